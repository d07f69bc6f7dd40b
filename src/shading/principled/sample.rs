//! Importance sampling of a surface's lobes.

use super::bsdf::Bsdf;
use super::ggx::Ggx;
use super::reflectance::schlick;
use crate::math::{Color, Vector};
use crate::sampling::warp::concentric_disk;
use crate::simd::{Float, Mask};

/// A sampled direction.
pub struct BsdfSample<F: Float> {
    /// Unit vector in world space.
    pub direction: Vector<F>,
    /// Value · |cos| / density.
    pub weight: Color<F>,
    /// Density per steradian; 0 for a perfect mirror.
    pub pdf: F,
    /// Set if there is a direction.
    pub valid: F::Mask,
    /// Set if the direction leads to the other side.
    pub transmitted: F::Mask,
    /// Set if the direction was drawn from a diffuse lobe.
    pub wide: F::Mask,
}

impl<F: Float> Bsdf<F> {
    /// Samples a direction by importance. `u` selects the lobe and the direction in it. `which` selects reflection or
    /// transmission at microfacets that may do both, and if a scattered direction within a body is drawn from a cone
    /// ([`Bsdf::wide_sine`]). `budget` is the mean number of directions that may be followed, 1 or more;
    /// [`Bsdf::sample_other`] returns the second one.
    #[inline(always)]
    pub fn sample(&self, which: F, budget: F, u: (F, F), mask: F::Mask) -> BsdfSample<F> {
        let zero = F::zero();
        let Lobe { is_diffuse, is_back, is_microfacet, is_coat, u } = self.lobe(u);

        let mut direction = self.p.frame.z;
        let none = F::Mask::from_bits(0);
        let mut delta = none;
        let mut delta_weight = Color::black();
        let (mut is_through, mut possible) = (none, F::Mask::from_bits(u32::MAX));
        let wide = is_diffuse | is_back;
        if (mask & wide).any() {
            // Cosine-distributed, except in bodies: a disk, lifted to the hemisphere (PBRT 4th ed., A.5.3).
            let (x, y) = concentric_disk(u.0, u.1);
            let scale = self.wide_sine(is_back, which);
            let (x, y) = (x * scale, y * scale);
            let z = (F::one() - x * x - y * y).max(F::splat(1e-8)).sqrt();
            direction = self.p.frame.world(Vector::new(x, y, F::select(is_back, -z, z)));
        }
        if self.has.specular && (mask & is_microfacet).any() {
            let narrow = self.narrow(u, which, self.budget(budget), none);
            direction = Vector::select(is_microfacet, self.p.frame.world(narrow.direction), direction);
            delta = is_microfacet & self.smooth;
            delta_weight = narrow.weight;
            is_through = is_microfacet & narrow.through;
            possible = narrow.valid | !is_microfacet;
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
            let weight = schlick(coat.f0, coat.f90, cos.max(zero)) * (coat.weight / self.chance[3]);
            delta_weight = Color::select(exact, weight, delta_weight);
        }
        let direction = direction.normalize();
        let goes_through = is_back | is_through;
        let side = self.p.geometric_normal.dot(direction);
        let right_side = F::select(goes_through, -side, side).gt(zero);
        let (value, pdf) =
            if (mask & !delta).any() { self.evaluate(direction, mask) } else { (Color::black(), zero) };
        let weight = Color::select(delta, delta_weight, value * (F::one() / pdf.max(F::splat(1e-20))));
        let possible = possible & (delta | pdf.gt(zero));
        BsdfSample {
            direction,
            weight,
            pdf: F::select(delta, zero, pdf),
            valid: mask & right_side & possible,
            transmitted: goes_through,
            wide,
        }
    }

    /// Samples the transmitted direction of a smooth surface, in lanes in which [`Bsdf::sample`] has drawn the
    /// reflected one from the same numbers and the budget allows both.
    #[inline(always)]
    pub fn sample_other(&self, which: F, budget: F, u: (F, F), mask: F::Mask) -> BsdfSample<F> {
        let Lobe { is_microfacet, u, .. } = self.lobe(u);
        let through = F::Mask::from_bits(u32::MAX);
        let narrow = self.narrow(u, which, self.budget(budget), through);
        let direction = self.p.frame.world(narrow.direction).normalize();
        let behind = self.p.geometric_normal.dot(direction).lt(F::zero());
        BsdfSample {
            direction,
            weight: narrow.weight,
            pdf: F::zero(),
            valid: mask & is_microfacet & self.smooth & behind & narrow.valid & narrow.both,
            transmitted: through,
            wide: F::Mask::from_bits(0),
        }
    }

