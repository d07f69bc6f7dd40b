//! Interleaved rays: the kernel for incoherent rays.
//!
//! A thread traces [`RAYS`] rays together, each with its own stack, in rounds: every ray at a node takes one step
//! through it, every ray at a leaf tests its block, and a finished ray makes room for the next of the queue. The
//! latencies of one ray (a node from memory, a long chain of operations) are hidden by the others; the memory for a
//! ray's next step is prefetched a round ahead. No branch depends on a ray's results: decisions are conditional moves,
//! and the positions of rays are stored in bits. (After "wavefront" scheduling of rays on GPUs; cf. Aila and Laine,
//! "Understanding the efficiency of ray traversal on GPUs", 2009.)

mod ray_slots;
mod two_ray_blocks;

use std::hint::select_unpredictable;
use std::marker::PhantomData;

use super::prepare::{BATCH, Fill, PreparedRays, RayRow};
use super::subtree::{LEAVE_INSTANCE, SubtreeEntry};
use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::{self, LeafContext};
use crate::bvh::intersect::ray::{LocalRay, is_finite, to_local};
use crate::bvh::intersect::sphere;
use crate::bvh::intersect::triangle::Exact;
use crate::bvh::layout::{BLOCK, Bvh, Child, ChildKind, SphereBlock, TriangleBlock};
use crate::math::{Hit, NONE, Ray};
use crate::simd::{Float, Kernel, Lanes, Mask, Sixteen, TraversalStack, opaque};
use ray_slots::{ChildAddresses, RaySlots, take_first};
use two_ray_blocks::{LeafBlock, TwoRayTest};

/// The number of interleaved rays.
const RAYS: usize = 32;
/// The number of stack entries that are checked together.
const BELOW: usize = TraversalStack::FIRST as usize;
/// The child word of a finished ray.
const END: u32 = u32::MAX - 1;

/// A thread's rays and their stacks.
pub(super) struct InterleavedRays {
    rays: Box<[ActiveRay; RAYS]>,
    /// The rows in world space of rays that are in an instance.
    outside: Box<[RayRow; RAYS]>,
    stacks: Box<[TraversalStack; RAYS]>,
    prepared: Box<PreparedRays>,
}

/// [`InterleavedRays::trace`] as a kernel.
pub(super) struct InterleavedQuery<'a, 'r, A> {
    pub interleaved: &'a mut InterleavedRays,
    pub bvh: &'a Bvh,
    pub rays: Rays<'r>,
    pub sink: &'a mut A,
}

impl<A: HitSink> Kernel for InterleavedQuery<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.interleaved.trace::<L, A>(self.bvh, self.rays, self.sink);
    }
}

/// A ray during its traversal.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct ActiveRay {
    row: RayRow,
    /// The child that it is at.
    child: Child,
    /// The number of its stack entries. The entry above these is the ray's current position, or was when it came to
    /// this level.
    top: u32,
    /// Its index in the queue.
    index: u32,
    best: Hit,
    /// The instance that it is in.
    instance: u32,
    /// The lower end of the t range, exclusive.
    t_min: f32,
    /// Maintained only if there are spheres.
    direction: [f32; 3],
}

