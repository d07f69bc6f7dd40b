//! The arguments of `rayfront plan`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, ValueEnum};

use crate::cli::args::{ProcessLimits, Render, parse_duration};
use crate::cli::failure::Failure;
use crate::error::in_one_line;

/// `rayfront plan`.
#[derive(Args, Debug)]
pub struct PlanArguments {
    /// The scene
    pub scene: PathBuf,
    /// Number of parts of the samples; with -- --frames there is one task per frame instead
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub shards: Option<u32>,
    /// Engine that runs the jobs
    #[arg(long = "for", value_name = "ENGINE", value_enum)]
    pub engine: Engine,
    /// File for the image; may be given several times [default: the scene's name with .png, in the current folder; for
    /// frames with .####.png]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Folder for the job files and the parts [default: the scene's name with .jobs, in the current folder]
    #[arg(long, value_name = "FOLDER")]
    pub folder: Option<PathBuf>,
    /// Program that the engine starts [default: this program; for kubernetes: rayfront]
    #[arg(long, value_name = "FILE")]
    pub program: Option<String>,
    /// Cores of each task [default: --threads after --; else, for slurm, hyperqueue and kubernetes, those of this
    /// machine, but at most 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub cores: Option<u32>,
    /// Longest time of each task, such as 2h, after which the engine ends it
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub time_limit: Option<Duration>,
    /// For kubernetes: the container's image
    #[arg(long, value_name = "NAME", default_value = concat!("rayfront:", env!("CARGO_PKG_VERSION")))]
    pub image: String,
    /// For kubernetes: the claim of the volume that holds the current folder, including scene, parts and image
    #[arg(long, value_name = "NAME", default_value = "rayfront")]
    pub volume: String,
    /// Options of the render, after --, such as -- --spp 1024
    #[arg(last = true, value_name = "OPTIONS")]
    pub options: Vec<String>,
}

/// The options of the tasks, behind `--`.
#[derive(Parser)]
#[command(name = "rayfront")]
pub struct TaskArguments {
    /// The options of the render.
    #[command(flatten)]
    pub render: Render,
    /// The limits of the process.
    #[command(flatten)]
    pub limits: ProcessLimits,
}

/// The engine that runs the jobs.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// An array, and a merge that waits for its end
    Slurm,
    /// A template of Open Job Description, for render farms such as AWS Deadline Cloud
    Openjd,
    /// An array of HyperQueue
    Hyperqueue,
    /// An indexed job and a merge
    Kubernetes,
    /// One command per line, for xargs, GNU parallel, hq submit --each-line or cuecmd
    Commands,
}

impl PlanArguments {
    /// Refuses names with control characters, which would end lines of job files.
    pub fn check_names(&self) -> Result<(), Failure> {
        let is_odd = |path: &&PathBuf| path.to_string_lossy().chars().any(char::is_control);
        let mut names = [&self.scene].into_iter().chain(&self.folder).chain(&self.output);
        names.find(is_odd).map_or(Ok(()), |path| {
            let path = in_one_line(&path.to_string_lossy());
            Err(Failure::command_line(format!("{path}: job files cannot hold such a name: rename it")))
        })
    }

    /// Parses the options of the tasks. Errors in them appear now, not in every part.
    pub fn arguments(&self) -> Result<TaskArguments, Failure> {
        let command = ["rayfront".into(), self.scene.to_string_lossy().into_owned()];
        let arguments =
            TaskArguments::try_parse_from(command.iter().chain(&self.options)).map_err(|error| {
                Failure::command_line(error.to_string().trim_start_matches("error: ").trim_end().to_owned())
            })?;
        if !arguments.render.output.output.is_empty() {
            return Err(Failure::command_line(
                "where things go is said with --output and --folder, before --",
            ));
        }
        let part = &arguments.render.part;
        if part.shard.is_some() || part.samples.is_some() || part.pilot.is_some() {
            return Err(Failure::command_line(
                "--shard, --samples and --pilot are what every task gets: leave them out behind --",
            ));
        }
        Ok(arguments)
    }

    /// Returns the program that the engine starts.
    pub fn program(&self) -> String {
        match &self.program {
            Some(program) => program.clone(),
            None if self.engine == Engine::Kubernetes => "rayfront".into(),
            None => {
                std::env::current_exe().map_or("rayfront".into(), |path| path.to_string_lossy().into_owned())
            }
        }
    }
}
