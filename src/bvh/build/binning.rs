//! Cuts a range of references in two: the binned surface area heuristic (Wald, "On fast construction of SAH-based
//! bounding volume hierarchies", 2007).

use glam::{Mat4, Vec4, Vec4Swizzles};

use super::reference::{Reference, SimdAabb};
use crate::bvh::layout::BLOCK;

/// The largest number of bins on an axis.
pub const BINS: usize = 16;

/// 2^23: added to a small number, it leaves that number, rounded, in the low bits.
const TO_INTEGER: f32 = 8_388_608.0;

/// The mapping from a centre to its bin on each axis.
#[derive(Clone, Copy)]
pub struct Binning {
    /// The number of bins on each axis.
    bins: usize,
    origin: Vec4,
    scale: Vec4,
}

impl Binning {
    /// Creates bins for centres in `centers`; others fall into the outermost bins.
    #[inline(always)]
    pub fn new(centers: &SimdAabb, bins: usize) -> Self {
        let size = centers.max - centers.min;
        // An axis has one bin if the box is flat along it, or if its length overflows.
        let fine = size.cmpgt(Vec4::splat(1e-30)) & size.cmplt(Vec4::INFINITY);
        let fine = fine & glam::BVec4A::new(true, true, true, false);
        let scale = Vec4::select(fine, Vec4::splat(bins as f32) / size, Vec4::ZERO);
        // Coordinates are rounded to bins, so the first bin's middle is the origin.
        let half = Vec4::select(fine, size * (0.5 / bins as f32), Vec4::ZERO);
        Self { bins, origin: centers.min + half, scale }
    }

    /// The bins of a point on the three axes.
    #[inline(always)]
    pub fn bins(&self, point: Vec4) -> [usize; 4] {
        let place = (point - self.origin) * self.scale;
        let place = place.max(Vec4::ZERO).min(Vec4::splat((self.bins - 1) as f32));
        (place + Vec4::splat(TO_INTEGER)).to_array().map(|p| p.to_bits() as usize % BINS)
    }

    /// The doubled coordinate at which the right side of a cut begins.
    #[inline(always)]
    pub fn threshold(&self, cut: &Cut) -> f32 {
        self.origin[cut.axis] + (cut.plane as f32 - 0.5) / self.scale[cut.axis]
    }
}

/// The boxes and counts of the bins on the three axes.
pub struct Bins {
    /// The number of bins in use on each axis.
    used: usize,
    min: [[Vec4; 3]; BINS],
    max: [[Vec4; 3]; BINS],
    count: [[u32; 4]; BINS],
}

/// A cut: references in a smaller bin on the axis go left.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// The axis.
    pub axis: usize,
    /// The first bin on the right.
    pub plane: usize,
    /// Half areas times blocks, summed over both sides.
    pub cost: f32,
}

impl Default for Bins {
    /// Bins of which none is in use.
    fn default() -> Self {
        Bins { used: 0, min: [[Vec4::ZERO; 3]; BINS], max: [[Vec4::ZERO; 3]; BINS], count: [[0; 4]; BINS] }
    }
}

impl Bins {
    /// Empties the bins and fills them with references.
    #[inline(always)]
    pub fn fill<'a>(&mut self, references: impl Iterator<Item = &'a Reference>, binning: &Binning) {
        self.used = binning.bins;
        for bin in 0..binning.bins {
            self.min[bin] = [Vec4::INFINITY; 3];
            self.max[bin] = [Vec4::NEG_INFINITY; 3];
            self.count[bin] = [0; 4];
        }
        for reference in references {
            let SimdAabb { min, max } = reference.extent();
            let [x, y, z, _] = binning.bins(reference.center());
            for (axis, at) in [x, y, z].into_iter().enumerate() {
                self.min[at][axis] = self.min[at][axis].min(min);
                self.max[at][axis] = self.max[at][axis].max(max);
                self.count[at][axis] += 1;
            }
        }
    }

    /// The cut with the least cost, with each reference counting as `weight`; `None` if no cut leaves `fewest` on both
    /// sides. Computes all three axes together, one in each lane.
    #[inline(always)]
    pub fn best(&self, weight: u32, fewest: usize) -> Option<Cut> {
        let count = self.used;
        let mut right = [Vec4::INFINITY; BINS];
        let mut boxes = AxisBoxes::EMPTY;
        for plane in (1..count).rev() {
            boxes.grow(&self.min[plane], &self.max[plane], &self.count[plane]);
            right[plane] = boxes.cost(weight, fewest);
        }
        let mut best = Vec4::INFINITY;
        let mut planes = Vec4::ZERO;
        let mut left = AxisBoxes::EMPTY;
        for (plane, right) in right.into_iter().enumerate().take(count).skip(1) {
            left.grow(&self.min[plane - 1], &self.max[plane - 1], &self.count[plane - 1]);
            let cost = left.cost(weight, fewest) + right;
            let better = cost.cmplt(best);
            best = Vec4::select(better, cost, best);
            planes = Vec4::select(better, Vec4::splat(plane as f32), planes);
        }
        let axis = if best.x <= best.y && best.x <= best.z { 0 } else { 1 + (best.z < best.y) as usize };
        let cost = best[axis];
        (cost < f32::INFINITY).then(|| Cut { axis, plane: planes[axis] as usize, cost })
    }
}

/// Three growing boxes, one for each axis that is cut.
struct AxisBoxes {
    min: [Vec4; 3],
    max: [Vec4; 3],
    count: [u32; 4],
}

impl AxisBoxes {
    const EMPTY: AxisBoxes =
        AxisBoxes { min: [Vec4::INFINITY; 3], max: [Vec4::NEG_INFINITY; 3], count: [0; 4] };

    #[inline(always)]
    fn grow(&mut self, min: &[Vec4; 3], max: &[Vec4; 3], count: &[u32; 4]) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(min[axis]);
            self.max[axis] = self.max[axis].max(max[axis]);
            self.count[axis] += count[axis];
        }
    }

    /// The expected costs: the areas times the blocks to test; infinite if there are too few references.
    #[inline(always)]
    fn cost(&self, weight: u32, fewest: usize) -> Vec4 {
        let product = |axis: usize| {
            let d = self.max[axis] - self.min[axis];
            d * d.yzxw()
        };
        // A row for each box, with the three products of its sides in the columns.
        let sides = Mat4::from_cols(product(0), product(1), product(2), Vec4::ZERO).transpose();
        let blocks = |count: u32| {
            let is_enough = count as usize >= fewest;
            if is_enough { (count * weight).div_ceil(BLOCK as u32) as i32 as f32 } else { f32::INFINITY }
        };
        let blocks = self.count.map(blocks);
        (sides.x_axis + sides.y_axis + sides.z_axis) * Vec4::from_array(blocks)
    }
}

/// Moves references with a doubled centre below the threshold to the front; returns their number.
#[inline(always)]
pub fn partition(references: &mut [Reference], axis: usize, threshold: f32) -> usize {
    let threshold = Vec4::splat(threshold);
    partition_by(references, |r| r.center().cmplt(threshold).bitmask() >> axis & 1 != 0)
}

/// Moves references that `left` picks to the front; returns their number.
#[inline(always)]
pub fn partition_by(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    // Without a branch, whose outcome could not be predicted: every reference is swapped with the first one of the
    // right side, which then begins behind it or stays where it is.
    let mut middle = 0;
    for i in 0..references.len() {
        let is_left = left(&references[i]);
        references.swap(i, middle);
        middle += is_left as usize;
    }
    middle
}
