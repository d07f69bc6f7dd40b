//! How to render: what a scene file's `settings` say and command line flags override.

use serde::{Deserialize, Serialize};

use crate::bvh::BuildQuality;
use crate::math::Rgb;

use super::components::Pattern;

/// What a scene file says about rendering. The defaults are those of a file without settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Width and height in pixels, each 1 to 65,536.
    pub size: [u32; 2],
    /// Samples a pixel (spp), 1 to 4,194,304.
    pub samples: u32,
    /// Bounces after the camera ray, 0 to 65,535: a longer path counts as black. Under the path
    /// transport a surface after the last bounce still shows what it gives off: light is scattered
    /// once more often than it bounces.
    pub max_depth: u32,
    /// Bounces of each kind within these, under the path transport.
    pub depth_limits: DepthLimits,
    /// A branch ends when no component of its throughput is above this. The default of
    /// 1/1024 is a quarter of the step of an 8-bit image at a radiance of 1. The path
    /// transport plays Russian roulette instead.
    pub min_throughput: f32,
    /// The path transport's Russian roulette begins at this bounce; none: never.
    pub roulette_depth: Option<u32>,
    /// What a path adds to its sample after the first bounce is cut off at this radiance:
    /// fewer fireflies, but light is lost. None: nothing is.
    pub clamp: Option<f32>,
    /// Which numbers the path transport draws.
    pub sampler: Sampler,
    /// Whether pixels share the paths of their neighbours, under the path transport.
    pub sharing: Sharing,
    /// Whether blocks of pixels get samples where they lessen the error most, as many as `samples` on average.
    pub adaptive: Adaptive,
    /// How light travels.
    pub transport: Transport,
    /// Which random numbers: another seed, another (equally right) noise.
    pub seed: u64,
    /// How samples are spread over a pixel and what it gathers.
    pub filter: PixelFilter,
    /// Where in a pixel its samples go, before the filter is applied.
    pub pixel_pattern: Pattern,
    /// What a ray sees that hits nothing.
    pub background: Background,
    /// Radiance W m⁻² sr⁻¹ that every surface sends back times its diffuse colour, from nowhere.
    pub ambient: Rgb,
    /// From radiance to display.
    pub tonemap: Tonemap,
    /// Stops: radiance is multiplied by 2^exposure before the tone curve.
    pub exposure_ev: f32,
    /// Whether the image chooses its exposure, to which `exposure_ev` is added.
    pub auto_exposure: bool,
    /// How much work goes into the acceleration structure.
    pub build_quality: BuildQuality,
    /// Triangles that copies of meshes which are placed several times may take besides the first copies: what
    /// would take more is placed as instances, which need little memory for each place and are slower to trace.
    /// At most [`Settings::MOST_COPIED_TRIANGLES`].
    pub copied_triangles: u32,
    /// What else the image holds than light, each once.
    pub aov: Vec<Aov>,
}

impl Settings {
    /// The most triangles that copies may take, so that no scene file takes more than some gigabytes for them.
    pub const MOST_COPIED_TRIANGLES: u32 = 1 << 24;
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: [960, 540],
            samples: 16,
            max_depth: 8,
            depth_limits: DepthLimits::default(),
            min_throughput: 1.0 / 1024.0,
            roulette_depth: Some(4),
            clamp: None,
            sampler: Sampler::Sobol,
            sharing: Sharing::Auto,
            adaptive: Adaptive::Off,
            transport: Transport::Whitted,
            seed: 0,
            filter: PixelFilter::default(),
            pixel_pattern: Pattern::Jittered,
            background: Background::default(),
            ambient: Rgb::BLACK,
            tonemap: Tonemap::default(),
            exposure_ev: 0.0,
            auto_exposure: false,
            build_quality: BuildQuality::Default,
            copied_triangles: 1 << 18,
            aov: Vec::new(),
        }
    }
}

/// What a pixel can tell besides its light: an arbitrary output variable. Means are over what the
/// pixel's samples hit first, behind what is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Aov {
    /// Distance from the camera along its axis, in metres.
    Depth,
    /// Shading normal on the viewer's side, in world space.
    Normal,
    /// Base colour; of the classic model its diffuse colour.
    Albedo,
    /// In world space, in metres.
    Position,
    /// Which entity most samples hit.
    Entity,
    /// Which material most samples hit.
    Material,
    /// The part of the samples that hit anything.
    Coverage,
    /// How many samples there are.
    Samples,
    /// Variance of the pixel's value, estimated.
    Variance,
}

impl Aov {
    /// All that there are.
    pub const ALL: [Aov; 9] = [
        Aov::Depth,
        Aov::Normal,
        Aov::Albedo,
        Aov::Position,
        Aov::Entity,
        Aov::Material,
        Aov::Coverage,
        Aov::Samples,
        Aov::Variance,
    ];

