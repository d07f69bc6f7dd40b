//! Shaft culling: the primitives between two boxes, for rays that begin in one and end in the other (Haines and
//! Wallace, "Shaft culling for efficient ray-traced radiosity", 1991).

use std::ops::Range;

use super::direction_classes::padded;
use crate::bvh::Rays;
use crate::bvh::layout::PADDING;
use crate::math::DVec3;
use crate::simd::{Float, Mask};

/// A margin for rounding errors, as a fraction of coordinates.
const MARGIN: f32 = 2.0 * PADDING;

/// The box around the starts of rays, and the box around their ends.
pub(in crate::bvh) struct Shaft([CoordinateRange; 2]);

/// The least and greatest coordinates.
#[derive(Clone, Copy)]
struct CoordinateRange {
    low: [f32; 3],
    high: [f32; 3],
}

impl Shaft {
    /// The shaft around some rays of a queue; `None` if one of them has no end.
    #[inline(always)]
    pub fn around<F: Float>(rays: &Rays, range: Range<usize>) -> Option<Self> {
        let (most, least) = (F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY));
        let mut lanes = [[[most; 3], [least; 3]]; 2];
        let mut zeros = F::zero();
        for at in range.clone().step_by(F::WIDTH) {
            let mask = F::Mask::first(range.end - at);
            let t_max = padded::<F>(&rays.t_max[at..]);
            for axis in 0..3 {
                let start = padded::<F>(&rays.origin[axis][at..]);
                let end = start + padded::<F>(&rays.direction[axis][at..]) * t_max;
                for ([low, high], value) in lanes.iter_mut().zip([start, end]) {
                    // A non-finite value times 0 is NaN.
                    zeros = zeros + F::select(mask, value * F::zero(), F::zero());
                    low[axis] = low[axis].min(F::select(mask, value, most));
                    high[axis] = high[axis].max(F::select(mask, value, least));
                }
            }
        }
        if !zeros.eq(F::zero()).bits() & F::Mask::first(F::WIDTH).bits() != 0 {
            return None;
        }
        let [starts, ends] = lanes;
        let starts = CoordinateRange { low: fold::<F, false>(starts[0]), high: fold::<F, true>(starts[1]) };
        let ends = CoordinateRange { low: fold::<F, false>(ends[0]), high: fold::<F, true>(ends[1]) };
        Some(Self::new(starts, ends))
    }

    /// The shaft between two boxes. Starts are exact, so that rays that leave a wall along an axis leave it behind;
    /// ends are computed.
    #[inline(always)]
    fn new(starts: CoordinateRange, mut ends: CoordinateRange) -> Self {
        for axis in 0..3 {
            let size = |bound: &[f32; 3]| bound[axis].abs();
            let size = size(&starts.low).max(size(&starts.high)).max(size(&ends.low)).max(size(&ends.high));
            ends.low[axis] -= size * MARGIN;
            ends.high[axis] += size * MARGIN;
        }
        Self([starts, ends])
    }

    /// The box around both.
    #[inline(always)]
    fn bounds(&self) -> CoordinateRange {
        let [mut bounds, ends] = self.0;
        for axis in 0..3 {
            bounds.low[axis] = bounds.low[axis].min(ends.low[axis]);
            bounds.high[axis] = bounds.high[axis].max(ends.high[axis]);
        }
        bounds
    }
}

/// The least of each of three coordinates over all lanes, or the greatest.
#[inline(always)]
fn fold<F: Float, const GREATEST: bool>([x, y, z]: [F; 3]) -> [f32; 3] {
    let mut rows = [[0.0; 4]; 16];
    F::store_rows([x, y, z, z], &mut rows);
    let mut best = rows[0];
    for row in &rows[1..F::WIDTH] {
        for (best, value) in best.iter_mut().zip(row) {
            *best = if GREATEST { Float::max(*best, *value) } else { Float::min(*best, *value) };
        }
    }
    [best[0], best[1], best[2]]
}

/// The primitives that may lie in a shaft, by columns, padded to a multiple of sixteen: no more than 128 triangles and
/// spheres.
#[derive(Default)]
pub(in crate::bvh) struct Obstacles {
    /// The unit normal and the offset of each one's plane; zeros for a sphere.
    plane: [Vec<f32>; 4],
    /// The least and greatest coordinates.
    bounds: [[Vec<f32>; 3]; 2],
}

impl Obstacles {
    /// Adds a triangle.
    pub fn push_triangle(&mut self, corners: [[f32; 3]; 3]) {
        let [a, b, c] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let [low, high] = [f32::min, f32::max].map(|best| {
            [0, 1, 2].map(|axis| best(corners[0][axis], best(corners[1][axis], corners[2][axis])))
        });
        self.push([normal.x, normal.y, normal.z, normal.dot(a)].map(|value| value as f32), low, high);
    }

    /// Adds a sphere.
    pub fn push_sphere(&mut self, center: [f32; 3], radius: f32) {
        // Padded as boxes around spheres are.
        let reach = |axis: usize| radius + (radius + center[axis].abs()) * MARGIN;
        let low = [0, 1, 2].map(|axis| center[axis] - reach(axis));
        self.push([0.0; 4], low, [0, 1, 2].map(|axis| center[axis] + reach(axis)));
    }

    fn push(&mut self, plane: [f32; 4], low: [f32; 3], high: [f32; 3]) {
        self.plane.iter_mut().zip(plane).for_each(|(column, value)| column.push(value));
        for (columns, values) in self.bounds.iter_mut().zip([low, high]) {
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        }
    }

