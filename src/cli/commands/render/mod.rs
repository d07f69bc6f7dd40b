//! `rayfront render SCENE` and `rayfront SCENE`: loads, compiles, renders and saves.

mod existing;
pub mod frames;
mod pilot;

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use self::existing::ExistingImages;
use super::{request, views};
use crate::cli::args::{Frames, Render};
use crate::cli::job::{
    Job, LiveViews, LoadSession, Outputs, Video, default_image, execute, load_existing_film,
};
use crate::cli::{command_line::CommandLine, failure::Failure, interrupt::Interrupt, output};
use crate::error::in_one_line;
use crate::files::are_same;
use crate::formats::film_file::FilmFile;
use crate::formats::picture::supported;
use crate::render::on_threads;
use crate::view::watched::{POLL_INTERVAL, Watched};
use crate::world::Adaptive;

/// Renders a scene. `line` is recorded in films and images.
pub fn run(arguments: &Render, line: CommandLine) -> Result<ExitCode, Failure> {
    let shard = arguments.part.shard.map(|shard| shard.resolve()).transpose()?;
    let outputs = outputs(arguments, shard)?;
    outputs.images.iter().try_for_each(|path| supported(path))?;
    if let Some(pilot) = &arguments.part.pilot
        && outputs.images.iter().chain(&outputs.film).any(|output| are_same(output, pilot))
    {
        let pilot = in_one_line(&pilot.to_string_lossy());
        return Err(Failure::command_line(format!("{pilot} is the pilot: name another -o")));
    }
    let views = views(&arguments.run, &arguments.scene)?;
    let command = RenderCommand { arguments, line, shard, views };
    // Everything, including loading, runs on the requested number of threads.
    let code = on_threads(arguments.run.work.threads, || match arguments.frames_of_scene()? {
        None if arguments.watch.watch => command.watch(&outputs),
        None => {
            let mut session = LoadSession::new(arguments.frames.shutter.is_some());
            command.render(outputs, None, &mut session)
        }
        Some(frames) => command.all_frames(&outputs, &frames),
    })??;
    Ok(ExitCode::from(code))
}

/// Returns the outputs: those given, else an image with the scene's name, or a film for a part of one.
fn outputs(arguments: &Render, shard: Option<[u32; 2]>) -> Result<Outputs, Failure> {
    let image = default_image(&arguments.scene);
    match (shard, &arguments.output.output[..]) {
        (None, []) => {
            let is_one = arguments.frames.given().is_none();
            let images = vec![if is_one { image } else { image.with_extension("####.png") }];
            Ok(Outputs { images, ..Outputs::default() })
        }
        (None, given) => Outputs::of(given),
        (Some([index, count]), []) => {
            let film = Some(image.with_extension(format!("{index}-of-{count}.film")));
            Ok(Outputs { film, ..Outputs::default() })
        }
        (Some([index, _]), given) => {
            given.iter().try_for_each(|path| frames::is_unicode(path, '{'))?;
            // The command is the same for all tasks of an array.
            let name =
                |path: &PathBuf| PathBuf::from(path.to_string_lossy().replace("{shard}", &index.to_string()));
            Outputs::of(&given.iter().map(name).collect::<Vec<_>>())
        }
    }
}

/// A command that renders.
struct RenderCommand<'a> {
    arguments: &'a Render,
    line: CommandLine,
    /// The index of the part to render, and the number of parts.
    shard: Option<[u32; 2]>,
    views: LiveViews,
}

