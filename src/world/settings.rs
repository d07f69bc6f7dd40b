//! Render settings: the `settings` of a scene file, which command line flags override.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::math::Rgb;

use super::bounds::check;
use super::components::Pattern;
use super::fields::{Field, Fields, Quantity, Range, Slot, fields, forms, names};

fields! {
    /// The render settings. The defaults are those of a file without settings.
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
        /// under the Whitted transport, a reflection or refraction that counts for no more than this is left out (the
        /// path transport plays Russian roulette instead)
        min_throughput: f32 = 1.0 / 1024.0, Number(Range::From(0.0));
        /// from this bounce on, the path transport ends at random paths that carry little, after a bounce off something
        /// matte (Russian roulette)
        roulette_depth: Option<u32> = Some(4), OptionalWhole(0, Settings::MOST_DEPTH);
        /// the path transport cuts off at this radiance what a path brings from beyond its first hit: fewer fireflies,
        /// but some light is lost
        clamp: Option<f32> = None, OptionalNumber(Range::Above0);
        /// after a diffuse bounce, the path transport takes what mirrors and lets light through for at least this rough:
        /// fewer fireflies, but light that such things throw is blurred
        filter_glossy: f32 = 0.0, Number(Range::UNIT);
        /// direct light, mirrors and glass; or light that is scattered any number of times; `Auto` means `Path` for
        /// scenes with glTF files, `Principled` materials or surroundings (`Environment`, `Sky`), else `Whitted`
        transport: Transport = Transport::Whitted, Transport;
        /// how the path transport spreads a pixel's samples over its decisions: stratified at every scale, in a grid,
        /// or not at all
        sampler: Sampler = Sampler::Sobol, Form;
        /// how many pixels share their paths under the path transport; `Auto` measures, block by block,
        /// where this pays off
        sharing: Sharing = Sharing::Auto, Sharing;
        /// whether photons bring the light that glass and mirrors throw onto other things: caustics; `Auto` traces them
        /// under the path transport wherever such light is found, as many as it takes; the numbers are the photons of a
        /// sample for each pixel (at most 64), and the radius in widths of a pixel (0.01 to 64, 1.4 unless given)
        /// within which the first sample gathers them
        caustics: Caustics = Caustics::Auto, Caustics;
        /// whether blocks of pixels get more samples where these reduce the error most, for as many rays as `samples`
        /// per pixel would take
        adaptive: Adaptive = Adaptive::Off, Form;
        /// the seed of all random numbers: another seed gives another, equally valid noise
        seed: u64 = 0, Seed;
        /// weight of a sample by its distance from the pixel's centre; its `radius` is where the weight is zero, in
        /// pixels
        filter: PixelFilter = PixelFilter::default(), Form;
        /// where in a pixel its samples go, before the filter, under the Whitted transport
        pixel_pattern: Pattern = Pattern::Jittered, Form;
        /// radiance that rays see if they hit nothing, W m⁻² sr⁻¹, unless there is an environment or a sky; under the
        /// Whitted transport it lights nothing by itself
        background: Background = Background::default(), Background;
        /// radiance that the camera sees, straight or through surfaces that bend no light, where nothing is hit; it
        /// lights nothing and no mirror shows it; `None`: the environment, the sky or the `background`, which give light
        /// all the same
        backdrop: Option<Background> = None, OptionalBackground;
        /// what images show behind things, where nothing is hit, and through smooth glass: the colours of a screen, 0 to
        /// 1, which neither the exposure nor the tone curve changes, or a picture, scaled so that it covers the image; it
        /// lights nothing, and no mirror shows it
        backplate: Option<Backplate> = None, Backplate;
        /// whether the image has an opacity (alpha), and nothing is seen where nothing is hit, nor through smooth glass and
        /// other surfaces that let light through; the environment, the sky or the `background` still give light, and mirrors
        /// show them
        transparent: bool = false, Flag;
        /// light from nowhere, W m⁻² sr⁻¹: every surface reflects it, times its diffuse colour; under the Whitted
        /// transport
        ambient: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::Radiance));
        /// how radiance becomes what a screen shows, for PNG files
        tonemap: Tonemap = Tonemap::default(), Form;
        /// exposure in stops: PNG files show radiance × 2 to this power
        exposure_ev: f32 = 0.0, Number(Range::FromTo(-64.0, 64.0));
        /// `Auto`: the exposure is chosen from the image, and `exposure_ev` is added to it: the log-average of its
        /// luminance goes to 0.18 (Reinhard and others 2002)
        auto_exposure ["exposure"]: bool = false, Exposure;
        /// meshes that are placed several times are copied to each place as long as this takes no more triangles (or
        /// vertices) in addition to the first copies; what would take more is placed as instances, which need little
        /// memory and are slower to trace
        copied_triangles: u32 = 1 << 18, Whole(0, Settings::MOST_COPIED_TRIANGLES);
        /// whether the film sums up the light of each lamp by itself, so that lamps can be mixed afterwards: each light,
        /// emissive entity and environment without a `group` is one of its own name
        light_groups: bool = false, Flag;
        /// whether the film sums up the light of each bounce by itself, in place of that of lamps: what is emitted towards
        /// the camera, what one surface sends there, what came by way of two, and so on
        light_by_bounce: bool = false, Flag;
        /// what the image holds besides light
        aov: Vec<Aov> = Vec::new(), Aovs;
    }
}

