//! Failures, and the program's exit codes.

use std::path::Path;
use std::process::ExitCode;

use crate::error::{CompileError, LoadError, SaveError, in_one_line};
use crate::memory::Shortage;
use crate::render::ThreadError;
use crate::study::experiment::StudyError;
use crate::view::scene::SceneError;
use crate::view::tev::TevError;

/// The cause of a failure. Each kind has its own exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A scene or another input file.
    File,
    /// The command line.
    CommandLine,
    /// Something could not be written.
    Output,
    /// Too little memory, too few threads, or a scene with more elements than its numbers can count.
    Limit,
    /// Results that should be equal differ.
    Difference,
    /// The reader of standard output has closed it; nothing is reported.
    ClosedPipe,
}

impl Fault {
    /// Returns the program's exit code.
    pub fn code(self) -> ExitCode {
        ExitCode::from(self.number())
    }

    /// Returns the exit code as a number.
    pub fn number(self) -> u8 {
        match self {
            Fault::File => 1,
            Fault::CommandLine => 2,
            Fault::Output => 3,
            Fault::Limit => 4,
            Fault::Difference => 5,
            // The code with which shells report an end by SIGPIPE (13).
            Fault::ClosedPipe => 128 + 13,
        }
    }
}

/// A failure: its cause and its message.
#[derive(Debug)]
pub struct Failure {
    fault: Fault,
    message: String,
}

impl Failure {
    /// Creates a failure caused by a scene or another file.
    pub fn file(message: impl Into<String>) -> Failure {
        Failure { fault: Fault::File, message: message.into() }
    }

    /// Attributes a failure of the command line to a file instead.
    pub fn of_file(self) -> Failure {
        let fault = if self.fault == Fault::CommandLine { Fault::File } else { self.fault };
        Failure { fault, ..self }
    }

    /// Creates a failure caused by the command line.
    pub fn command_line(message: impl Into<String>) -> Failure {
        Failure { fault: Fault::CommandLine, message: message.into() }
    }

    /// Creates a failure to write an output.
    pub fn output(message: impl Into<String>) -> Failure {
        Failure { fault: Fault::Output, message: message.into() }
    }

    /// Creates a failure caused by a limit.
    pub fn limit(message: impl Into<String>) -> Failure {
        Failure { fault: Fault::Limit, message: message.into() }
    }

    /// Creates a failure caused by results that should be equal but differ.
    pub fn difference(message: impl Into<String>) -> Failure {
        Failure { fault: Fault::Difference, message: message.into() }
    }

    /// Combines the failures of several outputs, with a note on what became of the rendered film.
    pub fn all(failures: Vec<Failure>, note: &str) -> Failure {
        let told: Vec<Failure> = failures.into_iter().filter(|failure| !failure.is_closed_pipe()).collect();
        let fault = told.first().map_or(Fault::ClosedPipe, |first| first.fault);
        let lines = told.into_iter().map(|failure| failure.message);
        let message = lines.collect::<Vec<_>>().join("\nerror: ");
        Failure { fault, message: format!("{message}\n{note}").trim_end().to_owned() }
    }

    /// Returns a function that converts errors of writing `what` to standard output.
    pub fn stdout(what: &str) -> impl Fn(std::io::Error) -> Failure {
        move |error| match error.kind() {
            std::io::ErrorKind::BrokenPipe => Failure { fault: Fault::ClosedPipe, message: String::new() },
            _ => Failure::output(format!("cannot write {what} to standard output: {error}")),
        }
    }

    /// Returns a function that converts errors of compiling a scene, whose file at `path` could be read.
    pub fn compile(path: &Path) -> impl Fn(CompileError) -> Failure {
        move |error| Failure {
            fault: of_scene(&error),
            message: in_one_line(&format!("{}: {error}", path.display())),
        }
    }

    /// True if the reader of standard output has closed it.
    pub fn is_closed_pipe(&self) -> bool {
        self.fault == Fault::ClosedPipe
    }

    /// Returns the program's exit code.
    pub fn code(&self) -> ExitCode {
        self.fault.code()
    }
}

fn of_scene(error: &CompileError) -> Fault {
    match error {
        CompileError::TooLarge(_) => Fault::Limit,
        // Only --camera selects a camera by name.
        CompileError::UnknownCamera { .. } => Fault::CommandLine,
        CompileError::NoCamera | CompileError::Entity { .. } | CompileError::Invalid { .. } => Fault::File,
    }
}

fn of_file(error: &LoadError) -> Fault {
    match error {
        LoadError::TooLarge { .. } => Fault::Limit,
        LoadError::Option { .. } => Fault::CommandLine,
        LoadError::Io { .. } | LoadError::At { .. } | LoadError::Several(_) | LoadError::Invalid { .. } => {
            Fault::File
        }
    }
}

/// Converts errors into failures of one cause each.
macro_rules! failures {
    ($($error:ty => $fault:ident),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Failure {
                Failure { fault: Fault::$fault, message: error.to_string() }
            }
        }
    )*};
}

failures!(SaveError => Output, TevError => Output, Shortage => Limit, ThreadError => Limit);

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        let fault = of_file(&error);
        let message = match error {
            // The option as typed: `time_s` is --time.
            LoadError::Option { option, reason } => {
                format!("--{}: {reason}", option.trim_end_matches("_s").replace('_', "-"))
            }
            LoadError::Several(errors) => {
                errors.iter().map(LoadError::to_string).collect::<Vec<_>>().join("\nerror: ")
            }
            error => error.to_string(),
        };
        Failure { fault, message }
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Job(reason) => Failure::file(reason),
            StudyError::Save(error) => error.into(),
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let message = error.to_string();
        match error {
            SceneError::Load(error) => error.into(),
            SceneError::Compile { source, .. } => Failure { fault: of_scene(&source), message },
            SceneError::Save(error) => error.into(),
            SceneError::Refused(_) => Failure { fault: Fault::CommandLine, message },
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}
