//! Pictures: textures in (PNG, JPEG, TGA, BMP, WebP, Radiance HDR, OpenEXR), rendered
//! images out (PNG, OpenEXR, Radiance HDR).
//!
//! | file | becomes |
//! |---|---|
//! | 8 bits a channel or fewer | [`Texels::Rgba8`]: the bytes as they are |
//! | PNG of 16 bits | [`Texels::Rgb32`]: taken for sRGB and decoded to linear; alpha is left out |
//! | Radiance HDR, OpenEXR | [`Texels::Rgb32`]: linear, as the file says |
//! | photometric profile (IES) | [`Texels::Rgb32`]: candela by direction |
//!
//! A file's content decides what it is; its extension only where the content does not
//! tell (TGA). Memory is bounded before any pixel is allocated: see [`limits`].

mod decode;
mod encode;
mod encode_openexr;
mod encode_png;
mod encode_radiance;
mod ies;
pub mod limits;
mod openexr;
mod texts;
pub mod video;

use std::path::Path;
use std::sync::Arc;

pub use encode::{Output, PngBits, is_saved, png_bytes, save, supported};
pub use texts::load_text;

use crate::error::LoadError;
use crate::film::tonemap::srgb_decode;
use crate::math::Rgb;
use crate::world::{Image, SourceFiles, Texels};

/// Brighter texels are cut off at this value, so that no sum of products of a few of them overflows.
const BRIGHTEST_TEXEL: f32 = 1e9;

/// Reads a picture to be used as a texture. NaN and negative floats become 0, infinity
/// and what is above 10⁹ becomes 10⁹.
pub fn load(path: &Path, sources: &SourceFiles) -> Result<Arc<Image>, LoadError> {
    let bytes = sources.read(path).map_err(LoadError::io(path))?;
    sources.kept.images.decoded(&bytes, path, || {
        let image = decode(&bytes, path)?;
        Ok(Arc::new(Image { source: Some(path.to_owned()), ..image }))
    })
}

/// [`load`] for a picture in memory, such as one within a glTF file. `path` is what
/// errors call it, and its extension says what it is where `bytes` do not.
pub fn decode(bytes: &[u8], path: &Path) -> Result<Image, LoadError> {
    let mut image = decode_unchanged(bytes, path)?;
    if let Texels::Rgb32(texels) = &mut image.texels {
        for texel in texels {
            *texel = texel.map(|value| if value > 0.0 { value.min(BRIGHTEST_TEXEL) } else { 0.0 });
        }
    }
    Ok(image)
}

/// Width, height and linear pixels of a picture that is to be compared with another:
/// PNG and the like by the sRGB curve without alpha; OpenEXR and Radiance HDR as they
/// are, NaN, infinity and all.
pub fn load_linear(path: &Path) -> Result<(u32, u32, Vec<Rgb>), LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let image = decode_unchanged(&bytes, path)?;
    let pixels = match image.texels {
        Texels::Rgb32(texels) => texels.into_iter().map(Rgb::from).collect(),
        Texels::Rgba8(texels) => {
            let linear: Vec<f32> = (0..=u8::MAX).map(|byte| srgb_decode(f32::from(byte) / 255.0)).collect();
            let decode = |byte: u8| linear[usize::from(byte)];
            texels.into_iter().map(|[r, g, b, _]| Rgb::new(decode(r), decode(g), decode(b))).collect()
        }
    };
    Ok((image.width, image.height, pixels))
}

fn decode_unchanged(bytes: &[u8], path: &Path) -> Result<Image, LoadError> {
    if ies::is_ies(bytes, path) {
        return ies::decode(bytes, path);
    }
    match decode::recognise(bytes, path)? {
        image::ImageFormat::OpenExr => openexr::decode(bytes, path),
        format => decode::decode(bytes, format, path),
    }
}

#[cfg(test)]
mod tests;
