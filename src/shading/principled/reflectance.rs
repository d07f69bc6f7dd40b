//! Reflectance of the mirror lobe: of a single microfacet by Fresnel's equations, and of the whole lobe, for a
//! direction and on average; and the light that the lobe leaves to those below.

use super::albedo::{self, Albedo};
use super::bsdf::Bsdf;
use super::tables::MIRROR;
use super::thin_film::{Interference, ThinFilm};
use crate::math::Color;
use crate::shading::fresnel;
use crate::simd::{Float, Outlined};

/// Gaussian quadrature in μ² for means over the hemisphere, ∫ f(μ) 2μ dμ: nodes and weights.
const NODES: [(f32, f32); 4] =
    [(0.263_499, 0.173_927_4), (0.574_465, 0.326_072_6), (0.818_529, 0.326_072_6), (0.964_660, 0.173_927_4)];

/// Reflectances of the dielectric and of the metal.
#[derive(Clone, Copy)]
pub(super) struct Reflectance<F: Float> {
    /// Reflectance of the dielectric.
    pub dielectric: Color<F>,
    /// Reflectance of the metal; meaningless if there is none.
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

    /// Component-wise product.
    #[inline(always)]
    pub fn by(self, factors: &Self) -> Self {
        Self { dielectric: self.dielectric * factors.dielectric, metal: self.metal * factors.metal }
    }
}

/// The albedo of microfacets for one direction.
#[derive(Clone, Copy)]
pub(super) struct DirectionalAlbedo<F: Float> {
    /// Albedo of single reflections, if microfacets reflect all light.
    pub albedo: Albedo<F>,
    /// Cosines that represent the angles of incidence at microfacets; meaningless without a film or an edge tint.
    pub cosines: [F; 2],
}

/// The light that a mirror lobe with Schlick's Fresnel term leaves to the lobes below.
#[derive(Clone, Copy)]
pub struct UnderMirror<F: Float> {
    /// Reflectance at normal incidence.
    pub f0: Color<F>,
    /// Reflectance at grazing angles.
    pub f90: Color<F>,
    /// The part that is reflected later of the light that the microfacets do not reflect in a single bounce.
    pub further: Color<F>,
}

impl<F: Float> UnderMirror<F> {
    /// The light left for a direction with albedo `own`.
    #[inline(always)]
    pub fn left(&self, own: &Albedo<F>) -> Color<F> {
        rest(self.f0 * own.at_normal + self.f90 * own.at_grazing, self.further, own).clamp(0.0, 1.0)
    }
}

impl UnderMirror<f32> {
    const BLACK: Color<f32> = Color { r: 0.0, g: 0.0, b: 0.0 };
    /// No mirror lobe, or none that depends on the direction.
    pub const NOTHING: Self = Self { f0: Self::BLACK, f90: Self::BLACK, further: Self::BLACK };

    /// True if nothing is reflected, as in [`UnderMirror::NOTHING`].
    pub fn is_nothing(&self) -> bool {
        [self.f0, self.f90, self.further].iter().all(|c| c.max_component() <= 0.0)
    }

    /// Broadcasts to all lanes.
    #[inline(always)]
    pub fn splat<F: Float>(&self) -> UnderMirror<F> {
        UnderMirror { f0: lanes(self.f0), f90: lanes(self.f90), further: lanes(self.further) }
    }
}

/// Broadcasts a colour to all lanes.
#[inline(always)]
fn lanes<F: Float>(c: Color<f32>) -> Color<F> {
    Color::new(F::splat(c.r), F::splat(c.g), F::splat(c.b))
}

/// The light left if `once` is reflected in a single bounce and a part `further` of the rest in later ones.
#[inline(always)]
fn rest<F: Float>(once: Color<F>, further: Color<F>, own: &Albedo<F>) -> Color<F> {
    (once + further * (F::one() - own.whole())).complement()
}

impl<F: Float> Bsdf<F> {
    /// The part of light that a smooth surface transmits straight on, provided that it does not bend light.
    #[inline(always)]
    pub fn straight(&self) -> Color<F> {
        if !self.has.transmission {
            return Color::black();
        }
        let fresnel = self.fresnel(self.wo.z.max(F::zero()));
        Color::select(self.smooth, self.transmitted(&fresnel) * self.below, Color::black())
    }

