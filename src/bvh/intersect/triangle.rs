//! The canonical triangle test, common to all kernels.

use crate::bvh::layout::{BLOCK, TriangleBlock};
use crate::math::{DVec3, Ray};
use crate::simd::{Float, Int, Mask};

/// A ray prepared for the watertight test of Woop, Benthin and Wald (2013): axes permuted so that the direction is
/// longest along z, and the shear that makes it (0, 0, 1).
#[derive(Clone, Copy, Default)]
pub struct Shear {
    /// The axes that become x, y and z.
    pub axes: [usize; 3],
    /// The ray's origin, with permuted axes.
    pub origin: [f32; 3],
    /// The shears of x and y, and the factor of z.
    pub shear: [f32; 3],
}

impl Shear {
    /// The permutations of axes if the direction is longest along x, along y, along z; the last one only fills the
    /// fourth place.
    pub const AXES: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

    /// Prepares a ray, whose direction may have any length but zero.
    #[inline(always)]
    pub fn new(ray: &Ray<f32>) -> Self {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z];
        let origin = [ray.origin.x, ray.origin.y, ray.origin.z];
        let kz = Longest::new(direction).axis().0 as usize;
        let [kx, ky, _] = Self::AXES[kz];
        let reciprocal = 1.0 / direction[kz];
        Self {
            axes: [kx, ky, kz],
            origin: [origin[kx], origin[ky], origin[kz]],
            shear: [direction[kx] * reciprocal, direction[ky] * reciprocal, reciprocal],
        }
    }
}

/// Provides the ray itself. It is seldom needed, so a kernel need not keep it at hand.
pub trait Exact {
    /// The ray in the block's space.
    fn ray(&self) -> Ray<f32>;
}

impl Exact for Ray<f32> {
    #[inline(always)]
    fn ray(&self) -> Ray<f32> {
        *self
    }
}

/// The range of hits that count: t is not computed exactly for others.
#[derive(Clone, Copy)]
pub struct AcceptedRange<T: Float> {
    /// The lanes that take part.
    pub lanes: T::Mask,
    /// The lower end of the range, exclusive.
    pub t_min: T,
    /// The upper end of the range, inclusive.
    pub t_max: T,
}

impl<T: Float> AcceptedRange<T> {
    /// A range for all lanes.
    #[inline(always)]
    pub fn between(t_min: f32, t_max: f32) -> Self {
        Self { lanes: T::Mask::first(T::WIDTH), t_min: T::splat(t_min), t_max: T::splat(t_max) }
    }
}

/// The intersections of a ray with the planes of a block's triangles, and the lanes in which they are inside the
/// triangles.
pub struct BlockHits<T: Float> {
    /// The lanes with a hit; it may lie outside the accepted range.
    pub mask: T::Mask,
    /// The lanes in which t is less exact than it should be.
    pub doubtful: T::Mask,
    /// The distance along the ray.
    pub t: T,
    /// The barycentric weight of the second corner.
    pub u: T,
    /// The barycentric weight of the third corner.
    pub v: T,
    /// Positive if the ray comes from the front (see [`crate::bvh::Sidedness::Front`]).
    pub side: T,
    /// The distance at which a ray that enters a sphere at t leaves it again; NaN for a triangle, which is crossed
    /// once.
    pub far: T,
}

/// Tests the triangles from `lane` on.
///
/// No fused operations: an edge that two triangles share gives both the same products, so no ray passes between them.
/// Where t may be off by more than 1/16,384 of itself, it is recomputed in double precision, as for close hits on large
/// triangles. So a ray that has just left a large triangle does not hit it again, and one that starts close to it does
/// not miss it.
#[inline(always)]
pub fn intersect<T: Float>(
    block: &TriangleBlock,
    lane: usize,
    ray: &impl Exact,
    shear: &Shear,
    asked: &AcceptedRange<T>,
) -> BlockHits<T> {
    let corners = corners::<T>(block, lane, shear);
    let edges = EdgeFunctions::new(&corners);
    let mut hits = edges.meet(&corners, T::splat(shear.shear[2]), asked);
    make_exact(&mut hits, block, lane, ray);
    hits
}

