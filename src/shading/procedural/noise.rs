//! Gradient noise and Voronoi cells on a lattice of hashed points.

use crate::math::Vector;
use crate::math::hash::{mix, to_unit};
use crate::scene::procedures::{NoiseKind, Octaves, VoronoiKind};
use crate::simd::{Float, Int, Mask};

/// Factors on lattice coordinates: large odd numbers.
const PRIMES: [u32; 3] = [0x8da6_b343, 0xd816_3841, 0xcb1a_b31f];
/// Ten random bits as a number from 0 to 1.
const TEN_BITS: f32 = 1.0 / 1023.0;
/// The factor that brings noise of random gradients to about −1 to 1.
const GAIN: f32 = 1.4;
/// The means of |noise| and of (1 − |noise|)², and the standard deviation of noise: what remains of an octave that is
/// too fine to be seen.
const MEAN_ABS: f32 = 0.22;
const MEAN_RIDGE: f32 = 0.65;
const DEVIATION: f32 = 0.28;
/// The means of distances in Voronoi diagrams, in space.
const MEAN_DISTANCE: f32 = 0.52;
const MEAN_EDGE: f32 = 0.2;

/// The hash of a lattice point: its coordinates times [`PRIMES`], and a step from there.
#[inline(always)]
fn lattice<I: Int>(base: [I; 3], step: [u32; 3]) -> I {
    let [x, y, z] = [0, 1, 2].map(|axis: usize| step[axis].wrapping_mul(PRIMES[axis]));
    mix(base[0] + I::splat(x) + base[1] + I::splat(y) + base[2] + I::splat(z))
}

/// A coordinate of a lattice cell, as [`lattice`] takes it.
#[inline(always)]
fn cell<F: Float>(whole: F, axis: usize) -> F::Int {
    whole.to_int() * F::Int::splat(PRIMES[axis])
}

#[inline(always)]
fn floor<F: Float>(p: Vector<F>) -> Vector<F> {
    Vector::new(p.x.floor(), p.y.floor(), p.z.floor())
}

/// A random number from 0 to 1, from the lowest ten bits.
#[inline(always)]
fn ten<F: Float>(bits: F::Int) -> F {
    (bits & F::Int::splat(1023)).to_float() * F::splat(TEN_BITS)
}

/// Three random numbers from 0 to 1.
#[inline(always)]
fn three<F: Float>(hash: F::Int) -> Vector<F> {
    Vector::new(ten(hash), ten(hash.shr::<10>()), ten(hash.shr::<20>()))
}

/// Perlin's fifth-degree step from 0 to 1.
#[inline(always)]
fn fade<F: Float>(t: F) -> F {
    t * t * t * (t * (t * F::splat(6.0) - F::splat(15.0)) + F::splat(10.0))
}

#[inline(always)]
fn blend<F: Float>(a: F, b: F, weight: F) -> F {
    a + (b - a) * weight
}

/// The product of a lattice point's random gradient and the vector from there.
#[inline(always)]
fn corner<F: Float>(base: [F::Int; 3], step: [u32; 3], at: Vector<F>) -> F {
    let random: Vector<F> = three(lattice(base, step));
    let gradient = random + random - Vector::new(F::one(), F::one(), F::one());
    let [x, y, z] = step.map(|step| step as f32);
    gradient.dot(at - Vector::new(F::splat(x), F::splat(y), F::splat(z)))
}

/// Gradient noise, about −1 to 1 (Perlin, "Improving Noise", SIGGRAPH 2002, with gradients in a cube).
#[inline(always)]
fn gradient_noise<F: Float>(p: Vector<F>) -> F {
    let whole = floor(p);
    let base = [cell(whole.x, 0), cell(whole.y, 1), cell(whole.z, 2)];
    let at = p - whole;
    let (u, v, w) = (fade(at.x), fade(at.y), fade(at.z));
    let mut layers = [F::zero(); 2];
    for z in 0..2 {
        let near = blend(corner(base, [0, 0, z], at), corner(base, [1, 0, z], at), u);
        let far = blend(corner(base, [0, 1, z], at), corner(base, [1, 1, z], at), u);
        layers[z as usize] = blend(near, far, v);
    }
    blend(layers[0], layers[1], w) * F::splat(GAIN)
}

