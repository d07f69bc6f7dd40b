//! From a light and a point to the light's direction and irradiance there.

use crate::math::{Color, Vector};
use crate::sampling::pattern::{Grid, point_of_many};
use crate::sampling::{Dimension, Key};
use crate::scene::Light;
use crate::simd::Float;

/// One point of a light as seen from a surface.
#[derive(Clone, Copy)]
pub struct LightSample<F: Float> {
    /// Unit vector to it.
    pub direction: Vector<F>,
    /// How far it is; infinite for parallel light.
    pub distance: F,
    /// What it would send to a surface across `direction`, W m⁻².
    pub irradiance: Color<F>,
}

/// Shadow rays end before their light by this part of the way, so that a light's own surface
/// is not in it.
pub const SHADOW_END: f32 = 1.0 - 1.0 / 8192.0;

/// Sample `which` of a light, seen from a point. `bounce` and `key` say which random numbers,
/// `light_index` which light, `pixel` how many samples its pixel has.
#[inline(always)]
pub fn sample_light<F: Float>(
    light: &Light,
    light_index: u32,
    which: u32,
    pixel: Grid,
    key: Key<F::Int>,
    bounce: F::Int,
    position: Vector<F>,
) -> LightSample<F> {
    match light {
        Light::Directional { to_light, irradiance } => LightSample {
            direction: Vector::splat(*to_light),
            distance: F::splat(f32::INFINITY),
            irradiance: Color::splat(*irradiance),
        },
        Light::Point { position: place, intensity, falloff } => {
            towards(Vector::splat(*place) - position, Color::splat(*intensity), *falloff)
        }
        Light::Spot { position: place, intensity, falloff, axis, cos_outer, scale } => {
            let sample = towards(Vector::splat(*place) - position, Color::splat(*intensity), *falloff);
            let cos = -sample.direction.dot(Vector::splat(*axis));
            // The square makes the edge soft on the dark side (KHR_lights_punctual).
            let inside = ((cos - F::splat(*cos_outer)) * F::splat(*scale)).clamp(0.0, 1.0);
            LightSample { irradiance: sample.irradiance * (inside * inside), ..sample }
        }
        Light::Area { corner, edge_u, edge_v, normal, intensity, grid, pattern, .. } => {
            let key = key.fork(light_index.wrapping_mul(0x9e37) ^ 0x51ed);
            let dimension = Dimension::Light.at(bounce);
            let (u, v) = point_of_many::<F>(*pattern, *grid, which, pixel, key, dimension);
            let place = Vector::splat(*corner) + Vector::splat(*edge_u) * u + Vector::splat(*edge_v) * v;
            let sample = towards(place - position, Color::splat(*intensity), true);
            // E of a small Lambertian emitter: L A cos θ / d².
            let cos = (-sample.direction.dot(Vector::splat(*normal))).max(F::zero());
            LightSample { irradiance: sample.irradiance * cos, ..sample }
        }
    }
}

/// Light from one point at the end of `way`.
#[inline(always)]
fn towards<F: Float>(way: Vector<F>, intensity: Color<F>, falloff: bool) -> LightSample<F> {
    let square = way.dot(way).max(F::splat(1e-30));
    let distance = square.sqrt();
    let irradiance = if falloff { intensity * (F::one() / square) } else { intensity };
    LightSample { direction: way * (F::one() / distance), distance, irradiance }
}
