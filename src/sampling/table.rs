//! Tabulated distributions, sampled by binary search in their cumulative sums. An alias table would take constant time
//! but permutes its numbers; a search preserves their order, so points that are stratified in the square stay
//! stratified over the cells.
//!
//! Cumulative sums are integer multiples of 2⁻²⁴, like random numbers: a cell is found with exactly the reported
//! probability, and each cell of positive weight has a positive probability.

use crate::simd::{Float, Int};

/// The unit of cumulative sums.
const QUANTUM: f64 = 1.0 / 16_777_216.0;
/// The largest float below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
/// The largest number of entries for which a quantum each is guaranteed.
const MAX_ENTRIES: usize = 1 << 23;

/// A density over the unit square, bilinear between nodes, so that it follows an image that is interpolated between its
/// texels. The left and right edges are joined. At the upper and lower edge, the poles of an image of all directions,
/// the density falls to zero.
///
/// A cell lies between four nodes; the cells of the first and the last row have half the height.
#[derive(Clone, Debug)]
pub struct Distribution2d {
    width: u32,
    /// Rows of nodes, without the edges: one fewer than rows of cells.
    height: u32,
    /// Cumulative probabilities of the rows of cells.
    marginal: Vec<f32>,
    /// Cumulative probabilities of the cells within each row: `width + 1` entries per row.
    conditional: Vec<f32>,
    /// The nodes, `width` per row, with a row of zeros at either edge.
    nodes: Vec<f32>,
}

/// A cell: column and row of its first node, and its height.
struct TableCell<F: Float> {
    column: F::Int,
    row: F::Int,
    /// The height in rows: 1, or ½ at the edges.
    high: F,
}

/// The densities at a cell's corners, relative to their mean: the upper two first.
struct CornerDensities<F: Float>([F; 4]);

impl<F: Float> CornerDensities<F> {
    /// The density at a point of the cell.
    #[inline(always)]
    fn at(&self, x: F, y: F) -> F {
        let (left, right) = self.across(y);
        left + (right - left) * x
    }

    /// The densities at height `y` on the left and the right edge.
    #[inline(always)]
    fn across(&self, y: F) -> (F, F) {
        let [a, b, c, d] = self.0;
        (a + (c - a) * y, b + (d - b) * y)
    }

    /// Maps a point of the unit square to a point of the cell, with the cell's density (PBRT 4th ed., A.4 and A.5.1).
    #[inline(always)]
    fn sample(&self, u: (F, F)) -> (F, F) {
        let [a, b, c, d] = self.0;
        let y = linear(u.1, a + b, c + d);
        let (left, right) = self.across(y);
        (linear(u.0, left, right), y)
    }
}

/// Samples the unit interval with a linear density from `from` to `to`.
#[inline(always)]
fn linear<F: Float>(u: F, from: F, to: F) -> F {
    let below = from + (from * from + (to * to - from * from) * u).max(F::zero()).sqrt();
    let some = below.gt(F::splat(1e-20));
    let number = u * (from + to) / F::select(some, below, F::one());
    // If both ends are zero, or if the density and the number both start at zero.
    F::select(some, number, u).min(F::splat(BELOW_ONE))
}

impl Distribution2d {
    /// Builds the distribution from nodes, `width` per row, the top row (next to v = 0) first; an incomplete last row
    /// is ignored. Nodes that are not finite and positive count as zero; if all are zero, the distribution is uniform
    /// over the cells.
    pub fn new(nodes: &[f32], width: usize) -> Self {
        let width = width.clamp(1, MAX_ENTRIES - 1);
        let height = nodes.len() / width;
        let mut padded = vec![0.0; (height + 2) * width];
        for (node, to) in nodes[..height * width].iter().zip(&mut padded[width..]) {
            *to = if *node > 0.0 && node.is_finite() { *node } else { 0.0 };
        }
        if height == 0 {
            return Self {
                width: width as u32,
                height: 0,
                marginal: vec![],
                conditional: vec![],
                nodes: vec![],
            };
        }
        let mut conditional = vec![0.0; (height + 1) * (width + 1)];
        let mut sums = Vec::with_capacity(height + 1);
        for (row, cumulative) in conditional.chunks_exact_mut(width + 1).enumerate() {
            let (upper, lower) = padded[row * width..][..2 * width].split_at(width);
            let column = |x: usize| f64::from(upper[x]) + f64::from(lower[x]);
            let cells = (0..width).map(|x| column(x) + column(if x + 1 < width { x + 1 } else { 0 }));
            sums.push(accumulate(cells, cumulative) * if row == 0 || row == height { 0.5 } else { 1.0 });
        }
        let mut marginal = vec![0.0; height + 2];
        accumulate(sums.iter().copied(), &mut marginal);
        Self { width: width as u32, height: height as u32, marginal, conditional, nodes: padded }
    }