    /// The transmittance of a microfacet.
    #[inline(always)]
    pub(super) fn transmitted(&self, fresnel: &Reflectance<F>) -> Color<F> {
        self.transmission() * fresnel.dielectric.complement()
    }

    /// The reflectance of a microfacet.
    #[inline(always)]
    pub(super) fn fresnel(&self, cos: F) -> Reflectance<F> {
        let bare = self.bare(cos);
        if self.has.film && !self.has.constant_fresnel { self.covered(bare, cos) } else { bare }
    }

    /// The reflectance without a film.
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
        let mut metal =
            if self.has.metallic { schlick(p.metal, Color::grey(F::one()), cos) } else { Color::black() };
        if self.has.edge {
            metal = (metal + p.edge * -edge_dip(cos)).clamp(0.0, 1.0);
        }
        Reflectance { dielectric, metal }
    }

    /// The reflectance with a film.
    #[inline(always)]
    fn covered(&self, bare: Reflectance<F>, cos: F) -> Reflectance<F> {
        let (film, metallic) = (self.p.film, self.has.metallic);
        F::outlined(Covered { film, cos: self.cos_outside(cos), bare, metallic })
    }

    /// The change of the microfacets' mean reflectance by a film, averaged over representative cosines.
    #[inline(always)]
    fn added_by_film(&self, cosines: &[F]) -> Reflectance<F> {
        let mut sum = Reflectance { dielectric: Color::black(), metal: Color::black() };
        for &cos in cosines {
            let bare = self.bare(cos);
            sum = sum.plus(self.covered(bare, cos).minus(bare));
        }
        sum.times(F::splat(1.0 / cosines.len() as f32))
    }

    /// The cosine at the film. Films lie on the outside of bodies: light from inside meets the film at its angle in
    /// air, and is reflected like light from there.
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

    /// Computes all albedos of the mirror lobe for the viewer.
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

    /// The albedo of single reflections at microfacets.
    #[inline(always)]
    fn singly(&self, own: &Albedo<F>, cosines: &[F]) -> Reflectance<F> {
        let p = &self.p;
        if self.has.constant_fresnel {
            return Reflectance { dielectric: p.f0 * own.whole(), metal: Color::black() };
        }
        let mut metal = if self.has.metallic {
            p.metal * own.at_normal + Color::grey(own.at_grazing)
        } else {
            Color::black()
        };
        if self.has.edge {
            let mut dip = F::zero();
            for &cos in cosines {
                dip = dip + edge_dip(cos);
            }
            let mean = dip * F::splat(1.0 / cosines.len().max(1) as f32);
            metal = (metal + p.edge * (-mean * own.whole())).clamp(0.0, 1.0);
        }
        let bare = Reflectance { dielectric: p.f0 * own.at_normal + p.f90 * own.at_grazing, metal };
        if !self.has.film {
            return bare;
        }
        bare.plus(self.added_by_film(cosines).times(own.whole())).clamped()
    }

    /// The metal's factor that compensates for light lost between microfacets.
    #[inline(always)]
    pub(super) fn gain_of_metal(&self) -> Color<F> {
        let (once, least) = (self.once.metal, F::splat(1e-6));
        let later = self.further_metal * (F::one() - self.own.albedo.whole());
        let divisor = Color::new(once.r.max(least), once.g.max(least), once.b.max(least));
        (once + later).over(divisor)
    }

    /// The factor that compensates for lost light in rough glass with a film (`gain` without film), and the reflected
    /// fraction. The film changes the reflected part, and with it the part that is lost between microfacets.
    #[inline(always)]
    pub(super) fn glass_under_film(&self, gain: F, reflected: F) -> (Color<F>, Color<F>) {
        let (one, kept) = (F::one(), self.own.albedo.whole().max(F::splat(0.05)));
        let added = self.added_by_film(&self.own.cosines).dielectric;
        let (plain_back, plain_through) = (reflected / gain, (one - reflected) / gain);
        // The fraction that each microfacet does not reflect.
        let rest = (one - plain_back / kept).max(F::splat(1e-3));
        let back = (added * kept + Color::grey(plain_back)).clamp(0.0, 1.0);
        let through = (added * (one / rest)).clamp(-1e3, 1.0).complement() * plain_through;
        let both = back + through;
        (Color::grey(one).over(both), back.over(both))
    }

    /// The mean reflectance over the hemisphere.
    #[inline(always)]
    fn average(&self, mask: F::Mask) -> Reflectance<F> {
        let p = &self.p;
        if !self.has.film {
            let part = F::splat(if self.has.constant_fresnel { 0.0 } else { 1.0 / 21.0 });
            let white = Color::grey(F::one());
            let mut metal = p.metal.mix(white, part);
            if self.has.edge {
                // The mean of the dip over the hemisphere is 2 B(3, 7).
                metal = (metal + p.edge * F::splat(-1.0 / 126.0)).clamp(0.0, 1.0);
            }
            return Reflectance { dielectric: p.f0.mix(p.f90, part), metal };
        }
        let mut sum = Reflectance { dielectric: Color::black(), metal: Color::black() };
        let mut weights = F::zero();
        for (cos, weight) in NODES {
            let (table, cos) = (&MIRROR, F::splat(cos));
            let own = albedo::directional(table, cos, p.roughness, mask);
            let [low, high] = albedo::cosines(table, cos, p.roughness, mask);
            let middle = (low + high) * F::splat(0.5);
            sum = sum.plus(self.singly(&own, &[middle]).times(F::splat(weight)));
            weights = weights + own.whole() * F::splat(weight);
        }
        sum.times(F::one() / weights.max(F::splat(1e-6)))
    }

    /// The part that is reflected later of the light that microfacets do not reflect in a single bounce: the series of
    /// all further bounces, for a mean reflectance over the hemisphere.
    #[inline(always)]
    fn further(&self, average: Color<F>) -> Color<F> {
        let lost = F::one() - self.mean.whole();
        (average * average * self.mean.whole()).over((average * lost).complement())
    }

    /// The light that the dielectric's mirror lobe, with all its bounces, leaves to the lobes below, for a direction.
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

    /// The layer above the diffuse lobe, its roughness, and the part of the lobe that it leaves for the viewer. These
    /// are all view-dependent terms of diffuse light under a mirror lobe without film.
    #[inline(always)]
    pub fn above_diffuse(&self) -> (UnderMirror<F>, F, Color<F>) {
        if !self.has.specular || self.has.constant_fresnel {
            return (UnderMirror::NOTHING.splat(), self.p.roughness, self.left);
        }
        (self.under_mirror(), self.p.roughness, self.left)
    }
}