impl RenderCommand<'_> {
    /// Prints a line, unless that is not wanted.
    fn note(&self, line: std::fmt::Arguments) {
        if !self.arguments.run.work.quiet {
            output::note(line);
        }
    }

    /// Renders again whenever a file has changed, until it is interrupted.
    fn watch(&self, outputs: &Outputs) -> Result<u8, Failure> {
        let watch = &self.arguments.watch;
        let interrupt = Interrupt::watch();
        let mut session = LoadSession::watching(watch.paranoid);
        loop {
            match self.render(outputs.clone(), None, &mut session) {
                Err(failure) if failure.is_closed_pipe() => return Err(failure),
                // The user is about to mend what is broken now.
                Err(failure) => output::note(format_args!("error: {failure}")),
                Ok(0) => {}
                code => return code,
            }
            let mut files = Watched::new(&session.sources);
            while !files.have_changed() {
                if interrupt.is_set() {
                    return Ok(interrupt.exit_code());
                }
                std::thread::sleep(POLL_INTERVAL);
            }
        }
    }

    /// Renders frame after frame, except those whose images exist and are complete.
    fn all_frames(&self, outputs: &Outputs, frames: &Frames) -> Result<u8, Failure> {
        let Render { frames: options, output, part, .. } = self.arguments;
        let several = frames.numbers().count() > 1;
        if several && outputs.stdout_image.is_some() {
            let reason =
                "standard output takes one image: name files, such as -o frame.####.png, or a video, -o -";
            return Err(Failure::command_line(reason));
        }
        let mut exposing = frames.numbers().next().filter(|_| several);
        let frames = frames.resolve()?;
        let count = frames.numbers().count();
        // A part of the samples is not an image yet.
        let is_whole = self.shard.is_none() && part.samples.is_none();
        let shows = outputs.to_stdout && is_whole;
        let mut video = shows.then(|| Video { rate: frames::rate(options.fps), begins: true });
        let mut session = LoadSession::new(several || options.shutter.is_some());
        let mut existing = ExistingImages::new(self.arguments, &self.line, is_whole);
        let mut code = 0;
        for (turn, frame) in frames.numbers().enumerate() {
            self.views.set_turn(turn, count);
            let named = frames::named(outputs, frame, several)?;
            let outputs = Outputs { to_stdout: outputs.to_stdout && !shows, video, ..named };
            let files_alone = outputs.film.is_none() && !outputs.takes_stdout();
            if files_alone && !output.overwrite && existing.are_kept(&outputs.images, frame) {
                continue;
            }
            if let Some(first) = exposing.take() {
                let job = self.load(Some(first), &mut session)?;
                session.exposure_ev = pilot::exposure_ev(&job, self.arguments.run.stop.max_time)?;
                if let Some(ev) = session.exposure_ev {
                    self.note(format_args!(
                        "exposure of all frames: {ev} EV, by frame {first} (--exposure {ev})"
                    ));
                }
            }
            code = self.render(outputs, Some(frame), &mut session)?;
            if code != 0 {
                break;
            }
            video = video.map(|video| Video { begins: false, ..video });
        }
        Ok(code)
    }

    /// Loads the scene, alone or as it is in a frame.
    fn load(&self, frame: Option<u32>, session: &mut LoadSession) -> Result<Job, Failure> {
        let arguments = self.arguments;
        let (view, quiet) = (arguments.view(frame), arguments.run.work.quiet);
        let exposure_ev = session.exposure_ev;
        let mut job = Job::load_frame(&arguments.scene, view, quiet, session, |world| {
            arguments.apply(world);
            if let Some(ev) = exposure_ev {
                (world.settings.auto_exposure, world.settings.exposure_ev) = (false, ev);
            }
        })?;
        job.header.note.command = self.line.words();
        Ok(job)
    }

    /// Renders the scene, alone or as it is in a frame; returns the exit code.
    fn render(&self, outputs: Outputs, frame: Option<u32>, session: &mut LoadSession) -> Result<u8, Failure> {
        let Render { output, run, watch, crop, .. } = self.arguments;
        let mut job = self.load(frame, session)?;
        job.crop(*crop)?;
        if let ControlFlow::Break(code) = self.choose_samples(&mut job)? {
            return Ok(code);
        }
        let overwrites = output.overwrite || watch.watch;
        let found = outputs.film.as_deref().map(|film| load_existing_film(film, &job.header, overwrites));
        let found = found.transpose()?.flatten();
        let is_whole =
            |film: &FilmFile| film.header.begun.is_none() && film.header.samples == [job.header.wanted];
        let film_alone = outputs.images.is_empty() && !outputs.takes_stdout() && !run.work.json;
        if let Some(film) =
            outputs.film.as_ref().filter(|_| film_alone && found.as_ref().is_some_and(is_whole))
        {
            let line = format!("{} is there and whole: nothing to do\n", film.display());
            return if run.work.quiet { Ok(0) } else { output::print(&line).map(|()| 0) };
        }
        let mut request = request(run, output, outputs, &self.views);
        if watch.watch {
            request.checkpoint = run.stop.checkpoint.flatten();
            request.watched = Some(&session.sources);
        }
        execute(job, &request, found)
    }

    /// Chooses the samples that the job renders. Breaks with the exit code if there is nothing more to do.
    fn choose_samples(&self, job: &mut Job) -> Result<ControlFlow<u8>, Failure> {
        let part = &self.arguments.part;
        let is_part = self.shard.is_some() || part.samples.is_some();
        match job.header.settings.adaptive {
            Adaptive::Unbiased if is_part || part.pilot.is_some() => {
                let code = pilot::allocate(job, self.arguments)?;
                if code != 0 || part.pilot_only {
                    return Ok(ControlFlow::Break(code));
                }
            }
            _ if part.pilot.is_some() => {
                return Err(Failure::command_line("--pilot is for --adaptive=unbiased"));
            }
            _ => {}
        }
        let total = job.header.total();
        if let Some([index, count]) = self.shard {
            let part = job.header.part(index, count);
            if part.is_empty() && job.header.allocation.is_some() {
                output::note(format_args!("part {index} of {count} has no samples: nothing to do"));
                return Ok(ControlFlow::Break(0));
            }
            if part.is_empty() {
                return Err(Failure::command_line(format!(
                    "--shard {index}/{count}: of {total} samples nothing is left for this part: use at most {total} parts"
                )));
            }
            (job.header.wanted, job.header.shard) = ([part.start, part.end], self.shard);
        }
        if let Some([start, end]) = part.samples {
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
        Ok(ControlFlow::Continue(()))
    }
}
