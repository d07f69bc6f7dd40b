//! Runs render jobs.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::checkpoint::{self, Checkpoint};
use super::films::{describe, gathered_of, save, uneven_blur, write_to_stdout};
use super::image::OutputImage;
use super::live_views::LiveViews;
use super::outputs::{Outputs, check_output_conflicts, denoised_name};
use super::report::RenderReport;
use super::saving::Saved;
use super::stop::{StopLimits, StopRules, pass_end};
use super::{Job, aov};
use crate::check;
use crate::cli::interrupt::{self, Interrupt};
use crate::cli::{command_line, failure::Failure, output, process_times};
use crate::error::Diagnostic;
use crate::formats::film_file::{self, FilmFile, FilmHeader};
use crate::formats::picture::{ImageEncoding, Opacity, fits, supported};
use crate::integrator::Stop;
use crate::render::{MemoryEstimate, Options, Progress, Session};
use crate::study::explain::Recipe;
use crate::world::{Settings, SourceFiles};

/// The request to run a job.
pub struct RunRequest<'a> {
    /// The output files.
    pub outputs: Outputs,
    /// True if each image is written denoised as well.
    pub denoises: bool,
    /// The bits per channel of PNG files.
    pub bits: u8,
    /// The rules for stopping.
    pub stop: StopLimits,
    /// The interval between checkpoints, if there are any.
    pub checkpoint: Option<Duration>,
    /// The options of execution.
    pub work: Options,
    /// True if neither progress nor a summary is shown.
    pub quiet: bool,
    /// True if statistics are printed as JSON.
    pub json: bool,
    /// The live views of the image.
    pub views: &'a LiveViews,
    /// The files whose change ends the run; nothing is written then.
    pub watched: Option<&'a SourceFiles>,
}

