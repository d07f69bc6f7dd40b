//! The albedo of a rough mirror of reflectance 1 after a single bounce between its microfacets. The missing light
//! bounces more than once, and is returned by a separate lobe (Kulla and Conty 2017), so that a white surface passes
//! the furnace test.

#[cfg(test)]
pub(super) mod integral;

use crate::simd::{Float, Int};

/// Cosines in the table: the nodes are at squares, closer together at grazing angles.
const COSINES: usize = 40;
/// Roughnesses (√α) in the table.
const ROUGHNESSES: usize = 28;
const ENTRIES: usize = 2 * ROUGHNESSES * COSINES;
const MEANS: usize = 2 * ROUGHNESSES;
/// The count of all numbers of the table.
pub(super) const LENGTH: usize = 2 * ENTRIES + MEANS;

/// The albedo of GGX with Schlick's Fresnel term F₀ (1 − f) + F₉₀ f, f = (1 − cos)⁵, is F₀ · `straight` + F₉₀ ·
/// `grazing`. The table holds both at each roughness and cosine, and their means over the hemisphere.
pub struct AlbedoTable<'a> {
    entries: &'a [f32],
    means: &'a [f32],
    /// Mean and standard deviation of the cosine of incidence at microfacets, weighted by the reflected light.
    cosines: &'a [f32],
}

impl<'a> AlbedoTable<'a> {
    /// Divides numbers into columns.
    pub(super) const fn new(numbers: &'a [f32; LENGTH]) -> Self {
        let (entries, rest) = numbers.split_at(ENTRIES);
        let (means, cosines) = rest.split_at(MEANS);
        Self { entries, means, cosines }
    }
}

/// The two parts of an albedo (see [`directional`]).
#[derive(Clone, Copy)]
pub struct Albedo<F> {
    /// The coefficient of F₀.
    pub at_normal: F,
    /// The coefficient of F₉₀.
    pub at_grazing: F,
}

impl<F: Float> Albedo<F> {
    /// The albedo of a surface that reflects everything.
    #[inline(always)]
    pub fn whole(&self) -> F {
        self.at_normal + self.at_grazing
    }

    /// Interpolates linearly.
    #[inline(always)]
    pub(super) fn mix(self, other: Self, weight: F) -> Self {
        let rest = F::one() - weight;
        Self {
            at_normal: self.at_normal * rest + other.at_normal * weight,
            at_grazing: self.at_grazing * rest + other.at_grazing * weight,
        }
    }
}

/// The lower node of a position between two nodes, and the weight of the upper one.
#[inline(always)]
pub(super) fn between<F: Float>(place: F, nodes: usize) -> (F::Int, F) {
    let place = place.clamp(0.0, (nodes - 1) as f32);
    let node = place.floor().min(F::splat((nodes - 2) as f32));
    (node.to_int(), place - node)
}

/// The albedo for a cosine to the normal and a roughness √α.
#[inline(always)]
pub fn directional<F: Float>(table: &AlbedoTable, cosine: F, roughness: F, mask: F::Mask) -> Albedo<F> {
    let [at_normal, at_grazing] = pair(table.entries, cosine, roughness, mask);
    Albedo { at_normal, at_grazing }
}

/// Two cosines that represent all angles of incidence at microfacets, one standard deviation to either side of the
/// mean: a function of the angle has about the same mean over both as over all.
#[inline(always)]
pub fn cosines<F: Float>(table: &AlbedoTable, cosine: F, roughness: F, mask: F::Mask) -> [F; 2] {
    let [mean, deviation] = pair(table.cosines, cosine, roughness, mask);
    [(mean - deviation).clamp(1e-3, 1.0), (mean + deviation).clamp(1e-3, 1.0)]
}

/// Looks up a pair of numbers.
#[inline(always)]
fn pair<F: Float>(table: &[f32], cosine: F, roughness: F, mask: F::Mask) -> [F; 2] {
    let (c, wc) = between(cosine.max(F::zero()).sqrt() * F::splat((COSINES - 1) as f32), COSINES);
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let first = (r * F::Int::splat(COSINES as u32) + c) * F::Int::splat(2);
    let row = F::Int::splat(2 * COSINES as u32);
    let low = entry(table, first, mask).mix(entry(table, first + F::Int::splat(2), mask), wc);
    let first = first + row;
    let high = entry(table, first, mask).mix(entry(table, first + F::Int::splat(2), mask), wc);
    let both = low.mix(high, wr);
    [both.at_normal, both.at_grazing]
}

/// The mean albedo over the hemisphere, with weight cos/π.
#[inline(always)]
pub fn average<F: Float>(table: &AlbedoTable, roughness: F, mask: F::Mask) -> Albedo<F> {
    let (r, wr) = between(roughness * F::splat((ROUGHNESSES - 1) as f32), ROUGHNESSES);
    let first = r * F::Int::splat(2);
    entry(table.means, first, mask).mix(entry(table.means, first + F::Int::splat(2), mask), wr)
}

/// Loads both parts from a table, starting at `first`.
#[inline(always)]
pub(super) fn entry<F: Float>(table: &[f32], first: F::Int, mask: F::Mask) -> Albedo<F> {
    Albedo {
        at_normal: F::gather(table, first, mask),
        at_grazing: F::gather(table, first + F::Int::splat(1), mask),
    }
}
