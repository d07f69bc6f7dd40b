//! The queue of shadow rays.

use std::sync::atomic::{AtomicBool, Ordering};

use super::queue::{PathQueue, RayLimits};
use crate::bvh::{AnyHitFilter, Crossing, HitPredicate, Rays};
use crate::integrator::RenderSetup;
use crate::integrator::path::any_hit::{LightRay, PathRay, culling};
use crate::integrator::path::columns::Columns;
use crate::integrator::path::shadow::ShadowRay;
use crate::math::{Color, NONE, Ray, Vector};
use crate::scene::MaterialRecord;
use crate::scene::bodies::NOWHERE;
use crate::simd::Float;
use crate::world::Transport;

/// Bytes of a shadow ray.
pub const SHADOW_BYTES: usize = Columns::<10, 1>::ITEM + 3 * Columns::<0, 1>::ITEM;

/// A queue of shadow rays.
pub struct ShadowQueue {
    /// Origin, direction, end, contribution; the hit that each ray is for.
    rays: Columns<10, 1>,
    /// The emitters at their ends, if some can be hit or there are light groups.
    emitters: Option<Columns<0, 1>>,
    /// The groups that count their light, if paths choose them.
    path_groups: Option<Columns<0, 1>>,
    /// The bodies in which they begin, if these affect what arrives.
    pub(super) bodies: Option<Columns<0, 1>>,
    /// True for each ray that goes straight through something; empty if no material lets rays through.
    pub(super) passes: Vec<AtomicBool>,
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
            emitters: (setup.scene.emitters.can_be_hit() || setup.light_groups() > 0)
                .then(|| Columns::new(capacity)),
            path_groups: setup.groups_by_path().then(|| Columns::new(capacity)),
            bodies: (any(|m| m.body != 0) && any(|m| m.attenuates() || m.passes_shadow_rays))
                .then(|| Columns::new(capacity)),
            passes: (0..passes).map(|_| AtomicBool::new(false)).collect(),
        }
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        let optional =
            [&self.emitters, &self.path_groups, &self.bodies].into_iter().flatten().map(Columns::bytes);
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
    pub(super) fn clear(&mut self) {
        self.rays.clear();
        let optional = [&mut self.emitters, &mut self.path_groups, &mut self.bodies];
        optional.into_iter().flatten().for_each(Columns::clear);
    }

    /// Appends rays.
    #[inline(always)]
    pub fn append<F: Float>(&mut self, shadow: &ShadowRay<F>, target: F::Int) {
        let ShadowRay { ray, contribution: c, emitter, path_group, bodies, mask } = *shadow;
        let Ray { origin: o, direction: d, t_max, .. } = ray;
        self.rays.append::<F>(mask, [o.x, o.y, o.z, d.x, d.y, d.z, t_max, c.r, c.g, c.b], [target]);
        if let Some(emitters) = &mut self.emitters {
            emitters.append::<F>(mask, [], [emitter]);
        }
        if let Some(groups) = &mut self.path_groups {
            groups.append::<F>(mask, [], [path_group]);
        }
        if let Some(column) = &mut self.bodies {
            column.append::<F>(mask, [], [bodies]);
        }
    }

    /// The rays, with a column of their beginnings.
    pub(super) fn rays<'a>(&'a self, ends: &'a RayLimits, surfaces: &'a ShadowAnyHit) -> Rays<'a> {
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
    pub(super) fn target(&self, i: usize) -> usize {
        self.rays.integers(0)[i] as usize
    }

    /// The emitter at a ray's end, or [`NONE`] if none can be hit.
    pub(super) fn emitter(&self, i: usize) -> u32 {
        self.emitters.as_ref().map_or(NONE, |emitters| emitters.integers(0)[i])
    }

    /// The group that counts a ray's light, or [`NONE`]: its emitter's, or the one that its path chose.
    pub(super) fn group(&self, i: usize, of_emitters: &[u32]) -> u32 {
        match &self.path_groups {
            Some(groups) => groups.integers(0)[i],
            None => of_emitters.get(self.emitter(i) as usize).copied().unwrap_or(NONE),
        }
    }

    /// The bodies in which a ray begins.
    pub(super) fn bodies(&self, i: usize) -> u32 {
        self.bodies.as_ref().map_or(NOWHERE, |bodies| bodies.integers(0)[i])
    }

    /// The contributions of the rays, and the hits that they are for.
    pub fn contributions(&self) -> ([&[f32]; 3], &[u32]) {
        ([7, 8, 9].map(|i| self.rays.floats(i)), self.rays.integers(0))
    }

    /// Sets the contribution of a ray.
    pub(super) fn bring(&mut self, i: usize, contribution: Color<f32>) {
        let Color { r, g, b } = contribution;
        for (column, value) in [7, 8, 9].into_iter().zip([r, g, b]) {
            self.rays.floats_mut(column)[i] = value;
        }
    }
}

/// The any-hit filter of shadow rays.
pub(super) struct ShadowAnyHit<'a> {
    pub setup: &'a RenderSetup,
    /// The paths from which the rays come.
    pub paths: &'a PathQueue,
    pub shadow: &'a ShadowQueue,
}

impl HitPredicate for ShadowAnyHit<'_> {
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
