//! Texture lookups of the path transport: one texture, many points, at the size of the rays'
//! footprints.

use crate::math::elementary::log2;
use crate::math::{Color, NONE};
use crate::scene::Textures;
use crate::scene::principled::{ColorParam, ScalarParam};
use crate::scene::textures::Sampled;
use crate::simd::{Float, Int, Mask, Part};

/// Where on a mesh textures are looked up.
#[derive(Clone, Copy)]
pub struct Coordinates<F: Float> {
    /// The mesh's two sets.
    pub uv: [(F, F); 2],
    /// How wide a ray is there, in units of the first set.
    pub footprint: F,
}

/// A texel's four channels.
#[derive(Clone, Copy)]
pub struct Texel<F: Float> {
    /// Red, green, blue.
    pub color: Color<F>,
    /// 1 where an image has none.
    pub alpha: F,
}

/// A material's colour.
#[inline(always)]
pub fn color<F: Float>(
    param: &ColorParam,
    textures: &Textures,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> Color<F> {
    let factor = Color::splat(param.factor.into());
    if param.texture == NONE || param.is_black() {
        return factor;
    }
    let sampled = &textures.sampled[param.texture as usize];
    factor * Color::splat(sampled.factor.into()) * texel(textures, sampled, at, mask).color
}

/// A material's number.
#[inline(always)]
pub fn scalar<F: Float>(param: &ScalarParam, textures: &Textures, at: &Coordinates<F>, mask: F::Mask) -> F {
    let factor = F::splat(param.factor);
    if param.texture == NONE || param.is_zero() {
        return factor;
    }
    let texel = texel(textures, &textures.sampled[param.texture as usize], at, mask);
    let value = match param.channel {
        0 => texel.color.r,
        1 => texel.color.g,
        2 => texel.color.b,
        _ => texel.alpha,
    };
    factor * value
}

/// What is stored at a point, without the texture's factor.
#[inline(always)]
pub fn texel<F: Float>(
    textures: &Textures,
    sampled: &Sampled,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> Texel<F> {
    // A material has a dozen of these: inlined they would be most of the program.
    F::apart(Lookup { textures, sampled, at, mask })
}

struct Lookup<'a, F: Float> {
    textures: &'a Textures,
    sampled: &'a Sampled,
    at: &'a Coordinates<F>,
    mask: F::Mask,
}

impl<F: Float> Part for Lookup<'_, F> {
    type Output = Texel<F>;
    #[inline(always)]
    fn run(self) -> Texel<F> {
        look_up(self.textures, self.sampled, self.at, self.mask)
    }
}

#[inline(always)]
fn look_up<F: Float>(textures: &Textures, sampled: &Sampled, at: &Coordinates<F>, mask: F::Mask) -> Texel<F> {
    let (u, v) = at.uv[(sampled.uv_set & 1) as usize];
    let [x, y] = sampled.matrix;
    // Beyond a million repeats a float has no bits left for the place within the image.
    let s = (u * F::splat(x[0]) + v * F::splat(x[1]) + F::splat(x[2])).clamp(-1e6, 1e6);
    let t = (u * F::splat(y[0]) + v * F::splat(y[1]) + F::splat(y[2])).clamp(-1e6, 1e6);
    let image = Picture { textures, sampled, mask };
    let first = F::Int::splat(sampled.first_level);
    if sampled.smaller_levels == 0 {
        return image.level(first, s, t);
    }
    // λ = log₂ of the footprint in texels (Akenine-Möller and others, JCGT 2021).
    let width = (at.footprint * F::splat(sampled.texels_per_uv)).max(F::splat(1e-20));
    let lambda = log2(width).clamp(0.0, sampled.smaller_levels as f32);
    let whole = lambda.floor();
    let between = lambda - whole;
    let fine = image.level(first + whole.to_int(), s, t);
    if !(mask & between.gt(F::zero())).any() {
        return fine;
    }
    let next = (whole + F::one()).min(F::splat(sampled.smaller_levels as f32));
    let coarse = image.level(first + next.to_int(), s, t);
    fine.mix(coarse, between)
}

impl<F: Float> Texel<F> {
    #[inline(always)]
    fn mix(self, other: Self, weight: F) -> Self {
        let rest = F::one() - weight;
        Self {
            color: self.color * rest + other.color * weight,
            alpha: self.alpha * rest + other.alpha * weight,
        }
    }
}

struct Picture<'a, F: Float> {
    textures: &'a Textures,
    sampled: &'a Sampled,
    mask: F::Mask,
}

impl<F: Float> Picture<'_, F> {
    /// One level at (s, t) in the image's unit square.
    #[inline(always)]
    fn level(&self, level: F::Int, s: F, t: F) -> Texel<F> {
        let levels = &self.textures.levels;
        let width = F::gather(&levels.width, level, self.mask);
        let height = F::gather(&levels.height, level, self.mask);
        let first = F::Int::gather(&levels.first, level, self.mask);
        let [wrap_u, wrap_v] = self.sampled.wrap;
        let (x, y) = (s * width, t * height);
        if !self.sampled.blends {
            return self.texel(first, width, wrap(wrap_u, x.floor(), width), wrap(wrap_v, y.floor(), height));
        }
        // Texel centres are at half coordinates.
        let half = F::splat(0.5);
        let (x, y) = (x - half, y - half);
        let (column, row) = (x.floor(), y.floor());
        let (left, right) = (wrap(wrap_u, column, width), wrap(wrap_u, column + F::one(), width));
        let (top, bottom) = (wrap(wrap_v, row, height), wrap(wrap_v, row + F::one(), height));
        let upper = self.texel(first, width, left, top).mix(self.texel(first, width, right, top), x - column);
        let lower =
            self.texel(first, width, left, bottom).mix(self.texel(first, width, right, bottom), x - column);
        upper.mix(lower, y - row)
    }

    #[inline(always)]
    fn texel(&self, first: F::Int, width: F, x: F, y: F) -> Texel<F> {
        let index = first + y.to_int() * width.to_int() + x.to_int();
        if self.sampled.float {
            return Texel {
                color: Color::gather(&self.textures.texels32, index, self.mask),
                alpha: F::one(),
            };
        }
        let word = F::Int::gather(&self.textures.texels8, index, self.mask);
        let curve = F::Int::splat(if self.sampled.srgb { 256 } else { 0 });
        let low = F::Int::splat(255);
        let table = &self.textures.decode;
        Texel {
            color: Color::new(
                F::gather(table, (word & low) + curve, self.mask),
                F::gather(table, (word.shr::<8>() & low) + curve, self.mask),
                F::gather(table, (word.shr::<16>() & low) + curve, self.mask),
            ),
            alpha: word.shr::<24>().to_float() * F::splat(1.0 / 255.0),
        }
    }
}

/// A whole texel number to one within the image.
#[inline(always)]
fn wrap<F: Float>(mode: u32, texel: F, size: F) -> F {
    let last = size - F::one();
    let wrapped = match mode {
        1 => texel,
        2 => {
            let double = size * F::splat(2.0);
            let folded = texel - (texel / double).floor() * double;
            folded.min(double - F::one() - folded)
        }
        _ => texel - (texel / size).floor() * size,
    };
    // The divisions round: never outside, whatever they did.
    wrapped.max(F::zero()).min(last)
}
