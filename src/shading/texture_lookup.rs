//! Texture lookups: one texture at many points, filtered over the rays' footprints.

use super::footprint::{Footprint, Taps, may_exceed_a_texel};
use super::procedural;
use crate::math::{Color, NONE, Vector};
use crate::scene::Textures;
use crate::scene::material::{ColorParam, ScalarParam};
use crate::scene::textures::SampledTexture;
use crate::simd::{Float, Int, Mask, Outlined};

/// The coordinates of a texture lookup.
#[derive(Clone, Copy)]
pub struct Coordinates<F: Float> {
    /// The mesh's two sets of texture coordinates.
    pub uv: [(F, F); 2],
    /// The ray's footprint in units of either set.
    pub footprint: [Footprint<F>; 2],
    /// The position in the object's space, in metres; zero in a scene without textures there.
    pub object: Vector<F>,
    /// Two conjugate diameters of the ray's footprint there.
    pub object_footprint: [Vector<F>; 2],
    /// The mesh's colours and alphas at vertices, interpolated; opaque white in a scene without textures that look it up.
    pub vertex: Texel<F>,
}

impl<F: Float> Coordinates<F> {
    /// Coordinates of a footprint that is a point.
    #[inline(always)]
    pub fn point(uv: [(F, F); 2]) -> Self {
        let zero = Vector::zero();
        Self {
            uv,
            footprint: [Footprint::point(); 2],
            object: zero,
            object_footprint: [zero; 2],
            vertex: Texel::white(),
        }
    }
}

/// The four channels of a texel.
#[derive(Clone, Copy)]
pub struct Texel<F: Float> {
    /// Red, green, blue.
    pub color: Color<F>,
    /// Alpha; 1 if the image has none.
    pub alpha: F,
}

/// Looks up a colour parameter.
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

/// Looks up a scalar parameter.
#[inline(always)]
pub fn scalar<F: Float>(param: &ScalarParam, textures: &Textures, at: &Coordinates<F>, mask: F::Mask) -> F {
    let factor = F::splat(param.factor);
    if param.texture == NONE || param.is_zero() {
        return factor;
    }
    let texel = texel(textures, &textures.sampled[param.texture as usize], at, mask);
    factor * texel.channel(param.channel)
}

/// The filtered texel at a point, without the texture's factor.
#[inline(always)]
pub fn texel<F: Float>(
    textures: &Textures,
    sampled: &SampledTexture,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> Texel<F> {
    // A material has a dozen of these lookups: inlined they would be most of the program.
    F::outlined(Lookup { textures, sampled, at, mask })
}

struct ProceduralLookup<'a, F: Float> {
    textures: &'a Textures,
    sampled: &'a SampledTexture,
    at: &'a Coordinates<F>,
    mask: F::Mask,
}

impl<F: Float> Outlined for ProceduralLookup<'_, F> {
    type Output = Texel<F>;
    #[inline(always)]
    fn run(self) -> Texel<F> {
        procedural::evaluate(self.textures, self.sampled, self.at, self.mask)
    }
}

struct Lookup<'a, F: Float> {
    textures: &'a Textures,
    sampled: &'a SampledTexture,
    at: &'a Coordinates<F>,
    mask: F::Mask,
}

impl<F: Float> Outlined for Lookup<'_, F> {
    type Output = Texel<F>;
    #[inline(always)]
    fn run(self) -> Texel<F> {
        let Lookup { textures, sampled, at, mask } = self;
        if sampled.is_procedural() {
            return F::outlined(ProceduralLookup { textures, sampled, at, mask });
        }
        look_up(textures, sampled, at, mask)
    }
}

