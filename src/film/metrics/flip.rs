//! LDR-FLIP, the difference of two images that are shown in turn: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström
//! and Fairchild, "FLIP: A Difference Evaluator for Alternating Images" (2020). Names and constants are the paper's.
//!
//! Written from the paper: the only crate for it wraps the authors' C++.

use std::f64::consts::PI;

use super::raster::{Raster, gaussian, normalised};
use crate::math::{DMat3, DVec3, Rgb};

/// The angular resolution of the paper's viewer: 0.7 m from a screen that is 0.7 m and 3,840 pixels wide.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;
/// The exponents of colour and feature differences, and the knee of the former.
const QC: f64 = 0.7;
const QF: f64 = 0.5;
const PC: f64 = 0.4;
const PT: f64 = 0.95;
/// The width of the feature detectors in degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// Contrast sensitivity as sums of Gaussians (a, b), for the three components of YCxCz.
const SENSITIVITY: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// A pixel in a colour space between linear light and perception.
type ColorTriple = [f64; 3];

/// Returns the error of each pixel, from 0 to 1. Inputs are linear, 0 to 1.
pub(super) fn map(width: usize, reference: &[Rgb], test: &[Rgb]) -> Vec<f64> {
    let space = Space::new();
    let (reference, test) = (Perceived::new(&space, width, reference), Perceived::new(&space, width, test));
    let largest =
        libm::pow(hyab(space.hunt(DVec3::new(0.0, 1.0, 0.0)), space.hunt(DVec3::new(0.0, 0.0, 1.0))), QC);
    let color = |i: usize| bend(libm::pow(hyab(reference.color[i], test.color[i]), QC), largest);
    let feature = |i: usize| {
        let edge = (reference.edges[i] - test.edges[i]).abs();
        let point = (reference.points[i] - test.points[i]).abs();
        libm::pow(edge.max(point) / 2f64.sqrt(), QF)
    };
    (0..reference.color.len()).map(|i| libm::pow(color(i), 1.0 - feature(i).min(1.0))).collect()
}

/// Compresses large differences into the range from PT to 1.
fn bend(difference: f64, largest: f64) -> f64 {
    let limit = PC * largest;
    if difference < limit {
        difference * PT / limit
    } else {
        PT + (difference - limit) / (largest - limit) * (1.0 - PT)
    }
}

/// The HyAB distance between colours, which is valid for large distances too.
fn hyab(a: ColorTriple, b: ColorTriple) -> f64 {
    let [lightness, red, yellow] = [0, 1, 2].map(|i| a[i] - b[i]);
    lightness.abs() + (red * red + yellow * yellow).sqrt()
}

/// An image as the eye perceives it.
struct Perceived {
    /// Hunt-adjusted L*a*b*, blurred as far as the eye blurs it.
    color: Vec<ColorTriple>,
    /// The strength of edges in each pixel.
    edges: Vec<f64>,
    /// The strength of points and lines in each pixel.
    points: Vec<f64>,
}

impl Perceived {
    fn new(space: &Space, width: usize, pixels: &[Rgb]) -> Perceived {
        let plane = |i: usize| Raster::new(width, pixels, |pixel| space.opponent(pixel)[i]);
        let [y, cx, cz] = [0, 1, 2].map(|i| sensed(&plane(i), SENSITIVITY[i]));
        let color = (0..pixels.len())
            .map(|i| space.hunt(space.light([y.values[i], cx.values[i], cz.values[i]])))
            .collect();
        drop([y, cx, cz]);
        // Features are detected in lightness from 0 to 1.
        let lightness = Raster::new(width, &plane(0).values, |y| (y + 16.0) / 116.0);
        Perceived {
            color,
            edges: features(&lightness, edge_weights),
            points: features(&lightness, point_weights),
        }
    }
}

/// Filters a component by the eye's contrast sensitivity at the viewer's distance.
fn sensed(plane: &Raster, gaussians: &[(f64, f64)]) -> Raster {
    // All components use the radius of the widest: 3 σ.
    let sigma = |b: f64| (b / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma(0.04)).ceil() as usize;
    let parts: Vec<(f64, Vec<f64>)> = gaussians
        .iter()
        .map(|(a, b)| {
            let weights = gaussian(sigma(*b), radius);
            let sum: f64 = weights.iter().sum();
            (a * (PI / b).sqrt() * sum * sum, normalised(&weights))
        })
        .collect();
    let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
    let mut out = plane.zip(plane, |_, _| 0.0);
    for (weight, weights) in parts {
        out = out.zip(&plane.filtered(&weights, &weights), |sum, more| sum + more * weight / total);
    }
    out
}

