//! Options for reading a scene: the moment, the surroundings and changes of values.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::{LoadError, did_you_mean, in_one_line};
use crate::math::{DVec3, Quat, Rgb, Vec3};
use crate::world::{Light, Transform};

/// Options for reading a scene. The default reads it as it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LoadOptions {
    /// Values of variables by their names, as text of scene files (`1.2`, `(0.8, 0.1, 0.1)`, `"oak.png"`), in place of
    /// those that the file gives. Paths in them are relative to the working folder. For `.ron` files.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub var: BTreeMap<String, String>,
    /// The time at which animations (of glTF files) and keys (of `.ron` files) are read, in seconds. None: nodes have
    /// the poses in their file, and keyed values are those at 0 s. For `.ron`, `.gltf` and `.glb` files.
    pub time_s: Option<f32>,
    /// The name of a variant of the model's materials (KHR_materials_variants), or its number from 0. For `.gltf` and
    /// `.glb` files.
    pub variant: Option<String>,
    /// The name of one of the model's scenes, or its number from 0. None: the file's default scene. For `.gltf` and
    /// `.glb` files.
    pub scene: Option<String>,
    /// The name of one of the model's animations, or its number from 0. None: all of them; if several move the same
    /// property of a node, the first counts. A model that has it is read at 0 s unless a time is given. For glTF files,
    /// and `.ron` files that place them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// The unit of a model's lights. For glTF files, and `.ron` files that place them.
    pub light_units: LightUnits,
    /// True if glass without a volume encloses a solid body all the same. Otherwise it is a thin sheet, which light
    /// passes without refraction. For glTF files, and `.ron` files that place them.
    pub solid_glass: bool,
    /// True if all surfaces of models are visible from both sides. For glTF files, and `.ron` files that place them.
    pub double_sided: bool,
    /// The axis that points up in a model or mesh. For `.gltf`, `.glb` files and meshes: scene files have transforms.
    #[serde(skip_serializing_if = "UpAxis::is_usual")]
    pub up: UpAxis,
    /// Surroundings that replace the scene's own environments and skies. None: these stay.
    pub surroundings: Option<EnvironmentPreset>,
    /// Other changes.
    #[serde(skip_serializing_if = "Edits::is_empty")]
    pub edits: Edits,
    /// Columns and rows of the image, each 1 to 65,536, in place of the scene's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
}

impl LoadOptions {
    /// Fails for options that have no meaning for a file of this kind.
    pub(super) fn are_for(&self, path: &Path, extension: &str) -> Result<(), LoadError> {
        let (to_gltf, to_scenes) = match extension {
            "gltf" | "glb" => (false, false),
            "ron" if self.up != UpAxis::default() => {
                let way = "in a scene, transform: (rotate_degrees: (-90, 0, 0)) turns an entity upright";
                return Err(LoadError::option("up", format!("this is for models and meshes: {way}")));
            }
            "ron" => (true, false),
            _ => (true, true),
        };
        let gltf = ".gltf and .glb files";
        let scenes = ".gltf and .glb files and .ron files that name these";
        let all = [
            ("var", extension != "ron" && !self.var.is_empty(), ".ron files"),
            ("variant", to_gltf && self.variant.is_some(), gltf),
            ("scene", to_gltf && self.scene.is_some(), gltf),
            ("animation", to_scenes && self.animation.is_some(), scenes),
            ("light_units", to_scenes && self.light_units != LightUnits::Auto, scenes),
            ("solid_glass", to_scenes && self.solid_glass, scenes),
            ("double_sided", to_scenes && self.double_sided, scenes),
            ("time_s", to_scenes && self.time_s.is_some(), ".gltf, .glb and .ron files"),
        ];
        match all.iter().find(|(_, is_refused, _)| *is_refused) {
            Some((option, _, kinds)) => Err(LoadError::option(
                option,
                format!("this is for {kinds}, not for {}", in_one_line(&path.to_string_lossy())),
            )),
            None => Ok(()),
        }
    }
}

