//! Studies in RON: scenes, what is varied in them, how often, and what is plotted.

mod limits;

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Edits;
use crate::error::LoadError;

/// Experiments that are reported together.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, rename = "Study")]
pub struct StudyFile {
    /// For people.
    pub title: String,
    /// What it is about. Empty lines separate paragraphs.
    #[serde(default)]
    pub text: String,
    /// One or more.
    pub experiments: Vec<Experiment>,
}

/// Scenes × series × values of x × seeds: each combination is a job.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Letters, digits and underscores: files are named after it.
    pub name: String,
    /// For people.
    #[serde(default)]
    pub title: String,
    /// What to look for.
    #[serde(default)]
    pub text: String,
    /// The scenes to render.
    pub scenes: Vec<StudyScene>,
    /// What all jobs have in common.
    #[serde(default)]
    pub with: SettingsOverride,
    /// What is varied from left to right.
    pub x: Axis,
    /// What is compared.
    pub series: Vec<Series>,
    /// How often each is repeated, with other random numbers.
    #[serde(default = "one")]
    pub seeds: u32,
    /// Errors are measured against an image rendered with these changes in addition to `with`.
    #[serde(default)]
    pub reference: Option<SettingsOverride>,
    /// What is shown.
    #[serde(default)]
    pub plots: Vec<Plot>,
}

impl Experiment {
    /// True if a plot tells bias from variance, for which each job takes a second image with other random numbers.
    pub fn needs_pairs(&self) -> bool {
        self.plots.iter().any(|plot| matches!(plot.y, Measurement::SquaredBias | Measurement::Variance))
    }
}

fn one() -> u32 {
    1
}

/// Something to look at.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub enum StudyScene {
    /// A scene, model or mesh, relative to the study's folder.
    File(PathBuf),
    /// A bumpy ball of as many triangles as x says.
    Ball,
    /// As many small triangles anywhere in a cube.
    Cloud,
}

/// What is varied from left to right.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub enum Axis {
    /// Samples a pixel.
    Samples(Vec<u32>),
    /// Shadow rays to each area light.
    LightSamples(Vec<u32>),
    /// Points on the lens: samples a pixel, all through its middle unless `pixel_pattern` says otherwise.
    LensSamples(Vec<u32>),
    /// Paths of a wave.
    Wave(Vec<u32>),
    /// Bounces after the camera ray.
    Depth(Vec<u32>),
    /// Threads.
    Threads(Vec<u32>),
    /// Photons for each pixel in each sample.
    Photons(Vec<u32>),
    /// The radius within which photons of the first sample are gathered, in pixels.
    PhotonRadius(Vec<u32>),
    /// Triangles of made-up meshes.
    Triangles(Vec<u32>),
}

impl Axis {
    /// From left to right.
    pub fn values(&self) -> &[u32] {
        match self {
            Axis::Samples(v) | Axis::LightSamples(v) | Axis::LensSamples(v) | Axis::Wave(v) => v,
            Axis::Depth(v) | Axis::Threads(v) | Axis::Triangles(v) | Axis::Photons(v) => v,
            Axis::PhotonRadius(v) => v,
        }
    }

    /// Its name, with the unit.
    pub fn label(&self) -> &'static str {
        match self {
            Axis::Samples(_) => "samples a pixel",
            Axis::LightSamples(_) => "shadow rays to a light",
            Axis::LensSamples(_) => "samples of the lens",
            Axis::Wave(_) => "paths of a wave",
            Axis::Depth(_) => "bounces",
            Axis::Threads(_) => "threads",
            Axis::Photons(_) => "photons for each pixel",
            Axis::PhotonRadius(_) => "first radius, pixels",
            Axis::Triangles(_) => "triangles",
        }
    }
}

/// One of the variants to compare.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Series {
    /// For people.
    pub label: String,
    /// What distinguishes it.
    #[serde(default)]
    pub with: SettingsOverride,
    /// The largest x at which it is measured.
    #[serde(default)]
    pub most: Option<u32>,
}

