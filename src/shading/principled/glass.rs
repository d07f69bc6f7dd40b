//! How much light a rough boundary of glass gives back and lets through together: what is missing
//! meets microfacets more than once, and is made up for by a factor on both lobes. And which part of both
//! it gives back.

use std::num::Wrapping;

use super::albedo::between;
use super::ggx::Ggx;
use crate::math::Vector;
use crate::sampling::sobol;
use crate::shading::fresnel;
use crate::simd::{Float, Int};

/// Ratios of indices in the table, by (η − 1)/(η + 1), which is odd in the side: nodes at squares to
/// either side, closer together about 1, from where on there is total reflection.
const RATIOS: usize = 29;
/// Of [`RATIOS`] the first and, above zero, the last: ior 3 from either side.
const LAST: f32 = 0.5;
const ROUGHNESSES: usize = 16;
/// Nodes at squares, closer together at grazing angles.
const COSINES: usize = 20;
/// Directions for an entry.
const SAMPLES: u32 = 512;

/// By ratio of indices, roughness and cosine.
pub struct Table {
    /// What goes on at once, over the albedo of a rough mirror: it changes less than either.
    whole: Vec<f32>,
    /// The part of it that is reflected.
    reflected: Vec<f32>,
}

impl Table {
    /// Without entries.
    pub(super) const EMPTY: Table = Table { whole: Vec::new(), reflected: Vec::new() };

    /// Takes about a tenth of a second.
    pub(super) fn new() -> Self {
        let mut table = Self::EMPTY;
        for e in 0..RATIOS {
            let place = 2.0 * e as f32 / (RATIOS - 1) as f32 - 1.0;
            let odd = LAST * place * place.abs();
            let eta = (1.0 + odd) / (1.0 - odd);
            for r in 0..ROUGHNESSES {
                let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
                for c in 0..COSINES {
                    let node = c as f32 / (COSINES - 1) as f32;
                    let (whole, reflected) =
                        integrate((node * node).max(1e-3), (roughness * roughness).max(1e-3), eta);
                    table.whole.push(whole);
                    table.reflected.push(reflected);
                }
            }
        }
        table
    }
}

/// The mean of G₂/G₁ over visible normals and both ways that light can take from each, over that of a
/// rough mirror; and the part of it that is reflected.
fn integrate(cosine: f32, alpha: f32, eta: f32) -> (f32, f32) {
    let w = Vector::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let ggx = Ggx { x: alpha, y: alpha };
    let own = 1.0 + ggx.lambda(w);
    let (mut back, mut through, mut mirror) = (0.0f64, 0.0f64, 0.0f64);
    for i in 0..SAMPLES {
        let h = ggx.sample(w, sobol::two(Wrapping(i), Wrapping(1)));
        let cos = w.dot(h).max(0.0);
        let reflected = fresnel::reflectance(cos, eta);
        let mirrored = h * (2.0 * cos) - w;
        if mirrored.z > 0.0 {
            let kept = own / (own + ggx.lambda(mirrored));
            back += (reflected * kept) as f64;
            mirror += kept as f64;
        }
        let sin2 = eta * eta * (1.0 - cos * cos);
        if sin2 < 1.0 {
            let bent = h * (eta * cos - (1.0 - sin2).sqrt()) - w * eta;
            if bent.z < 0.0 {
                through += ((1.0 - reflected) * own / (own + ggx.lambda(bent))) as f64;
            }
        }
    }
    let sum = back + through;
    ((sum / mirror.max(1.0)) as f32, (back / sum.max(1.0)) as f32)
}

/// A place between entries.
pub struct Place<F: Float> {
    first: F::Int,
    weights: [F; 3],
}

/// For a cosine to the normal, a roughness √α and a ratio of indices (viewer's side over the other).
#[inline(always)]
pub fn place<F: Float>(cosine: F, roughness: F, eta: F) -> Place<F> {
    let odd = (eta - F::one()) / (eta + F::one());
    let away = (odd.abs() * F::splat(1.0 / LAST)).sqrt();
    let ratio = F::select(odd.lt(F::zero()), -away, away) + F::one();
    let (e, we) = between(ratio * F::splat((RATIOS - 1) as f32 * 0.5), RATIOS);
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let (c, wc) = between(cosine.max(F::zero()).sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let row = F::Int::splat(COSINES as u32);
    let layer = F::Int::splat((COSINES * ROUGHNESSES) as u32);
    Place { first: e * layer + r * row + c, weights: [we, wr, wc] }
}

impl<F: Float> Place<F> {
    /// What makes up for light that is lost, given the albedo of a rough mirror of that cosine and roughness.
    #[inline(always)]
    pub fn gain(&self, table: &Table, mirror: F, mask: F::Mask) -> F {
        F::one() / (self.entry(&table.whole, mask) * mirror).max(F::splat(0.1))
    }

    /// The part of what goes on at once that is reflected.
    #[inline(always)]
    pub fn reflected(&self, table: &Table, mask: F::Mask) -> F {
        self.entry(&table.reflected, mask)
    }

    #[inline(always)]
    fn entry(&self, table: &[f32], mask: F::Mask) -> F {
        let row = F::Int::splat(COSINES as u32);
        let layer = F::Int::splat((COSINES * ROUGHNESSES) as u32);
        let [we, wr, wc] = self.weights;
        let near = plane(table, self.first, row, wc, wr, mask);
        let far = plane(table, self.first + layer, row, wc, wr, mask);
        near * (F::one() - we) + far * we
    }
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
