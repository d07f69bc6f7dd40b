//! The names of values on the command line.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::bvh::Coherence;
use crate::cli::progress::ProgressForm;
use crate::formats::{Floor, LightUnits, UpAxis};
use crate::integrator::Schedule;
use crate::world::{Adaptive, Aov, Sampler, Tonemap, Transport};

/// The values of an option: name, help, value.
pub type NamedValues<T> = &'static [(&'static str, &'static str, T)];

/// A transport; `None` is the one that renders everything in the scene. An alias, because clap would take an option of
/// an option for an optional value.
pub type TransportChoice = Option<Transport>;

/// Output variables. An alias for the same reason.
pub type Aovs = &'static [Aov];

pub const TRANSPORTS: NamedValues<TransportChoice> = &[
    ("whitted", "Direct light, mirrors, glass", Some(Transport::Whitted)),
    ("path", "Light that is scattered any number of times", Some(Transport::Path)),
    ("auto", "The one that renders everything in the scene", None),
];

pub const SAMPLERS: NamedValues<Sampler> = &[
    ("sobol", "Stratified at every scale", Sampler::Sobol),
    ("jittered", "One in each cell of a grid", Sampler::Jittered),
    ("independent", "Each independent of the others", Sampler::Independent),
];

pub const SCHEDULES: NamedValues<Schedule> = &[
    ("wavefront", "Breadth first, queue by queue", Schedule::Wavefront),
    ("recursive", "Depth first, pixel by pixel", Schedule::Recursive),
];

pub const COHERENCES: NamedValues<Coherence> = &[
    ("unknown", "Checked before tracing", Coherence::Unknown),
    ("coherent", "Rays that run side by side", Coherence::Coherent),
    ("scattered", "Rays that go anywhere", Coherence::Scattered),
];

pub const TONEMAPS: NamedValues<Tonemap> = &[
    ("clamp", "Cut off at 1", Tonemap::Clamp),
    ("scale-by-maximum", "Divide by the largest component", Tonemap::ScaleByMaximum),
    ("reinhard", "Reinhard et al., on luminance", Tonemap::Reinhard),
    ("aces", "The ACES fit", Tonemap::Aces),
    ("agx", "AgX", Tonemap::Agx),
    ("pbr-neutral", "Khronos PBR Neutral", Tonemap::PbrNeutral),
];

pub const ADAPTIVE: NamedValues<Adaptive> =
    &[("on", "", Adaptive::On), ("off", "", Adaptive::Off), ("unbiased", "", Adaptive::Unbiased)];

pub const LIGHT_UNITS: NamedValues<LightUnits> =
    &[("auto", "", LightUnits::Auto), ("candela", "", LightUnits::Candela), ("watt", "", LightUnits::Watt)];

pub const GROUNDS: NamedValues<Floor> = &[("grey", "", Floor::Grey), ("shadow", "", Floor::Shadow)];

pub const UP_AXES: NamedValues<UpAxis> = &[("y", "", UpAxis::Y), ("z", "", UpAxis::Z)];

pub const PROGRESS_FORMS: NamedValues<ProgressForm> = &[
    ("lines", "Progress: 42%, and details", ProgressForm::Lines),
    ("json", "A JSON object", ProgressForm::Json),
    ("openjd", "openjd_progress: 42", ProgressForm::Openjd),
];

pub const AOVS: NamedValues<Aovs> = &[
    ("all", "All except nodes, tests, path-length and time, which take another rendering", Aov::IMAGE),
    ("none", "None, even if the scene has some", &[]),
    (Aov::Depth.name(), "Distance along the camera's axis", &[Aov::Depth]),
    (Aov::Normal.name(), "Shading normal", &[Aov::Normal]),
    (Aov::Albedo.name(), "Base colour", &[Aov::Albedo]),
    (Aov::Position.name(), "Position in the world", &[Aov::Position]),
    (Aov::Entity.name(), "Number of the entity", &[Aov::Entity]),
    (Aov::Material.name(), "Number of the material", &[Aov::Material]),
    (Aov::Coverage.name(), "Fraction of the samples that hit anything", &[Aov::Coverage]),
    (Aov::Samples.name(), "Number of samples", &[Aov::Samples]),
    (Aov::Variance.name(), "Estimated variance of the pixel", &[Aov::Variance]),
    (Aov::Nodes.name(), "Nodes of the tree that a sample's rays visit", &[Aov::Nodes]),
    (Aov::Tests.name(), "Triangles and spheres that they are tested against", &[Aov::Tests]),
    (Aov::PathLength.name(), "Rays of a sample's path", &[Aov::PathLength]),
    (Aov::Time.name(), "Microseconds of a sample", &[Aov::Time]),
];

/// Returns a parser of these names.
pub fn one_of<T: Copy + Send + Sync>(names: NamedValues<T>) -> impl TypedValueParser<Value = T> {
    let values = names.iter().map(|(name, help, _)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(values).try_map(|text| {
        let found = names.iter().find(|(name, ..)| text == *name);
        found.map(|(.., value)| *value).ok_or("expected a name")
    })
}

/// Returns the name of a value.
pub fn name_of<T: PartialEq>(names: NamedValues<T>, value: &T) -> &'static str {
    names.iter().find(|(.., named)| named == value).map_or("", |(name, ..)| name)
}
