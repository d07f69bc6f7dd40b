//! Owen-scrambled points of Sobol's sequence: each power-of-two block of them is stratified at every scale, and each
//! seed gives different points.
//!
//! Points are scrambled by hashing (Laine and Karras 2011; Burley, "Practical hash-based Owen scrambling", JCGT 2020):
//! a hash in which each bit depends only on lower bits is a nested uniform scramble of the reversed bits. So all steps
//! but the first and the last work on reversed bits. Sobol's two dimensions are cheap in that form: the first is the
//! (shuffled) index itself, the second is the index multiplied by Pascal's triangle modulo two, in five steps.
//!
//! A pair takes about 100 integer operations: four reversals of 7, three scrambles of 10, three hashes of 9, the
//! triangle's 14 and the conversion.

use crate::math::hash::{mix, to_unit};
use crate::simd::{Float, Int};

/// Point `index` in the unit square of the sequence of `seed`.
#[inline(always)]
pub fn two<F: Float>(index: F::Int, seed: F::Int) -> (F, F) {
    let shuffled = shuffle(index, seed);
    let first = scramble(shuffled, hash(seed, 1));
    let second = scramble(pascal(shuffled), hash(seed, 2));
    (to_unit(first.reverse_bits()), to_unit(second.reverse_bits()))
}

/// Point `index` in the unit interval of the sequence of `seed`.
#[inline(always)]
pub fn one<F: Float>(index: F::Int, seed: F::Int) -> F {
    to_unit(scramble(shuffle(index, seed), hash(seed, 1)).reverse_bits())
}

/// Permutes indices, keeping power-of-two blocks together. Otherwise sequences of different seeds would visit their
/// strata in the same order.
#[inline(always)]
fn shuffle<I: Int>(index: I, seed: I) -> I {
    scramble(index.reverse_bits(), hash(seed, 0)).reverse_bits()
}

/// One of several hashes of a seed.
#[inline(always)]
fn hash<I: Int>(seed: I, which: u32) -> I {
    mix(seed + I::splat(0x9e37_79b9u32.wrapping_mul(which + 1)))
}

/// Nested uniform scramble of reversed bits: a bijection in which each bit is flipped by a hash of the lower bits. The
/// construction is by Laine and Karras; the constants are Vegdahl's ("Building a better LK hash", 2021), whose bits
/// depend on each other as they should.
#[inline(always)]
fn scramble<I: Int>(x: I, seed: I) -> I {
    let x = x ^ (x * I::splat(0x3d20_adea));
    let x = x + seed;
    let x = x * (seed.shr::<16>() | I::splat(1));
    let x = x ^ (x * I::splat(0x0552_6c56));
    x ^ (x * I::splat(0x53a2_2864))
}

