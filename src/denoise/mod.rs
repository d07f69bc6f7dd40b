//! From a noisy image to one without noise: every pixel becomes a mean of those around it that look alike, as the
//! other half of the samples sees them.
//!
//! Even and odd samples are two images of the same thing, each with its own noise. Which pixels of one are averaged
//! is decided by the other one (so that no noise chooses itself) and by what the samples hit first: by non-local
//! means over patches (Buades and others 2005; Rousselle, Knaus and Zwicker 2012) and by features that were filtered
//! in the same way (Rousselle, Manzi and Zwicker, "Robust denoising using feature and color information", 2013).
//! There are four such means for each pixel, which differ in how much colours and features count. Each is compared with
//! the other half, and in every place the one with the smallest error is taken. What then differs between the two halves
//! is filtered once more.
//!
//! Before that, the texture of surfaces is divided out (`texture`), and the light of single samples far above all
//! around them is taken out (`outliers`): it comes back only as far as both halves agree on it.
//!
//! Paths that neighbours share have errors in common, which averaging neighbours does not remove. They are found as
//! what differs between the two halves over whole groups, and averaged over what lies beside them.
//!
//! Every sum goes in one order, whatever the lanes and threads: the same film, the same bits.

mod filter;
mod guides;
mod outliers;
mod plane;
mod select;
mod texture;

use crate::film::{Features, Film};
use crate::math::{Rgb, elementary};
use crate::simd::Isa;
use filter::{FilterPass, FilteredImage};
use outliers::Split;
use plane::ImagePlane;

/// Pixels to each side that are averaged first. Measured on three scenes at 4 and 32 samples: 10 is up to 1.2 times
/// worse and up to 1.1 times better.
const RADIUS: usize = 8;
/// Pixels to each side of which patches are compared.
const PATCH: usize = 2;
/// Differences in colour count little, much (as with k = 0.25), not at all, or much where features count little.
const CANDIDATES: [FilteredImage; 4] = [
    FilteredImage::Colors(0),
    FilteredImage::Colors(3),
    FilteredImage::FeaturesAlone,
    FilteredImage::Wide(3),
];
/// The number of the last one.
const WIDE: usize = CANDIDATES.len() - 1;
/// How the first filter works, and the last one when little noise is left.
const FIRST: FilterSize = FilterSize { radius: RADIUS, patch: PATCH, sharpness: 2.0 };
/// See [`FIRST`].
const LAST: FilterSize = FilterSize { radius: 3, patch: 1, sharpness: 4.0 };
/// Variances are means over this many pixels to each side.
const VARIANCE_RADIUS: usize = 1;
/// No variance is below this part of the mean over more pixels: the halves of a few may be alike by chance.
const FAR_PART: f32 = 0.25;
/// Pixels to each side of that mean.
const FAR_RADIUS: usize = 3;
/// Brightness, relative to the image's mean, below which what is compared is in proportion to it, and above which to its
/// logarithm: noise grows with brightness, and one bright pixel must not outweigh a patch.
const KNEE: f32 = 0.1;
/// Below any difference in what is compared that matters, squared.
const LEAST: f32 = 2e-4;

/// About how many bytes it takes for each pixel: planes of halves, of what is compared, of texture and of outliers,
/// variances, features and candidates, and their sums.
pub const BYTES: usize = 4 * (6 + 6 + 6 + 6 + 3 + 9 + 32 + 32);

/// See [`FilterPass`].
struct FilterSize {
    radius: usize,
    patch: usize,
    sharpness: f32,
}

/// A film and what its samples hit first.
#[derive(Clone, Copy)]
pub struct Noisy<'a> {
    /// Of whole pixels with even and odd samples.
    pub film: &'a Film,
    /// Of even and of odd samples, pixel by pixel, row by row.
    pub features: [&'a [Features]; 2],
}

/// A film without its noise, or nearly so: means of pixels that look alike, by their colours and by what their
/// samples hit first (Rousselle, Manzi and Zwicker 2013).
#[derive(Clone, Debug)]
pub struct Denoised {
    /// Of each pixel, in W m⁻² sr⁻¹, row by row from the top of the film's region.
    pub radiance: Vec<Rgb>,
    /// Root mean square of the noise that is left in a component, in W m⁻² sr⁻¹, estimated from the difference of
    /// both halves. Detail that was smoothed away does not count.
    pub noise: f64,
}

