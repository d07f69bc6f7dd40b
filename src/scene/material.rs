//! Materials: one record each, because all lanes that are shaded together have the same material.

use crate::bvh::Sidedness;
use crate::math::NONE;
use crate::world::Transport;

/// Microfacets with a smaller α than this count as a perfect mirror.
pub const SMOOTH: f32 = 1e-3;

/// What is rougher than this makes no caustics: photons find little that paths do not. (Over path tracing, photons are
/// 23 times as efficient for a ring of α = 0.05, 2.5 times at 0.2, and 0.8 times at 0.5.)
pub const CAUSTIC_ROUGHNESS: f32 = 0.45;

/// A colour: a constant times a texture, if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorParam {
    /// What the texture is multiplied by.
    pub factor: [f32; 3],
    /// Texture id or [`NONE`].
    pub texture: u32,
}

/// A number: a constant times a channel of a texture, if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarParam {
    /// What the channel is multiplied by.
    pub factor: f32,
    /// Texture id or [`NONE`].
    pub texture: u32,
    /// 0 red to 3 alpha.
    pub channel: u32,
}

impl ColorParam {
    /// The same everywhere.
    pub const fn constant(factor: [f32; 3]) -> Self {
        Self { factor, texture: NONE }
    }

    /// Whether it is black everywhere.
    pub fn is_black(&self) -> bool {
        self.factor == [0.0; 3]
    }
}

impl ScalarParam {
    /// The same everywhere.
    pub const fn constant(factor: f32) -> Self {
        Self { factor, texture: NONE, channel: 0 }
    }

    /// Whether it is nothing everywhere.
    pub fn is_zero(&self) -> bool {
        self.factor == 0.0
    }

    /// Whether it is one everywhere.
    pub fn is_one(&self) -> bool {
        self.factor == 1.0 && self.texture == NONE
    }
}

/// How much of a surface is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coverage {
    /// All of it.
    Whole,
    /// What has at least this alpha.
    Mask(f32),
    /// Alpha of it.
    Blend,
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalParam {
    /// Texture id.
    pub texture: u32,
    /// A factor on x and y.
    pub scale: f32,
}

/// Heights above a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpParam {
    /// Where they are looked up, as stored.
    pub heights: ScalarParam,
    /// How much higher 1 is than 0, in metres.
    pub metres: f32,
}

/// What is within a body, the same everywhere (PBRT 4th ed., 11.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// σₜ: absorption and scattering, m⁻¹.
    pub extinction: [f32; 3],
    /// σₛ/σₜ: the part of it that is scattering.
    pub albedo: [f32; 3],
    /// Henyey and Greenstein's g.
    pub anisotropy: f32,
}

impl Medium {
    /// Does nothing to light.
    pub const CLEAR: Medium = Medium { extinction: [0.0; 3], albedo: [0.0; 3], anisotropy: 0.0 };

    /// Whether it does nothing to light.
    pub fn is_clear(&self) -> bool {
        self.extinction == [0.0; 3]
    }

    /// Whether light changes its direction in it.
    pub fn scatters(&self) -> bool {
        self.extinction.iter().zip(self.albedo).any(|(extinction, albedo)| extinction * albedo > 0.0)
    }
}

/// A thin film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinFilmParam {
    /// Coverage.
    pub factor: ScalarParam,
    /// Index of refraction.
    pub ior: f32,
    /// 0 at the thinnest to 1 at the thickest.
    pub thickness: ScalarParam,
    /// In nm; may be the larger one of the two.
    pub thinnest: f32,
    /// In nm.
    pub thickest: f32,
}

/// What Whitted's transport makes of a material: how it answers a light, and its mirror image and
/// refraction (see [`crate::world::BlinnPhong`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhittedParams {
    /// kd.
    pub diffuse: ColorParam,
    /// ks.
    pub specular: ColorParam,
    /// Exponent of the specular lobe.
    pub shininess: f32,
    /// Whether the lobe is Phong's, not Blinn's.
    pub phong: bool,
    /// Weight of the reflection.
    pub kr: ColorParam,
    /// Weight of the refraction.
    pub kt: [f32; 3],
    /// Index of refraction, 0 where light does not enter.
    pub ior: f32,
}

