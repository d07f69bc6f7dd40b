//! Files: what a person or another program wrote, read into a [`World`](crate::world::World),
//! and what we write ourselves.

use std::path::Path;

use crate::error::LoadError;
use crate::world::{Assets, Image, Mesh};

pub mod ron;

/// Reads the files that a scene refers to, whatever their formats are.
pub trait AssetFiles {
    /// Reads a mesh. What it brings along (materials, textures) goes into `assets`, what is
    /// odd but no error into `warnings`.
    fn mesh(
        &mut self,
        path: &Path,
        assets: &mut Assets,
        warnings: &mut Vec<String>,
    ) -> Result<Mesh, LoadError>;

    /// Reads and decodes a picture.
    fn image(&mut self, path: &Path) -> Result<Image, LoadError>;
}