    /// Fills the columns up with empty obstacles.
    pub fn finish(&mut self) {
        let count = self.len().next_multiple_of(16);
        self.plane.iter_mut().for_each(|column| column.resize(count, 0.0));
        let [low, high] = &mut self.bounds;
        low.iter_mut().for_each(|column| column.resize(count, f32::INFINITY));
        high.iter_mut().for_each(|column| column.resize(count, f32::NEG_INFINITY));
    }

    /// The number of obstacles.
    pub fn len(&self) -> usize {
        self.plane[0].len()
    }

    /// The obstacles that a ray in the shaft may hit: all others lie beside it, or it lies on one side of their planes.
    #[inline(always)]
    pub fn within<F: Float>(&self, shaft: &Shaft) -> u128 {
        let bounds = shaft.bounds();
        let (mut centers, mut halves) = ([[F::zero(); 3]; 2], [[F::zero(); 3]; 2]);
        for (side, CoordinateRange { low, high }) in shaft.0.iter().enumerate() {
            for axis in 0..3 {
                let (center, half) = ((low[axis] + high[axis]) * 0.5, (high[axis] - low[axis]) * 0.5);
                centers[side][axis] = F::splat(center);
                halves[side][axis] = F::splat(half + (center.abs() + half) * MARGIN);
            }
        }
        let mut found = 0;
        for at in (0..self.len()).step_by(F::WIDTH) {
            let offset = F::load(&self.plane[3][at..]);
            let margin = offset.abs() * F::splat(MARGIN);
            let (mut distance, mut reach) = ([F::zero() - offset; 2], [margin; 2]);
            let mut beside = F::Mask::from_bits(0);
            for axis in 0..3 {
                let normal = F::load(&self.plane[axis][at..]);
                for side in 0..2 {
                    distance[side] = distance[side] + normal * centers[side][axis];
                    reach[side] = reach[side] + normal.abs() * halves[side][axis];
                }
                let [low, high] = [&self.bounds[0][axis], &self.bounds[1][axis]];
                let (low, high) = (F::load(&low[at..]), F::load(&high[at..]));
                beside = beside | low.gt(F::splat(bounds.high[axis])) | high.lt(F::splat(bounds.low[axis]));
            }
            let before = distance[0].gt(reach[0]) & distance[1].gt(reach[1]);
            let behind = (distance[0] + reach[0]).lt(F::zero()) & (distance[1] + reach[1]).lt(F::zero());
            let lanes = !(beside | before | behind).bits() & F::Mask::first(F::WIDTH).bits();
            found |= u128::from(lanes) << at;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::AnyHitFilter;

    fn obstacles_of(shaft: [[[f32; 3]; 2]; 2]) -> u128 {
        let mut obstacles = Obstacles::default();
        // A wall at x = 0, one at x = 4, a floor between them, a slope over the floor, a ball.
        obstacles.push_triangle([[0.0, -9.0, -9.0], [0.0, 9.0, -9.0], [0.0, 0.0, 9.0]]);
        obstacles.push_triangle([[4.0, -9.0, -9.0], [4.0, 9.0, -9.0], [4.0, 0.0, 9.0]]);
        obstacles.push_triangle([[0.0, -9.0, -1.0], [4.0, -9.0, -1.0], [2.0, 9.0, -1.0]]);
        obstacles.push_triangle([[0.0, -9.0, 0.0], [4.0, -9.0, 4.0], [4.0, 9.0, 4.0]]);
        obstacles.push_sphere([2.0, 0.0, 8.0], 1.0);
        obstacles.finish();
        let [[low, high], [end_low, end_high]] = shaft;
        let shaft =
            Shaft::new(CoordinateRange { low, high }, CoordinateRange { low: end_low, high: end_high });
        obstacles.within::<f32>(&shaft)
    }

    #[test]
    fn obstacles_beside_a_shaft_or_with_planes_that_it_does_not_cross_are_culled() {
        let cube = |at: [f32; 3]| [at.map(|c| c - 0.1), at.map(|c| c + 0.1)];
        assert_eq!(obstacles_of([cube([1.0, 0.0, 3.0]), cube([3.0, 0.0, 5.0])]), 0, "above the slope");
        assert_eq!(obstacles_of([cube([3.0, 0.0, 1.0]), cube([3.0, 1.0, -0.5])]), 0, "below it");
        assert_eq!(obstacles_of([cube([3.0, 0.0, 1.0]), cube([1.0, 0.0, 3.0])]), 0b01000, "through it");
        assert_eq!(obstacles_of([cube([-1.0, 0.0, 6.0]), cube([5.0, 0.0, 9.0])]), 0b10011, "across");
        // A ray that starts just off a wall leaves it behind; one that ends just before a wall may hit it.
        let off = |x: f32| [[x, 0.0, 5.0]; 2];
        assert_eq!(obstacles_of([off(1e-9), off(2.0)]), 0);
        assert_eq!(obstacles_of([off(2.0), off(1e-9)]), 1);
    }

    #[test]
    fn rays_without_ends_have_no_shaft() {
        let (x, y, t_min) = ([0.0; 3], [1.0; 3], [0.0; 3]);
        let around = |t_max: [f32; 3]| {
            let filter = AnyHitFilter::ACCEPT_ALL;
            let rays = Rays { origin: [&x; 3], direction: [&y; 3], t_min: &t_min, t_max: &t_max, filter };
            Shaft::around::<f32>(&rays, 0..3).map(|shaft| shaft.0[1].high[0])
        };
        assert!(around([1.0, 3.0, 2.0]).is_some_and(|end| (3.0..3.001).contains(&end)));
        assert!(around([1.0, f32::INFINITY, 2.0]).is_none());
        assert!(around([1.0, f32::NAN, 2.0]).is_none());
    }
}
