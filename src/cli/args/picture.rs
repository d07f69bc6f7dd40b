//! Options of the image and of reading a scene.

use clap::Args;

use super::names::{
    ADAPTIVE, GROUNDS, LIGHT_UNITS, SAMPLERS, TONEMAPS, TRANSPORTS, TransportChoice, UP_AXES, one_of,
};
use super::parse::{
    Exposure, parse_caustics, parse_degrees, parse_exposure_or_auto, parse_f_stop, parse_focal_length,
    parse_fov, parse_place, parse_roughness, parse_sharing, parse_size, parse_strength, parse_time,
    parse_turn, parse_variable, parse_zoom,
};
use crate::formats::{Edits, EnvironmentPreset, Floor, LightUnits, LoadOptions, UpAxis};
use crate::world::{Adaptive, Caustics, DepthLimits, Sampler, Settings, Sharing, Tonemap, World};

/// Angles in degrees, to the right and up.
pub type Degrees = [f64; 2];

/// Columns and rows. An alias, because clap would take an array for several values.
pub type ImageSize = [u32; 2];

/// The options on which samples depend: their number, size, camera, light. Groups of options come last, because any
/// option after a group would belong to it.
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct SampleOptions {
    /// Samples per pixel
    #[arg(short = 's', long, visible_alias = "samples-per-pixel", aliases = ["sample-count", "samples-count"], value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    pub spp: Option<u32>,
    /// Size of the image in pixels, such as 1280x720
    #[arg(long, aliases = ["resolution", "res"], value_name = "WxH", value_parser = parse_size)]
    pub size: Option<ImageSize>,
    /// Seed of the random numbers [default: the scene's]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Name of the camera to look through [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Show nothing where nothing is hit, and count the opacity of pixels for PNG, WebP and OpenEXR files; environments
    /// still give light
    #[arg(long)]
    pub transparent: bool,
    /// The options of light transport.
    #[command(flatten)]
    pub light: LightOptions,
}

impl SampleOptions {
    /// Applies these options to the scene's settings.
    pub fn apply(&self, world: &mut World) {
        self.light.apply(world);
        let settings = &mut world.settings;
        settings.samples = self.spp.unwrap_or(settings.samples);
        settings.seed = self.seed.unwrap_or(settings.seed);
        settings.transparent |= self.transparent;
    }
}

/// The options of the image: its samples and its display.
#[derive(Args, Debug)]
pub struct PictureOptions {
    /// The options of the samples.
    #[command(flatten)]
    pub sampling: SampleOptions,
    /// The options of the display.
    #[command(flatten)]
    pub look: PictureLook,
}

/// The options of display.
#[derive(Args, Debug)]
pub struct PictureLook {
    /// Tone curve of PNG files
    #[arg(long, help_heading = "Picture", value_parser = one_of(TONEMAPS))]
    pub tonemap: Option<Tonemap>,
    /// Exposure of PNG files in stops, such as -1.5, or auto: chosen from the image, and printed
    #[arg(long, help_heading = "Picture", value_name = "STOPS|auto", allow_negative_numbers = true,
          value_parser = parse_exposure_or_auto)]
    pub exposure: Option<Exposure>,
}

impl PictureOptions {
    /// Applies these options to the scene's settings.
    pub fn apply(&self, world: &mut World) {
        self.sampling.apply(world);
        self.look.apply(&mut world.settings);
    }
}

impl PictureLook {
    /// Applies these options to settings.
    pub fn apply(&self, settings: &mut Settings) {
        if let Some(exposure) = self.exposure {
            (settings.auto_exposure, settings.exposure_ev) = (exposure.is_none(), exposure.unwrap_or(0.0));
        }
        settings.tonemap = self.tonemap.unwrap_or(settings.tonemap);
    }
}

