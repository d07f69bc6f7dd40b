//! Transcendental functions with bit-identical results on every machine: polynomials over the exact operations of
//! [`Float`]. The functions of std differ between systems. The coefficients are our own minimax fits (Lawson's
//! iteration, float64).

// The coefficients are fitted; that some are close to known constants is a coincidence.
#![allow(clippy::approx_constant, clippy::excessive_precision)]

use crate::simd::{Float, Int};

/// Evaluates c₀ + x (c₁ + x (c₂ + …)).
#[inline(always)]
fn polynomial<F: Float, const N: usize>(x: F, coefficients: [f32; N]) -> F {
    let mut sum = F::splat(coefficients[N - 1]);
    for i in (0..N - 1).rev() {
        sum = sum * x + F::splat(coefficients[i]);
    }
    sum
}

/// 2ˣ, relative error below 2·10⁻⁷; 0 below 2⁻¹²⁶, 2¹²⁷ at most.
#[inline(always)]
pub fn exp2<F: Float>(x: F) -> F {
    let clamped = x.clamp(-127.0, 127.0);
    let whole = (clamped + F::splat(0.5)).floor();
    let scale = (whole.to_int() + F::Int::splat(127)).shl::<23>().reinterpret();
    let fraction = polynomial(
        clamped - whole,
        [1.0, 0.693_147_2, 0.240_226_5, 0.055_503_27, 0.009_617_994, 0.001_340_043_2, 0.000_154_780_18],
    );
    fraction * scale
}

/// log₂ x for normal x > 0, absolute error below 2·10⁻⁷ near 1.
#[inline(always)]
pub fn log2<F: Float>(x: F) -> F {
    // The mantissa is mapped to [√½, √2), where the series in s = (m − 1) / (m + 1) is short.
    let bits = x.to_bits() - F::Int::splat(0x3f35_04f3);
    let exponent = (bits.shr::<23>() ^ F::Int::splat(0x100)) - F::Int::splat(0x100);
    let mantissa = (x.to_bits() - exponent.shl::<23>()).reinterpret();
    let s = (mantissa - F::one()) / (mantissa + F::one());
    let series = polynomial(s * s, [2.885_390_1, 0.961_798_85, 0.576_714_25, 0.431_742_1]);
    exponent.to_float() + s * series
}

/// xʸ for x ≥ 0, y ≥ 0; 0⁰ = 1. The relative error is about 10⁻⁷ (1 + y·|log₂ x|).
#[inline(always)]
pub fn pow<F: Float>(x: F, y: F) -> F {
    let tiny = x.lt(F::splat(1e-30));
    let power = exp2(y * log2(x.max(F::splat(1e-30))));
    F::select(tiny, F::select(y.le(F::zero()), F::one(), F::zero()), power)
}

/// Sine and cosine of 2π·`turns`, absolute error below 10⁻⁷, for |turns| < 10⁵.
#[inline(always)]
pub fn sin_cos_turns<F: Float>(turns: F) -> (F, F) {
    let quarter = (turns * F::splat(4.0) + F::splat(0.5)).floor();
    let r = turns - quarter * F::splat(0.25);
    let r2 = r * r;
    let sin = r * polynomial(r2, [6.283_185_3, -41.341_663, 81.592_56, -75.402_25]);
    let cos = polynomial(r2, [1.0, -19.739_208, 64.939_316, -85.442_86, 59.220_5]);
    let quadrant = quarter.to_int();
    let odd = (quadrant & F::Int::splat(1)).eq(F::Int::splat(1));
    let two = (quadrant & F::Int::splat(2)).eq(F::Int::splat(2));
    let (s, c) = (F::select(odd, cos, sin), F::select(odd, sin, cos));
    let flip_cos = (odd & !two) | (two & !odd);
    (F::select(two, -s, s), F::select(flip_cos, -c, c))
}

