//! The one sphere test that decides, in every kernel.

use super::layout::SphereBlock;
use super::triangle::BlockHits;
use crate::math::{Ray, Vector};
use crate::simd::{Float, Mask};

/// What spheres need of a ray.
#[derive(Clone, Copy, Default)]
pub struct Line {
    /// Where it starts.
    pub origin: [f32; 3],
    /// Of any length.
    pub direction: [f32; 3],
}

impl Line {
    /// That of a ray.
    #[inline(always)]
    pub fn new(ray: &Ray<f32>) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        Self { origin: [o.x, o.y, o.z], direction: [d.x, d.y, d.z] }
    }
}

/// Tests the spheres from `lane` on: [`meet`].
#[inline(always)]
pub fn intersect<T: Float>(block: &SphereBlock, lane: usize, line: &Line, t_min: T) -> BlockHits<T> {
    let ([ox, oy, oz], [dx, dy, dz]) = (line.origin, line.direction);
    let origin = Vector::new(T::splat(ox), T::splat(oy), T::splat(oz));
    let direction = Vector::new(T::splat(dx), T::splat(dy), T::splat(dz));
    let center = Vector::new(
        T::load(&block.center[0][lane..]),
        T::load(&block.center[1][lane..]),
        T::load(&block.center[2][lane..]),
    );
    let radius = T::load(&block.radius[lane..]);
    meet(center, radius, origin, direction, t_min)
}

/// The same for the blocks of two rays, one in the low half of the lanes and one in the high half, of which there are
/// 16.
#[inline(always)]
pub fn intersect_two<T: Float>([a, b]: [&SphereBlock; 2], [c, d]: [&Line; 2], t_min: T) -> BlockHits<T> {
    let (low, high) = (&a.center, &b.center);
    let center = Vector::new(
        T::load_halves(&low[0], &high[0]),
        T::load_halves(&low[1], &high[1]),
        T::load_halves(&low[2], &high[2]),
    );
    let origin = halves([&c.origin, &d.origin]);
    let direction = halves([&c.direction, &d.direction]);
    meet(center, T::load_halves(&a.radius, &b.radius), origin, direction, t_min)
}

/// A vector for each half of the lanes.
#[inline(always)]
fn halves<T: Float>([[ax, ay, az], [bx, by, bz]]: [&[f32; 3]; 2]) -> Vector<T> {
    Vector::new(T::splat_halves(*ax, *bx), T::splat_halves(*ay, *by), T::splat_halves(*az, *bz))
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
