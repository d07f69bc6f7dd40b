//! `rayfront completions SHELL` and `rayfront man FOLDER`: the command line for shells and for `man`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Command};

use crate::cli::{failure::Failure, output};
use crate::error::SaveError;
use crate::files::atomic_write::write_whole;
use crate::files::links::make_folder;

/// `rayfront completions`.
#[derive(Args, Debug)]
pub struct Completions {
    /// The shell
    pub shell: clap_complete::Shell,
}

/// `rayfront man`.
#[derive(Args, Debug)]
pub struct Man {
    /// Folder for the pages; created if it does not exist
    pub folder: PathBuf,
}

/// Prints a script that the shell reads.
pub fn completions(arguments: &Completions, mut program: Command) -> Result<ExitCode, Failure> {
    // Not printed by the generator, which panics if it cannot write.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "rayfront", &mut script);
    output::print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a page for the program and one for each command.
pub fn man(arguments: &Man, program: Command) -> Result<ExitCode, Failure> {
    let folder = &arguments.folder;
    make_folder(folder)?;
    let mut program = program.disable_help_subcommand(true);
    program.build();
    write_pages(program, folder)?;
    output::print(&format!("man pages  {}\n", folder.join("rayfront*.1").display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the pages of a command and its subcommands, each whole or not at all.
fn write_pages(command: Command, folder: &Path) -> Result<(), SaveError> {
    let below = command.get_subcommands().filter(|below| !below.is_hide_set()).cloned();
    below.collect::<Vec<_>>().into_iter().try_for_each(|below| write_pages(below, folder))?;
    let page = clap_mangen::Man::new(command);
    write_whole(&folder.join(page.get_filename()), |mut file| {
        page.render(&mut file).and_then(|()| file.flush())
    })
}
