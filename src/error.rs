//! Errors of loading, compiling and saving a world: one type for each. Every message names the file or entity, the
//! place in it and the remedy.

mod diagnostic;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

pub use diagnostic::{Diagnostic, Remedy, Severity, Subject};

use crate::memory::Shortage;

/// A file could not be read or is invalid.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The operating system reported an error.
    #[error("{}", of_file(.file, format_args!("cannot read: {source}{hint}")))]
    Io {
        /// The requested file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
        /// A suggestion, if a file has nearly that name.
        hint: String,
    },
    /// A place in a text file is wrong.
    #[error("{}", in_one_line(&format!("{}:{line}:{column}: {reason}", file.display())))]
    At {
        /// The file.
        file: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// The column, counted from 1 in characters.
        column: usize,
        /// The fault and what would be right.
        reason: String,
    },
    /// Several places in a text file are wrong.
    #[error("{}", .0.iter().map(LoadError::to_string).collect::<Vec<_>>().join("\n"))]
    Several(
        /// The errors, in the order of their places.
        Vec<LoadError>,
    ),
    /// A file is wrong at a place that has no line and column.
    #[error("{}", of_file(.file, reason))]
    Invalid {
        /// The file.
        file: PathBuf,
        /// The place in it (an element, a face, a byte) and the fault.
        reason: String,
    },
    /// An option cannot be applied: a field of `LoadOptions` in the module `formats`.
    #[error("{option}: {reason}")]
    Option {
        /// The field's name, such as `set`.
        option: &'static str,
        /// The fault in its value, in several lines if a place in it is marked.
        reason: String,
    },
    /// A file holds more than can be read, or more than memory has room for.
    #[error("{}", of_file(.file, reason))]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// The size of the file, and the size that fits.
        reason: String,
    },
}

impl LoadError {
    /// Returns a function for [`std::io::Result::map_err`].
    pub(crate) fn io(file: &Path) -> impl FnOnce(std::io::Error) -> LoadError {
        let file = file.to_owned();
        move |source| {
            if let Some(shortage) = source.get_ref().and_then(|inner| inner.downcast_ref::<Shortage>()) {
                return LoadError::TooLarge { reason: shortage.to_string(), file };
            }
            let is_missing = source.kind() == std::io::ErrorKind::NotFound;
            let hint = if is_missing { nearest_file(&file) } else { String::new() };
            LoadError::Io { file, source, hint }
        }
    }

    /// Creates a [`LoadError::Invalid`].
    pub(crate) fn invalid(file: &Path, reason: impl Into<String>) -> LoadError {
        LoadError::Invalid { file: file.to_owned(), reason: reason.into() }
    }

    /// Returns a function that creates a [`LoadError::TooLarge`], for a file that memory has no room for.
    pub(crate) fn shortage(file: &Path) -> impl FnOnce(Shortage) -> LoadError {
        let file = file.to_owned();
        move |shortage| LoadError::TooLarge { file, reason: shortage.to_string() }
    }

    /// Creates a [`LoadError::Option`]. The reason must be safe to show on a terminal.
    pub(crate) fn option(option: &'static str, reason: impl std::fmt::Display) -> LoadError {
        LoadError::Option { option, reason: reason.to_string() }
    }

    /// Creates a [`LoadError::TooLarge`].
    pub(crate) fn too_large(file: &Path, reason: impl Into<String>) -> LoadError {
        LoadError::TooLarge { file: file.to_owned(), reason: reason.into() }
    }
}

/// A world cannot be compiled into a scene.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// The world has no camera.
    #[error(
        "the scene has no camera: add an entity such as (camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0)))"
    )]
    NoCamera,
    /// No camera has the requested name.
    #[error("{}", in_one_line(&format!("there is no camera \"{name}\"; there are: {known}")))]
    UnknownCamera {
        /// The requested name.
        name: String,
        /// The names of the cameras that exist, separated by commas; `none` if there are none.
        known: String,
    },
    /// An entity's components are invalid.
    #[error("{}", in_one_line(&format!("{entity}: {reason}")))]
    Entity {
        /// Its name, or `entity N` if it has none (see [`crate::world::World::name_of`]).
        entity: String,
        /// The fault and the remedy.
        reason: String,
    },
    /// Settings, or something that entities share, are invalid.
    #[error("{}", in_one_line(&format!("{place}: {reason}")))]
    Invalid {
        /// The part of the world, such as `settings` or `mesh 0 "sheet"`.
        place: String,
        /// The fault and what would be right.
        reason: String,
    },
    /// There is more than ids or memory can hold; the text names it.
    #[error("the scene is too large: {0}")]
    TooLarge(String),
}

