//! The stage that traces shadow rays.

use std::num::Wrapping;

use super::queue::PathQueue;
use super::shadow_queue::{ShadowAnyHit, ShadowQueue};
use super::wave::{StageClock, Wave};
use crate::bvh::{self, Coherence};
use crate::film::Film;
use crate::integrator::path::light_groups::GroupLight;
use crate::integrator::path::shadow::{ShadowRay, connect};
use crate::integrator::path::unpack_pixel;
use crate::integrator::transport::path_tracing::limited;
use crate::integrator::transport::transparent_shadow::arriving;
use crate::integrator::{RenderSetup, Stage};
use crate::math::{Color, NONE, Rgb};
use crate::scene::bodies::Body;
use crate::simd::{Isa, Kernel, Lanes, dispatch};
use crate::world::Transport;

impl Wave {
    /// Traces the shadow queue and adds the contributions, in the queue's order; those of light groups to the film, or,
    /// without one, to what is found by group.
    pub(super) fn shadows(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        film: Option<&mut Film>,
        clock: &mut StageClock,
    ) {
        let count = self.shadow.count();
        self.shadow.passes.iter_mut().take(count).for_each(|passes| *passes.get_mut() = false);
        let surfaces = ShadowAnyHit { setup, paths: &self.paths, shadow: &self.shadow };
        let rays = self.shadow.rays(&self.ends, &surfaces);
        let (bvh, occluded) = (&setup.scene.bvh, &mut self.occluded[..count]);
        bvh::any(self.traversal.unwrap_or(isa), bvh, rays, Coherence::Unknown, &mut self.stack, occluded);
        self.weaken(setup, isa, count);
        match film {
            _ if setup.light_groups() == 0 && !setup.catches => {}
            Some(film) => {
                let Self { shadow, paths, occluded, .. } = &*self;
                let groups = &setup.scene.emitters.group;
                dispatch(isa, GroupStage { groups, shadow, paths, occluded: &occluded[..count], film });
            }
            None => self.find_by_group(setup, count),
        }
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
        clock.stage(Stage::Shadow, count);
    }

    /// Adds the contributions of unblocked rays to the light that is found by group. Photons' rays, which go to the
    /// camera, end at no emitter.
    fn find_by_group(&mut self, setup: &RenderSetup, count: usize) {
        let (groups, Self { found, shadow, paths, occluded, .. }) = (&setup.scene.emitters.group[..], self);
        let ([r, g, b], targets) = shadow.contributions();
        let (pixels, samples) = paths.pixels();
        found.kept.reserve(count);
        for i in (0..count).filter(|i| occluded[*i] == 0) {
            let group = shadow.group(i, groups);
            if group != NONE {
                let (target, light) = (targets[i] as usize, Rgb::new(r[i], g[i], b[i]));
                found.kept.push(GroupLight { pixel: pixels[target], sample: samples[target], group, light });
            }
        }
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
                let [emitter, bodies, path_group] = [self.shadow.emitter(i), bodies, NONE].map(Wrapping);
                let ray = self.shadow.ray(i);
                let shadow = ShadowRay { ray, contribution, emitter, path_group, bodies, mask: true };
                arriving(setup, isa, &path, &shadow, &mut self.stack).unwrap_or(Color::black())
            } else {
                limited(setup, &path, contribution)
            };
            self.shadow.bring(i, left);
        }
    }
}

/// Adds the contributions of unblocked rays to light groups.
struct GroupStage<'a> {
    /// The group of each emitter.
    groups: &'a [u32],
    shadow: &'a ShadowQueue,
    paths: &'a PathQueue,
    occluded: &'a [u32],
    film: &'a mut Film,
}

impl Kernel for GroupStage<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let GroupStage { groups, shadow, paths, occluded, film } = self;
        let (contributions, targets) = shadow.contributions();
        let (pixels, samples) = paths.pixels();
        let contributions = contributions.map(|channel| &channel[..occluded.len()]);
        let of = |i: usize| {
            if occluded[i] != 0 {
                return None;
            }
            let group = shadow.group(i, groups);
            let target = targets[i] as usize;
            (group != NONE).then(|| [pixels[target], samples[target], group])
        };
        film.add_each_to_group(contributions, of, unpack_pixel);
    }
}
