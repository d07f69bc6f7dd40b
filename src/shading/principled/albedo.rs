//! The albedo of a rough mirror of reflectance 1 after a single bounce between its microfacets. The missing light
//! bounces more than once, and is returned by a separate lobe (Kulla and Conty 2017), so that a white surface passes
//! the furnace test.

use std::num::Wrapping;

use super::ggx::Ggx;
use crate::math::Vector;
use crate::sampling::sobol;
use crate::simd::{Float, Int, Isa, Kernel, Lanes, dispatch};

/// Cosines in the table: the nodes are at squares, closer together at grazing angles.
const COSINES: usize = 40;
/// Roughnesses (√α) in the table.
const ROUGHNESSES: usize = 28;
/// Directions per entry.
const SAMPLES: u32 = 2048;

/// The albedo of GGX with Schlick's Fresnel term F₀ (1 − f) + F₉₀ f, f = (1 − cos)⁵, is F₀ · `straight` + F₉₀ ·
/// `grazing`. The table holds both at each roughness and cosine, and their means over the hemisphere.
pub struct AlbedoTable {
    entries: Vec<f32>,
    means: Vec<f32>,
    /// Mean and standard deviation of the cosine of incidence at microfacets, weighted by the reflected light.
    cosines: Vec<f32>,
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

impl AlbedoTable {
    /// An empty table.
    pub(super) const EMPTY: AlbedoTable =
        AlbedoTable { entries: Vec::new(), means: Vec::new(), cosines: Vec::new() };

    /// Computes the table, in some hundredths of a second.
    pub(super) fn new() -> Self {
        let (isa, points) = (Isa::detect(), Points::new(SAMPLES));
        let (mut entries, mut means, mut cosines) = (Vec::new(), Vec::new(), Vec::new());
        for r in 0..ROUGHNESSES {
            let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
            let alpha = (roughness * roughness).max(1e-4);
            for c in 0..COSINES {
                let node = c as f32 / (COSINES - 1) as f32;
                let cosine = (node * node).max(1e-4);
                let w = Vector::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
                let (albedo, cosine) = integrate(isa, w, Ggx { x: alpha, y: alpha }, &points);
                entries.extend([albedo.at_normal, albedo.at_grazing]);
                cosines.extend(cosine);
            }
            // The mean ∫ 2 μ E(μ) dμ.
            let steps = 256;
            let (mut at_normal, mut at_grazing) = (0.0f64, 0.0f64);
            for i in 0..steps {
                let cosine = (i as f64 + 0.5) / steps as f64;
                let place = cosine.sqrt() * (COSINES - 1) as f64;
                let at = (place as usize).min(COSINES - 2);
                let weight = place - at as f64;
                let first = 2 * (r * COSINES + at);
                let value = |k: usize| {
                    entries[first + k] as f64 * (1.0 - weight) + entries[first + 2 + k] as f64 * weight
                };
                at_normal += 2.0 * cosine * value(0) / steps as f64;
                at_grazing += 2.0 * cosine * value(1) / steps as f64;
            }
            means.extend([at_normal as f32, at_grazing as f32]);
        }
        AlbedoTable { entries, means, cosines }
    }
}

/// Points of the unit square, shared by all entries of a table.
pub(super) struct Points {
    u: Vec<f32>,
    v: Vec<f32>,
}

impl Points {
    /// Creates `count` points, a multiple of the number of lanes.
    pub fn new(count: u32) -> Self {
        let points = (0..count).map(|i| sobol::two::<f32>(Wrapping(i), Wrapping(1)));
        let (u, v) = points.unzip();
        Self { u, v }
    }

    /// The number of points.
    pub fn count(&self) -> usize {
        self.u.len()
    }

    /// Loads points from an index on, one per lane.
    #[inline(always)]
    pub fn load<F: Float>(&self, at: usize) -> (F, F) {
        (F::load(&self.u[at..]), F::load(&self.v[at..]))
    }
}

/// The mean of G₂/G₁ over visible normals, split into the Fresnel term's two parts; and mean and standard deviation of
/// the cosine of incidence.
pub(super) fn integrate(isa: Isa, w: Vector<f32>, ggx: Ggx<f32>, points: &Points) -> (Albedo<f32>, [f32; 2]) {
    dispatch(isa, AlbedoIntegral { w, ggx, points })
}

struct AlbedoIntegral<'a> {
    w: Vector<f32>,
    ggx: Ggx<f32>,
    points: &'a Points,
}

impl Kernel for AlbedoIntegral<'_> {
    type Output = (Albedo<f32>, [f32; 2]);
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        self.sum::<L::Queue>()
    }
}

impl AlbedoIntegral<'_> {
    #[inline(always)]
    fn sum<F: Float>(&self) -> (Albedo<f32>, [f32; 2]) {
        let w = Vector::new(F::splat(self.w.x), F::splat(self.w.y), F::splat(self.w.z));
        let ggx = Ggx { x: F::splat(self.ggx.x), y: F::splat(self.ggx.y) };
        let own = F::one() + ggx.lambda(w);
        let (mut at_normal, mut at_grazing) = (0.0f64, 0.0f64);
        let (mut first, mut second) = (0.0f64, 0.0f64);
        let count = self.points.count();
        for at in (0..count).step_by(F::WIDTH) {
            let h = ggx.sample(w, self.points.load(at));
            let cos = w.dot(h).max(F::zero());
            let wi = h * (F::splat(2.0) * cos) - w;
            let weight = own / (own + ggx.lambda(wi));
            let weight = F::select(wi.z.gt(F::zero()), weight, F::zero());
            let (mut weights, mut cosines) = ([0.0; 16], [0.0; 16]);
            weight.store(&mut weights);
            cos.store(&mut cosines);
            // Added sequentially, so that the sum does not depend on the number of lanes.
            for (weight, cos) in weights[..F::WIDTH].iter().zip(cosines) {
                let weight = f64::from(*weight);
                let f = (1.0 - f64::from(cos)).powi(5);
                at_normal += weight * (1.0 - f);
                at_grazing += weight * f;
                first += weight * f64::from(cos);
                second += weight * f64::from(cos * cos);
            }
        }
        let whole = (at_normal + at_grazing).max(1e-9);
        let mean = first / whole;
        let deviation = (second / whole - mean * mean).max(0.0).sqrt();
        let count = count as f64;
        let albedo =
            Albedo { at_normal: (at_normal / count) as f32, at_grazing: (at_grazing / count) as f32 };
        (albedo, [mean as f32, deviation as f32])
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
    let [at_normal, at_grazing] = pair(&table.entries, cosine, roughness, mask);
    Albedo { at_normal, at_grazing }
}

/// Two cosines that represent all angles of incidence at microfacets, one standard deviation to either side of the
/// mean: a function of the angle has about the same mean over both as over all.
#[inline(always)]
pub fn cosines<F: Float>(table: &AlbedoTable, cosine: F, roughness: F, mask: F::Mask) -> [F; 2] {
    let [mean, deviation] = pair(&table.cosines, cosine, roughness, mask);
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
    entry(&table.means, first, mask).mix(entry(&table.means, first + F::Int::splat(2), mask), wr)
}

/// Loads both parts from a table, starting at `first`.
#[inline(always)]
pub(super) fn entry<F: Float>(table: &[f32], first: F::Int, mask: F::Mask) -> Albedo<F> {
    Albedo {
        at_normal: F::gather(table, first, mask),
        at_grazing: F::gather(table, first + F::Int::splat(1), mask),
    }
}
