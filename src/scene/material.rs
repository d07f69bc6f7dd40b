//! Materials: one record each, because all lanes that are shaded together have the same material.

use crate::bvh::Sidedness;
use crate::math::NONE;
use crate::world::Transport;

/// Microfacets with a smaller α than this are treated as a perfect mirror.
pub const SMOOTH: f32 = 1e-3;

/// Rougher surfaces make no caustics: photons find little that paths do not. (Compared with path tracing, photons are
/// 23 times as efficient for a ring of α = 0.05, 2.5 times at 0.2, and 0.8 times at 0.5.)
pub const CAUSTIC_ROUGHNESS: f32 = 0.45;

/// A colour: a constant, times a texture if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorParam {
    /// The constant.
    pub factor: [f32; 3],
    /// Texture id or [`NONE`].
    pub texture: u32,
}

/// A number: a constant, times a channel of a texture if there is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarParam {
    /// The constant.
    pub factor: f32,
    /// Texture id or [`NONE`].
    pub texture: u32,
    /// The channel, from 0 (red) to 3 (alpha).
    pub channel: u32,
}

impl ColorParam {
    /// A constant colour.
    pub const fn constant(factor: [f32; 3]) -> Self {
        Self { factor, texture: NONE }
    }

    /// True if the colour is black everywhere.
    pub fn is_black(&self) -> bool {
        self.factor == [0.0; 3]
    }
}

impl ScalarParam {
    /// A constant number.
    pub const fn constant(factor: f32) -> Self {
        Self { factor, texture: NONE, channel: 0 }
    }

    /// True if the number is zero everywhere.
    pub fn is_zero(&self) -> bool {
        self.factor == 0.0
    }

    /// True if the number is one everywhere.
    pub fn is_one(&self) -> bool {
        self.factor == 1.0 && self.texture == NONE
    }
}

/// The part of a surface that exists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coverage {
    /// The whole surface.
    Whole,
    /// The part with at least this alpha.
    Mask(f32),
    /// The fraction alpha of the surface.
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

/// A bump map: heights above a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpParam {
    /// The heights, as stored.
    pub heights: ScalarParam,
    /// The height of 1 above 0, in metres.
    pub metres: f32,
}

/// The homogeneous medium within a body (PBRT 4th ed., 11.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// The extinction coefficient σₜ: absorption and scattering, m⁻¹.
    pub extinction: [f32; 3],
    /// The single-scattering albedo σₛ/σₜ.
    pub albedo: [f32; 3],
    /// The asymmetry parameter g of Henyey and Greenstein.
    pub anisotropy: f32,
}

impl Medium {
    /// A medium that neither absorbs nor scatters.
    pub const CLEAR: Medium = Medium { extinction: [0.0; 3], albedo: [0.0; 3], anisotropy: 0.0 };

    /// True if the medium neither absorbs nor scatters.
    pub fn is_clear(&self) -> bool {
        self.extinction == [0.0; 3]
    }

    /// True if the medium scatters light.
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
    /// Interpolates from 0 (thinnest) to 1 (thickest).
    pub thickness: ScalarParam,
    /// Thickness at 0, in nm; may be larger than `thickest`.
    pub thinnest: f32,
    /// Thickness at 1, in nm.
    pub thickest: f32,
}

/// The parameters of Whitted's transport: local illumination, mirror reflection and refraction (see
/// [`crate::world::BlinnPhong`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhittedParams {
    /// The diffuse colour kd.
    pub diffuse: ColorParam,
    /// The specular colour ks.
    pub specular: ColorParam,
    /// Exponent of the specular lobe.
    pub shininess: f32,
    /// True for Phong's lobe, false for Blinn's.
    pub phong: bool,
    /// Weight of the reflection.
    pub kr: ColorParam,
    /// Weight of the refraction.
    pub kt: [f32; 3],
    /// Index of refraction; 0 if light does not enter.
    pub ior: f32,
}

