//! N points in the unit square: uniform, jittered or regular. Each point is a pure function of its index.

use crate::math::hash::SampleKey;
use crate::simd::{Float, Int, Mask};
use crate::world::{Pattern, Settings};

/// The largest number of points of a stratified pattern: cell numbers must be exact as floats.
pub const MAX_STRATA: u32 = Settings::MOST_SAMPLES;

/// A grid of at least N cells, as nearly square as possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Cells along u.
    pub columns: u32,
    /// Cells along v.
    pub rows: u32,
}

impl Grid {
    /// A grid for `count` points, 1 to [`MAX_STRATA`].
    pub fn new(count: u32) -> Self {
        let count = count.clamp(1, MAX_STRATA);
        let mut columns = (count as f64).sqrt() as u32;
        while columns * columns < count {
            columns += 1;
        }
        Self { columns, rows: count.div_ceil(columns) }
    }

    /// The number of cells.
    pub fn cells(self) -> u32 {
        self.columns * self.rows
    }

    /// Column and row of cell number `cell`.
    #[inline(always)]
    fn place<F: Float>(self, cell: F::Int) -> (F, F) {
        let columns = F::splat(self.columns as f32);
        let number = cell.to_float();
        // Adding half a cell keeps the quotient away from integers, so rounding cannot cross one.
        let row = ((number + F::splat(0.5)) / columns).floor();
        (number - row * columns, row)
    }

    /// Maps a point of the unit square into a cell.
    #[inline(always)]
    fn point<F: Float>(self, cell: F::Int, inner: (F, F)) -> (F, F) {
        let (column, row) = self.place::<F>(cell);
        let below_one = F::splat(1.0 - f32::EPSILON / 2.0);
        (
            ((column + inner.0) * F::splat(1.0 / self.columns as f32)).min(below_one),
            ((row + inner.1) * F::splat(1.0 / self.rows as f32)).min(below_one),
        )
    }
}

/// A permutation of 0..length, selected by `seed`: a bijection of the next power of two, repeated while its result is
/// out of range (Kensler, "Correlated multi-jittered sampling", 2013). An index out of range counts as 0.
#[inline(always)]
pub fn permute<I: Int>(index: I, length: u32, seed: I) -> I {
    if length <= 1 {
        return I::splat(0);
    }
    let mask = I::splat(u32::MAX >> (length - 1).leading_zeros());
    let end = I::splat(length);
    let inside = I::select(index.lt(end), index, I::splat(0));
    let mut i = scramble(inside, mask, seed);
    loop {
        let outside = !i.lt(end);
        if !outside.any() {
            return i;
        }
        i = I::select(outside, scramble(i, mask, seed), i);
    }
}

/// A bijection of the integers up to `mask` = 2ᵏ − 1: each step (xor, odd multiple, xor with own higher bits, addition)
/// is a bijection.
#[inline(always)]
fn scramble<I: Int>(i: I, mask: I, seed: I) -> I {
    let x = (i ^ seed) * I::splat(0x9e37_79b1);
    let x = x ^ (x & mask).shr::<3>() ^ seed.shr::<11>();
    let x = x * (seed.shr::<23>() | I::splat(1)) * I::splat(0x85eb_ca6b);
    let x = x ^ (x & mask).shr::<1>() ^ seed.shr::<19>();
    let x = x * (seed.shr::<14>() | I::splat(1)) * I::splat(0x2c1b_3c6d);
    let x = x ^ (x & mask).shr::<2>() ^ seed.shr::<3>();
    let x = x * (seed.shr::<5>() | I::splat(1)) * I::splat(0xc2b2_ae35);
    let x = x ^ (x & mask).shr::<1>();
    (x + seed.shr::<7>()) & mask
}

/// The point in the unit square of sample `key.sample` of a pixel; `pattern` spreads the points over all samples of the
/// pixel. `grid` is made for their number.
#[inline(always)]
pub fn point<F: Float>(pattern: Pattern, grid: Grid, key: SampleKey<F::Int>, dimension: F::Int) -> (F, F) {
    let (second, order) = (dimension + F::Int::splat(1), dimension + F::Int::splat(2));
    match pattern {
        Pattern::Uniform => (key.uniform(dimension), key.uniform(second)),
        Pattern::Regular => grid.point(key.sample, (F::splat(0.5), F::splat(0.5))),
        Pattern::Center => (F::splat(0.5), F::splat(0.5)),
        Pattern::Jittered => {
            let cell = permute(key.sample, grid.cells(), key.pixel_hash(order));
            grid.point(cell, (key.uniform(dimension), key.uniform(second)))
        }
    }
}

