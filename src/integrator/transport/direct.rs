//! Direct lighting under the path transport: one light is sampled at each vertex.

use super::medium;
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::light_groups::group_of_sample;
use crate::integrator::path::mis::{choose, power_heuristic};
use crate::integrator::path::shadow::ShadowRay;
use crate::math::{Color, NONE, Ray};
use crate::sampling::SampleKey;
use crate::scene::emitters::kind;
use crate::shading::Surface;
use crate::shading::boundary::Boundary;
use crate::shading::emitter::{self, EmitterSample, SHADOW_END};
use crate::shading::packed_normal::packed_normal;
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::surface::offset_origin;
use crate::simd::{Float, Int, Mask};

/// The facing of a surface, for choosing lights.
#[inline(always)]
pub(in crate::integrator) fn faces<F: Float>(
    setup: &RenderSetup,
    surface: &Surface<F>,
    bsdf: &Bsdf<F>,
) -> F::Int {
    if setup.scene.emitters.len() < 2 {
        return F::Int::splat(NONE);
    }
    packed_normal(surface.geometric_normal, bsdf.lets_through())
}

/// A sampled point of a light.
pub(in crate::integrator) struct LightPoint<F: Float> {
    /// The emitter.
    pub emitter: F::Int,
    /// Probability of the emitter times density of the point.
    density: F,
    /// The MIS weight of the light sample.
    pub share: F,
    /// BSDF value · |cos| towards it.
    value: Color<F>,
    pub sample: EmitterSample<F>,
}

/// Chooses a light and a point on it, in lanes that are `caught` by a shadow catcher or not.
#[inline(always)]
pub(in crate::integrator) fn sampled_light<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    surface: &Surface<F>,
    bsdf: &Bsdf<F>,
    key: SampleKey<F::Int>,
    [mask, caught]: [F::Mask; 2],
) -> LightPoint<F> {
    let scene = &setup.scene;
    // The origin of drawn directions, too: on a light itself the difference matters.
    let position = surface.position + surface.geometric_normal * surface.offset;
    let packed_normal = faces(setup, surface, bsdf);
    let (emitter, chance, u) = choose(setup, position, packed_normal, (path.depth, key), mask);
    let sample = emitter::sample(scene, emitter, position, u, mask);
    let (value, own) = bsdf.evaluate(sample.direction, mask);
    let density = sample.pdf * chance;
    // At shadow catchers light samples alone find lamps: what they would bring without other things is then known without
    // tracing another ray.
    let mut is_alone = caught;
    if caught.any() {
        let what = F::Int::gather(&scene.emitters.kinds, emitter, caught);
        is_alone = caught & !what.eq(F::Int::splat(kind::ENVIRONMENT));
    }
    let is_divided = sample.can_be_hit & !is_alone;
    let share = F::select(is_divided, power_heuristic(density, own), F::one());
    LightPoint { emitter, density, share, value, sample }
}

/// The shadow ray to a point of a light in the lanes `here`, `caught` by a shadow catcher or not, and the BSDF value ·
/// |cos| towards it.
#[inline(always)]
pub(in crate::integrator) fn to_light<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    bsdf: &Bsdf<F>,
    key: SampleKey<F::Int>,
    [here, caught]: [F::Mask; 2],
) -> (ShadowRay<F>, Color<F>) {
    let scene = &setup.scene;
    let mask = here & bsdf.scatters();
    if scene.emitters.is_empty() || !mask.any() {
        return (ShadowRay::none(), Color::black());
    }
    let zero = F::zero();
    let LightPoint { emitter, density, share, value, sample } =
        sampled_light(setup, path, surface, bsdf, key, [mask, caught]);
    let light = value * sample.radiance * (share / density.max(F::splat(1e-30)));
    let through = sample.direction.dot(surface.geometric_normal).lt(zero);
    let bodies = boundary.beyond(through);
    // Infinitely distant lights are in no body, however open it is.
    let somewhere = mask & sample.distance.lt(F::splat(f32::INFINITY));
    let contribution = medium::emitted(setup, bodies, path.throughput * light, somewhere);
    let origin = offset_origin(surface.position, surface.geometric_normal, surface.offset, sample.direction);
    let shadow = ShadowRay {
        ray: Ray {
            origin,
            direction: sample.direction,
            t_min: zero,
            t_max: sample.distance * F::splat(SHADOW_END),
        },
        contribution,
        emitter,
        path_group: group_of_sample(setup, path, caught),
        bodies,
        mask: mask & density.gt(zero) & contribution.max_component().gt(zero),
    };
    (shadow, value)
}