impl Denoised {
    /// A 128-bit hash (XXH3) of all bits.
    pub fn hash(&self) -> u128 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        for component in self.radiance.iter().flat_map(|rgb| rgb.to_array()) {
            hasher.update(&component.to_le_bytes());
        }
        hasher.digest128()
    }
}

/// Takes the noise out; `None` if a pixel lacks even or odd samples.
pub fn denoise(isa: Isa, noisy: &Noisy) -> Option<Denoised> {
    let region = noisy.film.region();
    let size = [region.width() as usize, region.height() as usize];
    let (even, odd): (Vec<Rgb>, Vec<Rgb>) = noisy.film.halves()?.map(|[even, odd]| (even, odd)).unzip();
    let halves = [even, odd];
    let scale = brightness(&halves);
    let texture = texture::factors(size, noisy.features);
    let width = size[0];
    let color = [0, 1].map(|half: usize| {
        [0, 1, 2].map(|c: usize| {
            let light = |x: usize, y: usize| halves[half][y * width + x].to_array()[c] / scale;
            ImagePlane::of(size, |x, y| light(x, y) / texture[half][c].at(x, y))
        })
    });
    let features = guides::features(isa, size, noisy.features);
    let Split { base, spread } = outliers::split(isa, &color, &features);
    let first = select::complete(&filtered(isa, &base, &features, &CANDIDATES, &FIRST), WIDE);
    let chosen = select::best(&base, first);
    let last = filtered(isa, &chosen, &features, &CANDIDATES[..1], &LAST).into_iter().next()?;

    let mut radiance = Vec::with_capacity(size[0] * size[1]);
    let mut squares = 0.0f64;
    for y in 0..size[1] {
        for x in 0..size[0] {
            let mean = [0, 1, 2].map(|c: usize| {
                let factor = 0.5 * (texture[0][c].at(x, y) + texture[1][c].at(x, y));
                let of = |half: usize| (last[half][c].at(x, y) + spread[half][c].at(x, y)) * factor;
                let (a, b) = (of(0), of(1));
                squares += f64::from((a - b) * scale).powi(2) / 4.0;
                (a + b) * 0.5 * scale
            });
            radiance.push(mean.into());
        }
    }
    let noise = (squares / (3 * radiance.len()).max(1) as f64).sqrt();
    Some(Denoised { radiance, noise })
}

/// The mean luminance of an image, by which everything is divided, so that what is small is small in relation to it.
fn brightness(halves: &[Vec<Rgb>; 2]) -> f32 {
    let sum: f64 = halves.iter().flatten().map(|rgb| f64::from(rgb.luminance())).sum();
    let mean = (sum / (2 * halves[0].len()).max(1) as f64) as f32;
    if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
}

/// Both halves of each candidate: `[candidate][half][channel]`, and the sums of weights.
fn filtered(
    isa: Isa,
    color: &[[ImagePlane; 3]; 2],
    features: &[ImagePlane],
    candidates: &[FilteredImage],
    &FilterSize { radius, patch, sharpness }: &FilterSize,
) -> Vec<[[ImagePlane; 4]; 2]> {
    let looks = [0, 1].map(|half: usize| {
        [0, 1, 2].map(|c: usize| {
            ImagePlane::of(color[half][c].size, |x, y| {
                elementary::log2(1.0 + color[half][c].at(x, y).max(0.0) / KNEE)
            })
        })
    });
    let variance = [0, 1, 2].map(|c| {
        let [near, far] =
            [VARIANCE_RADIUS, FAR_RADIUS].map(|radius| plane::variance(&looks[0][c], &looks[1][c], radius));
        ImagePlane::of(near.size, |x, y| near.at(x, y).max(FAR_PART * far.at(x, y)))
    });
    let [even, odd] = color.each_ref().map(|half| half.each_ref());
    let [even_looks, odd_looks] = looks.each_ref().map(|half| half.each_ref());
    let pass = FilterPass {
        halves: [&even, &odd],
        compared: [&even_looks, &odd_looks],
        variance: &variance.each_ref(),
        features,
        sharpness,
        candidates,
        radius,
        stride: None,
        patch,
        least: LEAST,
    };
    let array = |planes: Vec<ImagePlane>| -> [ImagePlane; 4] {
        let mut planes = planes.into_iter();
        std::array::from_fn(|_| planes.next().unwrap_or_default())
    };
    pass.run(isa).into_iter().map(|halves| halves.map(array)).collect()
}

#[cfg(test)]
mod tests;