    /// The number of directions that may be followed: one for rough surfaces.
    #[inline(always)]
    fn budget(&self, budget: F) -> F {
        F::select(self.smooth, budget, F::one())
    }

    /// Chooses a lobe by slices of the unit square: each lobe's points are as even within its slice as all points are
    /// within the square. With a separate number for the choice, they would only be a random subset.
    #[inline(always)]
    fn lobe(&self, u: (F, F)) -> Lobe<F> {
        let [diffuse, back, microfacets, coat] = self.chance;
        let (to_back, to_microfacets) = (diffuse + back, diffuse + back + microfacets);
        let is_diffuse = u.1.lt(diffuse);
        let below_back = u.1.lt(to_back);
        let below_microfacets = u.1.lt(to_microfacets);
        let begin = F::select(below_microfacets, to_back, to_microfacets);
        let begin = F::select(is_diffuse, F::zero(), F::select(below_back, diffuse, begin));
        let width = F::select(below_microfacets, microfacets, coat);
        let width = F::select(is_diffuse, diffuse, F::select(below_back, back, width));
        let within = (u.1 - begin) / width.max(F::splat(1e-20));
        let within = within.max(F::zero()).min(F::splat(1.0 - f32::EPSILON / 2.0));
        Lobe {
            is_diffuse,
            is_back: below_back & !is_diffuse,
            is_microfacet: below_microfacets & !below_back,
            is_coat: !below_microfacets,
            u: (u.0, within),
        }
    }

    /// Samples a direction from a microfacet, in the frame: reflected if `which` is less than the probability of
    /// reflection, except in lanes with `through` set. Also returns the weight for smooth surfaces.
    ///
    /// Two directions with probabilities p and 1 − p are candidates. With a budget of m, the first one is followed with
    /// probability min(1, m p) and the second one with min(1, m (1 − p)), both by a single number (Arvo and Kirk,
    /// "Particle transport and image synthesis", 1990).
    #[inline(always)]
    fn narrow(&self, u: (F, F), which: F, budget: F, through: F::Mask) -> FromMicrofacet<F> {
        let (zero, p) = (F::zero(), &self.p);
        let up = Vector::new(zero, zero, F::one());
        let h =
            if (!self.smooth).any() { Vector::select(self.smooth, up, p.ggx.sample(self.wo, u)) } else { up };
        let cos = self.wo.dot(h);
        let reflected = h * (F::splat(2.0) * cos) - self.wo;
        let fresnel = self.fresnel(cos.max(zero));
        let one = F::one();
        let own = self.reflects(&fresnel);
        let (reflects, passes) = ((budget * own).min(one), (budget * (one - own)).min(one));
        let reflected_first = which.lt(reflects);
        let both = reflected_first & which.ge(one - passes) & budget.gt(one);
        let through = through | !reflected_first;
        let all = F::Mask::from_bits(u32::MAX);
        let chance = self.below / self.chance[2];
        let weight = self.mixed(fresnel) * (chance / reflects.max(F::splat(1e-20)));
        if !self.has.transmission {
            return FromMicrofacet {
                direction: reflected,
                weight,
                through: F::Mask::from_bits(0),
                valid: all,
                both: F::Mask::from_bits(0),
            };
        }
        let passes = self.transmitted(&fresnel) * (chance / passes.max(F::splat(1e-20)));
        let (bent, possible) = if self.has.solid {
            let sin2 = p.eta * p.eta * (F::one() - cos * cos).max(zero);
            let cos_t = (F::one() - sin2).max(zero).sqrt();
            (h * (p.eta * cos - cos_t) - self.wo * p.eta, sin2.lt(F::one()))
        } else {
            (Vector::new(reflected.x, reflected.y, -reflected.z), all)
        };
        FromMicrofacet {
            direction: Vector::select(through, bent, reflected),
            weight: Color::select(through, passes, weight),
            through,
            valid: possible | !through,
            both,
        }
    }
}

/// The lobe of a sampled direction, and the remaining point in the unit square.
struct Lobe<F: Float> {
    is_diffuse: F::Mask,
    is_back: F::Mask,
    is_microfacet: F::Mask,
    is_coat: F::Mask,
    u: (F, F),
}

struct FromMicrofacet<F: Float> {
    direction: Vector<F>,
    weight: Color<F>,
    through: F::Mask,
    valid: F::Mask,
    /// Set if the reflected and the transmitted direction are both followed.
    both: F::Mask,
}
