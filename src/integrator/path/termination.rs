//! Termination of paths of the path transport: by the limits on bounces, or by Russian roulette.

use super::{Path, bounces};
use crate::integrator::RenderSetup;
use crate::math::Color;
use crate::sampling::draw::draw_1d;
use crate::sampling::{Dimension, SampleKey};
use crate::simd::{Float, Int, Mask};

/// The lanes whose path has had its last bounce, of all or of a kind.
#[inline(always)]
pub(in crate::integrator) fn is_last<F: Float>(setup: &RenderSetup, path: &Path<F>) -> F::Mask {
    // Scattering within bodies does not count, nor does going straight through.
    let last = (F::Int::splat(setup.max_depth) + path.scatterings).lt(path.depth);
    if setup.limits.is_some() { last | bounces::spent::<F>(path.bounce_counts) } else { last }
}

/// Russian roulette in the lanes of `mask`: returns the throughput and the lanes whose path survives.
#[inline(always)]
pub(in crate::integrator) fn roulette<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    throughput: Color<F>,
    key: SampleKey<F::Int>,
    mask: F::Mask,
) -> (Color<F>, F::Mask) {
    let all = F::Mask::from_bits(u32::MAX);
    let Some(first) = setup.roulette_depth else { return (throughput, all) };
    // With path reuse, first vertices do not play: their neighbours cannot account for the outcome.
    let first = if setup.sharing.is_some() { first.max(1) } else { first };
    let plays = mask & !path.depth.lt(F::Int::splat(first));
    let survival = throughput.max_component().clamp(0.05, 1.0);
    let number: F = draw_1d(setup.sampler, setup.samples, key, Dimension::Roulette.at(path.depth));
    let throughput = throughput * F::select(plays, F::one() / survival, F::one());
    (throughput, number.lt(survival) | !plays)
}
