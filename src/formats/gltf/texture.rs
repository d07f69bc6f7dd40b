//! Textures: an image, a sampler and perhaps a transform.

use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::Import;
use super::extensions::{TextureTransform, WebpTexture};
use crate::error::LoadError;
use crate::math::{Rgb, Vec2};
use crate::world::Texture;
use crate::world::assets::{TextureFilter, Wrap};

/// A texture as a material uses it, and by which of the mesh's sets of coordinates.
pub(super) struct Lookup {
    pub texture: Texture,
    pub set: u32,
}

impl Import<'_> {
    /// A texture that colours are looked up in; none if its image cannot be had.
    pub(super) fn lookup(&mut self, info: &Info, at: &str) -> Result<Option<Lookup>, LoadError> {
        let document = self.document;
        let texture = document.get(&document.root.textures, info.index, at, "texture")?;
        let Some(source) = self.source(info.index, at)? else { return Ok(None) };
        let id = self.images.id(document, source, at, self.assets, self.warnings)?;
        let Some(image) = id else { return Ok(None) };
        let mut lookup = Lookup { texture: Texture::new(image), set: info.tex_coord };
        if let Some(index) = texture.sampler {
            let at = format!("/textures/{}/sampler", info.index.value());
            let sampler = document.get(&document.root.samplers, index, at, "sampler")?;
            if sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest)) {
                lookup.texture.filter = TextureFilter::Nearest;
            }
            lookup.texture.wrap = [wrap(sampler.wrap_s), wrap(sampler.wrap_t)];
        }
        let extensions = info.extensions.as_ref().map(|extensions| &extensions.others);
        let transform: Option<TextureTransform> =
            document.extension(extensions, "KHR_texture_transform", at)?;
        if let Some(transform) = transform {
            lookup.texture.scale = Vec2::from_array(transform.scale);
            lookup.texture.offset = Vec2::from_array(transform.offset);
            lookup.set = transform.tex_coord.unwrap_or(lookup.set);
            if transform.rotation != 0.0 {
                self.losses.rotated_textures += 1;
            }
        }
        Ok(Some(lookup))
    }

    /// The mean over a texture's image, as it is stored.
    pub(super) fn texture_mean(&mut self, info: &Info, at: &str) -> Result<Option<[f32; 3]>, LoadError> {
        let Some(source) = self.source(info.index, at)? else { return Ok(None) };
        self.images.mean(self.document, source, at, self.warnings)
    }

    /// The image of a texture; none, and a warning, if only unknown extensions could say.
    fn source(
        &mut self,
        index: Index<json::Texture>,
        at: &str,
    ) -> Result<Option<Index<json::Image>>, LoadError> {
        let document = self.document;
        let texture = document.get(&document.root.textures, index, at, "texture")?;
        let at = format!("/textures/{}", index.value());
        let extensions = texture.extensions.as_ref().map(|extensions| &extensions.others);
        let webp: Option<WebpTexture> = document.extension(extensions, "EXT_texture_webp", &at)?;
        if let Some(source) = webp.and_then(|webp| webp.source) {
            return Ok(Some(Index::new(source)));
        }
        // What the crate says where there is none.
        if texture.source.value() == u32::MAX as usize {
            self.warnings.push(document.warning(format_args!("{at}: has no image that can be read")));
            return Ok(None);
        }
        Ok(Some(texture.source))
    }
}

impl Lookup {
    /// With another factor.
    pub(super) fn times(&self, factor: Rgb) -> Texture {
        Texture { factor, ..self.texture }
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}
