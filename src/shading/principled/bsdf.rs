//! The BSDF of physically based surfaces: lobes of diffuse reflection and transmission, of a rough mirror, of rough
//! transmission and of a clear coat, in the local frame of the shading normal.
//!
//! Layers divide light by their directional albedos, so that energy is conserved: light that the mirror lobe does not
//! reflect reaches the lobes below (glTF 2.0, appendix B, with the Fresnel mix of single microfacets replaced by the
//! mix of whole lobes; Kulla and Conty 2017).

use super::albedo::{self, Albedo};
use super::anisotropic;
use super::parameters::{LobeFlags, Parameters};
use super::reflectance::{DirectionalAlbedo, Reflectance};
use super::sheen;
use super::tables::{ANISOTROPIC, MIRROR, SHEEN};
use crate::math::{Color, Vector};
use crate::scene::material::SMOOTH;
use crate::simd::{Float, Mask, Outlined};

const PI: f32 = std::f32::consts::PI;

/// The BSDF of a surface seen from one direction.
pub struct Bsdf<F: Float> {
    pub(super) has: LobeFlags,
    pub(super) p: Parameters<F>,
    /// Direction to the viewer, in the frame.
    pub(super) wo: Vector<F>,
    /// Set if the mirror lobe is that of a perfect mirror.
    pub(super) smooth: F::Mask,
    /// Smith's Λ of the viewer's direction.
    pub(super) lambda: F,
    pub(super) own: DirectionalAlbedo<F>,
    pub(super) mean: Albedo<F>,
    /// Albedo of single reflections, for the viewer.
    pub(super) once: Reflectance<F>,
    /// Albedo of light that is reflected more than once between microfacets.
    pub(super) multiple: Color<F>,
    /// Compensates for light lost between the microfacets of transmissive bodies.
    pub(super) gain: Reflectance<F>,
    /// The dielectric's part of `multiple`.
    pub(super) dielectric: Color<F>,
    /// The metal's part of `multiple`.
    pub(super) further_metal: Color<F>,
    /// 1 − albedo of the dielectric's mirror lobe, for the viewer, and its mean.
    pub(super) left: Color<F>,
    pub(super) left_mean: Color<F>,
    /// The mean of `left` over directions on the other side, for bodies that scatter light there.
    pub(super) left_mean_behind: F,
    /// The fraction of light that passes the layers above the base.
    pub(super) below: F,
    /// The fraction of light that passes the clear coat.
    below_coat: F,
    pub(super) coat_wo: Vector<F>,
    pub(super) coat_smooth: F::Mask,
    /// Probabilities of the lobes: diffuse, back, microfacets, coat. [`Bsdf::reflects`] is the probability that a
    /// microfacet reflects instead of transmitting.
    pub(super) chance: [F; 4],
}

impl<F: Float> Bsdf<F> {
    /// The BSDF for light that leaves along `to_viewer`.
    #[inline(always)]
    pub fn new(has: LobeFlags, p: Parameters<F>, to_viewer: Vector<F>, mask: F::Mask) -> Self {
        let (zero, one, black) = (F::zero(), F::one(), Color::black());
        let white = black.complement();
        let wo = p.frame.local(to_viewer);
        let none = F::Mask::from_bits(0);
        let nothing = Albedo { at_normal: zero, at_grazing: zero };
        let mut bsdf = Self {
            has,
            p,
            wo,
            smooth: none,
            lambda: zero,
            own: DirectionalAlbedo { albedo: nothing, cosines: [zero; 2] },
            mean: nothing,
            once: Reflectance { dielectric: black, metal: black },
            multiple: black,
            gain: Reflectance { dielectric: white, metal: white },
            dielectric: black,
            further_metal: black,
            left: white,
            left_mean: white,
            left_mean_behind: one,
            below: one,
            below_coat: one,
            coat_wo: wo,
            coat_smooth: none,
            chance: [zero; 4],
        };
        if has.specular {
            bsdf.smooth = p.ggx.x.max(p.ggx.y).lt(F::splat(SMOOTH));
            bsdf.lambda = p.ggx.lambda(wo);
            bsdf.own = bsdf.seen(wo, mask);
            bsdf.mean = if has.anisotropic {
                anisotropic::average(&ANISOTROPIC, &p.ggx, mask)
            } else {
                albedo::average(&MIRROR, p.roughness, mask)
            };
            bsdf.mirror_albedos(mask);
        }
        if has.solid {
            bsdf.divide(mask);
        }
        bsdf.layers(to_viewer, mask);
        bsdf.choose();
        bsdf
    }