/// [`intersect`] without a branch on whether there is a hit at all; doubtful t stay as they are.
#[inline(always)]
pub fn intersect_roughly<T: Float>(
    block: &TriangleBlock,
    lane: usize,
    shear: &Shear,
    asked: &AcceptedRange<T>,
) -> BlockHits<T> {
    let corners = corners::<T>(block, lane, shear);
    let edges = EdgeFunctions::new(&corners);
    let mask = edges.inside() & asked.lanes;
    edges.distances(&corners, T::splat(shear.shear[2]), asked, mask)
}

/// [`intersect_roughly`] for the blocks of two rays, one in the low half of the 16 lanes and one in the high half.
#[inline(always)]
pub fn intersect_two<T: Float>(
    blocks: [&TriangleBlock; 2],
    rays: [&Shear; 2],
    asked: &AcceptedRange<T>,
) -> BlockHits<T> {
    let [a, b] = rays;
    let mut seen = [[T::zero(); 3]; 3];
    for (corner, seen) in seen.iter_mut().enumerate() {
        for (axis, seen) in seen.iter_mut().enumerate() {
            let low = &blocks[0].vertex[a.axes[axis]][corner];
            let high = &blocks[1].vertex[b.axes[axis]][corner];
            *seen = T::load_halves(low, high) - T::splat_halves(a.origin[axis], b.origin[axis]);
        }
        let [x, y, z] = *seen;
        let (shear_x, shear_y) =
            (T::splat_halves(a.shear[0], b.shear[0]), T::splat_halves(a.shear[1], b.shear[1]));
        *seen = [x - shear_x * z, y - shear_y * z, z];
    }
    let edges = EdgeFunctions::new(&seen);
    let mask = edges.inside() & asked.lanes;
    edges.distances(&seen, T::splat_halves(a.shear[2], b.shear[2]), asked, mask)
}

/// Recomputes t where it is doubtful.
#[inline(always)]
fn make_exact<T: Float>(hits: &mut BlockHits<T>, block: &TriangleBlock, lane: usize, ray: &impl Exact) {
    if hits.doubtful.any() {
        let mut lanes = [0.0; BLOCK];
        hits.t.store(&mut lanes);
        for_each_bit(hits.doubtful.bits(), |i| lanes[i] = exact_t(block.corners(lane + i), &ray.ray()));
        hits.t = T::load(&lanes);
    }
}

/// A triangle's corners relative to the origins of rays in lanes, with the axes of both permuted.
#[inline(always)]
pub fn seen_from<T: Float>(corners: &[[f32; 3]; 3], origin: &[T; 3]) -> [[T; 3]; 3] {
    let mut seen = [[T::zero(); 3]; 3];
    for (seen, corner) in seen.iter_mut().zip(corners) {
        for ((seen, value), origin) in seen.iter_mut().zip(corner).zip(origin) {
            *seen = T::splat(*value) - *origin;
        }
    }
    seen
}

/// Provides a triangle's t in double precision, for rays in lanes. (Not a closure: it would be compiled without the
/// instruction set.)
pub trait ExactRays<T: Float> {
    /// [`TrianglePlane::t`] in some lanes; the value of `t` in the others.
    fn t(&self, lanes: T::Mask, t: T) -> T;
}

/// Tests one triangle against a ray in each lane. `seen` holds its corners with permuted axes (each ray's own),
/// relative to the rays' origins; `shear` holds the values of [`Shear`] for each ray.
#[inline(always)]
pub fn intersect_rays<T: Float>(
    mut seen: [[T; 3]; 3],
    shear: &[T; 3],
    asked: &AcceptedRange<T>,
    exact: &impl ExactRays<T>,
) -> BlockHits<T> {
    for corner in &mut seen {
        let [x, y, z] = *corner;
        *corner = [x - shear[0] * z, y - shear[1] * z, z];
    }
    let edges = EdgeFunctions::new(&seen);
    let mut hits = edges.meet(&seen, shear[2], asked);
    if hits.doubtful.any() {
        hits.t = exact.t(hits.doubtful, hits.t);
    }
    hits
}

/// The edge functions of sheared corners: twice the signed areas that the ray's line makes with each edge.
struct EdgeFunctions<T> {
    u: T,
    v: T,
    w: T,
    low: T,
    high: T,
}

