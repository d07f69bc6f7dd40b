//! Many rays in flight: the kernel for rays that go anywhere.
//!
//! A thread holds [`RAYS`] rays, each with a stack of its own, and takes them round by
//! round: every ray at a node takes one step through it, every ray at a leaf tests its
//! block, and a ray that has ended makes room for the next of the queue. What one ray
//! waits for (a node from memory, a long chain of operations) the others hide; the memory
//! of a ray's next step is asked for a round ahead. No branch depends on what a ray
//! finds: decisions are conditional moves, and a ray is written to all lists, of which one
//! gets longer. (After "wavefront" scheduling of rays on GPUs; cf. Aila and Laine,
//! "Understanding the efficiency of ray traversal on GPUs", 2009.)

use std::hint::select_unpredictable;

use super::answers::Answers;
use super::layout::{Bvh, Child, ChildKind, Node, Order, TriangleBlock, WIDTH, back_to_front};
use super::leaf::{self, Visit};
use super::prepare::{BATCH, Fill, Prepared, Row};
use super::ray::{LocalRay, is_finite, to_local};
use super::traverse::LEAVE_INSTANCE;
use super::triangle::Exact;
use super::{HitsMut, Rays};
use crate::math::{Hit, NONE, Ray};
use crate::simd::sixteen::{key, key_distance};
use crate::simd::{Kernel, Lanes, Sixteen, prefetch};

/// Rays in flight.
const RAYS: usize = 32;
/// At the bottom of every stack, so that a window of eight keys can always be read.
const WINDOW: usize = 8;
/// 32-bit entries of a cache line.
const LINE: usize = 16;
/// The child word of a ray that has ended.
const END: u32 = u32::MAX - 1;

/// A thread's rays and their stacks.
pub(super) struct Flight {
    rays: Box<[InFlight; RAYS]>,
    /// Those that are in an instance, as they are in the world.
    outside: Box<[Row; RAYS]>,
    stacks: Stacks,
    prepared: Box<Prepared>,
}

/// What each ray has still to visit.
struct Stacks {
    /// Where the nearest hit is asked for.
    keys: Vec<u64>,
    /// Where any hit will do, and no distance is needed: child words.
    words: Vec<u32>,
    /// Entries of a ray.
    each: usize,
}

impl Stacks {
    fn new(bvh: &Bvh) -> Self {
        // Within an instance, the world's entries stay where they are; and there is room for a node's children, which
        // are written sixteen at a time.
        let trees = if bvh.instances.is_empty() { 1 } else { 2 };
        let needed = WINDOW + trees * bvh.stack_size + 2 + WIDTH;
        // An odd number of cache lines, so that not all begin in the same set of the cache.
        let each = LINE * (needed.div_ceil(LINE) | 1);
        Self { keys: vec![key(0.0, END); RAYS * each], words: vec![END; RAYS * each], each }
    }

    /// Those of a ray.
    #[inline(always)]
    fn of(&mut self, ray: usize) -> RayStack<'_> {
        let first = ray * self.each;
        RayStack { keys: &mut self.keys, words: &mut self.words, first }
    }
}

/// A ray's stack.
struct RayStack<'a> {
    keys: &'a mut [u64],
    words: &'a mut [u32],
    first: usize,
}

impl RayStack<'_> {
    /// A place on it.
    #[inline(always)]
    fn at(&self, place: u32) -> usize {
        self.first + place as usize
    }
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
    row: Row,
    /// Where it is: the node or block, and where the ray enters that.
    current: u64,
    /// Keys on its stack.
    top: u32,
    /// Its place in the queue.
    index: u32,
    best: Hit,
    /// The instance it is in.
    instance: u32,
    /// Only hits beyond this count.
    t_min: f32,
}

/// Numbers of rays.
#[derive(Clone, Copy)]
struct List {
    rays: [u8; 256],
    length: u8,
}

impl List {
    const EMPTY: List = List { rays: [0; 256], length: 0 };

    /// How many there are. From now on the list is written again from its start: nothing is added faster than it is
    /// read.
    #[inline(always)]
    fn take(&mut self) -> u8 {
        std::mem::take(&mut self.length)
    }

    #[inline(always)]
    fn get(&self, i: u8) -> usize {
        usize::from(self.rays[usize::from(i)]) % RAYS
    }

    /// Adds a ray if `wanted`.
    #[inline(always)]
    fn append(&mut self, ray: usize, wanted: bool) {
        self.rays[usize::from(self.length)] = ray as u8;
        self.length = self.length.wrapping_add(u8::from(wanted));
    }
}

