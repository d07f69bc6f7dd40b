//! Texture lookups.

use crate::math::{Color, NONE};
use crate::scene::Textures;
use crate::scene::materials::ColorColumn;
use crate::scene::textures::flag;
use crate::simd::{Float, Int, Mask};

/// A material's colour at a point: its constant, times its texture there if it has one.
#[inline(always)]
pub fn color<F: Float>(
    column: &ColorColumn,
    textures: &Textures,
    material: F::Int,
    uv: (F, F),
    mask: F::Mask,
) -> Color<F> {
    let constant = Color::gather(&column.constant, material, mask);
    let texture = F::Int::gather(&column.texture, material, mask);
    let textured = mask & !texture.eq(F::Int::splat(NONE));
    if !textured.any() {
        return constant;
    }
    Color::select(textured, constant * lookup(textures, texture, uv, textured), constant)
}

/// A texture's colour at a point.
#[inline(always)]
pub fn lookup<F: Float>(textures: &Textures, texture: F::Int, uv: (F, F), mask: F::Mask) -> Color<F> {
    let flags = F::Int::gather(&textures.flags, texture, mask);
    let corner = texture * F::Int::splat(2);
    let width = F::gather(textures.size.as_flattened(), corner, mask);
    let height = F::gather(textures.size.as_flattened(), corner + F::Int::splat(1), mask);
    let factor = Color::gather(&textures.factor, texture, mask);
    let image =
        Picture { textures, mask, flags, first: F::Int::gather(&textures.first, texture, mask), width };
    let along_u = Axis { size: width, mode: flags.shr::<{ flag::WRAP_U }>() & F::Int::splat(3) };
    let along_v = Axis { size: height, mode: flags.shr::<{ flag::WRAP_V }>() & F::Int::splat(3) };
    let (table, first) = (textures.transform.as_flattened(), texture * F::Int::splat(4));
    let scale_u = F::gather(table, first, mask);
    let scale_v = F::gather(table, first + F::Int::splat(1), mask);
    let offset_u = F::gather(table, first + F::Int::splat(2), mask);
    let offset_v = F::gather(table, first + F::Int::splat(3), mask);
    // Beyond a million repeats a float has no bits left for the place within the image.
    let x = (uv.0 * scale_u + offset_u).clamp(-1e6, 1e6) * width;
    let y = (uv.1 * scale_v + offset_v).clamp(-1e6, 1e6) * height;

    let bilinear = !(flags & F::Int::splat(flag::BILINEAR)).eq(F::Int::splat(0)) & mask;
    if !bilinear.any() {
        return image.texel(along_u.wrap(x.floor()), along_v.wrap(y.floor())) * factor;
    }
    // Texel centres are at half coordinates. Where nothing is blended the weights are 0.
    let half = F::select(bilinear, F::splat(0.5), F::zero());
    let (x, y) = (x - half, y - half);
    let (column, row) = (x.floor(), y.floor());
    let wx = F::select(bilinear, x - column, F::zero());
    let wy = F::select(bilinear, y - row, F::zero());
    let (left, right) = (along_u.wrap(column), along_u.wrap(column + F::one()));
    let (top, bottom) = (along_v.wrap(row), along_v.wrap(row + F::one()));
    let upper = image.texel(left, top) * (F::one() - wx) + image.texel(right, top) * wx;
    let lower = image.texel(left, bottom) * (F::one() - wx) + image.texel(right, bottom) * wx;
    (upper * (F::one() - wy) + lower * wy) * factor
}

/// One direction of an image.
struct Axis<F: Float> {
    size: F,
    mode: F::Int,
}

impl<F: Float> Axis<F> {
    /// A whole texel number to one within the image.
    #[inline(always)]
    fn wrap(&self, texel: F) -> F {
        let last = self.size - F::one();
        let clamped = texel.max(F::zero()).min(last);
        let repeated = texel - (texel / self.size).floor() * self.size;
        let double = self.size * F::splat(2.0);
        let folded = texel - (texel / double).floor() * double;
        let mirrored = folded.min(double - F::one() - folded);
        let clamps = self.mode.eq(F::Int::splat(1));
        let mirrors = self.mode.eq(F::Int::splat(2));
        let wrapped = F::select(clamps, clamped, F::select(mirrors, mirrored, repeated));
        // The divisions round: never outside, whatever they did.
        wrapped.max(F::zero()).min(last)
    }
}

