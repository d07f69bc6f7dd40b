//! Sixteen lanes: AVX-512.

mod children;

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::avx2::F32x8;
use super::x86::{assert_in_range, half_bytes_in_reverse};
use super::{Float, Int, Kernel, Lanes, Mask, Outlined, opaque};

x86_set! {
    /// The lanes of AVX-512 with the extensions of every processor since 2017 that has it.
    Avx512 {
        type Queue = F32x16;
        type Node = F32x16;
        type Block = F32x8;
    }
    "avx" "avx2" "fma" "bmi1" "bmi2" "lzcnt" "popcnt" "avx512f" "avx512vl" "avx512dq" "avx512bw"
}

// A mask has one bit a lane.
wide_lanes!(F32x16(__m512), I32x16(__m512i), M32x16(__mmask16));

operators! {
    each,
    F32x16: Add::add = _mm512_add_ps, Sub::sub = _mm512_sub_ps, Mul::mul = _mm512_mul_ps,
        Div::div = _mm512_div_ps;
    I32x16: Add::add = _mm512_add_epi32, Sub::sub = _mm512_sub_epi32, Mul::mul = _mm512_mullo_epi32,
        BitAnd::bitand = _mm512_and_si512, BitOr::bitor = _mm512_or_si512, BitXor::bitxor = _mm512_xor_si512;
    M32x16: BitAnd::bitand = _kand_mask16, BitOr::bitor = _kor_mask16, BitXor::bitxor = _kxor_mask16;
}

impl Mask for M32x16 {
    inlined! {
        fn bits(self) -> u32 => self.0 as u32;
        fn from_bits(bits: u32) -> Self => Self(bits as __mmask16);
    }
}

neg_and_transpose!(F32x16, _mm512_unpacklo_ps, _mm512_unpackhi_ps, _mm512_shuffle_ps);

impl Float for F32x16 {
    x86_float! {
        16, I32x16, M32x16;
        gather(table, index, mask) = _mm512_mask_i32gather_ps::<4>(_mm512_setzero_ps(), mask, index, table);
        keep(values, mask) = _mm512_maskz_mov_ps(mask, values);
        three(from) = _mm_maskz_loadu_ps(0b111, from);
        join(quarters) = {
            let four = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(quarters[0]), quarters[1]);
            _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(four, quarters[2]), quarters[3])
        };
        split(register) = [
            _mm512_castps512_ps128(register),
            _mm512_extractf32x4_ps::<1>(register),
            _mm512_extractf32x4_ps::<2>(register),
            _mm512_extractf32x4_ps::<3>(register),
        ];
    }
    #[inline(always)]
    fn splat_halves(low: f32, high: f32) -> Self {
        // If it knows the mask, the compiler prefers two shuffles.
        let upper = opaque(0xff00) as __mmask16;
        // SAFETY: as in `instructions`.
        unsafe { Self(_mm512_mask_broadcastss_ps(_mm512_set1_ps(low), upper, _mm_set_ss(high))) }
    }
    #[inline(always)]
    fn load_halves(low: &[f32; 8], high: &[f32; 8]) -> Self {
        // SAFETY: the arrays have 8 floats each; as in `instructions`.
        unsafe {
            let (low, high) = (_mm256_loadu_ps(low.as_ptr()), _mm256_loadu_ps(high.as_ptr()));
            Self(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high))
        }
    }
    #[inline(always)]
    fn least_of_four(columns: [Self; 4]) -> [f32; 4] {
        let [a, b, c, d] = transpose(columns);
        let rows = Float::min(Float::min(a, b), Float::min(c, d)).0;
        let mut least = [0.0; 4];
        // SAFETY: the array has room for four floats; as in `instructions`.
        unsafe {
            let rows = _mm256_min_ps(_mm512_castps512_ps256(rows), _mm512_extractf32x8_ps::<1>(rows));
            let row = _mm_min_ps(_mm256_castps256_ps128(rows), _mm256_extractf128_ps::<1>(rows));
            _mm_storeu_ps(least.as_mut_ptr(), row);
        }
        least
    }
    instructions! {
        fn splat(value: f32) -> Self => Self(_mm512_set1_ps(value));
        fn compress(self, mask: M32x16, out: &mut [f32]) =>
            Float::store(Self(_mm512_maskz_compress_ps(mask.0, self.0)), out);
        fn sqrt(self) -> Self => Self(_mm512_sqrt_ps(self.0));
        fn min(self, other: Self) -> Self => Self(_mm512_min_ps(self.0, other.0));
        fn max(self, other: Self) -> Self => Self(_mm512_max_ps(self.0, other.0));
        // Selects the larger absolute value, 3, with the sign cleared, 2.
        fn max_abs(self, other: Self) -> Self => Self(_mm512_range_ps::<{ 2 << 2 | 3 }>(self.0, other.0));
        fn floor(self) -> Self =>
            Self(_mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0));
        fn to_int(self) -> I32x16 => I32x16(_mm512_cvttps_epi32(self.0));
        fn to_bits(self) -> I32x16 => I32x16(_mm512_castps_si512(self.0));
        fn lt(self, other: Self) -> M32x16 => M32x16(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0));
        fn le(self, other: Self) -> M32x16 => M32x16(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0));
        fn eq(self, other: Self) -> M32x16 => M32x16(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0));
        fn select(mask: M32x16, yes: Self, no: Self) -> Self =>
            Self(_mm512_mask_blend_ps(mask.0, no.0, yes.0));
    }
}

impl Int for I32x16 {
    wide_int!(16, F32x16, M32x16);
    reverse_bits!(_mm512_broadcast_i32x4, _mm512_shuffle_epi8);
    instructions! {
        fn splat(value: u32) -> Self => Self(_mm512_set1_epi32(value as i32));
        fn compress(self, mask: M32x16, out: &mut [u32]) =>
            Self(_mm512_maskz_compress_epi32(mask.0, self.0)).store(out);
        fn shl<const N: i32>(self) -> Self => Self(_mm512_sllv_epi32(self.0, _mm512_set1_epi32(N)));
        fn shr<const N: i32>(self) -> Self => Self(_mm512_srlv_epi32(self.0, _mm512_set1_epi32(N)));
        fn eq(self, other: Self) -> M32x16 => M32x16(_mm512_cmpeq_epi32_mask(self.0, other.0));
        fn lt(self, other: Self) -> M32x16 => M32x16(_mm512_cmplt_epu32_mask(self.0, other.0));
        fn select(mask: M32x16, yes: Self, no: Self) -> Self =>
            Self(_mm512_mask_blend_epi32(mask.0, no.0, yes.0));
        fn to_float(self) -> F32x16 => F32x16(_mm512_cvtepi32_ps(self.0));
        fn reinterpret(self) -> F32x16 => F32x16(_mm512_castsi512_ps(self.0));
    }
}
