//! What can be said on the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use super::aov::AovName;
use super::frames::FrameOptions;
use super::job_args::{OutputOptions, StopOptions, WorkOptions};
use super::shard::ShardOption;
use crate::bvh::Coherence;
use crate::film::Region;
use crate::formats::surroundings::Surroundings;
use crate::formats::{LightUnits, LoadOptions};
use crate::integrator::Schedule;
use crate::simd::Level;
use crate::world::{Adaptive, BuildQuality, DepthLimits, Sampler, Settings, Sharing, Tonemap, Transport};

/// Columns and rows. A name, or clap would take the array for several values.
pub type ImageSize = [u32; 2];

/// A CPU renderer: a scene in, an image out.
#[derive(Parser, Debug)]
#[command(version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Exit codes: 0 done, 1 a file or scene is at fault, 2 the command line is, \
                        129, 130, 143 interrupted (what there was has been saved).")]
pub struct Arguments {
    /// Other things to do than to render.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// What to render.
    #[command(flatten)]
    pub render: Render,
}

/// Other things to do than to render.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Say what a scene holds: counts, bounds, memory, materials, lights, textures, warnings
    Info(Info),
    /// Trace rays from a file: hits to another file, speed, build time, memory
    Trace(Trace),
    /// Say how far an image is from a reference
    Compare(super::compare::Compare),
    /// Render in every way that there is and compare the films
    Verify(super::verify::Verify),
    /// Follow the samples of a pixel from the camera to their ends
    Explain(super::explain::Explain),
    /// Say where the time goes, in both schedules
    Profile(super::profile::Profile),
    /// Go on with a film: finish what was interrupted, or add samples
    Resume(super::resume::Resume),
    /// Put films together that hold different samples of one image
    Merge(super::merge::Merge),
    /// Write job files that render a scene in parts on many machines
    Plan(super::plan::Plan),
    /// Render an image again by what it says of itself, and say whether it is the same
    Reproduce(super::reproduce::Reproduce),
    /// Do the experiments of a file and report on them
    Study(super::study::Study),
}

/// `rayfront info`.
#[derive(Args, Debug)]
pub struct Info {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    pub scene: PathBuf,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
}

/// `rayfront trace`.
#[derive(Args, Debug)]
pub struct Trace {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    pub scene: PathBuf,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
    /// The rays: 8 little-endian 32-bit floats each, origin x y z, direction x y z, t_min, t_max
    #[arg(long, value_name = "FILE")]
    pub rays: PathBuf,
    /// Where the hits go: 3 floats t u v and the primitive as a 32-bit integer each, infinity 0 0 and 2^32 - 1 for a miss
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Ask only whether there is any hit: 0 0 0 and primitive 0 for each ray that has one
    #[arg(long)]
    pub any: bool,
    /// Trace as often; the best time counts
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub repeat: u32,
    /// Threads; 0 means one for each core
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Instruction set [default: the widest there is]; the hits are the same
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub simd: Option<Level>,
    /// Work put into the acceleration structure [default: the scene's]
    #[arg(long, value_enum)]
    pub quality: Option<QualityName>,
    /// What is known of rays that follow each other; the hits are the same
    #[arg(long, value_enum, default_value_t = CoherenceName::Unknown)]
    pub coherence: CoherenceName,
    /// Hits to compare with, in the format of --out
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
}

