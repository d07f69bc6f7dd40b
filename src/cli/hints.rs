//! Suggestions for a word that is neither a command nor a file.

use std::ffi::OsStr;
use std::path::Path;

use clap::CommandFactory;

use super::Failure;
use super::args::Arguments;
use crate::error::did_you_mean;

/// Returns the failure for a word in the place of a command or a scene that is neither, but resembles a command.
pub fn misspelt_command(word: &OsStr) -> Option<Failure> {
    let path = Path::new(word);
    let is_word = path.extension().is_none() && path.parent() == Some(Path::new(""));
    let word = word.to_str().filter(|word| is_word && !word.starts_with('-') && !path.exists())?;
    let program = Arguments::command();
    let commands: Vec<&str> = program.get_subcommands().map(|command| command.get_name()).collect();
    let hint = did_you_mean(word, commands.iter().copied());
    let is_command = commands.contains(&word) || word == "help";
    (!is_command && !hint.is_empty())
        .then(|| Failure::command_line(format!("there is no command and no scene \"{word}\"{hint}")))
}
