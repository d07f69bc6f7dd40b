//! The structures of a scene file, filled by serde. Values stay raw: their type depends on their form (a colour is a
//! tuple, a number or a texture), and `lower` needs their places in the text.

use serde::Deserialize;

use super::source::Raw;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct SceneKeys<'a> {
    pub settings: Option<Raw<'a>>,
    pub materials: Option<Raw<'a>>,
    pub entities: Raw<'a>,
    pub edits: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct NormalMapKeys<'a> {
    pub texture: Raw<'a>,
    pub scale: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct BumpMapKeys<'a> {
    pub texture: Raw<'a>,
    #[serde(alias = "height")]
    pub height_m: Raw<'a>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct TextureKeys<'a> {
    pub image: Raw<'a>,
    pub filter: Option<Raw<'a>>,
    pub wrap: Option<Raw<'a>>,
    pub scale: Option<Raw<'a>>,
    pub rotation_degrees: Option<Raw<'a>>,
    pub offset: Option<Raw<'a>>,
    pub uv_set: Option<Raw<'a>>,
    pub color_space: Option<Raw<'a>>,
    pub channel: Option<Raw<'a>>,
    pub factor: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct Entity<'a> {
    pub name: Option<Raw<'a>>,
    pub parent: Option<Raw<'a>>,
    pub transform: Option<Raw<'a>>,
    pub shape: Option<Raw<'a>>,
    pub gltf: Option<Raw<'a>>,
    pub overrides: Option<Raw<'a>>,
    pub material: Option<Raw<'a>>,
    pub light: Option<Raw<'a>>,
    pub camera: Option<Raw<'a>>,
    pub caustics: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct Trs<'a> {
    pub translate: Option<Raw<'a>>,
    pub rotate_degrees: Option<Raw<'a>>,
    pub rotate_quaternion: Option<Raw<'a>>,
    pub scale: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct LookAt<'a> {
    pub from: Raw<'a>,
    pub to: Raw<'a>,
    pub up: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct Sphere<'a> {
    pub radius_m: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct Triangle<'a> {
    pub vertices: Raw<'a>,
    pub normals: Option<Raw<'a>>,
    pub uvs: Option<Raw<'a>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'a"))]
pub(super) struct Plane<'a> {
    pub corners: Raw<'a>,
}
