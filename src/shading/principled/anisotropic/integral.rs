//! The integrals behind the table.

use super::super::albedo::integral::{Points, integrate};
use super::super::ggx::Ggx;
use super::{AZIMUTHS, AnisotropicTable, COSINES, ROUGHNESSES, STRENGTHS, directional};
use crate::math::Vector;
use crate::math::elementary::sin_cos_turns;
use crate::simd::Isa;

/// Directions per entry.
const SAMPLES: u32 = 512;

/// Computes the numbers of the table.
pub fn numbers() -> Vec<f32> {
    let (isa, points) = (Isa::detect(), Points::new(SAMPLES));
    let part = |i: usize, count: usize| i as f32 / (count - 1) as f32;
    let (mut entries, mut widths) = (Vec::new(), Vec::new());
    for r in 0..ROUGHNESSES {
        let narrow = (part(r, ROUGHNESSES) * part(r, ROUGHNESSES)).max(1e-4);
        for s in 0..STRENGTHS {
            let strength = part(s, STRENGTHS);
            let ggx = Ggx { x: narrow + (1.0 - narrow) * strength * strength, y: narrow };
            widths.push(ggx);
            for a in 0..AZIMUTHS {
                for c in 0..COSINES {
                    let cosine = (part(c, COSINES) * part(c, COSINES)).max(1e-4);
                    let w = direction(cosine, part(a, AZIMUTHS));
                    let (albedo, _) = integrate(isa, w, ggx, &points);
                    entries.extend([albedo.at_normal, albedo.at_grazing]);
                }
            }
        }
    }
    let table = AnisotropicTable { entries: &entries, means: &[] };
    let means: Vec<f32> = widths.iter().flat_map(|ggx| mean(&table, ggx)).collect();
    [entries, means].concat()
}

/// The direction with a cosine to the normal and, projected onto the surface, a cosine to the x axis.
pub fn direction(cosine: f32, azimuth: f32) -> Vector<f32> {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    Vector::new(sine * azimuth, sine * (1.0 - azimuth * azimuth).max(0.0).sqrt(), cosine)
}

/// The mean 1/π ∫ E(ω) cos dω.
fn mean(table: &AnisotropicTable, ggx: &Ggx<f32>) -> [f32; 2] {
    const STEPS: [usize; 2] = [16, 64];
    let (mut at_normal, mut at_grazing) = (0.0f64, 0.0f64);
    for a in 0..STEPS[0] {
        let (_, azimuth) = sin_cos_turns((a as f32 + 0.5) / (4 * STEPS[0]) as f32);
        for c in 0..STEPS[1] {
            let cosine = (c as f64 + 0.5) / STEPS[1] as f64;
            let albedo = directional(table, direction(cosine as f32, azimuth), ggx, true);
            at_normal += 2.0 * cosine * f64::from(albedo.at_normal);
            at_grazing += 2.0 * cosine * f64::from(albedo.at_grazing);
        }
    }
    let count = STEPS.iter().product::<usize>() as f64;
    [(at_normal / count) as f32, (at_grazing / count) as f32]
}
