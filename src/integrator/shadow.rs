//! Rays to lights, of both transports.

use crate::math::{Color, Ray, Vector};
use crate::simd::{Float, Mask};

/// A ray to a light and what arrives along it if nothing is between.
#[derive(Clone, Copy)]
pub struct ShadowRay<F: Float> {
    /// Ends just before the light.
    pub ray: Ray<F>,
    /// To be added to the path's radiance.
    pub contribution: Color<F>,
    /// Lanes in which there is something to gain.
    pub mask: F::Mask,
}

impl<F: Float> ShadowRay<F> {
    /// Nothing to gain anywhere.
    #[inline(always)]
    pub fn none() -> Self {
        let zero = F::zero();
        let up = Vector::new(zero, zero, F::one());
        Self {
            ray: Ray { origin: Vector::zero(), direction: up, t_min: zero, t_max: zero },
            contribution: Color::black(),
            mask: F::Mask::from_bits(0),
        }
    }
}

/// Adds what has arrived from a light.
#[inline(always)]
pub fn connect<F: Float>(radiance: Color<F>, contribution: Color<F>) -> Color<F> {
    radiance + contribution
}
