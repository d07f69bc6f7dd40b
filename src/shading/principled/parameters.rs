//! What the lobes of a surface are made from.

use super::dispersion::Spectrum;
use super::ggx::Ggx;
use super::shading_frame::ShadingFrame;
use super::thin_film::ThinFilm;
use crate::math::{Color, Vector};
use crate::scene::Material;
use crate::scene::material::is_real;
use crate::simd::Float;

/// Which lobes a material has at all: the same for all lanes, so that what it lacks costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct LobeFlags {
    /// Lambert's.
    pub diffuse: bool,
    /// A rough or smooth mirror.
    pub specular: bool,
    /// Stretched in one direction.
    pub anisotropic: bool,
    /// Partly metal.
    pub metallic: bool,
    /// Reflectance does not depend on the angle.
    pub constant_fresnel: bool,
    /// Light goes through.
    pub transmission: bool,
    /// And is refracted.
    pub solid: bool,
    /// Each colour in its own way.
    pub dispersion: bool,
    /// Diffuse light leaves on the other side, too.
    pub back: bool,
    /// A clear layer.
    pub coat: bool,
    /// Fibres.
    pub sheen: bool,
    /// A thin film on the mirror.
    pub film: bool,
}

impl LobeFlags {
    /// Lambert's lobe and nothing else.
    pub const MATTE: LobeFlags = LobeFlags {
        diffuse: true,
        specular: false,
        anisotropic: false,
        metallic: false,
        constant_fresnel: false,
        transmission: false,
        solid: false,
        dispersion: false,
        back: false,
        coat: false,
        sheen: false,
        film: false,
    };

    /// Whether it is [`LobeFlags::MATTE`]: what the mirror lobe is like does not matter where there is none.
    #[inline(always)]
    pub fn is_matte(&self) -> bool {
        let LobeFlags { diffuse, specular, transmission, back, coat, sheen, film, .. } = *self;
        diffuse && !(specular || transmission || back || coat || sheen || film)
    }
}

/// What is known of a clear layer.
#[derive(Clone, Copy)]
pub struct Coat<F: Float> {
    /// Coverage.
    pub weight: F,
    /// Perceptual roughness.
    pub roughness: F,
    /// Its own frame.
    pub frame: ShadingFrame<F>,
    /// Reflectance straight on.
    pub f0: Color<F>,
    /// At grazing angles.
    pub f90: Color<F>,
}

/// What is known of fibres.
#[derive(Clone, Copy)]
pub struct SheenParams<F: Float> {
    /// Their colour.
    pub color: Color<F>,
    /// Perceptual roughness.
    pub roughness: F,
}

/// What lies outside a surface: air, or a body that it is in.
#[derive(Clone, Copy)]
pub struct Outside<F: Float> {
    /// Whether it is air in all lanes.
    pub is_air: bool,
    /// Its index of refraction.
    pub index: F,
    /// As [`Material::dispersion`].
    pub dispersion: F,
}

impl<F: Float> Outside<F> {
    /// Air in all lanes.
    #[inline(always)]
    pub fn air() -> Self {
        Self { is_air: true, index: F::one(), dispersion: F::zero() }
    }

    /// Where there is something else than air.
    #[inline(always)]
    fn is_dense(&self) -> F::Mask {
        !self.index.eq(F::one())
    }

    /// Reflectance straight on of a dielectric that has such an index and that reflectance in air.
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

    /// The index on the viewer's side over that on the other side of a boundary of rough or smooth glass.
    #[inline(always)]
    pub(super) fn eta(&self, material: &Material, inside: F::Mask) -> F {
        let ior = F::splat(material.ior);
        let eta = F::select(inside, ior / self.index, self.index / ior);
        if self.is_air || material.roughness.is_zero() {
            return eta;
        }
        // Microfacets between equal indices would have no half vector.
        let bends = (eta - F::one()).abs().gt(F::splat(5e-5));
        F::select(bends, eta, F::splat(1.0 + 1e-4))
    }
}

/// A surface's parameters at a point.
#[derive(Clone, Copy)]
pub struct Parameters<F: Float> {
    /// About the shading normal, on the viewer's side.
    pub frame: ShadingFrame<F>,
    /// On the viewer's side.
    pub geometric_normal: Vector<F>,
    /// Albedo of diffuse light, before what lies above takes its part.
    pub diffuse: Color<F>,
    /// The same for what leaves on the other side.
    pub back: Color<F>,
    /// Reflectance straight on of what is no metal.
    pub f0: Color<F>,
    /// At grazing angles.
    pub f90: Color<F>,
    /// Reflectance straight on of what is metal.
    pub metal: Color<F>,
    /// How much of the surface is metal.
    pub metallic: F,
    /// Widths along the frame's x and y.
    pub ggx: Ggx<F>,
    /// √α, the mean of both.
    pub roughness: F,
    /// Factor on transmitted light.
    pub through: Color<F>,
    /// Index of refraction on the viewer's side over that on the other.
    pub eta: F,
    /// Where the viewer is within the body.
    pub inside: F::Mask,
    /// `eta` for each colour, if the colours differ.
    pub spectrum: Spectrum<F>,
    /// The clear layer above it.
    pub coat: Coat<F>,
    /// Fibres above it.
    pub sheen: SheenParams<F>,
    /// The film on its mirror lobe.
    pub film: ThinFilm<F>,
}
