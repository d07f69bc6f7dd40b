//! Saves what there is while rendering continues.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::films::{describe, save};
use super::output;
use super::saving::Saved;
use crate::error::SaveError;
use crate::formats::film_file::{self, Header};
use crate::render::Gathered;
use crate::world::Content;

/// A file that holds the film as it was not long ago.
pub struct Checkpoint {
    path: PathBuf,
    /// Whether the file was asked for and stays.
    is_wanted: bool,
    every: Duration,
    header: Header,
    begun: Instant,
    saving: Mutex<Saving>,
}

struct Saving {
    last: Instant,
    /// The thread that writes the last state.
    writer: Option<JoinHandle<Result<(), SaveError>>>,
    /// Whether the file is this rendering's.
    saved: bool,
}

impl Checkpoint {
    /// The first save is after `every`. The header says everything except what is in the film.
    pub fn new(path: PathBuf, is_wanted: bool, every: Duration, header: Header) -> Checkpoint {
        let begun = Instant::now();
        let saving = Mutex::new(Saving { last: begun, writer: None, saved: false });
        Checkpoint { path, is_wanted, every, header, begun, saving }
    }

    /// Saves what has been gathered if it is time to. Another thread writes; while it does nothing more is
    /// saved.
    pub fn tick(&self, gathered: &dyn Fn() -> Gathered) {
        // Another worker is looking after it.
        let Ok(mut saving) = self.saving.try_lock() else { return };
        if saving.last.elapsed() < self.every
            || saving.writer.as_ref().is_some_and(|writer| !writer.is_finished())
        {
            return;
        }
        self.end(&mut saving);
        let (gathered, mut header, path) = (gathered(), self.header.clone(), self.path.clone());
        header.note.seconds += self.begun.elapsed().as_secs_f64();
        let write = move || {
            describe(&mut header, &gathered);
            save(&path, &header, &gathered)
        };
        saving.last = Instant::now();
        saving.writer = std::thread::Builder::new().name("checkpoint".into()).spawn(write).ok();
    }

    /// Waits for the writing thread, and reports what went wrong. Rendering goes on.
    fn end(&self, saving: &mut Saving) {
        let Some(written) = saving.writer.take().and_then(|writer| writer.join().ok()) else { return };
        match written {
            Ok(()) => saving.saved = true,
            Err(error) => output::tell(format_args!(
                "warning: {error} (the rendering goes on, and an older checkpoint is kept)"
            )),
        }
    }

    /// Saves the final state: always to a film that was asked for; otherwise only if samples are missing and
    /// rendering was interrupted or has taken long.
    pub fn save_end(
        &self,
        header: &Header,
        gathered: &Gathered,
        [has_more, is_interrupted]: [bool; 2],
        saved: &mut Saved,
    ) {
        let mut saving = self.saving.lock().unwrap_or_else(PoisonError::into_inner);
        self.end(&mut saving);
        if self.is_wanted {
            saved.film(&self.path, save(&self.path, header, gathered));
        } else if has_more && (is_interrupted || saving.saved || self.begun.elapsed() >= self.every) {
            saved.film(&self.path, save(&self.path, header, gathered));
            if saved.film.is_some() {
                let path = self.path.display();
                output::tell(format_args!("to go on: rayfront resume {path}"));
            }
        }
    }

    /// Called when everything is written and complete: removes the file unless it was asked for. If it cannot be
    /// removed, it does no harm.
    pub fn remove(self) {
        if !self.is_wanted && is_ours(&self.path, &self.header) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Whether a leftover file holds a part of what is now complete.
fn is_ours(path: &std::path::Path, header: &Header) -> bool {
    film_file::load_header(path).is_ok_and(|found| found.difference(header).is_none())
}

/// What replaces the extension of an image in the name of a film that nobody has asked for.
pub const EXTENSION: &str = "checkpoint.film";

/// Where such a film goes: to another name if the file holds hours of another rendering that could still be continued,
/// or something else. The name depends on what is rendered, so that the same command finds it again.
pub fn free(path: PathBuf, header: &Header, quiet: bool) -> PathBuf {
    let name = path.display();
    let (what, to_do) = match film_file::load_header(&path) {
        Ok(there) => match there.difference_of_job(header) {
            Some(what) => (what, format!("finish it with rayfront resume {name}, or remove it")),
            None => return path,
        },
        Err(_) if path.exists() => ("something else".to_owned(), "move it to another name".to_owned()),
        Err(_) => return path,
    };
    let job = (&header.scene.hash, &header.view, &header.settings, &header.region, &header.wanted);
    let hash = Content::of(format!("{job:?}").as_bytes()).hash as u32;
    let other = path.with_extension("").with_extension(format!("checkpoint-{hash:08x}.film"));
    if !quiet {
        let other = other.display();
        output::tell(format_args!(
            "note: {name} is {what} ({to_do}): this rendering is saved to {other} meanwhile"
        ));
    }
    other
}

/// Whether a film has the name of one that nobody has asked for, as [`free`] gives them.
pub fn is_checkpoint(name: &str) -> bool {
    let Some((_, end)) = name.strip_suffix(".film").and_then(|name| name.rsplit_once(".checkpoint")) else {
        return false;
    };
    let of_job = |hash: &str| hash.len() == 8 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    end.is_empty() || end.strip_prefix('-').is_some_and(of_job)
}

#[cfg(test)]
mod tests {
    use super::is_checkpoint;

    #[test]
    fn checkpoints_are_known_by_their_names() {
        assert!(is_checkpoint("a.checkpoint.film") && is_checkpoint("a.b.checkpoint-0123abcd.film"));
        for other in [
            "a.film",
            "a.checkpoints.film",
            "a.checkpoint-final.film",
            "a.checkpoint-0123abcd",
            "checkpoint.film",
        ] {
            assert!(!is_checkpoint(other), "{other}");
        }
    }
}
