//! Queries, one ray at a time: nearest hit and any hit.

use super::layout::{Bvh, Child, Kind, Node, PADDING, WIDTH};
use super::triangle::{BlockHits, Shear};
use super::{HitsMut, Rays, sphere, triangle};
use crate::math::{Hit, NONE, Ray, Vector};
use crate::simd::{Float, Kernel, Lanes, Mask};

/// Nodes still to visit, kept by the caller between queries so that none allocates.
#[derive(Default)]
pub struct Stack {
    entries: Vec<Entry>,
}

impl Stack {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        // Twice: below an instance the world's entries stay where they are.
        Self { entries: vec![Entry::default(); 2 * bvh.stack_size + 2] }
    }
}

#[derive(Clone, Copy, Default)]
struct Entry {
    /// Where the ray enters the child's box.
    near: f32,
    child: u32,
}

/// On the stack: the world again, after an instance.
const LEAVE_INSTANCE: u32 = u32::MAX;

/// Nearest hits, one ray after another.
pub(super) struct Closest<'a> {
    pub bvh: &'a Bvh,
    pub rays: Rays<'a>,
    pub stack: &'a mut Stack,
    pub hits: HitsMut<'a>,
}

impl Kernel for Closest<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        for i in 0..self.rays.len() {
            let hit = closest_one::<L>(self.bvh, &self.rays.get(i), self.stack);
            self.hits.t[i] = hit.t;
            self.hits.u[i] = hit.u;
            self.hits.v[i] = hit.v;
            self.hits.primitive[i] = hit.primitive;
            self.hits.instance[i] = hit.instance;
        }
    }
}

/// Any hits, one ray after another.
pub(super) struct Any<'a> {
    pub bvh: &'a Bvh,
    pub rays: Rays<'a>,
    pub stack: &'a mut Stack,
    pub occluded: &'a mut [u32],
}

impl Kernel for Any<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        for i in 0..self.rays.len() {
            self.occluded[i] = any_one::<L>(self.bvh, &self.rays.get(i), self.stack) as u32;
        }
    }
}

impl Rays<'_> {
    #[inline(always)]
    fn get(&self, i: usize) -> Ray<f32> {
        let [ox, oy, oz] = self.origin;
        let [dx, dy, dz] = self.direction;
        Ray {
            origin: Vector { x: ox[i], y: oy[i], z: oz[i] },
            direction: Vector { x: dx[i], y: dy[i], z: dz[i] },
            t_min: self.t_min[i],
            t_max: self.t_max[i],
        }
    }
}

/// The nearest hit of one ray with t_min < t ≤ t_max.
#[inline(always)]
pub fn closest_one<L: Lanes>(bvh: &Bvh, ray: &Ray<f32>, stack: &mut Stack) -> Hit {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    walk::<L, false>(bvh, ray, &mut stack.entries, &mut best);
    if best.is_miss() { Hit::MISS } else { best }
}

/// Whether one ray hits anything with t_min < t ≤ t_max.
#[inline(always)]
pub fn any_one<L: Lanes>(bvh: &Bvh, ray: &Ray<f32>, stack: &mut Stack) -> bool {
    let mut best = Hit { t: ray.t_max, ..Hit::MISS };
    walk::<L, true>(bvh, ray, &mut stack.entries, &mut best)
}

