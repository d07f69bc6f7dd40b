//! Block tests for one or two interleaved rays, without a branch on whether there is a hit.

use std::hint::select_unpredictable;

use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::{acceptable, is_better};
use crate::bvh::intersect::sphere;
use crate::bvh::intersect::triangle::{self, AcceptedRange, BlockHits, Exact, Shear};
use crate::bvh::kernels::prepare::RayRow;
use crate::bvh::layout::sidedness::{PrimitiveRef, SPHERE};
use crate::bvh::layout::{BLOCK, Bvh, Child, SphereBlock, TriangleBlock};
use crate::math::{Hit, Ray};
use crate::simd::{Float, Mask};

/// A block of primitives that rays are tested against.
pub trait LeafBlock {
    /// A ray prepared for the test.
    type Line: Copy;
    /// The flag of the primitives' ids.
    const FLAG: u32;

    /// The block of a child word.
    fn of(bvh: &Bvh, child: Child) -> &Self;
    /// Prepares a ray for the test, from its row and its direction.
    fn line(row: &RayRow, direction: &[f32; 3]) -> Self::Line;
    /// The primitive references.
    fn words(&self) -> &[u32; BLOCK];
    /// The canonical test, with a block in one register. Doubtful t stay as they are.
    fn meet<F: Float>(&self, line: &Self::Line, asked: &AcceptedRange<F>) -> BlockHits<F>;
    /// [`LeafBlock::meet`] for the blocks of two rays, one in the low half of the 16 lanes and one in the high half.
    fn meet_two<F: Float>(
        blocks: [&Self; 2],
        lines: [&Self::Line; 2],
        asked: &AcceptedRange<F>,
    ) -> BlockHits<F>;
    /// Recomputes a doubtful t.
    fn exact_t(&self, place: usize, ray: &Ray<f32>) -> f32;
}

impl LeafBlock for TriangleBlock {
    type Line = Shear;
    const FLAG: u32 = 0;

    #[inline(always)]
    fn of(bvh: &Bvh, child: Child) -> &Self {
        &bvh.triangles[child.index()]
    }
    #[inline(always)]
    fn line(row: &RayRow, _: &[f32; 3]) -> Shear {
        row.shear()
    }
    #[inline(always)]
    fn words(&self) -> &[u32; BLOCK] {
        &self.words
    }
    #[inline(always)]
    fn meet<F: Float>(&self, line: &Shear, asked: &AcceptedRange<F>) -> BlockHits<F> {
        triangle::intersect_roughly(self, 0, line, asked)
    }
    #[inline(always)]
    fn meet_two<F: Float>(blocks: [&Self; 2], lines: [&Shear; 2], asked: &AcceptedRange<F>) -> BlockHits<F> {
        triangle::intersect_two(blocks, lines, asked)
    }
    #[inline(always)]
    fn exact_t(&self, place: usize, ray: &Ray<f32>) -> f32 {
        triangle::exact_t(self.corners(place), ray)
    }
}

impl LeafBlock for SphereBlock {
    type Line = sphere::Line;
    const FLAG: u32 = SPHERE;

    #[inline(always)]
    fn of(bvh: &Bvh, child: Child) -> &Self {
        &bvh.spheres[child.index()]
    }
    #[inline(always)]
    fn line(row: &RayRow, direction: &[f32; 3]) -> sphere::Line {
        sphere::Line { origin: row.origin(), direction: *direction }
    }
    #[inline(always)]
    fn words(&self) -> &[u32; BLOCK] {
        &self.words
    }
    #[inline(always)]
    fn meet<F: Float>(&self, line: &sphere::Line, asked: &AcceptedRange<F>) -> BlockHits<F> {
        sphere::intersect(self, 0, line, asked.t_min)
    }
    #[inline(always)]
    fn meet_two<F: Float>(
        blocks: [&Self; 2],
        lines: [&sphere::Line; 2],
        asked: &AcceptedRange<F>,
    ) -> BlockHits<F> {
        sphere::intersect_two(blocks, lines, asked.t_min)
    }
    fn exact_t(&self, _: usize, _: &Ray<f32>) -> f32 {
        // A sphere's t is never doubtful.
        f32::NAN
    }
}

/// A ray at a block of which every hit counts.
pub struct TwoRayTest<'a, B: LeafBlock, E> {
    pub block: &'a B,
    pub line: B::Line,
    /// The entry distance of the block's box; it does not matter for any-hit queries.
    pub near: f32,
    /// The lower end of the t range, exclusive.
    pub t_min: f32,
    /// The instance that the ray is in.
    pub instance: u32,
    /// The ray itself, in case it is needed.
    pub exact: E,
}

