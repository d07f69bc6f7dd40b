//! Bump mapping: the slopes of heights above a surface perturb its shading normal (Blinn 1978; without a frame of
//! texture coordinates by Mikkelsen, "Bump mapping unparametrized surfaces on the GPU", 2010).

use super::ShadingPoint;
use super::point::Tables;
use super::surface::normalize_or;
use super::texture_coordinates::{object_gradient, uv_gradients};
use super::texture_lookup::{Coordinates, scalar};
use super::vertices;
use crate::math::Vector;
use crate::scene::Textures;
use crate::scene::material::BumpParam;
use crate::scene::procedures::TextureStep;
use crate::simd::{Float, Outlined};

/// The step over which slopes of computed textures are measured, as a part of the finest detail or of a triangle.
const PART: f32 = 1.0 / 32.0;

struct RisenByProcedure<'a, 'b, F: Float> {
    point: &'a ShadingPoint<'b, F>,
    normal: Vector<F>,
    bump: &'a BumpParam,
    program: [u32; 2],
}

impl<F: Float> Outlined for RisenByProcedure<'_, '_, F> {
    type Output = Vector<F>;
    #[inline(always)]
    fn run(self) -> Vector<F> {
        self.point.risen_by_procedure(self.normal, self.bump, self.program)
    }
}

impl<F: Float> ShadingPoint<'_, F> {
    /// The normal perturbed by a bump map.
    #[inline(always)]
    pub(super) fn risen(&self, normal: Vector<F>, bump: &BumpParam) -> Vector<F> {
        let sampled = &self.tables.textures.sampled[bump.heights.texture as usize];
        if sampled.is_procedural() {
            // Few scenes want it: inlined in all kernels it would take long to compile.
            return F::outlined(RisenByProcedure { point: self, normal, bump, program: sampled.program });
        }
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

    /// The normal perturbed by a computed texture: the slopes in all coordinates that it uses add up.
    #[inline(always)]
    fn risen_by_procedure(&self, normal: Vector<F>, bump: &BumpParam, program: [u32; 2]) -> Vector<F> {
        let Tables { geometry, textures } = self.tables;
        let half = F::splat(0.5);
        let mut gradient = Vector::zero();
        for set in 0..2 {
            let Some(finest) = finest(textures, program, set as u32) else { continue };
            let (u, v) = uv_gradients(geometry, self.hit, self.surface, set, self.mask);
            let [a, b] = self.at.footprint[set].axes;
            let (zero, finest) = (F::zero(), F::splat(finest));
            let du = (a.0.abs().max(b.0.abs()) * half).max(finest);
            let dv = (a.1.abs().max(b.1.abs()) * half).max(finest);
            gradient = gradient
                + u * (self.slope(bump, set, (du, zero)) / du)
                + v * (self.slope(bump, set, (zero, dv)) / dv);
        }
        if let Some(finest) = finest(textures, program, 2) {
            let [a, b] = self.at.object_footprint;
            let step = (a.length().max(b.length()) * half).max(F::splat(finest));
            let zero = F::zero();
            let x = self.object_slope(bump, Vector::new(step, zero, zero));
            let y = self.object_slope(bump, Vector::new(zero, step, zero));
            let z = self.object_slope(bump, Vector::new(zero, zero, step));
            let slope = Vector::new(x, y, z) * (F::one() / step);
            gradient = gradient + object_gradient(geometry, self.hit, self.surface, slope, self.mask);
        }
        if looks_up_vertices(textures, program) {
            for (change, along) in vertices::gradients(geometry, self.hit, self.mask) {
                let (mut before, mut after) = (self.at, self.at);
                before.vertex = before.vertex.plus(change.scaled(F::splat(-PART)));
                after.vertex = after.vertex.plus(change.scaled(F::splat(PART)));
                let rise = self.height(bump, &after) - self.height(bump, &before);
                gradient = gradient + along * (rise * F::splat(0.5 / PART));
            }
        }
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

    /// Half the difference of the heights on both sides in the object's space.
    #[inline(always)]
    fn object_slope(&self, bump: &BumpParam, step: Vector<F>) -> F {
        let (mut before, mut after) = (self.at, self.at);
        (before.object, after.object) = (self.at.object - step, self.at.object + step);
        (self.height(bump, &after) - self.height(bump, &before)) * F::splat(0.5)
    }

    #[inline(always)]
    fn height(&self, bump: &BumpParam, at: &Coordinates<F>) -> F {
        scalar(&bump.heights, self.tables.textures, at, self.mask)
    }
}

/// True if a computed texture depends on what is at the mesh's vertices.
fn looks_up_vertices(textures: &Textures, [first, end]: [u32; 2]) -> bool {
    let steps = &textures.steps[first as usize..end as usize];
    steps.iter().any(|step| matches!(step, TextureStep::Vertex | TextureStep::VertexChannel(_)))
}

/// The step in some coordinates over which the slope of a computed texture is measured; none if it does not use them.
fn finest(textures: &Textures, [first, end]: [u32; 2], space: u32) -> Option<f32> {
    let steps = textures.steps[first as usize..end as usize].iter();
    let finest = steps.filter_map(|step| match step {
        TextureStep::Image(image) => {
            let sampled = &textures.sampled[*image as usize];
            let size: [f32; 2] = textures.size(sampled).into();
            (sampled.uv_set == space)
                .then(|| texel(sampled.matrix, 0, size).min(texel(sampled.matrix, 1, size)))
        }
        TextureStep::Pattern(step) if step.space == space => {
            let rows = step.matrix.iter().flat_map(|row| &row[..3]);
            let scale = rows.fold(1e-6f32, |most, number| most.max(number.abs()));
            Some(PART / (scale * step.pattern.fineness()))
        }
        _ => None,
    });
    finest.reduce(f32::min)
}

/// The distance between neighbouring texels along u (0) or v (1), in texture coordinates.
fn texel(matrix: [[f32; 3]; 2], axis: usize, size: [f32; 2]) -> f32 {
    let [x, y] = matrix;
    1.0 / (x[axis] * size[0]).abs().max((y[axis] * size[1]).abs()).max(1e-6)
}
