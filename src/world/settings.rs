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
    /// Bounces after the camera ray, 0 to 65,535; longer paths count as black. Under the path transport, a surface
    /// that is met after the last bounce still shows what it emits: light may be scattered once more often than paths
    /// bounce.
    pub max_depth: u32,
    /// Limits for bounces of each kind within these, under the path transport.
    pub depth_limits: DepthLimits,
    /// Under the Whitted transport, a branch ends when no component of its throughput is above this. The default of
    /// 1/1024 is a quarter of the step of an 8-bit image at a radiance of 1. (The path transport plays Russian
    /// roulette instead.)
    pub min_throughput: f32,
    /// The bounce at which the path transport's Russian roulette begins; `None` for never.
    pub roulette_depth: Option<u32>,
    /// What a path of the path transport adds to its sample after the first bounce is cut off at this radiance, in
    /// W m⁻² sr⁻¹: fewer fireflies, but light is lost. `None` cuts off nothing.
    pub clamp: Option<f32>,
    /// Which numbers the path transport draws.
    pub sampler: Sampler,
    /// Whether pixels share the paths of their neighbours, under the path transport.
    pub sharing: Sharing,
    /// Whether photons bring the light that comes through glass or off mirrors.
    pub caustics: Caustics,
    /// Whether blocks of pixels get more samples where these reduce the error most, with as many rays in all as if
    /// each pixel got `samples`.
    pub adaptive: Adaptive,
    /// How light travels; [`super::World::fitting_transport`] is the one that suits a world.
    pub transport: Transport,
    /// The seed of all random numbers: another seed gives another, equally valid noise.
    pub seed: u64,
    /// How samples are spread around a pixel's centre.
    pub filter: PixelFilter,
    /// Where in a pixel its samples go, before the filter is applied, under the Whitted transport.
    pub pixel_pattern: Pattern,
    /// What a ray sees that hits nothing.
    pub background: Background,
    /// Radiance in W m⁻² sr⁻¹ that every surface adds, times its diffuse colour, without any light; under the Whitted
    /// transport.
    pub ambient: Rgb,
    /// From radiance to display values.
    pub tonemap: Tonemap,
    /// Exposure in stops: radiance is multiplied by 2 to this power before the tone curve.
    pub exposure_ev: f32,
    /// Whether the image itself sets the exposure, to which `exposure_ev` is then added: the log-average of its
    /// luminance goes to 0.18 (Reinhard and others 2002).
    pub auto_exposure: bool,
    /// How much work goes into the acceleration structure.
    pub build_quality: BuildQuality,
    /// How many triangles may go into copies of meshes that are placed several times, beyond the first copy of each.
    /// Meshes for which these do not suffice are placed as instances, which need little memory for each place and are
    /// slower to trace. At most [`Settings::MOST_COPIED_TRIANGLES`].
    pub copied_triangles: u32,
    /// What the image holds besides light, each at most once.
    pub aov: Vec<Aov>,
}

impl Settings {
    /// The largest width, and the largest height, of an image in pixels.
    pub const MOST_PIXELS_A_SIDE: u32 = 1 << 16;
    /// The most samples of a pixel, and of a light: the numbers of a pattern's cells must be exact as floats.
    pub const MOST_SAMPLES: u32 = 1 << 22;
    /// The largest [`Settings::max_depth`].
    pub const MOST_DEPTH: u32 = 65_535;
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
            caustics: Caustics::Auto,
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

/// What a pixel can hold besides light: an arbitrary output variable. Means are over what the pixel's samples hit
/// first; surfaces that are not there, by their alpha or from their back, do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Aov {
    /// Distance from the camera along its axis, in metres.
    Depth,
    /// Shading normal on the viewer's side, in world space.
    Normal,
    /// Base colour; of the classic model its diffuse colour.
    Albedo,
    /// Position in world space, in metres.
    Position,
    /// Which entity most samples hit: 1 + its number in the world, or 0 for none.
    Entity,
    /// Which material most samples hit: 1 + its number, or 0 for none.
    Material,
    /// The part of the samples that hit anything.
    Coverage,
    /// How many samples there are.
    Samples,
    /// Estimated variance of the mean of the pixel's samples, in (W m⁻² sr⁻¹)².
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

/// How many bounces of each kind a path may have, 0 to [`DepthLimits::MOST`]; with `None`, as many as
/// [`Settings::max_depth`] allows. The kind is that of the lobe that a bounce was drawn from. As after the last
/// bounce of all, one more ray still finds what shines.
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

/// Whether the pixels of a group lend each other the second vertices of their paths: without bias, and with far less
/// noise where matte surfaces scatter light. Nothing is shared with [`Settings::clamp`] or
/// [`Settings::depth_limits`], which are about each path by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sharing {
    /// In groups of up to 64, block by block, where it pays.
    #[default]
    Auto,
    /// Every pixel has its own paths.
    Off,
    /// In groups of this many pixels, one of [`Sharing::SIZES`].
    Groups(u32),
}