#[inline(always)]
fn look_up<F: Float>(
    textures: &Textures,
    sampled: &SampledTexture,
    at: &Coordinates<F>,
    mask: F::Mask,
) -> Texel<F> {
    let set = (sampled.uv_set & 1) as usize;
    let (u, v) = at.uv[set];
    let [x, y] = sampled.matrix;
    // Beyond a million repeats a float has no bits left for the position within the image.
    let s = (u * F::splat(x[0]) + v * F::splat(x[1]) + F::splat(x[2])).clamp(-1e6, 1e6);
    let t = (u * F::splat(y[0]) + v * F::splat(y[1]) + F::splat(y[2])).clamp(-1e6, 1e6);
    let image = TextureLookup { textures, sampled, mask };
    if sampled.smaller_levels == 0 {
        return image.level(F::Int::splat(sampled.first_level), s, t);
    }
    let (width, height) = image.finest();
    let [a, b] = at.footprint[set].axes;
    let axes = [texels_along(x, y, a, (width, height)), texels_along(x, y, b, (width, height))];
    if !(mask & may_exceed_a_texel(axes)).any() {
        return image.level(F::Int::splat(sampled.first_level), s, t);
    }
    let taps = Taps::new(axes);
    // λ of each level (Akenine-Möller and others, JCGT 2021).
    let lambda = taps.level.clamp(0.0, sampled.smaller_levels as f32);
    let (across, down) = (F::splat(1.0 / width), F::splat(1.0 / height));
    let (s, t) = (s + taps.first.0 * across, t + taps.first.1 * down);
    let mut sum = image.between_levels(lambda, s, t);
    let mut index = F::one();
    loop {
        let more = taps.continues(index, mask);
        if !more.any() {
            return sum.divided(taps.count);
        }
        let (s, t) = (s + taps.step.0 * (index * across), t + taps.step.1 * (index * down));
        let next = TextureLookup { mask: more, ..image }.between_levels(lambda, s, t);
        sum = Texel::select(more, sum.plus(next), sum);
        index = index + F::one();
    }
}

/// Converts a step in a mesh's coordinates to texels, by the rows of a matrix to the image's unit square.
#[inline(always)]
fn texels_along<F: Float>(x: [f32; 3], y: [f32; 3], (u, v): (F, F), size: (f32, f32)) -> (F, F) {
    (
        (u * F::splat(x[0]) + v * F::splat(x[1])) * F::splat(size.0),
        (u * F::splat(y[0]) + v * F::splat(y[1])) * F::splat(size.1),
    )
}

impl<F: Float> Texel<F> {
    /// Opaque white.
    #[inline(always)]
    pub fn white() -> Self {
        Self { color: Color::new(F::one(), F::one(), F::one()), alpha: F::one() }
    }

    /// A channel: red, green, blue, alpha.
    #[inline(always)]
    pub(super) fn channel(&self, channel: u32) -> F {
        match channel {
            0 => self.color.r,
            1 => self.color.g,
            2 => self.color.b,
            _ => self.alpha,
        }
    }

    /// A mixture: `weight` of the other one, the rest of this one.
    #[inline(always)]
    pub(super) fn mix(self, other: Self, weight: F) -> Self {
        let rest = F::one() - weight;
        Self {
            color: self.color * rest + other.color * weight,
            alpha: self.alpha * rest + other.alpha * weight,
        }
    }

    #[inline(always)]
    pub(super) fn scaled(self, part: F) -> Self {
        Self { color: self.color * part, alpha: self.alpha * part }
    }

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self { color: self.color + other.color, alpha: self.alpha + other.alpha }
    }

    #[inline(always)]
    fn divided(self, count: F) -> Self {
        let Color { r, g, b } = self.color;
        Self { color: Color::new(r / count, g / count, b / count), alpha: self.alpha / count }
    }

    #[inline(always)]
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self { color: Color::select(mask, yes.color, no.color), alpha: F::select(mask, yes.alpha, no.alpha) }
    }
}

#[derive(Clone, Copy)]
struct TextureLookup<'a, F: Float> {
    textures: &'a Textures,
    sampled: &'a SampledTexture,
    mask: F::Mask,
}

impl<F: Float> TextureLookup<'_, F> {
    /// Width and height of the finest level.
    #[inline(always)]
    fn finest(&self) -> (f32, f32) {
        let (levels, first) = (&self.textures.levels, self.sampled.first_level as usize);
        (levels.width[first], levels.height[first])
    }

    /// Interpolates between the two levels around a fractional one, counted from the finest.
    #[inline(always)]
    fn between_levels(&self, lambda: F, s: F, t: F) -> Texel<F> {
        let first = F::Int::splat(self.sampled.first_level);
        let whole = lambda.floor();
        let between = lambda - whole;
        let fine = self.level(first + whole.to_int(), s, t);
        if !(self.mask & between.gt(F::zero())).any() {
            return fine;
        }
        let next = (whole + F::one()).min(F::splat(self.sampled.smaller_levels as f32));
        let coarse = self.level(first + next.to_int(), s, t);
        fine.mix(coarse, between)
    }

    /// Looks up one level at (s, t) in the image's unit square.
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

