//! Saving of rendered images: selects the encoder, and writes a file completely or not at all.

use std::io::{self, Write};
use std::path::Path;

use super::{decode_data, encode_eight_bit, encode_openexr, encode_png, encode_radiance};
use crate::error::{LoadError, SaveError};
use crate::files::atomic_write::{writable, write_whole};
use crate::film::alpha::{Transparency, unassociated};
use crate::film::tonemap::{DisplayTransform, encode_8_bit, encode_16_bit, quantise_8_bit, quantise_16_bit};
use crate::film::{FilmChannel, Region};
use crate::math::Rgb;
use crate::world::{Image, Settings};

/// Bits per channel of a PNG file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PngBits {
    /// The depth for display, supported by every viewer.
    #[default]
    Eight,
    /// The depth for further processing, without visible steps.
    Sixteen,
}

/// A rendered image to be written to a file.
#[derive(Clone, Copy, Debug)]
pub struct Output<'a> {
    /// Pixels per row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// The place in a larger image, of which these pixels are a part. Only OpenEXR files hold it.
    pub window: Option<CropWindow>,
    /// Linear Rec. 709 radiance, `width * height` pixels, top row first.
    pub radiance: &'a [Rgb],
    /// The opacity of each pixel, with which the radiance is associated. None: all is opaque.
    pub alpha: Option<&'a [f32]>,
    /// The parts of colours that pixels let through, of which images for screens make their opacity and colour.
    pub transparency: Option<&'a [Transparency]>,
    /// The part of a backplate that each pixel shows, as a linear display value. Images for screens then have no opacity
    /// of their own; OpenEXR files hold it, and not the backplate.
    pub behind: Option<&'a [Rgb]>,
    /// Exposure and tone curve. OpenEXR and Radiance HDR store the radiance unchanged.
    pub display: DisplayTransform,
    /// Bits per channel. Only for PNG.
    pub bits: PngBits,
    /// Names and values for the file's header.
    pub metadata: &'a [(String, String)],
    /// Channels besides radiance, each with one value per pixel. Only for OpenEXR.
    pub channels: &'a [FilmChannel],
}

impl<'a> Output<'a> {
    /// An opaque 8-bit image without metadata.
    pub fn plain([width, height]: [u32; 2], radiance: &'a [Rgb], display: DisplayTransform) -> Output<'a> {
        Output {
            width,
            height,
            window: None,
            radiance,
            alpha: None,
            transparency: None,
            behind: None,
            display,
            bits: PngBits::Eight,
            metadata: &[],
            channels: &[],
        }
    }

    /// The way in which images treat the opacity of pixels.
    pub fn opacity(&self) -> Opacity {
        match (self.alpha, self.behind) {
            (None, _) => Opacity::Whole,
            (Some(_), None) => Opacity::Stored,
            (Some(_), Some(_)) => Opacity::BeforePlate,
        }
    }

    /// The pixels as a screen shows them, with 8 bits a channel: red, green and blue, and the opacity if the image keeps
    /// it, which the colours are not associated with.
    pub fn shown_8_bit(&self) -> Vec<u8> {
        self.shown(encode_8_bit, quantise_8_bit)
    }

    /// [`Output::shown_8_bit`] with 16 bits a channel.
    pub fn shown_16_bit(&self) -> Vec<u16> {
        self.shown(encode_16_bit, quantise_16_bit)
    }

    fn shown<T: Copy>(&self, color: impl Fn(Rgb) -> [T; 3], opacity: impl Fn(f32) -> T) -> Vec<T> {
        let colors = unassociated(self.radiance, self.alpha);
        let apply = |light: &Rgb| self.display.apply(*light);
        match (self.alpha, self.behind) {
            (None, _) => colors.iter().flat_map(|light| color(apply(light))).collect(),
            (Some(alpha), None) => {
                let pixel = |(at, (light, alpha)): (usize, (&Rgb, &f32))| {
                    let transparency = self.transparency.and_then(|pixels| pixels.get(at));
                    let own = apply(light);
                    let (own, alpha) = transparency.map_or((own, *alpha), |pixel| pixel.on_screens(own));
                    let [r, g, b] = color(own);
                    [r, g, b, opacity(alpha)]
                };
                colors.iter().zip(alpha).enumerate().flat_map(pixel).collect()
            }
            (Some(alpha), Some(behind)) => {
                let over = |((light, alpha), behind): ((&Rgb, &f32), &Rgb)| {
                    color(self.display.apply_over(*light, *alpha, *behind))
                };
                colors.iter().zip(alpha).zip(behind).flat_map(over).collect()
            }
        }
    }
}

/// The way in which images treat the opacity of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opacity {
    /// All is opaque.
    Whole,
    /// Images for screens show a backplate behind things, others store the opacity.
    BeforePlate,
    /// All images store it.
    Stored,
}

