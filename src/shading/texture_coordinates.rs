//! Data of hits that only some materials need: a second set of texture coordinates, the ray's footprint, tangents.

use std::f32::consts::PI;

use super::footprint::{Footprint, on_surface};
use super::principled::shading_frame::ShadingFrame;
use super::surface::{HitLanes, Surface, corners, normalize_or, rows, transform_normal};
use super::texture_lookup::Coordinates;
use super::vertices::AtVertices;
use crate::bvh::layout::sidedness::SPHERE;
use crate::math::elementary::sin_cos_turns;
use crate::math::{NONE, Vector};
use crate::scene::Geometry;
use crate::simd::{Float, Int, Mask, Outlined};

/// The triangles of hits: vertices, parts and barycentric weights.
pub(super) struct HitCorners<F: Float> {
    pub(super) vertices: [F::Int; 3],
    pub(super) part: F::Int,
    pub(super) weights: [F; 3],
    pub(super) is_triangle: F::Mask,
}

/// A set of texture coordinates: at the hits, at the corners, and the lanes that have them.
struct UvSet<F: Float> {
    at: (F, F),
    corners: [(F, F); 3],
    mapped: F::Mask,
}

impl<F: Float> HitCorners<F> {
    #[inline(always)]
    pub(super) fn new(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> Self {
        let is_triangle = (hit.primitive & F::Int::splat(SPHERE)).eq(F::Int::splat(0)) & mask;
        let first = hit.primitive * F::Int::splat(3);
        Self {
            vertices: F::Int::gather_three(geometry.triangles.as_flattened(), first, is_triangle),
            part: F::Int::gather(&geometry.triangle_parts, hit.primitive, is_triangle),
            weights: [F::one() - hit.u - hit.v, hit.u, hit.v],
            is_triangle,
        }
    }

    /// Loads a pair of numbers for each vertex.
    #[inline(always)]
    fn pairs(&self, table: &[[f32; 2]], base: F::Int, mask: F::Mask) -> [(F, F); 3] {
        let table = table.as_flattened();
        let mut pairs = [(F::zero(), F::zero()); 3];
        for (pair, vertex) in pairs.iter_mut().zip(self.vertices) {
            let index = (vertex + base) * F::Int::splat(2);
            *pair = (F::gather(table, index, mask), F::gather(table, index + F::Int::splat(1), mask));
        }
        pairs
    }

    /// Looks up a set of texture coordinates; `other` for parts that have none.
    #[inline(always)]
    fn set(&self, table: &[[f32; 2]], parts: &[u32], other: (F, F)) -> UvSet<F> {
        let base = F::Int::gather(parts, self.part, self.is_triangle);
        let mapped = self.is_triangle & !base.eq(F::Int::splat(NONE));
        let corners = self.pairs(table, base, mapped);
        let (u, v) = self.blend(corners);
        UvSet { at: (F::select(mapped, u, other.0), F::select(mapped, v, other.1)), corners, mapped }
    }

    #[inline(always)]
    fn blend(&self, pairs: [(F, F); 3]) -> (F, F) {
        let w = self.weights;
        (
            pairs[0].0 * w[0] + pairs[1].0 * w[1] + pairs[2].0 * w[2],
            pairs[0].1 * w[0] + pairs[1].1 * w[1] + pairs[2].1 * w[2],
        )
    }
}

/// The texture coordinates of a hit without its surface. The footprint is a point, which selects the finest level. `uv`
/// are the coordinates of spheres.
#[inline(always)]
pub fn point_coordinates<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    uv: (F, F),
    mask: F::Mask,
) -> Coordinates<F> {
    let triangle = HitCorners::new(geometry, hit, mask);
    let of_hit = (F::select(triangle.is_triangle, hit.u, uv.0), F::select(triangle.is_triangle, hit.v, uv.1));
    let first = triangle.set(&geometry.uvs, &geometry.parts.uvs, of_hit).at;
    let second = triangle.set(&geometry.uvs1, &geometry.parts.uvs1, first).at;
    let mut at = Coordinates::point([first, second]);
    if geometry.keeps_object_space {
        let (uv_axes, diameters) = ([(F::zero(), F::zero()); 2], [Vector::zero(); 2]);
        at.object = F::outlined(ObjectPlace { geometry, hit, uv, uv_axes, diameters, mask }).0;
    }
    if geometry.has_vertex_textures {
        at.vertex = F::outlined(AtVertices { geometry, hit, mask });
    }
    at
}

