//! SIMD lanes: one set of float and integer operations over 1, 8 or 16 values.
//!
//! Computations on many rays are written once, generic over [`Float`]; width 1 (`f32` itself) serves the recursive
//! schedule, the wider types the queues. All widths give the same bits: only + − × ÷ √, comparisons, bit operations and
//! conversions are provided, each with one IEEE 754 result; no fused multiply-add, no approximate reciprocal.
//!
//! The wide types are private. They are available only through [`dispatch`], which runs a [`Kernel`] with the types of
//! an [`Isa`], and an `Isa` above portable exists only on a processor that has its instructions: that is what makes the
//! unsafe code in this module sound. Kernels and all that they call must be `#[inline(always)]`, so that they are
//! compiled for the instruction set they are dispatched to.

#![allow(unsafe_code)]

#[macro_use]
mod macros;
#[cfg(target_arch = "x86_64")]
#[macro_use]
mod x86;

#[cfg(target_arch = "x86_64")]
mod avx2;
// Left out of fuzzing: code for all widths takes half an hour to compile with the counters that fuzzing adds.
#[cfg(all(target_arch = "x86_64", not(fuzzing)))]
mod avx512;
mod memory;
#[cfg(target_arch = "aarch64")]
mod neon;
mod scalar;
pub mod sixteen;
mod traversal_stack;

#[cfg(feature = "cli")]
pub use memory::give_back_freed;
pub use memory::{prefer_large_pages, prefetch};
pub use sixteen::Sixteen;
use std::fmt;
pub use traversal_stack::TraversalStack;

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// A Boolean value for each lane.
pub trait Mask:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self> + 'static
{
    /// The lanes as bits: lane i as bit i.
    fn bits(self) -> u32;
    /// The inverse of [`Mask::bits`].
    fn from_bits(bits: u32) -> Self;
    /// True if some lane is set.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
    /// The number of lanes that are set.
    #[inline(always)]
    fn count(self) -> usize {
        self.bits().count_ones() as usize
    }
    /// Sets the first `count` lanes.
    #[inline(always)]
    fn first(count: usize) -> Self {
        Self::from_bits(if count >= 32 { u32::MAX } else { (1 << count) - 1 })
    }
}

/// 32-bit floats, one a lane.
pub trait Float:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// Number of lanes.
    const WIDTH: usize;
    /// The results of comparisons.
    type Mask: Mask;
    /// Integers of the same width.
    type Int: Int<Float = Self, Mask = Self::Mask>;

    /// Runs a part of a computation as a function of its own, compiled for the same instruction set:
    /// [`Lanes::outlined`] for code that is generic over its lanes only.
    fn outlined<P: Outlined>(part: P) -> P::Output;

    /// Broadcasts to all lanes.
    fn splat(value: f32) -> Self;
    /// Loads the first `WIDTH` values of a slice. Panics if there are fewer.
    fn load(values: &[f32]) -> Self;
    /// Broadcasts one value to the first eight lanes, another to the next eight.
    #[inline(always)]
    fn splat_halves(low: f32, high: f32) -> Self {
        Self::load_halves(&[low; 8], &[high; 8])
    }
    /// Loads eight values, then another eight.
    #[inline(always)]
    fn load_halves(low: &[f32; 8], high: &[f32; 8]) -> Self {
        let mut values = [0.0; 16];
        values[..8].copy_from_slice(low);
        values[8..].copy_from_slice(high);
        Self::load(&values)
    }
    /// Stores the lanes at the front of a slice. Panics if it is shorter than `WIDTH`.
    fn store(self, out: &mut [f32]);
    /// Packs the lanes of `mask` together at the front of `out`, which has room for `WIDTH`; the values behind them are
    /// undefined.
    fn compress(self, mask: Self::Mask, out: &mut [f32]);
    /// Gathers `table[index]` in the lanes of `mask`, zero in the others. Panics when out of range.
    fn gather(table: &[f32], index: Self::Int, mask: Self::Mask) -> Self;
    /// Gathers three consecutive entries for each lane: `table[first]`, `table[first + 1]` and `table[first + 2]` in
    /// the lanes of `mask`, zero in the others. Panics when out of range.
    #[inline(always)]
    fn gather_three(table: &[f32], first: Self::Int, mask: Self::Mask) -> [Self; 3] {
        let (second, third) = (first + Self::Int::splat(1), first + Self::Int::splat(2));
        [
            Self::gather(table, first, mask),
            Self::gather(table, second, mask),
            Self::gather(table, third, mask),
        ]
    }
    /// Loads rows as columns: lane i of column c is `table[index[i]][c]`. Panics when out of range.
    fn load_rows(table: &[[f32; 4]], index: Self::Int) -> [Self; 4];
    /// The inverse of [`Float::load_rows`] for the rows at the front of `out`, which has room for `WIDTH`.
    fn store_rows(columns: [Self; 4], out: &mut [[f32; 4]]);
    /// [`Float::store_rows`] in the order of the rows in registers, which takes less time: the row of lane i goes to
    /// [`Float::mixed`]`(i)`.
    #[inline(always)]
    fn store_rows_mixed(columns: [Self; 4], out: &mut [[f32; 4]]) {
        Self::store_rows(columns, out);
    }
    /// The index at which [`Float::store_rows_mixed`] stores a lane's row.
    #[inline(always)]
    fn mixed(lane: usize) -> usize {
        lane
    }

    /// The least lane of each of four columns.
    #[inline(always)]
    fn least_of_four(four: [Self; 4]) -> [f32; 4] {
        let mut rows = [[0.0; 4]; 16];
        Self::store_rows_mixed(four, &mut rows);
        let mut least = rows[0];
        for row in &rows[1..Self::WIDTH] {
            for (least, value) in least.iter_mut().zip(row) {
                *least = <f32 as Float>::min(*least, *value);
            }
        }
        least
    }

    /// The least lane.
    #[inline(always)]
    fn least(self) -> f32 {
        let mut lanes = [0.0; 16];
        self.store(&mut lanes);
        lanes[..Self::WIDTH].iter().copied().fold(f32::INFINITY, <f32 as Float>::min)
    }

    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// The absolute value.
    fn abs(self) -> Self;
    /// `if self < other { self } else { other }`: a NaN gives `other`.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: a NaN gives `other`.
    fn max(self, other: Self) -> Self;
    /// The larger of the absolute values; undefined if one of them is NaN.
    #[inline(always)]
    fn max_abs(self, other: Self) -> Self {
        self.abs().max(other.abs())
    }
    /// Rounds towards −∞.
    fn floor(self) -> Self;
    /// Converts with rounding towards zero; `i32::MIN` for values that do not fit.
    fn to_int(self) -> Self::Int;
    /// The IEEE 754 encoding.
    fn to_bits(self) -> Self::Int;

    /// `self < other`; false for NaN, as all comparisons.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn eq(self, other: Self) -> Self::Mask;
    /// `self > other`.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other`.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `yes` where `mask` is set, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// One in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
    /// Clamps to the range from `low` to `high`; a NaN gives `low`.
    #[inline(always)]
    fn clamp(self, low: f32, high: f32) -> Self {
        self.max(Self::splat(low)).min(Self::splat(high))
    }
}

