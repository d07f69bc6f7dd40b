//! The command line's arguments.

mod names;
mod options;
mod parse;
mod words;

use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand};

use super::aov::AovName;
use super::frames::FrameOptions;
use super::job_args::{LookOptions, OutputOptions, StopOptions, WorkOptions};
use super::shard::ShardOption;
use crate::film::Region;
use crate::simd::Isa;
use crate::world::World;
pub use names::{CoherenceName, QualityName, ScheduleName};
pub use options::{ImageSize, LightOptions, ModelOptions, PictureOptions};
pub(super) use parse::{parse_bits, parse_exposure, parse_level, parse_place, parse_size};
use parse::{parse_crop, parse_samples};
pub use words::Words;

/// What is shown below the options.
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
pub struct Arguments {
    /// Commands other than rendering.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// What to render, if no other command is given.
    #[command(flatten)]
    pub render: Render,
    /// What the process may do.
    #[command(flatten)]
    pub limits: ProcessLimits,
}

/// What the process may do.
#[derive(Args, Debug)]
#[command(next_help_heading = "Limits")]
pub struct ProcessLimits {
    /// Use at most this much memory, such as 800M or 4G [default: what is free, and what ulimit -v and control groups
    /// allow]
    #[arg(long, global = true, value_name = "SIZE", value_parser = crate::memory::parse)]
    pub memory: Option<u64>,
    /// Let scenes refer to files outside their folders
    #[arg(long, global = true)]
    pub allow_outside: bool,
}

impl ProcessLimits {
    /// Sets these limits from now on.
    pub fn set(&self) {
        self.memory.iter().for_each(|bytes| crate::memory::set_limit(*bytes));
        if self.allow_outside {
            crate::files::allow_outside();
        }
    }
}

impl Arguments {
    /// The files and folders to write that were typed, word for word: not names in which something is filled in.
    pub fn typed_outputs(&self) -> Vec<&Path> {
        let (several, one): (&[PathBuf], Option<&PathBuf>) = match &self.command {
            None => (&self.render.output.output, self.render.part.pilot.as_ref()),
            Some(Command::Render(render)) => (&render.output.output, render.part.pilot.as_ref()),
            Some(Command::Resume(resume)) => (&resume.output.output, Some(&resume.film)),
            Some(Command::Merge(merge)) => (&merge.output.output, None),
            Some(Command::Trace(trace)) => (&[], trace.out.as_ref()),
            Some(Command::Compare(compare)) => (&[], compare.heatmap.as_ref()),
            Some(Command::Profile(profile)) => (&[], profile.trace.as_ref()),
            Some(Command::Plan(plan)) => (&plan.output, plan.folder.as_ref()),
            Some(Command::Study(study)) => (&[], study.output.as_ref()),
            Some(Command::Man(man)) => (&[], Some(&man.folder)),
            // These write nothing, or under names that are made of others.
            Some(
                Command::Info(_)
                | Command::Verify(_)
                | Command::Explain(_)
                | Command::Reproduce(_)
                | Command::View(_)
                | Command::Check(_)
                | Command::Ls(_)
                | Command::Diff(_)
                | Command::Ab(_)
                | Command::Completions(_),
            ) => (&[], None),
        };
        several.iter().chain(one).map(PathBuf::as_path).collect()
    }
}

/// Commands other than rendering.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Render a scene (the word may be left out)
    #[command(after_help = AFTER_HELP)]
    Render(Box<Render>),
    /// Show what a scene holds: counts, bounds, memory, materials, lights, textures, warnings
    Info(Info),
    /// Trace rays from a file: hits to another file, speed, build time, memory
    Trace(Trace),
    /// Measure how far an image is from a reference
    Compare(super::compare::Compare),
    /// Render in every possible way and compare the films
    Verify(super::verify::Verify),
    /// Follow the samples of a pixel from the camera to their ends
    Explain(super::explain::Explain),
    /// Show where the time goes, in both schedules
    Profile(super::profile::ProfileArguments),
    /// Continue a film: finish what was interrupted, or add samples
    Resume(super::resume::Resume),
    /// Merge films that hold different samples of one image
    Merge(super::merge::Merge),
    /// Write job files that render a scene in parts on many machines
    Plan(super::plan::PlanArguments),
    /// Render an image again from the record in it, and say whether it is the same
    Reproduce(super::reproduce::Reproduce),
    /// Show a scene on a page while it renders: look around, ask questions, edit its files
    View(super::view::ViewArguments),
    /// Report what is probably not as intended in a scene, and how to fix it
    Check(super::check::Check),
    /// List the parts of a scene that a query selects
    Ls(super::ls::Ls),
    /// Show in which components two scenes differ
    Diff(super::diff::Diff),
    /// Render a scene with and without changes, and measure the difference
    Ab(super::ab::Ab),
    /// Run the experiments in a file and report on them
    Study(super::study::StudyArguments),
    /// Print a script with which a shell completes commands and options
    Completions(super::manual::Completions),
    /// Write man pages
    Man(super::manual::Man),
}

