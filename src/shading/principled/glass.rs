//! Rough glass: the light that a boundary's microfacets lose, and the division of the rest between reflection and
//! transmission. Both are tables over index, roughness and cosine; [`super::anisotropic_glass`] has two more
//! dimensions.

use super::albedo::{Points, between};
use super::ggx::Ggx;
use crate::math::Vector;
use crate::shading::fresnel;
use crate::simd::{Float, Int, Isa, Kernel, Lanes, dispatch};

/// Ratios of indices on each side, by (η − 1)/(η + 1): nodes at squares, closer together near a ratio of 1.
const RATIOS: usize = 17;
/// The last of the [`RATIOS`]: ior 99. Larger ratios are clamped to it.
const LAST: f32 = 0.98;
/// Ratios for means over smooth boundaries, which need no sampling.
const SMOOTH_RATIOS: usize = 160;
const ROUGHNESSES: usize = 16;
/// Nodes of [`Cosine`].
const COSINES: usize = 25;
/// Directions per entry.
const SAMPLES: u32 = 512;
/// Steps of means over the hemisphere.
const STEPS: usize = 200;

/// Tables by side, ratio of indices, roughness and cosine.
pub struct GlassTable {
    /// Columns of [`Divided::kept`] and [`Divided::reflected`].
    kept: Vec<f32>,
    reflected: Vec<f32>,
    /// Means over the hemisphere of the light that is not reflected, by side, ratio and roughness.
    means: Vec<f32>,
    /// The means for smooth boundaries seen from outside, by ratio.
    smooth_means: Vec<f32>,
}

impl GlassTable {
    /// An empty table.
    pub(super) const EMPTY: GlassTable =
        GlassTable { kept: Vec::new(), reflected: Vec::new(), means: Vec::new(), smooth_means: Vec::new() };

