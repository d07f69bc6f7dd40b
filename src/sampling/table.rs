//! Piecewise-constant distributions, sampled by binary search in their cumulative
//! sums. An alias table would answer in constant time, but it scatters its numbers: a search
//! keeps their order, so that points stratified in the square stay stratified over the cells.
//!
//! Cumulative sums are whole multiples of 2⁻²⁴, as random numbers are: the probability that is
//! told is the one with which a cell is found, and a cell of any weight above zero has one.

use crate::simd::{Float, Int};

/// What cumulative sums are multiples of.
const QUANTUM: f64 = 1.0 / 16_777_216.0;
/// The largest float below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
/// Twice the error of a quotient and a product: the part of itself by which a place keeps off
/// its cell's edges, so that the cell is found again.
const MARGIN: f32 = 1.0 / 4_194_304.0;
/// More entries than this could have no quantum each.
const MAX_ENTRIES: usize = 1 << 23;

/// A density over the unit square, constant in each cell of a grid.
#[derive(Clone, Debug)]
pub struct Distribution2d {
    width: u32,
    height: u32,
    /// Over the rows.
    marginal: Vec<f32>,
    /// Within each row, `width + 1` entries a row.
    conditional: Vec<f32>,
}

impl Distribution2d {
    /// Of `width` weights a row, top row (v = 0) first; a last row that is not full is left out.
    /// Weights count as zero where they are not finite and positive; if all are zero, the
    /// density is even.
    pub fn new(weights: &[f32], width: usize) -> Self {
        let width = width.clamp(1, MAX_ENTRIES);
        let rows = weights.chunks_exact(width);
        let height = rows.len();
        let mut conditional = vec![0.0; height * (width + 1)];
        let mut sums = Vec::with_capacity(height);
        for (row, cumulative) in rows.zip(conditional.chunks_exact_mut(width + 1)) {
            sums.push(accumulate(row.iter().map(|&weight| weight as f64), cumulative));
        }
        let mut marginal = vec![0.0; height + 1];
        accumulate(sums.iter().copied(), &mut marginal);
        Self { width: width as u32, height: height as u32, marginal, conditional }
    }

    /// A point from one in the unit square, and the density there. The density is zero where
    /// `mask` is not set and where there are no cells.
    #[inline(always)]
    pub fn sample<F: Float>(&self, u: (F, F), mask: F::Mask) -> ((F, F), F) {
        if self.height == 0 {
            return (u, F::zero());
        }
        let row = search(&self.marginal, F::Int::splat(0), self.height as usize, u.1, mask);
        let first = row.index * F::Int::splat(self.width + 1);
        let column = search(&self.conditional, first, self.width as usize, u.0, mask);
        let place = (place(column.index, column.rest, self.width), place(row.index, row.rest, self.height));
        (place, self.density(row.probability, column.probability))
    }

    /// The density at a point; zero where `mask` is not set.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, place: (F, F), mask: F::Mask) -> F {
        if self.height == 0 {
            return F::zero();
        }
        let (column, row) = (cell(place.0, self.width), cell(place.1, self.height));
        let first = row * F::Int::splat(self.width + 1);
        self.density(step(&self.marginal, row, mask), step(&self.conditional, first + column, mask))
    }

    /// From the probabilities of a row and, in it, of a column.
    #[inline(always)]
    fn density<F: Float>(&self, row: F, column: F) -> F {
        (row * F::splat(self.height as f32)) * (column * F::splat(self.width as f32))
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        size_of::<f32>() * (self.marginal.len() + self.conditional.len())
    }
}

/// Writes the cumulative sums of weights, from 0 to exactly 1, and gives their sum.
fn accumulate<I>(weights: I, cumulative: &mut [f32]) -> f64
where
    I: DoubleEndedIterator<Item = f64> + ExactSizeIterator + Clone,
{
    let count = weights.len();
    let weights = weights.map(|weight| if weight > 0.0 && weight.is_finite() { weight } else { 0.0 });
    let sum: f64 = weights.clone().sum();
    let quanta = 1.0 / QUANTUM;
    // One quantum at least for what has a weight.
    let least = |weight: f64| if count <= MAX_ENTRIES && (weight > 0.0 || sum == 0.0) { 1.0 } else { 0.0 };
    let (mut running, mut end) = (0.0, 0.0f64);
    for (i, weight) in weights.clone().enumerate() {
        running += weight;
        let part = if sum > 0.0 { running / sum } else { (i + 1) as f64 / count as f64 };
        end = (part * quanta).round().max(end + least(weight));
        cumulative[i + 1] = (end * QUANTUM) as f32;
    }
    // Those quanta may have pushed the end beyond 1: the cells before it give them back.
    let mut limit = quanta;
    for (i, weight) in weights.enumerate().rev() {
        let end = (cumulative[i + 1] as f64 * quanta).min(limit);
        cumulative[i + 1] = (end * QUANTUM) as f32;
        limit = end - least(weight);
    }
    sum
}

