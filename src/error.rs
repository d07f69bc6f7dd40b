//! What can go wrong when a world is loaded, compiled or saved: one type for each. Every message names the file or
//! entity, the place in it and what to do.

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
        /// The line, counted from 1.
        line: usize,
        /// The column, counted from 1 in characters.
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
    /// An option cannot be carried out: a field of `LoadOptions` in the module `formats`.
    #[error("{option}: {reason}")]
    Option {
        /// The field's name, such as `set`.
        option: &'static str,
        /// What is wrong with its value, in several lines where a place in it is marked.
        reason: String,
    },
    /// A file holds more than can be read, or more than memory has room for.
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

    /// A [`LoadError::Invalid`].
    pub(crate) fn invalid(file: &Path, reason: impl Into<String>) -> LoadError {
        LoadError::Invalid { file: file.to_owned(), reason: reason.into() }
    }

    /// For a file that memory has no room for.
    pub(crate) fn shortage(file: &Path) -> impl FnOnce(Shortage) -> LoadError {
        let file = file.to_owned();
        move |shortage| LoadError::TooLarge { file, reason: shortage.to_string() }
    }

    /// A [`LoadError::Option`]. The reason must be safe to show on a terminal.
    pub(crate) fn option(option: &'static str, reason: impl std::fmt::Display) -> LoadError {
        LoadError::Option { option, reason: reason.to_string() }
    }

    /// A [`LoadError::TooLarge`].
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
    /// No camera has the name that was asked for.
    #[error("{}", in_one_line(&format!("there is no camera \"{name}\"; there are: {known}")))]
    UnknownCamera {
        /// The name that was asked for.
        name: String,
        /// The names of the cameras that exist, separated by commas; `none` if there are none.
        known: String,
    },
    /// An entity's components do not make sense.
    #[error("{}", in_one_line(&format!("{entity}: {reason}")))]
    Entity {
        /// Its name, or `entity N` if it has none (see [`crate::world::World::name_of`]).
        entity: String,
        /// What is wrong and what to do.
        reason: String,
    },
    /// Settings, or something that entities share, do not make sense.
    #[error("{}", in_one_line(&format!("{place}: {reason}")))]
    Invalid {
        /// The part of the world, such as `settings` or `mesh 0 "sheet"`.
        place: String,
        /// What is wrong and what would be right.
        reason: String,
    },
    /// There is more than ids or memory can hold; the text says what.
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
    /// Why it was not.
    pub reason: String,
}

impl SaveError {
    /// From anything that says why.
    pub(crate) fn new(file: &Path, reason: impl std::fmt::Display) -> SaveError {
        SaveError { file: file.to_owned(), reason: reason.to_string() }
    }
}

/// Text that is safe to show: characters that would move a terminal's cursor, change its colours or change the order
/// of reading are escaped. Tabs and line ends stay.
pub(crate) fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(is_harmful) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if is_harmful(c) { c.escape_unicode().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect::<String>().into()
}

/// The same on one line: tabs and line ends are escaped, too.
pub(crate) fn in_one_line(text: &str) -> String {
    shown(text).replace('\n', "\\n").replace('\t', "\\t")
}

/// A name from a file, fit for a line of text: its first 64 characters, escaped.
pub(crate) fn words(name: &str) -> String {
    name.chars().take(64).flat_map(char::escape_debug).collect()
}

/// The text with blanks for characters that cannot be shown, so that marks on the line below fit it.
pub(crate) fn with_blanks(text: &str) -> String {
    text.chars().map(|c| if is_harmful(c) || c.is_control() { ' ' } else { c }).collect()
}

/// What is said of a file, in one line.
fn of_file(file: &Path, what: impl std::fmt::Display) -> String {
    in_one_line(&format!("{}: {what}", file.display()))
}

/// Control characters other than tab and line feed, direction marks, and Unicode's line separators.
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
    near.map_or_else(String::new, |(_, k)| meant(k))
}

/// In the words of [`did_you_mean`].
pub(crate) fn meant(name: &str) -> String {
    format!(" (did you mean \"{name}\"?)")
}

/// The file in the same folder that a missing one most likely meant, in the words of [`did_you_mean`].
fn nearest_file(missing: &Path) -> String {
    let folder = missing.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(name) = missing.file_name().and_then(|name| name.to_str()) else { return String::new() };
    let extension = |name: &str| name.rsplit_once('.').map_or(String::new(), |(_, end)| end.to_lowercase());
    let wanted = extension(name);
    // A scene's picture has nearly the same name but is not a scene.
    let is_of_kind = |name: &String| {
        let own = extension(name);
        strsim::damerau_levenshtein(&own, &wanted) <= own.len().max(wanted.len()) / 2
    };
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    // The kind comes with the listing. A link may lead to a file.
    let files = files.filter(|file| file.file_type().is_ok_and(|kind| !kind.is_dir()));
    let mut names: Vec<String> = files.filter_map(|file| file.file_name().into_string().ok()).collect();
    names.retain(is_of_kind);
    // Directory listings have no order.
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
