//! Options shared by all commands that render.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::names::{PROGRESS_FORMS, SCHEDULES, one_of};
use super::parse::{Interval, parse_bits, parse_checkpoint, parse_duration, parse_level, parse_until};
use crate::cli::progress::ProgressForm;
use crate::integrator::Schedule;
use crate::render::Options;
use crate::simd::Isa;

/// The options of execution. No bit of the image depends on them.
#[derive(Args, Debug)]
#[command(next_help_heading = "Work")]
pub struct WorkOptions {
    /// Order in which rays are traced; the image is the same
    #[arg(long, default_value = "wavefront", value_parser = one_of(SCHEDULES))]
    pub schedule: Schedule,
    /// Paths in a wave of the wavefront schedule; the image is the same
    #[arg(long, value_name = "N", default_value_t = crate::render::DEFAULT_WAVE as u32,
          value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub wave: u32,
    /// Threads; 0 means one for each core
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Instruction set [default: the widest available]; the image is the same
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub simd: Option<Isa>,
    /// Show neither progress (a bar on a terminal, else a line every 30 seconds) nor a summary
    #[arg(short, long)]
    pub quiet: bool,
    /// Print statistics as one JSON object
    #[arg(long)]
    pub json: bool,
}

impl WorkOptions {
    /// Returns the options in the form that sessions expect.
    pub fn options(&self) -> Options {
        let (schedule, wave, defaults) = (self.schedule, self.wave as usize, Options::default());
        Options { schedule, wave, isa: self.simd.unwrap_or(defaults.isa), ..defaults }
    }
}

/// The options of live views and of progress messages.
#[derive(Args, Debug)]
pub struct LookOptions {
    /// Print progress for other programs on standard error, at most once a second and only if it has changed: lines
    /// (such as "Progress: 42%"), json (objects) or openjd [default: a bar on a terminal, else a line every 30 seconds]
    #[arg(
        long,
        value_name = "FORM",
        conflicts_with = "quiet",
        help_heading = "Work",
        hide_possible_values = true,
        value_parser = one_of(PROGRESS_FORMS)
    )]
    pub progress: Option<ProgressForm>,
    /// Show the image, as floats, while it renders, in tev or HDRView listening at this address, usually
    /// 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT")]
    pub tev: Option<String>,
    /// Show the image while it renders, in the terminal under the progress bar
    #[arg(long)]
    pub preview: bool,
}

/// The options of outputs.
#[derive(Args, Debug)]
#[command(next_help_heading = "Output")]
pub struct OutputOptions {
    /// Output files: images (.png, .jpg, .webp, .exr, .hdr), a film to continue later (.film), or standard output: - (a
    /// film; with --frames a video, as YUV4MPEG2) or an image as png:-, exr:- and so on; may be given several times [default: the scene's name with .png, in the
    /// current folder]
    #[arg(short, long, aliases = ["out", "outfile", "render-output"], value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Replace a .film that holds something else
    #[arg(long)]
    pub overwrite: bool,
    /// Also write a denoised version of each image, as NAME.denoised with the same extension
    #[arg(long)]
    pub denoise: bool,
    /// Bits per channel of PNG files
    #[arg(long, value_name = "8|16", default_value_t = 8, value_parser = parse_bits)]
    pub bits: u8,
}

/// The rules for stopping, and the interval between checkpoints.
#[derive(Args, Debug)]
#[command(next_help_heading = "Stopping")]
pub struct StopOptions {
    /// Stop once the noise is below this part of the image's brightness, such as noise=1%
    #[arg(long, value_name = "noise=PERCENT", value_parser = parse_until)]
    pub until: Option<f64>,
    /// Stop after this time, such as 90s, 10m or 2h
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub max_time: Option<Duration>,
    /// Save the film at this interval, such as 30s, so that rendering can be continued after any interruption; off:
    /// never [default: 1m, to the .film of -o, else to NAME.checkpoint.film, which is removed at the end]
    #[arg(long, value_name = "TIME|off", value_parser = parse_checkpoint)]
    pub checkpoint: Option<Interval>,
}

/// The options of running a job.
#[derive(Args, Debug)]
pub struct RunOptions {
    /// The rules for stopping.
    #[command(flatten)]
    pub stop: StopOptions,
    /// The live views of the image.
    #[command(flatten)]
    pub look: LookOptions,
    /// The options of execution.
    #[command(flatten)]
    pub work: WorkOptions,
}