/// The options of light transport.
#[derive(Args, Debug)]
#[command(next_help_heading = "Light")]
pub struct LightOptions {
    /// Maximum number of bounces after the camera ray [default: the scene's]
    #[arg(long, aliases = ["max-depth", "maxdepth", "bounces", "max-bounces"], value_name = "N", value_parser = clap::value_parser!(u32).range(0..=65_535))]
    pub depth: Option<u32>,
    /// Maximum number of diffuse bounces among these, under the path transport [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=DepthLimits::MOST as i64))]
    pub diffuse_depth: Option<u32>,
    /// Maximum number of mirror reflections among these, sharp or blurred, under the path transport [default: the
    /// scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=DepthLimits::MOST as i64))]
    pub glossy_depth: Option<u32>,
    /// Maximum number of transmissions through glass among these, under the path transport [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=DepthLimits::MOST as i64))]
    pub transmission_depth: Option<u32>,
    /// Light transport [default: the scene's]
    #[arg(long, value_parser = one_of(TRANSPORTS))]
    pub transport: Option<TransportChoice>,
    /// Sample pattern of the path transport [default: the scene's]
    #[arg(long, value_parser = one_of(SAMPLERS))]
    pub sampler: Option<Sampler>,
    /// Path reuse among groups of this many pixels, under the path transport: auto, off, or 2, 4 ... 64 [default: the
    /// scene's]
    #[arg(long, value_name = "auto|off|N", value_parser = parse_sharing)]
    pub sharing: Option<Sharing>,
    /// Caustics, the light that glass and mirrors throw onto other surfaces: auto (under the path transport), off, or
    /// the number of photons per pixel, as in 2, optionally with the first radius in pixels, as in 2,1.4 [default: the
    /// scene's]
    #[arg(long, value_name = "auto|off|N[,R]", value_parser = parse_caustics)]
    pub caustics: Option<Caustics>,
    /// Least roughness of what mirrors or lets light through, after a diffuse bounce, under the path transport: fewer
    /// fireflies, 0 to 1 [default: the scene's]
    #[arg(long, value_name = "ROUGHNESS", value_parser = parse_roughness)]
    pub filter_glossy: Option<f32>,
    /// Give blocks of pixels more samples where they reduce the error most, for as many rays as --spp takes: on, off,
    /// or unbiased, which decides beforehand by samples that are then discarded [default: the scene's]
    #[arg(long, value_name = "on|off|unbiased", num_args = 0..=1, default_missing_value = "on", require_equals = true,
          hide_possible_values = true, value_parser = one_of(ADAPTIVE))]
    pub adaptive: Option<Adaptive>,
    /// Sum up the light of each lamp by itself, for layers of an .exr file and rayfront mix
    #[arg(long)]
    pub light_groups: bool,
    /// Sum up the light of each bounce by itself, for layers of an .exr file and rayfront mix
    #[arg(long)]
    pub light_by_bounce: bool,
}

impl LightOptions {
    /// Applies these options to the scene's settings.
    pub fn apply(&self, world: &mut World) {
        let fitting = world.fitting_transport();
        let transport = self.transport.map_or(world.settings.transport, |choice| choice.unwrap_or(fitting));
        let depth = self.depth.unwrap_or(world.depth_under(transport));
        let settings = &mut world.settings;
        (settings.transport, settings.max_depth) = (transport, depth);
        let limits = &mut settings.depth_limits;
        limits.diffuse = self.diffuse_depth.or(limits.diffuse);
        limits.glossy = self.glossy_depth.or(limits.glossy);
        limits.transmission = self.transmission_depth.or(limits.transmission);
        if self.transport.is_some() {
            world.warnings.retain(|warning| warning.code != World::PATH_IS_CHOSEN);
        }
        settings.sampler = self.sampler.unwrap_or(settings.sampler);
        settings.sharing = self.sharing.unwrap_or(settings.sharing);
        settings.caustics = self.caustics.unwrap_or(settings.caustics);
        settings.filter_glossy = self.filter_glossy.unwrap_or(settings.filter_glossy);
        settings.adaptive = self.adaptive.unwrap_or(settings.adaptive);
        settings.light_groups |= self.light_groups;
        settings.light_by_bounce |= self.light_by_bounce;
    }
}

/// The options of commands that render a scene in several ways.
#[derive(Args, Debug)]
pub struct StudyOptions {
    /// Name of the camera to look through [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Print one JSON object instead
    #[arg(long)]
    pub json: bool,
    /// The options of light transport.
    #[command(flatten)]
    pub light: LightOptions,
    /// The options for reading the scene.
    #[command(flatten)]
    pub model: ModelOptions,
}

/// The options for reading a scene and its glTF files, including its environment and edits.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Model")]
pub struct ModelOptions {
    /// Give a variable of a scene file a value, such as height=1.2 or 'paint=(0.8, 0.1, 0.1)'; may be given several
    /// times
    #[arg(long = "var", value_name = "NAME=VALUE", value_parser = parse_variable)]
    pub variables: Vec<(String, String)>,
    /// Time of animations and keys, in seconds [default: the scene as it stands without them]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_time)]
    pub time: Option<f32>,
    /// Variant of a model's materials
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Scene of a model, by name or index [default: the file's own choice]
    #[arg(id = "model_scene", long = "scene", value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// Animation of a model, by name or index [default: all, the first of those that move the same node]
    #[arg(long, value_name = "NAME|INDEX")]
    pub animation: Option<String>,
    /// Unit of glTF lights: candela (as they are), watt (683 lumens to a watt), auto (Blender's unit, if Blender wrote
    /// the file)
    #[arg(long, value_name = "NAME", default_value = "auto", hide_possible_values = true,
          value_parser = one_of(LIGHT_UNITS))]
    pub light_units: LightUnits,
    /// Treat glass without a volume in glTF files as a solid body, which refracts light
    #[arg(long)]
    pub solid_glass: bool,
    /// Make all surfaces of glTF files visible from both sides
    #[arg(long)]
    pub double_sided: bool,
    /// Axis that points up in a model or mesh: y, or z (Blender, CAD, scans), which is turned upright
    #[arg(long, value_name = "y|z", default_value = "y", hide_possible_values = true, value_parser = one_of(UP_AXES))]
    pub up: UpAxis,
    /// Environment in place of the scene's own: an image file, or none, studio, sky, sky:ELEVATION,AZIMUTH
    #[arg(long, aliases = ["hdri", "hdri-file", "envmap", "environment", "skybox"], value_name = "NAME|FILE",
          value_parser = EnvironmentPreset::named)]
    pub env: Option<EnvironmentPreset>,
    /// Turn the environment or sky, by degrees clockwise seen from above
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = parse_turn)]
    pub env_turn: Option<f64>,
    /// Factor on the light of the environment or sky
    #[arg(long, value_name = "FACTOR", value_parser = parse_strength)]
    pub env_strength: Option<f32>,
    /// The edits of the scene.
    #[command(flatten)]
    pub edits: EditOptions,
}

