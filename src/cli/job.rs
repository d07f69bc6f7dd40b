//! Render jobs, from a command line or a film file to the outputs.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::checkpoint::{self, Checkpoint};
use super::films::{describe, gathered_of, save, write_to_stdout};
use super::interrupt::{self, Interrupt};
use super::job_args::{CheckpointEvery, OutputOptions, Outputs, StopOptions, WorkOptions};
use super::live_views::LiveViews;
use super::loading::{LoadSession, LoadedScene, check_against_full_compile, compiled};
use super::output::{self, OutputImage};
use super::report::{Phases, RenderReport};
use super::saving::Saved;
use super::stop::{StopRules, pass_end};
use super::{Failure, aov, command_line, process_times};
use crate::check;
use crate::error::{Diagnostic, Severity};
use crate::film::Region;
use crate::formats::film_file::{self, FilmFile, FilmHeader, Note, PROGRAM, RenderedView};
use crate::formats::picture::supported;
use crate::integrator::{RenderSetup, Stop};
use crate::render::{MemoryEstimate, OnProgress, Options, Progress, RenderState, Session, adaptive};
use crate::study::explain::Recipe;
use crate::world::{Adaptive, Aov, Settings, SourceFiles, World};

/// A scene that is ready to be rendered.
pub struct Job {
    /// The header of its film.
    pub header: FilmHeader,
    /// The render setup.
    pub setup: Arc<RenderSetup>,
    /// The names of entities, if they are needed.
    pub names: HashMap<u32, String>,
    /// The settings in the scene's file.
    authored: Settings,
    /// The probable mistakes in the scene.
    findings: Vec<Diagnostic>,
    /// The time taken so far.
    pub phases: Phases,
    /// The data shared with other moments of the scene.
    reuse: LoadSession,
    /// The index of the moment that `setup` is of, for motion blur.
    moment: u32,
}

impl Job {
    /// Reads a scene and prepares it. `change` applies options to the world.
    pub fn load(
        path: &Path,
        view: RenderedView,
        quiet: bool,
        change: impl Fn(&mut World),
    ) -> Result<Job, Failure> {
        let mut reuse = LoadSession::new(view.moments() > 1);
        Self::load_frame(path, view, quiet, &mut reuse, change)
    }

    /// Reads and prepares one of several frames, as [`Job::load`] does. `reuse` passes data from one frame to the next.
    pub fn load_frame(
        path: &Path,
        view: RenderedView,
        quiet: bool,
        reuse: &mut LoadSession,
        change: impl Fn(&mut World),
    ) -> Result<Job, Failure> {
        let sources = SourceFiles::with(reuse.kept.clone());
        // Recorded even if loading fails: fixing it means changing one of these files.
        reuse.sources = sources.clone();
        let mut told = std::mem::take(&mut reuse.told);
        let mut tell = |diagnostic: &Diagnostic| {
            if told.insert(diagnostic.to_string()) {
                let kind = if diagnostic.severity == Severity::Note { "note" } else { "warning" };
                output::note(format_args!("{kind}: {diagnostic}"));
            }
        };
        let tell: Option<&mut dyn FnMut(&Diagnostic)> = if quiet { None } else { Some(&mut tell) };
        let found = compiled(path, &view.at(0), reuse, &sources, tell, &change);
        reuse.told = told;
        let LoadedScene { compiled, setup, findings, settings, authored, source, names, phases } = found?;
        reuse.kept.forget_unused();
        if reuse.paranoid && reuse.before.is_some() {
            check_against_full_compile(path, &view.at(0), &compiled, &change)?;
            if !quiet {
                output::note("--paranoid: the same as compiled by itself");
            }
        }
        if settings.adaptive != Adaptive::Off && view.moments() > 1 {
            let reason = "adaptive samples need all of the time at once";
            return Err(Failure::command_line(format!("--shutter: {reason}: add --adaptive=off")));
        }
        let setup = Arc::new(setup);
        if reuse.several {
            reuse.before = Some(compiled);
        }
        let header = FilmHeader {
            program: PROGRAM.into(),
            scene: source,
            view,
            region: Region::whole(settings.size),
            unit: setup.unit,
            variance: settings.aov.contains(&Aov::Variance),
            wanted: [0, settings.samples],
            settings,
            samples: Vec::new(),
            most: 0,
            begun: None,
            rays: None,
            allocation: None,
            shard: None,
            film_hash: String::new(),
            moments_hash: None,
            note: Note { command: command_line::recorded_args(), ..Note::default() },
        };
        Ok(Job { header, setup, names, authored, findings, phases, reuse: reuse.clone(), moment: 0 })
    }

