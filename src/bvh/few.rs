//! A kernel for trees of a few leaves: a ray a lane, every leaf in turn.
//!
//! In a Cornell box a ray meets most of the boxes there are, and getting into and out of a
//! traversal costs more than the traversal. Here nothing is walked: 16 rays, wherever they go,
//! meet the boxes of all leaves, then the triangles in those that one of them enters. Nothing
//! of it is a decision of one ray's.

use super::Rays;
use super::layout::{Bvh, Child, Kind};
use super::query::Answers;
use super::ray::slab_scales;
use super::triangle::{Longest, exact_t, intersect_rays};
use crate::math::{Hit, NONE};
use crate::simd::{Float, Int, Lanes, Mask};

/// More blocks than this are walked. (Measured on cut-down bumpy meshes.)
const MOST_BLOCKS: usize = 12;

/// The leaves of a tree.
pub(super) struct Few {
    leaves: Vec<Leaf>,
}

/// The planes of a leaf's box, lower ones first, and its triangles: corners and ids.
struct Leaf {
    planes: [[f32; 3]; 2],
    triangles: Vec<([[f32; 3]; 3], u32)>,
}

/// What is known of 16 rays.
struct Group<F: Float> {
    origin: [F; 3],
    near_scale: [F; 3],
    far_scale: [F; 3],
    /// Where a component of the direction is negative.
    backwards: [F::Mask; 3],
    longest: Longest<F>,
    shear: [F; 3],
    t_min: F,
    best: Best<F>,
}

#[derive(Clone, Copy)]
struct Best<F: Float> {
    /// Below 0 for a ray that is done.
    t: F,
    u: F,
    v: F,
    primitive: F::Int,
}

impl Few {
    /// The leaves of a tree, if they are few and nothing but triangles.
    pub fn new(bvh: &Bvh) -> Option<Self> {
        let root = bvh.root?;
        if bvh.triangles.len() > MOST_BLOCKS || !bvh.instances.is_empty() || !bvh.spheres.is_empty() {
            return None;
        }
        let mut leaves = Vec::new();
        let planes = [root.bounds.min.to_array(), root.bounds.max.to_array()];
        let mut todo = vec![(root.child, planes)];
        while let Some((child, planes)) = todo.pop() {
            match child.kind() {
                Kind::Triangles => {
                    let block = &bvh.triangles[child.index()];
                    let places = (0..block.primitive.len()).filter(|place| block.primitive[*place] != NONE);
                    let triangles =
                        places.map(|place| (block.corners(place), block.primitive[place])).collect();
                    leaves.push(Leaf { planes, triangles });
                }
                Kind::Node => {
                    let node = &bvh.nodes[child.index()];
                    for (slot, child) in node.child.iter().enumerate() {
                        let planes = [0, 1].map(|side| node.planes.map(|axis| axis[side][slot]));
                        // What is not used lies nowhere.
                        if planes[0][0] <= planes[1][0] {
                            todo.push((Child(*child), planes));
                        }
                    }
                }
                _ => return None,
            }
        }
        Some(Self { leaves })
    }

    /// Answers all rays.
    #[inline(always)]
    pub fn trace<L: Lanes, A: Answers>(&self, rays: &Rays, answers: &mut A) {
        let (width, count) = (L::Queue::WIDTH, rays.len());
        for first in (0..count).step_by(width) {
            let lanes = width.min(count - first);
            let mut group = Group::<L::Queue>::load(rays, first, lanes);
            self.visit::<L::Queue, A>(rays, first, &mut group);
            group.answer(first, lanes, answers);
        }
    }

    #[inline(always)]
    fn visit<F: Float, A: Answers>(&self, rays: &Rays, first: usize, group: &mut Group<F>) {
        for leaf in &self.leaves {
            let (near, entered) = group.enter(&leaf.planes);
            if !entered.any() {
                continue;
            }
            for (corners, primitive) in &leaf.triangles {
                group.test::<A>(corners, *primitive, near, entered, rays, first);
            }
            if A::ANY && !group.best.t.ge(F::zero()).any() {
                return;
            }
        }
    }
}

