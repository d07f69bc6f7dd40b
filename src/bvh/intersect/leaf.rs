//! Leaf tests: the canonical test of a block, and the choice of the best hit.

use super::hit_sink::HitSink;
use super::sphere;
use super::triangle::{self, AcceptedRange, BlockHits, Exact, Shear};
use crate::bvh::Bvh;
use crate::bvh::layout::sidedness::{AnyHitFilter, PrimitiveCandidate, PrimitiveRef, SPHERE, Sidedness};
use crate::bvh::layout::{Instance, SphereBlock, TriangleBlock};
use crate::math::{Hit, NONE, Ray};
use crate::simd::{Float, Int, Lanes, Mask};

/// The state of a ray at a leaf.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct LeafContext<'a> {
    /// The entry distance of the leaf's box: no hit in it counts as nearer.
    pub near: f32,
    /// The lower end of the t range, exclusive.
    pub t_min: f32,
    /// The instance that the leaf is in.
    pub instance: u32,
    /// Any-hit filter.
    pub filter: AnyHitFilter<'a>,
    /// True if hits of some primitives may be rejected.
    conditional: bool,
    instances: &'a [Instance],
}

impl<'a> LeafContext<'a> {
    /// The context at a leaf of a tree.
    #[inline(always)]
    pub fn new(bvh: &'a Bvh, near: f32, t_min: f32, instance: u32, filter: AnyHitFilter<'a>) -> Self {
        let Bvh { conditional, instances, .. } = bvh;
        Self { near, t_min, instance, filter, conditional: *conditional, instances }
    }

    /// The context in a tree of which every hit counts.
    #[inline(always)]
    pub fn everywhere(near: f32, t_min: f32) -> LeafContext<'static> {
        let filter = AnyHitFilter::ACCEPT_ALL;
        LeafContext { near, t_min, instance: NONE, filter, conditional: false, instances: &[] }
    }

    /// The sidedness of all primitives, if their instance overrides it.
    #[inline(always)]
    fn given(&self) -> Option<Sidedness> {
        self.instances.get(self.instance as usize).and_then(|instance| instance.sidedness)
    }
}

/// The best hits of rays in lanes; `t` is negative for a finished ray.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct Best<F: Float> {
    pub t: F,
    pub u: F,
    pub v: F,
    pub primitive: F::Int,
}

impl<F: Float> Best<F> {
    /// Takes the better hits with a primitive and returns their lanes. `near` is each ray's entry into the primitive's
    /// leaf.
    #[inline(always)]
    pub fn take<A: HitSink>(
        &mut self,
        hits: &BlockHits<F>,
        candidate: PrimitiveCandidate,
        near: F,
        t_min: F,
        filters: &impl AnyHitFilters,
    ) -> F::Mask {
        let id = F::Int::splat(candidate.id);
        let before = (self.t, self.primitive);
        let (t, better) = better_in_lanes(hits, candidate, near, t_min, before, filters);
        self.t = F::select(better, if A::ANY { F::splat(-1.0) } else { t }, self.t);
        self.u = F::select(better, hits.u, self.u);
        self.v = F::select(better, hits.v, self.v);
        self.primitive = F::Int::select(better, id, self.primitive);
        better
    }

    /// The hits by lane, of which as many are valid as there are lanes, none of them in an instance.
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

/// The any-hit filters of rays in lanes. (Not a closure: it would be compiled without the instruction set.)
pub(in crate::bvh) trait AnyHitFilters {
    /// The filter of the ray in a lane.
    fn filter(&self, lane: usize) -> AnyHitFilter<'_>;
}

/// The distances at which rays in lanes hit a primitive, and the lanes whose hits are better than the best ones so far,
/// given by t and primitive. At equal distance the smaller id wins. (No primitive is both in the world and in an
/// instance, so the instance's id is never needed.)
#[inline(always)]
pub(in crate::bvh) fn better_in_lanes<F: Float>(
    hits: &BlockHits<F>,
    candidate: PrimitiveCandidate,
    near: F,
    t_min: F,
    best: (F, F::Int),
    filters: &impl AnyHitFilters,
) -> (F, F::Mask) {
    let (t, acceptable) = acceptable(hits, near, t_min, best.0);
    let better = acceptable & precedes(t, candidate.id, best);
    let front = hits.side.gt(F::zero());
    if candidate.sidedness == Sidedness::Always {
        return (t, better);
    }
    let sidedness = filters.filter(0).culling().of(candidate.sidedness);
    match sidedness {
        Sidedness::Always => (t, better),
        Sidedness::Front => (t, better & front),
        Sidedness::Back | Sidedness::Filtered => {
            let far = hits.far.max(near);
            let leaves = front & hits.far.gt(hits.t) & far.le(best.0) & precedes(far, candidate.id, best);
            if sidedness == Sidedness::Back {
                return (F::select(front, far, t), better & (leaves | !front));
            }
            ask(hits, candidate.id, [t, far], [better, leaves], filters)
        }
    }
}

/// The lanes whose hits with a primitive, no farther than the best ones so far, are better.
#[inline(always)]
fn precedes<F: Float>(t: F, primitive: u32, (best, best_primitive): (F, F::Int)) -> F::Mask {
    t.lt(best) | F::Int::splat(primitive).lt(best_primitive)
}

/// The accepted ones of the better hits, each at the first accepted one of its two distances. (Most have only one. A
/// sphere may be rejected where a ray enters it and accepted where the ray leaves.)
#[inline(always)]
fn ask<F: Float>(
    hits: &BlockHits<F>,
    id: u32,
    [near, far]: [F; 2],
    [better, leaves]: [F::Mask; 2],
    filters: &impl AnyHitFilters,
) -> (F, F::Mask) {
    let (mut t, mut ts) = ([0.0; 16], [0.0; 16]);
    let (mut u, mut v, mut side) = ([0.0; 16], [0.0; 16], [0.0; 16]);
    near.store(&mut t);
    far.store(&mut ts);
    hits.u.store(&mut u);
    hits.v.store(&mut v);
    hits.side.store(&mut side);
    let (mut bits, mut there) = (better.bits(), 0);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize % 16;
        bits &= bits - 1;
        let hit = Hit { t: t[lane], u: u[lane], v: v[lane], primitive: id, instance: NONE };
        let filter = filters.filter(lane);
        let mut met = filter.accepts(&hit, side[lane] > 0.0);
        if !met && leaves.bits() >> lane & 1 == 1 && filter.accepts(&Hit { t: ts[lane], ..hit }, false) {
            t[lane] = ts[lane];
            met = true;
        }
        there |= u32::from(met) << lane;
    }
    (F::load(&t), F::Mask::from_bits(there))
}

