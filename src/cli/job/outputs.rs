//! The outputs of a render.

use std::path::{Path, PathBuf};

use crate::cli::failure::Failure;
use crate::error::{did_you_mean, in_one_line};
use crate::files::are_same;
use crate::formats::film_file::{Source, is_film};
use crate::formats::picture::ImageEncoding;

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
    /// The image that goes to standard output instead, by its format.
    pub stdout_image: Option<ImageEncoding>,
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
    /// True if standard output carries a film, a video or an image, not text.
    pub fn takes_stdout(&self) -> bool {
        self.to_stdout || self.video.is_some() || self.stdout_image.is_some()
    }

    /// Sorts the given files by kind.
    pub fn of(given: &[PathBuf]) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::default();
        for path in given {
            let format = path.to_str().and_then(|path| path.strip_suffix(":-"));
            let is_stdout = path.as_os_str() == "-" || format.is_some();
            if is_stdout && outputs.takes_stdout() {
                let reason = "two outputs go to standard output: name a file for one of them";
                return Err(Failure::command_line(reason));
            }
            match path {
                _ if is_stdout => match format.filter(|format| !format.eq_ignore_ascii_case("film")) {
                    None => outputs.to_stdout = true,
                    Some(format) => outputs.stdout_image = Some(encoding(format)?),
                },
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

/// The format of an image for standard output.
fn encoding(format: &str) -> Result<ImageEncoding, Failure> {
    ImageEncoding::of_extension(format).ok_or_else(|| {
        let known = ["png", "jpg", "webp", "exr", "hdr", "film"];
        let (format, hint) = (in_one_line(format), did_you_mean(format, known));
        Failure::command_line(format!(
            "-o {format}:- is no format for standard output{hint}: {} are, such as -o png:-",
            known.join(", ")
        ))
    })
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
            ..Outputs::default()
        };
        assert_eq!(outputs, Some(expected));
        assert!(Outputs::of(&paths(&["a.film", "b.film"])).is_err());
        let stdout = |names: &[&str]| {
            Outputs::of(&paths(names)).map(|outputs| (outputs.to_stdout, outputs.stdout_image))
        };
        assert_eq!(stdout(&["EXR:-"]).ok(), Some((false, Some(ImageEncoding::OpenExr))));
        assert_eq!(stdout(&["jpeg:-"]).ok(), Some((false, Some(ImageEncoding::Jpeg))));
        assert_eq!((stdout(&["film:-"]).ok(), stdout(&["-"]).ok()), (Some((true, None)), Some((true, None))));
        let error = |names: &[&str]| stdout(names).map_err(|error| error.to_string()).unwrap_err();
        assert!(
            error(&["png:-", "-"]).contains("two outputs")
                && error(&["png:-", "exr:-"]).contains("two outputs")
        );
        assert!(error(&["pgn:-"]).contains("did you mean \"png\"?"));
    }
}
