//! Names of other files in mesh files and their libraries.

use std::path::{Path, PathBuf};

/// Resolves a file name in `from`: relative to its folder or, failing that, in this folder itself, which helps with
/// absolute paths on the author's machine.
pub fn resolve(from: &Path, name: &str) -> PathBuf {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let folder = from.parent().unwrap_or(Path::new(""));
    let is_absolute = name.starts_with('/') || name.as_bytes().get(1) == Some(&b':');
    let beside = folder.join(name.rsplit('/').next().unwrap_or_default());
    let written = folder.join(&name);
    if is_absolute || (beside.is_file() && !written.is_file()) { beside } else { written }
}

/// The name of a file without folders and extension.
pub fn stem(name: &str) -> String {
    let file = name.trim().trim_matches('"').rsplit(['/', '\\']).next().unwrap_or_default();
    file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned()
}
