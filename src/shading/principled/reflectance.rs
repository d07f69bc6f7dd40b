//! What the mirror lobe reflects: of one microfacet by Fresnel's equations, and of all of them, for
//! one direction and on average, with what that leaves to lobes below.

use super::albedo::{self, Albedo};
use super::bsdf::Bsdf;
use super::thin_film::{Interference, ThinFilm};
use crate::math::Color;
use crate::shading::fresnel;
use crate::simd::{Float, Outlined};

/// Gauss's nodes and weights for the mean over the hemisphere, ∫ f(μ) 2μ dμ: by μ².
const NODES: [(f32, f32); 4] =
    [(0.263_499, 0.173_927_4), (0.574_465, 0.326_072_6), (0.818_529, 0.326_072_6), (0.964_660, 0.173_927_4)];

/// Separate values for dielectric and metal.
#[derive(Clone, Copy)]
pub(super) struct Reflectance<F: Float> {
    /// Of the dielectric.
    pub dielectric: Color<F>,
    /// Of the metal; meaningless if there is none.
    pub metal: Color<F>,
}

impl<F: Float> Reflectance<F> {
    #[inline(always)]
    fn times(self, factor: F) -> Self {
        Self { dielectric: self.dielectric * factor, metal: self.metal * factor }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self { dielectric: self.dielectric + other.dielectric, metal: self.metal + other.metal }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self { dielectric: self.dielectric - other.dielectric, metal: self.metal - other.metal }
    }

    #[inline(always)]
    fn clamped(self) -> Self {
        Self { dielectric: self.dielectric.clamp(0.0, 1.0), metal: self.metal.clamp(0.0, 1.0) }
    }

    /// Colour by colour.
    #[inline(always)]
    pub fn by(self, factors: &Self) -> Self {
        Self { dielectric: self.dielectric * factors.dielectric, metal: self.metal * factors.metal }
    }
}

/// How microfacets are seen from a direction.
#[derive(Clone, Copy)]
pub(super) struct DirectionalAlbedo<F: Float> {
    /// Albedo of single reflections, if all light is reflected.
    pub albedo: Albedo<F>,
    /// Cosines that stand for all under which they reflect; of no meaning without a film.
    pub cosines: [F; 2],
}

/// What a mirror lobe with Schlick's Fresnel term leaves to what lies below it.
#[derive(Clone, Copy)]
pub struct UnderMirror<F: Float> {
    /// Reflectance straight on.
    pub f0: Color<F>,
    /// At grazing angles.
    pub f90: Color<F>,
    /// Of the light that the microfacets do not reflect at once, the part that they reflect later.
    pub further: Color<F>,
}

impl<F: Float> UnderMirror<F> {
    /// What is left for a direction of this albedo.
    #[inline(always)]
    pub fn left(&self, own: &Albedo<F>) -> Color<F> {
        rest(self.f0 * own.straight + self.f90 * own.grazing, self.further, own).clamp(0.0, 1.0)
    }
}

impl UnderMirror<f32> {
    const BLACK: Color<f32> = Color { r: 0.0, g: 0.0, b: 0.0 };
    /// Nothing lies above, or nothing that depends on the direction.
    pub const NOTHING: Self = Self { f0: Self::BLACK, f90: Self::BLACK, further: Self::BLACK };

    /// Whether it is [`UnderMirror::NOTHING`].
    pub fn is_nothing(&self) -> bool {
        [self.f0, self.f90, self.further].iter().all(|c| c.max_component() <= 0.0)
    }

    /// The same in every lane.
    #[inline(always)]
    pub fn splat<F: Float>(&self) -> UnderMirror<F> {
        UnderMirror { f0: lanes(self.f0), f90: lanes(self.f90), further: lanes(self.further) }
    }
}

/// The same colour in every lane.
#[inline(always)]
fn lanes<F: Float>(c: Color<f32>) -> Color<F> {
    Color::new(F::splat(c.r), F::splat(c.g), F::splat(c.b))
}

/// What is left of light of which a part is reflected once and a part of the rest later.
#[inline(always)]
fn rest<F: Float>(once: Color<F>, further: Color<F>, own: &Albedo<F>) -> Color<F> {
    (once + further * (F::one() - own.whole())).complement()
}

impl<F: Float> Bsdf<F> {
    /// The part of light that goes straight on where the surface is smooth, if it bends none.
    #[inline(always)]
    pub fn straight(&self) -> Color<F> {
        if !self.has.transmission {
            return Color::black();
        }
        let fresnel = self.fresnel(self.wo.z.max(F::zero()));
        Color::select(self.smooth, self.transmitted(&fresnel) * self.below, Color::black())
    }

