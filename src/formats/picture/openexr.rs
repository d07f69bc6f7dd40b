//! OpenEXR decoder. Files are read block by block, so that only the required channels take memory, and on the calling
//! thread only: a panic on one of the crate's own threads would end the process.

use std::io::Cursor;
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::lines::LineRef;
use exr::block::reader::ChunksReader;
use exr::math::Vec2;
use exr::meta::attribute::{ChannelList, IntegerBounds, SampleType};
use exr::meta::header::Header;
use exr::prelude::f16;

use super::limits;
use crate::error::LoadError;
use crate::world::{Image, Texels};

/// The location of the colours in a file.
struct ColourChannels {
    layer: usize,
    channels: Colours,
}

/// The channel indices of red, green and blue; `None` stands for zero.
type Colours = [Option<usize>; 3];

/// A function that finds the colours among the channel names of a layer.
type FindColours = fn(&[String]) -> Option<Colours>;

/// The part of a file that becomes an image.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ExrWindow {
    /// The display window; black where the layer has no data.
    Display,
    /// The data window of the layer.
    Data,
}

/// An image and its place in the file's display window.
pub(super) struct PlacedImage {
    pub image: Image,
    /// The display window's column and row of the first pixel.
    pub at: [i64; 2],
    /// The size of the display window.
    pub whole: [u32; 2],
}

/// Decodes the first layer with colours, at its highest resolution.
pub(super) fn decode(bytes: &[u8], path: &Path, window: ExrWindow) -> Result<PlacedImage, LoadError> {
    let invalid = |reason: String| LoadError::invalid(path, reason);
    let refuse =
        |error: exr::error::Error| invalid(format!("the OpenEXR picture cannot be decoded: {error}"));

    let reader = exr::block::read(Cursor::new(bytes), false).map_err(refuse)?;
    let source = find_colours(reader.headers()).map_err(invalid)?;
    // Each chunk takes eight bytes in the file's offset table, so this limits all lists of chunks.
    let chunks = reader.headers().iter().fold(0, |sum: usize, header| sum.saturating_add(header.chunk_count));
    if chunks > bytes.len() / 8 {
        return Err(invalid(format!(
            "the OpenEXR picture claims to have {chunks} chunks: it is cut off or damaged"
        )));
    }
    let header = &reader.headers()[source.layer];
    let picture = DecodedLayer::new(header, source, window, bytes.len(), path)?;
    let layer = picture.source.layer;
    let chunks = reader
        .filter_chunks(false, |_, tile, block| block.layer == layer && tile.is_largest_resolution_level())
        .map_err(refuse)?;
    let (at, whole) = (picture.at, picture.whole);
    let image = picture.fill(chunks.sequential_decompressor(false)).map_err(refuse)?;
    Ok(PlacedImage { image, at, whole })
}

/// Selects the channels to read: red, green and blue of the first layer that has all three, without a prefix or with
/// one as in `view.R`; else luminance, else those of the three that exist.
fn find_colours(headers: &[Header]) -> Result<ColourChannels, String> {
    let flat = || headers.iter().enumerate().filter(|(_, header)| !header.deep);
    let wanted: [FindColours; 3] = [all_three, luminance, some_of_three];
    for find in wanted {
        for (layer, header) in flat() {
            if let Some(channels) = find(&names(header)) {
                return Ok(ColourChannels { layer, channels });
            }
        }
    }
    if flat().next().is_none() {
        return Err("the OpenEXR picture has deep data only, which cannot be read".to_owned());
    }
    let known: Vec<_> = headers.iter().flat_map(names).take(16).collect();
    Err(format!("the OpenEXR picture has neither channels R, G, B nor Y, but: {}", known.join(", ")))
}

fn names(header: &Header) -> Vec<String> {
    header.channels.list.iter().map(|channel| channel.name.to_string()).collect()
}

fn all_three(names: &[String]) -> Option<Colours> {
    let at = |name: &str| names.iter().position(|other| other == name);
    let prefixes = names.iter().filter_map(|name| name.strip_suffix(".R"));
    std::iter::once(String::new()).chain(prefixes.map(|prefix| format!("{prefix}."))).find_map(|prefix| {
        let [r, g, b] = ["R", "G", "B"].map(|channel| at(&format!("{prefix}{channel}")));
        Some([Some(r?), Some(g?), Some(b?)])
    })
}

