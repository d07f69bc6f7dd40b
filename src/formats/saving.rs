//! Saves images and scenes, and reads images.

use std::path::Path;

use super::picture::{self, CropWindow, ImageEncoding, ImagePixels, Opacity, Output, PngBits};
use super::{film_file, ron};
use crate::denoise::Denoised;
use crate::error::{LoadError, SaveError};
use crate::film::exposure::exposure_ev;
use crate::film::tonemap::DisplayTransform;
use crate::film::{Film, FilmChannel};
use crate::world::{Image, Settings, World};

/// The name under which a denoised image stores its hash.
pub(crate) const DENOISED: &str = "denoised_hash";

/// Options for saving an image. The default saves only the film, with 8 bits in PNG files.
#[derive(Clone, Copy, Default)]
pub struct ImageOptions<'a> {
    /// Layers besides radiance, as returned by [`crate::render::Session::channels`]: one value for each pixel of the
    /// film's region, row by row from the top. Only OpenEXR files hold them.
    pub layers: &'a [FilmChannel],
    /// Bits per channel of PNG files.
    pub bits: PngBits,
    /// A denoised image (see [`crate::render::Session::denoised`]) that is saved in place of the film's pixels, with
    /// their exposure.
    pub denoised: Option<&'a Denoised>,
}

/// Writes an image in the format given by the extension of `path`: `.png`, `.jpg` or `.webp` (8-bit sRGB, exposed and tone
/// mapped by the settings), `.exr` (32-bit floats) or `.hdr` (8-bit mantissas with a shared exponent). The latter two hold unchanged
/// radiance in W m⁻² sr⁻¹, linear with the primaries of Rec. 709. The file appears when it is complete; until then an
/// older one stays as it was.
///
/// Errors: another extension; a film without pixels; a folder that does not exist; a full disk.
pub fn save_image(path: impl AsRef<Path>, film: &Film, settings: &Settings) -> Result<(), SaveError> {
    save_image_with(path, film, settings, &ImageOptions::default())
}

/// [`save_image`] with layers, with 16 bits, or denoised.
///
/// Errors: those of [`save_image`]; a number of layer values or denoised pixels that differs from the film's.
pub fn save_image_with(
    path: impl AsRef<Path>,
    film: &Film,
    settings: &Settings,
    options: &ImageOptions,
) -> Result<(), SaveError> {
    let path = path.as_ref();
    with_output(path, (film, settings, options), |output| picture::save(path, output))
}

/// The bytes of a PNG file, as [`save_image_with`] would write it: to show an image, or to send it somewhere.
///
/// Errors: a film without pixels; a number of denoised pixels that differs from the film's.
pub fn png_bytes(film: &Film, settings: &Settings, options: &ImageOptions) -> Result<Vec<u8>, SaveError> {
    with_output(Path::new("PNG"), (film, settings, options), picture::png_bytes)
}

/// The bytes of an OpenEXR file, as [`save_image_with`] would write it.
///
/// Errors: a film without pixels.
pub(crate) fn exr_bytes(
    film: &Film,
    settings: &Settings,
    options: &ImageOptions,
) -> Result<Vec<u8>, SaveError> {
    let path = Path::new("OpenEXR");
    with_output(path, (film, settings, options), |output| {
        let mut bytes = Vec::new();
        let done = picture::encode(&mut bytes, ImageEncoding::OpenExr, output);
        done.map(|()| bytes).map_err(|error| SaveError::new(path, error))
    })
}

/// The pixels for a screen: sRGB red, green and blue, and an alpha, which is 255 unless the image is
/// [`Settings::transparent`], one for each pixel of the film's region, row by row from the top. The colours are those of
/// an 8-bit PNG; layers and bits have no effect. Missing denoised pixels are black.
///
/// Errors: a [`Settings::backplate`] that cannot be read.
pub fn rgba8(film: &Film, settings: &Settings, options: &ImageOptions) -> Result<Vec<[u8; 4]>, SaveError> {
    with_output(Path::new("pixels"), (film, settings, options), |output| {
        let shown = output.shown_8_bit();
        let mut pixels: Vec<[u8; 4]> = match output.opacity() {
            Opacity::Stored => shown.as_chunks().0.to_vec(),
            _ => shown.as_chunks().0.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect(),
        };
        pixels.resize(film.region().area(), [0, 0, 0, 255]);
        Ok(pixels)
    })
}

/// Calls `write` with the pixels of an image, which messages call `path`.
fn with_output<T>(
    path: &Path,
    (film, settings, options): (&Film, &Settings, &ImageOptions),
    write: impl FnOnce(&Output) -> Result<T, SaveError>,
) -> Result<T, SaveError> {
    let &ImageOptions { layers, bits, denoised } = options;
    let plate = picture::backplate(settings, film.region()).map_err(|error| SaveError::new(path, error))?;
    let pixels = ImagePixels::new(film, plate.as_deref(), denoised);
    let region = film.region();
    let mut metadata = vec![
        ("Software".to_string(), film_file::PROGRAM.to_string()),
        ("film_hash".to_string(), format!("{:032x}", film.hash())),
    ];
    metadata.extend(denoised.map(|denoised| (DENOISED.to_string(), format!("{:032x}", denoised.hash()))));
    write(&Output {
        width: region.width(),
        height: region.height(),
        window: CropWindow::of(region, settings.size),
        radiance: &pixels.radiance,
        alpha: pixels.alpha.as_deref(),
        transparency: pixels.transparency.as_deref(),
        behind: pixels.behind.as_deref(),
        display: DisplayTransform::new(settings.tonemap, exposure_ev(settings, film), &pixels.own_colors()),
        bits,
        metadata: &metadata,
        channels: layers,
    })
}

/// Writes a world as a scene file (`.ron`), which reads back as the same world. Paths of meshes and images become
/// relative to the file's folder. The contents of a glTF file are written as a reference to that file. The scene file
/// appears when it is complete; until then an older one stays as it was.
///
/// Errors: a world that no scene file can hold (meshes and images that came from no file, two entities of one name,
/// infinity and NaN, parts of a glTF file that were changed); a folder that does not exist; a full disk.
pub fn save_scene(path: impl AsRef<Path>, world: &World) -> Result<(), SaveError> {
    ron::save(world, path.as_ref())
}

/// Reads an image for use as a texture: PNG, JPEG, TGA, BMP, WebP, Radiance HDR, OpenEXR, or a photometric profile
/// (IES). The content determines the format; the extension counts only where the content does not. In formats with
/// floats, NaN and negative values become 0, infinite ones the largest finite one or 65,504, and values above 10⁹ become
/// 10⁹.
///
/// Errors: a file that cannot be opened ([`LoadError::Io`]); one that is no such image, or damaged
/// ([`LoadError::Invalid`]); more than 65,536 pixels along a side, more than 2 GiB when decoded, or more than memory
/// allows ([`LoadError::TooLarge`]).
pub fn load_image(path: impl AsRef<Path>) -> Result<Image, LoadError> {
    let path = path.as_ref();
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    Ok(Image { source: Some(path.to_owned()), ..picture::decode(&bytes, path)?.0 })
}