/// Wraps an integral texel coordinate into the image.
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
    // Divisions round, but the result must never be outside the image.
    wrapped.max(F::zero()).min(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tonemap::srgb_decode;
    use crate::scene::textures::Levels;

    /// One image of bytes or floats with levels of these sizes, looked up without interpolation.
    fn textures(sizes: &[[u32; 2]], texels8: Vec<u32>, texels32: Vec<[f32; 3]>) -> Textures {
        let unit = |i: u16| f32::from(i) / 255.0;
        let decode = (0..256).map(unit).chain((0..256).map(|i| srgb_decode(unit(i)))).collect();
        let mut levels = Levels::default();
        let mut first = 0;
        for [width, height] in sizes {
            levels.first.push(first);
            levels.width.push(*width as f32);
            levels.height.push(*height as f32);
            first += width * height;
        }
        let sampled = SampledTexture {
            matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            uv_set: 0,
            factor: [1.0; 3],
            blends: false,
            srgb: false,
            float: texels8.is_empty(),
            wrap: [0; 2],
            first_level: 0,
            smaller_levels: sizes.len() as u32 - 1,
            program: [0; 2],
            levels: [0.0; 2],
        };
        let (texels8, texels32) = (texels8.into(), texels32.into());
        Textures { texels8, texels32, decode, levels, sampled: vec![sampled], ..Textures::default() }
    }

    fn grey(byte: u8) -> u32 {
        u32::from_le_bytes([byte, byte, byte, 255])
    }

    /// Values 0, 0.2, 0.4 and 0.6 along u.
    fn steps() -> Textures {
        textures(&[[4, 1]], [0, 51, 102, 153].map(grey).to_vec(), vec![])
    }

    fn at(u: f32, v: f32) -> Coordinates<f32> {
        Coordinates::point([(u, v); 2])
    }

    /// A circular footprint at (0.3, 0.3).
    fn round(width: f32) -> Coordinates<f32> {
        Coordinates { footprint: [Footprint { axes: [(width, 0.0), (0.0, width)] }; 2], ..at(0.3, 0.3) }
    }

    fn red(textures: &Textures, at: &Coordinates<f32>) -> f32 {
        texel(textures, &textures.sampled[0], at, true).color.r
    }

    #[track_caller]
    fn near(found: f32, expected: f32) {
        assert!((found - expected).abs() < 1e-6, "{found} instead of {expected}");
    }

    #[test]
    fn wrap_modes_repeat_clamp_or_mirror_the_image() {
        let mut steps = steps();
        // The coordinate, then the texel with repeat, clamp and mirror.
        for (u, expected) in [
            (0.1, [0.0, 0.0, 0.0]),
            (0.6, [0.4, 0.4, 0.4]),
            (1.1, [0.0, 0.6, 0.6]),
            (1.9, [0.6, 0.6, 0.0]),
            (2.1, [0.0, 0.6, 0.0]),
            (-0.1, [0.6, 0.0, 0.0]),
            (-1.1, [0.6, 0.0, 0.6]),
            (-0.3, [0.4, 0.0, 0.2]),
        ] {
            for (mode, expected) in (0..).zip(expected) {
                steps.sampled[0].wrap = [mode, 0];
                near(red(&steps, &at(u, 0.5)), expected);
            }
        }
        // The other axis has a mode of its own.
        let mut upright = textures(&[[1, 4]], [0, 51, 102, 153].map(grey).to_vec(), vec![]);
        upright.sampled[0].wrap = [0, 2];
        near(red(&upright, &at(7.0, 1.1)), 0.6);
        for far in [1e30, -1e30, f32::NAN, f32::INFINITY] {
            assert!(red(&steps, &at(far, far)).is_finite());
        }
    }

    #[test]
    fn bilinear_lookup_interpolates_four_texels() {
        let bytes = [0, 51, 102, 255].map(grey).to_vec();
        let mut square = textures(&[[2, 2]], bytes, vec![]);
        square.sampled[0].blends = true;
        near(red(&square, &at(0.25, 0.25)), 0.0);
        near(red(&square, &at(0.75, 0.75)), 1.0);
        near(red(&square, &at(0.5, 0.25)), 0.1);
        near(red(&square, &at(0.25, 0.375)), 0.1);
        near(red(&square, &at(0.5, 0.5)), (0.0 + 0.2 + 0.4 + 1.0) / 4.0);
        // At the edge interpolated with the other edge, with itself, with itself.
        for (mode, expected) in [(0, 0.1), (1, 0.0), (2, 0.0)] {
            square.sampled[0].wrap = [mode; 2];
            near(red(&square, &at(0.0, 0.25)), expected);
        }
    }

    #[test]
    fn footprint_selects_the_mip_levels() {
        let bytes = [[0; 16].as_slice(), &[102; 4], &[204]].concat().into_iter().map(grey).collect();
        let mut levels = textures(&[[4, 4], [2, 2], [1, 1]], bytes, vec![]);
        levels.sampled[0].blends = true;
        // Widths in texels: zero, half, one, two, four, many; then between one and two, and between two and four.
        for (texels, expected) in [
            (0.0, 0.0),
            (0.5, 0.0),
            (1.0, 0.0),
            (2.0, 0.4),
            (4.0, 0.8),
            (100.0, 0.8),
            (1.5, 0.4 * 1.5f32.log2()),
        ] {
            near(red(&levels, &round(texels / 4.0)), expected);
        }
        near(red(&levels, &round(2f32.powf(-0.5))), 0.6);
        // Without smaller levels, or with another first level.
        levels.sampled[0].smaller_levels = 0;
        near(red(&levels, &round(1.0)), 0.0);
        levels.sampled[0].first_level = 1;
        near(red(&levels, &at(0.3, 0.3)), 0.4);
    }

    #[test]
    fn lookup_transforms_its_uv_set_by_the_matrix() {
        let mut steps = steps();
        let two = Coordinates::point([(0.1, 0.1), (0.6, 0.9)]);
        near(red(&steps, &two), 0.0);
        steps.sampled[0].uv_set = 1;
        near(red(&steps, &two), 0.4);
        // s is v scaled by ½ and moved by ¼: 0.7 lies in the third texel.
        steps.sampled[0].matrix = [[0.0, 0.5, 0.25], [-1.0, 0.0, 0.0]];
        near(red(&steps, &two), 0.4);
        // t is 1 − u.
        let mut upright = textures(&[[1, 4]], [0, 51, 102, 153].map(grey).to_vec(), vec![]);
        upright.sampled[0].matrix = [[1.0, 0.0, 0.0], [-1.0, 0.0, 1.0]];
        near(red(&upright, &at(0.1, 0.0)), 0.6);
    }

    #[test]
    fn srgb_decoding_applies_to_bytes_and_not_to_alpha() {
        let mut bytes = textures(&[[1, 1]], vec![u32::from_le_bytes([51, 102, 153, 204])], vec![]);
        let of = |textures: &Textures| {
            let Texel { color, alpha } = texel(textures, &textures.sampled[0], &at(0.5, 0.5), true);
            [color.r, color.g, color.b, alpha]
        };
        of(&bytes).into_iter().zip([0.2, 0.4, 0.6, 0.8]).for_each(|(found, expected)| near(found, expected));
        bytes.sampled[0].srgb = true;
        let expected = [0.2, 0.4, 0.6].map(srgb_decode);
        of(&bytes).into_iter().zip(expected).for_each(|(found, expected)| near(found, expected));
        near(of(&bytes)[3], 0.8);
        let floats = textures(&[[1, 1]], vec![], vec![[0.25, 7.0, 1e5]]);
        assert_eq!(of(&floats), [0.25, 7.0, 1e5, 1.0]);
    }

    #[test]
    fn parameters_multiply_texels_by_their_factors() {
        let mut bytes = textures(&[[1, 1]], vec![u32::from_le_bytes([51, 102, 153, 204])], vec![]);
        bytes.sampled[0].factor = [0.5, 1.0, 2.0];
        let place = at(0.5, 0.5);
        let param = ColorParam { factor: [1.0, 0.5, 1.0], texture: 0 };
        let found = color(&param, &bytes, &place, true);
        near(found.r, 0.1);
        near(found.g, 0.2);
        near(found.b, 1.2);
        let constant = color(&ColorParam::constant([0.3; 3]), &bytes, &place, true);
        assert_eq!([constant.r, constant.g, constant.b], [0.3; 3]);
        // A scalar ignores the texture's factor.
        for (channel, expected) in [(0, 0.1), (1, 0.2), (2, 0.3), (3, 0.4)] {
            near(scalar(&ScalarParam { factor: 0.5, texture: 0, channel }, &bytes, &place, true), expected);
        }
        assert_eq!(scalar(&ScalarParam::constant(0.7), &bytes, &place, true), 0.7);
        // A factor of zero causes no lookup: there is no such texture.
        assert_eq!(scalar(&ScalarParam { factor: 0.0, texture: 9, channel: 0 }, &bytes, &place, true), 0.0);
        assert_eq!(color(&ColorParam { factor: [0.0; 3], texture: 9 }, &bytes, &place, true).g, 0.0);
    }
}
