//! Fibres that stand up from a surface: the "Charlie" distribution of Estevez and Kulla (2017)
//! with Ashikhmin's visibility term (KHR_materials_sheen).

use super::albedo::between;
use super::glass::plane;
use crate::math::elementary::pow;
use crate::math::{Color, Vector};
use crate::simd::{Float, Int};

const COSINES: usize = 32;
const ROUGHNESSES: usize = 32;
/// Smoother fibres than this are as smooth as this.
const SMOOTHEST: f32 = 0.07;

/// D V for directions in the frame of the surface.
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

/// Albedos of white fibres.
pub(super) fn table() -> Vec<f32> {
    let mut table = Vec::new();
    for r in 0..ROUGHNESSES {
        for c in 0..COSINES {
            // Closer together at grazing angles, where the lobe is.
            let node = c as f32 / (COSINES - 1) as f32;
            table.push(integrate((node * node).max(1e-3), r as f32 / (ROUGHNESSES - 1) as f32));
        }
    }
    table
}

/// ∫ D V cos dω over the hemisphere.
fn integrate(cos_o: f32, roughness: f32) -> f32 {
    let wo = Vector::new((1.0 - cos_o * cos_o).max(0.0).sqrt(), 0.0, cos_o);
    let (rings, sectors) = (96, 32);
    let mut sum = 0.0f64;
    for i in 0..rings {
        // Closer together at grazing angles, where the lobe is.
        let x = (i as f32 + 0.5) / rings as f32;
        let cos_i = x * x;
        let sin_i = (1.0 - cos_i * cos_i).sqrt();
        for j in 0..sectors {
            let turns = (j as f32 + 0.5) / sectors as f32;
            let (sin, cos) = crate::math::elementary::sin_cos_turns(turns);
            let h = (wo + Vector::new(sin_i * cos, sin_i * sin, cos_i)).normalize();
            sum += (lobe(roughness, h.z, cos_o, cos_i) * cos_i * 2.0 * x) as f64;
        }
    }
    (sum * std::f64::consts::TAU / (rings * sectors) as f64).min(1.0) as f32
}

/// Albedo of white fibres for a cosine to the normal.
#[inline(always)]
pub fn albedo<F: Float>(table: &[f32], cosine: F, roughness: F, mask: F::Mask) -> F {
    let (c, wc) = between(cosine.max(F::zero()).sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let row = F::Int::splat(COSINES as u32);
    plane(table, r * row + c, row, wc, wr, mask)
}