/// The angle of (x, y) in turns, −½ to ½; 0 at the origin. Error below 10⁻⁷.
#[inline(always)]
pub fn atan2_turns<F: Float>(y: F, x: F) -> F {
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay.gt(ax);
    let (low, high) = (F::select(steep, ax, ay), F::select(steep, ay, ax));
    let z = low / high.max(F::splat(f32::MIN_POSITIVE));
    let series = polynomial(
        z * z,
        [
            0.159_154_94, -0.053_051_267, 0.031_819_94, -0.022_611_396, 0.016_957_583, -0.011_990_479,
            0.006_850_212, -0.002_591_684_5, 0.000_462_153_39,
        ],
    );
    let angle = z * series;
    let angle = F::select(steep, F::splat(0.25) - angle, angle);
    let angle = F::select(x.lt(F::zero()), F::splat(0.5) - angle, angle);
    F::select(y.lt(F::zero()), -angle, angle)
}

/// The arc cosine of x in turns, 0 to ½, for |x| ≤ 1.
#[inline(always)]
pub fn acos_turns<F: Float>(x: F) -> F {
    atan2_turns(((F::one() - x) * (F::one() + x)).max(F::zero()).sqrt(), x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(from: f64, to: f64, error: impl Fn(f64) -> f64) -> f64 {
        (0..=200_000)
            .map(|i| error((from + (to - from) * i as f64 / 200_000.0) as f32 as f64))
            .fold(0.0, f64::max)
    }

    #[test]
    fn exp2_error_is_below_its_bound() {
        assert!(worst(-125.0, 126.0, |x| (exp2(x as f32) as f64 / libm::exp2(x) - 1.0).abs()) < 2e-7);
        assert_eq!(exp2(-1000.0f32), 0.0);
        assert_eq!(exp2(3.0f32), 8.0);
    }

    #[test]
    fn log2_error_is_below_its_bound() {
        assert!(worst(0.5, 2.0, |x| (log2(x as f32) as f64 - libm::log2(x)).abs()) < 2e-7);
        assert!(worst(1e-30, 1e30, |x| (log2(x as f32) as f64 / libm::log2(x) - 1.0).abs()) < 2e-7);
        assert_eq!(log2(1.0f32), 0.0);
        assert_eq!(log2(0.125f32), -3.0);
    }

    #[test]
    fn pow_is_exact_at_zero_and_one_and_accurate_between() {
        assert_eq!(pow(0.0f32, 0.0), 1.0);
        assert_eq!(pow(0.0f32, 5.0), 0.0);
        assert_eq!(pow(1.0f32, 1e6), 1.0);
        assert!(worst(0.1, 1.0, |x| (pow(x as f32, 20.0) as f64 / libm::pow(x, 20.0) - 1.0).abs()) < 2e-5);
    }

    #[test]
    fn sin_cos_atan2_and_acos_errors_are_below_their_bounds() {
        use std::f64::consts::TAU;
        assert!(worst(-3.0, 3.0, |x| (sin_cos_turns(x as f32).0 as f64 - libm::sin(x * TAU)).abs()) < 1.5e-7);
        assert!(worst(-3.0, 3.0, |x| (sin_cos_turns(x as f32).1 as f64 - libm::cos(x * TAU)).abs()) < 1.5e-7);
        let angle = |t: f64| {
            let (y, x) = (libm::sin(t) as f32, libm::cos(t) as f32);
            (atan2_turns(y, x) as f64 - libm::atan2(y as f64, x as f64) / TAU).abs()
        };
        assert!(worst(-3.14, 3.14, angle) < 1e-7);
        assert!(worst(-1.0, 1.0, |x| (acos_turns(x as f32) as f64 - libm::acos(x) / TAU).abs()) < 1e-7);
        assert_eq!(atan2_turns(0.0f32, 0.0), 0.0);
        assert_eq!(acos_turns(-1.0f32), 0.5);
    }
}