/// The texture coordinates and footprints of a hit; `width` is that of the ray, in metres.
#[inline(always)]
pub fn coordinates<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    direction: Vector<F>,
    width: F,
    mask: F::Mask,
) -> Coordinates<F> {
    let mut at = Coordinates::point([surface.uv; 2]);
    let triangle = HitCorners::new(geometry, hit, mask);
    let diameters = on_surface(surface.geometric_normal, direction, width, hit.t);
    let round = mask & !triangle.is_triangle;
    if round.any() {
        let (u, v) = round_gradients(geometry, hit, surface, round);
        at.footprint = [Footprint::select(round, Footprint::new(&diameters, u, v), Footprint::point()); 2];
    }
    if geometry.keeps_object_space {
        let (uv, uv_axes) = (surface.uv, at.footprint[0].axes);
        (at.object, at.object_footprint) =
            F::outlined(ObjectPlace { geometry, hit, uv, uv_axes, diameters, mask });
    }
    if geometry.has_vertex_textures {
        at.vertex = F::outlined(AtVertices { geometry, hit, mask });
    }
    if geometry.uvs.is_empty() {
        return at;
    }
    let first = triangle.set(&geometry.uvs, &geometry.parts.uvs, surface.uv);
    let along = triangle.along(geometry, hit, first.mapped);
    at.footprint[0] = along.footprint(&first, &diameters, at.footprint[0]);
    at.footprint[1] = at.footprint[0];
    if !geometry.uvs1.is_empty() {
        let second = triangle.set(&geometry.uvs1, &geometry.parts.uvs1, surface.uv);
        at.uv[1] = second.at;
        at.footprint[1] = along.footprint(&second, &diameters, at.footprint[1]);
    }
    at
}

/// The position of a hit in its object's space, and the ray's footprint there. Few scenes want them: inlined in all
/// kernels they would take long to compile.
struct ObjectPlace<'a, F: Float> {
    geometry: &'a Geometry,
    hit: &'a HitLanes<F>,
    /// The coordinates of spheres, and the footprint in them.
    uv: (F, F),
    uv_axes: [(F, F); 2],
    /// Two conjugate diameters of the footprint in world space.
    diameters: [Vector<F>; 2],
    mask: F::Mask,
}

impl<F: Float> Outlined for ObjectPlace<'_, F> {
    type Output = (Vector<F>, [Vector<F>; 2]);
    #[inline(always)]
    fn run(self) -> Self::Output {
        let ObjectPlace { geometry, hit, uv, uv_axes, diameters, mask } = self;
        let triangle = HitCorners::new(geometry, hit, mask);
        let (place, [s, t]) = object_position(geometry, hit, &triangle, uv, mask);
        let along = triangle.along(geometry, hit, triangle.is_triangle);
        let mut footprint = [Vector::zero(); 2];
        for (axis, d) in diameters.into_iter().enumerate() {
            let uv = uv_axes[axis];
            let flat = s * along.0.dot(d) + t * along.1.dot(d);
            footprint[axis] = Vector::select(triangle.is_triangle, flat, s * uv.0 + t * uv.1);
        }
        (place, footprint)
    }
}

/// The position of a hit in its object's space, and the edges from a triangle's first corner to the others there; of a
/// sphere the derivatives by u and v, which are its texture coordinates.
#[inline(always)]
fn object_position<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    triangle: &HitCorners<F>,
    (u, v): (F, F),
    mask: F::Mask,
) -> (Vector<F>, [Vector<F>; 2]) {
    let is_triangle = triangle.is_triangle;
    let base = F::Int::gather(&geometry.parts.object, triangle.part, is_triangle);
    let moved = is_triangle & !base.eq(F::Int::splat(NONE));
    let mut corners: [Vector<F>; 3] = corners(&geometry.positions, triangle.vertices, is_triangle);
    if moved.any() {
        for (corner, vertex) in corners.iter_mut().zip(triangle.vertices) {
            let own = Vector::gather(&geometry.object_positions, vertex + base, moved);
            *corner = Vector::select(moved, own, *corner);
        }
    }
    let [p, q, r] = corners;
    let (mut place, mut s, mut t) = (p + (q - p) * hit.u + (r - p) * hit.v, q - p, r - p);
    let round = mask & !is_triangle;
    if round.any() {
        let part = F::Int::gather(&geometry.sphere_parts, hit.primitive ^ F::Int::splat(SPHERE), round);
        let radius = F::Int::gather(&geometry.parts.object, part, round).reinterpret();
        let ((sin, cos), (sin_v, cos_v)) = (sin_cos_turns(u), sin_cos_turns(v * F::splat(0.5)));
        place = Vector::select(round, Vector::new(-(cos * sin_v), cos_v, sin * sin_v) * radius, place);
        let around = Vector::new(sin * sin_v, F::zero(), cos * sin_v) * (radius * F::splat(2.0 * PI));
        let down = Vector::new(-(cos * cos_v), -sin_v, sin * cos_v) * (radius * F::splat(PI));
        (s, t) = (Vector::select(round, around, s), Vector::select(round, down, t));
    }
    (place, [s, t])
}