    /// The directional albedo of the mirror lobe for a direction on either side.
    #[inline(always)]
    fn seen(&self, w: Vector<F>, mask: F::Mask) -> DirectionalAlbedo<F> {
        let cosines = if self.has.film || self.has.edge {
            albedo::cosines(&MIRROR, w.z.abs(), self.p.roughness, mask)
        } else {
            [F::zero(); 2]
        };
        DirectionalAlbedo { albedo: self.albedo(w, mask), cosines }
    }

    /// The albedo of a single bounce.
    #[inline(always)]
    fn albedo(&self, w: Vector<F>, mask: F::Mask) -> Albedo<F> {
        if self.has.anisotropic {
            return anisotropic::directional(&ANISOTROPIC, w, &self.p.ggx, mask);
        }
        albedo::directional(&MIRROR, w.z.abs(), self.p.roughness, mask)
    }

    /// Attenuates the base by sheen and clear coat.
    #[inline(always)]
    fn layers(&mut self, to_viewer: Vector<F>, mask: F::Mask) {
        let one = F::one();
        if self.has.coat {
            let coat = &self.p.coat;
            self.coat_wo = coat.frame.local(to_viewer);
            let alpha = coat.roughness * coat.roughness;
            self.coat_smooth = alpha.lt(F::splat(SMOOTH));
            let reflected = self.coat_albedo(mask);
            self.below_coat = one - reflected;
            self.below = self.below_coat;
        }
        if self.has.sheen {
            let sheen = &self.p.sheen;
            let albedo = sheen::albedo(&SHEEN, self.wo.z, sheen.roughness, mask);
            self.below = self.below * (one - sheen.color.max_component() * albedo);
        }
    }

    /// Sets the lobes' probabilities in proportion to their albedos.
    #[inline(always)]
    fn choose(&mut self) {
        let (zero, p) = (F::zero(), &self.p);
        let left = self.left.luminance();
        let mut diffuse = zero;
        let mut back = zero;
        let (mut microfacets, mut coat) = (zero, zero);
        if self.has.diffuse {
            diffuse = p.diffuse.luminance() * left;
        }
        if self.has.diffuse_transmission {
            back = p.diffuse_transmission.luminance() * left;
        }
        if self.has.specular {
            microfacets = self.mixed(self.once).luminance().max(F::splat(1e-3));
            if !self.has.solid {
                let often = self.multiple.luminance() * (F::one() - self.own.albedo.whole());
                diffuse = diffuse + F::select(self.smooth, zero, often);
            }
        }
        if self.has.transmission {
            let fresnel = self.fresnel(self.wo.z.abs());
            let through = (p.transmission * fresnel.dielectric.complement()).luminance();
            let reflected = self.mixed(fresnel).luminance();
            microfacets = through + if self.has.solid { reflected } else { microfacets };
            if !self.has.solid {
                let often = self.often_through().luminance() * (F::one() - self.own.albedo.whole());
                back = back + F::select(self.smooth, zero, often);
            }
        }
        if self.has.coat {
            coat = F::one() - self.below_coat;
        }
        let [mut diffuse, back, microfacets] = [diffuse, back, microfacets].map_each(self.below);
        if self.has.sheen {
            // The sheen has no directions of its own.
            diffuse = diffuse + (self.below_coat - self.below);
        }
        let scale = F::one() / (diffuse + back + microfacets + coat).max(F::splat(1e-20));
        self.chance = [diffuse * scale, back * scale, microfacets * scale, coat * scale];
    }

    /// The probability that a sampled microfacet reflects, by its own Fresnel term. That of the mean microfacet is a
    /// poor estimate if many reflect all light and many hardly any.
    #[inline(always)]
    pub(super) fn reflects(&self, fresnel: &Reflectance<F>) -> F {
        if !self.has.transmission {
            return F::one();
        }
        let reflected = self.mixed(*fresnel).luminance();
        let through = (self.p.transmission * fresnel.dielectric.complement()).luminance();
        reflected / (reflected + through).max(F::splat(1e-20))
    }

    /// The value · |cos| and the density for light from `direction`, without perfect mirrors.
    #[inline(always)]
    pub fn evaluate(&self, direction: Vector<F>, mask: F::Mask) -> (Color<F>, F) {
        if self.has.is_matte() {
            return self.value(direction, mask);
        }
        F::outlined(Evaluate { bsdf: self, direction, mask })
    }

