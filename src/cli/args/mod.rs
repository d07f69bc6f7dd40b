//! Groups of options, most of which several commands share.

mod frames;
mod job;
mod names;
mod parse;
mod picture;
mod render;
mod shard;

use clap::Args;

pub use frames::Frames;
pub use job::{OutputOptions, RunOptions, WorkOptions};
pub use names::{
    ADAPTIVE, COHERENCES, GROUNDS, LIGHT_UNITS, NamedValues, PROGRESS_FORMS, SAMPLERS, SCHEDULES, TONEMAPS,
    TRANSPORTS, UP_AXES, name_of, one_of,
};
pub use parse::{parse_duration, parse_exposure, parse_level, parse_place, parse_size};
pub use picture::{ImageSize, ModelOptions, PictureLook, PictureOptions, SampleOptions, StudyOptions};
pub use render::Render;

/// The limits of the process.
#[derive(Args, Debug)]
#[command(next_help_heading = "Limits")]
pub struct ProcessLimits {
    /// Use at most this much memory, such as 800M or 4G [default: all free memory that ulimit -v and control groups
    /// allow]
    #[arg(long, global = true, value_name = "SIZE", value_parser = crate::memory::parse)]
    pub memory: Option<u64>,
    /// Let scenes refer to files outside their folders
    #[arg(long, global = true)]
    pub allow_outside: bool,
}

impl ProcessLimits {
    /// Sets these limits for the process.
    pub fn set(&self) {
        self.memory.iter().for_each(|bytes| crate::memory::set_limit(*bytes));
        if self.allow_outside {
            crate::files::allow_outside();
        }
    }
}
