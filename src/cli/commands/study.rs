//! `rayfront study FILE`: runs the experiments in a file, and writes a page about them.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use indicatif::ProgressBar;

use crate::cli::{failure::Failure, interrupt::Interrupt, output, process_times, progress::styled};
use crate::files::links::make_folder;
use crate::integrator::Stop;
use crate::study::experiment::Run;
use crate::study::experiment::short::shorten;

/// `rayfront study`.
#[derive(Args, Debug)]
pub struct StudyArguments {
    /// The experiments (.ron)
    pub file: PathBuf,
    /// Do a sixteenth of the work: few repetitions, the cheap part of x, coarser references
    #[arg(long)]
    pub short: bool,
    /// Folder for the results [default: the file's name in the folder out/, with _short appended for --short]
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Only report on what has been measured already
    #[arg(long)]
    pub report: bool,
    /// Show neither a progress bar nor a summary
    #[arg(short, long)]
    pub quiet: bool,
}

pub fn run(arguments: &StudyArguments) -> Result<ExitCode, Failure> {
    let mut study = crate::formats::study::load(&arguments.file)?;
    let mut name = arguments.file.file_stem().unwrap_or("study".as_ref()).to_owned();
    if arguments.short {
        shorten(&mut study);
        name.push("_short");
    }
    let out = arguments.output.clone().unwrap_or_else(|| Path::new("out").join(name));
    let folder = arguments.file.parent().unwrap_or(Path::new(""));
    let interrupt = Interrupt::watch();
    let stop = Stop::at(interrupt.flag());
    let run = Run { study: &study, folder, out: &out, cpu: process_times::process_cpu_seconds, stop };
    let jobs = run.jobs()?;

    let bar = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new(jobs.len() as u64) };
    let bar = styled(bar, "{bar:32} {pos} of {len}  {eta} left  {msg}");
    let mut progress = |number: usize, name: &str| {
        bar.set_position(number as u64);
        bar.set_message(name.to_owned());
        !stop.is_set()
    };
    if arguments.report {
        ["plots", "references"].iter().try_for_each(|folder| make_folder(&out.join(folder)))?;
    } else {
        run.run(&jobs, &mut progress)?;
    }
    bar.finish_and_clear();
    let page = run.report(&jobs)?;
    if !arguments.quiet {
        let results = out.join("results.csv");
        output::print(&format!("results    {}\npage       {}\n", results.display(), page.display()))?;
    }
    Ok(interrupt.exit_code().into())
}