    /// What a microfacet transmits.
    #[inline(always)]
    pub(super) fn transmitted(&self, fresnel: &Reflectance<F>) -> Color<F> {
        self.through() * fresnel.dielectric.complement()
    }

    /// Reflectance of a microfacet.
    #[inline(always)]
    pub(super) fn fresnel(&self, cos: F) -> Reflectance<F> {
        let bare = self.bare(cos);
        if self.has.film && !self.has.constant_fresnel { self.covered(bare, cos) } else { bare }
    }

    /// Without a film.
    #[inline(always)]
    fn bare(&self, cos: F) -> Reflectance<F> {
        let p = &self.p;
        if self.has.constant_fresnel {
            return Reflectance { dielectric: p.f0, metal: p.f0 };
        }
        let dielectric = if self.has.dispersion {
            p.spectrum.reflectance(cos)
        } else if self.has.solid {
            Color::grey(fresnel::reflectance(cos, p.eta))
        } else {
            schlick(p.f0, p.f90, cos)
        };
        let metal =
            if self.has.metallic { schlick(p.metal, Color::grey(F::one()), cos) } else { Color::black() };
        Reflectance { dielectric, metal }
    }

    /// With one.
    #[inline(always)]
    fn covered(&self, bare: Reflectance<F>, cos: F) -> Reflectance<F> {
        let (film, metallic) = (self.p.film, self.has.metallic);
        F::outlined(Covered { film, cos: self.cos_outside(cos), bare, metallic })
    }

    /// What a film adds to the mean reflectance of microfacets, over cosines that stand for all of them.
    #[inline(always)]
    fn added_by_film(&self, cosines: &[F]) -> Reflectance<F> {
        let mut sum = Reflectance { dielectric: Color::black(), metal: Color::black() };
        for &cos in cosines {
            let bare = self.bare(cos);
            sum = sum.plus(self.covered(bare, cos).minus(bare));
        }
        sum.times(F::splat(1.0 / cosines.len() as f32))
    }

    /// Films lie on the outside of bodies: what leaves one meets its film at the angle that it has
    /// in the air, and is reflected as what comes from there.
    #[inline(always)]
    fn cos_outside(&self, cos: F) -> F {
        if !self.has.solid {
            return cos;
        }
        let eta = self.p.eta;
        let outside = (F::one() - eta * eta * (F::one() - cos * cos)).max(F::zero()).sqrt();
        F::select(self.p.inside, outside, cos)
    }

    #[inline(always)]
    pub(super) fn mixed(&self, parts: Reflectance<F>) -> Color<F> {
        if !self.has.metallic {
            return parts.dielectric;
        }
        parts.dielectric.mix(parts.metal, self.p.metallic)
    }

    /// All albedos of the mirror lobe for the viewer.
    #[inline(always)]
    pub(super) fn mirror_albedos(&mut self, mask: F::Mask) {
        let average = self.average(mask);
        self.once = self.singly(&self.own.albedo, &self.own.cosines);
        let further =
            Reflectance { dielectric: self.further(average.dielectric), metal: self.further(average.metal) };
        self.dielectric = further.dielectric;
        self.further_metal = further.metal;
        self.multiple = self.mixed(further);
        self.left = self.left_by(&self.own);
        let once = if self.has.film {
            average.dielectric * self.mean.whole()
        } else {
            self.singly(&self.mean, &[]).dielectric
        };
        self.left_mean = rest(once, self.dielectric, &self.mean).clamp(1e-6, 1.0);
    }

    /// Albedo of single reflections by microfacets.
    #[inline(always)]
    fn singly(&self, own: &Albedo<F>, cosines: &[F]) -> Reflectance<F> {
        let p = &self.p;
        if self.has.constant_fresnel {
            return Reflectance { dielectric: p.f0 * own.whole(), metal: Color::black() };
        }
        let metal = if self.has.metallic {
            p.metal * own.straight + Color::grey(own.grazing)
        } else {
            Color::black()
        };
        let bare = Reflectance { dielectric: p.f0 * own.straight + p.f90 * own.grazing, metal };
        if !self.has.film {
            return bare;
        }
        bare.plus(self.added_by_film(cosines).times(own.whole())).clamped()
    }

    /// The factor that makes up for light lost between microfacets, where it is given back by them.
    #[inline(always)]
    pub(super) fn gain_of_metal(&self) -> Color<F> {
        let (once, least) = (self.once.metal, F::splat(1e-6));
        let later = self.further_metal * (F::one() - self.own.albedo.whole());
        let divisor = Color::new(once.r.max(least), once.g.max(least), once.b.max(least));
        (once + later).over(divisor)
    }