/// Sobol's second dimension on reversed bits. Bit k of an index stands for the polynomial (1 + x)ᵏ over the integers
/// modulo two. At every scale, p(x + 1) is the sum of p's halves, followed by the upper half, because (x + 1)ⁿ = xⁿ + 1
/// if n is a power of two.
#[inline(always)]
fn pascal<I: Int>(x: I) -> I {
    let x = x ^ x.shr::<16>();
    let x = x ^ (x.shr::<8>() & I::splat(0x00ff_00ff));
    let x = x ^ (x.shr::<4>() & I::splat(0x0f0f_0f0f));
    let x = x ^ (x.shr::<2>() & I::splat(0x3333_3333));
    x ^ (x.shr::<1>() & I::splat(0x5555_5555))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Isa, Kernel, Lanes, dispatch};
    use std::num::Wrapping;

    fn pair(index: u32, seed: u32) -> (f32, f32) {
        two(Wrapping(index), Wrapping(seed))
    }

    #[test]
    fn reverse_bits_matches_std() {
        for x in [0u32, 1, 0x1234_5678, u32::MAX, 0x8000_0001] {
            assert_eq!(Int::reverse_bits(Wrapping(x)).0, x.reverse_bits());
        }
    }

    /// Compares with the direction numbers of the literature: vₖ₊₁ = vₖ xor vₖ / 2 (Sobol' 1967).
    #[test]
    fn pascal_matches_the_direction_numbers_of_the_second_dimension() {
        for index in (0..5000).chain([u32::MAX, 0xdead_beef]) {
            let (mut direction, mut expected) = (1u32 << 31, 0);
            for bit in 0..32 {
                expected ^= if index >> bit & 1 == 1 { direction } else { 0 };
                direction ^= direction >> 1;
            }
            assert_eq!(Int::reverse_bits(pascal(Wrapping(index))).0, expected);
        }
    }

    #[test]
    fn two_puts_one_point_of_a_block_into_each_elementary_interval() {
        for seed in (0..60u32).map(|s| s.wrapping_mul(0x0101_6b25)) {
            for power in 0..=10u32 {
                let count = 1u32 << power;
                for block in [0, 1, 5, 1000] {
                    let points: Vec<_> = (0..count).map(|i| pair(block * count + i, seed)).collect();
                    for columns in 0..=power {
                        let (width, height) = (1u32 << columns, 1u32 << (power - columns));
                        let mut seen = vec![false; count as usize];
                        for &(u, v) in &points {
                            assert!((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v));
                            let cell = (u * width as f32) as u32 * height + (v * height as f32) as u32;
                            let twice = std::mem::replace(&mut seen[cell as usize], true);
                            assert!(!twice, "seed {seed}, block {block} of {count}, {width} by {height}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn one_puts_one_point_of_a_block_into_each_stratum() {
        for seed in 0..100 {
            for (first, count) in [(0u32, 1024), (3072, 1024), (64, 64)] {
                let mut seen = vec![false; count as usize];
                for i in first..first + count {
                    let u: f32 = one(Wrapping(i), Wrapping(seed));
                    assert!(!std::mem::replace(&mut seen[(u * count as f32) as usize], true));
                }
            }
        }
    }

    #[test]
    fn each_index_is_uniform_over_seeds() {
        for index in [0, 1, 7, 100] {
            let (n, mut counts) = (1 << 16, [0u32; 256]);
            for seed in 0..n {
                let (u, v) = pair(index, seed);
                counts[(u * 16.0) as usize * 16 + (v * 16.0) as usize] += 1;
            }
            let expected = n as f64 / 256.0;
            let chi2: f64 = counts.iter().map(|&c| (c as f64 - expected).powi(2) / expected).sum();
            assert!(chi2 < 330.5, "chi² of 255 degrees of freedom, 0.1 %: {chi2} at {index}");
        }
    }

    /// Mean and mean square of the correlation of the first 64 points of two seeds, over pairs of seeds.
    #[test]
    fn sequences_of_different_seeds_are_uncorrelated() {
        let (n, pairs) = (64u32, 2000u32);
        let (mut mean, mut square) = (0.0, 0.0);
        for k in 0..pairs {
            let correlation: f64 = (0..n)
                .map(|i| (pair(i, 2 * k).0 as f64 - 0.5) * (pair(i, 2 * k + 1).0 as f64 - 0.5))
                .sum::<f64>()
                * 12.0
                / n as f64;
            mean += correlation / pairs as f64;
            square += correlation * correlation / pairs as f64;
        }
        // Shuffles that keep blocks together have a variance of 1.55 / n with exact random scrambles, not 1 / n.
        assert!(mean.abs() < 4.0 * (1.55 / f64::from(n * pairs)).sqrt(), "{mean}");
        assert!((1.4..1.7).contains(&(square * f64::from(n))), "{square}");
    }

    #[test]
    fn error_of_a_smooth_integral_falls_faster_than_1_over_n() {
        // ∫ (x² y + x y³ + (1 − x)² (1 − y)) = 1/6 + 1/8 + 1/6.
        let f = |(x, y): (f32, f32)| {
            let (x, y) = (x as f64, y as f64);
            x * x * y + x * y * y * y + (1.0 - x) * (1.0 - x) * (1.0 - y)
        };
        let exact = 1.0 / 6.0 + 1.0 / 8.0 + 1.0 / 6.0;
        let error = |n: u32| {
            let seeds = 100;
            let square = |seed| {
                let mean = (0..n).map(|i| f(pair(i, seed))).sum::<f64>() / n as f64;
                (mean - exact) * (mean - exact)
            };
            ((0..seeds).map(square).sum::<f64>() / seeds as f64).sqrt()
        };
        let slope = (error(1024) / error(16)).log2() / 6.0;
        assert!(slope < -1.25, "N to the power of {slope}");
    }

    /// The bits of points of both kinds at 64 indices.
    struct Points;

    impl Kernel for Points {
        type Output = Vec<u32>;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<u32> {
            let mut bits = Vec::new();
            points::<L::Queue>(&mut bits);
            bits
        }
    }

    #[inline(always)]
    fn points<F: Float>(bits: &mut Vec<u32>) {
        let indices: Vec<u32> = (0..64).map(|i| i * i * 77).collect();
        let mut row = [0; 16];
        for first in (0..64).step_by(F::WIDTH) {
            let index = F::Int::load(&indices[first..]);
            let (u, v) = two::<F>(index, index * F::Int::splat(3));
            let w = one::<F>(index, index + F::Int::splat(9));
            (u.to_bits() ^ (v.to_bits() * F::Int::splat(3)) ^ (w.to_bits() * F::Int::splat(5)))
                .store(&mut row);
            bits.extend_from_slice(&row[..F::WIDTH]);
        }
    }

    #[test]
    fn every_level_gives_the_same_bits() {
        for isa in Isa::available() {
            assert_eq!(dispatch(isa, Points), dispatch(Isa::PORTABLE, Points), "{isa:?}");
        }
    }
}