    /// Maps a point of the unit square to a sample and its density. The density is zero where `mask` is not set, and if
    /// there are no nodes.
    #[inline(always)]
    pub fn sample<F: Float>(&self, u: (F, F), mask: F::Mask) -> ((F, F), F) {
        if self.height == 0 {
            return (u, F::zero());
        }
        let row = search(&self.marginal, F::Int::splat(0), self.height as usize + 1, u.1, mask);
        let first = row.index * F::Int::splat(self.width + 1);
        let column = search(&self.conditional, first, self.width as usize, u.0, mask);
        let cell = self.cell(column.index, row.index);
        let corners = self.corners(&cell, mask);
        let (x, y) = corners.sample((column.rest, row.rest));
        let (one, half) = (F::one(), F::splat(0.5));
        let across = (cell.column.to_float() + half + x) / F::splat(self.width as f32);
        let across = F::select(across.lt(one), across, across - one);
        let begin = F::select(row.index.eq(F::Int::splat(0)), F::zero(), row.index.to_float() - half);
        let down = ((begin + y * cell.high) / F::splat(self.height as f32)).min(F::splat(BELOW_ONE));
        ((across, down), self.density(row.probability * column.probability, &cell, corners.at(x, y)))
    }

    /// The density at a point; zero where `mask` is not set.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, place: (F, F), mask: F::Mask) -> F {
        if self.height == 0 {
            return F::zero();
        }
        let (one, half) = (F::one(), F::splat(0.5));
        let (width, height) = (F::splat(self.width as f32), F::splat(self.height as f32));
        let x = place.0 * width - half;
        let x = F::select(x.lt(F::zero()), x + width, x).max(F::zero());
        let y = (place.1 * height + half).max(half).min(height + half);
        let (left, upper) = (x.floor().min(width - one), y.floor().min(height));
        let cell = self.cell(left.to_int(), upper.to_int());
        let begin = F::select(upper.lt(one), half, upper);
        let corners = self.corners(&cell, mask);
        let value = corners.at((x - left).min(one), ((y - begin) / cell.high).min(one));
        let first = cell.row * F::Int::splat(self.width + 1);
        let row: F = step(&self.marginal, cell.row, mask);
        let column: F = step(&self.conditional, first + cell.column, mask);
        self.density(row * column, &cell, value)
    }

    #[inline(always)]
    fn cell<F: Float>(&self, column: F::Int, row: F::Int) -> TableCell<F> {
        let outer = row.eq(F::Int::splat(0)) | row.eq(F::Int::splat(self.height));
        TableCell { column, row, high: F::select(outer, F::splat(0.5), F::one()) }
    }

    #[inline(always)]
    fn corners<F: Float>(&self, cell: &TableCell<F>, mask: F::Mask) -> CornerDensities<F> {
        let width = F::Int::splat(self.width);
        let next = cell.column + F::Int::splat(1);
        let next = F::Int::select(next.eq(width), F::Int::splat(0), next);
        let (upper, lower) = (cell.row * width, cell.row * width + width);
        let a = F::gather(&self.nodes, upper + cell.column, mask);
        let b = F::gather(&self.nodes, upper + next, mask);
        let c = F::gather(&self.nodes, lower + cell.column, mask);
        let d = F::gather(&self.nodes, lower + next, mask);
        let quarter = F::splat(0.25);
        let mean = a * quarter + b * quarter + c * quarter + d * quarter;
        let some = mean.gt(F::splat(f32::MIN_POSITIVE));
        let per_mean = F::one() / F::select(some, mean, F::one());
        let one = F::one();
        CornerDensities([
            F::select(some, a * per_mean, one),
            F::select(some, b * per_mean, one),
            F::select(some, c * per_mean, one),
            F::select(some, d * per_mean, one),
        ])
    }

    /// The density at a point, from the probability of its cell and the relative density within it.
    #[inline(always)]
    fn density<F: Float>(&self, probability: F, cell: &TableCell<F>, within: F) -> F {
        let size = cell.high * F::splat(1.0 / (self.width as f32 * self.height as f32));
        probability * within / size
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<f32>() * (self.marginal.len() + self.conditional.len() + self.nodes.len())
    }
}

