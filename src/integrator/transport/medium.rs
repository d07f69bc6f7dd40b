//! Light within bodies: brighter by the square of their index, absorbed and scattered, in homogeneous media (PBRT 4th
//! ed., 9.5.2, 11.1 and 14.1). A boundary that bends light hides lights from within, so paths find them by themselves;
//! through one that does not, shadow rays go straight.

use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{BLURRED, FREE_EVENT, FROM_CATCHER};
use crate::integrator::path::termination::{is_last, roulette};
use crate::math::elementary::{exp2, log2, sin_cos_turns};
use crate::math::{Color, NONE, Vector};
use crate::sampling::draw::draw_2d;
use crate::sampling::{Dimension, SampleKey};
use crate::scene::MaterialRecord;
use crate::scene::bodies::NOWHERE;
use crate::scene::material::Medium;
use crate::shading::boundary::is_lit;
use crate::shading::emitter;
use crate::shading::principled::shading_frame::ShadingFrame;
use crate::simd::{Float, Int, Mask, Outlined};

/// The largest number of a path's vertices that do not count as bounces, so that each path ends.
pub(in crate::integrator) const MOST: u32 = 4096;
/// Separates the random numbers for distances from those for directions.
const DISTANCE: u32 = 0x6d65_6469;

/// The free flight of a path's ray in the body that it is in.
pub struct FreeFlight<F: Float> {
    /// The path's throughput at its end.
    pub throughput: Color<F>,
    /// The lanes that are scattered before they reach the surface.
    pub scattered: F::Mask,
    /// The distance travelled.
    pub t: F,
}

/// Samples the free flight along a path's ray to a surface at distance `t`.
#[inline(always)]
pub fn free_flight<F: Float>(setup: &RenderSetup, path: &Path<F>, t: F, mask: F::Mask) -> FreeFlight<F> {
    let none = F::Mask::from_bits(0);
    let mut flight = FreeFlight { throughput: path.throughput, scattered: none, t };
    let mut todo = mask & !path.bodies.eq(F::Int::splat(NOWHERE));
    // Infinity times an extinction of zero would be NaN.
    let t = t.min(F::splat(f32::MAX));
    while todo.any() {
        let (MaterialRecord { medium, .. }, same) = first(setup, path.bodies, todo);
        todo = todo & !same;
        if medium.is_clear() {
            continue;
        }
        if medium.scatters() {
            let key = path.path_key(setup.seed).fork(DISTANCE);
            let u = draw_2d(setup.sampler, setup.samples, key, Dimension::Scatter.at(path.depth));
            let way = within(medium, path.throughput, t, u);
            flight.throughput = Color::select(same, way.throughput, flight.throughput);
            flight.t = F::select(same, way.t, flight.t);
            flight.scattered = flight.scattered | (same & way.scattered);
        } else {
            let left = path.throughput * transmittance(medium, t);
            flight.throughput = Color::select(same, left, flight.throughput);
        }
    }
    flight
}

/// The throughput after a distance `t` through a body, without the light that is scattered away.
#[inline(always)]
pub fn attenuated<F: Float>(
    setup: &RenderSetup,
    throughput: Color<F>,
    bodies: F::Int,
    t: F,
    mask: F::Mask,
) -> Color<F> {
    let mut throughput = throughput;
    let mut todo = mask & !bodies.eq(F::Int::splat(NOWHERE));
    let t = t.min(F::splat(f32::MAX));
    while todo.any() {
        let (body, same) = first(setup, bodies, todo);
        todo = todo & !same;
        if !body.medium.is_clear() {
            throughput = Color::select(same, throughput * transmittance(&body.medium, t), throughput);
        }
    }
    throughput
}

/// Scales light that a path finds and that is emitted within bodies. A path's throughput is that of light in the
/// camera's body: if light begins in another one, its radiance changes on the way with the squares of their indices
/// ([`MaterialRecord::index_square`]), so throughput need not change at each boundary.
#[inline(always)]
pub(in crate::integrator) fn emitted<F: Float>(
    setup: &RenderSetup,
    bodies: F::Int,
    light: Color<F>,
    mask: F::Mask,
) -> Color<F> {
    let within = mask & !bodies.eq(F::Int::splat(NOWHERE));
    if !within.any() {
        return light;
    }
    F::outlined(EmittedWithin { setup, bodies, light, within })
}

/// Light emitted within bodies; outlined because it is rare.
struct EmittedWithin<'a, F: Float> {
    setup: &'a RenderSetup,
    bodies: F::Int,
    light: Color<F>,
    within: F::Mask,
}

impl<F: Float> Outlined for EmittedWithin<'_, F> {
    type Output = Color<F>;
    #[inline(always)]
    fn run(self) -> Color<F> {
        let Self { setup, bodies, mut light, within: mut todo } = self;
        while todo.any() {
            let (body, same) = first(setup, bodies, todo);
            todo = todo & !same;
            let scale = 1.0 / body.index_square();
            light = Color::select(same, light * F::splat(scale), light);
        }
        light
    }
}

