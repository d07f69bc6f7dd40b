//! `KHR_materials_variants`.

use serde::Deserialize;

/// `KHR_materials_variants` of the file.
#[derive(Deserialize)]
pub(in super::super) struct Variants {
    pub variants: Vec<GltfVariant>,
}

/// An item of [`Variants`].
#[derive(Deserialize)]
pub(in super::super) struct GltfVariant {
    #[serde(default)]
    name: String,
}

impl GltfVariant {
    /// The variant's name, or its number if it has none.
    pub fn called(&self, number: usize) -> String {
        if self.name.is_empty() { number.to_string() } else { self.name.clone() }
    }
}

/// `KHR_materials_variants` of a primitive.
#[derive(Deserialize)]
pub(in super::super) struct Mappings {
    #[serde(default)]
    pub mappings: Vec<Mapping>,
}

/// A material, and the variants for which the primitive uses it.
#[derive(Deserialize)]
pub(in super::super) struct Mapping {
    pub material: u32,
    #[serde(default)]
    pub variants: Vec<usize>,
}