/// The gradients of the barycentric weights of a triangle's second and third corner, per metre in world space.
pub(super) struct WeightGradients<F: Float>(pub(super) Vector<F>, pub(super) Vector<F>);

impl<F: Float> WeightGradients<F> {
    /// The gradients of u and v of a set of coordinates.
    #[inline(always)]
    fn of(&self, set: &UvSet<F>) -> (Vector<F>, Vector<F>) {
        let [a, b, c] = set.corners;
        (self.0 * (b.0 - a.0) + self.1 * (c.0 - a.0), self.0 * (b.1 - a.1) + self.1 * (c.1 - a.1))
    }

    /// The footprint in a set of coordinates; `other` if there is no such set.
    #[inline(always)]
    fn footprint(&self, set: &UvSet<F>, diameters: &[Vector<F>; 2], other: Footprint<F>) -> Footprint<F> {
        let (u, v) = self.of(set);
        Footprint::select(set.mapped, Footprint::new(diameters, u, v), other)
    }
}

impl<F: Float> HitCorners<F> {
    #[inline(always)]
    pub(super) fn along(&self, geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> WeightGradients<F> {
        let [p, q, r]: [Vector<F>; 3] = corners(&geometry.positions, self.vertices, mask);
        let (mut s, mut t) = (q - p, r - p);
        let placed = mask & !hit.instance.eq(F::Int::splat(NONE));
        if placed.any() {
            let there = rows(geometry, hit.instance, 0, placed);
            s = Vector::select(placed, there.apply(s), s);
            t = Vector::select(placed, there.apply(t), t);
        }
        // The edges and their dual basis: s · (t × n) is 1 and t · (t × n) is 0.
        let normal = s.cross(t);
        let part = F::one() / normal.dot(normal).max(F::splat(1e-30));
        WeightGradients(t.cross(normal) * part, normal.cross(s) * part)
    }
}

/// The gradients of a sphere's u and v, per metre in world space.
#[inline(always)]
fn round_gradients<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    round: F::Mask,
) -> (Vector<F>, Vector<F>) {
    let id = hit.primitive ^ F::Int::splat(SPHERE);
    let (table, first) = (geometry.sphere_axes.as_flattened(), id * F::Int::splat(9));
    let axes: [Vector<F>; 3] = [
        Vector::gather_flat(table, first, round),
        Vector::gather_flat(table, first + F::Int::splat(3), round),
        Vector::gather_flat(table, first + F::Int::splat(6), round),
    ];
    let table = geometry.spheres.as_flattened();
    let per_metre = F::one() / F::gather(table, id * F::Int::splat(4) + F::Int::splat(3), round);
    let mut normal = Vector::select(surface.inside, -surface.geometric_normal, surface.geometric_normal);
    let mut gradients = axes;
    let placed = round & !hit.instance.eq(F::Int::splat(NONE));
    if placed.any() {
        let (there, back) =
            (rows(geometry, hit.instance, 0, placed), rows(geometry, hit.instance, 3, placed));
        normal = Vector::select(placed, transform_normal(&there, normal), normal);
        gradients[0] = Vector::select(placed, back.apply_transposed(axes[0]), axes[0]);
        gradients[1] = Vector::select(placed, back.apply_transposed(axes[1]), axes[1]);
        gradients[2] = Vector::select(placed, back.apply_transposed(axes[2]), axes[2]);
    }
    let (x, z) = (axes[0].dot(normal), axes[2].dot(normal));
    // u is atan2(−z, x) plus half a turn, v is acos(y) in half turns.
    let flat = (x * x + z * z).max(F::splat(1e-12));
    let u = (gradients[0] * z - gradients[2] * x) * (per_metre * F::splat(0.5 / PI) / flat);
    let v = -gradients[1] * (per_metre * F::splat(1.0 / PI) / flat.sqrt());
    (u, v)
}

