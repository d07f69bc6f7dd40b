//! Studies in RON: scenes, the settings that vary, the number of repetitions, and the plots.

mod limits;

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Edits;
use crate::error::LoadError;

/// Experiments that are reported together.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, rename = "Study")]
pub struct StudyFile {
    /// The human-readable title.
    pub title: String,
    /// A description. Empty lines separate paragraphs.
    #[serde(default)]
    pub text: String,
    /// The experiments, one or more.
    pub experiments: Vec<Experiment>,
}

/// Scenes × series × values of x × seeds: each combination is a job.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// A name of letters, digits and underscores, by which files are named.
    pub name: String,
    /// The human-readable title.
    #[serde(default)]
    pub title: String,
    /// A description of what to look for.
    #[serde(default)]
    pub text: String,
    /// The scenes to render.
    pub scenes: Vec<StudyScene>,
    /// Settings that all jobs share.
    #[serde(default)]
    pub with: SettingsOverride,
    /// The setting that varies from left to right, and its values.
    pub x: Axis,
    /// The variants to compare.
    pub series: Vec<Series>,
    /// The number of repetitions of each job, with different random numbers.
    #[serde(default = "one")]
    pub seeds: u32,
    /// Settings, in addition to `with`, of the image against which errors are measured.
    #[serde(default)]
    pub reference: Option<SettingsOverride>,
    /// The plots to show.
    #[serde(default)]
    pub plots: Vec<Plot>,
}

impl Experiment {
    /// True if a plot separates bias from variance: each job then takes a second image with other random numbers.
    pub fn needs_pairs(&self) -> bool {
        self.plots.iter().any(|plot| matches!(plot.y, Measurement::SquaredBias | Measurement::Variance))
    }
}

fn one() -> u32 {
    1
}

/// A scene of an experiment.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub enum StudyScene {
    /// A scene, model or mesh, relative to the study's folder.
    File(PathBuf),
    /// A bumpy ball with the number of triangles given by x.
    Ball,
    /// A cube filled at random with the number of small triangles given by x.
    Cloud,
}

/// A setting that varies from left to right, and its values.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub enum Axis {
    /// Samples per pixel.
    Samples(Vec<u32>),
    /// Shadow rays to each area light.
    LightSamples(Vec<u32>),
    /// Points on the lens: samples per pixel, all through the pixel's middle unless `pixel_pattern` is given.
    LensSamples(Vec<u32>),
    /// Paths per wave.
    Wave(Vec<u32>),
    /// Bounces after the camera ray.
    Depth(Vec<u32>),
    /// Threads.
    Threads(Vec<u32>),
    /// Lanes; numbers that the processor does not have are left out.
    Lanes(Vec<u32>),
    /// Photons for each pixel in each sample.
    Photons(Vec<u32>),
    /// The radius within which photons of the first sample are gathered, in pixels.
    PhotonRadius(Vec<u32>),
    /// Triangles of procedural meshes.
    Triangles(Vec<u32>),
}

impl Axis {
    /// The values from left to right.
    pub fn values(&self) -> &[u32] {
        match self {
            Axis::Samples(v) | Axis::LightSamples(v) | Axis::LensSamples(v) | Axis::Wave(v) => v,
            Axis::Depth(v) | Axis::Threads(v) | Axis::Triangles(v) | Axis::Photons(v) => v,
            Axis::PhotonRadius(v) | Axis::Lanes(v) => v,
        }
    }

    /// Its label, with the unit.
    pub fn label(&self) -> &'static str {
        match self {
            Axis::Samples(_) => "samples a pixel",
            Axis::LightSamples(_) => "shadow rays to a light",
            Axis::LensSamples(_) => "samples of the lens",
            Axis::Wave(_) => "paths of a wave",
            Axis::Depth(_) => "bounces",
            Axis::Threads(_) => "threads",
            Axis::Lanes(_) => "lanes",
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
    /// The human-readable name.
    pub label: String,
    /// The settings that distinguish it.
    #[serde(default)]
    pub with: SettingsOverride,
    /// The largest x at which it is measured.
    #[serde(default)]
    pub most: Option<u32>,
}

/// Settings that override the scene's.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default, rename = "Change")]
pub struct SettingsOverride {
    /// Columns and rows.
    pub size: Option<(u32, u32)>,
    /// Samples per pixel.
    pub samples: Option<u32>,
    /// Bounces after the camera ray.
    pub max_depth: Option<u32>,
    /// Shadow rays to each area light.
    pub light_samples: Option<u32>,
    /// The pattern of samples on area lights.
    pub light_pattern: Option<StudyPattern>,
    /// The pattern of samples on the lens.
    pub lens_pattern: Option<StudyPattern>,
    /// The pattern of samples in a pixel.
    pub pixel_pattern: Option<StudyPattern>,
    /// The light transport.
    pub transport: Option<StudyTransport>,
    /// The sampler of the path transport.
    pub sampler: Option<StudySampler>,
    /// Pixels that reuse each other's paths under the path transport; 1: none do.
    pub sharing: Option<u32>,
    /// Photons for each pixel in each sample: with this or `photon_radius`, photons are traced whatever the scene's
    /// settings.
    pub photons: Option<f32>,
    /// The radius within which photons of the first sample are gathered, in pixels.
    pub photon_radius: Option<f32>,
    /// True if the image is denoised, within the time that is measured.
    pub denoise: Option<bool>,
    /// The order in which rays are traced.
    pub schedule: Option<StudySchedule>,
    /// The order in which the wavefront shades hits under the path transport.
    pub sorting: Option<StudySorting>,
    /// Paths per wave.
    pub wave: Option<u32>,
    /// Threads; 1 by default.
    pub threads: Option<u32>,
    /// Lanes that work together: 1, 8 or 16; by default as many as the processor has. Jobs with a number that it does
    /// not have are left out.
    pub lanes: Option<u32>,
    /// Lanes of all stages of the wavefront other than queries, if not as many as of queries.
    pub shading_lanes: Option<u32>,
    /// The number of scattered rays to trace instead of rendering.
    pub rays: Option<u32>,
    /// The method of tracing these rays.
    pub by: Option<Tracing>,
    /// Values to change in the scene, as in [`Edits::set`]: for example `"Material[\"glass\"].ior = 1.6"`.
    pub set: Vec<String>,
    /// The only shapes to keep, as in [`Edits::only`].
    pub only: Vec<String>,
    /// Shapes and lights to remove, as in [`Edits::hide`].
    pub hide: Vec<String>,
}

impl SettingsOverride {
    /// These settings, overridden by those of `other`. Changes to the scene are applied one after the other.
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
            lanes: other.lanes.or(self.lanes),
            shading_lanes: other.shading_lanes.or(self.shading_lanes),
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

/// A pattern of sample points.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudyPattern {
    /// Random points anywhere.
    Uniform,
    /// A random point in each cell of a grid.
    Jittered,
    /// The centres of a grid's cells.
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

/// A light transport.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudyTransport {
    /// Direct light, mirrors and glass.
    Whitted,
    /// Light scattered any number of times.
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

/// A sampler of the path transport.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudySampler {
    /// Stratified at every scale.
    Sobol,
    /// One in each cell of a grid.
    Jittered,
    /// Independent of each other.
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

/// The order in which the wavefront shades hits under the path transport.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudySorting {
    /// Grouped by material.
    ByMaterial,
    /// In the order of their rays.
    Unsorted,
}

/// The order in which rays are traced.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum StudySchedule {
    /// Breadth first.
    Wavefront,
    /// Depth first.
    Recursive,
}

