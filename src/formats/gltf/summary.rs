//! The scenes, variants and animations of a file, read from its JSON only.

use std::path::Path;

use gltf::json::{Animation, Root};
use serde::Deserialize;

use super::container::Container;
use super::extensions::variants::Variants;
use crate::error::LoadError;

/// Names to choose by. Items without a name are called by their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSummary {
    /// The names of the scenes.
    pub scenes: Vec<String>,
    /// The names of the material variants.
    pub variants: Vec<String>,
    /// The names of the animations, each with the time of its end in seconds if the file gives it.
    pub animations: Vec<(String, Option<f32>)>,
}

/// Reads the summary of the file at `path`.
pub fn contents(path: &Path) -> Result<ModelSummary, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let root = Container::open(&bytes, path)?.parse(path)?;
    let name = |given: &Option<String>, number: usize| given.clone().unwrap_or_else(|| number.to_string());
    let extensions = root.extensions.as_ref().map(|extensions| &extensions.others);
    let variants = extensions.and_then(|others| others.get("KHR_materials_variants"));
    // Errors in the list are reported when a variant is requested.
    let variants = variants.and_then(|value| Variants::deserialize(value).ok());
    let variants = variants.map_or_else(Vec::new, |read| read.variants);
    let (scenes, animations) = (root.scenes.iter().enumerate(), root.animations.iter().enumerate());
    Ok(ModelSummary {
        scenes: scenes.map(|(number, scene)| name(&scene.name, number)).collect(),
        variants: variants.iter().enumerate().map(|(number, variant)| variant.called(number)).collect(),
        animations: animations
            .map(|(number, animation)| (name(&animation.name, number), end(&root, animation)))
            .collect(),
    })
}

/// The time of an animation's last key.
fn end(root: &Root, animation: &Animation) -> Option<f32> {
    let inputs = animation.samplers.iter().filter_map(|sampler| root.accessors.get(sampler.input.value()));
    let ends = inputs.filter_map(|times| times.max.as_ref()?.get(0)?.as_f64());
    ends.reduce(f64::max).map(|end| end as f32)
}
