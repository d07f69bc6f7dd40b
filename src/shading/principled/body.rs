//! Refractive boundaries of bodies: the division of light, and the part that is left for scattering within.

use super::bsdf::Bsdf;
use super::glass::Divided;
use super::reflectance::DirectionalAlbedo;
use super::tables::{ANISOTROPIC_GLASS, GLASS};
use crate::math::{Color, Vector};
use crate::shading::fresnel;
use crate::simd::{Float, Mask};

/// The largest probability of drawing a scattered direction within a rough body from the cone in which most of them
/// leave it; within smooth bodies it is 1.
const CONE_FRACTION: f32 = 0.9;

impl<F: Float> Bsdf<F> {
    /// The density of scattered directions at an angle to the normal, on the viewer's side or behind the surface.
    ///
    /// It is the cosine's, but within a body most directions are drawn from the cone of the critical angle, the
    /// refracted image of the hemisphere outside: directions beyond it would seldom leave the body.
    #[inline(always)]
    pub(super) fn wide_density(&self, cos: F, is_behind: bool) -> F {
        let lambert = cos * F::splat(std::f32::consts::FRAC_1_PI);
        if !self.has.solid {
            return lambert;
        }
        // More than 1 on the denser side.
        let ratio = (if is_behind { F::one() / self.p.eta } else { self.p.eta }).max(F::one());
        let in_cone = (F::one() - cos * cos).lt(F::one() / (ratio * ratio));
        let part = self.cone_fraction();
        let of_cone = F::select(in_cone, part * (ratio * ratio), F::zero());
        lambert * (F::one() - part + of_cone)
    }

    /// A factor on the sine of a cosine-distributed direction which gives it the density [`Bsdf::wide_density`], for a
    /// random number.
    #[inline(always)]
    pub(super) fn wide_sine(&self, is_behind: F::Mask, which: F) -> F {
        if !self.has.solid {
            return F::one();
        }
        let eta = F::select(is_behind, F::one() / self.p.eta, self.p.eta);
        F::select(which.lt(self.cone_fraction()), F::one() / eta.max(F::one()), F::one())
    }

    #[inline(always)]
    fn cone_fraction(&self) -> F {
        // The sheen shares the lobe's directions, and is bright at grazing angles.
        if self.has.sheen {
            return F::zero();
        }
        // Microfacets tilted by as much as the cone is wide transmit light from all directions.
        let eta = self.p.eta;
        let tilt = self.p.roughness * self.p.roughness * eta.max(F::one() / eta);
        F::select(self.smooth, F::one(), (F::one() - tilt * F::splat(0.7)).clamp(0.0, CONE_FRACTION))
    }

    /// Divides light between reflection, transmission and scattering within bodies.
    #[inline(always)]
    pub(super) fn divide(&mut self, mask: F::Mask) {
        let scatters = self.has.diffuse || self.has.diffuse_transmission;
        if scatters {
            // Schlick's term lacks total reflection.
            self.left = self.fresnel(self.wo.z).dielectric.complement();
            self.left_mean = Color::grey(self.left_mean_of_body(self.p.eta, mask));
            if self.has.diffuse_transmission {
                self.left_mean_behind = self.left_mean_of_body(F::one() / self.p.eta, mask);
            }
        }
        let rough = mask & !self.smooth;
        if !rough.any() {
            return;
        }
        let divided = self.divided(self.wo, self.p.eta, mask);
        let gain = divided.gain(self.own.albedo.whole());
        let mut reflected = Color::grey(divided.reflected);
        self.gain.dielectric = Color::grey(gain);
        if self.has.film {
            (self.gain.dielectric, reflected) = self.glass_under_film(gain, reflected.r);
        }
        if self.has.metallic {
            self.gain.metal = self.gain_of_metal();
        }
        if scatters {
            self.left = Color::select(rough, reflected.complement(), self.left);
        }
    }

    /// The division of light from a direction by a body's rough boundary, for a ratio of indices `eta`.
    #[inline(always)]
    fn divided(&self, w: Vector<F>, eta: F, mask: F::Mask) -> Divided<F> {
        if self.has.anisotropic {
            return ANISOTROPIC_GLASS.directional(w, &self.p.ggx, eta, mask);
        }
        GLASS.directional(w.z.abs(), self.p.roughness, eta, mask)
    }

    /// The fraction of light from a direction on either side that a body's boundary does not reflect: light scattered
    /// within leaves by the same boundary through which it came. Films are ignored here, so surfaces with a film are
    /// not reciprocal.
    #[inline(always)]
    pub(super) fn left_by_body(&self, w: Vector<F>, eta: F, mask: F::Mask) -> F {
        let mut reflected = fresnel::reflectance(w.z.abs(), eta);
        let rough = mask & !self.smooth;
        if rough.any() {
            reflected = F::select(self.smooth, reflected, self.divided(w, eta, rough).reflected);
        }
        F::one() - reflected
    }

    /// The mean of [`Bsdf::left_by_body`] over the hemisphere.
    #[inline(always)]
    fn left_mean_of_body(&self, eta: F, mask: F::Mask) -> F {
        let mut mean = GLASS.smooth_transmitted_mean(eta, mask);
        let rough = mask & !self.smooth;
        if rough.any() {
            let of_rough = if self.has.anisotropic {
                ANISOTROPIC_GLASS.transmitted_mean(&self.p.ggx, eta, rough)
            } else {
                GLASS.transmitted_mean(self.p.roughness, eta, rough)
            };
            mean = F::select(self.smooth, mean, of_rough);
        }
        mean.max(F::splat(1e-6))
    }

    /// The light from a direction on the viewer's side that the mirror lobe does not reflect.
    #[inline(always)]
    pub(super) fn left_towards(&self, wi: Vector<F>, seen: &DirectionalAlbedo<F>, mask: F::Mask) -> Color<F> {
        if self.has.solid { Color::grey(self.left_by_body(wi, self.p.eta, mask)) } else { self.left_by(seen) }
    }

    /// Refraction by microfacets: value and density (Walter and others 2007; PBRT 4th ed., 9.7).
    #[inline(always)]
    pub(super) fn bent(&self, wi: Vector<F>) -> (Color<F>, F) {
        let (zero, p) = (F::zero(), &self.p);
        let h = self.wo * p.eta + wi;
        let square = h.dot(h);
        let meets = square.gt(F::splat(1e-12));
        let h = h * (F::one() / F::select(meets, square, F::one()).sqrt());
        let h = Vector::select(h.z.lt(zero), -h, h);
        let (cos_o, cos_i) = (self.wo.dot(h), wi.dot(h));
        let valid = meets & cos_o.gt(zero) & cos_i.lt(zero);
        let denominator = cos_i + cos_o * p.eta;
        let jacobian = -cos_i / (denominator * denominator).max(F::splat(1e-12));
        let density = p.ggx.density(h) * cos_o / self.wo.z * jacobian;
        let visible = F::one() / (F::one() + self.lambda + p.ggx.lambda(wi));
        let fresnel = self.fresnel(cos_o.max(zero));
        let passes = self.transmitted(&fresnel) * self.gain.dielectric;
        let value = passes * (density * visible);
        let pdf = density / (F::one() + self.lambda) * (F::one() - self.reflects(&fresnel));
        (Color::select(valid, value, Color::black()), F::select(valid, pdf, zero))
    }
}
