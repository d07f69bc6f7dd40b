//! The one triangle test that decides, in every kernel.

use super::layout::TriangleBlock;
use crate::math::Ray;
use crate::simd::Float;

/// A ray prepared for the watertight test of Woop, Benthin and Wald (2013): axes renamed
/// so that the direction is longest along z, and the shear that makes it (0, 0, 1).
#[derive(Clone, Copy)]
pub struct Shear {
    axes: [usize; 3],
    origin: [f32; 3],
    shear: [f32; 3],
}

impl Shear {
    /// For a ray of any length but zero.
    #[inline(always)]
    pub fn new(ray: &Ray<f32>) -> Self {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z];
        let origin = [ray.origin.x, ray.origin.y, ray.origin.z];
        let [x, y, z] = direction.map(f32::abs);
        let kz = if x > y {
            if x > z { 0 } else { 2 }
        } else if y > z {
            1
        } else {
            2
        };
        let (kx, ky) = [(1, 2), (2, 0), (0, 1)][kz];
        let reciprocal = 1.0 / direction[kz];
        Self {
            axes: [kx, ky, kz],
            origin: [origin[kx], origin[ky], origin[kz]],
            shear: [direction[kx] * reciprocal, direction[ky] * reciprocal, reciprocal],
        }
    }
}

/// Where a ray meets the planes of a block's triangles, and in which lanes inside them.
pub struct BlockHits<T: Float> {
    /// Lanes with a hit at any t.
    pub mask: T::Mask,
    /// Along the ray.
    pub t: T,
    /// Weight of the second corner.
    pub u: T,
    /// Weight of the third corner.
    pub v: T,
}

/// Tests the triangles from `lane` on.
///
/// No fused operations: an edge that two triangles share gives both the same products,
/// so no ray passes between them.
#[inline(always)]
pub fn intersect<T: Float>(block: &TriangleBlock, lane: usize, ray: &Shear) -> BlockHits<T> {
    let (ax, ay, az) = corner::<T>(block, 0, lane, ray);
    let (bx, by, bz) = corner::<T>(block, 1, lane, ray);
    let (cx, cy, cz) = corner::<T>(block, 2, lane, ray);
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let low = u.min(v).min(w);
    let high = u.max(v).max(w);
    let determinant = u + v + w;
    let zero = T::zero();
    let mask = (low.ge(zero) | high.le(zero)) & !determinant.eq(zero);
    let reciprocal = T::one() / determinant;
    let t = (u * az + v * bz + w * cz) * T::splat(ray.shear[2]) * reciprocal;
    // A block's unused lanes are degenerate: their determinant is zero.
    BlockHits { mask, t, u: v * reciprocal, v: w * reciprocal }
}

/// A corner of each triangle, seen from the ray's origin and sheared.
#[inline(always)]
fn corner<T: Float>(block: &TriangleBlock, index: usize, lane: usize, ray: &Shear) -> (T, T, T) {
    let vertex = &block.vertex[index];
    let x = T::load(&vertex[ray.axes[0]][lane..]) - T::splat(ray.origin[0]);
    let y = T::load(&vertex[ray.axes[1]][lane..]) - T::splat(ray.origin[1]);
    let z = T::load(&vertex[ray.axes[2]][lane..]) - T::splat(ray.origin[2]);
    (x - T::splat(ray.shear[0]) * z, y - T::splat(ray.shear[1]) * z, z)
}
