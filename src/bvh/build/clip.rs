//! Bounding boxes of clipped triangles.

use glam::Vec4;

use super::reference::SimdAabb;
use crate::bvh::layout::PADDING;

/// A triangle in double precision, for clipping.
pub struct Clipper {
    corners: [[f64; 3]; 3],
    /// The padding of the boxes of parts, which is that of the whole triangle: hits are as inexact on a part as on the
    /// whole.
    padding: Vec4,
}

impl Clipper {
    /// Prepares a triangle.
    #[inline]
    pub fn new(corners: [[f32; 3]; 3]) -> Self {
        let whole = SimdAabb::around_points(corners);
        let padding = whole.min.abs().max(whole.max.abs()) * Vec4::splat(PADDING);
        Self { corners: corners.map(|corner| corner.map(f64::from)), padding }
    }

    /// The padded box around the part between two planes across an axis; empty if there is none. Never too small:
    /// double precision errs by far less than the padding, except where floats have hardly any digits left, hence the
    /// next floats outwards.
    #[inline]
    pub fn between(&self, axis: usize, low: f32, high: f32) -> SimdAabb {
        let (low, high) = (f64::from(low), f64::from(high));
        let mut min = [f64::INFINITY; 3];
        let mut max = [f64::NEG_INFINITY; 3];
        let mut add = |point: [f64; 3]| {
            for k in 0..3 {
                min[k] = min[k].min(point[k]);
                max[k] = max[k].max(point[k]);
            }
        };
        for corner in 0..3 {
            let (a, b) = (self.corners[corner], self.corners[(corner + 1) % 3]);
            if a[axis] >= low && a[axis] <= high {
                add(a);
            }
            for plane in [low, high] {
                if (a[axis] < plane && b[axis] > plane) || (a[axis] > plane && b[axis] < plane) {
                    let part = (plane - a[axis]) / (b[axis] - a[axis]);
                    let mut point = [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * part);
                    point[axis] = plane;
                    add(point);
                }
            }
        }
        if min[0] > max[0] {
            return SimdAabb::EMPTY;
        }
        let corner = |point: [f64; 3], outwards: fn(f32) -> f32| {
            let [x, y, z] = point.map(|c| outwards(c as f32));
            Vec4::new(x, y, z, 0.0)
        };
        SimdAabb {
            min: corner(min, f32::next_down) - self.padding,
            max: corner(max, f32::next_up) + self.padding,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Every point of a triangle is in the box of its slab.
        #[test]
        fn box_of_a_part_contains_the_points_of_the_part(
            corners in prop::array::uniform3(prop::array::uniform3(-10.0f32..10.0)),
            weights in prop::array::uniform3(0.0f64..1.0),
            planes in prop::array::uniform2(-10.0f32..10.0),
            axis in 0usize..3,
        ) {
            let (low, high) = (planes[0].min(planes[1]), planes[0].max(planes[1]));
            let part = Clipper::new(corners).between(axis, low, high).bounds();
            let sum = weights.iter().sum::<f64>().max(1e-9);
            let point: [f64; 3] = std::array::from_fn(|k| {
                (0..3).map(|c| f64::from(corners[c][k]) * weights[c] / sum).sum::<f64>()
            });
            if point[axis] >= f64::from(low) && point[axis] <= f64::from(high) && weights != [0.0; 3] {
                for (k, point) in point.into_iter().enumerate() {
                    prop_assert!(point >= f64::from(part.min[k]) && point <= f64::from(part.max[k]));
                }
            }
        }
    }
}