/// The edits of a scene after its files are read.
#[derive(Args, Clone, Debug)]
pub struct EditOptions {
    /// Change a value, such as 'Light[name~"lamp*"].power_w *= 2' or 'Material["glass"].ior = 1.6'; may be given
    /// several times
    #[arg(long, value_name = "STATEMENT")]
    pub set: Vec<String>,
    /// Keep only these shapes, such as '"ball" | Plane', and their children
    #[arg(long, value_name = "QUERY")]
    pub only: Vec<String>,
    /// Remove shapes and lights, such as 'Mesh & !Material', and their children, or cameras ('Camera': the view is that
    /// of a model without one)
    #[arg(long, value_name = "QUERY")]
    pub hide: Vec<String>,
    /// Look from one point at another, each as X,Y,Z in metres
    #[arg(long, num_args = 2, value_names = ["FROM", "TO"], allow_hyphen_values = true, value_parser = parse_place)]
    pub look_at: Vec<String>,
    /// Orbit cameras about their targets, by degrees to the right and up
    #[arg(long, value_name = "RIGHT,UP", allow_hyphen_values = true, value_parser = parse_degrees)]
    pub orbit: Option<Degrees>,
    /// Move cameras this many times closer to their targets
    #[arg(long, value_name = "FACTOR", value_parser = parse_zoom)]
    pub zoom: Option<f64>,
    /// Vertical angle of view of cameras, in degrees
    #[arg(long, alias = "vfov", value_name = "DEGREES", value_parser = parse_fov)]
    pub fov: Option<f64>,
    /// Focal length of cameras in millimetres, for full frame (36 mm along the longer side) or the camera's own sensor
    #[arg(long, value_name = "MM", value_parser = parse_focal_length, conflicts_with = "fov")]
    pub focal_length: Option<f64>,
    /// F-number of cameras, such as 2.8: what is not in focus is blurred; without --focus, a camera that has no focus yet
    /// focuses on what is in the middle of the image
    #[arg(long, alias = "fstop", value_name = "N", value_parser = parse_f_stop)]
    pub f_stop: Option<f64>,
    /// Focus on an entity, or on what a pixel of the image shows
    #[arg(long, value_name = "NAME|X,Y")]
    pub focus: Option<String>,
    /// Put a floor under everything: a grey one, or one of which only the shadows are seen
    #[arg(long, value_name = "grey|shadow", num_args = 0..=1, require_equals = true, default_missing_value = "grey", hide_possible_values = true, value_parser = one_of(GROUNDS))]
    pub ground: Option<Floor>,
    /// Shown behind things, unchanged by exposure and tone curve: a colour as in scene files, such as white, '#ff8000' or
    /// 0.1,0.2,0.4 (linear), or a picture, which is scaled so that it covers the image. It lights nothing; OpenEXR files get the
    /// opacity of pixels in its place
    #[arg(long, aliases = ["background-color", "background-image", "backplate", "bg-color", "bg"], value_name = "COLOUR|FILE")]
    pub background: Option<String>,
}

impl EditOptions {
    /// Returns the edits in the form that loaders expect.
    pub fn edits(self) -> Edits {
        let EditOptions { set, only, hide, look_at, orbit, zoom, fov, focal_length, f_stop, focus, .. } =
            self;
        let EditOptions { ground, background, .. } = self;
        let look_at = look_at.try_into().ok();
        let lens =
            Edits { fov_degrees: fov, focal_length_mm: focal_length, f_stop, focus, ..Edits::default() };
        Edits { set, only, hide, look_at, orbit, zoom, ground, background, ..lens }
    }
}

impl ModelOptions {
    /// Returns the options in the form that loaders expect, with the given size of the image, if any.
    pub fn of_size(&self, size: Option<ImageSize>) -> LoadOptions {
        let ModelOptions { time, variant, scene, animation, light_units, solid_glass, double_sided, .. } =
            self.clone();
        let ModelOptions { variables, up, env, env_turn, env_strength, edits, .. } = self.clone();
        let var = variables.into_iter().collect();
        let edits = Edits { env_turn_degrees: env_turn, env_strength, ..edits.edits() };
        let common = LoadOptions { var, time_s: time, variant, scene, edits, size, ..LoadOptions::default() };
        LoadOptions { animation, light_units, solid_glass, double_sided, up, surroundings: env, ..common }
    }
}
