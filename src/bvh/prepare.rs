//! Rays prepared many at a time: what [`super::ray::Local`] computes for one, in lanes.

use super::Rays;
use super::layout::{Bvh, Root};
use super::ray::{Slabs, slab_scales};
use super::triangle::{Longest, Shear};
use crate::simd::sixteen::key;
use crate::simd::{Float, Int, Kernel, Lanes, Mask};

/// Rays of a batch.
pub(super) const BATCH: usize = 16;

type BatchColumn = [f32; BATCH];

/// A batch of rays, by columns.
#[derive(Default)]
pub(super) struct Prepared {
    /// The rays that enter the tree's box and have not been taken, by bits.
    pub waiting: u32,
    /// The queue's number of the first one.
    pub first: u32,
    /// The tree's root with the distance where the ray enters it.
    pub current: [u64; BATCH],
    pub t_min: BatchColumn,
    pub t_max: BatchColumn,
    origin: [BatchColumn; 3],
    near_scale: [BatchColumn; 3],
    far_scale: [BatchColumn; 3],
    near_side: [[u32; BATCH]; 3],
    longest: [u32; BATCH],
    sheared_origin: [BatchColumn; 3],
    shear: [BatchColumn; 3],
    direction: [BatchColumn; 3],
}

/// [`Prepared::fill`] as a function of its own.
pub(super) struct Fill<'a> {
    pub prepared: &'a mut Prepared,
    pub bvh: &'a Bvh,
    pub rays: &'a Rays<'a>,
    pub first: usize,
    pub count: usize,
}

impl Kernel for Fill<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.prepared.fill::<L::Queue>(self.bvh, self.rays, self.first, self.count);
    }
}

impl Prepared {
    /// Whether all have been taken.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    /// Takes the next one.
    #[inline(always)]
    pub fn take(&mut self) -> usize {
        let place = self.waiting.trailing_zeros() as usize % BATCH;
        self.waiting &= self.waiting.wrapping_sub(1);
        place
    }

    /// For boxes.
    #[inline(always)]
    pub fn slabs(&self, i: usize) -> Slabs {
        let of = |c: &[BatchColumn; 3]| [c[0][i], c[1][i], c[2][i]];
        let [x, y, z] = &self.near_side;
        Slabs {
            origin: of(&self.origin),
            near_scale: of(&self.near_scale),
            far_scale: of(&self.far_scale),
            near_side: [x[i], y[i], z[i]],
            floor: self.t_min[i],
        }
    }

    /// For triangles.
    #[inline(always)]
    pub fn shear(&self, i: usize) -> Shear {
        let of = |c: &[BatchColumn; 3]| [c[0][i], c[1][i], c[2][i]];
        Shear {
            axes: Shear::AXES[self.longest[i] as usize % 4],
            origin: of(&self.sheared_origin),
            shear: of(&self.shear),
        }
    }

    /// Prepares `count` rays from `first` on.
    #[inline(always)]
    fn fill<F: Float>(&mut self, bvh: &Bvh, rays: &Rays, first: usize, count: usize) {
        self.first = first as u32;
        self.waiting = 0;
        let Some(root) = bvh.root else { return };
        for axis in 0..3 {
            copy(&mut self.origin[axis], rays.origin[axis], first, count);
            copy(&mut self.direction[axis], rays.direction[axis], first, count);
        }
        copy(&mut self.t_min, rays.t_min, first, count);
        copy(&mut self.t_max, rays.t_max, first, count);
        let mut near = [0.0; BATCH];
        for at in (0..BATCH).step_by(F::WIDTH) {
            self.waiting |= self.lanes::<F>(&root, at, &mut near).bits() << at;
        }
        self.waiting &= ((1u64 << count) - 1) as u32;
        for (current, near) in self.current.iter_mut().zip(near) {
            *current = key(near, root.child.0);
        }
    }

    /// Prepares the lanes from `at` on; says which of them enter the tree.
    #[inline(always)]
    fn lanes<F: Float>(&mut self, root: &Root, at: usize, entry: &mut BatchColumn) -> F::Mask {
        // A NaN stays one, −0 becomes 0.
        let t_min = F::zero().max(F::load(&self.t_min[at..])) + F::zero();
        t_min.store(&mut self.t_min[at..]);
        let mut near = t_min;
        let mut far = F::splat(f32::INFINITY);
        let mut zeros = F::zero();
        let (mut origin, mut direction, mut reciprocal) = ([F::zero(); 3], [F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            let o = F::load(&self.origin[axis][at..]);
            let d = F::load(&self.direction[axis][at..]);
            let r = F::one() / d;
            let (near_scale, far_scale) = slab_scales(r);
            near_scale.store(&mut self.near_scale[axis][at..]);
            far_scale.store(&mut self.far_scale[axis][at..]);
            let side = r.to_bits().shr::<31>();
            side.store(&mut self.near_side[axis][at..]);
            let backwards = side.eq(F::Int::splat(1));
            let (low, high) = (F::splat(root.bounds.min[axis]), F::splat(root.bounds.max[axis]));
            near = ((o - F::select(backwards, high, low)) * near_scale).max(near);
            far = ((o - F::select(backwards, low, high)) * far_scale).min(far);
            // NaN where something is not finite.
            zeros = zeros + o * F::zero() + d * F::zero();
            (origin[axis], direction[axis], reciprocal[axis]) = (o, d, r);
        }
        near.store(&mut entry[at..]);
        let longest = Longest::new(direction);
        longest.axis().store(&mut self.longest[at..]);
        let o = longest.rename(origin);
        let d = longest.rename(direction);
        let r = longest.rename(reciprocal);
        for (column, o) in self.sheared_origin.iter_mut().zip(o) {
            o.store(&mut column[at..]);
        }
        (d[0] * r[2]).store(&mut self.shear[0][at..]);
        (d[1] * r[2]).store(&mut self.shear[1][at..]);
        r[2].store(&mut self.shear[2][at..]);
        near.le(far) & near.le(F::load(&self.t_max[at..])) & zeros.eq(F::zero())
    }
}

#[inline(always)]
fn copy(column: &mut BatchColumn, from: &[f32], first: usize, count: usize) {
    match from[first..].first_chunk::<BATCH>() {
        Some(whole) => *column = *whole,
        None => column[..count].copy_from_slice(&from[first..first + count]),
    }
}
