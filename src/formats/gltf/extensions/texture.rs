//! Texture slots of materials, and the extensions of textures.

use gltf::json::material::NormalTexture;
use gltf::json::texture::Info;
use gltf::json::{self, Index};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::number::{all_finite, finite, one};

/// A texture reference of a material, for any purpose.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct TextureInfo {
    pub index: Index<json::Texture>,
    #[serde(default)]
    pub tex_coord: u32,
    /// Used by normal maps only.
    #[serde(default = "one", deserialize_with = "finite")]
    pub scale: f32,
    pub extensions: Option<Map<String, Value>>,
}

impl From<&Info> for TextureInfo {
    fn from(info: &Info) -> Self {
        let extensions = info.extensions.as_ref().map(|extensions| extensions.others.clone());
        Self { index: info.index, tex_coord: info.tex_coord, scale: 1.0, extensions }
    }
}

impl From<&NormalTexture> for TextureInfo {
    fn from(normal: &NormalTexture) -> Self {
        let extensions = normal.extensions.as_ref().map(|extensions| extensions.others.clone());
        Self { index: normal.index, tex_coord: normal.tex_coord, scale: normal.scale, extensions }
    }
}

/// `KHR_texture_transform`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(in super::super) struct TextureTransform {
    #[serde(deserialize_with = "all_finite")]
    pub offset: [f32; 2],
    #[serde(deserialize_with = "finite")]
    pub rotation: f32,
    #[serde(deserialize_with = "all_finite")]
    pub scale: [f32; 2],
    pub tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

/// `EXT_texture_webp` and `KHR_texture_basisu`: an image used instead of the texture's own.
#[derive(Deserialize)]
pub(in super::super) struct OtherSource {
    pub source: Option<u32>,
}
