//! Detection of changed files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::world::{FileDigest, SourceFiles};

/// The interval between checks of the files.
pub const POLL_INTERVAL: Duration = Duration::from_millis(40);

/// The files that a scene was read from, checked by polling: the change notifications of operating systems differ, are
/// silent on network drives, and do not cover files that do not exist yet.
#[derive(Debug, Default)]
pub struct Watched(BTreeMap<PathBuf, Seen>);

/// The state of a file when it was last checked.
#[derive(Debug)]
struct Seen {
    /// Its content when it was read; none if it could not be read.
    content: Option<FileDigest>,
    /// Its metadata at that time; none if it has not been checked yet.
    stamp: Option<Stamp>,
}

/// Metadata that change with a file: length, modification time and inode number (editors put another file in its
/// place). None if the file does not exist.
type Stamp = Option<(u64, Option<SystemTime>, u64)>;

impl Watched {
    /// Watches the files that were read and those that could not be. Their contents are compared at the first check:
    /// they may have changed since they were read.
    pub fn new(files: &SourceFiles) -> Watched {
        let read = files.all().into_iter().map(|(path, content)| (path, Some(content)));
        let missing = files.missing().into_iter().map(|path| (path, None));
        let all = missing.chain(read).map(|(path, content)| (path, Seen { content, stamp: None }));
        Watched(all.collect())
    }

    /// Adds the files of another list that are not in this one.
    pub fn extend(&mut self, others: Watched) {
        for (path, seen) in others.0 {
            self.0.entry(path).or_insert(seen);
        }
    }

    /// True if the file held these bytes when it was read.
    pub fn is_as_read(&self, path: &Path, bytes: &[u8]) -> bool {
        self.0.get(path).is_some_and(|seen| seen.content == Some(FileDigest::of(bytes)))
    }

    /// True if the content of any file differs from what was read. A deleted file does not count as changed: it is
    /// about to be replaced, or its old content will do.
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
    fn have_changed_reports_new_content_replaced_and_new_files() {
        let folder = tempfile::tempdir().unwrap();
        let [scene, texture] = ["a.ron", "b.png"].map(|name| folder.path().join(name));
        std::fs::write(&scene, "one").unwrap();
        let files = SourceFiles::default();
        files.read(&scene).unwrap();
        assert!(files.read(&texture).is_err());
        let mut watched = Watched::new(&files);
        assert!(!watched.have_changed());
        // Rewritten with the same content.
        std::fs::write(&scene, "one").unwrap();
        assert!(!watched.have_changed());
        std::fs::write(&scene, "two").unwrap();
        assert!(watched.have_changed());
        // Editors save so: another file takes the name.
        let mut watched = Watched::new(&files);
        std::fs::write(folder.path().join("new"), "six").unwrap();
        std::fs::rename(folder.path().join("new"), &scene).unwrap();
        assert!(watched.have_changed());
        // A file that appears, and a file that is deleted.
        let mut watched = Watched::new(&files);
        std::fs::write(&scene, "one").unwrap();
        assert!(!watched.have_changed());
        std::fs::write(&texture, "png").unwrap();
        assert!(watched.have_changed());
        std::fs::remove_file(&scene).unwrap();
        assert!(!watched.have_changed());
    }
}
