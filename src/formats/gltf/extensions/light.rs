//! `KHR_lights_punctual` and `EXT_lights_image_based`.

use serde::Deserialize;
use serde_json::Value;

use super::number::{all_finite, finite, one, white};

/// `KHR_lights_punctual` of the file.
#[derive(Deserialize)]
pub(in super::super) struct Lights {
    /// Each is a [`GltfLight`].
    pub lights: Vec<Value>,
}

/// `KHR_lights_punctual` of a node.
#[derive(Deserialize)]
pub(in super::super) struct LightOfNode {
    pub light: u32,
}

/// An item of [`Lights`]; the intensity is in candela or, for directional lights, in lux.
#[derive(Deserialize)]
pub(in super::super) struct GltfLight {
    pub name: Option<String>,
    #[serde(default, rename = "type")]
    pub kind: String,
    #[serde(default = "white", deserialize_with = "all_finite")]
    pub color: [f32; 3],
    #[serde(default = "one", deserialize_with = "finite")]
    pub intensity: f32,
    pub spot: Option<GltfSpot>,
}

/// The cone of a [`GltfLight`]: half angles in radians.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(in super::super) struct GltfSpot {
    #[serde(deserialize_with = "finite")]
    pub inner_cone_angle: f32,
    #[serde(deserialize_with = "finite")]
    pub outer_cone_angle: f32,
}

impl Default for GltfSpot {
    fn default() -> Self {
        Self { inner_cone_angle: 0.0, outer_cone_angle: std::f32::consts::FRAC_PI_4 }
    }
}

/// `EXT_lights_image_based` of the file.
#[derive(Deserialize)]
pub(in super::super) struct ImageLights {
    /// Each is an [`ImageLight`].
    pub lights: Vec<Value>,
}

/// `EXT_lights_image_based` of a scene.
#[derive(Deserialize)]
pub(in super::super) struct ImageLightOfScene {
    pub light: u32,
}

/// An item of [`ImageLights`].
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct ImageLight {
    pub name: Option<String>,
    #[serde(default = "unturned", deserialize_with = "all_finite")]
    pub rotation: [f32; 4],
    #[serde(default = "one", deserialize_with = "finite")]
    pub intensity: f32,
    /// Six images for each level: +X, −X, +Y, −Y, +Z, −Z. The first level is not blurred.
    #[serde(default)]
    pub specular_images: Vec<Vec<u32>>,
}

fn unturned() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}
