//! Dispersion: refraction that depends on the wavelength (KHR_materials_dispersion). From the first such boundary that
//! it passes, a path follows a single wavelength: one of three colours, chosen at random, and a position in that
//! colour's band. From then on its throughput has only that colour, so the next choice, with probabilities proportional
//! to the throughput, must select it again: the path need not store the choice. Reflected light keeps all colours.

use crate::math::Color;
use crate::shading::fresnel;
use crate::simd::{Float, Mask};

use super::parameters::{Outside, Parameters};

/// Peaks of the sensitivities to red, green and blue light (linear Rec. 709), nm.
const PEAKS: [f32; 3] = [605.0, 540.0, 450.0];
/// Half width of the bands, which are tents, nm. They overlap in yellow (572 nm) and in blue-green (495 nm), as the
/// sensitivities do.
const HALF_WIDTH: f32 = 65.0;

/// The refraction of colours at a boundary.
#[derive(Clone, Copy)]
pub struct Spectrum<F: Float> {
    /// [`Parameters::eta`] at a wavelength in the band of each colour.
    pub etas: Color<F>,
    /// The factor on transmitted light: one over the probability of the colour that is followed, 0 for the others.
    pub tint: Color<F>,
}

impl<F: Float> Spectrum<F> {
    /// The spectrum of a boundary that refracts all light equally.
    #[inline(always)]
    pub fn none() -> Self {
        Self { etas: Color::grey(F::one()), tint: Color::grey(F::one()) }
    }

    /// The reflectance of a smooth boundary, for each colour.
    #[inline(always)]
    pub(super) fn reflectance(&self, cos: F) -> Color<F> {
        let Color { r, g, b } = self.etas;
        Color::new(fresnel::reflectance(cos, r), fresnel::reflectance(cos, g), fresnel::reflectance(cos, b))
    }
}

/// The index of refraction at a wavelength in nm, given the index at 587.6 nm: Cauchy's equation with the numbers of
/// the extension.
#[inline(always)]
pub fn ior<F: Float>(middle: F, dispersion: F, wavelength: F) -> F {
    let slope = (middle - F::one()) * dispersion / F::splat(20.0);
    let place = F::splat(523_655.0) / (wavelength * wavelength) - F::splat(1.5168);
    (middle + slope * place).max(middle.min(F::one()))
}

/// A boundary that disperses light.
pub struct Dispersive<'a, F: Float> {
    /// Index of refraction of the enclosed body.
    pub ior: f32,
    /// 20 / Abbe number.
    pub dispersion: f32,
    /// The medium outside the body.
    pub outside: &'a Outside<F>,
    /// Set if light comes from inside.
    pub inside: F::Mask,
}

impl<F: Float> Dispersive<'_, F> {
    /// The index on the side of the incident light divided by that on the other side, at a wavelength.
    #[inline(always)]
    fn eta(&self, wavelength: F) -> F {
        let outside = self.outside;
        let own = ior(F::splat(self.ior), F::splat(self.dispersion), wavelength);
        if outside.is_air {
            return F::select(self.inside, own, F::one() / own);
        }
        let other = ior(outside.index, outside.dispersion, wavelength);
        F::select(self.inside, own / other, other / own)
    }

    /// The lanes in which the boundary disperses light.
    #[inline(always)]
    fn disperses(&self) -> F::Mask {
        let all = F::Mask::from_bits(u32::MAX);
        if self.dispersion > 0.0 { all } else { self.outside.dispersion.gt(F::zero()) }
    }
}

impl<F: Float> Parameters<F> {
    /// Chooses a wavelength by two random numbers; a path with this throughput follows it if it is transmitted.
    #[inline(always)]
    pub fn split(&mut self, boundary: &Dispersive<F>, throughput: Color<F>, u: (F, F)) {
        let (zero, one) = (F::zero(), F::one());
        let place = tent(u.1) * F::splat(HALF_WIDTH);
        let [red, green, blue] = PEAKS.map(F::splat);
        let etas =
            Color::new(boundary.eta(red + place), boundary.eta(green + place), boundary.eta(blue + place));
        let Color { r, g, b } = throughput;
        let (sum, least) = (r + g + b, F::splat(1e-30));
        let chosen = u.0 * sum;
        let red = chosen.lt(r);
        let red_or_green = red | chosen.lt(r + g);
        let followed = F::select(red, etas.r, F::select(red_or_green, etas.g, etas.b));
        let (r, g, b) = (sum / r.max(least), sum / g.max(least), sum / b.max(least));
        let tint = Color::new(
            F::select(red, r, zero),
            F::select(red, zero, F::select(red_or_green, g, zero)),
            F::select(red_or_green, zero, b),
        );
        let disperses = boundary.disperses();
        self.spectrum = Spectrum {
            etas: Color::select(disperses, etas, Color::grey(self.eta)),
            tint: Color::select(disperses, tint, Color::grey(one)),
        };
        self.eta = F::select(disperses, followed, self.eta);
    }
}

