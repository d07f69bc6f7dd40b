//! The recipe of a rendering: all that must be asked for to have it again.

use std::path::PathBuf;

use crate::formats::LoadOptions;
use crate::world::Settings;

/// A scene's file, how it is read, and how it is rendered.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// The scene's file.
    pub path: PathBuf,
    /// How the file is read.
    pub options: LoadOptions,
    /// The camera's name, if not the first.
    pub camera: Option<String>,
    /// The settings of the file, as the options change them.
    pub authored: Settings,
    /// The settings in force.
    pub settings: Settings,
    /// True if a hand has moved the camera to where no option can put it.
    pub is_moved: bool,
}
