//! The folder of third-party files named by `RAYFRONT_CORPUS`, for the tests that iterate over it.

use std::path::{Path, PathBuf};

/// Returns the folder; if there is none, prints that the test is skipped.
pub fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("RAYFRONT_CORPUS").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: RAYFRONT_CORPUS is not set");
    }
    folder
}

/// Returns all files below a folder with one of these extensions, sorted. Panics if there are none.
pub fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut files = Vec::new();
    collect(folder, extensions, &mut files);
    files.sort();
    assert!(!files.is_empty(), "{} holds none of {extensions:?}", folder.display());
    files
}

fn collect(folder: &Path, extensions: &[&str], files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a readable corpus") {
        let path = entry.expect("a readable corpus").path();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if path.is_dir() {
            collect(&path, extensions, files);
        } else if extensions.contains(&extension.as_str()) {
            files.push(path);
        }
    }
}

/// Describes an unexpected outcome of reading a file of the corpus: an unexpected error, an error without the file's
/// name or the expected reason in one line, or a missing error.
pub fn surprise(corpus: &Path, path: &Path, error: Option<&dyn std::error::Error>) -> Option<String> {
    let name = path.strip_prefix(corpus).unwrap_or(path).display().to_string();
    match (error.map(ToString::to_string), expected(&name)) {
        (None, None) => None,
        (None, Some(reason)) => Some(format!("{name} loads, but: {reason}")),
        (Some(message), None) => Some(message),
        (Some(message), Some(reason)) => {
            let names_file = message.starts_with(&path.display().to_string());
            let right = names_file && !message.contains('\n') && message.contains(reason);
            (!right).then(|| format!("{message:?} does not say {reason:?}"))
        }
    }
}

/// Returns the words that the message about a file must contain, if it must be refused.
fn expected(name: &str) -> Option<&'static str> {
    let mut refusals = include_str!("corpus.txt").lines().filter_map(|line| line.split_once(" => "));
    refusals.find(|(known, _)| *known == name).map(|(_, reason)| reason)
}