impl Settings {
    /// The largest width and height of an image in pixels.
    pub const MOST_PIXELS_A_SIDE: u32 = 1 << 16;
    /// The largest number of samples of a pixel or of a light: cell numbers of a pattern must be exact as floats.
    pub const MOST_SAMPLES: u32 = 1 << 22;
    /// The largest [`Settings::max_depth`].
    pub const MOST_DEPTH: u32 = 65_535;
    /// The largest [`Settings::copied_triangles`], so that the copies of no scene file take more than a few gigabytes.
    pub const MOST_COPIED_TRIANGLES: u32 = 1 << 24;

    /// True if films count what pixels show of the things behind the scene.
    pub(crate) fn counts_opacity(&self) -> bool {
        self.transparent || self.backplate.is_some()
    }

    /// Checks all settings; the error describes the first one that is out of its range.
    pub(crate) fn check(&self) -> Result<(), String> {
        check(&mut self.clone())
    }
}

names!(
    Aov,
    "output variable",
    [
        Depth, Normal, Albedo, Position, Entity, Material, Coverage, Samples, Variance, Nodes, Tests,
        PathLength, Time
    ]
);

/// An arbitrary output variable: a value of a pixel other than its radiance. Means are over the first hits of the
/// pixel's samples; surfaces that are absent, by their alpha or seen from the back, do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Aov {
    /// The distance from the camera along its axis, in metres.
    Depth,
    /// The shading normal on the viewer's side, in world space.
    Normal,
    /// The base colour, or the diffuse colour of the classic model.
    Albedo,
    /// The position in world space, in metres.
    Position,
    /// The entity that most samples hit: 1 + its number in the world, or 0 for none.
    Entity,
    /// The material that most samples hit: 1 + its number, or 0 for none.
    Material,
    /// The fraction of the samples that hit anything.
    Coverage,
    /// The number of samples.
    Samples,
    /// The estimated variance of the mean of the pixel's samples, in (W m⁻² sr⁻¹)².
    Variance,
    /// The mean number of tree nodes that a sample's rays visit: camera rays, the others of the path, shadow rays.
    Nodes,
    /// The mean number of triangles and spheres that a sample's rays are tested against, by the same kinds of rays.
    Tests,
    /// The mean number of rays along a sample's path and its forks, without shadow rays.
    PathLength,
    /// The time of a sample in microseconds, as measured on one thread under the recursive schedule: no two measurements
    /// are equal.
    Time,
}

impl Aov {
    /// All output variables; those of [`Aov::IMAGE`] come first.
    pub const ALL: [Aov; 13] = [
        Aov::Depth,
        Aov::Normal,
        Aov::Albedo,
        Aov::Position,
        Aov::Entity,
        Aov::Material,
        Aov::Coverage,
        Aov::Samples,
        Aov::Variance,
        Aov::Nodes,
        Aov::Tests,
        Aov::PathLength,
        Aov::Time,
    ];