/// Where rays are: at nodes, at triangles, elsewhere.
struct Lists {
    nodes: List,
    triangles: List,
    others: List,
    /// Where nodes and blocks of triangles are.
    base: [usize; 2],
    /// Where nodes' orders are.
    orders: usize,
}

impl Lists {
    fn new(bvh: &Bvh) -> Self {
        let base = [bvh.nodes.as_ptr() as usize, bvh.triangles.as_ptr() as usize];
        Self {
            nodes: List::EMPTY,
            triangles: List::EMPTY,
            others: List::EMPTY,
            base,
            orders: bvh.orders.as_ptr() as usize,
        }
    }

    /// Puts a ray where its next step is and asks for that step's memory.
    #[inline(always)]
    fn send<A: Answers>(&mut self, ray: usize, current: u64) {
        let word = current as u32;
        let (node, block) = (word >> 30 == ChildKind::Node as u32, word >> 30 == ChildKind::Triangles as u32);
        self.nodes.append(ray, node);
        self.triangles.append(ray, block);
        self.others.append(ray, !node & !block);
        let index = Child(word).index();
        let address = self.base[0].wrapping_add(index.wrapping_mul(size_of::<Node>()));
        let block_address = self.base[1].wrapping_add(index.wrapping_mul(size_of::<TriangleBlock>()));
        prefetch(select_unpredictable(block, block_address, address), 7);
        if !A::ANY {
            prefetch(self.orders.wrapping_add(index.wrapping_mul(size_of::<Order>())), 1);
        }
    }
}

impl Flight {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        let ray = InFlight {
            row: Row::default(),
            current: 0,
            top: 0,
            index: 0,
            best: Hit::MISS,
            instance: NONE,
            t_min: 0.0,
        };
        Self {
            rays: Box::new([ray; RAYS]),
            outside: Box::new([Row::default(); RAYS]),
            stacks: Stacks::new(bvh),
            prepared: Box::default(),
        }
    }

    /// Answers a queue.
    #[inline(always)]
    fn trace<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, rays: Rays, answers: &mut A) {
        let mut lists = Lists::new(bvh);
        let (flight, stacks) = (&mut *self.rays, &mut self.stacks);
        let mut queue = Queue { bvh, rays, next: 0, prepared: &mut self.prepared };
        for (i, f) in flight.iter_mut().enumerate() {
            queue.refill::<L, A>(i, f, answers, &mut lists);
        }
        loop {
            for i in 0..lists.nodes.take() {
                let ray = lists.nodes.get(i);
                let f = &mut flight[ray];
                f.step::<L, A>(bvh, &mut stacks.of(ray));
                lists.send::<A>(ray, f.current);
            }
            for i in 0..lists.triangles.take() {
                let ray = lists.triangles.get(i);
                let f = &mut flight[ray];
                if A::ANY {
                    f.look_for_triangles::<L, A>(bvh, &queue.rays);
                } else {
                    f.test_triangles::<L>(bvh, &queue.rays);
                }
                f.pop::<L, A>(&stacks.of(ray));
                lists.send::<A>(ray, f.current);
            }
            for i in 0..lists.others.take() {
                let ray = lists.others.get(i);
                let f = &mut flight[ray];
                if f.child().0 == END {
                    answers.put(f.index as usize, &f.best);
                    queue.refill::<L, A>(ray, f, answers, &mut lists);
                    continue;
                }
                if f.child().kind() == ChildKind::Spheres {
                    f.test_spheres::<L>(bvh, &queue.rays);
                    f.pop::<L, A>(&stacks.of(ray));
                } else {
                    f.change_place::<L, A>(bvh, &queue.rays, &mut stacks.of(ray), &mut self.outside[ray]);
                }
                lists.send::<A>(ray, f.current);
            }
            if lists.nodes.length + lists.triangles.length + lists.others.length == 0 {
                break;
            }
        }
    }
}

impl InFlight {
    #[inline(always)]
    fn child(&self) -> Child {
        Child(self.current as u32)
    }

