//! What a packet goes through and what its rays ask for there.

use super::super::Rays;
use super::super::hit_sink::HitSink;
use super::super::layout::{Bvh, TriangleBlock};
use super::super::leaf::AnyHitFilters;
use super::super::sidedness::AnyHitFilter;
use super::super::triangle::{ExactRays, TrianglePlane};
use super::rays::PacketRays;
use super::{Packet, Verdict};
use crate::simd::{Float, Kernel, Lanes, TraversalStack};

/// [`Packet::trace`].
pub(in super::super) struct PacketQuery<'a, 'r, A> {
    pub packet: &'a mut Packet,
    pub bvh: &'a Bvh,
    pub rays: &'a Rays<'r>,
    /// The first of them, and how many.
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

/// What a packet goes through, and what its first ray asks by.
#[derive(Clone, Copy)]
pub struct PacketScene<'a> {
    pub bvh: &'a Bvh,
    pub filter: AnyHitFilter<'a>,
}

/// A group of rays that can ask.
pub struct InGroup<'a> {
    /// The packet's first ray.
    pub first: AnyHitFilter<'a>,
    pub at: usize,
}

impl AnyHitFilters for InGroup<'_> {
    fn filter(&self, lane: usize) -> AnyHitFilter<'_> {
        self.first.after(self.at + lane)
    }
}
