//! The primitives that a tree is built over.

use std::ops::Range;

use super::assemble::PrimitiveArrays;
use super::layout::ChildKind;
use super::reference::{Reference, SimdAabb};
use crate::math::Aabb;

/// Parts of the geometry, and the boxes of instances.
pub struct Primitives<'a> {
    /// The arrays that ids refer to.
    pub geometry: &'a PrimitiveArrays<'a>,
    /// Ids of triangles.
    pub triangles: Range<u32>,
    /// Ids of spheres.
    pub spheres: Range<u32>,
    /// The instances' padded boxes in world space.
    pub instances: Vec<Aabb>,
}

impl Primitives<'_> {
    /// The number of primitives.
    pub fn count(&self) -> usize {
        self.triangles.len() + self.spheres.len() + self.instances.len()
    }

    /// True if a range of them may not fit a leaf even if it is small enough.
    pub fn are_mixed(&self) -> bool {
        !self.instances.is_empty() || (!self.triangles.is_empty() && !self.spheres.is_empty())
    }

    /// The reference of the primitive at an index: triangles come first, then spheres, then instances.
    #[inline(always)]
    pub fn reference(&self, place: usize) -> Reference {
        let (triangles, spheres) = (self.triangles.len(), self.spheres.len());
        if place < triangles {
            let id = self.triangles.start + place as u32;
            let bounds = SimdAabb::around_points(self.geometry.corners(id));
            return Reference::new(bounds.padded(), ChildKind::Triangles, id);
        }
        let place = place - triangles;
        if place < spheres {
            let id = self.spheres.start + place as u32;
            return Reference::new(SimdAabb::new(&self.geometry.sphere_bounds(id)), ChildKind::Spheres, id);
        }
        let place = place - spheres;
        Reference::new(SimdAabb::new(&self.instances[place]), ChildKind::Instance, place as u32)
    }
}
