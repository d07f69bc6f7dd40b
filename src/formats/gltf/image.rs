//! Pictures in a file or beside it, each decoded once.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use gltf::json::{self, Index};

use super::document::Document;
use super::uri::{self, Resource};
use crate::error::LoadError;
use crate::film::tonemap::{srgb_decode, srgb_encode};
use crate::formats::picture;
use crate::math::Rgb;
use crate::world::{Assets, Image, ImageId, Texels};

/// Where an image's bytes are, the same for the same image.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Place {
    File(PathBuf),
    /// Offset and length in a buffer.
    Buffer(usize, u64, u64),
    /// In the URI of this image.
    Uri(usize),
}

/// The pictures that were asked for so far.
#[derive(Default)]
pub(super) struct Images {
    ids: HashMap<Place, Option<ImageId>>,
    means: HashMap<Place, Option<[f32; 3]>>,
    /// Encoded bytes of buffers that were decoded: views that overlap would be a way to make
    /// much of little.
    decoded: HashMap<usize, u64>,
    complained: HashSet<Place>,
}

impl Images {
    /// An image as an asset; none, and a warning, if it cannot be had.
    pub(super) fn id(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        at: &str,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
    ) -> Result<Option<ImageId>, LoadError> {
        let place = place(document, index, at)?;
        if let Some(id) = self.ids.get(&place) {
            return Ok(*id);
        }
        let image = self.decode(document, index, &place, warnings)?;
        let id = image.map(|image| assets.add_image(image));
        self.ids.insert(place, id);
        Ok(id)
    }

    /// The mean over an image, each channel from 0 to 1 as it is stored (not through a curve).
    pub(super) fn mean(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        at: &str,
        warnings: &mut Vec<String>,
    ) -> Result<Option<[f32; 3]>, LoadError> {
        let place = place(document, index, at)?;
        if let Some(mean) = self.means.get(&place) {
            return Ok(*mean);
        }
        let mean = self.decode(document, index, &place, warnings)?.map(|image| mean(&image, |byte| byte));
        self.means.insert(place, mean);
        Ok(mean)
    }

    fn decode(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        place: &Place,
        warnings: &mut Vec<String>,
    ) -> Result<Option<Image>, LoadError> {
        let at = format!("/images/{}", index.value());
        let image = document.get(&document.root.images, index, &at, "image")?;
        let decoded = match place {
            Place::File(file) => picture::load(file),
            Place::Uri(_) => {
                let uri = image.uri.as_deref().unwrap_or_default();
                let bytes = match uri::resolve(uri, document.folder()) {
                    Ok(Resource::Data(bytes)) => bytes,
                    Ok(Resource::File(_)) => Vec::new(),
                    Err(reason) => return Err(document.error(at, reason)),
                };
                picture::decode(&bytes, &inside(document.path, &at))
            }
            Place::Buffer(buffer, _, length) => {
                let Some(view) = image.buffer_view else { return Ok(None) };
                let bytes = document.view(view, &at)?;
                // A picture may be wanted as a texture and for its mean.
                let decoded = self.decoded.entry(*buffer).or_default();
                *decoded += length;
                let whole = document.root.buffers.get(*buffer).map_or(0, |buffer| buffer.byte_length.0);
                if *decoded > whole.saturating_mul(2) {
                    return Err(document.error(at, "the images of this buffer overlap"));
                }
                picture::decode(bytes, &inside(document.path, &at))
            }
        };
        decoded.map(Some).or_else(|error| {
            if self.complained.insert(place.clone()) {
                warnings.push(format!("{error} (it is left out)"));
            }
            Ok(None)
        })
    }
}

/// What messages call a picture within a file.
fn inside(path: &Path, at: &str) -> PathBuf {
    PathBuf::from(format!("{}: {at}", path.display()))
}

fn place(document: &Document, index: Index<json::Image>, at: &str) -> Result<Place, LoadError> {
    let image = document.get(&document.root.images, index, at, "image")?;
    let at = format!("/images/{}", index.value());
    if let Some(view) = image.buffer_view {
        let view = document.get(&document.root.buffer_views, view, &at, "buffer view")?;
        return Ok(Place::Buffer(
            view.buffer.value(),
            view.byte_offset.unwrap_or_default().0,
            view.byte_length.0,
        ));
    }
    let Some(uri) = &image.uri else {
        return Err(document.error(at, "an image needs a uri or a bufferView"));
    };
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return Ok(Place::Uri(index.value()));
    }
    match uri::resolve(uri, document.folder()) {
        Ok(Resource::File(file)) => Ok(Place::File(file)),
        Ok(Resource::Data(_)) => Ok(Place::Uri(index.value())),
        Err(reason) => Err(document.error(at, reason)),
    }
}

/// The mean colour of an image that is read by the sRGB curve.
pub(super) fn mean_color(image: &Image) -> Rgb {
    mean(image, srgb_decode).into()
}

/// The mean of each channel; `curve` is applied to stored values from 0 to 1. What the
/// decoder has made linear goes back through the sRGB curve first.
fn mean(image: &Image, curve: impl Fn(f32) -> f32) -> [f32; 3] {
    let mut sums = [0.0f64; 3];
    let count = match &image.texels {
        Texels::Rgba8(texels) => {
            let table: Vec<f64> =
                (0..=u8::MAX).map(|byte| f64::from(curve(f32::from(byte) / 255.0))).collect();
            for texel in texels {
                sums.iter_mut().zip(texel).for_each(|(sum, byte)| *sum += table[usize::from(*byte)]);
            }
            texels.len()
        }
        Texels::Rgb32(texels) => {
            for texel in texels {
                let stored = texel.map(|linear| srgb_encode(linear.min(1.0)));
                sums.iter_mut().zip(stored).for_each(|(sum, value)| *sum += f64::from(curve(value)));
            }
            texels.len()
        }
    };
    sums.map(|sum| (sum / count.max(1) as f64) as f32)
}
