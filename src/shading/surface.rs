//! Computes the surface at a hit: position, normals, texture coordinates and a bound on the rounding error.

use std::num::Wrapping;

use crate::bvh::intersect::sphere::is_vast;
use crate::bvh::layout::sidedness::SPHERE;
use crate::math::elementary::{acos_turns, atan2_turns};
use crate::math::{Hit, NONE, Ray, Vector};
use crate::scene::Geometry;
use crate::simd::{Float, Int, Mask};

/// A [`crate::math::Hit`] in each lane.
#[derive(Clone, Copy)]
pub struct HitLanes<F: Float> {
    /// Distance along the ray.
    pub t: F,
    /// Barycentric weight of a triangle's second corner.
    pub u: F,
    /// Barycentric weight of a triangle's third corner.
    pub v: F,
    /// Primitive id.
    pub primitive: F::Int,
    /// Instance id or [`NONE`].
    pub instance: F::Int,
}

impl HitLanes<f32> {
    /// A hit in one lane.
    #[inline(always)]
    pub fn one(hit: &Hit) -> Self {
        let Hit { t, u, v, primitive, instance } = *hit;
        Self { t, u, v, primitive: Wrapping(primitive), instance: Wrapping(instance) }
    }
}

/// The surface at a hit point.
#[derive(Clone, Copy)]
pub struct Surface<F: Float> {
    /// The hit point in world space.
    pub position: Vector<F>,
    /// The distance along the geometric normal by which a ray's origin must be moved to be certainly off the surface.
    pub offset: F,
    /// Unit geometric normal, on the viewer's side.
    pub geometric_normal: Vector<F>,
    /// Unit shading normal, on the viewer's side.
    pub normal: Vector<F>,
    /// Set if the viewer is on the inner side, from which corners go around clockwise.
    pub inside: F::Mask,
    /// Texture coordinates.
    pub uv: (F, F),
    /// Interpolated vertex colour, a factor on the material's colour.
    pub color: Vector<F>,
    /// Material id.
    pub material: F::Int,
}

/// γₙ = n ε / (1 − n ε): the relative error of n rounded operations (Higham; PBRT 4th ed., 6.8).
const fn gamma(n: u32) -> f32 {
    const HALF_ULP: f32 = f32::EPSILON * 0.5;
    (n as f32 * HALF_ULP) / (1.0 - n as f32 * HALF_ULP)
}

/// A hit on a triangle or sphere, in the primitive's own space.
struct LocalHit<F: Float> {
    position: Vector<F>,
    error: Vector<F>,
    geometric_normal: Vector<F>,
    normal: Vector<F>,
    uv: (F, F),
    color: Vector<F>,
    part: F::Int,
}

impl<F: Float> LocalHit<F> {
    #[inline(always)]
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            position: Vector::select(mask, yes.position, no.position),
            error: Vector::select(mask, yes.error, no.error),
            geometric_normal: Vector::select(mask, yes.geometric_normal, no.geometric_normal),
            normal: Vector::select(mask, yes.normal, no.normal),
            uv: (F::select(mask, yes.uv.0, no.uv.0), F::select(mask, yes.uv.1, no.uv.1)),
            color: Vector::select(mask, yes.color, no.color),
            part: F::Int::select(mask, yes.part, no.part),
        }
    }
}

impl<F: Float> Surface<F> {
    /// The surface at a hit. Lanes outside `mask` are undefined.
    #[inline(always)]
    pub fn new(geometry: &Geometry, ray: &Ray<F>, hit: &HitLanes<F>, mask: F::Mask) -> Self {
        let is_sphere = !(hit.primitive & F::Int::splat(SPHERE)).eq(F::Int::splat(0)) & mask;
        let is_triangle = mask & !is_sphere;
        let placed = !hit.instance.eq(F::Int::splat(NONE)) & mask;
        let local = if !is_sphere.any() {
            triangle(geometry, hit, is_triangle)
        } else {
            let spheres = sphere(geometry, ray, hit, is_sphere, placed);
            if is_triangle.any() {
                LocalHit::select(is_sphere, spheres, triangle(geometry, hit, is_triangle))
            } else {
                spheres
            }
        };
        let material = material_of_part(geometry, hit, local.part, mask);
        let mut world = local;
        if placed.any() {
            world = to_world(geometry, hit, world, placed);
        }
        Self::facing(world, ray, material)
    }