/// The gradients of u and v of a set of texture coordinates, per metre in world space.
#[inline(always)]
pub fn uv_gradients<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    set: usize,
    mask: F::Mask,
) -> (Vector<F>, Vector<F>) {
    let triangle = HitCorners::new(geometry, hit, mask);
    let first = triangle.set(&geometry.uvs, &geometry.parts.uvs, surface.uv);
    let second = triangle.set(&geometry.uvs1, &geometry.parts.uvs1, surface.uv);
    let along = triangle.along(geometry, hit, first.mapped | second.mapped);
    let (mut u, mut v) = along.of(&first);
    if set == 1 {
        let of_second = along.of(&second);
        u = Vector::select(second.mapped, of_second.0, u);
        v = Vector::select(second.mapped, of_second.1, v);
    }
    let round = mask & !triangle.is_triangle;
    if round.any() {
        let of_sphere = round_gradients(geometry, hit, surface, round);
        u = Vector::select(round, of_sphere.0, u);
        v = Vector::select(round, of_sphere.1, v);
    }
    let known = first.mapped | second.mapped | round;
    (Vector::select(known, u, Vector::zero()), Vector::select(known, v, Vector::zero()))
}

/// The gradient in world space of a value whose gradient in the object's space is `slope`, along the surface.
#[inline(always)]
pub fn object_gradient<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    slope: Vector<F>,
    mask: F::Mask,
) -> Vector<F> {
    let triangle = HitCorners::new(geometry, hit, mask);
    let (_, [s, t]) = object_position(geometry, hit, &triangle, surface.uv, mask);
    let along = triangle.along(geometry, hit, triangle.is_triangle);
    let (mut first, mut second) = (along.0, along.1);
    let round = mask & !triangle.is_triangle;
    if round.any() {
        let (u, v) = round_gradients(geometry, hit, surface, round);
        (first, second) = (Vector::select(round, u, first), Vector::select(round, v, second));
    }
    first * s.dot(slope) + second * t.dot(slope)
}

/// A frame whose x follows the mesh's tangents, or the direction of increasing u if there are none (as on a sphere),
/// and whose z is the shading normal. On the inner side z is flipped, x and y are not: a normal map looks the same from
/// behind.
#[inline(always)]
pub fn tangent_frame<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    mask: F::Mask,
) -> ShadingFrame<F> {
    let plain = ShadingFrame::about(surface.normal);
    let triangle = HitCorners::new(geometry, hit, mask);
    let none = F::Int::splat(NONE);
    let base = F::Int::gather(&geometry.parts.tangents, triangle.part, triangle.is_triangle);
    let given = triangle.is_triangle & !base.eq(none);
    let (mut x, mut sign) = (plain.x, F::one());
    if given.any() {
        let (xs, ss) = given_tangents(geometry, &triangle, base, given);
        x = Vector::select(given, xs, x);
        sign = F::select(given, ss, sign);
    }
    let base = F::Int::gather(&geometry.parts.uvs, triangle.part, triangle.is_triangle);
    let derived = triangle.is_triangle & !given & !base.eq(none);
    if derived.any() {
        let (along, side) = derived_tangents(geometry, &triangle, base, derived);
        x = Vector::select(derived, along, x);
        sign = F::select(derived, side, sign);
    }
    let placed = (given | derived) & !hit.instance.eq(none);
    let round = mask & !triangle.is_triangle;
    if placed.any() {
        let there = rows(geometry, hit.instance, 0, placed);
        x = Vector::select(placed, there.apply(x), x);
        let turned = F::gather(&geometry.instance_signs, hit.instance, placed);
        sign = F::select(placed, sign * turned, sign);
    }
    // The bitangent belongs to the outward normal.
    let outward = Vector::select(surface.inside, -surface.normal, surface.normal);
    if round.any() {
        let (pole, side) = pole(geometry, hit, round);
        x = Vector::select(round, pole.cross(outward) * side, x);
        sign = F::select(round, side, sign);
    }
    let x = normalize_or(x - outward * outward.dot(x), plain.x);
    let known = given | derived | round;
    let part_sign = F::gather(&geometry.parts.sign, triangle.part, triangle.is_triangle);
    let y = outward.cross(x) * (sign * F::select(triangle.is_triangle, part_sign, F::one()));
    ShadingFrame {
        x: Vector::select(known, x, plain.x),
        y: Vector::select(known, y, plain.y),
        z: surface.normal,
    }
}

