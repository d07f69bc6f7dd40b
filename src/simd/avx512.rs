//! Sixteen lanes: AVX-512.

mod children;
mod rows;

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::avx2::F32x8;
use super::{Float, Int, Kernel, Lanes, Mask, Outlined, opaque};
use rows::{four_rows, three_entries, transpose};

/// The lanes of AVX-512 with the extensions of every processor since 2017 that has it.
pub(super) struct Avx512;

impl Lanes for Avx512 {
    type Queue = F32x16;
    type Node = F32x16;
    type Block = F32x8;

    #[inline(always)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        // SAFETY: only kernels under `run` use this type, and the caller of `run` has checked the CPU.
        unsafe { run_outlined(kernel) }
    }
}

/// True if the processor has all the features that [`run`] adds to those of AVX2.
pub(super) fn detected() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
}

/// Runs a kernel compiled for AVX-512.
///
/// # Safety
///
/// [`detected`] and [`super::avx2::detected`] must have returned true.
#[target_feature(enable = "avx,avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
pub(super) unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

/// [`run`], never inlined.
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(never)]
#[target_feature(enable = "avx,avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
unsafe fn run_outlined<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

/// Runs a part of a kernel, never inlined.
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(never)]
#[target_feature(enable = "avx,avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
unsafe fn part_outlined<P: Outlined>(part: P) -> P::Output {
    part.run()
}

/// 16 floats.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F32x16(__m512);

/// 16 integers.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct I32x16(__m512i);

/// A lane mask: one bit a lane.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct M32x16(__mmask16);

impl Mask for M32x16 {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0 as u32
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as __mmask16)
    }
}

/// Implements an operator by one instruction.
macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: values of this type exist only under `run`, whose caller has checked the CPU.
                unsafe { Self($intrinsic(self.0, other.0)) }
            }
        }
    };
}
operator!(F32x16, Add, add, _mm512_add_ps);
operator!(F32x16, Sub, sub, _mm512_sub_ps);
operator!(F32x16, Mul, mul, _mm512_mul_ps);
operator!(F32x16, Div, div, _mm512_div_ps);
operator!(I32x16, Add, add, _mm512_add_epi32);
operator!(I32x16, Sub, sub, _mm512_sub_epi32);
operator!(I32x16, Mul, mul, _mm512_mullo_epi32);
operator!(I32x16, BitAnd, bitand, _mm512_and_si512);
operator!(I32x16, BitOr, bitor, _mm512_or_si512);
operator!(I32x16, BitXor, bitxor, _mm512_xor_si512);

impl BitAnd for M32x16 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for M32x16 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitXor for M32x16 {
    type Output = Self;
    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }
}

impl Not for M32x16 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_xor_ps(self.0, _mm512_set1_ps(-0.0))) }
    }
}

impl Float for F32x16 {
    const WIDTH: usize = 16;
    type Mask = M32x16;
    type Int = I32x16;

