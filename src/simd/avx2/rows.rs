//! Rows of a table as columns, by loads and shuffles.

use std::arch::x86_64::*;

use super::{I32x8, M32x8};
use crate::simd::Int;

/// Loads three consecutive entries for each lane, as columns; zero outside the mask. Eight loads and some shuffles take
/// less time than three gathers.
///
/// # Safety
///
/// The conditions of [`super::run`] hold. In each lane of the mask three entries must exist, and the mask must have a lane.
#[inline(always)]
pub unsafe fn three_entries(table: *const f32, first: I32x8, mask: M32x8) -> [__m256; 3] {
    let mut places = [0; 8];
    // Lanes outside the mask read the table's front, which has three entries because those of some lane exist.
    I32x8::select(mask, first, I32x8::splat(0)).store(&mut places);
    // SAFETY: by the caller; the fourth entries are not read.
    unsafe {
        let three = _mm_setr_epi32(-1, -1, -1, 0);
        let mut pairs = [_mm256_setzero_ps(); 4];
        for (i, pair) in pairs.iter_mut().enumerate() {
            let low = _mm_maskload_ps(table.add(places[i] as usize), three);
            let high = _mm_maskload_ps(table.add(places[i + 4] as usize), three);
            *pair = _mm256_set_m128(high, low);
        }
        let [a, b, c, _] = transpose(pairs);
        [_mm256_and_ps(mask.0, a), _mm256_and_ps(mask.0, b), _mm256_and_ps(mask.0, c)]
    }
}

/// Transposes four by four, in each half of the registers.
///
/// # Safety
///
/// The conditions of [`super::run`] hold.
#[inline(always)]
pub unsafe fn transpose([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    // SAFETY: by the caller.
    unsafe {
        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}