impl From<Shortage> for CompileError {
    fn from(shortage: Shortage) -> CompileError {
        CompileError::TooLarge(shortage.to_string())
    }
}

/// An image or a scene could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}", of_file(.file, format_args!("cannot write: {reason}")))]
pub struct SaveError {
    /// The file that was to be written.
    pub file: PathBuf,
    /// The reason.
    pub reason: String,
}

impl SaveError {
    /// Creates an error from a reason.
    pub(crate) fn new(file: &Path, reason: impl std::fmt::Display) -> SaveError {
        SaveError { file: file.to_owned(), reason: reason.to_string() }
    }
}

/// Makes text safe to show: escapes characters that would move a terminal's cursor, change its colours or change the
/// order of reading. Tabs and line ends stay.
pub(crate) fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(is_harmful) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if is_harmful(c) { c.escape_unicode().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect::<String>().into()
}

/// [`shown`] on one line: escapes tabs and line ends, too.
pub(crate) fn in_one_line(text: &str) -> String {
    shown(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// Makes a name from a file fit for a line of text: its first 64 characters, escaped.
pub(crate) fn words(name: &str) -> String {
    name.chars().take(64).flat_map(char::escape_debug).collect()
}

/// Replaces characters that cannot be shown with blanks, so that marks on the line below are aligned.
pub(crate) fn with_blanks(text: &str) -> String {
    text.chars().map(|c| if is_harmful(c) || c.is_control() { ' ' } else { c }).collect()
}

/// Formats a message about a file on one line.
fn of_file(file: &Path, what: impl std::fmt::Display) -> String {
    in_one_line(&format!("{}: {what}", file.display()))
}

/// True for control characters other than tab and line feed, direction marks, and Unicode's line separators.
fn is_harmful(c: char) -> bool {
    c.is_control() && !"\n\t".contains(c)
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Suggests the one of `known` that `name` most likely meant, as `(did you mean "x"?)`; returns nothing if none is
/// near.
pub(crate) fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = known
        .into_iter()
        .map(|k| (distance(name, k), k))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, k)| *distance <= (k.len().max(name.len()) / 3).max(1));
    near.map_or_else(String::new, |(_, k)| meant(k))
}

/// Formats the suggestion of [`did_you_mean`].
pub(crate) fn meant(name: &str) -> String {
    format!(" (did you mean \"{name}\"?)")
}

/// Suggests the file in the same folder that a missing one most likely meant, like [`did_you_mean`].
fn nearest_file(missing: &Path) -> String {
    let folder = missing.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(name) = missing.file_name().and_then(|name| name.to_str()) else { return String::new() };
    let extension = |name: &str| name.rsplit_once('.').map_or(String::new(), |(_, end)| end.to_lowercase());
    let wanted = extension(name);
    // A scene's image has nearly the same name but is not a scene.
    let is_of_kind = |name: &String| {
        let own = extension(name);
        strsim::damerau_levenshtein(&own, &wanted) <= own.len().max(wanted.len()) / 2
    };
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    // The file type comes with the listing. A link may lead to a file.
    let files = files.filter(|file| file.file_type().is_ok_and(|kind| !kind.is_dir()));
    let mut names: Vec<String> = files.filter_map(|file| file.file_name().into_string().ok()).collect();
    names.retain(is_of_kind);
    // Directory listings have no order.
    names.sort();
    did_you_mean(name, names.iter().map(String::as_str))
}

/// Returns the edit distance between two names. A unit at the end may be left out: "radus" is near "radius_m".
fn distance(name: &str, known: &str) -> usize {
    const UNITS: [&str; 6] = ["degrees", "ev", "kelvin", "m", "s", "w"];
    let edits = |k: &str| strsim::damerau_levenshtein(&name.to_lowercase(), &k.to_lowercase());
    let unit = known.rsplit_once('_').filter(|(_, unit)| UNITS.contains(unit));
    let without_unit = unit.map_or(usize::MAX, |(stem, _)| edits(stem));
    edits(known).min(without_unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shown_escapes_terminal_control_characters() {
        assert!(matches!(shown("plain, Zoë\n\t"), Cow::Borrowed(_)));
        assert_eq!(shown("a\u{1b}[31m\r\u{9b}\u{202e}b"), "a\\u{1b}[31m\\u{d}\\u{9b}\\u{202e}b");
        assert_eq!(in_one_line("error:\nfake"), "error:\\nfake");
    }
}
