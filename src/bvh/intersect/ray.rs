//! A ray with the values precomputed for boxes, for triangles and for an instance's space.

use super::triangle::Shear;
use crate::bvh::Rays;
use crate::bvh::layout::{Instance, Node, PADDING, WIDTH};
use crate::math::{Aabb, Ray, Vector};
use crate::simd::{Float, Sixteen};

impl Rays<'_> {
    /// Returns ray `i`. A negative `t_min` counts as 0.
    #[inline(always)]
    pub(in crate::bvh) fn get(&self, i: usize) -> Ray<f32> {
        let [ox, oy, oz] = self.origin;
        let [dx, dy, dz] = self.direction;
        Ray {
            origin: Vector { x: ox[i], y: oy[i], z: oz[i] },
            direction: Vector { x: dx[i], y: dy[i], z: dz[i] },
            // NaN stays NaN, −0 becomes 0.
            t_min: Float::max(0.0, self.t_min[i]) + 0.0,
            t_max: self.t_max[i],
        }
    }
}

/// True if all components of a ray are finite. Otherwise every box would be open, even the unused ones of a node, and
/// the traversal would run in circles.
#[inline(always)]
pub(in crate::bvh) fn is_finite(ray: &Ray<f32>) -> bool {
    let (o, d) = (ray.origin, ray.direction);
    // A non-finite value times 0 is NaN.
    o.x * 0.0 + o.y * 0.0 + o.z * 0.0 + d.x * 0.0 + d.y * 0.0 + d.z * 0.0 == 0.0
}

/// A ray with the values precomputed for one space.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct LocalRay {
    pub ray: Ray<f32>,
    pub slabs: RaySlabs,
    pub shear: Shear,
}

impl LocalRay {
    #[inline(always)]
    pub fn new(ray: Ray<f32>) -> Self {
        Self { ray, slabs: RaySlabs::new(&ray), shear: Shear::new(&ray) }
    }
}

/// The ray in an instance's space; its direction is not normalized.
#[inline(always)]
pub(in crate::bvh) fn to_local(ray: &Ray<f32>, instance: &Instance) -> Ray<f32> {
    let (o, d) = (ray.origin, ray.direction);
    let ([ox, oy, oz], [dx, dy, dz]) = line_to_local(instance, [o.x, o.y, o.z], [d.x, d.y, d.z]);
    Ray { origin: Vector { x: ox, y: oy, z: oz }, direction: Vector { x: dx, y: dy, z: dz }, ..*ray }
}

/// Transforms origins and directions to an instance's space.
#[inline(always)]
pub(in crate::bvh) fn line_to_local<F: Float>(
    instance: &Instance,
    mut origin: [F; 3],
    direction: [F; 3],
) -> ([F; 3], [F; 3]) {
    for (from, place) in origin.iter_mut().zip(instance.place()) {
        *from = *from - F::splat(place);
    }
    let (mut from, mut along) = ([F::zero(); 3], [F::zero(); 3]);
    for (axis, row) in instance.to_local.iter().enumerate() {
        let [a, b, c] = [F::splat(row[0]), F::splat(row[1]), F::splat(row[2])];
        from[axis] = a * origin[0] + b * origin[1] + c * origin[2];
        along[axis] = a * direction[0] + b * direction[1] + c * direction[2];
    }
    (from, along)
}

/// The factors for near and for far planes from a component's reciprocal, see [`RaySlabs`].
#[inline(always)]
pub(in crate::bvh) fn slab_scales<F: Float>(reciprocal: F) -> (F, F) {
    (reciprocal * F::splat(PADDING - 1.0), reciprocal * F::splat(-1.0 - PADDING))
}

/// A ray prepared for boxes: reciprocal directions, rounded towards the origin for near planes and away from it for far
/// ones, and negated: the distance to a plane is computed as (origin − plane) · scale, so that the planes can stay in
/// memory.
#[derive(Clone, Copy, Default)]
pub(in crate::bvh) struct RaySlabs {
    pub origin: [f32; 3],
    pub near_scale: [f32; 3],
    pub far_scale: [f32; 3],
    /// The index of the first near plane among a node's planes across an axis: 0 or 16.
    pub near_planes: [u32; 3],
    /// The least entry distance.
    pub floor: f32,
}

impl RaySlabs {
    #[inline(always)]
    pub fn new(ray: &Ray<f32>) -> Self {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z];
        let reciprocal = direction.map(|d| 1.0 / d);
        Self {
            origin: [ray.origin.x, ray.origin.y, ray.origin.z],
            near_scale: reciprocal.map(|r| slab_scales(r).0),
            far_scale: reciprocal.map(|r| slab_scales(r).1),
            near_planes: reciprocal.map(|r| (r.to_bits() >> 31) * WIDTH as u32),
            floor: ray.t_min,
        }
    }

    /// The octant: bit i is set if the ray goes down along axis i.
    #[inline(always)]
    pub fn octant(&self) -> u32 {
        let [x, y, z] = self.near_planes;
        (x | y << 1 | z << 2) / WIDTH as u32
    }

    /// The distance at which the ray enters a box, if it does.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "the axis indexes five arrays")]
    pub fn enter(&self, bounds: &Aabb) -> Option<f32> {
        let corners = [bounds.min, bounds.max];
        let (mut near, mut far) = (self.floor, f32::INFINITY);
        for axis in 0..3 {
            let side = usize::from(self.near_planes[axis] != 0);
            // As for the children below: a NaN (0 · ∞, a ray in the plane) leaves the interval as it is.
            near = Float::max((self.origin[axis] - corners[side][axis]) * self.near_scale[axis], near);
            far = Float::min((self.origin[axis] - corners[1 - side][axis]) * self.far_scale[axis], far);
        }
        (near <= far).then_some(near)
    }

    /// The entry and exit distances of a node's children, no farther than `limit`; if the ray misses a child, its exit
    /// is nearer than its entry.
    ///
    /// A child's box lies in its parent's and rounding is monotonic, so a ray never enters it before its parent: the
    /// entry is a function of the ray and the child's box only.
    #[inline(always)]
    pub fn meet_children<S: Sixteen>(&self, node: &Node, limit: f32) -> (S, S) {
        let (mut near, mut far) = (S::splat(self.floor), S::splat(limit));
        for axis in 0..3 {
            let (first, last) = node.planes_across(axis, self.near_planes[axis]);
            let origin = S::splat(self.origin[axis]);
            near = ((origin - S::load(first)) * S::splat(self.near_scale[axis])).max(near);
            far = ((origin - S::load(last)) * S::splat(self.far_scale[axis])).min(far);
        }
        (near, far)
    }
}

const _: () = assert!(WIDTH == 16, "a node's children fill a `Sixteen`");
