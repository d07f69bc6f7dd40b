//! OpenEXR encoder: 32-bit float, linear Rec. 709, run-length encoded.

use std::io::Cursor;

use exr::compression::Compression;
use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, Text};
use exr::meta::header::{LayerAttributes, standard_names};

use super::encode::{CropWindow, Output};
use crate::film::Values;

/// Bytes before the first attribute: magic number and version.
const ATTRIBUTES_START: usize = 8;

/// Rendered floats hardly compress: ZIP shrinks 14.8 MB (1280 × 960 pixels) to 14.1 MB and takes 0.3 to 0.4 s, longer
/// than rendering one sample. Run-length encoding takes 0.04 to 0.09 s, and also shortens backgrounds and identifiers.
const ENCODING: Encoding = Encoding { compression: Compression::RLE, ..Encoding::SMALL_LOSSLESS };

/// Returns the file's bytes; the error is a reason.
pub(super) fn bytes(output: &Output<'_>) -> Result<Vec<u8>, String> {
    let size = Vec2(output.width as usize, output.height as usize);
    let mut attributes =
        LayerAttributes { software_name: Text::new_or_none("rayfront"), ..Default::default() };
    for (name, value) in output.metadata {
        if let (Some(name), Some(value)) = (attribute_name(name), latin_text(value)) {
            attributes.other.insert(name, AttributeValue::Text(value));
        }
    }
    let mut image = Image::from_layer(Layer::new(size, attributes, ENCODING, channels(output)));
    if let Some(CropWindow { at, whole }) = output.window {
        let [at, whole] = [at, whole].map(|[x, y]| Vec2(x as usize, y as usize));
        image.layer_data.attributes.layer_position = at.to_i32();
        image.attributes.display_window = IntegerBounds::new((0, 0), whole);
    }
    image.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).map_err(|error| error.to_string())?;
    let mut file = file.into_inner();
    sort_attributes(&mut file).ok_or("the header could not be put in order")?;
    Ok(file)
}

/// The radiance as R, G and B, and the opacity, with which it is associated, as A. Without opacity, there is A, which is 1
/// everywhere, only if there are further channels: such a layer composites like any other, because its background
/// belongs to the image.
fn channels(output: &Output<'_>) -> AnyChannels<FlatSamples> {
    let light = ["R", "G", "B"].into_iter().enumerate().map(|(channel, name)| {
        let values = output.radiance.iter().map(|pixel| pixel.to_array()[channel]);
        AnyChannel::new(name, FlatSamples::F32(values.collect()))
    });
    let opaque = || (!output.channels.is_empty()).then(|| vec![1.0; output.radiance.len()]);
    let alpha = output.alpha.map(<[f32]>::to_vec).or_else(opaque);
    let alpha = alpha.map(|alpha| AnyChannel::new("A", FlatSamples::F32(alpha)));
    let others = output.channels.iter().map(|channel| {
        let values = match &channel.values {
            Values::Float(values) => FlatSamples::F32(values.clone()),
            Values::Whole(values) => FlatSamples::U32(values.clone()),
        };
        AnyChannel::new(&channel.name[..], values)
    });
    AnyChannels::sort(light.chain(alpha).chain(others).collect())
}

/// A name that the format allows: not empty, and not reserved.
fn attribute_name(name: &str) -> Option<Text> {
    let reserved = standard_names::ALL.contains(&name.as_bytes());
    let name = if reserved || name.is_empty() { format!("rayfront {name}") } else { name.to_owned() };
    latin_text(&name.replace('\0', " ").chars().take(255).collect::<String>())
}

/// The crate's texts store one byte per character, so others than ASCII become `?`.
fn latin_text(text: &str) -> Option<Text> {
    Text::new_or_none(text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect::<String>())
}

/// Sorts the attributes of a single-part file's header by name: the crate writes them in the random order of a hash
/// map, but equal images should give equal files. Lengths and offsets do not change. None if the header is invalid.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let mut attributes = Vec::new();
    let mut at = ATTRIBUTES_START;
    while *file.get(at)? != 0 {
        let name_end = at + file.get(at..)?.iter().position(|byte| *byte == 0)?;
        let type_end = name_end + 1 + file.get(name_end + 1..)?.iter().position(|byte| *byte == 0)?;
        let length = file.get(type_end + 1..type_end + 5)?;
        let length = u32::from_le_bytes(length.try_into().ok()?) as usize;
        let end = type_end + 5 + length;
        attributes.push(file.get(at..end)?.to_vec());
        at = end;
    }
    attributes.sort();
    file[ATTRIBUTES_START..at].copy_from_slice(&attributes.concat());
    Some(())
}
