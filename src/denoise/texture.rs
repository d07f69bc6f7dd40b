//! The texture of surfaces: albedo relative to a material's mean, which is divided out before filtering and multiplied
//! back afterwards, so that fine patterns survive however much is averaged.
//!
//! Only pixels among others of their own material take part: where several surfaces share a pixel, its light is not
//! proportional to the mean albedo of its samples.

use std::collections::BTreeMap;

use super::plane::ImagePlane;
use crate::film::Features;

/// Added to albedos: light that is reflected at a surface does not depend on its colour.
const GLOSS: f32 = 0.1;
/// The squared length of a mean normal below which samples hit different surfaces.
const ONE_SURFACE: f32 = 0.98;

/// Returns the factors of even and of odd samples, `[half][channel]`: 1 where there is no texture.
pub fn factors(size: [usize; 2], halves: [&[Features]; 2]) -> [[ImagePlane; 3]; 2] {
    let means = means(halves);
    let pure = pure(size, halves);
    halves.map(|half| {
        [0, 1, 2].map(|channel: usize| {
            ImagePlane::new(size, |at| match means.get(&half[at].material) {
                Some(mean) if pure[at] => {
                    (half[at].albedo.to_array()[channel] + GLOSS) / (mean[channel] + GLOSS)
                }
                _ => 1.0,
            })
        })
    })
}

/// Returns the mean albedo of each material.
fn means(halves: [&[Features]; 2]) -> BTreeMap<u32, [f32; 3]> {
    let mut sums = BTreeMap::<u32, [f64; 4]>::new();
    for of in halves.into_iter().flatten().filter(|of| of.material != 0) {
        let sum = sums.entry(of.material).or_default();
        let [r, g, b] = of.albedo.to_array();
        sum.iter_mut().zip([r, g, b, 1.0]).for_each(|(sum, value)| *sum += f64::from(value));
    }
    sums.into_iter()
        .map(|(material, [r, g, b, count])| (material, [r, g, b].map(|sum| (sum / count) as f32)))
        .collect()
}

/// True for each pixel if it and its neighbours show one material and one surface each.
fn pure(size: [usize; 2], halves: [&[Features]; 2]) -> Vec<bool> {
    let [width, height] = size;
    let around = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
    let one_surface = |of: &Features| of.normal.iter().map(|n| n * n).sum::<f32>() > ONE_SURFACE;
    let is_pure = |at: usize| {
        let own = halves[0][at].material;
        let like = |at: usize| halves.iter().all(|half| half[at].material == own && one_surface(&half[at]));
        around(at / width, height).all(|y| around(at % width, width).all(|x| like(y * width + x)))
    };
    (0..width * height).map(is_pure).collect()
}
