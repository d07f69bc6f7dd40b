//! The traversal of a tree by a packet.

use std::marker::PhantomData;

use super::beam::Beam;
use super::instance::{InstancePacket, InstanceWalk};
use super::rays::{Active, GROUPS, PacketColumn, PacketRays, RAYS, SetBits};
use super::scene::{InGroup, OfGroup, PacketScene};
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::better_in_lanes;
use crate::bvh::intersect::ray::RaySlabs;
use crate::bvh::intersect::sphere;
use crate::bvh::intersect::triangle::{self, AcceptedRange, BlockHits};
use crate::bvh::kernels::subtree::SubtreeEntry;
use crate::bvh::kernels::traverse::{Subtree, start};
use crate::bvh::layout::sidedness::{PrimitiveCandidate, PrimitiveRef};
use crate::bvh::layout::{BLOCK, Bvh, Child, ChildKind, SphereBlock, TriangleBlock, WIDTH};
use crate::math::NONE;
use crate::simd::sixteen::slot;
use crate::simd::{Float, Int, Kernel, Lanes, Mask, Sixteen, TraversalStack};

/// Fewer rays traverse an instance one by one.
const FEWEST_INSIDE: u32 = 16;

/// Rays that traverse a tree together.
pub struct PacketWalk {
    pub rays: PacketRays,
    /// The entry distances of the box that is being visited; NaN for rays that miss it.
    pub near: PacketColumn<f32>,
}

/// The stack of boxes that are still to be visited.
pub struct BoxStack {
    stack: Vec<BoxEntry>,
    top: usize,
    /// The number of boxes of the world's tree that were tested for the packet so far.
    pub visits: usize,
}

/// A box that the beam meets.
#[derive(Clone, Copy, Default)]
struct BoxEntry {
    /// The child word of the box.
    child: u32,
    /// The node that holds the box, and the slot of the box.
    node: u32,
    slot: u32,
    /// The groups that reach the parent.
    groups: u32,
}

impl BoxStack {
    /// Creates a stack for queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        let trees = if bvh.instances.is_empty() { 1 } else { 2 };
        Self { stack: vec![BoxEntry::default(); trees * bvh.stack_size + WIDTH], top: 0, visits: 0 }
    }

    /// Pushes the children of a node that the beam meets, the nearest on top; for any-hit queries, the farthest. Shadow
    /// rays start among surfaces that they leave behind, and converge at a light: what blocks one of them near it
    /// blocks many. (Million rays a second, farthest and nearest first: a sun in the atrium 37 and 21, shadows on 70
    /// thousand triangles 40 and 34, other classes 0.9 to 1.15.)
    #[inline(always)]
    fn open<L: Lanes, A: HitSink>(&mut self, bvh: &Bvh, index: usize, groups: u32, beam: &Beam) {
        let node = &bvh.nodes[index];
        let bits = beam.meets::<L::Node>(node);
        // The first one pushed is visited last.
        let octant = if A::ANY { beam.octant() } else { beam.octant() ^ 7 };
        let order = node.order[octant as usize % 8];
        for place in SetBits(<L::Node as Sixteen>::in_order(bits, order)) {
            let slot = slot(order, place);
            let child = node.child[slot];
            bvh.fetch(Child(child));
            self.stack[self.top] = BoxEntry { child, node: index as u32, slot: slot as u32, groups };
            self.top += 1;
        }
    }
}

/// A pass of rays through a tree, as a kernel.
pub struct Pass<'q, 'a, A, const APEX: bool> {
    pub walk: &'q mut PacketWalk,
    pub boxes: &'q mut BoxStack,
    /// The buffers for rays in an instance; `None` within an instance, which holds no other.
    pub placed: Option<&'q mut InstancePacket>,
    pub scene: PacketScene<'a>,
    pub active: Active,
    pub beam: &'q Beam,
    /// The part of the tree to traverse, and the groups that enter it.
    pub child: Child,
    pub groups: u32,
    pub keys: &'q mut TraversalStack,
    pub sink: PhantomData<A>,
}

