//! Eight lanes in two registers: NEON, which every 64-bit ARM processor has.

use std::arch::aarch64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::sixteen::Two;
use super::{Float, Int, Kernel, Lanes, Mask, Outlined};

/// The lanes of NEON.
pub(super) struct Neon;

impl Lanes for Neon {
    type Queue = F32x8;
    type Node = Two<F32x8>;
    type Block = F32x8;

    #[inline(never)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Self>()
    }
}

/// 8 floats.
#[derive(Clone, Copy)]
pub(super) struct F32x8(float32x4_t, float32x4_t);

/// 8 integers.
#[derive(Clone, Copy)]
pub(super) struct I32x8(uint32x4_t, uint32x4_t);

/// A lane mask: all bits of a lane set, or none.
#[derive(Clone, Copy)]
pub(super) struct M32x8(uint32x4_t, uint32x4_t);

/// Applies an instruction to each register.
macro_rules! each {
    ($type:ident, $intrinsic:ident, $($value:expr),+) => {
        // SAFETY: the instruction belongs to NEON, which is part of the architecture.
        unsafe { $type($intrinsic($($value.0),+), $intrinsic($($value.1),+)) }
    };
}

/// Implements an operator with `each`.
macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                each!($type, $intrinsic, self, other)
            }
        }
    };
}
operator!(F32x8, Add, add, vaddq_f32);
operator!(F32x8, Sub, sub, vsubq_f32);
operator!(F32x8, Mul, mul, vmulq_f32);
operator!(F32x8, Div, div, vdivq_f32);
operator!(I32x8, Add, add, vaddq_u32);
operator!(I32x8, Sub, sub, vsubq_u32);
operator!(I32x8, Mul, mul, vmulq_u32);
operator!(I32x8, BitAnd, bitand, vandq_u32);
operator!(I32x8, BitOr, bitor, vorrq_u32);
operator!(I32x8, BitXor, bitxor, veorq_u32);
operator!(M32x8, BitAnd, bitand, vandq_u32);
operator!(M32x8, BitOr, bitor, vorrq_u32);
operator!(M32x8, BitXor, bitxor, veorq_u32);

impl Not for M32x8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        each!(M32x8, vmvnq_u32, self)
    }
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(F32x8, vnegq_f32, self)
    }
}

/// The bit of each lane.
const LANES: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

impl Mask for M32x8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        let lanes = I32x8::load(&LANES);
        // SAFETY: as for `each`.
        unsafe { vaddvq_u32(vandq_u32(self.0, lanes.0)) + vaddvq_u32(vandq_u32(self.1, lanes.1)) }
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        each!(M32x8, vtstq_u32, I32x8::splat(bits), I32x8::load(&LANES))
    }
}

impl Float for F32x8 {
    const WIDTH: usize = 8;
    type Mask = M32x8;
    type Int = I32x8;