/// `rayfront info`.
#[derive(Args, Debug)]
pub struct Info {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    pub scene: PathBuf,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
}

/// `rayfront trace`.
#[derive(Args, Debug)]
pub struct Trace {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    pub scene: PathBuf,
    /// File of rays: 8 little-endian 32-bit floats each, origin x y z, direction x y z, t_min, t_max
    #[arg(long, value_name = "FILE")]
    pub rays: PathBuf,
    /// Where the hits go: 3 floats t u v and the primitive as a 32-bit integer each, infinity 0 0 and 2^32 - 1 for a miss
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Only find out whether there is any hit: 0 0 0 and primitive 0 for each ray that has one
    #[arg(long)]
    pub any: bool,
    /// Trace this many times; the best time counts
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub repeat: u32,
    /// Threads; 0 means one for each core
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Instruction set [default: the widest available]; the hits are the same
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub simd: Option<Isa>,
    /// Effort put into building the acceleration structure [default: the scene's]
    #[arg(long, value_enum)]
    pub quality: Option<QualityName>,
    /// What is known about consecutive rays; the hits are the same
    #[arg(long, value_enum, default_value_t = CoherenceName::Unknown)]
    pub coherence: CoherenceName,
    /// Hits to compare with, in the format of --out
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
}

/// `rayfront render SCENE` and `rayfront SCENE`.
#[derive(Args, Debug)]
pub struct Render {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    #[arg(required = true)]
    pub scene: Option<PathBuf>,
    /// What it looks like.
    #[command(flatten)]
    pub picture: PictureOptions,
    /// Render only columns X0 to X1 and rows Y0 to Y1 (X1 and Y1 not included)
    #[arg(long, help_heading = "Picture", value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    pub crop: Option<Region>,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
    /// What comes out of it.
    #[command(flatten)]
    pub output: OutputOptions,
    /// Write layers besides light into the .exr file (or into NAME.aov.exr) [default: the scene's]
    #[arg(long, help_heading = "Output", value_name = "NAMES", value_enum, value_delimiter = ',')]
    pub aov: Vec<AovName>,
    /// Which part of the samples.
    #[command(flatten)]
    pub part: PartOptions,
    /// Which moments.
    #[command(flatten)]
    pub frames: FrameOptions,
    /// When to stop.
    #[command(flatten)]
    pub stop: StopOptions,
    /// Where the image is shown meanwhile.
    #[command(flatten)]
    pub look: LookOptions,
    /// How to work.
    #[command(flatten)]
    pub work: WorkOptions,
    /// Whether to continue after that.
    #[command(flatten)]
    pub watch: WatchOptions,
}

/// Which part of the samples is rendered.
#[derive(Args, Debug)]
#[command(next_help_heading = "Parts and frames")]
pub struct PartOptions {
    /// Render one part of the samples: its number, from 0, and how many parts there are, such as 3/64; auto/64 and
    /// auto take the number from the scheduler that runs this
    #[arg(long, value_name = "I/N", value_parser = super::shard::parse, conflicts_with = "samples")]
    pub shard: Option<ShardOption>,
    /// Render only these samples, such as 0..16; a plain number, such as 64, means the same as --spp
    #[arg(long, value_name = "FIRST..END", value_parser = parse_samples)]
    pub samples: Option<[u32; 2]>,
    /// With --adaptive=unbiased: a film with what the pilot has chosen; if it does not exist, the pilot is rendered
    /// and saved in it
    #[arg(long, value_name = "FILE")]
    pub pilot: Option<PathBuf>,
    /// Render only the pilot
    #[arg(long, requires = "pilot")]
    pub pilot_only: bool,
}

/// Whether a scene is rendered while it is written.
#[derive(Args, Debug)]
#[command(next_help_heading = "Work")]
pub struct WatchOptions {
    /// Render again whenever the scene or a file that it names changes, until Ctrl-C
    #[arg(long, conflicts_with_all = ["frames", "shard", "samples", "pilot"])]
    pub watch: bool,
    /// After each change, prove that whatever was reused is the same as if it had been made again
    #[arg(long, requires = "watch")]
    pub paranoid: bool,
}

impl Render {
    /// Changes the scene's settings to what was asked for here.
    pub fn apply(&self, world: &mut World) {
        self.picture.apply(world);
        if !self.aov.is_empty() {
            world.settings.aov = super::aov::list(&self.aov);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declaration_is_sound() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }
}
