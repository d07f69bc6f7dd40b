//! The command line: arguments to a rendered file.
//!
//! Exit codes: 0 done, 1 a file or scene is at fault (one line on stderr), 2 the command
//! line is, 129, 130 or 143 interrupted (what there was has been saved).

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
mod films;
mod frames;
mod info;
mod interrupt;
mod job;
mod job_args;
mod loading;
mod ls;
mod merge;
mod output;
mod pilot;
mod plan;
mod profile;
mod profile_report;
mod render;
mod report;
mod reproduce;
mod resume;
mod shard;
mod stop;
mod study;
mod trace;
mod usage;
mod verify;
mod view;

use std::process::ExitCode;

use clap::Parser;

pub use args::Arguments;

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse_from(command_line::understood(std::env::args_os()));
    let outcome = match arguments.command {
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
        None => render::run(&arguments.render),
    };
    match outcome {
        Ok(code) => code,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

/// A scene in a size and with samples of its own, ready to be rendered in several ways.
fn frame(
    scene: &std::path::Path,
    size: args::ImageSize,
    samples: u32,
    light: &args::LightOptions,
    camera: Option<&str>,
) -> Result<std::sync::Arc<crate::integrator::Frame>, Failure> {
    let mut world = crate::formats::load(scene)?;
    world.settings.size = size;
    world.settings.samples = samples;
    light.apply(&mut world);
    let compiled = crate::compile::compile(&world, camera)
        .map_err(|error| Failure(format!("{}: {error}", scene.display())))?;
    Ok(std::sync::Arc::new(crate::integrator::Frame::new(compiled, &world.settings)))
}

/// Why there is no result, in one line.
struct Failure(String);

impl<E: std::error::Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure(error.to_string())
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}
