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
    inlined! {
        fn bits(self) -> u32 => self as u32;
        fn from_bits(bits: u32) -> Self => bits & 1 != 0;
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
    inlined! {
        fn splat(value: f32) -> Self => value;
        fn load(values: &[f32]) -> Self => values[0];
        fn store(self, out: &mut [f32]) => out[0] = self;
        fn compress(self, _: bool, out: &mut [f32]) => out[0] = self;
        fn gather(table: &[f32], index: Wrapping<u32>, mask: bool) -> Self =>
            if mask { table[index.0 as usize] } else { 0.0 };
        fn load_rows(table: &[[f32; 4]], index: Wrapping<u32>) -> [Self; 4] => table[index.0 as usize];
        fn store_rows(columns: [Self; 4], out: &mut [[f32; 4]]) => out[0] = columns;
        fn sqrt(self) -> Self => f32::sqrt(self);
        fn abs(self) -> Self => f32::abs(self);
        fn min(self, other: Self) -> Self => if self < other { self } else { other };
        fn max(self, other: Self) -> Self => if self > other { self } else { other };
        fn floor(self) -> Self => f32::floor(self);
        fn to_int(self) -> Wrapping<u32> => {
            let fits = (-2147483648.0..2147483648.0).contains(&self);
            Wrapping(if fits { self as i32 as u32 } else { i32::MIN as u32 })
        };
        fn to_bits(self) -> Wrapping<u32> => Wrapping(f32::to_bits(self));
        fn lt(self, other: Self) -> bool => self < other;
        fn le(self, other: Self) -> bool => self <= other;
        fn eq(self, other: Self) -> bool => self == other;
        fn select(mask: bool, yes: Self, no: Self) -> Self => if mask { yes } else { no };
    }
}

impl Int for Wrapping<u32> {
    type Mask = bool;
    type Float = f32;

    inlined! {
        fn splat(value: u32) -> Self => Wrapping(value);
        fn load(values: &[u32]) -> Self => Wrapping(values[0]);
        fn store(self, out: &mut [u32]) => out[0] = self.0;
        fn compress(self, _: bool, out: &mut [u32]) => out[0] = self.0;
        fn gather(table: &[u32], index: Self, mask: bool) -> Self =>
            Wrapping(if mask { table[index.0 as usize] } else { 0 });
        fn shl<const N: i32>(self) -> Self => Wrapping(self.0 << N);
        fn shr<const N: i32>(self) -> Self => Wrapping(self.0 >> N);
        fn eq(self, other: Self) -> bool => self.0 == other.0;
        fn lt(self, other: Self) -> bool => self.0 < other.0;
        fn select(mask: bool, yes: Self, no: Self) -> Self => if mask { yes } else { no };
        fn to_float(self) -> f32 => self.0 as i32 as f32;
        fn reinterpret(self) -> f32 => f32::from_bits(self.0);
    }
}
