//! Leaf tests for the rays of a list.

use super::rows::{LANES, Quad, ROW, best, finish, put_best};
use super::{StreamScene, StreamWalk, numbers};
use crate::bvh::Rays;
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::{self, AnyHitFilters, Best, LeafContext};
use crate::bvh::intersect::sphere;
use crate::bvh::intersect::triangle::{self, AcceptedRange, BlockHits, Exact, ExactRays, Shear};
use crate::bvh::kernels::direction_classes::OCTANTS;
use crate::bvh::layout::sidedness::{AnyHitFilter, PrimitiveCandidate, PrimitiveRef};
use crate::bvh::layout::{Child, ChildKind, SphereBlock, TriangleBlock};
use crate::math::{NONE, Ray};
use crate::simd::{Float, Int, Lanes, Mask};

/// Rays of a list at a leaf, a ray a lane.
struct AtLeaf<F: Float> {
    /// The numbers of the rays, and the first quads of their rows.
    ids: [u32; LANES],
    row: F::Int,
    origin: [F; 3],
    shear: [F; 3],
    t_min: F,
    /// The distances at which they enter the leaf, and the lanes of those that do.
    near: F,
    entered: F::Mask,
    best: Best<F>,
    /// The lanes of those that have hit something in the leaf.
    found: F::Mask,
}

impl<F: Float> AtLeaf<F> {
    /// Loads the rays from one place of a list on, if one of them enters the leaf.
    #[inline(always)]
    fn load(walk: &StreamWalk, rows: &[Quad], (start, count): (usize, usize), at: usize) -> Option<Self> {
        let (id, mask) = numbers::<F>((&walk.lists[start..], count), at);
        let row = id.shl::<2>();
        let [x, y, z, reached] = F::load_rows(rows, row);
        let [_, _, _, t_min] = F::load_rows(&rows[1..], row);
        let near = F::load(&walk.near[start + at..]).max(t_min);
        let entered = near.le(reached) & mask;
        if !entered.any() {
            return None;
        }
        let [shear_x, shear_y, shear_z, primitive] = F::load_rows(&rows[2..], row);
        let mut ids = [0; LANES];
        id.store(&mut ids);
        Some(Self {
            ids,
            row,
            origin: [x, y, z],
            shear: [shear_x, shear_y, shear_z],
            t_min,
            near,
            entered,
            best: Best { t: reached, u: F::zero(), v: F::zero(), primitive: primitive.to_bits() },
            found: F::Mask::from_bits(0),
        })
    }

    /// Tests a block's triangles.
    #[inline(always)]
    fn meet_triangles<A: HitSink>(&mut self, block: &TriangleBlock, scene: StreamScene, rows: &[Quad]) {
        let axes = Shear::AXES[scene.way / OCTANTS];
        let origin = [self.origin[axes[0]], self.origin[axes[1]], self.origin[axes[2]]];
        for (place, word) in block.words.into_iter().enumerate() {
            if !PrimitiveRef(word).is_used() {
                break;
            }
            let mut corners = [[0.0; 3]; 3];
            for (corner, values) in corners.iter_mut().enumerate() {
                for (axis, value) in axes.into_iter().zip(values) {
                    *value = block.vertex[axis][corner][place];
                }
            }
            let seen = triangle::seen_from(&corners, &origin);
            let asked = AcceptedRange { lanes: self.entered, t_min: self.t_min, t_max: self.best.t };
            let exact = OfRows { rows, ids: &self.ids, rays: scene.rays, block, place };
            let hits = triangle::intersect_rays(seen, &self.shear, &asked, &exact);
            self.take::<A>(&hits, PrimitiveCandidate::triangle(PrimitiveRef(word)), scene, rows);
        }
    }

    /// Tests a block's spheres.
    #[inline(always)]
    fn meet_spheres<A: HitSink>(&mut self, block: &SphereBlock, scene: StreamScene, rows: &[Quad]) {
        let [_, _, _, queued] = F::load_rows(&rows[3..], self.row);
        let mut direction = [F::zero(); 3];
        for (direction, column) in direction.iter_mut().zip(scene.rays.direction) {
            *direction = F::gather(column, queued.to_bits(), self.entered);
        }
        for (place, word) in block.words.into_iter().enumerate() {
            if !PrimitiveRef(word).is_used() {
                break;
            }
            let placed = block.sphere(place);
            let hits = sphere::intersect_rays(placed, self.origin, direction, self.t_min, self.entered);
            self.take::<A>(&hits, PrimitiveCandidate::sphere(PrimitiveRef(word)), scene, rows);
        }
    }

