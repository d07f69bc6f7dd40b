//! Image files: reads textures (PNG, JPEG, TGA, BMP, WebP, Radiance HDR, OpenEXR) and writes rendered images (PNG,
//! JPEG, WebP, OpenEXR, Radiance HDR).
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

mod backplate;
mod decode;
mod encode;
mod encode_eight_bit;
mod encode_openexr;
mod encode_png;
mod encode_radiance;
mod exif;
mod ies;
pub mod limits;
mod openexr;
mod texts;
pub mod video;

use std::path::Path;

use self::openexr::{ExrWindow, PlacedImage};

pub use backplate::{ImagePixels, backplate};
pub use encode::{
    CropWindow, ImageEncoding, Opacity, Output, PngBits, encode, fits, is_saved, png_bytes, save, supported,
};
pub use texts::load_text;

use crate::error::{Diagnostic, LoadError};
use crate::film::texels::linear_colors;
use crate::math::Rgb;
use crate::world::{DecodedImage, Image, SourceFiles, Texels};

/// Brighter texels are clamped to this value, so that products of a few of them do not overflow.
const BRIGHTEST_TEXEL: f32 = 1e9;

/// The largest half float.
const LARGEST_HALF: f32 = 65_504.0;

/// Reads an image to be used as a texture. NaN and negative floats become 0, infinite ones the largest finite one or
/// 65,504, and values above 10⁹ become 10⁹.
pub fn load(path: &Path, sources: &SourceFiles) -> Result<DecodedImage, LoadError> {
    let bytes = sources.read(path).map_err(LoadError::io(path))?;
    sources.kept.images.decoded(&bytes, path, || {
        let (image, warning) = decode(&bytes, path)?;
        Ok(DecodedImage { image: Image { source: Some(path.to_owned()), ..image }.into(), warning })
    })
}

/// [`load`] for an image in memory, such as one within a glTF file, with the warning about its values. Messages call it
/// `path`, whose extension gives the format if `bytes` do not identify it.
pub fn decode(bytes: &[u8], path: &Path) -> Result<(Image, Option<Diagnostic>), LoadError> {
    let mut image = decode_unchanged(bytes, path)?;
    let warning = match &mut image.texels {
        Texels::Rgb32(texels) => finite(texels, image.width, path),
        Texels::Rgba8(_) | Texels::Rgba16(_) => None,
    };
    Ok((image, warning))
}

/// Makes values fit for light: NaN and negative ones become 0, infinite ones the largest finite one of the image or
/// 65,504, beyond which half floats are infinite. Values above 10⁹ become 10⁹. Returns a warning if the image has values
/// that stand for no amount of light.
fn finite(texels: &mut [[f32; 3]], width: u32, path: &Path) -> Option<Diagnostic> {
    let values = texels.as_flattened().iter().copied();
    let largest = values.filter(|value| value.is_finite()).fold(LARGEST_HALF, f32::max).min(BRIGHTEST_TEXEL);
    let is_odd = |value: &f32| !(value.is_finite() && *value >= 0.0);
    let (mut count, mut first) = (0_usize, None);
    for (at, texel) in texels.iter_mut().enumerate() {
        if texel.iter().any(is_odd) {
            count += 1;
            first.get_or_insert(at);
        }
        *texel = texel.map(|value| match value > 0.0 {
            true if value.is_infinite() => largest,
            true => value.min(BRIGHTEST_TEXEL),
            false => 0.0,
        });
    }
    let (x, y) = (first? % width as usize, first? / width as usize);
    let (texels, are) = if count == 1 { ("texel", "is") } else { ("texels", "are") };
    let text = format!(
        "{count} {texels} {are} infinite, NaN or negative: the first at {x}, {y}; infinite counts as {largest}, the others as 0"
    );
    Some(Diagnostic::in_file("odd-texels", path, &text))
}

/// Reads width, height and linear pixels of an image for comparison with another: PNG and other 8- and 16-bit formats
/// through the sRGB curve and without alpha; OpenEXR and Radiance HDR unchanged, including NaN and infinity.
pub fn load_linear(path: &Path) -> Result<(u32, u32, Vec<Rgb>), LoadError> {
    linear(&crate::files::read(path).map_err(LoadError::io(path))?, path)
}

/// [`load_linear`] for the bytes of a file. Messages call it `path`.
pub fn linear(bytes: &[u8], path: &Path) -> Result<(u32, u32, Vec<Rgb>), LoadError> {
    let image = decode_unchanged(bytes, path)?;
    let pixels = linear_colors(&image.texels).iter().map(|texel| Rgb::from(*texel)).collect();
    Ok((image.width, image.height, pixels))
}

/// The pixels of an image that may be a part of a larger one.
#[derive(Debug)]
pub struct LinearCrop {
    /// The column and row of the first pixel in the larger image.
    pub at: [i64; 2],
    /// Width and height.
    pub size: [u32; 2],
    /// Width and height of the larger image.
    pub whole: [u32; 2],
    /// Linear pixels, row by row.
    pub pixels: Vec<Rgb>,
}

/// Reads the pixels that an image has, as [`load_linear`] does, and their place: the data window of an OpenEXR file in
/// its display window. Other images are whole.
pub fn load_linear_crop(path: &Path) -> Result<LinearCrop, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let PlacedImage { image, at, whole } = decode_data(&bytes, path)?;
    let pixels = linear_colors(&image.texels).iter().map(|texel| Rgb::from(*texel)).collect();
    Ok(LinearCrop { at, size: [image.width, image.height], whole, pixels })
}

/// The pixels that a file stores, without a border.
fn decode_data(bytes: &[u8], path: &Path) -> Result<PlacedImage, LoadError> {
    if !ies::is_ies(bytes, path) && decode::recognise(bytes, path)? == image::ImageFormat::OpenExr {
        return openexr::decode(bytes, path, ExrWindow::Data);
    }
    let image = decode_unchanged(bytes, path)?;
    Ok(PlacedImage { at: [0; 2], whole: [image.width, image.height], image })
}

fn decode_unchanged(bytes: &[u8], path: &Path) -> Result<Image, LoadError> {
    if ies::is_ies(bytes, path) {
        return ies::decode(bytes, path);
    }
    match decode::recognise(bytes, path)? {
        image::ImageFormat::OpenExr => Ok(openexr::decode(bytes, path, ExrWindow::Display)?.image),
        format => decode::decode(bytes, format, path),
    }
}

#[cfg(test)]
mod tests;
