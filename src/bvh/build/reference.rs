//! The builder's references to primitives.

use glam::Vec4;

use crate::bvh::layout::{ChildKind, PADDING};
use crate::math::Aabb;

/// A primitive's box, with its id and kind in the spare fourth components. 32 bytes.
///
/// The fourth components take part in the arithmetic of the other three, but the results are not used. So that they
/// never slow it down as denormals do, they are numbers from 1 to 2 whose 23 fraction bits hold the id's low bits, and
/// its high bits with the kind.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    low: Vec4,
    high: Vec4,
}

/// The bits of 1.0.
const ONE: u32 = 0x3f80_0000;
const FRACTION_BITS: u32 = 23;
const FRACTION: u32 = (1 << FRACTION_BITS) - 1;
/// The position of the kind above the high bits of a 32-bit id.
const KIND_SHIFT: u32 = 32 - FRACTION_BITS;

impl Reference {
    /// Creates a reference from a primitive's padded box, kind and id.
    #[inline(always)]
    pub fn new(bounds: SimdAabb, kind: ChildKind, id: u32) -> Self {
        let low = f32::from_bits(ONE | id & FRACTION);
        let high = f32::from_bits(ONE | id >> FRACTION_BITS | (kind as u32) << KIND_SHIFT);
        Self { low: bounds.min.with_w(low), high: bounds.max.with_w(high) }
    }

    /// The id of the primitive.
    #[inline(always)]
    pub fn id(&self) -> u32 {
        self.low.w.to_bits() & FRACTION | (self.high.w.to_bits() & FRACTION) << FRACTION_BITS
    }

    /// The kind of the primitive.
    #[inline(always)]
    pub fn kind(&self) -> ChildKind {
        match (self.high.w.to_bits() & FRACTION) >> KIND_SHIFT {
            1 => ChildKind::Triangles,
            2 => ChildKind::Spheres,
            _ => ChildKind::Instance,
        }
    }

    /// A reference to the part of the primitive in a box.
    #[inline(always)]
    pub fn clipped(&self, bounds: &SimdAabb) -> Self {
        Self { low: bounds.min.with_w(self.low.w), high: bounds.max.with_w(self.high.w) }
    }

    /// The box; its fourth components are meaningless.
    #[inline(always)]
    pub fn extent(&self) -> SimdAabb {
        SimdAabb { min: self.low, max: self.high }
    }

    /// Twice the centre of the box: min + max saves a multiplication.
    #[inline(always)]
    pub fn center(&self) -> Vec4 {
        self.low + self.high
    }
}

/// A box with corners of four components, computed together. The fourth is meaningless.
#[derive(Clone, Copy, Debug)]
pub struct SimdAabb {
    /// The low corner.
    pub min: Vec4,
    /// The high corner.
    pub max: Vec4,
}

impl SimdAabb {
    /// The empty box.
    pub const EMPTY: SimdAabb = SimdAabb { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    /// The box around points.
    #[inline(always)]
    pub fn around_points(points: [[f32; 3]; 3]) -> SimdAabb {
        let [a, b, c] = points.map(|[x, y, z]| Vec4::new(x, y, z, 0.0));
        SimdAabb { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    /// The box grown by a fraction of its own coordinates, as by [`crate::bvh::layout::pad`].
    #[inline(always)]
    pub fn padded(self) -> SimdAabb {
        let padding = Vec4::splat(PADDING);
        SimdAabb { min: self.min - self.min.abs() * padding, max: self.max + self.max.abs() * padding }
    }

    /// The box around the references' boxes.
    pub fn around(references: &[Reference]) -> SimdAabb {
        references.iter().fold(SimdAabb::EMPTY, |all, r| all.union(r.extent()))
    }

    /// The box around the references' doubled centres.
    pub fn around_centers(references: &[Reference]) -> SimdAabb {
        // Two independent chains: each minimum depends on the one before it.
        let (pairs, rest) = references.as_chunks::<2>();
        let mut all = [SimdAabb::EMPTY; 2];
        for pair in pairs {
            all = [all[0].with(pair[0].center()), all[1].with(pair[1].center())];
        }
        rest.iter().fold(all[0].union(all[1]), |all, r| all.with(r.center()))
    }

    /// The box around both.
    #[inline(always)]
    pub fn union(self, other: SimdAabb) -> SimdAabb {
        SimdAabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The intersection of both.
    #[inline(always)]
    pub fn intersection(self, other: SimdAabb) -> SimdAabb {
        SimdAabb { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// The box that also includes a point.
    #[inline(always)]
    pub fn with(self, point: Vec4) -> SimdAabb {
        SimdAabb { min: self.min.min(point), max: self.max.max(point) }
    }

    /// Half the surface area. NaN or infinite if the box is empty or its size overflows.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// The axis of the longest side.
    #[inline(always)]
    pub fn longest_axis(&self) -> usize {
        let size = self.max - self.min;
        if size.x >= size.y && size.x >= size.z { 0 } else { 1 + (size.z > size.y) as usize }
    }

    /// Adds fourth components to a box.
    #[inline(always)]
    pub fn new(bounds: &Aabb) -> SimdAabb {
        SimdAabb { min: bounds.min.extend(0.0), max: bounds.max.extend(0.0) }
    }

    /// Drops the fourth components.
    #[inline(always)]
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.min.truncate(), max: self.max.truncate() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn reference_preserves_bounds_kind_and_id() {
        let bounds = Aabb { min: Vec3::new(-1.0, -0.0, 2.0), max: Vec3::new(1.0, 0.0, 3.0) };
        for kind in [ChildKind::Triangles, ChildKind::Spheres, ChildKind::Instance] {
            for id in [0, 1, 0x7f_ffff, 0x80_0000, 0x1234_5678, (1 << 31) - 1, u32::MAX] {
                let reference = Reference::new(SimdAabb::new(&bounds), kind, id);
                assert_eq!((reference.kind(), reference.id()), (kind, id));
                assert_eq!(reference.extent().bounds(), bounds);
                assert!(reference.low.w.is_normal() && reference.high.w.is_normal());
            }
        }
        assert_eq!(size_of::<Reference>(), 32);
    }
}
