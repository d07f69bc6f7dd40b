//! Directions drawn from the lobes of a surface.

use super::bsdf::Bsdf;
use super::ggx::Ggx;
use super::reflectance::schlick;
use crate::math::{Color, Vector};
use crate::sampling::warp::concentric_disk;
use crate::simd::{Float, Mask};

/// A direction that a path may take.
pub struct BsdfSample<F: Float> {
    /// Unit vector in the world.
    pub direction: Vector<F>,
    /// Value · |cos| / density.
    pub weight: Color<F>,
    /// Density per steradian, 0 for a mirror's.
    pub pdf: F,
    /// Where there is one.
    pub valid: F::Mask,
    /// Where it leads to the other side.
    pub through: F::Mask,
    /// Where it was drawn from a lobe that is wide.
    pub wide: F::Mask,
}

impl<F: Float> Bsdf<F> {
    /// A direction by importance: `choice` picks the lobe, `u` the direction in it.
    #[inline(always)]
    pub fn sample(&self, choice: F, u: (F, F), mask: F::Mask) -> BsdfSample<F> {
        let zero = F::zero();
        let [diffuse, back, mirror, through, _] = self.chance;
        let below_diffuse = choice.lt(diffuse);
        let below_back = choice.lt(diffuse + back);
        let below_mirror = choice.lt(diffuse + back + mirror);
        let below_through = choice.lt(diffuse + back + mirror + through);
        let is_diffuse = below_diffuse;
        let is_back = below_back & !below_diffuse;
        let is_mirror = below_mirror & !below_back;
        let is_through = below_through & !below_mirror;
        let is_coat = !below_through;

        let mut direction = self.p.frame.z;
        let mut delta = F::Mask::from_bits(0);
        let mut delta_weight = Color::black();
        let (mut is_mirror, mut is_through) = (is_mirror, is_through);
        let wide = is_diffuse | is_back;
        if (mask & wide).any() {
            // Cosine-distributed: a disk, lifted to the hemisphere (PBRT 4th ed., A.5.3).
            let (x, y) = concentric_disk(u.0, u.1);
            let z = (F::one() - x * x - y * y).max(F::splat(1e-8)).sqrt();
            direction = self.p.frame.world(Vector::new(x, y, F::select(is_back, -z, z)));
        }
        if self.has.specular && (mask & (is_mirror | is_through)).any() {
            let narrow = self.narrow(u, is_through);
            direction =
                Vector::select(is_mirror | is_through, self.p.frame.world(narrow.direction), direction);
            let exact = (is_mirror | is_through) & self.smooth;
            delta = exact;
            delta_weight = narrow.weight;
            is_mirror = is_mirror & narrow.valid;
            is_through = is_through & narrow.valid;
        }
        if self.has.coat && (mask & is_coat).any() {
            let coat = &self.p.coat;
            let alpha = coat.roughness * coat.roughness;
            let h = Ggx { x: alpha, y: alpha }.sample(self.coat_wo, u);
            let up = Vector::new(zero, zero, F::one());
            let h = Vector::select(self.coat_smooth, up, h);
            let cos = self.coat_wo.dot(h);
            let wi = coat.frame.world(h * (F::splat(2.0) * cos) - self.coat_wo);
            direction = Vector::select(is_coat, wi, direction);
            let exact = is_coat & self.coat_smooth;
            delta = delta | exact;
            let weight = schlick(coat.f0, coat.f90, cos.max(zero)) * (coat.weight / self.chance[4]);
            delta_weight = Color::select(exact, weight, delta_weight);
        }
        let valid = is_diffuse | is_back | is_mirror | is_through | is_coat;
        let direction = direction.normalize();
        let goes_through = is_back | is_through;
        let side = self.p.geometric_normal.dot(direction);
        let right_side = F::select(goes_through, -side, side).gt(zero);
        let (value, pdf) =
            if (mask & !delta).any() { self.evaluate(direction, mask) } else { (Color::black(), zero) };
        let weight = Color::select(delta, delta_weight, value * (F::one() / pdf.max(F::splat(1e-20))));
        let possible = delta | pdf.gt(zero);
        BsdfSample {
            direction,
            weight,
            pdf: F::select(delta, zero, pdf),
            valid: mask & valid & right_side & possible,
            through: goes_through,
            wide,
        }
    }

    /// A direction of the mirror's or of what goes through, in the frame; and its weight where
    /// the surface is smooth.
    #[inline(always)]
    fn narrow(&self, u: (F, F), through: F::Mask) -> ThroughSmall<F> {
        let (zero, p) = (F::zero(), &self.p);
        let up = Vector::new(zero, zero, F::one());
        let h =
            if (!self.smooth).any() { Vector::select(self.smooth, up, p.ggx.sample(self.wo, u)) } else { up };
        let cos = self.wo.dot(h);
        let reflected = h * (F::splat(2.0) * cos) - self.wo;
        let part = self.fresnel(cos.max(zero));
        let weight = part * (self.below / self.chance[2]);
        if !self.has.transmission {
            return ThroughSmall { direction: reflected, weight, valid: F::Mask::from_bits(u32::MAX) };
        }
        let passes = self.through() * part.complement() * (self.below / self.chance[3]);
        let (bent, possible) = if self.has.solid {
            let sin2 = p.eta * p.eta * (F::one() - cos * cos).max(zero);
            let cos_t = (F::one() - sin2).max(zero).sqrt();
            (h * (p.eta * cos - cos_t) - self.wo * p.eta, sin2.lt(F::one()))
        } else {
            (Vector::new(reflected.x, reflected.y, -reflected.z), F::Mask::from_bits(u32::MAX))
        };
        ThroughSmall {
            direction: Vector::select(through, bent, reflected),
            weight: Color::select(through, passes, weight),
            valid: possible | !through,
        }
    }
}

struct ThroughSmall<F: Float> {
    direction: Vector<F>,
    weight: Color<F>,
    valid: F::Mask,
}