    #[inline(always)]
    fn value(&self, direction: Vector<F>, mask: F::Mask) -> (Color<F>, F) {
        let (zero, p) = (F::zero(), &self.p);
        let wi = p.frame.local(direction);
        let side = p.geometric_normal.dot(direction);
        let front = wi.z.gt(zero) & side.gt(zero);
        let behind = wi.z.lt(zero) & side.lt(zero);
        let (mut value, mut pdf) = (Color::black(), zero);
        let cos = wi.z.abs();
        let lambert = cos * F::splat(1.0 / PI);
        let mut incoming = Color::black().complement();
        if self.has.specular {
            let (lobe, density, left) = self.mirror(wi, mask & front);
            incoming = left;
            value = value + lobe;
            pdf = pdf + density * self.chance[2];
        }
        pdf = pdf + self.wide_density(cos, false) * self.chance[0];
        if self.has.diffuse {
            value = value + self.diffuse_value(incoming, lambert);
        }
        value = value * self.below;
        if self.has.sheen {
            let lobe = sheen::evaluate(p.sheen.color, p.sheen.roughness, self.wo, wi);
            value = value + lobe * (cos * self.below_coat);
        }
        value = Color::select(front, value, Color::black());
        pdf = F::select(front, pdf, zero);
        if self.has.diffuse_transmission || self.has.transmission {
            let (lobe, density) = self.far_side(wi, lambert, mask & behind);
            value = value + Color::select(behind, lobe * self.below, Color::black());
            pdf = pdf + F::select(behind, density, zero);
        }
        if self.has.coat {
            // The clear coat's reflection depends on its own normals, not on those of the base.
            let (lobe, density) = self.coat(direction, side.gt(zero));
            value = value + lobe;
            pdf = pdf + density * self.chance[3];
        }
        (value, pdf)
    }

    /// The probability of sampling the diffuse lobe.
    #[inline(always)]
    pub fn diffuse_chance(&self) -> F {
        self.chance[0]
    }

    /// The shading normal, on the viewer's side.
    #[inline(always)]
    pub fn normal(&self) -> Vector<F> {
        self.p.frame.z
    }

    /// The diffuse lobe's fraction of `whole`, the BSDF's value · |cos| for light from `direction`, if no coat or sheen
    /// lies above it.
    #[inline(always)]
    pub fn diffuse_part(&self, direction: Vector<F>, whole: Color<F>, mask: F::Mask) -> Color<F> {
        let (zero, black) = (F::zero(), Color::black());
        let wi = self.p.frame.local(direction);
        let front = wi.z.gt(zero) & self.p.geometric_normal.dot(direction).gt(zero);
        if !self.has.diffuse {
            return black;
        }
        if !self.has.specular {
            return Color::select(front, black.complement(), black);
        }
        let mask = mask & front;
        let incoming = self.left_towards(wi, &self.seen(wi, mask), mask);
        let value = self.diffuse_value(incoming, wi.z.abs() * F::splat(1.0 / PI)) * self.below;
        let least = F::splat(1e-30);
        let whole = Color::new(whole.r.max(least), whole.g.max(least), whole.b.max(least));
        let part = value.over(whole).clamp(0.0, 1.0);
        Color::select(front, part, black)
    }

    #[inline(always)]
    fn diffuse_value(&self, incoming: Color<F>, lambert: F) -> Color<F> {
        self.p.diffuse * self.shared(incoming) * lambert
    }

    /// The attenuation of the diffuse lobe by the mirror lobe above it, for both directions.
    #[inline(always)]
    fn shared(&self, incoming: Color<F>) -> Color<F> {
        if !self.has.specular || self.has.constant_fresnel {
            return self.left;
        }
        (self.left * incoming).over(self.left_mean)
    }

    /// The value of the mirror lobe with all its bounces, the density of single bounces, and the fraction of light from
    /// that direction that passes the lobe.
    #[inline(always)]
    fn mirror(&self, wi: Vector<F>, mask: F::Mask) -> (Color<F>, F, Color<F>) {
        let (zero, p) = (F::zero(), &self.p);
        let other = self.seen(wi, mask);
        let incoming = if self.has.diffuse { self.left_towards(wi, &other, mask) } else { Color::black() };
        let h = (self.wo + wi).normalize();
        let density = p.ggx.density(h) / (F::splat(4.0) * self.wo.z);
        let visible = F::one() / (F::one() + self.lambda + p.ggx.lambda(wi));
        let fresnel = self.fresnel(self.wo.dot(h).max(zero));
        let bounces = density * visible;
        let value = if self.has.solid {
            self.mixed(fresnel.by(&self.gain)) * bounces
        } else {
            let multiple = self.multiple * (self.lost(&other.albedo) * wi.z * F::splat(1.0 / PI));
            self.mixed(fresnel) * bounces + multiple
        };
        let rough = !self.smooth;
        let pdf = density / (F::one() + self.lambda) * self.reflects(&fresnel);
        (Color::select(rough, value, Color::black()), F::select(rough, pdf, zero), incoming)
    }

