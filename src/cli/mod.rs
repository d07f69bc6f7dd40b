//! The command line, from arguments to a rendered file.
//!
//! Exit codes: 0 done; those of `failure::Fault`, with the reason in one line on stderr; 129, 130 or 143 interrupted
//! (the state of the render has been saved).

mod args;
mod command_line;
mod commands;
mod failure;
mod interrupt;
mod job;
mod output;
mod process_times;
mod progress;

use std::ffi::{OsStr, OsString};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use self::args::{ProcessLimits, Render};
use self::command_line::{CommandLine, normalize_args};
use self::commands::{
    ab, check, compare, diff, explain, furnace, info, ls, manual, merge, mix, plan, profile, render,
    reproduce, resume, study, trace, verify, view,
};
use self::failure::{Failure, Fault};
use crate::error::did_you_mean;
use crate::formats::elsewhere::option_advice;
use crate::render::check_environment;

/// The text below the options in the help.
const AFTER_HELP: &str = "\
rayfront render SCENE and rayfront SCENE are the same.

Examples:
  rayfront scene.ron --size 320x180 -s 4 -o quick.png      a quick look
  rayfront model.glb --env sky -o model.png -o model.exr   a model under a sky, as two files of one rendering
  rayfront scene.ron --max-time 10m --denoise              what ten minutes give, and the same without noise

Exit codes: 0 done; 1 a scene or another file is at fault; 2 the command line is; 3 output could not be
written; 4 a limit was met (memory, size, threads); 5 a difference was found; 129, 130, 143 interrupted (what
there was has been saved); 141 whoever read the output has closed it.";

/// A CPU renderer: a scene in, an image out.
#[derive(Parser, Debug)]
#[command(version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = AFTER_HELP)]
struct Arguments {
    /// The command, if one is given.
    #[command(subcommand)]
    command: Option<Command>,
    /// The options of rendering, if no command is given.
    #[command(flatten)]
    render: Option<Render>,
    /// The limits of the process.
    #[command(flatten)]
    limits: ProcessLimits,
}

/// The program's commands.
#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene (the word may be left out)
    #[command(after_help = AFTER_HELP)]
    Render(Box<Render>),
    /// Show the contents of a scene: counts, bounds, memory, materials, lights, textures, warnings
    Info(info::Info),
    /// Trace rays from a file: hits to another file, speed, build time, memory
    Trace(trace::Trace),
    /// Measure how far an image is from a reference
    Compare(compare::Compare),
    /// Render in every possible way and compare the films
    Verify(verify::Verify),
    /// Follow the samples of a pixel from the camera to their ends
    Explain(explain::Explain),
    /// Measure a material of a scene: the light that it returns by angle and roughness, and whether its sampling is right
    Furnace(furnace::Furnace),
    /// Show where the time goes, in both schedules
    Profile(profile::ProfileArguments),
    /// Continue a film: finish what was interrupted, or add samples
    Resume(resume::Resume),
    /// Merge films that hold different samples of one image
    Merge(merge::Merge),
    /// Mix the lamps of a film with light groups: brighter, darker, of other colours, without rendering
    Mix(mix::Mix),
    /// Write job files that render a scene in parts on many machines
    Plan(plan::PlanArguments),
    /// Render an image again from the record in it, and report whether it is identical
    Reproduce(reproduce::Reproduce),
    /// Show a scene on a web page while it renders: look around, explain pixels, edit its files
    View(view::ViewArguments),
    /// Report what is probably not as intended in a scene, and how to fix it
    Check(check::Check),
    /// List the parts of a scene that a query selects
    Ls(ls::Ls),
    /// Show in which components two scenes differ
    Diff(diff::Diff),
    /// Render a scene with and without changes, and measure the difference
    Ab(ab::Ab),
    /// Run the experiments in a file and report on them
    Study(study::StudyArguments),
    /// Print a shell script that completes commands and options
    Completions(manual::Completions),
    /// Write man pages
    Man(manual::Man),
}

impl Command {
    /// Returns the output files and folders as typed, before placeholders are filled in.
    fn typed_outputs(&self) -> Vec<&Path> {
        let (several, one): (&[PathBuf], Option<&PathBuf>) = match self {
            Command::Render(render) => (&render.output.output, render.part.pilot.as_ref()),
            Command::Resume(resume) => (&resume.output.output, Some(&resume.film)),
            Command::Merge(merge) => (&merge.output.output, None),
            Command::Mix(mix) => (&mix.output.output, None),
            Command::Trace(trace) => (&[], trace.out.as_ref()),
            Command::Compare(compare) => (&[], compare.heatmap.as_ref()),
            Command::Furnace(furnace) => (&[], furnace.html.as_ref()),
            Command::Profile(profile) => return profile.outputs(),
            Command::Plan(plan) => (&plan.output, plan.folder.as_ref()),
            Command::Study(study) => (&[], study.output.as_ref()),
            Command::View(view) => (&[], view.output.as_ref()),
            Command::Man(man) => (&[], Some(&man.folder)),
            // These write nothing, or to names derived from others.
            Command::Info(_)
            | Command::Verify(_)
            | Command::Explain(_)
            | Command::Reproduce(_)
            | Command::Check(_)
            | Command::Ls(_)
            | Command::Diff(_)
            | Command::Ab(_)
            | Command::Completions(_) => (&[], None),
        };
        several.iter().chain(one).map(PathBuf::as_path).collect()
    }
}

