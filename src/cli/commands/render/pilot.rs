//! Decisions before rendering: the number of samples of each block under adaptive sampling (by a pilot, or by the film
//! in which one was saved), and the exposure of frames.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::cli::args::Render;
use crate::cli::job::{Job, deadline, describe, samples, save};
use crate::cli::{failure::Failure, interrupt::Interrupt, output};
use crate::film::{self, Allocation};
use crate::formats::film_file::{self, FilmHeader};
use crate::integrator::Stop;
use crate::render::{MemoryEstimate, Options, Session, adaptive};

/// Stores the number of samples of each block in the job's header. Returns the exit code, which is 0 unless it was
/// interrupted.
pub fn allocate(job: &mut Job, arguments: &Render) -> Result<u8, Failure> {
    let Render { part, run, .. } = arguments;
    let saved = part.pilot.as_deref();
    if let Some(path) = saved.filter(|path| path.exists()) {
        job.header.allocation = Some(load(job, path)?);
        return Ok(0);
    }
    saved.map_or(Ok(()), film_file::writable)?;
    MemoryEstimate::usual(job.header.region).check(&job.setup, &job.header.settings)?;
    let interrupt = Interrupt::watch();
    let mut session = job.session(&run.work.options());
    let stop = Stop::at(interrupt.flag()).with_deadline(deadline(Instant::now(), run.stop.max_time));
    if !session.allocate(&stop, &|_| ()) {
        if interrupt.is_set() {
            return Ok(interrupt.exit_code());
        }
        let reason = "the pilot that chooses how many samples each block gets takes longer";
        return Err(Failure::command_line(format!(
            "--max-time: {reason}: raise --max-time, or --adaptive=off"
        )));
    }
    job.header.allocation.clone_from(&session.state().allocation);
    if let Some(path) = saved {
        let mut header = job.header.clone();
        describe(&mut header, session.state());
        save(path, &header, session.state())?;
        if part.pilot_only && !run.work.quiet {
            output::print(&format!("pilot     {}: {} samples\n", path.display(), samples(&header)))?;
        }
    }
    Ok(0)
}

/// The longer side in pixels, and the samples per pixel, of the small image that determines the exposure of frames.
const EXPOSING: (u32, u32) = (192, 16);

/// Returns the exposure in stops of all frames of an animation, if it is to be automatic: that of a small image of the
/// first frame, `job`. So frames do not flicker, and processes that render some of them agree. Also returns `None` if it was
/// interrupted.
pub fn exposure_ev(job: &Job, max_time: Option<Duration>) -> Result<Option<f32>, Failure> {
    let settings = &job.header.settings;
    if !settings.auto_exposure {
        return Ok(None);
    }
    let (longer_side, samples) = EXPOSING;
    let small = Arc::new(job.setup.small(longer_side));
    let mut session = Session::of(small, samples, Options::default());
    let interrupt = Interrupt::watch();
    let stop = Stop::at(interrupt.flag()).with_deadline(deadline(Instant::now(), max_time));
    match session.finish_while(&stop, |_| (), |_| true) {
        true => Ok(Some(film::exposure::exposure_ev(settings, session.film()))),
        false if interrupt.is_set() => Ok(None),
        false => Err(Failure::command_line(
            "--max-time: the small image that chooses the exposure of all frames takes longer: choose it: --exposure 0, or raise --max-time",
        )),
    }
}

/// Loads the allocation that a pilot has chosen for the same render, or for one whose image contains this one.
fn load(job: &Job, path: &Path) -> Result<Allocation, Failure> {
    let header = film_file::load_header(path)?;
    let wrong = |reason: String| {
        Failure::file(format!("{}: {reason}: remove it, or choose another --pilot", path.display()))
    };
    let (whole, part) = (header.region, job.header.region);
    let same = FilmHeader { region: part, ..header.clone() };
    if let Some(what) = same.difference(&job.header) {
        return Err(wrong(format!("it is {what}")));
    }
    let blocks = adaptive::blocks(whole).len();
    let sound = |allocation: &Allocation| allocation.is_sound() && allocation.samples().len() == blocks;
    let allocation =
        header.allocation.filter(sound).ok_or_else(|| wrong("it was not saved by a pilot".into()))?;
    let [x, y] = [part.x0, part.y0];
    adaptive::allocation_of_part(&allocation, whole, part)
        .ok_or_else(|| wrong(format!("it says nothing of the pixels from {x},{y} on")))
}