/// 32-bit integers, one a lane. Arithmetic wraps.
pub trait Int:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + 'static
{
    /// The results of comparisons.
    type Mask: Mask;
    /// Floats of the same width.
    type Float: Float<Int = Self, Mask = Self::Mask>;

    /// Broadcasts to all lanes.
    fn splat(value: u32) -> Self;
    /// Loads the first values of a slice. Panics if there are fewer than lanes.
    fn load(values: &[u32]) -> Self;
    /// Stores the lanes at the front of a slice. Panics if it is shorter.
    fn store(self, out: &mut [u32]);
    /// Packs lanes together, as [`Float::compress`] does.
    fn compress(self, mask: Self::Mask, out: &mut [u32]);
    /// Gathers entries, as [`Float::gather`] does.
    #[inline(always)]
    fn gather(table: &[u32], index: Self, mask: Self::Mask) -> Self {
        Self::Float::gather(as_floats(table), index, mask).to_bits()
    }
    /// Gathers three consecutive entries, as [`Float::gather_three`] does.
    #[inline(always)]
    fn gather_three(table: &[u32], first: Self, mask: Self::Mask) -> [Self; 3] {
        let [a, b, c] = Self::Float::gather_three(as_floats(table), first, mask);
        [a.to_bits(), b.to_bits(), c.to_bits()]
    }

    /// Shifts left by `N` bits.
    fn shl<const N: i32>(self) -> Self;
    /// Shifts right by `N` bits, with zeros from the left.
    fn shr<const N: i32>(self) -> Self;
    /// Reverses the order of the bits.
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        let x = self.shl::<16>() | self.shr::<16>();
        // Both sides are masked after the shift: a shift each and one bitwise selection.
        let x = (x.shl::<8>() & Self::splat(0xff00_ff00)) | (x.shr::<8>() & Self::splat(0x00ff_00ff));
        let x = (x.shl::<4>() & Self::splat(0xf0f0_f0f0)) | (x.shr::<4>() & Self::splat(0x0f0f_0f0f));
        let x = (x.shl::<2>() & Self::splat(0xcccc_cccc)) | (x.shr::<2>() & Self::splat(0x3333_3333));
        (x.shl::<1>() & Self::splat(0xaaaa_aaaa)) | (x.shr::<1>() & Self::splat(0x5555_5555))
    }
    /// `self == other`.
    fn eq(self, other: Self) -> Self::Mask;
    /// `self < other`, unsigned.
    fn lt(self, other: Self) -> Self::Mask;
    /// `yes` where `mask` is set, `no` elsewhere.
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self::Float::select(mask, yes.reinterpret(), no.reinterpret()).to_bits()
    }
    /// Converts from a signed integer to the nearest float.
    fn to_float(self) -> Self::Float;
    /// The float with this encoding.
    fn reinterpret(self) -> Self::Float;
}

