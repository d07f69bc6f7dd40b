//! `KHR_draco_mesh_compression`.

use std::collections::BTreeMap;

use gltf::json::Index;
use gltf::json::buffer::View;
use serde::Deserialize;

/// `KHR_draco_mesh_compression` of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct DracoPrimitive {
    pub buffer_view: Index<View>,
    /// The ids of attributes by their names.
    pub attributes: BTreeMap<String, u32>,
}