    #[inline(never)]
    fn outlined<P: Outlined>(part: P) -> P::Output {
        part.run()
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as for `each`.
        unsafe { Self(vdupq_n_f32(value), vdupq_n_f32(value)) }
    }
    #[inline(always)]
    fn load(values: &[f32]) -> Self {
        let values = &values[..8];
        // SAFETY: the slice has 8 floats; as for `each`.
        unsafe { Self(vld1q_f32(values.as_ptr()), vld1q_f32(values.as_ptr().add(4))) }
    }
    #[inline(always)]
    fn store(self, out: &mut [f32]) {
        let out = &mut out[..8];
        // SAFETY: the slice has room for 8 floats; as for `each`.
        unsafe {
            vst1q_f32(out.as_mut_ptr(), self.0);
            vst1q_f32(out.as_mut_ptr().add(4), self.1);
        }
    }
    #[inline(always)]
    fn compress(self, mask: M32x8, out: &mut [f32]) {
        let mut lanes = [0.0; 8];
        self.store(&mut lanes);
        pack(&lanes, mask.bits(), out);
    }
    #[inline(always)]
    fn gather(table: &[f32], index: I32x8, mask: M32x8) -> Self {
        Self::load(&gather(table, index, mask))
    }
    #[inline(always)]
    fn load_rows(table: &[[f32; 4]], index: I32x8) -> [Self; 4] {
        let mut places = [0; 8];
        index.store(&mut places);
        let [mut a, mut b, mut c, mut d] = [[0.0; 8]; 4];
        for (lane, place) in places.into_iter().enumerate() {
            [a[lane], b[lane], c[lane], d[lane]] = table[place as usize];
        }
        [Self::load(&a), Self::load(&b), Self::load(&c), Self::load(&d)]
    }
    #[inline(always)]
    fn store_rows([a, b, c, d]: [Self; 4], out: &mut [[f32; 4]]) {
        let out = &mut out[..8];
        let [mut x, mut y, mut z, mut w] = [[0.0; 8]; 4];
        a.store(&mut x);
        b.store(&mut y);
        c.store(&mut z);
        d.store(&mut w);
        for (lane, row) in out.iter_mut().enumerate() {
            *row = [x[lane], y[lane], z[lane], w[lane]];
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(F32x8, vsqrtq_f32, self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        each!(F32x8, vabsq_f32, self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // NEON's own minimum of a number and a NaN is NaN.
        Self::select(self.lt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.gt(other), self, other)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        each!(F32x8, vrndmq_f32, self)
    }
    #[inline(always)]
    fn to_int(self) -> I32x8 {
        // NEON's conversion saturates instead, and converts NaN to zero.
        let fits = self.ge(Self::splat(-2_147_483_648.0)) & self.lt(Self::splat(2_147_483_648.0));
        // SAFETY: as for `each`.
        let whole = unsafe {
            I32x8(vreinterpretq_u32_s32(vcvtq_s32_f32(self.0)), vreinterpretq_u32_s32(vcvtq_s32_f32(self.1)))
        };
        I32x8::select(fits, whole, I32x8::splat(1 << 31))
    }
    #[inline(always)]
    fn to_bits(self) -> I32x8 {
        each!(I32x8, vreinterpretq_u32_f32, self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M32x8 {
        each!(M32x8, vcltq_f32, self, other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> M32x8 {
        each!(M32x8, vcleq_f32, self, other)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M32x8 {
        each!(M32x8, vceqq_f32, self, other)
    }
    #[inline(always)]
    fn select(mask: M32x8, yes: Self, no: Self) -> Self {
        each!(F32x8, vbslq_f32, mask, yes, no)
    }
}

impl Int for I32x8 {
    type Mask = M32x8;
    type Float = F32x8;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        // SAFETY: as for `each`.
        unsafe { Self(vdupq_n_u32(value), vdupq_n_u32(value)) }
    }
    #[inline(always)]
    fn load(values: &[u32]) -> Self {
        let values = &values[..8];
        // SAFETY: the slice has 8 integers; as for `each`.
        unsafe { Self(vld1q_u32(values.as_ptr()), vld1q_u32(values.as_ptr().add(4))) }
    }
    #[inline(always)]
    fn store(self, out: &mut [u32]) {
        let out = &mut out[..8];
        // SAFETY: the slice has room for 8 integers; as for `each`.
        unsafe {
            vst1q_u32(out.as_mut_ptr(), self.0);
            vst1q_u32(out.as_mut_ptr().add(4), self.1);
        }
    }
    #[inline(always)]
    fn compress(self, mask: M32x8, out: &mut [u32]) {
        let mut lanes = [0; 8];
        self.store(&mut lanes);
        pack(&lanes, mask.bits(), out);
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self, mask: M32x8) -> Self {
        Self::load(&gather(table, index, mask))
    }
    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        // SAFETY: as for `each`.
        unsafe {
            let by = vdupq_n_s32(N);
            Self(vshlq_u32(self.0, by), vshlq_u32(self.1, by))
        }
    }
    #[inline(always)]
    fn shr<const N: i32>(self) -> Self {
        // SAFETY: as for `each`.
        unsafe {
            let by = vdupq_n_s32(-N);
            Self(vshlq_u32(self.0, by), vshlq_u32(self.1, by))
        }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M32x8 {
        each!(M32x8, vceqq_u32, self, other)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M32x8 {
        each!(M32x8, vcltq_u32, self, other)
    }
    #[inline(always)]
    fn select(mask: M32x8, yes: Self, no: Self) -> Self {
        each!(I32x8, vbslq_u32, mask, yes, no)
    }
    #[inline(always)]
    fn to_float(self) -> F32x8 {
        // SAFETY: as for `each`.
        unsafe {
            F32x8(vcvtq_f32_s32(vreinterpretq_s32_u32(self.0)), vcvtq_f32_s32(vreinterpretq_s32_u32(self.1)))
        }
    }
    #[inline(always)]
    fn reinterpret(self) -> F32x8 {
        each!(F32x8, vreinterpretq_f32_u32, self)
    }
}

/// Gathers one lane at a time: NEON has no gather.
#[inline(always)]
fn gather<T: Copy + Default>(table: &[T], index: I32x8, mask: M32x8) -> [T; 8] {
    let mut places = [0; 8];
    index.store(&mut places);
    let bits = mask.bits();
    let mut out = [T::default(); 8];
    for (lane, (value, place)) in out.iter_mut().zip(places).enumerate() {
        if bits >> lane & 1 == 1 {
            *value = table[place as usize];
        }
    }
    out
}

/// Packs the lanes of `bits` at the front of `out`, without a branch on them.
#[inline(always)]
fn pack<T: Copy>(lanes: &[T; 8], bits: u32, out: &mut [T]) {
    let out = &mut out[..8];
    let mut next = 0;
    for (lane, &value) in lanes.iter().enumerate() {
        out[next.min(7)] = value;
        next += (bits >> lane & 1) as usize;
    }
}
