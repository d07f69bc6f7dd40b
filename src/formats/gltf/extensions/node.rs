//! `KHR_node_visibility` and `EXT_mesh_gpu_instancing`.

use std::collections::BTreeMap;

use gltf::json::{Accessor, Index};
use serde::Deserialize;

/// Whether a node and its children are shown.
#[derive(Deserialize)]
pub(in super::super) struct Visibility {
    #[serde(default = "shown")]
    pub visible: bool,
}

fn shown() -> bool {
    true
}

/// Transforms at which a node's mesh is shown, relative to the node.
#[derive(Deserialize)]
pub(in super::super) struct Instancing {
    #[serde(default)]
    pub attributes: BTreeMap<String, Index<Accessor>>,
}