    /// Flips the normals to the viewer's side.
    #[inline(always)]
    fn facing(world: LocalHit<F>, ray: &Ray<F>, material: F::Int) -> Self {
        let zero = F::zero();
        // The winding order determines the outside; vertex normals are for shading only.
        let inside = world.geometric_normal.dot(ray.direction).gt(zero);
        let geometric = Vector::select(inside, -world.geometric_normal, world.geometric_normal);
        let agrees = world.normal.dot(geometric).ge(zero);
        Self {
            position: world.position,
            offset: off_surface(world.position, world.error, geometric),
            geometric_normal: geometric,
            normal: Vector::select(agrees, world.normal, -world.normal),
            inside,
            uv: world.uv,
            color: world.color,
            material,
        }
    }
}

/// The error of a point along the normal, plus the rounding error of adding it to the point (PBRT 4th ed., 6.8.6).
#[inline(always)]
fn off_surface<F: Float>(position: Vector<F>, error: Vector<F>, normal: Vector<F>) -> F {
    let rounding = position.abs() * F::splat(f32::EPSILON);
    normal.abs().dot(error + rounding)
}

/// A ray origin just off a surface, on the side of `direction`.
#[inline(always)]
pub fn offset_origin<F: Float>(
    position: Vector<F>,
    normal: Vector<F>,
    offset: F,
    direction: Vector<F>,
) -> Vector<F> {
    let away = direction.dot(normal).lt(F::zero());
    position + normal * F::select(away, -offset, offset)
}

#[inline(always)]
fn triangle<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> LocalHit<F> {
    let id = hit.primitive;
    let vertices = F::Int::gather_three(geometry.triangles.as_flattened(), id * F::Int::splat(3), mask);
    let part = F::Int::gather(&geometry.triangle_parts, id, mask);
    let parts = PartLanes::new(part, mask);
    let weights = [F::one() - hit.u - hit.v, hit.u, hit.v];

    let p = corners(&geometry.positions, vertices, mask);
    let terms = [p[0] * weights[0], p[1] * weights[1], p[2] * weights[2]];
    let position = terms[0] + terms[1] + terms[2];
    let error = (terms[0].abs() + terms[1].abs() + terms[2].abs()) * F::splat(gamma(7));
    let sign = parts.number(&geometry.parts.sign);
    let flat =
        normalize_or((p[1] - p[0]).cross(p[2] - p[0]) * sign, Vector::new(F::zero(), F::zero(), F::one()));

    let none = F::Int::splat(NONE);
    let base = parts.base(&geometry.parts.normals, geometry.normals.is_empty());
    let smooth = mask & !base.eq(none);
    let normal = if smooth.any() {
        let n = interpolate(&geometry.normals, vertices, base, weights, smooth);
        // Opposite normals can cancel, and a zero normal means flat shading.
        Vector::select(smooth, normalize_or(n, flat), flat)
    } else {
        flat
    };

    let base = parts.base(&geometry.parts.uvs, geometry.uvs.is_empty());
    let mapped = mask & !base.eq(none);
    let mut uv = (hit.u, hit.v);
    if mapped.any() {
        let (mut u, mut v) = (F::zero(), F::zero());
        for k in 0..3 {
            let index = (vertices[k] + base) * F::Int::splat(2);
            u = u + F::gather(geometry.uvs.as_flattened(), index, mapped) * weights[k];
            let index = index + F::Int::splat(1);
            v = v + F::gather(geometry.uvs.as_flattened(), index, mapped) * weights[k];
        }
        uv = (F::select(mapped, u, uv.0), F::select(mapped, v, uv.1));
    }

    let base = parts.base(&geometry.parts.colors, geometry.colors.is_empty());
    let colored = mask & !base.eq(none);
    let white = Vector::new(F::one(), F::one(), F::one());
    let color = if colored.any() {
        Vector::select(colored, interpolate(&geometry.colors, vertices, base, weights, colored), white)
    } else {
        white
    };
    LocalHit { position, error, geometric_normal: flat, normal, uv, color, part }
}

/// The parts that lanes have hit: usually the same part, whose values are then loaded only once.
struct PartLanes<F: Float> {
    part: F::Int,
    mask: F::Mask,
    same: Option<usize>,
}

impl<F: Float> PartLanes<F> {
    #[inline(always)]
    fn new(part: F::Int, mask: F::Mask) -> Self {
        let mut parts = [0; 16];
        part.store(&mut parts);
        let first = parts[mask.bits().trailing_zeros() as usize % 16];
        let is_same = mask.any() && !(mask & !part.eq(F::Int::splat(first))).any();
        Self { part, mask, same: is_same.then_some(first as usize) }
    }

    /// The values of the parts in a column.
    #[inline(always)]
    fn number(&self, column: &[f32]) -> F {
        match self.same {
            Some(part) => F::splat(column[part]),
            None => F::gather(column, self.part, self.mask),
        }
    }

