//! The acceleration structure: one flattened tree of 16-wide nodes over blocks of 8 triangles or spheres, and over
//! instances of further trees in the same arrays.
//!
//! [`build`] makes the tree, [`layout`] is the result, [`kernels`] trace queues of rays by the tests of [`intersect`], and
//! [`baseline`] finds the same hits by simpler ways. Rooms in order of imports: layout, intersect, build, kernels, baseline.
//!
//! **The reported hit** does not depend on the order in which nodes are visited, the lane width or the schedule. Every
//! box is padded ([`layout::pad`]) and every slab distance rounded outwards, so that a leaf is never culled before a
//! hit inside it; a hit's `t` is raised to the ray's entry into its leaf box where rounding put it before; a node is
//! skipped only if the ray enters it beyond the best hit; of equal hits the smallest (primitive, instance) wins. So the
//! hit is the minimum of (max(t, entry), primitive, instance) over all primitives that the ray's any-hit filter accepts
//! ([`sidedness`]), in all leaves whose boxes it enters: a triangle may be in several.

pub mod baseline;
pub mod build;
pub mod intersect;
pub mod kernels;
pub mod layout;

#[cfg(test)]
mod tests;

pub use build::primitives::PrimitiveArrays;
pub use kernels::query::{Coherence, QUEUE, Stack, any, any_in_bundles, any_ray, closest, closest_ray};
pub use layout::sidedness::{AnyHitFilter, Crossing, FaceCulling, HitPredicate, SPHERE, Sidedness};
pub use layout::{BuildStatistics, Bvh, Child, ChildKind, Instance, Root};

/// A view of ray columns: all slices have the same length.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    /// X, Y and Z of the origins.
    pub origin: [&'a [f32]; 3],
    /// X, Y and Z of the directions, of any length but zero, in which t is measured.
    pub direction: [&'a [f32]; 3],
    /// The lower ends of the t ranges: at least 0; negative values count as 0.
    pub t_min: &'a [f32],
    /// The upper ends of the t ranges; infinity for an unbounded ray.
    pub t_max: &'a [f32],
    /// Any-hit filter; ray 0 of this view is its first ray.
    pub(crate) filter: AnyHitFilter<'a>,
}

impl<'a> Rays<'a> {
    /// Creates a view from columns: X, Y and Z of the origins and of the directions, and the t range of each ray. All
    /// have the same length.
    pub fn new(
        origin: [&'a [f32]; 3],
        direction: [&'a [f32]; 3],
        t_min: &'a [f32],
        t_max: &'a [f32],
    ) -> Self {
        Self { origin, direction, t_min, t_max, filter: AnyHitFilter::ACCEPT_ALL }
    }

    /// The number of rays.
    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    /// Returns ray `i`.
    pub(crate) fn ray(&self, i: usize) -> crate::math::Ray<f32> {
        self.get(i)
    }

    /// The any-hit filter of ray `i`.
    #[inline(always)]
    pub(crate) fn filter(&self, i: usize) -> AnyHitFilter<'a> {
        self.filter.after(i)
    }

    /// A part of the rays.
    pub(crate) fn range(&self, range: std::ops::Range<usize>) -> Self {
        let part = |column: &'a [f32]| {
            let end = range.end.min(column.len());
            &column[range.start.min(end)..end]
        };
        Self {
            origin: self.origin.map(part),
            direction: self.direction.map(part),
            t_min: part(self.t_min),
            t_max: part(self.t_max),
            filter: self.filter.after(range.start),
        }
    }

    /// Views of all rays in order, `size` at a time; the last one may be shorter. A `size` of 0 counts as 1. Meant for
    /// several threads, each with its part of the hits ([`HitsMut::chunks`]) and its own tracer.
    pub fn chunks(self, size: usize) -> impl Iterator<Item = Rays<'a>> {
        let all = self.origin.into_iter().chain(self.direction).chain([self.t_min, self.t_max]);
        // If some columns are shorter, so are those of the parts, and a query reports it.
        let (size, count) = (size.max(1), all.map(<[f32]>::len).max().unwrap_or(0));
        (0..count).step_by(size).map(move |from| self.range(from..from.saturating_add(size)))
    }

    /// True if there are no rays.
    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }
}

/// Columns of hits, with one entry for each ray (see [`crate::math::Hit`]).
pub struct HitsMut<'a> {
    /// Distances, in lengths of each ray's direction; infinity for a miss.
    pub t: &'a mut [f32],
    /// Barycentric weights of triangles' second corners; 0 for spheres and misses.
    pub u: &'a mut [f32],
    /// Barycentric weights of triangles' third corners; 0 for spheres and misses.
    pub v: &'a mut [f32],
    /// Primitive ids, [`crate::math::NONE`] for a miss.
    pub primitive: &'a mut [u32],
    /// Instance ids, [`crate::math::NONE`] for a miss and for primitives in world space.
    pub instance: &'a mut [u32],
}

impl<'a> HitsMut<'a> {
    /// All hits in order, `size` (at least 1) at a time; the last part may be shorter.
    pub fn chunks(self, size: usize) -> impl Iterator<Item = HitsMut<'a>> {
        let size = size.max(1);
        let Self { t, u, v, primitive, instance } = self;
        let floats = t.chunks_mut(size).zip(u.chunks_mut(size)).zip(v.chunks_mut(size));
        let ids = primitive.chunks_mut(size).zip(instance.chunks_mut(size));
        floats.zip(ids).map(|(((t, u), v), (primitive, instance))| HitsMut { t, u, v, primitive, instance })
    }
}
