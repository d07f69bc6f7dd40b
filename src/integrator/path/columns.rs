//! Arrays of numbers in columns, so that lanes load and pack them directly. Columns are longer than their capacity by the
//! widest lane count, past which kernels never write.

use crate::simd::{Float, Int, Mask};

/// The padding of columns, at least the width of any lane type.
pub const PADDING: usize = 16;

/// `N` columns of floats and `M` of integers with a common length.
pub struct Columns<const N: usize, const M: usize> {
    pub(in crate::integrator) floats: [Vec<f32>; N],
    pub(in crate::integrator) integers: [Vec<u32>; M],
    pub(in crate::integrator) length: usize,
    capacity: usize,
}

impl<const N: usize, const M: usize> Columns<N, M> {
    /// Creates columns with room for `capacity` items.
    pub fn new(capacity: usize) -> Self {
        Self {
            floats: std::array::from_fn(|_| vec![0.0; capacity + PADDING]),
            integers: std::array::from_fn(|_| vec![0; capacity + PADDING]),
            length: 0,
            capacity,
        }
    }

    /// The number of items.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.length
    }

    /// True if there are no items.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Bytes of one item.
    pub const ITEM: usize = 4 * (N + M);

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        Self::ITEM * (self.capacity + PADDING)
    }

    /// The number of items that fit in all.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The number of further items that fit.
    pub fn room(&self) -> usize {
        self.capacity - self.length
    }

    /// Removes all items.
    pub fn clear(&mut self) {
        self.length = 0;
    }

    /// Sets the number of items, whose columns have been or will be written.
    pub fn set_len(&mut self, length: usize) {
        assert!(length <= self.capacity, "a queue holds more than its capacity");
        self.length = length;
    }

    /// Sets a larger capacity.
    pub(in crate::integrator) fn grow(&mut self, capacity: usize) {
        self.capacity = capacity;
        self.floats.iter_mut().for_each(|c| c.resize(capacity + PADDING, 0.0));
        self.integers.iter_mut().for_each(|c| c.resize(capacity + PADDING, 0));
    }

    /// Loads lanes of a column of floats.
    #[inline(always)]
    pub fn float<F: Float>(&self, column: usize, at: usize) -> F {
        F::load(&self.floats[column][at..])
    }

    /// Loads lanes of a column of integers.
    #[inline(always)]
    pub fn integer<I: Int>(&self, column: usize, at: usize) -> I {
        I::load(&self.integers[column][at..])
    }

    /// Packs lanes to place `at`.
    #[inline(always)]
    pub fn pack<F: Float>(&mut self, at: usize, mask: F::Mask, floats: [F; N], integers: [F::Int; M]) {
        for (column, value) in self.floats.iter_mut().zip(floats) {
            value.compress(mask, &mut column[at..]);
        }
        for (column, value) in self.integers.iter_mut().zip(integers) {
            value.compress(mask, &mut column[at..]);
        }
    }

    /// Packs lanes to the end.
    #[inline(always)]
    pub fn append<F: Float>(&mut self, mask: F::Mask, floats: [F; N], integers: [F::Int; M]) {
        let at = self.length;
        self.pack::<F>(at, mask, floats, integers);
        self.set_len(at + mask.count());
    }

    /// A column of floats.
    pub fn floats(&self, column: usize) -> &[f32] {
        &self.floats[column][..self.length]
    }

    /// A column of floats, writable.
    pub fn floats_mut(&mut self, column: usize) -> &mut [f32] {
        &mut self.floats[column][..self.length]
    }

    /// A column of integers.
    pub fn integers(&self, column: usize) -> &[u32] {
        &self.integers[column][..self.length]
    }

    /// Moves the last items of another queue, as many as fit, to the end of this one.
    pub(in crate::integrator) fn take_last(&mut self, from: &mut Self) {
        if self.length == 0 && from.capacity == self.capacity {
            return std::mem::swap(self, from);
        }
        let count = from.length.min(self.room());
        let (start, to) = (from.length - count, self.length);
        for (column, source) in self.floats.iter_mut().zip(&from.floats) {
            column[to..to + count].copy_from_slice(&source[start..start + count]);
        }
        for (column, source) in self.integers.iter_mut().zip(&from.integers) {
            column[to..to + count].copy_from_slice(&source[start..start + count]);
        }
        from.length = start;
        self.length += count;
    }
}
