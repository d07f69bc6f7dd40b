//! Diagnostics: what loading, compiling, checking and rendering report about a scene that can be rendered all the same.

use std::fmt::{Display, Formatter};
use std::path::{Path, PathBuf};

use super::{in_one_line, words};

/// A message about a scene or an image. [`Display`] writes it as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// A stable name for programs, such as `no-light`.
    pub code: &'static str,
    /// The probability that something is wrong.
    pub severity: Severity,
    /// The part of the scene concerned, if it is a single one.
    pub subject: Option<Subject>,
    /// The problem and its cause.
    pub text: String,
    /// The change that fixes it, if there is one.
    pub remedy: Option<Remedy>,
}

/// The probability that something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Nothing is wrong; something was chosen or added.
    Note,
    /// The image is probably not as intended.
    Warning,
}

/// A part of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Subject {
    /// Its name: of an entity, a material or a file.
    pub name: String,
    /// The file in which it is written, if known.
    pub file: Option<PathBuf>,
    /// Line and column in the file, from 1, the column in characters.
    pub position: Option<[u32; 2]>,
}

impl Subject {
    /// A part that is known only by its name.
    pub(crate) fn named(name: impl Into<String>) -> Subject {
        Subject { name: name.into(), file: None, position: None }
    }
}

/// The change that fixes a problem: a text in which parts of a command line are marked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remedy {
    /// Plain text and parts of a command line in turn, plain text first.
    parts: Vec<String>,
}

impl Remedy {
    /// The parts of a command line: one, or several to choose from, each with its words.
    pub fn commands(&self) -> Vec<Vec<String>> {
        self.parts.iter().skip(1).step_by(2).map(|command| shell_words(command)).collect()
    }

    /// The text with each part of a command line replaced.
    pub fn with_commands(&self, replace: impl Fn(&str) -> String) -> String {
        let parts = self.parts.iter().enumerate();
        parts.map(|(at, part)| if at % 2 == 1 { replace(part) } else { part.clone() }).collect()
    }
}

impl Display for Remedy {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        f.write_str(&self.parts.concat())
    }
}

/// Splits a command line at blanks outside of single quotes; a backslash outside of them takes the next character as it
/// is.
fn shell_words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut is_quoted) = (Vec::new(), None::<String>, false);
    let mut rest = line.chars();
    while let Some(c) = rest.next() {
        match c {
            '\'' => {
                is_quoted = !is_quoted;
                word.get_or_insert_default();
            }
            '\\' if !is_quoted => word.get_or_insert_default().extend(rest.next()),
            c if c.is_whitespace() && !is_quoted => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

impl Diagnostic {
    /// Creates a warning.
    pub(crate) fn warning(code: &'static str, text: impl Into<String>) -> Diagnostic {
        Diagnostic { code, severity: Severity::Warning, subject: None, text: text.into(), remedy: None }
    }

    /// Creates a note.
    pub(crate) fn note(code: &'static str, text: impl Into<String>) -> Diagnostic {
        Diagnostic { severity: Severity::Note, ..Self::warning(code, text) }
    }

    /// Creates a warning about a file from `text (remedy)`; the remedy is optional and has marked options.
    pub(crate) fn in_file(code: &'static str, file: &Path, line: &str) -> Diagnostic {
        let subject =
            Subject { name: file.display().to_string(), file: Some(file.to_owned()), position: None };
        let parts = line.strip_suffix(')').and_then(|line| line.rsplit_once(" ("));
        match parts.filter(|(_, remedy)| remedy.contains('`')) {
            Some((text, remedy)) => Diagnostic::warning(code, text).fixed_by(remedy),
            None => Diagnostic::warning(code, line),
        }
        .about(subject)
    }

    /// Creates a warning about a line of a file.
    pub(crate) fn at_line(
        code: &'static str,
        file: &Path,
        line: usize,
        text: impl Into<String>,
    ) -> Diagnostic {
        let position = Some([u32::try_from(line).unwrap_or(u32::MAX), 1]);
        let name = format!("{}:{line}", file.display());
        Diagnostic::warning(code, text).about(Subject { name, file: Some(file.to_owned()), position })
    }

    /// Names the part of the scene concerned.
    pub(crate) fn about(self, subject: Subject) -> Diagnostic {
        Diagnostic { subject: Some(subject), ..self }
    }

    /// Adds a remedy, with parts of a command line in backticks: ``or `--env studio` ``.
    pub(crate) fn fixed_by(self, remedy: impl Into<String>) -> Diagnostic {
        let parts = remedy.into().split('`').map(str::to_owned).collect();
        Diagnostic { remedy: Some(Remedy { parts }), ..self }
    }

    /// Adds a command line, whose words may contain any characters, and a text after it.
    #[cfg_attr(
        not(feature = "cli"),
        allow(dead_code, reason = "only the program prints whole command lines")
    )]
    pub(crate) fn fixed_by_command(self, command: String, text: &str) -> Diagnostic {
        Diagnostic { remedy: Some(Remedy { parts: vec![String::new(), command, text.to_owned()] }), ..self }
    }

    /// The whole line, `subject: text (remedy)`, with each part of a command line in the remedy replaced.
    pub fn with_commands(&self, replace: impl Fn(&str) -> String) -> String {
        let mut line = String::new();
        if let Some(Subject { name, file, .. }) = &self.subject {
            // The name of a file is not shortened.
            let is_file = file.as_ref().is_some_and(|file| name.starts_with(&*file.to_string_lossy()));
            line = format!("{}: ", if is_file { in_one_line(name) } else { words(name) });
        }
        line.push_str(&self.text);
        if let Some(remedy) = &self.remedy {
            line += &format!(" ({})", remedy.with_commands(replace));
        }
        line
    }
}

impl Display for Diagnostic {
    /// Writes `subject: text (remedy)`.
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        f.write_str(&self.with_commands(str::to_owned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_of_a_remedy_are_words() {
        let found =
            Diagnostic::warning("no-light", "there is no light").fixed_by("add one, or `--env studio`");
        assert_eq!(found.to_string(), "there is no light (add one, or --env studio)");
        let remedy = found.remedy.as_ref().unwrap();
        assert_eq!(remedy.commands(), [["--env", "studio"]]);
        assert_eq!(remedy.with_commands(|_| "env=\"studio\"".into()), "add one, or env=\"studio\"");
        let command = "explain 'it'\\''s `a`.ron' 3,4".to_owned();
        let shown = Diagnostic::warning("outlier", "a bright sample").fixed_by_command(command, " shows it");
        assert_eq!(shown.to_string(), "a bright sample (explain 'it'\\''s `a`.ron' 3,4 shows it)");
        assert_eq!(shown.remedy.unwrap().commands(), [["explain", "it's `a`.ron", "3,4"]]);
        let found = found.about(Subject::named("lamp\n"));
        assert!(found.to_string().starts_with("lamp\\n: there is no light"));
    }
}
