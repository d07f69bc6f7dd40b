//! The resources of a task: cores, memory, time.

use std::path::Path;

use super::arguments::{Engine, PlanArguments};
use crate::cli::args::Render;
use crate::cli::commands::info;
use crate::cli::failure::Failure;
use crate::cli::job::{Job, aov};
use crate::film::Region;
use crate::memory;
use crate::render::{MemoryEstimate, on_threads};

/// The largest number of cores of a task by default.
const USUAL_CORES: usize = 4;
/// The step of memory requests in bytes, so that requests for the same scene are equal.
const STEP: u64 = 64 << 20;

/// The resources of a task.
#[derive(Clone, Copy, Debug)]
pub struct Resources {
    /// The number of cores; `None` for all of the machine that runs the task.
    pub cores: Option<u32>,
    /// The memory in units of 2^20 bytes.
    pub mebibytes: u64,
    /// The time limit in seconds.
    pub seconds: Option<u64>,
}

impl Resources {
    /// Determines the resources of a task that renders a scene. Returns the scene as well, ready to be rendered;
    /// warnings about it have been printed.
    pub fn of(
        plan: &PlanArguments,
        scene: &Path,
        frame: Option<u32>,
        options: &Render,
    ) -> Result<(Job, Resources), Failure> {
        if plan.engine == Engine::Commands && plan.time_limit.is_some() {
            return Err(Failure::command_line(
                "--time-limit: no engine ends commands: add --max-time behind --, which ends them with an image",
            ));
        }
        let threads = u32::try_from(options.run.work.threads).ok().filter(|threads| *threads > 0);
        let cores = plan.cores.or(threads).or_else(|| match plan.engine {
            // A worker has one task at a time, or cores are not counted.
            Engine::Openjd | Engine::Commands => None,
            Engine::Slurm | Engine::Hyperqueue | Engine::Kubernetes => {
                let here = std::thread::available_parallelism().map_or(1, usize::from);
                Some(here.min(USUAL_CORES) as u32)
            }
        });
        let before = memory::resident();
        let (job, bytes) = on_threads(cores.unwrap_or(0) as usize, || {
            let job = Job::load(scene, options.view(frame), options.run.work.quiet, |world| {
                options.apply(world);
            })?;
            let needs = needs(plan, options, job.header.region);
            let rendering = info::rendering_bytes(before, &job.setup, &job.header.settings, &needs);
            Ok::<_, Failure>((job, memory::peak().max(rendering)))
        })??;
        // Other machines take a little more for the same work, and a part of their limit is never granted.
        let bytes = bytes.map(|bytes| bytes + bytes / 4 + memory::RESERVE);
        let bytes = memory::limit().or(bytes).unwrap_or(STEP);
        let mebibytes = bytes.next_multiple_of(STEP) >> 20;
        // Engines count in whole minutes.
        let seconds = plan.time_limit.map(|time| time.as_secs().max(1).next_multiple_of(60));
        Ok((job, Resources { cores, mebibytes, seconds }))
    }

    /// Returns the lines of a script for Slurm.
    pub fn slurm(&self) -> String {
        let cores = self.cores.map_or(String::new(), |cores| format!("#SBATCH --cpus-per-task={cores}\n"));
        let time = self.seconds.map_or(String::new(), |seconds| format!("#SBATCH --time={}\n", seconds / 60));
        format!("{cores}#SBATCH --mem={}M\n{time}", self.mebibytes)
    }

    /// Returns the options of `hq submit`.
    pub fn hyperqueue(&self) -> String {
        let cores = self.cores.map_or("all".to_owned(), |cores| cores.to_string());
        let time = self.seconds.map_or(String::new(), |seconds| format!(" --time-limit {seconds}s"));
        // HyperQueue counts in millions of bytes.
        let megabytes = (self.mebibytes << 20).div_ceil(1_000_000);
        format!("--cpus {cores} --resource mem={megabytes}{time}")
    }
}

/// Returns the parameters of the memory that the render and, if there is one, the merge take besides the scene.
fn needs(plan: &PlanArguments, options: &Render, region: Region) -> MemoryEstimate {
    let region = options.crop.unwrap_or(region);
    MemoryEstimate {
        to_openexr: plan.output.iter().any(|image| aov::holds(image)),
        denoises: options.output.denoise,
        schedule: options.run.work.schedule,
        wave: options.run.work.wave as usize,
        ..MemoryEstimate::usual(region)
    }
}
