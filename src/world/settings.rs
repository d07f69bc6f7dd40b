//! How to render: what a scene file's `settings` say and command line flags override.

use serde::{Deserialize, Serialize};

use crate::bvh::BuildQuality;
use crate::math::Rgb;

use super::components::Pattern;
use super::fields::{self, Field, Fields, Range, Slot, fields, forms, names};

fields! {
    /// How to render. The defaults are those of a file without settings.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    pub struct Settings, "settings" {
        /// width and height of the image
        size: [u32; 2] = [960, 540], Size;
        /// samples per pixel
        samples: u32 = 16, Whole(1, Settings::MOST_SAMPLES);
        /// bounces after the camera ray; what lies beyond is black, but under the path transport, a surface that is met
        /// after the last bounce still shows what it emits; 64 under the path transport if a material bends light
        max_depth: u32 = 8, Whole(0, Settings::MOST_DEPTH);
        /// limits for bounces of each kind within these, under the path transport
        depth_limits: DepthLimits = DepthLimits::default(), Inline;
        /// under the Whitted transport, a reflection or refraction that counts for no more than this is left out (the path
        /// transport plays Russian roulette instead)
        min_throughput: f32 = 1.0 / 1024.0, Number(Range::From(0.0));
        /// from this bounce on, the path transport ends at random paths that carry little, after a bounce off something
        /// matte (Russian roulette)
        roulette_depth: Option<u32> = Some(4), OptionalWhole(Settings::MOST_DEPTH);
        /// the path transport cuts off at this radiance what a path brings from beyond its first hit: fewer fireflies, but
        /// some light is lost
        clamp: Option<f32> = None, OptionalNumber(Range::Above0);
        /// direct light, mirrors and glass; or light that is scattered any number of times; `Auto` means `Path` for scenes
        /// with glTF files, `Principled` materials or surroundings (`Environment`, `Sky`), else `Whitted`
        transport: Transport = Transport::Whitted, Transport;
        /// how the path transport spreads a pixel's samples over its decisions: stratified at every scale, in a grid, or
        /// not at all
        sampler: Sampler = Sampler::Sobol, Form;
        /// how many neighbouring pixels share their paths under the path transport; `Auto` measures, block by block, where
        /// this pays off
        sharing: Sharing = Sharing::Auto, Sharing;
        /// whether photons bring the light that glass and mirrors throw onto other things: caustics; `Auto` traces them
        /// under the path transport wherever such light is found, as many as it takes; the numbers are the photons of a
        /// sample for each pixel (at most 64), and the radius in widths of a pixel (0.01 to 64, 1.4 unless given) within
        /// which the first sample gathers them
        caustics: Caustics = Caustics::Auto, Caustics;
        /// whether blocks of pixels get more samples where these reduce the error most, for as many rays as `samples` per
        /// pixel would take
        adaptive: Adaptive = Adaptive::Off, Form;
        /// the seed of all random numbers: another seed gives another, equally valid noise
        seed: u64 = 0, Seed;
        /// weight of a sample by its distance from the pixel's centre; its `radius` is where the weight is zero, in pixels
        filter: PixelFilter = PixelFilter::default(), Form;
        /// where in a pixel its samples go, before the filter, under the Whitted transport
        pixel_pattern: Pattern = Pattern::Jittered, Form;
        /// radiance that rays see if they hit nothing, W m⁻² sr⁻¹, unless there is an environment or a sky; under the
        /// Whitted transport it lights nothing by itself
        background: Background = Background::default(), Background;
        /// light from nowhere, W m⁻² sr⁻¹: every surface reflects it, times its diffuse colour; under the Whitted transport
        ambient: Rgb = Rgb::BLACK, Color(Range::From(0.0));
        /// how radiance becomes what a screen shows, for PNG files
        tonemap: Tonemap = Tonemap::default(), Form;
        /// exposure in stops: PNG files show radiance × 2 to this power
        exposure_ev: f32 = 0.0, Number(Range::FromTo(-64.0, 64.0));
        /// `Auto`: the exposure is chosen from the image, and `exposure_ev` is added to it: the log-average of its luminance
        /// goes to 0.18 (Reinhard and others 2002)
        auto_exposure ["exposure"]: bool = false, Exposure;
        /// work put into the acceleration structure: the more, the faster the tracing
        build_quality: BuildQuality = BuildQuality::Default, Form;
        /// meshes that are placed several times are copied to each place as long as this takes no more triangles (or
        /// vertices) in addition to the first copies; what would take more is placed as instances, which need little memory
        /// and are slower to trace
        copied_triangles: u32 = 1 << 18, Whole(0, Settings::MOST_COPIED_TRIANGLES);
        /// what the image holds besides light
        aov: Vec<Aov> = Vec::new(), Aovs;
    }
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

    /// Errors: the first setting that is out of its range.
    pub(crate) fn check(&self) -> Result<(), String> {
        fields::check(&mut self.clone())
    }
}

