//! A denoiser for films: every pixel becomes a mean of the pixels around it that look alike, as judged by the other
//! half of the samples.
//!
//! Even and odd samples are two images of the same scene with independent noise. The weights for one half come from the
//! other half (so that no noise selects itself) and from features, the first hits of samples: by non-local means over
//! patches (Buades and others 2005; Rousselle, Knaus and Zwicker 2012) and by features that were filtered in the same
//! way (Rousselle, Manzi and Zwicker, "Robust denoising using feature and color information", 2013). There are four
//! such means for each pixel, the candidates, which differ in how much colours and features count. Each is compared
//! with the other half, and every pixel takes the one with the smallest error. The noise that then remains is filtered
//! once more.
//!
//! Before that, the texture of surfaces is divided out (`texture`), and the light of outliers, single samples far
//! brighter than their surroundings, is removed (`outliers`): it is restored only as far as both halves agree on it.
//!
//! Path reuse correlates the errors of neighbours, which averaging over neighbours does not remove.
//!
//! Every sum has a fixed order, independent of lanes and threads: the same film gives the same bits.

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

/// The radius of the first filter in pixels. Measured on three scenes at 4 and 32 samples: 10 is up to 1.2 times worse
/// and up to 1.1 times better.
const RADIUS: usize = 8;
/// The radius of patches in pixels.
const PATCH: usize = 2;
/// The candidates: differences in colour count little, much (as with k = 0.25), not at all, or much while features
/// count little.
const CANDIDATES: [FilteredImage; 4] = [
    FilteredImage::Colors(0),
    FilteredImage::Colors(3),
    FilteredImage::FeaturesAlone,
    FilteredImage::Wide(3),
];
/// The index of the last candidate.
const WIDE: usize = CANDIDATES.len() - 1;
/// The size of the first filter.
const FIRST: FilterSize = FilterSize { radius: RADIUS, patch: PATCH, sharpness: 2.0 };
/// The size of the last filter, when little noise is left.
const LAST: FilterSize = FilterSize { radius: 3, patch: 1, sharpness: 4.0 };
/// Variances are averaged over this many pixels to each side.
const VARIANCE_RADIUS: usize = 1;
/// The lower limit of a variance, as a fraction of the mean over more pixels: the halves of a few pixels may agree by
/// chance.
const FAR_PART: f32 = 0.25;
/// The radius of that mean in pixels.
const FAR_RADIUS: usize = 3;
/// The brightness, relative to the image's mean, below which compared values are linear and above which they are
/// logarithmic: noise grows with brightness, and one bright pixel must not outweigh a patch.
const KNEE: f32 = 0.1;
/// Added to variances: below the square of any difference of compared values that matters.
const LEAST: f32 = 2e-4;

/// The approximate number of bytes for each pixel: planes of halves, compared values, texture and outliers, variances,
/// features and candidates, and their sums.
pub const BYTES: usize = 4 * (6 + 6 + 6 + 6 + 3 + 9 + 32 + 32);

/// The size of a filter; see [`FilterPass`].
struct FilterSize {
    radius: usize,
    patch: usize,
    sharpness: f32,
}

/// A film and the first hits of its samples.
#[derive(Clone, Copy)]
pub struct Noisy<'a> {
    /// The film; every pixel needs even and odd samples.
    pub film: &'a Film,
    /// The features of even and of odd samples, pixel by pixel, row by row.
    pub features: [&'a [Features]; 2],
}

/// A denoised film: means of pixels that look alike, by their colours and by the first hits of their samples
/// (Rousselle, Manzi and Zwicker 2013).
#[derive(Clone, Debug)]
pub struct Denoised {
    /// The radiance of each pixel, in W m⁻² sr⁻¹, row by row from the top of the film's region.
    pub radiance: Vec<Rgb>,
    /// The part of what is behind the scene that each pixel shows, of each colour, in films that count opacity, if shadow
    /// catchers, blended surfaces or blurred edges make it as noisy as light. Otherwise that of the film has no noise worth
    /// removing.
    pub let_through: Option<Vec<Rgb>>,
    /// The part that each pixel would show without shadows on catchers, if there are such and blended surfaces make it as
    /// noisy as light.
    pub without_shadows: Option<Vec<Rgb>>,
    /// The root mean square of the remaining noise in a component, in W m⁻² sr⁻¹, estimated from the difference of both
    /// halves. Detail that was smoothed away does not count.
    pub noise: f64,
}