    /// Computes the table, in a tenth of a second.
    pub(super) fn new() -> Self {
        let (isa, points) = (Isa::detect(), Points::new(SAMPLES));
        let mut table = Self::EMPTY;
        for (inside, node) in sides(RATIOS) {
            let eta = ratio(node, RATIOS, LAST, inside);
            for r in 0..ROUGHNESSES {
                let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
                let alpha = (roughness * roughness).max(1e-3);
                for c in 0..COSINES {
                    let cosine = Cosine { eta, inside }.of_node(c, COSINES);
                    let w = Vector::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
                    let entry = integrate(isa, w, Ggx { x: alpha, y: alpha }, eta, &points);
                    table.kept.push(entry.kept);
                    table.reflected.push(entry.reflected);
                }
            }
        }
        for node in 0..SMOOTH_RATIOS {
            let outside = Cosine { eta: ratio(node, SMOOTH_RATIOS, LAST, false), inside: false };
            table.smooth_means.push(outside.mean(STEPS, |c| fresnel::reflectance(c, outside.eta)));
        }
        for (inside, node) in sides(RATIOS) {
            let eta = ratio(node, RATIOS, LAST, inside);
            for r in 0..ROUGHNESSES {
                let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
                let reflected = |cosine| table.directional(cosine, roughness, eta, true).reflected;
                table.means.push(Cosine { eta, inside }.mean(STEPS, reflected));
            }
        }
        table
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
        for (out, table) in out.iter_mut().zip([&self.kept, &self.reflected]) {
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
        plane(&self.means, (side + e) * row + r, row, wr, we, mask)
    }

    /// [`GlassTable::transmitted_mean`] for a smooth boundary.
    #[inline(always)]
    pub fn smooth_transmitted_mean<F: Float>(&self, eta: F, mask: F::Mask) -> F {
        let (_, e, we) = between_ratios(eta, SMOOTH_RATIOS, LAST);
        let low = F::gather(&self.smooth_means, e, mask);
        let high = F::gather(&self.smooth_means, e + F::Int::splat(1), mask);
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

/// All nodes of both sides: from outside, then from inside.
pub(super) fn sides(ratios: usize) -> impl Iterator<Item = (bool, usize)> {
    [false, true].into_iter().flat_map(move |inside| (0..ratios).map(move |node| (inside, node)))
}

/// The ratio of indices at a node, viewer's side divided by the other.
pub(super) fn ratio(node: usize, ratios: usize, last: f32, inside: bool) -> f32 {
    let place = node as f32 / (ratios - 1) as f32;
    // At exactly 1 there would be no critical angle, near which the nodes lie.
    let odd = (last * place * place).max(1e-4);
    let ior = (1.0 + odd) / (1.0 - odd);
    if inside { ior } else { 1.0 / ior }
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

impl Cosine<f32> {
    /// The cosine at a node.
    pub fn of_node(&self, node: usize, nodes: usize) -> f32 {
        self.at(node as f32 / (nodes - 1) as f32).max(1e-3)
    }

    /// The mean ∫ (1 − f(μ)) 2μ dμ.
    pub fn mean(&self, steps: usize, reflected: impl Fn(f32) -> f32) -> f32 {
        let (mut sum, mut low) = (0.0f64, 0.0f32);
        for i in 0..steps {
            let high = self.at((i + 1) as f32 / steps as f32);
            let left = f64::from(1.0 - reflected(self.at((i as f32 + 0.5) / steps as f32)));
            sum += left * (f64::from(high) * f64::from(high) - f64::from(low) * f64::from(low));
            low = high;
        }
        (sum as f32).max(1e-6)
    }

    /// The cosine at a position between the first node, 0, and the last, 1.
    fn at(&self, place: f32) -> f32 {
        let critical = self.critical();
        match (self.inside, place <= 0.5) {
            (false, _) => place * place,
            (true, true) => critical * crowded(2.0 * place),
            (true, false) => critical + (1.0 - critical) * crowded(2.0 * place - 1.0),
        }
    }
}

/// Maps 0..1 to 0..1, with a small slope at both ends.
fn crowded(place: f32) -> f32 {
    if place < 0.5 { 2.0 * place * place } else { 1.0 - 2.0 * (1.0 - place) * (1.0 - place) }
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

/// The division of light from a direction: the mean of G₂/G₁ over visible normals and both ways that light can take at
/// each.
pub(super) fn integrate(isa: Isa, w: Vector<f32>, ggx: Ggx<f32>, eta: f32, points: &Points) -> Divided<f32> {
    dispatch(isa, GlassIntegral { w, ggx, eta, points })
}

struct GlassIntegral<'a> {
    w: Vector<f32>,
    ggx: Ggx<f32>,
    eta: f32,
    points: &'a Points,
}

impl Kernel for GlassIntegral<'_> {
    type Output = Divided<f32>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Divided<f32> {
        self.sum::<L::Queue>()
    }
}

impl GlassIntegral<'_> {
    #[inline(always)]
    fn sum<F: Float>(&self) -> Divided<f32> {
        let w = Vector::new(F::splat(self.w.x), F::splat(self.w.y), F::splat(self.w.z));
        let ggx = Ggx { x: F::splat(self.ggx.x), y: F::splat(self.ggx.y) };
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
            // Added sequentially, so that the sums do not depend on the number of lanes.
            for (sum, part) in sums.iter_mut().zip([reflected * kept, kept, through]) {
                let mut lanes = [0.0; 16];
                part.store(&mut lanes);
                for value in &lanes[..F::WIDTH] {
                    *sum += f64::from(*value);
                }
            }
        }
        let [back, mirror, through] = sums;
        let whole = back + through;
        Divided { kept: (whole / mirror.max(1.0)) as f32, reflected: (back / whole.max(1.0)) as f32 }
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
    use super::super::tables::LobeTables;
    use super::*;

    #[test]
    fn between_its_nodes_the_table_is_the_integral() {
        let (points, tables) = (Points::new(4096), LobeTables::all());
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
            let whole = exact.kept * albedo::integrate(Isa::detect(), w, ggx, &points).0.whole();
            let own = albedo::directional(tables.mirror, cosine, roughness, true).whole();
            let found = tables.glass.directional(cosine, roughness, eta, true);
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
        let tables = LobeTables::all();
        for ior in [1.0003f32, 1.01, 1.2, 1.33, 1.5, 2.4, 4.0, 20.0] {
            for eta in [ior, 1.0 / ior] {
                let exact = Cosine { eta, inside: eta > 1.0 }.mean(20_000, |c| fresnel::reflectance(c, eta));
                let found = tables.glass.smooth_transmitted_mean(eta, true);
                assert!((found / exact - 1.0).abs() < 0.001, "{eta}: {found} {exact}");
            }
        }
    }
}