/// Writes the cumulative sums of weights, from 0 to exactly 1, and returns the sum of the weights.
fn accumulate<I>(weights: I, cumulative: &mut [f32]) -> f64
where
    I: DoubleEndedIterator<Item = f64> + ExactSizeIterator + Clone,
{
    let count = weights.len();
    let weights = weights.map(|weight| if weight > 0.0 && weight.is_finite() { weight } else { 0.0 });
    let sum: f64 = weights.clone().sum();
    let quanta = 1.0 / QUANTUM;
    // At least one quantum for each positive weight.
    let least = |weight: f64| if count <= MAX_ENTRIES && (weight > 0.0 || sum == 0.0) { 1.0 } else { 0.0 };
    let (mut running, mut end) = (0.0, 0.0f64);
    for (i, weight) in weights.clone().enumerate() {
        running += weight;
        let part = if sum > 0.0 { running / sum } else { (i + 1) as f64 / count as f64 };
        end = (part * quanta).round().max(end + least(weight));
        cumulative[i + 1] = (end * QUANTUM) as f32;
    }
    // Those quanta may have pushed the end beyond 1: preceding cells give them back.
    let mut limit = quanta;
    for (i, weight) in weights.enumerate().rev() {
        let end = (cumulative[i + 1] as f64 * quanta).min(limit);
        cumulative[i + 1] = (end * QUANTUM) as f32;
        limit = end - least(weight);
    }
    sum
}

/// The result of a search.
struct Found<F: Float> {
    index: F::Int,
    probability: F,
    /// The position of the number within the entry, 0 to 1.
    rest: F,
}