impl Denoised {
    /// A 128-bit hash (XXH3) of all bits.
    pub fn hash(&self) -> u128 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        let colors = [&self.let_through, &self.without_shadows].into_iter().flatten().flatten();
        let colors = self.radiance.iter().chain(colors);
        for component in colors.flat_map(|rgb| rgb.to_array()) {
            hasher.update(&component.to_le_bytes());
        }
        hasher.digest128()
    }
}

/// Denoises a film; `None` if a pixel lacks even or odd samples.
pub fn denoise(isa: Isa, noisy: &Noisy) -> Option<Denoised> {
    let region = noisy.film.region();
    let size = [region.width() as usize, region.height() as usize];
    let features = guides::features(isa, size, noisy.features);
    let halves = apart(noisy.film.halves()?);
    let texture = texture::factors(size, noisy.features);
    let (radiance, noise) = cleaned(isa, size, &halves, Some(&texture), &features)?;
    let part = |halves: [Vec<Rgb>; 2]| Some(cleaned(isa, size, &halves, None, &features)?.0);
    let let_through = noisy.film.halves_let_through().and_then(|halves| part(apart(halves)));
    let without_shadows = noisy.film.halves_without_shadows().and_then(|halves| part(apart(halves)));
    Some(Denoised { radiance, let_through, without_shadows, noise })
}

/// The even and the odd halves of pixels.
fn apart(halves: impl Iterator<Item = [Rgb; 2]>) -> [Vec<Rgb>; 2] {
    let (even, odd) = halves.map(|[even, odd]| (even, odd)).unzip();
    [even, odd]
}

/// Two halves of an image of a size without their noise, and the root mean square of what remains. Texture that is
/// given is divided out before.
fn cleaned(
    isa: Isa,
    size: [usize; 2],
    halves: &[Vec<Rgb>; 2],
    texture: Option<&[[ImagePlane; 3]; 2]>,
    features: &[ImagePlane],
) -> Option<(Vec<Rgb>, f64)> {
    let factor = |half: usize, c: usize, x, y| texture.map_or(1.0, |texture| texture[half][c].at(x, y));
    let scale = brightness(halves);
    let width = size[0];
    let color = [0, 1].map(|half: usize| {
        [0, 1, 2].map(|c: usize| {
            let light = |x: usize, y: usize| halves[half][y * width + x].to_array()[c] / scale;
            ImagePlane::of(size, |x, y| light(x, y) / factor(half, c, x, y))
        })
    });
    let Split { base, spread } = outliers::split(isa, &color, features);
    let first = select::complete(&filtered(isa, &base, features, &CANDIDATES, &FIRST), WIDE);
    let chosen = select::best(&base, first);
    let last = filtered(isa, &chosen, features, &CANDIDATES[..1], &LAST).into_iter().next()?;

    let mut radiance = Vec::with_capacity(size[0] * size[1]);
    let mut squares = 0.0f64;
    for y in 0..size[1] {
        for x in 0..size[0] {
            let mean = [0, 1, 2].map(|c: usize| {
                let factor = 0.5 * (factor(0, c, x, y) + factor(1, c, x, y));
                let of = |half: usize| (last[half][c].at(x, y) + spread[half][c].at(x, y)) * factor;
                let (a, b) = (of(0), of(1));
                squares += f64::from((a - b) * scale).powi(2) / 4.0;
                (a + b) * 0.5 * scale
            });
            radiance.push(mean.into());
        }
    }
    let noise = (squares / (3 * radiance.len()).max(1) as f64).sqrt();
    Some((radiance, noise))
}

/// The mean luminance of an image, by which everything is divided, so that thresholds are relative to it.
fn brightness(halves: &[Vec<Rgb>; 2]) -> f32 {
    let sum: f64 = halves.iter().flatten().map(|rgb| f64::from(rgb.luminance())).sum();
    let mean = (sum / (2 * halves[0].len()).max(1) as f64) as f32;
    if mean > 0.0 && mean.is_finite() { mean } else { 1.0 }
}

/// Filters both halves for each candidate: returns `[candidate][half][channel]`, where the last channel holds the sums
/// of weights.
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
