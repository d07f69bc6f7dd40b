//! The sixteen children of a node of the acceleration structure: their entry distances, and the order in which entered
//! children are put on a ray's stack.

use std::ops::{Mul, Sub};

use super::{Float, Int, Mask};

/// The number of children.
pub const SIXTEEN: usize = 16;

/// Sixteen floats, however many lanes the machine has. The operations are those of [`super::Float`]; distances are at
/// least 0.
pub trait Sixteen: Copy + Sub<Output = Self> + Mul<Output = Self> + 'static {
    /// Broadcasts to all sixteen.
    fn splat(value: f32) -> Self;
    /// Loads from memory.
    fn load(values: &[f32; 16]) -> Self;
    /// Stores to memory.
    fn store(self, out: &mut [f32; 16]);
    /// `if self < other { self } else { other }`: a NaN gives `other`.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: a NaN gives `other`.
    fn max(self, other: Self) -> Self;
    /// Bit i of the result is set if `self[i] <= other[i]`.
    fn le(self, other: Self) -> u32;
    /// Puts `near[i]` and `words[i]` of the boxes that are entered, where `near[i] <= far[i]`, at the fronts of `nears`
    /// and `out`, with the one to visit first at the end; the values behind them are undefined. Returns the word of
    /// that one and the number of entered boxes. `back_to_front` is an order of the boxes (see [`slot`]); it is used if
    /// the machine has no better one.
    fn take_in_order(
        near: Self,
        far: Self,
        words: &[u32; 16],
        back_to_front: u64,
        nears: &mut [f32; 16],
        out: &mut [u32; 16],
    ) -> (u32, u32);
    /// Puts the words of the boxes that are entered at the front of `out`, in the order of the lanes. Returns the last
    /// of them and their number.
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32);
    /// Permutes bits: bit i of the result is the bit of `bits` that place i of `order` names.
    #[inline(always)]
    fn in_order(bits: u32, order: u64) -> u32 {
        (0..16).fold(0, |ordered, i| ordered | (bits >> slot(order, i) & 1) << i)
    }
}

/// Plain floats: the oracle, and the implementation for processors without wide registers.
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
    inlined! {
        fn splat(value: f32) -> Self => Self([value; 16]);
        fn load(values: &[f32; 16]) -> Self => Self(*values);
        fn store(self, out: &mut [f32; 16]) => *out = self.0;
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
    fn take_in_order(
        near: Self,
        far: Self,
        words: &[u32; 16],
        _: u64,
        nears: &mut [f32; 16],
        out: &mut [u32; 16],
    ) -> (u32, u32) {
        // The nearest comes last, the others in no order.
        let mut bits = near.le(far);
        let count = bits.count_ones();
        let mut distances = [0.0; 16];
        near.store(&mut distances);
        // A distance and a word in one integer, ordered by distance.
        let (mut nearest, mut place) = (u64::MAX, 0);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 15;
            bits &= bits - 1;
            let found = u64::from(distances[lane].to_bits()) << 32 | u64::from(words[lane]);
            let farther = found.max(nearest);
            // The first one displaces none.
            (nears[place & 15], out[place & 15]) = (f32::from_bits((farther >> 32) as u32), farther as u32);
            place += usize::from(nearest != u64::MAX);
            nearest = found.min(nearest);
        }
        (nears[place & 15], out[place & 15]) = (f32::from_bits((nearest >> 32) as u32), nearest as u32);
        (nearest as u32, count)
    }
    #[inline(always)]
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
        let mut bits = near.le(far);
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
}

/// Two registers of eight.
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
    inlined! {
        fn splat(value: f32) -> Self => Self(F::splat(value), F::splat(value));
        fn load(values: &[f32; 16]) -> Self => Self(F::load(&values[..8]), F::load(&values[8..]));
    }
    #[inline(always)]
    fn store(self, out: &mut [f32; 16]) {
        self.0.store(&mut out[..8]);
        self.1.store(&mut out[8..]);
    }
    inlined! {
        fn min(self, other: Self) -> Self => Self(self.0.min(other.0), self.1.min(other.1));
        fn max(self, other: Self) -> Self => Self(self.0.max(other.0), self.1.max(other.1));
        fn le(self, other: Self) -> u32 => self.0.le(other.0).bits() | self.1.le(other.1).bits() << 8;
    }
    #[inline(always)]
    fn take_in_order(
        near: Self,
        far: Self,
        words: &[u32; 16],
        _: u64,
        nears: &mut [f32; 16],
        out: &mut [u32; 16],
    ) -> (u32, u32) {
        // Without a branch: all of them in the order of the lanes, then the last one to the place of the nearest, and
        // the nearest to the end.
        let entered = (near.0.le(far.0), near.1.le(far.1));
        let bits = near.le(far);
        let none = F::splat(f32::INFINITY);
        let least = F::select(entered.0, near.0, none).min(F::select(entered.1, near.1, none)).least();
        let nearest = near.le(Self::splat(least)) & bits;
        let (lane, last) = (nearest.trailing_zeros() & 15, 31 - (bits.leading_zeros() & 31));
        let low = entered.0.count();
        near.0.compress(entered.0, &mut nears[..8]);
        near.1.compress(entered.1, &mut nears[low..][..8]);
        F::Int::load(&words[..8]).compress(entered.0, &mut out[..8]);
        F::Int::load(&words[8..]).compress(entered.1, &mut out[low..][..8]);
        let mut distances = [0.0; 16];
        near.store(&mut distances);
        let place = (bits & ((1 << lane) - 1)).count_ones() as usize & 15;
        (nears[place], out[place]) = (distances[last as usize & 15], words[last as usize & 15]);
        let (word, count) = (words[lane as usize], bits.count_ones());
        let end = count.wrapping_sub(1) as usize & 15;
        (nears[end], out[end]) = (least, word);
        (word, count)
    }
    #[inline(always)]
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
        // Without a branch, if the machine packs lanes without one.
        let (low, high) = (near.0.le(far.0), near.1.le(far.1));
        F::Int::load(&words[..8]).compress(low, &mut out[..8]);
        F::Int::load(&words[8..]).compress(high, &mut out[low.count()..][..8]);
        let entered = low.bits() | high.bits() << 8;
        let last = 31 - (entered.leading_zeros() & 31);
        (words[last as usize & 15], entered.count_ones())
    }
}

/// The slot at a place of an order: four bits each, those at even places in the low half, those at odd places in the
/// high half. So one shift of eight 64-bit lanes brings each of them to the lowest bits of a 32-bit lane.
#[inline(always)]
pub fn slot(order: u64, place: usize) -> usize {
    (order >> shift(place) & 15) as usize
}

/// The position of a place in an order, in bits.
#[inline(always)]
pub fn shift(place: usize) -> usize {
    (place * 34) & 60
}
