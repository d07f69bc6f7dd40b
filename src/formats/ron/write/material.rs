//! Materials.

use super::Written;
use super::assets::AssetPaths;
use super::number::{Keys, color, degrees, number, same};
use super::texture::WrittenTextures;
use crate::formats::ron::lower::glass;
use crate::math::Rgb;
use crate::world::{
    AlphaMode, Anisotropy, Assets, BlinnPhong, BumpMap, ColorInput, Highlight, Iridescence, Material,
    NormalMap, Principled, ScalarInput, Volume,
};

pub(super) fn material(material: &Material, assets: &Assets, paths: &AssetPaths) -> Written {
    let writer = MaterialWriter { keys: Keys::default(), textures: WrittenTextures { assets, paths } };
    match material {
        Material::BlinnPhong(material) => writer.blinn_phong(material),
        Material::Principled(material) => writer.principled(material),
    }
}

/// Writes the keys of a material that are not at their defaults.
struct MaterialWriter<'a> {
    keys: Keys,
    textures: WrittenTextures<'a>,
}

impl MaterialWriter<'_> {
    fn blinn_phong(mut self, material: &BlinnPhong) -> Written {
        let BlinnPhong { diffuse, specular, shininess, highlight, kr, kt, ior, priority, emission, caustics } =
            material;
        let default = if ior.is_some() { glass() } else { BlinnPhong::default() };
        self.color("diffuse", diffuse, &default.diffuse)?;
        self.color("specular", specular, &default.specular)?;
        self.number("shininess", *shininess, default.shininess)?;
        let is_default = *highlight == Highlight::default();
        self.keys.push_unless(is_default, "highlight", || Ok(format!("{highlight:?}")))?;
        self.color("kr", kr, &default.kr)?;
        self.keys.push_unless(same(&kt.to_array(), &default.kt.to_array()), "kt", || color(*kt))?;
        if let Some(ior) = ior {
            self.keys.push("ior", number(*ior)?);
        }
        self.keys.push_unless(*priority == 0, "priority", || Ok(priority.to_string()))?;
        self.color("emission", emission, &default.emission)?;
        self.no_caustics(*caustics)?;
        Ok(self.keys.finish("BlinnPhong"))
    }

    fn principled(mut self, material: &Principled) -> Written {
        let default = Principled::default();
        self.color("base_color", &material.base_color, &default.base_color)?;
        self.scalar("alpha", &material.alpha, &default.alpha)?;
        match material.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                self.keys.push("alpha_mode", format!("Mask(cutoff: {})", number(cutoff)?));
            }
            AlphaMode::Blend => self.keys.push("alpha_mode", "Blend"),
        }
        self.scalar("metallic", &material.metallic, &default.metallic)?;
        self.scalar("roughness", &material.roughness, &default.roughness)?;
        self.normal("normal", &material.normal)?;
        self.bump(&material.bump)?;
        self.color("emission", &material.emission, &default.emission)?;
        self.flag("double_sided", material.double_sided);
        self.flag("unlit", material.unlit);
        self.number("ior", material.ior, default.ior)?;
        self.scalar("specular", &material.specular, &default.specular)?;
        self.color("specular_color", &material.specular_color, &default.specular_color)?;
        self.scalar("transmission", &material.transmission, &default.transmission)?;
        self.volume(&material.volume)?;
        self.number("dispersion", material.dispersion, default.dispersion)?;
        self.scalar("diffuse_transmission", &material.diffuse_transmission, &default.diffuse_transmission)?;
        let color = &material.diffuse_transmission_color;
        self.color("diffuse_transmission_color", color, &default.diffuse_transmission_color)?;
        self.scalar("clearcoat", &material.clearcoat, &default.clearcoat)?;
        self.scalar("clearcoat_roughness", &material.clearcoat_roughness, &default.clearcoat_roughness)?;
        self.normal("clearcoat_normal", &material.clearcoat_normal)?;
        self.color("sheen_color", &material.sheen_color, &default.sheen_color)?;
        self.scalar("sheen_roughness", &material.sheen_roughness, &default.sheen_roughness)?;
        self.anisotropy(&material.anisotropy)?;
        self.iridescence(&material.iridescence)?;
        self.no_caustics(material.caustics)?;
        Ok(self.keys.finish("Principled"))
    }

    fn color(&mut self, key: &str, input: &ColorInput, default: &ColorInput) -> Written<()> {
        let is_default = match (input, default) {
            (ColorInput::Constant(a), ColorInput::Constant(b)) => same(&a.to_array(), &b.to_array()),
            _ => false,
        };
        self.keys.push_unless(is_default, key, || self.textures.color(input))
    }

    fn scalar(&mut self, key: &str, input: &ScalarInput, default: &ScalarInput) -> Written<()> {
        let is_default = input.texture.is_none() && same(&[input.factor], &[default.factor]);
        self.keys.push_unless(is_default, key, || self.textures.scalar(input, key))
    }

    fn number(&mut self, key: &str, value: f32, default: f32) -> Written<()> {
        self.keys.push_unless(same(&[value], &[default]), key, || number(value))
    }

    fn flag(&mut self, key: &str, value: bool) {
        if value {
            self.keys.push(key, "true");
        }
    }

    fn no_caustics(&mut self, caustics: bool) -> Written<()> {
        self.keys.push_unless(caustics, "caustics", || Ok("false".to_owned()))
    }

    fn normal(&mut self, key: &str, map: &Option<NormalMap>) -> Written<()> {
        let Some(NormalMap { texture, scale }) = map else { return Ok(()) };
        let texture = self.textures.data(*texture)?;
        let written = if same(&[*scale], &[1.0]) {
            texture
        } else {
            format!("(texture: {texture}, scale: {})", number(*scale)?)
        };
        self.keys.push(key, written);
        Ok(())
    }

    fn bump(&mut self, map: &Option<BumpMap>) -> Written<()> {
        let Some(BumpMap { texture, channel, height_m }) = map else { return Ok(()) };
        let input = ScalarInput { factor: 1.0, texture: Some((*texture, *channel)) };
        let (texture, height) = (self.textures.scalar(&input, "bump")?, number(*height_m)?);
        self.keys.push("bump", format!("(texture: {texture}, height_m: {height})"));
        Ok(())
    }

    fn volume(&mut self, volume: &Option<Volume>) -> Written<()> {
        let Some(volume) = volume else { return Ok(()) };
        let Volume {
            attenuation_color,
            attenuation_distance,
            multiscatter_color,
            scatter_anisotropy,
            thickness,
            priority,
        } = volume;
        let mut keys = Keys::default();
        let is_default = same(&attenuation_color.to_array(), &Rgb::WHITE.to_array());
        keys.push_unless(is_default, "attenuation_color", || color(*attenuation_color))?;
        let is_default = *attenuation_distance == f32::INFINITY;
        keys.push_unless(is_default, "attenuation_distance_m", || number(*attenuation_distance))?;
        let is_default = multiscatter_color.is_black();
        keys.push_unless(is_default, "multiscatter_color", || color(*multiscatter_color))?;
        let is_default = *scatter_anisotropy == 0.0;
        keys.push_unless(is_default, "scatter_anisotropy", || number(*scatter_anisotropy))?;
        keys.push_unless(*thickness == 0.0, "thickness_m", || number(*thickness))?;
        keys.push_unless(*priority == 0, "priority", || Ok(priority.to_string()))?;
        self.keys.push("volume", keys.finish(""));
        Ok(())
    }

    fn anisotropy(&mut self, anisotropy: &Anisotropy) -> Written<()> {
        let Anisotropy { strength, rotation, texture } = anisotropy;
        let mut keys = Keys::default();
        keys.push_unless(same(&[*strength], &[0.0]), "strength", || number(*strength))?;
        keys.push_unless(same(&[*rotation], &[0.0]), "rotation_degrees", || degrees(*rotation))?;
        if let Some(texture) = texture {
            keys.push("texture", self.textures.data(*texture)?);
        }
        self.structure("anisotropy", keys);
        Ok(())
    }

    fn iridescence(&mut self, iridescence: &Iridescence) -> Written<()> {
        let Iridescence { factor, ior, thickness_minimum, thickness_maximum, thickness } = iridescence;
        let default = Iridescence::default();
        let mut inner = MaterialWriter { keys: Keys::default(), textures: self.textures };
        inner.scalar("factor", factor, &default.factor)?;
        inner.number("ior", *ior, default.ior)?;
        inner.number("thickness_minimum_nm", *thickness_minimum, default.thickness_minimum)?;
        inner.number("thickness_maximum_nm", *thickness_maximum, default.thickness_maximum)?;
        if let Some((texture, channel)) = thickness {
            inner.keys.push("thickness", self.textures.channel(*texture, *channel, "thickness")?);
        }
        self.structure("iridescence", inner.keys);
        Ok(())
    }

    /// A structure, unless all of it is at its defaults.
    fn structure(&mut self, key: &str, keys: Keys) {
        let written = keys.finish("");
        if written != "()" {
            self.keys.push(key, written);
        }
    }
}
