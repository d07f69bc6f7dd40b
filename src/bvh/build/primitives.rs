//! The primitives that a tree is built over.

use std::ops::Range;

use glam::Vec3;

use super::reference::{Reference, SimdAabb};
use crate::bvh::layout::ChildKind;
use crate::math::Aabb;

/// The arrays that primitive ids refer to.
#[derive(Clone, Copy)]
pub struct PrimitiveArrays<'a> {
    /// Vertex positions.
    pub positions: &'a [[f32; 3]],
    /// Triangles by vertex indices; a triangle's id is its index.
    pub triangles: &'a [[u32; 3]],
    /// Centres and radii; a sphere's id is its index with the [`crate::bvh::SPHERE`] bit.
    pub spheres: &'a [[f32; 4]],
}

impl PrimitiveArrays<'_> {
    #[inline(always)]
    pub(in crate::bvh) fn corners(&self, triangle: u32) -> [[f32; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    pub(in crate::bvh) fn sphere_bounds(&self, sphere: u32) -> Aabb {
        let [x, y, z, radius] = self.spheres[sphere as usize];
        let (center, radius) = (Vec3::new(x, y, z), Vec3::splat(radius));
        // Centre ± radius may cancel: pad by the size of the operands, not of the result.
        let extra = (center.abs() + radius) * crate::bvh::layout::PADDING;
        Aabb { min: center - radius - extra, max: center + radius + extra }
    }
}

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
    /// References to all of these, if some have several ([`super::slivers`]); otherwise empty.
    pub parts: Vec<Reference>,
}

impl<'a> Primitives<'a> {
    /// Parts of the geometry, and instances with these boxes. Slivers are split if it is worthwhile.
    pub fn new(
        geometry: &'a PrimitiveArrays<'a>,
        triangles: Range<u32>,
        spheres: Range<u32>,
        instances: Vec<Aabb>,
    ) -> Self {
        let whole = Self::whole(geometry, triangles, spheres, instances);
        Self { parts: super::slivers::split(&whole), ..whole }
    }

    /// Like [`Primitives::new`], without splits.
    pub fn whole(
        geometry: &'a PrimitiveArrays<'a>,
        triangles: Range<u32>,
        spheres: Range<u32>,
        instances: Vec<Aabb>,
    ) -> Self {
        Self { geometry, triangles, spheres, instances, parts: Vec::new() }
    }

    /// The number of references to primitives.
    pub fn count(&self) -> usize {
        match self.parts.len() {
            0 => self.triangles.len() + self.spheres.len() + self.instances.len(),
            parts => parts,
        }
    }

    /// True if a range of them may not fit a leaf even if it is small enough.
    pub fn are_mixed(&self) -> bool {
        !self.instances.is_empty() || (!self.triangles.is_empty() && !self.spheres.is_empty())
    }

    /// The reference at an index: to triangles first, then to spheres, then to instances.
    #[inline(always)]
    pub fn reference(&self, place: usize) -> Reference {
        if let Some(part) = self.parts.get(place) {
            return *part;
        }
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
