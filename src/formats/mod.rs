//! Files: reads scenes, models, meshes and images into a [`World`](crate::world::World), and writes images and scenes.
//! No other module depends on file formats.

pub(crate) mod asset_files;
mod auto_camera;
mod bounding_points;
mod edits;
pub(crate) mod environment_preset;
pub(crate) mod film_file;
mod framing;
pub(crate) mod gltf;
pub(crate) mod load;
mod names;
pub(crate) mod obj;
pub(crate) mod picture;
pub(crate) mod ply;
pub(crate) mod rays;
pub(crate) mod ron;
mod saving;
mod studio;
pub(crate) mod study;
mod track;
pub(crate) mod triangulate;

use std::io::{self, Read};
use std::path::Path;

pub use crate::files::allow_outside;
pub(crate) use asset_files::{AssetFiles, Files};
#[cfg(feature = "python")]
pub(crate) use auto_camera::has_added_camera;
pub use edits::Edits;
pub use environment_preset::{EnvironmentPreset, SkyOptions};
pub(crate) use framing::is_usual;
pub(crate) use load::load_again;
pub use load::{LightUnits, LoadOptions, load, load_with};
pub use picture::PngBits;
pub(crate) use saving::DENOISED;
pub use saving::{ImageOptions, load_image, png_bytes, rgba8, save_image, save_image_with, save_scene};

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
