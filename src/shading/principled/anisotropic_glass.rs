//! Rough glass with anisotropic microfacets: [`super::glass`] with the dimensions of [`super::anisotropic`].

#[cfg(test)]
pub(super) mod integral;

use super::albedo::between;
use super::anisotropic::{azimuth, place};
use super::ggx::Ggx;
use super::glass::{Cosine, Divided, between_ratios};
use crate::math::Vector;
use crate::simd::{Float, Int, Outlined};

/// Ratios of indices on each side: nodes as in [`super::glass`].
const RATIOS: usize = 9;
/// The last of the [`RATIOS`]: ior 9. Larger ratios are clamped to it.
const LAST: f32 = 0.8;
const ROUGHNESSES: usize = 9;
const STRENGTHS: usize = 7;
const AZIMUTHS: usize = 5;
const COSINES: usize = 17;
const MEANS: usize = 2 * RATIOS * ROUGHNESSES * STRENGTHS;
const ENTRIES: usize = 2 * MEANS * AZIMUTHS * COSINES;
/// The count of all numbers of the table.
pub(super) const LENGTH: usize = ENTRIES + MEANS;

/// Tables by side, ratio of indices, roughness, strength, azimuth and cosine: both numbers of a [`Divided`].
pub struct AnisotropicGlassTable<'a> {
    entries: &'a [f32],
    /// Means over the hemisphere of the light that is not reflected, by side, ratio, roughness and strength.
    means: &'a [f32],
}

impl<'a> AnisotropicGlassTable<'a> {
    /// Divides numbers into columns.
    pub(super) const fn new(numbers: &'a [f32; LENGTH]) -> Self {
        let (entries, means) = numbers.split_at(ENTRIES);
        Self { entries, means }
    }

    /// The division of light from a direction in the frame; `eta` is the index on the viewer's side divided by the
    /// other.
    #[inline(always)]
    pub fn directional<F: Float>(&self, w: Vector<F>, ggx: &Ggx<F>, eta: F, mask: F::Mask) -> Divided<F> {
        F::outlined(GlassLookUp { table: self, w, ggx: *ggx, eta, mask })
    }

    /// The mean over the hemisphere of the light that is not reflected, weighted by the cosine.
    #[inline(always)]
    pub fn transmitted_mean<F: Float>(&self, ggx: &Ggx<F>, eta: F, mask: F::Mask) -> F {
        let (side, e, we) = between_ratios(eta, RATIOS, LAST);
        let ((r, wr), (s, ws)) = place(ggx, ROUGHNESSES, STRENGTHS);
        let mut sum = F::zero();
        for corner in 0..8u32 {
            let [up_e, up_r, up_s] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let layer = side + e + F::Int::splat(up_e);
            let at = (layer * F::Int::splat(ROUGHNESSES as u32) + r + F::Int::splat(up_r))
                * F::Int::splat(STRENGTHS as u32)
                + s
                + F::Int::splat(up_s);
            let weight = weight(we, up_e) * weight(wr, up_r) * weight(ws, up_s);
            sum = sum + F::gather(self.means, at, mask) * weight;
        }
        sum
    }
}

/// The weight of the upper node if `up` is 1, otherwise that of the lower one.
#[inline(always)]
fn weight<F: Float>(upper: F, up: u32) -> F {
    if up == 1 { upper } else { F::one() - upper }
}

struct GlassLookUp<'a, F: Float> {
    table: &'a AnisotropicGlassTable<'a>,
    w: Vector<F>,
    ggx: Ggx<F>,
    eta: F,
    mask: F::Mask,
}

impl<F: Float> Outlined for GlassLookUp<'_, F> {
    type Output = Divided<F>;
    #[inline(always)]
    fn run(self) -> Divided<F> {
        let Self { table, w, ggx, eta, mask } = self;
        let (side, e, we) = between_ratios(eta, RATIOS, LAST);
        let ((r, wr), (s, ws)) = place(&ggx, ROUGHNESSES, STRENGTHS);
        let (a, wa) = between(azimuth(w) * F::splat((AZIMUTHS - 1) as f32), AZIMUTHS);
        let (c, wc) = Cosine { eta, inside: eta.gt(F::one()) }.between(w.z.abs(), COSINES);
        let [mut kept, mut reflected] = [F::zero(); 2];
        for corner in 0..32u32 {
            let [up_e, up_r, up_s] = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let [up_a, up_c] = [corner >> 3 & 1, corner >> 4];
            let mut at = side + e + F::Int::splat(up_e);
            at = at * F::Int::splat(ROUGHNESSES as u32) + r + F::Int::splat(up_r);
            at = at * F::Int::splat(STRENGTHS as u32) + s + F::Int::splat(up_s);
            at = at * F::Int::splat(AZIMUTHS as u32) + a + F::Int::splat(up_a);
            at = (at * F::Int::splat(COSINES as u32) + c + F::Int::splat(up_c)) * F::Int::splat(2);
            let weight =
                weight(we, up_e) * weight(wr, up_r) * weight(ws, up_s) * weight(wa, up_a) * weight(wc, up_c);
            kept = kept + F::gather(table.entries, at, mask) * weight;
            reflected = reflected + F::gather(table.entries, at + F::Int::splat(1), mask) * weight;
        }
        Divided { kept, reflected }
    }
}

#[cfg(test)]
mod tests {
    use super::super::albedo::integral::{self, Points};
    use super::super::anisotropic;
    use super::super::anisotropic::integral::direction;
    use super::super::glass::integral::integrate;
    use super::super::tables::{ANISOTROPIC, ANISOTROPIC_GLASS};
    use super::*;
    use crate::simd::Isa;

    #[test]
    fn between_its_nodes_the_table_is_the_integral() {
        let points = Points::new(4096);
        let (mut worst, mut squares) = ([0.0f64; 2], [0.0f64; 2]);
        let count = 2000;
        for i in 0..count {
            // Roberts' sequence.
            let [r, s, a, e, c] = [0.881_271_2, 0.776_639, 0.684_429, 0.603_167, 0.531_554]
                .map(|step| (i as f32 * step).fract());
            let ior = 1.02 + 2.0 * e * e;
            let eta = if i % 2 == 0 { ior } else { 1.0 / ior };
            let r = 0.05 + 0.95 * r;
            let ggx = Ggx { x: r * r + (1.0 - r * r) * s * s, y: r * r };
            let w = direction(c.max(0.01), (a * std::f32::consts::FRAC_PI_2).cos());
            let exact = integrate(Isa::detect(), w, ggx, eta, &points);
            let whole = exact.kept * integral::integrate(Isa::detect(), w, ggx, &points).0.whole();
            let own = anisotropic::directional(&ANISOTROPIC, w, &ggx, true).whole();
            let found = ANISOTROPIC_GLASS.directional(w, &ggx, eta, true);
            let off =
                [f64::from(found.gain(own) * whole - 1.0), f64::from(found.reflected - exact.reflected)];
            for k in 0..2 {
                worst[k] = worst[k].max(off[k].abs());
                squares[k] += off[k] * off[k] * 2.0 * f64::from(w.z);
            }
        }
        let rms = squares.map(|sum| (sum / f64::from(count)).sqrt());
        assert!(worst.iter().all(|off| *off < 0.2) && rms.iter().all(|off| *off < 0.01), "{worst:?} {rms:?}");
    }
}