/// The unit of the lights in a glTF file. Its specification (KHR_lights_punctual) uses candela and lux; powers here are
/// in watts, so a factor is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LightUnits {
    /// `Watt` if Blender's exporter wrote the file and its lights are too bright to be watts (which gives a warning),
    /// otherwise `Candela`.
    #[default]
    Auto,
    /// Candela and lux, as in the specification. A lumen counts as a watt, so that a light of 1 cd is as bright as 1 m²
    /// of a surface that emits 1 W m⁻² sr⁻¹.
    Candela,
    /// Candela and lux, but with 683 lumens to a watt. The emission of materials is in watts already.
    Watt,
}

/// A floor that is added under everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Floor {
    /// A grey one.
    Grey,
    /// One that shows what is behind it, darkened by the shadows of things
    /// ([`crate::world::Principled::shadow_catcher`]).
    Shadow,
}

/// The axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpAxis {
    /// +Y, as in scene files and glTF.
    #[default]
    Y,
    /// +Z, as in Blender, CAD and scans: turned by −90° about X, so that it points to +Y.
    Z,
}

impl UpAxis {
    fn is_usual(&self) -> bool {
        *self == UpAxis::default()
    }

    /// The transform that turns the axis to +Y.
    pub(super) fn upright(self) -> Transform {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let rotation = match self {
            UpAxis::Y => Quat::IDENTITY,
            UpAxis::Z => Quat::from_xyzw(-half, 0.0, 0.0, half),
        };
        Transform::Trs { translation: DVec3::ZERO, rotation, scale: Vec3::ONE }
    }
}

/// Changes to a scene beyond its files. They are applied in this order: `env_turn_degrees`, `env_strength`, `look_at`,
/// `set`, `only`, `hide`, `background`, `fov_degrees`, `focal_length_mm`, `f_stop`, `focus`, `orbit`, `zoom`, `ground`.
///
/// `only` and `hide` hold queries, which select entities. A query is a kind of component (`Light`), perhaps with a name
/// or filters in brackets (`Mesh["floor"]`, `Light[name~"lamp*", parent="stage"]`), or only a name (`"lamp*"`); queries
/// combine by `&`, `|`, `!` and parentheses. A filter compares `name`, `parent` or `material` by `=`, `!=` or `~`. In
/// names and after `~`, `*` stands for any text. `set` holds statements, which change a value of everything that a
/// query selects: `Material["glass"].ior = 1.6`, `Light.power_w *= 2`, `settings.samples = 64`. The operators are `=`,
/// `*=`, `/=`, `+=` and `-=`. `hide` removes the cameras of what it selects if nothing of that is a shape or a light; if
/// no camera is left, one is added that sees everything.
///
/// A text that cannot be parsed, selects nothing, or sets a value that a scene file cannot hold is a
/// [`LoadError::Option`] with the name of its field.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Edits {
    /// Statements that change values, such as `Material["glass"].ior = 1.6`.
    pub set: Vec<String>,
    /// Queries. If there are any, rays can hit only the shapes that one of them selects, and the shapes below those.
    /// Lights stay.
    pub only: Vec<String>,
    /// Queries. The shapes and lights that they select are removed, and so are all below these. Surroundings that
    /// [`LoadOptions::surroundings`] adds, or that a bare model gets, stay.
    pub hide: Vec<String>,
    /// The position of all cameras, and the point that they look at: each `"x, y, z"` in metres.
    pub look_at: Option<[String; 2]>,
    /// The angles in degrees by which cameras orbit the point that they look at: to the right, and up. They never pass
    /// straight up or straight down.
    pub orbit: Option<[f64; 2]>,
    /// The factor by which cameras come nearer to the point that they look at, from 0.001 to 1000. An orthographic
    /// camera shows a part that is smaller by this factor instead.
    pub zoom: Option<f64>,
    /// The vertical angle of view of cameras with a lens (and of pinholes), in degrees, between 0 and 180.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fov_degrees: Option<f64>,
    /// Their focal length in millimetres, 0.1 to 100,000: with a sensor of 36 mm along the image's longer side (full
    /// frame), or the camera's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_length_mm: Option<f64>,
    /// Their f-number, 0.01 to 1000. A camera without a focus focuses on what is in the middle of the image, unless
    /// there is a `focus`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_stop: Option<f64>,
    /// The name of the entity that is in focus, or the pixel of the image, `X,Y` from its top left.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus: Option<String>,
    /// The picture behind things: a colour or a gradient as in scene files, such as `0.2`, of
    /// which the quotes of `#c03020` and the parentheses of `0.1, 0.2, 0.3` may be missing, or the path of a picture:
    /// [`crate::world::Settings::backplate`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<String>,
    /// The angle in degrees by which environments and skies are turned, clockwise seen from above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub env_turn_degrees: Option<f64>,
    /// The factor on the light of environments and skies, at least 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub env_strength: Option<f32>,
    /// The large floor that is added under everything, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground: Option<Floor>,
}

