//! What happens at a leaf: the canonical test of its block, and which hit is kept.

use super::layout::{SphereBlock, TriangleBlock};
use super::query::Answers;
use super::triangle::{Asked, BlockHits, Exact, Shear};
use super::{sphere, triangle};
use crate::math::{Hit, Ray};
use crate::simd::{Float, Lanes, Mask};

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
        found |= acceptable(&hits, visit, limit).1.any();
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

/// Where a block's hits count, and which of them lie no farther than `limit`.
#[inline(always)]
fn acceptable<T: Float>(hits: &BlockHits<T>, visit: Visit, limit: f32) -> (T, T::Mask) {
    // NaN distances fail the first comparison.
    let t = hits.t.max(T::splat(visit.near));
    (t, hits.mask & hits.t.gt(T::splat(visit.t_min)) & t.le(T::splat(limit)))
}

/// Takes the hits of a block that are better than `best`; where any hit will do it says whether there is one.
#[inline(always)]
fn accept<T: Float, A: Answers>(hits: &BlockHits<T>, ids: &[u32], visit: Visit, best: &mut Hit) -> bool {
    let (t, mask) = acceptable(hits, visit, best.t);
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
