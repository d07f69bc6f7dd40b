//! The single-ray kernel: used by the recursive schedule, and the oracle of the queue kernels.

use std::marker::PhantomData;

use super::counters::{self, Counter, NoCounter};
use super::prepare::{BATCH, Fill, PreparedRays, RayRow};
use super::subtree::{LEAVE_INSTANCE, SubtreeEntry};
use crate::bvh::intersect::hit_sink::{HitSink, Occluded};
use crate::bvh::intersect::leaf::{self, LeafContext};
use crate::bvh::intersect::ray::{LocalRay, RaySlabs, is_finite, to_local};
use crate::bvh::layout::sidedness::AnyHitFilter;
use crate::bvh::layout::{Bvh, Child, ChildKind, WIDTH};
use crate::bvh::{HitsMut, Rays};
use crate::math::{Hit, NONE, Ray};
use crate::simd::{Kernel, Lanes, Sixteen, TraversalStack};

/// The traversal stack of the single-ray kernel.
pub(in crate::bvh) fn stack_for(bvh: &Bvh) -> TraversalStack {
    // Doubled: within an instance, the world's entries stay where they are.
    TraversalStack::new(2 * bvh.stack_size + 2, 0)
}

/// Traces a queue, ray by ray.
#[inline(always)]
pub(in crate::bvh) fn each<L: Lanes, A: HitSink>(
    bvh: &Bvh,
    rays: Rays,
    prepared: &mut PreparedRays,
    keys: &mut TraversalStack,
    sink: &mut A,
) {
    for first in (0..rays.len()).step_by(BATCH) {
        let count = (rays.len() - first).min(BATCH);
        L::outlined(Fill { prepared, bvh, rays: &rays, first, count });
        for place in 0..count {
            let ray = rays.get(first + place);
            let mut best = Hit { t: ray.t_max, ..Hit::MISS };
            if prepared.pending >> place & 1 == 1 {
                let mut row = RayRow::default();
                let start = prepared.read::<L::Queue>(place, &mut row);
                let mut local = LocalRay { ray, slabs: row.slabs(), shear: row.shear() };
                let filter = rays.filter(first + place);
                if walk::<L, A, _>(bvh, &mut local, filter, start, keys, &mut best, &mut NoCounter) && A::ANY
                {
                    // Any-hit: the primitive's id is not needed.
                    best.primitive = 0;
                }
            }
            sink.write(first + place, &best);
        }
    }
}

/// The tree's root and the distance at which a ray enters it.
#[inline(always)]
pub(in crate::bvh) fn start(bvh: &Bvh, ray: &Ray<f32>, slabs: &RaySlabs) -> Option<SubtreeEntry> {
    let root = bvh.root.filter(|_| is_finite(ray))?;
    let near = slabs.enter(&root.bounds).filter(|near| *near <= ray.t_max)?;
    Some(SubtreeEntry { near, child: root.child })
}

/// Traces a ray through a part of the tree, as a kernel, and replaces `best` by a better hit. Returns true if an
/// any-hit query is finished.
pub(in crate::bvh) struct Subtree<'a, A> {
    pub bvh: &'a Bvh,
    pub ray: &'a Ray<f32>,
    pub filter: AnyHitFilter<'a>,
    /// The part of the tree.
    pub start: SubtreeEntry,
    pub keys: &'a mut TraversalStack,
    pub best: &'a mut Hit,
    pub sink: PhantomData<A>,
}

impl<A: HitSink> Kernel for Subtree<'_, A> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let mut local = LocalRay::new(*self.ray);
        let Self { bvh, filter, start, keys, .. } = self;
        let found = walk::<L, A, _>(bvh, &mut local, filter, start, keys, self.best, &mut NoCounter);
        if found {
            // Any-hit: the primitive's id is not needed.
            self.best.primitive = 0;
        }
        found
    }
}

/// Finds the nearest hit of one ray with t_min < t ≤ t_max.
#[inline(always)]
pub fn closest_one<L: Lanes>(
    bvh: &Bvh,
    ray: &Ray<f32>,
    filter: AnyHitFilter,
    stack: &mut TraversalStack,
) -> Hit {
    closest_counted::<L, _>(bvh, ray, filter, stack, &mut NoCounter)
}

/// True if one ray hits anything with t_min < t ≤ t_max.
#[inline(always)]
pub fn any_one<L: Lanes>(
    bvh: &Bvh,
    ray: &Ray<f32>,
    filter: AnyHitFilter,
    stack: &mut TraversalStack,
) -> bool {
    any_counted::<L, _>(bvh, ray, filter, stack, &mut NoCounter)
}

