//! Rough glass: the light that a boundary's microfacets lose, and the division of the rest between reflection and
//! transmission. Both are tables over index, roughness and cosine; [`super::anisotropic_glass`] has two more
//! dimensions.

#[cfg(test)]
pub(super) mod integral;

use super::albedo::between;
use crate::simd::{Float, Int};

/// Ratios of indices on each side, by (η − 1)/(η + 1): nodes at squares, closer together near a ratio of 1.
const RATIOS: usize = 17;
/// The last of the [`RATIOS`]: ior 99. Larger ratios are clamped to it.
const LAST: f32 = 0.98;
/// Ratios for means over smooth boundaries, which need no sampling.
const SMOOTH_RATIOS: usize = 160;
const ROUGHNESSES: usize = 16;
/// Nodes of [`Cosine`].
const COSINES: usize = 25;
const MEANS: usize = 2 * RATIOS * ROUGHNESSES;
const ENTRIES: usize = MEANS * COSINES;
/// The count of all numbers of the table.
pub(super) const LENGTH: usize = 2 * ENTRIES + MEANS + SMOOTH_RATIOS;

/// Tables by side, ratio of indices, roughness and cosine.
pub struct GlassTable<'a> {
    /// Columns of [`Divided::kept`] and [`Divided::reflected`].
    kept: &'a [f32],
    reflected: &'a [f32],
    /// Means over the hemisphere of the light that is not reflected, by side, ratio and roughness.
    means: &'a [f32],
    /// The means for smooth boundaries seen from outside, by ratio.
    smooth_means: &'a [f32],
}

impl<'a> GlassTable<'a> {
    /// Divides numbers into columns.
    pub(super) const fn new(numbers: &'a [f32; LENGTH]) -> Self {
        let (kept, rest) = numbers.split_at(ENTRIES);
        let (reflected, rest) = rest.split_at(ENTRIES);
        let (means, smooth_means) = rest.split_at(MEANS);
        Self { kept, reflected, means, smooth_means }
    }

    /// The division of light for a cosine to the normal, a roughness √α and a ratio of indices (viewer's side divided
    /// by the other).
    #[inline(always)]
    pub fn directional<F: Float>(&self, cosine: F, roughness: F, eta: F, mask: F::Mask) -> Divided<F> {
        let (side, e, we) = between_ratios(eta, RATIOS, LAST);
        let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
        let (c, wc) = Cosine { eta, inside: eta.gt(F::one()) }.between(cosine, COSINES);
        let row = F::Int::splat(COSINES as u32);
        let layer = F::Int::splat((COSINES * ROUGHNESSES) as u32);
        let first = (side + e) * layer + r * row + c;
        let mut out = [F::zero(); 2];
        for (out, table) in out.iter_mut().zip([self.kept, self.reflected]) {
            let near = plane(table, first, row, wc, wr, mask);
            let far = plane(table, first + layer, row, wc, wr, mask);
            *out = near * (F::one() - we) + far * we;
        }
        Divided { kept: out[0], reflected: out[1] }
    }

    /// The mean over the hemisphere of the light that is not reflected, weighted by the cosine.
    #[inline(always)]
    pub fn transmitted_mean<F: Float>(&self, roughness: F, eta: F, mask: F::Mask) -> F {
        let (side, e, we) = between_ratios(eta, RATIOS, LAST);
        let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
        let row = F::Int::splat(ROUGHNESSES as u32);
        plane(self.means, (side + e) * row + r, row, wr, we, mask)
    }

    /// [`GlassTable::transmitted_mean`] for a smooth boundary.
    #[inline(always)]
    pub fn smooth_transmitted_mean<F: Float>(&self, eta: F, mask: F::Mask) -> F {
        let (_, e, we) = between_ratios(eta, SMOOTH_RATIOS, LAST);
        let low = F::gather(self.smooth_means, e, mask);
        let high = F::gather(self.smooth_means, e + F::Int::splat(1), mask);
        // The same light fills a smaller solid angle inside.
        let ior = eta.max(F::one());
        (low * (F::one() - we) + high * we) / (ior * ior)
    }
}

/// The division of light by a boundary.
#[derive(Clone, Copy)]
pub struct Divided<F> {
    /// The fraction that is not lost between microfacets, divided by the albedo of a mirror of the same microfacets:
    /// this ratio varies less.
    pub kept: F,
    /// The reflected fraction of the light that is not lost.
    pub reflected: F,
}

impl<F: Float> Divided<F> {
    /// The factor on both lobes that compensates for lost light, given the albedo of that mirror. (It depends only on
    /// the viewer's direction, so very rough glass is not reciprocal.)
    #[inline(always)]
    pub fn gain(&self, mirror: F) -> F {
        F::one() / (self.kept * mirror).max(F::splat(0.1))
    }
}