    /// Whether it says something about the samples themselves, not about what they hit.
    pub(crate) fn is_of_film(self) -> bool {
        matches!(self, Aov::Samples | Aov::Variance)
    }
}

/// How many bounces of each kind a path may have, 0 to [`DepthLimits::MOST`]; none: as many as
/// [`Settings::max_depth`] lets it. The kind is that of the lobe that a bounce was drawn from. As
/// after the last bounce of all, one more ray still finds what shines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DepthLimits {
    /// Of lobes that scatter light widely, to either side of the surface.
    pub diffuse: Option<u32>,
    /// Of mirrors and whatever else reflects light around the mirror image.
    pub glossy: Option<u32>,
    /// Through glass, smooth or rough.
    pub transmission: Option<u32>,
}

impl DepthLimits {
    /// The largest limit.
    pub const MOST: u32 = 1000;

    /// Those that there are, by the names that a scene file has for them.
    pub(crate) fn given(&self) -> impl Iterator<Item = (&'static str, u32)> {
        let Self { diffuse, glossy, transmission } = *self;
        [("diffuse_depth", diffuse), ("glossy_depth", glossy), ("transmission_depth", transmission)]
            .into_iter()
            .filter_map(|(name, limit)| Some((name, limit?)))
    }
}

/// How light travels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Transport {
    /// Direct light, mirror reflection and refraction (Whitted 1980), with
    /// distributed shadow and lens rays (Cook, Porter and Carpenter 1984).
    #[default]
    Whitted,
    /// Light that is scattered any number of times: path tracing with next-event estimation
    /// and multiple importance sampling (Kajiya 1986, Veach 1997).
    Path,
}

/// How the samples of a pixel are spread over each use of random numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sampler {
    /// Points of Sobol's sequence, scrambled after Owen: stratified at every scale.
    #[default]
    Sobol,
    /// One at random in each cell of a grid.
    Jittered,
    /// Each on its own.
    Independent,
}

/// Whether the pixels of a group lend each other their paths' second vertices (see
/// [`crate::integrator::sharing`]): no bias, far less noise where light is scattered by matte surfaces.
/// There is none with [`Settings::clamp`] or [`Settings::depth_limits`], which say something about each path
/// for itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sharing {
    /// In groups of up to 64, block by block, where it pays.
    #[default]
    Auto,
    /// Every pixel has its own paths.
    Off,
    /// In groups of so many pixels, one of [`Sharing::SIZES`].
    Groups(u32),
}

impl Sharing {
    /// Pixels that a group may have.
    pub const SIZES: [u32; 6] = [2, 4, 8, 16, 32, 64];
}

/// Whether blocks of pixels get samples where they lessen the error most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Adaptive {
    /// All pixels get the same number.
    #[default]
    Off,
    /// In rounds, chosen by the samples up to then.
    On,
    /// Chosen beforehand, by samples that do not count.
    Unbiased,
}

/// The weight of a sample by its distance from the pixel's centre, sampled by
/// importance: every sample counts the same and lands where the filter says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum PixelFilter {
    /// Constant over one pixel.
    Box,
    /// Falls linearly to zero at `radius`.
    Tent {
        /// In pixels.
        radius: f32,
    },
    /// A Gaussian bell of standard deviation `radius / 3`, cut off at `radius`.
    Gaussian {
        /// In pixels.
        radius: f32,
    },
    /// The four-term window of Blackman and Harris over ±`radius`.
    BlackmanHarris {
        /// In pixels.
        radius: f32,
    },
}

impl Default for PixelFilter {
    fn default() -> Self {
        Self::BlackmanHarris { radius: 1.5 }
    }
}

/// The radiance that comes from where nothing is. Under the Whitted transport it
/// lights no surface by itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Background {
    /// The same in all directions.
    Constant(Rgb),
    /// By the height of the direction: `bottom` straight down, `top` straight up (+Y), linear in y.
    Gradient {
        /// Straight down.
        bottom: Rgb,
        /// Straight up.
        top: Rgb,
    },
}

impl Default for Background {
    fn default() -> Self {
        Self::Constant(Rgb::BLACK)
    }
}

/// From scene radiance to what a screen shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tonemap {
    /// Cut off at 1.
    #[default]
    Clamp,
    /// Divide all by the image's largest component.
    ScaleByMaximum,
    /// x (1 + x / w²) / (1 + x) on luminance with w = 4 (Reinhard and others 2002).
    Reinhard,
    /// The ACES reference rendering transform, Hill's fit.
    Aces,
    /// Sobotka's AgX, base look.
    Agx,
    /// Khronos PBR Neutral.
    PbrNeutral,
}
