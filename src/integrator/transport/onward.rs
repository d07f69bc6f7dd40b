//! The continuation of paths at a surface under the path transport: in a direction drawn from one of its lobes,
//! straight on, or, at smooth glass, in two directions.

use super::direct::faces;
use super::medium;
use super::scatter_vertex::{Fork, ScatterVertex};
use crate::integrator::RenderSetup;
use crate::integrator::path::Path;
use crate::integrator::path::bounces::{self, BLURRED, CAUGHT, FREE_EVENT, FROM_CATCHER};
use crate::integrator::path::termination::roulette;
use crate::math::{Color, Vector};
use crate::sampling::draw::{draw_1d, draw_2d};
use crate::sampling::{Dimension, SampleKey};
use crate::scene::MaterialRecord;
use crate::shading::Surface;
use crate::shading::boundary::Boundary;
use crate::shading::principled::bsdf::Bsdf;
use crate::shading::principled::sample::BsdfSample;
use crate::shading::surface::offset_origin;
use crate::simd::{Float, Int, Mask};
use crate::world::Sampler;

/// Continues paths behind a surface in their present direction; returns them and the lanes that go on.
#[inline(always)]
pub(in crate::integrator) fn past<F: Float>(
    path: &Path<F>,
    surface: &Surface<F>,
    width: F,
) -> (Path<F>, F::Mask) {
    let one = F::Int::splat(1);
    let next = Path {
        origin: offset_origin(surface.position, surface.geometric_normal, surface.offset, path.direction),
        depth: path.depth + one,
        scatterings: path.scatterings + one,
        width,
        ..*path
    };
    (next, path.scatterings.lt(F::Int::splat(medium::MOST)) & path.throughput.max_component().gt(F::zero()))
}

/// Continues paths where there is no boundary; returns them and the lanes that go on. If rays to lights pass the
/// surface, too, what the path finds next is weighted against the light sample of the previous vertex; otherwise they
/// end at it.
#[inline(always)]
pub(in crate::integrator) fn unhindered<F: Float>(
    path: &Path<F>,
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    record: &MaterialRecord,
    t: F,
    width: F,
) -> (Path<F>, F::Mask) {
    let (next, goes_on) = past(path, surface, width);
    let next = Path {
        radiance: Color::black(),
        pdf: if record.passes_shadow_rays { path.pdf } else { F::zero() },
        travelled: path.travelled + t,
        // Photons that end behind it are not seen directly: no ray to the camera passes it.
        bounce_counts: if record.passes_shadow_rays {
            path.bounce_counts
        } else {
            path.bounce_counts | F::Int::splat(FREE_EVENT)
        },
        bodies: boundary.beyond(F::Mask::from_bits(u32::MAX)),
        ..next
    };
    (next, goes_on)
}

impl<F: Float> ScatterVertex<'_, F> {
    /// Forks off the transmitted path at smooth glass where the path itself follows the reflection.
    #[inline(always)]
    pub fn forked(&self, bsdf: &Bsdf<F>) -> Option<Fork<F>> {
        let Self { setup, path, surface, key, draws, .. } = *self;
        let budget = budget(setup, path);
        if !(draws & budget.gt(F::one())).any() {
            return None;
        }
        let (which, u) = numbers(setup, path, bsdf, key, draws);
        let drawn = bsdf.sample_other(which, budget, u, draws);
        if !drawn.valid.any() {
            return None;
        }
        let (mut next, mask) = self.continued(&drawn);
        next.packed_normal = faces(setup, surface, bsdf);
        Some(Fork { next, mask: drawn.valid & mask })
    }

    /// Continues a path in a drawn direction; returns it and the lanes that go on.
    #[inline(always)]
    pub fn continued(&self, drawn: &BsdfSample<F>) -> (Path<F>, F::Mask) {
        let Self { setup, path, surface, key, width, .. } = *self;
        let (mut next, mut goes_on) = reflected(setup, path, surface, &self.boundary, drawn, key, width);
        if setup.catches {
            let flags = next.bounce_counts | F::Int::splat(CAUGHT | FROM_CATCHER);
            next.bounce_counts = F::Int::select(self.caught, flags, next.bounce_counts);
        }
        if self.point.material.passes_shadow_rays {
            self.go_straight_on(drawn, &mut next, &mut goes_on);
        }
        (next, goes_on)
    }

    /// Lets paths that go straight through continue as if they had met a filter instead of a vertex: what they find is
    /// weighted against the light sample of the previous vertex, whose ray went through the surface, too.
    #[inline(always)]
    fn go_straight_on(&self, drawn: &BsdfSample<F>, next: &mut Path<F>, continues: &mut F::Mask) {
        let Self { path, here, .. } = *self;
        let passes = goes_straight(drawn) & self.boundary.is_straight(self.point.material);
        let again = path.scatterings.lt(F::Int::splat(medium::MOST));
        *continues = *continues & ((passes & again) | (here & !passes));
        next.direction = Vector::select(passes, path.direction, next.direction);
        next.bounce_counts = F::Int::select(passes, path.bounce_counts, next.bounce_counts);
        next.pdf = F::select(passes, path.pdf, next.pdf);
        next.packed_normal = F::Int::select(passes, path.packed_normal, next.packed_normal);
        next.travelled = F::select(passes, path.travelled + self.t, next.travelled);
        let one = F::Int::splat(1);
        next.scatterings = F::Int::select(passes, path.scatterings + one, path.scatterings);
    }
}

