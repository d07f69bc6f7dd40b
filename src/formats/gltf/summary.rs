//! The scenes, variants and animations of a file.

use std::path::Path;

use serde::Deserialize;

use super::animation;
use super::document::Document;
use super::extensions::variants::{self, Variants};
use super::node;
use crate::error::LoadError;
use crate::world::SourceFiles;

/// Names to choose by. Items without a name are called by their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSummary {
    /// The names of the scenes.
    pub scenes: Vec<String>,
    /// The names of the material variants.
    pub variants: Vec<String>,
    /// The names of the animations, each with the time of its end in seconds if it has any keys.
    pub animations: Vec<(String, Option<f32>)>,
}

/// Reads the summary of the file at `path`; `sources` are the files that it may refer to.
pub fn contents(path: &Path, sources: &SourceFiles) -> Result<ModelSummary, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let document = Document::open(&bytes, path, sources)?;
    let root = &document.root;
    let extensions = root.extensions.as_ref().map(|extensions| &extensions.others);
    let variants = extensions.and_then(|others| others.get("KHR_materials_variants"));
    // Errors in the list are reported when a variant is requested.
    let variants = variants.and_then(|value| Variants::deserialize(value).ok());
    let variants = variants.map_or_else(Vec::new, |read| read.variants);
    let ends = root.animations.iter().map(|clip| animation::end(&document, clip));
    Ok(ModelSummary {
        scenes: node::choice(root).all(),
        variants: variants::choice(&variants).all(),
        animations: animation::choice(root).all().into_iter().zip(ends).collect(),
    })
}