/// Returns the response of a pair of detectors, along rows and along columns.
fn features(lightness: &Raster, detector: impl Fn(f64, usize) -> Vec<f64>) -> Vec<f64> {
    let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as usize;
    let (weights, blur) = (detector(sigma, radius), normalised(&gaussian(sigma, radius)));
    let (across, down) = (lightness.filtered(&weights, &blur), lightness.filtered(&blur, &weights));
    across.zip(&down, |x, y| (x * x + y * y).sqrt()).values
}

fn edge_weights(sigma: f64, radius: usize) -> Vec<f64> {
    balanced(sigma, radius, |x| -x)
}

fn point_weights(sigma: f64, radius: usize) -> Vec<f64> {
    balanced(sigma, radius, |x| x * x / (sigma * sigma) - 1.0)
}

/// Returns a Gaussian times `factor`, with positive weights that add up to 1 and negative ones to −1.
fn balanced(sigma: f64, radius: usize, factor: impl Fn(f64) -> f64) -> Vec<f64> {
    let weights: Vec<f64> = gaussian(sigma, radius)
        .iter()
        .enumerate()
        .map(|(i, weight)| weight * factor(i as f64 - radius as f64))
        .collect();
    let positive: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -weights.iter().filter(|w| **w < 0.0).sum::<f64>();
    weights.iter().map(|w| w / if *w > 0.0 { positive } else { negative }).collect()
}

/// Conversion from linear Rec. 709 to YCxCz and L*a*b*, and from YCxCz back.
struct Space {
    to_xyz: DMat3,
    from_xyz: DMat3,
    white: DVec3,
}

impl Space {
    fn new() -> Space {
        // The primaries and the white of IEC 61966-2-1.
        let to_xyz = DMat3::from_cols(
            DVec3::new(0.412_386_56, 0.212_636_82, 0.019_330_62),
            DVec3::new(0.357_591_49, 0.715_182_98, 0.119_197_16),
            DVec3::new(0.180_450_49, 0.072_180_20, 0.950_372_59),
        );
        Space { to_xyz, from_xyz: to_xyz.inverse(), white: to_xyz * DVec3::ONE }
    }

    /// Converts to YCxCz: linear, but scaled like L*a*b*.
    fn opponent(&self, pixel: &Rgb) -> ColorTriple {
        let linear = DVec3::from_array(pixel.to_array().map(f64::from));
        let DVec3 { x, y, z } = self.to_xyz * linear / self.white;
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// The inverse of [`Space::opponent`], clamped to what a screen can show.
    fn light(&self, [y, cx, cz]: ColorTriple) -> DVec3 {
        let y = (y + 16.0) / 116.0;
        let xyz = DVec3::new(y + cx / 500.0, y, y - cz / 200.0) * self.white;
        (self.from_xyz * xyz).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// Converts to L*a*b*, with less chroma in the dark.
    fn hunt(&self, linear: DVec3) -> ColorTriple {
        const DELTA: f64 = 6.0 / 29.0;
        let [x, y, z] = (self.to_xyz * linear / self.white).to_array().map(|t| {
            if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
        });
        let lightness = 116.0 * y - 16.0;
        [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(width: usize, a: &[Rgb], b: &[Rgb]) -> f64 {
        let map = map(width, a, b);
        assert!(map.iter().all(|error| (0.0..=1.0).contains(error)));
        map.iter().sum::<f64>() / map.len() as f64
    }

    /// An image by formula, so that other programs can make the same one.
    fn waves(phase: f64) -> Vec<Rgb> {
        let level = |x: f64| (0.5 + 0.5 * libm::sin(x + phase)) as f32;
        (0..64 * 48)
            .map(|i| {
                let (x, y) = (f64::from(i % 64), f64::from(i / 64));
                Rgb::new(level(0.3 * x), level(0.2 * y), level(0.1 * (x + y)))
            })
            .collect()
    }

    /// The expected values are those of the authors' program (1.7, `flip_evaluator` for Python).
    #[test]
    fn flip_matches_authors_program() {
        assert!((mean(64, &waves(0.0), &waves(0.5)) - 0.638_353).abs() < 2e-4);
        let errors = map(64, &waves(0.0), &waves(0.5));
        for (x, y, wanted) in [(0, 0, 0.442_252), (20, 10, 0.641_797), (63, 47, 0.789_295)] {
            let got = errors[y * 64 + x];
            assert!((got - wanted).abs() < 1e-3, "{x} {y}: {got}, not {wanted}");
        }
        let (black, white) = (vec![Rgb::BLACK; 400], vec![Rgb::WHITE; 400]);
        assert!((mean(20, &black, &white) - 0.967_386).abs() < 2e-4);
    }

    #[test]
    fn flip_of_equal_images_is_zero() {
        let picture = waves(0.0);
        assert_eq!(mean(64, &picture, &picture), 0.0);
        assert_eq!(mean(1, &picture[..7], &picture[..7]), 0.0);
    }
}
