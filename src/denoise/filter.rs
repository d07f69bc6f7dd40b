//! Non-local means of one half of the samples, with weights from the other half and from features; over lanes, tile by
//! tile.

use rayon::prelude::*;

use super::plane::{BORDER, ImagePlane};
use crate::math::elementary::exp2;
use crate::simd::{Float, Isa, Kernel, Lanes, dispatch};

/// The columns and rows of a tile: its sums stay in the second-level cache.
pub const TILE: [usize; 2] = [64, 16];
/// The number of columns of scratch rows: patches reach beyond the tile, and lanes beyond those.
const ROW: usize = TILE[0] + 2 * super::PATCH + 16;
/// The number of scratch rows.
const ROWS: usize = TILE[1] + 2 * super::PATCH;

/// The inputs and parameters of a filter.
pub struct FilterPass<'a> {
    /// The channels of even and of odd samples.
    pub halves: [&'a [&'a ImagePlane]; 2],
    /// The channels of even and of odd samples that are compared to find pixels that look alike.
    pub compared: [&'a [&'a ImagePlane]; 2],
    /// The variance of one half in each compared channel.
    pub variance: &'a [&'a ImagePlane],
    /// The features, in units in which a difference of 1 leaves e⁻¹ of the weight.
    pub features: &'a [ImagePlane],
    /// The factor on distances between patches, 1 / k².
    pub sharpness: f32,
    /// The filtered images to compute.
    pub candidates: &'a [FilteredImage],
    /// The radius of the filter in units of the stride: see [`FilterPass::steps`].
    pub radius: usize,
    /// The distance in pixels between the pixels that are averaged; their weights fall towards the radius. Without it
    /// the distance is 1, all weights are equal, and beyond [`DENSE`] every other pixel is left out.
    pub stride: Option<usize>,
    /// The radius of patches in pixels.
    pub patch: usize,
    /// Added to variances.
    pub least: f32,
}

/// A way to weigh pixels for a filtered image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilteredImage {
    /// Weights by colours and features: e^(−distance) to the power of 2ⁿ, so that one exponential is enough.
    Colors(u32),
    /// [`FilteredImage::Colors`], but features may differ by 2√2 times as much.
    Wide(u32),
    /// Weights by features only.
    FeaturesAlone,
}

/// Within this radius all pixels count; beyond it those of one colour of a chequerboard, and in an outer ring of the
/// same area those of the other colour: with one colour only, the image would split into two images that share no
/// pixel.
const DENSE: i32 = 4;

/// The sums of a tile: weights, then channels, of each half of each candidate.
struct TileSums {
    sums: Vec<f32>,
    /// The number of values that each sum has in a tile.
    area: usize,
}

impl FilterPass<'_> {
    /// Returns the offsets of the pixels to average, within a disc and from the corner of the border, and their
    /// weights.
    fn steps(&self) -> Vec<([usize; 2], f32)> {
        let radius = self.radius as i32;
        let taken = |[dx, dy]: &[i32; 2]| {
            let square = dx * dx + dy * dy;
            let outer = 2 * square > DENSE * DENSE + radius * radius;
            let kept = self.stride.is_some() || square <= DENSE * DENSE || ((dx + dy) % 2 != 0) == outer;
            kept && 2 * square <= 2 * radius * radius + radius
        };
        let row = |dy: i32| (-radius..=radius).map(move |dx| [dx, dy]);
        let steps = (-radius..=radius).flat_map(row).filter(taken);
        let place = |way: i32| (way * self.stride.unwrap_or(1) as i32 + BORDER as i32) as usize;
        let weight = |[dx, dy]: [i32; 2]| {
            let beyond = (radius + 1) * (radius + 1);
            let near = 1.0 - (dx * dx + dy * dy) as f32 / beyond as f32;
            if self.stride.is_some() { near * near } else { 1.0 }
        };
        steps.map(|step| (step.map(place), weight(step))).collect()
    }

    /// Returns planes `[candidate][half][channel]`; the one after the channels holds the sums of weights.
    pub fn run(&self, isa: Isa) -> Vec<[Vec<ImagePlane>; 2]> {
        let size = self.halves[0][0].size;
        let across = size[0].div_ceil(TILE[0]);
        let count = across * size[1].div_ceil(TILE[1]);
        let corner = |tile: usize| [tile % across * TILE[0], tile / across * TILE[1]];
        let steps = &self.steps()[..];
        let run = |tile: usize| dispatch(isa, TileKernel { pass: self, steps, corner: corner(tile) });
        let tiles: Vec<TileSums> = (0..count).into_par_iter().map(run).collect();
        let value = |at: usize, number: usize| {
            let (x, y) = (at % size[0], at / size[0]);
            let tile = &tiles[y / TILE[1] * across + x / TILE[0]];
            tile.sums[number * tile.area + y % TILE[1] * TILE[0] + x % TILE[0]]
        };
        let channels = self.halves[0].len();
        let plane = |candidate: usize, half: usize, channel: usize| {
            let first = (2 * candidate + half) * (channels + 1);
            ImagePlane::new(size, |at| value(at, first + 1 + channel) / value(at, first))
        };
        let weights = |candidate: usize, half: usize| {
            ImagePlane::new(size, |at| value(at, (2 * candidate + half) * (channels + 1)))
        };
        let half = |candidate: usize, half: usize| {
            let means = (0..channels).map(|channel| plane(candidate, half, channel));
            means.chain([weights(candidate, half)]).collect()
        };
        (0..self.candidates.len()).map(|candidate| [0, 1].map(|number| half(candidate, number))).collect()
    }
}

