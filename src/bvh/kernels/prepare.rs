//! Prepares batches of rays in lanes: the values that [`LocalRay`](crate::bvh::intersect::ray::LocalRay) computes for one ray.

use super::direction_classes::padded;
use super::subtree::SubtreeEntry;
use crate::bvh::Rays;
use crate::bvh::intersect::ray::{LocalRay, RaySlabs, slab_scales};
use crate::bvh::intersect::triangle::{Longest, Shear};
use crate::bvh::layout::{Bvh, Child, Root};
use crate::simd::{Float, Int, Kernel, Lanes, Mask, prefetch};

/// The number of rays in a batch.
pub(in crate::bvh) const BATCH: usize = 16;

/// The prefetch distance in rays.
const AHEAD: usize = 4 * BATCH;

/// A prepared ray in rows of four numbers.
///
/// ```text
/// origin x y z, floor │ near scale x y z, t_max │ far scale x y z, entry │ near planes x y z, longest │
/// sheared origin x y z, octant │ shear x y z, –
/// ```
#[derive(Clone, Copy, Default)]
#[repr(C, align(32))]
pub(in crate::bvh) struct RayRow([[f32; 4]; ROWS]);

const ROWS: usize = 6;

impl RayRow {
    /// Copies another row, four numbers at a time: reading as a whole a row that was written in parts would stall.
    #[inline(always)]
    pub fn copy(&mut self, other: &RayRow) {
        for (to, from) in self.0.iter_mut().zip(&other.0) {
            *to = *from;
        }
    }

    /// Stores a ray that was prepared on its own and that enters nothing before `floor`.
    #[inline(always)]
    pub fn write(&mut self, local: &LocalRay, floor: f32) {
        let LocalRay { ray, slabs, shear } = local;
        let [origin, near_scale, far_scale, side, sheared, slopes] = &mut self.0;
        for axis in 0..3 {
            origin[axis] = slabs.origin[axis];
            near_scale[axis] = slabs.near_scale[axis];
            far_scale[axis] = slabs.far_scale[axis];
            side[axis] = f32::from_bits(slabs.near_planes[axis]);
            sheared[axis] = shear.origin[axis];
            slopes[axis] = shear.shear[axis];
        }
        (origin[3], near_scale[3]) = (floor, ray.t_max);
        (side[3], sheared[3]) = (f32::from_bits(shear.axes[2] as u32), f32::from_bits(slabs.octant()));
    }

    /// The ray prepared for boxes.
    #[inline(always)]
    pub fn slabs(&self) -> RaySlabs {
        let [origin, near_scale, far_scale, [x, y, z, _], _, _] = &self.0;
        RaySlabs {
            origin: three(origin),
            near_scale: three(near_scale),
            far_scale: three(far_scale),
            near_planes: [x.to_bits(), y.to_bits(), z.to_bits()],
            floor: origin[3],
        }
    }

    /// The ray prepared for triangles.
    #[inline(always)]
    pub fn shear(&self) -> Shear {
        let [_, _, _, side, origin, shear] = &self.0;
        Shear {
            axes: Shear::AXES[side[3].to_bits() as usize % 4],
            origin: three(origin),
            shear: three(shear),
        }
    }

    /// The origin of the ray.
    #[inline(always)]
    pub fn origin(&self) -> [f32; 3] {
        three(&self.0[0])
    }

    /// The octant: bit i is set if the ray goes down along axis i.
    #[inline(always)]
    pub fn octant(&self) -> u32 {
        self.0[4][3].to_bits()
    }

    /// The start of the ray's t range.
    #[inline(always)]
    pub fn t_min(&self) -> f32 {
        self.0[0][3]
    }

    /// The end of the ray's t range.
    #[inline(always)]
    pub fn t_max(&self) -> f32 {
        self.0[1][3]
    }
}

#[inline(always)]
fn three(quad: &[f32; 4]) -> [f32; 3] {
    [quad[0], quad[1], quad[2]]
}

/// A batch of prepared rays.
#[derive(Default)]
pub(in crate::bvh) struct PreparedRays {
    /// The rays that enter the tree's box and have not been taken, as bits.
    pub pending: u32,
    /// The index in the queue of the first ray.
    pub first: u32,
    /// The child word of the root.
    root: u32,
    /// The rows, in the order of [`Float::mixed`].
    rows: [[[f32; 4]; BATCH]; ROWS],
}

/// [`PreparedRays::fill`] as a kernel.
pub(in crate::bvh) struct Fill<'a> {
    pub prepared: &'a mut PreparedRays,
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