/// [`closest_one`], counted.
#[inline(always)]
pub(in crate::bvh) fn closest_counted<L: Lanes, T: Counter>(
    bvh: &Bvh,
    ray: &Ray<f32>,
    filter: AnyHitFilter,
    stack: &mut TraversalStack,
    counter: &mut T,
) -> Hit {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    let mut local = LocalRay::new(*ray);
    if let Some(start) = start(bvh, ray, &local.slabs) {
        walk::<L, HitsMut, T>(bvh, &mut local, filter, start, stack, &mut best, counter);
    }
    if best.is_miss() { Hit::MISS } else { best }
}

/// [`any_one`], counted.
#[inline(always)]
pub(in crate::bvh) fn any_counted<L: Lanes, T: Counter>(
    bvh: &Bvh,
    ray: &Ray<f32>,
    filter: AnyHitFilter,
    stack: &mut TraversalStack,
    counter: &mut T,
) -> bool {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    let mut local = LocalRay::new(*ray);
    match start(bvh, ray, &local.slabs) {
        Some(start) => walk::<L, Occluded, T>(bvh, &mut local, filter, start, stack, &mut best, counter),
        None => false,
    }
}

/// Traverses the tree from front to back, as far as that is known. An any-hit query stops at the first hit and returns
/// true.
#[inline(always)]
fn walk<L: Lanes, A: HitSink, T: Counter>(
    bvh: &Bvh,
    local: &mut LocalRay,
    filter: AnyHitFilter,
    start: SubtreeEntry,
    stack: &mut TraversalStack,
    best: &mut Hit,
    counter: &mut T,
) -> bool {
    let world = local.ray;
    let mut instance = NONE;
    let mut top = TraversalStack::FIRST;
    let SubtreeEntry { mut near, mut child } = start;
    loop {
        match child.kind() {
            ChildKind::Node => {
                let node = &bvh.nodes[child.index()];
                counter.node();
                let (entries, exits) = local.slabs.meet_children::<L::Node>(node, best.t);
                let bits = entries.le(exits);
                if bits.is_power_of_two() {
                    // A node that is visited next needs no distance, but a leaf does.
                    let slot = bits.trailing_zeros() as usize & 15;
                    let mut distances = [0.0; WIDTH];
                    entries.store(&mut distances);
                    (near, child) = (distances[slot], Child(node.child[slot]));
                    continue;
                }
                if bits != 0 {
                    let (words, nears) = stack.from(top);
                    let order = node.back_to_front(local.slabs.octant());
                    let (word, count) =
                        Sixteen::take_in_order(entries, exits, &node.child, order, nears, words);
                    let last = count - 1;
                    (near, child) = (nears[last as usize % WIDTH], Child(word));
                    top += last;
                    continue;
                }
            }
            ChildKind::Triangles => {
                let visit = LeafContext::new(bvh, near, world.t_min, instance, filter);
                let block = &bvh.triangles[child.index()];
                counter.leaf(|| counters::triangles(block));
                if leaf::triangles::<L, A>(block, &local.ray, &local.shear, visit, best) {
                    return true;
                }
            }
            ChildKind::Spheres => {
                let visit = LeafContext::new(bvh, near, world.t_min, instance, filter);
                let block = &bvh.spheres[child.index()];
                counter.leaf(|| counters::spheres(block));
                if leaf::spheres::<L, A>(block, &local.ray, visit, best) {
                    return true;
                }
            }
            ChildKind::Instance if child.0 == LEAVE_INSTANCE => {
                *local = LocalRay::new(world);
                instance = NONE;
            }
            ChildKind::Instance => {
                let placed = &bvh.instances[child.index()];
                counter.instance();
                let ray = to_local(&world, placed);
                if is_finite(&ray) {
                    let (words, nears) = stack.from(top);
                    (nears[0], words[0]) = (0.0, LEAVE_INSTANCE);
                    top += 1;
                    *local = LocalRay::new(ray);
                    local.slabs.floor = near;
                    instance = child.index() as u32;
                    child = placed.root.child;
                    continue;
                }
            }
        }
        // The next entry that is not beyond the best hit.
        loop {
            if top == TraversalStack::FIRST {
                return false;
            }
            top -= 1;
            near = stack.near(top);
            if near <= best.t {
                child = Child(stack.word(top));
                break;
            }
        }
    }
}
