//! Rough glass with anisotropic microfacets: [`super::glass`] with the dimensions of [`super::anisotropic`].

use super::albedo::{Points, between};
use super::anisotropic::{azimuth, direction, place};
use super::ggx::Ggx;
use super::glass::{Cosine, Divided, between_ratios, integrate, ratio, sides};
use crate::math::Vector;
use crate::math::elementary::sin_cos_turns;
use crate::simd::{Float, Int, Isa, Outlined};

/// Ratios of indices on each side: nodes as in [`super::glass`].
const RATIOS: usize = 9;
/// The last of the [`RATIOS`]: ior 9. Larger ratios are clamped to it.
const LAST: f32 = 0.8;
const ROUGHNESSES: usize = 9;
const STRENGTHS: usize = 7;
const AZIMUTHS: usize = 5;
const COSINES: usize = 17;
/// Directions per entry.
const SAMPLES: u32 = 256;

/// Tables by side, ratio of indices, roughness, strength, azimuth and cosine: both numbers of a [`Divided`].
pub struct AnisotropicGlassTable {
    entries: Vec<f32>,
    /// Means over the hemisphere of the light that is not reflected, by side, ratio, roughness and strength.
    means: Vec<f32>,
}

impl AnisotropicGlassTable {
    /// An empty table.
    pub(super) const EMPTY: AnisotropicGlassTable =
        AnisotropicGlassTable { entries: Vec::new(), means: Vec::new() };

    /// Computes the table, in a tenth of a second.
    pub(super) fn new() -> Self {
        let (isa, points) = (Isa::detect(), Points::new(SAMPLES));
        let mut table = Self::EMPTY;
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
                        table.entries.extend([kept, reflected]);
                    }
                }
            }
        }
        for (inside, node) in sides(RATIOS) {
            let cosine = Cosine { eta: ratio(node, RATIOS, LAST, inside), inside };
            for ggx in &widths {
                let mean = table.mean(ggx, &cosine);
                table.means.push(mean);
            }
        }
        table
    }

    /// The mean 1/π ∫ (1 − reflected) cos dω.
    fn mean(&self, ggx: &Ggx<f32>, cosine: &Cosine<f32>) -> f32 {
        const TURNS: usize = 4;
        let mut sum = 0.0;
        for turn in 0..TURNS {
            let (_, azimuth) = sin_cos_turns((turn as f32 + 0.5) / (4 * TURNS) as f32);
            let reflected = |c| self.directional(direction(c, azimuth), ggx, cosine.eta, true).reflected;
            sum += cosine.mean(2 * COSINES, reflected);
        }
        sum / TURNS as f32
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
            sum = sum + F::gather(&self.means, at, mask) * weight;
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
    table: &'a AnisotropicGlassTable,
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
            kept = kept + F::gather(&table.entries, at, mask) * weight;
            reflected = reflected + F::gather(&table.entries, at + F::Int::splat(1), mask) * weight;
        }
        Divided { kept, reflected }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tables::LobeTables;
    use super::super::{albedo, anisotropic};
    use super::*;

    #[test]
    fn between_its_nodes_the_table_is_the_integral() {
        let (points, tables) = (Points::new(4096), LobeTables::all());
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
            let whole = exact.kept * albedo::integrate(Isa::detect(), w, ggx, &points).0.whole();
            let own = anisotropic::directional(tables.anisotropic, w, &ggx, true).whole();
            let found = tables.anisotropic_glass.directional(w, &ggx, eta, true);
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