/// `rayfront SCENE`.
#[derive(Args, Debug)]
pub struct Render {
    /// A scene (.ron), a model (.gltf, .glb) or a mesh (.ply, .obj)
    #[arg(required = true)]
    pub scene: Option<PathBuf>,
    /// What of a model is shown.
    #[command(flatten)]
    pub model: ModelOptions,
    /// What comes out of it.
    #[command(flatten)]
    pub output: OutputOptions,
    /// Samples a pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    pub spp: Option<u32>,
    /// Size of the image in pixels, such as 1280x720
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,
    /// How light travels.
    #[command(flatten)]
    pub light: LightOptions,
    /// Work put into the acceleration structure [default: the scene's]
    #[arg(long, value_enum)]
    pub quality: Option<QualityName>,
    /// Which random numbers
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Name of the camera to look through [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Render only columns X0 to X1 and rows Y0 to Y1 (the latter not included)
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    pub crop: Option<Region>,
    /// Tone curve of PNG files
    #[arg(long, value_enum)]
    pub tonemap: Option<TonemapName>,
    /// Stops of exposure of PNG files, such as -1.5, or auto: chosen by the image, and printed
    #[arg(long, value_name = "STOPS|auto", allow_negative_numbers = true, value_parser = parse_exposure_or_auto)]
    pub exposure: Option<Exposure>,
    /// Write more than light as layers of the .exr file (else of NAME.aov.exr) [default: the scene's]
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',')]
    pub aov: Vec<AovName>,
    /// Render one part of the samples: number, from 0, and how many parts, such as 3/64; auto/64 and auto take
    /// the number from the scheduler that runs this
    #[arg(long, value_name = "I/N", value_parser = super::shard::parse, conflicts_with = "samples")]
    pub shard: Option<ShardOption>,
    /// Of --adaptive=unbiased: a film with what the pilot has chosen; if it is not there, the pilot is rendered and
    /// saved in it
    #[arg(long, value_name = "FILE")]
    pub pilot: Option<PathBuf>,
    /// Render nothing but the pilot
    #[arg(long, requires = "pilot")]
    pub pilot_only: bool,
    /// Render only these samples of all, such as 0..16
    #[arg(long, value_name = "FIRST..END", value_parser = parse_samples)]
    pub samples: Option<[u32; 2]>,
    /// Which moments.
    #[command(flatten)]
    pub frames: FrameOptions,
    /// When to stop.
    #[command(flatten)]
    pub stop: StopOptions,
    /// How to work.
    #[command(flatten)]
    pub work: WorkOptions,
}

/// How light travels, and how far.
#[derive(Args, Debug)]
pub struct LightOptions {
    /// Bounces after the camera ray [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=65_535))]
    pub depth: Option<u32>,
    /// Bounces of light that surfaces scatter widely, within --depth, under the path transport [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=DepthLimits::MOST as i64))]
    pub diffuse_depth: Option<u32>,
    /// The same for mirror images, sharp or blurred
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=DepthLimits::MOST as i64))]
    pub glossy_depth: Option<u32>,
    /// The same for ways through glass
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=DepthLimits::MOST as i64))]
    pub transmission_depth: Option<u32>,
    /// How light travels [default: the scene's]
    #[arg(long, value_enum)]
    pub transport: Option<TransportName>,
    /// Which numbers the path transport draws [default: the scene's]
    #[arg(long, value_enum)]
    pub sampler: Option<SamplerName>,
    /// Pixels that share their paths under the path transport: auto, off, or 2, 4 ... 64 [default: the scene's]
    #[arg(long, value_name = "auto|off|N", value_parser = parse_sharing)]
    pub sharing: Option<Sharing>,
    /// Give blocks of pixels more samples where they lessen the error most, for the rays of --spp: on, off, or
    /// unbiased, which chooses beforehand by samples that do not count [default: the scene's]
    #[arg(long, value_name = "on|off|unbiased", num_args = 0..=1, default_missing_value = "on", require_equals = true,
          value_parser = parse_adaptive)]
    pub adaptive: Option<Adaptive>,
}

impl LightOptions {
    /// The scene's settings with what was said here instead.
    pub fn apply(&self, settings: &mut Settings) {
        settings.max_depth = self.depth.unwrap_or(settings.max_depth);
        let limits = &mut settings.depth_limits;
        limits.diffuse = self.diffuse_depth.or(limits.diffuse);
        limits.glossy = self.glossy_depth.or(limits.glossy);
        limits.transmission = self.transmission_depth.or(limits.transmission);
        settings.transport = self.transport.map_or(settings.transport, Into::into);
        settings.sampler = self.sampler.map_or(settings.sampler, Into::into);
        settings.sharing = self.sharing.unwrap_or(settings.sharing);
        settings.adaptive = self.adaptive.unwrap_or(settings.adaptive);
    }
}

/// What of a glTF file is shown, and what is around it.
#[derive(Args, Clone, Debug)]
pub struct ModelOptions {
    /// Moment of a model's animations in seconds [default: as it stands without them]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_time)]
    pub time: Option<f32>,
    /// Variant of a model's materials
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Which of a model's scenes [default: the one that it says]
    #[arg(id = "model_scene", long = "scene", value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// What glTF lights count: candela (as they are), watt (683 of them make up one), auto (what Blender means,
    /// where it wrote the file)
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = parse_light_units)]
    pub light_units: LightUnits,
    /// Glass of glTF files that says nothing of a volume is the boundary of a body, and bends light
    #[arg(long)]
    pub solid_glass: bool,
    /// Surfaces of glTF files are there from both sides, whatever the files say
    #[arg(long)]
    pub double_sided: bool,
    /// What is around the scene, in place of its own environment: a picture, or studio, sky, sky:ELEVATION,AZIMUTH
    #[arg(long, value_name = "NAME|FILE", value_parser = Surroundings::named)]
    pub env: Option<Surroundings>,
}

