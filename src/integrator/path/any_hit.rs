//! The any-hit filter of paths, called during traversal: it rejects surfaces that are cut out or blended away and, for
//! rays to lights, those that light passes straight through and the light's own surface.

use std::num::Wrapping;

use super::Path;
use crate::bvh::{Crossing, FaceCulling, HitPredicate};
use crate::integrator::RenderSetup;
use crate::math::{Hit, NONE, Ray, Vector};
use crate::sampling::draw::draw_1d;
use crate::sampling::hash::combine;
use crate::sampling::{Dimension, SampleKey};
use crate::scene::MaterialRecord;
use crate::scene::material::Coverage;
use crate::shading::crossing::{coverage_at, crossed};
use crate::shading::{HitLanes, emitter};
use crate::world::Transport;

/// A ray of a path as the any-hit filter sees it.
pub struct PathRay<'a> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The path whose random numbers the ray draws: called only at surfaces with partial coverage.
    pub path: &'a (dyn Fn() -> Path<f32> + Sync),
    /// The shadow ray, if the ray goes from the path's vertex to a light instead of along the path.
    pub shadow: Option<LightRay<'a>>,
}

/// A ray to a light.
#[derive(Clone, Copy)]
pub struct LightRay<'a> {
    /// The ray.
    pub ray: Ray<f32>,
    /// The emitter at its end, whose own surface does not block it.
    pub emitter: u32,
    /// Called for surfaces that the ray passes straight through, perhaps more than once for each.
    pub passes: &'a (dyn Fn(&Crossing) + Sync),
}

/// The face culling for the rays of a render. Photons travel backwards along camera paths, which meet a one-sided
/// surface where they arrive, at its front: there the photon arrives or leaves (`photons::trace`), so it meets both
/// sides. Its ray to the camera meets the sides that the camera's ray meets.
pub fn culling(setup: &RenderSetup, is_shadow: bool) -> FaceCulling {
    match (setup.follows_light, is_shadow) {
        (false, _) => FaceCulling::AsBuilt,
        (true, false) => FaceCulling::Off,
        (true, true) => FaceCulling::Opposite,
    }
}

impl PathRay<'_> {
    /// True if the ray hits the surface at a crossing. The result is always the same, as the random number belongs to
    /// the crossing.
    pub fn meets(&self, crossing: &Crossing) -> bool {
        let scene = &self.setup.scene;
        let Some(material) = crossed(scene, crossing, culling(self.setup, self.shadow.is_some())) else {
            return false;
        };
        if let Some(LightRay { emitter, .. }) = self.shadow
            && emitter != NONE
            && material.emits()
            && emitter::of_hit(scene, &HitLanes::one(&crossing.hit), true).0 == emitter
        {
            return false;
        }
        if material.coverage != Coverage::Whole && !self.is_covered(material, crossing) {
            return false;
        }
        match self.shadow {
            Some(LightRay { passes, .. }) if material.passes_shadow_rays => {
                passes(crossing);
                false
            }
            _ => true,
        }
    }

    /// True if a surface of partial coverage covers the crossing.
    fn is_covered(&self, material: &MaterialRecord, crossing: &Crossing) -> bool {
        let (setup, path) = (self.setup, (self.path)());
        let Hit { primitive, instance, .. } = crossing.hit;
        let ray = || self.shadow.map_or(path.ray(), |shadow| shadow.ray);
        let there = coverage_at(&setup.scene, material, crossing, ray);
        if material.coverage != Coverage::Blend {
            return there > 0.0;
        }
        let layer =
            combine(combine(Wrapping(primitive), Wrapping(instance)), Wrapping(crossing.front.into()));
        let dimension = if self.shadow.is_some() { Dimension::ShadowAlpha } else { Dimension::Alpha };
        let number: f32 =
            draw_1d(setup.sampler, setup.samples, self.key(&path).fork(layer.0), dimension.at(path.depth));
        there > number
    }

    /// The key of the ray's random numbers.
    fn key(&self, path: &Path<f32>) -> SampleKey<Wrapping<u32>> {
        let Self { setup, shadow, .. } = *self;
        match (setup.transport, shadow) {
            (Transport::Path, _) => path.path_key(setup.seed),
            (Transport::Whitted, None) => path.key(setup.seed),
            // A vertex has many shadow rays.
            (Transport::Whitted, Some(LightRay { ray, .. })) => {
                let Vector { x, y, z } = ray.direction;
                let which = [x, y, z].map(|c| Wrapping(c.to_bits())).into_iter().reduce(combine);
                path.key(setup.seed).fork(which.unwrap_or_default().0)
            }
        }
    }
}

impl HitPredicate for PathRay<'_> {
    fn accepts(&self, _: usize, crossing: &Crossing) -> bool {
        self.meets(crossing)
    }
}
