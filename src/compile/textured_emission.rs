//! The brightness of surfaces whose emission is a texture: by the texels that they show, not by the factor.

use std::collections::HashMap;
use std::num::Wrapping;

use super::emitters::EmittingSurfaces;
use crate::bvh::layout::sidedness::SPHERE;
use crate::math::{Color, NONE, Rgb, Vec2};
use crate::scene::textures::SampledTexture;
use crate::scene::{Geometry, Textures};
use crate::shading::surface::HitLanes;
use crate::shading::texture_coordinates::point_coordinates;
use crate::shading::texture_lookup::{Texel, texel};

/// The most cells along an image's longer side.
const FINEST: usize = 512;
/// A triangle's texels are sampled at the centres of smaller, equal triangles, in this many rows.
const ROWS: usize = 8;

/// Mean emission of surfaces with emission textures; a table for each texture.
pub(super) struct EmissionAverages<'a> {
    surfaces: &'a EmittingSurfaces<'a>,
    sums: HashMap<u32, EmissionSums>,
}

impl<'a> EmissionAverages<'a> {
    pub(super) fn new(surfaces: &'a EmittingSurfaces<'a>) -> Self {
        Self { surfaces, sums: HashMap::new() }
    }

    /// The mean luminance of a material's emission on a primitive, relative to its factor. Zero only if all of it is
    /// black: faint emitters must be sampled, too.
    pub(super) fn mean(&mut self, material: u32, primitive: u32) -> f32 {
        let EmittingSurfaces { geometry, materials, textures, .. } = *self.surfaces;
        let texture = materials[material as usize].emission.texture;
        let sampled = &textures.sampled[texture as usize];
        if sampled.is_procedural() {
            return procedural_mean(geometry, textures, sampled, primitive);
        }
        let sums = self.sums.entry(texture).or_insert_with(|| EmissionSums::new(textures, sampled));
        let mean = match corners(geometry, sampled, primitive) {
            Some(corners) => sums.triangle(corners),
            None => sums.within(Vec2::ZERO, Vec2::new(sums.columns as f32, sums.rows as f32)),
        };
        mean * Rgb::from(sampled.factor).luminance()
    }
}

/// The mean luminance of a computed texture on a primitive, from points of it. Parts that all points miss count, too.
fn procedural_mean(
    geometry: &Geometry,
    textures: &Textures,
    sampled: &SampledTexture,
    primitive: u32,
) -> f32 {
    let mut sum = 0.0;
    for row in 0..ROWS {
        for column in 0..ROWS {
            let [mut u, mut v] = [row, column].map(|at| (at as f32 + 0.5) / ROWS as f32);
            if primitive & SPHERE == 0 && u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let hit = HitLanes { t: 0.0, u, v, primitive: Wrapping(primitive), instance: Wrapping(NONE) };
            let at = point_coordinates(geometry, &hit, (u, v), true);
            let Texel { color, .. } = texel(textures, sampled, &at, true);
            sum += (color * Color::splat(sampled.factor.into())).luminance();
        }
    }
    (sum / (ROWS * ROWS) as f32).max(sampled.levels[0] / 256.0)
}

/// The corners of a triangle in the image, in units of its width and height; `None` for spheres and for triangles
/// without texture coordinates.
fn corners(geometry: &Geometry, sampled: &SampledTexture, primitive: u32) -> Option<[Vec2; 3]> {
    if primitive & SPHERE != 0 {
        return None;
    }
    let vertices = geometry.triangles[primitive as usize];
    let part = geometry.triangle_parts[primitive as usize] as usize;
    let second = sampled.uv_set & 1 == 1 && geometry.parts.uvs1[part] != NONE;
    let (offset, table) = match second {
        true => (geometry.parts.uvs1[part], &geometry.uvs1),
        false => (geometry.parts.uvs[part], &geometry.uvs),
    };
    if offset == NONE {
        return None;
    }
    let [x, y] = sampled.matrix;
    let at = |vertex: u32| {
        let [u, v] = *table.get(vertex.wrapping_add(offset) as usize)?;
        Some(Vec2::new(x[0] * u + x[1] * v + x[2], y[0] * u + y[1] * v + y[2]))
    };
    Some([at(vertices[0])?, at(vertices[1])?, at(vertices[2])?])
}

/// A summed-area table of an image's luminance (Crow 1984).
struct EmissionSums {
    columns: usize,
    rows: usize,
    wrap: [u32; 2],
    /// The sums; one column and one row more than there are cells.
    sums: Vec<f64>,
}

impl EmissionSums {
    fn new(textures: &Textures, sampled: &SampledTexture) -> Self {
        let level = sampled.first_level as usize;
        let (width, height) = (textures.levels.width[level] as usize, textures.levels.height[level] as usize);
        let step = width.max(height).div_ceil(FINEST);
        let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
        let mut cells = vec![0.0f64; columns * rows];
        let first = textures.levels.first[level] as usize;
        for at in 0..width * height {
            let (x, y) = (at % width / step, at / width / step);
            cells[y * columns + x] += f64::from(luminance(textures, sampled, first + at));
        }
        let mut sums = vec![0.0; (columns + 1) * (rows + 1)];
        for y in 0..rows {
            let mut row = 0.0;
            for x in 0..columns {
                let (left, top) = (x * step, y * step);
                let texels = (step.min(width - left) * step.min(height - top)) as f64;
                row += cells[y * columns + x] / texels;
                sums[(y + 1) * (columns + 1) + x + 1] = sums[y * (columns + 1) + x + 1] + row;
            }
        }
        Self { columns, rows, wrap: sampled.wrap, sums }
    }

