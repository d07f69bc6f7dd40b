//! A thin film on a surface: light reflected by the film and by the surface below interferes
//! (KHR_materials_iridescence; Belcour and Barla, "A practical extension to microfacet theory for the modeling of
//! varying iridescence", 2017). As in the extension, amplitudes are real and light is unpolarised.
//!
//! Let R₁₂ be the reflectance of the film, R₂₃ that of the surface below, and ρ = r₁₂ r₂₃. A wave whose phase is
//! delayed by φ on its way through the film and back has Airy's reflectance 1 − A (1 + 2 Σ (−ρ)ᵐ cos mφ), A = (1 −
//! R₁₂)(1 − R₂₃)/(1 − ρ²). The mean of cos mφ over the wavelengths of a colour has a closed form if the eye's
//! sensitivities are Gaussians over the wave number.
//!
//! Two things differ from the extension's (non-normative) code. First, the surface below the film is not derived from
//! its F₀ but from its reflectance in air at the same angle: r₂₃ is chosen so that a film of zero thickness gives that
//! reflectance. So a film of zero thickness changes nothing, whatever model the surface follows. Second, colours are
//! those under white light, not under equal energy at all wavelengths, which made thin films reddish.

use crate::math::Color;
use crate::math::elementary::{exp2, sin_cos_turns};
use crate::shading::fresnel;
use crate::simd::Float;

/// Orders of interference; higher orders use the waves of the last one.
const ORDERS: usize = 6;
/// Gaussians of the sensitivities x̄ (two of them), ȳ and z̄: wave numbers of their centres, nm⁻¹.
const CENTRE: [f32; 4] = [1.6810e-3, 2.2399e-3, 1.7953e-3, 2.2084e-3];
/// A path difference of d nm reduces a wave's mean over a Gaussian by a factor of 2^(this · d²).
const FADING: [f32; 4] = [fading(4.3278e-9), fading(4.5282e-9), fading(9.3046e-9), fading(6.6121e-9)];
/// The weight of x̄'s first Gaussian; it is to that of the second as 5.4856 √4.3278 to 0.9747 √4.5282.
const FIRST: f32 = 0.846_198;
/// XYZ to linear Rec. 709, with each row divided by its sum: white stays white.
const RGB: [[f32; 3]; 3] = [
    [3.2404542 / 1.2047843, -1.5371385 / 1.2047843, -0.4985314 / 1.2047843],
    [-0.969266 / 0.9483008, 1.8760108 / 0.9483008, 0.041556 / 0.9483008],
    [0.0556434 / 0.9088427, -0.2040259 / 0.9088427, 1.0572252 / 0.9088427],
];

/// The exponent for a Gaussian of variance 2v nm⁻²: −(2π)² v log₂ e.
const fn fading(v: f32) -> f32 {
    -4.0 * std::f32::consts::PI * std::f32::consts::PI * v * std::f32::consts::LOG2_E
}

/// Parameters of a film.
#[derive(Clone, Copy)]
pub struct ThinFilm<F: Float> {
    /// Coverage.
    pub weight: F,
    /// Thickness in nm.
    pub thickness: F,
    /// Index of refraction.
    pub ior: F,
}

/// A film seen under one angle.
#[derive(Clone, Copy)]
pub struct Interference<F: Float> {
    /// r₁₂ of the film in air.
    outer: F,
    /// The mean of cos mφ in each colour, for each order m.
    waves: [Color<F>; ORDERS],
}

impl<F: Float> Interference<F> {
    /// The interference at an angle whose cosine in air is `cos`.
    #[inline(always)]
    pub fn new(film: &ThinFilm<F>, cos: F) -> Self {
        let (zero, one, two) = (F::zero(), F::one(), F::splat(2.0));
        let outer = -fresnel::reflectance(cos, one / film.ior).sqrt();
        let sin2 = (one - cos * cos) / (film.ior * film.ior);
        let path = two * film.ior * film.thickness * (one - sin2).max(zero).sqrt();
        // cos mφ by Chebyshev's recurrence, and q^(m²) by its factors q^(2m + 1).
        let (mut double, mut last, mut now) = ([zero; 4], [one; 4], [zero; 4]);
        let (mut size, mut step, mut square) = ([zero; 4], [zero; 4], [zero; 4]);
        for k in 0..4 {
            now[k] = sin_cos_turns(path * F::splat(CENTRE[k])).1;
            double[k] = two * now[k];
            size[k] = exp2(path * path * F::splat(FADING[k]));
            square[k] = size[k] * size[k];
            step[k] = square[k] * size[k];
        }
        let mut waves = [Color::black(); ORDERS];
        for wave in &mut waves {
            let x = now[0] * size[0] * F::splat(FIRST) + now[1] * size[1] * F::splat(1.0 - FIRST);
            *wave = rgb([x, now[2] * size[2], now[3] * size[3]]);
            for k in 0..4 {
                (last[k], now[k]) = (now[k], double[k] * now[k] - last[k]);
                size[k] = size[k] * step[k];
                step[k] = step[k] * square[k];
            }
        }
        Self { outer, waves }
    }

