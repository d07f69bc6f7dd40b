//! Files: what a person or another program wrote, read into a [`World`](crate::world::World), and what we
//! write ourselves. The only place that knows file formats.

pub(crate) mod asset_files;
mod edits;
mod extent;
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
mod shot;
mod studio;
pub(crate) mod study;
pub(crate) mod surroundings;
mod track;
pub(crate) mod triangulate;

use std::io::{self, Read};
use std::path::Path;

pub(crate) use asset_files::{AssetFiles, Files};
pub use edits::Edits;
pub(crate) use load::load_again;
pub use load::{LightUnits, LoadOptions, load, load_with};
pub use saving::{load_image, png_bytes, save_image, save_scene};
pub use surroundings::{Sky, Surroundings};

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Reads until the buffer is full or there is no more; says how many bytes there were.
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
