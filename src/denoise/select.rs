//! Selection of the candidate with the smallest error, pixel by pixel.

use super::plane::{ImagePlane, variance};

/// Errors are averaged over this many pixels to each side.
const ERROR_RADIUS: usize = 2;
/// One choice fades into another over this many pixels to each side.
const FADE_RADIUS: usize = 2;

/// The sum of weights that is enough to average away noise.
const ENOUGH: f32 = 4.0;

/// Completes pixels with too few similar ones, as at silhouettes, from the candidate `wide`, which accepts more pixels:
/// as much of it as is missing. The last plane of each half holds the sums of weights.
pub fn complete(candidates: &[[[ImagePlane; 4]; 2]], wide: usize) -> Vec<[[ImagePlane; 3]; 2]> {
    let completed = |own: &[ImagePlane; 4], other: &[ImagePlane; 4]| {
        [0, 1, 2].map(|channel: usize| {
            ImagePlane::of(own[3].size, |x, y| {
                let [weight, more] = [own, other].map(|planes| planes[3].at(x, y));
                let missing = (ENOUGH - weight).clamp(0.0, (more - weight).max(0.0));
                let part = if missing > 0.0 { missing / (more - weight) * more } else { 0.0 };
                let (value, fill) = (own[channel].at(x, y), other[channel].at(x, y));
                (weight * value + part * fill) / (weight + part)
            })
        })
    };
    candidates
        .iter()
        .map(|own| [0, 1].map(|half: usize| completed(&own[half], &candidates[wide][half])))
        .collect()
}

/// Selects, for each pixel, the candidate `[half][channel]` that differs least from the half that it was not made of.
pub fn best(color: &[[ImagePlane; 3]; 2], candidates: Vec<[[ImagePlane; 3]; 2]>) -> [[ImagePlane; 3]; 2] {
    let size = color[0][0].size;
    let noise = [0, 1, 2].map(|c| variance(&color[0][c], &color[1][c], 1));
    let errors: Vec<ImagePlane> = candidates.iter().map(|filtered| error(color, filtered, &noise)).collect();
    let width = size[0].max(1);
    let chosen: Vec<usize> = (0..size[0] * size[1])
        .map(|at| {
            let of = |candidate: usize| errors[candidate].at(at % width, at / width);
            (1..errors.len()).fold(0, |best, other| if of(other) < of(best) { other } else { best })
        })
        .collect();
    let shares: Vec<ImagePlane> = (0..candidates.len())
        .map(|candidate| {
            ImagePlane::new(size, |at| f32::from(u8::from(chosen[at] == candidate))).smoothed(FADE_RADIUS)
        })
        .collect();
    [0, 1].map(|half: usize| {
        [0, 1, 2].map(|channel: usize| {
            ImagePlane::new(size, |at| {
                let (x, y) = (at % width, at / width);
                let parts = candidates.iter().zip(&shares);
                parts.map(|(filtered, share)| filtered[half][channel].at(x, y) * share.at(x, y)).sum()
            })
        })
    })
}

/// Estimates the relative squared error of a candidate: its squared difference from the other half, less that half's
/// own noise.
fn error(
    color: &[[ImagePlane; 3]; 2],
    filtered: &[[ImagePlane; 3]; 2],
    noise: &[ImagePlane; 3],
) -> ImagePlane {
    let size = color[0][0].size;
    let width = size[0].max(1);
    let relative = |at: usize| {
        let (x, y) = (at % width, at / width);
        let mut sum = 0.0;
        for channel in 0..3 {
            let [even, odd] = [0, 1].map(|half: usize| color[half][channel].at(x, y));
            let differs = [filtered[0][channel].at(x, y) - odd, filtered[1][channel].at(x, y) - even];
            let mean = 0.5 * (even + odd);
            let square = 0.5 * (differs[0] * differs[0] + differs[1] * differs[1]) - noise[channel].at(x, y);
            sum += square / (0.01 + mean * mean);
        }
        sum / 3.0
    };
    ImagePlane::new(size, relative).smoothed(ERROR_RADIUS)
}
