//! The outputs of a render.

use std::path::{Path, PathBuf};

use crate::cli::failure::Failure;
use crate::error::in_one_line;
use crate::files::are_same;
use crate::formats::film_file::{Source, is_film};

/// The files to be written, by kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The images.
    pub images: Vec<PathBuf>,
    /// A film that can be continued.
    pub film: Option<PathBuf>,
    /// True if a film goes to standard output.
    pub to_stdout: bool,
    /// The video that goes to standard output instead.
    pub video: Option<Video>,
}

/// A video, as a stream of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Video {
    /// The frames per second as a fraction.
    pub rate: [u32; 2],
    /// True if no frame has been written yet.
    pub begins: bool,
}

impl Outputs {
    /// True if standard output carries a film or a video, not text.
    pub fn takes_stdout(&self) -> bool {
        self.to_stdout || self.video.is_some()
    }

    /// Sorts the given files by kind.
    pub fn of(given: &[PathBuf]) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::default();
        for path in given {
            match path {
                _ if path.as_os_str() == "-" => outputs.to_stdout = true,
                _ if is_film(path) => {
                    if let Some(first) = outputs.film.replace(path.clone()) {
                        let (first, second) = (first.display(), path.display());
                        return Err(Failure::command_line(format!(
                            "two films were asked for, {first} and {second}: one is enough"
                        )));
                    }
                }
                _ => outputs.images.push(path.clone()),
            }
        }
        Ok(outputs)
    }
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

/// Returns the default path of a scene's image: the scene's name, in the current folder.
pub fn default_image(scene: &Path) -> PathBuf {
    let name = scene.with_extension("png");
    PathBuf::from(name.file_name().unwrap_or("image.png".as_ref()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_sorted_by_kind() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let outputs = Outputs::of(&paths(&["a.png", "b.FILM", "-", "c.exr"])).ok();
        let expected = Outputs {
            images: paths(&["a.png", "c.exr"]),
            film: Some("b.FILM".into()),
            to_stdout: true,
            video: None,
        };
        assert_eq!(outputs, Some(expected));
        assert!(Outputs::of(&paths(&["a.film", "b.film"])).is_err());
    }
}