    /// Renders as [`Session::advance_until`] does, with the scene at the moment of the next samples.
    pub fn advance(
        &mut self,
        session: &mut Session,
        count: u32,
        stop: &Stop,
        progress: OnProgress,
    ) -> Result<(), Failure> {
        let (view, samples) = (&self.header.view, self.header.settings.samples);
        let pass = session.state().pass.as_ref().map(|pass| pass.samples.start);
        let next = pass.or_else(|| session.next_sample()).unwrap_or(0);
        let (moment, end) = view.moment_of(next, samples);
        let count = count.min(end.saturating_sub(next)).max(1);
        self.move_to(moment)?;
        if !Arc::ptr_eq(&self.setup, session.setup()) {
            session.replace_setup(self.setup.clone());
        }
        session.advance_until(count, stop, progress);
        Ok(())
    }

    /// Prepares the scene at a moment.
    fn move_to(&mut self, moment: u32) -> Result<(), Failure> {
        if moment == self.moment {
            return Ok(());
        }
        let FilmHeader { scene, view, settings, .. } = &self.header;
        let sources = SourceFiles::with(self.reuse.kept.clone());
        let found = compiled(&scene.path, &view.at(moment), &self.reuse, &sources, None, |world| {
            world.settings = settings.clone()
        })?;
        self.reuse.kept.forget_unused();
        if let Some(what) = found.source.difference(scene) {
            return Err(Failure::file(format!("{}: it has changed meanwhile: {what}", scene.path.display())));
        }
        // A film has only one unit.
        let setup = RenderSetup { unit: self.setup.unit, ..found.setup };
        (self.setup, self.moment) = (Arc::new(setup), moment);
        self.reuse.before = Some(found.compiled);
        self.phases.load += found.phases.load;
        self.phases.compile += found.phases.compile;
        Ok(())
    }

    /// Restricts rendering to a region of the image.
    pub fn crop(&mut self, crop: Option<Region>) -> Result<(), Failure> {
        let [width, height] = self.header.settings.size;
        match crop {
            Some(Region { x1, y1, .. }) if x1 > width || y1 > height => {
                let image = format!("beyond the image of {width}x{height}");
                Err(Failure::command_line(format!("--crop ends at {x1},{y1}, {image}")))
            }
            Some(region) => {
                self.header.region = region;
                Ok(())
            }
            None => Ok(()),
        }
    }

    /// Returns a session that continues a render; `None` if `gathered` cannot be the state of this job.
    pub fn going_on(&self, work: &WorkOptions, gathered: RenderState) -> Option<Session> {
        let FilmHeader { wanted: [start, end], region, settings, .. } = &self.header;
        let options = self.options(work, *region);
        let session = Session::going_on(self.setup.clone(), settings.samples, options, gathered);
        session.map(|session| session.with_samples(*start..*end))
    }

    fn options(&self, work: &WorkOptions, region: Region) -> Options {
        let defaults = Options::default();
        Options {
            schedule: work.schedule.into(),
            wave: work.wave as usize,
            isa: work.simd.unwrap_or(defaults.isa),
            region: Some(region),
            variance: self.header.variance,
            ..defaults
        }
    }

    /// Returns a session in which nothing is rendered yet.
    pub fn session(&self, work: &WorkOptions) -> Session {
        self.session_of(work, self.header.region)
    }

    /// Returns a session for a part of the image, in which nothing is rendered yet.
    pub fn session_of(&self, work: &WorkOptions, region: Region) -> Session {
        let options = self.options(work, region);
        let FilmHeader { wanted: [start, end], allocation, region: whole, settings, .. } = &self.header;
        let allocation = allocation
            .as_ref()
            .and_then(|allocation| adaptive::allocation_of_part(allocation, *whole, region));
        Session::of(self.setup.clone(), settings.samples, options)
            .with_samples(*start..*end)
            .with_allocation(allocation)
    }
}

