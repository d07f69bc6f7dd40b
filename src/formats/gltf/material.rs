//! Metallic-roughness materials as Blinn-Phong's: what they come to where every light is a
//! point and nothing but mirrors shows the surroundings.
//!
//! With the base colour b, metalness m, roughness r and α = r²:
//!
//! - *diffuse* b · (1 − m + m α). The second part is the metal's: the wider its lobe, the
//!   less it depends on direction, and at r = 1 it is all but Lambertian. In the lobe itself
//!   1 − α of the metal is left.
//! - *shininess* s = 2/α² − 2, by which Blinn-Phong's distribution is as wide as Beckmann's
//!   and GGX's of that α.
//! - *specular* F₀ · (s + 2)/8. A microfacet lobe is D F V with D = (s + 2)/2π · (n·h)ˢ and
//!   V = 1/4 for light and viewer near the normal; the model has no factor 1/π, so that π of
//!   it are in a unit of our irradiance. F₀ = 0.04 (1 − m) + b m (1 − α).
//! - *kr* b m (1 − r/0.3) for metals smoother than that: their lobe is a mirror image.
//! - Textures of metalness and roughness count by their means: the model has one exponent.
//! - *Transmission* t lets b t through and leaves 1 − t of the diffuse part. Only what has a
//!   volume bends light; a thin wall (an ior of 1) bends and mirrors nothing.
//! - *Unlit* surfaces give their colour off.
//!
//! Textures that this has no use for (normals, occlusion) are left out without a word:
//! nearly every file has them.

use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use super::Import;
use super::extensions::{EmissiveStrength, Ior, Transmission, Unlit, Volume, usual_ior};
use super::image::mean_color;
use super::texture::Lookup;
use crate::error::LoadError;
use crate::math::Rgb;
use crate::world::{BlinnPhong, ColorInput, Material, MaterialId};

/// A material of the file and what a mesh must know of it.
#[derive(Clone, Copy)]
pub(super) struct Lowered {
    pub id: MaterialId,
    /// The set of texture coordinates that it is looked up by, if it is.
    pub set: Option<u32>,
}

/// Below this roughness lights have this size: the points of a perfect mirror would be
/// found by no ray.
const SMOOTHEST: f32 = 0.15;
/// The roughness from which metals show no mirror image.
const DULL: f32 = 0.3;
/// F₀ of what is no metal.
const DIELECTRIC: f32 = 0.04;

/// The numbers of a material, textures averaged.
struct Surface {
    color: Rgb,
    metallic: f32,
    roughness: f32,
}

