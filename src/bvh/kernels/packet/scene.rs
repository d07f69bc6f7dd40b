//! The scene of a packet, and its any-hit filters.

use super::rays::PacketRays;
use super::{Packet, Verdict};
use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::AnyHitFilters;
use crate::bvh::intersect::triangle::{ExactRays, TrianglePlane};
use crate::bvh::layout::sidedness::AnyHitFilter;
use crate::bvh::layout::{Bvh, TriangleBlock};
use crate::simd::{Float, Kernel, Lanes, TraversalStack};

/// [`Packet::trace`] as a kernel.
pub(in crate::bvh) struct PacketQuery<'a, 'r, A> {
    pub packet: &'a mut Packet,
    pub bvh: &'a Bvh,
    pub rays: &'a Rays<'r>,
    /// The index of the first ray, and the number of rays.
    pub first: usize,
    pub count: usize,
    pub keys: &'a mut TraversalStack,
    pub sink: &'a mut A,
}

impl<A: HitSink> Kernel for PacketQuery<'_, '_, A> {
    type Output = Verdict;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Verdict {
        let Self { packet, bvh, rays, first, count, keys, sink } = self;
        packet.trace::<L, A>(bvh, rays, first, count, keys, sink)
    }
}

/// A triangle and a group of rays.
pub struct OfGroup<'a> {
    pub rays: &'a PacketRays,
    pub group: usize,
    pub block: &'a TriangleBlock,
    pub place: usize,
}

impl<F: Float> ExactRays<F> for OfGroup<'_> {
    #[inline(always)]
    fn t(&self, lanes: F::Mask, t: F) -> F {
        let (origin, direction) = self.rays.lines::<F>(self.group);
        TrianglePlane::new(self.block.corners(self.place)).t_in_lanes(&origin, &direction, lanes, t)
    }
}

/// The tree for a packet, and the any-hit filter of its first ray.
#[derive(Clone, Copy)]
pub struct PacketScene<'a> {
    pub bvh: &'a Bvh,
    pub filter: AnyHitFilter<'a>,
}

/// The any-hit filters of a group of rays.
pub struct InGroup<'a> {
    /// The filter of the packet's first ray.
    pub first: AnyHitFilter<'a>,
    pub at: usize,
}

impl AnyHitFilters for InGroup<'_> {
    fn filter(&self, lane: usize) -> AnyHitFilter<'_> {
        self.first.after(self.at + lane)
    }
}
