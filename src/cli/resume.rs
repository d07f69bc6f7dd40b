//! `rayfront resume FILM`: finishes an interrupted film, or adds samples to a finished one.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::Failure;
use super::checkpoint::is_checkpoint;
use super::films::load_existing_film;
use super::job::{Job, RunRequest, execute};
use super::job_args::{LookOptions, OutputOptions, Outputs, StopOptions, WorkOptions};
use super::live_views::LiveViews;
use super::record::{may_be_written, scene_of};
use super::reproduce::record;
use crate::formats::film_file::{self, FilmFile, FilmHeader};
use crate::formats::picture::supported;
use crate::render::on_threads;

/// `rayfront resume`.
#[derive(Args, Debug)]
pub struct Resume {
    /// A film that rayfront has written, or - for standard input
    pub film: PathBuf,
    /// Path of the scene [default: the recorded path, if that is in the film's folder, or next to the film]
    #[arg(long, value_name = "FILE")]
    pub scene_file: Option<PathBuf>,
    /// Samples per pixel, at least as many as were wanted before
    #[arg(short = 's', long, visible_alias = "samples-per-pixel", value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    pub spp: Option<u32>,
    /// The options of outputs.
    #[command(flatten)]
    pub output: OutputOptions,
    /// The rules for stopping.
    #[command(flatten)]
    pub stop: StopOptions,
    /// The live views of the image.
    #[command(flatten)]
    pub look: LookOptions,
    /// The options of execution.
    #[command(flatten)]
    pub work: WorkOptions,
}

pub(super) fn run(arguments: &Resume) -> Result<ExitCode, Failure> {
    on_threads(arguments.work.threads, || resume(arguments))?.map(ExitCode::from)
}

fn resume(arguments: &Resume) -> Result<u8, Failure> {
    let film = load(&arguments.film)?;
    let mut outputs = Outputs::of(&arguments.output.output)?;
    if outputs.images.is_empty() && !outputs.to_stdout && outputs.film.is_none() {
        outputs.images.clone_from(&film.header.note.outputs);
        outputs.images.iter().try_for_each(|image| may_be_written(image, &arguments.film))?;
        outputs.images.iter().try_for_each(|image| may_be_replaced(image, &film.header))?;
    }
    outputs.images.iter().try_for_each(|path| supported(path))?;
    // The film continues in the same file.
    let is_file = arguments.film.as_os_str() != "-";
    if is_file && outputs.film.is_none() && !outputs.to_stdout {
        outputs.film = Some(arguments.film.clone());
    }
    let mut job =
        load_again(&film.header, arguments.scene_file.as_ref(), &arguments.film, arguments.work.quiet)?;
    (job.header.wanted, job.header.shard) = (film.header.wanted, film.header.shard);
    job.header.note.command.clone_from(&film.header.note.command);
    if let Some(spp) = arguments.spp {
        extend(&mut job, &film, spp)?;
    }
    if let Some(film) = outputs.film.as_ref().filter(|film| !crate::files::are_same(film, &arguments.film)) {
        load_existing_film(film, &job.header, arguments.output.overwrite)?;
    }
    let name = arguments.film.file_name().unwrap_or_default().to_string_lossy();
    let is_checkpoint = outputs.film.as_ref() == Some(&arguments.film) && is_checkpoint(&name);
    let onlookers = LiveViews::new(&arguments.look, &film.header.scene.path)?;
    let wanted = RunRequest {
        outputs,
        output: &arguments.output,
        stop: &arguments.stop,
        work: &arguments.work,
        onlookers: &onlookers,
        watched: None,
    };
    let code = execute(job, &wanted, Some(film))?;
    let is_whole = |header: FilmHeader| header.begun.is_none() && header.note.stopped_by.is_none();
    let is_whole = code == 0 && film_file::load_header(&arguments.film).is_ok_and(is_whole);
    if is_checkpoint && is_whole && !wanted.outputs.images.is_empty() {
        // The film was not requested. If it stays, it does no harm.
        let _ = std::fs::remove_file(&arguments.film);
    }
    Ok(code)
}

/// Checks that an image that only a film names does not exist yet, or is of the same scene: the author of a film must
/// not decide which of the user's images are lost.
fn may_be_replaced(image: &Path, header: &FilmHeader) -> Result<(), Failure> {
    let is_of_it = || record(image).is_ok_and(|found| found.scene.hash == header.scene.hash);
    if image.symlink_metadata().is_err() || is_of_it() {
        return Ok(());
    }
    let image = image.display();
    Err(Failure::output(format!(
        "{image}, where the film says that its image goes, holds something else: say where it goes with -o"
    )))
}

/// Loads a film from a file or standard input.
pub(super) fn load(path: &std::path::Path) -> Result<FilmFile, Failure> {
    if path.as_os_str() != "-" {
        return Ok(film_file::load(path)?);
    }
    let film = film_file::read(&mut std::io::stdin().lock(), "standard input".as_ref())?;
    film.ok_or_else(|| Failure::file("standard input: there is no film"))
}

/// Loads the scene of a film, which must be unchanged.
pub(super) fn load_again(
    header: &FilmHeader,
    scene_file: Option<&PathBuf>,
    film_path: &std::path::Path,
    quiet: bool,
) -> Result<Job, Failure> {
    let scene = scene_of(header, film_path, scene_file)?;
    // The options come from a film or an image, not from the command line.
    let mut job =
        Job::load(&scene, header.view.clone(), quiet, |world| world.settings = header.settings.clone())
            .map_err(Failure::of_file)?;
    job.header.region = header.region;
    job.header.variance = header.variance;
    job.header.allocation.clone_from(&header.allocation);
    match header.difference(&job.header) {
        Some(what) => Err(Failure::file(format!("{} is {what}", film_path.display()))),
        None => Ok(job),
    }
}

/// Extends the job to more samples than were wanted before.
fn extend(job: &mut Job, film: &FilmFile, spp: u32) -> Result<(), Failure> {
    let total = film.header.settings.samples;
    if spp < total {
        return Err(Failure::command_line(format!(
            "--spp {spp}: the film was to have {total} samples, and can only get more"
        )));
    }
    if spp == total {
        return Ok(());
    }
    if film.header.wanted != [0, total] {
        let [start, end] = film.header.wanted;
        return Err(Failure::command_line(format!(
            "--spp {spp}: the film is a part, samples {start}..{end} of {total}: merge all parts first"
        )));
    }
    if film.header.view.moments() > 1 {
        return Err(Failure::command_line(format!(
            "--spp {spp}: its samples are spread over the time that the shutter is open: render it anew with --spp {spp}"
        )));
    }
    job.setup.extensible().map_err(|reason| {
        Failure::command_line(format!("--spp {spp}: {reason}: render it anew with --spp {spp}"))
    })?;
    let frame = std::sync::Arc::make_mut(&mut job.setup);
    frame.samples = crate::sampling::pattern::Grid::new(spp);
    (job.header.settings.samples, job.header.wanted) = (spp, [0, spp]);
    Ok(())
}
