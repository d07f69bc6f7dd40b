//! What is decided before a rendering whose samples go where they are worth it: by a pilot, or by the film in which
//! one was saved.

use std::path::Path;

use super::args::Render;
use super::films::{describe, save};
use super::interrupt::Interrupt;
use super::job::Job;
use super::{Failure, output};
use crate::film::Allocation;
use crate::formats::film_file::{self, Header};
use crate::render::adaptive;

/// Says in the job's header how many samples blocks get. The exit code is 0 unless it was interrupted.
pub fn allocate(job: &mut Job, arguments: &Render) -> Result<u8, Failure> {
    let saved = arguments.part.pilot.as_deref();
    if let Some(path) = saved.filter(|path| path.exists()) {
        job.header.allocation = Some(load(job, path)?);
        return Ok(0);
    }
    saved.map_or(Ok(()), film_file::writable)?;
    let interrupt = Interrupt::watch();
    let mut session = job.session(&arguments.work);
    if !session.allocate(interrupt.flag(), &|_| ()) {
        return Ok(interrupt.exit_code());
    }
    job.header.allocation.clone_from(&session.gathered().allocation);
    if let Some(path) = saved {
        let mut header = job.header.clone();
        describe(&mut header, session.gathered());
        save(path, &header, session.gathered())?;
        if arguments.part.pilot_only && !arguments.work.quiet {
            output::say(
                &format!("pilot     {}: {} samples\n", path.display(), output::samples(&header)),
                false,
            )?;
        }
    }
    Ok(0)
}

/// What a pilot of the same rendering has chosen, or of one of which this is a part of the image.
fn load(job: &Job, path: &Path) -> Result<Allocation, Failure> {
    let header = film_file::load_header(path)?;
    let wrong = |reason: String| {
        Failure::file(format!("{}: {reason}: remove it, or choose another --pilot", path.display()))
    };
    let (whole, part) = (header.region, job.header.region);
    let same = Header { region: part, ..header.clone() };
    if let Some(what) = same.difference(&job.header) {
        return Err(wrong(format!("it is {what}")));
    }
    let blocks = adaptive::blocks(whole).len();
    let sound = |allocation: &Allocation| allocation.is_sound() && allocation.samples().len() == blocks;
    let allocation = header.allocation.filter(sound).ok_or_else(|| wrong("it is no pilot's".into()))?;
    let [x, y] = [part.x0, part.y0];
    adaptive::allocation_of_part(&allocation, whole, part)
        .ok_or_else(|| wrong(format!("it says nothing of the pixels from {x},{y} on")))
}
