//! Light samples from where paths are scattered within bodies.

use super::Frame;
use super::ends::is_last;
use super::medium;
use super::mis::{choose, heuristic};
use super::path::Path;
use super::shadow::ShadowRay;
use crate::math::{NONE, Ray};
use crate::sampling::SampleKey;
use crate::shading::boundary::is_lit;
use crate::shading::emitter::{self, SHADOW_END};
use crate::simd::{Float, Int, Mask, Outlined};

/// Light on paths that are scattered within bodies whose boundary lets it in unbent.
pub struct LitWithin<'a, F: Float> {
    /// The scene.
    pub frame: &'a Frame,
    /// The path, with the throughput that is left there.
    pub path: &'a Path<F>,
    /// How far it gets.
    pub flight: &'a medium::Flight<F>,
    /// Its random numbers.
    pub key: SampleKey<F::Int>,
}

/// A ray to a point of a light.
pub struct Lit<F: Float> {
    /// The light, or [`NONE`].
    pub emitter: F::Int,
    /// The weight of finding the light this way.
    pub share: F,
    /// The ray.
    pub shadow: ShadowRay<F>,
}

impl<F: Float> Outlined for LitWithin<'_, F> {
    type Output = Lit<F>;
    #[inline(always)]
    fn run(self) -> Lit<F> {
        let Self { frame, path, flight, key } = self;
        let (scene, zero) = (&frame.scene, F::zero());
        let none = F::Int::splat(NONE);
        let mask = is_lit(&scene.bodies, path.bodies, flight.scattered & !is_last(frame, path));
        if scene.emitters.is_empty() || !mask.any() {
            return Lit { emitter: none, share: F::one(), shadow: ShadowRay::none() };
        }
        let origin = path.origin + path.direction * flight.t;
        let (emitter, chance, u) = choose(frame, origin, none, (path.depth, key), mask);
        let sample = emitter::sample(scene, emitter, origin, u, mask);
        let phase = medium::phase(frame, path.bodies, path.direction.dot(sample.direction), mask);
        let density = sample.pdf * chance;
        let share = F::select(sample.shared, heuristic(density, phase), F::one());
        let light = sample.radiance * (phase * share / density.max(F::splat(1e-30)));
        let contribution = path.throughput * light;
        let t_max = sample.distance * F::splat(SHADOW_END);
        let shadow = ShadowRay {
            ray: Ray { origin, direction: sample.direction, t_min: zero, t_max },
            contribution,
            emitter,
            bodies: path.bodies,
            mask: mask & density.gt(zero) & contribution.max_component().gt(zero),
        };
        Lit { emitter, share, shadow }
    }
}
