//! How much light a rough glass boundary reflects and transmits together: the rest meets microfacets more than once,
//! and is made up for by a factor on both lobes. Also which part of both it reflects.

use super::albedo::{Points, between};
use super::ggx::Ggx;
use crate::math::Vector;
use crate::shading::fresnel;
use crate::simd::{Float, Int, Kernel, Lanes, Level, dispatch};

/// Ratios of indices in the table, by (η − 1)/(η + 1), which is odd in the side: nodes at squares to
/// either side, closer together about 1, from where on there is total reflection.
const RATIOS: usize = 29;
/// The first and, positive, the last of the [`RATIOS`]: ior 3 from either side.
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

    /// Takes some hundredths of a second.
    pub(super) fn new() -> Self {
        let (level, points) = (Level::detect(), Points::new(SAMPLES));
        let mut table = Self::EMPTY;
        for e in 0..RATIOS {
            let place = 2.0 * e as f32 / (RATIOS - 1) as f32 - 1.0;
            let odd = LAST * place * place.abs();
            let eta = (1.0 + odd) / (1.0 - odd);
            for r in 0..ROUGHNESSES {
                let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
                for c in 0..COSINES {
                    let node = c as f32 / (COSINES - 1) as f32;
                    let (cosine, alpha) = ((node * node).max(1e-3), (roughness * roughness).max(1e-3));
                    let integral = Integral { cosine, alpha, eta, points: &points };
                    let (whole, reflected) = dispatch(level, integral);
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
struct Integral<'a> {
    cosine: f32,
    alpha: f32,
    eta: f32,
    points: &'a Points,
}

impl Kernel for Integral<'_> {
    type Output = (f32, f32);
    #[inline(always)]
    fn run<L: Lanes>(self) -> (f32, f32) {
        self.sum::<L::Queue>()
    }
}

impl Integral<'_> {
    #[inline(always)]
    fn sum<F: Float>(&self) -> (f32, f32) {
        let sine = (1.0 - self.cosine * self.cosine).max(0.0).sqrt();
        let w = Vector::new(F::splat(sine), F::zero(), F::splat(self.cosine));
        let ggx = Ggx { x: F::splat(self.alpha), y: F::splat(self.alpha) };
        let (own, eta) = (F::one() + ggx.lambda(w), F::splat(self.eta));
        let mut sums = [0.0f64; 3];
        for at in (0..self.points.count()).step_by(F::WIDTH) {
            let h = ggx.sample(w, self.points.load(at));
            let cos = w.dot(h).max(F::zero());
            let reflected = fresnel::reflectance(cos, eta);
            let mirrored = h * (F::splat(2.0) * cos) - w;
            let kept = own / (own + ggx.lambda(mirrored));
            let kept = F::select(mirrored.z.gt(F::zero()), kept, F::zero());
            let sin2 = eta * eta * (F::one() - cos * cos);
            let bent = h * (eta * cos - (F::one() - sin2).max(F::zero()).sqrt()) - w * eta;
            let through = (F::one() - reflected) * own / (own + ggx.lambda(bent));
            let goes_through = sin2.lt(F::one()) & bent.z.lt(F::zero());
            let through = F::select(goes_through, through, F::zero());
            // One after the other, so that the sums are the same however many lanes there are.
            for (sum, part) in sums.iter_mut().zip([reflected * kept, kept, through]) {
                let mut lanes = [0.0; 16];
                part.store(&mut lanes);
                for value in &lanes[..F::WIDTH] {
                    *sum += f64::from(*value);
                }
            }
        }
        let [back, mirror, through] = sums;
        let sum = back + through;
        ((sum / mirror.max(1.0)) as f32, (back / sum.max(1.0)) as f32)
    }
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

    /// The part that is reflected of what leaves at once.
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