    /// The mean over a triangle.
    fn triangle(&self, corners: [Vec2; 3]) -> f32 {
        let size = Vec2::new(self.columns as f32, self.rows as f32);
        let [a, b, c] = corners.map(|corner| corner * size);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // Lookups interpolate between neighbours.
        let most = self.within(low - 1.0, high + 1.0);
        if most <= 0.0 {
            return 0.0;
        }
        let parts = (ROWS * ROWS) as f32;
        let half = 0.5 * ((b - a).perp_dot(c - a).abs() * 0.5 / parts).sqrt().max(1.0);
        let mut sum = 0.0;
        for row in 0..ROWS {
            for place in 0..2 * row + 1 {
                // The centroids of small triangles, every other one of which is upside down.
                let third = if place % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
                let down = row as f32 + 1.0 - third;
                let along = (place / 2) as f32 + third;
                let at = a + ((b - a) * (down - along) + (c - a) * along) / ROWS as f32;
                sum += self.within(at - half, at + half);
            }
        }
        (sum / parts).max(most / 256.0)
    }

    /// The mean over the rectangle between two corners, which may lie outside the image.
    fn within(&self, low: Vec2, high: Vec2) -> f32 {
        let (mut sum, mut cells) = (0.0, 0);
        for (left, right) in spans(low.x, high.x, self.columns, self.wrap[0]) {
            for (top, bottom) in spans(low.y, high.y, self.rows, self.wrap[1]) {
                sum += self.sum([left, top], [right, bottom]);
                cells += (right - left) * (bottom - top);
            }
        }
        (sum / cells.max(1) as f64) as f32
    }

    /// The sum over a rectangle of whole cells.
    fn sum(&self, [left, top]: [usize; 2], [right, bottom]: [usize; 2]) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * (self.columns + 1) + x];
        (at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top)).max(0.0)
    }
}

/// The cells between two places along an axis: two ranges if an end of the image lies between them, or all cells if
/// they are at least the image's size apart.
fn spans(low: f32, high: f32, cells: usize, wrap: u32) -> [(usize, usize); 2] {
    let count = cells as f32;
    let low = low.floor();
    let high = high.ceil().max(low + 1.0);
    let whole = [(0, cells), (0, 0)];
    if wrap == 1 {
        return [(low.clamp(0.0, count - 1.0) as usize, high.clamp(1.0, count) as usize), (0, 0)];
    }
    // Far from zero, floats are too coarse for cells.
    if (high - low).is_nan() || high - low >= count || low.abs() > 1e6 {
        return whole;
    }
    let turn = (low / count).floor();
    let (low, high) = ((low - turn * count) as usize, (high - turn * count) as usize);
    let first = (low, high.min(cells));
    let beyond = high.saturating_sub(cells);
    match wrap {
        // Mirrored every other time.
        2 if (turn * 0.5).fract() == 0.0 => [first, (cells - beyond, cells)],
        2 => [(cells - first.1, cells - first.0), (0, beyond)],
        _ => [first, (0, beyond)],
    }
}

/// The linear luminance of a texel.
fn luminance(textures: &Textures, sampled: &SampledTexture, texel: usize) -> f32 {
    if sampled.float {
        return Rgb::from(textures.texels32[texel]).luminance();
    }
    let curve = if sampled.srgb { 256 } else { 0 };
    let [r, g, b, _] = textures.texels8[texel].to_le_bytes().map(|byte| curve + usize::from(byte));
    Rgb::new(textures.decode[r], textures.decode[g], textures.decode[b]).luminance()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One bright texel in the corner of 64 × 64, cells of one texel each.
    fn corner() -> EmissionSums {
        let (columns, rows) = (64, 64);
        let mut sums = vec![1.0; (columns + 1) * (rows + 1)];
        sums[..=columns].fill(0.0);
        (0..=rows).for_each(|y| sums[y * (columns + 1)] = 0.0);
        EmissionSums { columns, rows, wrap: [0; 2], sums }
    }

    #[test]
    fn triangles_have_the_mean_of_their_texels() {
        let sums = corner();
        assert_eq!(sums.within(Vec2::ZERO, Vec2::splat(64.0)), 1.0 / 4096.0);
        // A triangle on the bright corner, far from it, and over half of the image.
        let triangle = |x: f32, y: f32, size: f32| {
            let at = Vec2::new(x, y);
            sums.triangle([at, at + Vec2::X * size, at + Vec2::Y * size])
        };
        assert!(triangle(0.0, 0.0, 1.0 / 64.0) > 0.2);
        assert_eq!(triangle(0.5, 0.5, 0.25), 0.0);
        let half = triangle(0.0, 0.0, 1.0);
        assert!(half > 0.3 / 4096.0 && half < 8.0 / 4096.0, "{half}");
        // However small the emitting part, the mean is not zero.
        assert!(triangle(-0.4, -0.4, 0.81) > 0.0);
        // Beyond the image it repeats.
        assert!(triangle(3.0, -2.0, 1.0 / 64.0) > 0.2);
        assert_eq!(triangle(3.5, -2.5, 0.25), 0.0);
    }

    #[test]
    fn uniform_image_has_its_value_everywhere() {
        let (columns, rows) = (16, 8);
        let sums =
            (0..(columns + 1) * (rows + 1)).map(|at| (at % (columns + 1) * (at / (columns + 1))) as f64);
        for wrap in [0, 1, 2] {
            let glow = EmissionSums { columns, rows, wrap: [wrap; 2], sums: sums.clone().collect() };
            for at in [Vec2::ZERO, Vec2::splat(0.9), Vec2::new(-3.2, 7.7), Vec2::splat(1e9)] {
                let mean = glow.triangle([at, at + Vec2::new(0.3, 0.1), at + Vec2::new(0.1, 0.4)]);
                assert!((mean - 1.0).abs() < 1e-4, "{mean} {wrap} {at}");
            }
        }
    }
}