names!(BuildQuality, "build quality", [Fast, Default, High]);
names!(
    Aov,
    "output variable",
    [Depth, Normal, Albedo, Position, Entity, Material, Coverage, Samples, Variance]
);

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

fields! {
    /// Limits for bounces of each kind; with `None`, as many as [`Settings::max_depth`] allows. The kind is that of the
    /// lobe that a bounce was sampled from. As after the last bounce of all, one more ray still finds what emits.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    pub struct DepthLimits, "depth limits" {
        /// the most bounces off matte surfaces (and through thin ones that scatter light), under the path transport
        diffuse ["diffuse_depth"]: Option<u32> = None, OptionalWhole(DepthLimits::MOST);
        /// the most bounces off sharp or blurred mirrors
        glossy ["glossy_depth"]: Option<u32> = None, OptionalWhole(DepthLimits::MOST);
        /// the most bounces through glass, smooth or rough
        transmission ["transmission_depth"]: Option<u32> = None, OptionalWhole(DepthLimits::MOST);
    }
}

impl DepthLimits {
    /// The largest limit.
    pub const MOST: u32 = 1000;

    /// The limits that there are, by their keys in scene files.
    pub(crate) fn given(mut self) -> impl Iterator<Item = (&'static str, u32)> {
        let limit = |field: Field<'_>| match field.slot {
            Slot::OptionalWhole(Some(limit), _) => Some((field.name, *limit)),
            _ => None,
        };
        self.fields().into_iter().filter_map(limit).collect::<Vec<_>>().into_iter()
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

forms! {
    /// How the samples of a pixel are spread over each use of random numbers.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Sampler, "sampler" {
        /// Points of Sobol's sequence, scrambled after Owen: stratified at every scale.
        #[default]
        Sobol,
        /// One at random in each cell of a grid.
        Jittered,
        /// Each on its own.
        Independent,
    }
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

forms! {
    /// Whether blocks of pixels get more samples where these reduce the error most.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Adaptive, "adaptive" {
        /// All pixels get the same number.
        #[default]
        Off,
        /// In rounds, each chosen by the samples before it. That is slightly biased (Kirk and Arvo 1991).
        On,
        /// Chosen beforehand, by samples of a pilot that are then discarded: without bias.
        Unbiased,
    }
}

forms! {
    /// The weight of a sample by its distance from the pixel's centre, sampled by
    /// importance: every sample counts the same and lands where the filter says.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    pub enum PixelFilter, "filter" {
        /// Constant over one pixel.
        Box,
        /// Falls linearly to zero at `radius`.
        Tent {
            /// in pixels
            radius: f32 = 1.0, Number(Range::Above0);
        },
        /// A Gaussian bell of standard deviation `radius / 3`, cut off at `radius`.
        Gaussian {
            /// in pixels
            radius: f32 = 1.5, Number(Range::Above0);
        },
        /// The four-term window of Blackman and Harris (Harris 1978) over ±`radius`.
        BlackmanHarris {
            /// in pixels
            radius: f32 = 1.5, Number(Range::Above0);
        },
    }
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

forms! {
    /// From scene radiance to what a screen shows.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Tonemap, "tonemap" {
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
}