struct TileKernel<'a> {
    pass: &'a FilterPass<'a>,
    /// Offsets from the corner of the border, and weights.
    steps: &'a [([usize; 2], f32)],
    corner: [usize; 2],
}

impl Kernel for TileKernel<'_> {
    type Output = TileSums;
    #[inline(always)]
    fn run<L: Lanes>(self) -> TileSums {
        tile::<L::Queue>(&self)
    }
}

/// Distances of patches between a tile's pixels and those one step away, in each half.
struct Distances {
    of: [Vec<f32>; 2],
    rows: [Vec<f32>; 2],
}

#[inline(always)]
fn tile<F: Float>(TileKernel { pass, steps, corner }: &TileKernel) -> TileSums {
    let (area, channels) = (TILE[0] * TILE[1], pass.halves[0].len());
    let mut out = TileSums { sums: vec![0.0; area * 2 * pass.candidates.len() * (channels + 1)], area };
    let buffer = || vec![0.0f32; ROW * ROWS];
    let mut distances = Distances { of: [buffer(), buffer()], rows: [buffer(), buffer()] };
    let rows = TILE[1].min(pass.halves[0][0].size[1] - corner[1]);
    for (step, counts) in *steps {
        compare::<F>(pass, *corner, *step, rows, &mut distances);
        for y in 0..rows {
            let own = [corner[0] + BORDER, corner[1] + y + BORDER];
            let other = [corner[0] + step[0], corner[1] + y + step[1]];
            add_row::<F>(pass, own, other, &distances, &mut out, y, *counts);
        }
    }
    out
}

/// Computes differences in colour beyond those of noise, of the tile and of the margin for patches, summed along rows.
#[inline(always)]
fn compare<F: Float>(
    pass: &FilterPass,
    corner: [usize; 2],
    step: [usize; 2],
    rows: usize,
    distances: &mut Distances,
) {
    let patch = pass.patch;
    for y in 0..rows + 2 * patch {
        let own = [corner[0] + BORDER - patch, corner[1] + y + BORDER - patch];
        let other = [corner[0] + step[0] - patch, corner[1] + y + step[1] - patch];
        compare_row::<F>(pass, own, other, distances, y);
        for half in 0..2 {
            let from = &distances.rows[half][y * ROW..][..ROW];
            let to = &mut distances.of[half][y * ROW..][..ROW];
            for x in (0..TILE[0]).step_by(F::WIDTH) {
                let mut sum = F::load(&from[x..]);
                for step in 1..=2 * patch {
                    sum = sum + F::load(&from[x + step..]);
                }
                sum.store(&mut to[x..]);
            }
        }
    }
}