    /// The reflectance with the film of a surface that reflects `plain` without it.
    #[inline(always)]
    pub fn over(&self, plain: Color<F>) -> Color<F> {
        let (r, g, b) = (self.channel(plain.r), self.channel(plain.g), self.channel(plain.b));
        let one = F::one();
        let (mut sum_r, mut sum_g, mut sum_b) = (one, one, one);
        let (mut power_r, mut power_g, mut power_b) = (F::splat(2.0), F::splat(2.0), F::splat(2.0));
        for (m, wave) in self.waves.iter().enumerate() {
            (power_r, power_g, power_b) = (power_r * -r.product, power_g * -g.product, power_b * -b.product);
            if m + 1 == ORDERS {
                // The rest of the geometric series: exact for a film of zero thickness.
                (power_r, power_g, power_b) = (power_r * r.rest(), power_g * g.rest(), power_b * b.rest());
            }
            sum_r = sum_r + power_r * wave.r;
            sum_g = sum_g + power_g * wave.g;
            sum_b = sum_b + power_b * wave.b;
        }
        // Colours beyond Rec. 709 are clipped.
        Color::new(one - r.passed * sum_r, one - g.passed * sum_g, one - b.passed * sum_b).clamp(0.0, 1.0)
    }

    /// r₂₃ from r₁₃ = (r₁₂ + r₂₃)/(1 + r₁₂ r₂₃). Amplitudes are negative because a denser medium inverts the wave.
    #[inline(always)]
    fn channel(&self, plain: F) -> InterferenceChannel<F> {
        let (one, least) = (F::one(), F::splat(1e-6));
        let whole = -plain.max(F::zero()).min(one).sqrt();
        let inner = (whole - self.outer) / (one - self.outer * whole).max(least);
        let product = self.outer * inner;
        let passes = (one - self.outer * self.outer) * (one - inner * inner).max(F::zero());
        InterferenceChannel { product, passed: passes / (one - product * product).max(least) }
    }
}

/// The coefficients of Airy's reflectance for one colour.
struct InterferenceChannel<F: Float> {
    /// The coefficient ρ.
    product: F,
    /// The coefficient A.
    passed: F,
}

impl<F: Float> InterferenceChannel<F> {
    /// The sum 1 − ρ + ρ² − …
    #[inline(always)]
    fn rest(&self) -> F {
        F::one() / (F::one() + self.product).max(F::splat(1e-3))
    }
}

