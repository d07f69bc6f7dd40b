//! Atomic writing of files, which are either complete or absent, even if the power fails.

use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

use super::links;
use crate::error::SaveError;

/// The writer of a temporary file.
pub type Writer<'a> = BufWriter<&'a File>;

/// The prefix and the suffix of the names of temporary files.
const PREFIX: &str = ".rayfront-";
const SUFFIX: &str = ".part";

/// Replaces the content of a file atomically.
pub fn replace(path: &Path, content: &[u8]) -> Result<(), SaveError> {
    write_whole(path, |mut file| file.write_all(content).and_then(|()| file.flush()))
}

/// Writes a temporary file in the same folder, waits until it is on disk, and renames it. Until then, and after an
/// error, an older file of that name stays as it was. Links stay links, and permissions stay as they were.
pub fn write_whole<E: std::fmt::Display>(
    path: &Path,
    write: impl FnOnce(Writer<'_>) -> Result<(), E>,
) -> Result<(), SaveError> {
    begin(path, write)?.finish()
}

/// The first half of [`write_whole`]: writes the temporary file.
pub fn begin<E: std::fmt::Display>(
    path: &Path,
    write: impl FnOnce(Writer<'_>) -> Result<(), E>,
) -> Result<UnnamedFile, SaveError> {
    let place = place_of(path)?;
    let temporary = temporary_beside(path, &place)?;
    write(BufWriter::new(temporary.as_file())).map_err(|reason| SaveError::new(path, reason))?;
    Ok(UnnamedFile { path: path.to_owned(), place, temporary })
}

/// A temporary file that is written but not yet renamed. Dropping it removes the file.
pub struct UnnamedFile {
    path: PathBuf,
    place: PathBuf,
    temporary: NamedTempFile,
}

impl UnnamedFile {
    /// The second half of [`write_whole`]: waits until the file is on disk, and renames it.
    pub fn finish(self) -> Result<(), SaveError> {
        let UnnamedFile { path, place, temporary } = self;
        let failed = |error: std::io::Error| SaveError::new(&path, error);
        if let Ok(older) = std::fs::metadata(&place) {
            temporary.as_file().set_permissions(older.permissions()).map_err(failed)?;
        }
        // Otherwise a rename could reach the disk before the content does.
        temporary.as_file().sync_all().map_err(failed)?;
        let (file, named) = temporary.into_parts();
        std::fs::rename(&named, &place).map_err(failed)?;
        // It has another name now, so there is nothing to remove.
        let _ = named.keep();
        drop(file);
        // The name is a part of the folder. Not every file system can sync a folder.
        #[cfg(unix)]
        let _ = File::open(folder_of(&place)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

/// Checks that a file could be written now. Removes temporary files that were left behind by processes that were killed
/// while they wrote.
pub fn writable(path: &Path) -> Result<(), SaveError> {
    let place = place_of(path)?;
    remove_left_behind(folder_of(&place));
    temporary_beside(path, &place).map(|_| ())
}

/// Folders that have been cleaned: listing one can take long, and once is enough.
static CLEAN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Resolves a path: links are followed if they may be, even to files that do not exist yet.
fn place_of(path: &Path) -> Result<PathBuf, SaveError> {
    links::check(path)?;
    let failed = |error: std::io::Error| SaveError::new(path, error);
    let mut place = path.to_owned();
    // (Operating systems follow about forty.)
    for _ in 0..40 {
        let found = match std::fs::symlink_metadata(&place) {
            Ok(found) => found,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(place),
            Err(error) => return Err(failed(error)),
        };
        if found.is_dir() {
            return Err(SaveError::new(path, "this is a folder: give the name of a file"));
        }
        if found.is_file() && found.permissions().readonly() {
            return Err(SaveError::new(path, "this file is write-protected: chmod u+w it, or name another"));
        }
        if found.is_file() {
            return Ok(place);
        }
        if !found.is_symlink() {
            return Err(SaveError::new(
                path,
                "this is a device, a pipe or the like: give the name of a file",
            ));
        }
        place = folder_of(&place).join(std::fs::read_link(&place).map_err(failed)?);
    }
    Err(SaveError::new(path, "its links lead nowhere"))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Creates a file in the same folder, because renaming works only within one file system. It is locked while it is
/// being written.
fn temporary_beside(path: &Path, place: &Path) -> Result<NamedTempFile, SaveError> {
    let folder = folder_of(place);
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(SaveError::new(path, format!("there is no folder {folder}: make it first")));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // Temporary files are private; this one will be an ordinary file, and the umask applies. The replacement of a
    // private file is private from the beginning.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::metadata(place).map_or(0o666, |older| older.permissions().mode() & 0o666);
        builder.permissions(PermissionsExt::from_mode(mode));
    }
    let temporary = builder.tempfile_in(folder).map_err(|error| SaveError::new(path, error))?;
    // Not every file system has locks; without locks, a file is kept while it is young.
    let _ = temporary.as_file().try_lock();
    Ok(temporary)
}

/// Removes our temporary files that are no longer being written.
fn remove_left_behind(folder: &Path) {
    // Nothing panics while it holds the lock.
    if !CLEAN.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_owned()) {
        return;
    }
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let is_ours = name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        if is_ours && is_left_behind(&entry.path()) {
            // Files of other users stay.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// True if a file is not locked and has not been written to for a minute.
fn is_left_behind(path: &Path) -> bool {
    // Opened for writing, since some file systems give no lock otherwise. This does not block: it is an ordinary
    // file.
    let is_ordinary = std::fs::symlink_metadata(path).is_ok_and(|found| found.is_file());
    let Some(file) = is_ordinary.then(|| File::options().write(true).open(path).ok()).flatten() else {
        return false;
    };
    let age =
        file.metadata().and_then(|metadata| metadata.modified()).ok().and_then(|time| time.elapsed().ok());
    let is_old = age.is_some_and(|age| age.as_secs() >= 60);
    is_old && !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::time::{Duration, SystemTime};

    use super::*;

    fn replace(path: &Path, content: &str) -> Result<(), SaveError> {
        write_whole(path, |mut file| file.write_all(content.as_bytes()).and_then(|()| file.flush()))
    }

    #[test]
    fn replacing_a_file_keeps_links_and_modes() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, hanging] = ["file", "link", "hanging"].map(|name| folder.path().join(name));
        std::fs::create_dir(folder.path().join("below")).unwrap();
        std::fs::write(&file, "old").unwrap();
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o600)).unwrap();
        symlink("file", &link).unwrap();
        symlink("below/new", &hanging).unwrap();
        replace(&link, "new").unwrap();
        assert!(link.is_symlink() && std::fs::read(&file).unwrap() == b"new");
        assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        // A private file is private from the beginning.
        let mut mode = 0;
        let look = |mut writer: Writer<'_>| {
            mode = writer.get_ref().metadata()?.permissions().mode() & 0o777;
            writer.write_all(b"newest").and_then(|()| writer.flush())
        };
        write_whole(&file, look).unwrap();
        assert_eq!(mode, 0o600);
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o444)).unwrap();
        assert!(replace(&file, "x").unwrap_err().to_string().contains("write-protected"));
        assert_eq!(std::fs::read(&file).unwrap(), b"newest");
        replace(&hanging, "newer").unwrap();
        assert!(hanging.is_symlink());
        assert_eq!(std::fs::read(folder.path().join("below/new")).unwrap(), b"newer");
    }

    #[test]
    fn folders_devices_and_link_loops_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [device, ring] = ["device", "ring"].map(|name| folder.path().join(name));
        symlink("/dev/null", &device).unwrap();
        symlink("ring", &ring).unwrap();
        for (path, reason) in
            [(&device, "a device"), (&ring, "lead nowhere"), (&folder.path().into(), "a folder")]
        {
            let error = replace(path, "x").unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
            assert!(writable(path).is_err());
        }
        assert!(!Path::new("/dev/null").is_file());
        let long = folder.path().join("a".repeat(300));
        assert!(writable(&long).is_err(), "known before anything is rendered");
    }

    #[test]
    fn abandoned_temporary_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let old = |name: &str| {
            let path = folder.path().join(name);
            let file = File::create(&path).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(90)).unwrap();
            (path, file)
        };
        let (left, other) = (old(".rayfront-abc.part").0, old(".rayfront-abc").0);
        let (written, file) = old(".rayfront-def.part");
        file.lock().unwrap();
        let young = folder.path().join(".rayfront-ghi.part");
        std::fs::write(&young, "").unwrap();
        writable(&folder.path().join("a.png")).unwrap();
        assert_eq!([left, other, written, young].map(|path| path.exists()), [false, true, true, true]);
    }
}
