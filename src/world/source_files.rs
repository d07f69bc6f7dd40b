//! Which files a world was read from, and what was in them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use xxhash_rust::xxh3::xxh3_128;

use super::kept::Kept;

/// A file's length in bytes and the 128-bit hash (XXH3) of its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content {
    /// In bytes.
    pub length: u64,
    /// XXH3 of all of them.
    pub hash: u128,
}

impl Content {
    /// What there is.
    pub fn of(bytes: &[u8]) -> Content {
        Content { length: bytes.len() as u64, hash: xxh3_128(bytes) }
    }
}

/// Files that were read, by their paths. Copies are one and the same list: several threads read.
#[derive(Clone, Debug, Default)]
pub struct SourceFiles {
    read: Arc<Mutex<BTreeMap<PathBuf, Content>>>,
    /// Those that could not be read.
    missing: Arc<Mutex<BTreeSet<PathBuf>>>,
    /// What files were decoded to before.
    pub kept: Kept,
}

impl SourceFiles {
    /// None yet, with what was decoded before.
    pub fn with(kept: Kept) -> SourceFiles {
        SourceFiles { kept, ..SourceFiles::default() }
    }

    /// Reads a file and remembers what was in it.
    pub fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        let bytes = std::fs::read(path).inspect_err(|_| {
            lock(&self.missing).insert(path.to_owned());
        })?;
        lock(&self.read).insert(path.to_owned(), Content::of(&bytes));
        Ok(bytes)
    }

    /// Adds those of another list.
    pub fn extend(&self, others: &SourceFiles) {
        if !Arc::ptr_eq(&self.read, &others.read) {
            lock(&self.read).extend(others.all());
            lock(&self.missing).extend(others.missing());
        }
    }

    /// All that have been read.
    pub fn all(&self) -> BTreeMap<PathBuf, Content> {
        lock(&self.read).clone()
    }

    /// Those that somebody asked for and that could not be read.
    pub fn missing(&self) -> BTreeSet<PathBuf> {
        lock(&self.missing).clone()
    }
}

/// Nothing panics while it holds the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}
