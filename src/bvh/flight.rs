//! Many rays in flight: the kernel for rays that go anywhere.
//!
//! A thread holds [`RAYS`] rays, each with a stack of its own, and takes them round by
//! round: every ray at a node takes one step through it, every ray at a leaf tests its
//! block, and a ray that has ended makes room for the next of the queue. What one ray
//! waits for (a node from memory, a long chain of operations) the others hide; the memory
//! of a ray's next step is asked for a round ahead. No branch depends on what a ray
//! finds: decisions are conditional moves, and which list a ray goes to is a computed place. (After "wavefront" scheduling of rays on
//! GPUs; cf. Aila and Laine, "Understanding the efficiency of ray traversal on GPUs", 2009.)

use std::hint::select_unpredictable;

use super::answers::Answers;
use super::layout::{Bvh, Child, ChildKind, Node, SphereBlock, TriangleBlock, WIDTH};
use super::leaf::{self, Visit};
use super::prepare::{BATCH, Fill, Prepared};
use super::ray::{LocalRay, Slabs, is_finite, to_local};
use super::traverse::LEAVE_INSTANCE;
use super::triangle::{Exact, Shear};
use super::{HitsMut, Rays, triangle};
use crate::math::{Hit, NONE, Ray};
use crate::simd::sixteen::{key, key_distance};
use crate::simd::{Kernel, Lanes, Sixteen, prefetch};

/// Rays in flight.
const RAYS: usize = 32;
/// At the bottom of every stack, so that a window of eight keys can always be read.
const WINDOW: usize = 8;
/// Keys on a stack, and room for those of a node, which are written sixteen at a time. With
/// this number a ray takes an odd number of cache lines, so that not all stacks begin in
/// the same set of the cache.
const KEYS: usize = 496;
/// The child word of a ray that has ended.
const END: u32 = u32::MAX - 1;

/// A thread's rays and their stacks.
pub(super) struct Flight {
    rays: Box<[InFlight; RAYS]>,
    prepared: Box<Prepared>,
}

/// [`Flight::trace`].
pub(super) struct FlightQuery<'a, 'r, A> {
    pub flight: &'a mut Flight,
    pub bvh: &'a Bvh,
    pub rays: Rays<'r>,
    pub answers: &'a mut A,
}

impl<A: Answers> Kernel for FlightQuery<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.flight.trace::<L, A>(self.bvh, self.rays, self.answers);
    }
}

/// A ray on its way.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct InFlight {
    slabs: Slabs,
    shear: Shear,
    /// Where it is: the node or block, and where the ray enters that.
    current: u64,
    /// Keys on its stack.
    top: u32,
    /// Its place in the queue.
    index: u32,
    best: Hit,
    /// The instance it is in.
    instance: u32,
    /// Hits count beyond.
    t_min: f32,
    keys: [u64; KEYS],
}

const _: () = assert!(size_of::<InFlight>() / 64 % 2 == 1);

/// Numbers of rays, in one list for each kind of what is next, and one for those that go on
/// with what is on their stack.
struct Lists {
    items: [[u8; RAYS]; LISTS],
    length: [usize; LISTS],
    /// For each kind the address of the array that it is in, and the size of its items.
    base: [usize; 4],
    size: [usize; 4],
}

const NODES: usize = ChildKind::Node as usize;
const TRIANGLES: usize = ChildKind::Triangles as usize;
const SPHERES: usize = ChildKind::Spheres as usize;
/// Into and out of instances, and rays that have ended.
const PLACES: usize = ChildKind::Instance as usize;
const POPS: usize = 4;
const CANDIDATES: usize = 5;
const LISTS: usize = 6;

impl Lists {
    fn new(bvh: &Bvh) -> Self {
        let (nodes, blocks) = (bvh.nodes.as_ptr() as usize, bvh.triangles.as_ptr() as usize);
        Self {
            items: [[0; RAYS]; LISTS],
            length: [0; LISTS],
            base: [nodes, blocks, bvh.spheres.as_ptr() as usize, nodes],
            size: [size_of::<Node>(), size_of::<TriangleBlock>(), size_of::<SphereBlock>(), 0],
        }
    }

