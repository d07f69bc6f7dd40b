//! The lines of OBJ files, and their words.

use std::borrow::Cow;
use std::fmt::Write;

use smallvec::SmallVec;

use crate::formats::mended::MendedValues;

/// An invalid line.
#[derive(Debug)]
pub struct LineFault {
    /// The line number, from 1.
    pub line: usize,
    /// The column, from 1, in characters.
    pub column: usize,
    /// The reason.
    pub reason: String,
}

/// A word and its byte offset in the line.
#[derive(Clone, Copy)]
pub struct ObjToken<'a> {
    /// The word.
    pub text: &'a str,
    /// Its byte offset.
    pub place: usize,
}

/// The byte offset of an error in a line, and its reason.
pub type Complaint = (usize, String);

/// Vertex, texture coordinates and normal: the kinds of indices of a corner.
pub const VERTEX: usize = 0;
pub const UV: usize = 1;
pub const NORMAL: usize = 2;
pub const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The lines of a text with their numbers, joined where they end with a backslash.
pub fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let mut line = Cow::Borrowed(line);
        while line.trim_end().ends_with('\\') {
            let Some((_, more)) = lines.next() else { break };
            let so_far = line.trim_end().len() - 1;
            let joined = line.to_mut();
            joined.truncate(so_far);
            joined.push(' ');
            joined.push_str(more);
        }
        Some((number + 1, line))
    })
}

pub fn fault_at(line: &str, number: usize, place: usize, reason: String) -> LineFault {
    LineFault { line: number, column: column(line, place), reason }
}

/// The first word of a line, and the rest.
pub fn split_keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(word, rest)| (word, rest.trim()))
}

/// Adds a message about values or lines, if there are any, and the line of the first.
pub fn tell(told: &mut Vec<(usize, String)>, of: MendedValues, what: &str, rest: impl Fn(usize) -> String) {
    if of.count > 0 {
        told.push((of.first, format!("{what}: {}", rest(of.count))));
    }
}

/// The column, from 1, of the character at a byte offset.
pub fn column(line: &str, place: usize) -> usize {
    line.get(..place).map_or(1, |before| before.chars().count() + 1)
}

/// Writing to a string cannot fail.
pub fn write_infallibly(text: &mut String, arguments: std::fmt::Arguments) {
    let _ = text.write_fmt(arguments);
}

/// The words of a line up to a comment.
pub fn words(line: &str) -> SmallVec<[ObjToken<'_>; 8]> {
    let mut words = SmallVec::new();
    for text in line.split_whitespace() {
        if text.starts_with('#') {
            break;
        }
        // `text` is a slice of the line.
        words.push(ObjToken { text, place: text.as_ptr() as usize - line.as_ptr() as usize });
    }
    words
}

/// The part of a word that fits into a message.
pub fn short(text: &str) -> String {
    text.chars().take(40).collect()
}