/// The part of a detail that a footprint keeps: all up to half of its size, nothing from its whole size.
#[inline(always)]
fn kept<F: Float>(width: F) -> F {
    (F::splat(2.0) - width - width).clamp(0.0, 1.0)
}

/// The value of noise, 0 to 1, and the width of the range of the values that the footprint, `width` wide, covers
/// (Musgrave and others, *Texturing and Modeling*, 3rd ed., chapters 2 and 16).
#[inline(always)]
pub(super) fn noise<F: Float>(
    p: Vector<F>,
    width: F,
    kind: NoiseKind,
    octaves: Octaves,
    mask: F::Mask,
) -> (F, F) {
    let (value, lost) = octaves_of(p, width, kind, octaves, mask);
    match kind {
        NoiseKind::Fractal => (value * F::splat(0.5) + F::splat(0.5), lost * F::splat(0.5)),
        _ => (value, lost),
    }
}

/// The weighted mean of octaves of noise, and the width of the range of the values of those that are left out.
#[inline(always)]
pub(super) fn octaves_of<F: Float>(
    p: Vector<F>,
    width: F,
    kind: NoiseKind,
    octaves: Octaves,
    mask: F::Mask,
) -> (F, F) {
    let mean = match kind {
        NoiseKind::Fractal => 0.0,
        NoiseKind::Turbulence => MEAN_ABS,
        NoiseKind::Ridged => MEAN_RIDGE,
    };
    let (mut sum, mut lost, mut whole) = (F::zero(), F::zero(), 0.0);
    let (mut amplitude, mut frequency) = (1.0, 1.0);
    for octave in 0..octaves.count {
        let kept = kept(width * F::splat(frequency));
        let mut value = F::splat(mean);
        if (mask & kept.gt(F::zero())).any() {
            // The octaves' lattices do not meet.
            let shift = F::splat(octave as f32 * 17.31);
            let noise = gradient_noise(p * F::splat(frequency) + Vector::new(shift, shift, shift));
            let shaped = match kind {
                NoiseKind::Fractal => noise,
                NoiseKind::Turbulence => noise.abs(),
                NoiseKind::Ridged => {
                    let ridge = (F::one() - noise.abs()).max(F::zero());
                    ridge * ridge
                }
            };
            value = value + (shaped - value) * kept;
        }
        sum = sum + value * F::splat(amplitude);
        let left_out = (F::one() - kept) * F::splat(amplitude * DEVIATION);
        lost = lost + left_out * left_out;
        whole += amplitude;
        amplitude *= octaves.roughness;
        frequency *= octaves.lacunarity;
    }
    // A uniform distribution is √12 times as wide as its deviation.
    (sum * F::splat(1.0 / whole), lost.sqrt() * F::splat(12f32.sqrt() / whole))
}