/// What a search finds.
struct Found<F: Float> {
    index: F::Int,
    probability: F,
    /// Where between the ends of its part of the unit interval.
    rest: F,
}

/// The last of the `count` parts from entry `first` on that begins at or before `u`, by halving.
/// It ends after `u`, so it is not empty.
#[inline(always)]
fn search<F: Float>(cumulative: &[f32], first: F::Int, count: usize, u: F, mask: F::Mask) -> Found<F> {
    // At most the last random number, which also takes care of 1 and of NaN.
    let u = F::select(u.lt(F::splat(BELOW_ONE)), u, F::splat(BELOW_ONE)).max(F::zero());
    let end = F::Int::splat(count as u32);
    let mut index = F::Int::splat(0);
    let mut stride = count.next_power_of_two() as u32 / 2;
    while stride > 0 {
        let probe = index + F::Int::splat(stride);
        let inside = mask & probe.lt(end);
        let before = inside & F::gather(cumulative, first + probe, inside).le(u);
        index = F::Int::select(before, probe, index);
        stride /= 2;
    }
    let begin = F::gather(cumulative, first + index, mask);
    let probability = step(cumulative, first + index, mask);
    let rest = (u - begin) / F::select(mask, probability, F::one());
    Found { index, probability, rest: rest.min(F::splat(BELOW_ONE)) }
}

/// How far it is from an entry to the next.
#[inline(always)]
fn step<F: Float>(cumulative: &[f32], index: F::Int, mask: F::Mask) -> F {
    F::gather(cumulative, index + F::Int::splat(1), mask) - F::gather(cumulative, index, mask)
}

/// The coordinate in [0, 1) of a place in a cell, such that [`cell`] finds the cell again.
#[inline(always)]
fn place<F: Float>(index: F::Int, rest: F, cells: u32) -> F {
    let low = index.to_float();
    let high = low + F::one();
    let within = (low + rest).max(low * F::splat(1.0 + MARGIN)).min(high * F::splat(1.0 - MARGIN));
    within / F::splat(cells as f32)
}