    /// The rays of a list, and how many they are. From now on it is written anew: nothing is
    /// added to it faster than it is read.
    #[inline(always)]
    fn take(&mut self, list: usize) -> usize {
        std::mem::take(&mut self.length[list])
    }

    #[inline(always)]
    fn get(&self, list: usize, i: usize) -> usize {
        usize::from(self.items[list][i % RAYS])
    }

    /// Adds a ray to a list.
    #[inline(always)]
    fn append(&mut self, list: usize, ray: usize) {
        let length = self.length[list];
        // One ray is in one list once, so there is room.
        self.items[list][length % RAYS] = ray as u8;
        self.length[list] = length + 1;
    }

    /// Puts a ray where its next step is and asks for that step's memory.
    #[inline(always)]
    fn send(&mut self, ray: usize, current: u64) {
        self.append((current as u32 >> 30) as usize, ray);
        self.fetch(current);
    }

    /// Asks for the memory of a node or block.
    #[inline(always)]
    fn fetch(&self, current: u64) {
        let (kind, index) = ((current as u32 >> 30) as usize, Child(current as u32).index());
        prefetch(self.base[kind] + index * self.size[kind], 7);
    }
}

impl Flight {
    /// Whether its stacks are deep enough for a tree.
    pub fn holds(bvh: &Bvh) -> bool {
        WINDOW + 2 * bvh.stack_size + 2 + WIDTH <= KEYS
    }

    /// Empty.
    pub fn new() -> Self {
        let ray = InFlight {
            slabs: Slabs::default(),
            shear: Shear::default(),
            current: 0,
            top: 0,
            index: 0,
            best: Hit::MISS,
            instance: NONE,
            t_min: 0.0,
            keys: [key(0.0, END); KEYS],
        };
        Self { rays: Box::new([ray; RAYS]), prepared: Box::default() }
    }

    /// Answers a queue.
    #[inline(always)]
    fn trace<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, rays: Rays, answers: &mut A) {
        let mut lists = Lists::new(bvh);
        let flight = &mut *self.rays;
        let mut queue = Queue { bvh, rays, next: 0, prepared: &mut self.prepared };
        for (i, f) in flight.iter_mut().enumerate() {
            queue.refill::<L, A>(i, f, answers, &mut lists);
        }
        while lists.length.iter().sum::<usize>() > 0 {
            if A::ANY {
                first_hit_round::<L, A>(bvh, &queue.rays, flight, &mut lists);
            } else {
                nearest_hit_round::<L, A>(bvh, &queue.rays, flight, &mut lists);
            }
            for i in 0..lists.take(SPHERES) {
                let ray = lists.get(SPHERES, i);
                flight[ray % RAYS].test_spheres::<L>(bvh, &queue.rays);
                lists.append(POPS, ray);
            }
            for i in 0..lists.take(POPS) {
                let ray = lists.get(POPS, i);
                let f = &mut flight[ray % RAYS];
                f.pop::<L, A>();
                lists.send(ray, f.current);
            }
            for i in 0..lists.take(PLACES) {
                let ray = lists.get(PLACES, i);
                let f = &mut flight[ray % RAYS];
                if f.child().0 == END {
                    answers.put(f.index as usize, &f.best);
                    queue.refill::<L, A>(ray, f, answers, &mut lists);
                } else {
                    f.change_place::<L, A>(bvh, &queue.rays);
                    lists.send(ray, f.current);
                }
            }
        }
    }
}

/// A round of all rays at nodes and at triangles, if the nearest hit is asked for.
///
/// Each kind of work has a loop of its own, and the shorter the better: the processor looks
/// some 200 operations ahead, which is two steps through a node, but seven pops.
#[inline(always)]
fn nearest_hit_round<L: Lanes, A: Answers>(
    bvh: &Bvh,
    rays: &Rays,
    flight: &mut [InFlight; RAYS],
    lists: &mut Lists,
) {
    for i in 0..lists.take(NODES) {
        let ray = lists.get(NODES, i);
        let f = &mut flight[ray % RAYS];
        let entered = f.step::<L, A>(bvh);
        let list = select_unpredictable(entered, (f.current as u32 >> 30) as usize, POPS);
        lists.append(list, ray);
        lists.fetch(f.current);
    }
    for i in 0..lists.take(TRIANGLES) {
        let ray = lists.get(TRIANGLES, i);
        let f = &flight[ray % RAYS];
        let found = triangle::may_hit::<L::Block>(&bvh.triangles[f.child().index()], &f.shear);
        lists.append(select_unpredictable(found, CANDIDATES, POPS), ray);
    }
    for i in 0..lists.take(CANDIDATES) {
        let ray = lists.get(CANDIDATES, i);
        flight[ray % RAYS].test_triangles::<L>(bvh, rays);
        lists.append(POPS, ray);
    }
}