    /// The value and density for light from the other side.
    #[inline(always)]
    fn far_side(&self, wi: Vector<F>, lambert: F, mask: F::Mask) -> (Color<F>, F) {
        let (zero, p) = (F::zero(), &self.p);
        let (mut value, mut pdf) = (Color::black(), zero);
        if self.has.diffuse_transmission {
            let mut lobe = p.diffuse_transmission * self.left * lambert;
            if self.has.solid && !self.has.constant_fresnel {
                let eta = F::one() / p.eta;
                lobe = lobe * (self.left_by_body(wi, eta, mask) / self.left_mean_behind);
            }
            value = value + lobe;
        }
        pdf = pdf + self.wide_density(wi.z.abs(), true) * self.chance[1];
        if !self.has.transmission || !(mask & !self.smooth).any() {
            return (value, pdf);
        }
        let (mut lobe, density) = if self.has.solid { self.bent(wi) } else { self.unbent(wi) };
        if !self.has.solid {
            let other = self.albedo(wi, mask);
            lobe = lobe + self.often_through() * (self.lost(&other) * lambert);
        }
        let rough = !self.smooth;
        value = value + Color::select(rough, lobe, Color::black());
        pdf = pdf + F::select(rough, density, zero) * self.chance[2];
        (value, pdf)
    }

    /// The transmitted part of the light that a thin sheet's microfacets neither reflect nor transmit in a single
    /// bounce: all that is not reflected in further bounces.
    #[inline(always)]
    fn often_through(&self) -> Color<F> {
        self.p.transmission * self.dielectric.complement()
    }

    /// The angular distribution of light that bounced more than once, relative to that of a diffuse surface, for a
    /// direction of albedo `other` (Kulla and Conty 2017).
    #[inline(always)]
    fn lost(&self, other: &Albedo<F>) -> F {
        let lost_mean = (F::one() - self.mean.whole()).max(F::splat(1e-5));
        (F::one() - self.own.albedo.whole()) * (F::one() - other.whole()) / lost_mean
    }

    /// Transmission by a thin sheet: the mirror lobe, flipped to the other side.
    #[inline(always)]
    fn unbent(&self, wi: Vector<F>) -> (Color<F>, F) {
        let p = &self.p;
        let turned = Vector::new(wi.x, wi.y, -wi.z);
        let h = (self.wo + turned).normalize();
        let density = p.ggx.density(h) / (F::splat(4.0) * self.wo.z);
        let visible = F::one() / (F::one() + self.lambda + p.ggx.lambda(turned));
        let fresnel = self.fresnel(self.wo.dot(h).max(F::zero()));
        let pdf = density / (F::one() + self.lambda) * (F::one() - self.reflects(&fresnel));
        (p.transmission * fresnel.dielectric.complement() * (density * visible), pdf)
    }

    /// The factor on transmitted light, for the wavelength of the path.
    #[inline(always)]
    pub(super) fn transmission(&self) -> Color<F> {
        if self.has.dispersion { self.p.transmission * self.p.spectrum.tint } else { self.p.transmission }
    }

    /// True if microfacets transmit light.
    #[inline(always)]
    pub fn lets_microfacets_through(&self) -> bool {
        self.has.transmission
    }

    /// True if light from behind can reach the viewer.
    #[inline(always)]
    pub fn lets_through(&self) -> bool {
        self.has.diffuse_transmission || self.has.transmission
    }

    /// Set if light samples can contribute: perfect mirrors need none.
    #[inline(always)]
    pub fn scatters(&self) -> F::Mask {
        let wide = self.chance[0] + self.chance[1];
        let rough = F::select(self.smooth, F::zero(), self.chance[2]);
        let coat = F::select(self.coat_smooth, F::zero(), self.chance[3]);
        (wide + rough + coat).gt(F::zero())
    }
}

/// Outlined, because [`Bsdf::evaluate`] is needed for light samples and for sampled directions.
struct Evaluate<'a, F: Float> {
    bsdf: &'a Bsdf<F>,
    direction: Vector<F>,
    mask: F::Mask,
}

impl<F: Float> Outlined for Evaluate<'_, F> {
    type Output = (Color<F>, F);
    #[inline(always)]
    fn run(self) -> (Color<F>, F) {
        self.bsdf.value(self.direction, self.mask)
    }
}

/// Multiplication of all elements by one factor.
trait MapEach<F> {
    fn map_each(self, factor: F) -> Self;
}

impl<F: Float> MapEach<F> for [F; 3] {
    #[inline(always)]
    fn map_each(self, factor: F) -> Self {
        let [a, b, c] = self;
        [a * factor, b * factor, c * factor]
    }
}