/// What happens to light at a surface (see [`crate::world::Principled`] for the meanings). Presence,
/// emission, colour and normal map are the same for both transports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Albedo of dielectrics, reflectance straight on of metals.
    pub base_color: ColorParam,
    /// By [`Material::coverage`].
    pub alpha: ScalarParam,
    /// What alpha means.
    pub coverage: Coverage,
    /// Whether rays pass through its back as if it were not there.
    pub hides_back: bool,
    /// 0 to 1.
    pub metallic: ScalarParam,
    /// Perceptual.
    pub roughness: ScalarParam,
    /// Of the base layer.
    pub normal: Option<NormalParam>,
    /// Its relief.
    pub bump: Option<BumpParam>,
    /// Radiance.
    pub emission: ColorParam,
    /// Whether its back gives off none.
    pub one_sided_emission: bool,
    /// Its base colour is what is seen; no light falls on it.
    pub unlit: bool,
    /// False if no photons are aimed at it, nor begin on it.
    pub caustics: bool,
    /// Index of refraction of the inside.
    pub ior: f32,
    /// Strength of the dielectric's reflection; also what it grows to at grazing angles.
    pub specular: ScalarParam,
    /// Its colour: a factor on F₀.
    pub specular_color: ColorParam,
    /// F₀ without strength and colour: ((n − 1)/(n + 1))².
    pub f0: f32,
    /// Reflectance does not depend on the angle (Blinn-Phong's ks and kr).
    pub constant_fresnel: bool,
    /// The part of the rest that goes through.
    pub transmission: ScalarParam,
    /// Whether it goes through a thin sheet, unbent.
    pub thin: bool,
    /// 20 / Abbe number; 0 where all colours are bent alike.
    pub dispersion: f32,
    /// Whether some light goes straight on behind it, and rays to lights with it ([`Material::lets_straight_on`]):
    /// only under the path transport.
    pub straight: bool,
    /// Whether it is the boundary of a body.
    pub encloses: bool,
    /// The number of that kind of body ([`super::Bodies`]), or 0.
    pub body: u32,
    /// The number of the body that its front touches without a gap, or 0.
    pub beside: u32,
    /// Whether another surface in the same place stands for it.
    pub hidden: bool,
    /// Which of several bodies fills a place ([`super::bodies::Body::priority`]).
    pub priority: i32,
    /// What the body does to light within it.
    pub medium: Medium,
    /// Optical depth of a thin sheet for light that meets it straight on.
    pub sheet_depth: [f32; 3],
    /// The part of diffuse light that leaves on the other side, and its colour.
    pub diffuse_transmission: ScalarParam,
    /// Its colour.
    pub diffuse_transmission_color: ColorParam,
    /// Coverage by the clear layer; its reflectance straight on is in `coat_f0`.
    pub coat: ScalarParam,
    /// Perceptual.
    pub coat_roughness: ScalarParam,
    /// The clear layer's own normals.
    pub coat_normal: Option<NormalParam>,
    /// Reflectance straight on, and at grazing angles.
    pub coat_f0: [f32; 3],
    /// Reflectance at grazing angles.
    pub coat_f90: [f32; 3],
    /// Fibres.
    pub sheen_color: ColorParam,
    /// Perceptual.
    pub sheen_roughness: ScalarParam,
    /// From 0, round, to 1.
    pub anisotropy: f32,
    /// Cosine and sine of the angle from the tangent.
    pub anisotropy_direction: [f32; 2],
    /// Red, green: direction; blue: strength.
    pub anisotropy_texture: u32,
    /// On the mirror lobe, if there is one.
    pub film: Option<ThinFilmParam>,
    /// For Whitted's transport.
    pub classic: WhittedParams,
    /// Whether anything of it is looked up in a texture: [`Material::looks_up`].
    pub textured: bool,
}

/// Whether an index of refraction can be that of something: beyond these, it stands for a surface that reflects all
/// light.
pub fn is_real(ior: f32) -> bool {
    (0.1..=10.0).contains(&ior)
}

impl Material {
    /// From which side a surface of it is there, as the tree sees it: a transform may have mirrored the tree's
    /// triangles.
    pub fn sidedness(&self, mirrored: bool) -> Sidedness {
        match (self.coverage, self.has_side(false)) {
            (Coverage::Mask(_) | Coverage::Blend, _) => Sidedness::Filtered,
            // A ray to a light passes its surface.
            _ if self.straight || self.emits() || self.hidden => Sidedness::Filtered,
            (Coverage::Whole, true) => Sidedness::Always,
            (Coverage::Whole, false) if mirrored => Sidedness::Back,
            (Coverage::Whole, false) => Sidedness::Front,
        }
    }

    /// Whether it has that side: its front, or its back.
    pub fn has_side(&self, front: bool) -> bool {
        !self.hidden && (front || !self.hides_back)
    }

    /// Whether it reflects like a mirror, however blurred.
    pub fn is_specular(&self) -> bool {
        // What is black when seen straight on still has its rim: F90 is `specular` alone.
        let dielectric = self.f0 > 0.0 && !self.specular.is_zero();
        dielectric || !self.metallic.is_zero()
    }

    /// Whether it has a lobe of microfacets: reflection, transmission, a film.
    pub fn has_mirror(&self) -> bool {
        self.is_specular() || !self.transmission.is_zero() || self.film.is_some()
    }