    /// One step through a node, to the foremost of its children that is entered or to what is next on the stack.
    #[inline(always)]
    fn step<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, stack: &mut RayStack) {
        let (waiting, below) = self.peek::<L, A>(stack);
        let node = &bvh.nodes[self.current as u32 as usize];
        let (near, far) = self.row.slabs().meet_children::<L::Node>(node, self.best.t);
        let top = stack.at(self.top);
        let (next, count) = if A::ANY {
            let Some(room) = stack.words[top..].first_chunk_mut::<WIDTH>() else { return };
            let (word, count) = <L::Node as Sixteen>::take_entered(near, far, &node.child, room);
            (key(0.0, word), count)
        } else {
            let Some(room) = stack.keys[top..].first_chunk_mut::<WIDTH>() else { return };
            let order = back_to_front(&bvh.orders[self.current as u32 as usize], self.row.octant());
            Sixteen::take_in_order(near, far, &node.child, order, room)
        };
        let entered = count != 0;
        self.current = select_unpredictable(entered, next, waiting);
        self.top = select_unpredictable(entered, (self.top + count).wrapping_sub(1), below);
    }

    /// The canonical test.
    #[inline(always)]
    fn test_triangles<L: Lanes>(&mut self, bvh: &Bvh, rays: &Rays) {
        let block = &bvh.triangles[self.child().index()];
        let visit = self.visit(bvh, rays);
        let source = RaySource { bvh, rays, index: self.index, instance: self.instance };
        leaf::nearest_triangle::<L>(block, &source, &self.row.shear(), visit, &mut self.best);
    }

    /// Whether there is a hit in a block, without a branch on it.
    #[inline(always)]
    fn look_for_triangles<L: Lanes, A: Answers>(&mut self, bvh: &Bvh, rays: &Rays) {
        let block = &bvh.triangles[self.child().index()];
        let source = RaySource { bvh, rays, index: self.index, instance: self.instance };
        let visit = self.visit(bvh, rays);
        let found = leaf::hits_triangles::<L, A>(block, &source, &self.row.shear(), visit, self.best.t);
        self.best.primitive = select_unpredictable(found, 0, self.best.primitive);
    }

    #[inline(always)]
    fn visit<'a>(&self, bvh: &'a Bvh, rays: &Rays<'a>) -> Visit<'a> {
        let asker = rays.asker(self.index as usize);
        Visit::new(bvh, key_distance(self.current), self.t_min, self.instance, asker)
    }

    /// The next key on the stack and how many are below it. For the nearest hit, keys beyond the best hit are passed
    /// over. If all eight on top are beyond it, the last of them is taken, which is useless but does no harm.
    #[inline(always)]
    fn peek<L: Lanes, A: Answers>(&self, stack: &RayStack) -> (u64, u32) {
        if A::ANY {
            let below = self.top.wrapping_sub(1);
            return (key(0.0, stack.words[stack.at(below)]), below);
        }
        let first = self.top.wrapping_sub(WINDOW as u32);
        let window = stack.keys[stack.at(first)..].first_chunk::<WINDOW>();
        let Some(window) = window else { return (key(0.0, END), 0) };
        let place = <L::Node as Sixteen>::last_within(window, self.best.t);
        (window[place % WINDOW], first + place as u32)
    }

    /// Goes to the next key, or ends.
    #[inline(always)]
    fn pop<L: Lanes, A: Answers>(&mut self, stack: &RayStack) {
        let (waiting, below) = self.peek::<L, A>(stack);
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

    /// The way into or out of an instance; `outside` keeps the ray as it is in the world.
    #[inline(always)]
    fn change_place<L: Lanes, A: Answers>(
        &mut self,
        bvh: &Bvh,
        rays: &Rays,
        stack: &mut RayStack,
        outside: &mut Row,
    ) {
        if self.child().0 == LEAVE_INSTANCE {
            self.row.copy(outside);
            self.instance = NONE;
            return self.pop::<L, A>(stack);
        }
        let number = self.child().index();
        let placed = &bvh.instances[number];
        let ray = to_local(&rays.get(self.index as usize), placed);
        if !is_finite(&ray) {
            return self.pop::<L, A>(stack);
        }
        let near = key_distance(self.current);
        let top = stack.at(self.top);
        stack.keys[top] = key(0.0, LEAVE_INSTANCE);
        stack.words[top] = LEAVE_INSTANCE;
        self.top += 1;
        outside.copy(&self.row);
        self.row.write(&LocalRay::new(ray), near.max(self.t_min));
        self.instance = number as u32;
        self.current = key(near, placed.root.child.0);
    }
}

/// Where to get the ray itself.
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

/// The rays that have not taken off.
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
        p.read(place, &mut f.row);
        f.current = p.start(place);
        f.top = WINDOW as u32;
        f.index = p.first + place as u32;
        f.best = Hit { t: f.row.t_max(), ..Hit::MISS };
        f.instance = NONE;
        f.t_min = f.row.t_min();
        lists.send::<A>(ray, f.current);
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