impl Edits {
    /// The range of [`Edits::focal_length_mm`].
    pub(crate) const FOCAL_LENGTHS_MM: RangeInclusive<f64> = 0.1..=100_000.0;
    /// The range of [`Edits::f_stop`].
    pub(crate) const F_STOPS: RangeInclusive<f64> = 0.01..=1000.0;
    /// The largest [`Edits::env_strength`].
    pub const MOST_STRENGTH: f32 = 1e6;

    /// True if there are no edits.
    pub(crate) fn is_empty(&self) -> bool {
        *self == Edits::default()
    }

    /// Leaves cameras where the files put them.
    pub(crate) fn forget_camera(&mut self) {
        (self.look_at, self.orbit, self.zoom) = (None, None, None);
        (self.fov_degrees, self.focal_length_mm, self.f_stop, self.focus) = (None, None, None, None);
    }
}

/// Surroundings that replace a scene's own environments and skies. They light the scene, and are visible behind it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EnvironmentPreset {
    /// No surroundings: the scene's own environments and skies are removed.
    None,
    /// A photographer's studio: two soft lights, a pale ceiling, a grey floor.
    Studio,
    /// A clear sky and its sun, as [`Light::Sky`] describes, at full brightness.
    Sky(SkyOptions),
    /// An equirectangular image: a path, relative to the working folder. Its centre lies along −Z, its top along +Y;
    /// its values are radiance in W m⁻² sr⁻¹.
    Picture(#[serde(with = "as_text")] PathBuf),
}

/// The position of the sun, and the haze in the air.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkyOptions {
    /// The sun's elevation above the horizon in degrees, from −90 to 90.
    pub elevation_degrees: f64,
    /// The sun's azimuth in degrees: 0 along −Z, 90 along +X. Any finite number.
    pub azimuth_degrees: f64,
    /// The haze, relative to that of a clear day, from 0 to [`SkyOptions::MOST_HAZE`].
    pub haze: f32,
}

impl SkyOptions {
    /// The largest [`SkyOptions::haze`].
    pub const MOST_HAZE: f32 = 100.0;

    /// The sky as a light.
    pub(in crate::formats) fn light(&self, radiance: Rgb) -> Light {
        let radians = |degrees: f64| degrees.to_radians() as f32;
        let (elevation, azimuth) =
            (radians(self.elevation_degrees), radians(self.azimuth_degrees.rem_euclid(360.0)));
        Light::Sky { elevation, azimuth, haze: self.haze, radiance, sun: 1.0, sun_angle: Light::SUN_ANGLE }
    }
}

impl Default for SkyOptions {
    /// Half-way up the sky, behind the left shoulder of someone looking along −Z: elevation 45°, azimuth 220°, haze 1.
    fn default() -> Self {
        Self { elevation_degrees: 45.0, azimuth_degrees: 220.0, haze: 1.0 }
    }
}