impl<B: LeafBlock, E: Exact + Copy> TwoRayTest<'_, B, E> {
    /// The canonical test, with blocks in one register: replaces `best` by a better hit, without a branch on whether
    /// there is one.
    #[inline(always)]
    pub fn test<F: Float, A: HitSink>(&self, best: &mut Hit) {
        let asked = AcceptedRange::between(self.t_min, best.t);
        let hits = self.block.meet::<F>(&self.line, &asked);
        self.take::<A>(&TwoRayMasks::new::<A, F>(&hits, F::splat(self.near), &asked), 0, best);
    }

    /// Takes the results of eight lanes, from `first` on.
    #[inline(always)]
    fn take<A: HitSink>(&self, seen: &TwoRayMasks, first: usize, best: &mut Hit) {
        let (bits, doubtful) = (seen.hits >> first & 0xff, seen.doubtful >> first & 0xff);
        let (found, place) = (bits != 0, bits.trailing_zeros() as usize % 8);
        let lane = first + place;
        let is_settled = doubtful == 0
            && (A::ANY || (bits & bits.wrapping_sub(1) == 0) & !(found & (seen.values.t[lane] == best.t)));
        if !is_settled {
            let Self { block, near, t_min, instance, exact, .. } = *self;
            let closer = ExactTest { block, near, t_min, instance, exact, bits, doubtful, first };
            return closer.take(&seen.values, A::ANY, best);
        }
        if A::ANY {
            best.primitive = select_unpredictable(found, 0, best.primitive);
            return;
        }
        best.t = select_unpredictable(found, seen.values.t[lane], best.t);
        best.u = select_unpredictable(found, seen.values.u[lane], best.u);
        best.v = select_unpredictable(found, seen.values.v[lane], best.v);
        best.primitive = select_unpredictable(
            found,
            PrimitiveRef(self.block.words()[place]).number() | B::FLAG,
            best.primitive,
        );
        best.instance = select_unpredictable(found, self.instance, best.instance);
    }
}

/// [`TwoRayTest::test`] for two rays in sixteen lanes.
#[inline(always)]
pub fn test_two<F: Float, A: HitSink, B: LeafBlock, E: Exact + Copy>(
    [a, b]: [&TwoRayTest<B, E>; 2],
    [best, other]: [&mut Hit; 2],
) {
    let asked = AcceptedRange {
        lanes: F::Mask::first(F::WIDTH),
        t_min: F::splat_halves(a.t_min, b.t_min),
        t_max: F::splat_halves(best.t, other.t),
    };
    let hits = B::meet_two::<F>([a.block, b.block], [&a.line, &b.line], &asked);
    let seen = TwoRayMasks::new::<A, F>(&hits, F::splat_halves(a.near, b.near), &asked);
    a.take::<A>(&seen, 0, best);
    b.take::<A>(&seen, 8, other);
}

/// The results of a block test.
struct TwoRayMasks {
    /// The hits that count, as bits.
    hits: u32,
    /// The lanes in which t is less exact than it should be, so that it is not known whether their hits count.
    doubtful: u32,
    values: TwoRayValues,
}

/// The values of the hits, by lanes.
struct TwoRayValues {
    t: [f32; 16],
    u: [f32; 16],
    v: [f32; 16],
}

impl TwoRayMasks {
    #[inline(always)]
    fn new<A: HitSink, F: Float>(hits: &BlockHits<F>, near: F, asked: &AcceptedRange<F>) -> Self {
        let (t, mask) = acceptable(hits, if A::ANY { asked.t_min } else { near }, asked.t_min, asked.t_max);
        let lanes = [0.0; 16];
        let mut values = TwoRayValues { t: lanes, u: lanes, v: lanes };
        t.store(&mut values.t);
        hits.u.store(&mut values.u);
        hits.v.store(&mut values.v);
        let doubtful = hits.doubtful.bits();
        Self { hits: mask.bits() & !doubtful, doubtful, values }
    }
}

/// The rare cases: t has to be recomputed, or more than one primitive is hit, or one is as far as the best hit so far.
/// For the fields, see [`TwoRayTest`] and [`TwoRayMasks`].
struct ExactTest<'a, B, E> {
    block: &'a B,
    near: f32,
    t_min: f32,
    instance: u32,
    exact: E,
    bits: u32,
    doubtful: u32,
    first: usize,
}

impl<B: LeafBlock, E: Exact> ExactTest<'_, B, E> {
    #[cold]
    #[inline(never)]
    fn take(self, values: &TwoRayValues, any: bool, best: &mut Hit) {
        let (limit, mut todo) = (best.t, self.bits | self.doubtful);
        while todo != 0 {
            let place = todo.trailing_zeros() as usize % 8;
            todo &= todo - 1;
            let lane = (self.first + place) % 16;
            let mut t = values.t[lane];
            if self.doubtful >> place & 1 == 1 {
                let exact = self.block.exact_t(place, &self.exact.ray());
                t = Float::max(exact, self.near);
                // NaN fails the first comparison.
                if !(exact > self.t_min && t <= limit) {
                    continue;
                }
            }
            if any {
                // Any-hit: the primitive's id is not needed.
                best.primitive = 0;
                return;
            }
            let primitive = PrimitiveRef(self.block.words()[place]).number() | B::FLAG;
            let found = Hit { t, u: values.u[lane], v: values.v[lane], primitive, instance: self.instance };
            if is_better(&found, best) {
                *best = found;
            }
        }
    }
}