impl InterleavedRays {
    /// Creates the buffers for queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        // Within an instance, the world's entries stay where they are.
        let trees = if bvh.instances.is_empty() { 1 } else { 2 };
        let capacity = trees * bvh.stack_size + 2;
        let ray = ActiveRay {
            row: RayRow::default(),
            child: Child(END),
            top: 0,
            index: 0,
            best: Hit::MISS,
            instance: NONE,
            t_min: 0.0,
            direction: [0.0; 3],
        };
        Self {
            rays: Box::new([ray; RAYS]),
            outside: Box::new([RayRow::default(); RAYS]),
            stacks: Box::new(std::array::from_fn(|_| TraversalStack::new(capacity, END))),
            prepared: Box::default(),
        }
    }

    /// Traces a queue.
    #[inline(always)]
    fn trace<L: Lanes, A: HitSink>(&mut self, bvh: &Bvh, rays: Rays, sink: &mut A) {
        let memory = ChildAddresses::new(bvh);
        let (interleaved, stacks) = (&mut *self.rays, &mut *self.stacks);
        let mut queue = Queue { bvh, rays, next: 0, prepared: &mut self.prepared };
        let mut places = RaySlots::default();
        for (ray, f) in interleaved.iter_mut().enumerate() {
            queue.refill::<L, A>(ray, f, &mut stacks[ray], sink, &mut places);
        }
        while places.alive != 0 {
            // One step for each ray. (Rays that come to triangles in this round could continue in it, but then finding
            // them would wait for the last step.)
            let [mut todo, triangles, others] = places.take();
            while todo != 0 {
                let ray = take_first(&mut todo);
                let child = interleaved[ray].step::<L, A>(bvh, &mut stacks[ray]);
                memory.send::<A>(&mut places, ray, child);
            }
            let leaves = Leaves { bvh, rays: &queue.rays, memory: &memory };
            leaves.test::<L, A, TriangleBlock>(interleaved, stacks, triangles, &mut places);
            let mut todo = others;
            if !bvh.spheres.is_empty() {
                let spheres = at_spheres(interleaved, others);
                leaves.test::<L, A, SphereBlock>(interleaved, stacks, spheres, &mut places);
                todo &= !spheres;
            }
            while todo != 0 {
                let ray = take_first(&mut todo);
                let f = &mut interleaved[ray];
                if f.child.0 == END {
                    sink.write(f.index as usize, &f.best);
                    queue.refill::<L, A>(ray, f, &mut stacks[ray], sink, &mut places);
                    continue;
                }
                f.change_place::<L, A>(bvh, &queue.rays, &mut stacks[ray], &mut self.outside[ray]);
                memory.send::<A>(&mut places, ray, f.child);
            }
        }
    }
}

impl ActiveRay {
    /// Takes one step through a node, to the first of its children that is entered or to the next stack entry.
    #[inline(always)]
    fn step<L: Lanes, A: HitSink>(&mut self, bvh: &Bvh, stack: &mut TraversalStack) -> Child {
        let below = self.peek::<L, A>(stack);
        let pending = stack.word(below);
        let node = &bvh.nodes[self.child.0 as usize];
        let (near, far) = self.row.slabs().meet_children::<L::Node>(node, self.best.t);
        let (words, nears) = stack.from(self.top);
        let (word, count) = if A::ANY {
            <L::Node as Sixteen>::take_entered(near, far, &node.child, words)
        } else {
            Sixteen::take_in_order(
                near,
                far,
                &node.child,
                node.back_to_front(self.row.octant()),
                nears,
                words,
            )
        };
        let entered = count != 0;
        self.child.0 = select_unpredictable(entered, opaque(word), pending);
        self.top = select_unpredictable(entered, (self.top + count).wrapping_sub(1), below);
        self.child
    }

    /// Runs the canonical test of its block.
    #[inline(always)]
    fn test<L: Lanes, A: HitSink, B: LeafBlock>(&mut self, bvh: &Bvh, rays: &Rays, stack: &TraversalStack) {
        if bvh.conditional || L::Block::WIDTH < BLOCK {
            let near = self.near::<A>(stack);
            L::outlined(FilteredTest { ray: self, near, bvh, rays, sink: PhantomData::<A> });
        } else {
            self.glance::<A, B>(bvh, rays, stack).test::<L::Block, A>(&mut self.best);
        }
    }

