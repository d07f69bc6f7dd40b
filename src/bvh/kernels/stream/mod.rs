//! Streams: rays in roughly one direction that traverse the tree together, node by node.
//!
//! A queue is sorted by direction class (see [`super::direction_classes`]); all rays of a class meet the same sides of
//! boxes first, and have much the same order of a node's children. So they share one stack, each entry of which lists
//! the rays that enter a box. A box is tested against 16 rays of a list together, and those that enter are packed into
//! the child's list: however few rays of a register enter a box, its own list is dense again. At a leaf each triangle
//! or sphere is tested against 16 rays with the canonical test. (After Barringer and Akenine-Möller, "Dynamic ray
//! stream traversal", 2014, and Wald et al., "SIMD ray stream tracing", 2007, with the order of children known
//! beforehand.)
//!
//! The nodes and blocks that a list's rays meet are read once for all of them, and nothing waits for a single ray.
//! Where a list gets short, its rays continue one by one.

mod bounds;
mod leaves;
mod rows;

use std::marker::PhantomData;

use super::direction_classes::{DirectionClasses, OCTANTS, starts};
use super::subtree::SubtreeEntry;
use super::traverse::Subtree;
use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::layout::{Bvh, Child, ChildKind, PADDING, WIDTH};
use crate::simd::sixteen::slot;
use crate::simd::{Float, Int, Kernel, Lanes, Mask, Sixteen, TraversalStack};
use bounds::ListBounds;
use rows::{LANES, Quad, ROW, answer, best, finish, load, put_best};

/// The most rays that are sorted together.
pub(super) const RAYS: usize = 16_384;
/// Fewer rays are not worth sorting.
pub(super) const FEWEST: usize = 512;
/// Lists of no more rays than this are taken into nodes one by one.
const LONE: usize = 3;
/// Lists of no more rays than this are tested at leaves one by one.
const LONE_AT_LEAF: usize = 4;
/// Far distances grow by this factor, so that they are no less than those by the exact factor for far planes: see
/// [`slab_scales`](crate::bvh::intersect::ray::slab_scales).
const FARTHER: f32 = 1.0 + 3.0 * PADDING;

/// 16 rays of a list, with the values for boxes.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct StreamGroup {
    origin: [[f32; LANES]; 3],
    scale: [[f32; LANES]; 3],
    best: [f32; LANES],
    id: [u32; LANES],
}

/// A box and the rays that enter it, as a part of the lists.
#[derive(Clone, Copy)]
struct StackEntry {
    child: Child,
    start: u32,
    count: u32,
}

/// A thread's buffers for streams.
#[derive(Default)]
pub(super) struct StreamBuffers {
    rows: Vec<Quad>,
    /// The row of each ray of the queue.
    places: Vec<u32>,
    walk: StreamWalk,
}

/// [`StreamBuffers::trace`] as a kernel.
pub(super) struct StreamQuery<'a, 'r, A> {
    pub stream: &'a mut StreamBuffers,
    pub bvh: &'a Bvh,
    pub rays: &'a Rays<'r>,
    pub classes: &'a mut DirectionClasses,
    pub keys: &'a mut TraversalStack,
    pub sink: &'a mut A,
}

impl<A: HitSink> Kernel for StreamQuery<'_, '_, A> {
    /// True if the queue was traced; false if some directions are at the limits of floats.
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        self.stream.trace::<L, A>(self.bvh, self.rays, self.classes, self.keys, self.sink)
    }
}

/// The state of a traversal.
#[derive(Default)]
struct StreamWalk {
    stack: Vec<StackEntry>,
    /// Lists of rays, by their numbers in the stream.
    lists: Vec<u32>,
    /// The entry distance of each ray in a list; not written for boxes of nodes.
    near: Vec<f32>,
    /// The rays of the current list.
    groups: Vec<StreamGroup>,
}

/// The scene and the direction class of a traversal.
#[derive(Clone, Copy)]
struct StreamScene<'a> {
    bvh: &'a Bvh,
    rays: &'a Rays<'a>,
    way: usize,
}

