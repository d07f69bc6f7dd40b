//! The sixteen children of a node in one register. (Safety as in `instructions` beside it: only kernels under
//! [`super::run`] use the type.)

use std::arch::x86_64::*;

use super::F32x16;
use crate::simd::{Float, Mask, Sixteen};

impl Sixteen for F32x16 {
    inlined! {
        fn splat(value: f32) -> Self => Float::splat(value);
        fn load(values: &[f32; 16]) -> Self => Float::load(values);
        fn store(self, out: &mut [f32; 16]) => Float::store(self, out);
        fn min(self, other: Self) -> Self => Float::min(self, other);
        fn max(self, other: Self) -> Self => Float::max(self, other);
        fn le(self, other: Self) -> u32 => Float::le(self, other).bits();
    }
    #[inline(always)]
    fn take_in_order(
        near: Self,
        far: Self,
        words: &[u32; 16],
        back_to_front: u64,
        nears: &mut [f32; 16],
        out: &mut [u32; 16],
    ) -> (u32, u32) {
        // SAFETY: the arrays have 16 words and room for 16 numbers each; as in `instructions`.
        unsafe {
            let places = places(back_to_front);
            let near = _mm512_permutexvar_ps(places, near.0);
            let far = _mm512_permutexvar_ps(places, far.0);
            let words = _mm512_permutexvar_epi32(places, _mm512_loadu_si512(words.as_ptr().cast()));
            let mask = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(near, far);
            let (entered, near) = (u32::from(mask), _mm512_maskz_compress_ps(mask, near));
            let packed = _mm512_maskz_compress_epi32(mask, words);
            let count = entered.count_ones();
            if count <= 8 {
                // The shorter a store, the fewer loads have to wait for it.
                _mm256_storeu_ps(nears.as_mut_ptr(), _mm512_castps512_ps256(near));
                _mm256_storeu_si256(out.as_mut_ptr().cast(), _mm512_castsi512_si256(packed));
            } else {
                _mm512_storeu_ps(nears.as_mut_ptr(), near);
                _mm512_storeu_si512(out.as_mut_ptr().cast(), packed);
            }
            // The word of the first one to visit, by its lane: reading back what was just written would take longer.
            let lane = _mm_cvtsi32_si128(31 - entered.leading_zeros() as i32);
            let first = _mm512_permutexvar_epi32(_mm512_castsi128_si512(lane), words);
            (_mm_cvtsi128_si32(_mm512_castsi512_si128(first)) as u32, count)
        }
    }
    #[inline(always)]
    fn take_entered(near: Self, far: Self, words: &[u32; 16], out: &mut [u32; 16]) -> (u32, u32) {
        // SAFETY: the arrays have 16 words and room for 16; as in `instructions`.
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
        // SAFETY: as in `instructions`.
        unsafe {
            let places = _mm512_and_si512(places(order), _mm512_set1_epi32(15));
            let shifted = _mm512_srlv_epi32(_mm512_set1_epi32(bits as i32), places);
            u32::from(_mm512_test_epi32_mask(shifted, _mm512_set1_epi32(1)))
        }
    }
}

/// Place i of an order in the four lowest bits of lane i, with later places in the bits above.
#[inline(always)]
fn places(order: u64) -> __m512i {
    // SAFETY: as in `instructions`.
    unsafe {
        _mm512_srlv_epi64(_mm512_set1_epi64(order as i64), _mm512_set_epi64(28, 24, 20, 16, 12, 8, 4, 0))
    }
}
