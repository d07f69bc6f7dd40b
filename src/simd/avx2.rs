//! Eight lanes: AVX2.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::sixteen::Two;
use super::x86::{assert_in_range, half_bytes_in_reverse};
use super::{Float, Int, Kernel, Lanes, Mask, Outlined};

x86_set! {
    /// The lanes of AVX2.
    Avx2 {
        type Queue = F32x8;
        type Node = Two<F32x8>;
        type Block = F32x8;
    }
    "avx" "avx2" "fma" "bmi1" "bmi2" "lzcnt" "popcnt"
}

// A lane of a mask has all bits set, or none.
wide_lanes!(F32x8(__m256), I32x8(__m256i), M32x8(__m256));

operators! {
    each,
    F32x8: Add::add = _mm256_add_ps, Sub::sub = _mm256_sub_ps, Mul::mul = _mm256_mul_ps,
        Div::div = _mm256_div_ps;
    I32x8: Add::add = _mm256_add_epi32, Sub::sub = _mm256_sub_epi32, Mul::mul = _mm256_mullo_epi32,
        BitAnd::bitand = _mm256_and_si256, BitOr::bitor = _mm256_or_si256, BitXor::bitxor = _mm256_xor_si256;
    M32x8: BitAnd::bitand = _mm256_and_ps, BitOr::bitor = _mm256_or_ps, BitXor::bitxor = _mm256_xor_ps;
}

impl Mask for M32x8 {
    instructions! {
        fn bits(self) -> u32 => _mm256_movemask_ps(self.0) as u32;
        fn from_bits(bits: u32) -> Self => {
            let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lane);
            Self(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane)))
        };
    }
}

neg_and_transpose!(F32x8, _mm256_unpacklo_ps, _mm256_unpackhi_ps, _mm256_shuffle_ps);

impl Float for F32x8 {
    x86_float! {
        8, I32x8, M32x8;
        gather(table, index, mask) = _mm256_mask_i32gather_ps::<4>(_mm256_setzero_ps(), table, index, mask);
        keep(values, mask) = _mm256_and_ps(mask, values);
        three(from) = _mm_maskload_ps(from, _mm_setr_epi32(-1, -1, -1, 0));
        join(quarters) = _mm256_set_m128(quarters[1], quarters[0]);
        split(register) = [_mm256_castps256_ps128(register), _mm256_extractf128_ps::<1>(register)];
    }
    instructions! {
        fn splat(value: f32) -> Self => Self(_mm256_set1_ps(value));
        fn compress(self, mask: M32x8, out: &mut [f32]) =>
            Self(_mm256_permutevar8x32_ps(self.0, front(mask))).store(out);
        fn least(self) -> f32 => {
            let half = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
            _mm_cvtss_f32(_mm_min_ss(pair, _mm_shuffle_ps::<1>(pair, pair)))
        };
        fn sqrt(self) -> Self => Self(_mm256_sqrt_ps(self.0));
        fn min(self, other: Self) -> Self => Self(_mm256_min_ps(self.0, other.0));
        fn max(self, other: Self) -> Self => Self(_mm256_max_ps(self.0, other.0));
        fn floor(self) -> Self => Self(_mm256_floor_ps(self.0));
        fn to_int(self) -> I32x8 => I32x8(_mm256_cvttps_epi32(self.0));
        fn to_bits(self) -> I32x8 => I32x8(_mm256_castps_si256(self.0));
        fn lt(self, other: Self) -> M32x8 => M32x8(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0));
        fn le(self, other: Self) -> M32x8 => M32x8(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0));
        fn eq(self, other: Self) -> M32x8 => M32x8(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0));
        fn select(mask: M32x8, yes: Self, no: Self) -> Self => Self(_mm256_blendv_ps(no.0, yes.0, mask.0));
    }
}

impl Int for I32x8 {
    wide_int!(8, F32x8, M32x8);
    reverse_bits!(_mm256_broadcastsi128_si256, _mm256_shuffle_epi8);
    instructions! {
        fn splat(value: u32) -> Self => Self(_mm256_set1_epi32(value as i32));
        fn compress(self, mask: M32x8, out: &mut [u32]) =>
            Self(_mm256_permutevar8x32_epi32(self.0, front(mask))).store(out);
        fn shl<const N: i32>(self) -> Self => Self(_mm256_slli_epi32::<N>(self.0));
        fn shr<const N: i32>(self) -> Self => Self(_mm256_srli_epi32::<N>(self.0));
        fn eq(self, other: Self) -> M32x8 => M32x8(_mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0)));
        fn lt(self, other: Self) -> M32x8 => {
            let (a, b) = (self ^ Self::splat(1 << 31), other ^ Self::splat(1 << 31));
            M32x8(_mm256_castsi256_ps(_mm256_cmpgt_epi32(b.0, a.0)))
        };
        fn to_float(self) -> F32x8 => F32x8(_mm256_cvtepi32_ps(self.0));
        fn reinterpret(self) -> F32x8 => F32x8(_mm256_castsi256_ps(self.0));
    }
}

/// The lanes of each mask, packed together, a byte each.
static PACKED: [u64; 256] = {
    let mut packed = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut place) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                packed[mask] |= (lane as u64) << (8 * place);
                place += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    packed
};

/// The permutation that brings the lanes of a mask to the front.
#[inline(always)]
fn front(mask: M32x8) -> __m256i {
    let lanes = PACKED[mask.bits() as usize & 255];
    // SAFETY: as in `instructions`.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes as i64)) }
}
