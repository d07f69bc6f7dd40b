//! `light` and `camera`.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::environment_preset::SkyOptions;
use crate::formats::ron::schema;
use crate::formats::ron::source::{Raw, SceneText, VariantText};
use crate::math::{Rgb, Vec2};
use crate::world::assets::{ColorSpace, Wrap};
use crate::world::fields::Forms;
use crate::world::{Camera, Falloff, Light, Outline, Pattern, Settings, Texture};

const LIGHTS: &[&str] = &["Point", "Spot", "Photometric", "Directional", "Environment", "Sky", "Area"];
const OUTLINES: &[(&str, Outline)] = &[("Rectangle", Outline::Rectangle), ("Disc", Outline::Disc)];
const CAMERAS: &[&str] = &["Pinhole", "ThinLens", "Orthographic"];
const FALLOFFS: &[(&str, Falloff)] =
    &[("InverseSquare", Falloff::InverseSquare), ("Constant", Falloff::Constant)];

/// In degrees.
const DEFAULT_FOV: f64 = 45.0;
const DEFAULT_INNER: f64 = 30.0;
const DEFAULT_OUTER: f64 = 45.0;
const DEFAULT_HEIGHT_M: f32 = 2.0;

/// An angle as the world stores it. Degrees are read as f64 so that every f32 of radians can be written in degrees.
pub(in crate::formats::ron) fn radians(degrees: f64) -> f32 {
    (degrees * (std::f64::consts::PI / 180.0)) as f32
}

impl<'a> Lowering<'_, 'a> {
    pub(super) fn light(&mut self, raw: Raw<'a>) -> Result<Light, LoadError> {
        let source = self.source;
        let Some(variant) = source.variant(raw) else {
            return Err(source.expected(raw, &format!("a light: {}", LIGHTS.join(", "))));
        };
        match variant.name {
            "Point" => {
                let read: schema::Point = source.variant_fields(variant)?;
                Ok(Light::Point {
                    power_w: source.color(read.power_w, "a power")?,
                    falloff: falloff(source, read.falloff)?,
                })
            }
            "Spot" => spot(source, variant),
            "Photometric" => {
                let read: schema::Photometric = source.variant_fields(variant)?;
                let image = self.assets.image(source, read.profile, &mut self.world)?;
                let wrap = [Wrap::Repeat, Wrap::Clamp];
                let texture = Texture { wrap, color_space: ColorSpace::Linear, ..Texture::new(image) };
                let profile = self.assets.texture(texture, &mut self.world);
                Ok(Light::Photometric { power_w: source.color(read.power_w, "a power")?, profile })
            }
            "Directional" => directional(source, variant),
            "Environment" => {
                let read: schema::Environment = source.variant_fields(variant)?;
                let radiance = read.radiance.map_or(Ok(Rgb::WHITE), |raw| source.color(raw, "a radiance"))?;
                let image = read.image.map(|raw| self.assets.image(source, raw, &mut self.world));
                Ok(Light::Environment { radiance, image: image.transpose()? })
            }
            "Sky" => sky(source, variant),
            "Area" => area(source, variant),
            other => Err(source.unknown(other, "light", LIGHTS)),
        }
    }

    pub(super) fn camera(&mut self, raw: Raw<'a>) -> Result<Camera, LoadError> {
        let source = self.source;
        let Some(variant) = source.variant(raw) else {
            return Err(source.expected(raw, &format!("a camera: {}", CAMERAS.join(", "))));
        };
        match variant.name {
            "Pinhole" => {
                let read: schema::Pinhole = source.variant_fields(variant)?;
                Ok(Camera::Pinhole { vertical_fov: field_of_view(source, read.vertical_fov_degrees)? })
            }
            "ThinLens" => {
                let read: schema::ThinLens = source.variant_fields(variant)?;
                Ok(Camera::ThinLens {
                    vertical_fov: field_of_view(source, read.vertical_fov_degrees)?,
                    lens_radius_m: source.at_least_zero(read.lens_radius_m, "a lens's radius")?,
                    focus_distance_m: source.positive(read.focus_distance_m, "a focus distance")?,
                    aperture: read
                        .aperture
                        .map(|raw| self.assets.image(source, raw, &mut self.world))
                        .transpose()?,
                    pattern: pattern(source, read.pattern)?,
                })
            }
            "Orthographic" => {
                let read: schema::Orthographic = source.variant_fields(variant)?;
                let height = read.height_m.map(|raw| source.positive(raw, "the image's height"));
                Ok(Camera::Orthographic { height_m: height.unwrap_or(Ok(DEFAULT_HEIGHT_M))? })
            }
            other => Err(source.unknown(other, "camera", CAMERAS)),
        }
    }
}

fn directional<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Light, LoadError> {
    let read: schema::Directional = source.variant_fields(variant)?;
    let irradiance = source.color(read.irradiance, "an irradiance")?;
    let Some(raw) = read.angle_degrees else { return Ok(Light::Directional { irradiance, angle: 0.0 }) };
    let degrees = source.number::<f64>(raw)?;
    if !(0.0..=180.0).contains(&degrees) {
        return Err(source.out_of_range(raw, "the angle of a source", "from 0 to 180 degrees"));
    }
    Ok(Light::Directional { irradiance, angle: radians(degrees) })
}