/// Where an image's texels are.
struct Picture<'a, F: Float> {
    textures: &'a Textures,
    mask: F::Mask,
    flags: F::Int,
    first: F::Int,
    width: F,
}

impl<F: Float> Picture<'_, F> {
    /// The colour of a texel by its whole coordinates.
    #[inline(always)]
    fn texel(&self, x: F, y: F) -> Color<F> {
        let index = self.first + y.to_int() * self.width.to_int() + x.to_int();
        let float = !(self.flags & F::Int::splat(flag::FLOAT)).eq(F::Int::splat(0)) & self.mask;
        let bytes = self.mask & !float;
        let mut color = Color::black();
        if bytes.any() {
            let word = F::Int::gather(&self.textures.texels8, index, bytes);
            let linear = !(self.flags & F::Int::splat(flag::LINEAR)).eq(F::Int::splat(0));
            let curve = F::Int::select(linear, F::Int::splat(0), F::Int::splat(256));
            let low = F::Int::splat(255);
            let table = &self.textures.decode;
            color = Color::new(
                F::gather(table, (word & low) + curve, bytes),
                F::gather(table, (word.shr::<8>() & low) + curve, bytes),
                F::gather(table, (word.shr::<16>() & low) + curve, bytes),
            );
        }
        if float.any() {
            color = Color::select(float, Color::gather(&self.textures.texels32, index, float), color);
        }
        color
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::assets::Wrap;
    use std::num::Wrapping;

    /// A 2×2 picture: red, green / blue, white; with one texture of the given flags.
    fn picture(flags: u32) -> Textures {
        let word = |r, g, b| u32::from_le_bytes([r, g, b, 255]);
        let unit = (0..256).map(|i| i as f32 / 255.0);
        Textures {
            flags: vec![flags | flag::LINEAR],
            size: vec![[2.0, 2.0]],
            first: vec![0],
            transform: vec![[1.0, 1.0, 0.0, 0.0]],
            factor: vec![[1.0; 3]],
            texels8: vec![word(255, 0, 0), word(0, 255, 0), word(0, 0, 255), word(255, 255, 255)],
            texels32: vec![],
            decode: unit.clone().chain(unit).collect(),
            ..Textures::default()
        }
    }

    fn at(textures: &Textures, u: f32, v: f32) -> [f32; 3] {
        let c: Color<f32> = lookup(textures, Wrapping(0), (u, v), true);
        [c.r, c.g, c.b]
    }

    fn wrap(mode: Wrap) -> u32 {
        let mode = mode as u32;
        mode << flag::WRAP_U | mode << flag::WRAP_V
    }

    #[test]
    fn nearest_takes_the_texel_under_the_point() {
        let t = picture(0);
        assert_eq!(at(&t, 0.1, 0.1), [1.0, 0.0, 0.0]);
        assert_eq!(at(&t, 0.9, 0.1), [0.0, 1.0, 0.0]);
        assert_eq!(at(&t, 0.1, 0.9), [0.0, 0.0, 1.0]);
        assert_eq!(at(&t, 1.1, -0.1), [0.0, 0.0, 1.0], "repeats");
    }

    #[test]
    fn bilinear_blends_four_texels() {
        let t = picture(flag::BILINEAR);
        assert_eq!(at(&t, 0.25, 0.25), [1.0, 0.0, 0.0], "a texel's centre");
        assert_eq!(at(&t, 0.5, 0.25), [0.5, 0.5, 0.0]);
        assert_eq!(at(&t, 0.5, 0.5), [0.5, 0.5, 0.5]);
        assert_eq!(at(&t, 0.0, 0.25), [0.5, 0.5, 0.0], "blends around the edge");
    }

    #[test]
    fn wrap_modes_hold_or_turn_at_the_edge() {
        let t = picture(wrap(Wrap::Clamp));
        assert_eq!(at(&t, -3.0, 7.0), [0.0, 0.0, 1.0]);
        let t = picture(wrap(Wrap::Mirror));
        assert_eq!(at(&t, 1.1, 0.1), [0.0, 1.0, 0.0]);
        assert_eq!(at(&t, 1.9, 0.1), [1.0, 0.0, 0.0]);
        assert_eq!(at(&t, -0.1, 0.1), [1.0, 0.0, 0.0]);
        assert!(at(&t, 1e30, f32::NAN)[0].is_finite(), "never outside");
    }
}
