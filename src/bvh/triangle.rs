//! The one triangle test that decides, in every kernel.

use super::layout::{BLOCK, TriangleBlock};
use crate::math::{DVec3, Ray};
use crate::simd::{Float, Mask};

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
/// so no ray passes between them. Where rounding could have moved t across the ray's
/// origin, t is computed again in double precision: a ray that has just left a large
/// triangle does not hit it again, and one that starts close to it does not miss it.
#[inline(always)]
pub fn intersect<T: Float>(
    block: &TriangleBlock,
    lane: usize,
    ray: &Ray<f32>,
    shear: &Shear,
) -> BlockHits<T> {
    let (ax, ay, az) = corner::<T>(block, 0, lane, shear);
    let (bx, by, bz) = corner::<T>(block, 1, lane, shear);
    let (cx, cy, cz) = corner::<T>(block, 2, lane, shear);
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    let low = u.min(v).min(w);
    let high = u.max(v).max(w);
    let determinant = u + v + w;
    let zero = T::zero();
    let mask = (low.ge(zero) | high.le(zero)) & !determinant.eq(zero);
    // A block's unused lanes are degenerate: their determinant is zero.
    if !mask.any() {
        return BlockHits { mask, t: zero, u: zero, v: zero };
    }
    let reciprocal = T::one() / determinant;
    let scale = T::splat(shear.shear[2]) * reciprocal;
    let mut t = (u * az + v * bz + w * cz) * scale;
    let x = ax.abs().max(bx.abs()).max(cx.abs());
    let y = ay.abs().max(by.abs()).max(cy.abs());
    let z = az.abs().max(bz.abs()).max(cz.abs());
    let edge = low.abs().max(high.abs());
    let doubtful = mask & t.abs().le(error_bound(x, y, z, edge, scale.abs()));
    if doubtful.any() {
        t = with_exact(t, doubtful, block, lane, ray);
    }
    BlockHits { mask, t, u: v * reciprocal, v: w * reciprocal }
}

/// How far off t can be, from the largest coordinates and edge functions (PBRT 4th ed.,
/// 6.8.7; z is scaled last here, by `scale`).
#[inline(always)]
fn error_bound<T: Float>(x: T, y: T, z: T, edge: T, scale: T) -> T {
    const EPSILON: f32 = f32::EPSILON * 0.5;
    let (delta_x, delta_y) = ((x + z) * T::splat(6.0 * EPSILON), (y + z) * T::splat(6.0 * EPSILON));
    let delta_edge = (x * y * T::splat(3.0 * EPSILON) + delta_y * x + delta_x * y) * T::splat(2.0);
    (edge * z * T::splat(8.0 * EPSILON) + delta_edge * z) * T::splat(3.0) * scale
}

/// t of the lanes of `mask` by the plane's equation in double precision.
#[cold]
#[inline(never)]
fn exact_t(vertices: [[f32; 3]; 3], ray: &Ray<f32>) -> f32 {
    let [a, b, c] = vertices.map(|v| DVec3::from_array(v.map(f64::from)));
    let vector = |v: crate::math::Vector<f32>| DVec3::new(v.x as f64, v.y as f64, v.z as f64);
    let normal = (b - a).cross(c - a);
    (normal.dot(a - vector(ray.origin)) / normal.dot(vector(ray.direction))) as f32
}

#[inline(always)]
fn with_exact<T: Float>(t: T, mask: T::Mask, block: &TriangleBlock, lane: usize, ray: &Ray<f32>) -> T {
    let mut lanes = [0.0; BLOCK];
    t.store(&mut lanes);
    let mut bits = mask.bits();
    while bits != 0 {
        let i = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let v = &block.vertex;
        let at = lane + i;
        let vertices = [
            [v[0][0][at], v[0][1][at], v[0][2][at]],
            [v[1][0][at], v[1][1][at], v[1][2][at]],
            [v[2][0][at], v[2][1][at], v[2][2][at]],
        ];
        lanes[i] = exact_t(vertices, ray);
    }
    T::load(&lanes)
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
