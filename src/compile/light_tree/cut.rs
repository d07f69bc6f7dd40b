//! Cuts a set of lights in two.

use std::f64::consts::{FRAC_PI_2, PI};

use super::CutItem;
use super::bound::WideBounds;
use crate::math::DVec3;

/// Bins along each axis; the planes between them are the candidate cuts.
const BINS: usize = 12;

/// A plane between two bins along an axis.
pub(super) struct BinPlane {
    axis: usize,
    low: f64,
    /// Bins per metre.
    scale: f64,
    /// The first bin of the second part.
    bin: usize,
}

impl BinPlane {
    fn bin_of(&self, extent: &CutBox) -> usize {
        (((extent.center()[self.axis] - self.low) * self.scale) as usize).min(BINS - 1)
    }

    pub(super) fn is_first(&self, extent: &CutBox) -> bool {
        self.bin_of(extent) < self.bin
    }
}

/// The cut of lowest cost; none if all centres are the same.
pub(super) fn best_cut(items: &[CutItem]) -> Option<BinPlane> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut all = CutBox::NONE;
    for item in items {
        low = low.min(item.extent.center());
        high = high.max(item.extent.center());
        all.add(&item.extent);
    }
    let mut best: Option<(f64, BinPlane)> = None;
    for axis in 0..3 {
        let width = high[axis] - low[axis];
        if width.is_nan() || width <= 0.0 || !width.is_finite() {
            continue;
        }
        let mut cut = BinPlane { axis, low: low[axis], scale: BINS as f64 / width, bin: 0 };
        let mut bins = [CutBox::NONE; BINS];
        for item in items {
            bins[cut.bin_of(&item.extent)].add(&item.extent);
        }
        // Long, thin parts cost more.
        let size = all.max - all.min;
        let thinness = size.max_element() / size[axis].max(f64::MIN_POSITIVE);
        let (cost, bin) = cheapest(&bins);
        if best.as_ref().is_none_or(|(lowest, _)| cost * thinness < *lowest) {
            cut.bin = bin;
            best = Some((cost * thinness, cut));
        }
    }
    best.map(|(_, cut)| cut)
}

/// The lowest cost of the cuts between bins, and the first bin after that cut.
fn cheapest(bins: &[CutBox; BINS]) -> (f64, usize) {
    let mut after = [0.0; BINS + 1];
    let mut extent = CutBox::NONE;
    for i in (1..BINS).rev() {
        extent.add(&bins[i]);
        // An empty bin changes nothing.
        after[i] = if bins[i].power == 0.0 { after[i + 1] } else { extent.cost() };
    }
    let mut best = (f64::INFINITY, BINS / 2);
    let mut extent = CutBox::NONE;
    for i in 1..BINS {
        if bins[i - 1].power == 0.0 {
            continue;
        }
        extent.add(&bins[i - 1]);
        let cost = extent.cost() + after[i];
        if cost < best.0 {
            best = (cost, i);
        }
    }
    best
}

/// The bounds of lights, as far as cuts depend on them. The spread of normals is estimated from their mean: the cone
/// around them takes trigonometry for each light, which was nine tenths of the time with a million lights.
#[derive(Clone, Copy)]
pub(super) struct CutBox {
    min: DVec3,
    max: DVec3,
    power: f64,
    /// The sum of power times the mean of a light's normals.
    normals: DVec3,
    emission: f64,
    cos_emission: f64,
}

impl CutBox {
    /// The bounds of no light. Like lights without power, they widen nothing.
    const NONE: CutBox = CutBox {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
        power: 0.0,
        normals: DVec3::ZERO,
        emission: 0.0,
        cos_emission: 1.0,
    };

    pub(super) fn new(bound: &WideBounds) -> Self {
        // The side of a two-sided light that faces more upwards, so that equal lights agree.
        let upwards = DVec3::new(0.28, 0.9, 0.33);
        let turned = bound.two_sided && bound.cone.axis.dot(upwards) < 0.0;
        // The mean of the directions in a cone is (1 + cos) / 2 long.
        let mean = bound.cone.axis * (0.5 + 0.5 * bound.cone.cos);
        Self {
            min: bound.min,
            max: bound.max,
            power: bound.power,
            normals: if turned { -mean } else { mean } * bound.power,
            emission: bound.emission,
            cos_emission: bound.cos_emission,
        }
    }

    fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    fn add(&mut self, other: &Self) {
        if other.power == 0.0 {
            return;
        }
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.power += other.power;
        self.normals += other.normals;
        if other.emission > self.emission {
            (self.emission, self.cos_emission) = (other.emission, other.cos_emission);
        }
    }

    /// Power times the measure of directions times the area of the box (PBRT, "EvaluateCost").
    fn cost(&self) -> f64 {
        if self.power == 0.0 {
            return 0.0;
        }
        // As if normals were spread evenly over a cone.
        let cos = (2.0 * self.normals.length() / self.power - 1.0).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        let spread = libm::acos(cos);
        let end = (spread + self.emission).min(PI);
        // cos(spread − 2 end), by the cosine of the emission's angle.
        let (cos_e, sin_e) = (self.cos_emission, (1.0 - self.cos_emission * self.cos_emission).sqrt());
        let cos_difference =
            if end < PI { cos * (2.0 * cos_e * cos_e - 1.0) - sin * (2.0 * sin_e * cos_e) } else { cos };
        let around = 2.0 * end * sin - cos_difference - 2.0 * spread * sin + cos;
        let directions = 2.0 * PI * (1.0 - cos) + FRAC_PI_2 * around;
        let d = self.max - self.min;
        // Lights in one row have no area, yet should be cut where they are far apart.
        let area = d.x * d.y + d.y * d.z + d.z * d.x + 1e-6 * d.length_squared();
        self.power * directions * area
    }
}