/// The same if any hit will do. What is next on a stack is then one load away, and a block's hits
/// need no ordering, so that there is nothing to be gained from loops of their own.
#[inline(always)]
fn first_hit_round<L: Lanes, A: Answers>(
    bvh: &Bvh,
    rays: &Rays,
    flight: &mut [InFlight; RAYS],
    lists: &mut Lists,
) {
    for i in 0..lists.take(NODES) {
        let ray = lists.get(NODES, i);
        let f = &mut flight[ray % RAYS];
        let (waiting, below) = f.peek::<L, A>();
        let entered = f.step::<L, A>(bvh);
        f.current = select_unpredictable(entered, f.current, waiting);
        f.top = select_unpredictable(entered, f.top, below);
        lists.send(ray, f.current);
    }
    for i in 0..lists.take(TRIANGLES) {
        let ray = lists.get(TRIANGLES, i);
        let f = &mut flight[ray % RAYS];
        f.look_for_triangles::<L, A>(bvh, rays);
        f.pop::<L, A>();
        lists.send(ray, f.current);
    }
}

impl InFlight {
    #[inline(always)]
    fn child(&self) -> Child {
        Child(self.current as u32)
    }

    /// One step through a node; whether there is a next one.
    #[inline(always)]
    fn step<L: Lanes, A: Answers>(&mut self, bvh: &Bvh) -> bool {
        let node = &bvh.nodes[self.current as u32 as usize];
        let (near, bits) = self.slabs.enter_children::<L::Node>(node, self.best.t);
        let room = self.keys.get_mut(self.top as usize..).and_then(|keys| keys.first_chunk_mut::<WIDTH>());
        let Some(room) = room else { return false };
        self.current = if A::ANY {
            <L::Node as Sixteen>::take_first(&node.child, bits, room)
        } else {
            near.take_nearest(&node.child, bits, room)
        };
        self.top += bits.count_ones().saturating_sub(1);
        bits != 0
    }

    /// The canonical test, for a block of which the filter says that it may be hit.
    #[inline(always)]
    fn test_triangles<L: Lanes>(&mut self, bvh: &Bvh, rays: &Rays) {
        let block = &bvh.triangles[self.child().index()];
        let visit = self.visit(bvh, rays);
        let source = RaySource { bvh, rays, index: self.index, instance: self.instance };
        leaf::triangles::<L, HitsMut>(block, &source, &self.shear, visit, &mut self.best);
    }