/// Settings instead of the scene's.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default, rename = "Change")]
pub struct SettingsOverride {
    /// Columns and rows.
    pub size: Option<(u32, u32)>,
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// Bounces after the camera ray.
    pub max_depth: Option<u32>,
    /// Shadow rays to each area light.
    pub light_samples: Option<u32>,
    /// Where on area lights they go.
    pub light_pattern: Option<StudyPattern>,
    /// Where on the lens samples go.
    pub lens_pattern: Option<StudyPattern>,
    /// Where in a pixel samples go.
    pub pixel_pattern: Option<StudyPattern>,
    /// What happens to light at a vertex.
    pub transport: Option<StudyTransport>,
    /// Which numbers the path transport draws.
    pub sampler: Option<StudySampler>,
    /// Pixels that share their paths under the path transport; 1: none do.
    pub sharing: Option<u32>,
    /// Photons for each pixel in each sample: with one of these two, photons are traced whatever the scene says.
    pub photons: Option<f32>,
    /// The radius within which photons of the first sample are gathered, in pixels.
    pub photon_radius: Option<f32>,
    /// Whether the image is denoised, within the time that is measured.
    pub denoise: Option<bool>,
    /// In which order rays are traced.
    pub schedule: Option<StudySchedule>,
    /// In which order the wavefront shades hits under the path transport.
    pub sorting: Option<StudySorting>,
    /// Paths of a wave.
    pub wave: Option<u32>,
    /// Threads; 1 unless told otherwise.
    pub threads: Option<u32>,
    /// Work put into the acceleration structure.
    pub quality: Option<Quality>,
    /// Traces as many scattered rays instead of rendering.
    pub rays: Option<u32>,
    /// How these rays are traced.
    pub by: Option<Tracing>,
    /// Values to change in the scene, as in [`Edits::set`]: for example `"Material[\"glass\"].ior = 1.6"`.
    pub set: Vec<String>,
    /// The only shapes to keep, as in [`Edits::only`].
    pub only: Vec<String>,
    /// Shapes and lights to remove, as in [`Edits::hide`].
    pub hide: Vec<String>,
}

impl SettingsOverride {
    /// These changes, overridden by those of `other`. Changes to the scene are carried out one after the other.
    pub fn and(&self, other: &SettingsOverride) -> SettingsOverride {
        let both = |one: &[String], other: &[String]| [one, other].concat();
        SettingsOverride {
            size: other.size.or(self.size),
            samples: other.samples.or(self.samples),
            max_depth: other.max_depth.or(self.max_depth),
            light_samples: other.light_samples.or(self.light_samples),
            light_pattern: other.light_pattern.or(self.light_pattern),
            lens_pattern: other.lens_pattern.or(self.lens_pattern),
            pixel_pattern: other.pixel_pattern.or(self.pixel_pattern),
            transport: other.transport.or(self.transport),
            sampler: other.sampler.or(self.sampler),
            sharing: other.sharing.or(self.sharing),
            photons: other.photons.or(self.photons),
            photon_radius: other.photon_radius.or(self.photon_radius),
            denoise: other.denoise.or(self.denoise),
            schedule: other.schedule.or(self.schedule),
            sorting: other.sorting.or(self.sorting),
            wave: other.wave.or(self.wave),
            threads: other.threads.or(self.threads),
            quality: other.quality.or(self.quality),
            rays: other.rays.or(self.rays),
            by: other.by.or(self.by),
            set: both(&self.set, &other.set),
            only: both(&self.only, &other.only),
            hide: both(&self.hide, &other.hide),
        }
    }

    /// The changes to the scene beyond its files.
    pub fn edits(&self) -> Edits {
        let SettingsOverride { set, only, hide, .. } = self.clone();
        Edits { set, only, hide, ..Edits::default() }
    }
}

/// How points are spread.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudyPattern {
    /// Anywhere.
    Uniform,
    /// One anywhere in each cell of a grid.
    Jittered,
    /// In the cells' centres.
    Regular,
    /// All in the middle.
    Center,
}

impl From<StudyPattern> for crate::world::Pattern {
    fn from(pattern: StudyPattern) -> Self {
        match pattern {
            StudyPattern::Uniform => Self::Uniform,
            StudyPattern::Jittered => Self::Jittered,
            StudyPattern::Regular => Self::Regular,
            StudyPattern::Center => Self::Center,
        }
    }
}

