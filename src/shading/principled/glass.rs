//! How much light a rough boundary of glass gives back and lets through together: what is missing
//! meets microfacets more than once, and is made up for by a factor on both lobes.

use std::num::Wrapping;

use super::albedo::between;
use super::ggx::Ggx;
use crate::math::Vector;
use crate::sampling::sobol;
use crate::shading::fresnel;
use crate::simd::{Float, Int};

/// Ratios of indices in the table, by (η − 1)/(η + 1), which is odd in the side: nodes at squares to
/// either side, closer together about 1, from where on there is total reflection.
const RATIOS: usize = 25;
/// Of [`RATIOS`] the first and, above zero, the last: ior 2.6 from either side.
const LAST: f32 = 0.45;
const ROUGHNESSES: usize = 16;
/// Nodes at squares, closer together at grazing angles.
const COSINES: usize = 16;
/// Directions for an entry.
const SAMPLES: u32 = 512;

/// Takes about a tenth of a second.
pub(super) fn table() -> Vec<f32> {
    let mut table = Vec::with_capacity(RATIOS * ROUGHNESSES * COSINES);
    for e in 0..RATIOS {
        let place = 2.0 * e as f32 / (RATIOS - 1) as f32 - 1.0;
        let odd = LAST * place * place.abs();
        let eta = (1.0 + odd) / (1.0 - odd);
        for r in 0..ROUGHNESSES {
            let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
            for c in 0..COSINES {
                let node = c as f32 / (COSINES - 1) as f32;
                table.push(integrate((node * node).max(1e-3), (roughness * roughness).max(1e-3), eta));
            }
        }
    }
    table
}

/// The mean of G₂/G₁ over visible normals and both ways that light can take from each, over that of a
/// rough mirror: the ratio changes less with cosine and roughness than either.
fn integrate(cosine: f32, alpha: f32, eta: f32) -> f32 {
    let w = Vector::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let ggx = Ggx { x: alpha, y: alpha };
    let own = 1.0 + ggx.lambda(w);
    let (mut sum, mut mirror) = (0.0f64, 0.0f64);
    for i in 0..SAMPLES {
        let h = ggx.sample(w, sobol::two(Wrapping(i), Wrapping(1)));
        let cos = w.dot(h).max(0.0);
        let reflected = fresnel::reflectance(cos, eta);
        let mirrored = h * (2.0 * cos) - w;
        if mirrored.z > 0.0 {
            let kept = own / (own + ggx.lambda(mirrored));
            sum += (reflected * kept) as f64;
            mirror += kept as f64;
        }
        let sin2 = eta * eta * (1.0 - cos * cos);
        if sin2 < 1.0 {
            let bent = h * (eta * cos - (1.0 - sin2).sqrt()) - w * eta;
            if bent.z < 0.0 {
                sum += ((1.0 - reflected) * own / (own + ggx.lambda(bent))) as f64;
            }
        }
    }
    (sum / mirror.max(1.0)) as f32
}

/// The factor for a cosine to the normal, a roughness √α, a ratio of indices (viewer's side over
/// the other) and the albedo of a rough mirror of that cosine and roughness.
#[inline(always)]
pub fn gain<F: Float>(table: &[f32], cosine: F, roughness: F, eta: F, mirror: F, mask: F::Mask) -> F {
    let odd = (eta - F::one()) / (eta + F::one());
    let away = (odd.abs() * F::splat(1.0 / LAST)).sqrt();
    let place = F::select(odd.lt(F::zero()), -away, away) + F::one();
    let (e, we) = between(place * F::splat((RATIOS - 1) as f32 * 0.5), RATIOS);
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let (c, wc) = between(cosine.max(F::zero()).sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let row = F::Int::splat(COSINES as u32);
    let layer = F::Int::splat((COSINES * ROUGHNESSES) as u32);
    let first = e * layer + r * row + c;
    let near = plane(table, first, row, wc, wr, mask);
    let far = plane(table, first + layer, row, wc, wr, mask);
    let albedo = (near * (F::one() - we) + far * we) * mirror;
    F::one() / albedo.max(F::splat(0.1))
}

/// Between four entries of a table whose next row begins `row` later.
#[inline(always)]
pub(super) fn plane<F: Float>(table: &[f32], first: F::Int, row: F::Int, wc: F, wr: F, mask: F::Mask) -> F {
    let one = F::Int::splat(1);
    let low = F::gather(table, first, mask) * (F::one() - wc) + F::gather(table, first + one, mask) * wc;
    let next = first + row;
    let high = F::gather(table, next, mask) * (F::one() - wc) + F::gather(table, next + one, mask) * wc;
    low * (F::one() - wr) + high * wr
}
