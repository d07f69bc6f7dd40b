//! What rays see that hit nothing.

use crate::math::{Color, Vector};
use crate::simd::Float;
use crate::world::Background;

/// Radiance from a unit direction.
#[inline(always)]
pub fn radiance<F: Float>(background: &Background, direction: Vector<F>) -> Color<F> {
    match background {
        Background::Constant(color) => Color::splat(*color),
        Background::Gradient { bottom, top } => {
            let height = direction.y * F::splat(0.5) + F::splat(0.5);
            Color::splat(*bottom) * (F::one() - height) + Color::splat(*top) * height
        }
    }
}