#[inline(always)]
fn rgb<F: Float>([x, y, z]: [F; 3]) -> Color<F> {
    let [r, g, b] = RGB;
    Color::new(
        x * F::splat(r[0]) + y * F::splat(r[1]) + z * F::splat(r[2]),
        x * F::splat(g[0]) + y * F::splat(g[1]) + z * F::splat(g[2]),
        x * F::splat(b[0]) + y * F::splat(b[1]) + z * F::splat(b[2]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    fn film(thickness: f32, ior: f32) -> ThinFilm<f32> {
        ThinFilm { weight: 1.0, thickness, ior }
    }

    fn grey(value: f32) -> Color<f32> {
        Color::splat(Rgb::splat(value))
    }

    /// Fresnel's amplitudes perpendicular and parallel to the plane of incidence.
    fn amplitudes(n1: f64, n2: f64, cos1: f64, cos2: f64) -> [f64; 2] {
        [(n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2), (n1 * cos2 - n2 * cos1) / (n1 * cos2 + n2 * cos1)]
    }

    /// Airy's sum for a film of index `n` on glass, unpolarised.
    fn airy(n: f64, base: f64, cos: f64, phase: f64) -> f64 {
        let below = |n: f64| (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
        let (first, second) = (amplitudes(1.0, n, cos, below(n)), amplitudes(n, base, below(n), below(base)));
        let mut sum = 0.0;
        for (a, b) in first.into_iter().zip(second) {
            let wave = 2.0 * a * b * libm::cos(phase);
            sum += 0.5 * (a * a + b * b + wave) / (1.0 + a * a * b * b + wave);
        }
        sum
    }

    /// The film's reflectance at a single wavelength.
    fn at_phase(n: f32, base: f32, cos: f32, phase: f64) -> f32 {
        let mut seen = Interference::new(&film(0.0, n), cos);
        for (m, wave) in seen.waves.iter_mut().enumerate() {
            *wave = grey(libm::cos(phase * (m + 1) as f64) as f32);
        }
        seen.over(grey(fresnel::reflectance(cos, 1.0 / base))).r
    }

    #[test]
    fn reflectance_at_one_wavelength_matches_airys_sum() {
        for (n, base) in [(1.33, 1.5), (1.8, 1.5), (1.3, 2.4), (2.4, 1.5)] {
            for k in 0..16 {
                let phase = k as f64 / 16.0 * std::f64::consts::TAU;
                for (cos, allowed) in [(1.0, 2e-4), (0.8, 0.01), (0.5, 0.05), (0.25, 0.1)] {
                    let found = at_phase(n as f32, base as f32, cos as f32, phase) as f64;
                    let expected = airy(n, base, cos, phase);
                    // Off the normal, the two polarisations are treated as one.
                    assert!(
                        (found - expected).abs() < allowed,
                        "{n} on {base}, cos {cos}, phase {phase}: {found}, not {expected}"
                    );
                }
            }
        }
    }

    /// The film's colour over all wavelengths, by quadrature over wave numbers.
    fn spectrum(thickness: f64, ior: f64, base: f64) -> [f64; 3] {
        let bells = [(1.6810, 4.3278), (2.2399, 4.5282), (1.7953, 9.3046), (2.2084, 6.6121)];
        let steps = 4000;
        let mut means = [0.0; 4];
        for (mean, (centre, variance)) in means.iter_mut().zip(bells) {
            let width = (2.0f64 * variance * 1e-9).sqrt();
            let mut weights = 0.0;
            for i in 0..steps {
                let x = (i as f64 + 0.5) / steps as f64 * 12.0 - 6.0;
                let number = centre * 1e-3 + x * width;
                let weight = libm::exp(-0.5 * x * x);
                let phase = std::f64::consts::TAU * number * 2.0 * ior * thickness;
                *mean += weight * airy(ior, base, 1.0, phase);
                weights += weight;
            }
            *mean /= weights;
        }
        let first = 5.4856 * 4.3278f64.sqrt();
        let second = 0.9747 * 4.5282f64.sqrt();
        let x = (means[0] * first + means[1] * second) / (first + second);
        RGB.map(|row| row[0] as f64 * x + row[1] as f64 * means[2] + row[2] as f64 * means[3])
    }

    #[test]
    fn colours_match_the_mean_over_wavelengths() {
        for (ior, base) in [(1.33, 1.5), (1.8, 1.5), (1.3, 2.4)] {
            for thickness in [0.0, 100.0, 250.0, 400.0, 700.0, 1200.0, 5000.0] {
                let plain = fresnel::reflectance(1.0, 1.0 / base as f32);
                let found = Interference::new(&film(thickness as f32, ior as f32), 1.0).over(grey(plain));
                let expected = spectrum(thickness, ior, base);
                for (found, expected) in [found.r, found.g, found.b].into_iter().zip(expected) {
                    assert!(
                        (found as f64 - expected.clamp(0.0, 1.0)).abs() < 5e-4,
                        "{thickness} nm of {ior} on {base}: {found}, not {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn film_without_thickness_keeps_the_reflectance() {
        for ior in [1.0, 1.3, 1.8, 2.5] {
            for plain in [0.0, 0.04, 0.3, 0.9, 1.0] {
                for cos in [0.0, 0.01, 0.1, 0.5, 1.0] {
                    let found = Interference::new(&film(0.0, ior), cos).over(grey(plain)).g;
                    // If the film reflects everything, the surface below is invisible.
                    let expected = if cos == 0.0 { 1.0 } else { plain };
                    assert!((found - expected).abs() < 2e-3, "{ior} {plain} {cos}: {found}");
                }
            }
        }
    }

    #[test]
    fn perfect_reflector_stays_perfect_under_any_film() {
        for thickness in [0.0, 120.0, 400.0, 3000.0, 1e5] {
            for cos in [0.0, 0.2, 1.0] {
                let found = Interference::new(&film(thickness, 1.3), cos).over(grey(1.0));
                assert!(found.r == 1.0 && found.g == 1.0 && found.b == 1.0, "{thickness} {cos}");
            }
        }
    }
}