/// A sphere's +Y axis as a normal in world space, and −1 if the sphere is mirrored. u increases around this axis.
#[inline(always)]
fn pole<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, round: F::Mask) -> (Vector<F>, F) {
    let first = (hit.primitive ^ F::Int::splat(SPHERE)) * F::Int::splat(9);
    let axes = geometry.sphere_axes.as_flattened();
    let x: Vector<F> = Vector::gather_flat(axes, first, round);
    let mut pole = Vector::gather_flat(axes, first + F::Int::splat(3), round);
    let z = Vector::gather_flat(axes, first + F::Int::splat(6), round);
    let mut side = F::select(x.cross(pole).dot(z).lt(F::zero()), -F::one(), F::one());
    let placed = round & !hit.instance.eq(F::Int::splat(NONE));
    if placed.any() {
        pole = Vector::select(placed, transform_normal(&rows(geometry, hit.instance, 3, placed), pole), pole);
        side = F::select(placed, side * F::gather(&geometry.instance_signs, hit.instance, placed), side);
    }
    (pole, side)
}

#[inline(always)]
fn given_tangents<F: Float>(
    geometry: &Geometry,
    triangle: &HitCorners<F>,
    base: F::Int,
    given: F::Mask,
) -> (Vector<F>, F) {
    let table = geometry.tangents.as_flattened();
    let (mut sum, mut sign) = (Vector::zero(), F::zero());
    for k in 0..3 {
        let first = (triangle.vertices[k] + base) * F::Int::splat(4);
        sum = sum + Vector::gather_flat(table, first, given) * triangle.weights[k];
        sign = sign + F::gather(table, first + F::Int::splat(3), given);
    }
    (sum, F::select(sign.lt(F::zero()), -F::one(), F::one()))
}

/// The direction of increasing u, and the sign of the bitangent.
#[inline(always)]
fn derived_tangents<F: Float>(
    geometry: &Geometry,
    triangle: &HitCorners<F>,
    base: F::Int,
    derived: F::Mask,
) -> (Vector<F>, F) {
    let [a, b, c] = triangle.pairs(&geometry.uvs, base, derived);
    let [p, q, r] = corners(&geometry.positions, triangle.vertices, derived);
    let (du1, dv1, du2, dv2) = (b.0 - a.0, b.1 - a.1, c.0 - a.0, c.1 - a.1);
    let determinant = du1 * dv2 - dv1 * du2;
    let along = (q - p) * dv2 - (r - p) * dv1;
    let flips = determinant.lt(F::zero());
    // Texture coordinates increase downwards: the bitangent of glTF points to decreasing v.
    (Vector::select(flips, -along, along), F::select(flips, F::one(), -F::one()))
}

#[cfg(test)]
mod tests {
    use std::num::Wrapping;

    use super::super::vertices::alpha;
    use super::*;
    use crate::math::Ray;
    use crate::scene::geometry::Part;

    const PART: Part = Part {
        material: 0,
        normals: NONE,
        uvs: 0,
        uvs1: NONE,
        tangents: NONE,
        colors: NONE,
        alphas: NONE,
        object: NONE,
        mirrored: false,
        entity: 0,
    };