fn spot<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Light, LoadError> {
    let read: schema::Spot = source.variant_fields(variant)?;
    let power_w = source.color(read.power_w, "a power")?;
    let degrees = |raw: Option<Raw<'a>>, default: f64| -> Result<f64, LoadError> {
        let Some(raw) = raw else { return Ok(default) };
        let degrees = source.number::<f64>(raw)?;
        if (0.0..=90.0).contains(&degrees) {
            Ok(degrees)
        } else {
            Err(source.out_of_range(raw, "half of a cone's angle", "from 0 to 90 degrees"))
        }
    };
    let inner = degrees(read.inner_degrees, DEFAULT_INNER)?;
    let outer = degrees(read.outer_degrees, DEFAULT_OUTER)?;
    if outer < inner {
        let place = read.outer_degrees.or(read.inner_degrees).map_or(variant.name, |raw| raw.0);
        let reason = format!("outer_degrees ({outer}) must be at least inner_degrees ({inner})");
        return Err(source.error(place, reason));
    }
    let falloff = falloff(source, read.falloff)?;
    Ok(Light::Spot { power_w, inner_angle: radians(inner), outer_angle: radians(outer), falloff })
}

fn sky<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Light, LoadError> {
    let read: schema::Sky = source.variant_fields(variant)?;
    let SkyOptions { elevation_degrees, azimuth_degrees, haze } = SkyOptions::default();
    let elevation = read.elevation_degrees.map_or(Ok(elevation_degrees), |raw| {
        let degrees = source.number::<f64>(raw)?;
        if (-90.0..=90.0).contains(&degrees) {
            Ok(degrees)
        } else {
            Err(source.out_of_range(raw, "the sun's elevation", "from -90 to 90 degrees"))
        }
    })?;
    let azimuth = read.azimuth_degrees.map_or(Ok(azimuth_degrees), |raw| source.number::<f64>(raw))?;
    let radiance = read.radiance.map_or(Ok(Rgb::WHITE), |raw| source.color(raw, "a radiance"))?;
    let haze = read.haze.map_or(Ok(haze), |raw| {
        let haze = source.at_least_zero(raw, "haze")?;
        if haze <= SkyOptions::MOST_HAZE {
            Ok(haze)
        } else {
            Err(source.out_of_range(raw, "haze", "from 0 to 100"))
        }
    })?;
    Ok(SkyOptions { elevation_degrees: elevation, azimuth_degrees: azimuth, haze }.light(radiance))
}

fn area<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Light, LoadError> {
    let read: schema::Area = source.variant_fields(variant)?;
    let side = |raw| source.positive(raw, "a side of an area light");
    let size_m = source.keyed(read.size_m, |raw| {
        if !raw.0.starts_with('(') {
            return side(raw).map(Vec2::splat);
        }
        let [width, height] = source.tuple(raw, "(width, height)")?;
        Ok(Vec2::new(side(width)?, side(height)?))
    })?;
    let samples =
        read.samples.map_or(Ok(1), |raw| source.whole(raw, "samples", 1, Settings::MOST_SAMPLES.into()))?;
    Ok(Light::Area {
        power_w: source.color(read.power_w, "a power")?,
        size_m,
        outline: read
            .outline
            .map_or(Ok(Outline::default()), |raw| source.choice(raw, "outline", OUTLINES))?,
        samples: samples as u32,
        pattern: pattern(source, read.pattern)?,
        visible: read.visible.map_or(Ok(false), |raw| source.flag(raw))?,
    })
}

fn falloff<'a>(source: &SceneText<'a>, raw: Option<Raw<'a>>) -> Result<Falloff, LoadError> {
    raw.map_or(Ok(Falloff::default()), |raw| source.choice(raw, "falloff", FALLOFFS))
}

fn pattern<'a>(source: &SceneText<'a>, raw: Option<Raw<'a>>) -> Result<Pattern, LoadError> {
    const PATTERNS: [Pattern; 4] = [Pattern::Uniform, Pattern::Jittered, Pattern::Regular, Pattern::Center];
    let known: Vec<(&str, Pattern)> = Pattern::default().names().iter().copied().zip(PATTERNS).collect();
    raw.map_or(Ok(Pattern::default()), |raw| source.choice(raw, "pattern", &known))
}

fn field_of_view<'a>(source: &SceneText<'a>, raw: Option<Raw<'a>>) -> Result<f32, LoadError> {
    let Some(raw) = raw else { return Ok(radians(DEFAULT_FOV)) };
    let angle = radians(source.number(raw)?);
    if angle > 0.0 && angle < std::f32::consts::PI {
        Ok(angle)
    } else {
        Err(source.out_of_range(raw, "an angle of view", "above 0 and below 180 degrees"))
    }
}