    #[inline(always)]
    fn outlined<P: Outlined>(part: P) -> P::Output {
        // SAFETY: only kernels under `run` use this type, and the caller of `run` has checked the CPU.
        unsafe { part_outlined(part) }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_set1_ps(value)) }
    }
    #[inline(always)]
    fn load(values: &[f32]) -> Self {
        let values = &values[..16];
        // SAFETY: the slice has 16 floats; as for the operators.
        unsafe { Self(_mm512_loadu_ps(values.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, out: &mut [f32]) {
        let out = &mut out[..16];
        // SAFETY: the slice has room for 16 floats; as for the operators.
        unsafe { _mm512_storeu_ps(out.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn splat_halves(low: f32, high: f32) -> Self {
        // If it knows the mask, the compiler prefers two shuffles.
        let upper = opaque(0xff00) as __mmask16;
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_mask_broadcastss_ps(_mm512_set1_ps(low), upper, _mm_set_ss(high))) }
    }
    #[inline(always)]
    fn load_halves(low: &[f32; 8], high: &[f32; 8]) -> Self {
        // SAFETY: the arrays have 8 floats each; as for the operators.
        unsafe {
            let (low, high) = (_mm256_loadu_ps(low.as_ptr()), _mm256_loadu_ps(high.as_ptr()));
            Self(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high))
        }
    }
    #[inline(always)]
    fn compress(self, mask: M32x16, out: &mut [f32]) {
        // SAFETY: as for the operators.
        unsafe { Float::store(Self(_mm512_maskz_compress_ps(mask.0, self.0)), out) }
    }
    #[inline(always)]
    fn gather(table: &[f32], index: I32x16, mask: M32x16) -> Self {
        assert_in_range(table.len(), index, mask);
        // SAFETY: in the lanes of the mask, every index is within the table; the others are not read.
        unsafe {
            let zero = _mm512_setzero_ps();
            Self(_mm512_mask_i32gather_ps::<4>(zero, mask.0, index.0, table.as_ptr()))
        }
    }
    #[inline(always)]
    fn gather_three(table: &[f32], first: I32x16, mask: M32x16) -> [Self; 3] {
        if !mask.any() {
            return [Float::splat(0.0); 3];
        }
        assert_in_range(table.len().saturating_sub(2), first, mask);
        // SAFETY: the mask has lanes, and in each of them three entries from `first` on are within the table; as for
        // the operators.
        unsafe { three_entries(table.as_ptr(), first, mask).map(Self) }
    }
    #[inline(always)]
    fn load_rows(table: &[[f32; 4]], index: I32x16) -> [Self; 4] {
        assert_in_range(table.len(), index, M32x16(!0));
        let mut places = [0; 16];
        index.store(&mut places);
        // Rows i, i + 4, i + 8 and i + 12 side by side.
        // SAFETY: every index is within the table; as for the operators.
        unsafe {
            let rows = [
                four_rows(table, &places, 0),
                four_rows(table, &places, 1),
                four_rows(table, &places, 2),
                four_rows(table, &places, 3),
            ];
            let [a, b, c, d] = transpose(rows);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    fn store_rows([a, b, c, d]: [Self; 4], out: &mut [[f32; 4]]) {
        let out = out[..16].as_mut_ptr().cast::<f32>();
        // SAFETY: the slice has room for 16 rows; as for the operators.
        unsafe {
            let rows = transpose([a.0, b.0, c.0, d.0]);
            for (i, rows) in rows.into_iter().enumerate() {
                _mm_storeu_ps(out.add(4 * i), _mm512_castps512_ps128(rows));
                _mm_storeu_ps(out.add(4 * i + 16), _mm512_extractf32x4_ps::<1>(rows));
                _mm_storeu_ps(out.add(4 * i + 32), _mm512_extractf32x4_ps::<2>(rows));
                _mm_storeu_ps(out.add(4 * i + 48), _mm512_extractf32x4_ps::<3>(rows));
            }
        }
    }
    #[inline(always)]
    fn store_rows_mixed([a, b, c, d]: [Self; 4], out: &mut [[f32; 4]]) {
        // SAFETY: as for the operators.
        let rows = unsafe { transpose([a.0, b.0, c.0, d.0]) };
        for (rows, out) in rows.into_iter().zip(out[..16].as_flattened_mut().chunks_exact_mut(16)) {
            Float::store(Self(rows), out);
        }
    }
    #[inline(always)]
    fn least_of_four([a, b, c, d]: [Self; 4]) -> [f32; 4] {
        let mut least = [0.0; 4];
        // SAFETY: the array has room for four floats; as for the operators.
        unsafe {
            let [a, b, c, d] = transpose([a.0, b.0, c.0, d.0]);
            let rows = _mm512_min_ps(_mm512_min_ps(a, b), _mm512_min_ps(c, d));
            let rows = _mm256_min_ps(_mm512_castps512_ps256(rows), _mm512_extractf32x8_ps::<1>(rows));
            let row = _mm_min_ps(_mm256_castps256_ps128(rows), _mm256_extractf128_ps::<1>(rows));
            _mm_storeu_ps(least.as_mut_ptr(), row);
        }
        least
    }
    #[inline(always)]
    fn mixed(lane: usize) -> usize {
        lane % 4 * 4 + lane / 4
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_andnot_ps(_mm512_set1_ps(-0.0), self.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_max_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max_abs(self, other: Self) -> Self {
        // SAFETY: as for the operators. (Selects the larger absolute value, 3, with the sign cleared, 2.)
        unsafe { Self(_mm512_range_ps::<{ 2 << 2 | 3 }>(self.0, other.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)) }
    }
    #[inline(always)]
    fn to_int(self) -> I32x16 {
        // SAFETY: as for the operators.
        unsafe { I32x16(_mm512_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn to_bits(self) -> I32x16 {
        // SAFETY: as for the operators.
        unsafe { I32x16(_mm512_castps_si512(self.0)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M32x16 {
        // SAFETY: as for the operators.
        unsafe { M32x16(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> M32x16 {
        // SAFETY: as for the operators.
        unsafe { M32x16(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M32x16 {
        // SAFETY: as for the operators.
        unsafe { M32x16(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn select(mask: M32x16, yes: Self, no: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_mask_blend_ps(mask.0, no.0, yes.0)) }
    }
}

impl Int for I32x16 {
    type Mask = M32x16;
    type Float = F32x16;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_set1_epi32(value as i32)) }
    }
    #[inline(always)]
    fn load(values: &[u32]) -> Self {
        let values = &values[..16];
        // SAFETY: the slice has 16 integers; as for the operators.
        unsafe { Self(_mm512_loadu_si512(values.as_ptr().cast())) }
    }
    #[inline(always)]
    fn store(self, out: &mut [u32]) {
        let out = &mut out[..16];
        // SAFETY: the slice has room for 16 integers; as for the operators.
        unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn compress(self, mask: M32x16, out: &mut [u32]) {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_maskz_compress_epi32(mask.0, self.0)).store(out) }
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self, mask: M32x16) -> Self {
        assert_in_range(table.len(), index, mask);
        // SAFETY: in the lanes of the mask, every index is within the table; the others are not read.
        unsafe {
            let zero = _mm512_setzero_si512();
            Self(_mm512_mask_i32gather_epi32::<4>(zero, mask.0, index.0, table.as_ptr().cast()))
        }
    }
    #[inline(always)]
    fn gather_three(table: &[u32], first: Self, mask: M32x16) -> [Self; 3] {
        if !mask.any() {
            return [Self::splat(0); 3];
        }
        assert_in_range(table.len().saturating_sub(2), first, mask);
        // SAFETY: the mask has lanes, and in each of them three entries from `first` on are within the table; as for
        // the operators.
        unsafe {
            let [a, b, c] = three_entries(table.as_ptr().cast(), first, mask);
            [Self(_mm512_castps_si512(a)), Self(_mm512_castps_si512(b)), Self(_mm512_castps_si512(c))]
        }
    }
    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_sllv_epi32(self.0, _mm512_set1_epi32(N))) }
    }
    #[inline(always)]
    fn shr<const N: i32>(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_srlv_epi32(self.0, _mm512_set1_epi32(N))) }
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // SAFETY: as for the operators.
        unsafe {
            // Reverses half-bytes by tables, then the bytes.
            let low = _mm512_set1_epi8(0x0f);
            let upwards = _mm512_broadcast_i32x4(super::avx2::half_bytes_in_reverse(4));
            let downwards = _mm512_broadcast_i32x4(super::avx2::half_bytes_in_reverse(0));
            let upper = _mm512_and_si512(_mm512_srli_epi32::<4>(self.0), low);
            let lower = _mm512_shuffle_epi8(upwards, _mm512_and_si512(self.0, low));
            let bytes = _mm512_or_si512(lower, _mm512_shuffle_epi8(downwards, upper));
            Self(_mm512_shuffle_epi8(bytes, _mm512_broadcast_i32x4(super::avx2::bytes_in_reverse())))
        }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M32x16 {
        // SAFETY: as for the operators.
        unsafe { M32x16(_mm512_cmpeq_epi32_mask(self.0, other.0)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M32x16 {
        // SAFETY: as for the operators.
        unsafe { M32x16(_mm512_cmplt_epu32_mask(self.0, other.0)) }
    }
    #[inline(always)]
    fn select(mask: M32x16, yes: Self, no: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm512_mask_blend_epi32(mask.0, no.0, yes.0)) }
    }
    #[inline(always)]
    fn to_float(self) -> F32x16 {
        // SAFETY: as for the operators.
        unsafe { F32x16(_mm512_cvtepi32_ps(self.0)) }
    }
    #[inline(always)]
    fn reinterpret(self) -> F32x16 {
        // SAFETY: as for the operators.
        unsafe { F32x16(_mm512_castsi512_ps(self.0)) }
    }
}

/// Panics if an index is out of range. The instructions take signed indices: to them a table ends before entry 2³¹.
#[inline(always)]
fn assert_in_range(length: usize, index: I32x16, mask: M32x16) {
    let length = I32x16::splat(length.min(i32::MAX as usize) as u32);
    assert!(!(mask & !index.lt(length)).any(), "gather outside its table");
}
