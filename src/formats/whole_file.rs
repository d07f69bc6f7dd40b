//! Files that are either whole or not there, even if the power fails.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use tempfile::NamedTempFile;

use crate::error::SaveError;

/// What is written to before the file has its name.
pub type Writer<'a> = BufWriter<&'a File>;

/// Writes a file beside its place, waits until the disk has it and gives it its name. Until then an older
/// one of that name stays as it was, and after an error, too.
pub fn write_whole<E: std::fmt::Display>(
    path: &Path,
    write: impl FnOnce(Writer<'_>) -> Result<(), E>,
) -> Result<(), SaveError> {
    let temporary = temporary_beside(path)?;
    write(BufWriter::new(temporary.as_file())).map_err(|reason| SaveError::new(path, reason))?;
    // Else a rename could reach the disk before the content does.
    temporary.as_file().sync_all().map_err(|error| SaveError::new(path, error))?;
    temporary.persist(path).map_err(|error| SaveError::new(path, error.error))?;
    // The name is the folder's content. Not every file system can be asked to keep it.
    #[cfg(unix)]
    let _ = File::open(folder_of(path)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Whether a file could be made there now.
pub fn writable(path: &Path) -> Result<(), SaveError> {
    if path.is_dir() {
        return Err(SaveError::new(path, "this is a folder: give the name of a file"));
    }
    temporary_beside(path).map(|_| ())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file in the same folder, for a rename works only within one file system.
fn temporary_beside(path: &Path) -> Result<NamedTempFile, SaveError> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(SaveError::new(path, format!("there is no folder {folder}: make it first")));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rayfront-").suffix(".part");
    // Temporary files are private; this one will be an ordinary file, and the umask applies.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|error| SaveError::new(path, error))
}