/// The first row of the side of a ratio, the lower node on that side, and the weight of the upper node.
#[inline(always)]
pub(super) fn between_ratios<F: Float>(eta: F, ratios: usize, last: f32) -> (F::Int, F::Int, F) {
    let odd = (eta - F::one()) / (eta + F::one());
    let place = (odd.abs() * F::splat(1.0 / last)).sqrt();
    let (e, we) = between(place * F::splat((ratios - 1) as f32), ratios);
    let inside = F::Int::splat(ratios as u32);
    (F::Int::select(odd.gt(F::zero()), inside, F::Int::splat(0)), e, we)
}

/// The nodes of a table over cosines. From outside they are at squares, closer together at grazing angles; from inside
/// half of them are on either side of the critical angle, closer together there and at both ends.
pub(super) struct Cosine<F: Float> {
    /// The ratio of indices, viewer's side divided by the other.
    pub eta: F,
    /// Set if the viewer is inside.
    pub inside: F::Mask,
}

impl<F: Float> Cosine<F> {
    /// The cosine of the critical angle, below which there is total reflection.
    #[inline(always)]
    fn critical(&self) -> F {
        (F::one() - F::one() / (self.eta * self.eta)).max(F::splat(1e-6)).sqrt().min(F::splat(0.9999))
    }

    /// The lower node, and the weight of the upper one.
    #[inline(always)]
    pub fn between(&self, cosine: F, nodes: usize) -> (F::Int, F) {
        let (one, half) = (F::one(), F::splat(0.5));
        let cosine = cosine.max(F::zero()).min(one);
        let critical = self.critical();
        let below = cosine.lt(critical);
        let part = F::select(below, cosine / critical, (cosine - critical) / (one - critical));
        let low = (part * half).sqrt();
        let high = one - ((one - part).max(F::zero()) * half).sqrt();
        let place = F::select(part.lt(half), low, high) * half;
        let place = F::select(below, place, place + half);
        let place = F::select(self.inside, place, cosine.sqrt());
        between(place * F::splat((nodes - 1) as f32), nodes)
    }
}

/// Interpolates bilinearly in a table whose next row begins `row` entries later.
#[inline(always)]
pub(super) fn plane<F: Float>(table: &[f32], first: F::Int, row: F::Int, wc: F, wr: F, mask: F::Mask) -> F {
    let one = F::Int::splat(1);
    let low = F::gather(table, first, mask) * (F::one() - wc) + F::gather(table, first + one, mask) * wc;
    let next = first + row;
    let high = F::gather(table, next, mask) * (F::one() - wc) + F::gather(table, next + one, mask) * wc;
    low * (F::one() - wr) + high * wr
}

#[cfg(test)]
mod tests {
    use super::super::albedo;
    use super::super::albedo::integral::Points;
    use super::super::ggx::Ggx;
    use super::super::tables::{GLASS, MIRROR};
    use super::integral::integrate;
    use super::*;
    use crate::math::Vector;
    use crate::shading::fresnel;
    use crate::simd::Isa;

    #[test]
    fn between_its_nodes_the_table_is_the_integral() {
        let points = Points::new(4096);
        let (mut worst, mut squares) = ([0.0f64; 2], [0.0f64; 2]);
        let count = 2000;
        for i in 0..count {
            // Roberts' sequence.
            let [r, e, c] = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step| (i as f32 * step).fract());
            let ior = 1.02 + 4.0 * e * e;
            let eta = if i % 2 == 0 { ior } else { 1.0 / ior };
            let (roughness, cosine) = (0.05 + 0.95 * r, c.max(0.01));
            let w = Vector::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
            let alpha = roughness * roughness;
            let ggx = Ggx { x: alpha, y: alpha };
            let exact = integrate(Isa::detect(), w, ggx, eta, &points);
            let whole = exact.kept * albedo::integral::integrate(Isa::detect(), w, ggx, &points).0.whole();
            let own = albedo::directional(&MIRROR, cosine, roughness, true).whole();
            let found = GLASS.directional(cosine, roughness, eta, true);
            let off =
                [f64::from(found.gain(own) * whole - 1.0), f64::from(found.reflected - exact.reflected)];
            for k in 0..2 {
                worst[k] = worst[k].max(off[k].abs());
                // Weighted by the frequency of such directions over the hemisphere.
                squares[k] += off[k] * off[k] * 2.0 * f64::from(cosine);
            }
        }
        let rms = squares.map(|sum| (sum / f64::from(count)).sqrt());
        assert!(
            worst.iter().all(|off| *off < 0.05) && rms.iter().all(|off| *off < 0.003),
            "{worst:?} {rms:?}"
        );
    }

    #[test]
    fn smooth_transmitted_mean_matches_fresnels_equations() {
        for ior in [1.0003f32, 1.01, 1.2, 1.33, 1.5, 2.4, 4.0, 20.0] {
            for eta in [ior, 1.0 / ior] {
                let exact = Cosine { eta, inside: eta > 1.0 }.mean(20_000, |c| fresnel::reflectance(c, eta));
                let found = GLASS.smooth_transmitted_mean(eta, true);
                assert!((found / exact - 1.0).abs() < 0.001, "{eta}: {found} {exact}");
            }
        }
    }
}
