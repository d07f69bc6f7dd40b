//! What happens to the rays of a list at a leaf.

use super::super::Rays;
use super::super::layout::{BLOCK, TriangleBlock};
use super::super::leaf::{self, Best, Visit};
use super::super::query::Answers;
use super::super::sphere;
use super::super::triangle::{self, Asked, Exact, ExactRays, Shear};
use super::super::ways::OCTANTS;
use super::rows::{LANES, Quad, ROW, best, finish, put_best};
use super::{Scene, Walk, numbers};
use crate::math::{NONE, Ray};
use crate::simd::{Float, Int, Lanes, Mask};

/// Rays of a list, a ray a lane.
struct AtLeaf<F: Float> {
    /// Their numbers, and the first quads of their rows.
    ids: [u32; LANES],
    row: F::Int,
    origin: [F; 3],
    t_min: F,
    /// Where they enter the leaf, and which of them do.
    near: F,
    entered: F::Mask,
    best: Best<F>,
    /// Those that have found something here.
    found: F::Mask,
}

impl<F: Float> AtLeaf<F> {
    /// Those from one place of a list on.
    #[inline(always)]
    fn load(walk: &Walk, rows: &[Quad], (start, count): (usize, usize), at: usize) -> Self {
        let (id, mask) = numbers::<F>((&walk.lists[start..], count), at);
        let mut ids = [0; LANES];
        id.store(&mut ids);
        let row = id.shl::<2>();
        let [x, y, z, reached] = F::load_rows(rows, row);
        let [_, _, _, t_min] = F::load_rows(&rows[1..], row);
        let near = F::load(&walk.near[start + at..]).max(t_min);
        let (zero, none) = (F::zero(), F::Int::splat(NONE));
        Self {
            ids,
            row,
            origin: [x, y, z],
            t_min,
            near,
            entered: near.le(reached) & mask,
            best: Best { t: reached, u: zero, v: zero, primitive: none },
            found: F::Mask::from_bits(0),
        }
    }

    /// Writes what has been found to the rows.
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

impl Walk {
    /// Tests a block's triangles against the rays of a list.
    #[inline(always)]
    pub(super) fn test<F: Float, A: Answers>(
        &mut self,
        scene: Scene,
        rows: &mut [Quad],
        block: usize,
        start: usize,
        count: usize,
    ) {
        let Scene { bvh, rays, way } = scene;
        let block = &bvh.triangles[block];
        let axes = Shear::AXES[way / OCTANTS];
        for at in (0..count).step_by(F::WIDTH) {
            let mut group = AtLeaf::<F>::load(self, rows, (start, count), at);
            if !group.entered.any() {
                continue;
            }
            let [shear_x, shear_y, shear_z, primitive] = F::load_rows(&rows[2..], group.row);
            let shear = [shear_x, shear_y, shear_z];
            group.best.primitive = primitive.to_bits();
            let origin = [group.origin[axes[0]], group.origin[axes[1]], group.origin[axes[2]]];
            for place in 0..BLOCK {
                if block.primitive[place] == NONE {
                    break;
                }
                let mut corners = [[0.0; 3]; 3];
                for (corner, values) in corners.iter_mut().enumerate() {
                    for (axis, value) in axes.into_iter().zip(values) {
                        *value = block.vertex[axis][corner][place];
                    }
                }
                let seen = triangle::seen_from(&corners, &origin);
                let asked = Asked { lanes: group.entered, t_min: group.t_min, t_max: group.best.t };
                let exact = OfRows { rows, ids: &group.ids, rays, block, place };
                let hits = triangle::intersect_rays(seen, &shear, &asked, &exact);
                if hits.mask.any() {
                    let better = group.best.take::<A>(&hits, block.primitive[place], group.near, group.t_min);
                    group.found = group.found | better;
                }
            }
            group.write(rows);
        }
    }

    /// Tests a block's spheres against the rays of a list.
    #[inline(always)]
    pub(super) fn test_spheres<F: Float, A: Answers>(
        &mut self,
        scene: Scene,
        rows: &mut [Quad],
        block: usize,
        start: usize,
        count: usize,
    ) {
        let Scene { bvh, rays, .. } = scene;
        let block = &bvh.spheres[block];
        for at in (0..count).step_by(F::WIDTH) {
            let mut group = AtLeaf::<F>::load(self, rows, (start, count), at);
            if !group.entered.any() {
                continue;
            }
            let [_, _, _, primitive] = F::load_rows(&rows[2..], group.row);
            group.best.primitive = primitive.to_bits();
            let [_, _, _, queued] = F::load_rows(&rows[3..], group.row);
            let mut direction = [F::zero(); 3];
            for (direction, column) in direction.iter_mut().zip(rays.direction) {
                *direction = F::gather(column, queued.to_bits(), group.entered);
            }
            for place in 0..BLOCK {
                if block.primitive[place] == NONE {
                    break;
                }
                let placed = block.sphere(place);
                let hits =
                    sphere::intersect_rays(placed, group.origin, direction, group.t_min, group.entered);
                if hits.mask.any() {
                    let better = group.best.take::<A>(&hits, block.primitive[place], group.near, group.t_min);
                    group.found = group.found | better;
                }
            }
            group.write(rows);
        }
    }

    /// Tests a block's triangles ray by ray.
    #[inline(always)]
    pub(super) fn test_lone<L: Lanes, A: Answers>(
        &mut self,
        scene: Scene,
        rows: &mut [Quad],
        block: usize,
        start: usize,
        count: usize,
    ) {
        let Scene { bvh, rays, way } = scene;
        let block = &bvh.triangles[block];
        let axes = Shear::AXES[way / OCTANTS];
        for (id, near) in self.lists[start..][..count].iter().zip(&self.near[start..]) {
            let row = &mut rows[ROW * *id as usize..][..ROW];
            let visit = Visit { near: Float::max(*near, row[1][3]), t_min: row[1][3], instance: NONE };
            if visit.near > row[0][3] {
                continue;
            }
            let [sx, sy, sz, _] = row[2];
            let origin = [row[0][axes[0]], row[0][axes[1]], row[0][axes[2]]];
            let shear = Shear { axes, origin, shear: [sx, sy, sz] };
            let again = Again { rays, place: row[3][3].to_bits() as usize };
            let mut hit = best(row);
            if leaf::triangles::<L, A>(block, &again, &shear, visit, &mut hit) {
                finish(row);
            } else {
                put_best(row, &hit);
            }
        }
    }
}

/// A triangle, and rays that are to be had again.
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

/// A ray of the queue, read where it is needed after all.
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
