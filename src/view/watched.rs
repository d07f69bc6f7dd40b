//! Whether files have changed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::world::{FileDigest, SourceFiles};

/// How often files are looked at.
pub const LOOK: Duration = Duration::from_millis(40);

/// Files that something was made of. They are looked at again and again: what a system tells of changes differs from
/// system to system, is silent on network drives, and is not told of files that are not there yet.
#[derive(Debug, Default)]
pub struct Watched(BTreeMap<PathBuf, Seen>);

/// The state of a file when it was last checked.
#[derive(Debug)]
struct Seen {
    /// Its content when it was read; none of one that could not be.
    content: Option<FileDigest>,
    /// What the system said about it then. None: it has not been checked yet.
    stamp: Option<Stamp>,
}

/// What changes with a file: length, time, and which file it is, for editors put another one in its place. None of
/// what is not there.
type Stamp = Option<(u64, Option<SystemTime>, u64)>;

impl Watched {
    /// Those that were read, and those that could not be. What they hold is compared at the first look: they may have
    /// changed since they were read.
    pub fn new(files: &SourceFiles) -> Watched {
        let read = files.all().into_iter().map(|(path, content)| (path, Some(content)));
        let missing = files.missing().into_iter().map(|path| (path, None));
        let all = missing.chain(read).map(|(path, content)| (path, Seen { content, stamp: None }));
        Watched(all.collect())
    }

    /// Adds those of another list that are not known.
    pub fn extend(&mut self, others: Watched) {
        for (path, seen) in others.0 {
            self.0.entry(path).or_insert(seen);
        }
    }

    /// Whether a file held this when it was read.
    pub fn is_as_read(&self, path: &Path, bytes: &[u8]) -> bool {
        self.0.get(path).is_some_and(|seen| seen.content == Some(FileDigest::of(bytes)))
    }

    /// Whether any holds something else than what was read. One that is gone has not changed: it is about to be
    /// replaced, or what was read of it will do.
    pub fn have_changed(&mut self) -> bool {
        let mut changed = false;
        for (path, seen) in &mut self.0 {
            let stamp = stamp(path);
            if seen.stamp.as_ref() == Some(&stamp) {
                continue;
            }
            seen.stamp = Some(stamp);
            let content = content(path);
            changed |= content.is_some() && content != seen.content;
        }
        changed
    }
}

fn stamp(path: &Path) -> Stamp {
    let data = std::fs::metadata(path).ok()?;
    #[cfg(unix)]
    let number = std::os::unix::fs::MetadataExt::ino(&data);
    #[cfg(not(unix))]
    let number = 0;
    Some((data.len(), data.modified().ok(), number))
}

fn content(path: &Path) -> Option<FileDigest> {
    crate::files::read(path).ok().map(|bytes| FileDigest::of(&bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_is_noticed_whoever_changes_it_and_how() {
        let folder = tempfile::tempdir().unwrap();
        let [scene, texture] = ["a.ron", "b.png"].map(|name| folder.path().join(name));
        std::fs::write(&scene, "one").unwrap();
        let files = SourceFiles::default();
        files.read(&scene).unwrap();
        assert!(files.read(&texture).is_err());
        let mut watched = Watched::new(&files);
        assert!(!watched.have_changed());
        // Written again with the same content.
        std::fs::write(&scene, "one").unwrap();
        assert!(!watched.have_changed());
        std::fs::write(&scene, "two").unwrap();
        assert!(watched.have_changed());
        // As editors do it: another file takes its name.
        let mut watched = Watched::new(&files);
        std::fs::write(folder.path().join("new"), "six").unwrap();
        std::fs::rename(folder.path().join("new"), &scene).unwrap();
        assert!(watched.have_changed());
        // A file that appears, and one that disappears.
        let mut watched = Watched::new(&files);
        std::fs::write(&scene, "one").unwrap();
        assert!(!watched.have_changed());
        std::fs::write(&texture, "png").unwrap();
        assert!(watched.have_changed());
        std::fs::remove_file(&scene).unwrap();
        assert!(!watched.have_changed());
    }
}
