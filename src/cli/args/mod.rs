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
pub struct Arguments {
    /// The command, if one is given.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// The options of rendering, if no command is given.
    #[command(flatten)]
    pub render: Render,
    /// The limits of the process.
    #[command(flatten)]
    pub limits: ProcessLimits,
}

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

impl Arguments {
    /// Returns the output files and folders as typed, before placeholders are filled in.
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
            // These write nothing, or to names derived from others.
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

/// The program's commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Render a scene (the word may be left out)
    #[command(after_help = AFTER_HELP)]
    Render(Box<Render>),
    /// Show the contents of a scene: counts, bounds, memory, materials, lights, textures, warnings
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
    /// Render an image again from the record in it, and report whether it is identical
    Reproduce(super::reproduce::Reproduce),
    /// Show a scene on a web page while it renders: look around, explain pixels, edit its files
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
    /// Print a shell script that completes commands and options
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
    /// The options for reading the scene.
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
    /// File for the hits: for each ray 3 floats t u v and the primitive as a 32-bit integer; infinity 0 0 and 2^32 - 1
    /// for a miss
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Only test whether each ray hits anything: 0 0 0 and primitive 0 for each that does
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
    /// Coherence of consecutive rays; the hits are the same
    #[arg(long, value_enum, default_value_t = CoherenceName::Unknown)]
    pub coherence: CoherenceName,
    /// Hits to compare with, in the format of --out
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

/// `rayfront render SCENE` and `rayfront SCENE`.
#[derive(Args, Debug)]
pub struct Render {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    #[arg(required = true)]
    pub scene: Option<PathBuf>,
    /// The options of the image.
    #[command(flatten)]
    pub picture: PictureOptions,
    /// Render only columns X0 to X1 and rows Y0 to Y1 (X1 and Y1 not included)
    #[arg(long, help_heading = "Picture", value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    pub crop: Option<Region>,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
    /// The options of outputs.
    #[command(flatten)]
    pub output: OutputOptions,
    /// Write layers besides light into the .exr file (or into NAME.aov.exr) [default: the scene's]
    #[arg(long, help_heading = "Output", value_name = "NAMES", value_enum, value_delimiter = ',')]
    pub aov: Vec<AovName>,
    /// The part of the samples to render.
    #[command(flatten)]
    pub part: PartOptions,
    /// The frames to render.
    #[command(flatten)]
    pub frames: FrameOptions,
    /// The rules for stopping.
    #[command(flatten)]
    pub stop: StopOptions,
    /// The live views of the image.
    #[command(flatten)]
    pub look: LookOptions,
    /// The options of execution.
    #[command(flatten)]
    pub work: WorkOptions,
    /// The options of watching the scene's files.
    #[command(flatten)]
    pub watch: WatchOptions,
}

/// The part of the samples to render.
#[derive(Args, Debug)]
#[command(next_help_heading = "Parts and frames")]
pub struct PartOptions {
    /// Render one part of the samples: its number, from 0, and the number of parts, such as 3/64; auto/64 and auto take
    /// the number from the scheduler that runs this
    #[arg(long, value_name = "I/N", value_parser = super::shard::parse, conflicts_with = "samples")]
    pub shard: Option<ShardOption>,
    /// Render only these samples, such as 0..16; a plain number, such as 64, means the same as --spp
    #[arg(long, value_name = "FIRST..END", value_parser = parse_samples)]
    pub samples: Option<[u32; 2]>,
    /// With --adaptive=unbiased: film that stores the pilot's choice of samples; if it does not exist, the pilot is
    /// rendered and saved in it
    #[arg(long, value_name = "FILE")]
    pub pilot: Option<PathBuf>,
    /// Render only the pilot
    #[arg(long, requires = "pilot")]
    pub pilot_only: bool,
}

/// The options of rendering a scene while it is edited.
#[derive(Args, Debug)]
#[command(next_help_heading = "Work")]
pub struct WatchOptions {
    /// Render again whenever the scene or a file that it names changes, until Ctrl-C
    #[arg(long, conflicts_with_all = ["frames", "shard", "samples", "pilot"])]
    pub watch: bool,
    /// After each change, check that everything reused is the same as if it had been computed anew
    #[arg(long, requires = "watch")]
    pub paranoid: bool,
}

impl Render {
    /// Applies these options to the scene's settings.
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
    fn clap_declaration_is_valid() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }
}
