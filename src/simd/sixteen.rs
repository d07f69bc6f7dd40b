//! The sixteen children of a node of the acceleration structure: entry distances, and
//! the keys (distance, child) by which they wait on a ray's stack.

use std::ops::{Mul, Sub};

use super::{Float, Mask};

/// No key: what [`Sixteen::take_nearest`] returns where there is none.
pub const NO_KEY: u64 = u64::MAX;

/// A distance, at least 0, and a word in one integer whose order is that of the distances.
#[inline(always)]
pub fn key(distance: f32, word: u32) -> u64 {
    u64::from(distance.to_bits()) << 32 | u64::from(word)
}

/// The distance of a [`key`].
#[inline(always)]
pub fn key_distance(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

/// Sixteen floats, however many lanes the machine has. The operations are those of
/// [`super::Float`]; distances are at least 0.
pub trait Sixteen: Copy + Sub<Output = Self> + Mul<Output = Self> + 'static {
    /// The same value sixteen times.
    fn splat(value: f32) -> Self;
    /// From memory.
    fn load(values: &[f32; 16]) -> Self;
    /// To memory.
    fn store(self, out: &mut [f32; 16]);
    /// `if self < other { self } else { other }`: a NaN gives `other`.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: a NaN gives `other`.
    fn max(self, other: Self) -> Self;
    /// Bit i: `self[i] <= other[i]`.
    fn le(self, other: Self) -> u32;
    /// The least of the keys (`self[i]`, `words[i]`) for which bit i is set, [`NO_KEY`] if
    /// there is none. The others go to the front of `out`; behind them it is undetermined.
    fn take_nearest(self, words: &[u32; 16], bits: u32, out: &mut [u64; 16]) -> u64;
    /// The same for keys (0, `words[i]`): takes the first one in the order of the lanes.
    fn take_first(words: &[u32; 16], bits: u32, out: &mut [u64; 16]) -> u64;
    /// The place of the last key whose distance is at most `limit`; 0 if there is none.
    fn last_within(keys: &[u64; 8], limit: f32) -> usize;
}

/// Plain floats: the oracle, and what processors without wide registers get.
#[derive(Clone, Copy)]
pub(super) struct Plain([f32; 16]);

impl Sub for Plain {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a -= b;
        }
        self
    }
}

impl Mul for Plain {
    type Output = Self;
    #[inline(always)]
    fn mul(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a *= b;
        }
        self
    }
}

impl Sixteen for Plain {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; 16])
    }
    #[inline(always)]
    fn load(values: &[f32; 16]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self, out: &mut [f32; 16]) {
        *out = self.0;
    }
    #[inline(always)]
    fn min(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = if *a < b { *a } else { b };
        }
        self
    }
    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = if *a > b { *a } else { b };
        }
        self
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        let mut bits = 0;
        for (i, (a, b)) in self.0.iter().zip(other.0).enumerate() {
            bits |= u32::from(*a <= b) << i;
        }
        bits
    }
    #[inline(always)]
    fn take_nearest(self, words: &[u32; 16], bits: u32, out: &mut [u64; 16]) -> u64 {
        take_nearest(&self.0, words, bits, out)
    }
    #[inline(always)]
    fn take_first(words: &[u32; 16], bits: u32, out: &mut [u64; 16]) -> u64 {
        take_first(words, bits, out)
    }
    #[inline(always)]
    fn last_within(keys: &[u64; 8], limit: f32) -> usize {
        last_within(keys, limit)
    }
}

/// In two registers of eight.
#[derive(Clone, Copy)]
pub(super) struct Two<F>(F, F);

impl<F: Float> Sub for Two<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl<F: Float> Mul for Two<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }
}

impl<F: Float> Sixteen for Two<F> {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(F::splat(value), F::splat(value))
    }
    #[inline(always)]
    fn load(values: &[f32; 16]) -> Self {
        Self(F::load(&values[..8]), F::load(&values[8..]))
    }
    #[inline(always)]
    fn store(self, out: &mut [f32; 16]) {
        self.0.store(&mut out[..8]);
        self.1.store(&mut out[8..]);
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        self.0.le(other.0).bits() | self.1.le(other.1).bits() << 8
    }
    #[inline(always)]
    fn take_nearest(self, words: &[u32; 16], bits: u32, out: &mut [u64; 16]) -> u64 {
        let mut distances = [0.0; 16];
        self.store(&mut distances);
        take_nearest(&distances, words, bits, out)
    }
    #[inline(always)]
    fn take_first(words: &[u32; 16], bits: u32, out: &mut [u64; 16]) -> u64 {
        take_first(words, bits, out)
    }
    #[inline(always)]
    fn last_within(keys: &[u64; 8], limit: f32) -> usize {
        last_within(keys, limit)
    }
}

/// See [`Sixteen::take_nearest`].
#[inline(always)]
fn take_nearest(distances: &[f32; 16], words: &[u32; 16], mut bits: u32, out: &mut [u64; 16]) -> u64 {
    let (mut nearest, mut count) = (NO_KEY, 0);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize & 15;
        bits &= bits - 1;
        let found = key(distances[lane], words[lane]);
        // The first one has nothing to leave behind.
        out[count & 15] = found.max(nearest);
        count += usize::from(nearest != NO_KEY);
        nearest = found.min(nearest);
    }
    nearest
}

/// See [`Sixteen::take_first`].
#[inline(always)]
fn take_first(words: &[u32; 16], mut bits: u32, out: &mut [u64; 16]) -> u64 {
    let mut first = NO_KEY;
    let mut count = 0;
    while bits != 0 {
        let word = words[bits.trailing_zeros() as usize & 15];
        bits &= bits - 1;
        if first == NO_KEY {
            first = key(0.0, word);
        } else {
            out[count & 15] = key(0.0, word);
            count += 1;
        }
    }
    first
}

/// See [`Sixteen::last_within`].
#[inline(always)]
fn last_within(keys: &[u64; 8], limit: f32) -> usize {
    (0..8).rev().find(|i| key_distance(keys[*i]) <= limit).unwrap_or(0)
}
