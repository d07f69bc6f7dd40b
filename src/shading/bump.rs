//! Bump mapping: the slopes of heights above a surface perturb its shading normal (Blinn 1978; without a frame of
//! texture coordinates by Mikkelsen, "Bump mapping unparametrized surfaces on the GPU", 2010).

use super::ShadingPoint;
use super::surface::normalize_or;
use super::texture_coordinates::uv_gradients;
use super::texture_lookup::{Coordinates, scalar};
use crate::math::Vector;
use crate::scene::material::BumpParam;
use crate::simd::Float;

impl<F: Float> ShadingPoint<'_, F> {
    /// The normal perturbed by a bump map.
    #[inline(always)]
    pub(super) fn risen(&self, normal: Vector<F>, bump: &BumpParam) -> Vector<F> {
        let sampled = &self.tables.textures.sampled[bump.heights.texture as usize];
        let set = (sampled.uv_set & 1) as usize;
        let (u, v) = uv_gradients(self.tables.geometry, self.hit, self.surface, set, self.mask);
        let levels = &self.tables.textures.levels;
        let first = sampled.first_level as usize;
        let size = [levels.width[first], levels.height[first]];
        // The step is one texel, or half of the ray's footprint if that is larger.
        let [a, b] = self.at.footprint[set].axes;
        let half = F::splat(0.5);
        let du = (a.0.abs().max(b.0.abs()) * half).max(F::splat(texel(sampled.matrix, 0, size)));
        let dv = (a.1.abs().max(b.1.abs()) * half).max(F::splat(texel(sampled.matrix, 1, size)));
        let zero = F::zero();
        let along_u = self.slope(bump, set, (du, zero)) / du;
        let along_v = self.slope(bump, set, (zero, dv)) / dv;
        let gradient = u * along_u + v * along_v;
        // The relief looks the same from behind, as with normal maps.
        normalize_or(normal - gradient * F::splat(bump.metres), normal)
    }

    /// Half the difference of the heights on both sides.
    #[inline(always)]
    fn slope(&self, bump: &BumpParam, set: usize, step: (F, F)) -> F {
        let (u, v) = self.at.uv[set];
        let (mut before, mut after) = (self.at, self.at);
        before.uv[set] = (u - step.0, v - step.1);
        after.uv[set] = (u + step.0, v + step.1);
        (self.height(bump, &after) - self.height(bump, &before)) * F::splat(0.5)
    }

    #[inline(always)]
    fn height(&self, bump: &BumpParam, at: &Coordinates<F>) -> F {
        scalar(&bump.heights, self.tables.textures, at, self.mask)
    }
}

/// The distance between neighbouring texels along u (0) or v (1), in texture coordinates.
fn texel(matrix: [[f32; 3]; 2], axis: usize, size: [f32; 2]) -> f32 {
    let [x, y] = matrix;
    1.0 / (x[axis] * size[0]).abs().max((y[axis] * size[1]).abs()).max(1e-6)
}
