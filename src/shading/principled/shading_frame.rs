//! Orthonormal frames at surfaces.

use crate::math::Vector;
use crate::simd::Float;

/// Orthonormal axes at a surface.
#[derive(Clone, Copy)]
pub struct ShadingFrame<F: Float> {
    /// Tangent to the surface.
    pub x: Vector<F>,
    /// Tangent to the surface, perpendicular to x.
    pub y: Vector<F>,
    /// Normal to the surface.
    pub z: Vector<F>,
}

impl<F: Float> ShadingFrame<F> {
    /// An arbitrary frame about a unit normal (Duff and others 2017).
    #[inline(always)]
    pub fn about(z: Vector<F>) -> Self {
        let (zero, one) = (F::zero(), F::one());
        let sign = F::select(z.z.lt(zero), -one, one);
        let a = -(one / (sign + z.z));
        let b = z.x * z.y * a;
        Self {
            x: Vector::new(one + sign * z.x * z.x * a, sign * b, -(sign * z.x)),
            y: Vector::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Transforms a world vector into the frame.
    #[inline(always)]
    pub fn local(&self, v: Vector<F>) -> Vector<F> {
        Vector::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Transforms a vector of the frame to world space.
    #[inline(always)]
    pub fn world(&self, v: Vector<F>) -> Vector<F> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}