impl<F: Float> Group<F> {
    #[inline(always)]
    fn load(rays: &Rays, first: usize, lanes: usize) -> Self {
        let origin = [0, 1, 2].map(|axis| padded::<F>(&rays.origin[axis][first..], lanes));
        let direction = [0, 1, 2].map(|axis| padded::<F>(&rays.direction[axis][first..], lanes));
        let (zero, none) = (F::zero(), F::Mask::from_bits(0));
        let (mut near_scale, mut far_scale) = ([zero; 3], [zero; 3]);
        let (mut reciprocal, mut backwards) = ([zero; 3], [none; 3]);
        // NaN where something is not finite.
        let mut zeros = zero;
        for axis in 0..3 {
            let r = F::one() / direction[axis];
            (near_scale[axis], far_scale[axis]) = slab_scales(r);
            backwards[axis] = !r.to_bits().shr::<31>().eq(F::Int::splat(0));
            reciprocal[axis] = r;
            zeros = zeros + origin[axis] * zero + direction[axis] * zero;
        }
        let longest = Longest::new(direction);
        let d = longest.rename(direction);
        let r = longest.rename(reciprocal)[2];
        // A NaN stays one, −0 becomes 0.
        let t_min = zero.max(padded::<F>(&rays.t_min[first..], lanes)) + zero;
        let t_max = padded::<F>(&rays.t_max[first..], lanes);
        let alive = zeros.eq(zero) & t_min.le(t_max) & F::Mask::first(lanes);
        let best = Best {
            t: F::select(alive, t_max, F::splat(-1.0)),
            u: zero,
            v: zero,
            primitive: F::Int::splat(NONE),
        };
        let shear = [d[0] * r, d[1] * r, r];
        Self { origin, near_scale, far_scale, backwards, longest, shear, t_min, best }
    }

    /// Where the rays enter a box, and which of them do.
    #[inline(always)]
    fn enter(&self, planes: &[[f32; 3]; 2]) -> (F, F::Mask) {
        let (mut near, mut far) = (self.t_min, self.best.t);
        let [lows, highs] = planes;
        for (axis, (low, high)) in lows.iter().zip(highs).enumerate() {
            let (low, high) = (F::splat(*low), F::splat(*high));
            let near_plane = F::select(self.backwards[axis], high, low);
            let far_plane = F::select(self.backwards[axis], low, high);
            near = ((self.origin[axis] - near_plane) * self.near_scale[axis]).max(near);
            far = ((self.origin[axis] - far_plane) * self.far_scale[axis]).min(far);
        }
        (near, near.le(far))
    }

    /// One triangle against all rays that have entered its leaf.
    #[inline(always)]
    fn test<A: Answers>(
        &mut self,
        vertices: &[[f32; 3]; 3],
        primitive: u32,
        near: F,
        entered: F::Mask,
        rays: &Rays,
        first: usize,
    ) {
        let mut seen = [[F::zero(); 3]; 3];
        for (seen, corner) in seen.iter_mut().zip(vertices) {
            let mut from = [F::zero(); 3];
            for ((from, corner), origin) in from.iter_mut().zip(corner).zip(self.origin) {
                *from = F::splat(*corner) - origin;
            }
            *seen = self.longest.rename(from);
        }
        let hits = intersect_rays(seen, &self.shear, |lane| exact_t(*vertices, &rays.get(first + lane)));
        let best = self.best.t;
        let t = hits.t.max(near);
        let beyond = hits.mask & entered & hits.t.gt(self.t_min) & t.le(best);
        let id = F::Int::splat(primitive);
        let better = beyond & (t.lt(best) | id.lt(self.best.primitive));
        if !better.any() {
            return;
        }
        self.best = Best {
            t: F::select(better, if A::ANY { F::splat(-1.0) } else { t }, best),
            u: F::select(better, hits.u, self.best.u),
            v: F::select(better, hits.v, self.best.v),
            primitive: F::Int::select(better, id, self.best.primitive),
        };
    }

    #[inline(always)]
    fn answer<A: Answers>(&self, first: usize, lanes: usize, answers: &mut A) {
        let (mut t, mut u, mut v, mut primitive) = ([0.0; 16], [0.0; 16], [0.0; 16], [0; 16]);
        self.best.t.store(&mut t);
        self.best.u.store(&mut u);
        self.best.v.store(&mut v);
        self.best.primitive.store(&mut primitive);
        for lane in 0..lanes {
            let hit = Hit { t: t[lane], u: u[lane], v: v[lane], primitive: primitive[lane], instance: NONE };
            answers.put(first + lane, &hit);
        }
    }
}

/// The front of a column, whose end may be near.
#[inline(always)]
fn padded<F: Float>(column: &[f32], lanes: usize) -> F {
    if column.len() >= F::WIDTH {
        return F::load(column);
    }
    let mut values = [0.0; 16];
    values[..lanes].copy_from_slice(&column[..lanes]);
    F::load(&values)
}
