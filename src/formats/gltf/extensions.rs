//! The extensions that are read, as serde fills them, and what is said about all others.

use gltf::json::Root;
use serde::de::{Deserialize, Deserializer, Error};

use super::document::Document;
use crate::error::LoadError;

/// Those that are not merely tolerated.
const KNOWN: [&str; 9] = [
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Refuses a file that cannot be read rightly, and names in a warning what it loses.
pub(super) fn check(document: &Document, warnings: &mut Vec<String>) -> Result<(), LoadError> {
    let Root { extensions_required, extensions_used, .. } = &document.root;
    let unknown = list(extensions_required);
    if !unknown.is_empty() {
        return Err(document.error("/extensionsRequired", format!("not supported: {unknown}")));
    }
    let unknown = list(extensions_used);
    if !unknown.is_empty() {
        warnings
            .push(document.warning(format_args!("extensions that are not supported and ignored: {unknown}")));
    }
    Ok(())
}

fn list(names: &[String]) -> String {
    const MOST: usize = 16;
    let mut unknown: Vec<String> = names
        .iter()
        .filter(|name| !KNOWN.contains(&name.as_str()))
        .map(|name| name.chars().take(64).flat_map(char::escape_debug).collect())
        .collect();
    if unknown.len() > MOST {
        unknown.truncate(MOST);
        unknown.push("…".to_owned());
    }
    unknown.join(", ")
}

/// `KHR_texture_transform`.
#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct TextureTransform {
    #[serde(deserialize_with = "finite")]
    pub offset: [f32; 2],
    pub rotation: f32,
    #[serde(deserialize_with = "finite")]
    pub scale: [f32; 2],
    pub tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

/// `EXT_texture_webp`.
#[derive(serde::Deserialize)]
pub(super) struct WebpTexture {
    pub source: Option<u32>,
}

/// `KHR_materials_emissive_strength`.
#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct EmissiveStrength {
    #[serde(default = "one", deserialize_with = "finite_number")]
    pub emissive_strength: f32,
}

/// `KHR_materials_ior`.
#[derive(serde::Deserialize)]
pub(super) struct Ior {
    #[serde(default = "usual_ior", deserialize_with = "finite_number")]
    pub ior: f32,
}

/// `KHR_materials_transmission`.
#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Transmission {
    #[serde(default, deserialize_with = "finite_number")]
    pub transmission_factor: f32,
    pub transmission_texture: Option<serde::de::IgnoredAny>,
}

/// `KHR_materials_volume`, of which only the thickness counts.
#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Volume {
    #[serde(default, deserialize_with = "finite_number")]
    pub thickness_factor: f32,
}

/// `KHR_materials_unlit`.
#[derive(serde::Deserialize)]
pub(super) struct Unlit {}

/// `KHR_lights_punctual` of the file.
#[derive(serde::Deserialize)]
pub(super) struct Lights {
    pub lights: Vec<Light>,
}

/// `KHR_lights_punctual` of a node.
#[derive(serde::Deserialize)]
pub(super) struct LightOfNode {
    pub light: usize,
}

/// One of [`Lights`]; in candela or, if directional, lux.
#[derive(serde::Deserialize)]
pub(super) struct Light {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default = "white", deserialize_with = "finite")]
    pub color: [f32; 3],
    #[serde(default = "one", deserialize_with = "finite_number")]
    pub intensity: f32,
    pub spot: Option<Spot>,
}

/// The cone of a [`Light`]: half angles in radians.
#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Spot {
    #[serde(default, deserialize_with = "finite_number")]
    pub inner_cone_angle: f32,
    #[serde(default = "usual_cone", deserialize_with = "finite_number")]
    pub outer_cone_angle: f32,
}

fn one() -> f32 {
    1.0
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

pub(super) fn usual_ior() -> f32 {
    1.5
}

fn usual_cone() -> f32 {
    std::f32::consts::FRAC_PI_4
}

fn finite_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let number = f32::deserialize(deserializer)?;
    if number.is_finite() { Ok(number) } else { Err(D::Error::custom("a number is too large")) }
}

fn finite<'de, D: Deserializer<'de>, const N: usize>(deserializer: D) -> Result<[f32; N], D::Error>
where
    [f32; N]: Deserialize<'de>,
{
    let numbers = <[f32; N]>::deserialize(deserializer)?;
    if numbers.iter().all(|number| number.is_finite()) {
        Ok(numbers)
    } else {
        Err(D::Error::custom("a number is too large"))
    }
}
