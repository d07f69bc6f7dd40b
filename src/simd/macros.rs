//! Macros that define lanes: functions of one expression, and the parts that all wide lanes have in common.

/// Defines inlined functions of one expression each.
macro_rules! inlined {
    ($(fn $name:ident $(<const $n:ident: i32>)? ($($arg:tt)*) $(-> $out:ty)? => $body:expr;)*) => {$(
        #[inline(always)]
        fn $name $(<const $n: i32>)? ($($arg)*) $(-> $out)? {
            $body
        }
    )*};
}

/// Defines inlined functions of instructions that access no memory.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! instructions {
    ($(fn $name:ident $(<const $n:ident: i32>)? ($($arg:tt)*) $(-> $out:ty)? => $body:expr;)*) => {$(
        #[inline(always)]
        fn $name $(<const $n: i32>)? ($($arg)*) $(-> $out)? {
            // SAFETY: wide lanes are used by dispatched kernels only, on a processor that has the instructions.
            unsafe { $body }
        }
    )*};
}

/// Implements operators by one instruction each, which `$each` applies to the registers.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! operators {
    ($each:ident, $($type:ident: $($trait:ident::$method:ident = $instruction:ident),*;)*) => {$($(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                $each!(Self, $instruction, self, other)
            }
        }
    )*)*};
}

/// Declares wide lanes by their registers.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! wide_lanes {
    ($float:ident($($floats:ty),*), $int:ident($($ints:ty),*), $mask:ident($($masks:ty),*)) => {
        /// Floats, one a lane.
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub(super) struct $float($($floats),*);

        /// Integers, one a lane.
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub(super) struct $int($($ints),*);

        /// A lane mask.
        #[derive(Clone, Copy)]
        pub(super) struct $mask($($masks),*);

        impl Not for $mask {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                self ^ Self::from_bits(u32::MAX)
            }
        }
    };
}

/// Defines loads and stores of as many numbers as there are lanes.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! loads_and_stores {
    ($width:literal, $number:ty) => {
        #[inline(always)]
        fn load(values: &[$number]) -> Self {
            let values = &values[..$width];
            // SAFETY: the slice has a number for each lane, and the type consists of nothing but these.
            unsafe { values.as_ptr().cast::<Self>().read_unaligned() }
        }
        #[inline(always)]
        fn store(self, out: &mut [$number]) {
            let out = &mut out[..$width];
            // SAFETY: the slice has room for all lanes; as above.
            unsafe { out.as_mut_ptr().cast::<Self>().write_unaligned(self) }
        }
    };
}

/// Defines the part of [`super::Float`] that is the same for all wide lanes.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! wide_float {
    ($width:literal, $int:ident, $mask:ident) => {
        const WIDTH: usize = $width;
        type Mask = $mask;
        type Int = $int;

        loads_and_stores!($width, f32);
    };
}

/// Defines the part of [`super::Int`] that is the same for all wide lanes.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! wide_int {
    ($width:literal, $float:ident, $mask:ident) => {
        type Mask = $mask;
        type Float = $float;

        loads_and_stores!($width, u32);
    };
}
