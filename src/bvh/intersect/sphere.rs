//! The canonical sphere test, common to all kernels.

use super::triangle::BlockHits;
use crate::bvh::layout::SphereBlock;
use crate::math::{DVec3, Ray, Vector};
use crate::simd::{Float, Mask};

/// The line of a ray, for spheres.
#[derive(Clone, Copy, Default)]
pub struct Line {
    /// The origin of the ray.
    pub origin: [f32; 3],
    /// The direction, of any length.
    pub direction: [f32; 3],
}

impl Line {
    /// The line of a ray.
    #[inline(always)]
    pub fn new(ray: &Ray<f32>) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        Self { origin: [o.x, o.y, o.z], direction: [d.x, d.y, d.z] }
    }
}

/// Tests the spheres from `lane` on, with [`meet`].
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

/// [`intersect`] for the blocks of two rays, one in the low half of the 16 lanes and one in the high half.
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

/// Tests one sphere against a ray in each of some lanes, with [`meet`].
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

/// The canonical test, for a sphere and a ray in each lane.
///
/// The discriminant is computed from the point of the ray nearest to the centre, which stays exact for small and
/// distant spheres (Haines, Günther and Akenine-Möller, "Precision improvements for ray/sphere intersection", Ray
/// Tracing Gems, 2019).
///
/// The hit is the first of the two beyond `t_min`. Close to spheres that are far larger than the coordinates of the
/// origin, such as a planet's ground, it is recomputed in double precision ([`is_vast`]).
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
    let mut hits = BlockHits { mask, doubtful, t, u: T::zero(), v: T::zero(), side, far: second };
    let may_be_vast = mask & radius.lt(T::zero());
    if may_be_vast.any() {
        let vast = may_be_vast & is_vast(radius.abs(), &origin, first.abs().min(second.abs()));
        if vast.any() {
            make_exact(&mut hits, (center, radius), (origin, direction), t_min, vast);
        }
    }
    hits
}

/// The radius as stored in blocks: negative if [`is_vast`] may be true of a hit, because the sphere's surface passes
/// close to the origin of coordinates. Only its square and its sign matter.
pub fn stored_radius(center: [f32; 3], radius: f32) -> f32 {
    let [x, y, z] = center.map(f64::from);
    let (away, own) = ((x * x + y * y + z * z).sqrt(), f64::from(radius));
    // √3/64 + 1/256, and a little more.
    if (away - own).abs() < 0.04 * own { -radius } else { radius }
}

/// The lanes in which the distance t from a sphere is so short, and the radius so much larger than the origin's
/// coordinates, that single precision loses more than 1/16,384 of t, although the origin is precise enough.
#[inline(always)]
pub fn is_vast<T: Float>(radius: T, origin: &Vector<T>, t: T) -> T::Mask {
    let reach = origin.x.max_abs(origin.y).max_abs(origin.z);
    radius.gt(reach * T::splat(64.0)) & radius.gt(t * T::splat(256.0))
}

/// Recomputes the hits of some lanes, one by one.
#[inline(always)]
fn make_exact<T: Float>(
    hits: &mut BlockHits<T>,
    (center, radius): (Vector<T>, T),
    (origin, direction): (Vector<T>, Vector<T>),
    t_min: T,
    lanes: T::Mask,
) {
    let (c, o, d) = (center, origin, direction);
    let mut rows = [[0.0; 16]; 11];
    for (row, lanes) in rows.iter_mut().zip([c.x, c.y, c.z, radius, o.x, o.y, o.z, d.x, d.y, d.z, t_min]) {
        lanes.store(row);
    }
    let (mut t, mut side, mut far) = ([0.0; 16], [0.0; 16], [0.0; 16]);
    hits.t.store(&mut t);
    hits.side.store(&mut side);
    hits.far.store(&mut far);
    let (mut bits, mut met) = (lanes.bits(), hits.mask.bits());
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize % 16;
        bits &= bits - 1;
        match exact(&rows, lane) {
            Some(found) => [t[lane], side[lane], far[lane]] = found,
            None => met &= !(1 << lane),
        }
    }
    hits.mask = T::Mask::from_bits(met);
    (hits.t, hits.side, hits.far) = (T::load(&t), T::load(&side), T::load(&far));
}

/// t, side and the far t of one lane in double precision, from its column of numbers; otherwise as [`meet`].
#[cold]
#[inline(never)]
fn exact(rows: &[[f32; 16]; 11], lane: usize) -> Option<[f32; 3]> {
    let [cx, cy, cz, radius, ox, oy, oz, dx, dy, dz, t_min] = rows.map(|row| f64::from(row[lane]));
    let from_center = DVec3::new(ox - cx, oy - cy, oz - cz);
    let direction = DVec3::new(dx, dy, dz);
    let a = direction.dot(direction);
    let b = -from_center.dot(direction);
    let nearest = from_center + direction * (b / a);
    let discriminant = radius * radius - nearest.dot(nearest);
    if discriminant.is_nan() || discriminant < 0.0 {
        return None;
    }
    let root = (a * discriminant).sqrt();
    let q = b + if b < 0.0 { -root } else { root };
    let (t0, t1) = ((from_center.dot(from_center) - radius * radius) / q, q / a);
    let (first, second) = (t0.min(t1), t0.max(t1));
    let outside = first > t_min;
    let t = if outside { first } else { second };
    (!t.is_nan()).then_some([t as f32, if outside { 1.0 } else { -1.0 }, second as f32])
}
