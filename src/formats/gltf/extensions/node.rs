//! `KHR_node_visibility` and `EXT_mesh_gpu_instancing`.

use std::collections::BTreeMap;

use gltf::json::{Accessor, Index};
use serde::Deserialize;

/// `KHR_node_visibility`: the visibility of a node and its descendants.
#[derive(Deserialize)]
pub(in super::super) struct Visibility {
    #[serde(default = "shown")]
    pub visible: bool,
}

fn shown() -> bool {
    true
}

/// `EXT_mesh_gpu_instancing`: the transforms of a node's instances, relative to the node.
#[derive(Deserialize)]
pub(in super::super) struct Instancing {
    #[serde(default)]
    pub attributes: BTreeMap<String, Index<Accessor>>,
}
