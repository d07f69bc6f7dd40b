//! `rayfront render SCENE` and `rayfront SCENE`: loads, compiles, renders and saves.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::args::Render;
use super::films::load_existing_film;
use super::frames::{self, Frames};
use super::interrupt::Interrupt;
use super::job::{Job, RunRequest, execute};
use super::job_args::{Outputs, Video};
use super::live_views::LiveViews;
use super::loading::LoadSession;
use super::output::{self, ExistingImages, default_image};
use super::{Failure, hints, pilot};
use crate::error::in_one_line;
use crate::files::are_same;
use crate::formats::film_file::{FilmFile, RenderedView};
use crate::formats::picture::supported;
use crate::render::on_threads;
use crate::view::watched::{POLL_INTERVAL, Watched};
use crate::world::Adaptive;

pub(super) fn run(arguments: &Render) -> Result<ExitCode, Failure> {
    let Some(scene) = &arguments.scene else {
        return Err(Failure::command_line("no scene was given"));
    };
    if let Some(failure) = hints::misspelt_command(scene.as_os_str()) {
        return Err(failure);
    }
    let shard = arguments.part.shard.map(|shard| shard.resolve()).transpose()?;
    let outputs = outputs(arguments, scene, shard)?;
    outputs.images.iter().try_for_each(|path| supported(path))?;
    if let Some(pilot) = &arguments.part.pilot
        && outputs.images.iter().chain(&outputs.film).any(|output| are_same(output, pilot))
    {
        let pilot = in_one_line(&pilot.to_string_lossy());
        return Err(Failure::command_line(format!("{pilot} is the pilot: name another -o")));
    }
    let onlookers = LiveViews::new(&arguments.look, scene)?;
    // Everything, including loading, runs on the requested number of threads.
    let code = on_threads(arguments.work.threads, || match &arguments.frames.frames {
        None if arguments.watch.watch => watch(arguments, scene, &outputs, &onlookers),
        None => {
            let mut reuse = LoadSession::new(arguments.frames.shutter.is_some());
            render(arguments, scene, outputs, shard, arguments.model.time, &mut reuse, &onlookers)
        }
        Some(frames) => all_frames(arguments, scene, &outputs, shard, frames, &onlookers),
    })??;
    Ok(ExitCode::from(code))
}