impl StreamBuffers {
    /// Traces at most [`RAYS`] rays.
    #[inline(always)]
    fn trace<L: Lanes, A: HitSink>(
        &mut self,
        bvh: &Bvh,
        rays: &Rays,
        classes: &mut DirectionClasses,
        keys: &mut TraversalStack,
        sink: &mut A,
    ) -> bool {
        let count = rays.len();
        if self.rows.len() < ROW * count + 3 {
            self.rows.resize(ROW * count + 3, [0.0; 4]);
        }
        if self.places.len() < count {
            self.places.resize(count, 0);
        }
        // Rows are aligned to cache lines.
        let skip = (self.rows.as_ptr() as usize / size_of::<Quad>()).wrapping_neg() % 4;
        let rows = &mut self.rows[skip..][..ROW * count];
        let ends = classes.classify::<L::Queue>(rays);
        let mut next = starts(&ends);
        for at in (0..count).step_by(L::Queue::WIDTH) {
            if !load::<L::Queue>(rays, at, classes.classes(), &mut next, rows, &mut self.places) {
                return false;
            }
        }
        let mut first = 0;
        for (way, end) in ends.into_iter().enumerate() {
            if end > first {
                let rows = &mut rows[ROW * first..ROW * end];
                self.walk.run::<L, A>(StreamScene { bvh, rays, way }, rows, keys);
                // Any-hit results, one word a ray, are written as soon as they are known; whole hits go to their
                // columns 16 at a time (measured: 5 % of first bounces' time, but shadow rays would lose as much).
                if A::ANY {
                    for row in rows.chunks_exact(ROW) {
                        sink.write(row[3][3].to_bits() as usize, &best(row));
                    }
                }
            }
            first = end;
        }
        if !A::ANY {
            for at in (0..count).step_by(L::Queue::WIDTH) {
                answer::<L::Queue, A>(rows, &self.places[at..count], at, sink);
            }
        }
        true
    }
}

/// The rays of a list from one place on, and the lanes that have one; the others have the first ray.
#[inline(always)]
fn numbers<F: Float>((list, count): (&[u32], usize), at: usize) -> (F::Int, F::Mask) {
    let mask = F::Mask::first(count.saturating_sub(at));
    (F::Int::select(mask, F::Int::load(&list[at..]), F::Int::splat(list[0])), mask)
}

impl StreamWalk {
    /// Traces the rays of all rows through the tree.
    #[inline(always)]
    fn run<L: Lanes, A: HitSink>(
        &mut self,
        scene: StreamScene,
        rows: &mut [Quad],
        keys: &mut TraversalStack,
    ) {
        let bvh = scene.bvh;
        let Some(root) = bvh.root else { return };
        let count = rows.len() / ROW;
        self.make_room(0, count);
        for (number, id) in self.lists[..count].iter_mut().enumerate() {
            *id = number as u32;
        }
        self.look_at::<L::Queue>(rows, 0, count);
        let planes = [root.bounds.min.to_array(), root.bounds.max.to_array()];
        self.enter::<L::Queue, true>(&planes, scene.way, root.child, count, 0);
        while let Some(StackEntry { child, start, count }) = self.stack.pop() {
            let (start, count) = (start as usize, count as usize);
            match child.kind() {
                ChildKind::Node if count > LONE => self.open::<L>(scene, rows, child.index(), start, count),
                ChildKind::Triangles | ChildKind::Spheres if count > LONE_AT_LEAF => {
                    self.test::<L::Queue, A>(scene, rows, child, start, count);
                }
                ChildKind::Triangles | ChildKind::Spheres => {
                    self.test_lone::<L, A>(scene, rows, child, start, count);
                }
                _ => self.leave::<L, A>(scene, rows, child, start, count, keys),
            }
        }
    }

    /// Makes room for the lists of all children of a node, from `start` on.
    #[inline(always)]
    fn make_room(&mut self, start: usize, count: usize) {
        // Lists are written a register at a time.
        let room = start + WIDTH * count + LANES;
        if self.lists.len() < room {
            self.lists.resize(room, 0);
            self.near.resize(room, 0.0);
        }
        if self.groups.len() < count.div_ceil(LANES) {
            let columns = [[0.0; LANES]; 3];
            let empty = StreamGroup { origin: columns, scale: columns, best: [-1.0; LANES], id: [0; LANES] };
            self.groups.resize(count.div_ceil(LANES), empty);
        }
    }

    /// Loads the rays of a list into the groups.
    #[inline(always)]
    fn look_at<F: Float>(&mut self, rows: &[Quad], start: usize, count: usize) {
        let list = (&self.lists[start..], count);
        for (number, group) in self.groups[..count.div_ceil(LANES)].iter_mut().enumerate() {
            for lane in (0..LANES).step_by(F::WIDTH) {
                let (id, mask) = numbers::<F>(list, number * LANES + lane);
                let row = id.shl::<2>();
                let [x, y, z, best] = F::load_rows(rows, row);
                let [scale_x, scale_y, scale_z, _] = F::load_rows(&rows[1..], row);
                for (column, value) in group.origin.iter_mut().zip([x, y, z]) {
                    value.store(&mut column[lane..]);
                }
                for (column, value) in group.scale.iter_mut().zip([scale_x, scale_y, scale_z]) {
                    value.store(&mut column[lane..]);
                }
                F::select(mask, best, F::splat(-1.0)).store(&mut group.best[lane..]);
                id.store(&mut group.id[lane..]);
            }
        }
    }

