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
//! ray ([`presence`]).

mod answers;
pub mod assemble;
pub mod binary;
pub mod binning;
pub mod brute;
pub mod buckets;
pub mod build;
pub mod check;
pub mod clip;
pub mod collapse;
mod direction_classes;
mod few_leaves;
mod flight;
pub mod layout;
mod leaf;
pub mod narrow;
mod packet;
mod prepare;
pub mod presence;
pub mod primitives;
pub mod query;
mod race;
mod ray;
pub mod reference;
mod shaft;
pub mod spatial;
pub mod sphere;
mod stream;
pub mod tally;
pub mod traverse;
pub mod triangle;

#[cfg(test)]
mod tests;

pub use assemble::Geometry;
pub use layout::{BuildStatistics, Bvh, Child, ChildKind, Instance, Root, SPHERE};
pub use presence::{Asker, Crossing, Presence, Surfaces};
pub use query::{Coherence, QUEUE, Stack, any, any_in_fans, any_ray, closest, closest_ray};

/// How much work goes into the acceleration structure: what it costs to build against what
/// it saves while tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "render", derive(serde::Serialize, serde::Deserialize))]
pub enum BuildQuality {
    /// As soon as possible; traces slower.
    Fast,
    /// Good for nearly everything.
    #[default]
    Default,
    /// As good as it gets: large triangles may be split between leaves, within a budget.
    High,
}

/// A view of ray columns: all slices have the same length.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    /// X, Y and Z of the origins.
    pub origin: [&'a [f32]; 3],
    /// X, Y and Z of the directions, of any length but zero; t counts in it.
    pub direction: [&'a [f32]; 3],
    /// At least 0; less counts as 0.
    pub t_min: &'a [f32],
    /// Infinity where nothing bounds the ray.
    pub t_max: &'a [f32],
    /// Asks for the first of them what is there.
    pub(crate) asker: Asker<'a>,
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
        Self { origin, direction, t_min, t_max, asker: Asker::CREDULOUS }
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
    pub(crate) fn asker(&self, i: usize) -> Asker<'a> {
        self.asker.after(i)
    }

    /// Some of them.
    pub(crate) fn range(&self, range: std::ops::Range<usize>) -> Self {
        let part = |column: &'a [f32]| &column[range.clone()];
        Self {
            origin: self.origin.map(part),
            direction: self.direction.map(part),
            t_min: part(self.t_min),
            t_max: part(self.t_max),
            asker: self.asker.after(range.start),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }
}

/// Hit columns, one entry a ray (see [`crate::math::Hit`]).
pub struct HitsMut<'a> {
    /// Distances; infinity for a miss.
    pub t: &'a mut [f32],
    /// First barycentric coordinates.
    pub u: &'a mut [f32],
    /// Second barycentric coordinates.
    pub v: &'a mut [f32],
    /// Primitive ids, [`crate::math::NONE`] for a miss.
    pub primitive: &'a mut [u32],
    /// Instance ids, [`crate::math::NONE`] in world space.
    pub instance: &'a mut [u32],
}
