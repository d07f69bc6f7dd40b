//! Eight lanes: AVX2.

mod rows;

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::sixteen::Two;
use super::{Float, Int, Kernel, Lanes, Mask, Outlined};
use rows::{three_entries, transpose};

/// The lanes of AVX2.
pub(super) struct Avx2;

impl Lanes for Avx2 {
    type Queue = F32x8;
    type Node = Two<F32x8>;
    type Block = F32x8;

    #[inline(always)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        // SAFETY: only kernels under `run` use this type, and the caller of `run` has checked the CPU.
        unsafe { run_outlined(kernel) }
    }
}

/// True if the processor has all the features that [`run`] is compiled for.
pub(super) fn detected() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// Runs a kernel compiled for AVX2.
///
/// # Safety
///
/// [`detected`] must have returned true.
#[target_feature(enable = "avx,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(super) unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

/// [`run`], never inlined.
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(never)]
#[target_feature(enable = "avx,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_outlined<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

/// Runs a part of a kernel, never inlined.
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(never)]
#[target_feature(enable = "avx,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn part_outlined<P: Outlined>(part: P) -> P::Output {
    part.run()
}

/// 8 floats.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct F32x8(__m256);

/// 8 integers.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct I32x8(__m256i);

/// A lane mask: all bits of a lane set, or none.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct M32x8(__m256);

impl Mask for M32x8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: as for the operators.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        // SAFETY: as for the operators.
        unsafe {
            let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lane);
            Self(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane)))
        }
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
operator!(F32x8, Add, add, _mm256_add_ps);
operator!(F32x8, Sub, sub, _mm256_sub_ps);
operator!(F32x8, Mul, mul, _mm256_mul_ps);
operator!(F32x8, Div, div, _mm256_div_ps);
operator!(I32x8, Add, add, _mm256_add_epi32);
operator!(I32x8, Sub, sub, _mm256_sub_epi32);
operator!(I32x8, Mul, mul, _mm256_mullo_epi32);
operator!(I32x8, BitAnd, bitand, _mm256_and_si256);
operator!(I32x8, BitOr, bitor, _mm256_or_si256);
operator!(I32x8, BitXor, bitxor, _mm256_xor_si256);
operator!(M32x8, BitAnd, bitand, _mm256_and_ps);
operator!(M32x8, BitOr, bitor, _mm256_or_ps);
operator!(M32x8, BitXor, bitxor, _mm256_xor_ps);

impl Not for M32x8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))) }
    }
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }
}

impl Float for F32x8 {
    const WIDTH: usize = 8;
    type Mask = M32x8;
    type Int = I32x8;

