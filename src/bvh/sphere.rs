//! The one sphere test that decides, in every kernel.

use super::layout::SphereBlock;
use super::triangle::BlockHits;
use crate::math::{Ray, Vector};
use crate::simd::{Float, Mask};

/// Tests the spheres from `lane` on, for a direction of any length: [`meet`].
#[inline(always)]
pub fn intersect<T: Float>(block: &SphereBlock, lane: usize, ray: &Ray<f32>) -> BlockHits<T> {
    let (o, d) = (ray.origin, ray.direction);
    let origin = Vector::new(T::splat(o.x), T::splat(o.y), T::splat(o.z));
    let direction = Vector::new(T::splat(d.x), T::splat(d.y), T::splat(d.z));
    let center = Vector::new(
        T::load(&block.center[0][lane..]),
        T::load(&block.center[1][lane..]),
        T::load(&block.center[2][lane..]),
    );
    let radius = T::load(&block.radius[lane..]);
    meet(center, radius, origin, direction, T::splat(ray.t_min))
}

/// Tests one sphere against a ray in each of some lanes: [`meet`].
#[inline(always)]
pub fn intersect_rays<T: Float>(
    (center, radius): ([f32; 3], f32),
    [ox, oy, oz]: [T; 3],
    [dx, dy, dz]: [T; 3],
    t_min: T,
    lanes: T::Mask,
) -> BlockHits<T> {
    let center = Vector::new(T::splat(center[0]), T::splat(center[1]), T::splat(center[2]));
    let (origin, direction) = (Vector::new(ox, oy, oz), Vector::new(dx, dy, dz));
    let hits = meet(center, T::splat(radius), origin, direction, t_min);
    BlockHits { mask: hits.mask & lanes, ..hits }
}

/// The test itself, for a sphere and a ray in each lane.
///
/// The discriminant is taken about the point of the ray nearest to the centre, which stays exact
/// for small and distant spheres (Haines, Günther and Akenine-Möller, "Precision improvements for
/// ray/sphere intersection", Ray Tracing Gems, 2019).
///
/// The hit is the first of the two beyond `t_min`.
#[inline(always)]
pub fn meet<T: Float>(
    center: Vector<T>,
    radius: T,
    origin: Vector<T>,
    direction: Vector<T>,
    t_min: T,
) -> BlockHits<T> {
    let from_center = origin - center;
    let a = direction.dot(direction);
    let b = -from_center.dot(direction);
    let nearest = from_center + direction * (b / a);
    let discriminant = radius * radius - nearest.dot(nearest);
    // NaN radii (unused lanes) and NaN distances compare false.
    let met = discriminant.ge(T::zero());
    if !met.any() {
        let (zero, none) = (T::zero(), T::Mask::from_bits(0));
        return BlockHits { mask: none, doubtful: none, t: zero, u: zero, v: zero, side: zero, far: zero };
    }
    let root = (a * discriminant.max(T::zero())).sqrt();
    let q = b + T::select(b.lt(T::zero()), -root, root);
    let c = from_center.dot(from_center) - radius * radius;
    let (t0, t1) = (c / q, q / a);
    let (first, second) = (t0.min(t1), t0.max(t1));
    let outside = first.gt(t_min);
    let t = T::select(outside, first, second);
    let side = T::select(outside, T::one(), -T::one());
    let mask = met & t.eq(t);
    let doubtful = T::Mask::from_bits(0);
    BlockHits { mask, doubtful, t, u: T::zero(), v: T::zero(), side, far: second }
}