impl From<&ModelOptions> for LoadOptions {
    fn from(options: &ModelOptions) -> Self {
        let ModelOptions { time, variant, scene, light_units, solid_glass, double_sided, env } =
            options.clone();
        Self { time_s: time, variant, scene, light_units, solid_glass, double_sided, surroundings: env }
    }
}

impl Render {
    /// The scene's settings with what was said here instead.
    pub fn apply(&self, settings: &mut Settings) {
        settings.samples = self.spp.unwrap_or(settings.samples);
        self.light.apply(settings);
        settings.size = self.size.unwrap_or(settings.size);
        settings.seed = self.seed.unwrap_or(settings.seed);
        if let Some(exposure) = self.exposure {
            (settings.auto_exposure, settings.exposure_ev) = match exposure {
                Exposure::Auto => (true, 0.0),
                Exposure::Stops(stops) => (false, stops),
            };
        }
        settings.tonemap = self.tonemap.map_or(settings.tonemap, Into::into);
        settings.build_quality = self.quality.map_or(settings.build_quality, Into::into);
        if !self.aov.is_empty() {
            settings.aov = super::aov::list(&self.aov);
        }
    }
}

/// What `--exposure` can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Chosen by the image.
    Auto,
    /// Radiance is multiplied by two to the power of them.
    Stops(f32),
}

/// Names of [`Transport`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum TransportName {
    /// Direct light, mirrors, glass
    Whitted,
    /// Light that is scattered any number of times
    Path,
}

impl From<TransportName> for Transport {
    fn from(name: TransportName) -> Self {
        match name {
            TransportName::Whitted => Transport::Whitted,
            TransportName::Path => Transport::Path,
        }
    }
}

/// Names of [`Sampler`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum SamplerName {
    /// Stratified at every scale
    Sobol,
    /// One in each cell of a grid
    Jittered,
    /// Each on its own
    Independent,
}

impl From<SamplerName> for Sampler {
    fn from(name: SamplerName) -> Self {
        match name {
            SamplerName::Sobol => Sampler::Sobol,
            SamplerName::Jittered => Sampler::Jittered,
            SamplerName::Independent => Sampler::Independent,
        }
    }
}

/// Names of [`Schedule`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum ScheduleName {
    /// Breadth first, queue by queue
    Wavefront,
    /// Depth first, pixel by pixel
    Recursive,
}

impl From<ScheduleName> for Schedule {
    fn from(name: ScheduleName) -> Self {
        match name {
            ScheduleName::Wavefront => Schedule::Wavefront,
            ScheduleName::Recursive => Schedule::Recursive,
        }
    }
}

/// Names of [`BuildQuality`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum QualityName {
    /// Built as soon as possible
    Fast,
    /// Good for nearly everything
    Default,
    /// As good as it gets
    High,
}

impl From<QualityName> for BuildQuality {
    fn from(name: QualityName) -> Self {
        match name {
            QualityName::Fast => BuildQuality::Fast,
            QualityName::Default => BuildQuality::Default,
            QualityName::High => BuildQuality::High,
        }
    }
}

/// Names of [`Coherence`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum CoherenceName {
    /// Nothing: looked at before tracing
    Unknown,
    /// They run side by side
    Coherent,
    /// They go anywhere
    Scattered,
}

impl From<CoherenceName> for Coherence {
    fn from(name: CoherenceName) -> Self {
        match name {
            CoherenceName::Unknown => Coherence::Unknown,
            CoherenceName::Coherent => Coherence::Coherent,
            CoherenceName::Scattered => Coherence::Scattered,
        }
    }
}

/// Names of [`Tonemap`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum TonemapName {
    /// Cut off at 1
    Clamp,
    /// Divide by the largest component
    ScaleByMaximum,
    /// Reinhard and others, on luminance
    Reinhard,
    /// The ACES fit
    Aces,
    /// AgX
    Agx,
    /// Khronos PBR Neutral
    PbrNeutral,
}

