//! The parts that the instruction sets of x86 have in common.

use std::arch::x86_64::*;

use super::{Int, Mask};

/// Declares an instruction set by its lanes and the processor's features that it needs.
macro_rules! x86_set {
    ($(#[$doc:meta])* $set:ident { $($lanes:item)* } $($feature:tt)*) => {
        $(#[$doc])*
        pub(super) struct $set;

        impl Lanes for $set {
            $($lanes)*

            #[inline(always)]
            fn outlined<K: Kernel>(kernel: K) -> K::Output {
                // SAFETY: only kernels under `run` use this type, and the caller of `run` has checked the processor.
                unsafe { run_outlined(kernel) }
            }
        }

        /// True if the processor has all the features that [`run`] is compiled for.
        pub(super) fn detected() -> bool {
            $(is_x86_feature_detected!($feature))&&*
        }

        /// Runs a kernel compiled for this instruction set.
        ///
        /// # Safety
        ///
        /// [`detected`] must have returned true.
        #[target_feature($(enable = $feature),*)]
        pub(super) unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<$set>()
        }

        /// [`run`], never inlined.
        ///
        /// # Safety
        ///
        /// The conditions of [`run`] hold.
        #[inline(never)]
        #[target_feature($(enable = $feature),*)]
        unsafe fn run_outlined<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<$set>()
        }

        /// Runs a part of a kernel, never inlined.
        ///
        /// # Safety
        ///
        /// The conditions of [`run`] hold.
        #[inline(never)]
        #[target_feature($(enable = $feature),*)]
        unsafe fn part_outlined<P: Outlined>(part: P) -> P::Output {
            part.run()
        }
    };
}

/// Applies an instruction to registers.
macro_rules! each {
    ($type:ident, $instruction:ident, $($value:expr),+) => {
        // SAFETY: as in `instructions`.
        unsafe { $type($instruction($($value.0),+)) }
    };
}

/// Defines the part of [`super::Float`] that differs in instructions only: gathers, and rows as columns. A register
/// joins 128-bit quarters and splits into them. Loads and shuffles take less time than gathers.
macro_rules! x86_float {
    (
        $width:literal, $int:ident, $mask:ident;
        gather($table:ident, $index:ident, $lanes:ident) = $gather:expr;
        keep($kept:ident, $keeping:ident) = $keep:expr;
        three($from:ident) = $three:expr;
        join($quarters:ident) = $join:expr;
        split($register:ident) = $split:expr;
    ) => {
        wide_float!($width, $int, $mask);

        #[inline(always)]
        fn abs(self) -> Self {
            (self.to_bits() & Int::splat(i32::MAX as u32)).reinterpret()
        }

        #[inline(always)]
        fn outlined<P: Outlined>(part: P) -> P::Output {
            // SAFETY: only kernels under `run` use this type, and the caller of `run` has checked the processor.
            unsafe { part_outlined(part) }
        }
        #[inline(always)]
        fn gather(table: &[f32], index: $int, mask: $mask) -> Self {
            assert_in_range(table.len(), index, mask);
            let ($table, $index, $lanes) = (table.as_ptr(), index.0, mask.0);
            // SAFETY: in the lanes of the mask, every index is within the table; the others are not read.
            unsafe { Self($gather) }
        }
        #[inline(always)]
        fn gather_three(table: &[f32], first: $int, mask: $mask) -> [Self; 3] {
            if !mask.any() {
                return [Self::splat(0.0); 3];
            }
            assert_in_range(table.len().saturating_sub(2), first, mask);
            let mut places = [0; $width];
            // Lanes outside the mask read the table's front, which has three entries because those of some lane exist.
            Int::select(mask, first, Int::splat(0)).store(&mut places);
            let mut rows = [Self::splat(0.0); 4];
            for (i, row) in rows.iter_mut().enumerate() {
                // SAFETY: three entries from each place on are within the table; the fourth ones are not read.
                unsafe {
                    let mut $quarters = [_mm_setzero_ps(); $width / 4];
                    for (part, quarter) in $quarters.iter_mut().enumerate() {
                        let $from = table.as_ptr().add(places[i + 4 * part] as usize);
                        *quarter = $three;
                    }
                    *row = Self($join);
                }
            }
            let mut columns = transpose(rows);
            for column in &mut columns {
                let ($kept, $keeping) = (column.0, mask.0);
                // SAFETY: as in `instructions`.
                *column = unsafe { Self($keep) };
            }
            [columns[0], columns[1], columns[2]]
        }
        #[inline(always)]
        fn load_rows(table: &[[f32; 4]], index: $int) -> [Self; 4] {
            assert_in_range(table.len(), index, $mask::from_bits(u32::MAX));
            let mut places = [0; $width];
            index.store(&mut places);
            let mut rows = [Self::splat(0.0); 4];
            for (i, row) in rows.iter_mut().enumerate() {
                // SAFETY: every place is within the table, and a row is 4 floats.
                unsafe {
                    let mut $quarters = [_mm_setzero_ps(); $width / 4];
                    for (part, quarter) in $quarters.iter_mut().enumerate() {
                        *quarter = _mm_loadu_ps(table.as_ptr().add(places[i + 4 * part] as usize).cast());
                    }
                    *row = Self($join);
                }
            }
            transpose(rows)
        }
        #[inline(always)]
        fn store_rows(columns: [Self; 4], out: &mut [[f32; 4]]) {
            let out = &mut out[..$width];
            for (i, row) in transpose(columns).into_iter().enumerate() {
                let $register = row.0;
                // SAFETY: a row is 4 floats; as in `instructions`.
                unsafe {
                    for (part, quarter) in $split.into_iter().enumerate() {
                        _mm_storeu_ps(out[i + 4 * part].as_mut_ptr(), quarter);
                    }
                }
            }
        }
        #[inline(always)]
        fn store_rows_mixed(columns: [Self; 4], out: &mut [[f32; 4]]) {
            let out = out[..$width].as_flattened_mut().chunks_exact_mut($width);
            for (rows, out) in transpose(columns).into_iter().zip(out) {
                Float::store(rows, out);
            }
        }
        #[inline(always)]
        fn mixed(lane: usize) -> usize {
            lane % 4 * ($width / 4) + lane / 4
        }
    };
}