/// The lanes whose direction leads straight through a surface that bends no light.
#[inline(always)]
pub(in crate::integrator) fn goes_straight<F: Float>(drawn: &BsdfSample<F>) -> F::Mask {
    drawn.transmitted & !drawn.wide & drawn.pdf.le(F::zero())
}

/// The mean number of paths that may be followed from here. Bright objects are often seen in a faint mirror image,
/// which shows as dots if it is only chosen at random. In all, about [`RenderSetup::splitting`] paths come from one,
/// because those that are fainter than its inverse fork no more.
#[inline(always)]
fn budget<F: Float>(setup: &RenderSetup, path: &Path<F>) -> F {
    let left = path.throughput.max_component().min(F::splat(setup.around_square));
    (left * F::splat(setup.splitting / setup.around_square)).max(F::one())
}

/// The random numbers for a direction: one for whether a microfacet reflects, and a pair for the rest.
#[inline(always)]
fn numbers<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    bsdf: &Bsdf<F>,
    key: SampleKey<F::Int>,
    mask: F::Mask,
) -> (F, (F, F)) {
    let which = if bsdf.lets_microfacets_through() {
        draw_1d(setup.sampler, setup.samples, key, Dimension::Through.at(path.depth))
    } else {
        F::zero()
    };
    let mut u = draw_2d(setup.sampler, setup.samples, key, Dimension::Scatter.at(path.depth));
    if let Some(grouping) = &setup.sharing
        && setup.sampler == Sampler::Sobol
    {
        let first = mask & path.depth.eq(F::Int::splat(0));
        if first.any() {
            let joint =
                grouping.joint(setup.seed, path.pixel, path.sample, Dimension::Scatter.at(path.depth));
            u = (F::select(first, joint.0, u.0), F::select(first, joint.1, u.1));
        }
    }
    (which, u)
}

/// Draws a direction from one of the lobes.
#[inline(always)]
pub(in crate::integrator) fn sampled<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    bsdf: &Bsdf<F>,
    key: SampleKey<F::Int>,
    mask: F::Mask,
) -> BsdfSample<F> {
    let (which, u) = numbers(setup, path, bsdf, key, mask);
    bsdf.sample(which, budget(setup, path), u, mask)
}

/// Continues a path in a direction drawn from a lobe; returns it and the lanes that go on.
#[inline(always)]
fn reflected<F: Float>(
    setup: &RenderSetup,
    path: &Path<F>,
    surface: &Surface<F>,
    boundary: &Boundary<F>,
    drawn: &BsdfSample<F>,
    key: SampleKey<F::Int>,
    width: F,
) -> (Path<F>, F::Mask) {
    let zero = F::zero();
    let BsdfSample { direction, weight, pdf, valid, transmitted: through, wide } = *drawn;
    let throughput = path.throughput * weight;
    let goes_on = valid & throughput.max_component().gt(zero);
    // Only wide lobes play: paths through glass and between mirrors are few and bright, so ending one is visible.
    let (throughput, survives) = roulette(setup, path, throughput, key, wide);
    let goes_on = goes_on & survives;
    let from = path.bounce_counts & F::Int::splat(!FROM_CATCHER);
    let mut branch = bounces::counted::<F>(from, wide, through);
    branch = F::Int::select(pdf.gt(zero), branch | F::Int::splat(BLURRED), branch);
    if let Some(limits) = &setup.limits {
        branch = bounces::limited::<F>(limits, branch);
    }
    // A wide lobe blurs over about this angle.
    let spread = path.spread + F::select(wide, F::splat(0.2), zero);
    let next = Path {
        origin: offset_origin(surface.position, surface.geometric_normal, surface.offset, direction),
        direction,
        throughput,
        radiance: Color::black(),
        bounce_counts: branch,
        depth: path.depth + F::Int::splat(1),
        pdf,
        width,
        spread,
        bodies: boundary.beyond(through),
        travelled: zero,
        ..*path
    };
    (next, goes_on)
}