/// Visits the tree nearest child first; with `ANY` stops at the first hit and returns true.
#[inline(always)]
fn walk<L: Lanes, const ANY: bool>(bvh: &Bvh, world: &Ray<f32>, stack: &mut [Entry], best: &mut Hit) -> bool {
    let Some(root) = bvh.root.filter(|_| is_finite(world)) else { return false };
    let mut local = Local::new(*world);
    let Some(mut near) = local.slabs.enter(&root.bounds) else { return false };
    let mut child = root.child;
    let mut instance = NONE;
    let mut top = 0;
    loop {
        match child.kind() {
            _ if near > best.t => {}
            Kind::Node => {
                let entered = local.slabs.enter_children::<L>(&bvh.nodes[child.index()], near, best.t);
                if push(stack, &mut top, entered, &bvh.nodes[child.index()].child) {
                    top -= 1;
                    (near, child) = (stack[top].near, Child(stack[top].child));
                    continue;
                }
            }
            Kind::Triangles => {
                let block = &bvh.triangles[child.index()];
                for lane in (0..block.primitive.len()).step_by(L::Block::WIDTH) {
                    let hits = triangle::intersect::<L::Block>(block, lane, &local.ray, &local.shear);
                    if accept::<_, ANY>(&hits, &block.primitive[lane..], near, world.t_min, instance, best) {
                        return true;
                    }
                }
            }
            Kind::Spheres => {
                let block = &bvh.spheres[child.index()];
                for lane in (0..block.primitive.len()).step_by(L::Block::WIDTH) {
                    let hits = sphere::intersect::<L::Block>(block, lane, &local.ray);
                    if accept::<_, ANY>(&hits, &block.primitive[lane..], near, world.t_min, instance, best) {
                        return true;
                    }
                }
            }
            Kind::Instance if child.0 == LEAVE_INSTANCE => {
                local = Local::new(*world);
                instance = NONE;
            }
            Kind::Instance => {
                let placed = &bvh.instances[child.index()];
                let ray = to_local(world, &placed.to_local);
                if is_finite(&ray) {
                    stack[top] = Entry { near: f32::NEG_INFINITY, child: LEAVE_INSTANCE };
                    top += 1;
                    local = Local::new(ray);
                    instance = child.index() as u32;
                    child = placed.root;
                    continue;
                }
            }
        }
        if top == 0 {
            return false;
        }
        top -= 1;
        (near, child) = (stack[top].near, Child(stack[top].child));
    }
}

/// To a ray that is nowhere every box is open, the unused ones of a node too, and it would
/// go round in circles.
#[inline(always)]
fn is_finite(ray: &Ray<f32>) -> bool {
    let (o, d) = (ray.origin, ray.direction);
    [o.x, o.y, o.z, d.x, d.y, d.z].iter().all(|c| c.is_finite())
}

/// A ray with what is computed from it once for each space.
struct Local {
    ray: Ray<f32>,
    slabs: Slabs,
    shear: Shear,
}

impl Local {
    #[inline(always)]
    fn new(ray: Ray<f32>) -> Self {
        Self { ray, slabs: Slabs::new(&ray), shear: Shear::new(&ray) }
    }
}

/// The ray in an instance's space; its direction keeps whatever length it gets.
#[inline(always)]
fn to_local(ray: &Ray<f32>, rows: &[[f32; 4]; 3]) -> Ray<f32> {
    let (o, d) = (ray.origin, ray.direction);
    let direction = |r: &[f32; 4]| r[0] * d.x + r[1] * d.y + r[2] * d.z;
    let point = |r: &[f32; 4]| r[0] * o.x + r[1] * o.y + r[2] * o.z + r[3];
    let [x, y, z] = rows;
    Ray {
        origin: Vector { x: point(x), y: point(y), z: point(z) },
        direction: Vector { x: direction(x), y: direction(y), z: direction(z) },
        ..*ray
    }
}

/// A ray prepared for boxes: reciprocal directions rounded towards the origin for near
/// planes and away from it for far ones.
struct Slabs {
    origin: [f32; 3],
    near_scale: [f32; 3],
    far_scale: [f32; 3],
    /// Which of a node's planes the ray meets first.
    near_side: [usize; 3],
    t_min: f32,
}

/// The children that a ray enters, and where.
struct Entered {
    bits: u32,
    near: [f32; WIDTH],
}

