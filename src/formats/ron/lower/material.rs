//! Reads `materials`, and materials within entities.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, VariantText, shorten, suggest};
use crate::world::fields::Fields;
use crate::world::{BlinnPhong, ColorInput, Material, MaterialId, Principled, ScalarInput};

const MODELS: &[&str] = &["BlinnPhong", "Principled", "Metal"];

impl<'a> Lowering<'_, 'a> {
    /// Reads the map of materials by name in the file with a number.
    pub(super) fn named_materials(&mut self, number: usize, raw: Raw<'a>) -> Result<(), LoadError> {
        for (key, value) in self.source.map(raw, "the materials")? {
            let name = self.source.string(key, "the name of a material")?;
            let name = format!("{}{name}", self.source.parts[number].prefix);
            if self.materials.contains_key(&name) {
                let remedy = self.source.keep_apart(number);
                let reason = format!("there is already a material \"{}\"{remedy}", shorten(&name));
                self.source.recover(Err::<(), _>(self.source.error(key.0, reason)))?;
                continue;
            }
            // A material with a fault is known by its name.
            let material = self.source.recover(self.material(value))?.unwrap_or_default();
            let id = self.world.assets.add_material(Some(name.clone()), material);
            self.materials.insert(name, id);
        }
        Ok(())
    }

    /// An entity's material: a name or an inline material.
    pub(super) fn material_of_entity(&mut self, raw: Raw<'a>) -> Result<MaterialId, LoadError> {
        let named = raw.0.starts_with('"') || raw.0.starts_with("r\"") || raw.0.starts_with("r#");
        if !named {
            let material = self.material(raw)?;
            // The default material already exists.
            return Ok(if material == Material::default() {
                MaterialId::DEFAULT
            } else {
                self.world.assets.add_material(None, material)
            });
        }
        let name = self.source.string(raw, "the name of a material")?;
        self.source.find_name(raw, &name, |name| self.materials.get(name).copied()).ok_or_else(|| {
            let suggestion = suggest(&name, self.materials.keys().map(String::as_str));
            let known = match self.materials.is_empty() {
                true => "; the scene names none: materials: {\"…\": Principled()} does",
                false => "",
            };
            self.source.error(raw.0, format!("unknown material \"{}\"{suggestion}{known}", shorten(&name)))
        })
    }

    pub(super) fn material(&mut self, raw: Raw<'a>) -> Result<Material, LoadError> {
        let body = match self.source.variant(raw) {
            Some(VariantText { name: "BlinnPhong", body }) => Raw(body.unwrap_or("()")),
            Some(VariantText { name: "Principled", body }) => {
                let mut material = Box::<Principled>::default();
                self.structure(Raw(body.unwrap_or("()")), &mut *material)?;
                return Ok(Material::Principled(material));
            }
            Some(VariantText { name: "Metal", body: Some(body) }) => return self.metal(body),
            Some(VariantText { name, body: Some(_) }) => {
                return Err(self.source.unknown(name, "material model", MODELS));
            }
            None if raw.0.starts_with('(') => raw,
            _ => {
                let expected = "a material, as \"name\", BlinnPhong(…), Principled(…) or (diffuse: …)";
                return Err(self.source.expected(raw, expected));
            }
        };
        let members = self.source.structure(body, "BlinnPhong")?;
        let is_given = |key: &str| {
            members.iter().any(|(given, raw)| *given == key && self.source.optional(*raw).is_some())
        };
        let mut material = BlinnPhong::with_keys(&is_given);
        self.fill(&members, ("BlinnPhong", raw.0), None, &mut |each| {
            material.visit(&mut |field| each(field))
        })?;
        Ok(Material::BlinnPhong(material))
    }

    /// `Metal("gold")`, or `Metal(name: "gold", …)` with fields of `Principled`: a polished metal.
    fn metal(&mut self, body: &'a str) -> Result<Material, LoadError> {
        let source = self.source;
        let (name, members) = match source.tuple(Raw(body), "") {
            Ok([name]) => (Some(name), Vec::new()),
            Err(_) => {
                let mut members = source.members(body, "Metal")?;
                let place = members.iter().position(|(key, _)| *key == "name");
                (place.map(|place| members.remove(place).1), members)
            }
        };
        let Some(name) = name else {
            return Err(source.error(body, "Metal needs the field \"name\", as Metal(name: \"gold\")"));
        };
        let [base_color, edge_tint] = source.metal_called(name)?;
        let mut material = Box::new(Principled {
            base_color: ColorInput::Constant(base_color),
            edge_tint,
            roughness: ScalarInput::constant(0.0),
            ..Principled::default()
        });
        self.fill(&members, ("Metal", body), None, &mut |each| material.visit(&mut |field| each(field)))?;
        Ok(Material::Principled(material))
    }
}
