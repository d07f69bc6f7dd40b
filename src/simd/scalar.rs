//! One lane: plain `f32` and `u32`. The oracle for the wide types.

use std::num::Wrapping;

use super::{Float, Int, Kernel, Lanes, Mask, Outlined};

/// The portable lanes, for any processor.
pub(super) struct Portable;

impl Lanes for Portable {
    type Queue = f32;
    type Node = super::sixteen::Plain;
    type Block = f32;

    #[inline(never)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Self>()
    }
}

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits & 1 != 0
    }
}

impl Float for f32 {
    const WIDTH: usize = 1;
    type Mask = bool;
    type Int = Wrapping<u32>;

    #[inline(never)]
    fn outlined<P: Outlined>(part: P) -> P::Output {
        part.run()
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn load(values: &[f32]) -> Self {
        values[0]
    }
    #[inline(always)]
    fn store(self, out: &mut [f32]) {
        out[0] = self;
    }
    #[inline(always)]
    fn compress(self, _: bool, out: &mut [f32]) {
        out[0] = self;
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Wrapping<u32>, mask: bool) -> Self {
        if mask { table[index.0 as usize] } else { 0.0 }
    }
    #[inline(always)]
    fn load_rows(table: &[[f32; 4]], index: Wrapping<u32>) -> [Self; 4] {
        table[index.0 as usize]
    }
    #[inline(always)]
    fn store_rows(columns: [Self; 4], out: &mut [[f32; 4]]) {
        out[0] = columns;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32::floor(self)
    }
    #[inline(always)]
    fn to_int(self) -> Wrapping<u32> {
        let fits = (-2147483648.0..2147483648.0).contains(&self);
        Wrapping(if fits { self as i32 as u32 } else { i32::MIN as u32 })
    }
    #[inline(always)]
    fn to_bits(self) -> Wrapping<u32> {
        Wrapping(f32::to_bits(self))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

impl Int for Wrapping<u32> {
    type Mask = bool;
    type Float = f32;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Wrapping(value)
    }
    #[inline(always)]
    fn load(values: &[u32]) -> Self {
        Wrapping(values[0])
    }
    #[inline(always)]
    fn store(self, out: &mut [u32]) {
        out[0] = self.0;
    }
    #[inline(always)]
    fn compress(self, _: bool, out: &mut [u32]) {
        out[0] = self.0;
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self, mask: bool) -> Self {
        Wrapping(if mask { table[index.0 as usize] } else { 0 })
    }
    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        Wrapping(self.0 << N)
    }
    #[inline(always)]
    fn shr<const N: i32>(self) -> Self {
        Wrapping(self.0 >> N)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self.0 == other.0
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.0 < other.0
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn to_float(self) -> f32 {
        self.0 as i32 as f32
    }
    #[inline(always)]
    fn reinterpret(self) -> f32 {
        f32::from_bits(self.0)
    }
}
