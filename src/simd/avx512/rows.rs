//! Rows of a table as columns, by loads and shuffles.

use std::arch::x86_64::*;

use super::{I32x16, M32x16};
use crate::simd::Int;

/// Loads three consecutive entries for each lane, as columns; zero outside the mask. Sixteen loads and some shuffles
/// take less time than three gathers.
///
/// # Safety
///
/// The conditions of [`super::run`] hold. In each lane of the mask three entries must exist, and the mask must have a lane.
#[inline(always)]
pub unsafe fn three_entries(table: *const f32, first: I32x16, mask: M32x16) -> [__m512; 3] {
    let mut places = [0; 16];
    // Lanes outside the mask read the table's front, which has three entries because those of some lane exist.
    I32x16::select(mask, first, I32x16::splat(0)).store(&mut places);
    // SAFETY: by the caller.
    unsafe {
        let rows = [
            four_times_three(table, &places, 0),
            four_times_three(table, &places, 1),
            four_times_three(table, &places, 2),
            four_times_three(table, &places, 3),
        ];
        let [a, b, c, _] = transpose(rows);
        [_mm512_maskz_mov_ps(mask.0, a), _mm512_maskz_mov_ps(mask.0, b), _mm512_maskz_mov_ps(mask.0, c)]
    }
}

/// Loads three entries from places i, i + 4, i + 8 and i + 12 on, side by side.
///
/// # Safety
///
/// The conditions of [`super::run`] hold, and from each of these places on three entries must exist.
#[inline(always)]
unsafe fn four_times_three(table: *const f32, places: &[u32; 16], i: usize) -> __m512 {
    const THREE: __mmask8 = 0b111;
    // SAFETY: by the caller; the fourth is not read.
    unsafe {
        let first = _mm_maskz_loadu_ps(THREE, table.add(places[i] as usize));
        let second = _mm_maskz_loadu_ps(THREE, table.add(places[i + 4] as usize));
        let third = _mm_maskz_loadu_ps(THREE, table.add(places[i + 8] as usize));
        let fourth = _mm_maskz_loadu_ps(THREE, table.add(places[i + 12] as usize));
        let four = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(first), second);
        _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(four, third), fourth)
    }
}

/// Loads the rows at places i, i + 4, i + 8 and i + 12, side by side.
///
/// # Safety
///
/// The conditions of [`super::run`] hold, and the places must lie in the table.
#[inline(always)]
pub unsafe fn four_rows(table: &[[f32; 4]], places: &[u32; 16], i: usize) -> __m512 {
    // SAFETY: by the caller.
    unsafe {
        let table = table.as_ptr();
        let four = _mm512_castps128_ps512(_mm_loadu_ps(table.add(places[i] as usize).cast()));
        let four = _mm512_insertf32x4::<1>(four, _mm_loadu_ps(table.add(places[i + 4] as usize).cast()));
        let four = _mm512_insertf32x4::<2>(four, _mm_loadu_ps(table.add(places[i + 8] as usize).cast()));
        _mm512_insertf32x4::<3>(four, _mm_loadu_ps(table.add(places[i + 12] as usize).cast()))
    }
}

/// Transposes four by four, in each quarter of the registers.
///
/// # Safety
///
/// The conditions of [`super::run`] hold.
#[inline(always)]
pub unsafe fn transpose([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: by the caller.
    unsafe {
        let (ab, cd) = (_mm512_unpacklo_ps(a, b), _mm512_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
        [
            _mm512_shuffle_ps::<0b01_00_01_00>(ab, cd),
            _mm512_shuffle_ps::<0b11_10_11_10>(ab, cd),
            _mm512_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm512_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}
