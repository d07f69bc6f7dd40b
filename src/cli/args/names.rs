//! The names of enum values on the command line.

use clap::ValueEnum;

use crate::bvh::Coherence;
use crate::integrator::Schedule;
use crate::world::{BuildQuality, Sampler, Tonemap, Transport};

/// The names of [`Transport`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum TransportName {
    /// Direct light, mirrors, glass
    Whitted,
    /// Light that is scattered any number of times
    Path,
    /// The one that renders everything in the scene
    Auto,
}

impl TransportName {
    /// Returns the name of a transport.
    pub fn of(transport: Transport) -> Self {
        match transport {
            Transport::Whitted => TransportName::Whitted,
            Transport::Path => TransportName::Path,
        }
    }

    /// Returns the transport; `fitting` is the one that renders everything in the scene, for [`TransportName::Auto`].
    pub fn among(self, fitting: Transport) -> Transport {
        match self {
            TransportName::Whitted => Transport::Whitted,
            TransportName::Path => Transport::Path,
            TransportName::Auto => fitting,
        }
    }
}

/// The names of [`Sampler`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum SamplerName {
    /// Stratified at every scale
    Sobol,
    /// One in each cell of a grid
    Jittered,
    /// Each independent of the others
    Independent,
}

impl SamplerName {
    /// Returns the name of a sampler.
    pub fn of(sampler: Sampler) -> Self {
        match sampler {
            Sampler::Sobol => SamplerName::Sobol,
            Sampler::Jittered => SamplerName::Jittered,
            Sampler::Independent => SamplerName::Independent,
        }
    }
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

/// The names of [`Schedule`].
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

/// The names of [`BuildQuality`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum QualityName {
    /// Built as quickly as possible
    Fast,
    /// Good for nearly everything
    Default,
    /// Best possible
    High,
}

impl QualityName {
    /// Returns the name of a quality.
    pub fn of(quality: BuildQuality) -> Self {
        match quality {
            BuildQuality::Fast => QualityName::Fast,
            BuildQuality::Default => QualityName::Default,
            BuildQuality::High => QualityName::High,
        }
    }
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

/// The names of [`Coherence`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum CoherenceName {
    /// Checked before tracing
    Unknown,
    /// Rays that run side by side
    Coherent,
    /// Rays that go anywhere
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

/// The names of [`Tonemap`].
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum TonemapName {
    /// Cut off at 1
    Clamp,
    /// Divide by the largest component
    ScaleByMaximum,
    /// Reinhard et al., on luminance
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