/// Renders again whenever a file has changed, until it is interrupted.
fn watch(arguments: &Render, scene: &Path, outputs: &Outputs, onlookers: &LiveViews) -> Result<u8, Failure> {
    let interrupt = Interrupt::watch();
    let mut reuse = LoadSession::watching(arguments.watch.paranoid);
    loop {
        let time_s = arguments.model.time;
        let rendered = render(arguments, scene, outputs.clone(), None, time_s, &mut reuse, onlookers);
        match rendered {
            Err(failure) if failure.is_closed_pipe() => return Err(failure),
            // The user is about to mend what is broken now.
            Err(failure) => output::note(format_args!("error: {failure}")),
            Ok(code) if code != 0 => return Ok(code),
            Ok(_) => {}
        }
        let mut files = Watched::new(&reuse.sources);
        while !files.have_changed() {
            if interrupt.is_set() {
                return Ok(interrupt.exit_code());
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

/// Renders frame after frame, except those whose images exist and are complete.
fn all_frames(
    arguments: &Render,
    scene: &Path,
    outputs: &Outputs,
    shard: Option<[u32; 2]>,
    frames: &Frames,
    onlookers: &LiveViews,
) -> Result<u8, Failure> {
    let several = frames.numbers().count() > 1;
    let first = frames.numbers().next();
    let frames = frames.resolve()?;
    // A part of the samples is not an image yet.
    let shows = outputs.to_stdout && shard.is_none() && arguments.part.samples.is_none();
    let mut video = shows.then(|| Video { rate: frames::rate(arguments.frames.fps), begins: true });
    let mut reuse = LoadSession::new(several || arguments.frames.shutter.is_some());
    let command = output::command_of_images();
    let mut is_exposed = !several;
    let time_of = |frame: u32| frame as f32 / arguments.frames.fps;
    let (mut compared, samples) = (ExistingImages::default(), arguments.picture.spp);
    let count = frames.numbers().count();
    for (turn, frame) in frames.numbers().enumerate() {
        onlookers.set_turn(turn, count);
        let named = frames::named(outputs, frame, several)?;
        let outputs = Outputs { to_stdout: outputs.to_stdout && !shows, video, ..named };
        let files_alone = outputs.film.is_none() && !outputs.takes_stdout();
        let are_there = files_alone && outputs.images.iter().all(|image| image.exists());
        // With --shard or --samples, an image may have fewer samples and be as intended.
        let wants_all = shard.is_none() && arguments.part.samples.is_none();
        let is_empty = |image: &PathBuf| image.metadata().is_ok_and(|file| file.is_file() && file.len() == 0);
        let lacks_samples = |image: &PathBuf| is_empty(image) || wants_all && output::lacks_samples(image);
        if are_there && !arguments.output.overwrite && outputs.images.iter().any(lacks_samples) {
            if !arguments.work.quiet {
                output::note(format_args!("frame {frame} is unfinished: it is rendered again"));
            }
        } else if are_there && !arguments.output.overwrite {
            let mut difference =
                |image: &PathBuf| compared.difference(image, &command, samples, time_of(frame), scene);
            if let Some(how) = outputs.images.iter().find_map(&mut difference) {
                output::note(format_args!(
                    "warning: frame {frame} was rendered {how} and is kept (--overwrite renders it again)"
                ));
            } else if !arguments.work.quiet {
                let samples = outputs.images.iter().find_map(|image| output::samples_of(image));
                let samples = samples.map_or_else(String::new, |samples| format!(", with {samples} samples"));
                output::note(format_args!("frame {frame} is there{samples} (--overwrite renders it again)"));
            }
            continue;
        }
        if let (false, Some(first)) = (is_exposed, first) {
            let view = view(arguments, Some(time_of(first)));
            reuse.exposure_ev = pilot::exposure_ev(scene, view, arguments, &mut reuse)?;
            if let Some(ev) = reuse.exposure_ev.filter(|_| !arguments.work.quiet) {
                output::note(format_args!(
                    "exposure of all frames: {ev} EV, by frame {first} (--exposure {ev})"
                ));
            }
            is_exposed = true;
        }
        let time_s = time_of(frame);
        let code = render(arguments, scene, outputs, shard, Some(time_s), &mut reuse, onlookers)?;
        if code != 0 {
            return Ok(code);
        }
        video = video.map(|video| Video { begins: false, ..video });
    }
    Ok(0)
}

/// Returns the outputs: those given, else an image with the scene's name, or a film for a part of one.
fn outputs(arguments: &Render, scene: &Path, shard: Option<[u32; 2]>) -> Result<Outputs, Failure> {
    let given = &arguments.output.output;
    let Some([index, count]) = shard else {
        let image = default_image(scene);
        let is_one = arguments.frames.frames.is_none();
        let images = vec![if is_one { image.clone() } else { image.with_extension("####.png") }];
        return match given.is_empty() {
            true => Ok(Outputs { images, ..Outputs::default() }),
            false => Outputs::of(given),
        };
    };
    if given.is_empty() {
        let film = default_image(scene).with_extension(format!("{index}-of-{count}.film"));
        return Ok(Outputs { film: Some(film), ..Outputs::default() });
    }
    given.iter().try_for_each(|path| frames::is_unicode(path, '{'))?;
    // The command is the same for all tasks of an array.
    let name = |path: &PathBuf| PathBuf::from(path.to_string_lossy().replace("{shard}", &index.to_string()));
    Outputs::of(&given.iter().map(name).collect::<Vec<_>>())
}

fn render(
    arguments: &Render,
    path: &Path,
    outputs: Outputs,
    shard: Option<[u32; 2]>,
    time_s: Option<f32>,
    reuse: &mut LoadSession,
    onlookers: &LiveViews,
) -> Result<u8, Failure> {
    let quiet = arguments.work.quiet;
    let exposure_ev = reuse.exposure_ev;
    let mut job = Job::load_frame(path, view(arguments, time_s), quiet, reuse, |world| {
        arguments.apply(world);
        if let Some(ev) = exposure_ev {
            (world.settings.auto_exposure, world.settings.exposure_ev) = (false, ev);
        }
    })?;
    job.crop(arguments.crop)?;
    if job.header.settings.adaptive == Adaptive::Unbiased
        && (shard.is_some() || arguments.part.samples.is_some() || arguments.part.pilot.is_some())
    {
        let code = pilot::allocate(&mut job, arguments)?;
        if code != 0 || arguments.part.pilot_only {
            return Ok(code);
        }
    } else if arguments.part.pilot.is_some() {
        return Err(Failure::command_line("--pilot is for --adaptive=unbiased"));
    }
    let total = job.header.total();
    if let Some([index, count]) = shard {
        let part = job.header.part(index, count);
        if part.is_empty() && job.header.allocation.is_some() {
            output::print_text(&format!("part {index} of {count} has no samples: nothing to do\n"), true)?;
            return Ok(0);
        }
        if part.is_empty() {
            return Err(Failure::command_line(format!(
                "--shard {index}/{count}: of {total} samples nothing is left for this part: use at most {total} parts"
            )));
        }
        (job.header.wanted, job.header.shard) = ([part.start, part.end], shard);
    }
    if let Some([start, end]) = arguments.part.samples {
        if end > total {
            return Err(Failure::command_line(format!(
                "--samples ends at {end}, but there are {total}: see --spp"
            )));
        }
        job.header.wanted = [start, end];
    }
    if job.header.settings.adaptive == Adaptive::On && job.header.wanted != [0, total] {
        let reason = "adaptive samples are chosen by the film of all samples up to then";
        return Err(Failure::command_line(format!(
            "--shard and --samples: {reason}: add --adaptive=unbiased or --adaptive=off, or render it whole"
        )));
    }
    let overwrites = arguments.output.overwrite || arguments.watch.watch;
    let found = outputs.film.as_deref().map(|film| load_existing_film(film, &job.header, overwrites));
    let found = found.transpose()?.flatten();
    let is_whole =
        |film: &FilmFile| film.header.begun.is_none() && film.header.samples == [job.header.wanted];
    let film_alone = outputs.images.is_empty() && !outputs.takes_stdout() && !arguments.work.json;
    if film_alone && found.as_ref().is_some_and(is_whole) {
        if !arguments.work.quiet {
            let film = outputs.film.as_deref().unwrap_or(path).display();
            output::print_text(&format!("{film} is there and whole: nothing to do\n"), false)?;
        }
        return Ok(0);
    }
    let Render { output, stop, work, .. } = arguments;
    let sources = reuse.sources.clone();
    let watched = arguments.watch.watch.then_some(&sources);
    let wanted = RunRequest { outputs, output, stop, work, onlookers, watched };
    execute(job, &wanted, found)
}

/// Returns the view of the scene that is rendered, at a time.
pub(super) fn view(arguments: &Render, time_s: Option<f32>) -> RenderedView {
    RenderedView {
        camera: arguments.picture.camera.clone(),
        time_s,
        shutter_s: arguments.frames.shutter.map(|part| part / arguments.frames.fps),
        moments: arguments.frames.shutter.and(Some(arguments.frames.moments)),
        variant: arguments.model.variant.clone(),
        scene: arguments.model.scene.clone(),
        light_units: arguments.model.light_units,
        solid_glass: arguments.model.solid_glass,
        double_sided: arguments.model.double_sided,
        surroundings: arguments.model.env.clone(),
        edits: arguments.model.edits.edits(),
        size: arguments.picture.size,
    }
}
