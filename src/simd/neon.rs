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

// A lane of a mask has all bits set, or none.
wide_lanes!(F32x8(float32x4_t, float32x4_t), I32x8(uint32x4_t, uint32x4_t), M32x8(uint32x4_t, uint32x4_t));

/// Applies an instruction to each register.
macro_rules! each {
    ($type:ident, $instruction:ident, $($value:expr),+) => {
        // SAFETY: the instruction belongs to NEON, which is part of the architecture.
        unsafe { $type($instruction($($value.0),+), $instruction($($value.1),+)) }
    };
}

operators! {
    each,
    F32x8: Add::add = vaddq_f32, Sub::sub = vsubq_f32, Mul::mul = vmulq_f32, Div::div = vdivq_f32;
    I32x8: Add::add = vaddq_u32, Sub::sub = vsubq_u32, Mul::mul = vmulq_u32,
        BitAnd::bitand = vandq_u32, BitOr::bitor = vorrq_u32, BitXor::bitxor = veorq_u32;
    M32x8: BitAnd::bitand = vandq_u32, BitOr::bitor = vorrq_u32, BitXor::bitxor = veorq_u32;
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(Self, vnegq_f32, self)
    }
}

/// The bit of each lane.
const LANES: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

impl Mask for M32x8 {
    instructions! {
        fn bits(self) -> u32 => {
            let lanes = I32x8::load(&LANES);
            vaddvq_u32(vandq_u32(self.0, lanes.0)) + vaddvq_u32(vandq_u32(self.1, lanes.1))
        };
    }
    inlined! {
        fn from_bits(bits: u32) -> Self => each!(Self, vtstq_u32, I32x8::splat(bits), I32x8::load(&LANES));
    }
}

impl Float for F32x8 {
    wide_float!(8, I32x8, M32x8);

    #[inline(never)]
    fn outlined<P: Outlined>(part: P) -> P::Output {
        part.run()
    }
    #[inline(always)]
    fn compress(self, mask: M32x8, out: &mut [f32]) {
        let mut lanes = [0.0; 8];
        self.store(&mut lanes);
        pack(&lanes, mask.bits(), out);
    }
    #[inline(always)]
    fn gather(table: &[f32], index: I32x8, mask: M32x8) -> Self {
        // One lane at a time: NEON has no gather.
        let mut places = [0; 8];
        index.store(&mut places);
        let bits = mask.bits();
        let mut out = [0.0; 8];
        for (lane, (value, place)) in out.iter_mut().zip(places).enumerate() {
            if bits >> lane & 1 == 1 {
                *value = table[place as usize];
            }
        }
        Self::load(&out)
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
    fn to_int(self) -> I32x8 {
        // NEON's conversion saturates instead, and converts NaN to zero.
        let fits = self.ge(Self::splat(-2_147_483_648.0)) & self.lt(Self::splat(2_147_483_648.0));
        // SAFETY: as for `each`.
        let whole = unsafe {
            I32x8(vreinterpretq_u32_s32(vcvtq_s32_f32(self.0)), vreinterpretq_u32_s32(vcvtq_s32_f32(self.1)))
        };
        I32x8::select(fits, whole, I32x8::splat(1 << 31))
    }
    instructions! {
        fn splat(value: f32) -> Self => Self(vdupq_n_f32(value), vdupq_n_f32(value));
    }
    inlined! {
        fn abs(self) -> Self => each!(Self, vabsq_f32, self);
        fn sqrt(self) -> Self => each!(Self, vsqrtq_f32, self);
        // NEON's own minimum of a number and a NaN is NaN.
        fn min(self, other: Self) -> Self => Self::select(self.lt(other), self, other);
        fn max(self, other: Self) -> Self => Self::select(self.gt(other), self, other);
        fn floor(self) -> Self => each!(Self, vrndmq_f32, self);
        fn to_bits(self) -> I32x8 => each!(I32x8, vreinterpretq_u32_f32, self);
        fn lt(self, other: Self) -> M32x8 => each!(M32x8, vcltq_f32, self, other);
        fn le(self, other: Self) -> M32x8 => each!(M32x8, vcleq_f32, self, other);
        fn eq(self, other: Self) -> M32x8 => each!(M32x8, vceqq_f32, self, other);
        fn select(mask: M32x8, yes: Self, no: Self) -> Self => each!(Self, vbslq_f32, mask, yes, no);
    }
}

impl Int for I32x8 {
    wide_int!(8, F32x8, M32x8);

    #[inline(always)]
    fn compress(self, mask: M32x8, out: &mut [u32]) {
        let mut lanes = [0; 8];
        self.store(&mut lanes);
        pack(&lanes, mask.bits(), out);
    }
    instructions! {
        fn splat(value: u32) -> Self => Self(vdupq_n_u32(value), vdupq_n_u32(value));
        fn shl<const N: i32>(self) -> Self =>
            Self(vshlq_u32(self.0, vdupq_n_s32(N)), vshlq_u32(self.1, vdupq_n_s32(N)));
        fn shr<const N: i32>(self) -> Self =>
            Self(vshlq_u32(self.0, vdupq_n_s32(-N)), vshlq_u32(self.1, vdupq_n_s32(-N)));
        fn to_float(self) -> F32x8 =>
            F32x8(vcvtq_f32_s32(vreinterpretq_s32_u32(self.0)), vcvtq_f32_s32(vreinterpretq_s32_u32(self.1)));
    }
    inlined! {
        fn eq(self, other: Self) -> M32x8 => each!(M32x8, vceqq_u32, self, other);
        fn lt(self, other: Self) -> M32x8 => each!(M32x8, vcltq_u32, self, other);
        fn reinterpret(self) -> F32x8 => each!(F32x8, vreinterpretq_f32_u32, self);
    }
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
