//! The supported extensions, deserialised by serde, and checks for all others.

#[cfg(feature = "draco")]
pub(super) mod draco;
pub(super) mod light;
pub(super) mod material;
pub(super) mod node;
mod number;
pub(super) mod texture;
pub(super) mod variants;

use gltf::json::Root;

use super::document::Document;
use crate::error::{Diagnostic, LoadError, words};

/// The extensions that every build supports; [`is_known`] adds those that depend on features.
const KNOWN: [&str; 27] = [
    "EXT_lights_image_based", "EXT_mesh_gpu_instancing", "EXT_meshopt_compression", "EXT_texture_webp",
    "KHR_lights_punctual", "KHR_materials_anisotropy", "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission", "KHR_materials_dispersion", "KHR_materials_emissive_strength",
    "KHR_materials_ior", "KHR_materials_iridescence", "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen", "KHR_materials_specular", "KHR_materials_transmission", "KHR_materials_unlit",
    "KHR_materials_variants", "KHR_materials_volume", "KHR_materials_volume_scatter",
    "KHR_mesh_quantization", "KHR_meshopt_compression",
    // These have no effect on an image.
    "KHR_node_hoverability", "KHR_node_selectability", "KHR_node_visibility", "KHR_texture_transform",
    // Metadata about the file.
    "KHR_xmp_json_ld",
];

/// Refuses a file that cannot be read correctly, and warns about extensions that are ignored.
pub(super) fn check(document: &Document, warnings: &mut Vec<Diagnostic>) -> Result<(), LoadError> {
    let Root { extensions_required, extensions_used, .. } = &document.root;
    let unknown = list(extensions_required);
    if !unknown.is_empty() {
        let lacks = |feature: &str, extension: &str, has: bool| {
            let is_missing = !has && extensions_required.iter().any(|name| name == extension);
            let remedy = format!(
                " ({extension} comes with the feature {feature}: cargo install with --features {feature})"
            );
            is_missing.then_some(remedy)
        };
        let basisu = lacks("basisu", "KHR_texture_basisu", cfg!(feature = "basisu"));
        let draco = lacks("draco", "KHR_draco_mesh_compression", cfg!(feature = "draco"));
        let hint = [basisu, draco].into_iter().flatten().collect::<String>();
        return Err(document.error("/extensionsRequired", format!("not supported: {unknown}{hint}")));
    }
    let unknown = list(extensions_used);
    if !unknown.is_empty() {
        warnings
            .push(document.warning(format_args!("extensions that are not supported and ignored: {unknown}")));
    }
    Ok(())
}

fn is_known(name: &str) -> bool {
    match name {
        "KHR_draco_mesh_compression" => cfg!(feature = "draco"),
        "KHR_texture_basisu" => cfg!(feature = "basisu"),
        _ => KNOWN.contains(&name),
    }
}

fn list(names: &[String]) -> String {
    const MOST: usize = 16;
    let mut unknown: Vec<String> =
        names.iter().filter(|name| !is_known(name)).map(|name| words(name)).collect();
    if unknown.len() > MOST {
        unknown.truncate(MOST);
        unknown.push("…".to_owned());
    }
    unknown.join(", ")
}
