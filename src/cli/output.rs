//! The images of a film, and their metadata.

use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::job_args::{Outputs, Video};
use super::saving::Saved;
use super::{Failure, aov, command_line, reproduce};
use crate::denoise::Denoised;
use crate::error::{in_one_line, shown};
use crate::files::are_same;
use crate::film::exposure::exposure_ev;
use crate::film::tonemap::DisplayTransform;
use crate::film::{Film, FilmChannel};
use crate::formats::DENOISED;
use crate::formats::film_file::{FilmHeader, Note, Source};
use crate::formats::picture::{Output, PngBits, is_saved, save, video};
use crate::math::Rgb;
use crate::world::Adaptive;

/// The key of an image's metadata under which its film's header is stored, as JSON.
pub const RECORD: &str = "rayfront";
/// The options that are not recorded in an image: how it was rendered, and where it was written.
const WITHOUT_TRACE: [&str; 19] = [
    "--schedule", "--wave", "--threads", "--simd", "--checkpoint", "--output", "-o", "--max-time", "--until",
    "--shard", "--samples", "--bits", "--quality", "--spp", "--frames", "--fps", "--tev", "--progress",
    "--memory",
];

/// The image of a film, as written to files.
pub struct OutputImage<'a> {
    header: &'a FilmHeader,
    film: &'a Film,
    radiance: Vec<Rgb>,
    bits: PngBits,
    /// The exposure in stops, from the settings or chosen from the image.
    pub exposure_ev: f32,
}

impl<'a> OutputImage<'a> {
    /// Creates the image with the header's settings.
    pub fn new(header: &'a FilmHeader, film: &'a Film, bits: u8) -> OutputImage<'a> {
        let radiance = film.radiance();
        let exposure_ev = exposure_ev(&header.settings, &radiance);
        let bits = if bits == 16 { PngBits::Sixteen } else { PngBits::Eight };
        OutputImage { header, film, radiance, bits, exposure_ev }
    }

    /// The radiance of the pixels, row by row.
    pub fn radiance(&self) -> &[Rgb] {
        &self.radiance
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
        let output = self.output(&self.radiance, &metadata);
        let whole = Output { metadata: &with_manifest, channels, ..output };
        for path in paths {
            saved.image(path, save(path, if aov::holds(path) { &whole } else { &output }));
        }
    }

    /// True if a file holds this image or, if given, its denoised version.
    pub fn is_in(&self, path: &Path, denoised: Option<&Denoised>) -> Result<bool, Failure> {
        let radiance = denoised.map_or(&self.radiance, |denoised| &denoised.radiance);
        Ok(is_saved(path, &self.output(radiance, &[]))?)
    }

    /// Writes the image to standard output as a frame of a video.
    pub fn write_to_video(&self, video: Video, denoised: Option<&Denoised>) -> Result<(), Failure> {
        let output = self.output(denoised.map_or(&self.radiance, |denoised| &denoised.radiance), &[]);
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
        let output = self.output(&denoised.radiance, &metadata);
        let mut paths: Vec<PathBuf> = images.iter().map(|path| denoised_name(path)).collect();
        paths.retain(|path| {
            let outcome = save(path, &output);
            let exists = outcome.is_ok();
            saved.pixels(outcome);
            exists
        });
        paths
    }

    /// Returns the pixels in the form in which they are written.
    fn output<'b>(&self, radiance: &'b [Rgb], metadata: &'b [(String, String)]) -> Output<'b> {
        let region = self.film.region();
        let settings = &self.header.settings;
        Output {
            width: region.width(),
            height: region.height(),
            radiance,
            display: DisplayTransform::new(settings.tonemap, self.exposure_ev, radiance),
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
        let command = without_trace(&self.header.note.command);
        let note = Note { command, stopped_by: self.header.note.stopped_by.clone(), ..Note::default() };
        let record = serde_json::to_string(&FilmHeader { note, ..self.header.clone() });
        entries.extend(record.ok().map(|record| entry(RECORD, aov::ascii(&record))));
        entries
    }
}

/// Returns a command's words, except those that change nothing in an image.
fn without_trace(command: &[String]) -> Vec<String> {
    let switches = ["--quiet", "-q", "--json", "--overwrite", "--denoise", "--preview", "--allow-outside"];
    let words = command_line::without(command, &WITHOUT_TRACE);
    words.into_iter().filter(|word| !switches.contains(&&word[..])).collect()
}

/// Returns this command as it is recorded in the images that it writes.
pub fn command_of_images() -> Vec<String> {
    without_trace(&command_line::recorded_args())
}

/// Checks whether existing images are those that a command would render.
#[derive(Default)]
pub struct ExistingImages {
    /// The file that has changed since, if any, by the hash of a scene's files.
    changed: HashMap<String, Option<PathBuf>>,
}

impl ExistingImages {
    /// Returns how an image's record differs from this command, number of samples and time, in words that follow "it
    /// was rendered"; `None` for an image without a record.
    pub fn difference(
        &mut self,
        image: &Path,
        command: &[String],
        samples: Option<u32>,
        time_s: f32,
        scene: &Path,
    ) -> Option<String> {
        let header = reproduce::record(image).ok()?;
        if header.note.command != command {
            return Some("by another command".into());
        }
        if samples.is_some_and(|samples| header.settings.samples != samples) {
            return Some(format!("with {} samples", header.settings.samples));
        }
        if header.view.time_s.is_some_and(|before| before != time_s) {
            return Some("at another time".into());
        }
        let changed = self.changed.entry(header.scene.hash.clone());
        let changed = changed.or_insert_with(|| header.scene.changed(scene)).as_ref()?;
        Some(format!("before {} was changed", in_one_line(&changed.display().to_string())))
    }
}

