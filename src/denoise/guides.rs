//! Feature planes, made from the first hits of samples, which guide the filter.

use super::filter::{FilterPass, FilteredImage};
use super::plane::{ImagePlane, variance};
use crate::film::Features;
use crate::math::elementary::log2;
use crate::simd::Isa;

/// The difference that leaves e⁻¹ of the weight: in albedo, in a coordinate of a normal, or relative in a distance.
const WIDTH: f32 = 0.1;
/// The radius of the filter in pixels.
const RADIUS: usize = 3;
/// The radius of patches in pixels; see [`super::PATCH`].
const PATCH: usize = 2;
/// Added to variances: below the square of any difference that matters.
const LEAST: f32 = 1e-6;

/// Returns planes of denoised albedo, normal, depth and coverage, in units of [`WIDTH`], and [`ImagePlane::frame`].
pub fn features(isa: Isa, size: [usize; 2], halves: [&[Features]; 2]) -> Vec<ImagePlane> {
    let mut planes = Vec::with_capacity(9);
    for group in [&[0, 1, 2][..], &[3, 4, 5], &[6, 7]] {
        let [even, odd] = halves.map(|half| -> Vec<ImagePlane> {
            group.iter().map(|number| ImagePlane::new(size, |at| feature(&half[at], *number))).collect()
        });
        let noise: Vec<ImagePlane> =
            even.iter().zip(&odd).map(|(even, odd)| variance(even, odd, 1)).collect();
        let halves = [&even, &odd].map(|half| half.iter().collect::<Vec<_>>());
        let halves = [&halves[0][..], &halves[1][..]];
        let pass = FilterPass {
            halves,
            compared: halves,
            variance: &noise.iter().collect::<Vec<_>>(),
            features: &[],
            sharpness: 1.0,
            candidates: &[FilteredImage::Colors(0)],
            radius: RADIUS,
            stride: None,
            patch: PATCH,
            least: LEAST,
        };
        for [even, odd] in pass.run(isa) {
            let width = size[0].max(1);
            for (even, odd) in even.iter().zip(&odd).take(group.len()) {
                let of = |at: usize| {
                    (even.at(at % width, at / width) + odd.at(at % width, at / width)) * (0.5 / WIDTH)
                };
                planes.push(ImagePlane::new(size, of));
            }
        }
    }
    planes.push(ImagePlane::frame(size));
    planes
}

/// Returns one of the eight features.
fn feature(of: &Features, number: usize) -> f32 {
    match number {
        0..3 => of.albedo.to_array()[number],
        3..6 => of.normal[number - 3],
        // The logarithm, so that the size of a scene does not matter; 0 where nothing was hit.
        6 if of.coverage > 0.0 => log2(of.depth_m.clamp(1e-30, 1e30)) * std::f32::consts::LN_2 * of.coverage,
        6 => 0.0,
        _ => of.coverage,
    }
}
