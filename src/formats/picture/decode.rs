//! Decoding of images with the `image` crate.

use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::limits;
use crate::error::LoadError;
use crate::world::{Image, Texels};

/// The supported formats and their extensions in lower case.
const KNOWN: [(&str, ImageFormat); 8] = [
    ("png", ImageFormat::Png),
    ("jpg", ImageFormat::Jpeg),
    ("jpeg", ImageFormat::Jpeg),
    ("tga", ImageFormat::Tga),
    ("bmp", ImageFormat::Bmp),
    ("webp", ImageFormat::WebP),
    ("hdr", ImageFormat::Hdr),
    ("exr", ImageFormat::OpenExr),
];

/// Determines the format of `bytes` by their beginning or, if that is inconclusive, by the extension of `path`.
pub(super) fn recognise(bytes: &[u8], path: &Path) -> Result<ImageFormat, LoadError> {
    // Greg Ward's other signature, which the crate does not recognise.
    let by_content =
        if bytes.starts_with(b"#?RGBE") { Some(ImageFormat::Hdr) } else { image::guess_format(bytes).ok() };
    let is_known = |format: &ImageFormat| KNOWN.iter().any(|(_, known)| known == format);
    if let Some(format) = by_content.filter(is_known) {
        return Ok(format);
    }
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let by_extension = KNOWN.iter().find(|(known, _)| *known == extension).map(|(_, format)| *format);
    by_extension.ok_or_else(|| {
        let what = by_content.and_then(|format| format.extensions_str().first()).copied();
        let what =
            what.map_or_else(|| "no picture of a known kind".to_owned(), |kind| format!("a .{kind} picture"));
        let known: Vec<_> = KNOWN.iter().map(|(extension, _)| *extension).collect();
        LoadError::invalid(
            path,
            format!("this is {what}: the kinds that can be read are {}", known.join(", ")),
        )
    })
}

/// Decodes an image of `format` without changing its values.
pub(super) fn decode(bytes: &[u8], format: ImageFormat, path: &Path) -> Result<Image, LoadError> {
    let refuse = |error: image::ImageError| {
        let reason = error.to_string().replace('\n', " ");
        LoadError::invalid(path, format!("the picture cannot be decoded: {reason}"))
    };
    let bytes = &without_notes(bytes, format);
    let decoder = open(bytes, format).map_err(refuse)?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let pixel_bytes = match color.bytes_per_pixel() / color.channel_count() {
        1 => 4,
        2 => 8,
        _ => 12,
    };
    let _claim = limits::check(path, [width.into(), height.into()], pixel_bytes, bytes.len())?;
    let texels = texels(DynamicImage::from_decoder(decoder).map_err(refuse)?);
    Ok(Image { source: None, width, height, texels })
}

/// Returns an image without profiles and texts, which nothing here depends on. Those of PNG files are compressed: a
/// million bytes may expand a thousandfold, and the crate unpacks them before it reports the size of the image.
fn without_notes(bytes: &[u8], format: ImageFormat) -> Cow<'_, [u8]> {
    /// The length, type and checksum of a chunk.
    const AROUND: usize = 12;
    if format != ImageFormat::Png {
        return bytes.into();
    }
    let mut kept: Option<Vec<u8>> = None;
    let mut at = 8;
    while let Some((length, rest)) = bytes.get(at..).and_then(|rest| rest.split_first_chunk::<4>()) {
        let end = at.saturating_add(AROUND).saturating_add(u32::from_be_bytes(*length) as usize);
        let end = end.min(bytes.len());
        if matches!(rest.get(..4), Some(b"iCCP" | b"zTXt" | b"iTXt" | b"tEXt" | b"eXIf")) {
            kept.get_or_insert_with(|| bytes[..at].to_vec());
        } else if let Some(kept) = &mut kept {
            kept.extend_from_slice(&bytes[at..end]);
        }
        at = end;
    }
    kept.map_or(bytes.into(), Cow::Owned)
}

/// Creates a decoder; reads the header only.
pub(super) fn open(bytes: &[u8], format: ImageFormat) -> image::ImageResult<Box<dyn ImageDecoder + '_>> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut allowed = Limits::default();
    allowed.max_alloc = Some(2 * limits::LARGEST_SIZE);
    reader.limits(allowed);
    Ok(match format {
        // The strict decoder accepts only one of the two signatures.
        ImageFormat::Hdr => Box::new(HdrDecoder::new_nonstrict(Cursor::new(bytes))?),
        _ => Box::new(reader.into_decoder()?),
    })
}

fn texels(image: DynamicImage) -> Texels {
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            Texels::Rgb32(image.into_rgb32f().into_raw().as_chunks().0.to_vec())
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            Texels::Rgba16(image.into_rgba16().into_raw().as_chunks().0.to_vec())
        }
        // The crate would first make a copy with four channels.
        DynamicImage::ImageRgb8(image) => {
            let texels = image.as_raw().as_chunks().0;
            Texels::Rgba8(texels.iter().map(|[r, g, b]: &[u8; 3]| [*r, *g, *b, 255]).collect())
        }
        DynamicImage::ImageLuma8(image) => {
            Texels::Rgba8(image.as_raw().iter().map(|grey| [*grey, *grey, *grey, 255]).collect())
        }
        _ => Texels::Rgba8(image.into_rgba8().into_raw().as_chunks().0.to_vec()),
    }
}
