//! Measurements of a BSDF against what must hold for each: energy, densities of sampled directions, reciprocity. They
//! take the BSDF as functions, so that tests can measure wrong ones.

use std::num::Wrapping;

use super::sample::BsdfSample;
use crate::math::elementary::{atan2_turns, sin_cos_turns};
use crate::math::{Color, Vector};
use crate::sampling::hash::{combine, to_unit};
use crate::sampling::sobol;

/// A direction with a given cosine to the normal (0, 0, 1), `turns` of a circle from x.
pub fn towards(cos: f32, turns: f32) -> Vector<f32> {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (y, x) = sin_cos_turns(turns);
    Vector { x: sin * x, y: sin * y, z: cos }
}

/// A sequence of random numbers from 0 to 1.
pub struct Chance {
    seed: Wrapping<u32>,
    next: u32,
}

impl Chance {
    /// The sequence of a seed.
    pub fn new(seed: u32) -> Self {
        Self { seed: Wrapping(seed), next: 0 }
    }

    /// The next number.
    pub fn unit(&mut self) -> f32 {
        self.next = self.next.wrapping_add(1);
        to_unit(combine(self.seed, Wrapping(self.next)))
    }

    /// The next number, scaled to a range.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// A directional albedo: the light that a surface returns to one viewer under light of radiance 1 from everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredAlbedo {
    /// Red, green, blue.
    pub mean: [f64; 3],
    /// The standard errors of these.
    pub error: [f64; 3],
}

/// The number of blocks of a sequence by which the error of an albedo is estimated. Together they are more even than
/// independent points, so the error is rather less.
const SETS: u32 = 16;

/// Measures the albedo: the mean of the weights of about `count` sampled directions. `sample` gets the numbers of
/// [`super::bsdf::Bsdf::sample`].
pub fn albedo(count: u32, sample: impl Fn(f32, (f32, f32)) -> BsdfSample<f32>) -> MeasuredAlbedo {
    let in_set = (count / SETS).max(1);
    let (mut sum, mut squares) = ([0.0f64; 3], [0.0f64; 3]);
    for set in 0..SETS {
        let mut mean = [0.0f64; 3];
        for i in (set * in_set..(set + 1) * in_set).map(Wrapping) {
            let which: f32 = sobol::one(i, Wrapping(1));
            let sampled = sample(which, sobol::two(i, Wrapping(2)));
            if sampled.valid {
                let Color { r, g, b } = sampled.weight;
                mean = [mean[0] + r as f64, mean[1] + g as f64, mean[2] + b as f64];
            }
        }
        for channel in 0..3 {
            let mean = mean[channel] / f64::from(in_set);
            sum[channel] += mean;
            squares[channel] += mean * mean;
        }
    }
    let sets = f64::from(SETS);
    let mean = sum.map(|sum| sum / sets);
    let variance = |channel: usize| (squares[channel] / sets - mean[channel] * mean[channel]).max(0.0);
    MeasuredAlbedo { mean, error: [0, 1, 2].map(|channel| (variance(channel) / (sets - 1.0)).sqrt()) }
}

/// Sampled directions in cells of the sphere, against the integral of the reported density over these.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DensityCheck {
    /// Pearson's χ², the error of the integrals included.
    pub chi_square: f64,
    /// The number of cells.
    pub cells: usize,
    /// The largest deviation of a cell, in standard errors.
    pub largest: f64,
    /// The integral of the density over all cells, less the fraction of directions that were sampled.
    pub excess: f64,
    /// The standard error of this.
    pub excess_error: f64,
}

impl DensityCheck {
    /// The limit on χ²: five standard deviations above its mean, and a margin for the error of the integrals.
    pub fn limit(&self) -> f64 {
        let freedom = self.cells.max(2) as f64;
        1.05 * freedom + 5.0 * (2.0 * freedom).sqrt() + 10.0
    }

    /// True if directions are sampled with the reported density, as far as the number of samples can tell.
    pub fn agrees(&self) -> bool {
        self.chi_square <= self.limit() && self.excess.abs() <= 0.01 + 5.0 * self.excess_error
    }

