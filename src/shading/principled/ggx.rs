//! The microfacet distribution of Trowbridge and Reitz (GGX) with Smith's height-correlated shadowing and masking, in
//! the frame of the surface: z along the normal, x and y along the axes of roughness.

use crate::math::Vector;
use crate::math::elementary::sin_cos_turns;
use crate::simd::{Float, Mask};

/// The distribution with widths α of the slopes along x and y.
#[derive(Clone, Copy)]
pub struct Ggx<F: Float> {
    /// Width along x.
    pub x: F,
    /// Width along y.
    pub y: F,
}

impl<F: Float> Ggx<F> {
    /// D: the density of microfacets with a normal, per steradian (PBRT 4th ed., eq. 9.16).
    #[inline(always)]
    pub fn density(&self, h: Vector<F>) -> F {
        let (a, b) = (h.x / self.x, h.y / self.y);
        let sum = a * a + b * b + h.z * h.z;
        F::one() / (F::splat(std::f32::consts::PI) * self.x * self.y * sum * sum)
    }

    /// Smith's Λ, from which masking and shadowing are computed (PBRT 4th ed., eq. 9.20).
    #[inline(always)]
    pub fn lambda(&self, w: Vector<F>) -> F {
        let (a, b) = (w.x * self.x, w.y * self.y);
        let tan2 = (a * a + b * b) / (w.z * w.z).max(F::splat(1e-20));
        ((F::one() + tan2).sqrt() - F::one()) * F::splat(0.5)
    }

    /// Samples a normal of the microfacets visible along `w` (w.z > 0) from a point in the unit square, with density G₁
    /// D (w·h) / w.z (Dupuy and Benyoub 2023, by spherical caps).
    #[inline(always)]
    pub fn sample(&self, w: Vector<F>, u: (F, F)) -> Vector<F> {
        let anisotropic = Vector::new(w.x * self.x, w.y * self.y, w.z).normalize();
        let (sin, cos) = sin_cos_turns(u.0);
        let z = (F::one() - u.1) * (F::one() + anisotropic.z) - anisotropic.z;
        let radius = (F::one() - z * z).max(F::zero()).sqrt();
        let cap = Vector::new(radius * cos, radius * sin, z) + anisotropic;
        let h = Vector::new(cap.x * self.x, cap.y * self.y, cap.z.max(F::zero()));
        let square = h.dot(h);
        let long = square.gt(F::splat(1e-30));
        let length = F::select(long, square, F::one()).sqrt();
        let up = Vector::new(F::zero(), F::zero(), F::one());
        if (!long).any() {
            return Vector::select(long, h * (F::one() / length), up);
        }
        h * (F::one() / length)
    }
}