    #[inline(always)]
    fn outlined<P: Outlined>(part: P) -> P::Output {
        // SAFETY: only kernels under `run` use this type, and the caller of `run` has checked the CPU.
        unsafe { part_outlined(part) }
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_set1_ps(value)) }
    }
    #[inline(always)]
    fn load(values: &[f32]) -> Self {
        let values = &values[..8];
        // SAFETY: the slice has 8 floats; as for the operators.
        unsafe { Self(_mm256_loadu_ps(values.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, out: &mut [f32]) {
        let out = &mut out[..8];
        // SAFETY: the slice has room for 8 floats; as for the operators.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn compress(self, mask: M32x8, out: &mut [f32]) {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_permutevar8x32_ps(self.0, front(mask))).store(out) }
    }
    #[inline(always)]
    fn gather(table: &[f32], index: I32x8, mask: M32x8) -> Self {
        assert_in_range(table.len(), index, mask);
        // SAFETY: in the lanes of the mask, every index is within the table; the others are not read.
        unsafe {
            let zero = _mm256_setzero_ps();
            Self(_mm256_mask_i32gather_ps::<4>(zero, table.as_ptr(), index.0, mask.0))
        }
    }
    #[inline(always)]
    fn gather_three(table: &[f32], first: I32x8, mask: M32x8) -> [Self; 3] {
        if !mask.any() {
            return [Float::splat(0.0); 3];
        }
        assert_in_range(table.len().saturating_sub(2), first, mask);
        // SAFETY: the mask has lanes, and in each of them three entries from `first` on are within the table; as for
        // the operators.
        unsafe { three_entries(table.as_ptr(), first, mask).map(Self) }
    }
    #[inline(always)]
    fn load_rows(table: &[[f32; 4]], index: I32x8) -> [Self; 4] {
        let mut places = [0; 8];
        index.store(&mut places);
        // SAFETY: a row is 4 floats; as for the operators.
        unsafe {
            let mut pairs = [_mm256_setzero_ps(); 4];
            for (i, pair) in pairs.iter_mut().enumerate() {
                let (low, high) = (&table[places[i] as usize], &table[places[i + 4] as usize]);
                *pair = _mm256_loadu2_m128(high.as_ptr(), low.as_ptr());
            }
            let [a, b, c, d] = transpose(pairs);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    fn store_rows([a, b, c, d]: [Self; 4], out: &mut [[f32; 4]]) {
        let out = &mut out[..8];
        // SAFETY: the slice has room for 8 rows; as for the operators.
        unsafe {
            for (i, pair) in transpose([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
                _mm256_storeu2_m128(out[i + 4].as_mut_ptr(), out[i].as_mut_ptr(), pair);
            }
        }
    }
    #[inline(always)]
    fn store_rows_mixed([a, b, c, d]: [Self; 4], out: &mut [[f32; 4]]) {
        // SAFETY: as for the operators.
        let rows = unsafe { transpose([a.0, b.0, c.0, d.0]) };
        for (rows, out) in rows.into_iter().zip(out[..8].as_flattened_mut().chunks_exact_mut(8)) {
            Self(rows).store(out);
        }
    }
    #[inline(always)]
    fn mixed(lane: usize) -> usize {
        lane % 4 * 2 + lane / 4
    }
    #[inline(always)]
    fn least(self) -> f32 {
        // SAFETY: as for the operators.
        unsafe {
            let half = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
            _mm_cvtss_f32(_mm_min_ss(pair, _mm_shuffle_ps::<1>(pair, pair)))
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_max_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_floor_ps(self.0)) }
    }
    #[inline(always)]
    fn to_int(self) -> I32x8 {
        // SAFETY: as for the operators.
        unsafe { I32x8(_mm256_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn to_bits(self) -> I32x8 {
        // SAFETY: as for the operators.
        unsafe { I32x8(_mm256_castps_si256(self.0)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M32x8 {
        // SAFETY: as for the operators.
        unsafe { M32x8(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> M32x8 {
        // SAFETY: as for the operators.
        unsafe { M32x8(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M32x8 {
        // SAFETY: as for the operators.
        unsafe { M32x8(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn select(mask: M32x8, yes: Self, no: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_blendv_ps(no.0, yes.0, mask.0)) }
    }
}

/// A table of reversed half-bytes: for each value of four bits, the bits in reverse, shifted left by `by`.
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(always)]
pub(super) unsafe fn half_bytes_in_reverse(by: u32) -> __m128i {
    let table: [u8; 16] = std::array::from_fn(|half| (half as u8).reverse_bits() >> 4 << by);
    // SAFETY: the table has 16 bytes; by the caller.
    unsafe { _mm_loadu_si128(table.as_ptr().cast()) }
}

/// The shuffle that reverses the bytes of each 32-bit lane.
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(always)]
pub(super) unsafe fn bytes_in_reverse() -> __m128i {
    // SAFETY: by the caller.
    unsafe { _mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12) }
}

impl Int for I32x8 {
    type Mask = M32x8;
    type Float = F32x8;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_set1_epi32(value as i32)) }
    }
    #[inline(always)]
    fn load(values: &[u32]) -> Self {
        let values = &values[..8];
        // SAFETY: the slice has 8 integers; as for the operators.
        unsafe { Self(_mm256_loadu_si256(values.as_ptr().cast())) }
    }
    #[inline(always)]
    fn store(self, out: &mut [u32]) {
        let out = &mut out[..8];
        // SAFETY: the slice has room for 8 integers; as for the operators.
        unsafe { _mm256_storeu_si256(out.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn compress(self, mask: M32x8, out: &mut [u32]) {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_permutevar8x32_epi32(self.0, front(mask))).store(out) }
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self, mask: M32x8) -> Self {
        assert_in_range(table.len(), index, mask);
        // SAFETY: in the lanes of the mask, every index is within the table; the others are not read.
        unsafe {
            let zero = _mm256_setzero_si256();
            let mask = _mm256_castps_si256(mask.0);
            Self(_mm256_mask_i32gather_epi32::<4>(zero, table.as_ptr().cast(), index.0, mask))
        }
    }
    #[inline(always)]
    fn gather_three(table: &[u32], first: Self, mask: M32x8) -> [Self; 3] {
        if !mask.any() {
            return [Self::splat(0); 3];
        }
        assert_in_range(table.len().saturating_sub(2), first, mask);
        // SAFETY: the mask has lanes, and in each of them three entries from `first` on are within the table; as for
        // the operators.
        unsafe {
            let [a, b, c] = three_entries(table.as_ptr().cast(), first, mask);
            [Self(_mm256_castps_si256(a)), Self(_mm256_castps_si256(b)), Self(_mm256_castps_si256(c))]
        }
    }
    #[inline(always)]
    fn shl<const N: i32>(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_slli_epi32::<N>(self.0)) }
    }
    #[inline(always)]
    fn shr<const N: i32>(self) -> Self {
        // SAFETY: as for the operators.
        unsafe { Self(_mm256_srli_epi32::<N>(self.0)) }
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // SAFETY: as for the operators.
        unsafe {
            // Reverses half-bytes by tables, then the bytes.
            let low = _mm256_set1_epi8(0x0f);
            let upwards = _mm256_broadcastsi128_si256(half_bytes_in_reverse(4));
            let downwards = _mm256_broadcastsi128_si256(half_bytes_in_reverse(0));
            let upper = _mm256_and_si256(_mm256_srli_epi32::<4>(self.0), low);
            let lower = _mm256_shuffle_epi8(upwards, _mm256_and_si256(self.0, low));
            let bytes = _mm256_or_si256(lower, _mm256_shuffle_epi8(downwards, upper));
            Self(_mm256_shuffle_epi8(bytes, _mm256_broadcastsi128_si256(bytes_in_reverse())))
        }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M32x8 {
        // SAFETY: as for the operators.
        unsafe { M32x8(_mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0))) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M32x8 {
        // SAFETY: as for the operators.
        unsafe {
            let sign = _mm256_set1_epi32(i32::MIN);
            let (a, b) = (_mm256_xor_si256(self.0, sign), _mm256_xor_si256(other.0, sign));
            M32x8(_mm256_castsi256_ps(_mm256_cmpgt_epi32(b, a)))
        }
    }
    #[inline(always)]
    fn select(mask: M32x8, yes: Self, no: Self) -> Self {
        // SAFETY: as for the operators.
        unsafe {
            Self(_mm256_castps_si256(_mm256_blendv_ps(
                _mm256_castsi256_ps(no.0),
                _mm256_castsi256_ps(yes.0),
                mask.0,
            )))
        }
    }
    #[inline(always)]
    fn to_float(self) -> F32x8 {
        // SAFETY: as for the operators.
        unsafe { F32x8(_mm256_cvtepi32_ps(self.0)) }
    }
    #[inline(always)]
    fn reinterpret(self) -> F32x8 {
        // SAFETY: as for the operators.
        unsafe { F32x8(_mm256_castsi256_ps(self.0)) }
    }
}

/// Panics if an index is out of range. The instructions take signed indices: to them a table ends before entry 2³¹.
#[inline(always)]
fn assert_in_range(length: usize, index: I32x8, mask: M32x8) {
    let length = I32x8::splat(length.min(i32::MAX as usize) as u32);
    assert!(!(mask & !index.lt(length)).any(), "gather outside its table");
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
///
/// # Safety
///
/// The conditions of [`run`] hold.
#[inline(always)]
unsafe fn front(mask: M32x8) -> __m256i {
    let lanes = PACKED[mask.bits() as usize & 255];
    // SAFETY: by the caller.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes as i64)) }
}
