//! Shadow rays: their queue, and the stage that traces it.

use std::sync::atomic::{AtomicBool, Ordering};

use super::queue::{Columns, PathQueue, RayLimits};
use super::{StageClock, Wave};
use crate::bvh::{self, AnyHitFilter, Coherence, Crossing, HitPredicate, Rays};
use crate::integrator::any_hit::{LightRay, PathRay, culling};
use crate::integrator::path_tracing::limited;
use crate::integrator::shadow::{ShadowRay, connect};
use crate::integrator::transparent_shadow::arriving;
use crate::integrator::{RenderSetup, Stage};
use crate::math::{Color, NONE, Ray, Vector};
use crate::scene::MaterialRecord;
use crate::scene::bodies::{Body, NOWHERE};
use crate::simd::{Float, Isa};
use crate::world::Transport;

/// Bytes of a shadow ray.
pub const SHADOW_BYTES: usize = Columns::<10, 1>::ITEM + 2 * Columns::<0, 1>::ITEM;

/// A queue of shadow rays.
pub struct ShadowQueue {
    /// Origin, direction, end, contribution; the hit that each ray is for.
    rays: Columns<10, 1>,
    /// The emitters at their ends, if some can be hit.
    emitters: Option<Columns<0, 1>>,
    /// The bodies in which they begin, if these affect what arrives.
    bodies: Option<Columns<0, 1>>,
    /// True for each ray that goes straight through something; empty if no material lets rays through.
    passes: Vec<AtomicBool>,
}

impl ShadowQueue {
    /// Creates a queue with room for `capacity` rays.
    pub fn new(setup: &RenderSetup, capacity: usize) -> Self {
        let any = |is: fn(&MaterialRecord) -> bool| {
            setup.transport == Transport::Path && setup.scene.materials.iter().any(is)
        };
        let passes = if any(|material| material.passes_shadow_rays) { capacity } else { 0 };
        Self {
            rays: Columns::new(capacity),
            emitters: setup.scene.emitters.can_be_hit().then(|| Columns::new(capacity)),
            bodies: (any(|m| m.body != 0) && any(|m| m.attenuates() || m.passes_shadow_rays))
                .then(|| Columns::new(capacity)),
            passes: (0..passes).map(|_| AtomicBool::new(false)).collect(),
        }
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        let optional = [&self.emitters, &self.bodies].into_iter().flatten().map(Columns::bytes);
        self.rays.bytes() + optional.sum::<usize>() + self.passes.len()
    }

    /// The number of rays.
    pub fn count(&self) -> usize {
        self.rays.len()
    }

    /// The number of rays that fit in all.
    pub fn capacity(&self) -> usize {
        self.rays.capacity()
    }

    /// The number of further rays that fit.
    pub fn room(&self) -> usize {
        self.rays.room()
    }

    /// Removes all rays.
    fn clear(&mut self) {
        self.rays.clear();
        self.emitters.iter_mut().chain(&mut self.bodies).for_each(Columns::clear);
    }

    /// Appends rays.
    #[inline(always)]
    pub fn append<F: Float>(&mut self, shadow: &ShadowRay<F>, target: F::Int) {
        let ShadowRay { ray, contribution: c, emitter, bodies, mask } = *shadow;
        let Ray { origin: o, direction: d, t_max, .. } = ray;
        self.rays.append::<F>(mask, [o.x, o.y, o.z, d.x, d.y, d.z, t_max, c.r, c.g, c.b], [target]);
        if let Some(emitters) = &mut self.emitters {
            emitters.append::<F>(mask, [], [emitter]);
        }
        if let Some(column) = &mut self.bodies {
            column.append::<F>(mask, [], [bodies]);
        }
    }

    /// The rays, with a column of their beginnings.
    fn rays<'a>(&'a self, ends: &'a RayLimits, surfaces: &'a OfShadows) -> Rays<'a> {
        let column = |i: usize| self.rays.floats(i);
        Rays {
            origin: [0, 1, 2].map(column),
            direction: [3, 4, 5].map(column),
            t_min: ends.zero(self.count()),
            t_max: column(6),
            filter: AnyHitFilter::new(surfaces, 0).with_culling(culling(surfaces.setup, true)),
        }
    }

    /// The ray at a place.
    pub fn ray(&self, i: usize) -> Ray<f32> {
        let vector = |column: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| self.rays.floats(column + axis)[i]);
            Vector::new(x, y, z)
        };
        Ray { origin: vector(0), direction: vector(3), t_min: 0.0, t_max: self.rays.floats(6)[i] }
    }

    /// The hit that a ray is for.
    fn target(&self, i: usize) -> usize {
        self.rays.integers(0)[i] as usize
    }

    /// The emitter at a ray's end, or [`NONE`] if none can be hit.
    fn emitter(&self, i: usize) -> u32 {
        self.emitters.as_ref().map_or(NONE, |emitters| emitters.integers(0)[i])
    }

    /// The bodies in which a ray begins.
    fn bodies(&self, i: usize) -> u32 {
        self.bodies.as_ref().map_or(NOWHERE, |bodies| bodies.integers(0)[i])
    }

    /// The contributions of the rays, and the hits that they are for.
    pub fn contributions(&self) -> ([&[f32]; 3], &[u32]) {
        ([7, 8, 9].map(|i| self.rays.floats(i)), self.rays.integers(0))
    }

    /// Sets the contribution of a ray.
    fn bring(&mut self, i: usize, contribution: Color<f32>) {
        let Color { r, g, b } = contribution;
        for (column, value) in [7, 8, 9].into_iter().zip([r, g, b]) {
            self.rays.floats_mut(column)[i] = value;
        }
    }
}

