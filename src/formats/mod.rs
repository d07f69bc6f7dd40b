//! Files: reads scenes, models, meshes and images into a [`World`](crate::world::World), and writes images and scenes.
//! No other module depends on file formats.

pub(crate) mod asset_files;
mod colors;
pub(crate) mod elsewhere;
pub(crate) mod film_file;
pub(crate) mod gltf;
pub(crate) mod load_options;
mod mended;
mod names;
pub(crate) mod obj;
pub(crate) mod picture;
pub(crate) mod ply;
pub(crate) mod rays;
mod references;
pub(crate) mod ron;
mod saving;
pub(crate) mod staging;
pub(crate) mod stl;
mod strands;
pub(crate) mod study;
mod track;
mod vertex_colors;

use std::io::{self, Read};
use std::path::Path;

pub use crate::files::allow_outside;
pub(crate) use asset_files::{AssetFiles, Files};
pub use load_options::{Edits, EnvironmentPreset, Floor, LightUnits, LoadOptions, SkyOptions, UpAxis};
pub use picture::PngBits;
pub(crate) use saving::{DENOISED, exr_bytes};
pub use saving::{ImageOptions, load_image, png_bytes, rgba8, save_image, save_image_with, save_scene};
#[cfg(feature = "python")]
pub(crate) use staging::has_added_camera;
pub(crate) use staging::load_again;
pub use staging::{load, load_with};

/// The extensions of files of a mesh.
const MESHES: [&str; 3] = ["ply", "obj", "stl"];

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Reads until the buffer is full or nothing is left; returns the number of bytes read.
fn fill(from: &mut dyn Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match from.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
