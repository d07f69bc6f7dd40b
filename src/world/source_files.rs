//! The files that a world was read from, with digests of their contents.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

use xxhash_rust::xxh3::xxh3_128;

use super::asset_cache::AssetCache;
use crate::files;

/// A file's length in bytes and the 128-bit hash (XXH3) of its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileDigest {
    /// The length in bytes.
    pub length: u64,
    /// The XXH3 of all bytes.
    pub hash: u128,
}

impl FileDigest {
    /// Returns the digest of a file's content.
    pub fn of(bytes: &[u8]) -> FileDigest {
        FileDigest { length: bytes.len() as u64, hash: xxh3_128(bytes) }
    }
}

/// The files that were read, by path. Clones share one list, since several threads read files.
#[derive(Clone, Debug, Default)]
pub struct SourceFiles {
    read: Arc<Mutex<BTreeMap<PathBuf, FileDigest>>>,
    /// The files that could not be read.
    missing: Arc<Mutex<BTreeSet<PathBuf>>>,
    /// The files that may be read.
    confines: Arc<Mutex<Confines>>,
    /// The cache of decoded files.
    pub kept: AssetCache,
}

/// The files that a scene may refer to.
#[derive(Debug, Default)]
struct Confines {
    /// The root folder of the scene, with all links resolved; `None` permits all files.
    root: Option<PathBuf>,
    /// Files named by the user of the program, which are always permitted.
    named: BTreeSet<PathBuf>,
}

/// A file of this name marks its folder as the root of all scenes in it and below, which may then refer to each
/// other's files.
const ROOT_MARK: &str = ".rayfront-root";

/// Returns the folder that must contain all files that a scene in `folder` refers to.
fn root_of(folder: &Path) -> PathBuf {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let marked = folder.ancestors().find(|folder| folder.join(ROOT_MARK).is_file());
    marked.unwrap_or(&folder).to_owned()
}

/// True if `path`, with all links resolved, is a place that `file` may refer to: see [`SourceFiles::confine`].
pub fn is_within(file: &Path, path: &Path) -> bool {
    files::outside_is_allowed()
        || path.canonicalize().is_ok_and(|path| path.starts_with(root_of(folder_of(file))))
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

impl SourceFiles {
    /// Returns an empty list with a cache of decoded files.
    pub fn with(kept: AssetCache) -> SourceFiles {
        SourceFiles { kept, ..SourceFiles::default() }
    }

    /// Restricts reading to two kinds of files: those that were [named](SourceFiles::allow), and those that lie, with
    /// all links resolved, in the folder of `scene` or below. If that folder or one above it contains a file
    /// `.rayfront-root`, the nearest such folder takes its place.
    pub fn confine(&self, scene: &Path) {
        lock(&self.confines).root = (!files::outside_is_allowed()).then(|| root_of(folder_of(scene)));
    }

    /// Permits a file that the user of the program has named, wherever it lies.
    pub fn allow(&self, path: &Path) {
        lock(&self.confines).named.insert(path.to_owned());
    }

    /// Checks that a file may be read.
    fn check(&self, path: &Path) -> std::io::Result<()> {
        let confines = lock(&self.confines);
        let Some(root) = confines.root.as_ref().filter(|_| !confines.named.contains(path)) else {
            return Ok(());
        };
        if path.canonicalize()?.starts_with(root) {
            return Ok(());
        }
        let root = root.display();
        let reason =
            format!("it lies outside of the scene's folder {root}: --allow-outside lets a scene refer to it");
        Err(std::io::Error::new(std::io::ErrorKind::PermissionDenied, reason))
    }

    /// Reads an ordinary file and records its digest, or else that it could not be read.
    pub fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        let bytes = self.check(path).and_then(|()| files::read(path)).inspect_err(|_| {
            lock(&self.missing).insert(path.to_owned());
        })?;
        lock(&self.read).insert(path.to_owned(), FileDigest::of(&bytes));
        Ok(bytes)
    }

    /// Adds the files of another list.
    pub fn extend(&self, others: &SourceFiles) {
        if !Arc::ptr_eq(&self.read, &others.read) {
            lock(&self.read).extend(others.all());
            lock(&self.missing).extend(others.missing());
        }
    }

    /// Returns all files that have been read.
    pub fn all(&self) -> BTreeMap<PathBuf, FileDigest> {
        lock(&self.read).clone()
    }

    /// Returns the files that were requested but could not be read.
    pub fn missing(&self) -> BTreeSet<PathBuf> {
        lock(&self.missing).clone()
    }
}

/// Locks a mutex; no code panics while it holds the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

// Temporary folders need this feature.
#[cfg(feature = "formats")]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn read_refuses_files_outside_the_scenes_root_unless_named() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(place("inner/below")).unwrap();
        for name in ["secret", "inner/a", "inner/below/b"] {
            std::fs::write(place(name), name).unwrap();
        }
        let files = SourceFiles::default();
        assert!(files.read(&place("secret")).is_ok(), "nobody has confined it yet");
        files.confine(&place("inner/scene.ron"));
        for inside in ["inner/a", "inner/below/b", "inner/below/../a"] {
            assert!(files.read(&place(inside)).is_ok(), "{inside}");
        }
        let outside = place("inner/../secret");
        let refused = |path: &Path| files.read(path).unwrap_err().to_string().contains("--allow-outside");
        assert!(refused(&outside));
        assert!(files.missing().contains(&outside), "it is looked at again if it changes");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../secret", place("inner/link")).unwrap();
            assert!(refused(&place("inner/link")), "links are followed");
        }
        files.allow(&outside);
        assert!(files.read(&outside).is_ok(), "somebody has named it");
        std::fs::write(place(ROOT_MARK), "").unwrap();
        let files = SourceFiles::default();
        files.confine(&place("inner/scene.ron"));
        assert!(files.read(&outside).is_ok(), "the folder above is the root now");
    }
}