/// The any-hit filter of shadow rays.
struct OfShadows<'a> {
    setup: &'a RenderSetup,
    /// The paths from which the rays come.
    paths: &'a PathQueue,
    shadow: &'a ShadowQueue,
}

impl HitPredicate for OfShadows<'_> {
    fn accepts(&self, ray: usize, crossing: &Crossing) -> bool {
        let path = || self.paths.load(self.shadow.target(ray));
        let passes = |_: &Crossing| {
            if let Some(passes) = self.shadow.passes.get(ray) {
                passes.store(true, Ordering::Relaxed);
            }
        };
        let shadow =
            LightRay { ray: self.shadow.ray(ray), emitter: self.shadow.emitter(ray), passes: &passes };
        PathRay { setup: self.setup, path: &path, shadow: Some(shadow) }.meets(crossing)
    }
}

impl Wave {
    /// Traces the shadow queue and adds the contributions, in the queue's order.
    pub(super) fn shadows(&mut self, setup: &RenderSetup, isa: Isa, clock: &mut StageClock) {
        let count = self.shadow.count();
        self.shadow.passes.iter_mut().take(count).for_each(|passes| *passes.get_mut() = false);
        let surfaces = OfShadows { setup, paths: &self.paths, shadow: &self.shadow };
        let rays = self.shadow.rays(&self.ends, &surfaces);
        let (bvh, occluded) = (&setup.scene.bvh, &mut self.occluded[..count]);
        bvh::any(isa, bvh, rays, Coherence::Unknown, &mut self.stack, occluded);
        self.weaken(setup, isa, count);
        let ([r, g, b], targets) = self.shadow.contributions();
        let [to_r, to_g, to_b] = self.paths.radiance_mut();
        for i in 0..count {
            if self.occluded[i] == 0 {
                let to = targets[i] as usize;
                let so_far = Color::new(to_r[to], to_g[to], to_b[to]);
                let sum = connect(so_far, Color::new(r[i], g[i], b[i]));
                (to_r[to], to_g[to], to_b[to]) = (sum.r, sum.g, sum.b);
            }
        }
        clock.statistics.rays.shadow += count as u64;
        self.report_shadows(setup, isa, clock.observer);
        self.shadow.clear();
        clock.stage(Stage::Shadow);
    }

    /// Attenuates the contributions of unblocked rays by the surfaces that they go straight through, and in the bodies
    /// where they begin; clamps them.
    fn weaken(&mut self, setup: &RenderSetup, isa: Isa, count: usize) {
        let clamps = setup.transport == Transport::Path && setup.clamp.is_some();
        if self.shadow.bodies.is_none() && self.shadow.passes.is_empty() && !clamps {
            return;
        }
        for i in (0..count).filter(|i| self.occluded[*i] == 0) {
            let bodies = self.shadow.bodies(i);
            let passes = self.shadow.passes.get_mut(i).is_some_and(|passes| *passes.get_mut());
            let attenuates = |body: &Body| setup.scene.materials[body.material as usize].attenuates();
            let is_weakened = passes || setup.scene.bodies.filling(bodies).is_some_and(attenuates);
            if !is_weakened && !clamps {
                continue;
            }
            let path = self.paths.load::<f32>(self.shadow.target(i));
            let [r, g, b] = self.shadow.contributions().0.map(|channel| channel[i]);
            let contribution = Color::new(r, g, b);
            let left = if is_weakened {
                let [emitter, bodies] = [self.shadow.emitter(i), bodies].map(std::num::Wrapping);
                let shadow = ShadowRay { ray: self.shadow.ray(i), contribution, emitter, bodies, mask: true };
                let (stack, room) = (&mut self.stack, &mut self.crossings);
                arriving(setup, isa, &path, &shadow, stack, room).unwrap_or(Color::black())
            } else {
                limited(setup, &path, contribution)
            };
            self.shadow.bring(i, left);
        }
    }
}