    /// The offsets of the parts' entries in another table; [`NONE`] for parts without entries, and for all if the table
    /// is empty.
    #[inline(always)]
    fn base(&self, column: &[u32], is_empty: bool) -> F::Int {
        match self.same {
            _ if is_empty => F::Int::splat(NONE),
            Some(part) => F::Int::splat(column[part]),
            None => F::Int::gather(column, self.part, self.mask),
        }
    }
}

/// Loads the entries of a table for three vertices.
#[inline(always)]
pub(super) fn corners<F: Float>(table: &[[f32; 3]], vertices: [F::Int; 3], mask: F::Mask) -> [Vector<F>; 3] {
    [
        Vector::gather(table, vertices[0], mask),
        Vector::gather(table, vertices[1], mask),
        Vector::gather(table, vertices[2], mask),
    ]
}

/// The weighted sum of the vertices' entries, whose indices are offset by `base`.
#[inline(always)]
fn interpolate<F: Float>(
    table: &[[f32; 3]],
    vertices: [F::Int; 3],
    base: F::Int,
    weights: [F; 3],
    mask: F::Mask,
) -> Vector<F> {
    let places = [vertices[0] + base, vertices[1] + base, vertices[2] + base];
    let [a, b, c] = corners(table, places, mask);
    a * weights[0] + b * weights[1] + c * weights[2]
}

/// v / |v|, or `other` if v is too short or NaN.
#[inline(always)]
pub(super) fn normalize_or<F: Float>(v: Vector<F>, other: Vector<F>) -> Vector<F> {
    let square = v.dot(v);
    let long = square.gt(F::splat(1e-36));
    let length = F::select(long, square, F::one()).sqrt();
    Vector::select(long, v * (F::one() / length), other)
}

#[inline(always)]
fn sphere<F: Float>(
    geometry: &Geometry,
    ray: &Ray<F>,
    hit: &HitLanes<F>,
    mask: F::Mask,
    placed: F::Mask,
) -> LocalHit<F> {
    let id = hit.primitive & F::Int::splat(!SPHERE);
    let (center, radius) = {
        let (table, first) = (geometry.spheres.as_flattened(), id * F::Int::splat(4));
        (Vector::gather_flat(table, first, mask), F::gather(table, first + F::Int::splat(3), mask))
    };
    let mut ray = *ray;
    if (mask & placed).any() {
        ray = to_local(geometry, &ray, hit.instance, mask & placed);
    }
    // The point is projected onto the sphere along its normal, so the error of the ray's distance no longer matters.
    let rough = ray.origin + ray.direction * hit.t - center;
    let normal = normalize_or(rough, Vector::new(F::zero(), F::one(), F::zero()));
    let mut position = center + normal * radius;
    let radii = Vector::new(radius, radius, radius);
    let mut error = (center.abs() + radii) * F::splat(gamma(6));
    let vast = mask & is_vast(radius, &ray.origin, hit.t);
    if vast.any() {
        // The ray's distance is more accurate than the position of the sphere's surface.
        let way = ray.direction * hit.t;
        position = Vector::select(vast, ray.origin + way, position);
        error = Vector::select(vast, (ray.origin.abs() + way.abs()) * F::splat(gamma(4)), error);
    }

    let uv = sphere_uv(geometry, id, normal, mask);
    let white = Vector::new(F::one(), F::one(), F::one());
    let part = F::Int::gather(&geometry.sphere_parts, id, mask);
    LocalHit { position, error, geometric_normal: normal, normal, uv, color: white, part }
}

/// Texture coordinates of a sphere at a point with this normal.
#[inline(always)]
pub(super) fn sphere_uv<F: Float>(
    geometry: &Geometry,
    id: F::Int,
    normal: Vector<F>,
    mask: F::Mask,
) -> (F, F) {
    let (axes, first) = (geometry.sphere_axes.as_flattened(), id * F::Int::splat(9));
    let x = Vector::gather_flat(axes, first, mask).dot(normal);
    let y = Vector::gather_flat(axes, first + F::Int::splat(3), mask).dot(normal);
    let z = Vector::gather_flat(axes, first + F::Int::splat(6), mask).dot(normal);
    (F::splat(0.5) + atan2_turns(-z, x), acos_turns(y.clamp(-1.0, 1.0)) * F::splat(2.0))
}

