//! Packets: the kernel for rays that run side by side.
//!
//! Up to [`RAYS`] rays go through the tree together, with one stack. A *beam* of six planes
//! holds them all: four that bound where the rays are, as straight lines between the ends
//! of the beam (so that rays from one point, to one point, and side by side are bounded
//! equally well), and its two ends. The beam is tested against a node's 16 children at
//! once; what it meets is tested ray by ray, with the slabs of the single-ray kernel, when
//! it comes off the stack. At a leaf the beam leaves out triangles, and the others, as all
//! spheres, meet the rays, a ray a lane, in the canonical test. (Large packets after Overbeck,
//! Ramamoorthi and Mark, "Large ray packets for real-time Whitted ray tracing", 2008; the
//! beam is Reshetov's frustum, "Multi-level ray tracing algorithm", 2005, with ends.)
//!
//! Rays of a packet whose directions have other signs or another longest axis than those of
//! the first one are left to a pass of their own.

mod beam;
mod rays;
mod scene;

use std::marker::PhantomData;

use super::Rays;
use super::answers::Answers;
use super::layout::{BLOCK, Bvh, Child, ChildKind, SphereBlock, TriangleBlock, WIDTH};
use super::leaf::better_in_lanes;
use super::presence::{Candidate, Word};
use super::ray::Slabs;
use super::sphere;
use super::traverse::{self, NodeStack, Subtree};
use super::triangle::{self, Asked, BlockHits};
use crate::math::{Hit, NONE};
use crate::simd::sixteen::key;
use crate::simd::{Float, Int, Lanes, Mask};
use beam::Beam;
use rays::{Active, Bits, GROUPS, PacketColumn, PacketRays};
pub(super) use rays::{LEAST_WIDTH, RAYS};
pub(super) use scene::PacketQuery;
use scene::{InGroup, OfGroup, PacketScene};

/// Passes over a packet before the rest of it is left to the single-ray kernel.
const PASSES: usize = 4;
/// A pass with fewer rays is not worth it.
const FEWEST: u32 = 12;

/// Boxes a ray from which on a packet costs more than a stream of its rays would, for the nearest hit
/// and for any: the mesh is finer than the rays are dense then, and each box is there for few of them.
/// (Measured in million rays a second. Shadow rays, with a limit of 0.9, 1.3, 1.8 and none: on a million
/// triangles 7.6, 8.2, 8.8, 9.0; on 10 million 6.1, 6.1, 5.6, 4.8; with 1.5 and none in another run 8.6 and 8.9, 5.9 and
/// 4.6. Camera rays on 10 million: 5.1 with 1, 5.7 with 2 and with none. `scenes/terrain.ron`, where mirrors are in it, is as fast with 2 as with 1.)
const DEAR: [f32; 2] = [2.0, 1.5];

/// What became of a packet.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Its rays do not run side by side; nothing has been answered.
    Refused,
    /// All is answered.
    Worthwhile,
    /// All is answered, but another kernel would have been as fast.
    Dear,
}

/// A packet and its stack.
pub(super) struct Packet {
    rays: PacketRays,
    /// Where a ray enters the box that is being visited; NaN if it does not.
    near: PacketColumn<f32>,
    stack: Vec<BoxEntry>,
    /// Boxes tested for the packet so far.
    visits: usize,
}

/// A box that the beam meets.
#[derive(Clone, Copy, Default)]
struct BoxEntry {
    /// What is in it.
    child: u32,
    /// Its node, and its place there.
    node: u32,
    slot: u32,
    /// The groups that reach its parent.
    groups: u32,
}