    fn add(&mut self, counted: f64, expected: f64, variance: f64) {
        let deviation = (counted - expected).abs() / (expected + variance).max(1.0).sqrt();
        self.chi_square += deviation * deviation;
        self.largest = self.largest.max(deviation);
        self.cells += 1;
    }
}

/// A cell with more directions than this is divided.
const IN_CELL: usize = 160;
/// An integral is computed over parts of a cell with at most this many directions: a narrow lobe may lie in a corner.
const IN_PART: usize = 4;
/// A cell with a smaller expected number of directions is counted together with all others of these.
const LEAST_EXPECTED: f64 = 10.0;
/// The number of estimates of a cell's integral, and the rows and columns of points in each.
const ESTIMATES: usize = 4;
const GRID: usize = 4;

/// A part of the sphere, in coordinates that keep areas: the hemisphere, the distance from its pole (1 − |z|) and turns
/// around it, both from 0 to 1.
#[derive(Clone, Copy)]
struct SphereCell {
    upper: bool,
    from: [f64; 2],
    size: [f64; 2],
}

impl SphereCell {
    /// The coordinates of a direction. Close to the pole, x and y have digits that z lacks.
    fn place(d: Vector<f32>) -> (bool, [f64; 2]) {
        let [x, y, z] = [d.x, d.y, d.z].map(f64::from);
        let far = (x * x + y * y) / (1.0 + z.abs());
        let turns = f64::from(atan2_turns(d.y, d.x));
        (z > 0.0, [far.min(1.0), turns - turns.floor()])
    }

    fn direction(&self, part: [f64; 2]) -> Vector<f32> {
        let [far, turns] = [0, 1].map(|axis| self.from[axis] + part[axis] * self.size[axis]);
        let sin = (far * (2.0 - far)).max(0.0).sqrt() as f32;
        let z = if self.upper { 1.0 - far } else { far - 1.0 };
        let (y, x) = sin_cos_turns(turns as f32);
        Vector { x: sin * x, y: sin * y, z: z as f32 }
    }

    /// The integral of a density, and the variance of this estimate.
    fn integral(&self, pdf: &dyn Fn(Vector<f32>) -> f32, chance: &mut Chance) -> (f64, f64) {
        let area = self.size[0] * self.size[1] * std::f64::consts::TAU;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..ESTIMATES {
            let mut mean = 0.0;
            for i in 0..GRID * GRID {
                let part = [i / GRID, i % GRID].map(|i| (i as f64 + f64::from(chance.unit())) / GRID as f64);
                mean += f64::from(pdf(self.direction(part)));
            }
            let integral = area * mean / (GRID * GRID) as f64;
            sum += integral;
            squares += integral * integral;
        }
        let count = ESTIMATES as f64;
        let mean = sum / count;
        (mean, (squares / count - mean * mean).max(0.0) / (count - 1.0))
    }

    fn halves(&self, axis: usize) -> [SphereCell; 2] {
        let mut first = *self;
        first.size[axis] *= 0.5;
        let mut second = first;
        second.from[axis] += first.size[axis];
        [first, second]
    }
}

/// Counts `count` sampled directions in cells. Cells are small where directions are many: half of the directions decide
/// on the cells, the other half is counted. Mirror directions, which have no density, are left out; none if all are.
pub fn density(
    count: u32,
    sample: impl Fn(f32, (f32, f32)) -> BsdfSample<f32>,
    pdf: impl Fn(Vector<f32>) -> f32,
) -> Option<DensityCheck> {
    let mut chance = Chance::new(0x5eed);
    let mut draw = |count: u32| -> [Vec<[f64; 2]>; 2] {
        let mut found = [Vec::new(), Vec::new()];
        for _ in 0..count {
            let sampled = sample(chance.unit(), (chance.unit(), chance.unit()));
            if sampled.valid && sampled.pdf > 0.0 {
                let (upper, place) = SphereCell::place(sampled.direction);
                found[usize::from(upper)].push(place);
            }
        }
        found
    };
    let counted = (count / 2).max(1);
    let (planned, drawn) = (draw(counted), draw(counted));
    if planned.iter().chain(&drawn).all(Vec::is_empty) {
        return None;
    }
    let mut histogram = Histogram {
        pdf: &pdf,
        chance: Chance::new(0xce11),
        total: f64::from(counted),
        check: DensityCheck::default(),
        few: [0.0; 3],
        all: [0.0; 3],
    };
    for (upper, (planned, drawn)) in [false, true].into_iter().zip(planned.into_iter().zip(drawn)) {
        let cell = SphereCell { upper, from: [0.0; 2], size: [1.0; 2] };
        histogram.count(cell, 0, planned, drawn);
    }
    Some(histogram.end())
}

