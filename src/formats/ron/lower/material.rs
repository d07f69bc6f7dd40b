//! `materials`, and materials within entities.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::schema;
use crate::formats::ron::source::{Raw, VariantText, shorten, suggest};
use crate::math::Rgb;
use crate::world::{BlinnPhong, ColorInput, Highlight, Material, MaterialId};

const MODELS: &[&str] = &["BlinnPhong", "Principled"];
const HIGHLIGHTS: &[(&str, Highlight)] = &[("Blinn", Highlight::Blinn), ("Phong", Highlight::Phong)];

impl<'a> Lowering<'_, 'a> {
    /// The scene's map of materials by name.
    pub(super) fn named_materials(&mut self, raw: Raw<'a>) -> Result<(), LoadError> {
        for (key, value) in self.source.map(raw, "the materials")? {
            let name = self.source.string(key, "the name of a material")?;
            if self.materials.contains_key(&name) {
                let reason = format!("there is already a material \"{}\"", shorten(&name));
                return Err(self.source.error(key.0, reason));
            }
            let material = self.material(value)?;
            let id = self.world.assets.add_material(Some(name.clone()), material);
            self.materials.insert(name, id);
        }
        Ok(())
    }

    /// An entity's material: a name or the thing itself.
    pub(super) fn material_of_entity(&mut self, raw: Raw<'a>) -> Result<MaterialId, LoadError> {
        let named = raw.0.starts_with('"') || raw.0.starts_with("r\"") || raw.0.starts_with("r#");
        if !named {
            let material = self.material(raw)?;
            // The default one is already there.
            return Ok(if material == Material::default() {
                MaterialId::DEFAULT
            } else {
                self.world.assets.add_material(None, material)
            });
        }
        let name = self.source.string(raw, "the name of a material")?;
        self.materials.get(&name).copied().ok_or_else(|| {
            let suggestion = suggest(&name, self.materials.keys().map(String::as_str));
            self.source.error(raw.0, format!("unknown material \"{}\"{suggestion}", shorten(&name)))
        })
    }

    pub(super) fn material(&mut self, raw: Raw<'a>) -> Result<Material, LoadError> {
        let read: schema::BlinnPhong = match self.source.variant(raw) {
            Some(variant) if variant.name == "BlinnPhong" => self.source.variant_fields(variant)?,
            Some(variant) if variant.name == "Principled" => {
                let read = self.source.variant_fields(variant)?;
                return Ok(Material::Principled(Box::new(self.principled(read)?)));
            }
            Some(VariantText { name, body: Some(_) }) => {
                return Err(self.source.unknown(name, "material model", MODELS));
            }
            None if raw.0.starts_with('(') => self.source.fields(raw, "BlinnPhong")?,
            _ => {
                let expected = "a material, as \"name\", BlinnPhong(…), Principled(…) or (diffuse: …)";
                return Err(self.source.expected(raw, expected));
            }
        };
        self.blinn_phong(read).map(Material::BlinnPhong)
    }

    fn blinn_phong(&mut self, read: schema::BlinnPhong<'a>) -> Result<BlinnPhong, LoadError> {
        let source = self.source;
        let ior = read.ior.map(|raw| source.positive(raw, "an index of refraction")).transpose()?;
        let mut material = if ior.is_some() { glass() } else { BlinnPhong::default() };
        material.ior = ior;
        if let Some(raw) = read.priority {
            material.priority = source.priority(raw)?;
        }
        if let Some(raw) = read.caustics {
            material.caustics = source.flag(raw)?;
        }
        if let Some(raw) = read.diffuse {
            material.diffuse = self.color_input(raw, "a diffuse colour")?;
        }
        if let Some(raw) = read.specular {
            material.specular = self.color_input(raw, "a specular colour")?;
        }
        if let Some(raw) = read.shininess {
            material.shininess = source.at_least_zero(raw, "shininess")?;
        }
        if let Some(raw) = read.highlight {
            material.highlight = source.choice(raw, "highlight", HIGHLIGHTS)?;
        }
        if let Some(raw) = read.kr {
            material.kr = self.color_input(raw, "a reflection weight")?;
        }
        if let Some(raw) = read.kt {
            material.kt = source.color(raw, "a refraction weight")?;
        }
        if let Some(raw) = read.emission {
            material.emission = self.color_input(raw, "an emission")?;
        }
        Ok(material)
    }
}

/// What a material with an index of refraction begins with: no colour of its own, and all
/// light either reflected or refracted.
pub(in crate::formats::ron) fn glass() -> BlinnPhong {
    BlinnPhong {
        diffuse: ColorInput::Constant(Rgb::BLACK),
        kr: ColorInput::Constant(Rgb::WHITE),
        ..BlinnPhong::default()
    }
}
