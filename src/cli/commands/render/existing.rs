//! Images of frames that exist before the frames are rendered.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::cli::args::Render;
use crate::cli::job::{header_of_image, samples};
use crate::cli::{command_line::CommandLine, output};
use crate::error::in_one_line;
use crate::formats::film_file::FilmHeader;
use crate::world::Adaptive;

/// Checks whether existing images are those that a command would render.
pub struct ExistingImages<'a> {
    arguments: &'a Render,
    /// The command line as recorded in images.
    line: CommandLine,
    /// False if images may have fewer samples and be as intended, because a part of the samples is rendered.
    is_whole: bool,
    /// The file that has changed since, if any, by the hash of a scene's files.
    changed: HashMap<String, Option<PathBuf>>,
}

impl ExistingImages<'_> {
    /// Creates a check for a command.
    pub fn new<'a>(arguments: &'a Render, line: &CommandLine, is_whole: bool) -> ExistingImages<'a> {
        ExistingImages { arguments, line: line.clone().of_images(), is_whole, changed: HashMap::new() }
    }

    /// True if the images of a frame exist and are complete, so that they are kept. Reports what is done.
    pub fn are_kept(&mut self, images: &[PathBuf], frame: u32) -> bool {
        let time_s = self.arguments.view(Some(frame)).options.time_s;
        if !images.iter().all(|image| image.exists()) {
            return false;
        }
        let quiet = self.arguments.run.work.quiet;
        let is_empty = |image: &Path| image.metadata().is_ok_and(|file| file.is_file() && file.len() == 0);
        let is_unfinished = |image: &PathBuf| is_empty(image) || self.is_whole && lacks_samples(image);
        if images.iter().any(is_unfinished) {
            if !quiet {
                output::note(format_args!("frame {frame} is unfinished: it is rendered again"));
            }
            return false;
        }
        if let Some(how) = images.iter().find_map(|image| self.difference(image, time_s)) {
            output::note(format_args!(
                "warning: frame {frame} was rendered {how} and is kept (--overwrite renders it again)"
            ));
        } else if !quiet {
            let samples = images.iter().find_map(|image| missing_samples(image));
            let samples = samples.map_or_else(String::new, |samples| format!(", with {samples} samples"));
            output::note(format_args!("frame {frame} is there{samples} (--overwrite renders it again)"));
        }
        true
    }

    /// Returns how an image's record differs from this command, number of samples and time, in words that follow "it
    /// was rendered"; `None` for an image without a record.
    fn difference(&mut self, image: &Path, time_s: Option<f32>) -> Option<String> {
        let Render { picture, scene, .. } = self.arguments;
        let header = header_of_image(image).ok()?;
        let changed = self.changed.entry(header.scene.hash.clone());
        if CommandLine::parse(&header.note.command).of_images() != self.line {
            Some("by another command".into())
        } else if picture.sampling.spp.is_some_and(|samples| header.settings.samples != samples) {
            Some(format!("with {} samples", header.settings.samples))
        } else if header.view.options.time_s != time_s {
            Some("at another time".into())
        } else {
            let changed = changed.or_insert_with(|| header.scene.changed(scene)).as_ref()?;
            Some(format!("before {} was changed", in_one_line(&changed.display().to_string())))
        }
    }
}

/// True if an image's record is of an interrupted render: it does not have all samples, and no rule stopped it.
fn lacks_samples(image: &Path) -> bool {
    let unfinished = |header: FilmHeader| {
        let all = [[0, header.settings.samples]];
        let lacks = header.settings.adaptive == Adaptive::Off && header.samples != all;
        (header.begun.is_some() || lacks) && header.note.stopped_by.is_none()
    };
    header_of_image(image).is_ok_and(unfinished)
}

/// Returns the number of samples in an image's record, and of how many, if some are missing.
fn missing_samples(image: &Path) -> Option<String> {
    Some(samples(&header_of_image(image).ok()?)).filter(|samples| samples.contains(" of "))
}