/// The request to run a job.
pub struct RunRequest<'a> {
    /// The output files.
    pub outputs: Outputs,
    /// The options of outputs.
    pub output: &'a OutputOptions,
    /// The rules for stopping.
    pub stop: &'a StopOptions,
    /// The options of execution.
    pub work: &'a WorkOptions,
    /// The live views of the image.
    pub onlookers: &'a LiveViews,
    /// The files whose change ends the run; nothing is written then.
    pub watched: Option<&'a SourceFiles>,
}

impl RunRequest<'_> {
    /// Returns the path of checkpoints, whether that file is kept, and the interval between saves.
    fn checkpoint(&self) -> Option<(PathBuf, bool, Duration)> {
        let every = match self.stop.checkpoint {
            None if self.watched.is_some() => return None,
            Some(CheckpointEvery::Off) => return None,
            Some(CheckpointEvery::Time(time)) => time,
            None => Duration::from_secs(60),
        };
        match &self.outputs.film {
            Some(film) => Some((film.clone(), true, every)),
            None => Some((self.outputs.images.first()?.with_extension(checkpoint::EXTENSION), false, every)),
        }
    }
}

/// Renders the rest of a job and writes its outputs. `found` is a film to continue.
pub fn execute(mut job: Job, wanted: &RunRequest, found: Option<FilmFile>) -> Result<u8, Failure> {
    let outputs = &wanted.outputs;
    let images = aov::with_file(&outputs.images, &job.header.settings.aov);
    images.iter().try_for_each(|path| supported(path))?;
    if wanted.output.denoise {
        outputs.images.iter().try_for_each(|path| supported(&output::denoised_name(path)))?;
    }
    outputs.film.iter().try_for_each(|path| film_file::writable(path))?;
    let all = Outputs { images: images.clone(), ..outputs.clone() };
    output::check_output_conflicts(&all, wanted.output.denoise, &job.header.scene)?;
    let (schedule, wave) = (wanted.work.schedule.into(), wanted.work.wave as usize);
    let to_openexr = images.iter().any(|path| aov::holds(path));
    let (region, denoises) = (job.header.region, wanted.output.denoise);
    job.header.note.outputs = outputs.images.clone();
    let checkpoint_to = wanted.checkpoint().map(|(path, is_wanted, every)| {
        let path = if is_wanted { path } else { checkpoint::free(path, &job.header, wanted.work.quiet) };
        (path, is_wanted, every)
    });
    if let Some((path, ..)) = &checkpoint_to {
        film_file::writable(path)?;
    }
    let found = match (found, &checkpoint_to) {
        (None, Some((path, false, _))) => checkpoint::left_behind(path, &job.header)?,
        (found, _) => found,
    };
    let (shown, saves_film) =
        (wanted.onlookers.pictures(), checkpoint_to.is_some() || outputs.film.is_some());
    let has_film = found.is_some();
    let needs = MemoryEstimate { region, to_openexr, denoises, schedule, wave, shown, saves_film, has_film };
    needs.check(&job.setup, &job.header.settings)?;
    let mut session = match found {
        Some(film) => resumed_session(&mut job, film, wanted.work)?,
        None => job.session(wanted.work),
    };
    job.header.note.hosts.extend(process_times::host().filter(|host| !job.header.note.hosts.contains(host)));

    let start = Instant::now();
    let cpu = process_times::cpu_seconds();
    let before = job.header.note.seconds;
    let checkpoint = checkpoint_to
        .map(|(path, is_wanted, every)| Checkpoint::new(path, is_wanted, every, job.header.clone()));
    let interrupt = Interrupt::watch();
    if interrupt.is_set() {
        // Interrupted between two frames.
        return Ok(interrupt.exit_code());
    }
    interrupt.begin_anew();
    let passed = interrupt::while_unchanged(wanted.watched, &interrupt, || {
        passes(&mut job, &mut session, wanted, checkpoint.as_ref(), &interrupt)
    });
    let (code, stopped_by) = passed?;
    if wanted.watched.is_some() && code == 0 && interrupt.flag().load(Ordering::Acquire) {
        return Ok(0);
    }
    if job.header.view.moments() > 1 {
        // The depths and normals of moving objects are those of the middle moment.
        job.move_to(job.header.view.moments() / 2)?;
        session.replace_setup(job.setup.clone());
    }
    job.phases.render = start.elapsed();
    job.phases.render_cpu = process_times::cpu_seconds().zip(cpu).map(|(after, before)| after - before);
    job.header.note.seconds = before + job.phases.render.as_secs_f64();
    job.header.note.stopped_by = stopped_by;
    describe(&mut job.header, session.state());
    session.free_workers();
    if let Some(fault) = output::uneven_blur(&job.header).filter(|_| !images.is_empty()) {
        output::note(format_args!("warning: {fault}"));
        job.findings.push(fault);
    }

    let start = Instant::now();
    let mut saved = Saved::default();
    // The film is saved before the images, because these can be made again from it.
    if let Some(checkpoint) = &checkpoint {
        let ends = [!session.is_done(), interrupt.is_set()];
        checkpoint.save_end(&job.header, session.state(), ends, &mut saved);
    } else if let Some(path) = &outputs.film {
        saved.film(path, save(path, &job.header, session.state()));
    }
    if outputs.to_stdout {
        saved.pixels(write_to_stdout(&job.header, session.state()));
    }
    job.phases.save = start.elapsed();
    finish(job, wanted, &session, &images, saved)?;
    if let Some(checkpoint) = checkpoint.filter(|_| session.is_done()) {
        checkpoint.remove();
    }
    Ok(code)
}

