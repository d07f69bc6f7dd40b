//! The integrals behind the table.

use std::num::Wrapping;

use super::super::ggx::Ggx;
use super::{Albedo, COSINES, ROUGHNESSES};
use crate::math::Vector;
use crate::sampling::sobol;
use crate::simd::{Float, Isa, Kernel, Lanes, dispatch};

/// Directions per entry.
const SAMPLES: u32 = 2048;

/// Computes the numbers of the table.
pub fn numbers() -> Vec<f32> {
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
    [entries, means, cosines].concat()
}

/// Points of the unit square, shared by all entries of a table.
pub struct Points {
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
pub fn integrate(isa: Isa, w: Vector<f32>, ggx: Ggx<f32>, points: &Points) -> (Albedo<f32>, [f32; 2]) {
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