/// Outlined, because reflectances with a film are needed in many places.
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

/// The cosine at which a metal's edge tint is given: 82° to the normal, where metals reflect less than by Schlick's
/// approximation (Kutz, Hašan and Edmondson, "Novel aspects of the Adobe Standard Material", 2021).
const EDGE: f32 = 1.0 / 7.0;

/// The shape of the reflectance that Schlick's approximation has too much: μ (1 − μ)⁶, largest at μ = 1/7 (Lazányi and
/// Szirmay-Kalos, "Fresnel term approximations for metals", 2005).
#[inline(always)]
pub(super) fn edge_dip<F: Float>(cos: F) -> F {
    let cos = cos.min(F::one());
    let c = F::one() - cos;
    let c2 = c * c;
    cos * (c2 * c2 * c2)
}

/// The factor on [`edge_dip`] by which a metal reflects a fraction `tint` of Schlick's approximation at [`EDGE`].
#[inline(always)]
pub(super) fn edge<F: Float>(metal: Color<F>, tint: Color<F>) -> Color<F> {
    let cos = F::splat(EDGE);
    schlick(metal, Color::grey(F::one()), cos) * tint.complement() * (F::one() / edge_dip(cos))
}

/// Schlick's approximation of Fresnel's equations (1994).
#[inline(always)]
pub(super) fn schlick<F: Float>(f0: Color<F>, f90: Color<F>, cos: F) -> Color<F> {
    let c = F::one() - cos.min(F::one());
    let c2 = c * c;
    f0.mix(f90, c2 * c2 * c)
}
