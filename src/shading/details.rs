//! What only some materials ask of a hit: a second set of texture coordinates, the footprint of
//! the ray, vertex alpha, directions along the surface.

use super::principled::frame::Frame;
use super::sampled::Coordinates;
use super::surface::{HitLanes, Surface, corners, rows, unit_or};
use crate::bvh::SPHERE;
use crate::math::{Color, NONE, Vector};
use crate::scene::Geometry;
use crate::simd::{Float, Int, Mask};

/// The triangles of a hit: their vertices, parts and the weights of the corners.
struct Corners<F: Float> {
    vertices: [F::Int; 3],
    part: F::Int,
    weights: [F; 3],
    is_triangle: F::Mask,
}

impl<F: Float> Corners<F> {
    #[inline(always)]
    fn new(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> Self {
        let is_triangle = (hit.primitive & F::Int::splat(SPHERE)).eq(F::Int::splat(0)) & mask;
        let indices = geometry.triangles.as_flattened();
        let first = hit.primitive * F::Int::splat(3);
        Self {
            vertices: [
                F::Int::gather(indices, first, is_triangle),
                F::Int::gather(indices, first + F::Int::splat(1), is_triangle),
                F::Int::gather(indices, first + F::Int::splat(2), is_triangle),
            ],
            part: F::Int::gather(&geometry.triangle_parts, hit.primitive, is_triangle),
            weights: [F::one() - hit.u - hit.v, hit.u, hit.v],
            is_triangle,
        }
    }

    /// A pair of numbers of each vertex.
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

    #[inline(always)]
    fn blend(&self, pairs: [(F, F); 3]) -> (F, F) {
        let w = self.weights;
        (
            pairs[0].0 * w[0] + pairs[1].0 * w[1] + pairs[2].0 * w[2],
            pairs[0].1 * w[0] + pairs[1].1 * w[1] + pairs[2].1 * w[2],
        )
    }
}

/// Texture coordinates of any point of a triangle, with no footprint: the finest level counts.
#[inline(always)]
pub fn point_coordinates<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> Coordinates<F> {
    let triangle = Corners::new(geometry, hit, mask);
    let set = |parts: &[u32]| F::Int::gather(parts, triangle.part, triangle.is_triangle);
    let (base, base1) = (set(&geometry.parts.uvs), set(&geometry.parts.uvs1));
    let mapped = triangle.is_triangle & !base.eq(F::Int::splat(NONE));
    let mapped1 = triangle.is_triangle & !base1.eq(F::Int::splat(NONE));
    let uv = triangle.blend(triangle.pairs(&geometry.uvs, base, mapped));
    let uv1 = triangle.blend(triangle.pairs(&geometry.uvs1, base1, mapped1));
    Coordinates { uv: [uv, uv1], footprint: F::zero() }
}

/// Where textures are looked up at a hit; `width` is that of the ray, in metres.
#[inline(always)]
pub fn coordinates<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    direction: Vector<F>,
    width: F,
    mask: F::Mask,
) -> Coordinates<F> {
    let mut at = Coordinates { uv: [surface.uv, surface.uv], footprint: F::zero() };
    if geometry.uvs.is_empty() {
        return at;
    }
    let triangle = Corners::new(geometry, hit, mask);
    let none = F::Int::splat(NONE);
    if !geometry.uvs1.is_empty() {
        let base = F::Int::gather(&geometry.parts.uvs1, triangle.part, triangle.is_triangle);
        let mapped = triangle.is_triangle & !base.eq(none);
        let (u, v) = triangle.blend(triangle.pairs(&geometry.uvs1, base, mapped));
        at.uv[1] = (F::select(mapped, u, surface.uv.0), F::select(mapped, v, surface.uv.1));
    }
    let base = F::Int::gather(&geometry.parts.uvs, triangle.part, triangle.is_triangle);
    let mapped = triangle.is_triangle & !base.eq(none);
    if mapped.any() {
        let [a, b, c] = triangle.pairs(&geometry.uvs, base, mapped);
        let uv_area = ((b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1)).abs();
        let [p, q, r]: [Vector<F>; 3] = corners(&geometry.positions, triangle.vertices, mapped);
        let (mut s, mut t) = (q - p, r - p);
        let placed = mapped & !hit.instance.eq(none);
        if placed.any() {
            let there = rows(geometry, hit.instance, 0, placed);
            s = Vector::select(placed, there.apply(s), s);
            t = Vector::select(placed, there.apply(t), t);
        }
        let cross = s.cross(t);
        let area = cross.dot(cross).sqrt().max(F::splat(1e-30));
        let slant = surface.geometric_normal.dot(direction).abs().max(F::splat(0.05));
        at.footprint = F::select(mapped, width / slant * (uv_area / area).sqrt(), F::zero());
    }
    at
}