/// Samples a tent from −1 to 1 with its peak at 0, by inversion.
#[inline(always)]
fn tent<F: Float>(u: F) -> F {
    let (one, two) = (F::one(), F::splat(2.0));
    let low = (two * u).sqrt() - one;
    let high = one - (two - two * u).max(F::zero()).sqrt();
    F::select(u.lt(F::splat(0.5)), low, high)
}

#[cfg(test)]
mod tests {
    use super::super::bsdf::Bsdf;
    use super::super::measure::towards;
    use super::super::tests::glass;
    use super::*;
    use crate::sampling::sobol;
    use std::num::Wrapping;

    const DISPERSION: f32 = 2.0;
    const AIR: Outside<f32> = Outside { is_air: true, index: 1.0, dispersion: 0.0 };

    fn glass_in_air(inside: bool) -> Dispersive<'static, f32> {
        Dispersive { ior: 1.5, dispersion: DISPERSION, outside: &AIR, inside }
    }

    #[test]
    fn ior_matches_the_abbe_number() {
        for (middle, abbe) in [(1.5f32, 59.0f32), (2.42, 55.0), (1.6, 20.0)] {
            let at = |wavelength: f32| ior(middle, 20.0 / abbe, wavelength);
            assert!((at(587.6) - middle).abs() < 1e-4);
            let found = (middle - 1.0) / (at(486.1) - at(656.3));
            assert!((found / abbe - 1.0).abs() < 1e-3, "{found}, not {abbe}");
        }
        assert_eq!(ior(1.5, 0.0, 400.0f32), 1.5);
        assert_eq!(ior(1.1, 100.0, 700.0f32), 1.0);
    }

    fn colors(c: Color<f32>) -> [f32; 3] {
        [c.r, c.g, c.b]
    }

    /// In uniform white surroundings dispersion creates no colours, whatever the throughput; each transmitted colour
    /// obeys Snell's law at a wavelength of its band.
    #[test]
    fn dispersed_colours_obey_snells_law_and_add_up_to_white() {
        for (inside, cos) in [(false, 0.3), (false, 0.9), (true, 0.8), (true, 0.75), (true, 0.95)] {
            for throughput in [[1.0f32, 1.0, 1.0], [0.2, 0.5, 0.9], [0.7, 0.0, 0.3]] {
                let (mut has, mut p) = glass(0.0, inside);
                has.dispersion = true;
                let carried = Color::new(throughput[0], throughput[1], throughput[2]);
                let (mut sum, mut angles) = ([0.0f64; 3], [[0.0f64; 2]; 3]);
                let count = 1 << 17;
                for i in 0..count {
                    let number = |d| sobol::two::<f32>(Wrapping(i), Wrapping(d));
                    p.split(&glass_in_air(inside), carried, number(1));
                    let sampled =
                        Bsdf::new(has, p, towards(cos, 0.1), true).sample(number(2).0, 1.0, number(3), true);
                    if !sampled.valid {
                        continue;
                    }
                    let weight = colors(carried * sampled.weight);
                    (0..3).for_each(|k| sum[k] += weight[k] as f64);
                    if sampled.direction.z < 0.0 {
                        let color = (0..3).find(|k| weight[*k] > 0.0).expect("a colour");
                        assert_eq!(weight.iter().filter(|w| **w > 0.0).count(), 1);
                        let sin = |z: f64| (1.0 - z * z).sqrt();
                        let ratio = sin(sampled.direction.z as f64) / sin(cos as f64);
                        assert!((ratio - colors(p.spectrum.etas)[color] as f64).abs() < 1e-5);
                        angles[color] = [angles[color][0] + ratio, angles[color][1] + 1.0];
                    }
                }
                for k in 0..3 {
                    let found = sum[k] / count as f64;
                    assert!((found - throughput[k] as f64).abs() < 5e-3, "{inside} {cos} {k}: {found}");
                    // Near the critical angle a part of the band is reflected.
                    if angles[k][1] > 100.0 && cos > 0.85 {
                        let n = ior(1.5, DISPERSION, PEAKS[k]);
                        let expected = if inside { n } else { 1.0 / n } as f64;
                        assert!((angles[k][0] / angles[k][1] - expected).abs() < 3e-3);
                    }
                }
            }
        }
    }

    #[test]
    fn split_at_a_second_boundary_chooses_the_same_colour() {
        let (_, mut p) = glass(0.0, false);
        for i in 0..1000 {
            let u = sobol::two(Wrapping(i), Wrapping(1));
            let white = Color::grey(0.37);
            p.split(&glass_in_air(false), white, u);
            let (first, index) = (white * p.spectrum.tint, 1.0 / p.eta);
            p.split(&glass_in_air(true), first * 0.77, u);
            assert!((p.eta - index).abs() < 1e-6);
            let second = colors(first * p.spectrum.tint);
            for (a, b) in colors(first).into_iter().zip(second) {
                assert!((a - b).abs() <= 1e-6, "{a} {b}");
            }
        }
    }
}
