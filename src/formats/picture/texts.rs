//! Texts stored in the headers of saved images.

use std::io::Cursor;
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};

use image::ImageDecoder;

use super::{decode, exif};
use crate::error::LoadError;

/// Reads the text that an image stores under a name; none if there is none, or if its format cannot store texts.
pub fn load_text(path: &Path, name: &str) -> Result<Option<String>, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    Ok(match decode::recognise(&bytes, path)? {
        image::ImageFormat::Png => of_png(&bytes, name),
        image::ImageFormat::OpenExr => of_openexr(&bytes, name),
        image::ImageFormat::Hdr => of_radiance(&bytes, name),
        format @ (image::ImageFormat::Jpeg | image::ImageFormat::WebP) => of_exif(&bytes, format, name),
        _ => None,
    })
}

fn of_png(bytes: &[u8], name: &str) -> Option<String> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_ignore_iccp_chunk(true);
    let reader = decoder.read_info().ok()?;
    let info = reader.info();
    let latin = info.uncompressed_latin1_text.iter().find(|text| text.keyword == name);
    // Compressed texts are skipped: this program writes none, and those of others may expand a thousandfold.
    let unicode =
        || info.utf8_text.iter().find(|text| text.keyword == name && !text.compressed)?.get_text().ok();
    latin.map(|text| text.text.clone()).or_else(unicode)
}

fn of_openexr(bytes: &[u8], name: &str) -> Option<String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?;
    let name = Text::new_or_none(name)?;
    match meta.headers.first()?.own_attributes.other.get(&name) {
        Some(AttributeValue::Text(text)) => Some(text.to_string()),
        _ => None,
    }
}

fn of_exif(bytes: &[u8], format: image::ImageFormat, name: &str) -> Option<String> {
    let exif = decode::open(bytes, format).ok()?.exif_metadata().ok()??;
    exif::text(&exif, name)
}

/// Searches the header: all lines up to an empty one.
fn of_radiance(bytes: &[u8], name: &str) -> Option<String> {
    let lines = bytes.split(|byte| *byte == b'\n').take_while(|line| !line.is_empty());
    let value = |line: &[u8]| {
        let line = String::from_utf8_lossy(line).into_owned();
        let (found, value) = line.strip_prefix("# ")?.split_once(": ")?;
        (found == name).then(|| value.to_owned())
    };
    lines.map(value).find_map(|value| value)
}