impl Opacity {
    /// The opacity in images of a scene with these settings.
    pub fn of(settings: &Settings) -> Opacity {
        match (settings.transparent, &settings.backplate) {
            (true, _) => Opacity::Stored,
            (false, Some(_)) => Opacity::BeforePlate,
            (false, None) => Opacity::Whole,
        }
    }
}

/// The place of a part of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropWindow {
    /// The column and row of the first pixel.
    pub at: [u32; 2],
    /// The size of the whole image.
    pub whole: [u32; 2],
}

impl CropWindow {
    /// The place of a region; none if it is the whole image, or no part of it.
    pub fn of(region: Region, whole: [u32; 2]) -> Option<CropWindow> {
        let is_part = region.x1 <= whole[0] && region.y1 <= whole[1] && region != Region::whole(whole);
        is_part.then_some(CropWindow { at: [region.x0, region.y0], whole })
    }
}

/// The format of an image file that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageEncoding {
    /// PNG: tone mapped, sRGB, 8 or 16 bits.
    Png,
    /// JPEG: tone mapped, sRGB, 8 bits, with losses.
    Jpeg,
    /// WebP: tone mapped, sRGB, 8 bits, without losses.
    WebP,
    /// OpenEXR: linear floats of 32 bits.
    OpenExr,
    /// Radiance HDR: linear, 8-bit mantissas with a shared exponent.
    Radiance,
}

impl ImageEncoding {
    /// The format with this extension, in any case.
    pub fn of_extension(extension: &str) -> Option<ImageEncoding> {
        Some(match extension.to_ascii_lowercase().as_str() {
            "png" => Self::Png,
            "jpg" | "jpeg" => Self::Jpeg,
            "webp" => Self::WebP,
            "exr" => Self::OpenExr,
            "hdr" => Self::Radiance,
            _ => return None,
        })
    }

    /// The name of the format, and the most pixels along a side.
    fn limits(self) -> (&'static str, u32) {
        match self {
            Self::Jpeg => ("JPEG", 65_535),
            Self::WebP => ("WebP", 16_384),
            Self::Png => ("PNG", u32::MAX),
            Self::OpenExr => ("OpenEXR", u32::MAX),
            Self::Radiance => ("Radiance HDR", u32::MAX),
        }
    }

    /// Checks that the format can hold images of this size and opacity; the error is the reason.
    pub fn fits(self, size: [u32; 2], opacity: Opacity) -> Result<(), String> {
        let (name, most) = self.limits();
        if size.into_iter().any(|side| side > most) {
            return Err(format!("{name} holds at most {most} pixels along a side: name a .png or .exr file"));
        }
        match (self, opacity) {
            (Self::Jpeg | Self::Radiance, Opacity::Stored) => {
                Err(format!("{name} holds no transparent pixels: name a .png, .webp or .exr file"))
            }
            (Self::Radiance, Opacity::BeforePlate) => Err(format!(
                "{name} holds light, which a background is not: name a .png, .jpg, .webp or .exr file"
            )),
            _ => Ok(()),
        }
    }
}

/// Checks that the format of `path` can hold images of this size and opacity. Called before a long rendering.
pub fn fits(path: &Path, size: [u32; 2], opacity: Opacity) -> Result<(), SaveError> {
    kind(path)?.fits(size, opacity).map_err(|reason| SaveError::new(path, reason))
}

/// Writes the image in the format given by the extension of `path`: `.png`, `.jpg` or `.webp` (tone mapped, sRGB),
/// `.exr` (32-bit float, linear) or `.hdr` (Radiance RGBE, linear). The file appears when it is complete; until then an older file of that
/// name stays as it was.
pub fn save(path: &Path, output: &Output<'_>) -> Result<(), SaveError> {
    let kind = kind(path)?;
    fits(path, [output.width, output.height], output.opacity())?;
    let pixels = pixels_of(path, output)?;
    if let Some(channel) = output.channels.iter().find(|channel| channel.values.len() != pixels) {
        let (name, given) = (&channel.name, channel.values.len());
        return Err(SaveError::new(path, format!("{given} values of {name} for {pixels} pixels")));
    }
    write_whole(path, |mut writer| encode(&mut writer, kind, output).and_then(|()| writer.flush()))
}

