//! Parameters of a surface's lobes.

use super::dispersion::Spectrum;
use super::ggx::Ggx;
use super::shading_frame::ShadingFrame;
use super::thin_film::ThinFilm;
use crate::math::{Color, Vector};
use crate::scene::MaterialRecord;
use crate::scene::material::is_real;
use crate::simd::Float;

/// The lobes of a material: equal in all lanes, so lobes that it lacks cost nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct LobeFlags {
    /// Diffuse reflection (Lambert).
    pub diffuse: bool,
    /// Rough or smooth mirror reflection.
    pub specular: bool,
    /// Microfacets stretched along one direction.
    pub anisotropic: bool,
    /// Partly or fully metallic.
    pub metallic: bool,
    /// A metal that reflects less at the edge than by Schlick's approximation.
    pub edge: bool,
    /// Reflectance independent of the angle.
    pub constant_fresnel: bool,
    /// Transmission by microfacets.
    pub transmission: bool,
    /// Refraction of the transmitted light.
    pub solid: bool,
    /// Refraction that depends on the colour.
    pub dispersion: bool,
    /// Diffuse transmission.
    pub diffuse_transmission: bool,
    /// A clear coat.
    pub coat: bool,
    /// Sheen of fibres.
    pub sheen: bool,
    /// A thin film on the mirror lobe.
    pub film: bool,
}

impl LobeFlags {
    /// Only the diffuse lobe.
    pub const MATTE: LobeFlags = LobeFlags {
        diffuse: true,
        specular: false,
        anisotropic: false,
        metallic: false,
        edge: false,
        constant_fresnel: false,
        transmission: false,
        solid: false,
        dispersion: false,
        diffuse_transmission: false,
        coat: false,
        sheen: false,
        film: false,
    };

    /// True if there is only the diffuse lobe, as in [`LobeFlags::MATTE`]. Flags of the mirror lobe are ignored,
    /// because there is none.
    #[inline(always)]
    pub fn is_matte(&self) -> bool {
        let LobeFlags {
            diffuse, specular, transmission, diffuse_transmission: back, coat, sheen, film, ..
        } = *self;
        diffuse && !(specular || transmission || back || coat || sheen || film)
    }
}

/// Parameters of a clear coat.
#[derive(Clone, Copy)]
pub struct Coat<F: Float> {
    /// Coverage.
    pub weight: F,
    /// Perceptual roughness.
    pub roughness: F,
    /// The shading frame of the clear coat.
    pub frame: ShadingFrame<F>,
    /// Reflectance at normal incidence.
    pub f0: Color<F>,
    /// Reflectance at grazing angles.
    pub f90: Color<F>,
}

/// Parameters of the sheen.
#[derive(Clone, Copy)]
pub struct SheenParams<F: Float> {
    /// Colour of the fibres.
    pub color: Color<F>,
    /// Perceptual roughness.
    pub roughness: F,
}

/// The medium outside a surface: air, or a surrounding body.
#[derive(Clone, Copy)]
pub struct Outside<F: Float> {
    /// True if it is air in all lanes.
    pub is_air: bool,
    /// Index of refraction.
    pub index: F,
    /// See [`MaterialRecord::dispersion`].
    pub dispersion: F,
}

impl<F: Float> Outside<F> {
    /// Air in all lanes.
    #[inline(always)]
    pub fn air() -> Self {
        Self { is_air: true, index: F::one(), dispersion: F::zero() }
    }

    /// The lanes with another index than air.
    #[inline(always)]
    fn is_dense(&self) -> F::Mask {
        !self.index.eq(F::one())
    }

    /// Reflectance at normal incidence of a dielectric of index `ior` that has the reflectance `in_air` in air.
    #[inline(always)]
    pub(super) fn reflectance(&self, ior: f32, in_air: f32) -> F {
        let in_air = F::splat(in_air);
        if self.is_air || !is_real(ior) {
            return in_air;
        }
        let ior = F::splat(ior);
        let ratio = (ior - self.index) / (ior + self.index);
        F::select(self.is_dense(), ratio * ratio, in_air)
    }

    /// The index on the viewer's side divided by the index on the other side of a boundary of rough or smooth glass.
    #[inline(always)]
    pub(super) fn eta(&self, material: &MaterialRecord, inside: F::Mask) -> F {
        let ior = F::splat(material.ior);
        let eta = F::select(inside, ior / self.index, self.index / ior);
        if self.is_air || material.roughness.is_zero() {
            return eta;
        }
        F::select(bends(eta), eta, F::splat(1.0 + 1e-4))
    }
}

/// The parameters of a surface's lobes at a point.
#[derive(Clone, Copy)]
pub struct Parameters<F: Float> {
    /// Shading frame, on the viewer's side.
    pub frame: ShadingFrame<F>,
    /// Geometric normal, on the viewer's side.
    pub geometric_normal: Vector<F>,
    /// Diffuse albedo, before attenuation by the layers above.
    pub diffuse: Color<F>,
    /// Albedo of diffuse transmission, before attenuation by the layers above.
    pub diffuse_transmission: Color<F>,
    /// Reflectance of the dielectric at normal incidence.
    pub f0: Color<F>,
    /// Reflectance of the dielectric at grazing angles.
    pub f90: Color<F>,
    /// Reflectance of the metal at normal incidence.
    pub metal: Color<F>,
    /// The factor on the shape of what the reflectance of a metal with an edge tint lacks.
    pub edge: Color<F>,
    /// The fraction of the surface that is metal.
    pub metallic: F,
    /// Widths of the microfacet distribution along the frame's x and y.
    pub ggx: Ggx<F>,
    /// √α, where α is the geometric mean of both widths.
    pub roughness: F,
    /// A factor on transmitted light.
    pub transmission: Color<F>,
    /// Index of refraction on the viewer's side divided by that on the other side.
    pub eta: F,
    /// Set if the viewer is inside the body.
    pub inside: F::Mask,
    /// `eta` for each colour, if it depends on the colour.
    pub spectrum: Spectrum<F>,
    /// The clear coat.
    pub coat: Coat<F>,
    /// The sheen.
    pub sheen: SheenParams<F>,
    /// The thin film on the mirror lobe.
    pub film: ThinFilm<F>,
}

impl<F: Float> Parameters<F> {
    /// Makes mirror lobes and clear coats of some lanes at least this rough (Kaplanyan and Dachsbacher, "Path space
    /// regularization for holistic and robust light transport", 2013).
    #[inline(always)]
    pub fn roughen(&mut self, least: F, has: LobeFlags, mask: F::Mask) {
        self.coat.roughness = F::select(mask, self.coat.roughness.max(least), self.coat.roughness);
        let mask = if has.solid { mask & bends(self.eta) } else { mask };
        self.roughness = F::select(mask, self.roughness.max(least), self.roughness);
        let (Ggx { x, y }, alpha) = (self.ggx, least * least);
        self.ggx = Ggx { x: F::select(mask, x.max(alpha), x), y: F::select(mask, y.max(alpha), y) };
    }
}

/// The lanes with indices so different that microfacets between them have a half vector.
#[inline(always)]
fn bends<F: Float>(eta: F) -> F::Mask {
    (eta - F::one()).abs().gt(F::splat(5e-5))
}
