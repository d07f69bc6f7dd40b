//! Counter-based random numbers: an integer hash of the place where the number is used.

use crate::simd::{Float, Int};

/// A bijection of 32-bit integers that changes half of the bits for any change of one
/// (the multiply and xor-shift construction, Wellons' "hash prospector" family).
#[inline(always)]
pub fn mix<I: Int>(x: I) -> I {
    let x = x ^ x.shr::<16>();
    let x = x * I::splat(0x21f0_aaad);
    let x = x ^ x.shr::<15>();
    let x = x * I::splat(0xd35a_2d97);
    x ^ x.shr::<15>()
}

/// The hash of a hash and one more integer.
#[inline(always)]
pub fn combine<I: Int>(hash: I, value: I) -> I {
    mix(hash * I::splat(0x9e37_79b1) + value)
}

/// 24 random bits as a float in [0, 1).
#[inline(always)]
pub fn to_unit<F: Float>(bits: F::Int) -> F {
    bits.shr::<8>().to_float() * F::splat(1.0 / 16_777_216.0)
}

/// Selects the random numbers of a sample: a hash of seed, pixel and branch. The sample index is stored separately
/// because stratified patterns need it.
#[derive(Clone, Copy)]
pub struct SampleKey<I> {
    hash: I,
    /// The index of the sample within its pixel.
    pub sample: I,
}

impl<I: Int> SampleKey<I> {
    /// The key of one branch of a path; `branch` is 0 for the branch that starts at the camera.
    #[inline(always)]
    pub fn new(seed: u64, pixel: I, sample: I, branch: I) -> Self {
        let seed = combine(I::splat(seed as u32), I::splat((seed >> 32) as u32));
        Self { hash: combine(combine(seed, pixel), branch), sample }
    }

    /// The key of one of several equal uses (a light, a shadow ray) of the same sample.
    #[inline(always)]
    pub fn fork(self, which: u32) -> Self {
        Self { hash: combine(self.hash, I::splat(which ^ 0x5bd1_e995)), ..self }
    }

    /// The sample's random number in [0, 1) for a dimension.
    #[inline(always)]
    pub fn uniform<F: Float<Int = I>>(self, dimension: I) -> F {
        to_unit(combine(combine(self.hash, dimension), self.sample))
    }

    /// The hash for a dimension that all samples of the pixel share.
    #[inline(always)]
    pub fn pixel_hash(self, dimension: I) -> I {
        combine(self.hash, dimension)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::Wrapping;

    #[test]
    fn numbers_are_uniform_and_dimensions_independent() {
        let n = 1 << 16;
        let draw = |s: u32, d: u32| -> f32 {
            SampleKey::new(7, Wrapping(3), Wrapping(s), Wrapping(0)).uniform(Wrapping(d))
        };
        let (mut bins, mut sum_xy, mut sum_x, mut sum_y) = ([0u32; 64], 0.0f64, 0.0f64, 0.0f64);
        for s in 0..n {
            let (x, y) = (draw(s, 0), draw(s, 1));
            assert!((0.0..1.0).contains(&x));
            bins[(x * 64.0) as usize] += 1;
            sum_xy += (x * y) as f64;
            sum_x += x as f64;
            sum_y += y as f64;
        }
        let expected = n as f64 / 64.0;
        let chi2: f64 = bins.iter().map(|&b| (b as f64 - expected).powi(2) / expected).sum();
        assert!(chi2 < 103.4, "chi² of 63 degrees of freedom, 0.1 %: {chi2}");
        let n = n as f64;
        let correlation = (sum_xy / n - sum_x / n * sum_y / n) * 12.0;
        assert!(correlation.abs() < 0.02, "{correlation}");
    }
}