/// Which of the cells along an axis a coordinate is in; the outermost for what is outside.
#[inline(always)]
fn cell<F: Float>(place: F, cells: u32) -> F::Int {
    (place * F::splat(cells as f32)).clamp(0.0, (cells - 1) as f32).to_int()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use crate::simd::{Kernel, Lanes, Level, Mask, dispatch};
    use rand::RngExt;

    fn numbers(n: usize, seed: u64) -> Vec<f32> {
        let mut stream = Stream::new(seed);
        (0..n).map(|_| stream.random_range(0.0..1.0f32)).collect()
    }

    fn cumulative(weights: &[f32]) -> Vec<f32> {
        let mut sums = vec![0.0; weights.len() + 1];
        accumulate(weights.iter().map(|&weight| weight as f64), &mut sums);
        sums
    }

    fn check_cumulative(cumulative: &[f32], weights: &[f32]) {
        assert_eq!((cumulative[0], cumulative[weights.len()]), (0.0, 1.0));
        for (i, &weight) in weights.iter().enumerate() {
            let part = cumulative[i + 1] - cumulative[i];
            assert!(if weight > 0.0 { part > 0.0 } else { part == 0.0 }, "{i}: {weight} has {part}");
        }
    }

    #[test]
    fn whatever_has_a_weight_has_a_probability() {
        let tiny = [1e-30f32, 0.0, 1e30, 0.0, 0.0, 1e-30, 1e-38, 0.0];
        check_cumulative(&cumulative(&tiny), &tiny);
        let mut many = vec![1e-20f32; 10_000];
        (many[77], many[9_998]) = (1.0, 0.0);
        check_cumulative(&cumulative(&many), &many);
        many.reverse();
        check_cumulative(&cumulative(&many), &many);
    }

    #[test]
    fn odd_weights_count_as_zero_and_zeros_as_alike() {
        let odd = cumulative(&[1.0, f32::NAN, -3.0, f32::INFINITY, 1.0]);
        assert_eq!(odd, [0.0, 0.5, 0.5, 0.5, 0.5, 1.0]);
        assert_eq!(cumulative(&[0.0; 4]), [0.0, 0.25, 0.5, 0.75, 1.0]);
        let flat = Distribution2d::new(&[0.0; 12], 4);
        assert!((flat.pdf((0.9f32, 0.1), true) - 1.0).abs() < 1e-6);
        assert_eq!(Distribution2d::new(&[], 4).sample((0.1f32, 0.2), true).1, 0.0);
    }

    #[test]
    fn the_ends_of_the_unit_interval_find_cells_with_a_weight() {
        let table = Distribution2d::new(&[0.0, 0.0, 1.0, 0.0, 2.0, 0.0], 6);
        for (u, expected) in [(0.0f32, 2), (-1.0, 2), (BELOW_ONE, 4), (1.0, 4), (f32::NAN, 4)] {
            let ((x, _), pdf) = table.sample((u, 0.5), true);
            assert_eq!((x * 6.0) as u32, expected, "{u}");
            assert!(pdf > 0.0);
        }
    }

    #[test]
    fn points_are_drawn_by_the_density() {
        let (width, height) = (7, 5);
        let mut weights = numbers(width * height, 9);
        weights.iter_mut().step_by(4).for_each(|weight| *weight = 0.0);
        weights[7..14].fill(0.0);
        let table = Distribution2d::new(&weights, width);
        let sum: f32 = weights.iter().sum();
        let n = 200_000;
        // Each cell in four quarters.
        let mut counts = vec![0.0f64; width * height * 4];
        for u in numbers(2 * n, 4).chunks(2) {
            let ((x, y), pdf) = table.sample((u[0], u[1]), true);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            assert_eq!(pdf, table.pdf((x, y), true));
            counts[(y * 2.0 * height as f32) as usize * 2 * width + (x * 2.0 * width as f32) as usize] += 1.0;
        }
        let (mut chi2, mut freedom) = (0.0, -1.0);
        for (i, count) in counts.iter().enumerate() {
            let (x, y) = (i % (2 * width) / 2, i / (2 * width) / 2);
            let weight = weights[y * width + x] / sum;
            let density =
                table.pdf(((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32), true);
            assert!((density - weight * (width * height) as f32).abs() < 1e-4);
            if weight > 0.0 {
                let expected = n as f64 * weight as f64 / 4.0;
                chi2 += (count - expected).powi(2) / expected;
                freedom += 1.0;
            } else {
                assert_eq!((*count, density), (0.0, 0.0));
            }
        }
        // 99.9 % of chi² by Wilson and Hilferty's approximation.
        let limit =
            freedom * (1.0f64 - 2.0 / (9.0 * freedom) + 3.09 * (2.0 / (9.0 * freedom)).sqrt()).powi(3);
        assert!(chi2 < limit, "{chi2} of {freedom} degrees of freedom, at most {limit}");
    }

    /// Points of a large, spiky image lie in the cell that they were drawn from.
    #[test]
    fn the_density_of_a_sample_is_that_of_its_place() {
        let (width, height) = (3001, 517);
        let weights: Vec<f32> = numbers(width * height, 5).iter().map(|u| u.powi(40)).collect();
        let table = Distribution2d::new(&weights, width);
        for u in
            numbers(20_000, 6).chunks(2).map(|u| (u[0], u[1])).chain([(0.0, 0.0), (BELOW_ONE, BELOW_ONE)])
        {
            let (place, pdf) = table.sample(u, true);
            assert!(pdf > 0.0);
            assert_eq!(pdf, table.pdf(place, true), "{u:?}");
        }
    }

    struct Draw<'a>(&'a Distribution2d, &'a [f32]);

    impl Kernel for Draw<'_> {
        type Output = Vec<f32>;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<f32> {
            let mut out = Vec::new();
            draw::<L::Queue>(self.0, self.1, &mut out);
            out
        }
    }

    #[inline(always)]
    fn draw<F: Float>(table: &Distribution2d, u: &[f32], out: &mut Vec<f32>) {
        let mut row = [0.0; 16];
        for first in (0..u.len() / 2).step_by(F::WIDTH) {
            let point = (F::load(&u[first..]), F::load(&u[u.len() / 2 + first..]));
            let ((x, y), pdf) = table.sample(point, F::Mask::first(F::WIDTH));
            (x + y * F::splat(3.0) + pdf * F::splat(5.0)).store(&mut row);
            out.extend_from_slice(&row[..F::WIDTH]);
        }
    }

    #[test]
    fn every_level_gives_the_same_bits() {
        let table = Distribution2d::new(&numbers(33 * 21, 1), 33);
        let u = numbers(512, 2);
        let expected = dispatch(Level::PORTABLE, Draw(&table, &u));
        for level in Level::available() {
            assert_eq!(dispatch(level, Draw(&table, &u)), expected, "{level:?}");
        }
    }
}
