//! The integrals behind the table.

use super::super::albedo::integral::Points;
use super::super::anisotropic::integral::direction;
use super::super::ggx::Ggx;
use super::super::glass::integral::{integrate, ratio, sides};
use super::super::glass::{Cosine, Divided};
use super::{AZIMUTHS, AnisotropicGlassTable, COSINES, LAST, RATIOS, ROUGHNESSES, STRENGTHS};
use crate::math::elementary::sin_cos_turns;
use crate::simd::Isa;

/// Directions per entry.
const SAMPLES: u32 = 256;

/// Computes the numbers of the table.
pub fn numbers() -> Vec<f32> {
    let (isa, points) = (Isa::detect(), Points::new(SAMPLES));
    let mut entries = Vec::new();
    let part = |i: usize, count: usize| i as f32 / (count - 1) as f32;
    let widths: Vec<_> = (0..ROUGHNESSES * STRENGTHS)
        .map(|i| {
            let (r, strength) = (part(i / STRENGTHS, ROUGHNESSES), part(i % STRENGTHS, STRENGTHS));
            let narrow = (r * r).max(1e-3);
            Ggx { x: narrow + (1.0 - narrow) * strength * strength, y: narrow }
        })
        .collect();
    for (inside, node) in sides(RATIOS) {
        let eta = ratio(node, RATIOS, LAST, inside);
        for ggx in &widths {
            for a in 0..AZIMUTHS {
                for c in 0..COSINES {
                    let cosine = Cosine { eta, inside }.of_node(c, COSINES);
                    let w = direction(cosine, part(a, AZIMUTHS));
                    let Divided { kept, reflected } = integrate(isa, w, *ggx, eta, &points);
                    entries.extend([kept, reflected]);
                }
            }
        }
    }
    let table = AnisotropicGlassTable { entries: &entries, means: &[] };
    let mut means = Vec::new();
    for (inside, node) in sides(RATIOS) {
        let cosine = Cosine { eta: ratio(node, RATIOS, LAST, inside), inside };
        for ggx in &widths {
            means.push(mean(&table, ggx, &cosine));
        }
    }
    [entries, means].concat()
}

/// The mean 1/π ∫ (1 − reflected) cos dω.
fn mean(table: &AnisotropicGlassTable, ggx: &Ggx<f32>, cosine: &Cosine<f32>) -> f32 {
    const TURNS: usize = 4;
    let mut sum = 0.0;
    for turn in 0..TURNS {
        let (_, azimuth) = sin_cos_turns((turn as f32 + 0.5) / (4 * TURNS) as f32);
        let reflected = |c| table.directional(direction(c, azimuth), ggx, cosine.eta, true).reflected;
        sum += cosine.mean(2 * COSINES, reflected);
    }
    sum / TURNS as f32
}