/// What happens to light at a vertex.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudyTransport {
    /// Direct light, mirrors, glass.
    Whitted,
    /// Light that is scattered any number of times.
    Path,
}

impl From<StudyTransport> for crate::world::Transport {
    fn from(transport: StudyTransport) -> Self {
        match transport {
            StudyTransport::Whitted => Self::Whitted,
            StudyTransport::Path => Self::Path,
        }
    }
}

/// Which numbers the path transport draws.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudySampler {
    /// Stratified at every scale.
    Sobol,
    /// One in each cell of a grid.
    Jittered,
    /// Each on its own.
    Independent,
}

impl From<StudySampler> for crate::world::Sampler {
    fn from(sampler: StudySampler) -> Self {
        match sampler {
            StudySampler::Sobol => Self::Sobol,
            StudySampler::Jittered => Self::Jittered,
            StudySampler::Independent => Self::Independent,
        }
    }
}

/// In which order the wavefront shades hits under the path transport.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudySorting {
    /// One material's after another's.
    ByMaterial,
    /// As they come.
    Unsorted,
}

/// In which order rays are traced.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudySchedule {
    /// Breadth first.
    Wavefront,
    /// Depth first.
    Recursive,
}

/// Work put into the acceleration structure.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum Quality {
    /// As soon as possible.
    Fast,
    /// Good for nearly everything.
    Default,
    /// As good as it gets.
    High,
}

impl From<Quality> for crate::world::BuildQuality {
    fn from(quality: Quality) -> Self {
        match quality {
            Quality::Fast => Self::Fast,
            Quality::Default => Self::Default,
            Quality::High => Self::High,
        }
    }
}

/// How rays are traced.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum Tracing {
    /// By the tree, as a queue.
    Queue,
    /// By the tree, one by one.
    Single,
    /// One by one, by the binary tree from which the tree was collapsed.
    Binary,
    /// Without the tree: every triangle for every ray.
    BruteForce,
}

/// A quantity that is plotted against x.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// The quantity.
    pub y: Measurement,
    /// Whether the axes are logarithmic.
    #[serde(default = "yes")]
    pub log_x: bool,
    /// The same for y.
    #[serde(default = "yes")]
    pub log_y: bool,
    /// Fit y = c · x^p to each series.
    #[serde(default)]
    pub fit: bool,
}

fn yes() -> bool {
    true
}

/// What is measured in a job.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum Measurement {
    /// Mean squared error against the reference.
    Mse,
    /// The same, relative (see `rayfront compare`).
    RelativeMse,
    /// The part of the mean squared error that more repetitions would not average away.
    SquaredBias,
    /// The other part of it.
    Variance,
    /// Mean of FLIP's error.
    Flip,
    /// Wall-clock seconds.
    RenderSeconds,
    /// CPU seconds of all threads together.
    CpuSeconds,
    /// Seconds to build the tree.
    BuildSeconds,
    /// CPU time of a traced ray.
    NanosecondsPerRay,
    /// Million rays per wall-clock second.
    Mrays,
    /// Bytes of the tree.
    TreeBytes,
}

impl Measurement {
    /// Its name, with the unit.
    pub fn label(self) -> &'static str {
        match self {
            Measurement::Mse => "mean squared error, (W m⁻² sr⁻¹)²",
            Measurement::RelativeMse => "relative mean squared error",
            Measurement::SquaredBias => "squared bias, (W m⁻² sr⁻¹)²",
            Measurement::Variance => "variance, (W m⁻² sr⁻¹)²",
            Measurement::Flip => "FLIP",
            Measurement::RenderSeconds => "rendering, s",
            Measurement::CpuSeconds => "CPU time, s",
            Measurement::BuildSeconds => "building the tree, s",
            Measurement::NanosecondsPerRay => "time of a ray, ns",
            Measurement::Mrays => "million rays a second",
            Measurement::TreeBytes => "tree, bytes",
        }
    }
}

