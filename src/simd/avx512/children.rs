//! The sixteen children of a node in one register. (Safety is as for the operators beside it: the type is known only
//! to kernels under [`super::run`].)

use std::arch::x86_64::*;

use super::F32x16;
use crate::simd::sixteen;
use crate::simd::{Float, Mask, Sixteen};

impl Sixteen for F32x16 {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Float::splat(value)
    }
    #[inline(always)]
    fn load(values: &[f32; 16]) -> Self {
        Float::load(values)
    }
    #[inline(always)]
    fn store(self, out: &mut [f32; 16]) {
        Float::store(self, out);
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Float::min(self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Float::max(self, other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        Float::le(self, other).bits()
    }
    #[inline(always)]
    fn take_in_order(
        near: Self,
        far: Self,
        words: &[u32; 16],
        order: u64,
        out: &mut [u64; 16],
    ) -> (u64, u32) {
        // SAFETY: 16 words are there; there is room for 16 keys, and no more than 8 + 8 are written; as for the
        // operators.
        let count = unsafe {
            let words = _mm512_loadu_si512(words.as_ptr().cast());
            let places = places(order);
            let entered = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(
                _mm512_permutexvar_ps(places, near.0),
                _mm512_permutexvar_ps(places, far.0),
            );
            let pairs = _mm512_set_epi32(28, 28, 24, 24, 20, 20, 16, 16, 12, 12, 8, 8, 4, 4, 0, 0);
            let of = _mm512_set_epi32(16, 0, 16, 0, 16, 0, 16, 0, 16, 0, 16, 0, 16, 0, 16, 0);
            let fifteen = _mm512_set1_epi32(15);
            let distances = _mm512_castps_si512(near.0);
            // A word and its distance each.
            let back = _mm512_srlv_epi32(_mm512_set1_epi32(order as i32), pairs);
            let back = _mm512_or_si512(_mm512_and_si512(back, fifteen), of);
            let front = _mm512_srlv_epi32(_mm512_set1_epi32((order >> 32) as i32), pairs);
            let front = _mm512_or_si512(_mm512_and_si512(front, fifteen), of);
            let back = _mm512_permutex2var_epi32(words, back, distances);
            let front = _mm512_permutex2var_epi32(words, front, distances);
            let place = out.as_mut_ptr();
            let behind = entered as __mmask8;
            _mm512_storeu_si512(place.cast(), _mm512_maskz_compress_epi64(behind, back));
            let place = place.add(behind.count_ones() as usize);
            _mm512_storeu_si512(place.cast(), _mm512_maskz_compress_epi64((entered >> 8) as __mmask8, front));
            u32::from(entered).count_ones()
        };
        (out[count.wrapping_sub(1) as usize & 15], count)
    }
    #[inline(always)]
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
        // SAFETY: 16 words are there, and room for 16; as for the operators.
        let entered = unsafe {
            let entered = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(near.0, far.0);
            let packed = _mm512_maskz_compress_epi32(entered, _mm512_loadu_si512(words.as_ptr().cast()));
            _mm512_storeu_si512(out.as_mut_ptr().cast(), packed);
            u32::from(entered)
        };
        let last = 31 - (entered.leading_zeros() & 31);
        (words[last as usize & 15], entered.count_ones())
    }
    #[inline(always)]
    fn in_order(bits: u32, order: u64) -> u32 {
        // SAFETY: as for the operators.
        unsafe {
            let places = _mm512_and_si512(places(order), _mm512_set1_epi32(15));
            let shifted = _mm512_srlv_epi32(_mm512_set1_epi32(bits as i32), places);
            u32::from(_mm512_test_epi32_mask(shifted, _mm512_set1_epi32(1)))
        }
    }
    #[inline(always)]
    fn last_within(keys: &[u64; 8], limit: f32) -> usize {
        let most = sixteen::key(limit, u32::MAX);
        // SAFETY: 8 keys are there; as for the operators.
        let within = unsafe {
            let keys = _mm512_loadu_si512(keys.as_ptr().cast());
            _mm512_cmple_epu64_mask(keys, _mm512_set1_epi64(most as i64))
        };
        (31 - u32::from(within).leading_zeros() as i32).max(0) as usize
    }
}

/// Place i of an order (four bits each) in the four lowest bits of lane i; above them is what comes after it.
#[inline(always)]
fn places(order: u64) -> __m512i {
    // SAFETY: as for the operators.
    unsafe {
        let (low, high) = (_mm256_set1_epi32(order as i32), _mm256_set1_epi32((order >> 32) as i32));
        let shifts = _mm512_set_epi32(28, 24, 20, 16, 12, 8, 4, 0, 28, 24, 20, 16, 12, 8, 4, 0);
        _mm512_srlv_epi32(_mm512_inserti64x4::<1>(_mm512_castsi256_si512(low), high), shifts)
    }
}
