//! `KHR_materials_variants`.

use serde::Deserialize;

use crate::formats::gltf::choice::Choice;

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

/// The variants of a file, as they are chosen by name or number.
pub(in super::super) fn choice(variants: &[GltfVariant]) -> Choice {
    Choice::of("variant", variants.iter().map(|variant| Some(&variant.name[..])))
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