    /// All output variables except the costs of pixels, which take another rendering: `All` in scene files.
    pub const IMAGE: &[Aov] = Aov::ALL.split_at(9).0;

    /// The name on the command line and in Python.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Aov::Depth => "depth",
            Aov::Normal => "normal",
            Aov::Albedo => "albedo",
            Aov::Position => "position",
            Aov::Entity => "entity",
            Aov::Material => "material",
            Aov::Coverage => "coverage",
            Aov::Samples => "samples",
            Aov::Variance => "variance",
            Aov::Nodes => "nodes",
            Aov::Tests => "tests",
            Aov::PathLength => "path-length",
            Aov::Time => "time",
        }
    }

    /// True if the variable describes the samples themselves, not the surfaces that they hit.
    pub(crate) fn is_of_film(self) -> bool {
        matches!(self, Aov::Samples | Aov::Variance)
    }

    /// True if the variable describes the work of the pixel's samples.
    pub(crate) fn is_cost(self) -> bool {
        matches!(self, Aov::Nodes | Aov::Tests | Aov::PathLength | Aov::Time)
    }
}

fields! {
    /// Limits for the bounces of each kind; `None` stands for [`Settings::max_depth`]. The kind of a bounce is that of
    /// the sampled lobe. As after the last bounce of a path, one more ray still finds emitters.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    pub struct DepthLimits, "depth limits" {
        /// the most bounces off matte surfaces (and through thin ones that scatter light), under the path transport
        diffuse ["diffuse_depth"]: Option<u32> = None, OptionalWhole(0, DepthLimits::MOST);
        /// the most bounces off sharp or blurred mirrors
        glossy ["glossy_depth"]: Option<u32> = None, OptionalWhole(0, DepthLimits::MOST);
        /// the most bounces through glass, smooth or rough
        transmission ["transmission_depth"]: Option<u32> = None, OptionalWhole(0, DepthLimits::MOST);
    }
}

impl DepthLimits {
    /// The largest limit.
    pub const MOST: u32 = 500;

    /// The limits that are set, with their keys in scene files.
    pub(crate) fn given(mut self) -> impl Iterator<Item = (&'static str, u32)> {
        let limit = |field: Field<'_>| match field.slot {
            Slot::OptionalWhole(Some(limit), ..) => Some((field.name, *limit)),
            _ => None,
        };
        self.fields().into_iter().filter_map(limit).collect::<Vec<_>>().into_iter()
    }
}

/// The light transport algorithm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Transport {
    /// Direct light, mirror reflection and refraction (Whitted 1980), with
    /// distributed shadow and lens rays (Cook, Porter and Carpenter 1984).
    #[default]
    Whitted,
    /// Any number of scattering events: path tracing with next-event estimation and multiple importance sampling
    /// (Kajiya 1986, Veach 1997).
    Path,
}

forms! {
    /// The distribution of a pixel's samples in each random dimension.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Sampler, "sampler" {
        /// Owen-scrambled points of Sobol's sequence: stratified at every scale.
        #[default]
        Sobol,
        /// One random point in each cell of a grid.
        Jittered,
        /// Independent random points.
        Independent,
    }
}

/// Path reuse: the pixels of a group give each other the second vertices of their paths. It is unbiased, and reduces
/// noise considerably where matte surfaces scatter light. It is off with [`Settings::depth_limits`], which apply to each
/// path by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sharing {
    /// Groups of up to 64 pixels, in blocks where reuse pays off.
    #[default]
    Auto,
    /// No reuse.
    Off,
    /// Groups of this many pixels, one of [`Sharing::SIZES`].
    Groups(u32),
}

impl Sharing {
    /// The possible numbers of pixels in a group.
    pub const SIZES: [u32; 6] = [2, 4, 8, 16, 32, 64];
}