    /// The ray at its block.
    #[inline(always)]
    fn glance<'a, A: HitSink, B: LeafBlock>(
        &self,
        bvh: &'a Bvh,
        rays: &'a Rays<'a>,
        stack: &TraversalStack,
    ) -> TwoRayTest<'a, B, RaySource<'a>> {
        let Self { t_min, instance, index, .. } = *self;
        let exact = RaySource { bvh, rays, index, instance };
        let (block, line) = (B::of(bvh, self.child), B::line(&self.row, &self.direction));
        TwoRayTest { block, line, near: self.near::<A>(stack), t_min, instance, exact }
    }

    #[inline(always)]
    fn visit<'a>(&self, bvh: &'a Bvh, rays: &Rays<'a>, near: f32) -> LeafContext<'a> {
        let filter = rays.filter(self.index as usize);
        LeafContext::new(bvh, near, self.t_min, self.instance, filter)
    }

    /// The entry distance of its current position; 0 for any-hit queries, where it does not matter.
    #[inline(always)]
    fn near<A: HitSink>(&self, stack: &TraversalStack) -> f32 {
        if A::ANY { 0.0 } else { stack.near(self.top) }
    }

    /// The index of the next stack entry. For the nearest hit, entries beyond the best hit are skipped. If all checked
    /// entries lie beyond it, the last of them is taken, which is useless but harmless.
    #[inline(always)]
    fn peek<L: Lanes, A: HitSink>(&self, stack: &TraversalStack) -> u32 {
        let mut beyond = 0;
        if !A::ANY {
            let nears = stack.nears_below(self.top);
            let mut within = 1u32;
            for lane in (0..BELOW).step_by(L::Block::WIDTH) {
                within |= L::Block::load(&nears[lane..]).le(L::Block::splat(self.best.t)).bits() << lane;
            }
            beyond = (within << (32 - BELOW)).leading_zeros();
        }
        self.top.wrapping_sub(1 + beyond)
    }

    /// Moves to the next stack entry, or ends.
    #[inline(always)]
    fn pop<L: Lanes, A: HitSink>(&mut self, stack: &TraversalStack) {
        self.top = self.peek::<L, A>(stack);
        let ended = A::ANY && !self.best.is_miss();
        self.child.0 = select_unpredictable(ended, END, opaque(stack.word(self.top)));
    }

    /// Moves the ray into or out of an instance; `outside` stores its row in world space.
    #[inline(always)]
    fn change_place<L: Lanes, A: HitSink>(
        &mut self,
        bvh: &Bvh,
        rays: &Rays,
        stack: &mut TraversalStack,
        outside: &mut RayRow,
    ) {
        if self.child.0 == LEAVE_INSTANCE {
            self.row.copy(outside);
            self.direction = sphere::Line::new(&rays.get(self.index as usize)).direction;
            self.instance = NONE;
            return self.pop::<L, A>(stack);
        }
        let number = self.child.index();
        let placed = &bvh.instances[number];
        let ray = to_local(&rays.get(self.index as usize), placed);
        if !is_finite(&ray) {
            return self.pop::<L, A>(stack);
        }
        let near = self.near::<A>(stack);
        let (words, nears) = stack.from(self.top);
        words[0] = LEAVE_INSTANCE;
        [nears[0], nears[1], ..] = [0.0, near];
        self.top += 1;
        outside.copy(&self.row);
        self.direction = sphere::Line::new(&ray).direction;
        self.row.write(&LocalRay::new(ray), near.max(self.t_min));
        self.instance = number as u32;
        self.child = placed.root.child;
    }
}

/// The context of tests at leaves.
struct Leaves<'a> {
    bvh: &'a Bvh,
    rays: &'a Rays<'a>,
    memory: &'a ChildAddresses,
}

impl Leaves<'_> {
    /// Tests the blocks of those rays that are at one, and moves the rays on.
    #[inline(always)]
    fn test<L: Lanes, A: HitSink, B: LeafBlock>(
        &self,
        interleaved: &mut [ActiveRay; RAYS],
        stacks: &[TraversalStack; RAYS],
        mut todo: u32,
        places: &mut RaySlots,
    ) {
        while todo != 0 {
            let ray = take_first(&mut todo);
            if L::Queue::WIDTH == 2 * BLOCK && todo != 0 {
                let other = take_first(&mut todo);
                if let Ok(two) = interleaved.get_disjoint_mut([ray, other]) {
                    self.test_two::<L, A, B>(two, [&stacks[ray], &stacks[other]]);
                }
                self.send::<L, A>(&mut interleaved[ray], &stacks[ray], ray, places);
                self.send::<L, A>(&mut interleaved[other], &stacks[other], other, places);
            } else {
                interleaved[ray].test::<L, A, B>(self.bvh, self.rays, &stacks[ray]);
                self.send::<L, A>(&mut interleaved[ray], &stacks[ray], ray, places);
            }
        }
    }

    /// Tests the blocks of two rays together.
    #[inline(always)]
    fn test_two<L: Lanes, A: HitSink, B: LeafBlock>(
        &self,
        [a, b]: [&mut ActiveRay; 2],
        stacks: [&TraversalStack; 2],
    ) {
        let Self { bvh, rays, .. } = *self;
        if bvh.conditional {
            a.test::<L, A, B>(bvh, rays, stacks[0]);
            b.test::<L, A, B>(bvh, rays, stacks[1]);
            return;
        }
        let glances = [&a.glance::<A, B>(bvh, rays, stacks[0]), &b.glance::<A, B>(bvh, rays, stacks[1])];
        two_ray_blocks::test_two::<L::Queue, A, _, _>(glances, [&mut a.best, &mut b.best]);
    }

    /// Moves a ray to the next entry of its stack.
    #[inline(always)]
    fn send<L: Lanes, A: HitSink>(
        &self,
        f: &mut ActiveRay,
        stack: &TraversalStack,
        ray: usize,
        places: &mut RaySlots,
    ) {
        f.pop::<L, A>(stack);
        self.memory.send::<A>(places, ray, f.child);
    }
}

