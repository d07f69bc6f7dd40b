//! Material columns to the parameters of one point.

use super::surface::Surface;
use super::texture;
use crate::math::Color;
use crate::scene::materials::flag;
use crate::scene::{Materials, Textures};
use crate::simd::{Float, Int, Mask};

/// A material's parameters where the textures have been looked up.
#[derive(Clone, Copy)]
pub struct Shaded<F: Float> {
    /// kd.
    pub diffuse: Color<F>,
    /// ks.
    pub specular: Color<F>,
    /// Exponent of the specular lobe.
    pub shininess: F,
    /// Where the lobe is Phong's.
    pub phong: F::Mask,
    /// Weight of the mirror image.
    pub kr: Color<F>,
    /// Weight of what is seen through.
    pub kt: Color<F>,
    /// Index of refraction, 0 where light does not enter.
    pub ior: F,
    /// Radiance given off to the viewer.
    pub emission: Color<F>,
}

impl<F: Float> Shaded<F> {
    /// Looks the surface's material up in the lanes of `mask`.
    #[inline(always)]
    pub fn new(materials: &Materials, textures: &Textures, surface: &Surface<F>, mask: F::Mask) -> Self {
        let id = surface.material;
        let uv = surface.uv;
        let flags = F::Int::gather(&materials.flags, id, mask);
        let dark = has(flags, flag::ONE_SIDED_EMISSION) & surface.inside;
        let tint = surface.color;
        Self {
            diffuse: texture::color(&materials.diffuse, textures, id, uv, mask)
                * Color::new(tint.x, tint.y, tint.z),
            specular: texture::color(&materials.specular, textures, id, uv, mask),
            shininess: F::gather(&materials.shininess, id, mask),
            phong: has(flags, flag::PHONG),
            kr: texture::color(&materials.kr, textures, id, uv, mask),
            kt: Color::gather(&materials.kt, id, mask),
            ior: F::gather(&materials.ior, id, mask),
            emission: Color::select(
                dark,
                Color::black(),
                texture::color(&materials.emission, textures, id, uv, mask),
            ),
        }
    }

    /// Whether any lane of the mask lets light through.
    #[inline(always)]
    pub fn any_refracts(&self, mask: F::Mask) -> bool {
        (mask & self.ior.gt(F::zero())).any()
    }
}

/// Lanes whose flags have a bit set.
#[inline(always)]
pub(super) fn has<I: Int>(flags: I, bit: u32) -> I::Mask {
    !(flags & I::splat(bit)).eq(I::splat(0))
}