/// Vertex alpha, 1 where there is none.
#[inline(always)]
pub fn alpha<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> F {
    if geometry.alphas.is_empty() {
        return F::one();
    }
    let triangle = Corners::new(geometry, hit, mask);
    let base = F::Int::gather(&geometry.parts.alphas, triangle.part, triangle.is_triangle);
    let has = triangle.is_triangle & !base.eq(F::Int::splat(NONE));
    let mut alpha = F::zero();
    for k in 0..3 {
        alpha = alpha + F::gather(&geometry.alphas, triangle.vertices[k] + base, has) * triangle.weights[k];
    }
    F::select(has, alpha, F::one())
}

/// A frame whose x goes along the mesh's tangents, or along growing u where it has none, and
/// whose z is the shading normal. On the inner side z is turned over, x and y are not: a normal
/// map is seen from behind as from the front.
#[inline(always)]
pub fn tangent_frame<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    surface: &Surface<F>,
    mask: F::Mask,
) -> Frame<F> {
    let plain = Frame::about(surface.normal);
    let triangle = Corners::new(geometry, hit, mask);
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
    if placed.any() {
        let there = rows(geometry, hit.instance, 0, placed);
        x = Vector::select(placed, there.apply(x), x);
    }
    // The bitangent belongs to the outward normal.
    let outward = Vector::select(surface.inside, -surface.normal, surface.normal);
    let x = unit_or(x - outward * outward.dot(x), plain.x);
    let known = given | derived;
    let part_sign = F::gather(&geometry.parts.sign, triangle.part, triangle.is_triangle);
    let y = outward.cross(x) * (sign * F::select(triangle.is_triangle, part_sign, F::one()));
    Frame { x: Vector::select(known, x, plain.x), y: Vector::select(known, y, plain.y), z: surface.normal }
}

#[inline(always)]
fn given_tangents<F: Float>(
    geometry: &Geometry,
    triangle: &Corners<F>,
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

/// Along growing u, and on which side v grows.
#[inline(always)]
fn derived_tangents<F: Float>(
    geometry: &Geometry,
    triangle: &Corners<F>,
    base: F::Int,
    derived: F::Mask,
) -> (Vector<F>, F) {
    let [a, b, c] = triangle.pairs(&geometry.uvs, base, derived);
    let [p, q, r] = corners(&geometry.positions, triangle.vertices, derived);
    let (du1, dv1, du2, dv2) = (b.0 - a.0, b.1 - a.1, c.0 - a.0, c.1 - a.1);
    let determinant = du1 * dv2 - dv1 * du2;
    let along = (q - p) * dv2 - (r - p) * dv1;
    let flips = determinant.lt(F::zero());
    // Texture coordinates grow downwards: the bitangent of glTF points to growing −v.
    (Vector::select(flips, -along, along), F::select(flips, F::one(), -F::one()))
}

/// The vertex normals' frame seen through a normal map's texel (already −1 to 1, x and y scaled).
#[inline(always)]
pub fn bend<F: Float>(
    frame: &Frame<F>,
    surface: &Surface<F>,
    n: Vector<F>,
    to_viewer: Vector<F>,
) -> Frame<F> {
    let bent = unit_or(frame.x * n.x + frame.y * n.y + frame.z * n.z, frame.z);
    // A normal that looks away from the viewer is turned until it does not.
    let least = F::splat(0.01);
    let cos = bent.dot(to_viewer);
    let away = cos.lt(least);
    let bent =
        Vector::select(away, unit_or(bent + to_viewer * (least - cos), surface.geometric_normal), bent);
    let x = unit_or(frame.x - bent * bent.dot(frame.x), Frame::about(bent).x);
    Frame { x, y: bent.cross(x), z: bent }
}

/// The factor of the vertex colours.
#[inline(always)]
pub fn vertex_color<F: Float>(surface: &Surface<F>) -> Color<F> {
    Color::new(surface.color.x, surface.color.y, surface.color.z)
}