/// The floats with these bits.
#[inline(always)]
fn as_floats(bits: &[u32]) -> &[f32] {
    // SAFETY: both types have one size and alignment, and all bits are valid for both.
    unsafe { std::slice::from_raw_parts(bits.as_ptr().cast(), bits.len()) }
}

/// The lane types of an instruction set.
pub trait Lanes: 'static {
    /// The lanes for shading and all other work on queues: as wide as the machine.
    type Queue: Float;
    /// The lanes for the 16 children of a BVH node.
    type Node: Sixteen;
    /// The lanes for the 8 primitives of a block: 1 or 8.
    type Block: Float;

    /// Runs a part of a kernel as a function of its own. The functions that a kernel calls are inlined at every call;
    /// this keeps large ones that are called from several places from being copied there.
    fn outlined<K: Kernel>(kernel: K) -> K::Output;
}

/// A part of a computation over lanes that [`Float::outlined`] runs.
pub trait Outlined {
    /// The result.
    type Output;
    /// Runs it. Implementations must be `#[inline(always)]`.
    fn run(self) -> Self::Output;
}

/// Work that can run with the lanes of any instruction set.
pub trait Kernel {
    /// The result.
    type Output;
    /// Runs it. Implementations must be `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// An instruction set that this processor has.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Isa(IsaKind);

#[derive(Clone, Copy, PartialEq, Eq)]
enum IsaKind {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
    Avx512,
    #[cfg(target_arch = "aarch64")]
    Neon,
}

impl Isa {
    /// The portable code: one lane at a time, on any processor.
    pub const PORTABLE: Isa = Isa(IsaKind::Portable);

    /// All instruction sets that this processor has, the widest last.
    pub fn available() -> Vec<Isa> {
        #[cfg_attr(
            not(any(target_arch = "x86_64", target_arch = "aarch64")),
            expect(unused_mut, reason = "there is but one set")
        )]
        let mut sets = vec![Isa::PORTABLE];
        #[cfg(target_arch = "aarch64")]
        sets.push(Isa(IsaKind::Neon));
        #[cfg(target_arch = "x86_64")]
        {
            if avx2::detected() {
                sets.push(Isa(IsaKind::Avx2));
                #[cfg(not(fuzzing))]
                if avx512::detected() {
                    sets.push(Isa(IsaKind::Avx512));
                }
            }
        }
        sets
    }

    /// The widest instruction set that this processor has.
    pub fn detect() -> Isa {
        *Isa::available().last().unwrap_or(&Isa::PORTABLE)
    }

    /// The name: `portable`, `avx2`, `avx512` or `neon`.
    pub fn name(self) -> &'static str {
        match self.0 {
            IsaKind::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            IsaKind::Avx2 => "avx2",
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            IsaKind::Avx512 => "avx512",
            #[cfg(target_arch = "aarch64")]
            IsaKind::Neon => "neon",
        }
    }

    /// The number of lanes: 1, 8 or 16.
    pub fn lanes(self) -> usize {
        dispatch(self, Width)
    }

    /// The widest instruction set of that number of lanes; `None` if this processor has none.
    pub fn with_lanes(lanes: usize) -> Option<Isa> {
        Isa::available().into_iter().rfind(|isa| isa.lanes() == lanes)
    }

    /// The instruction set of that name; `None` if this processor does not have it.
    pub fn from_name(name: &str) -> Option<Isa> {
        Isa::available().into_iter().find(|isa| isa.name() == name)
    }
}

/// The number of lanes of an instruction set.
struct Width;

impl Kernel for Width {
    type Output = usize;
    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        L::Queue::WIDTH
    }
}

impl fmt::Debug for Isa {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Returns the same number, hidden from the optimizer. (If the compiler knows that one side of a selection is read from
/// memory, it branches, to read it only where it is needed.)
#[inline(always)]
pub fn opaque(number: u32) -> u32 {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    let number = {
        let mut same = number;
        // SAFETY: the assembly does nothing.
        unsafe {
            std::arch::asm!("/* {0:e} */", inout(reg) same, options(pure, nomem, nostack, preserves_flags));
        }
        same
    };
    number
}

/// Runs a kernel, compiled for `isa`.
pub fn dispatch<K: Kernel>(isa: Isa, kernel: K) -> K::Output {
    match isa.0 {
        IsaKind::Portable => kernel.run::<scalar::Portable>(),
        // SAFETY: an `Isa` of this kind was made by `available`, which detected the instructions.
        #[cfg(target_arch = "x86_64")]
        IsaKind::Avx2 => unsafe { avx2::run(kernel) },
        // SAFETY: as above.
        #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
        IsaKind::Avx512 => unsafe { avx512::run(kernel) },
        #[cfg(target_arch = "aarch64")]
        IsaKind::Neon => kernel.run::<neon::Neon>(),
    }
}

#[cfg(test)]
mod tests;
