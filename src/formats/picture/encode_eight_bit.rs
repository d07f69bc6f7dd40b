//! JPEG and WebP encoders: tone mapped, sRGB encoded, 8 bits a channel.

use std::io::Write;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError, ImageResult};

use super::encode::{Opacity, Output};
use super::exif;

/// The quality of JPEG files, from 1 to 100: steps between colours are not visible, nor are blocks.
const QUALITY: u8 = 95;

/// Writes a JPEG file, without reducing the resolution of colours.
pub(super) fn jpeg(writer: impl Write, output: &Output<'_>) -> ImageResult<()> {
    encode(JpegEncoder::new_with_quality(writer, QUALITY), output)
}

/// Writes a WebP file, which keeps every byte.
pub(super) fn webp(writer: impl Write, output: &Output<'_>) -> ImageResult<()> {
    encode(WebPEncoder::new_lossless(writer), output)
}

fn encode(mut encoder: impl ImageEncoder, output: &Output<'_>) -> ImageResult<()> {
    if !output.metadata.is_empty() {
        encoder.set_exif_metadata(exif::of(output.metadata)).map_err(ImageError::Unsupported)?;
    }
    let keeps_opacity = output.opacity() == Opacity::Stored;
    let color = if keeps_opacity { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
    encoder.write_image(&output.shown_8_bit(), output.width, output.height, color)
}