/// Defines negation, and the transposition of four by four in each quarter of the registers.
macro_rules! neg_and_transpose {
    ($float:ident, $unpack_low:ident, $unpack_high:ident, $shuffle:ident) => {
        impl Neg for $float {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                (self.to_bits() ^ Int::splat(1 << 31)).reinterpret()
            }
        }

        #[inline(always)]
        fn transpose([a, b, c, d]: [$float; 4]) -> [$float; 4] {
            // SAFETY: as in `instructions`.
            unsafe {
                let (ab, cd) = ($unpack_low(a.0, b.0), $unpack_low(c.0, d.0));
                let (ab_high, cd_high) = ($unpack_high(a.0, b.0), $unpack_high(c.0, d.0));
                [
                    $float($shuffle::<0b01_00_01_00>(ab, cd)),
                    $float($shuffle::<0b11_10_11_10>(ab, cd)),
                    $float($shuffle::<0b01_00_01_00>(ab_high, cd_high)),
                    $float($shuffle::<0b11_10_11_10>(ab_high, cd_high)),
                ]
            }
        }
    };
}

/// Defines [`Int::reverse_bits`]: reverses half-bytes by tables, then the bytes of each lane.
macro_rules! reverse_bits {
    ($broadcast:ident, $shuffle:ident) => {
        #[inline(always)]
        fn reverse_bits(self) -> Self {
            let low = Self::splat(0x0f0f_0f0f);
            let (upper, lower) = (self.shr::<4>() & low, self & low);
            // SAFETY: as in `instructions`.
            unsafe {
                let (upwards, downwards) = (half_bytes_in_reverse(4), half_bytes_in_reverse(0));
                let bytes = Self($shuffle($broadcast(upwards), lower.0))
                    | Self($shuffle($broadcast(downwards), upper.0));
                let backwards = _mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12);
                Self($shuffle(bytes.0, $broadcast(backwards)))
            }
        }
    };
}

/// A table of reversed half-bytes: for each value of four bits, the bits in reverse, shifted left by `by`.
#[inline(always)]
pub(super) fn half_bytes_in_reverse(by: u32) -> __m128i {
    let table: [u8; 16] = std::array::from_fn(|half| (half as u8).reverse_bits() >> 4 << by);
    // SAFETY: the table has 16 bytes, and every processor has the instruction.
    unsafe { _mm_loadu_si128(table.as_ptr().cast()) }
}

/// Panics if an index is out of range. The instructions take signed indices: to them a table ends before entry 2³¹.
#[inline(always)]
pub(super) fn assert_in_range<I: Int>(length: usize, index: I, mask: I::Mask) {
    let length = I::splat(length.min(i32::MAX as usize) as u32);
    assert!(!(mask & !index.lt(length)).any(), "gather outside its table");
}