struct Histogram<'a> {
    pdf: &'a dyn Fn(Vector<f32>) -> f32,
    chance: Chance,
    total: f64,
    check: DensityCheck,
    /// The number of directions in small cells, the expected one, and its variance.
    few: [f64; 3],
    /// These of all cells.
    all: [f64; 3],
}

impl Histogram<'_> {
    /// The number of halvings after which floats hardly tell directions apart.
    const DEEPEST: u32 = 44;

    fn count(&mut self, cell: SphereCell, depth: u32, planned: Vec<[f64; 2]>, drawn: Vec<[f64; 2]>) {
        if planned.len() > IN_CELL && depth < Self::DEEPEST {
            let axis = depth as usize % 2;
            let [first, second] = cell.halves(axis);
            let is_first = |place: &[f64; 2]| place[axis] < second.from[axis];
            let (planned_first, planned_second) = planned.into_iter().partition(is_first);
            let (drawn_first, drawn_second) = drawn.into_iter().partition(is_first);
            self.count(first, depth + 1, planned_first, drawn_first);
            self.count(second, depth + 1, planned_second, drawn_second);
            return;
        }
        let (integral, variance) = self.integral(cell, depth, planned);
        let (counted, expected) = (drawn.len() as f64, self.total * integral);
        let variance = variance * self.total * self.total;
        let add = |sums: [f64; 3]| [sums[0] + counted, sums[1] + expected, sums[2] + variance];
        self.all = add(self.all);
        if expected.max(counted) < LEAST_EXPECTED {
            self.few = add(self.few);
        } else {
            self.check.add(counted, expected, variance);
        }
    }

    /// The integral of the density over a cell, in parts that are small where directions are many.
    fn integral(&mut self, cell: SphereCell, depth: u32, planned: Vec<[f64; 2]>) -> (f64, f64) {
        if planned.len() <= IN_PART || depth >= Self::DEEPEST {
            return cell.integral(self.pdf, &mut self.chance);
        }
        let axis = depth as usize % 2;
        let [first, second] = cell.halves(axis);
        let (in_first, in_second) =
            planned.into_iter().partition(|place: &[f64; 2]| place[axis] < second.from[axis]);
        let (a, b) = (self.integral(first, depth + 1, in_first), self.integral(second, depth + 1, in_second));
        (a.0 + b.0, a.1 + b.1)
    }

    fn end(mut self) -> DensityCheck {
        let [counted, expected, variance] = self.few;
        if counted.max(expected) >= LEAST_EXPECTED {
            self.check.add(counted, expected, variance);
        }
        let [counted, expected, variance] = self.all.map(|sum| sum / self.total);
        let by_chance = (counted * (1.0 - counted) + variance).max(0.0) / self.total;
        DensityCheck { excess: expected - counted, excess_error: by_chance.sqrt(), ..self.check }
    }
}

/// A BSDF's values for pairs of directions on one side, against those for the directions exchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reciprocity {
    /// The largest difference, relative to the larger of both values.
    pub largest: f64,
    /// The mean of the differences.
    pub mean: f64,
}

/// Values of a BSDF below this count as this when they are compared, so that zeros are no infinite differences.
const DARK: f32 = 1e-3;

