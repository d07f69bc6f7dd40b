//! Text on standard output and standard error.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::failure::Failure;
use crate::error::{in_one_line, shown};

/// Prints a report on standard output, or on standard error if standard output is taken.
pub fn print_text(text: &str, is_taken: bool) -> Result<(), Failure> {
    if !is_taken {
        return print(text);
    }
    tell_all(text);
    Ok(())
}

/// Prints on standard output. All output there goes this way, except films and videos.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(shown(text).as_bytes()).and_then(|()| out.flush()).map_err(Failure::stdout("the result"))
}

/// Prints a line on standard error; errors are ignored.
pub fn note(line: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{}", in_one_line(&line.to_string()));
}

/// Prints text of several lines on standard error; errors are ignored.
pub fn tell_all(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", shown(text.trim_end()));
}

/// Returns several paths as JSON.
pub fn paths_json(paths: &[PathBuf]) -> Vec<serde_json::Value> {
    paths.iter().map(|path| path_json(path)).collect()
}

/// Returns a path as JSON. Invalid Unicode is replaced, because JSON cannot represent it.
pub fn path_json(path: &Path) -> serde_json::Value {
    path.to_string_lossy().into()
}
