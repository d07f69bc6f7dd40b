//! Links at output paths: they are followed only if the user has typed their names. All other names are ours (defaults,
//! `NAME.denoised.png`, checkpoints) or come with a film, and whoever made the folder that contains such a link would
//! decide which file is lost.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use crate::error::SaveError;

/// The names that were typed, as absolute paths. `None`: all were, as in a program that uses the library.
static TYPED: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);

/// From now on, follows links only at output paths with one of these names, or those of earlier calls.
pub fn follow_only<'p>(typed: impl IntoIterator<Item = &'p Path>) {
    names().get_or_insert_default().extend(typed.into_iter().map(absolute));
}

/// Returns an error if the path is a link that was not typed, wherever it leads.
pub fn check(path: &Path) -> Result<(), SaveError> {
    if !path.is_symlink() || is_typed(path) {
        return Ok(());
    }
    let reason = "this is a link, and links are followed only if you type their names: remove it, or say where to write";
    Err(SaveError::new(path, reason))
}

/// Makes a folder and those above it, unless they exist. None of them may be a link, up to one that was typed or that
/// contains the working folder.
pub fn make_folder(path: &Path) -> Result<(), SaveError> {
    let failed = |error: std::io::Error| SaveError::new(path, error);
    let here = std::env::current_dir().map_err(failed)?;
    let ours = |folder: &&Path| !is_typed(folder) && !here.starts_with(absolute(folder));
    path.ancestors().take_while(ours).try_for_each(check)?;
    std::fs::create_dir_all(path).map_err(failed)
}

/// Opens a file to append to it; creates it unless it exists.
pub fn open_to_append(path: &Path) -> Result<File, SaveError> {
    check(path)?;
    let failed = |error: std::io::Error| SaveError::new(path, error);
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(failed)?;
    // It may have become a link in the meantime.
    check(path)?;
    Ok(file)
}

fn is_typed(path: &Path) -> bool {
    names().as_ref().is_none_or(|typed| typed.contains(&absolute(path)))
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Locks [`TYPED`]. Nothing panics while it holds the lock.
fn names() -> MutexGuard<'static, Option<BTreeSet<PathBuf>>> {
    TYPED.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}
