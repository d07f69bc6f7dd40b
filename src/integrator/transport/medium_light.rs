//! Light samples at points where paths are scattered within bodies.

use super::medium;
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::light_groups::group_of_sample;
use crate::integrator::path::mis::{choose, power_heuristic};
use crate::integrator::path::shadow::ShadowRay;
use crate::integrator::path::termination::is_last;
use crate::math::{NONE, Ray};
use crate::sampling::SampleKey;
use crate::shading::boundary::is_lit;
use crate::shading::emitter::{self, SHADOW_END};
use crate::simd::{Float, Int, Mask, Outlined};

/// The light sample of paths that are scattered within bodies whose boundary lets light in unbent.
pub struct MediumLightSample<'a, F: Float> {
    /// The render setup.
    pub setup: &'a RenderSetup,
    /// The path, with its throughput at that point.
    pub path: &'a Path<F>,
    /// The free flight that ends there.
    pub flight: &'a medium::FreeFlight<F>,
    /// The key of its random numbers.
    pub key: SampleKey<F::Int>,
}

/// A shadow ray to a point of a light.
pub struct MediumLight<F: Float> {
    /// The emitter, or [`NONE`].
    pub emitter: F::Int,
    /// The MIS weight of the light sample.
    pub share: F,
    /// The ray.
    pub shadow: ShadowRay<F>,
}

impl<F: Float> Outlined for MediumLightSample<'_, F> {
    type Output = MediumLight<F>;
    #[inline(always)]
    fn run(self) -> MediumLight<F> {
        let Self { setup, path, flight, key } = self;
        let (scene, zero) = (&setup.scene, F::zero());
        let none = F::Int::splat(NONE);
        let mask = is_lit(&scene.bodies, path.bodies, flight.scattered & !is_last(setup, path));
        if scene.emitters.is_empty() || !mask.any() {
            return MediumLight { emitter: none, share: F::one(), shadow: ShadowRay::none() };
        }
        let origin = path.origin + path.direction * flight.t;
        let (emitter, chance, u) = choose(setup, origin, none, (path.depth, key), mask);
        let sample = emitter::sample(scene, emitter, origin, u, mask);
        let phase = medium::phase(setup, path.bodies, path.direction.dot(sample.direction), mask);
        let density = sample.pdf * chance;
        let share = F::select(sample.can_be_hit, power_heuristic(density, phase), F::one());
        let light = sample.radiance * (phase * share / density.max(F::splat(1e-30)));
        let contribution = path.throughput * light;
        let t_max = sample.distance * F::splat(SHADOW_END);
        let shadow = ShadowRay {
            ray: Ray { origin, direction: sample.direction, t_min: zero, t_max },
            contribution,
            emitter,
            path_group: group_of_sample(setup, path, F::Mask::from_bits(0)),
            bodies: path.bodies,
            mask: mask & density.gt(zero) & contribution.max_component().gt(zero),
        };
        MediumLight { emitter, share, shadow }
    }
}