impl FromStr for EnvironmentPreset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "none" => return Ok(Self::None),
            "studio" => return Ok(Self::Studio),
            _ => {}
        }
        let Some(place) = text.strip_prefix("sky") else { return Ok(Self::Picture(text.into())) };
        let mut sky = SkyOptions::default();
        let Some(place) = place.strip_prefix(':') else {
            return if place.is_empty() { Ok(Self::Sky(sky)) } else { Ok(Self::Picture(text.into())) };
        };
        let number = |text: &str| text.parse().ok().filter(|degrees: &f64| degrees.is_finite());
        let (elevation, azimuth) = place.split_once(',').unwrap_or((place, "220"));
        let wrong = || {
            format!("where the sun stands is sky:ELEVATION,AZIMUTH in degrees, as sky:30,220, not {text:?}")
        };
        (sky.elevation_degrees, sky.azimuth_degrees) =
            number(elevation).zip(number(azimuth)).ok_or_else(wrong)?;
        if sky.elevation_degrees.abs() > 90.0 {
            return Err("the sun's elevation is from -90 to 90 degrees".into());
        }
        Ok(Self::Sky(sky))
    }
}

impl EnvironmentPreset {
    /// Parses `none`, `studio`, `sky`, `sky:ELEVATION` or `sky:ELEVATION,AZIMUTH` (in degrees, with a haze of 1), or
    /// else the path of an image, which is made absolute so that it is found from any folder.
    ///
    /// Errors: an empty text; angles that are no numbers; an elevation beyond ±90°; a path without an extension and
    /// without a file, which was probably meant to be one of the names. The error is a human-readable text.
    pub fn named(text: &str) -> Result<Self, String> {
        match text.parse()? {
            Self::Picture(path) if path.as_os_str().is_empty() => {
                Err("expected none, studio, sky, sky:ELEVATION,AZIMUTH or a picture's file".into())
            }
            // Without an extension and without a file, it was probably meant to be one of the names.
            Self::Picture(path) if path.extension().is_none() && !path.exists() => {
                let hint = did_you_mean(text, ["none", "studio", "sky"]);
                Err(format!("expected none, studio, sky, sky:ELEVATION,AZIMUTH or a picture's file{hint}"))
            }
            Self::Picture(path) => Ok(Self::Picture(std::path::absolute(&path).unwrap_or(path))),
            other => Ok(other),
        }
    }
}

/// Serialisation of paths as text. Invalid Unicode is replaced, because JSON cannot represent it; the path must then be
/// given again.
pub(in crate::formats) mod as_text {
    use std::path::{Path, PathBuf};

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(path: &Path, to: S) -> Result<S::Ok, S::Error> {
        path.to_string_lossy().serialize(to)
    }

    pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<PathBuf, D::Error> {
        String::deserialize(from).map(PathBuf::from)
    }

    pub mod several {
        use super::*;

        pub fn serialize<S: Serializer>(paths: &[PathBuf], to: S) -> Result<S::Ok, S::Error> {
            to.collect_seq(paths.iter().map(|path| path.to_string_lossy()))
        }

        pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<PathBuf>, D::Error> {
            Vec::<PathBuf>::deserialize(from)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn preset_names_are_parsed() {
        let sky = |elevation_degrees, azimuth_degrees| {
            Ok(EnvironmentPreset::Sky(SkyOptions { elevation_degrees, azimuth_degrees, haze: 1.0 }))
        };
        assert_eq!("studio".parse(), Ok(EnvironmentPreset::Studio));
        assert_eq!("sky".parse(), sky(45.0, 220.0));
        assert_eq!("sky:10".parse(), sky(10.0, 220.0));
        assert_eq!("sky:-3.5,90".parse(), sky(-3.5, 90.0));
        assert_eq!("sky.exr".parse(), Ok(EnvironmentPreset::Picture("sky.exr".into())));
        assert_eq!("skyline/a.hdr".parse(), Ok(EnvironmentPreset::Picture("skyline/a.hdr".into())));
        for wrong in ["sky:", "sky:up", "sky:10,", "sky:91", "sky:nan"] {
            assert!(wrong.parse::<EnvironmentPreset>().is_err(), "{wrong}");
        }
    }
}