/// The material of the body that fills the first lane's place, and the lanes in the same body.
#[inline(always)]
fn first<I: Int>(setup: &RenderSetup, bodies: I, todo: I::Mask) -> (&MaterialRecord, I::Mask) {
    let scene = &setup.scene;
    let first = emitter::lane(bodies, todo);
    let top = scene.bodies.top_mask();
    let material = scene.bodies.filling(first).map_or(0, |body| body.material);
    (&scene.materials[material as usize], todo & (bodies & I::splat(top)).eq(I::splat(first & top)))
}

/// The transmittance e^(−σₜ t) (Beer and Lambert).
#[inline(always)]
fn transmittance<F: Float>(medium: &Medium, t: F) -> Color<F> {
    let [r, g, b] = medium.extinction;
    Color::new(decay(r, t), decay(g, t), decay(b, t))
}

#[inline(always)]
fn decay<F: Float>(extinction: f32, t: F) -> F {
    exp2(t * F::splat(-extinction * std::f32::consts::LOG2_E))
}

/// Samples a point in a medium, or the surface behind it, by the extinction of one colour; all colours are weighted by
/// the density with which any of them would have chosen it (one-sample balance heuristic, Veach 1997; PBRT 4th ed.,
/// 14.1.1 has it for a single one).
#[inline(always)]
fn within<F: Float>(medium: &Medium, throughput: Color<F>, t: F, (which, u): (F, F)) -> FreeFlight<F> {
    let (zero, one) = (F::zero(), F::one());
    let [r, g, b] = medium.extinction.map(F::splat);
    let chances = throughput * (one / (throughput.r + throughput.g + throughput.b).max(F::splat(1e-30)));
    let extinction = F::select(which.lt(chances.r), r, F::select(which.lt(chances.r + chances.g), g, b));
    // −ln(1 − u)/σ; a colour without extinction always reaches the surface.
    let distance = log2((one - u).max(F::splat(1e-9))) * F::splat(-std::f32::consts::LN_2)
        / extinction.max(F::splat(1e-30));
    let scattered = distance.lt(t);
    let t = F::select(scattered, distance, t);
    let left = transmittance(medium, t);
    let rates = Color::new(r, g, b);
    let densities = left * Color::select(scattered, rates, Color::grey(one)) * chances;
    let density = (densities.r + densities.g + densities.b).max(F::splat(1e-30));
    let [r, g, b] = medium.albedo.map(F::splat);
    let kept = Color::select(scattered, rates * Color::new(r, g, b), Color::grey(one));
    let throughput = throughput * left * kept * (one / density);
    let alive = !throughput.max_component().le(zero);
    FreeFlight { throughput: Color::select(alive, throughput, Color::black()), scattered, t }
}

/// Continues scattered paths; returns them and the lanes that go on. `path` has the throughput at the end of the
/// flight.
#[inline(always)]
pub fn scattered<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    flight: &FreeFlight<F>,
    key: SampleKey<F::Int>,
) -> (Path<F>, F::Mask) {
    let one = F::Int::splat(1);
    let u = draw_2d(setup.sampler, setup.samples, key, Dimension::Scatter.at(path.depth));
    let (direction, pdf) = turned(setup, path, flight, u);
    let again = path.scatterings.lt(F::Int::splat(MOST));
    let (throughput, survives) = roulette(setup, path, path.throughput, key, flight.scattered);
    let alive = throughput.max_component().gt(F::zero());
    let goes_on = flight.scattered & again & alive & survives & !is_last(setup, path);
    let next = Path {
        origin: path.origin + path.direction * flight.t,
        direction,
        throughput,
        radiance: Color::black(),
        depth: path.depth + one,
        scatterings: path.scatterings + one,
        bounce_counts: path.bounce_counts & F::Int::splat(!FROM_CATCHER)
            | F::Int::splat(FREE_EVENT | BLURRED),
        pdf,
        travelled: F::zero(),
        packed_normal: F::Int::splat(NONE),
        width: path.width + path.spread * flight.t,
        ..*path
    };
    (next, goes_on)
}

/// Draws a direction from the phase function of Henyey and Greenstein (1941; PBRT 4th ed., 11.3.1), in each lane with
/// the parameter of its body; returns it and its density, or 0 where there is no light sample to weight it against.
#[inline(always)]
fn turned<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    flight: &FreeFlight<F>,
    (u, turns): (F, F),
) -> (Vector<F>, F) {
    let (mut cos, mut pdf) = (F::one(), F::zero());
    let mut todo = flight.scattered;
    let lit = is_lit(&setup.scene.bodies, path.bodies, flight.scattered);
    while todo.any() {
        let (body, same) = first(setup, path.bodies, todo);
        todo = todo & !same;
        let g = body.medium.anisotropy;
        cos = F::select(same, cosine(g, u), cos);
        pdf = F::select(same & lit, henyey_greenstein(g, cos), pdf);
    }
    let sin = (F::one() - cos * cos).max(F::zero()).sqrt();
    let (y, x) = sin_cos_turns(turns);
    (ShadingFrame::about(path.direction).world(Vector::new(x * sin, y * sin, cos)).normalize(), pdf)
}

