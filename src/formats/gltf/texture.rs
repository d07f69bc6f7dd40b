//! Textures: an image, a sampler and perhaps a transform.

use std::collections::HashMap;

use gltf::json::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::Import;
use super::extensions::texture::{OtherSource, TextureInfo, TextureTransform};
use crate::error::LoadError;
use crate::math::{Rgb, Vec2};
use crate::world::assets::{ColorSpace, TextureFilter, TextureSource, Wrap};
use crate::world::{Assets, Channel, ColorInput, NormalMap, ScalarInput, Texture, TextureId};

/// The textures created up to now, by all their properties. (The search of the asset store compares a texture with
/// every other.)
#[derive(Default)]
pub(super) struct GltfTextures(HashMap<GltfTextureKey, TextureId>);

type GltfTextureKey = (TextureSource, [u8; 4], u32, [u32; 8]);

impl GltfTextures {
    fn id(&mut self, texture: Texture, assets: &mut Assets) -> TextureId {
        let Texture { source, filter, wrap, scale, rotation, offset, uv_set, color_space, factor } = texture;
        let numbers = [scale.x, scale.y, offset.x, offset.y, rotation, factor.r, factor.g, factor.b];
        let names = [filter as u8, wrap[0] as u8, wrap[1] as u8, color_space as u8];
        *self.0.entry((source, names, uv_set, numbers.map(f32::to_bits))).or_insert_with(|| {
            assets.textures.push(texture);
            TextureId(assets.textures.len() as u32 - 1)
        })
    }
}

impl Import<'_> {
    /// A colour; its texture is decoded from sRGB.
    pub(super) fn color(
        &mut self,
        factor: Rgb,
        slot: Option<&TextureInfo>,
        at: &str,
    ) -> Result<ColorInput, LoadError> {
        let Some(texture) = self.lookup(slot, ColorSpace::Srgb, at)? else {
            return Ok(ColorInput::Constant(factor));
        };
        Ok(match factor.is_black() {
            true => ColorInput::Constant(factor),
            false => ColorInput::Texture(self.texture_id(Texture { factor, ..texture })),
        })
    }

    /// A scalar from a channel of a linear texture.
    pub(super) fn scalar(
        &mut self,
        factor: f32,
        slot: Option<&TextureInfo>,
        channel: Channel,
        at: &str,
    ) -> Result<ScalarInput, LoadError> {
        let texture = self.lookup(slot, ColorSpace::Linear, at)?.filter(|_| factor != 0.0);
        let texture = texture.map(|texture| (self.texture_id(texture), channel));
        Ok(ScalarInput { factor, texture })
    }

    /// A normal map.
    pub(super) fn normal_map(
        &mut self,
        slot: Option<&TextureInfo>,
        at: &str,
    ) -> Result<Option<NormalMap>, LoadError> {
        let texture = self.lookup(slot, ColorSpace::Linear, at)?;
        let scale = slot.map_or(1.0, |slot| slot.scale);
        if !scale.is_finite() {
            self.document.mend(format_args!("{at}/scale"), "the number is too large: 1 is taken");
        }
        let scale = if scale.is_finite() { scale } else { 1.0 };
        Ok(texture.map(|texture| NormalMap { texture: self.texture_id(texture), scale }))
    }

    /// Returns the id of a texture, adding it if it is new.
    pub(super) fn texture_id(&mut self, texture: Texture) -> TextureId {
        self.textures.id(texture, self.assets)
    }

    /// The texture of a slot; none if the slot is empty or its image cannot be read.
    pub(super) fn lookup(
        &mut self,
        slot: Option<&TextureInfo>,
        color_space: ColorSpace,
        at: &str,
    ) -> Result<Option<Texture>, LoadError> {
        let Some(slot) = slot else { return Ok(None) };
        let document = self.document;
        let Some(source) = self.source(slot.index, at) else { return Ok(None) };
        let at_texture = format!("/textures/{}", slot.index.value());
        let id = self.images.id(document, source, &at_texture, self.assets, self.warnings)?;
        let Some(image) = id else { return Ok(None) };
        let mut texture = Texture { color_space, uv_set: slot.tex_coord, ..Texture::new(image) };
        self.sample(slot.index, &mut texture);
        let transform: Option<TextureTransform> =
            document.extension(slot.extensions.as_ref(), "KHR_texture_transform", at);
        if let Some(transform) = transform {
            texture.scale = Vec2::from_array(transform.scale);
            texture.offset = Vec2::from_array(transform.offset);
            texture.rotation = transform.rotation;
            texture.uv_set = transform.tex_coord.unwrap_or(texture.uv_set);
        }
        if texture.uv_set > 1 {
            self.losses.other_sets += 1;
            texture.uv_set = 0;
        }
        Ok(Some(texture))
    }

    /// Sets the filter and the wrap modes from the texture's sampler.
    fn sample(&self, index: Index<json::Texture>, texture: &mut Texture) {
        let document = self.document;
        texture.filter = TextureFilter::Trilinear;
        let sampler = document.root.textures.get(index.value()).and_then(|texture| texture.sampler);
        let Some(sampler) = sampler else { return };
        let at = format!("/textures/{}/sampler", index.value());
        let samplers = &document.root.samplers;
        let Some(sampler) = document.find(samplers, sampler, at, "sampler", "a usual one is taken") else {
            return;
        };
        texture.wrap = [wrap(sampler.wrap_s), wrap(sampler.wrap_t)];
        texture.filter = match (sampler.mag_filter, sampler.min_filter) {
            (Some(Checked::Valid(MagFilter::Nearest)), _) => TextureFilter::Nearest,
            (_, Some(Checked::Valid(MinFilter::Nearest | MinFilter::Linear))) => TextureFilter::Bilinear,
            _ => TextureFilter::Trilinear,
        };
    }

    /// The image of a texture; none, with a warning, if only an unsupported extension gives it.
    pub(super) fn source(&self, index: Index<json::Texture>, at: &str) -> Option<Index<json::Image>> {
        let document = self.document;
        // Without a place it is read ahead, and read again when a material uses it.
        let texture = match at {
            "" => document.root.textures.get(index.value())?,
            _ => document.find(&document.root.textures, index, at, "texture", "it is left out")?,
        };
        let at = format!("/textures/{}", index.value());
        let extensions = texture.extensions.as_ref().map(|extensions| &extensions.others);
        let mut others = vec!["EXT_texture_webp"];
        // The crate's number for "no image" is `u32::MAX`. Without the feature `basisu`, the texture's own image is
        // used instead of the one that cannot be decoded.
        let has_own = texture.source.value() != u32::MAX as usize;
        if cfg!(feature = "basisu") || !has_own {
            others.push("KHR_texture_basisu");
        }
        for name in others {
            let other: Option<OtherSource> = document.extension(extensions, name, &at);
            if let Some(source) = other.and_then(|other| other.source) {
                return Some(Index::new(source));
            }
        }
        if !has_own {
            document.mend(at, "it has no image that can be read: it is left out");
            return None;
        }
        Some(texture.source)
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}
