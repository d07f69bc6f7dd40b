//! Packets in instances: those rays that enter an instance are transformed to its space, packed together, and traced
//! through its tree as a packet of their own.

use std::marker::PhantomData;

use super::beam::Beam;
use super::rays::{Active, GROUPS, PacketColumn, RAYS, SetBits};
use super::scene::PacketScene;
use super::walk::{BoxStack, PacketWalk, Pass};
use super::{FEWEST, PASSES};
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::is_better;
use crate::bvh::kernels::subtree::SubtreeEntry;
use crate::bvh::layout::Child;
use crate::math::Hit;
use crate::simd::{Float, Kernel, Lanes, TraversalStack};

/// Rays in an instance's space.
pub struct InstancePacket {
    walk: PacketWalk,
    /// The index of each ray in the outer packet.
    places: PacketColumn<u32>,
}

impl InstancePacket {
    /// A packet without rays.
    pub fn new() -> Self {
        Self { walk: PacketWalk::new(), places: PacketColumn([0; RAYS]) }
    }
}

/// Traces the rays of a packet that enter an instance, as a kernel. Every hit in it must count.
pub struct InstanceWalk<'q, 'a, A> {
    pub placed: &'q mut InstancePacket,
    /// The outer packet, at the instance's box.
    pub outer: &'q mut PacketWalk,
    pub boxes: &'q mut BoxStack,
    pub scene: PacketScene<'a>,
    /// The instance.
    pub child: Child,
    pub groups: u32,
    /// The active rays; finished rays are removed.
    pub active: &'q mut Active,
    pub keys: &'q mut TraversalStack,
    pub sink: PhantomData<A>,
}

impl<A: HitSink> Kernel for InstanceWalk<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let instance = &self.scene.bvh.instances[self.child.index()];
        let of_packet = (&self.outer.rays, &self.outer.near);
        let InstancePacket { walk, places } = &mut *self.placed;
        let count = walk.rays.take_to::<L::Queue>(instance, of_packet, (self.groups, self.active), places);
        let mut pending = walk.rays.pending::<L::Queue>(count);
        for _ in 0..PASSES {
            let rays = &self.placed.walk.rays;
            let Some(active) = rays.next_pass::<L::Queue>(&mut pending) else { break };
            let beam = Beam::around::<L::Queue>(rays, &active, &instance.root);
            match beam.filter(|_| active.count() >= FEWEST) {
                Some(beam) if beam.apex.is_some() => self.pass::<L, true>(active, &beam),
                Some(beam) => self.pass::<L, false>(active, &beam),
                None => self.one_by_one::<L>(&active),
            }
        }
        self.one_by_one::<L>(&pending);
        for place in 0..count {
            self.write::<L>(place);
        }
    }
}

impl<A: HitSink> InstanceWalk<'_, '_, A> {
    /// Traces a pass through the instance's tree.
    #[inline(always)]
    fn pass<L: Lanes, const APEX: bool>(&mut self, active: Active, beam: &Beam) {
        let child = self.scene.bvh.instances[self.child.index()].root.child;
        let walk = &mut self.placed.walk;
        walk.near = walk.rays.floor;
        let visits = self.boxes.visits;
        L::outlined(Pass::<A, APEX> {
            walk,
            boxes: &mut *self.boxes,
            placed: None,
            scene: self.scene,
            active,
            beam,
            child,
            groups: active.groups,
            keys: &mut *self.keys,
            sink: self.sink,
        });
        self.boxes.visits = visits;
    }

    /// Traces rays with the single-ray kernel.
    #[inline(always)]
    fn one_by_one<L: Lanes>(&mut self, rest: &Active) {
        let width = L::Queue::WIDTH;
        for group in SetBits(rest.groups) {
            for lane in SetBits(rest.lanes[group % GROUPS]) {
                let place = (group * width + lane) % RAYS;
                let ray = self.placed.places.0[place] as usize % RAYS;
                let start = SubtreeEntry { near: self.placed.walk.rays.floor.0[place], child: self.child };
                if self.outer.single::<L, A>(self.scene, ray, start, self.keys) {
                    self.active.remove(ray / width % GROUPS, 1 << (ray % width));
                }
            }
        }
    }

    /// Writes a ray's hit to the outer packet.
    #[inline(always)]
    fn write<L: Lanes>(&mut self, place: usize) {
        let found = self.placed.walk.rays.best(place);
        if found.is_miss() {
            return;
        }
        let ray = self.placed.places.0[place] as usize % RAYS;
        let best = &mut self.outer.rays;
        if A::ANY {
            (best.t.0[ray], best.primitive.0[ray]) = (-1.0, found.primitive);
            self.active.remove(ray / L::Queue::WIDTH % GROUPS, 1 << (ray % L::Queue::WIDTH));
            return;
        }
        let found = Hit { instance: self.child.index() as u32, ..found };
        if is_better(&found, &best.best(ray)) {
            best.put_best(ray, &found);
        }
    }
}