impl Sharing {
    /// How many pixels a group may have.
    pub const SIZES: [u32; 6] = [2, 4, 8, 16, 32, 64];
}

/// Whether photons bring the light that glass and mirrors throw onto other things: caustics. Without them such light is
/// found by chance if its lamp can be hit, and not at all if it has no extent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Caustics {
    /// Under the path transport, where there is something that makes them, and light falls on it. (Whitted's images
    /// have no noise, and photons would bring some.)
    #[default]
    Auto,
    /// Without photons.
    Off,
    /// As many photons, and gathered within such a radius.
    Photons {
        /// Photons for each pixel in each of its samples, above 0 and at most [`Caustics::MOST_PHOTONS`].
        photons: f32,
        /// The radius of the first sample in widths of a pixel, from [`Caustics::LEAST_RADIUS`] to
        /// [`Caustics::LARGEST_RADIUS`].
        radius: f32,
    },
}

impl Caustics {
    /// Photons for each pixel unless told otherwise.
    pub const PHOTONS: f32 = 1.0;
    /// The first radius, in widths of a pixel, unless told otherwise. Smaller ones are noisier where caustics are
    /// seen in mirrors or through glass, larger ones blur them.
    pub const RADIUS: f32 = 1.4;
    /// The most photons for each pixel.
    pub const MOST_PHOTONS: f32 = 64.0;
    /// The least first radius. The cells in which photons are found are made for it, and there are only so many.
    pub const LEAST_RADIUS: f32 = 0.01;
    /// The largest first radius.
    pub const LARGEST_RADIUS: f32 = 64.0;

    /// Photons for each pixel, and the first radius; none if there are no photons.
    pub fn numbers(&self) -> Option<(f32, f32)> {
        match *self {
            Caustics::Auto => Some((Self::PHOTONS, Self::RADIUS)),
            Caustics::Off => None,
            Caustics::Photons { photons, radius } => Some((photons, radius)),
        }
    }
}

/// Whether blocks of pixels get more samples where these reduce the error most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Adaptive {
    /// All pixels get the same number.
    #[default]
    Off,
    /// In rounds, each chosen by the samples before it. That is slightly biased (Kirk and Arvo 1991).
    On,
    /// Chosen beforehand, by samples of a pilot that are then discarded: without bias.
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
    /// The four-term window of Blackman and Harris (Harris 1978) over ±`radius`.
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

/// The radiance in W m⁻² sr⁻¹ that rays see that hit nothing. Under the Whitted transport it lights no surface by
/// itself.
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
    /// Divides everything by the image's largest component.
    ScaleByMaximum,
    /// x (1 + x / w²) / (1 + x) on luminance with w = 4 (Reinhard and others 2002).
    Reinhard,
    /// The ACES reference rendering transform, Stephen Hill's fit, at the brightness of three.js.
    Aces,
    /// Sobotka's AgX, base look.
    Agx,
    /// Khronos PBR Neutral.
    PbrNeutral,
}