    /// Whether there is a hit in a block, without a branch on it.
    #[inline(always)]
    fn look_for_triangles<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, rays: &Rays) {
        let block = &bvh.triangles[self.child().index()];
        let source = RaySource { bvh, rays, index: self.index, instance: self.instance };
        let visit = self.visit(bvh, rays);
        let found = leaf::hits_triangles::<L, A>(block, &source, &self.shear, visit, self.best.t);
        self.best.primitive = select_unpredictable(found, 0, self.best.primitive);
    }

    #[inline(always)]
    fn visit<'a>(&self, bvh: &'a Bvh, rays: &Rays<'a>) -> Visit<'a> {
        let asker = rays.asker(self.index as usize);
        Visit::new(bvh, key_distance(self.current), self.t_min, self.instance, asker)
    }

    /// The next key on the stack and how many are below it. For the nearest hit those beyond
    /// the best one are passed over; where all eight on top are, the last of them is taken:
    /// it is in vain, but does no harm.
    #[inline(always)]
    fn peek<L: Lanes, A: Answers>(&self) -> (u64, u32) {
        if A::ANY {
            let below = self.top.wrapping_sub(1);
            return (self.keys[below as usize % KEYS], below);
        }
        let first = self.top.wrapping_sub(WINDOW as u32);
        let window = self.keys.get(first as usize..).and_then(|keys| keys.first_chunk::<WINDOW>());
        let Some(window) = window else { return (key(0.0, END), 0) };
        let place = <L::Node as Sixteen>::last_within(window, self.best.t);
        (window[place % WINDOW], first + place as u32)
    }

    /// Goes to the next key, or ends.
    #[inline(always)]
    fn pop<L: Lanes, A: Answers>(&mut self) {
        let (waiting, below) = self.peek::<L, A>();
        let ended = A::ANY && !self.best.is_miss();
        self.current = select_unpredictable(ended, key(0.0, END), waiting);
        self.top = below;
    }

    /// The canonical test of a block of spheres.
    #[inline(always)]
    fn test_spheres<L: Lanes>(&mut self, bvh: &Bvh, rays: &Rays) {
        let source = RaySource { bvh, rays, index: self.index, instance: self.instance };
        let visit = self.visit(bvh, rays);
        leaf::spheres::<L, HitsMut>(&bvh.spheres[self.child().index()], &source.ray(), visit, &mut self.best);
    }

    /// The way into or out of an instance.
    #[inline(always)]
    fn change_place<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, rays: &Rays) {
        let world = rays.get(self.index as usize);
        if self.child().0 == LEAVE_INSTANCE {
            self.enter(&LocalRay::new(world), world.t_min, NONE);
        } else {
            let placed = &bvh.instances[self.child().index()];
            let ray = to_local(&world, placed);
            if is_finite(&ray) {
                let near = key_distance(self.current);
                self.keys[self.top as usize % KEYS] = key(0.0, LEAVE_INSTANCE);
                self.top += 1;
                self.enter(&LocalRay::new(ray), near, self.child().index() as u32);
                self.current = key(near, placed.root.0);
                return;
            }
        }
        self.pop::<L, A>();
    }

    /// Goes over to another space.
    fn enter(&mut self, local: &LocalRay, floor: f32, instance: u32) {
        self.slabs = Slabs { floor: floor.max(self.t_min), ..local.slabs };
        self.shear = local.shear;
        self.instance = instance;
    }
}

/// Where the ray itself is to be had.
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

/// What has not taken off.
struct Queue<'a> {
    bvh: &'a Bvh,
    rays: Rays<'a>,
    /// The first that has not been prepared.
    next: usize,
    prepared: &'a mut Prepared,
}

impl Queue<'_> {
    /// Puts the next ray in place `ray`; those that can hit nothing are answered on the way.
    #[inline(always)]
    fn refill<L: Lanes, A: Answers>(
        &mut self,
        ray: usize,
        f: &mut InFlight,
        answers: &mut A,
        lists: &mut Lists,
    ) {
        while self.prepared.is_empty() {
            if self.next >= self.rays.len() {
                return;
            }
            self.prepare::<L, A>(answers);
        }
        let place = self.prepared.take();
        let p = &*self.prepared;
        f.slabs = p.slabs(place);
        f.shear = p.shear(place);
        f.current = p.current[place];
        f.top = WINDOW as u32;
        f.index = p.first + place as u32;
        f.best = Hit { t: p.t_max[place], ..Hit::MISS };
        f.instance = NONE;
        f.t_min = p.t_min[place];
        lists.send(ray, f.current);
    }

    /// Prepares the next rays.
    #[inline(always)]
    fn prepare<L: Lanes, A: Answers>(&mut self, answers: &mut A) {
        let count = (self.rays.len() - self.next).min(BATCH);
        let (first, rays) = (self.next, &self.rays);
        L::outlined(Fill { prepared: self.prepared, bvh: self.bvh, rays, first, count });
        let mut missed = !self.prepared.waiting & (((1u64 << count) - 1) as u32);
        while missed != 0 {
            answers.put(self.next + missed.trailing_zeros() as usize, &Hit::MISS);
            missed &= missed - 1;
        }
        self.next += count;
    }
}
