//! Metallic-roughness materials. The layers of extensions are in `layers`.

use gltf::json::material::AlphaMode as Mode;
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use serde_json::{Map, Value};

use super::Import;
use super::extensions::material::{EmissiveStrength, SpecularGlossiness, Unlit};
use super::extensions::texture::TextureInfo;
use crate::error::LoadError;
use crate::math::Rgb;
use crate::world::assets::{ColorSpace, TextureSource};
use crate::world::{AlphaMode, Channel, ColorInput, Material, MaterialId, Principled, ScalarInput, Texture};

/// A material of the file, and the data that a mesh needs of it.
#[derive(Clone, Copy)]
pub(super) struct Lowered {
    pub id: MaterialId,
    /// The set of texture coordinates that tangents follow, if it needs any.
    pub tangents: Option<u32>,
}

/// The extensions of a JSON object.
pub(super) type Extensions<'d> = Option<&'d Map<String, Value>>;

impl Import<'_> {
    /// Returns the material of a primitive; each is read once.
    pub(super) fn material(
        &mut self,
        index: Option<Index<json::Material>>,
        place: &str,
    ) -> Result<Lowered, LoadError> {
        let document = self.document;
        let materials = &document.root.materials;
        let index = index.filter(|index| {
            document.find(materials, *index, place, "material", "the default counts").is_some()
        });
        let key = index.map(|index| index.value());
        if let Some(known) = self.materials.get(&key) {
            return Ok(*known);
        }
        let default = json::Material::default();
        let source = key.and_then(|number| materials.get(number)).unwrap_or(&default);
        let at = key.map_or_else(String::new, |number| format!("/materials/{number}"));
        let material = self.principled(source, &at)?;
        let tangents = self.tangent_set(&material);
        let material = Material::Principled(Box::new(material));
        let lowered = Lowered { id: self.assets.add_material(source.name.clone(), material), tangents };
        self.materials.insert(key, lowered);
        Ok(lowered)
    }

    fn principled(&mut self, source: &json::Material, at: &str) -> Result<Principled, LoadError> {
        let document = self.document;
        let extensions = source.extensions.as_ref().map(|extensions| &extensions.others);
        let alpha_mode = match source.alpha_mode {
            Checked::Valid(Mode::Opaque) => AlphaMode::Opaque,
            Checked::Valid(Mode::Mask) => {
                AlphaMode::Mask { cutoff: source.alpha_cutoff.unwrap_or_default().0.clamp(0.0, f32::MAX) }
            }
            Checked::Valid(Mode::Blend) => AlphaMode::Blend,
            Checked::Invalid => {
                let what = "alphaMode must be \"OPAQUE\", \"MASK\" or \"BLEND\": OPAQUE is taken";
                document.mend(format_args!("{at}/alphaMode"), what);
                AlphaMode::Opaque
            }
        };
        let double_sided = source.double_sided || self.double_sided;
        let mut material = Principled { alpha_mode, double_sided, ..Principled::default() };
        let older: Option<SpecularGlossiness> =
            document.extension(extensions, "KHR_materials_pbrSpecularGlossiness", at);
        match older {
            Some(older) => self.specular_glossiness(&older, &mut material, at)?,
            None => self.metallic_roughness(source, &mut material, at)?,
        }
        let normal = source.normal_texture.as_ref().map(TextureInfo::from);
        material.normal = self.normal_map(normal.as_ref(), &format!("{at}/normalTexture"))?;
        material.emission = self.emission(source, extensions, at)?;
        let unlit: Option<Unlit> = document.extension(extensions, "KHR_materials_unlit", at);
        material.unlit = unlit.is_some();
        self.layers(extensions, &mut material, at)?;
        Ok(material)
    }

    fn metallic_roughness(
        &mut self,
        source: &json::Material,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let pbr = &source.pbr_metallic_roughness;
        let at = |slot: &str| format!("{at}/pbrMetallicRoughness/{slot}");
        let slot = pbr.base_color_texture.as_ref().map(TextureInfo::from);
        let texture = self.lookup(slot.as_ref(), ColorSpace::Srgb, &at("baseColorTexture"))?;
        self.base_color(pbr.base_color_factor.0, texture, material);
        let slot = pbr.metallic_roughness_texture.as_ref().map(TextureInfo::from);
        let at = at("metallicRoughnessTexture");
        let (metallic, roughness) = (unit(pbr.metallic_factor.0), unit(pbr.roughness_factor.0));
        material.metallic = self.scalar(metallic, slot.as_ref(), Channel::Blue, &at)?;
        material.roughness = self.scalar(roughness, slot.as_ref(), Channel::Green, &at)?;
        Ok(())
    }

    /// Sets base colour and alpha.
    fn base_color(&mut self, factor: [f32; 4], texture: Option<Texture>, material: &mut Principled) {
        let [r, g, b, alpha] = factor.map(unit);
        let factor = Rgb::new(r, g, b);
        let id = texture.map(|texture| self.texture_id(Texture { factor, ..texture }));
        material.base_color = match id {
            Some(id) if !factor.is_black() => ColorInput::Texture(id),
            _ => ColorInput::Constant(factor),
        };
        if material.alpha_mode != AlphaMode::Opaque {
            material.alpha = ScalarInput { factor: alpha, texture: id.map(|id| (id, Channel::Alpha)) };
        }
    }

    fn emission(
        &mut self,
        source: &json::Material,
        extensions: Extensions,
        at: &str,
    ) -> Result<ColorInput, LoadError> {
        let read: Option<EmissiveStrength> =
            self.document.extension(extensions, "KHR_materials_emissive_strength", at);
        let strength = read.map_or(1.0, |read| read.emissive_strength.max(0.0));
        let factor = Rgb::from(source.emissive_factor.0).map(unit) * strength;
        let slot = source.emissive_texture.as_ref().filter(|_| !factor.is_black()).map(TextureInfo::from);
        self.color(factor, slot.as_ref(), &format!("{at}/emissiveTexture"))
    }

    /// Converts the older model as KHR_materials_ior describes: with an index of refraction of 0, a surface reflects
    /// its specular colour, and the rest of white light reaches the diffuse colour.
    fn specular_glossiness(
        &mut self,
        older: &SpecularGlossiness,
        material: &mut Principled,
        at: &str,
    ) -> Result<(), LoadError> {
        let at = |slot: &str| format!("{at}/extensions/KHR_materials_pbrSpecularGlossiness/{slot}");
        let slot = older.diffuse_texture.as_ref();
        let texture = self.lookup(slot, ColorSpace::Srgb, &at("diffuseTexture"))?;
        self.base_color(older.diffuse_factor, texture, material);
        material.metallic = ScalarInput::constant(0.0);
        material.ior = 0.0;
        let slot = older.specular_glossiness_texture.as_ref();
        let at = at("specularGlossinessTexture");
        material.specular_color = self.color(Rgb::from(older.specular_factor).map(unit), slot, &at)?;
        let gloss = unit(older.glossiness_factor);
        material.roughness = match slot.filter(|_| gloss > 0.0) {
            None => ScalarInput::constant(1.0 - gloss),
            Some(slot) => self.roughness(slot, gloss, &at)?,
        };
        Ok(())
    }

    /// Roughness from a texture whose alpha is gloss.
    fn roughness(&mut self, slot: &TextureInfo, gloss: f32, at: &str) -> Result<ScalarInput, LoadError> {
        let constant = ScalarInput::constant(1.0 - gloss);
        let Some(texture) = self.lookup(Some(slot), ColorSpace::Linear, at)? else { return Ok(constant) };
        let Some(source) = self.source(slot.index, at) else { return Ok(constant) };
        let image = texture.image();
        let image =
            image.and_then(|image| self.images.rough(self.document, source, image, gloss, self.assets));
        let Some(image) = image else {
            self.losses.glosses += 1;
            return Ok(constant);
        };
        let texture = self.texture_id(Texture { source: TextureSource::Image(image), ..texture });
        Ok(ScalarInput { factor: 1.0, texture: Some((texture, Channel::Red)) })
    }

    /// The set of texture coordinates used by normal maps or anisotropy.
    fn tangent_set(&self, material: &Principled) -> Option<u32> {
        let normal = material.normal.or(material.clearcoat_normal).map(|map| map.texture);
        let stretched = material.anisotropy.strength > 0.0;
        let texture = normal.or(material.anisotropy.texture.filter(|_| stretched));
        let texture = texture.and_then(|id| self.assets.textures.get(id.0 as usize));
        texture.map(|texture| texture.uv_set).or(stretched.then_some(0))
    }
}

/// Clamps a factor; files contain factors outside their range.
pub(super) fn unit(factor: f32) -> f32 {
    factor.clamp(0.0, 1.0)
}