impl Import<'_> {
    /// The material of a primitive; each is lowered once.
    pub(super) fn material(
        &mut self,
        index: Option<Index<json::Material>>,
        place: &str,
    ) -> Result<Lowered, LoadError> {
        let key = index.map(|index| index.value());
        if let Some(known) = self.materials.get(&key) {
            return Ok(*known);
        }
        let document = self.document;
        let default = json::Material::default();
        let (source, at) = match index {
            None => (&default, String::new()),
            Some(index) => {
                let material = document.get(&document.root.materials, index, place, "material")?;
                (material, format!("/materials/{}", index.value()))
            }
        };
        let (material, set) = self.lower(source, &at)?;
        let name = source.name.clone();
        let lowered = Lowered { id: self.assets.add_material(name, Material::BlinnPhong(material)), set };
        self.materials.insert(key, lowered);
        Ok(lowered)
    }

    fn lower(&mut self, source: &json::Material, at: &str) -> Result<(BlinnPhong, Option<u32>), LoadError> {
        if source.alpha_mode != Checked::Valid(AlphaMode::Opaque) {
            self.losses.see_through.push(source.name.clone().unwrap_or_else(|| at.to_owned()));
        }
        let pbr = &source.pbr_metallic_roughness;
        let lookup = match &pbr.base_color_texture {
            None => None,
            Some(info) => self.lookup(info, &format!("{at}/pbrMetallicRoughness/baseColorTexture"))?,
        };
        let surface = self.surface(source, at)?;
        let (emission, emission_set) = self.emission(source, at)?;
        let document = self.document;
        let extensions = source.extensions.as_ref().map(|extensions| &extensions.others);
        let set = lookup.as_ref().map(|lookup| lookup.set).or(emission_set);
        if emission_set.is_some() && emission_set != set {
            self.losses.other_sets += 1;
        }
        let unlit: Option<Unlit> = document.extension(extensions, "KHR_materials_unlit", at)?;
        if unlit.is_some() {
            let emission = self.input(lookup.as_ref(), surface.color);
            let diffuse = ColorInput::default();
            return Ok((BlinnPhong { diffuse, emission, ..BlinnPhong::default() }, set));
        }
        let transmission: Option<Transmission> =
            document.extension(extensions, "KHR_materials_transmission", at)?;
        let through = transmission.as_ref().map_or(0.0, |read| read.transmission_factor.clamp(0.0, 1.0));
        let through = through * (1.0 - surface.metallic);
        if through > 0.0 && transmission.is_some_and(|read| read.transmission_texture.is_some()) {
            self.losses.transmission_textures += 1;
        }
        let mut material = self.blinn_phong(&surface, lookup.as_ref(), through);
        material.emission = emission;
        if through > 0.0 {
            let volume: Option<Volume> = document.extension(extensions, "KHR_materials_volume", at)?;
            let ior: Option<Ior> = document.extension(extensions, "KHR_materials_ior", at)?;
            let bends = volume.is_some_and(|volume| volume.thickness_factor > 0.0);
            let ior = ior.map_or_else(usual_ior, |read| read.ior);
            // 0 is how files say that they mean no ior at all.
            material.ior = Some(if !bends {
                1.0
            } else if ior >= 1.0 {
                ior
            } else {
                usual_ior()
            });
            material.kr = ColorInput::Constant(Rgb::WHITE);
            material.kt = self.mean_of(lookup.as_ref(), surface.color) * through;
        }
        Ok((material, set))
    }

    /// Factors and the means of what they are factors of.
    fn surface(&mut self, source: &json::Material, at: &str) -> Result<Surface, LoadError> {
        let pbr = &source.pbr_metallic_roughness;
        let [r, g, b, _] = pbr.base_color_factor.0;
        let mut surface = Surface {
            color: Rgb::new(r, g, b).map(unit),
            metallic: unit(pbr.metallic_factor.0),
            roughness: unit(pbr.roughness_factor.0),
        };
        if let Some(info) = &pbr.metallic_roughness_texture {
            let at = format!("{at}/pbrMetallicRoughness/metallicRoughnessTexture");
            if let Some([_, roughness, metallic]) = self.texture_mean(info, &at)? {
                surface.roughness *= roughness;
                surface.metallic *= metallic;
            }
        }
        Ok(surface)
    }

    fn blinn_phong(&mut self, surface: &Surface, lookup: Option<&Lookup>, through: f32) -> BlinnPhong {
        let Surface { color, metallic, roughness } = *surface;
        let alpha = roughness.max(SMOOTHEST) * roughness.max(SMOOTHEST);
        let shininess = (2.0 / (alpha * alpha) - 2.0).max(0.0);
        let peak = (shininess + 2.0) / 8.0;
        let diffuse = (1.0 - metallic) * (1.0 - through) + metallic * alpha;
        let mirror = metallic * (1.0 - alpha);
        // One texture has one factor: what is hardly metal takes the mean of its colour, what is
        // mostly metal that colour for all of it.
        let specular = if metallic > 0.5 {
            self.input(lookup, color * ((mirror + DIELECTRIC * (1.0 - metallic)) * peak))
        } else {
            let color = self.mean_of(lookup, color);
            ColorInput::Constant((color * mirror + Rgb::splat(DIELECTRIC * (1.0 - metallic))) * peak)
        };
        let image = metallic * (1.0 - roughness / DULL).max(0.0);
        BlinnPhong {
            diffuse: self.input(lookup, color * diffuse),
            specular,
            shininess,
            kr: self.input(lookup, color * image),
            ..BlinnPhong::default()
        }
    }

    fn emission(
        &mut self,
        source: &json::Material,
        at: &str,
    ) -> Result<(ColorInput, Option<u32>), LoadError> {
        let extensions = source.extensions.as_ref().map(|extensions| &extensions.others);
        let read: Option<EmissiveStrength> =
            self.document.extension(extensions, "KHR_materials_emissive_strength", at)?;
        let strength = read.map_or(1.0, |read| read.emissive_strength.max(0.0));
        let factor = Rgb::from(source.emissive_factor.0).map(unit) * strength;
        let Some(info) = source.emissive_texture.as_ref().filter(|_| !factor.is_black()) else {
            return Ok((ColorInput::Constant(factor), None));
        };
        let lookup = self.lookup(info, &format!("{at}/emissiveTexture"))?;
        let set = lookup.as_ref().map(|lookup| lookup.set);
        Ok((self.input(lookup.as_ref(), factor), set))
    }

    /// A colour, or a texture times a colour.
    fn input(&mut self, lookup: Option<&Lookup>, factor: Rgb) -> ColorInput {
        match lookup {
            Some(lookup) if !factor.is_black() => {
                ColorInput::Texture(self.assets.add_texture(lookup.times(factor)))
            }
            _ => ColorInput::Constant(factor),
        }
    }

    /// A colour times the mean of a texture.
    fn mean_of(&self, lookup: Option<&Lookup>, factor: Rgb) -> Rgb {
        let image = lookup.and_then(|lookup| self.assets.images.get(lookup.texture.image.0 as usize));
        image.map_or(factor, |image| {
            let mean = mean_color(image);
            Rgb::new(factor.r * mean.r, factor.g * mean.g, factor.b * mean.b)
        })
    }
}

fn unit(factor: f32) -> f32 {
    factor.clamp(0.0, 1.0)
}