/// Renders the rest of a job and writes its outputs. `found` is a film to continue.
pub fn execute(mut job: Job, wanted: &RunRequest, found: Option<FilmFile>) -> Result<u8, Failure> {
    let RunRequest { outputs, denoises, work, .. } = wanted;
    let images = aov::with_file(&outputs.images, &job.header.settings.aov);
    check_outputs(wanted, &images, &job.header)?;
    job.header.note.outputs.clone_from(&outputs.images);
    // The path, and whether the file stays.
    let checkpoint_to = match (wanted.checkpoint, &outputs.film, outputs.images.first()) {
        (Some(_), Some(film), _) => Some((film.clone(), true)),
        (Some(_), None, Some(image)) => Some((checkpoint::free(image, &job.header, wanted.quiet), false)),
        _ => None,
    };
    checkpoint_to.iter().try_for_each(|(path, _)| film_file::writable(path))?;
    let found = match (found, &checkpoint_to) {
        (None, Some((path, false))) => checkpoint::left_behind(path, &job.header)?,
        (found, _) => found,
    };
    let needs = MemoryEstimate {
        region: job.header.region,
        to_openexr: outputs.stdout_image == Some(ImageEncoding::OpenExr)
            || images.iter().any(|path| aov::holds(path)),
        denoises: *denoises,
        schedule: work.schedule,
        wave: work.wave,
        shown: wanted.views.pictures(),
        saves_film: checkpoint_to.is_some() || outputs.film.is_some(),
        has_film: found.is_some(),
    };
    needs.check(&job.setup, &job.header.settings)?;
    let mut session = match found {
        Some(film) => resumed_session(&mut job, film, wanted)?,
        None => job.session(work),
    };
    job.header.note.hosts.extend(process_times::host().filter(|host| !job.header.note.hosts.contains(host)));

    let start = Instant::now();
    let cpu = process_times::cpu_seconds();
    let before = job.header.note.seconds;
    let checkpoint = checkpoint_to.zip(wanted.checkpoint);
    let checkpoint = checkpoint
        .map(|((path, is_wanted), every)| Checkpoint::new(path, is_wanted, every, job.header.clone()));
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
    if let Some(fault) =
        uneven_blur(&job.header).filter(|_| !images.is_empty() || outputs.stdout_image.is_some())
    {
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

/// Checks that the outputs can be written, and replace neither each other nor the scene's files.
fn check_outputs(wanted: &RunRequest, images: &[PathBuf], header: &FilmHeader) -> Result<(), Failure> {
    let RunRequest { outputs, denoises, .. } = wanted;
    let (size, opacity) = ([header.region.width(), header.region.height()], Opacity::of(&header.settings));
    images.iter().try_for_each(|path| supported(path).and_then(|()| fits(path, size, opacity)))?;
    if let Some(encoding) = outputs.stdout_image {
        encoding.fits(size, opacity).map_err(Failure::command_line)?;
    }
    if outputs.video.is_some() && opacity == Opacity::Stored {
        let reason = "a video holds no transparent pixels: name images, such as -o frame.####.png";
        return Err(Failure::command_line(reason));
    }
    if *denoises {
        outputs.images.iter().try_for_each(|path| supported(&denoised_name(path)))?;
    }
    outputs.film.iter().try_for_each(|path| film_file::writable(path))?;
    let all = Outputs { images: images.to_vec(), ..outputs.clone() };
    check_output_conflicts(&all, *denoises, &header.scene)
}

/// Writes the images and reports what was done.
fn finish(
    job: Job,
    wanted: &RunRequest,
    session: &Session,
    images: &[PathBuf],
    mut saved: Saved,
) -> Result<(), Failure> {
    if session.leaves_photons_out() && !wanted.quiet {
        output::note(format_args!(
            "note: photons would show as single dots here, so caustics are left to chance: --caustics 1 brings them"
        ));
    }
    let Job { header, names, authored, mut findings, mut phases, .. } = job;
    let start = Instant::now();
    let denoised = if wanted.denoises { session.denoised() } else { None };
    phases.denoise = start.elapsed();
    if wanted.denoises && denoised.is_none() {
        output::note("warning: nothing is denoised: that takes two samples of each pixel (--spp 2 or more)");
    }
    let start = Instant::now();
    let picture = OutputImage::new(&header, session.film(), wanted.bits);
    let Ok(picture) = picture.map_err(|failure| saved.pixels(Err(failure))) else {
        // A backplate that has vanished meanwhile costs the images, not the film.
        return saved.end(&header, session.state());
    };
    let has_layers = !images.is_empty() || wanted.outputs.stdout_image == Some(ImageEncoding::OpenExr);
    let mut channels = if has_layers { session.channels(&header.settings.aov) } else { Vec::new() };
    let layered = Outputs { images: images.to_vec(), ..wanted.outputs.clone() };
    channels.extend(aov::light_layers(session.film(), &header, &layered));
    let manifest = aov::manifest(&channels, &names, session.scene());
    picture.write(images, &channels, manifest.clone(), &mut saved);
    if let Some(encoding) = wanted.outputs.stdout_image {
        saved.pixels(picture.write_to_stdout(encoding, denoised.as_ref(), &channels, manifest));
    }
    if let Some(video) = wanted.outputs.video {
        saved.pixels(picture.write_to_video(video, denoised.as_ref()));
    }
    let clean = denoised
        .as_ref()
        .map(|denoised| (denoised, picture.write_denoised(&wanted.outputs.images, denoised, &mut saved)));
    phases.save += start.elapsed();
    let denoised = clean.as_ref().map(|(denoised, paths)| (*denoised, &paths[..]));
    if !wanted.quiet && session.is_done() {
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
    let text = match (wanted.json, wanted.quiet) {
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
    let shown = check::FinishedImage { film: session.film(), tonemap, exposure_ev };
    let outliers = check::outliers(session).into_iter().map(|outlier| {
        let (moment, _) = header.view.moment_of(outlier.sample, header.settings.samples);
        let recipe = Recipe {
            path: header.scene.path.clone(),
            options: header.view.at(moment).options,
            camera: header.view.camera.clone(),
            authored: authored.clone(),
            settings: header.settings.clone(),
            is_moved: false,
        };
        let replay = command_line::of_explain(&recipe, outlier.pixel, outlier.sample);
        Diagnostic::warning("outlier", outlier.to_string()).fixed_by_command(replay, " shows its path")
    });
    let finding = check::of_image(session.setup(), &shown, told);
    finding.into_iter().chain(outliers).collect()
}

/// Returns a session that continues a film.
fn resumed_session(job: &mut Job, film: FilmFile, wanted: &RunRequest) -> Result<Session, Failure> {
    let (note, begun) = (film.header.note.clone(), film.header.begun.is_some());
    let wrong =
        || Failure::file("the film's header is inconsistent (sample ranges and tiles): render it again");
    let gathered = gathered_of(film).ok_or_else(wrong)?;
    let count = gathered.samples.count();
    let session = job
        .going_on(&wanted.work, gathered)
        .ok_or_else(|| Failure::file("the film is of other pixels than the image: render it again"))?;
    let header = &mut job.header;
    if !wanted.quiet && !session.is_done() {
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
    let looking = wanted.views.attach(session, &job.header.settings, wanted.quiet);
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
    if interrupt.exit_code() != 0 && wanted.watched.is_none() && !wanted.quiet {
        let (done, all) = session.samples_done();
        output::note(format_args!("interrupted after {done} of {all} samples: what there is has been saved"));
    }
    if let Some(missed) = rules.missed(session).filter(|_| !wanted.quiet) {
        output::note(missed);
    }
    Ok((interrupt.exit_code(), stopped_by))
}