impl<T: Float> EdgeFunctions<T> {
    #[inline(always)]
    fn new([[ax, ay, _], [bx, by, _], [cx, cy, _]]: &[[T; 3]; 3]) -> Self {
        let u = *cx * *by - *cy * *bx;
        let v = *ax * *cy - *ay * *cx;
        let w = *bx * *ay - *by * *ax;
        Self { u, v, w, low: u.min(v).min(w), high: u.max(v).max(w) }
    }

    /// The lanes whose edge functions have one sign and are not all zero, so that the determinant is not zero: nothing
    /// cancels. A block's unused lanes are degenerate, with nothing but zeros. (If something is NaN, so is t.)
    #[inline(always)]
    fn inside(&self) -> T::Mask {
        let zero = T::zero();
        self.low.lt(zero) ^ self.high.gt(zero)
    }

    /// Intersects the lines with the planes, unless no line passes through its triangle.
    #[inline(always)]
    fn meet(&self, corners: &[[T; 3]; 3], scale: T, asked: &AcceptedRange<T>) -> BlockHits<T> {
        let mask = self.inside() & asked.lanes;
        if !mask.any() {
            let zero = T::zero();
            return BlockHits { mask, doubtful: mask, t: zero, u: zero, v: zero, side: zero, far: zero };
        }
        self.distances(corners, scale, asked, mask)
    }

    /// Intersects the lines with the planes in the lanes of `mask`, all of which pass through their triangles.
    #[inline(always)]
    fn distances(
        &self,
        corners: &[[T; 3]; 3],
        scale: T,
        asked: &AcceptedRange<T>,
        mask: T::Mask,
    ) -> BlockHits<T> {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;
        let reciprocal = T::one() / (self.u + self.v + self.w);
        // The determinant's sign is the orientation of the corners along the axis; the scale's, that of the ray.
        let side = scale * reciprocal;
        let t = (self.u * *az + self.v * *bz + self.w * *cz) * side;
        let x = ax.max_abs(*bx).max_abs(*cx);
        let y = ay.max_abs(*by).max_abs(*cy);
        let (low, high) = (az.min(*bz).min(*cz), az.max(*bz).max(*cz));
        let margin = twice_error_bound(x, y, [low, high], side.abs(), scale.abs());
        // What is certainly out of range need not be exact; with NaN nothing is certain.
        let refused = (t + margin).lt(asked.t_min) | (t - margin).gt(asked.t_max);
        let doubtful = mask & !refused & (t.abs() * T::splat(2.0 * WANTED)).le(margin);
        let (u, v) = (self.v * reciprocal, self.w * reciprocal);
        BlockHits { mask, doubtful, t, u, v, side, far: T::splat(f32::NAN) }
    }
}

/// The axis along which each direction is longest; z unless one of the others is longer than both.
#[derive(Clone, Copy)]
pub struct Longest<F: Float> {
    is_x: F::Mask,
    is_y: F::Mask,
}

impl<F: Float> Longest<F> {
    /// Finds the longest axis of each direction.
    #[inline(always)]
    pub fn new([x, y, z]: [F; 3]) -> Self {
        let (x, y, z) = (x.abs(), y.abs(), z.abs());
        let first = x.gt(y);
        Self { is_x: first & x.gt(z), is_y: !first & y.gt(z) }
    }

    /// The axis: 0, 1 or 2.
    #[inline(always)]
    pub fn axis(&self) -> F::Int {
        let axis = F::Int::select(self.is_x, F::Int::splat(0), F::Int::splat(2));
        F::Int::select(self.is_y, F::Int::splat(1), axis)
    }

    /// Permutes axes as in [`Shear`]: (y, z, x) where x is longest, (z, x, y) where y is, else (x, y, z).
    #[inline(always)]
    pub fn rename(&self, [x, y, z]: [F; 3]) -> [F; 3] {
        let Self { is_x, is_y } = *self;
        [
            F::select(is_x, y, F::select(is_y, z, x)),
            F::select(is_x, z, F::select(is_y, x, y)),
            F::select(is_x, x, F::select(is_y, y, z)),
        ]
    }
}

/// Calls `act` with the index of each set bit.
#[inline(always)]
fn for_each_bit(mut bits: u32, mut act: impl FnMut(usize)) {
    while bits != 0 {
        act(bits.trailing_zeros() as usize);
        bits &= bits - 1;
    }
}

/// The relative error of t above which it is recomputed in double precision.
const WANTED: f32 = 1.0 / 16_384.0;

