//! The extensions of materials. [`Principled`](crate::world::Principled) documents their meaning.

use serde::Deserialize;

use super::number::{all_finite, finite, one, white};
use super::texture::TextureInfo;

/// `KHR_materials_emissive_strength`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct EmissiveStrength {
    #[serde(default = "one", deserialize_with = "finite")]
    pub emissive_strength: f32,
}

/// `KHR_materials_ior`.
#[derive(Deserialize)]
pub(in super::super) struct Ior {
    #[serde(default = "usual_ior", deserialize_with = "finite")]
    pub ior: f32,
}

fn usual_ior() -> f32 {
    1.5
}

/// `KHR_materials_transmission`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct Transmission {
    #[serde(default, deserialize_with = "finite")]
    pub transmission_factor: f32,
    pub transmission_texture: Option<TextureInfo>,
}

/// `KHR_materials_volume`. The thickness is used for open surfaces only; in closed ones rays measure it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct GltfVolume {
    #[serde(default, deserialize_with = "finite")]
    pub thickness_factor: f32,
    /// May be infinite.
    #[serde(default = "infinite")]
    pub attenuation_distance: f32,
    #[serde(default = "white", deserialize_with = "all_finite")]
    pub attenuation_color: [f32; 3],
}

/// `KHR_materials_volume_scatter`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct VolumeScatter {
    #[serde(default, deserialize_with = "all_finite")]
    pub multiscatter_color: [f32; 3],
    #[serde(default, deserialize_with = "finite")]
    pub scatter_anisotropy: f32,
}

fn infinite() -> f32 {
    f32::INFINITY
}

/// `KHR_materials_dispersion`.
#[derive(Deserialize)]
pub(in super::super) struct Dispersion {
    #[serde(default, deserialize_with = "finite")]
    pub dispersion: f32,
}

/// `KHR_materials_specular`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct Specular {
    #[serde(default = "one", deserialize_with = "finite")]
    pub specular_factor: f32,
    pub specular_texture: Option<TextureInfo>,
    #[serde(default = "white", deserialize_with = "all_finite")]
    pub specular_color_factor: [f32; 3],
    pub specular_color_texture: Option<TextureInfo>,
}

/// `KHR_materials_clearcoat`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct Clearcoat {
    #[serde(default, deserialize_with = "finite")]
    pub clearcoat_factor: f32,
    pub clearcoat_texture: Option<TextureInfo>,
    #[serde(default, deserialize_with = "finite")]
    pub clearcoat_roughness_factor: f32,
    pub clearcoat_roughness_texture: Option<TextureInfo>,
    pub clearcoat_normal_texture: Option<TextureInfo>,
}

/// `KHR_materials_sheen`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct GltfSheen {
    #[serde(default, deserialize_with = "all_finite")]
    pub sheen_color_factor: [f32; 3],
    pub sheen_color_texture: Option<TextureInfo>,
    #[serde(default, deserialize_with = "finite")]
    pub sheen_roughness_factor: f32,
    pub sheen_roughness_texture: Option<TextureInfo>,
}

/// `KHR_materials_anisotropy`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct GltfAnisotropy {
    #[serde(default, deserialize_with = "finite")]
    pub anisotropy_strength: f32,
    #[serde(default, deserialize_with = "finite")]
    pub anisotropy_rotation: f32,
    pub anisotropy_texture: Option<TextureInfo>,
}

/// `KHR_materials_iridescence`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct GltfIridescence {
    #[serde(default, deserialize_with = "finite")]
    pub iridescence_factor: f32,
    pub iridescence_texture: Option<TextureInfo>,
    #[serde(default = "film_ior", deserialize_with = "finite")]
    pub iridescence_ior: f32,
    #[serde(default = "thinnest", deserialize_with = "finite")]
    pub iridescence_thickness_minimum: f32,
    #[serde(default = "thickest", deserialize_with = "finite")]
    pub iridescence_thickness_maximum: f32,
    pub iridescence_thickness_texture: Option<TextureInfo>,
}

fn film_ior() -> f32 {
    1.3
}

fn thinnest() -> f32 {
    100.0
}

fn thickest() -> f32 {
    400.0
}

/// `KHR_materials_diffuse_transmission`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct DiffuseTransmission {
    #[serde(default, deserialize_with = "finite")]
    pub diffuse_transmission_factor: f32,
    pub diffuse_transmission_texture: Option<TextureInfo>,
    #[serde(default = "white", deserialize_with = "all_finite")]
    pub diffuse_transmission_color_factor: [f32; 3],
    pub diffuse_transmission_color_texture: Option<TextureInfo>,
}

/// `KHR_materials_pbrSpecularGlossiness`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct SpecularGlossiness {
    #[serde(default = "opaque_white", deserialize_with = "all_finite")]
    pub diffuse_factor: [f32; 4],
    pub diffuse_texture: Option<TextureInfo>,
    #[serde(default = "white", deserialize_with = "all_finite")]
    pub specular_factor: [f32; 3],
    #[serde(default = "one", deserialize_with = "finite")]
    pub glossiness_factor: f32,
    pub specular_glossiness_texture: Option<TextureInfo>,
}

fn opaque_white() -> [f32; 4] {
    [1.0; 4]
}

/// `KHR_materials_unlit`.
#[derive(Deserialize)]
pub(in super::super) struct Unlit {}