/// A surface's material (see [`crate::world::Principled`] for the meanings). Coverage, emission, colour and normal map
/// are the same for both transports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialRecord {
    /// Albedo of dielectrics, reflectance of metals at normal incidence.
    pub base_color: ColorParam,
    /// Alpha, interpreted by [`MaterialRecord::coverage`].
    pub alpha: ScalarParam,
    /// The interpretation of alpha.
    pub coverage: Coverage,
    /// True if rays pass through the back of the surface.
    pub hides_back: bool,
    /// Metalness, 0 to 1.
    pub metallic: ScalarParam,
    /// A factor on the reflectance of metals at the angle of cosine 1/7, beside Schlick's approximation.
    pub edge_tint: [f32; 3],
    /// Perceptual roughness.
    pub roughness: ScalarParam,
    /// Normal map of the base layer.
    pub normal: Option<NormalParam>,
    /// Bump map of the base layer.
    pub bump: Option<BumpParam>,
    /// Emitted radiance.
    pub emission: ColorParam,
    /// True if the back emits no light.
    pub one_sided_emission: bool,
    /// The light group of the emitted light, or [`NONE`].
    pub group: u32,
    /// True if the surface shows its base colour and is not lit.
    pub unlit: bool,
    /// True if the surface shows what is behind it, darkened by the shadows that fall on it (path transport).
    pub shadow_catcher: bool,
    /// False if no photons are aimed at the surface nor emitted by it.
    pub caustics: bool,
    /// Index of refraction of the inside.
    pub ior: f32,
    /// Strength of the dielectric's reflection, and its reflectance at grazing angles.
    pub specular: ScalarParam,
    /// Colour of the dielectric's reflection: a factor on F₀.
    pub specular_color: ColorParam,
    /// F₀ without strength and colour: ((n − 1)/(n + 1))².
    pub f0: f32,
    /// True if reflectance does not depend on the angle (Blinn-Phong's ks and kr).
    pub constant_fresnel: bool,
    /// The part of the light that is not reflected that is transmitted.
    pub transmission: ScalarParam,
    /// True for a thin sheet, which does not bend light.
    pub thin: bool,
    /// 20 / Abbe number; 0 if all colours are bent alike.
    pub dispersion: f32,
    /// True if some light passes straight through, and shadow rays with it ([`MaterialRecord::lets_straight_on`]): only under
    /// the path transport.
    pub passes_shadow_rays: bool,
    /// True for the boundary of a body.
    pub encloses: bool,
    /// The number of the kind of that body ([`super::Bodies`]), or 0.
    pub body: u32,
    /// The number of the body that touches the front without a gap, or 0.
    pub beside: u32,
    /// True if another surface in the same place replaces this one.
    pub hidden: bool,
    /// The priority of the body where several overlap ([`super::bodies::Body::priority`]).
    pub priority: i32,
    /// The medium within the body.
    pub medium: Medium,
    /// Optical depth of a thin sheet at normal incidence.
    pub sheet_depth: [f32; 3],
    /// The part of diffuse light that is transmitted.
    pub diffuse_transmission: ScalarParam,
    /// The colour of diffusely transmitted light.
    pub diffuse_transmission_color: ColorParam,
    /// Coverage by the clear coat; its reflectance is in `coat_f0` and `coat_f90`.
    pub coat: ScalarParam,
    /// Perceptual roughness of the clear coat.
    pub coat_roughness: ScalarParam,
    /// Normal map of the clear coat.
    pub coat_normal: Option<NormalParam>,
    /// Reflectance of the clear coat at normal incidence.
    pub coat_f0: [f32; 3],
    /// Reflectance of the clear coat at grazing angles.
    pub coat_f90: [f32; 3],
    /// Colour of the sheen's fibres.
    pub sheen_color: ColorParam,
    /// Perceptual roughness of the sheen.
    pub sheen_roughness: ScalarParam,
    /// Anisotropy of the microfacets, 0 (isotropic) to 1.
    pub anisotropy: f32,
    /// Cosine and sine of the angle of anisotropy from the tangent.
    pub anisotropy_direction: [f32; 2],
    /// Texture id or [`NONE`]; red and green: direction, blue: strength.
    pub anisotropy_texture: u32,
    /// Thin film on the mirror lobe.
    pub film: Option<ThinFilmParam>,
    /// Parameters of Whitted's transport.
    pub classic: WhittedParams,
    /// True if any parameter has a texture: [`MaterialRecord::looks_up`].
    pub textured: bool,
    /// True if the colours and alphas of vertices are factors: no texture looks them up.
    pub vertices_are_factors: bool,
}

/// True if an index of refraction is physically plausible, 0.1 to 10. Other values stand for a surface that reflects
/// all light.
pub fn is_real(ior: f32) -> bool {
    (0.1..=10.0).contains(&ior)
}

impl MaterialRecord {
    /// The side from which the acceleration structure reports hits on the surface; a transform may have mirrored its
    /// triangles.
    pub fn sidedness(&self, mirrored: bool) -> Sidedness {
        match (self.coverage, self.has_side(false)) {
            (Coverage::Mask(_) | Coverage::Blend, _) => Sidedness::Filtered,
            // Shadow rays pass the surface of their light.
            _ if self.passes_shadow_rays || self.emits() || self.hidden => Sidedness::Filtered,
            (Coverage::Whole, true) => Sidedness::Always,
            (Coverage::Whole, false) if mirrored => Sidedness::Back,
            (Coverage::Whole, false) => Sidedness::Front,
        }
    }

    /// True if the surface has that side (`front`: its front, otherwise its back).
    pub fn has_side(&self, front: bool) -> bool {
        !self.hidden && (front || !self.hides_back)
    }

    /// True if it has a specular reflection, of any roughness.
    pub fn is_specular(&self) -> bool {
        // A dielectric that is black at normal incidence still reflects at grazing angles: F90 is just `specular`.
        let dielectric = self.f0 > 0.0 && !self.specular.is_zero();
        dielectric || !self.metallic.is_zero()
    }

