//! Multiple importance sampling (Veach 1997): the choice of an emitter at a vertex, and the weights where both a light
//! sample and a drawn direction could find it.

use super::Path;
use super::bounces::{self, FROM_CATCHER};
use crate::integrator::RenderSetup;
use crate::math::{NONE, Vector};
use crate::sampling::draw::{draw_1d, draw_2d};
use crate::sampling::{Dimension, SampleKey};
use crate::shading::{HitLanes, emitter, light_tree};
use crate::simd::{Float, Int, Mask, Outlined};

/// Power-heuristic weight of the technique with density `own` against one with density `other`.
#[inline(always)]
pub(in crate::integrator) fn power_heuristic<F: Float>(own: F, other: F) -> F {
    // Divided first, because squares of large densities overflow.
    let ratio = other / own.max(F::splat(1e-30));
    F::one() / (F::one() + ratio * ratio)
}

/// Balance-heuristic weight of the technique with density `own` against one with density `other` (Veach 1997).
#[inline(always)]
pub(in crate::integrator) fn balance_heuristic<F: Float>(own: F, other: F) -> F {
    F::one() / (F::one() + other / own.max(F::splat(1e-30)))
}

/// The weight of a photon against paths that find the same light. `area` is the area from which photons are collected:
/// a pixel's footprint, or the disc of a radius.
#[inline(always)]
pub(in crate::integrator) fn own_part<F: Float>(density: F, area: F, pdf: F, cosine: F) -> F {
    balance_heuristic(density * area, pdf / cosine)
}

/// Chooses an emitter for a surface point of a certain facing; returns it, the probability of choosing it, and the
/// point of the unit square that remains for choosing a point on it.
///
/// The square is cut into slices: each light's points are as even within its slice as all points are within the square.
/// A slice of one in a million holds only some 16 values of a 24-bit number, so another number fills in between.
#[inline(always)]
pub(in crate::integrator) fn choose<F: Float>(
    setup: &RenderSetup,
    position: Vector<F>,
    packed_normal: F::Int,
    draw: (F::Int, SampleKey<F::Int>),
    mask: F::Mask,
) -> (F::Int, F, (F, F)) {
    let (emitters, (depth, key)) = (&setup.scene.emitters, draw);
    let u = draw_2d(setup.sampler, setup.samples, key, Dimension::Light.at(depth));
    if emitters.len() < 2 {
        return (F::Int::splat(0), F::one(), u);
    }
    let (index, chance, rest) = light_tree::sample(&emitters.tree, position, packed_normal, u.1, mask);
    let between: F = draw_1d(setup.sampler, setup.samples, key, Dimension::LightBits.at(depth));
    let bits = F::splat(f32::EPSILON * 0.5) / chance.max(F::splat(f32::EPSILON * 0.5));
    let rest = (rest + between * bits).min(F::splat(1.0 - f32::EPSILON / 2.0));
    (index, chance, (u.0, rest))
}

/// The probability with which [`choose`] would have chosen an emitter where the path's direction was drawn.
#[inline(always)]
pub(in crate::integrator) fn selection_probability<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    index: F::Int,
    mask: F::Mask,
) -> F {
    let emitters = &setup.scene.emitters;
    if emitters.len() < 2 {
        return F::one();
    }
    light_tree::pmf(&emitters.tree, path.seen_from(), path.packed_normal, index, mask)
}

/// The MIS weight of a drawn direction that may have found a surface's emission.
#[inline(always)]
pub(in crate::integrator) fn emission_mis_weight<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    hit: &HitLanes<F>,
    mask: F::Mask,
) -> F {
    let (scene, drawn) = (&setup.scene, mask & path.pdf.gt(F::zero()));
    if !drawn.any() {
        return F::one();
    }
    let index = emitter::of_hit(scene, hit, drawn);
    mis_weight(setup, path, index, path.travelled + hit.t, drawn)
}

/// The MIS weight of a drawn direction that may have found an emitter, or [`NONE`], at a distance from where it was
/// drawn.
#[inline(always)]
pub(in crate::integrator) fn mis_weight<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    index: F::Int,
    distance: F,
    mask: F::Mask,
) -> F {
    let found = mask & path.pdf.gt(F::zero()) & !index.eq(F::Int::splat(NONE));
    if !found.any() {
        return F::one();
    }
    F::outlined(EmissionMisWeight { setup, path, index, distance, found })
}

/// The MIS weight of a drawn direction that has found an emitter.
struct EmissionMisWeight<'a, F: Float> {
    setup: &'a RenderSetup,
    path: &'a Path<F>,
    index: F::Int,
    distance: F,
    found: F::Mask,
}

impl<F: Float> Outlined for EmissionMisWeight<'_, F> {
    type Output = F;
    #[inline(always)]
    fn run(self) -> F {
        let Self { setup, path, index, distance, found } = self;
        let density = emitter::pdf(&setup.scene, index, path.seen_from(), path.direction, distance, found)
            * selection_probability(setup, path, index, found);
        // Light samples alone find lamps at shadow catchers.
        let left_out = bounces::is_set::<F>(path.bounce_counts, FROM_CATCHER);
        let weight = F::select(left_out, F::zero(), power_heuristic(path.pdf, density));
        F::select(found, weight, F::one())
    }
}
