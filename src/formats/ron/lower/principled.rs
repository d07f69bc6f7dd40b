//! Physically based materials.

use super::{Lowering, radians};
use crate::error::LoadError;
use crate::formats::ron::schema;
use crate::formats::ron::source::Raw;
use crate::world::{
    AlphaMode, Anisotropy, Channel, ColorInput, Iridescence, Principled, ScalarInput, Volume,
};

const ALPHA_MODES: &[&str] = &["Opaque", "Mask", "Blend"];

/// The channel that glTF has for a number, where it is not alpha.
pub(in crate::formats::ron) fn usual_channel(what: &str) -> Channel {
    match what {
        "alpha" => Channel::Alpha,
        "metallic" => Channel::Blue,
        "roughness" | "clearcoat_roughness" | "thickness" => Channel::Green,
        _ => Channel::Red,
    }
}

impl<'a> Lowering<'_, 'a> {
    pub(super) fn principled(&mut self, read: schema::Principled<'a>) -> Result<Principled, LoadError> {
        let source = self.source;
        let mut material = Principled::default();
        self.base(&read, &mut material)?;
        if let Some(raw) = read.normal {
            material.normal = Some(self.normal_map(raw)?);
        }
        if let Some(raw) = read.bump {
            material.bump = Some(self.bump_map(raw)?);
        }
        if let Some(raw) = read.emission {
            material.emission = self.color_input(raw, "an emission")?;
        }
        if let Some(raw) = read.double_sided {
            material.double_sided = source.flag(raw)?;
        }
        if let Some(raw) = read.unlit {
            material.unlit = source.flag(raw)?;
        }
        if let Some(raw) = read.caustics {
            material.caustics = source.flag(raw)?;
        }
        if let Some(raw) = read.ior {
            material.ior = source.at_least_zero(raw, "an index of refraction")?;
        }
        self.scalar(read.specular, "specular", &mut material.specular)?;
        if let Some(raw) = read.specular_color {
            material.specular_color = self.color_input(raw, "a specular colour")?;
        }
        self.scalar(read.transmission, "transmission", &mut material.transmission)?;
        if let Some(raw) = read.volume {
            material.volume = Some(self.volume(raw)?);
        }
        if let Some(raw) = read.dispersion {
            material.dispersion = source.at_least_zero(raw, "dispersion")?;
        }
        self.scalar(read.diffuse_transmission, "diffuse_transmission", &mut material.diffuse_transmission)?;
        let color = &mut material.diffuse_transmission_color;
        self.color(read.diffuse_transmission_color, "diffuse_transmission_color", color)?;
        self.scalar(read.clearcoat, "clearcoat", &mut material.clearcoat)?;
        self.scalar(read.clearcoat_roughness, "clearcoat_roughness", &mut material.clearcoat_roughness)?;
        if let Some(raw) = read.clearcoat_normal {
            material.clearcoat_normal = Some(self.normal_map(raw)?);
        }
        self.color(read.sheen_color, "sheen_color", &mut material.sheen_color)?;
        self.scalar(read.sheen_roughness, "sheen_roughness", &mut material.sheen_roughness)?;
        if let Some(raw) = read.anisotropy {
            material.anisotropy = self.anisotropy(raw)?;
        }
        if let Some(raw) = read.iridescence {
            material.iridescence = self.iridescence(raw)?;
        }
        Ok(material)
    }

    /// The metallic-roughness model itself.
    fn base(&mut self, read: &schema::Principled<'a>, material: &mut Principled) -> Result<(), LoadError> {
        self.color(read.base_color, "base_color", &mut material.base_color)?;
        self.scalar(read.alpha, "alpha", &mut material.alpha)?;
        if let Some(raw) = read.alpha_mode {
            material.alpha_mode = self.alpha_mode(raw)?;
        }
        self.scalar(read.metallic, "metallic", &mut material.metallic)?;
        self.scalar(read.roughness, "roughness", &mut material.roughness)
    }

    fn scalar(&mut self, raw: Option<Raw<'a>>, what: &str, to: &mut ScalarInput) -> Result<(), LoadError> {
        if let Some(raw) = raw {
            *to = self.scalar_input(raw, what, usual_channel(what))?;
        }
        Ok(())
    }

    fn color(&mut self, raw: Option<Raw<'a>>, what: &str, to: &mut ColorInput) -> Result<(), LoadError> {
        if let Some(raw) = raw {
            *to = self.reflectance(raw, what)?;
        }
        Ok(())
    }

    fn alpha_mode(&self, raw: Raw<'a>) -> Result<AlphaMode, LoadError> {
        let source = self.source;
        let Some(variant) = source.variant(raw) else {
            return Err(source.expected(raw, &format!("an alpha mode: {}", ALPHA_MODES.join(", "))));
        };
        let mode = match variant.name {
            "Opaque" => AlphaMode::Opaque,
            "Blend" => AlphaMode::Blend,
            "Mask" => {
                let read: schema::Mask = source.variant_fields(variant)?;
                let cutoff = read.cutoff.map_or(Ok(0.5), |raw| source.at_least_zero(raw, "cutoff"))?;
                return Ok(AlphaMode::Mask { cutoff });
            }
            other => return Err(source.unknown(other, "alpha mode", ALPHA_MODES)),
        };
        source.no_fields(variant)?;
        Ok(mode)
    }

    fn volume(&self, raw: Raw<'a>) -> Result<Volume, LoadError> {
        let source = self.source;
        let read: schema::Volume = source.fields(raw, "a volume")?;
        let mut volume = Volume::CLEAR;
        let colors = [
            (read.attenuation_color, "attenuation_color", &mut volume.attenuation_color),
            (read.multiscatter_color, "multiscatter_color", &mut volume.multiscatter_color),
        ];
        for (raw, name, to) in colors {
            let Some(raw) = raw else { continue };
            *to = source.color(raw, name)?;
            if to.max_component() > 1.0 {
                return Err(source.out_of_range(raw, name, "from 0 to 1"));
            }
        }
        if let Some(raw) = read.attenuation_distance_m {
            volume.attenuation_distance = source.positive(raw, "attenuation_distance_m")?;
        }
        if let Some(raw) = read.scatter_anisotropy {
            volume.scatter_anisotropy = source.number(raw)?;
            if volume.scatter_anisotropy.abs() > Volume::MOST {
                return Err(source.out_of_range(raw, "scatter_anisotropy", "from -0.99 to 0.99"));
            }
        }
        if let Some(raw) = read.thickness_m {
            volume.thickness = source.at_least_zero(raw, "thickness_m")?;
        }
        if let Some(raw) = read.priority {
            volume.priority = source.priority(raw)?;
        }
        Ok(volume)
    }

    fn anisotropy(&mut self, raw: Raw<'a>) -> Result<Anisotropy, LoadError> {
        let source = self.source;
        let read: schema::Anisotropy = source.fields(raw, "an anisotropy")?;
        Ok(Anisotropy {
            strength: read.strength.map_or(Ok(0.0), |raw| source.part(raw, "strength"))?,
            rotation: read.rotation_degrees.map_or(Ok(0.0), |raw| source.number(raw).map(radians))?,
            texture: read.texture.map(|raw| self.data_input(raw)).transpose()?,
        })
    }

    fn iridescence(&mut self, raw: Raw<'a>) -> Result<Iridescence, LoadError> {
        let source = self.source;
        let read: schema::Iridescence = source.fields(raw, "an iridescence")?;
        let mut iridescence = Iridescence::default();
        self.scalar(read.factor, "factor", &mut iridescence.factor)?;
        if let Some(raw) = read.ior {
            iridescence.ior = source.number(raw)?;
            if iridescence.ior < 1.0 {
                return Err(source.out_of_range(raw, "a film's index of refraction", "at least 1"));
            }
        }
        if let Some(raw) = read.thickness_minimum_nm {
            iridescence.thickness_minimum = source.at_least_zero(raw, "thickness_minimum_nm")?;
        }
        if let Some(raw) = read.thickness_maximum_nm {
            iridescence.thickness_maximum = source.at_least_zero(raw, "thickness_maximum_nm")?;
        }
        if let Some(raw) = read.thickness {
            iridescence.thickness = Some(self.channel_input(raw, usual_channel("thickness"))?);
        }
        Ok(iridescence)
    }
}