/// Computes the differences of one row, pixel by pixel.
#[inline(always)]
fn compare_row<F: Float>(
    pass: &FilterPass,
    own: [usize; 2],
    other: [usize; 2],
    distances: &mut Distances,
    y: usize,
) {
    let [even, odd] = &mut distances.rows;
    let (even, odd) = (&mut even[y * ROW..][..ROW], &mut odd[y * ROW..][..ROW]);
    let width = TILE[0] + 2 * pass.patch;
    for x in (0..width).step_by(F::WIDTH) {
        let (mut first, mut second) = (F::zero(), F::zero());
        for channel in 0..pass.variance.len() {
            let (p, q) = (
                pass.variance[channel].pair::<F>(own, other, x),
                pass.compared[0][channel].pair::<F>(own, other, x),
            );
            let r = pass.compared[1][channel].pair::<F>(own, other, x);
            let noise = p.0 + p.0.min(p.1);
            let (a, b) = (q.0 - q.1, r.0 - r.1);
            let scale = F::one() / (p.0 + p.1 + F::splat(pass.least));
            first = first + (a * a - noise) * scale;
            second = second + (b * b - noise) * scale;
        }
        first.store(&mut even[x..]);
        second.store(&mut odd[x..]);
    }
}

/// Sums a patch from the sums of its rows.
#[inline(always)]
fn patch<F: Float>(rows: &[f32], patch: usize, x: usize) -> F {
    let mut sum = F::load(&rows[x..]);
    for row in 1..=2 * patch {
        sum = sum + F::load(&rows[row * ROW + x..]);
    }
    sum
}

/// Adds pixels one step away to the sums of a tile's row.
#[inline(always)]
fn add_row<F: Float>(
    pass: &FilterPass,
    own: [usize; 2],
    other: [usize; 2],
    distances: &Distances,
    out: &mut TileSums,
    y: usize,
    counts: f32,
) {
    let zero = F::zero();
    let (channels, area) = (pass.halves[0].len(), out.area);
    let across = (2 * pass.patch + 1) as f32;
    // The factor from sums of patches to exponents of two.
    let mean = F::splat(-std::f32::consts::LOG2_E * pass.sharpness / (across * across * channels as f32));
    for x in (0..TILE[0]).step_by(F::WIDTH) {
        let mut unlike = zero;
        for feature in pass.features {
            let (p, q) = feature.pair::<F>(own, other, x);
            unlike = unlike.max((p - q) * (p - q));
        }
        let wide = exp2(unlike * F::splat(-std::f32::consts::LOG2_E / 8.0));
        let square = wide * wide;
        let fourth = square * square;
        let (wide, alike) = (wide * F::splat(counts), fourth * fourth * F::splat(counts));
        for half in 0..2 {
            // The weight comes from the other half.
            let apart: F = patch(&distances.of[1 - half][y * ROW..], pass.patch, x);
            let like = exp2(apart.max(zero) * mean);
            for (candidate, kind) in pass.candidates.iter().enumerate() {
                let mut weight = if matches!(kind, FilteredImage::Wide(_)) { wide } else { alike };
                if let FilteredImage::Colors(squarings) | FilteredImage::Wide(squarings) = kind {
                    let mut power = like;
                    for _ in 0..*squarings {
                        power = power * power;
                    }
                    weight = weight * power;
                }
                let first = (2 * candidate + half) * (channels + 1) * area + y * TILE[0] + x;
                let sums = &mut out.sums[first..][..channels * area + F::WIDTH];
                (F::load(sums) + weight).store(sums);
                for channel in 0..channels {
                    let sum = &mut sums[(channel + 1) * area..];
                    let value = F::load(pass.halves[half][channel].from(other[0] + x, other[1]));
                    (F::load(sum) + weight * value).store(sum);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of one colour of a chequerboard must not be filtered apart from those of the other colour.
    #[test]
    fn far_steps_cover_both_chequerboard_colours() {
        let pass = FilterPass {
            halves: [&[], &[]],
            compared: [&[], &[]],
            variance: &[],
            features: &[],
            sharpness: 1.0,
            candidates: &[],
            radius: super::super::RADIUS,
            stride: None,
            patch: 0,
            least: 0.0,
        };
        let way = |place: usize| place as i32 - BORDER as i32;
        let far = |[x, y]: [i32; 2]| x * x + y * y > DENSE * DENSE;
        let ways: Vec<[i32; 2]> =
            pass.steps().iter().map(|(step, _)| step.map(way)).filter(|step| far(*step)).collect();
        let even = ways.iter().filter(|[x, y]| (x + y) % 2 == 0).count();
        assert!((2 * even).abs_diff(ways.len()) * 10 < ways.len(), "{even} of {}", ways.len());
    }
}