impl PreparedRays {
    /// True if all rays have been taken.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.pending == 0
    }

    /// Takes the next ray and returns its place in the batch.
    #[inline(always)]
    pub fn take(&mut self) -> usize {
        let place = self.pending.trailing_zeros() as usize % BATCH;
        self.pending &= self.pending.wrapping_sub(1);
        place
    }

    /// Copies a ray to `row` (see [`RayRow::copy`]) and returns its entry into the tree. `F` is the type that it was
    /// prepared with.
    #[inline(always)]
    pub fn read<F: Float>(&self, place: usize, row: &mut RayRow) -> SubtreeEntry {
        let place = (place - place % F::WIDTH + F::mixed(place % F::WIDTH)) % BATCH;
        for (to, from) in row.0.iter_mut().zip(&self.rows) {
            *to = from[place];
        }
        SubtreeEntry { near: self.rows[2][place][3], child: Child(self.root) }
    }

    /// Prepares `count` rays from `first` on.
    #[inline(always)]
    fn fill<F: Float>(&mut self, bvh: &Bvh, rays: &Rays, first: usize, count: usize) {
        self.first = first as u32;
        self.pending = 0;
        let Some(root) = bvh.root else { return };
        self.root = root.child.0;
        // (A chain of iterators would be assembled in memory.)
        for axis in 0..3 {
            prefetch(rays.origin[axis].as_ptr().wrapping_add(first + AHEAD) as usize, 1);
            prefetch(rays.direction[axis].as_ptr().wrapping_add(first + AHEAD) as usize, 1);
        }
        prefetch(rays.t_min.as_ptr().wrapping_add(first + AHEAD) as usize, 1);
        prefetch(rays.t_max.as_ptr().wrapping_add(first + AHEAD) as usize, 1);
        for at in (0..count).step_by(F::WIDTH) {
            self.pending |= self.lanes::<F>(&root, rays, first + at, at).bits() << at;
        }
        self.pending &= ((1u64 << count) - 1) as u32;
    }

    /// Prepares the lanes from `at` on and returns those that enter the tree.
    #[inline(always)]
    fn lanes<F: Float>(&mut self, root: &Root, rays: &Rays, first: usize, at: usize) -> F::Mask {
        // NaN stays NaN, −0 becomes 0.
        let t_min = F::zero().max(padded::<F>(&rays.t_min[first..])) + F::zero();
        let t_max = padded::<F>(&rays.t_max[first..]);
        let mut near = t_min;
        let mut far = F::splat(f32::INFINITY);
        let mut zeros = F::zero();
        let mut octant = F::Int::splat(0);
        let (mut origin, mut direction, mut reciprocal) = ([F::zero(); 3], [F::zero(); 3], [F::zero(); 3]);
        let (mut near_scales, mut far_scales, mut near_planes) =
            ([F::zero(); 3], [F::zero(); 3], [F::zero(); 3]);
        for axis in 0..3 {
            let o = padded::<F>(&rays.origin[axis][first..]);
            let d = padded::<F>(&rays.direction[axis][first..]);
            let r = F::one() / d;
            let (near_scale, far_scale) = slab_scales(r);
            let side = r.to_bits().shr::<31>();
            octant = octant
                | match axis {
                    0 => side,
                    1 => side.shl::<1>(),
                    _ => side.shl::<2>(),
                };
            let backwards = side.eq(F::Int::splat(1));
            let (low, high) = (F::splat(root.bounds.min[axis]), F::splat(root.bounds.max[axis]));
            near = ((o - F::select(backwards, high, low)) * near_scale).max(near);
            far = ((o - F::select(backwards, low, high)) * far_scale).min(far);
            // NaN if something is not finite.
            zeros = zeros + o * F::zero() + d * F::zero();
            (origin[axis], direction[axis], reciprocal[axis]) = (o, d, r);
            (near_scales[axis], far_scales[axis]) = (near_scale, far_scale);
            near_planes[axis] = side.shl::<4>().reinterpret();
        }
        let longest = Longest::new(direction);
        let o = longest.rename(origin);
        let d = longest.rename(direction);
        let r = longest.rename(reciprocal);
        let shear = [d[0] * r[2], d[1] * r[2], r[2]];
        let columns = [origin, near_scales, far_scales, near_planes, o, shear];
        let last = [t_min, t_max, near, longest.axis().reinterpret(), octant.reinterpret(), F::zero()];
        for ((rows, [x, y, z]), last) in self.rows.iter_mut().zip(columns).zip(last) {
            F::store_rows_mixed([x, y, z, last], &mut rows[at..]);
        }
        near.le(far) & near.le(t_max) & zeros.eq(F::zero())
    }
}
