//! `rayfront completions SHELL` and `rayfront man FOLDER`: the command line for shells and for `man`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory};

use super::args::Arguments;
use super::{Failure, output};
use crate::error::SaveError;

/// `rayfront completions`.
#[derive(Args, Debug)]
pub struct Completions {
    /// Which shell
    pub shell: clap_complete::Shell,
}

/// `rayfront man`.
#[derive(Args, Debug)]
pub struct Man {
    /// Folder for the pages; created if it does not exist
    pub folder: PathBuf,
}

/// Prints a script that the shell reads.
pub(super) fn completions(arguments: &Completions) -> Result<ExitCode, Failure> {
    // Printed by our own means: the generator panics where it cannot write.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "rayfront", &mut script);
    output::print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a page of the program and one of each command.
pub(super) fn man(arguments: &Man) -> Result<ExitCode, Failure> {
    let folder = &arguments.folder;
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Arguments::command(), folder))
        .map_err(|error| SaveError::new(folder, error))?;
    output::print(&format!("man pages  {}\n", folder.join("rayfront*.1").display()))?;
    Ok(ExitCode::SUCCESS)
}