/// The size of the program's stack in bytes.
const STACK: usize = 8 << 20;

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    with_one_arena();
    interrupt::guard();
    let run = || run(std::env::args_os());
    // The stack that the system gives a process can be too small (`ulimit -s`).
    match std::thread::Builder::new().name("main".into()).stack_size(STACK).spawn(run) {
        Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        Err(_) => run(),
    }
}

/// Restarts the process with one heap for all threads, if the system limits its address space. By default glibc
/// reserves 64 MB of address space for the heap of each thread as long as that much is left, so a higher limit could
/// leave less memory. No two threads allocate so much that they would contend for the heap.
fn with_one_arena() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        use std::os::unix::process::CommandExt;
        const ARENAS: &str = "MALLOC_ARENA_MAX";
        if std::env::var_os(ARENAS).is_some() || !crate::memory::addresses_are_limited() {
            return;
        }
        let (Ok(program), mut words) = (std::env::current_exe(), std::env::args_os()) else { return };
        let name = words.next().unwrap_or_else(|| program.clone().into_os_string());
        // If this returns, it has failed, and nothing has changed.
        let _ = std::process::Command::new(program).arg0(name).args(words).env(ARENAS, "1").exec();
    }
}

/// Runs the command in `words`, the first of which is the program's name.
pub fn run(words: impl Iterator<Item = OsString>) -> ExitCode {
    let words = normalize_args(words);
    let outcome = match Arguments::try_parse_from(&words) {
        Ok(arguments) => dispatch(arguments, &words),
        Err(error) => answer(error, &words),
    };
    outcome.unwrap_or_else(|failure| {
        if !failure.is_closed_pipe() {
            output::tell_all(&format!("error: {failure}"));
        }
        failure.code()
    })
}

/// Checks that words, the first of which is the program's name, are a valid command line, as everything shown in the
/// guides must be.
pub fn understands(words: &[String]) -> Result<(), String> {
    let words = normalize_args(words.iter().map(OsString::from));
    Arguments::try_parse_from(&words).map(drop).map_err(|error| error.to_string())
}

/// Runs the command in the arguments, which `words` are as typed.
fn dispatch(arguments: Arguments, words: &[OsString]) -> Result<ExitCode, Failure> {
    arguments.limits.set();
    check_environment()?;
    let render = arguments.render.map(|render| Command::Render(Box::new(render)));
    let Some(command) = arguments.command.or(render) else {
        return Err(Failure::command_line("no scene was given"));
    };
    crate::files::links::follow_only(command.typed_outputs());
    match command {
        Command::Render(render) => match misspelt_command(render.scene.as_os_str()) {
            Some(failure) => Err(failure),
            None => {
                let words = words.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
                render::run(&render, CommandLine::parse(&words.collect::<Vec<_>>()))
            }
        },
        Command::Info(info) => info::run(&info),
        Command::Trace(trace) => trace::run(&trace),
        Command::Compare(images) => compare::run(&images),
        Command::Verify(scene) => verify::run(&scene),
        Command::Explain(pixel) => explain::run(&pixel),
        Command::Furnace(material) => furnace::run(&material),
        Command::Profile(scene) => profile::run(&scene),
        Command::Resume(film) => resume::run(&film),
        Command::Merge(films) => merge::run(&films),
        Command::Mix(film) => mix::run(&film),
        Command::Plan(scene) => plan::run(&scene),
        Command::Reproduce(image) => reproduce::run(&image),
        Command::Study(file) => study::run(&file),
        Command::View(scene) => view::run(scene),
        Command::Check(scene) => check::run(&scene),
        Command::Ls(query) => ls::run(&query),
        Command::Diff(scenes) => diff::run(&scenes),
        Command::Ab(scene) => ab::run(&scene),
        Command::Completions(shell) => manual::completions(&shell, Arguments::command()),
        Command::Man(folder) => manual::man(&folder, Arguments::command()),
    }
}

