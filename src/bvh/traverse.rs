//! One ray at a time: what the recursive schedule uses, and the oracle of the queue kernels.

use super::Rays;
use super::layout::{Bvh, Child, Kind, WIDTH};
use super::leaf::{self, Visit};
use super::query::{Answers, Stack};
use super::ray::{Local, Slabs, is_finite, to_local};
use crate::math::{Hit, NONE, Ray};
use crate::simd::sixteen::{NO_KEY, key, key_distance};
use crate::simd::{Lanes, Sixteen};

/// Nodes still to visit.
pub(super) struct Keys(Vec<u64>);

impl Keys {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        // Twice: below an instance the world's entries stay where they are. And room for a
        // node's keys, which are written sixteen at a time.
        Self(vec![0; 2 * bvh.stack_size + 2 + WIDTH])
    }
}

/// On the stack: the world again, after an instance.
pub(super) const LEAVE_INSTANCE: u32 = u32::MAX;

/// Answers a queue, ray by ray.
#[inline(always)]
pub(super) fn each<L: Lanes, A: Answers>(bvh: &Bvh, rays: Rays, keys: &mut Keys, answers: &mut A) {
    for i in 0..rays.len() {
        let ray = rays.get(i);
        let mut best = Hit { t: ray.t_max, ..Hit::MISS };
        if let Some(start) = start(bvh, &ray) {
            from::<L, A>(bvh, &ray, start, keys, &mut best);
        }
        answers.put(i, &best);
    }
}

/// The tree's root and where a ray enters it.
#[inline(always)]
pub(super) fn start(bvh: &Bvh, ray: &Ray<f32>) -> Option<u64> {
    let root = bvh.root.filter(|_| is_finite(ray))?;
    let near = Slabs::new(ray).enter(&root.bounds).filter(|near| *near <= ray.t_max)?;
    Some(key(near, root.child.0))
}

/// What a ray meets in a part of the tree, if it is better than `best`; whether the query is
/// answered, since any hit will do.
#[inline(always)]
pub(super) fn from<L: Lanes, A: Answers>(
    bvh: &Bvh,
    ray: &Ray<f32>,
    start: u64,
    keys: &mut Keys,
    best: &mut Hit,
) -> bool {
    if !A::ANY {
        return walk::<L, false>(bvh, ray, start, &mut keys.0, best);
    }
    let found = walk::<L, true>(bvh, ray, start, &mut keys.0, best);
    if found {
        // Which one it is, nobody asks.
        best.primitive = 0;
    }
    found
}

/// The nearest hit of one ray with t_min < t ≤ t_max.
#[inline(always)]
pub fn closest_one<L: Lanes>(bvh: &Bvh, ray: &Ray<f32>, stack: &mut Stack) -> Hit {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    if let Some(start) = start(bvh, ray) {
        walk::<L, false>(bvh, ray, start, &mut stack.single.0, &mut best);
    }
    if best.is_miss() { Hit::MISS } else { best }
}

/// Whether one ray hits anything with t_min < t ≤ t_max.
#[inline(always)]
pub fn any_one<L: Lanes>(bvh: &Bvh, ray: &Ray<f32>, stack: &mut Stack) -> bool {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    match start(bvh, ray) {
        Some(start) => walk::<L, true>(bvh, ray, start, &mut stack.single.0, &mut best),
        None => false,
    }
}

/// Visits the tree nearest child first; with `ANY` stops at the first hit and returns true.
#[inline(always)]
fn walk<L: Lanes, const ANY: bool>(
    bvh: &Bvh,
    world: &Ray<f32>,
    mut current: u64,
    stack: &mut [u64],
    best: &mut Hit,
) -> bool {
    let mut local = Local::new(*world);
    let mut instance = NONE;
    let mut top = 0;
    loop {
        let child = Child(current as u32);
        match child.kind() {
            Kind::Node => {
                let node = &bvh.nodes[child.index()];
                let (near, bits) = local.slabs.enter_children::<L::Node>(node, best.t);
                if bits.is_power_of_two() {
                    // No distance is needed of a node that is visited at once, but of a leaf.
                    let slot = bits.trailing_zeros() as usize & 15;
                    let mut distances = [0.0; WIDTH];
                    near.store(&mut distances);
                    current = key(distances[slot], node.child[slot]);
                    continue;
                }
                if bits != 0
                    && let Some(room) = stack[top..].first_chunk_mut::<WIDTH>()
                {
                    current = near.take_nearest(&node.child, bits, room);
                    top += bits.count_ones() as usize - 1;
                    continue;
                }
            }
            Kind::Triangles => {
                let visit = Visit { near: key_distance(current), t_min: world.t_min, instance };
                if leaf::triangles::<L, ANY>(
                    &bvh.triangles[child.index()],
                    &local.ray,
                    &local.shear,
                    visit,
                    best,
                ) {
                    return true;
                }
            }
            Kind::Spheres => {
                let visit = Visit { near: key_distance(current), t_min: world.t_min, instance };
                if leaf::spheres::<L, ANY>(&bvh.spheres[child.index()], &local.ray, visit, best) {
                    return true;
                }
            }
            Kind::Instance if child.0 == LEAVE_INSTANCE => {
                local = Local::new(*world);
                instance = NONE;
            }
            Kind::Instance => {
                let placed = &bvh.instances[child.index()];
                let ray = to_local(world, placed);
                if is_finite(&ray) {
                    stack[top] = key(0.0, LEAVE_INSTANCE);
                    top += 1;
                    local = Local::new(ray);
                    local.slabs.floor = key_distance(current);
                    instance = child.index() as u32;
                    current = key(local.slabs.floor, placed.root.0);
                    continue;
                }
            }
        }
        // The next that is not beyond the best hit.
        current = NO_KEY;
        while top > 0 {
            top -= 1;
            if key_distance(stack[top]) <= best.t {
                current = stack[top];
                break;
            }
        }
        if current == NO_KEY {
            return false;
        }
    }
}
