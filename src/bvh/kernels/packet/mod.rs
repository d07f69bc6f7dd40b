//! Packets: the kernel for coherent rays.
//!
//! Up to [`RAYS`] rays traverse the tree together, with one stack. A *beam* of six planes bounds them all: four that
//! bound the positions of the rays, as straight lines between the ends of the beam (so that rays from one point, to one
//! point, and side by side are bounded equally well), and its two ends. The beam is tested against a node's 16 children
//! together; those that it meets are tested ray by ray, with the slabs of the single-ray kernel, when they come off the
//! stack. At a leaf the beam culls triangles and spheres, and the others are tested against the rays, a ray a lane,
//! with the canonical test. (Large packets after Overbeck, Ramamoorthi and Mark, "Large ray packets for real-time
//! Whitted ray tracing", 2008; the beam is Reshetov's frustum, "Multi-level ray tracing algorithm", 2005, with ends.)
//!
//! Rays of a packet whose directions have other signs or another longest axis than the first one's are left to a pass
//! of their own.

mod beam;
mod instance;
mod rays;
mod scene;
mod walk;

use std::marker::PhantomData;

use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::layout::Bvh;
use crate::simd::{Float, Lanes, TraversalStack};
use beam::Beam;
use instance::InstancePacket;
use rays::Active;
pub(super) use rays::{LEAST_WIDTH, RAYS};
pub(super) use scene::PacketQuery;
use scene::PacketScene;
use walk::{BoxStack, PacketWalk, Pass};

/// The number of passes over a packet; the rest is left to the single-ray kernel.
const PASSES: usize = 4;
/// A pass with fewer rays is not worth it.
const FEWEST: u32 = 12;

/// The number of boxes for each ray above which a packet costs more than a stream of its rays would, for nearest-hit
/// and for any-hit queries: the mesh is then finer than the rays are dense, and few of them enter each box. (Measured
/// in million rays a second. Shadow rays, with a limit of 0.9, 1.3, 1.8 and none: on a million triangles 7.6, 8.2, 8.8,
/// 9.0; on 10 million 6.1, 6.1, 5.6, 4.8; with 1.5 and none in another run 8.6 and 8.9, 5.9 and 4.6. Camera rays on 10
/// million: 5.1 with 1, 5.7 with 2 and with none. `scenes/terrain.ron`, which has mirrors in it, is as fast with 2 as
/// with 1.)
const DEAR: [f32; 2] = [2.0, 1.5];

/// The outcome of a packet.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Its rays are not coherent; none has been traced.
    Refused,
    /// All rays are traced.
    Worthwhile,
    /// All rays are traced, but another kernel would have been as fast.
    Dear,
}

/// A packet and its stack.
pub(super) struct Packet {
    walk: PacketWalk,
    boxes: BoxStack,
    placed: InstancePacket,
}

impl Packet {
    /// Creates a packet for queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        Self { walk: PacketWalk::new(), boxes: BoxStack::new(bvh), placed: InstancePacket::new() }
    }

    /// Traces the rays from `first` on, at most [`RAYS`], if they are coherent.
    #[inline(always)]
    fn trace<L: Lanes, A: HitSink>(
        &mut self,
        bvh: &Bvh,
        rays: &Rays,
        first: usize,
        count: usize,
        keys: &mut TraversalStack,
        sink: &mut A,
    ) -> Verdict {
        let width = L::Queue::WIDTH;
        let Some(root) = bvh.root else { return Verdict::Refused };
        let scene = PacketScene { bvh, filter: rays.filter(first) };
        self.boxes.visits = 0;
        let walk = &mut self.walk;
        walk.rays.load::<L::Queue>(rays, first, count);
        let mut pending = walk.rays.pending::<L::Queue>(count);
        for pass in 0..PASSES {
            let Some(active) = self.walk.rays.next_pass::<L::Queue>(&mut pending) else { break };
            let beam = Beam::around::<L::Queue>(&self.walk.rays, &active, &root);
            let beam = beam.filter(|_| active.count() >= FEWEST);
            match beam {
                Some(beam) if beam.apex.is_some() => self.pass::<L, A, true>(scene, active, &beam, keys),
                Some(beam) => self.pass::<L, A, false>(scene, active, &beam, keys),
                // Nothing has been done yet, and the caller has a better kernel.
                None if pass == 0 => return Verdict::Refused,
                None => self.walk.one_by_one::<L, A>(scene, active, width, keys),
            }
        }
        self.walk.one_by_one::<L, A>(scene, pending, width, keys);
        sink.write_all(first, &self.walk.rays.hits(count));
        if self.boxes.visits as f32 > DEAR[usize::from(A::ANY)] * count as f32 {
            Verdict::Dear
        } else {
            Verdict::Worthwhile
        }
    }

    /// Traces a pass through the world's tree.
    #[inline(always)]
    fn pass<L: Lanes, A: HitSink, const APEX: bool>(
        &mut self,
        scene: PacketScene,
        active: Active,
        beam: &Beam,
        keys: &mut TraversalStack,
    ) {
        let Some(root) = scene.bvh.root else { return };
        let Self { walk, boxes, placed } = self;
        let planes = [root.bounds.min.to_array(), root.bounds.max.to_array()];
        let groups = walk.enter::<L::Queue, APEX>(&active, active.groups, &planes, beam);
        let (placed, child, sink) = (Some(placed), root.child, PhantomData::<A>);
        L::outlined(Pass::<A, APEX> { walk, boxes, placed, scene, active, beam, child, groups, keys, sink });
    }
}