/// The tracing of photons for caustics, the light that glass and mirrors cast onto other surfaces. Without photons,
/// paths find such light by chance if its source has a surface, and never if not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Caustics {
    /// Photons under the path transport, where light falls on surfaces that cause caustics. (Whitted's images have no
    /// noise, and photons would add some.)
    #[default]
    Auto,
    /// No photons.
    Off,
    /// A given number of photons, gathered within a given radius.
    Photons {
        /// Photons per pixel and sample, above 0 and at most [`Caustics::MOST_PHOTONS`].
        photons: f32,
        /// The gather radius of the first sample in pixel widths, from [`Caustics::LEAST_RADIUS`] to
        /// [`Caustics::LARGEST_RADIUS`].
        radius: f32,
    },
}

impl Caustics {
    /// The default number of photons per pixel and sample.
    pub const PHOTONS: f32 = 1.0;
    /// The default first radius, in pixel widths. Smaller radii are noisier where caustics are seen in mirrors or
    /// through glass; larger ones blur them.
    pub const RADIUS: f32 = 1.4;
    /// The largest number of photons per pixel and sample.
    pub const MOST_PHOTONS: f32 = 64.0;
    /// The smallest first radius. The first radius determines the size of the cells of the photon map, whose number is
    /// limited.
    pub const LEAST_RADIUS: f32 = 0.01;
    /// The largest first radius.
    pub const LARGEST_RADIUS: f32 = 64.0;
    pub(crate) const PHOTON_RANGE: Range = Range::UpTo(Self::MOST_PHOTONS);
    pub(crate) const RADIUS_RANGE: Range = Range::FromTo(Self::LEAST_RADIUS, Self::LARGEST_RADIUS);

    /// Returns the photons per pixel and sample, and the first radius; `None` without photons.
    pub fn numbers(&self) -> Option<(f32, f32)> {
        match *self {
            Caustics::Auto => Some((Self::PHOTONS, Self::RADIUS)),
            Caustics::Off => None,
            Caustics::Photons { photons, radius } => Some((photons, radius)),
        }
    }
}

forms! {
    /// Adaptive sampling: more samples for the blocks of pixels where they reduce the error most.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Adaptive, "adaptive" {
        /// An equal number of samples for all pixels.
        #[default]
        Off,
        /// Rounds of samples, each allocated by the previous samples. This is slightly biased (Kirk and Arvo 1991).
        On,
        /// Samples allocated beforehand by a pilot pass, whose samples are discarded: unbiased.
        Unbiased,
    }
}

forms! {
    /// The reconstruction filter: the weight of a sample by its distance from the pixel's centre. It is
    /// importance-sampled: sample positions follow the filter, and all samples have equal weight.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    pub enum PixelFilter, "filter" {
        /// A constant over one pixel.
        Box,
        /// A linear falloff to zero at `radius`.
        Tent {
            /// in pixels
            radius: f32 = 1.0, Number(Range::Above0);
        },
        /// A Gaussian of standard deviation `radius / 3`, truncated at `radius`.
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

/// The radiance in W m⁻² sr⁻¹ of rays that hit nothing. Under the Whitted transport it lights no surface by itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Background {
    /// A constant over all directions.
    Constant(Rgb),
    /// A gradient, linear in the y of the direction: `bottom` straight down, `top` straight up (+Y).
    Gradient {
        /// The radiance straight down.
        bottom: Rgb,
        /// The radiance straight up.
        top: Rgb,
    },
}

impl Background {
    /// True if it has no light.
    pub(crate) fn is_black(&self) -> bool {
        match self {
            Background::Constant(color) => color.is_black(),
            Background::Gradient { bottom, top } => bottom.is_black() && top.is_black(),
        }
    }
}

impl Default for Background {
    fn default() -> Self {
        Self::Constant(Rgb::BLACK)
    }
}

/// The picture behind the things of a scene, in images for screens. Colours are linear display values from 0 to 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Backplate {
    /// One colour.
    Constant(Rgb),
    /// A gradient from the bottom row to the top row, in steps that are even to the eye.
    Gradient {
        /// The colour of the bottom.
        bottom: Rgb,
        /// The colour of the top.
        top: Rgb,
    },
    /// The picture in this file, scaled so that it covers the image.
    Image(PathBuf),
}

forms! {
    /// The mapping from scene radiance to display values.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum Tonemap, "tonemap" {
        /// Clamps at 1.
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
