//! The images of a film, and their metadata.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::aov;
use super::films::samples;
use super::outputs::{Video, denoised_name};
use super::saving::Saved;
use crate::cli::{command_line::CommandLine, failure::Failure};
use crate::denoise::Denoised;
use crate::film::exposure::exposure_ev;
use crate::film::tonemap::DisplayTransform;
use crate::film::{Film, FilmChannel};
use crate::formats::DENOISED;
use crate::formats::film_file::{FilmHeader, Note};
use crate::formats::picture::{
    CropWindow, ImageEncoding, ImagePixels, Output, PngBits, backplate, encode, is_saved, load_text, save,
    video,
};
use crate::math::Rgb;

/// The key of an image's metadata under which its film's header is stored, as JSON.
const RECORD: &str = "rayfront";

/// The image of a film, as written to files.
pub struct OutputImage<'a> {
    header: &'a FilmHeader,
    film: &'a Film,
    /// The backplate's pixels.
    plate: Option<Vec<Rgb>>,
    bits: PngBits,
    /// The exposure in stops, from the settings or chosen from the image.
    pub exposure_ev: f32,
}

impl<'a> OutputImage<'a> {
    /// Creates the image with the header's settings. Errors: a backplate that cannot be read.
    pub fn new(header: &'a FilmHeader, film: &'a Film, bits: u8) -> Result<OutputImage<'a>, Failure> {
        let plate = backplate(&header.settings, film.region())?;
        let exposure_ev = exposure_ev(&header.settings, film);
        let bits = if bits == 16 { PngBits::Sixteen } else { PngBits::Eight };
        Ok(OutputImage { header, film, plate, bits, exposure_ev })
    }

    /// Saves images, each independently. Files that can hold them also get the channels, and the names of ids.
    pub fn write(
        &self,
        paths: &[PathBuf],
        channels: &[FilmChannel],
        manifest: Option<String>,
        saved: &mut Saved,
    ) {
        let metadata = self.metadata();
        let manifest = manifest.map(|ids| ("manifest".to_string(), ids));
        let with_manifest: Vec<_> = metadata.iter().cloned().chain(manifest).collect();
        let pixels = self.pixels(None);
        let output = self.output(&pixels, &metadata);
        let whole = Output { metadata: &with_manifest, channels, ..output };
        for path in paths {
            saved.image(path, save(path, if aov::holds(path) { &whole } else { &output }));
        }
    }

    /// True if a file holds this image or, if given, its denoised version.
    pub fn is_in(&self, path: &Path, denoised: Option<&Denoised>) -> Result<bool, Failure> {
        Ok(is_saved(path, &self.output(&self.pixels(denoised), &[]))?)
    }

    /// Writes the image to standard output, or its denoised version if there is one.
    pub fn write_to_stdout(
        &self,
        encoding: ImageEncoding,
        denoised: Option<&Denoised>,
        channels: &[FilmChannel],
        manifest: Option<String>,
    ) -> Result<(), Failure> {
        let mut metadata = self.metadata();
        metadata.extend(manifest.map(|ids| ("manifest".to_string(), ids)));
        metadata.extend(denoised.map(|denoised| (DENOISED.to_string(), format!("{:032x}", denoised.hash()))));
        let pixels = self.pixels(denoised);
        let output = Output { channels, ..self.output(&pixels, &metadata) };
        let mut out = BufWriter::new(std::io::stdout().lock());
        let written = encode(&mut out, encoding, &output).and_then(|()| out.flush());
        written.map_err(Failure::stdout("the image"))
    }

    /// Writes the image to standard output as a frame of a video.
    pub fn write_to_video(&self, video: Video, denoised: Option<&Denoised>) -> Result<(), Failure> {
        let pixels = self.pixels(denoised);
        let output = self.output(&pixels, &[]);
        let mut out = std::io::stdout().lock();
        let mut write = || {
            if video.begins {
                video::write_header(&mut out, [output.width, output.height], video.rate)?;
            }
            video::write_frame(&mut out, &output)?;
            out.flush()
        };
        write().map_err(Failure::stdout("the video"))
    }

    /// Saves the denoised image next to the images, with their exposure; returns its paths.
    pub fn write_denoised(&self, images: &[PathBuf], denoised: &Denoised, saved: &mut Saved) -> Vec<PathBuf> {
        let mut metadata = self.metadata();
        metadata.push((DENOISED.to_string(), format!("{:032x}", denoised.hash())));
        let pixels = self.pixels(Some(denoised));
        let output = self.output(&pixels, &metadata);
        let mut paths: Vec<PathBuf> = images.iter().map(|path| denoised_name(path)).collect();
        paths.retain(|path| {
            let outcome = save(path, &output);
            let exists = outcome.is_ok();
            saved.pixels(outcome);
            exists
        });
        paths
    }

    /// The pixels of the film, or denoised ones.
    fn pixels<'b>(&self, denoised: Option<&'b Denoised>) -> ImagePixels<'b> {
        ImagePixels::new(self.film, self.plate.as_deref(), denoised)
    }

    /// Returns the pixels in the form in which they are written.
    fn output<'b>(&'b self, pixels: &'b ImagePixels, metadata: &'b [(String, String)]) -> Output<'b> {
        let region = self.film.region();
        let settings = &self.header.settings;
        Output {
            width: region.width(),
            height: region.height(),
            window: CropWindow::of(region, settings.size),
            radiance: &pixels.radiance,
            alpha: pixels.alpha.as_deref(),
            transparency: pixels.transparency.as_deref(),
            behind: pixels.behind.as_deref(),
            display: DisplayTransform::new(settings.tonemap, self.exposure_ev, &pixels.own_colors()),
            bits: self.bits,
            metadata,
            channels: &[],
        }
    }

    /// Returns the metadata of an image: human-readable entries, and all that is needed to render it again.
    fn metadata(&self) -> Vec<(String, String)> {
        let settings = &self.header.settings;
        let entry = |key: &str, value: String| (key.to_string(), value);
        let [width, height] = settings.size;
        let limits = settings.depth_limits.given().map(|(name, limit)| entry(name, limit.to_string()));
        let mut entries = vec![
            entry("Software", self.header.program.clone()),
            entry("samples", samples(self.header)),
            entry("seed", settings.seed.to_string()),
            entry("size", format!("{width}x{height}")),
            entry("max_depth", settings.max_depth.to_string()),
            entry("min_throughput", settings.min_throughput.to_string()),
            entry("transport", format!("{:?}", settings.transport)),
            entry("filter", format!("{:?}", settings.filter)),
            entry("pixel_pattern", format!("{:?}", settings.pixel_pattern)),
            entry("tonemap", format!("{:?}", settings.tonemap)),
            entry("exposure_ev", self.exposure_ev.to_string()),
            entry("film_hash", self.header.film_hash.clone()),
        ];
        entries.extend(limits);
        // The name of the machine is private, and equal images must be equal files.
        let command = CommandLine::parse(&self.header.note.command).of_images().words();
        let Note { stopped_by, mix, .. } = self.header.note.clone();
        let note = Note { command, stopped_by, mix, ..Note::default() };
        let record = serde_json::to_string(&FilmHeader { note, ..self.header.clone() });
        entries.extend(record.ok().map(|record| entry(RECORD, aov::ascii(&record))));
        entries
    }
}

/// Returns the header of an image's film, from the image's metadata.
pub fn header_of_image(path: &Path) -> Result<FilmHeader, Failure> {
    let wrong = |reason: &str| Failure::file(format!("{}: {reason}", path.display()));
    let text = load_text(path, RECORD)?;
    let text = text.ok_or_else(|| {
        wrong("it does not say how it was rendered: rayfront has not written it, or its metadata was removed")
    })?;
    FilmHeader::parse(text.as_bytes()).map_err(|reason| wrong(&format!("its record {reason}")))
}