/// Reads a study.
pub fn load(path: &Path) -> Result<StudyFile, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    let text = std::str::from_utf8(&bytes).map_err(|_| LoadError::invalid(path, "this is not UTF-8"))?;
    parse(text, path)
}

/// Reads a study from its text; messages call it `path`.
pub fn parse(text: &str, path: &Path) -> Result<StudyFile, LoadError> {
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let mut study: StudyFile = options.from_str(text).map_err(|error| LoadError::At {
        file: path.to_owned(),
        line: error.span.start.line,
        column: error.span.start.col,
        reason: error.code.to_string(),
    })?;
    limits::check(&study).map_err(|reason| LoadError::invalid(path, reason))?;
    for experiment in &mut study.experiments {
        // The reference must also look through the middle of the pixel: edges would make most of the error.
        if matches!(experiment.x, Axis::LensSamples(_) | Axis::LightSamples(_)) {
            experiment.with.pixel_pattern.get_or_insert(StudyPattern::Center);
        }
    }
    Ok(study)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        parse(text, Path::new("a.ron")).unwrap_err().to_string()
    }

    const GOOD: &str = r#"(title: "t", experiments: [(name: "a", scenes: [File("b.ron"), Ball], x: Triangles([100, 1000]),
        with: (rays: 100), series: [(label: "tree", with: (by: Queue)), (label: "none", with: (by: BruteForce), most: 100)],
        plots: [(y: NanosecondsPerRay, fit: true)])])"#;

    #[test]
    fn a_study_is_read() {
        let study = parse(GOOD, Path::new("a.ron")).unwrap();
        let experiment = &study.experiments[0];
        assert_eq!((experiment.seeds, experiment.x.values()), (1, &[100, 1000][..]));
        let change = experiment.with.and(&experiment.series[1].with);
        assert_eq!((change.rays, change.by), (Some(100), Some(Tracing::BruteForce)));
        assert!(experiment.plots[0].log_x && experiment.plots[0].fit);
        let lens = GOOD
            .replace("Ball], x: Triangles", "File(\"c.ron\")], x: LensSamples")
            .replace("rays: 100", "samples: 1");
        let of = |text: &str| parse(text, Path::new("a.ron")).unwrap().experiments[0].with.pixel_pattern;
        assert_eq!(of(&lens), Some(StudyPattern::Center));
        assert_eq!(of(&lens.replace("LensSamples", "LightSamples")), Some(StudyPattern::Center));
        assert_eq!(of(&lens.replace("LensSamples", "Samples")), None);
        assert_eq!(of(&lens.replace("samples: 1", "pixel_pattern: Jittered")), Some(StudyPattern::Jittered));
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let unknown = error("(title: \"t\",\n experiments: [(nam: \"a\")])");
        assert!(unknown.starts_with("a.ron:2:") && unknown.contains("nam"), "{unknown}");
        for (from, to, wanted) in [
            ("name: \"a\"", "name: \"a b\"", "letters, digits"),
            ("x: Triangles([100, 1000])", "x: Triangles([])", "one value of x"),
            ("x: Triangles([100, 1000])", "x: Samples([1])", "x: Triangles"),
            ("x: Triangles([100, 1000])", "x: Triangles([0])", "from 1 to 100000000"),
            ("y: NanosecondsPerRay", "y: Mse", "no reference"),
            ("rays: 100)", "rays: 0)", "rays has to be"),
            ("rays: 100)", "rays: 100, sharing: 7)", "sharing has to be"),
            ("rays: 100)", "rays: 100, photons: 0)", "photons has to be above 0 and at most 64"),
            ("rays: 100)", "rays: 100, photon_radius: 65)", "photon_radius has to be above 0"),
            ("Ball], x: Triangles([100, 1000])", "File(\"c.ron\")], x: PhotonRadius([65])", "from 1 to 64"),
            ("y: NanosecondsPerRay", "y: SquaredBias", "no reference"),
            ("experiments: [", "experiments: [], unknown: [", "unknown"),
        ] {
            let error = error(&GOOD.replace(from, to));
            assert!(error.contains(wanted), "{to}: {error}");
        }
    }
}