/// The rays that are at spheres.
#[inline(always)]
fn at_spheres(interleaved: &[ActiveRay; RAYS], rays: u32) -> u32 {
    let (mut todo, mut found) = (rays, 0);
    while todo != 0 {
        let ray = take_first(&mut todo);
        found |= u32::from(interleaved[ray].child.kind() == ChildKind::Spheres) << ray;
    }
    found
}

/// [`ActiveRay::test`] if hits of some primitives may be rejected.
struct FilteredTest<'a, 'r, A> {
    ray: &'a mut ActiveRay,
    near: f32,
    bvh: &'a Bvh,
    rays: &'a Rays<'r>,
    sink: PhantomData<A>,
}

impl<A: HitSink> Kernel for FilteredTest<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { ray, near, bvh, rays, .. } = self;
        let source = RaySource { bvh, rays, index: ray.index, instance: ray.instance };
        let visit = ray.visit(bvh, rays, near);
        let place = ray.child.index();
        let found = if ray.child.kind() == ChildKind::Spheres {
            leaf::spheres::<L, A>(&bvh.spheres[place], &source.ray(), visit, &mut ray.best)
        } else {
            leaf::triangles::<L, A>(&bvh.triangles[place], &source, &ray.row.shear(), visit, &mut ray.best)
        };
        if found && A::ANY {
            // Any-hit: the primitive's id is not needed.
            ray.best.primitive = 0;
        }
    }
}

/// Reads a ray from the queue only if it is needed.
#[derive(Clone, Copy)]
struct RaySource<'a> {
    bvh: &'a Bvh,
    rays: &'a Rays<'a>,
    index: u32,
    instance: u32,
}

impl Exact for RaySource<'_> {
    fn ray(&self) -> Ray<f32> {
        let world = self.rays.get(self.index as usize);
        match self.bvh.instances.get(self.instance as usize) {
            Some(instance) => to_local(&world, instance),
            None => world,
        }
    }
}

/// The rays that have not started.
struct Queue<'a> {
    bvh: &'a Bvh,
    rays: Rays<'a>,
    /// The first that has not been prepared.
    next: usize,
    prepared: &'a mut PreparedRays,
}

impl Queue<'_> {
    /// Puts the next ray in place `ray`; the results of rays that can hit nothing are written on the way.
    #[inline(always)]
    fn refill<L: Lanes, A: HitSink>(
        &mut self,
        ray: usize,
        f: &mut ActiveRay,
        stack: &mut TraversalStack,
        sink: &mut A,
        places: &mut RaySlots,
    ) {
        places.alive &= !(1 << ray);
        while self.prepared.is_empty() {
            if self.next >= self.rays.len() {
                return;
            }
            self.prepare::<L, A>(sink);
        }
        let place = self.prepared.take();
        let p = &*self.prepared;
        let start = p.read::<L::Queue>(place, &mut f.row);
        f.top = TraversalStack::FIRST;
        SubtreeEntry { near: stack.from(TraversalStack::FIRST).1[0], child: f.child } = start;
        f.index = p.first + place as u32;
        f.best = Hit { t: f.row.t_max(), ..Hit::MISS };
        f.instance = NONE;
        f.t_min = f.row.t_min();
        if !self.bvh.spheres.is_empty() {
            f.direction = sphere::Line::new(&self.rays.get(f.index as usize)).direction;
        }
        places.alive |= 1 << ray;
        // The top of the tree needs no prefetch.
        places.put(ray, f.child);
    }

    /// Prepares the next rays.
    #[inline(always)]
    fn prepare<L: Lanes, A: HitSink>(&mut self, sink: &mut A) {
        let count = (self.rays.len() - self.next).min(BATCH);
        let (first, rays) = (self.next, &self.rays);
        L::outlined(Fill { prepared: self.prepared, bvh: self.bvh, rays, first, count });
        let mut missed = !self.prepared.pending & (((1u64 << count) - 1) as u32);
        while missed != 0 {
            sink.write(self.next + missed.trailing_zeros() as usize, &Hit::MISS);
            missed &= missed - 1;
        }
        self.next += count;
    }
}