    /// True if light goes through it and into or out of a body, which bends it.
    pub fn refracts(&self) -> bool {
        !self.transmission.is_zero() && !self.thin
    }

    /// Whether its microfacets may be longer one way.
    pub fn is_anisotropic(&self) -> bool {
        self.has_mirror() && self.anisotropy > 0.0
    }

    /// Whether it is smooth somewhere, and bends nothing of the light that it lets through: a thin sheet, or a body
    /// that refracts like its surroundings.
    pub fn lets_straight_on(&self) -> bool {
        let rough = self.roughness.factor;
        let smooth = rough * rough < SMOOTH || self.roughness.texture != NONE;
        let unbent = self.thin || (self.ior == 1.0 && self.dispersion == 0.0);
        !self.transmission.is_zero() && smooth && unbent && !self.unlit
    }

    /// True if it makes caustics: it reflects or lets through light into about one direction, and does nothing else.
    /// (Whatever its texture says, the roughness is at most the factor.)
    pub fn makes_caustics(&self) -> bool {
        let nothing_below =
            self.base_color.is_black() || self.metallic.is_one() || self.transmission.is_one();
        let is_clear = self.diffuse_transmission.is_zero() && self.sheen_color.is_black();
        let narrow = |roughness: &ScalarParam| roughness.factor <= CAUSTIC_ROUGHNESS;
        // The longer width of stretched microfacets (glTF, KHR_materials_anisotropy).
        let alpha = self.roughness.factor * self.roughness.factor;
        let longer = alpha + (1.0 - alpha) * self.anisotropy * self.anisotropy;
        let base = longer <= CAUSTIC_ROUGHNESS * CAUSTIC_ROUGHNESS;
        let coat = self.coat.is_zero() || narrow(&self.coat_roughness);
        let may = self.caustics && !self.unlit && self.has_mirror();
        may && nothing_below && is_clear && base && coat
    }

    /// Returns true if light comes through it to the other side.
    pub fn lets_through(&self) -> bool {
        !self.transmission.is_zero() || !self.diffuse_transmission.is_zero()
    }

    /// Whether photons may end at it. Those of Whitted's transport may also go on from there.
    pub fn ends_photons_under(&self, transport: Transport) -> bool {
        match transport {
            Transport::Whitted => !self.unlit && !self.classic.diffuse.is_black(),
            Transport::Path => !self.unlit && !self.makes_caustics(),
        }
    }

    /// Whether it makes caustics under either transport.
    pub fn makes_caustics_under(&self, transport: Transport) -> bool {
        match transport {
            Transport::Whitted => {
                self.caustics && !self.unlit && (!self.classic.kr.is_black() || self.classic.ior > 0.0)
            }
            Transport::Path => self.makes_caustics(),
        }
    }

    /// True if it encloses a body that does anything to light, within it or at its boundary.
    pub fn has_active_medium(&self) -> bool {
        self.encloses && (!self.medium.is_clear() || self.index_square() != 1.0)
    }

    /// True if it encloses a body that absorbs or scatters light.
    pub fn attenuates(&self) -> bool {
        self.encloses && !self.medium.is_clear()
    }

    /// The index of refraction of the body that it encloses, if the body's boundary bends light; 1 of all else.
    pub fn index(&self) -> f32 {
        if self.encloses && self.refracts() && is_real(self.ior) { self.ior } else { 1.0 }
    }

    /// Its square. Radiance within is n² times that of the same light outside, because it takes up a smaller solid
    /// angle (PBRT 4th ed., 9.5.2).
    pub fn index_square(&self) -> f32 {
        self.index() * self.index()
    }

    /// Whether it gives off light.
    pub fn emits(&self) -> bool {
        !self.emission.is_black() && !self.unlit
    }

    /// Whether it looks anything up in a texture.
    pub fn looks_up(&self) -> bool {
        let classic = &self.classic;
        let colors = [
            self.base_color,
            self.emission,
            self.specular_color,
            self.diffuse_transmission_color,
            self.sheen_color,
            classic.diffuse,
            classic.specular,
            classic.kr,
        ];
        let scalars = [
            self.alpha,
            self.metallic,
            self.roughness,
            self.specular,
            self.transmission,
            self.diffuse_transmission,
            self.coat,
            self.coat_roughness,
            self.sheen_roughness,
        ];
        colors.iter().any(|color| color.texture != NONE)
            || scalars.iter().any(|scalar| scalar.texture != NONE)
            || self.normal.is_some()
            || self.bump.is_some()
            || self.coat_normal.is_some()
            || self.anisotropy_texture != NONE
            || self.film.is_some_and(|film| film.factor.texture != NONE || film.thickness.texture != NONE)
    }

    /// Whether directions along the surface matter.
    pub fn needs_tangents(&self) -> bool {
        self.normal.is_some() || self.coat_normal.is_some() || self.anisotropy > 0.0
    }
}
