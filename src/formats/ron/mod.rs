//! Scene files in [RON](https://github.com/ron-rs/ron): a list of entities whose keys are their components. [`load`]
//! reads them, [`save`] writes them.
//!
//! One pass checks that a text of the usual kind is well formed and finds the spans of all values (`plain`, `tree`);
//! `ron` checks all others, and its errors are reported (`source`). Values stay slices of the text until they are
//! converted to components one by one (`value`, `lower`), so that every error has the line and column of its value. The
//! files that a scene includes are texts like its own (`parts`); a variable is replaced by the slice of its value
//! (`variables`).

mod color;
mod edit;
mod keyframes;
mod lower;
mod parts;
mod plain;
pub mod query;
mod scan;
mod slips;
mod source;
#[cfg(test)]
pub(super) mod tests;
mod tree;
mod value;
mod variables;
mod write;

use std::path::Path;

use serde::de::DeserializeOwned;

pub use self::edit::with_keys;
use self::parts::{BYTES_OF_TEXT, TextPart, text_of};
pub use self::query::{assignment, transform_parts, with_statements};
use self::source::SceneText;
pub use self::write::{Portrait, ValueWriter, WrittenPart, camera, look_at, portrait, save, write};
use super::AssetFiles;
use crate::error::LoadError;
use crate::memory;
use crate::world::World;

/// Reads the scene file at `path` and, through `files`, the scene files, meshes and images that it names.
pub fn load(path: &Path, files: &mut dyn AssetFiles) -> Result<World, LoadError> {
    let text = text_of(path, files)?;
    let _claim = memory::reserve("what it says", BYTES_OF_TEXT * text.len() as u64)
        .map_err(LoadError::shortage(path))?;
    parse(&text, path, files)
}

/// Reads a value of another kind of file from its text, with the messages of scene files.
pub fn value<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T, LoadError> {
    let part = TextPart::new(text.strip_prefix('\u{feff}').unwrap_or(text), path);
    let source = SceneText::new(std::slice::from_ref(&part), 0.0);
    source.root()?;
    source.whole_value()
}

/// Reads a scene from its text. `path` is its path in messages, and the files that it names are relative to its folder.
pub fn parse(text: &str, path: &Path, files: &mut dyn AssetFiles) -> Result<World, LoadError> {
    // Skips a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let parts = parts::gather(text, path, files)?;
    lower::scene(&SceneText::new(&parts, files.time_s().unwrap_or(0.0)), files)
}