/// Tests a block of triangles; for any-hit queries, returns true if there is a hit no farther than `best`.
#[inline(always)]
pub(in crate::bvh) fn triangles<L: Lanes, A: HitSink>(
    block: &TriangleBlock,
    ray: &impl Exact,
    shear: &Shear,
    visit: LeafContext,
    best: &mut Hit,
) -> bool {
    for lane in (0..block.words.len()).step_by(L::Block::WIDTH) {
        let asked = AcceptedRange::between(visit.t_min, best.t);
        let hits = triangle::intersect::<L::Block>(block, lane, ray, shear, &asked);
        if accept::<_, A>(&hits, &block.words[lane..], 0, visit, best) {
            return true;
        }
    }
    false
}

/// Tests a block of spheres, as [`triangles`] does.
#[inline(always)]
pub(in crate::bvh) fn spheres<L: Lanes, A: HitSink>(
    block: &SphereBlock,
    ray: &Ray<f32>,
    visit: LeafContext,
    best: &mut Hit,
) -> bool {
    let line = sphere::Line::new(ray);
    for lane in (0..block.words.len()).step_by(L::Block::WIDTH) {
        let hits = sphere::intersect::<L::Block>(block, lane, &line, L::Block::splat(visit.t_min));
        if accept::<_, A>(&hits, &block.words[lane..], SPHERE, visit, best) {
            return true;
        }
    }
    false
}

/// The hit distances, no nearer than `near`, and the lanes whose hits count and lie no farther than `limit`.
#[inline(always)]
pub(in crate::bvh) fn acceptable<T: Float>(hits: &BlockHits<T>, near: T, t_min: T, limit: T) -> (T, T::Mask) {
    // NaN distances fail the first comparison.
    let t = hits.t.max(near);
    (t, hits.mask & hits.t.gt(t_min) & t.le(limit))
}

/// Takes the hits of a block that are better than `best`; for any-hit queries, returns true if there is one. `flag` is
/// that of the primitives' ids.
#[inline(always)]
fn accept<T: Float, A: HitSink>(
    hits: &BlockHits<T>,
    words: &[u32],
    flag: u32,
    visit: LeafContext,
    best: &mut Hit,
) -> bool {
    let (near, t_min) = (T::splat(visit.near), T::splat(visit.t_min));
    let (t, mask) = acceptable(hits, near, t_min, T::splat(best.t));
    let mut bits = mask.bits();
    if bits == 0 {
        return false;
    }
    if A::ANY && !visit.conditional {
        return true;
    }
    let (mut ts, mut us, mut vs) = ([0.0; 8], [0.0; 8], [0.0; 8]);
    t.store(&mut ts);
    hits.u.store(&mut us);
    hits.v.store(&mut vs);
    let (mut sides, mut fars) = ([0.0; 8], [0.0; 8]);
    if visit.conditional {
        hits.side.store(&mut sides);
        hits.far.store(&mut fars);
    }
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let word = PrimitiveRef(words[lane]);
        let mut found = Hit {
            t: ts[lane],
            u: us[lane],
            v: vs[lane],
            primitive: word.number() | flag,
            instance: visit.instance,
        };
        if visit.conditional && !accepts(&mut found, word, sides[lane], fars[lane], &visit, best) {
            continue;
        }
        if A::ANY {
            return true;
        }
        if is_better(&found, best) {
            *best = found;
        }
    }
    false
}

/// True if `found` is better than `best`. Of equally distant hits, the one with the smaller ids wins.
#[inline(always)]
pub(in crate::bvh) fn is_better(found: &Hit, best: &Hit) -> bool {
    found.t < best.t
        || (found.t == best.t && (found.primitive, found.instance) < (best.primitive, best.instance))
}

/// True if the hit counts, perhaps moved to where the ray leaves a sphere.
#[inline(always)]
fn accepts(hit: &mut Hit, word: PrimitiveRef, side: f32, far: f32, visit: &LeafContext, best: &Hit) -> bool {
    let front = side > 0.0;
    let sidedness = visit.filter.culling().of(visit.given().unwrap_or(word.sidedness()));
    let here = match sidedness {
        Sidedness::Always => true,
        Sidedness::Front => front,
        Sidedness::Back => !front,
        // The filter is only called for hits that would be taken.
        Sidedness::Filtered => is_better(hit, best) && visit.filter.accepts(hit, front),
    };
    if here || sidedness == Sidedness::Front || !front || far.is_nan() || far <= hit.t {
        return here;
    }
    hit.t = Float::max(far, visit.near);
    let counts = hit.t <= best.t && is_better(hit, best);
    counts && (sidedness == Sidedness::Back || visit.filter.accepts(hit, false))
}