/// The value of a Voronoi diagram, 0 to 1, and the width of the range of values in the footprint (Worley, "A Cellular
/// Texture Basis Function", SIGGRAPH 1996).
#[inline(always)]
pub(super) fn voronoi<F: Float>(
    p: Vector<F>,
    width: F,
    kind: VoronoiKind,
    randomness: f32,
    flat: bool,
) -> (F, F) {
    let whole = floor(p);
    let base = [cell(whole.x, 0), cell(whole.y, 1), cell(whole.z, 2)];
    let at = p - whole;
    let (mut first, mut second, mut nearest) = (F::splat(9.0), F::splat(9.0), F::Int::splat(0));
    let still = F::splat(0.5 - 0.5 * randomness);
    let layers = if flat { 0..1 } else { -1..2 };
    for z in layers {
        for y in -1..2 {
            for x in -1..2 {
                let hash = lattice(base, [x as u32, y as u32, z as u32]);
                let random: Vector<F> = three(hash) * F::splat(randomness);
                let cell = Vector::new(F::splat(x as f32), F::splat(y as f32), F::splat(z as f32));
                let mut way = random + Vector::new(still, still, still) + cell - at;
                if flat {
                    way.z = F::zero();
                }
                let square = way.dot(way);
                let is_nearer = square.lt(first);
                second = F::select(is_nearer, first, second.min(square));
                nearest = F::Int::select(is_nearer, hash, nearest);
                first = first.min(square);
            }
        }
    }
    let (value, mean, range) = match kind {
        VoronoiKind::Distance => (first.sqrt(), MEAN_DISTANCE, 0.6),
        VoronoiKind::Edges => (second.sqrt() - first.sqrt(), MEAN_EDGE, 0.6),
        VoronoiKind::Cells => (to_unit(mix(nearest)), 0.5, 1.0),
    };
    let kept = kept(width);
    let value = F::splat(mean) + (value.min(F::one()) - F::splat(mean)) * kept;
    (value, (F::one() - kept) * F::splat(range))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random points in a cube of 64 cells.
    fn points() -> impl Iterator<Item = Vector<f32>> {
        (0..40_000u32).map(|number| {
            let random = |salt: u32| {
                let bits: u32 = mix(std::num::Wrapping(number * 3 + salt)).0;
                (bits >> 8) as f32 / 16_777_216.0 * 64.0 - 32.0
            };
            Vector::new(random(0), random(1), random(2))
        })
    }

    fn mean(values: impl Iterator<Item = f32>) -> f64 {
        let values: Vec<f64> = values.map(f64::from).collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn noise_has_the_mean_and_spread_that_fine_octaves_are_replaced_by() {
        let near = |found: f64, stated: f32| {
            assert!((found / f64::from(stated) - 1.0).abs() < 0.05, "{found} instead of {stated}");
        };
        assert!(mean(points().map(gradient_noise)).abs() < 0.005);
        near(mean(points().map(|p| gradient_noise(p).powi(2))).sqrt(), DEVIATION);
        near(mean(points().map(|p| gradient_noise(p).abs())), MEAN_ABS);
        near(mean(points().map(|p| (1.0 - gradient_noise(p).abs()).max(0.0).powi(2))), MEAN_RIDGE);
        assert!(points().all(|p| gradient_noise(p).abs() < 1.3));
        let of = |kind| mean(points().map(|p| voronoi(p, 0.0, kind, 1.0, false).0));
        near(of(VoronoiKind::Distance), MEAN_DISTANCE);
        near(of(VoronoiKind::Edges), MEAN_EDGE);
        near(of(VoronoiKind::Cells), 0.5);
    }

    #[test]
    fn noise_is_continuous_across_cells_and_zero_at_their_corners() {
        assert_eq!(gradient_noise(Vector::new(3.0f32, -4.0, 7.0)), 0.0);
        for k in 0..100 {
            let at = k as f32 * 0.37 - 18.0;
            let (before, after) = (Vector::new(2.0 - 1e-5, at, -at), Vector::new(2.0 + 1e-5, at, -at));
            assert!((gradient_noise(before) - gradient_noise(after)).abs() < 1e-3);
        }
    }

    #[test]
    fn nothing_is_left_of_octaves_finer_than_the_footprint() {
        let octaves = Octaves { count: 5, roughness: 0.5, lacunarity: 2.0 };
        for p in points().take(50) {
            assert_eq!(noise(p, 1.0, NoiseKind::Fractal, octaves, true).0, 0.5);
            let (value, range) = noise(p, 1.0, NoiseKind::Turbulence, octaves, true);
            assert!((value - MEAN_ABS).abs() < 1e-6 && range > 0.1);
            assert_eq!(noise(p, 0.0, NoiseKind::Ridged, octaves, true).1, 0.0);
        }
    }
}
