//! The sixteen children of a node of the acceleration structure: entry distances, and
//! the keys (distance, child) by which they wait on a ray's stack.

use std::ops::{Mul, Sub};

use super::{Float, Int, Mask};

/// No key.
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
    /// The keys (`near[i]`, `words[i]`) of those boxes that are entered, where `near[i] <= far[i]`, go to the front
    /// of `out`, with the one to visit first at the end. Returns that one and how many there are; behind them `out`
    /// is undetermined. `order` names the boxes from back to front, four bits each, the lowest first; it is used
    /// where the machine has no better one.
    fn take_in_order(near: Self, far: Self, words: &[u32; 16], order: u64, out: &mut [u64; 16])
    -> (u64, u32);
    /// The words of those boxes go to the front of `out`, in the order of the lanes. Returns the last of them and how
    /// many there are.
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32);
    /// Bit i of the result is the bit of `bits` that place i of `order` (four bits each) names.
    #[inline(always)]
    fn in_order(bits: u32, order: u64) -> u32 {
        (0..16).fold(0, |ordered, i| ordered | (bits >> (order >> (4 * i) & 15) & 1) << i)
    }
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
    fn take_in_order(near: Self, far: Self, words: &[u32; 16], _: u64, out: &mut [u64; 16]) -> (u64, u32) {
        take_in_order(near, far, words, out)
    }
    #[inline(always)]
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
        take_entered(near.le(far), words, out)
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
    fn take_in_order(near: Self, far: Self, words: &[u32; 16], _: u64, out: &mut [u64; 16]) -> (u64, u32) {
        take_in_order(near, far, words, out)
    }
    #[inline(always)]
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
        // Without a branch, where the machine packs lanes without one.
        let (low, high) = (near.0.le(far.0), near.1.le(far.1));
        F::Int::load(&words[..8]).compress(low, &mut out[..8]);
        F::Int::load(&words[8..]).compress(high, &mut out[low.count()..][..8]);
        let entered = low.bits() | high.bits() << 8;
        let last = 31 - (entered.leading_zeros() & 31);
        (words[last as usize & 15], entered.count_ones())
    }
    #[inline(always)]
    fn last_within(keys: &[u64; 8], limit: f32) -> usize {
        last_within(keys, limit)
    }
}

/// See [`Sixteen::take_in_order`]: the nearest last, the others in no order.
#[inline(always)]
fn take_in_order<S: Sixteen>(near: S, far: S, words: &[u32; 16], out: &mut [u64; 16]) -> (u64, u32) {
    let mut bits = near.le(far);
    let entered = bits.count_ones();
    let mut distances = [0.0; 16];
    near.store(&mut distances);
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
    out[count & 15] = nearest;
    (nearest, entered)
}

/// See [`Sixteen::take_entered`].
#[inline(always)]
fn take_entered(mut bits: u32, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
    let count = bits.count_ones();
    let mut last = 0;
    let mut place = 0;
    while bits != 0 {
        last = words[bits.trailing_zeros() as usize & 15];
        bits &= bits - 1;
        out[place & 15] = last;
        place += 1;
    }
    (last, count)
}

/// See [`Sixteen::last_within`].
#[inline(always)]
fn last_within(keys: &[u64; 8], limit: f32) -> usize {
    (0..8).rev().find(|i| key_distance(keys[*i]) <= limit).unwrap_or(0)
}
