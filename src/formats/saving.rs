//! What a program that renders by itself saves.

use std::path::Path;

use super::picture::{self, Output, PngBits};
use super::{film_file, ron};
use crate::error::{LoadError, SaveError};
use crate::film::exposure::exposure_ev;
use crate::film::tonemap::DisplayTransform;
use crate::film::{Channel, Film};
use crate::world::{Image, Settings, World};

/// Writes an image as what the name's extension says: `.png` (exposed and tone mapped as the settings say, sRGB),
/// `.exr` or `.hdr` (linear radiance). OpenEXR files get `layers`, too, which [`crate::render::Session::channels`]
/// makes. The file appears when it is whole; until then an older one stays as it was.
///
/// Errors: another extension; a folder that is not there; a full disk.
pub fn save_image(
    path: impl AsRef<Path>,
    film: &Film,
    settings: &Settings,
    layers: &[Channel],
) -> Result<(), SaveError> {
    with_output(film, settings, |output| {
        picture::save(path.as_ref(), &Output { channels: layers, ..*output })
    })
}

/// The bytes of a PNG, as [`save_image`] would write it: to show an image, or to send it somewhere.
pub fn png_bytes(film: &Film, settings: &Settings) -> Result<Vec<u8>, SaveError> {
    with_output(film, settings, picture::png_bytes)
}

fn with_output<T>(film: &Film, settings: &Settings, write: impl FnOnce(&Output) -> T) -> T {
    let radiance = film.radiance();
    let region = film.region();
    let metadata = [
        ("Software".to_string(), film_file::PROGRAM.to_string()),
        ("film_hash".to_string(), format!("{:032x}", film.hash())),
    ];
    write(&Output {
        width: region.width(),
        height: region.height(),
        radiance: &radiance,
        display: DisplayTransform::new(settings.tonemap, exposure_ev(settings, &radiance), &radiance),
        bits: PngBits::Eight,
        metadata: &metadata,
        channels: &[],
    })
}

/// Writes a world as a scene file (`.ron`). Paths of its meshes and images become relative to the file's folder.
///
/// Errors: what no scene file can say, such as a mesh that came from no file; a full disk.
pub fn save_scene(path: impl AsRef<Path>, world: &World) -> Result<(), SaveError> {
    ron::save(world, path.as_ref())
}

/// Reads a picture to be used as a texture: PNG, JPEG, TGA, BMP, WebP, Radiance HDR or OpenEXR.
///
/// Errors: no such file; what is no picture; what is too large for the memory.
pub fn load_image(path: impl AsRef<Path>) -> Result<Image, LoadError> {
    let path = path.as_ref();
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    Ok(Image { source: Some(path.to_owned()), ..picture::decode(&bytes, path)? })
}
