//! Colours and alphas of vertices at hits.

use super::surface::HitLanes;
use super::texture_coordinates::HitCorners;
use super::texture_lookup::Texel;
use crate::math::{Color, NONE, Vector};
use crate::scene::Geometry;
use crate::simd::{Float, Int, Mask, Outlined};

/// Vertex alpha; 1 if there is none.
#[inline(always)]
pub(super) fn alpha<F: Float>(geometry: &Geometry, hit: &HitLanes<F>, mask: F::Mask) -> F {
    if geometry.alphas.is_empty() {
        return F::one();
    }
    let triangle = HitCorners::new(geometry, hit, mask);
    let (base, has) = base(&geometry.parts.alphas, false, &triangle);
    let mut alpha = F::zero();
    for k in 0..3 {
        alpha = alpha + F::gather(&geometry.alphas, triangle.vertices[k] + base, has) * triangle.weights[k];
    }
    F::select(has, alpha, F::one())
}

/// Interpolates colours and alphas of vertices at hits, for textures.
pub(super) struct AtVertices<'a, F: Float> {
    pub(super) geometry: &'a Geometry,
    pub(super) hit: &'a HitLanes<F>,
    pub(super) mask: F::Mask,
}

impl<F: Float> Outlined for AtVertices<'_, F> {
    type Output = Texel<F>;
    #[inline(always)]
    fn run(self) -> Texel<F> {
        let triangle = HitCorners::new(self.geometry, self.hit, self.mask);
        let [a, b, c] = texels(self.geometry, &triangle);
        let [x, y, z] = triangle.weights;
        Texel {
            color: a.color * x + b.color * y + c.color * z,
            alpha: alpha(self.geometry, self.hit, self.mask),
        }
    }
}

/// Colours and alphas at the corners of triangles, opaque white where there are none.
#[inline(always)]
fn texels<F: Float>(geometry: &Geometry, triangle: &HitCorners<F>) -> [Texel<F>; 3] {
    let (colors, colored) = base(&geometry.parts.colors, geometry.colors.is_empty(), triangle);
    let (alphas, veiled) = base(&geometry.parts.alphas, geometry.alphas.is_empty(), triangle);
    let mut texels = [Texel::white(); 3];
    for (texel, vertex) in texels.iter_mut().zip(triangle.vertices) {
        if colored.any() {
            let color = Color::gather(&geometry.colors, vertex + colors, colored);
            texel.color = Color::select(colored, color, texel.color);
        }
        if veiled.any() {
            let alpha = F::gather(&geometry.alphas, vertex + alphas, veiled);
            texel.alpha = F::select(veiled, alpha, texel.alpha);
        }
    }
    texels
}

/// The offset of parts' vertices in a table, and the lanes that have one.
#[inline(always)]
fn base<F: Float>(bases: &[u32], is_empty: bool, triangle: &HitCorners<F>) -> (F::Int, F::Mask) {
    let mut base = F::Int::splat(NONE);
    if !is_empty {
        let found = F::Int::gather(bases, triangle.part, triangle.is_triangle);
        base = F::Int::select(triangle.is_triangle, found, base);
    }
    (base, triangle.is_triangle & !base.eq(F::Int::splat(NONE)))
}

/// The changes of colour and alpha from a triangle's first corner to the others, and the gradients of these corners'
/// weights, per metre in world space.
#[inline(always)]
pub(super) fn gradients<F: Float>(
    geometry: &Geometry,
    hit: &HitLanes<F>,
    mask: F::Mask,
) -> [(Texel<F>, Vector<F>); 2] {
    let triangle = HitCorners::new(geometry, hit, mask);
    let [a, b, c] = texels(geometry, &triangle);
    let along = triangle.along(geometry, hit, triangle.is_triangle);
    let less = a.scaled(-F::one());
    [
        (b.plus(less), Vector::select(triangle.is_triangle, along.0, Vector::zero())),
        (c.plus(less), Vector::select(triangle.is_triangle, along.1, Vector::zero())),
    ]
}
