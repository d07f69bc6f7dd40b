//! File access: scenes and everything that they name are opened here, and results are written here. Only ordinary files
//! are read, after a check of their size; writes are atomic.

#[cfg(feature = "formats")]
pub mod atomic_write;
#[cfg(feature = "formats")]
pub mod links;

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::memory;
#[cfg(feature = "formats")]
pub use atomic_write::replace;

/// True if scenes may refer to any file.
static OUTSIDE: AtomicBool = AtomicBool::new(false);

/// Allows scenes to refer to files outside of their folders from now on. Only for scenes that are known to be harmless.
pub fn allow_outside() {
    OUTSIDE.store(true, Ordering::Relaxed);
}

/// True if scenes may refer to files outside of their folders.
pub fn outside_is_allowed() -> bool {
    OUTSIDE.load(Ordering::Relaxed)
}

/// True if two paths name the same file, or would if it existed.
pub fn are_same(one: &Path, other: &Path) -> bool {
    let real = |path: &Path| std::fs::canonicalize(path).or_else(|_| std::path::absolute(path));
    one == other || matches!((real(one), real(other)), (Ok(one), Ok(other)) if one == other)
}

/// Opens an ordinary file; returns it with its length. Other files are errors: a pipe might never deliver anything, and
/// a device might never end.
pub fn open(path: &Path) -> io::Result<(File, u64)> {
    // Checked first: even opening a pipe waits.
    is_ordinary(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    is_ordinary(&metadata)?;
    Ok((file, metadata.len()))
}

/// Reads all of an ordinary file, if there is enough memory for it.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (file, length) = open(path)?;
    let _claim = memory::reserve("what is in it", length).map_err(io::Error::other)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX).saturating_add(1))?;
    // No more than was reserved, even if the file grows meanwhile.
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn is_ordinary(metadata: &Metadata) -> io::Result<()> {
    let what = match metadata.file_type() {
        kind if kind.is_file() => return Ok(()),
        kind if kind.is_dir() => "a folder",
        _ => "a device, a pipe or the like",
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("this is {what}: name an ordinary file")))
}

// The crate for temporary folders comes with this feature.
#[cfg(feature = "formats")]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_ordinary_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "some bytes").unwrap();
        assert_eq!(read(&path).unwrap(), b"some bytes");
        assert!(read(folder.path()).unwrap_err().to_string().contains("a folder"));
        assert_eq!(read(&folder.path().join("b")).unwrap_err().kind(), io::ErrorKind::NotFound);
        // Reading it would never end.
        #[cfg(unix)]
        assert!(read(Path::new("/dev/zero")).unwrap_err().to_string().contains("a device"));
    }

    #[test]
    fn file_larger_than_memory_is_rejected_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large");
        File::create(&path).unwrap().set_len(1 << 43).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.starts_with("what is in it takes 8796.09 GB"), "{message}");
    }
}