/// Writes the image in a format. `output` must be consistent.
pub fn encode(writer: &mut impl Write, encoding: ImageEncoding, output: &Output<'_>) -> io::Result<()> {
    match encoding {
        ImageEncoding::Png => encode_png::encode(writer, output).map_err(io::Error::other),
        ImageEncoding::Jpeg => encode_eight_bit::jpeg(writer, output).map_err(of_crate),
        ImageEncoding::WebP => encode_eight_bit::webp(writer, output).map_err(of_crate),
        ImageEncoding::OpenExr => writer.write_all(&encode_openexr::bytes(output).map_err(io::Error::other)?),
        ImageEncoding::Radiance => encode_radiance::encode(writer, output),
    }
}

/// Keeps the system's own errors, such as that of a closed pipe.
fn of_crate(error: image::ImageError) -> io::Error {
    match error {
        image::ImageError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

/// True if a file contains the image that [`save`] would write there, apart from its header. Errors: a file that cannot
/// be read.
pub fn is_saved(path: &Path, output: &Output<'_>) -> Result<bool, LoadError> {
    /// The offset of a PNG's bit depth.
    const DEPTH_AT: usize = 24;
    let found = crate::files::read(path).map_err(LoadError::io(path))?;
    let bits = if found.get(DEPTH_AT) == Some(&16) { PngBits::Sixteen } else { PngBits::Eight };
    let output = Output { bits, metadata: &[], channels: &[], ..*output };
    let mut expected = Vec::new();
    if !kind(path).is_ok_and(|kind| encode(&mut expected, kind, &output).is_ok()) {
        return Ok(false);
    }
    let [found, expected] = [found, expected].map(|bytes| Ok(decode_data(&bytes, path)?.image));
    let (found, expected): (Image, Image) = (found?, expected?);
    Ok((found.width, found.height, found.texels) == (expected.width, expected.height, expected.texels))
}

/// Encodes an image as PNG.
pub fn png_bytes(output: &Output<'_>) -> Result<Vec<u8>, SaveError> {
    let path = Path::new("PNG");
    pixels_of(path, output)?;
    let mut bytes = Vec::new();
    encode_png::encode(&mut bytes, output).map_err(|error| SaveError::new(path, error))?;
    Ok(bytes)
}

/// The number of pixels. Errors: zero, or a number that does not match the size.
fn pixels_of(path: &Path, output: &Output<'_>) -> Result<usize, SaveError> {
    let pixels = output.width as usize * output.height as usize;
    if pixels == 0 || pixels != output.radiance.len() {
        let (width, height, given) = (output.width, output.height, output.radiance.len());
        return Err(SaveError::new(path, format!("{given} pixels are not an image of {width} x {height}")));
    }
    if let Some(alpha) = output.alpha.filter(|alpha| alpha.len() != pixels) {
        let given = alpha.len();
        return Err(SaveError::new(path, format!("{given} opacities for {pixels} pixels")));
    }
    Ok(pixels)
}

/// Checks that [`save`] could write to `path` now: the extension is known, and the folder exists and is writable.
/// Called before a long rendering.
pub fn supported(path: &Path) -> Result<(), SaveError> {
    kind(path)?;
    writable(path)
}

fn kind(path: &Path) -> Result<ImageEncoding, SaveError> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    ImageEncoding::of_extension(extension).ok_or_else(|| {
        SaveError::new(
            path,
            "the name must end in .png, .jpg or .webp (tone mapped), .exr or .hdr (linear radiance); videos: --frames 1-48 -o - | ffmpeg -i - …",
        )
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use exr::meta::attribute::AttributeValue;

    use super::super::load_linear;
    use super::*;
    use crate::film::tonemap::srgb_encode;
    use crate::world::Tonemap;

    const WIDTH: u32 = 37;
    const HEIGHT: u32 = 11;

    fn picture() -> Vec<Rgb> {
        let pixel = |index: u32| {
            let t = f64::from(index) / f64::from(WIDTH * HEIGHT);
            let radiance = libm::exp2(t * 20.0 - 12.0) as f32;
            Rgb::new(radiance, radiance * 0.37, if index.is_multiple_of(5) { 0.0 } else { 0.001 })
        };
        (0..WIDTH * HEIGHT).map(pixel).collect()
    }

    fn metadata() -> Vec<(String, String)> {
        let pairs = [("seed", "42"), ("settings", "samples: 16\ndepth: 8"), ("owner", "Zoë")];
        pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec()
    }

    fn output<'a>(radiance: &'a [Rgb], metadata: &'a [(String, String)], bits: PngBits) -> Output<'a> {
        let display = DisplayTransform::new(Tonemap::Clamp, 0.0, radiance);
        Output { bits, metadata, ..Output::plain([WIDTH, HEIGHT], radiance, display) }
    }

    fn in_folder(name: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join(name);
        (folder, path)
    }

    fn saved(name: &str, bits: PngBits) -> (tempfile::TempDir, PathBuf) {
        let (folder, path) = in_folder(name);
        save(&path, &output(&picture(), &metadata(), bits)).expect("saving");
        (folder, path)
    }

    #[test]
    fn exr_keeps_every_bit() {
        let (_folder, path) = saved("a.exr", PngBits::Eight);
        assert_eq!(load_linear(&path).unwrap(), (WIDTH, HEIGHT, picture()));
    }

    #[test]
    fn png_is_accurate_to_its_bit_depth() {
        for (bits, steps) in [(PngBits::Eight, 255.0), (PngBits::Sixteen, 65_535.0)] {
            let (_folder, path) = saved("a.png", bits);
            let (width, height, pixels) = load_linear(&path).unwrap();
            assert_eq!((width, height), (WIDTH, HEIGHT));
            for (read, written) in pixels.iter().zip(picture()) {
                for (read, written) in read.to_array().into_iter().zip(written.to_array()) {
                    let error = srgb_encode(read) - srgb_encode(written.min(1.0));
                    assert!(error.abs() <= 0.501 / steps, "{read} for {written}");
                }
            }
        }
    }

    #[test]
    fn hdr_keeps_the_brightest_component_within_a_percent() {
        let (_folder, path) = saved("a.hdr", PngBits::Eight);
        let (width, height, pixels) = load_linear(&path).unwrap();
        assert_eq!((width, height), (WIDTH, HEIGHT));
        for (read, written) in pixels.iter().zip(picture()) {
            let tolerance = 0.01 * written.max_component();
            for (read, written) in read.to_array().into_iter().zip(written.to_array()) {
                assert!((read - written).abs() <= tolerance, "{read} for {written}");
            }
        }
    }

    #[test]
    fn hdr_stores_all_widths_and_values() {
        let odd = [0.0, 1e-45, 1e-38, 0.999_999, 1.0, 3.3e38, f32::INFINITY, f32::NAN, -4.0];
        for width in [1_u32, 7, 8, 300, 32_768] {
            let row: Vec<_> = (0..width as usize).map(|x| Rgb::splat(odd[(x / 3) % odd.len()])).collect();
            let (_folder, path) = in_folder("a.hdr");
            let display = DisplayTransform::new(Tonemap::Clamp, 0.0, &[]);
            save(&path, &Output::plain([width, 1], &row, display)).unwrap();
            for (read, written) in load_linear(&path).unwrap().2.iter().zip(&row) {
                let wanted = if written.r > 0.0 { written.r.min(1.69e38) } else { 0.0 };
                assert!((read.r - wanted).abs() <= wanted * 0.01 + 1e-38, "{} for {}", read.r, written.r);
            }
        }
    }

    #[test]
    fn png_is_marked_as_srgb_and_carries_metadata() {
        let (_folder, path) = saved("a.png", PngBits::Sixteen);
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let reader = png::Decoder::new(file).read_info().unwrap();
        let info = reader.info();
        assert!(info.srgb.is_some());
        assert_eq!((info.bit_depth, info.color_type), (png::BitDepth::Sixteen, png::ColorType::Rgb));
        let texts =
            info.uncompressed_latin1_text.iter().map(|text| (text.keyword.clone(), text.text.clone()));
        assert_eq!(texts.collect::<Vec<_>>(), metadata());
    }

    #[test]
    fn exr_has_chromaticities_and_carries_metadata() {
        let (_folder, path) = saved("a.exr", PngBits::Eight);
        let header = exr::meta::MetaData::read_from_file(&path, true).unwrap().headers.remove(0);
        let names: Vec<_> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R"]);
        assert!(header.channels.list.iter().all(|c| c.sample_type == exr::meta::attribute::SampleType::F32));
        assert_eq!(header.compression, exr::compression::Compression::RLE);
        assert_eq!(header.shared_attributes.chromaticities.unwrap().red, exr::math::Vec2(0.64, 0.33));
        let text = |name: &str| match header.own_attributes.other.get(&exr::prelude::Text::from(name)) {
            Some(AttributeValue::Text(text)) => text.to_string(),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(text("seed"), "42");
        assert_eq!(text("settings"), "samples: 16\ndepth: 8");
        // The name is reserved by the format, and texts are ASCII here.
        assert_eq!(text("rayfront owner"), "Zo?");
    }

    #[test]
    fn equal_images_give_equal_files() {
        for name in ["a.png", "a.exr", "a.hdr", "a.jpg", "a.JPEG", "a.webp"] {
            let ((_one, first), (_two, second)) = (saved(name, PngBits::Eight), saved(name, PngBits::Eight));
            assert_eq!(std::fs::read(first).unwrap(), std::fs::read(second).unwrap(), "{name}");
        }
    }

    #[test]
    fn awkward_metadata_does_not_prevent_saving() {
        let long = "name ".repeat(100);
        let pairs = [
            ("", "x"),
            (long.as_str(), "\0"),
            ("日本", "日本\n\n"),
            ("type", "t"),
            ("seed", ""),
            ("channels", "R"),
        ];
        let metadata = pairs.map(|(name, value)| (name.to_owned(), value.to_owned()));
        for name in ["a.png", "a.exr", "a.hdr", "a.jpg", "a.JPEG", "a.webp"] {
            let (_folder, path) = in_folder(name);
            save(&path, &output(&picture(), &metadata, PngBits::Eight)).unwrap();
            assert_eq!(load_linear(&path).unwrap().0, WIDTH, "{name}");
        }
    }

    #[test]
    fn formats_for_screens_are_exposed_and_tone_mapped() {
        let pixels = vec![Rgb::splat(0.5); (WIDTH * HEIGHT) as usize];
        for (name, wanted) in
            [("a.png", 0.25), ("a.exr", 0.5), ("a.hdr", 0.5), ("a.webp", 0.25), ("a.jpg", 0.25)]
        {
            let (_folder, path) = in_folder(name);
            let display = DisplayTransform::new(Tonemap::Clamp, -1.0, &pixels);
            save(&path, &Output { display, ..output(&pixels, &[], PngBits::Sixteen) }).unwrap();
            let read = load_linear(&path).unwrap().2[0];
            let allowed = if wanted < 0.5 && name != "a.png" { 2e-3 } else { 1e-4 };
            assert!((read.r - wanted).abs() < allowed, "{name}: {read:?}");
        }
    }

    #[test]
    fn failed_save_leaves_the_old_file_and_no_others() {
        let (folder, path) = saved("a.png", PngBits::Eight);
        let before = std::fs::read(&path).unwrap();
        let pixels = picture();
        let too_few = output(&pixels[1..], &[], PngBits::Eight);
        assert!(
            save(&path, &too_few).unwrap_err().to_string().contains("406 pixels are not an image of 37 x 11")
        );
        // A folder cannot be replaced, so this fails at the very end.
        let taken = folder.path().join("taken.png");
        std::fs::create_dir(&taken).unwrap();
        assert!(save(&taken, &output(&pixels, &[], PngBits::Eight)).is_err());
        assert!(supported(&taken).unwrap_err().to_string().contains("this is a folder"));
        assert_eq!(std::fs::read(&path).unwrap(), before);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn older_file_is_replaced() {
        let (folder, path) = saved("a.png", PngBits::Eight);
        let before = std::fs::read(&path).unwrap();
        save(&path, &output(&picture(), &metadata(), PngBits::Sixteen)).unwrap();
        assert_ne!(std::fs::read(&path).unwrap(), before);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn saved_file_has_the_permissions_of_a_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let (folder, path) = saved("a.png", PngBits::Eight);
        let ordinary = folder.path().join("ordinary");
        std::fs::write(&ordinary, "").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&ordinary));
    }

    #[test]
    fn unsupported_names_are_rejected_before_rendering() {
        for name in ["a.gif", "a", ".png", "a.png.part"] {
            let error = supported(Path::new(name)).unwrap_err().to_string();
            assert!(error.contains("must end in .png"), "{error}");
        }
        let error = supported(Path::new("no/such/folder/a.png")).unwrap_err().to_string();
        assert!(error.contains("there is no folder no/such/folder: make it first"), "{error}");
        let (folder, path) = in_folder("A.PNG");
        supported(&path).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
