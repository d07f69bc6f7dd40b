//! PNG encoder: tone mapped, sRGB encoded and marked as sRGB.

use std::io::Write;

use png::{BitDepth, ColorType, Compression, Encoder, SrgbRenderingIntent};

use super::encode::{Opacity, Output, PngBits};

pub(super) fn encode(writer: impl Write, output: &Output<'_>) -> Result<(), png::EncodingError> {
    let mut encoder = Encoder::new(writer, output.width, output.height);
    encoder.set_color(if output.opacity() == Opacity::Stored { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(match output.bits {
        PngBits::Eight => BitDepth::Eight,
        PngBits::Sixteen => BitDepth::Sixteen,
    });
    // Rendering one sample takes only a few times as long as better compression would.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    for (name, value) in output.metadata {
        let value = value.replace('\0', " ");
        if value.chars().all(|c| u32::from(c) < 256) {
            encoder.add_text_chunk(keyword(name), value)?;
        } else {
            encoder.add_itxt_chunk(keyword(name), value)?;
        }
    }
    let bytes = match output.bits {
        PngBits::Eight => output.shown_8_bit(),
        PngBits::Sixteen => output.shown_16_bit().into_iter().flat_map(u16::to_be_bytes).collect(),
    };
    let mut image = encoder.write_header()?;
    image.write_image_data(&bytes)?;
    image.finish()
}

/// Converts a name to a valid keyword: 1 to 79 printable Latin-1 characters. Invalid characters are replaced, because
/// metadata must not prevent saving the image.
fn keyword(name: &str) -> String {
    let printable = |c: char| matches!(u32::from(c), 32..=126 | 161..=255);
    let name: String = name.trim().chars().take(79).map(|c| if printable(c) { c } else { '?' }).collect();
    if name.is_empty() { "Comment".to_owned() } else { name }
}