/// Writes the images and reports what was done.
fn finish(
    job: Job,
    wanted: &RunRequest,
    session: &Session,
    images: &[PathBuf],
    mut saved: Saved,
) -> Result<(), Failure> {
    if session.leaves_photons_out() && !wanted.work.quiet {
        output::note(format_args!(
            "note: photons would show as single dots here, so caustics are left to chance: --caustics 1 brings them"
        ));
    }
    let Job { header, names, authored, mut findings, mut phases, .. } = job;
    let start = Instant::now();
    let denoised = if wanted.output.denoise { session.denoised() } else { None };
    phases.denoise = start.elapsed();
    if wanted.output.denoise && denoised.is_none() {
        output::note("warning: nothing is denoised: that takes two samples of each pixel (--spp 2 or more)");
    }
    let start = Instant::now();
    let picture = OutputImage::new(&header, session.film(), wanted.output.bits);
    let channels = if images.is_empty() { Vec::new() } else { session.channels(&header.settings.aov) };
    let manifest = aov::manifest(&channels, &names, session.scene());
    picture.write(images, &channels, manifest, &mut saved);
    if let Some(video) = wanted.outputs.video {
        saved.pixels(picture.write_to_video(video, denoised.as_ref()));
    }
    let clean = denoised
        .as_ref()
        .map(|denoised| (denoised, picture.write_denoised(&wanted.outputs.images, denoised, &mut saved)));
    phases.save += start.elapsed();
    let denoised = clean.as_ref().map(|(denoised, paths)| (*denoised, &paths[..]));
    if !wanted.work.quiet && session.is_done() {
        for fault in faults((&header, &authored), session, &picture, !findings.is_empty()) {
            output::note(format_args!("warning: {fault}"));
            findings.push(fault);
        }
    }
    let report = RenderReport {
        findings: &findings,
        header: &header,
        outputs: &saved.images,
        film: wanted.outputs.film.as_deref().filter(|_| saved.film.is_some()),
        session,
        exposure_ev: picture.exposure_ev,
        denoised,
        phases,
    };
    let text = match (wanted.work.json, wanted.work.quiet) {
        (true, _) => format!("{}\n", report.json()),
        (false, false) => report.text(),
        (false, true) => String::new(),
    };
    saved.report(output::print_text(&text, wanted.outputs.takes_stdout()));
    saved.end(&header, session.state())
}

