//! The integrals behind the table.

use super::{COSINES, ROUGHNESSES, lobe};
use crate::math::Vector;
use crate::math::elementary::sin_cos_turns;
use crate::simd::{Float, Isa, Kernel, Lanes, dispatch};

/// Computes the numbers of the table.
pub fn numbers() -> Vec<f32> {
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
