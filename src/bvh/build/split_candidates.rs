//! Finds spatial splits of a range of references: the surface area heuristic over slabs (Stich, Friedrich and Dietrich,
//! "Spatial splits in bounding volume hierarchies", 2009). The cost of a split is estimated in single precision; the
//! split itself is made by [`super::clip`], which never errs to the wrong side.

use glam::Vec4;

use super::binning::{BINS, Binning};
use super::primitives::PrimitiveArrays;
use super::reference::{Reference, SimdAabb};
use crate::bvh::layout::{BLOCK, ChildKind};

/// Larger ranges are sampled, with about this many references.
const SAMPLE: usize = 512;
/// References with at least this fraction of the range's area are always in the sample: they are worth splitting.
const LARGE: f32 = 1.0 / 256.0;

/// A plane across an axis, through primitives.
#[derive(Clone, Copy)]
pub struct SplitPlane {
    /// The axis.
    pub axis: usize,
    /// The coordinate on the axis.
    pub place: f32,
    /// Half areas times blocks, summed over both sides.
    pub cost: f32,
    /// The expected boxes and numbers of references of the sides.
    pub sides: [SplitSide; 2],
}

/// The contents of one side of a plane.
#[derive(Clone, Copy)]
pub struct SplitSide {
    /// The box around the parts on this side.
    pub bounds: SimdAabb,
    /// The number of references, including those that are cut.
    pub count: usize,
}

impl SplitSide {
    const EMPTY: SplitSide = SplitSide { bounds: SimdAabb::EMPTY, count: 0 };

    fn union(self, other: SplitSide) -> SplitSide {
        SplitSide { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count.div_ceil(BLOCK) as f32
    }
}

/// The contents of the slabs on the three axes.
pub struct SplitCandidates {
    /// The number of slabs in use on each axis.
    used: usize,
    low: Vec4,
    size: Vec4,
    binning: Binning,
    /// The number of references that begin in each slab, by axis.
    begin: [[u32; 3]; BINS],
    /// The number of references that end in each slab, by axis.
    end: [[u32; 3]; BINS],
    /// The boxes around the parts in each slab, by axis.
    boxes: [[SimdAabb; 3]; BINS],
}

impl SplitCandidates {
    /// Sorts references in `bounds` into slabs.
    pub fn new(references: &[Reference], bounds: &SimdAabb, geometry: &PrimitiveArrays) -> Self {
        let used = (4 + references.len() / 8).min(BINS);
        let mut slabs = Self {
            used,
            low: bounds.min,
            size: bounds.max - bounds.min,
            binning: Binning::new(bounds, used),
            begin: [[0; 3]; BINS],
            end: [[0; 3]; BINS],
            boxes: [[SimdAabb::EMPTY; 3]; BINS],
        };
        let stride = (references.len() / SAMPLE).max(1);
        let large = bounds.half_area() * LARGE;
        for (place, reference) in references.iter().enumerate() {
            if reference.extent().half_area() >= large {
                slabs.add(reference, 1, geometry);
            } else if place.is_multiple_of(stride) {
                slabs.add(reference, stride as u32, geometry);
            }
        }
        slabs
    }

    /// Adds a reference with a weight.
    #[inline(always)]
    fn add(&mut self, reference: &Reference, weight: u32, geometry: &PrimitiveArrays) {
        let part = reference.extent();
        let (mut first, mut last) = (self.binning.bins(part.min), self.binning.bins(part.max));
        if reference.kind() != ChildKind::Triangles {
            first = self.binning.bins(reference.center() * 0.5);
            last = first;
        }
        for axis in 0..3 {
            self.begin[first[axis]][axis] += weight;
            self.end[last[axis]][axis] += weight;
            if first[axis] == last[axis] {
                let around = &mut self.boxes[first[axis]][axis];
                *around = around.union(part);
            } else {
                let corners = geometry.corners(reference.id());
                self.add_parts(axis, [first[axis], last[axis]], &part, corners);
            }
        }
    }

    /// Adds a triangle to all slabs from the first to the last one. Its part between two planes is bounded by its
    /// corners there and by the intersections of its edges with the planes.
    fn add_parts(&mut self, axis: usize, [first, last]: [usize; 2], part: &SimdAabb, corners: [[f32; 3]; 3]) {
        let (low, step) = (self.low[axis], self.size[axis] / self.used as f32);
        // Rounded down, also before the first slab.
        let slab = |at: f32| (((at - low) / step).clamp(-1.0, BINS as f32) + 2.0) as i32 - 2;
        let (first, last) = (first as i32, last as i32);
        let corners = corners.map(|[x, y, z]| Vec4::new(x, y, z, 0.0));
        for corner in 0..3 {
            let (a, b) = (corners[corner], corners[(corner + 1) % 3]);
            let (from, to) = (slab(a[axis]), slab(b[axis]));
            self.add_point(axis, [first, last], [from, from], a, part);
            // A plane has the index of the slab behind it.
            let (least, most) = (from.min(to) + 1, from.max(to));
            let (start, scale) = (a[axis], (b[axis] - a[axis]).recip());
            for plane in least.max(first)..=most.min(last + 1) {
                let at = ((low + step * plane as f32) - start) * scale;
                self.add_point(axis, [first, last], [plane - 1, plane], a + (b - a) * at, part);
            }
        }
    }

    /// Adds a point to those of its slabs that are in the range.
    #[inline(always)]
    fn add_point(&mut self, axis: usize, range: [i32; 2], slabs: [i32; 2], point: Vec4, part: &SimdAabb) {
        let point = point.max(part.min).min(part.max);
        for slab in slabs {
            if slab >= range[0] && slab <= range[1] {
                let around = &mut self.boxes[slab as usize % BINS][axis];
                *around = around.with(point);
            }
        }
    }

    /// The plane with the least cost; `None` if none makes progress with at least `fewest` on both sides. `count` is
    /// the number of references.
    pub fn best(&self, count: usize, fewest: usize) -> Option<SplitPlane> {
        let planes = (0..3).filter_map(|axis| self.best_across(axis, count, fewest));
        planes.reduce(|a, b| if b.cost < a.cost { b } else { a })
    }

    fn best_across(&self, axis: usize, count: usize, fewest: usize) -> Option<SplitPlane> {
        let mut right = [SplitSide::EMPTY; BINS];
        let mut sum = SplitSide::EMPTY;
        for slab in (1..self.used).rev() {
            sum =
                sum.union(SplitSide { bounds: self.boxes[slab][axis], count: self.end[slab][axis] as usize });
            right[slab] = sum;
        }
        let mut best: Option<SplitPlane> = None;
        let mut left = SplitSide::EMPTY;
        for (slab, right) in right.into_iter().enumerate().take(self.used).skip(1) {
            let before = slab - 1;
            let begin = self.begin[before][axis] as usize;
            left = left.union(SplitSide { bounds: self.boxes[before][axis], count: begin });
            let sides = [left, right];
            let progress = |side: &SplitSide| side.count >= fewest && side.count < count;
            let cost = left.cost() + right.cost();
            if sides.iter().all(progress) && best.is_none_or(|best| cost < best.cost) {
                let place = self.low[axis] + self.size[axis] * (slab as f32 / self.used as f32);
                best = Some(SplitPlane { axis, place, cost, sides });
            }
        }
        best
    }
}
