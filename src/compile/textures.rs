//! Images and textures to texels and columns.

use crate::error::CompileError;
use crate::film::tonemap::{srgb_decode, srgb_encode};
use crate::scene::Textures;
use crate::scene::textures::{Sampled, flag};
use crate::world::assets::{Assets, ColorSpace, Image, Texels, Texture, TextureFilter, Wrap};

pub(super) fn compile(assets: &Assets) -> Result<Textures, CompileError> {
    let unit = |i: u16| f32::from(i) / 255.0;
    let decode = (0..256).map(unit).chain((0..256).map(|i| srgb_decode(unit(i))));
    let mut out = Textures { decode: decode.collect(), ..Textures::default() };
    let mut first_levels = Vec::with_capacity(assets.images.len());
    for (index, image) in assets.images.iter().enumerate() {
        let of_image = || assets.textures.iter().filter(|t| t.image.0 as usize == index);
        first_levels.push(out.levels.first.len() as u32);
        match &image.texels {
            Texels::Rgba8(texels) => {
                push_level(&mut out, image.width, image.height, false);
                out.texels8.extend(texels.iter().map(|t| u32::from_le_bytes(*t)));
            }
            Texels::Rgb32(texels) => {
                push_level(&mut out, image.width, image.height, true);
                out.texels32.extend_from_slice(texels);
            }
        }
        if of_image().any(|t| t.filter == TextureFilter::Trilinear) {
            // One image may be read both ways; what most of it is decides how copies are made.
            let srgb = of_image().any(|t| t.color_space == ColorSpace::Srgb);
            smaller_copies(&mut out, image, srgb);
        }
    }
    // Lanes address texels with signed 32-bit numbers.
    if out.texels8.len().max(out.texels32.len() * 3) > i32::MAX as usize {
        return Err(CompileError::TooLarge(
            "its textures have more than 2³¹ texels: use smaller ones".into(),
        ));
    }
    for texture in &assets.textures {
        let image = &assets.images[texture.image.0 as usize];
        push(&mut out, texture, image, &first_levels);
    }
    Ok(out)
}

fn push_level(out: &mut Textures, width: u32, height: u32, float: bool) {
    let first = if float { out.texels32.len() } else { out.texels8.len() };
    out.levels.first.push(first as u32);
    out.levels.width.push(width as f32);
    out.levels.height.push(height as f32);
}

/// Halves the image until one texel is left, each texel the mean of those that it covers, in
/// linear light. Odd sizes lose no row: the last texel covers three.
fn smaller_copies(out: &mut Textures, image: &Image, srgb: bool) {
    let mut size = [image.width as usize, image.height as usize];
    let decode = std::mem::take(&mut out.decode);
    let (float, curve) = (matches!(image.texels, Texels::Rgb32(_)), if srgb { 256 } else { 0 });
    let mut texels: Vec<[f32; 4]> = Vec::new();
    while size != [1, 1] {
        let half = size.map(|s| (s / 2).max(1));
        // The largest level is never copied as floats: it may fill half of the memory.
        texels = match (&image.texels, texels.is_empty()) {
            (Texels::Rgba8(bytes), true) => {
                let color = |t: [u8; 4], c: usize| decode[t[c] as usize + curve];
                let of = |t: [u8; 4]| [color(t, 0), color(t, 1), color(t, 2), decode[t[3] as usize]];
                halve(|i| of(bytes[i]), size, half)
            }
            (Texels::Rgb32(floats), true) => {
                halve(|i| [floats[i][0], floats[i][1], floats[i][2], 1.0], size, half)
            }
            (_, false) => halve(|i| texels[i], size, half),
        };
        size = half;
        push_level(out, size[0] as u32, size[1] as u32, float);
        if float {
            out.texels32.extend(texels.iter().map(|[r, g, b, _]| [*r, *g, *b]));
        } else {
            let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
            let encode = |c: f32| byte(if srgb { srgb_encode(c) } else { c });
            let pack =
                |t: &[f32; 4]| u32::from_le_bytes([encode(t[0]), encode(t[1]), encode(t[2]), byte(t[3])]);
            out.texels8.extend(texels.iter().map(pack));
        }
    }
    out.decode = decode;
}

/// The mean of the texels that each texel of the smaller image covers.
fn halve(texel: impl Fn(usize) -> [f32; 4], size: [usize; 2], half: [usize; 2]) -> Vec<[f32; 4]> {
    let covered = |i: usize, from: usize, to: usize| i * from / to..((i + 1) * from).div_ceil(to);
    let mut out = Vec::with_capacity(half[0] * half[1]);
    for y in 0..half[1] {
        for x in 0..half[0] {
            let (mut sum, mut count) = ([0.0; 4], 0.0);
            for row in covered(y, size[1], half[1]) {
                for column in covered(x, size[0], half[0]) {
                    let texel = texel(row * size[0] + column);
                    sum = std::array::from_fn(|c| sum[c] + texel[c]);
                    count += 1.0;
                }
            }
            out.push(sum.map(|c| c / count));
        }
    }
    out
}

fn push(out: &mut Textures, texture: &Texture, image: &Image, first_levels: &[u32]) {
    let mode = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    };
    let blends = texture.filter != TextureFilter::Nearest;
    let srgb = texture.color_space == ColorSpace::Srgb;
    let float = matches!(image.texels, Texels::Rgb32(_));
    let bits = [(blends, flag::BILINEAR), (!srgb, flag::LINEAR), (float, flag::FLOAT)];
    let flags = bits.into_iter().filter(|(set, _)| *set).fold(0, |all, (_, bit)| all | bit);
    let wrap = texture.wrap.map(mode);
    let first_level = first_levels[texture.image.0 as usize];
    let (width, height) = (image.width as f32, image.height as f32);
    out.flags.push(flags | wrap[0] << flag::WRAP_U | wrap[1] << flag::WRAP_V);
    out.size.push([width, height]);
    out.first.push(out.levels.first[first_level as usize]);
    out.transform.push([texture.scale.x, texture.scale.y, texture.offset.x, texture.offset.y]);
    out.factor.push(texture.factor.to_array());

    let (sin, cos) = (libm::sin(texture.rotation as f64) as f32, libm::cos(texture.rotation as f64) as f32);
    let (sx, sy) = (texture.scale.x, texture.scale.y);
    let next = first_levels.get(texture.image.0 as usize + 1).copied();
    let end = next.unwrap_or(out.levels.first.len() as u32);
    out.sampled.push(Sampled {
        matrix: [[cos * sx, sin * sy, texture.offset.x], [-sin * sx, cos * sy, texture.offset.y]],
        uv_set: texture.uv_set,
        factor: texture.factor.to_array(),
        blends,
        srgb,
        float,
        wrap,
        first_level,
        smaller_levels: if texture.filter == TextureFilter::Trilinear { end - first_level - 1 } else { 0 },
        texels_per_uv: (width * height * (sx * sy).abs()).sqrt(),
    });
}
