//! Shadow rays of both transports.

use crate::math::{Color, NONE, Ray, Vector};
use crate::scene::bodies::NOWHERE;
use crate::simd::{Float, Int, Mask};

/// A shadow ray and the light that arrives along it if nothing blocks it.
#[derive(Clone, Copy)]
pub struct ShadowRay<F: Float> {
    /// The ray, which ends just before the light.
    pub ray: Ray<F>,
    /// The contribution if nothing blocks or attenuates it, not clamped.
    pub contribution: Color<F>,
    /// The emitter at its end, whose surface does not block it.
    pub emitter: F::Int,
    /// The film's group that counts the light, if paths choose it and not lamps ([`RenderSetup::groups_by_path`]); otherwise
    /// [`NONE`].
    ///
    /// [`RenderSetup::groups_by_path`]: crate::integrator::RenderSetup::groups_by_path
    pub path_group: F::Int,
    /// The bodies in which it begins ([`crate::scene::Bodies`]).
    pub bodies: F::Int,
    /// The lanes with a contribution.
    pub mask: F::Mask,
}

impl<F: Float> ShadowRay<F> {
    /// Shadow rays without a contribution in any lane.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = F::zero();
        let up = Vector::new(zero, zero, F::one());
        Self {
            ray: Ray { origin: Vector::zero(), direction: up, t_min: zero, t_max: zero },
            contribution: Color::black(),
            emitter: F::Int::splat(NONE),
            path_group: F::Int::splat(NONE),
            bodies: F::Int::splat(NOWHERE),
            mask: F::Mask::from_bits(0),
        }
    }

    /// Selects one or the other, lane by lane.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: &Self, no: &Self) -> Self {
        let (a, b) = (&yes.ray, &no.ray);
        Self {
            ray: Ray {
                origin: Vector::select(mask, a.origin, b.origin),
                direction: Vector::select(mask, a.direction, b.direction),
                t_min: F::select(mask, a.t_min, b.t_min),
                t_max: F::select(mask, a.t_max, b.t_max),
            },
            contribution: Color::select(mask, yes.contribution, no.contribution),
            emitter: F::Int::select(mask, yes.emitter, no.emitter),
            path_group: F::Int::select(mask, yes.path_group, no.path_group),
            bodies: F::Int::select(mask, yes.bodies, no.bodies),
            mask: (mask & yes.mask) | (!mask & no.mask),
        }
    }
}

/// Adds the contribution of a light.
#[inline(always)]
pub fn connect<F: Float>(radiance: Color<F>, contribution: Color<F>) -> Color<F> {
    radiance + contribution
}
