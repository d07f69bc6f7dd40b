//! The recipe of a rendering: everything needed to repeat it.

use std::path::PathBuf;

use crate::formats::LoadOptions;
use crate::world::Settings;

/// A scene's file, how to read it, and the settings to render it with.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// The scene's file.
    pub path: PathBuf,
    /// The options to read the file with.
    pub options: LoadOptions,
    /// The name of the camera; none for the first one.
    pub camera: Option<String>,
    /// The settings of the file with the options applied.
    pub authored: Settings,
    /// The settings in use.
    pub settings: Settings,
    /// True if the camera was moved interactively to where no option can place it.
    pub is_moved: bool,
}