/// The phase function of each lane's body, per steradian, by the cosine between the directions of light before and
/// after: both the fraction that is scattered and the density with which it is drawn.
#[inline(always)]
pub(in crate::integrator) fn phase<F: Float>(
    setup: &RenderSetup,
    bodies: F::Int,
    cos: F,
    mask: F::Mask,
) -> F {
    let (mut value, mut todo) = (F::zero(), mask);
    while todo.any() {
        let (body, same) = first(setup, bodies, todo);
        todo = todo & !same;
        value = F::select(same, henyey_greenstein(body.medium.anisotropy, cos), value);
    }
    value
}

/// The Henyey-Greenstein phase function (1 − g²)/(4π (1 + g² − 2 g cos)^(3/2)).
#[inline(always)]
fn henyey_greenstein<F: Float>(g: f32, cos: F) -> F {
    const PER_SPHERE: f32 = 0.25 / std::f32::consts::PI;
    let square = (F::splat(1.0 + g * g) - F::splat(2.0 * g) * cos).max(F::splat(1e-12));
    F::splat((1.0 - g * g) * PER_SPHERE) / (square * square.sqrt())
}

/// Draws the cosine of the angle between light before and after scattering.
#[inline(always)]
fn cosine<F: Float>(g: f32, u: F) -> F {
    let (one, two) = (F::one(), F::splat(2.0));
    if g.abs() < 1e-3 {
        return one - two * u;
    }
    let (own, square) = (F::splat(g), F::splat(g * g));
    let ratio = F::splat(1.0 - g * g) / (one - own + two * own * u);
    ((one + square - ratio * ratio) / (two * own)).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_cosine_of_scattering_is_the_anisotropy() {
        for g in [-0.9, -0.3, 0.0, 0.0005, 0.5, 0.95] {
            let count = 100_000;
            let (mut mean, mut forwards) = (0.0f64, 0.0f64);
            for i in 0..count {
                let cos: f32 = cosine(g, (i as f32 + 0.5) / count as f32);
                mean += f64::from(cos) / f64::from(count);
                forwards += f64::from(u8::from(cos > 0.0)) / f64::from(count);
            }
            assert!((mean - f64::from(g)).abs() < 1e-3, "{g}: {mean}");
            // ∫ of the phase function over the forward hemisphere.
            if g.abs() > 1e-2 {
                let g = f64::from(g);
                let part = (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 - g) - 1.0 / (1.0 + g * g).sqrt());
                assert!((forwards - part).abs() < 1e-3, "{g}: {forwards}, not {part}");
            }
        }
    }

    #[test]
    fn directions_are_drawn_with_the_density_of_the_phase_function() {
        // ∫ 2π p dcos is the same between any two equally probable cosines.
        for g in [-0.8, 0.0, 0.6] {
            let count = 64;
            for i in 0..count {
                let [from, to]: [f32; 2] = [i, i + 1].map(|k| cosine(g, k as f32 / count as f32));
                let steps = 64;
                let at = |k: u32| from + (to - from) * (k as f32 + 0.5) / steps as f32;
                let sum: f32 = (0..steps).map(|k| henyey_greenstein(g, at(k))).sum();
                let part = 2.0 * std::f32::consts::PI * sum * (from - to).abs() / steps as f32;
                assert!((part * count as f32 - 1.0).abs() < 2e-3, "{g}, {i}: {part}");
            }
        }
    }

    #[test]
    fn scattered_and_transmitted_light_sum_to_the_throughput() {
        let medium = Medium { extinction: [0.3, 2.0, 9.0], albedo: [1.0; 3], anisotropy: 0.0 };
        let throughput = Color::new(0.7f32, 0.2, 0.5);
        let (mut sum, count) = ([0.0f64; 3], 200);
        for i in 0..count * count {
            let u = [i / count, i % count].map(|k| (k as f32 + 0.5) / count as f32);
            let Color { r, g, b } = within(&medium, throughput, 0.4, (u[0], u[1])).throughput;
            sum = [sum[0] + f64::from(r), sum[1] + f64::from(g), sum[2] + f64::from(b)];
        }
        for (sum, expected) in sum.into_iter().zip([0.7, 0.2, 0.5]) {
            let mean = sum / f64::from(count * count);
            assert!((mean / expected - 1.0).abs() < 0.01, "{mean}, not {expected}");
        }
    }
}
