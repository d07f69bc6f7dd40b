//! `KHR_materials_variants`.

use serde::Deserialize;

/// Of the file.
#[derive(Deserialize)]
pub(in super::super) struct Variants {
    pub variants: Vec<GltfVariant>,
}

/// One of [`Variants`].
#[derive(Deserialize)]
pub(in super::super) struct GltfVariant {
    #[serde(default)]
    name: String,
}

impl GltfVariant {
    /// Its name, or its number if it has none.
    pub fn called(&self, number: usize) -> String {
        if self.name.is_empty() { number.to_string() } else { self.name.clone() }
    }
}

/// Of a primitive.
#[derive(Deserialize)]
pub(in super::super) struct Mappings {
    #[serde(default)]
    pub mappings: Vec<Mapping>,
}

/// A material, and the variants under which it is the primitive's.
#[derive(Deserialize)]
pub(in super::super) struct Mapping {
    pub material: u32,
    #[serde(default)]
    pub variants: Vec<usize>,
}
