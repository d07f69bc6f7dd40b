//! Sheen of fibres that stand up from a surface: the "Charlie" distribution of Estevez and Kulla (2017) with
//! Ashikhmin's visibility term (KHR_materials_sheen).

use super::albedo::between;
use super::glass::plane;
use crate::math::elementary::{pow, sin_cos_turns};
use crate::math::{Color, Vector};
use crate::simd::{Float, Int, Isa, Kernel, Lanes, dispatch};

const COSINES: usize = 32;
const ROUGHNESSES: usize = 32;
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

/// The table of albedos of white fibres.
pub(super) fn table() -> Vec<f32> {
    let (isa, mut table) = (Isa::detect(), Vec::new());
    for r in 0..ROUGHNESSES {
        for c in 0..COSINES {
            // Closer together at grazing angles, where the lobe is.
            let node = c as f32 / (COSINES - 1) as f32;
            let (cos_o, roughness) = ((node * node).max(1e-3), r as f32 / (ROUGHNESSES - 1) as f32);
            table.push(dispatch(isa, SheenIntegral { cos_o, roughness }));
        }
    }
    table
}

/// The integral ∫ D V cos dω over the hemisphere.
struct SheenIntegral {
    cos_o: f32,
    roughness: f32,
}

impl Kernel for SheenIntegral {
    type Output = f32;
    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        self.sum::<L::Queue>()
    }
}

impl SheenIntegral {
    #[inline(always)]
    fn sum<F: Float>(&self) -> f32 {
        const RINGS: usize = 96;
        const SECTORS: usize = 32;
        let Self { cos_o, roughness } = *self;
        let sin_o = (1.0 - cos_o * cos_o).max(0.0).sqrt();
        let wo = Vector::new(F::splat(sin_o), F::zero(), F::splat(cos_o));
        let turns: [f32; SECTORS] = std::array::from_fn(|j| (j as f32 + 0.5) / SECTORS as f32);
        let mut sum = 0.0f64;
        for i in 0..RINGS {
            // Closer together at grazing angles, where the lobe is.
            let x = (i as f32 + 0.5) / RINGS as f32;
            let cos_i = x * x;
            let sin_i = F::splat((1.0 - cos_i * cos_i).sqrt());
            for at in (0..SECTORS).step_by(F::WIDTH) {
                let (sin, cos) = sin_cos_turns(F::load(&turns[at..]));
                let h = (wo + Vector::new(sin_i * cos, sin_i * sin, F::splat(cos_i))).normalize();
                let value = lobe(F::splat(roughness), h.z, F::splat(cos_o), F::splat(cos_i));
                let mut lanes = [0.0; 16];
                (value * F::splat(cos_i) * F::splat(2.0) * F::splat(x)).store(&mut lanes);
                // Added sequentially, so that the sum does not depend on the number of lanes.
                for value in &lanes[..F::WIDTH] {
                    sum += f64::from(*value);
                }
            }
        }
        (sum * std::f64::consts::TAU / (RINGS * SECTORS) as f64).min(1.0) as f32
    }
}

/// The albedo of white fibres for a cosine to the normal.
#[inline(always)]
pub fn albedo<F: Float>(table: &[f32], cosine: F, roughness: F, mask: F::Mask) -> F {
    let (c, wc) = between(cosine.max(F::zero()).sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let row = F::Int::splat(COSINES as u32);
    plane(table, r * row + c, row, wc, wr, mask)
}