/// Returns the probable mistakes in a finished image. `told` is true if findings about its scene have been reported.
fn faults(
    (header, authored): (&FilmHeader, &Settings),
    session: &Session,
    picture: &OutputImage,
    told: bool,
) -> Vec<Diagnostic> {
    let (tonemap, exposure_ev) = (header.settings.tonemap, picture.exposure_ev);
    let shown =
        check::FinishedImage { region: header.region, radiance: picture.radiance(), tonemap, exposure_ev };
    let outliers = check::outliers(session).into_iter().map(|outlier| {
        let (moment, _) = header.view.moment_of(outlier.sample, header.settings.samples);
        let recipe = Recipe {
            path: header.scene.path.clone(),
            options: header.view.at(moment).load_options(),
            camera: header.view.camera.clone(),
            authored: authored.clone(),
            settings: header.settings.clone(),
            is_moved: false,
        };
        let replay = command_line::of_explain(&recipe, outlier.pixel, outlier.sample);
        Diagnostic::warning("outlier", outlier.to_string()).fixed_by(format!("`{replay}` shows its path"))
    });
    let finding = check::of_image(session.setup(), &shown, told);
    finding.into_iter().chain(outliers).collect()
}

/// Returns a session that continues a film.
fn resumed_session(job: &mut Job, film: FilmFile, work: &WorkOptions) -> Result<Session, Failure> {
    let (note, begun) = (film.header.note.clone(), film.header.begun.is_some());
    let wrong =
        || Failure::file("the film's header is inconsistent (sample ranges and tiles): render it again");
    let gathered = gathered_of(film).ok_or_else(wrong)?;
    let count = gathered.samples.count();
    let session = job
        .going_on(work, gathered)
        .ok_or_else(|| Failure::file("the film is of other pixels than the image: render it again"))?;
    let header = &mut job.header;
    if !work.quiet && !session.is_done() {
        let more = if begun { ", and of some tiles more" } else { "" };
        let [start, end] = header.wanted;
        output::note(format_args!("going on with {count} of {} samples{more}", end - start));
    }
    (header.note.hosts, header.note.seconds) = (note.hosts, note.seconds);
    Ok(session)
}

/// Renders pass after pass until done, stopped by a rule or interrupted; returns the exit code and the rule that
/// stopped it.
fn passes(
    job: &mut Job,
    session: &mut Session,
    wanted: &RunRequest,
    checkpoint: Option<&Checkpoint>,
    interrupt: &Interrupt,
) -> Result<(u8, Option<String>), Failure> {
    let looking = wanted.onlookers.attach(session, &job.header.settings, wanted.work.quiet);
    let rules = StopRules::new(wanted.stop, session);
    let stop = Stop::at(interrupt.flag()).with_deadline(rules.deadline());
    let mut stopped_by = None;
    while !session.is_done() && !stop.is_set() {
        stopped_by = rules.holds(session);
        if stopped_by.is_some() {
            break;
        }
        let count = rules.limit(pass_end(session), session);
        let watch = |progress: &Progress| {
            looking.progress(progress);
            if checkpoint.is_some_and(Checkpoint::is_due) {
                progress.pause.store(true, Ordering::Relaxed);
            }
        };
        job.advance(session, count, &stop, &watch)?;
        if session.state().pass.is_none() {
            looking.passed(session);
        }
        // The last state is saved by the caller.
        let goes_on = !session.is_done() && !stop.is_set();
        if let Some(checkpoint) = checkpoint.filter(|checkpoint| goes_on && checkpoint.is_due()) {
            checkpoint.save(session.state());
        }
    }
    looking.finish(session);
    if interrupt.exit_code() == 0 && stopped_by.is_none() {
        stopped_by = rules.overdue(session);
        if stopped_by.is_some() && session.samples_done().0 == 0 {
            output::note(
                "warning: --max-time: one sample of each pixel takes longer: pixels that have none are black",
            );
        }
    }
    if interrupt.exit_code() != 0 && wanted.watched.is_none() && !wanted.work.quiet {
        let (done, all) = session.samples_done();
        output::note(format_args!("interrupted after {done} of {all} samples: what there is has been saved"));
    }
    if let Some(missed) = rules.missed(session).filter(|_| !wanted.work.quiet) {
        output::note(missed);
    }
    Ok((interrupt.exit_code(), stopped_by))
}
