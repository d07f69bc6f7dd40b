//! Surroundings that replace a scene's own: an image, a sky, a studio.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::names::TakenNames;
use super::{AssetFiles, Files, studio};
use crate::error::{LoadError, did_you_mean};
use crate::math::Rgb;
use crate::world::{Light, SourceFiles, Transform, World};

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
    Picture(#[serde(with = "super::film_file::as_text")] PathBuf),
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
        Light::Sky { elevation, azimuth, haze: self.haze, radiance }
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

/// Replaces the environments and skies of a scene.
pub(super) fn surround(world: &mut World, surroundings: &EnvironmentPreset) -> Result<(), LoadError> {
    let old: Vec<_> = world.surroundings().collect();
    for entity in old {
        // It is known to exist.
        let _ = world.entities.remove_one::<Light>(entity);
    }
    let around = |image| Light::Environment { radiance: Rgb::WHITE, image: Some(image) };
    let (name, light) = match surroundings {
        EnvironmentPreset::None => return Ok(()),
        EnvironmentPreset::Studio => ("studio", around(world.assets.add_made_image(studio::image()))),
        EnvironmentPreset::Sky(sky) => ("sky", sky.light(Rgb::WHITE)),
        EnvironmentPreset::Picture(path) => ("environment", around(read(world, path)?)),
    };
    let name = TakenNames::of(world).unique(name);
    world.entities.spawn((name, light, Transform::IDENTITY));
    Ok(())
}

fn read(world: &mut World, path: &Path) -> Result<crate::world::ImageId, LoadError> {
    let mut files = Files { sources: SourceFiles::clone(&world.assets.files), ..Files::default() };
    files.sources.allow(path);
    let image = files.image(path)?;
    world.assets.files.extend(&files.sources);
    Ok(world.assets.add_image(image))
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