    /// True if it has a microfacet lobe: reflection, transmission or a film.
    pub fn has_mirror(&self) -> bool {
        self.is_specular() || !self.transmission.is_zero() || self.film.is_some()
    }

    /// True if it transmits light into or out of a body and bends it.
    pub fn refracts(&self) -> bool {
        !self.transmission.is_zero() && !self.thin
    }

    /// True if its microfacets may be anisotropic.
    pub fn is_anisotropic(&self) -> bool {
        self.has_mirror() && self.anisotropy > 0.0
    }

    /// True if it is smooth somewhere and transmits light without bending it: a thin sheet, or a body with the index of
    /// its surroundings.
    pub fn lets_straight_on(&self) -> bool {
        let rough = self.roughness.factor;
        let smooth = rough * rough < SMOOTH || self.roughness.texture != NONE;
        let unbent = self.thin || (self.ior == 1.0 && self.dispersion == 0.0);
        !self.transmission.is_zero() && smooth && unbent && !self.unlit
    }

    /// True if it makes caustics: it reflects or transmits light into a narrow range of directions, and does nothing
    /// else. (Textures can only lower the roughness below the factor.)
    pub fn makes_caustics(&self) -> bool {
        let nothing_below =
            self.base_color.is_black() || self.metallic.is_one() || self.transmission.is_one();
        let is_clear = self.diffuse_transmission.is_zero() && self.sheen_color.is_black();
        let narrow = |roughness: &ScalarParam| roughness.factor <= CAUSTIC_ROUGHNESS;
        // The larger α of anisotropic microfacets (glTF, KHR_materials_anisotropy).
        let alpha = self.roughness.factor * self.roughness.factor;
        let longer = alpha + (1.0 - alpha) * self.anisotropy * self.anisotropy;
        let base = longer <= CAUSTIC_ROUGHNESS * CAUSTIC_ROUGHNESS;
        let coat = self.coat.is_zero() || narrow(&self.coat_roughness);
        let may = self.caustics && !self.unlit && self.has_mirror();
        may && nothing_below && is_clear && base && coat
    }

    /// True if it transmits light to the other side.
    pub fn lets_through(&self) -> bool {
        !self.transmission.is_zero() || !self.diffuse_transmission.is_zero()
    }

    /// True if photons may end on it. Those of Whitted's transport may also continue from there.
    pub fn ends_photons_under(&self, transport: Transport) -> bool {
        match transport {
            Transport::Whitted => !self.unlit && !self.classic.diffuse.is_black(),
            Transport::Path => !self.unlit && !self.makes_caustics(),
        }
    }

    /// True if it makes caustics under a transport.
    pub fn makes_caustics_under(&self, transport: Transport) -> bool {
        match transport {
            Transport::Whitted => {
                self.caustics && !self.unlit && (!self.classic.kr.is_black() || self.classic.ior > 0.0)
            }
            Transport::Path => self.makes_caustics(),
        }
    }

    /// True if it encloses a body that affects light, within it or at its boundary.
    pub fn has_active_medium(&self) -> bool {
        self.encloses && (!self.medium.is_clear() || self.index_square() != 1.0)
    }

    /// True if it encloses a body that absorbs or scatters light.
    pub fn attenuates(&self) -> bool {
        self.encloses && !self.medium.is_clear()
    }

    /// The index of refraction of the body that it encloses, if the body's boundary bends light; otherwise 1.
    pub fn index(&self) -> f32 {
        if self.encloses && self.refracts() && is_real(self.ior) { self.ior } else { 1.0 }
    }

    /// The square of [`MaterialRecord::index`]. Radiance within the body is n² times that of the same light outside, because
    /// it fills a smaller solid angle (PBRT 4th ed., 9.5.2).
    pub fn index_square(&self) -> f32 {
        self.index() * self.index()
    }

    /// True if it emits light.
    pub fn emits(&self) -> bool {
        !self.emission.is_black() && !self.unlit
    }

    /// True if any parameter has a texture.
    pub fn looks_up(&self) -> bool {
        let classic = &self.classic;
        let colors = [
            self.base_color, self.emission, self.specular_color, self.diffuse_transmission_color,
            self.sheen_color, classic.diffuse, classic.specular, classic.kr,
        ];
        let scalars = [
            self.alpha, self.metallic, self.roughness, self.specular, self.transmission,
            self.diffuse_transmission, self.coat, self.coat_roughness, self.sheen_roughness,
        ];
        colors.iter().any(|color| color.texture != NONE)
            || scalars.iter().any(|scalar| scalar.texture != NONE)
            || self.normal.is_some()
            || self.bump.is_some()
            || self.coat_normal.is_some()
            || self.anisotropy_texture != NONE
            || self.film.is_some_and(|film| film.factor.texture != NONE || film.thickness.texture != NONE)
    }

    /// True if shading needs tangents.
    pub fn needs_tangents(&self) -> bool {
        self.normal.is_some() || self.coat_normal.is_some() || self.anisotropy > 0.0
    }
}
