//! Files named by a record, which is the metadata of a film or an image and may come from a stranger. As for a scene,
//! only files in the record's folder are read and written, unless the user types their names.

use std::path::{Path, PathBuf};

use crate::cli::command_line::{CommandLine, not_an_option};
use crate::cli::failure::Failure;
use crate::error::in_one_line;
use crate::formats::EnvironmentPreset;
use crate::formats::film_file::FilmHeader;
use crate::world::source_files::is_within;

/// Returns the path of a record's scene: the path that was typed, else the recorded path, else the name beside the
/// record.
pub fn scene_of(header: &FilmHeader, record: &Path, typed: Option<&Path>) -> Result<PathBuf, Failure> {
    let (named, shown) = (&header.scene.path, record.display());
    if let Some(EnvironmentPreset::Picture(picture)) = &header.view.options.surroundings
        && !is_within(record, picture)
    {
        let picture = in_one_line(&picture.to_string_lossy());
        return Err(Failure::file(format!(
            "{shown}: its surroundings, {picture}, are not in its folder: --allow-outside lets them be read"
        )));
    }
    if let Some(scene) = typed {
        return Ok(scene.to_owned());
    }
    let beside = record.parent().zip(named.file_name()).map(|(folder, name)| folder.join(name));
    let found = [Some(named.clone()), beside].into_iter().flatten();
    let mut found = found.filter(|scene| is_within(record, scene) && scene.is_file());
    found.next().ok_or_else(|| {
        let scene = in_one_line(&named.to_string_lossy());
        Failure::file(format!(
            "{shown} is of {scene}, which is not in its folder: say where the scene is with --scene-file"
        ))
    })
}

/// Returns an error if an image that only a record names is not in the record's folder.
pub fn may_be_written(image: &Path, record: &Path) -> Result<(), Failure> {
    let folder = image.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if is_within(record, folder) {
        return Ok(());
    }
    let image = in_one_line(&image.to_string_lossy());
    Err(Failure::output(format!(
        "{image}, where the film says that its image goes, is not in the film's folder: say where it goes with -o"
    )))
}

/// Returns the command that continues a film that this program has just saved: it names all images again if some are
/// not in the film's folder.
pub fn resume_own(film: &Path, header: &FilmHeader) -> CommandLine {
    let outputs = &header.note.outputs;
    let mut line = resume(film, header);
    if outputs.iter().any(|image| may_be_written(image, film).is_err()) {
        outputs.iter().for_each(|image| line.output(image));
    }
    line
}

/// Returns the command that continues a film, whatever its origin.
pub fn resume(film: &Path, header: &FilmHeader) -> CommandLine {
    let mut line = CommandLine::of(["rayfront", "resume", &not_an_option(film)]);
    if let Some(EnvironmentPreset::Picture(picture)) = &header.view.options.surroundings
        && !is_within(film, picture)
    {
        line.switch("allow-outside", true);
    } else if scene_of(header, film, None).is_err() {
        line.push(["--scene-file", &not_an_option(&header.scene.path)]);
    }
    line
}
