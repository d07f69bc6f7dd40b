//! Checkpoints: saves the film in the course of a render.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::films::{describe, save};
use super::record;
use super::saving::Saved;
use crate::cli::{failure::Failure, output};
use crate::error::{LoadError, SaveError};
use crate::files::atomic_write::UnnamedFile;
use crate::formats::film_file::{self, FilmFile, FilmHeader};
use crate::render::RenderState;
use crate::world::FileDigest;

/// A file that holds a recent state of the film.
pub struct Checkpoint {
    path: PathBuf,
    /// True if the file was requested and stays.
    is_wanted: bool,
    every: Duration,
    header: FilmHeader,
    begun: Instant,
    saving: Mutex<Saving>,
}

struct Saving {
    /// The time at which the next save is due.
    next: Instant,
    /// The thread that waits until the last state is on disk.
    writer: Option<JoinHandle<Result<(), SaveError>>>,
    /// True if the file holds samples of this render.
    saved: bool,
}

/// The inverse of the largest fraction of the time that saving takes.
const SHARE: u32 = 10;

impl Checkpoint {
    /// Creates a checkpoint whose first save is due after `every`. The header describes everything except the film's
    /// contents.
    pub fn new(path: PathBuf, is_wanted: bool, every: Duration, header: FilmHeader) -> Checkpoint {
        let begun = Instant::now();
        let saving = Mutex::new(Saving { next: begun + every, writer: None, saved: false });
        Checkpoint { path, is_wanted, every, header, begun, saving }
    }

    /// True if it is time to save.
    pub fn is_due(&self) -> bool {
        // Another worker takes care of it.
        let Ok(saving) = self.saving.try_lock() else { return false };
        Instant::now() >= saving.next && saving.writer.as_ref().is_none_or(|writer| writer.is_finished())
    }

    /// Writes the state of the render while rendering pauses: a copy of the film to be written meanwhile would take as
    /// much memory again. Another thread waits for the disk.
    pub fn save(&self, gathered: &RenderState) {
        let mut saving = self.lock();
        self.end(&mut saving);
        let start = Instant::now();
        let mut header = self.header.clone();
        header.note.seconds += self.begun.elapsed().as_secs_f64();
        describe(&mut header, gathered);
        let written = film_file::begin(&self.path, &header, &gathered.film, gathered.moments.as_ref());
        match written.map(finished_elsewhere) {
            Ok(writer) => saving.writer = writer,
            Err(error) => tell(&error),
        }
        saving.next = Instant::now() + self.every.max(SHARE * start.elapsed());
    }

    /// Locks the state. Nothing panics while it holds the lock.
    fn lock(&self) -> MutexGuard<'_, Saving> {
        self.saving.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the writing thread and reports its error, if any. Rendering goes on.
    fn end(&self, saving: &mut Saving) {
        let Some(written) = saving.writer.take().and_then(|writer| writer.join().ok()) else { return };
        match written {
            Ok(()) => saving.saved = true,
            Err(error) => tell(&error),
        }
    }

    /// Saves the final state: always to a requested film; otherwise only if samples are missing and rendering was
    /// interrupted, has been saved before, or has taken at least one interval.
    pub fn save_end(
        &self,
        header: &FilmHeader,
        gathered: &RenderState,
        [has_more, is_interrupted]: [bool; 2],
        saved: &mut Saved,
    ) {
        let mut saving = self.lock();
        self.end(&mut saving);
        if self.is_wanted {
            saved.film(&self.path, save(&self.path, header, gathered));
        } else if has_more && (is_interrupted || saving.saved || self.begun.elapsed() >= self.every) {
            saved.film(&self.path, save(&self.path, header, gathered));
            if saved.film.is_some() {
                output::note(format_args!("to go on: {}", record::resume_own(&self.path, header)));
            }
        }
    }

    /// Removes the file unless it was requested; called when all outputs are written and complete. A file that cannot
    /// be removed does no harm.
    pub fn remove(self) {
        if !self.is_wanted && self.path.is_file() && is_ours(&self.path, &self.header) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Waits in a separate thread until a film is on disk, and renames it there.
fn finished_elsewhere(written: UnnamedFile) -> Option<JoinHandle<Result<(), SaveError>>> {
    // If no thread can be started, the older checkpoint stays.
    std::thread::Builder::new().name("checkpoint".into()).spawn(|| written.finish()).ok()
}

fn tell(error: &SaveError) {
    output::note(format_args!("warning: {error} (the rendering goes on, and an older checkpoint is kept)"));
}

/// True if a file holds samples of this render.
fn is_ours(path: &Path, header: &FilmHeader) -> bool {
    film_file::load_header(path).is_ok_and(|found| found.difference_of_job(header).is_none())
}

/// Returns the path for a film that was not requested, beside its image: another name if the file holds something else,
/// such as hours of another render that could still be continued. The name depends on what is rendered, so that the same
/// command finds it again.
pub fn free(image: &Path, header: &FilmHeader, quiet: bool) -> PathBuf {
    let path = image.with_extension("checkpoint.film");
    // Links are refused when they are written.
    if !path.exists() || path.is_symlink() {
        return path;
    }
    let name = path.display();
    let (what, to_do) = match film_file::load_header(&path) {
        Ok(there) => match there.difference_of_job(header) {
            Some(what) => (what, format!("finish it with {}, or remove it", record::resume(&path, &there))),
            None => return path,
        },
        Err(_) => ("something else".to_owned(), "move it to another name".to_owned()),
    };
    let job = (&header.scene.hash, &header.view, &header.settings, &header.region, &header.wanted);
    let hash = FileDigest::of(format!("{job:?}").as_bytes()).hash as u32;
    let other = path.with_extension("").with_extension(format!("checkpoint-{hash:08x}.film"));
    if !quiet {
        let other = other.display();
        output::note(format_args!(
            "note: {name} is {what} ({to_do}): this rendering is saved to {other} meanwhile"
        ));
    }
    other
}

/// Returns the film that an interrupted render of the same samples has left at a path. Returns an error if there is too
/// little memory for it.
pub fn left_behind(path: &Path, header: &FilmHeader) -> Result<Option<FilmFile>, Failure> {
    if !path.is_file() || !is_ours(path, header) {
        return Ok(None);
    }
    match film_file::load(path) {
        Err(error @ LoadError::TooLarge { .. }) => Err(error.into()),
        // A damaged film is of no use.
        film => Ok(film.ok()),
    }
}

/// True if a film has the name of one that was not requested, as returned by [`free`].
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
    fn checkpoints_are_recognised_by_their_names() {
        assert!(is_checkpoint("a.checkpoint.film") && is_checkpoint("a.b.checkpoint-0123abcd.film"));
        for other in [
            "a.film", "a.checkpoints.film", "a.checkpoint-final.film", "a.checkpoint-0123abcd",
            "checkpoint.film",
        ] {
            assert!(!is_checkpoint(other), "{other}");
        }
    }
}
