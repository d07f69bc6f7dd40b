//! Scene files in [RON](https://github.com/ron-rs/ron): a list of entities whose keys are their components. [`load`]
//! reads them, [`save`] writes them.
//!
//! `ron` checks that the text is well formed (`source`), and one pass finds the spans of all values (`tree`). Values stay
//! slices of the text until they are converted to components one by one (`value`, `lower`), so that every error has the
//! line and column of its value.

mod color;
mod edit;
mod keyframes;
mod lower;
pub mod query;
mod scan;
mod source;
#[cfg(test)]
pub(super) mod tests;
mod tree;
mod value;
mod write;

use std::path::Path;

use serde::de::DeserializeOwned;

pub use self::edit::with_keys;
use self::source::SceneText;
pub use self::write::{Portrait, WrittenPart, camera, look_at, portrait, save, write};
use super::AssetFiles;
use crate::error::LoadError;
use crate::memory;
use crate::world::World;

/// The memory that reading takes for each byte of text, in bytes.
const BYTES_OF_TEXT: u64 = 32;

/// Reads the scene file at `path` and, through `files`, the meshes and images that it names.
pub fn load(path: &Path, files: &mut dyn AssetFiles) -> Result<World, LoadError> {
    let bytes = files.read(path)?;
    if u32::try_from(bytes.len()).is_err() {
        return Err(LoadError::too_large(path, "a scene file must be smaller than 4 GiB"));
    }
    let _claim = memory::reserve("what it says", BYTES_OF_TEXT * bytes.len() as u64)
        .map_err(LoadError::shortage(path))?;
    match std::str::from_utf8(&bytes) {
        Ok(text) => parse(text, path, files),
        Err(error) => {
            let valid = bytes.get(..error.valid_up_to()).unwrap_or_default();
            let text = String::from_utf8_lossy(valid);
            let (line, column) = scan::position(&text, text.len());
            let reason = "this is not UTF-8: save the file in that encoding".to_owned();
            Err(LoadError::At { file: path.to_owned(), line, column, reason })
        }
    }
}

/// Reads a value of another kind of file from its text, with the messages of scene files.
pub fn value<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T, LoadError> {
    let source = SceneText::new(text.strip_prefix('\u{feff}').unwrap_or(text), path, 0.0);
    source.root()?;
    source.whole_value()
}

/// Reads a scene from its text. `path` is its path in messages, and the files that it names are relative to its folder.
pub fn parse(text: &str, path: &Path, files: &mut dyn AssetFiles) -> Result<World, LoadError> {
    // Skips a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    lower::scene(&SceneText::new(text, path, files.time_s().unwrap_or(0.0)), files)
}
