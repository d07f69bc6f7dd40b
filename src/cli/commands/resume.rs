//! `rayfront resume FILM`: finishes an interrupted film, or adds samples to a finished one.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::{request, views};
use crate::cli::args::{OutputOptions, RunOptions};
use crate::cli::failure::Failure;
use crate::cli::job::record::may_be_written;
use crate::cli::job::{Job, Outputs, execute, header_of_image, is_checkpoint, load_existing_film};
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
    /// The options of running the job.
    #[command(flatten)]
    pub run: RunOptions,
}

pub fn run(arguments: &Resume) -> Result<ExitCode, Failure> {
    on_threads(arguments.run.work.threads, || resume(arguments))?.map(ExitCode::from)
}

fn resume(arguments: &Resume) -> Result<u8, Failure> {
    let Resume { film: path, scene_file, spp, output, run } = arguments;
    let film = load(path)?;
    let mut outputs = Outputs::of(&output.output)?;
    if outputs.images.is_empty() && !outputs.takes_stdout() && outputs.film.is_none() {
        outputs.images.clone_from(&film.header.note.outputs);
        outputs.images.iter().try_for_each(|image| may_be_written(image, path))?;
        outputs.images.iter().try_for_each(|image| may_be_replaced(image, &film.header))?;
    }
    outputs.images.iter().try_for_each(|path| supported(path))?;
    // The film continues in the same file.
    let is_file = path.as_os_str() != "-";
    if is_file && outputs.film.is_none() && !outputs.to_stdout {
        outputs.film = Some(path.clone());
    }
    let mut job = Job::load_again(&film.header, scene_file.as_deref(), path, run.work.quiet)?;
    (job.header.wanted, job.header.shard) = (film.header.wanted, film.header.shard);
    if let Some(spp) = spp.filter(|spp| *spp != film.header.settings.samples) {
        extend(&mut job, &film.header, spp)?;
    }
    if let Some(film) = outputs.film.as_ref().filter(|film| !crate::files::are_same(film, path)) {
        load_existing_film(film, &job.header, output.overwrite)?;
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Such a film was not requested. If it stays, it does no harm.
    let may_go = outputs.film.as_ref() == Some(path) && is_checkpoint(&name) && !outputs.images.is_empty();
    let views = views(run, &film.header.scene.path)?;
    let code = execute(job, &request(run, output, outputs, &views), Some(film))?;
    let is_whole = |header: FilmHeader| header.begun.is_none() && header.note.stopped_by.is_none();
    if may_go && code == 0 && film_file::load_header(path).is_ok_and(is_whole) {
        let _ = std::fs::remove_file(path);
    }
    Ok(code)
}

/// Checks that an image that only a film names does not exist yet, or is of the same scene: the author of a film must
/// not decide which of the user's images are lost.
fn may_be_replaced(image: &Path, header: &FilmHeader) -> Result<(), Failure> {
    let is_of_it = || header_of_image(image).is_ok_and(|found| found.scene.hash == header.scene.hash);
    if image.symlink_metadata().is_err() || is_of_it() {
        return Ok(());
    }
    let image = image.display();
    Err(Failure::output(format!(
        "{image}, where the film says that its image goes, holds something else: say where it goes with -o"
    )))
}

/// Loads a film from a file or standard input.
fn load(path: &Path) -> Result<FilmFile, Failure> {
    if path.as_os_str() != "-" {
        return Ok(film_file::load(path)?);
    }
    let film = film_file::read(&mut std::io::stdin().lock(), "standard input".as_ref())?;
    film.ok_or_else(|| Failure::file("standard input: there is no film"))
}

/// Extends the job of a film to another number of samples than was wanted before.
fn extend(job: &mut Job, film: &FilmHeader, spp: u32) -> Result<(), Failure> {
    let (total, [start, end]) = (film.settings.samples, film.wanted);
    let anew = format!("render it anew with --spp {spp}");
    let refusal = if spp < total {
        Some(format!("the film was to have {total} samples, and can only get more"))
    } else if [start, end] != [0, total] {
        Some(format!("the film is a part, samples {start}..{end} of {total}: merge all parts first"))
    } else if film.view.moments() > 1 {
        Some(format!("its samples are spread over the time that the shutter is open: {anew}"))
    } else {
        job.setup.extensible().err().map(|reason| format!("{reason}: {anew}"))
    };
    if let Some(reason) = refusal {
        return Err(Failure::command_line(format!("--spp {spp}: {reason}")));
    }
    let setup = std::sync::Arc::make_mut(&mut job.setup);
    setup.samples = crate::sampling::pattern::Grid::new(spp);
    (job.header.settings.samples, job.header.wanted) = (spp, [0, spp]);
    Ok(())
}