/// Three rows of an instance's matrices: local to world if `first` is 0, with an offset that is added after the
/// rotation; world to local if it is 3, with an offset that is subtracted before the rotation.
#[inline(always)]
pub(super) fn rows<F: Float>(
    geometry: &Geometry,
    instance: F::Int,
    first: u32,
    mask: F::Mask,
) -> AffineRows<F> {
    let (table, start) = (geometry.instances.as_flattened(), instance * F::Int::splat(24));
    let start = start + F::Int::splat(4 * first);
    let (second, third) = (start + F::Int::splat(4), start + F::Int::splat(8));
    AffineRows {
        x: Vector::gather_flat(table, start, mask),
        y: Vector::gather_flat(table, second, mask),
        z: Vector::gather_flat(table, third, mask),
        offset: Vector::new(
            F::gather(table, start + F::Int::splat(3), mask),
            F::gather(table, second + F::Int::splat(3), mask),
            F::gather(table, third + F::Int::splat(3), mask),
        ),
    }
}

/// The rows of a matrix, and an offset.
pub(super) struct AffineRows<F> {
    x: Vector<F>,
    y: Vector<F>,
    z: Vector<F>,
    offset: Vector<F>,
}

impl<F: Float> AffineRows<F> {
    #[inline(always)]
    pub(super) fn apply(&self, v: Vector<F>) -> Vector<F> {
        Vector::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Multiplies by the transpose: transforms a gradient to the other space.
    #[inline(always)]
    pub(super) fn apply_transposed(&self, v: Vector<F>) -> Vector<F> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// Multiplies by the absolute values: transforms error bounds.
    #[inline(always)]
    fn apply_abs(&self, v: Vector<F>) -> Vector<F> {
        Vector::new(self.x.abs().dot(v), self.y.abs().dot(v), self.z.abs().dot(v))
    }
}

#[inline(always)]
fn to_local<F: Float>(geometry: &Geometry, ray: &Ray<F>, instance: F::Int, placed: F::Mask) -> Ray<F> {
    let rows = rows(geometry, instance, 3, placed);
    let (origin, direction) = (rows.apply(ray.origin - rows.offset), rows.apply(ray.direction));
    Ray {
        origin: Vector::select(placed, origin, ray.origin),
        direction: Vector::select(placed, direction, ray.direction),
        ..*ray
    }
}

/// The material of each lane's hit, [`NONE`] for misses.
#[inline(always)]
pub fn material_of<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> F::Int {
    let none = F::Int::splat(NONE);
    let met = mask & !hit.primitive.eq(none);
    let sphere = F::Int::splat(SPHERE);
    let is_sphere = !(hit.primitive & sphere).eq(F::Int::splat(0)) & met;
    let mut part = F::Int::gather(&geometry.triangle_parts, hit.primitive, met & !is_sphere);
    if is_sphere.any() {
        let spheres = F::Int::gather(&geometry.sphere_parts, hit.primitive ^ sphere, is_sphere);
        part = F::Int::select(is_sphere, spheres, part);
    }
    F::Int::select(met, material_of_part(geometry, hit, part, met), none)
}

/// The material of a part, or the one that overrides it in the instance.
#[inline(always)]
fn material_of_part<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, part: F::Int, mask: F::Mask) -> F::Int {
    let own = F::Int::gather(&geometry.parts.material, part, mask);
    let placed = !hit.instance.eq(F::Int::splat(NONE)) & mask;
    if !placed.any() {
        return own;
    }
    let given = F::Int::gather(&geometry.instance_materials, hit.instance, placed);
    F::Int::select(placed & !given.eq(F::Int::splat(NONE)), given, own)
}

#[inline(always)]
fn to_world<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    local: LocalHit<F>,
    placed: F::Mask,
) -> LocalHit<F> {
    let there = rows(geometry, hit.instance, 0, placed);
    let position = there.apply(local.position) + there.offset;
    // The transformed error of the local point, plus the error of the transformation itself.
    let moved = there.apply_abs(local.position.abs()) + there.offset.abs();
    let error = there.apply_abs(local.error) * F::splat(1.0 + gamma(3)) + moved * F::splat(gamma(4));
    let back = rows(geometry, hit.instance, 3, placed);
    let geometric = transform_normal(&back, local.geometric_normal);
    let normal = transform_normal(&back, local.normal);
    LocalHit {
        position: Vector::select(placed, position, local.position),
        error: Vector::select(placed, error, local.error),
        geometric_normal: Vector::select(placed, geometric, local.geometric_normal),
        normal: Vector::select(placed, normal, local.normal),
        ..local
    }
}

/// Transforms a normal by the inverse transpose, whose columns are the rows of `to_local`.
#[inline(always)]
pub(super) fn transform_normal<F: Float>(to_local: &AffineRows<F>, n: Vector<F>) -> Vector<F> {
    normalize_or(to_local.apply_transposed(n), n)
}