/// A method of tracing rays.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum Tracing {
    /// Through the tree, as a queue.
    Queue,
    /// Through the tree, one by one.
    Single,
    /// One by one, through the binary tree from which the tree was collapsed.
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
    /// True if the x axis is logarithmic.
    #[serde(default = "yes")]
    pub log_x: bool,
    /// True if the y axis is logarithmic.
    #[serde(default = "yes")]
    pub log_y: bool,
    /// True if y = c · x^p is fitted to each series.
    #[serde(default)]
    pub fit: bool,
}

fn yes() -> bool {
    true
}

/// A quantity that is measured in a job.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum Measurement {
    /// Mean squared error against the reference.
    Mse,
    /// Relative mean squared error against the reference (see `rayfront compare`).
    RelativeMse,
    /// The part of the mean squared error that more repetitions would not average away.
    SquaredBias,
    /// The rest of the mean squared error.
    Variance,
    /// Mean FLIP error.
    Flip,
    /// Wall-clock seconds.
    RenderSeconds,
    /// CPU seconds of all threads together.
    CpuSeconds,
    /// Seconds to build the tree.
    BuildSeconds,
    /// CPU time per traced ray.
    NanosecondsPerRay,
    /// Million rays per wall-clock second.
    Mrays,
    /// Bytes of the tree.
    TreeBytes,
}

impl Measurement {
    /// Its label, with the unit.
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
            Measurement::TreeBytes => "tree, MB",
        }
    }

    /// A measured value in the unit of the label.
    pub fn in_unit(self, value: f64) -> f64 {
        if self == Measurement::TreeBytes { value * 1e-6 } else { value }
    }

    /// True if the values may be negative: an estimate of a small squared bias is the difference of two others.
    pub fn is_signed(self) -> bool {
        self == Measurement::SquaredBias
    }

    /// Returns the number of times that something with the value `one` is as fast as something with the value `other`;
    /// none if the measurement is no time.
    pub fn speedup(self, one: f64, other: f64) -> Option<f64> {
        match self {
            Measurement::RenderSeconds | Measurement::CpuSeconds => Some(other / one),
            Measurement::BuildSeconds | Measurement::NanosecondsPerRay => Some(other / one),
            Measurement::Mrays => Some(one / other),
            _ => None,
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
    let mut study: StudyFile = super::ron::value(text, path)?;
    limits::check(&study).map_err(|reason| LoadError::invalid(path, reason))?;
    for experiment in &mut study.experiments {
        // The reference must also go through the middle of the pixel: edges would make most of the error.
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
    fn valid_study_is_parsed() {
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
        let hint = "unknown field \"nam\" in Experiment (did you mean \"name\"?); fields: name, title";
        assert!(unknown.starts_with("a.ron:2:") && unknown.contains(hint), "{unknown}");
        let unclosed = error("(title: \"t\",\n experiments: [(name: \"a\"");
        assert_eq!(unclosed, "a.ron:2:16: this \"(\" is never closed");
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
            ("rays: 100)", "rays: 100, lanes: 4)", "lanes has to be 1, 8 or 16 lanes, not 4"),
            ("rays: 100)", "rays: 100, shading_lanes: 2)", "shading_lanes has to be 1, 8 or 16"),
            (
                "Ball], x: Triangles([100, 1000])", "File(\"c.ron\")], x: Lanes([1, 4])",
                "x has to be 1, 8 or 16",
            ),
            ("y: NanosecondsPerRay", "y: SquaredBias", "no reference"),
            ("experiments: [", "experiments: [], unknown: [", "unknown"),
        ] {
            let error = error(&GOOD.replace(from, to));
            assert!(error.contains(wanted), "{to}: {error}");
        }
    }
}