/// Point `which` of the `grid.cells()` points that one sample spreads over the square. Each jittered point has its own
/// cell of `grid`, and within it each sample of the pixel has its own cell of `pixel`: the points of one sample are
/// stratified, and so are those of all samples.
#[inline(always)]
pub fn point_of_many<F: Float>(
    pattern: Pattern,
    grid: Grid,
    which: u32,
    pixel: Grid,
    key: SampleKey<F::Int>,
    dimension: F::Int,
) -> (F, F) {
    let key = key.fork(which);
    match pattern {
        Pattern::Uniform => point(Pattern::Uniform, pixel, key, dimension),
        Pattern::Regular => grid.point(F::Int::splat(which), (F::splat(0.5), F::splat(0.5))),
        Pattern::Center => (F::splat(0.5), F::splat(0.5)),
        Pattern::Jittered => {
            grid.point(F::Int::splat(which), point(Pattern::Jittered, pixel, key, dimension))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::Wrapping;

    #[test]
    fn permute_is_a_permutation() {
        for length in [1, 2, 3, 5, 16, 17, 100, 1000] {
            for seed in [0, 1, 0xdead_beef] {
                let mut seen = vec![false; length as usize];
                for i in 0..length {
                    let j = permute(Wrapping(i), length, Wrapping(seed)).0 as usize;
                    assert!(!std::mem::replace(&mut seen[j], true), "{length} {seed}");
                }
            }
        }
    }

    #[test]
    fn permute_moves_each_index_to_every_place_equally_often() {
        for length in [2u32, 4, 7, 16] {
            let mut counts = vec![0u32; (length * length) as usize];
            let n = 20_000;
            for seed in 0..n {
                for i in 0..length {
                    let hash = crate::sampling::hash::mix(Wrapping(seed));
                    counts[(i * length + permute(Wrapping(i), length, hash).0) as usize] += 1;
                }
            }
            let expected = n as f64 / length as f64;
            for (place, &count) in counts.iter().enumerate() {
                let sigma = (count as f64 - expected) / expected.sqrt();
                assert!(sigma.abs() < 5.0, "length {length} place {place}: {sigma} σ");
            }
        }
    }

    fn key(sample: u32) -> SampleKey<Wrapping<u32>> {
        SampleKey::new(1, Wrapping(77), Wrapping(sample), Wrapping(0))
    }

    #[test]
    fn jittered_points_lie_in_different_cells() {
        let grid = Grid::new(36);
        assert_eq!(grid, Grid { columns: 6, rows: 6 });
        let mut cells = std::collections::HashSet::new();
        for s in 0..36 {
            let (u, v): (f32, f32) = point(Pattern::Jittered, grid, key(s), Wrapping(0));
            assert!((0.0..1.0).contains(&u) && (0.0..1.0).contains(&v));
            cells.insert(((u * 6.0) as u32, (v * 6.0) as u32));
        }
        assert_eq!(cells.len(), 36);
    }

    #[test]
    fn point_of_many_is_stratified_within_a_sample_and_over_all_samples() {
        let (light, pixel) = (Grid::new(4), Grid::new(16));
        let mut fine = std::collections::HashSet::new();
        for sample in 0..16 {
            let mut coarse = std::collections::HashSet::new();
            for which in 0..4 {
                let (u, v): (f32, f32) =
                    point_of_many(Pattern::Jittered, light, which, pixel, key(sample), Wrapping(16));
                coarse.insert(((u * 2.0) as u32, (v * 2.0) as u32));
                fine.insert(((u * 8.0) as u32, (v * 8.0) as u32));
            }
            assert_eq!(coarse.len(), 4);
        }
        assert_eq!(fine.len(), 64);
    }

    #[test]
    fn place_is_exact_in_the_largest_grid() {
        let grid = Grid::new(MAX_STRATA);
        for cell in [0, 2047, 2048, MAX_STRATA - 1] {
            let (column, row): (f32, f32) = grid.place(Wrapping(cell));
            assert_eq!((column as u32, row as u32), (cell % grid.columns, cell / grid.columns));
        }
    }

    #[test]
    fn regular_and_center_points_are_centres_of_cells_and_pixel() {
        let (u, v): (f32, f32) = point(Pattern::Regular, Grid::new(1), key(0), Wrapping(0));
        assert_eq!((u, v), (0.5, 0.5));
        assert_eq!(point::<f32>(Pattern::Center, Grid::new(16), key(6), Wrapping(0)), (0.5, 0.5));
        let (u, v): (f32, f32) = point(Pattern::Regular, Grid::new(16), key(6), Wrapping(0));
        assert_eq!((u, v), (0.625, 0.375));
    }
}
