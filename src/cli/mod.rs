//! The command line, from arguments to a rendered file.
//!
//! Exit codes: 0 done; those of `failure::Fault`, with the reason in one line on stderr; 129, 130 or 143 interrupted
//! (the state of the render has been saved).

mod ab;
mod aov;
mod args;
mod audit;
mod check;
mod checkpoint;
mod command_line;
mod compare;
mod diff;
mod explain;
mod failure;
mod films;
mod frames;
mod hints;
mod info;
mod interrupt;
mod job;
mod job_args;
mod live_views;
mod loading;
mod ls;
mod manual;
mod merge;
mod output;
mod pilot;
mod plan;
mod process_times;
mod profile;
mod profile_report;
mod progress;
mod record;
mod render;
mod report;
mod reproduce;
mod resume;
mod saving;
mod shard;
mod stop;
mod study;
mod trace;
mod verify;
mod view;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

use crate::render::check_environment;
pub use args::Arguments;
use failure::{Failure, Fault};

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
    let words = command_line::normalize_args(words);
    let outcome = match Arguments::try_parse_from(&words) {
        Ok(arguments) => dispatch(arguments),
        Err(error) => answer(&error, words.get(1)),
    };
    outcome.unwrap_or_else(|failure| failure.tell())
}

/// Checks that words, the first of which is the program's name, are a valid command line, as everything shown in the
/// guides must be.
pub fn understands(words: &[String]) -> Result<(), String> {
    let words = command_line::normalize_args(words.iter().map(OsString::from));
    Arguments::try_parse_from(&words).map(drop).map_err(|error| error.to_string())
}

fn dispatch(arguments: Arguments) -> Result<ExitCode, Failure> {
    arguments.limits.set();
    check_environment()?;
    crate::files::links::follow_only(arguments.typed_outputs());
    match arguments.command {
        Some(args::Command::Render(scene)) => render::run(&scene),
        Some(args::Command::Info(info)) => info::run(&info),
        Some(args::Command::Trace(trace)) => trace::run(&trace),
        Some(args::Command::Compare(images)) => compare::run(&images),
        Some(args::Command::Verify(scene)) => verify::run(&scene),
        Some(args::Command::Explain(pixel)) => explain::run(&pixel),
        Some(args::Command::Profile(scene)) => profile::run(&scene),
        Some(args::Command::Resume(film)) => resume::run(&film),
        Some(args::Command::Merge(films)) => merge::run(&films),
        Some(args::Command::Plan(scene)) => plan::run(&scene),
        Some(args::Command::Reproduce(image)) => reproduce::run(&image),
        Some(args::Command::Study(file)) => study::run(&file),
        Some(args::Command::View(scene)) => view::run(scene),
        Some(args::Command::Check(scene)) => check::run(&scene),
        Some(args::Command::Ls(query)) => ls::run(&query),
        Some(args::Command::Diff(scenes)) => diff::run(&scenes),
        Some(args::Command::Ab(scene)) => ab::run(&scene),
        Some(args::Command::Completions(shell)) => manual::completions(&shell),
        Some(args::Command::Man(folder)) => manual::man(&folder),
        None => render::run(&arguments.render),
    }
}

/// Prints the requested help, or what is wrong with the command line, whose first word is `first`.
fn answer(error: &clap::Error, first: Option<&OsString>) -> Result<ExitCode, Failure> {
    let misspelt = first.filter(|_| error.use_stderr()).and_then(|word| hints::misspelt_command(word));
    if let Some(failure) = misspelt {
        return Err(failure);
    }
    let printed = error.print();
    if error.use_stderr() {
        return Ok(Fault::CommandLine.code());
    }
    printed.and_then(|()| std::io::stdout().flush()).map_err(Failure::stdout("the help"))?;
    Ok(ExitCode::SUCCESS)
}

/// Loads a scene with the given size and number of samples, ready to be rendered in several ways.
fn setup(
    (scene, model): (&std::path::Path, &args::ModelOptions),
    (size, samples): (args::ImageSize, u32),
    light: &args::LightOptions,
    camera: Option<&str>,
) -> Result<std::sync::Arc<crate::integrator::RenderSetup>, Failure> {
    let mut world = crate::formats::load_with(scene, &model.of_size(Some(size)))?;
    world.settings.samples = samples;
    light.apply(&mut world);
    let compiled = crate::compile::compile(&world, camera).map_err(Failure::compile(scene))?;
    let setup = crate::render::setup(compiled, &world.settings);
    let region = crate::film::Region::whole(world.settings.size);
    crate::render::MemoryEstimate::usual(region).check(&setup, &world.settings)?;
    Ok(std::sync::Arc::new(setup))
}