    #[inline(always)]
    fn take<A: HitSink>(
        &mut self,
        hits: &BlockHits<F>,
        candidate: PrimitiveCandidate,
        scene: StreamScene,
        rows: &[Quad],
    ) {
        if hits.mask.any() {
            let filters = Listed { rays: scene.rays, rows, ids: &self.ids };
            let taken = self.best.take::<A>(hits, candidate, self.near, self.t_min, &filters);
            self.found = self.found | taken;
        }
    }

    /// Writes the hits to the rows.
    #[inline(always)]
    fn write(&self, rows: &mut [Quad]) {
        if !self.found.any() {
            return;
        }
        let (mut bits, hits) = (self.found.bits(), self.best.hits());
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % LANES;
            bits &= bits - 1;
            put_best(&mut rows[ROW * self.ids[lane] as usize..][..ROW], &hits[lane]);
        }
    }
}

impl StreamWalk {
    /// Tests a block against the rays of a list.
    #[inline(always)]
    pub(super) fn test<F: Float, A: HitSink>(
        &mut self,
        scene: StreamScene,
        rows: &mut [Quad],
        child: Child,
        start: usize,
        count: usize,
    ) {
        let bvh = scene.bvh;
        for at in (0..count).step_by(F::WIDTH) {
            let Some(mut group) = AtLeaf::<F>::load(self, rows, (start, count), at) else { continue };
            if child.kind() == ChildKind::Spheres {
                group.meet_spheres::<A>(&bvh.spheres[child.index()], scene, rows);
            } else {
                group.meet_triangles::<A>(&bvh.triangles[child.index()], scene, rows);
            }
            group.write(rows);
        }
    }

    /// Tests a block ray by ray.
    #[inline(always)]
    pub(super) fn test_lone<L: Lanes, A: HitSink>(
        &mut self,
        scene: StreamScene,
        rows: &mut [Quad],
        child: Child,
        start: usize,
        count: usize,
    ) {
        let StreamScene { bvh, rays, way } = scene;
        let axes = Shear::AXES[way / OCTANTS];
        for (id, near) in self.lists[start..][..count].iter().zip(&self.near[start..]) {
            let row = &mut rows[ROW * *id as usize..][..ROW];
            let (near, t_min) = (Float::max(*near, row[1][3]), row[1][3]);
            let visit = LeafContext::new(bvh, near, t_min, NONE, filter(rays, row));
            if visit.near > row[0][3] {
                continue;
            }
            let again = Again { rays, place: row[3][3].to_bits() as usize };
            let mut hit = best(row);
            let found = if child.kind() == ChildKind::Spheres {
                leaf::spheres::<L, A>(&bvh.spheres[child.index()], &again.ray(), visit, &mut hit)
            } else {
                let [sx, sy, sz, _] = row[2];
                let origin = [row[0][axes[0]], row[0][axes[1]], row[0][axes[2]]];
                let shear = Shear { axes, origin, shear: [sx, sy, sz] };
                leaf::triangles::<L, A>(&bvh.triangles[child.index()], &again, &shear, visit, &mut hit)
            };
            if found {
                finish(row);
            } else {
                put_best(row, &hit);
            }
        }
    }
}

/// The any-hit filter of a row's ray.
#[inline(always)]
pub(super) fn filter<'a>(rays: &Rays<'a>, row: &[Quad]) -> AnyHitFilter<'a> {
    rays.filter(row[3][3].to_bits() as usize)
}

/// The any-hit filters of rays of a list.
struct Listed<'a> {
    rays: &'a Rays<'a>,
    rows: &'a [Quad],
    ids: &'a [u32; LANES],
}

impl AnyHitFilters for Listed<'_> {
    fn filter(&self, lane: usize) -> AnyHitFilter<'_> {
        filter(self.rays, &self.rows[ROW * self.ids[lane] as usize..])
    }
}

/// A triangle, and rays that can be read again.
struct OfRows<'a> {
    rows: &'a [Quad],
    ids: &'a [u32; LANES],
    rays: &'a Rays<'a>,
    block: &'a TriangleBlock,
    place: usize,
}

impl<F: Float> ExactRays<F> for OfRows<'_> {
    #[inline(always)]
    fn t(&self, lanes: F::Mask, t: F) -> F {
        let vertices = self.block.corners(self.place);
        let mut exact = [0.0; LANES];
        t.store(&mut exact);
        let mut bits = lanes.bits();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % LANES;
            bits &= bits - 1;
            let row = &self.rows[ROW * self.ids[lane] as usize..];
            exact[lane] = triangle::exact_t(vertices, &self.rays.get(row[3][3].to_bits() as usize));
        }
        F::load(&exact)
    }
}

/// A ray of the queue, read only if needed.
struct Again<'a> {
    rays: &'a Rays<'a>,
    place: usize,
}

impl Exact for Again<'_> {
    #[inline(always)]
    fn ray(&self) -> Ray<f32> {
        self.rays.get(self.place)
    }
}
