//! What can go wrong, one enum an edge: loading, compiling, saving. Every message
//! names the file or entity, the place in it and what to do.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::memory::Shortage;

/// A file could not be read or does not make sense.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The operating system refused.
    #[error("{}", of_file(.file, format_args!("cannot read: {source}{hint}")))]
    Io {
        /// The file that was asked for.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
        /// Which file was meant, if one has nearly that name.
        hint: String,
    },
    /// A place in a text file is wrong.
    #[error("{}", in_one_line(&format!("{}:{line}:{column}: {reason}", file.display())))]
    At {
        /// The file.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1, in characters.
        column: usize,
        /// What is wrong there and what would be right.
        reason: String,
    },
    /// A file is wrong at a place that has no line and column.
    #[error("{}", of_file(.file, reason))]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Where in it (an element, a face, a byte) and what is wrong.
        reason: String,
    },
    /// A file holds more than can be read.
    #[error("{}", of_file(.file, reason))]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// How large it is, and what fits.
        reason: String,
    },
}

impl LoadError {
    /// For [`std::io::Result::map_err`].
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

    /// An [`LoadError::Invalid`].
    pub(crate) fn invalid(file: &Path, reason: impl Into<String>) -> LoadError {
        LoadError::Invalid { file: file.to_owned(), reason: reason.into() }
    }

    /// For a file that memory does not do for.
    pub(crate) fn shortage(file: &Path) -> impl FnOnce(Shortage) -> LoadError {
        let file = file.to_owned();
        move |shortage| LoadError::TooLarge { file, reason: shortage.to_string() }
    }

    /// A [`LoadError::TooLarge`].
    pub(crate) fn too_large(file: &Path, reason: impl Into<String>) -> LoadError {
        LoadError::TooLarge { file: file.to_owned(), reason: reason.into() }
    }
}

/// A world cannot be made into a scene.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// There is nothing to look through.
    #[error(
        "the scene has no camera: add an entity such as (camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0)))"
    )]
    NoCamera,
    /// A name that nothing has.
    #[error("{}", in_one_line(&format!("there is no camera \"{name}\"; there are: {known}")))]
    UnknownCamera {
        /// What was asked for.
        name: String,
        /// Those that exist.
        known: String,
    },
    /// An entity's components do not make sense.
    #[error("{}", in_one_line(&format!("{entity}: {reason}")))]
    Entity {
        /// Its name.
        entity: String,
        /// What is wrong and what to do.
        reason: String,
    },
    /// More than ids or memory can hold.
    #[error("the scene is too large: {0}")]
    TooLarge(String),
}

impl From<Shortage> for CompileError {
    fn from(shortage: Shortage) -> CompileError {
        CompileError::TooLarge(shortage.to_string())
    }
}

/// An image could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}", of_file(.file, format_args!("cannot write: {reason}")))]
pub struct SaveError {
    /// The file that was to be written.
    pub file: PathBuf,
    /// Why it was not.
    pub reason: String,
}

impl SaveError {
    /// From anything that says why.
    pub(crate) fn new(file: &Path, reason: impl std::fmt::Display) -> SaveError {
        SaveError { file: file.to_owned(), reason: reason.to_string() }
    }
}

/// Text as it can be shown: signs that would move a terminal's cursor, change its colours or the order in which it is read
/// are written as escapes. A tabulator and the ends of lines stay.
pub(crate) fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(is_harmful) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if is_harmful(c) { c.escape_unicode().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect::<String>().into()
}

/// The same in one line.
pub(crate) fn in_one_line(text: &str) -> String {
    shown(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// A name from a file, as it can stand in a line: its first 64 signs.
pub(crate) fn words(name: &str) -> String {
    name.chars().take(64).flat_map(char::escape_debug).collect()
}

/// A line as long as the text, below which places in it can be marked.
pub(crate) fn with_blanks(text: &str) -> String {
    text.chars().map(|c| if is_harmful(c) || c.is_control() { ' ' } else { c }).collect()
}

/// What is said of a file, in one line.
fn of_file(file: &Path, what: impl std::fmt::Display) -> String {
    in_one_line(&format!("{}: {what}", file.display()))
}

/// Control characters, marks of direction, and what divides lines.
fn is_harmful(c: char) -> bool {
    c.is_control() && !"\n\t".contains(c)
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The one of `known` that `name` most likely meant, as `(did you mean "x"?)`, or nothing.
pub(crate) fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = known
        .into_iter()
        .map(|k| (distance(name, k), k))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, k)| *distance <= (k.len().max(name.len()) / 3).max(1));
    near.map_or_else(String::new, |(_, k)| format!(" (did you mean \"{k}\"?)"))
}

/// The file of a folder that a missing one most likely meant, as [`did_you_mean`] says it.
fn nearest_file(missing: &Path) -> String {
    let folder = missing.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(name) = missing.file_name().and_then(|name| name.to_str()) else { return String::new() };
    let extension = |name: &str| name.rsplit_once('.').map_or(String::new(), |(_, end)| end.to_lowercase());
    let wanted = extension(name);
    // The picture of a scene has nearly its name, and is no scene.
    let is_of_kind = |name: &String| {
        let own = extension(name);
        strsim::damerau_levenshtein(&own, &wanted) <= own.len().max(wanted.len()) / 2
    };
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = files.filter(|file| file.path().is_file());
    let mut names: Vec<String> = files.filter_map(|file| file.file_name().into_string().ok()).collect();
    names.retain(is_of_kind);
    // Folders have no order.
    names.sort();
    did_you_mean(name, names.iter().map(String::as_str))
}

/// Edits from one name to another. A unit at the end may be left out: "radus" is near "radius_m".
fn distance(name: &str, known: &str) -> usize {
    let edits = |k: &str| strsim::damerau_levenshtein(&name.to_lowercase(), &k.to_lowercase());
    let without_unit = known.rsplit_once('_').map_or(usize::MAX, |(stem, _)| edits(stem));
    edits(known).min(without_unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_moves_no_cursor() {
        assert!(matches!(shown("plain, Zoë\n\t"), Cow::Borrowed(_)));
        assert_eq!(shown("a\u{1b}[31m\r\u{9b}\u{202e}b"), "a\\u{1b}[31m\\u{d}\\u{9b}\\u{202e}b");
        assert_eq!(in_one_line("error:\nfake"), "error:\\nfake");
    }
}
