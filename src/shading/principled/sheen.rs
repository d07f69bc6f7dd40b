//! Sheen of fibres that stand up from a surface: the "Charlie" distribution of Estevez and Kulla (2017) with
//! Ashikhmin's visibility term (KHR_materials_sheen).

#[cfg(test)]
pub(super) mod integral;

use super::albedo::between;
use super::glass::plane;
use crate::math::elementary::pow;
use crate::math::{Color, Vector};
use crate::simd::{Float, Int};

const COSINES: usize = 32;
const ROUGHNESSES: usize = 32;
/// The count of all numbers of the table.
pub(super) const LENGTH: usize = ROUGHNESSES * COSINES;
/// The least roughness; smoother fibres are clamped to it.
const SMOOTHEST: f32 = 0.07;

/// The BRDF D V for directions in the frame of the surface.
#[inline(always)]
pub fn evaluate<F: Float>(color: Color<F>, roughness: F, wo: Vector<F>, wi: Vector<F>) -> Color<F> {
    let h = (wo + wi).normalize();
    color * lobe(roughness, h.z, wo.z, wi.z)
}

#[inline(always)]
fn lobe<F: Float>(roughness: F, cos_h: F, cos_o: F, cos_i: F) -> F {
    let rough = roughness.max(F::splat(SMOOTHEST));
    let inverse = F::one() / (rough * rough);
    let sin2 = (F::one() - cos_h * cos_h).clamp(0.0, 1.0);
    let density =
        (F::splat(2.0) + inverse) * pow(sin2, inverse * F::splat(0.5)) * F::splat(0.5 / std::f32::consts::PI);
    let visible = F::splat(4.0) * (cos_o + cos_i - cos_o * cos_i);
    density / visible.max(F::splat(1e-6))
}

/// The albedo of white fibres for a cosine to the normal.
#[inline(always)]
pub fn albedo<F: Float>(table: &[f32], cosine: F, roughness: F, mask: F::Mask) -> F {
    let (c, wc) = between(cosine.max(F::zero()).sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let row = F::Int::splat(COSINES as u32);
    plane(table, r * row + c, row, wc, wr, mask)
}