    /// For rough glass with a film: what leaves at once (one over a gain), and the part of it that is reflected. The
    /// film reflects a different part, of which a different part is lost between microfacets.
    #[inline(always)]
    pub(super) fn glass_under_film(&self, gain: F, reflected: F) -> (Color<F>, Color<F>) {
        let (one, kept) = (F::one(), self.own.albedo.whole().max(F::splat(0.05)));
        let added = self.added_by_film(&self.own.cosines).dielectric;
        let (plain_back, plain_through) = (reflected / gain, (one - reflected) / gain);
        // What each microfacet does not reflect.
        let rest = (one - plain_back / kept).max(F::splat(1e-3));
        let back = (added * kept + Color::grey(plain_back)).clamp(0.0, 1.0);
        let through = (added * (one / rest)).clamp(-1e3, 1.0).complement() * plain_through;
        let both = back + through;
        (Color::grey(one).over(both), back.over(both))
    }

    /// Mean reflectance over the hemisphere.
    #[inline(always)]
    fn average(&self, mask: F::Mask) -> Reflectance<F> {
        let p = &self.p;
        if !self.has.film {
            let part = F::splat(if self.has.constant_fresnel { 0.0 } else { 1.0 / 21.0 });
            let white = Color::grey(F::one());
            return Reflectance { dielectric: p.f0.mix(p.f90, part), metal: p.metal.mix(white, part) };
        }
        let mut sum = Reflectance { dielectric: Color::black(), metal: Color::black() };
        let mut weights = F::zero();
        for (cos, weight) in NODES {
            let (table, cos) = (self.tables.mirror, F::splat(cos));
            let own = albedo::directional(table, cos, p.roughness, mask);
            let [low, high] = albedo::cosines(table, cos, p.roughness, mask);
            let middle = (low + high) * F::splat(0.5);
            sum = sum.plus(self.singly(&own, &[middle]).times(F::splat(weight)));
            weights = weights + own.whole() * F::splat(weight);
        }
        sum.times(F::one() / weights.max(F::splat(1e-6)))
    }

    /// Of light that the microfacets do not give back at once, the part that they do later: the
    /// series of all further bounces, for a mean reflectance over the hemisphere.
    #[inline(always)]
    fn further(&self, average: Color<F>) -> Color<F> {
        let lost = F::one() - self.mean.whole();
        (average * average * self.mean.whole()).over((average * lost).complement())
    }

    /// What the mirror lobe of what is no metal, with all its bounces, leaves to what lies below it,
    /// for a direction of that albedo.
    #[inline(always)]
    pub(super) fn left_by(&self, seen: &DirectionalAlbedo<F>) -> Color<F> {
        let own = &seen.albedo;
        if self.has.film || self.has.constant_fresnel {
            let once = self.singly(own, &seen.cosines).dielectric;
            return rest(once, self.dielectric, own).clamp(0.0, 1.0);
        }
        self.under_mirror().left(own)
    }

    #[inline(always)]
    fn under_mirror(&self) -> UnderMirror<F> {
        UnderMirror { f0: self.p.f0, f90: self.p.f90, further: self.dielectric }
    }

    /// What lies above the diffuse lobe, its roughness, and how much of the lobe it leaves for the viewer: everything
    /// in the lobe's light that depends on the viewer, under a mirror lobe without film.
    #[inline(always)]
    pub fn above_diffuse(&self) -> (UnderMirror<F>, F, Color<F>) {
        if !self.has.specular || self.has.constant_fresnel {
            return (UnderMirror::NOTHING.splat(), self.p.roughness, self.left);
        }
        (self.under_mirror(), self.p.roughness, self.left)
    }
}

/// Reflectances with a film, which are needed in many places.
struct Covered<F: Float> {
    film: ThinFilm<F>,
    cos: F,
    bare: Reflectance<F>,
    metallic: bool,
}

impl<F: Float> Outlined for Covered<F> {
    type Output = Reflectance<F>;
    #[inline(always)]
    fn run(self) -> Reflectance<F> {
        let Self { film, cos, bare: Reflectance { dielectric, metal }, metallic } = self;
        let seen = Interference::new(&film, cos);
        let covered = dielectric.mix(seen.over(dielectric), film.weight);
        if !metallic {
            return Reflectance { dielectric: covered, metal };
        }
        Reflectance { dielectric: covered, metal: metal.mix(seen.over(metal), film.weight) }
    }
}

/// Schlick's approximation of Fresnel's equations (1994).
#[inline(always)]
pub(super) fn schlick<F: Float>(f0: Color<F>, f90: Color<F>, cos: F) -> Color<F> {
    let c = F::one() - cos.min(F::one());
    let c2 = c * c;
    f0.mix(f90, c2 * c2 * c)
}
