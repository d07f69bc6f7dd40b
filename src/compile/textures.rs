//! Images and textures to texels and columns.

mod mips;
mod srgb;

use std::sync::Arc;

use rayon::prelude::*;

use self::mips::{TexelsOut, Work};
use crate::error::CompileError;
use crate::film::tonemap::srgb_decode;
use crate::scene::Textures;
use crate::scene::textures::{Kind, SampledTexture};
use crate::world::assets::{Assets, ColorSpace, Image, Texels, Texture, TextureFilter, Wrap};
use crate::world::{AlphaMode, Channel, ColorInput, Material};

/// `before` may have been made of the same images: their texels are shared.
pub(super) fn compile(assets: &Assets, before: Option<&Textures>) -> Result<Textures, CompileError> {
    let unit = |i: u16| f32::from(i) / 255.0;
    let decode = (0..256).map(unit).chain((0..256).map(|i| srgb_decode(unit(i))));
    let mut out = Textures { decode: decode.collect(), ..Textures::default() };
    let first_levels = levels(assets, &mut out, before)?;
    for texture in &assets.textures {
        let image = &assets.images[texture.image.0 as usize];
        push(&mut out, texture, image, &first_levels);
    }
    Ok(out)
}

/// Texels of all images and their copies. Says where each image's levels begin.
fn levels(assets: &Assets, out: &mut Textures, before: Option<&Textures>) -> Result<Vec<u32>, CompileError> {
    out.images = kinds(assets);
    let uses = out.images.clone();
    let mut first_levels = Vec::with_capacity(assets.images.len());
    let mut sizes = Vec::with_capacity(assets.images.len());
    let (mut bytes, mut floats) = (0, 0);
    for (image, used) in assets.images.iter().zip(&uses) {
        let end = match image.texels {
            Texels::Rgba8(_) => &mut bytes,
            Texels::Rgb32(_) => &mut floats,
        };
        let own = [image.width as usize, image.height as usize];
        let levels = mips::sizes(own, used.smaller);
        first_levels.push(out.levels.first.len() as u32);
        for [width, height] in &levels {
            out.levels.first.push(*end as u32);
            out.levels.width.push(*width as f32);
            out.levels.height.push(*height as f32);
            *end += width * height;
        }
        sizes.push(levels);
    }
    // Lanes address texels with signed 32-bit numbers.
    if bytes.max(floats * 3) > i32::MAX as usize {
        return Err(CompileError::TooLarge(
            "its textures have more than 2³¹ texels: use smaller ones".into(),
        ));
    }
    if let Some(before) = before.filter(|before| is_same(assets, out, &first_levels, before)) {
        (out.texels8, out.texels32) = (before.texels8.clone(), before.texels32.clone());
        return Ok(first_levels);
    }
    let (mut texels8, mut texels32) = (vec![0; bytes], vec![[0.0; 3]; floats]);
    let (mut rest8, mut rest32) = (&mut texels8[..], &mut texels32[..]);
    let (linear, curved) = out.decode.split_at(256);
    let mut work = Vec::with_capacity(assets.images.len());
    for ((image, used), sizes) in assets.images.iter().zip(&uses).zip(sizes) {
        let count = sizes.iter().map(|[width, height]| width * height).sum();
        let room = match image.texels {
            Texels::Rgba8(_) => TexelsOut::Bytes(rest8.split_off_mut(..count).unwrap_or_default()),
            Texels::Rgb32(_) => TexelsOut::Floats(rest32.split_off_mut(..count).unwrap_or_default()),
        };
        let decode = [if used.srgb { curved } else { linear }, linear];
        work.push(Work { texels: &image.texels, sizes, room, decode, srgb: used.srgb, cut: used.cut });
    }
    let (large, small): (Vec<_>, Vec<_>) = work.into_iter().partition(Work::is_large);
    large.into_iter().for_each(Work::run);
    small.into_par_iter().for_each(Work::run);
    (out.texels8, out.texels32) = (Arc::new(texels8), Arc::new(texels32));
    Ok(first_levels)
}

/// Whether levels that are to be made would be those that were made before: of the same images in the same way.
fn is_same(assets: &Assets, new: &Textures, first_levels: &[u32], before: &Textures) -> bool {
    let starts = first_levels.iter().map(|level| new.levels.first[*level as usize] as usize);
    new.images == before.images
        && new.levels == before.levels
        && assets.images.iter().zip(starts).all(|(image, start)| match &image.texels {
            Texels::Rgba8(texels) => {
                let known = &before.texels8[start..start + texels.len()];
                texels.iter().zip(known).all(|(texel, known)| u32::from_le_bytes(*texel) == *known)
            }
            Texels::Rgb32(texels) => before.texels32[start..start + texels.len()] == texels[..],
        })
}

fn kinds(assets: &Assets) -> Vec<Kind> {
    let kind = |image: &Image| Kind { float: matches!(image.texels, Texels::Rgb32(_)), ..Kind::default() };
    let mut kinds: Vec<Kind> = assets.images.iter().map(kind).collect();
    for texture in &assets.textures {
        let kind = &mut kinds[texture.image.0 as usize];
        kind.smaller |= texture.filter == TextureFilter::Trilinear;
        kind.srgb |= texture.color_space == ColorSpace::Srgb;
    }
    for material in &assets.materials {
        let Material::Principled(material) = &material.material else { continue };
        let alpha = material.alpha.texture.filter(|_| material.alpha_mode != AlphaMode::Opaque);
        if let (ColorInput::Texture(color), Some((alpha, Channel::Alpha))) = (&material.base_color, alpha) {
            let [color, alpha] = [*color, alpha].map(|id| assets.textures[id.0 as usize].image.0 as usize);
            kinds[color].cut |= color == alpha;
        }
    }
    kinds
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
    let wrap = texture.wrap.map(mode);
    let first_level = first_levels[texture.image.0 as usize];
    let (sin, cos) = (libm::sin(texture.rotation as f64) as f32, libm::cos(texture.rotation as f64) as f32);
    let (sx, sy) = (texture.scale.x, texture.scale.y);
    let next = first_levels.get(texture.image.0 as usize + 1).copied();
    let end = next.unwrap_or(out.levels.first.len() as u32);
    out.sampled.push(SampledTexture {
        matrix: [[cos * sx, sin * sy, texture.offset.x], [-sin * sx, cos * sy, texture.offset.y]],
        uv_set: texture.uv_set,
        factor: texture.factor.to_array(),
        blends,
        srgb,
        float,
        wrap,
        first_level,
        smaller_levels: if texture.filter == TextureFilter::Trilinear { end - first_level - 1 } else { 0 },
    });
}
