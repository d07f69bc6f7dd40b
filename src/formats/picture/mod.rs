//! Image files: reads textures (PNG, JPEG, TGA, BMP, WebP, Radiance HDR, OpenEXR) and writes rendered images (PNG,
//! OpenEXR, Radiance HDR).
//!
//! | file | decoded to |
//! |---|---|
//! | up to 8 bits per channel | [`Texels::Rgba8`]: the bytes as they are |
//! | PNG of 16 bits | [`Texels::Rgba16`]: the values as they are |
//! | Radiance HDR, OpenEXR | [`Texels::Rgb32`]: linear, unchanged |
//! | photometric profile (IES) | [`Texels::Rgb32`]: candela by direction |
//!
//! The format is determined by a file's content; by its extension only if the content does not identify it (TGA).
//! Memory is limited before any pixel is allocated: see [`limits`].

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
use crate::film::texels::linear_colors;
use crate::math::Rgb;
use crate::world::{Image, SourceFiles, Texels};

/// Brighter texels are clamped to this value, so that products of a few of them do not overflow.
const BRIGHTEST_TEXEL: f32 = 1e9;

/// Reads an image to be used as a texture. NaN and negative floats become 0; infinity and values above 10⁹ become 10⁹.
pub fn load(path: &Path, sources: &SourceFiles) -> Result<Arc<Image>, LoadError> {
    let bytes = sources.read(path).map_err(LoadError::io(path))?;
    sources.kept.images.decoded(&bytes, path, || {
        let image = decode(&bytes, path)?;
        Ok(Arc::new(Image { source: Some(path.to_owned()), ..image }))
    })
}

/// [`load`] for an image in memory, such as one within a glTF file. Errors call it `path`, whose extension gives the
/// format if `bytes` do not identify it.
pub fn decode(bytes: &[u8], path: &Path) -> Result<Image, LoadError> {
    let mut image = decode_unchanged(bytes, path)?;
    if let Texels::Rgb32(texels) = &mut image.texels {
        for texel in texels {
            *texel = texel.map(|value| if value > 0.0 { value.min(BRIGHTEST_TEXEL) } else { 0.0 });
        }
    }
    Ok(image)
}

/// Reads width, height and linear pixels of an image for comparison with another: PNG and other 8- and 16-bit formats
/// through the sRGB curve and without alpha; OpenEXR and Radiance HDR unchanged, including NaN and infinity.
pub fn load_linear(path: &Path) -> Result<(u32, u32, Vec<Rgb>), LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let image = decode_unchanged(&bytes, path)?;
    let pixels = linear_colors(&image.texels).iter().map(|texel| Rgb::from(*texel)).collect();
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