fn luminance(names: &[String]) -> Option<Colours> {
    let found = names
        .iter()
        .position(|name| name == "Y")
        .or_else(|| names.iter().position(|name| name.ends_with(".Y")));
    found.map(|channel| [Some(channel); 3])
}

fn some_of_three(names: &[String]) -> Option<Colours> {
    let channels = ["R", "G", "B"].map(|channel| names.iter().position(|name| name == channel));
    channels.iter().any(Option::is_some).then_some(channels)
}

/// An image that is being filled.
struct DecodedLayer {
    source: ColourChannels,
    channels: ChannelList,
    /// The offset from the image's origin to the data window's.
    offset: [i64; 2],
    /// The offset from the display window's origin to the image's.
    at: [i64; 2],
    /// The size of the display window.
    whole: [u32; 2],
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
}

impl DecodedLayer {
    fn new(
        header: &Header,
        source: ColourChannels,
        window: ExrWindow,
        file_bytes: usize,
        path: &Path,
    ) -> Result<Self, LoadError> {
        // The crate misreads the rows of all channels if any is subsampled.
        if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return Err(LoadError::invalid(
                path,
                "the OpenEXR picture has channels of a lower resolution, which cannot be read: save it as RGB",
            ));
        }
        let IntegerBounds { position: display, size } = header.shared_attributes.display_window;
        let data = header.own_attributes.layer_position;
        let from_display = [0, 1].map(|axis: usize| {
            let of = |v: Vec2<i32>| i64::from(if axis == 0 { v.x() } else { v.y() });
            of(data) - of(display)
        });
        let whole = [size.x() as u32, size.y() as u32];
        let (size, at, offset) = match window {
            ExrWindow::Display => (size, [0; 2], from_display),
            ExrWindow::Data => (header.layer_size, from_display, [0; 2]),
        };
        limits::check(path, [size.x() as u64, size.y() as u64], 12, file_bytes)?;
        let layer = [header.layer_size.x() as u64, header.layer_size.y() as u64];
        let _claim = limits::check(path, layer, header.channels.bytes_per_pixel as u64, file_bytes)?;
        Ok(Self {
            source,
            channels: header.channels.clone(),
            offset,
            at,
            whole,
            size: [size.x(), size.y()],
            texels: vec![[0.0; 3]; size.x() * size.y()],
        })
    }

    fn fill(
        mut self,
        blocks: impl Iterator<Item = exr::error::Result<UncompressedBlock>>,
    ) -> exr::error::Result<Image> {
        for block in blocks {
            let block = block?;
            // The crate cuts lines out of the data without a check.
            if block.data.len() != block.index.pixel_size.area() * self.channels.bytes_per_pixel {
                return Err(exr::error::Error::Invalid("a block has the wrong size".into()));
            }
            let channels = self.channels.clone();
            for line in block.lines(&channels) {
                self.put(&line);
            }
        }
        Ok(Image {
            source: None,
            width: self.size[0] as u32,
            height: self.size[1] as u32,
            texels: Texels::Rgb32(self.texels),
        })
    }

    /// Stores a row of one channel of a block.
    fn put(&mut self, line: &LineRef<'_>) {
        let wanted = self.source.channels.map(|channel| channel == Some(line.location.channel));
        let row = line.location.position.y() as i64 + self.offset[1];
        if wanted == [false; 3] || row < 0 || row >= self.size[1] as i64 {
            return;
        }
        let width = self.size[0];
        let row = &mut self.texels[row as usize * width..][..width];
        let first = line.location.position.x() as i64 + self.offset[0];
        let sample_type = self.channels.list[line.location.channel].sample_type;
        for (index, bytes) in line.value.chunks_exact(sample_type.bytes_per_sample()).enumerate() {
            let column = usize::try_from(first + index as i64).ok();
            if let Some(texel) = column.and_then(|column| row.get_mut(column)) {
                let value = sample(sample_type, bytes);
                for (component, wanted) in texel.iter_mut().zip(wanted) {
                    if wanted {
                        *component = value;
                    }
                }
            }
        }
    }
}

fn sample(sample_type: SampleType, bytes: &[u8]) -> f32 {
    match (sample_type, bytes) {
        (SampleType::F16, &[a, b]) => f16::from_ne_bytes([a, b]).to_f32(),
        (SampleType::F32, &[a, b, c, d]) => f32::from_ne_bytes([a, b, c, d]),
        (SampleType::U32, &[a, b, c, d]) => u32::from_ne_bytes([a, b, c, d]) as f32,
        _ => 0.0,
    }
}