impl Slabs {
    #[inline(always)]
    fn new(ray: &Ray<f32>) -> Self {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z];
        let reciprocal = direction.map(|d| 1.0 / d);
        Self {
            origin: [ray.origin.x, ray.origin.y, ray.origin.z],
            near_scale: reciprocal.map(|r| r * (1.0 - PADDING)),
            far_scale: reciprocal.map(|r| r * (1.0 + PADDING)),
            near_side: reciprocal.map(|r| r.is_sign_negative() as usize),
            t_min: ray.t_min,
        }
    }

    /// Where the ray enters a box, if it does.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "the axis indexes five arrays")]
    fn enter(&self, bounds: &crate::math::Aabb) -> Option<f32> {
        let corners = [bounds.min, bounds.max];
        let (mut near, mut far) = (self.t_min, f32::INFINITY);
        for axis in 0..3 {
            let side = self.near_side[axis];
            // As for the children below: a NaN (0 · ∞, a ray in the plane) leaves the interval as it is.
            near = Float::max((corners[side][axis] - self.origin[axis]) * self.near_scale[axis], near);
            far = Float::min((corners[1 - side][axis] - self.origin[axis]) * self.far_scale[axis], far);
        }
        (near <= far).then_some(near)
    }

    /// The children whose boxes the ray enters no farther than `t_max`; it enters none before
    /// their parent's `near`.
    #[inline(always)]
    fn enter_children<L: Lanes>(&self, node: &Node, parent_near: f32, t_max: f32) -> Entered {
        let mut entered = Entered { bits: 0, near: [0.0; WIDTH] };
        for lane in (0..WIDTH).step_by(L::Node::WIDTH) {
            let (mut near, mut far) = (L::Node::splat(parent_near), L::Node::splat(t_max));
            for axis in 0..3 {
                let side = self.near_side[axis];
                let near_plane = L::Node::load(&node.planes[side][axis][lane..]);
                let far_plane = L::Node::load(&node.planes[1 - side][axis][lane..]);
                let origin = L::Node::splat(self.origin[axis]);
                near = ((near_plane - origin) * L::Node::splat(self.near_scale[axis])).max(near);
                far = ((far_plane - origin) * L::Node::splat(self.far_scale[axis])).min(far);
            }
            near.store(&mut entered.near[lane..]);
            entered.bits |= near.le(far).bits() << lane;
        }
        entered
    }
}

/// Puts the entered children on the stack, the nearest on top; says whether there is any.
#[inline(always)]
fn push(stack: &mut [Entry], top: &mut usize, entered: Entered, children: &[u32; WIDTH]) -> bool {
    let base = *top;
    let mut bits = entered.bits;
    while bits != 0 {
        let slot = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let entry = Entry { near: entered.near[slot], child: children[slot] };
        let mut place = *top;
        while place > base && stack[place - 1].near < entry.near {
            stack[place] = stack[place - 1];
            place -= 1;
        }
        stack[place] = entry;
        *top += 1;
    }
    *top > base
}

/// Takes the hits of a block that are better than `best`; with `ANY` says whether there is one.
#[inline(always)]
fn accept<T: Float, const ANY: bool>(
    hits: &BlockHits<T>,
    ids: &[u32],
    near: f32,
    t_min: f32,
    instance: u32,
    best: &mut Hit,
) -> bool {
    // NaN distances fail the first comparison.
    let t = hits.t.max(T::splat(near));
    let mask = hits.mask & hits.t.gt(T::splat(t_min)) & t.le(T::splat(best.t));
    let mut bits = mask.bits();
    if bits == 0 {
        return false;
    }
    if ANY {
        return true;
    }
    let (mut ts, mut us, mut vs) = ([0.0; 8], [0.0; 8], [0.0; 8]);
    t.store(&mut ts);
    hits.u.store(&mut us);
    hits.v.store(&mut vs);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let found = Hit { t: ts[lane], u: us[lane], v: vs[lane], primitive: ids[lane], instance };
        if found.t < best.t
            || (found.t == best.t && (found.primitive, found.instance) < (best.primitive, best.instance))
        {
            *best = found;
        }
    }
    false
}