    /// Coordinates of an upright image on the triangle from (0, 0, 0) along X and Y: u increases along +X, v along −Y.
    const UPRIGHT: [[f32; 2]; 3] = [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]];

    fn triangle(uvs: [[f32; 2]; 3], part: Part) -> Geometry {
        let mut geometry = Geometry {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            uvs: uvs.to_vec(),
            triangles: vec![[0, 1, 2]],
            triangle_parts: vec![0],
            ..Geometry::default()
        };
        geometry.add_part(part);
        geometry
    }

    /// A hit at ½ a + ¼ b + ¼ c.
    fn middle(instance: u32) -> HitLanes<f32> {
        HitLanes { t: 1.0, u: 0.25, v: 0.25, primitive: Wrapping(0), instance: Wrapping(instance) }
    }

    fn vector(x: f32, y: f32, z: f32) -> Vector<f32> {
        Vector::new(x, y, z)
    }

    /// The triangle seen from above, or from below if `inside`.
    fn seen(inside: bool) -> Surface<f32> {
        let normal = vector(0.0, 0.0, if inside { -1.0 } else { 1.0 });
        Surface {
            position: vector(0.25, 0.25, 0.0),
            offset: 0.0,
            geometric_normal: normal,
            normal,
            inside,
            uv: (0.25, 0.75),
            color: vector(0.1, 0.2, 0.3),
            material: Wrapping(0),
        }
    }

    #[track_caller]
    fn near(found: Vector<f32>, expected: [f32; 3]) {
        let found = [found.x, found.y, found.z];
        let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close, "{found:?} instead of {expected:?}");
    }

    #[track_caller]
    fn axes(frame: &ShadingFrame<f32>, expected: [[f32; 3]; 3]) {
        near(frame.x, expected[0]);
        near(frame.y, expected[1]);
        near(frame.z, expected[2]);
    }

    const X: [f32; 3] = [1.0, 0.0, 0.0];
    const Y: [f32; 3] = [0.0, 1.0, 0.0];
    const Z: [f32; 3] = [0.0, 0.0, 1.0];

    fn minus(axis: [f32; 3]) -> [f32; 3] {
        axis.map(|c| 0.0 - c)
    }

    fn frame(geometry: &Geometry, inside: bool) -> ShadingFrame<f32> {
        tangent_frame(geometry, &middle(NONE), &seen(inside), true)
    }

    #[test]
    fn tangent_frames_follow_increasing_u_and_the_top_of_the_image() {
        axes(&frame(&triangle(UPRIGHT, PART), false), [X, Y, Z]);
        // From behind, only z is flipped.
        axes(&frame(&triangle(UPRIGHT, PART), true), [X, Y, minus(Z)]);
        let upside_down = UPRIGHT.map(|[u, v]| [u, 1.0 - v]);
        axes(&frame(&triangle(upside_down, PART), false), [X, minus(Y), Z]);
        let mirrored = UPRIGHT.map(|[u, v]| [1.0 - u, v]);
        axes(&frame(&triangle(mirrored, PART), false), [minus(X), Y, Z]);
        // A quarter turn: u increases along +Y, the image's top is at −X.
        let turned = UPRIGHT.map(|[u, v]| [1.0 - v, u]);
        axes(&frame(&triangle(turned, PART), false), [Y, minus(X), Z]);
    }

    #[test]
    fn tangent_frames_of_mirrored_parts_are_mirrored() {
        let mut geometry = triangle(UPRIGHT, Part { mirrored: true, ..PART });
        geometry.positions[1] = minus(X);
        axes(&frame(&geometry, false), [minus(X), Y, Z]);
    }

    #[test]
    fn vertex_tangents_override_uvs_and_are_made_orthogonal() {
        let part = Part { tangents: 0, ..PART };
        for (w, y) in [(1.0, minus(X)), (-1.0, X)] {
            let mut geometry = triangle(UPRIGHT, part);
            geometry.tangents = vec![[0.0, 3.0, 4.0, w]; 3];
            axes(&frame(&geometry, false), [Y, y, Z]);
        }
        // Interpolated by the corners' weights ½, ¼, ¼.
        let mut geometry = triangle(UPRIGHT, part);
        geometry.tangents = vec![[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]];
        let half = 0.5f32.sqrt();
        axes(&frame(&geometry, false), [[half, half, 0.0], [-half, half, 0.0], Z]);
    }

    #[test]
    fn tangent_frames_exist_without_uvs_and_rotate_with_instances() {
        let frame_of = frame(&triangle(UPRIGHT, Part { uvs: NONE, ..PART }), false);
        near(frame_of.x.cross(frame_of.y), Z);
        let mut geometry = triangle(UPRIGHT, PART);
        // A quarter turn about Z, twice as large.
        let rows = [0.0, -2.0, 0.0, 7.0, 2.0, 0.0, 0.0, 8.0, 0.0, 0.0, 2.0, 9.0];
        geometry.instances = vec![[rows, [0.0; 12]].concat().try_into().unwrap()];
        geometry.instance_signs = vec![1.0];
        axes(&tangent_frame(&geometry, &middle(0), &seen(false), true), [Y, minus(X), Z]);
        // A mirrored instance flips the bitangent.
        geometry.instance_signs = vec![-1.0];
        axes(&tangent_frame(&geometry, &middle(0), &seen(false), true), [Y, X, Z]);
    }

    #[test]
    fn sphere_tangents_point_around_the_axis() {
        let mut geometry = triangle(UPRIGHT, PART);
        // The sphere's +Y points up, its +X to the viewer.
        geometry.sphere_axes = vec![[0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0]];
        let hit = HitLanes { primitive: Wrapping(SPHERE), ..middle(NONE) };
        axes(&tangent_frame(&geometry, &hit, &seen(false), true), [X, Y, Z]);
        // With its +Z flipped, u increases the other way.
        geometry.sphere_axes[0][6] = 1.0;
        axes(&tangent_frame(&geometry, &hit, &seen(false), true), [minus(X), Y, Z]);
    }

    /// The footprint of a ray 1 cm wide, along its direction and across.
    fn footprint(geometry: &Geometry, instance: u32, direction: Vector<f32>) -> [(f32, f32); 2] {
        let at = coordinates(geometry, &middle(instance), &seen(false), direction, 0.01, true);
        let [across, along] = at.footprint[0].axes;
        [along, across]
    }

    #[test]
    fn footprints_are_ray_widths_in_texture_coordinates() {
        let close = |found: [(f32, f32); 2], expected: [(f32, f32); 2]| {
            for (found, expected) in found.into_iter().zip(expected) {
                let near = |a: f32, b: f32| (a.abs() - b).abs() < 1e-5 * b.max(0.01);
                assert!(near(found.0, expected.0) && near(found.1, expected.1), "{found:?} {expected:?}");
            }
        };
        let slanted = vector(0.0, 0.8, -0.6);
        close(footprint(&triangle(UPRIGHT, PART), NONE, slanted), [(0.0, 0.01 / 0.6), (0.01, 0.0)]);
        // Four times as many units along one axis.
        let finer = triangle(UPRIGHT.map(|[u, v]| [4.0 * u, v]), PART);
        close(footprint(&finer, NONE, slanted), [(0.0, 0.01 / 0.6), (0.04, 0.0)]);
        let turned = vector(-0.8, 0.0, -0.6);
        close(footprint(&finer, NONE, turned), [(0.04 / 0.6, 0.0), (0.0, 0.01)]);
        // A copy that is three times as large has a third of the units per metre.
        let mut placed = finer;
        let rows = [3.0, 0.0, 0.0, 7.0, 0.0, 3.0, 0.0, 8.0, 0.0, 0.0, 3.0, 9.0];
        placed.instances = vec![[rows, [0.0; 12]].concat().try_into().unwrap()];
        close(footprint(&placed, 0, slanted), [(0.0, 0.01 / 1.8), (0.04 / 3.0, 0.0)]);
        let bare = triangle(UPRIGHT, Part { uvs: NONE, ..PART });
        close(footprint(&bare, NONE, slanted), [(0.0, 0.0); 2]);
    }

    /// Neighbouring rays hit texture coordinates whose differences match the footprints.
    #[test]
    fn footprints_match_the_differences_of_neighbouring_rays() {
        let mut geometry = triangle(UPRIGHT.map(|[u, v]| [3.0 * u + v, 0.5 * v - u]), PART);
        geometry.add_part(Part { uvs: NONE, ..PART });
        geometry.spheres = vec![[0.5, 0.25, 0.0, 0.5]];
        geometry.sphere_axes = vec![[0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6]];
        geometry.sphere_parts = vec![1];
        // A stretch, a shear and a translation; and the inverse, which subtracts the translation first.
        let there = [2.0, 0.0, 0.0, 1.0, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 2.0];
        let back = [0.5, 0.0, 0.0, 1.0, -0.25, 1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 2.0];
        geometry.instances = vec![[there, back].concat().try_into().unwrap()];
        geometry.instance_signs = vec![1.0];
        geometry.instance_materials = vec![NONE];
        let direction = Vector::new(0.3f32, -0.2, -0.5).normalize();
        for (primitive, instance) in [(0, NONE), (SPHERE, NONE), (0, 0), (SPHERE, 0)] {
            // Aims at (¼, ¼, 0) of the object's own space, or at the point of the sphere above it.
            let aim = if instance == NONE { vector(0.25, 0.25, 0.0) } else { vector(1.5, 0.375, 2.0) };
            let seen_from = |origin: Vector<f32>| {
                let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
                let hit = hit(&geometry, &ray, primitive, instance);
                (hit, Surface::new(&geometry, &ray, &hit, true))
            };
            let origin = aim - direction * 2.0;
            let (hit, surface) = seen_from(origin);
            let width = 0.01;
            let at = coordinates(&geometry, &hit, &surface, direction, width, true);
            let across = surface.geometric_normal.cross(direction).normalize();
            let sides = [across * width, direction.cross(across) * width];
            for (side, axis) in sides.into_iter().zip(at.footprint[0].axes) {
                let [one, other] = [0.5, -0.5].map(|half| seen_from(origin + side * half).1.uv);
                let (u, v) = (one.0 - other.0, one.1 - other.1);
                let long = axis.0.hypot(axis.1);
                let apart = (u - axis.0).hypot(v - axis.1).min((u + axis.0).hypot(v + axis.1));
                assert!(long > 1e-3 && apart < 2e-3 * long, "{primitive} {instance}: {u} {v}, {axis:?}");
            }
        }
    }

    /// The hit of a ray on the only triangle, or on the only sphere from outside.
    fn hit(geometry: &Geometry, ray: &Ray<f32>, primitive: u32, instance: u32) -> HitLanes<f32> {
        let (mut origin, mut direction) = (ray.origin, ray.direction);
        if instance != NONE {
            let back = rows(geometry, Wrapping(instance), 3, true);
            origin = back.apply(origin - vector(1.0, 0.0, 2.0));
            direction = back.apply(direction);
        }
        if primitive == 0 {
            let t = -origin.z / direction.z;
            let at = origin + direction * t;
            return HitLanes { t, u: at.x, v: at.y, primitive: Wrapping(0), instance: Wrapping(instance) };
        }
        let [x, y, z, radius] = geometry.spheres[0];
        let from = origin - vector(x, y, z);
        let (a, b) = (direction.dot(direction), direction.dot(from));
        let t = (-b - (b * b - a * (from.dot(from) - radius * radius)).sqrt()) / a;
        HitLanes { t, u: 0.0, v: 0.0, primitive: Wrapping(SPHERE), instance: Wrapping(instance) }
    }

    #[test]
    fn uvs_and_alphas_are_interpolated_by_barycentric_weights() {
        let mut geometry = triangle(UPRIGHT, Part { uvs1: 0, alphas: 0, ..PART });
        geometry.uvs1 = vec![[0.0, 0.0], [4.0, 0.0], [0.0, 8.0]];
        geometry.alphas = vec![0.0, 1.0, 0.2];
        let down = vector(0.0, 0.0, -1.0);
        let at = coordinates(&geometry, &middle(NONE), &seen(false), down, 0.0, true);
        assert_eq!(at.uv, [(0.25, 0.75), (1.0, 2.0)]);
        let at = point_coordinates(&geometry, &middle(NONE), (0.0, 0.0), true);
        assert_eq!((at.uv, at.footprint[0].axes), ([(0.25, 0.75), (1.0, 2.0)], [(0.0, 0.0); 2]));
        assert!((alpha(&geometry, &middle(NONE), true) - 0.3).abs() < 1e-6);
        // Without a second set, the first one is used; without alphas, alpha is 1.
        let plain = triangle(UPRIGHT, PART);
        let at = coordinates(&plain, &middle(NONE), &seen(false), down, 0.0, true);
        assert_eq!(at.uv, [(0.25, 0.75); 2]);
        assert_eq!(alpha(&plain, &middle(NONE), true), 1.0);
        // Vertices are looked up only if some texture does.
        geometry.add_part(Part { colors: 0, ..PART });
        (geometry.colors, geometry.triangle_parts[0]) =
            (vec![[0.0, 0.0, 0.4], [0.8, 0.0, 0.4], [0.0, 0.4, 0.4]], 1);
        let vertex = |geometry: &Geometry| {
            let of_surface = coordinates(geometry, &middle(NONE), &seen(false), down, 0.0, true).vertex;
            let of_hit = point_coordinates(geometry, &middle(NONE), (0.0, 0.0), true).vertex;
            let [a, b] = [of_surface, of_hit].map(|it| [it.color.r, it.color.g, it.color.b, it.alpha]);
            assert_eq!(a, b);
            a
        };
        assert_eq!(vertex(&geometry), [1.0; 4]);
        geometry.has_vertex_textures = true;
        assert_eq!(vertex(&geometry), [0.2, 0.1, 0.4, 1.0]);
    }
}
