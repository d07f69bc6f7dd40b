//! Images in a file or next to it, each decoded once.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use gltf::json::{self, Index};

use super::basis_universal;
use super::document::Document;
use super::uri::{self, Resource};
use crate::error::{Diagnostic, LoadError};
use crate::world::{Assets, DecodedImage, Image, ImageId, SourceFiles, Texels};

/// The location of an image's bytes: equal for equal images.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) enum ImageLocation {
    File(PathBuf),
    /// Offset and length in a buffer.
    Buffer(usize, u64, u64),
    /// Within the URI of this image.
    Uri(usize),
}

/// The images used up to now.
#[derive(Default)]
pub(super) struct Images {
    ids: HashMap<ImageLocation, Option<ImageId>>,
    /// Images whose gloss was converted to roughness, with the bits of the factor.
    rough: HashMap<ImageLocation, (u32, ImageId)>,
    /// Encoded bytes decoded from each buffer: limits the expansion by overlapping views.
    decoded: HashMap<usize, u64>,
    complained: HashSet<ImageLocation>,
    /// Images decoded by `decode_ahead` that have not been used yet.
    pub ahead: HashMap<ImageLocation, Result<DecodedImage, LoadError>>,
}

impl Images {
    /// Returns an image as an asset; none, with a warning, if it cannot be read.
    pub(super) fn id(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        at: &str,
        assets: &mut Assets,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Option<ImageId>, LoadError> {
        let Some(place) = place(document, index, at) else { return Ok(None) };
        if let Some(id) = self.ids.get(&place) {
            return Ok(*id);
        }
        let image = self.decode(document, index, &place, &assets.files, warnings)?;
        let id = image.map(|image| assets.add_image(image));
        self.ids.insert(place, id);
        Ok(id)
    }

    /// Returns an image whose red is roughness, 1 − gloss · `factor`, from a texture whose alpha is gloss. Each image
    /// has only one of these, so that files cannot turn one image into many.
    pub(super) fn rough(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        glossy: ImageId,
        factor: f32,
        assets: &mut Assets,
    ) -> Option<ImageId> {
        let place = place(document, index, "")?;
        if let Some((known, id)) = self.rough.get(&place) {
            return (*known == factor.to_bits()).then_some(*id);
        }
        let image = assets.images.get(glossy.0 as usize)?;
        let factor_of_gloss = factor.clamp(0.0, 1.0);
        let texels = match &image.texels {
            Texels::Rgba8(texels) => {
                let rough = |gloss: u8| (255.0 - f32::from(gloss) * factor_of_gloss).round() as u8;
                Texels::Rgba8(texels.iter().map(|texel| [rough(texel[3]), 0, 0, u8::MAX]).collect())
            }
            Texels::Rgba16(texels) => {
                let rough = |gloss: u16| (65_535.0 - f32::from(gloss) * factor_of_gloss).round() as u16;
                Texels::Rgba16(texels.iter().map(|texel| [rough(texel[3]), 0, 0, u16::MAX]).collect())
            }
            Texels::Rgb32(_) => return None,
        };
        let image = Image { source: None, width: image.width, height: image.height, texels };
        let id = assets.add_made_image(image);
        self.rough.insert(place, (factor.to_bits(), id));
        Some(id)
    }

    /// Returns an image's pixels; none, with a warning, if they cannot be read.
    pub(super) fn picture(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        at: &str,
        sources: &SourceFiles,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Option<Arc<Image>>, LoadError> {
        let Some(place) = place(document, index, at) else { return Ok(None) };
        self.decode(document, index, &place, sources, warnings)
    }

    fn decode(
        &mut self,
        document: &Document,
        index: Index<json::Image>,
        place: &ImageLocation,
        sources: &SourceFiles,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Option<Arc<Image>>, LoadError> {
        let at = format!("/images/{}", index.value());
        let ahead = self.ahead.remove(place);
        let encoded = if ahead.is_none() { Encoded::of(document, index, place) } else { None };
        if let ImageLocation::Buffer(buffer, _, length) = place {
            // An image may be read once as a texture and once as part of an environment.
            let decoded = self.decoded.entry(*buffer).or_default();
            *decoded += length;
            if *decoded > whole(document, *buffer).saturating_mul(2) {
                return Err(document.error(at, "the images of this buffer overlap"));
            }
        }
        let Some(decoded) = ahead.or_else(|| encoded.map(|encoded| encoded.decode(sources))) else {
            return Ok(None);
        };
        decoded.map(|decoded| Some(decoded.report(warnings))).or_else(|error| {
            if self.complained.insert(place.clone()) {
                warnings.push(
                    Diagnostic::warning("image-left-out", error.to_string()).fixed_by("it is left out"),
                );
            }
            Ok(None)
        })
    }
}

/// An image before decoding.
pub(super) enum Encoded<'d> {
    File(PathBuf),
    /// The bytes, and the name for messages.
    Bytes(Cow<'d, [u8]>, PathBuf),
}

impl<'d> Encoded<'d> {
    /// The encoded data of an image; none, which is recorded, if they cannot be located.
    pub(super) fn of(
        document: &'d Document,
        index: Index<json::Image>,
        place: &ImageLocation,
    ) -> Option<Self> {
        let at = format!("/images/{}", index.value());
        let image = document.root.images.get(index.value())?;
        let bytes = match place {
            ImageLocation::File(file) => return Some(Self::File(file.clone())),
            ImageLocation::Uri(_) => {
                let uri = image.uri.as_deref().unwrap_or_default();
                match uri::resolve(uri, document.folder()) {
                    Ok(Resource::Data(bytes)) => Cow::Owned(bytes),
                    Ok(Resource::File(_)) => Cow::default(),
                    Err(reason) => {
                        document.mend(at, left_out(&reason));
                        return None;
                    }
                }
            }
            ImageLocation::Buffer(..) => match document.view(image.buffer_view?, "") {
                Ok(bytes) => Cow::Borrowed(bytes),
                Err(error) => {
                    document.mend(&at, left_out(&reason_of(error)));
                    return None;
                }
            },
        };
        Some(Self::Bytes(bytes, inside(document.path, &at)))
    }

    /// Decodes the pixels.
    pub(super) fn decode(self, sources: &SourceFiles) -> Result<DecodedImage, LoadError> {
        let (bytes, name, source) = match self {
            Self::File(file) => {
                let bytes = sources.read(&file).map_err(LoadError::io(&file))?;
                (Cow::Owned(bytes), file.clone(), Some(file))
            }
            Self::Bytes(bytes, name) => (bytes, name, None),
        };
        sources.kept.images.decoded(&bytes, &name, || {
            let (image, warning) = basis_universal::decode(&bytes, &name)?;
            Ok(DecodedImage { image: Image { source, ..image }.into(), warning })
        })
    }
}

/// The length of a buffer.
pub(super) fn whole(document: &Document, buffer: usize) -> u64 {
    document.root.buffers.get(buffer).map_or(0, |buffer| buffer.byte_length.0)
}

/// The name for messages about an image inside a file.
fn inside(path: &Path, at: &str) -> PathBuf {
    PathBuf::from(format!("{}: {at}", path.display()))
}

/// The reason of an error without a place in the file.
fn reason_of(error: LoadError) -> String {
    match error {
        LoadError::Invalid { reason, .. } => reason.trim_start_matches(": ").to_owned(),
        other => other.to_string(),
    }
}

/// The text about an image that is left out for a reason, with its remedy at the end.
fn left_out(reason: &str) -> String {
    match reason.strip_suffix(')').and_then(|reason| reason.rsplit_once(" (")) {
        Some((reason, remedy)) => format!("{reason}: the image is left out ({remedy})"),
        None => format!("{reason}: the image is left out"),
    }
}

/// The location of an image; none, which is recorded, if it has none.
pub(super) fn place(document: &Document, index: Index<json::Image>, at: &str) -> Option<ImageLocation> {
    let image = document.find(&document.root.images, index, at, "image", "the texture is left out")?;
    let at = format!("/images/{}", index.value());
    if let Some(view) = image.buffer_view {
        let views = &document.root.buffer_views;
        let view = document.find(views, view, &at, "buffer view", "the image is left out")?;
        return Some(ImageLocation::Buffer(
            view.buffer.value(),
            view.byte_offset.unwrap_or_default().0,
            view.byte_length.0,
        ));
    }
    let Some(uri) = &image.uri else {
        document.mend(at, "an image needs a uri or a bufferView: it is left out");
        return None;
    };
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return Some(ImageLocation::Uri(index.value()));
    }
    match uri::resolve(uri, document.folder()) {
        Ok(Resource::File(file)) => Some(ImageLocation::File(file)),
        Ok(Resource::Data(_)) => Some(ImageLocation::Uri(index.value())),
        Err(reason) => {
            document.mend(at, left_out(&reason));
            None
        }
    }
}
