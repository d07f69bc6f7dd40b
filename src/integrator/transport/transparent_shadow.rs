//! The light along shadow rays that go straight through surfaces: thin smooth sheets, and the boundaries of bodies that
//! refract like their surroundings, such as fog.
//!
//! Traversal kernels only report which rays are unblocked. Such a ray is traced once more, by itself, to collect its
//! crossings, sorted by (t, primitive, instance), so the result does not depend on the caller.

use std::cell::RefCell;

use super::medium::attenuated;
use super::path_tracing::{bsdf, limited};
use crate::bvh::{AnyHitFilter, Crossing, Stack, any_ray};
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::any_hit::{LightRay, PathRay, culling};
use crate::integrator::path::shadow::ShadowRay;
use crate::math::Color;
use crate::shading::boundary::{BodyPair, Boundary};
use crate::shading::emitter::SHADOW_END;
use crate::shading::surface::material_of;
use crate::shading::{HitLanes, ShadingPoint, Surface};
use crate::simd::Isa;

thread_local! {
    /// The crossings of the ray that the thread traces. Any-hit filters must be shareable between threads, so that a
    /// buffer of the caller would need a lock for each crossing.
    static CROSSINGS: RefCell<Vec<Crossing>> = const { RefCell::new(Vec::new()) };
}

/// Returns what a path's light sample adds to its radiance; none if the ray is blocked.
pub fn arriving(
    setup: &RenderSetup,
    isa: Isa,
    path: &Path<f32>,
    shadow: &ShadowRay<f32>,
    stack: &mut Stack,
) -> Option<Color<f32>> {
    CROSSINGS.with_borrow_mut(Vec::clear);
    let passes = |crossing: &Crossing| CROSSINGS.with_borrow_mut(|all| all.push(*crossing));
    let to_light = LightRay { ray: shadow.ray, emitter: shadow.emitter.0, passes: &passes };
    let traced = PathRay { setup, path: &|| *path, shadow: Some(to_light) };
    if any_ray(
        isa,
        &setup.scene.bvh,
        &shadow.ray,
        AnyHitFilter::new(&traced, 0).with_culling(culling(setup, true)),
        stack,
    ) {
        return None;
    }
    let light = CROSSINGS.with_borrow_mut(|all| left(setup, path, shadow, in_order(all)));
    light.map(|light| limited(setup, path, light))
}

/// The crossings from the ray's origin to its end, each once: a split triangle may be met in several leaves.
fn in_order(crossed: &mut Vec<Crossing>) -> &[Crossing] {
    let which = |crossing: &Crossing| (crossing.hit.primitive, crossing.hit.instance, crossing.front);
    let by_t = |a: &Crossing, b: &Crossing| a.hit.t.total_cmp(&b.hit.t);
    crossed.sort_by(|a, b| which(a).cmp(&which(b)).then(by_t(a, b)));
    crossed.dedup_by_key(|crossing| which(crossing));
    crossed.sort_by(by_t);
    crossed
}

/// The light that is left behind all crossings and the bodies in between; none if a surface bends it because of the
/// body that it lies in.
fn left(
    setup: &RenderSetup,
    path: &Path<f32>,
    shadow: &ShadowRay<f32>,
    crossed: &[Crossing],
) -> Option<Color<f32>> {
    let (scene, ShadowRay { ray, contribution, .. }) = (&setup.scene, shadow);
    let (mut light, mut bodies, mut begin) = (*contribution, shadow.bodies, 0.0);
    for Crossing { hit, .. } in crossed {
        let lane = HitLanes::one(hit);
        let material = material_of(&scene.geometry, &lane, true).0;
        let surface = Surface::new(&scene.geometry, ray, &lane, true);
        let point = ShadingPoint::new(scene, material, &lane, &surface, ray.direction, 0.0, true);
        light = attenuated(setup, light, bodies, hit.t - begin, true);
        let between = BodyPair::of(point.material);
        let boundary = Boundary::<f32>::new(&scene.bodies, bodies, &between, surface.inside, true);
        if !boundary.gone {
            if !boundary.is_straight(point.material) {
                return None;
            }
            let key = path.path_key(setup.seed);
            light = light * bsdf(point.has(), setup, path, &point, &boundary.outside, key, true).straight();
        }
        bodies = boundary.beyond(true);
        begin = hit.t;
    }
    Some(attenuated(setup, light, bodies, ray.t_max / SHADOW_END - begin, true))
}