/// Prints the requested help, or what is wrong with the command line.
fn answer(error: clap::Error, words: &[OsString]) -> Result<ExitCode, Failure> {
    let misspelt = words.get(1).filter(|_| error.use_stderr()).and_then(|word| misspelt_command(word));
    if let Some(failure) = misspelt {
        return Err(failure);
    }
    let is_mistake = error.use_stderr();
    let printed = if is_mistake { with_our_tip(error, words).print() } else { error.print() };
    if is_mistake {
        return Ok(Fault::CommandLine.code());
    }
    printed.and_then(|()| std::io::stdout().flush()).map_err(Failure::stdout("the help"))?;
    Ok(ExitCode::SUCCESS)
}

/// Replaces the tip of an error about an unknown option: by what other programs' option is called here, or by an option
/// with nearly that name.
fn with_our_tip(mut error: clap::Error, words: &[OsString]) -> clap::Error {
    use clap::error::{ContextKind, ContextValue, ErrorKind};
    let Some(ContextValue::String(option)) = error.get(ContextKind::InvalidArg) else { return error };
    if error.kind() != ErrorKind::UnknownArgument {
        return error;
    }
    let tip = match option.starts_with('-') {
        true => tip_on(&option.clone(), words),
        false => tip_on_pair(&option.clone(), words),
    };
    if tip.is_none() && !option.starts_with('-') {
        return error;
    }
    for kind in [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::Suggested] {
        error.remove(kind);
    }
    if let Some(tip) = tip {
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}

/// Returns what to type in place of two numbers, if `second` is one that follows another.
fn tip_on_pair(second: &str, words: &[OsString]) -> Option<String> {
    let is_number = |word: &str| word.parse::<u32>().is_ok();
    let mut pairs = words.windows(2).filter(|pair| pair[1] == second && is_number(second));
    let first = pairs.find_map(|pair| pair[0].to_str().filter(|first| is_number(first)))?;
    Some(format!("two numbers are one word: {first},{second}"))
}

/// Returns what to type in place of an unknown option.
fn tip_on(option: &str, words: &[OsString]) -> Option<String> {
    if let Some(advice) = option_advice(option) {
        return Some(advice.into_owned());
    }
    let program = Arguments::command();
    let command = words.get(1).and_then(|word| program.find_subcommand(word)).unwrap_or(&program);
    let names: Vec<String> = command
        .get_arguments()
        .filter_map(|argument| argument.get_long())
        .map(|name| format!("--{name}"))
        .collect();
    let name = option.split('=').next().unwrap_or_default();
    let near = did_you_mean(name, names.iter().map(String::as_str));
    let near = near.trim().trim_start_matches("(did you mean ").trim_end_matches("?)");
    (name.starts_with("--") && !near.is_empty()).then(|| format!("did you mean {near}?"))
}

/// Returns the failure for a word in the place of a command or a scene that is neither, but resembles a command.
fn misspelt_command(word: &OsStr) -> Option<Failure> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_that_tips_say_to_type_is_an_option() {
        let mut count = 0;
        for typed in crate::formats::elsewhere::typed_options() {
            let words = ["rayfront", "scene.ron"].map(str::to_owned).into_iter();
            let words: Vec<String> = words.chain(shlex::split(typed).expect("closed quotes")).collect();
            assert_eq!(understands(&words), Ok(()), "{typed}");
            count += 1;
        }
        assert!(count > 25, "{count}");
    }

    #[test]
    fn unknown_options_get_what_to_type_or_nothing() {
        let tip = |line: &str| {
            let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
            let error = Arguments::try_parse_from(&words).expect_err(line);
            with_our_tip(error, &words).to_string()
        };
        for (line, typed) in [
            ("rayfront a.ron --width 640", "tip: --size 1280x720"),
            ("rayfront render a.ron --fovy=40", "tip: --fov 40"),
            ("rayfront a.ron --no-background", "tip: --transparent"),
            ("rayfront a.glb --camera-azimuth-angle 30", "tip: --orbit 30,15"),
            ("rayfront a.glb -E CYCLES", "tip: --transport path"),
            ("rayfront a.ron --exposre 1", "tip: did you mean \"--exposure\"?"),
            ("rayfront compare a.png b.png --max-rms 1", "tip: did you mean \"--max-rmse\"?"),
        ] {
            let text = tip(line);
            assert!(text.contains(typed) && text.matches("tip:").count() == 1, "{text}");
        }
        for line in ["rayfront a.ron --wibble", "rayfront a.ron --strands 3", "rayfront info a.ron --grain"] {
            assert!(!tip(line).contains("tip:"), "{}", tip(line));
        }
        for line in [
            "--resolution 640x480", "--hdri studio", "--max-depth 4", "--bounces 4", "--samples-count 4",
            "--out a.png",
        ] {
            let words = ["rayfront", "a.ron"].into_iter().chain(line.split(' ')).map(str::to_owned);
            assert_eq!(understands(&words.collect::<Vec<_>>()), Ok(()), "{line}");
        }
    }

    #[test]
    fn clap_declaration_is_valid() {
        Arguments::command().debug_assert();
    }
}