impl<A: HitSink, const APEX: bool> Kernel for Pass<'_, '_, A, APEX> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { walk, boxes, mut placed, scene, mut active, beam, mut child, mut groups, keys, sink } =
            self;
        let bvh = scene.bvh;
        let bottom = boxes.top;
        loop {
            if groups != 0 {
                match child.kind() {
                    ChildKind::Node => boxes.open::<L, A>(bvh, child.index(), groups, beam),
                    ChildKind::Triangles => {
                        let block = &bvh.triangles[child.index()];
                        let done = walk.test::<L, A, APEX>(scene, block, groups, &mut active, beam);
                        if done {
                            break;
                        }
                    }
                    ChildKind::Spheres => {
                        let block = &bvh.spheres[child.index()];
                        if walk.test_spheres::<L, A>(scene, block, groups, &mut active, beam) {
                            break;
                        }
                    }
                    ChildKind::Instance => {
                        let active = &mut active;
                        let together = !bvh.conditional
                            && placed.is_some()
                            && walk.entered::<L::Queue>(groups, active) >= FEWEST_INSIDE;
                        if together && let Some(placed) = placed.as_deref_mut() {
                            L::outlined(InstanceWalk {
                                placed,
                                outer: &mut *walk,
                                boxes: &mut *boxes,
                                scene,
                                child,
                                groups,
                                active,
                                keys: &mut *keys,
                                sink,
                            });
                        } else {
                            walk.leave_to_single::<L, A>(scene, child, groups, active, keys);
                        }
                        if active.groups == 0 {
                            break;
                        }
                    }
                }
            }
            if boxes.top == bottom {
                break;
            }
            boxes.top -= 1;
            boxes.visits += 1;
            let entry = boxes.stack[boxes.top];
            let node = &bvh.nodes[entry.node as usize];
            let slot = entry.slot as usize % WIDTH;
            // (`map` is not inlined here.)
            let mut planes = [[0.0; 3]; 2];
            for (axis, sides) in node.planes.iter().enumerate() {
                (planes[0][axis], planes[1][axis]) = (sides[0][slot], sides[1][slot]);
            }
            groups = walk.enter::<L::Queue, APEX>(&active, entry.groups & active.groups, &planes, beam);
            child = Child(entry.child);
        }
        boxes.top = bottom;
    }
}

impl PacketWalk {
    /// A packet with all values zero.
    pub fn new() -> Self {
        Self { rays: PacketRays::new(), near: PacketColumn([0.0; RAYS]) }
    }

    /// The number of active rays that enter the box that is being visited.
    #[inline(always)]
    fn entered<F: Float>(&self, groups: u32, active: &Active) -> u32 {
        let mut count = 0;
        for group in SetBits(groups) {
            let group = group % GROUPS;
            let entered = F::load(&self.near.0[group * F::WIDTH..]).ge(F::zero());
            count += (entered.bits() & active.lanes[group]).count_ones();
        }
        count
    }

