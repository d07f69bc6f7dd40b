//! Images and textures to texels and columns.

use crate::error::CompileError;
use crate::film::tonemap::srgb_decode;
use crate::scene::Textures;
use crate::scene::textures::flag;
use crate::world::assets::{Assets, ColorSpace, Texels, TextureFilter, Wrap};

pub(super) fn compile(assets: &Assets) -> Result<Textures, CompileError> {
    let unit = |i: u16| f32::from(i) / 255.0;
    let decode = (0..256).map(unit).chain((0..256).map(|i| srgb_decode(unit(i))));
    let mut out = Textures { decode: decode.collect(), ..Textures::default() };
    let mut first = Vec::with_capacity(assets.images.len());
    for image in &assets.images {
        match &image.texels {
            Texels::Rgba8(texels) => {
                first.push(out.texels8.len());
                out.texels8.extend(texels.iter().map(|t| u32::from_le_bytes(*t)));
            }
            Texels::Rgb32(texels) => {
                first.push(out.texels32.len());
                out.texels32.extend_from_slice(texels);
            }
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
        let mut flags = match texture.filter {
            TextureFilter::Nearest => 0,
            TextureFilter::Bilinear | TextureFilter::Trilinear => flag::BILINEAR,
        };
        if texture.color_space == ColorSpace::Linear {
            flags |= flag::LINEAR;
        }
        if matches!(image.texels, Texels::Rgb32(_)) {
            flags |= flag::FLOAT;
        }
        let mode = |wrap: Wrap| match wrap {
            Wrap::Repeat => 0,
            Wrap::Clamp => 1,
            Wrap::Mirror => 2,
        };
        flags |= mode(texture.wrap[0]) << flag::WRAP_U | mode(texture.wrap[1]) << flag::WRAP_V;
        out.flags.push(flags);
        out.size.push([image.width as f32, image.height as f32]);
        out.first.push(first[texture.image.0 as usize] as u32);
        out.transform.push([texture.scale.x, texture.scale.y, texture.offset.x, texture.offset.y]);
        out.factor.push(texture.factor.to_array());
    }
    Ok(out)
}
