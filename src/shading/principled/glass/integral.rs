//! The integrals behind the table.

use super::super::albedo::integral::Points;
use super::super::ggx::Ggx;
use super::{COSINES, Cosine, Divided, GlassTable, LAST, RATIOS, ROUGHNESSES, SMOOTH_RATIOS};
use crate::math::Vector;
use crate::shading::fresnel;
use crate::simd::{Float, Isa, Kernel, Lanes, dispatch};

/// Directions per entry.
const SAMPLES: u32 = 512;
/// Steps of means over the hemisphere.
const STEPS: usize = 200;

/// Computes the numbers of the table.
pub fn numbers() -> Vec<f32> {
    let (isa, points) = (Isa::detect(), Points::new(SAMPLES));
    let (mut kept, mut reflected) = (Vec::new(), Vec::new());
    for (inside, node) in sides(RATIOS) {
        let eta = ratio(node, RATIOS, LAST, inside);
        for r in 0..ROUGHNESSES {
            let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
            let alpha = (roughness * roughness).max(1e-3);
            for c in 0..COSINES {
                let cosine = Cosine { eta, inside }.of_node(c, COSINES);
                let w = Vector::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
                let entry = integrate(isa, w, Ggx { x: alpha, y: alpha }, eta, &points);
                kept.push(entry.kept);
                reflected.push(entry.reflected);
            }
        }
    }
    let mut smooth_means = Vec::new();
    for node in 0..SMOOTH_RATIOS {
        let outside = Cosine { eta: ratio(node, SMOOTH_RATIOS, LAST, false), inside: false };
        smooth_means.push(outside.mean(STEPS, |c| fresnel::reflectance(c, outside.eta)));
    }
    let table = GlassTable { kept: &kept, reflected: &reflected, means: &[], smooth_means: &[] };
    let mut means = Vec::new();
    for (inside, node) in sides(RATIOS) {
        let eta = ratio(node, RATIOS, LAST, inside);
        for r in 0..ROUGHNESSES {
            let roughness = r as f32 / (ROUGHNESSES - 1) as f32;
            let reflected = |cosine| table.directional(cosine, roughness, eta, true).reflected;
            means.push(Cosine { eta, inside }.mean(STEPS, reflected));
        }
    }
    [kept, reflected, means, smooth_means].concat()
}

/// All nodes of both sides: from outside, then from inside.
pub fn sides(ratios: usize) -> impl Iterator<Item = (bool, usize)> {
    [false, true].into_iter().flat_map(move |inside| (0..ratios).map(move |node| (inside, node)))
}

/// The ratio of indices at a node, viewer's side divided by the other.
pub fn ratio(node: usize, ratios: usize, last: f32, inside: bool) -> f32 {
    let place = node as f32 / (ratios - 1) as f32;
    // At exactly 1 there would be no critical angle, near which the nodes lie.
    let odd = (last * place * place).max(1e-4);
    let ior = (1.0 + odd) / (1.0 - odd);
    if inside { ior } else { 1.0 / ior }
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

/// The division of light from a direction: the mean of G₂/G₁ over visible normals and both ways that light can take at
/// each.
pub fn integrate(isa: Isa, w: Vector<f32>, ggx: Ggx<f32>, eta: f32, points: &Points) -> Divided<f32> {
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
