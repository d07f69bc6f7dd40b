//! The layers that extensions add to a material. Each is read on its own; the renderer combines them.

use super::Import;
use super::extensions::material as read;
use super::material::{Extensions, unit};
use crate::error::LoadError;
use crate::math::Rgb;
use crate::world::assets::ColorSpace;
use crate::world::{Anisotropy, Channel, Iridescence, Principled, Volume};

impl Import<'_> {
    /// Reads all extensions except `unlit` and those that replace core properties.
    pub(super) fn layers(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        if extensions.is_none() {
            return Ok(());
        }
        self.specular(extensions, material, at)?;
        self.transmission(extensions, material, at)?;
        self.clearcoat(extensions, material, at)?;
        self.sheen(extensions, material, at)?;
        self.anisotropy(extensions, material, at)?;
        self.iridescence(extensions, material, at)
    }

    fn specular(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let document = self.document;
        let ior: Option<read::Ior> = document.extension(extensions, "KHR_materials_ior", at);
        if let Some(read::Ior { ior }) = ior {
            // 0 is a special value, and indices between 0 and 1 are invalid.
            material.ior = if ior <= 0.0 { 0.0 } else { ior.max(1.0) };
        }
        let name = "KHR_materials_specular";
        let Some(read) = document.extension::<read::Specular>(extensions, name, at) else { return Ok(()) };
        let at = |slot: &str| format!("{at}/extensions/{name}/{slot}");
        let (factor, slot) = (unit(read.specular_factor), read.specular_texture.as_ref());
        material.specular = self.scalar(factor, slot, Channel::Alpha, &at("specularTexture"))?;
        let factor = Rgb::from(read.specular_color_factor).map(|c| c.max(0.0));
        let slot = read.specular_color_texture.as_ref();
        material.specular_color = self.color(factor, slot, &at("specularColorTexture"))?;
        Ok(())
    }

    fn transmission(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let document = self.document;
        let within = |name: &str, slot: &str| format!("{at}/extensions/{name}/{slot}");
        let name = "KHR_materials_transmission";
        if let Some(read) = document.extension::<read::Transmission>(extensions, name, at) {
            let (factor, slot) = (unit(read.transmission_factor), read.transmission_texture.as_ref());
            let at = within(name, "transmissionTexture");
            material.transmission = self.scalar(factor, slot, Channel::Red, &at)?;
        }
        let name = "KHR_materials_diffuse_transmission";
        if let Some(read) = document.extension::<read::DiffuseTransmission>(extensions, name, at) {
            let factor = unit(read.diffuse_transmission_factor);
            let slot = read.diffuse_transmission_texture.as_ref();
            let at = within(name, "diffuseTransmissionTexture");
            material.diffuse_transmission = self.scalar(factor, slot, Channel::Alpha, &at)?;
            let factor = Rgb::from(read.diffuse_transmission_color_factor).map(unit);
            let slot = read.diffuse_transmission_color_texture.as_ref();
            let at = within(name, "diffuseTransmissionColorTexture");
            material.diffuse_transmission_color = self.color(factor, slot, &at)?;
        }
        let volume: Option<read::GltfVolume> = document.extension(extensions, "KHR_materials_volume", at);
        material.volume = volume.filter(|volume| volume.thickness_factor > 0.0).map(|volume| Volume {
            attenuation_color: Rgb::from(volume.attenuation_color).map(unit),
            // Some files write 0 for "none", which the specification does not allow.
            attenuation_distance: match volume.attenuation_distance {
                distance if distance > 0.0 => distance,
                _ => f32::INFINITY,
            },
            thickness: volume.thickness_factor,
            ..Volume::default()
        });
        let scatter: Option<read::VolumeScatter> =
            document.extension(extensions, "KHR_materials_volume_scatter", at);
        if let (Some(volume), Some(read)) = (&mut material.volume, scatter) {
            volume.multiscatter_color = Rgb::from(read.multiscatter_color).map(unit);
            volume.scatter_anisotropy = read.scatter_anisotropy.clamp(-Volume::MOST, Volume::MOST);
        }
        if self.solid_glass && material.volume.is_none() && material.transmission.factor > 0.0 {
            material.volume = Some(Volume::default());
        }
        let dispersion: Option<read::Dispersion> =
            document.extension(extensions, "KHR_materials_dispersion", at);
        material.dispersion = dispersion.map_or(0.0, |read| read.dispersion.max(0.0));
        Ok(())
    }

    fn clearcoat(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let name = "KHR_materials_clearcoat";
        let Some(read) = self.document.extension::<read::Clearcoat>(extensions, name, at) else {
            return Ok(());
        };
        let at = |slot: &str| format!("{at}/extensions/{name}/{slot}");
        let (factor, slot) = (unit(read.clearcoat_factor), read.clearcoat_texture.as_ref());
        material.clearcoat = self.scalar(factor, slot, Channel::Red, &at("clearcoatTexture"))?;
        let factor = unit(read.clearcoat_roughness_factor);
        let slot = read.clearcoat_roughness_texture.as_ref();
        let place = at("clearcoatRoughnessTexture");
        material.clearcoat_roughness = self.scalar(factor, slot, Channel::Green, &place)?;
        let slot = read.clearcoat_normal_texture.as_ref();
        material.clearcoat_normal = self.normal_map(slot, &at("clearcoatNormalTexture"))?;
        Ok(())
    }

    fn sheen(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let name = "KHR_materials_sheen";
        let Some(read) = self.document.extension::<read::GltfSheen>(extensions, name, at) else {
            return Ok(());
        };
        let at = |slot: &str| format!("{at}/extensions/{name}/{slot}");
        let factor = Rgb::from(read.sheen_color_factor).map(unit);
        let slot = read.sheen_color_texture.as_ref();
        material.sheen_color = self.color(factor, slot, &at("sheenColorTexture"))?;
        let (factor, slot) = (unit(read.sheen_roughness_factor), read.sheen_roughness_texture.as_ref());
        material.sheen_roughness = self.scalar(factor, slot, Channel::Alpha, &at("sheenRoughnessTexture"))?;
        Ok(())
    }

    fn anisotropy(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let name = "KHR_materials_anisotropy";
        let Some(read) = self.document.extension::<read::GltfAnisotropy>(extensions, name, at) else {
            return Ok(());
        };
        let at = format!("{at}/extensions/{name}/anisotropyTexture");
        let texture = self.lookup(read.anisotropy_texture.as_ref(), ColorSpace::Linear, &at)?;
        material.anisotropy = Anisotropy {
            strength: unit(read.anisotropy_strength),
            rotation: read.anisotropy_rotation,
            texture: texture.map(|texture| self.texture_id(texture)),
        };
        Ok(())
    }

    fn iridescence(
        &mut self,
        extensions: Extensions,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let name = "KHR_materials_iridescence";
        let Some(read) = self.document.extension::<read::GltfIridescence>(extensions, name, at) else {
            return Ok(());
        };
        let at = |slot: &str| format!("{at}/extensions/{name}/{slot}");
        let (factor, slot) = (unit(read.iridescence_factor), read.iridescence_texture.as_ref());
        let factor = self.scalar(factor, slot, Channel::Red, &at("iridescenceTexture"))?;
        let slot = read.iridescence_thickness_texture.as_ref();
        let thickness = self.scalar(1.0, slot, Channel::Green, &at("iridescenceThicknessTexture"))?;
        material.iridescence = Iridescence {
            factor,
            ior: read.iridescence_ior.max(1.0),
            thickness_minimum: read.iridescence_thickness_minimum.max(0.0),
            thickness_maximum: read.iridescence_thickness_maximum.max(0.0),
            thickness: thickness.texture,
        };
        Ok(())
    }
}
