//! What a file offers to choose from, judged by its JSON alone.

use std::path::Path;

use gltf::json::{Animation, Root};
use serde::Deserialize;

use super::container::Container;
use super::extensions::variants::Variants;
use crate::error::LoadError;

/// Names to choose by. What has no name is called by its number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSummary {
    /// Of scenes.
    pub scenes: Vec<String>,
    /// Of variants of materials.
    pub variants: Vec<String>,
    /// Names of animations, each with the second at which it ends if the file says so.
    pub animations: Vec<(String, Option<f32>)>,
}

/// Looks into the file at `path`.
pub fn contents(path: &Path) -> Result<ModelSummary, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let root = Container::open(&bytes, path)?.parse(path)?;
    let name = |given: &Option<String>, number: usize| given.clone().unwrap_or_else(|| number.to_string());
    let extensions = root.extensions.as_ref().map(|extensions| &extensions.others);
    let variants = extensions.and_then(|others| others.get("KHR_materials_variants"));
    // Faults in the list are reported when a variant is asked for.
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
