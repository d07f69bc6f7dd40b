//! The acceleration structure: one flattened tree of 16-wide nodes over blocks of 8
//! triangles or spheres, and over instances of further trees in the same arrays.
//!
//! Built in three steps: [`build`] makes a binary tree with the surface area heuristic
//! ([`binning`]), large ones by way of [`buckets`], the best ones by cuts through triangles
//! ([`spatial`]); [`collapse`] folds it into wide nodes at least expected cost; [`layout`] is
//! what comes out. [`assemble`] puts the steps together. [`query`] answers queues of rays.
//!
//! **Which hit is the answer** does not depend on the order in which nodes are
//! visited, the lane width or the schedule. Every box is padded ([`layout::pad`]) and
//! every slab distance rounded outwards, so that a leaf is never culled before a hit
//! inside it; a hit's `t` is raised to the ray's entry into its leaf box where rounding
//! put it before; a node is skipped only if the ray enters it beyond the best hit;
//! of equal hits the smallest (primitive, instance) wins. So the answer is the
//! minimum of (max(t, entry), primitive, instance) over all primitives that are there for the
//! ray ([`sidedness`]).

pub mod assemble;
mod autotune;
pub mod binary;
pub mod binary_traversal;
pub mod binning;
pub mod brute;
pub mod buckets;
pub mod build;
pub mod check;
pub mod clip;
pub mod collapse;
pub mod counters;
mod direction_classes;
mod hit_sink;
mod interleaved;
pub mod layout;
mod leaf;
mod leaf_list;
mod packet;
mod prepare;
pub mod primitives;
pub mod query;
mod ray;
pub mod reference;
mod shaft;
pub mod sidedness;
mod spatial;
pub mod sphere;
pub mod split_candidates;
mod stream;
pub mod traverse;
pub mod triangle;

#[cfg(test)]
mod tests;

pub use assemble::PrimitiveArrays;
pub use layout::{BuildStatistics, Bvh, Child, ChildKind, Instance, Root, SPHERE};
pub use query::{Coherence, QUEUE, Stack, any, any_in_bundles, any_ray, closest, closest_ray};
pub use sidedness::{AnyHitFilter, Crossing, FaceCulling, HitPredicate, Sidedness};

/// How much work goes into the acceleration structure: a trade between the time to build it and the time to trace
/// rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "render", derive(serde::Serialize, serde::Deserialize))]
pub enum BuildQuality {
    /// Builds as fast as it can; tracing is slower.
    Fast,
    /// Good for nearly everything.
    #[default]
    Default,
    /// The best tree: large triangles may be split between leaves, into up to 30 % more references.
    High,
}

/// A view of ray columns: all slices have the same length.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    /// X, Y and Z of the origins.
    pub origin: [&'a [f32]; 3],
    /// X, Y and Z of the directions, of any length but zero, in which t is measured.
    pub direction: [&'a [f32]; 3],
    /// At least 0; a negative one counts as 0.
    pub t_min: &'a [f32],
    /// Infinity where nothing bounds the ray.
    pub t_max: &'a [f32],
    /// Asks for the first of them what is there.
    pub(crate) filter: AnyHitFilter<'a>,
}

impl<'a> Rays<'a> {
    /// Of columns: X, Y and Z of the origins and of the directions, and the range of t of each. All have the same
    /// length.
    pub fn new(
        origin: [&'a [f32]; 3],
        direction: [&'a [f32]; 3],
        t_min: &'a [f32],
        t_max: &'a [f32],
    ) -> Self {
        Self { origin, direction, t_min, t_max, filter: AnyHitFilter::ACCEPT_ALL }
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    /// One of them.
    pub(crate) fn ray(&self, i: usize) -> crate::math::Ray<f32> {
        self.get(i)
    }

    /// What one of them asks by.
    #[inline(always)]
    pub(crate) fn filter(&self, i: usize) -> AnyHitFilter<'a> {
        self.filter.after(i)
    }

    /// Some of them.
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

    /// Views of all rays in order, `size` at a time; the last one may be shorter. A `size` of 0 counts as 1. For
    /// several threads, each with its part of the hits ([`HitsMut::chunks`]) and a tracer of its own.
    pub fn chunks(self, size: usize) -> impl Iterator<Item = Rays<'a>> {
        let all = self.origin.into_iter().chain(self.direction).chain([self.t_min, self.t_max]);
        // If some columns are shorter, those of the parts are, too, and a query says so.
        let (size, count) = (size.max(1), all.map(<[f32]>::len).max().unwrap_or(0));
        (0..count).step_by(size).map(move |from| self.range(from..from.saturating_add(size)))
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }
}

/// Columns of hits, with one entry for each ray (see [`crate::math::Hit`]).
pub struct HitsMut<'a> {
    /// Distances, in lengths of each ray's direction; infinity for a miss.
    pub t: &'a mut [f32],
    /// Weights of triangles' second corners; 0 for spheres and misses.
    pub u: &'a mut [f32],
    /// Weights of triangles' third corners; 0 for spheres and misses.
    pub v: &'a mut [f32],
    /// Primitive ids, [`crate::math::NONE`] for a miss.
    pub primitive: &'a mut [u32],
    /// Instance ids, [`crate::math::NONE`] for a miss and for what lies in world space.
    pub instance: &'a mut [u32],
}

impl<'a> HitsMut<'a> {
    /// All of them in order, `size` (at least 1) at a time; the last part may be shorter.
    pub fn chunks(self, size: usize) -> impl Iterator<Item = HitsMut<'a>> {
        let size = size.max(1);
        let Self { t, u, v, primitive, instance } = self;
        let floats = t.chunks_mut(size).zip(u.chunks_mut(size)).zip(v.chunks_mut(size));
        let ids = primitive.chunks_mut(size).zip(instance.chunks_mut(size));
        floats.zip(ids).map(|(((t, u), v), (primitive, instance))| HitsMut { t, u, v, primitive, instance })
    }
}