    /// Finds the groups with a ray that enters a box; stores the distances in `near`.
    #[inline(always)]
    pub fn enter<F: Float, const APEX: bool>(
        &mut self,
        active: &Active,
        groups: u32,
        planes: &[[f32; 3]; 2],
        beam: &Beam,
    ) -> u32 {
        // The planes in the order in which the rays meet them, relative to the apex if there is one.
        let apex = if APEX { beam.apex.unwrap_or([0.0; 3]) } else { [0.0; 3] };
        let (mut near_planes, mut far_planes) = ([F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            let side = beam.sides[axis] & 1;
            let (near, far) = (planes[side][axis], planes[1 - side][axis]);
            near_planes[axis] = F::splat(if APEX { apex[axis] - near } else { near });
            far_planes[axis] = F::splat(if APEX { apex[axis] - far } else { far });
        }
        let mut entered = 0;
        for group in SetBits(groups) {
            let group = group % GROUPS;
            let at = group * F::WIDTH;
            let (mut near, mut far) = (F::load(&self.rays.floor.0[at..]), F::load(&self.rays.t.0[at..]));
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
            // A lane that does not enter gets NaN, for which every comparison is false.
            let inside = near.le(far);
            F::select(inside, near, F::splat(f32::NAN)).store(&mut self.near.0[at..]);
            entered |= u32::from(inside.bits() & active.lanes[group] != 0) << group;
        }
        entered
    }

    /// Tests a block against the rays that enter it; true if all rays of the pass are finished.
    #[inline(always)]
    fn test<L: Lanes, A: HitSink, const APEX: bool>(
        &mut self,
        scene: PacketScene,
        block: &TriangleBlock,
        groups: u32,
        active: &mut Active,
        beam: &Beam,
    ) -> bool {
        let met = beam.meets_triangles::<L::Block>(block);
        // Corners with permuted axes, relative to the apex if there is one.
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
        for place in SetBits(met) {
            let place = place % BLOCK;
            let todo = groups & active.groups;
            for group in SetBits(todo) {
                let group = group % GROUPS;
                self.test_one::<L::Queue, A, APEX>(scene, (block, place), &corners, group, active, beam);
            }
            if A::ANY && active.groups == 0 {
                return true;
            }
        }
        false
    }

    /// Tests one triangle against one group of rays.
    #[inline(always)]
    fn test_one<F: Float, A: HitSink, const APEX: bool>(
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
        let asked = AcceptedRange {
            lanes: F::Mask::from_bits(active.lanes[group]),
            t_min: F::load(&self.rays.t_min.0[at..]),
            t_max: F::load(&self.rays.t.0[at..]),
        };
        let exact = OfGroup { rays: &self.rays, group, block, place };
        let hits = triangle::intersect_rays(seen, &shear, &asked, &exact);
        if hits.mask.any() {
            self.take::<F, A>(
                &hits,
                PrimitiveCandidate::triangle(PrimitiveRef(block.words[place])),
                group,
                active,
                scene,
            );
        }
    }

    /// Tests a block of spheres against the rays that enter it; true if all rays of the pass are finished.
    #[inline(always)]
    fn test_spheres<L: Lanes, A: HitSink>(
        &mut self,
        scene: PacketScene,
        block: &SphereBlock,
        groups: u32,
        active: &mut Active,
        beam: &Beam,
    ) -> bool {
        for place in SetBits(beam.meets_spheres::<L::Block>(block)) {
            let place = place % BLOCK;
            for group in SetBits(groups & active.groups) {
                let group = group % GROUPS;
                let (origin, direction) = self.rays.lines::<L::Queue>(group);
                let t_min = L::Queue::load(&self.rays.t_min.0[group * L::Queue::WIDTH..]);
                let lanes = <L::Queue as Float>::Mask::from_bits(active.lanes[group]);
                let hits = sphere::intersect_rays(block.sphere(place), origin, direction, t_min, lanes);
                if hits.mask.any() {
                    let candidate = PrimitiveCandidate::sphere(PrimitiveRef(block.words[place]));
                    self.take::<L::Queue, A>(&hits, candidate, group, active, scene);
                }
            }
        }
        A::ANY && active.groups == 0
    }

    /// Takes those of a group's hits with a primitive that are better than the best ones so far.
    #[inline(always)]
    fn take<F: Float, A: HitSink>(
        &mut self,
        hits: &BlockHits<F>,
        candidate: PrimitiveCandidate,
        group: usize,
        active: &mut Active,
        scene: PacketScene,
    ) {
        let at = group * F::WIDTH;
        let (near, best) = (F::load(&self.near.0[at..]), F::load(&self.rays.t.0[at..]));
        let t_min = F::load(&self.rays.t_min.0[at..]);
        let id = F::Int::splat(candidate.id);
        let before = (best, F::Int::load(&self.rays.primitive.0[at..]));
        let of_group = InGroup { first: scene.filter, at };
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

    /// Traces an instance ray by ray.
    #[inline(always)]
    fn leave_to_single<L: Lanes, A: HitSink>(
        &mut self,
        scene: PacketScene,
        child: Child,
        groups: u32,
        active: &mut Active,
        keys: &mut TraversalStack,
    ) {
        for group in SetBits(groups) {
            let group = group % GROUPS;
            let lanes = active.lanes[group];
            for lane in SetBits(lanes) {
                let i = (group * L::Queue::WIDTH + lane) % RAYS;
                if self.near.0[i] >= 0.0
                    && self.single::<L, A>(scene, i, SubtreeEntry { near: self.near.0[i], child }, keys)
                {
                    active.remove(group, 1 << lane);
                }
            }
        }
    }

    /// Traces rays one by one.
    #[inline(always)]
    pub fn one_by_one<L: Lanes, A: HitSink>(
        &mut self,
        scene: PacketScene,
        rest: Active,
        width: usize,
        keys: &mut TraversalStack,
    ) {
        let groups = rest.groups;
        for group in SetBits(groups) {
            let group = group % GROUPS;
            let lanes = rest.lanes[group];
            for lane in SetBits(lanes) {
                let i = (group * width + lane) % RAYS;
                let ray = self.rays.ray(i);
                if let Some(start) = start(scene.bvh, &ray, &RaySlabs::new(&ray)) {
                    self.single::<L, A>(scene, i, start, keys);
                }
            }
        }
    }

    /// Traces one ray through a part of the tree; true if an any-hit ray is finished.
    #[inline(always)]
    pub fn single<L: Lanes, A: HitSink>(
        &mut self,
        scene: PacketScene,
        i: usize,
        start: SubtreeEntry,
        keys: &mut TraversalStack,
    ) -> bool {
        let mut best = self.rays.best(i);
        let (ray, sink) = (&self.rays.ray(i), PhantomData::<A>);
        let PacketScene { bvh, filter } = scene;
        let filter = filter.after(i);
        let done = L::outlined(Subtree { bvh, ray, filter, start, keys, best: &mut best, sink });
        if done {
            best.t = -1.0;
        }
        self.rays.put_best(i, &best);
        done
    }
}
