//! The clear coat: a mirror lobe with Schlick's Fresnel term and its own normals, above all other lobes
//! (KHR_materials_clearcoat).

use super::albedo;
use super::bsdf::Bsdf;
use super::ggx::Ggx;
use super::reflectance::schlick;
use super::tables::MIRROR;
use crate::math::{Color, Vector};
use crate::simd::Float;

impl<F: Float> Bsdf<F> {
    /// The fraction of incident light that the clear coat reflects.
    #[inline(always)]
    pub(super) fn coat_albedo(&self, mask: F::Mask) -> F {
        let coat = &self.p.coat;
        let own = albedo::directional(&MIRROR, self.coat_wo.z, coat.roughness, mask);
        (coat.weight * (coat.f0 * own.at_normal + coat.f90 * own.at_grazing).max_component()).clamp(0.0, 1.0)
    }

    /// The value and density of the clear coat's mirror lobe.
    #[inline(always)]
    pub(super) fn coat(&self, direction: Vector<F>, outwards: F::Mask) -> (Color<F>, F) {
        let (zero, coat) = (F::zero(), &self.p.coat);
        let alpha = coat.roughness * coat.roughness;
        let ggx = Ggx { x: alpha, y: alpha };
        let wi = coat.frame.local(direction);
        let (lobe, pdf) = single_mirror(&ggx, self.coat_wo, wi);
        let h = (self.coat_wo + wi).normalize();
        let reflected = schlick(coat.f0, coat.f90, self.coat_wo.dot(h).max(zero));
        let there = outwards & wi.z.gt(zero) & !self.coat_smooth;
        let value = reflected * (lobe * coat.weight);
        (Color::select(there, value, Color::black()), F::select(there, pdf, zero))
    }
}

/// D G₂ / (4 cos_o), and the density of sampling visible normals.
#[inline(always)]
fn single_mirror<F: Float>(ggx: &Ggx<F>, wo: Vector<F>, wi: Vector<F>) -> (F, F) {
    let h = (wo + wi).normalize();
    let density = ggx.density(h) / (F::splat(4.0) * wo.z);
    let own = ggx.lambda(wo);
    (density / (F::one() + own + ggx.lambda(wi)), density / (F::one() + own))
}