/// Twice the error bound of t, from the corners' largest x and y, their least and largest depth, and the factors from
/// depth to t: by the determinant's reciprocal, `side`, and directly, `scale`. (The error of the edge functions after
/// PBRT 4th ed., 6.8.7, multiplied out. Weights add up to 1 whatever their errors, so these count only as far as the
/// corners' depths differ.)
#[inline(always)]
fn twice_error_bound<T: Float>(x: T, y: T, [low, high]: [T; 2], side: T, scale: T) -> T {
    const EPSILON: f32 = f32::EPSILON * 0.5;
    let z = low.max_abs(high);
    let edge = x * y * T::splat(180.0 * EPSILON) + (x + y) * z * T::splat(72.0 * EPSILON);
    edge * (high - low) * side + z * (scale * T::splat(16.0 * EPSILON))
}

/// A triangle's plane in double precision.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePlane {
    corner: DVec3,
    normal: DVec3,
}

impl TrianglePlane {
    /// The plane of a triangle.
    #[inline(always)]
    pub fn new(vertices: [[f32; 3]; 3]) -> Self {
        let mut corners = [DVec3::ZERO; 3];
        for (corner, [x, y, z]) in corners.iter_mut().zip(vertices) {
            *corner = DVec3::new(x as f64, y as f64, z as f64);
        }
        let [a, b, c] = corners;
        Self { corner: a, normal: (b - a).cross(c - a) }
    }

    /// The distance at which a ray meets the plane.
    #[inline(always)]
    pub fn t(&self, ray: &Ray<f32>) -> f32 {
        let (o, d) = (ray.origin, ray.direction);
        self.meet([o.x, o.y, o.z], [d.x, d.y, d.z])
    }

    #[inline(always)]
    fn meet(&self, [ox, oy, oz]: [f32; 3], [dx, dy, dz]: [f32; 3]) -> f32 {
        let origin = DVec3::new(ox as f64, oy as f64, oz as f64);
        let direction = DVec3::new(dx as f64, dy as f64, dz as f64);
        (self.normal.dot(self.corner - origin) / self.normal.dot(direction)) as f32
    }

    /// [`TrianglePlane::t`] for a ray in each of `lanes`, `t` in the others.
    #[inline(always)]
    pub fn t_in_lanes<T: Float>(&self, origin: &[T; 3], direction: &[T; 3], lanes: T::Mask, t: T) -> T {
        let (mut from, mut along) = ([[0.0; 16]; 3], [[0.0; 16]; 3]);
        for axis in 0..3 {
            origin[axis].store(&mut from[axis]);
            direction[axis].store(&mut along[axis]);
        }
        // The same operations in every lane, without a branch, so that compilers vectorize them.
        let mut exact = [0.0; 16];
        for (i, exact) in exact.iter_mut().enumerate() {
            *exact = self.meet([from[0][i], from[1][i], from[2][i]], [along[0][i], along[1][i], along[2][i]]);
        }
        T::select(lanes, T::load(&exact), t)
    }
}

/// t from the plane's equation in double precision.
#[cold]
#[inline(never)]
pub fn exact_t(vertices: [[f32; 3]; 3], ray: &Ray<f32>) -> f32 {
    TrianglePlane::new(vertices).t(ray)
}

/// The corners of each triangle. (Not a closure: it would be compiled without the instruction set.)
#[inline(always)]
fn corners<T: Float>(block: &TriangleBlock, lane: usize, ray: &Shear) -> [[T; 3]; 3] {
    [corner(block, 0, lane, ray), corner(block, 1, lane, ray), corner(block, 2, lane, ray)]
}

/// A corner of each triangle, relative to the ray's origin and sheared.
#[inline(always)]
fn corner<T: Float>(block: &TriangleBlock, index: usize, lane: usize, ray: &Shear) -> [T; 3] {
    let [x, y, z] = ray.axes;
    let x = T::load(&block.vertex[x][index][lane..]) - T::splat(ray.origin[0]);
    let y = T::load(&block.vertex[y][index][lane..]) - T::splat(ray.origin[1]);
    let z = T::load(&block.vertex[z][index][lane..]) - T::splat(ray.origin[2]);
    [x - T::splat(ray.shear[0]) * z, y - T::splat(ray.shear[1]) * z, z]
}