impl Packet {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        let stack = vec![BoxEntry::default(); bvh.stack_size + WIDTH];
        Self { rays: PacketRays::new(), near: PacketColumn([0.0; RAYS]), stack, visits: 0 }
    }

    /// Answers the rays from `first` on, at most [`RAYS`], if they run side by side.
    #[inline(always)]
    fn trace<L: Lanes, A: Answers>(
        &mut self,
        bvh: &Bvh,
        rays: &Rays,
        first: usize,
        count: usize,
        keys: &mut NodeStack,
        answers: &mut A,
    ) -> Verdict {
        let width = L::Queue::WIDTH;
        let Some(root) = bvh.root else { return Verdict::Refused };
        let scene = PacketScene { bvh, asker: rays.asker(first) };
        self.visits = 0;
        self.rays.load::<L::Queue>(rays, first, count);
        let mut waiting = Active::NONE;
        for (group, lanes) in waiting.lanes.iter_mut().enumerate().take(count.div_ceil(width)) {
            *lanes = self.rays.alive::<L::Queue>(group * width, count - group * width);
            waiting.groups |= u32::from(*lanes != 0) << group;
        }
        for pass in 0..PASSES {
            let Some(active) = self.rays.next_pass::<L::Queue>(&mut waiting) else { break };
            let beam = Beam::around::<L::Queue>(&self.rays, &active, &root);
            let beam = beam.filter(|_| active.count() >= FEWEST);
            match beam {
                Some(beam) if beam.apex.is_some() => self.walk::<L, A, true>(scene, active, &beam, keys),
                Some(beam) => self.walk::<L, A, false>(scene, active, &beam, keys),
                // Nothing has been done yet, and the caller has a better way.
                None if pass == 0 => return Verdict::Refused,
                None => self.one_by_one::<L, A>(scene, active, width, keys),
            }
        }
        self.one_by_one::<L, A>(scene, waiting, width, keys);
        answers.put_all(first, &self.rays.hits(count));
        if self.visits as f32 > DEAR[usize::from(A::ANY)] * count as f32 {
            Verdict::Dear
        } else {
            Verdict::Worthwhile
        }
    }

    /// Takes a pass through the tree.
    #[inline(always)]
    fn walk<L: Lanes, A: Answers, const APEX: bool>(
        &mut self,
        scene: PacketScene,
        mut active: Active,
        beam: &Beam,
        keys: &mut NodeStack,
    ) {
        let bvh = scene.bvh;
        let Some(root) = bvh.root else { return };
        let planes = [root.bounds.min.to_array(), root.bounds.max.to_array()];
        let mut groups = self.enter::<L::Queue, APEX>(&active, active.groups, &planes, beam);
        let mut child = root.child;
        let mut top = 0;
        loop {
            if groups != 0 {
                match child.kind() {
                    ChildKind::Node => self.open::<L>(bvh, child.index(), groups, beam, &mut top),
                    ChildKind::Triangles => {
                        let block = &bvh.triangles[child.index()];
                        let done = self.test::<L, A, APEX>(scene, block, groups, &mut active, beam);
                        if done {
                            return;
                        }
                    }
                    ChildKind::Spheres => {
                        let block = &bvh.spheres[child.index()];
                        if self.test_spheres::<L::Queue, A>(scene, block, groups, &mut active) {
                            return;
                        }
                    }
                    ChildKind::Instance => {
                        self.leave_to_single::<L, A>(scene, child, groups, &mut active, keys);
                        if active.groups == 0 {
                            return;
                        }
                    }
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            self.visits += 1;
            let entry = self.stack[top];
            let node = &bvh.nodes[entry.node as usize];
            let slot = entry.slot as usize % WIDTH;
            // (`map` is not inlined here.)
            let mut planes = [[0.0; 3]; 2];
            for (axis, sides) in node.planes.iter().enumerate() {
                (planes[0][axis], planes[1][axis]) = (sides[0][slot], sides[1][slot]);
            }
            groups = self.enter::<L::Queue, APEX>(&active, entry.groups & active.groups, &planes, beam);
            child = Child(entry.child);
        }
    }

    /// Which groups have a ray that enters a box; `near` holds where.
    #[inline(always)]
    fn enter<F: Float, const APEX: bool>(
        &mut self,
        active: &Active,
        groups: u32,
        planes: &[[f32; 3]; 2],
        beam: &Beam,
    ) -> u32 {
        // The planes as the rays meet them; seen from the apex if there is one.
        let apex = if APEX { beam.apex.unwrap_or([0.0; 3]) } else { [0.0; 3] };
        let (mut near_planes, mut far_planes) = ([F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            let side = beam.sides[axis] & 1;
            let (near, far) = (planes[side][axis], planes[1 - side][axis]);
            near_planes[axis] = F::splat(if APEX { apex[axis] - near } else { near });
            far_planes[axis] = F::splat(if APEX { apex[axis] - far } else { far });
        }
        let mut entered = 0;
        for group in Bits(groups) {
            let group = group % GROUPS;
            let at = group * F::WIDTH;
            let (mut near, mut far) = (F::load(&self.rays.t_min.0[at..]), F::load(&self.rays.t.0[at..]));
            for axis in 0..3 {
                let near_scale = F::load(&self.rays.near_scale[axis].0[at..]);
                let far_scale = F::load(&self.rays.far_scale[axis].0[at..]);
                let (mut near_plane, mut far_plane) = (near_planes[axis], far_planes[axis]);
                if !APEX {
                    let origin = F::load(&self.rays.origin[axis].0[at..]);
                    (near_plane, far_plane) = (origin - near_plane, origin - far_plane);
                }
                near = (near_plane * near_scale).max(near);
                far = (far_plane * far_scale).min(far);
            }
            // A lane that does not enter gets no distance, with which no comparison is true.
            let inside = near.le(far);
            F::select(inside, near, F::splat(f32::NAN)).store(&mut self.near.0[at..]);
            entered |= u32::from(inside.bits() & active.lanes[group] != 0) << group;
        }
        entered
    }

    /// Puts the children of a node that the beam meets on the stack, the nearest on top.
    #[inline(always)]
    fn open<L: Lanes>(&mut self, bvh: &Bvh, index: usize, groups: u32, beam: &Beam, top: &mut usize) {
        let node = &bvh.nodes[index];
        let bits = beam.meets::<L::Node>(node);
        let depth = &node.planes[beam.axes[2] % 3][beam.sides[beam.axes[2] % 3] & 1];
        let sign = if beam.sides[beam.axes[2] % 3] == 0 { 1.0 } else { -1.0 };
        let mut order = [0u64; WIDTH];
        let mut count = 0;
        for slot in Bits(bits) {
            let slot = slot % WIDTH;
            let found = key(Float::max(depth[slot] * sign - beam.start(), 0.0), slot as u32);
            let mut place = count;
            while place > 0 && order[(place - 1) % WIDTH] < found {
                order[place % WIDTH] = order[(place - 1) % WIDTH];
                place -= 1;
            }
            order[place % WIDTH] = found;
            count += 1;
        }
        for found in &order[..count] {
            let slot = *found as u32;
            let child = node.child[slot as usize % WIDTH];
            bvh.fetch(Child(child));
            self.stack[*top] = BoxEntry { child, node: index as u32, slot, groups };
            *top += 1;
        }
    }

    /// Tests a block against the rays that enter it; whether all rays of the pass are done.
    #[inline(always)]
    fn test<L: Lanes, A: Answers, const APEX: bool>(
        &mut self,
        scene: PacketScene,
        block: &TriangleBlock,
        groups: u32,
        active: &mut Active,
        beam: &Beam,
    ) -> bool {
        let met = beam.meets_triangles::<L::Block>(block);
        // Corners with renamed axes, seen from the apex if there is one.
        let mut corners = [[[0.0; BLOCK]; 3]; 3];
        for (axis, place) in beam.axes.into_iter().enumerate() {
            let apex = L::Block::splat(if APEX { beam.apex.unwrap_or([0.0; 3])[place % 3] } else { 0.0 });
            for (corner, values) in block.vertex[place % 3].iter().enumerate() {
                for at in (0..BLOCK).step_by(L::Block::WIDTH) {
                    let value = L::Block::load(&values[at..]);
                    let value = if APEX { value - apex } else { value };
                    value.store(&mut corners[corner][axis][at..]);
                }
            }
        }
        for place in Bits(met) {
            let place = place % BLOCK;
            let todo = groups & active.groups;
            for group in Bits(todo) {
                let group = group % GROUPS;
                self.test_one::<L::Queue, A, APEX>(scene, (block, place), &corners, group, active, beam);
            }
            if A::ANY && active.groups == 0 {
                return true;
            }
        }
        false
    }

    /// One triangle against one group of rays.
    #[inline(always)]
    fn test_one<F: Float, A: Answers, const APEX: bool>(
        &mut self,
        scene: PacketScene,
        (block, place): (&TriangleBlock, usize),
        corners: &[[[f32; BLOCK]; 3]; 3],
        group: usize,
        active: &mut Active,
        beam: &Beam,
    ) {
        let at = group * F::WIDTH;
        let shear = [
            F::load(&self.rays.shear[0].0[at..]),
            F::load(&self.rays.shear[1].0[at..]),
            F::load(&self.rays.shear[2].0[at..]),
        ];
        let mut seen = [[F::zero(); 3]; 3];
        for (seen, corner) in seen.iter_mut().zip(corners) {
            for ((seen, corner), axis) in seen.iter_mut().zip(corner).zip(beam.axes) {
                *seen = F::splat(corner[place]);
                if !APEX {
                    *seen = *seen - F::load(&self.rays.origin[axis % 3].0[at..]);
                }
            }
        }
        let asked = Asked {
            lanes: F::Mask::from_bits(active.lanes[group]),
            t_min: F::load(&self.rays.t_min.0[at..]),
            t_max: F::load(&self.rays.t.0[at..]),
        };
        let exact = OfGroup { rays: &self.rays, group, block, place };
        let hits = triangle::intersect_rays(seen, &shear, &asked, &exact);
        if hits.mask.any() {
            self.take::<F, A>(&hits, Candidate::triangle(Word(block.words[place])), group, active, scene);
        }
    }

    /// Tests a block of spheres against the rays that enter it; whether all rays of the pass are done.
    #[inline(always)]
    fn test_spheres<F: Float, A: Answers>(
        &mut self,
        scene: PacketScene,
        block: &SphereBlock,
        groups: u32,
        active: &mut Active,
    ) -> bool {
        for (place, word) in block.words.into_iter().enumerate() {
            if !Word(word).is_used() {
                break;
            }
            for group in Bits(groups & active.groups) {
                let group = group % GROUPS;
                let (origin, direction) = self.rays.lines::<F>(group);
                let t_min = F::load(&self.rays.t_min.0[group * F::WIDTH..]);
                let lanes = F::Mask::from_bits(active.lanes[group]);
                let hits = sphere::intersect_rays(block.sphere(place), origin, direction, t_min, lanes);
                if hits.mask.any() {
                    let candidate = Candidate::sphere(Word(word));
                    self.take::<F, A>(&hits, candidate, group, active, scene);
                }
            }
        }
        A::ANY && active.groups == 0
    }

    /// Takes a group's hits with a primitive that are better than those before.
    #[inline(always)]
    fn take<F: Float, A: Answers>(
        &mut self,
        hits: &BlockHits<F>,
        candidate: Candidate,
        group: usize,
        active: &mut Active,
        scene: PacketScene,
    ) {
        let at = group * F::WIDTH;
        let (near, best) = (F::load(&self.near.0[at..]), F::load(&self.rays.t.0[at..]));
        let t_min = F::load(&self.rays.t_min.0[at..]);
        let id = F::Int::splat(candidate.id);
        let before = (best, F::Int::load(&self.rays.primitive.0[at..]));
        let of_group = InGroup { first: scene.asker, at };
        let (t, better) = better_in_lanes(hits, candidate, near, t_min, before, &of_group);
        if !better.any() {
            return;
        }
        if A::ANY {
            F::select(better, F::splat(-1.0), best).store(&mut self.rays.t.0[at..]);
            active.remove(group, better.bits());
        } else {
            F::select(better, t, best).store(&mut self.rays.t.0[at..]);
            F::select(better, hits.u, F::load(&self.rays.u.0[at..])).store(&mut self.rays.u.0[at..]);
            F::select(better, hits.v, F::load(&self.rays.v.0[at..])).store(&mut self.rays.v.0[at..]);
            let none = F::Int::splat(NONE);
            F::Int::select(better, none, F::Int::load(&self.rays.instance.0[at..]))
                .store(&mut self.rays.instance.0[at..]);
        }
        F::Int::select(better, id, F::Int::load(&self.rays.primitive.0[at..]))
            .store(&mut self.rays.primitive.0[at..]);
    }

    /// Instances, ray by ray.
    #[inline(always)]
    fn leave_to_single<L: Lanes, A: Answers>(
        &mut self,
        scene: PacketScene,
        child: Child,
        groups: u32,
        active: &mut Active,
        keys: &mut NodeStack,
    ) {
        for group in Bits(groups) {
            let group = group % GROUPS;
            let lanes = active.lanes[group];
            for lane in Bits(lanes) {
                let i = (group * L::Queue::WIDTH + lane) % RAYS;
                if self.near.0[i] >= 0.0 && self.single::<L, A>(scene, i, key(self.near.0[i], child.0), keys)
                {
                    active.remove(group, 1 << lane);
                }
            }
        }
    }

    /// What goes its own way.
    #[inline(always)]
    fn one_by_one<L: Lanes, A: Answers>(
        &mut self,
        scene: PacketScene,
        rest: Active,
        width: usize,
        keys: &mut NodeStack,
    ) {
        let groups = rest.groups;
        for group in Bits(groups) {
            let group = group % GROUPS;
            let lanes = rest.lanes[group];
            for lane in Bits(lanes) {
                let i = (group * width + lane) % RAYS;
                let ray = self.rays.ray(i);
                if let Some(start) = traverse::start(scene.bvh, &ray, &Slabs::new(&ray)) {
                    self.single::<L, A>(scene, i, start, keys);
                }
            }
        }
    }

    /// One ray through a part of the tree; whether it is done, since any hit will do.
    #[inline(always)]
    fn single<L: Lanes, A: Answers>(
        &mut self,
        scene: PacketScene,
        i: usize,
        start: u64,
        keys: &mut NodeStack,
    ) -> bool {
        let mut best = Hit {
            t: self.rays.t.0[i],
            u: self.rays.u.0[i],
            v: self.rays.v.0[i],
            primitive: self.rays.primitive.0[i],
            instance: self.rays.instance.0[i],
        };
        let (ray, answers) = (&self.rays.ray(i), PhantomData::<A>);
        let PacketScene { bvh, asker } = scene;
        let asker = asker.after(i);
        let done = L::outlined(Subtree { bvh, ray, asker, start, keys, best: &mut best, answers });
        (self.rays.t.0[i], self.rays.u.0[i], self.rays.v.0[i]) =
            (if done { -1.0 } else { best.t }, best.u, best.v);
        (self.rays.primitive.0[i], self.rays.instance.0[i]) = (best.primitive, best.instance);
        done
    }
}
