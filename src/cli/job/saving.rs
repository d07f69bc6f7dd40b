//! Writes outputs to the disk: a failure costs no other output, and the rendered film is not lost.

use std::path::{Path, PathBuf};

use super::films::save;
use crate::cli::{command_line::quoted, failure::Failure};
use crate::formats::film_file::FilmHeader;
use crate::render::RenderState;

/// The outputs that have been written, and the failures.
#[derive(Default)]
pub struct Saved {
    /// The images, in the order in which they were given.
    pub images: Vec<PathBuf>,
    /// The film, from which the images can be made again.
    pub film: Option<PathBuf>,
    failures: Vec<Failure>,
    /// True if some pixels could not be written.
    lacks_pixels: bool,
}

impl Saved {
    /// Records the outcome of printing the report.
    pub fn report(&mut self, outcome: Result<(), Failure>) {
        self.failures.extend(outcome.err());
    }

    /// Records the outcome of writing pixels other than to an image that was requested by name.
    pub fn pixels(&mut self, outcome: Result<(), impl Into<Failure>>) {
        let failure: Option<Failure> = outcome.err().map(Into::into);
        // A reader that has closed the pipe does not want them.
        self.lacks_pixels |= failure.as_ref().is_some_and(|failure| !failure.is_closed_pipe());
        self.failures.extend(failure);
    }

    /// Records the outcome of writing an image.
    pub fn image(&mut self, path: &Path, outcome: Result<(), impl Into<Failure>>) {
        match outcome {
            Ok(()) => self.images.push(path.to_owned()),
            failed => self.pixels(failed),
        }
    }

    /// Records the outcome of writing a film.
    pub fn film(&mut self, path: &Path, outcome: Result<(), impl Into<Failure>>) {
        match outcome {
            Ok(()) => self.film = Some(path.to_owned()),
            failed => self.pixels(failed),
        }
    }

    /// True if all outputs have been written.
    pub fn is_whole(&self) -> bool {
        self.failures.is_empty()
    }

    /// Returns the failures, combined. If no output holds the rendered film, it is saved wherever there is room.
    pub fn end(self, header: &FilmHeader, gathered: &RenderState) -> Result<(), Failure> {
        if self.failures.is_empty() {
            return Ok(());
        }
        if !self.lacks_pixels {
            return Err(Failure::all(self.failures, ""));
        }
        let film = self.film.map(Ok).unwrap_or_else(|| rescue(header, gathered));
        let note = match film {
            Ok(film) => {
                let film = quoted(&film.to_string_lossy());
                format!(
                    "what was rendered is in {film}: rayfront merge {film} --partial -o image.png makes an image of it"
                )
            }
            Err(()) => "and nowhere was room for what was rendered".to_owned(),
        };
        Err(Failure::all(self.failures, &note))
    }

    /// Returns the failures of a merge, as [`Saved::end`] does; but if all merged films are files, which remain, the
    /// result is not saved elsewhere.
    pub fn end_of_merge(
        self,
        header: &FilmHeader,
        gathered: &RenderState,
        films: &[PathBuf],
    ) -> Result<(), Failure> {
        match films.iter().any(|film| film.as_os_str() == "-") {
            false if !self.is_whole() => {
                Err(Failure::all(self.failures, "the films that were put together are as they were"))
            }
            _ => self.end(header, gathered),
        }
    }

    /// Returns the failures of making images of a film that remains.
    pub fn end_of_mix(self) -> Result<(), Failure> {
        if self.is_whole() { Ok(()) } else { Err(Failure::all(self.failures, "the film is as it was")) }
    }
}

/// Saves a film that was not requested wherever there is room; returns its path.
fn rescue(header: &FilmHeader, gathered: &RenderState) -> Result<PathBuf, ()> {
    let asked = header.note.outputs.first().map(PathBuf::as_path);
    let beside = asked.and_then(Path::parent).map(Path::to_owned);
    let asked = asked.or(Some(&header.scene.path));
    let folders = [beside, Some(PathBuf::new()), std::env::home_dir(), Some(std::env::temp_dir())];
    let memory = Some(PathBuf::from("/dev/shm")).filter(|folder| folder.is_dir());
    let stem = asked.and_then(Path::file_stem).unwrap_or("image".as_ref()).to_owned();
    let name = |number: u32| {
        let mut name = stem.clone();
        name.push(if number == 0 { ".saved.film".to_owned() } else { format!(".saved-{number}.film") });
        name
    };
    for folder in folders.into_iter().chain([memory]).flatten() {
        let free =
            (0..1000).map(|number| folder.join(name(number))).find(|path| path.symlink_metadata().is_err());
        let Some(path) = free else { continue };
        if save(&path, header, gathered).is_ok() {
            return Ok(std::path::absolute(&path).unwrap_or(path));
        }
    }
    Err(())
}