/// Binary search for the last of the `count` entries from `first` on that begins at or before `u`. It ends after `u`,
/// so it is not empty.
#[inline(always)]
fn search<F: Float>(cumulative: &[f32], first: F::Int, count: usize, u: F, mask: F::Mask) -> Found<F> {
    // Clamped to the largest random number, which also handles 1 and NaN.
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

/// The difference between an entry and the next.
#[inline(always)]
fn step<F: Float>(cumulative: &[f32], index: F::Int, mask: F::Mask) -> F {
    F::gather(cumulative, index + F::Int::splat(1), mask) - F::gather(cumulative, index, mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use crate::simd::{Isa, Kernel, Lanes, Mask, dispatch};
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
    fn cumulative_sums_give_each_positive_weight_a_probability() {
        let tiny = [1e-30f32, 0.0, 1e30, 0.0, 0.0, 1e-30, 1e-38, 0.0];
        check_cumulative(&cumulative(&tiny), &tiny);
        let mut many = vec![1e-20f32; 10_000];
        (many[77], many[9_998]) = (1.0, 0.0);
        check_cumulative(&cumulative(&many), &many);
        many.reverse();
        check_cumulative(&cumulative(&many), &many);
    }

    #[test]
    fn invalid_weights_count_as_zero_and_all_zeros_are_uniform() {
        let odd = cumulative(&[1.0, f32::NAN, -3.0, f32::INFINITY, 1.0]);
        assert_eq!(odd, [0.0, 0.5, 0.5, 0.5, 0.5, 1.0]);
        assert_eq!(cumulative(&[0.0; 4]), [0.0, 0.25, 0.5, 0.75, 1.0]);
        // Rows of cells: one of half the height, two of full height, one of half the height.
        let flat = Distribution2d::new(&[0.0; 12], 4);
        for (v, density) in [(0.1f32, 1.5), (0.3, 0.75), (0.6, 0.75), (0.9, 1.5)] {
            assert!((flat.pdf((0.9, v), true) - density).abs() < 1e-6);
        }
        assert_eq!(Distribution2d::new(&[], 4).sample((0.1f32, 0.2), true).1, 0.0);
    }

    #[test]
    fn sample_at_the_ends_of_the_unit_interval_finds_cells_of_positive_weight() {
        let table = Distribution2d::new(&[0.0, 0.0, 1.0, 0.0, 2.0, 0.0], 6);
        for (u, expected) in [(0.0f32, 1.5), (-1.0, 1.5), (BELOW_ONE, 5.5), (1.0, 5.5), (f32::NAN, 5.5)] {
            let ((x, _), _) = table.sample((u, 0.5), true);
            assert!((x * 6.0 - expected).abs() < 2e-3, "{u}: {x}");
        }
    }

    /// A table of nodes in which some nodes and one whole row are zero.
    fn spotty(width: usize, height: usize) -> (Vec<f32>, Distribution2d) {
        let mut nodes = numbers(width * height, 9);
        nodes.iter_mut().step_by(4).for_each(|node| *node = 0.0);
        nodes[width..2 * width].fill(0.0);
        let table = Distribution2d::new(&nodes, width);
        (nodes, table)
    }

    #[test]
    fn density_is_bilinear_between_nodes() {
        let (width, height) = (7, 5);
        let (nodes, table) = spotty(width, height);
        let at = |x: f32, y: f32| table.pdf((x / width as f32, y / height as f32), true) as f64;
        let node = |x: usize, y: usize| nodes[y * width + x % width] as f64;
        let scale = at(1.5, 0.5) / node(1, 0);
        let near = |found: f64, expected: f64| {
            assert!((found - expected * scale).abs() < 1e-4 * scale, "{found} and {}", expected * scale);
        };
        for y in 0..height {
            for x in 0..width {
                let (left, top) = (x as f32 + 0.5, y as f32 + 0.5);
                near(at(left, top), node(x, y));
                near(at((left + 0.5) % 7.0, top), (node(x, y) + node(x + 1, y)) / 2.0);
                if y + 1 < height {
                    let all = node(x, y) + node(x + 1, y) + node(x, y + 1) + node(x + 1, y + 1);
                    near(at((left + 0.5) % 7.0, top + 0.5), all / 4.0);
                }
            }
            near(at(3.5, 0.25), node(3, 0) / 2.0);
            near(at(3.5, 5.0), 0.0);
        }
    }

    #[test]
    fn samples_follow_the_density() {
        let (width, height) = (7, 5);
        let (_, table) = spotty(width, height);
        // Splits each cell and the halves of its neighbours into four quarters of 32 x 32 points.
        let (columns, rows, fine) = (width * 2, height * 2, 32);
        let mut expected = vec![0.0f64; columns * rows];
        let size = 1.0 / (columns * rows * fine * fine) as f64;
        for y in 0..rows * fine {
            for x in 0..columns * fine {
                let middle = |i: usize, n: usize| (i as f32 + 0.5) / (n * fine) as f32;
                let density = table.pdf((middle(x, columns), middle(y, rows)), true);
                expected[y / fine * columns + x / fine] += density as f64 * size;
            }
        }
        assert!((expected.iter().sum::<f64>() - 1.0).abs() < 1e-4);
        let n = 200_000;
        let mut counts = vec![0.0f64; columns * rows];
        for u in numbers(2 * n, 4).chunks(2) {
            let ((x, y), pdf) = table.sample((u[0], u[1]), true);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            assert!((pdf - table.pdf((x, y), true)).abs() < 1e-4 * (1.0 + pdf));
            counts[(y * rows as f32) as usize * columns + (x * columns as f32) as usize] += 1.0;
        }
        let (mut chi2, mut freedom) = (0.0, -1.0);
        for (count, part) in counts.iter().zip(expected) {
            if part > 1e-9 {
                let expected = n as f64 * part;
                chi2 += (count - expected).powi(2) / expected;
                freedom += 1.0;
            } else {
                assert_eq!(*count, 0.0);
            }
        }
        // The 99.9 % quantile of chi² by Wilson and Hilferty's approximation.
        let limit =
            freedom * (1.0f64 - 2.0 / (9.0 * freedom) + 3.09 * (2.0 / (9.0 * freedom)).sqrt()).powi(3);
        assert!(chi2 < limit, "{chi2} of {freedom} degrees of freedom, at most {limit}");
    }

    /// Uses a large, spiky image.
    #[test]
    fn sample_returns_the_density_of_its_point_in_a_large_table() {
        let (width, height) = (3001, 517);
        let nodes: Vec<f32> = numbers(width * height, 5).iter().map(|u| u.powi(40)).collect();
        let table = Distribution2d::new(&nodes, width);
        let mut apart = 0;
        for u in numbers(20_000, 6).chunks(2) {
            let (place, pdf) = table.sample((u[0], u[1]), true);
            assert!(pdf > 0.0, "{u:?}");
            // Points are rounded to a ten-thousandth of a cell; beside a dark node that is noticeable.
            apart += usize::from((pdf / table.pdf(place, true) - 1.0).abs() > 0.01);
        }
        assert!(apart < 20, "{apart} of 10,000");
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
        let expected = dispatch(Isa::PORTABLE, Draw(&table, &u));
        for isa in Isa::available() {
            assert_eq!(dispatch(isa, Draw(&table, &u)), expected, "{isa:?}");
        }
    }
}