/// True if an image's record is of an interrupted render: it does not have all samples, and no rule stopped it.
pub fn lacks_samples(image: &Path) -> bool {
    let unfinished = |header: FilmHeader| {
        let all = [[0, header.settings.samples]];
        let lacks = header.settings.adaptive == Adaptive::Off && header.samples != all;
        (header.begun.is_some() || lacks) && header.note.stopped_by.is_none()
    };
    reproduce::record(image).is_ok_and(unfinished)
}

/// Returns the number of samples in an image's record, and of how many, if some are missing.
pub fn samples_of(image: &Path) -> Option<String> {
    let header = reproduce::record(image).ok()?;
    let samples = samples(&header);
    samples.contains(" of ").then_some(samples)
}

/// Checks that outputs replace neither each other nor the scene's files.
pub fn check_output_conflicts(outputs: &Outputs, denoises: bool, scene: &Source) -> Result<(), Failure> {
    let denoised = outputs.images.iter().filter(|_| denoises).map(|image| denoised_name(image));
    let all: Vec<PathBuf> =
        outputs.images.iter().cloned().chain(denoised).chain(outputs.film.clone()).collect();
    for (place, path) in all.iter().enumerate() {
        let shown = in_one_line(&path.to_string_lossy());
        if all[..place].iter().any(|before| are_same(before, path)) {
            return Err(Failure::command_line(format!(
                "{shown} would be written twice: give each output a name"
            )));
        }
        if scene.paths().any(|read| are_same(&read, path)) {
            return Err(Failure::command_line(format!(
                "{shown} is read for this scene: say where the image goes with -o"
            )));
        }
    }
    Ok(())
}

/// Returns the path of a denoised image, next to the noisy one.
pub fn denoised_name(image: &Path) -> PathBuf {
    let mut extension = std::ffi::OsString::from("denoised.");
    extension.push(image.extension().unwrap_or_default());
    image.with_extension(extension)
}

/// Returns a warning if some of the moments of motion blur have no samples.
pub fn uneven_blur(header: &FilmHeader) -> Option<String> {
    let (moments, total) = (header.view.moments(), header.settings.samples);
    let there = header.view.moments_among(&header.samples, total);
    let all = header.view.moments_among(&[[0, total]], total);
    (moments > 1 && there < all).then(|| {
        format!("motion is blurred by {there} of {moments} moments, since not all samples are there")
    })
}

/// Returns the number of samples that pixels have, and the number wanted.
pub fn samples(header: &FilmHeader) -> String {
    if let Some(allocation) = &header.allocation {
        let least = allocation.samples().iter().min().copied().unwrap_or(0);
        let (most, asked) = (allocation.most(), header.settings.samples);
        let done: u32 = header.samples.iter().map(|[start, end]| end - start).sum();
        let part = if done == most { String::new() } else { format!("{done} of ") };
        return format!("{part}{least} to {most}, for the rays of {asked}");
    }
    if header.settings.adaptive != Adaptive::Off
        && header.most > header.samples.last().map_or(0, |[_, end]| *end)
    {
        let least: u32 = header.samples.iter().map(|[start, end]| end - start).sum();
        return format!("{least} to {}, for the rays of {}", header.most, header.settings.samples);
    }
    let done: u32 = header.samples.iter().map(|[start, end]| end - start).sum();
    match header.settings.samples {
        asked if asked == done => done.to_string(),
        asked => format!("{done} of {asked}"),
    }
}

/// Returns the command that renders a film's samples again.
pub fn again(header: &FilmHeader) -> String {
    match (&header.samples[..], header.settings.samples) {
        ([[0, end]], total)
            if *end < total && header.settings.adaptive == Adaptive::Off && header.begun.is_none() =>
        {
            let words = command_line::shell_line(&command_line::of_whole(header));
            format!("rayfront {words} --samples 0..{end}")
        }
        _ => "rayfront reproduce with the image or film".into(),
    }
}

/// Prints a report on standard output, or on standard error if standard output is taken.
pub fn print_text(text: &str, is_taken: bool) -> Result<(), Failure> {
    if !is_taken {
        return print(text);
    }
    tell_all(text);
    Ok(())
}

/// Prints on standard output. All output there goes this way, except films and videos.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(shown(text).as_bytes()).and_then(|()| out.flush()).map_err(Failure::stdout("the result"))
}

/// Prints a line on standard error; errors are ignored.
pub fn note(line: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{}", in_one_line(&line.to_string()));
}

/// Prints text of several lines on standard error; errors are ignored.
pub fn tell_all(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", shown(text.trim_end()));
}

/// Returns several paths as JSON.
pub fn paths_json(paths: &[PathBuf]) -> Vec<serde_json::Value> {
    paths.iter().map(|path| path_json(path)).collect()
}

/// Returns a path as JSON. Invalid Unicode is replaced, because JSON cannot represent it.
pub fn path_json(path: &Path) -> serde_json::Value {
    path.to_string_lossy().into()
}

/// Returns the default path of a scene's image: the scene's name, in the current folder.
pub fn default_image(scene: &Path) -> PathBuf {
    let name = scene.with_extension("png");
    PathBuf::from(name.file_name().unwrap_or("image.png".as_ref()))
}
