//! The scene of a packet, and its any-hit filters.

use super::super::Rays;
use super::super::hit_sink::HitSink;
use super::super::layout::{Bvh, TriangleBlock};
use super::super::leaf::AnyHitFilters;
use super::super::sidedness::AnyHitFilter;
use super::super::triangle::{ExactRays, TrianglePlane};
use super::rays::PacketRays;
use super::{Packet, Verdict};
use crate::simd::{Float, Kernel, Lanes, TraversalStack};

/// [`Packet::trace`] as a kernel.
pub(in super::super) struct PacketQuery<'a, 'r, A> {
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