impl From<TonemapName> for Tonemap {
    fn from(name: TonemapName) -> Self {
        match name {
            TonemapName::Clamp => Tonemap::Clamp,
            TonemapName::ScaleByMaximum => Tonemap::ScaleByMaximum,
            TonemapName::Reinhard => Tonemap::Reinhard,
            TonemapName::Aces => Tonemap::Aces,
            TonemapName::Agx => Tonemap::Agx,
            TonemapName::PbrNeutral => Tonemap::PbrNeutral,
        }
    }
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X', '×']);
    let side = |s: &str| s.trim().parse().ok().filter(|n| (1..=65_536).contains(n));
    parts
        .and_then(|(w, h)| Some([side(w)?, side(h)?]))
        .ok_or_else(|| "expected width x height, each 1 to 65536, such as 1280x720".into())
}

fn parse_crop(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Region { x0, y0, x1, y1 }),
        _ => Err("expected X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1, such as 100,50,200,150".into()),
    }
}

fn parse_samples(text: &str) -> Result<[u32; 2], String> {
    let range = text.split_once("..").and_then(|(start, end)| Some([start.parse().ok()?, end.parse().ok()?]));
    range.filter(|[start, end]| start < end).ok_or_else(|| "expected FIRST..END, such as 0..16".into())
}

pub(super) fn parse_exposure(text: &str) -> Result<f32, String> {
    let stops = text.parse().ok().filter(|s: &f32| s.is_finite() && s.abs() <= 64.0);
    stops.ok_or_else(|| "expected a number of stops from -64 to 64".into())
}

fn parse_exposure_or_auto(text: &str) -> Result<Exposure, String> {
    if text.eq_ignore_ascii_case("auto") {
        return Ok(Exposure::Auto);
    }
    parse_exposure(text).map(Exposure::Stops).map_err(|reason| format!("{reason}, or auto"))
}

fn parse_sharing(text: &str) -> Result<Sharing, String> {
    match text {
        "auto" => Ok(Sharing::Auto),
        "off" => Ok(Sharing::Off),
        _ => {
            let pixels = text.parse().ok().filter(|pixels| Sharing::SIZES.contains(pixels));
            pixels.map(Sharing::Groups).ok_or_else(|| "expected auto, off, 2, 4, 8, 16, 32 or 64".into())
        }
    }
}

fn parse_adaptive(text: &str) -> Result<Adaptive, String> {
    match text {
        "on" => Ok(Adaptive::On),
        "off" => Ok(Adaptive::Off),
        "unbiased" => Ok(Adaptive::Unbiased),
        _ => Err("expected on, off or unbiased".into()),
    }
}

fn parse_time(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s: &f32| s.is_finite());
    seconds.ok_or_else(|| "expected a number of seconds, such as 1.5".into())
}

fn parse_light_units(text: &str) -> Result<LightUnits, String> {
    match text {
        "auto" => Ok(LightUnits::Auto),
        "candela" => Ok(LightUnits::Candela),
        "watt" => Ok(LightUnits::Watt),
        _ => Err("expected auto, candela or watt".into()),
    }
}

pub(super) fn parse_bits(text: &str) -> Result<u8, String> {
    text.parse().ok().filter(|b| [8, 16].contains(b)).ok_or_else(|| "expected 8 or 16".into())
}

pub(super) fn parse_level(text: &str) -> Result<Level, String> {
    Level::from_name(text).ok_or_else(|| {
        let names: Vec<_> = Level::available().into_iter().map(Level::name).collect();
        format!("this processor has: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declaration_is_sound() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }

    #[test]
    fn values_are_checked() {
        assert_eq!(parse_size("1280x720"), Ok([1280, 720]));
        assert!(parse_size("0x5").is_err() && parse_size("70000x5").is_err() && parse_size("12").is_err());
        assert!(parse_crop("1,2,3,4").is_ok());
        assert!(parse_crop("3,2,3,4").is_err() && parse_crop("1,2,3").is_err());
        assert_eq!(parse_exposure_or_auto("auto"), Ok(Exposure::Auto));
        assert_eq!(parse_exposure_or_auto("-2"), Ok(Exposure::Stops(-2.0)));
        assert!(parse_exposure_or_auto("automatic").is_err_and(|reason| reason.ends_with(", or auto")));
        assert!(parse_exposure("nan").is_err() && parse_exposure("-1.5") == Ok(-1.5));
    }
}