/// Compares values for `pairs` random pairs of directions. `value` returns value · |cos| for light that comes from the
/// second direction and leaves along the first; `sample` draws the second one for every other pair, so that narrow lobes
/// are compared, too.
pub fn reciprocity(
    pairs: u32,
    value: impl Fn(Vector<f32>, Vector<f32>) -> Color<f32>,
    sample: impl Fn(Vector<f32>, f32, (f32, f32)) -> BsdfSample<f32>,
) -> Reciprocity {
    let mut chance = Chance::new(0xface);
    let (mut result, mut compared) = (Reciprocity::default(), 0u32);
    for pair in 0..pairs {
        let wo = towards(chance.between(0.05, 1.0), chance.unit());
        let mut wi = towards(chance.between(0.05, 1.0), chance.unit());
        if pair % 2 == 1 {
            let sampled = sample(wo, chance.unit(), (chance.unit(), chance.unit()));
            if !sampled.valid || sampled.direction.z < 0.05 {
                continue;
            }
            wi = sampled.direction;
        }
        let (forth, back) = (value(wo, wi), value(wi, wo));
        let difference = |a: f32, b: f32| {
            let (a, b) = (a / wi.z, b / wo.z);
            f64::from((a - b).abs() / a.max(b).max(DARK))
        };
        let of_channels =
            [difference(forth.r, back.r), difference(forth.g, back.g), difference(forth.b, back.b)];
        let most = of_channels.into_iter().fold(0.0, f64::max);
        result.largest = result.largest.max(most);
        result.mean += most;
        compared += 1;
    }
    result.mean /= f64::from(compared.max(1));
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::sampling::warp::concentric_disk;

    /// A matte surface of albedo `weight` by sampling proportionally to the cosine, and the density that it reports.
    fn lambert(weight: f32, u: (f32, f32)) -> BsdfSample<f32> {
        let (x, y) = concentric_disk(u.0, u.1);
        let z = (1.0 - x * x - y * y).max(1e-8f32).sqrt();
        BsdfSample {
            direction: Vector { x, y, z },
            weight: Color::splat(Rgb::splat(weight)),
            pdf: z / std::f32::consts::PI,
            valid: true,
            transmitted: false,
            wide: true,
        }
    }

    #[test]
    fn albedo_is_the_mean_of_weights_with_its_error() {
        let exact = albedo(4096, |_, u| lambert(0.7, u));
        assert!((exact.mean[1] - 0.7).abs() < 1e-6 && exact.error[1] < 1e-6, "{exact:?}");
        // Weights of 0 and 2 by chance: the error is that of independent coins, or less.
        let coins = albedo(4096, |which, u| lambert(if which < 0.5 { 0.0 } else { 2.0 }, u));
        assert!((coins.mean[0] - 1.0).abs() < 4.0 * coins.error[0] + 1e-3, "{coins:?}");
        assert!(coins.error[0] < 1.5 / 64.0, "{coins:?}");
    }

    #[test]
    fn density_check_accepts_the_true_density_and_rejects_others() {
        let cosine = |d: Vector<f32>| d.z.max(0.0) / std::f32::consts::PI;
        let uniform = |d: Vector<f32>| if d.z > 0.0 { 0.5 / std::f32::consts::PI } else { 0.0 };
        let check = |pdf: &dyn Fn(Vector<f32>) -> f32| {
            density(1 << 15, |_, u| lambert(1.0, u), pdf).expect("a density")
        };
        let right = check(&cosine);
        assert!(right.agrees() && right.cells > 64 && right.largest < 5.0, "{right:?}");
        assert!(!check(&uniform).agrees());
        assert!(!check(&|d| 1.05 * cosine(d)).agrees(), "5 % too large");
        let mirror = |_, u| BsdfSample { pdf: 0.0, ..lambert(1.0, u) };
        assert_eq!(density(1024, mirror, cosine), None);
    }

    #[test]
    fn reciprocity_finds_values_that_depend_on_the_viewer() {
        let drawn = |_, _, u| lambert(1.0, u);
        let matte = reciprocity(512, |_, wi| Color::splat(Rgb::splat(wi.z / 3.0)), drawn);
        assert!(matte.largest < 1e-6, "{matte:?}");
        let planted = reciprocity(512, |wo, wi| Color::splat(Rgb::splat(wi.z * (1.0 + wo.z))), drawn);
        assert!((0.3..0.5).contains(&planted.largest) && planted.mean > 0.05, "{planted:?}");
    }
}
