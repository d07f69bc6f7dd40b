//! What happens at a leaf: the canonical test of its block, and which hit is kept.

use super::answers::Answers;
use super::layout::{SphereBlock, TriangleBlock};
use super::triangle::{Asked, BlockHits, Exact, Shear};
use super::{sphere, triangle};
use crate::math::{Hit, NONE, Ray};
use crate::simd::{Float, Int, Lanes, Mask};

/// Where a ray is when it comes to a leaf.
#[derive(Clone, Copy)]
pub(super) struct Visit {
    /// Where it enters the leaf's box: no hit in it counts as nearer.
    pub near: f32,
    /// Hits count beyond.
    pub t_min: f32,
    /// The instance that it is in.
    pub instance: u32,
}

/// The best hits of rays in lanes; `t` is below 0 for a ray that is done.
#[derive(Clone, Copy)]
pub(super) struct Best<F: Float> {
    pub t: F,
    pub u: F,
    pub v: F,
    pub primitive: F::Int,
}

impl<F: Float> Best<F> {
    /// Takes those hits with a primitive that are better; says which. `near` is where each ray enters the
    /// primitive's leaf.
    #[inline(always)]
    pub fn take<A: Answers>(&mut self, hits: &BlockHits<F>, primitive: u32, near: F, t_min: F) -> F::Mask {
        let id = F::Int::splat(primitive);
        let (t, better) = better_in_lanes(hits, id, near, t_min, (self.t, self.primitive));
        self.t = F::select(better, if A::ANY { F::splat(-1.0) } else { t }, self.t);
        self.u = F::select(better, hits.u, self.u);
        self.v = F::select(better, hits.v, self.v);
        self.primitive = F::Int::select(better, id, self.primitive);
        better
    }

    /// One after another, as many as lanes, none of them in an instance.
    #[inline(always)]
    pub fn hits(&self) -> [Hit; 16] {
        let (mut t, mut u, mut v, mut primitive) = ([0.0; 16], [0.0; 16], [0.0; 16], [0; 16]);
        self.t.store(&mut t);
        self.u.store(&mut u);
        self.v.store(&mut v);
        self.primitive.store(&mut primitive);
        let mut hits = [Hit::MISS; 16];
        for (lane, hit) in hits.iter_mut().enumerate() {
            *hit = Hit { t: t[lane], u: u[lane], v: v[lane], primitive: primitive[lane], instance: NONE };
        }
        hits
    }
}

/// Where rays in lanes hit a primitive, and which of these hits are better than their best ones so far, of
/// which t and primitive are given. At equal distance the smaller number counts. (No primitive is both in the
/// world and in an instance, so that of the instance is never asked for.)
#[inline(always)]
pub(super) fn better_in_lanes<F: Float>(
    hits: &BlockHits<F>,
    primitive: F::Int,
    near: F,
    t_min: F,
    (best, best_primitive): (F, F::Int),
) -> (F, F::Mask) {
    let (t, acceptable) = acceptable(hits, near, t_min, best);
    (t, acceptable & (t.lt(best) | primitive.lt(best_primitive)))
}

/// Tests a block of triangles; where any hit will do it says whether there is a hit no farther than `best`.
#[inline(always)]
pub(super) fn triangles<L: Lanes, A: Answers>(
    block: &TriangleBlock,
    ray: &impl Exact,
    shear: &Shear,
    visit: Visit,
    best: &mut Hit,
) -> bool {
    for lane in (0..block.primitive.len()).step_by(L::Block::WIDTH) {
        let asked = Asked::between(visit.t_min, best.t);
        let hits = triangle::intersect::<L::Block>(block, lane, ray, shear, &asked);
        if accept::<_, A>(&hits, &block.primitive[lane..], visit, best) {
            return true;
        }
    }
    false
}

/// Whether one of a block's triangles is hit no farther than `limit`, without a branch on it.
#[inline(always)]
pub(super) fn hits_triangles<L: Lanes>(
    block: &TriangleBlock,
    ray: &impl Exact,
    shear: &Shear,
    visit: Visit,
    limit: f32,
) -> bool {
    let asked = Asked::between(visit.t_min, limit);
    let mut found = false;
    for lane in (0..block.primitive.len()).step_by(L::Block::WIDTH) {
        let hits = triangle::intersect_all::<L::Block>(block, lane, ray, shear, &asked);
        let (near, t_min) = (L::Block::splat(visit.near), L::Block::splat(visit.t_min));
        found |= acceptable(&hits, near, t_min, L::Block::splat(limit)).1.any();
    }
    found
}

/// The same for spheres.
#[inline(always)]
pub(super) fn spheres<L: Lanes, A: Answers>(
    block: &SphereBlock,
    ray: &Ray<f32>,
    visit: Visit,
    best: &mut Hit,
) -> bool {
    for lane in (0..block.primitive.len()).step_by(L::Block::WIDTH) {
        let hits = sphere::intersect::<L::Block>(block, lane, ray);
        if accept::<_, A>(&hits, &block.primitive[lane..], visit, best) {
            return true;
        }
    }
    false
}

/// Where hits count, and which of them lie no farther than `limit`.
#[inline(always)]
fn acceptable<T: Float>(hits: &BlockHits<T>, near: T, t_min: T, limit: T) -> (T, T::Mask) {
    // NaN distances fail the first comparison.
    let t = hits.t.max(near);
    (t, hits.mask & hits.t.gt(t_min) & t.le(limit))
}

/// Takes the hits of a block that are better than `best`; where any hit will do it says whether there is one.
#[inline(always)]
fn accept<T: Float, A: Answers>(hits: &BlockHits<T>, ids: &[u32], visit: Visit, best: &mut Hit) -> bool {
    let (near, t_min) = (T::splat(visit.near), T::splat(visit.t_min));
    let (t, mask) = acceptable(hits, near, t_min, T::splat(best.t));
    let mut bits = mask.bits();
    if bits == 0 {
        return false;
    }
    if A::ANY {
        return true;
    }
    let (mut ts, mut us, mut vs) = ([0.0; 8], [0.0; 8], [0.0; 8]);
    t.store(&mut ts);
    hits.u.store(&mut us);
    hits.v.store(&mut vs);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let found =
            Hit { t: ts[lane], u: us[lane], v: vs[lane], primitive: ids[lane], instance: visit.instance };
        if found.t < best.t
            || (found.t == best.t && (found.primitive, found.instance) < (best.primitive, best.instance))
        {
            *best = found;
        }
    }
    false
}