    /// Pushes the children of a node that rays of a list enter, the nearest on top.
    #[inline(always)]
    fn open<L: Lanes>(&mut self, scene: StreamScene, rows: &[Quad], node: usize, start: usize, count: usize) {
        let StreamScene { bvh, way, .. } = scene;
        self.make_room(start, count);
        // From here on, the list is in the groups, and its place is free.
        self.look_at::<L::Queue>(rows, start, count);
        let node = &bvh.nodes[node];
        let bits =
            ListBounds::new::<L::Queue>(&self.groups[..count.div_ceil(LANES)]).meet::<L::Node>(node, way);
        let mut end = start;
        // From back to front: the first one pushed is visited last.
        let order = node.back_to_front((way % OCTANTS) as u32);
        let mut places = <L::Node as Sixteen>::in_order(bits, order);
        while places != 0 {
            let slot = slot(order, places.trailing_zeros() as usize);
            places &= places - 1;
            let mut planes = [[0.0; 3]; 2];
            for (axis, [low, high]) in node.planes.iter().enumerate() {
                (planes[0][axis], planes[1][axis]) = (low[slot], high[slot]);
            }
            let child = Child(node.child[slot]);
            let entered = if child.kind() == ChildKind::Node {
                self.enter::<L::Queue, false>(&planes, way, child, count, end)
            } else {
                self.enter::<L::Queue, true>(&planes, way, child, count, end)
            };
            if entered > end {
                bvh.fetch(child);
                end = entered;
            }
        }
    }

    /// Lists the rays that enter a box, from `start` on, with their entry distances if `NEAR`; returns the list's end.
    #[inline(always)]
    fn enter<F: Float, const NEAR: bool>(
        &mut self,
        planes: &[[f32; 3]; 2],
        way: usize,
        child: Child,
        count: usize,
        start: usize,
    ) -> usize {
        let (mut near_planes, mut far_planes) = ([F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            let side = way >> axis & 1;
            near_planes[axis] = F::splat(planes[side][axis]);
            far_planes[axis] = F::splat(planes[side ^ 1][axis]);
        }
        let mut end = start;
        for group in &self.groups[..count.div_ceil(LANES)] {
            for lane in (0..LANES).step_by(F::WIDTH) {
                let (mut near, mut far) = (F::zero(), F::splat(f32::INFINITY));
                for axis in 0..3 {
                    let origin = F::load(&group.origin[axis][lane..]);
                    let scale = F::load(&group.scale[axis][lane..]);
                    near = ((origin - near_planes[axis]) * scale).max(near);
                    far = ((origin - far_planes[axis]) * scale).min(far);
                }
                let mask = near.le((far * F::splat(FARTHER)).min(F::load(&group.best[lane..])));
                F::Int::load(&group.id[lane..]).compress(mask, &mut self.lists[end..]);
                if NEAR {
                    near.compress(mask, &mut self.near[end..]);
                }
                end += mask.count();
            }
        }
        if end > start {
            self.stack.push(StackEntry { child, start: start as u32, count: (end - start) as u32 });
        }
        end
    }

    /// Traces a list's rays through a part of the tree with the single-ray kernel.
    #[inline(always)]
    fn leave<L: Lanes, A: HitSink>(
        &mut self,
        scene: StreamScene,
        rows: &mut [Quad],
        child: Child,
        start: usize,
        count: usize,
        keys: &mut TraversalStack,
    ) {
        let StreamScene { bvh, rays, .. } = scene;
        for (id, near) in self.lists[start..][..count].iter().zip(&self.near[start..]) {
            let row = &mut rows[ROW * *id as usize..][..ROW];
            let t_min = row[1][3];
            // The entry distances of nodes are not stored.
            let near = if child.kind() == ChildKind::Node { t_min } else { Float::max(*near, t_min) };
            if near > row[0][3] {
                continue;
            }
            let mut hit = best(row);
            let ray = rays.get(row[3][3].to_bits() as usize);
            let found = L::outlined(Subtree {
                bvh,
                ray: &ray,
                filter: leaves::filter(rays, row),
                start: SubtreeEntry { near, child },
                keys: &mut *keys,
                best: &mut hit,
                sink: PhantomData::<A>,
            });
            if found {
                finish(row);
            } else {
                put_best(row, &hit);
            }
        }
    }
}
