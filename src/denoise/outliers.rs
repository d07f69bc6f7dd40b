//! Outliers, single samples far brighter than their surroundings: their light is removed before filtering, and restored
//! as far as both halves of the samples agree on it.
//!
//! A sample that reaches a small bright thing by a rare path makes its pixel far brighter in one half than in the
//! other. Light that is in both halves is kept: small lights, highlights, bright edges. The part of an outlier that the
//! other half's surroundings confirm is kept, too; the rest is excess. Dense excess, as within a caustic, is noise like
//! any other and is filtered with the image. Sparse excess is spread over surfaces, at larger and larger scales, and
//! restored at the first scale at which both halves have enough of it. Excess that is too rare even for the largest
//! scale is dropped: nothing is known of its place.

use super::filter::{FilterPass, FilteredImage};
use super::plane::ImagePlane;
use crate::simd::Isa;

/// Pixels are outliers if they are brighter than usual by more than this factor.
const FACTOR: f32 = 3.0;
/// The least brightness of an outlier, relative to the image's mean.
const FLOOR: f32 = 0.01;
/// The radius in pixels of the window that gives the usual brightness.
const WINDOW: usize = 3;
/// The quantile of brightness in the window that counts as usual, so that edges and dense noise do.
const QUANTILE: f32 = 0.85;
/// The number of similar pixels in the window that is enough to ignore dissimilar ones.
const ENOUGH: usize = 8;
/// The squared difference of features, in units of their width, from which pixels are dissimilar.
const UNLIKE: f32 = 1.0;
/// The radius in pixels within which other outliers make it probable that two of them coincide in one pixel.
const MEETING: usize = 7;
/// The numbers of outliers in a half between which the reliability of their mean rises from 0 to 1.
const RELIABLE: [f32; 2] = [2.5, 6.0];
/// The radius in pixels within which dense excess is counted.
const DENSE_RADIUS: usize = 2;
/// The radius of each scale, in units of its stride.
const RADIUS: usize = 3;
/// The distance in pixels between the pixels that are averaged at each scale.
const STRIDES: [usize; 4] = [1, 2, 4, 8];
/// The reach of the largest scale in pixels.
pub const REACH: usize = RADIUS * STRIDES[STRIDES.len() - 1];

/// Both halves of an image without its outliers, and the light of these.
pub struct Split {
    /// The image without its excess, `[half][channel]`.
    pub base: [[ImagePlane; 3]; 2],
    /// The light to add after filtering, `[half][channel]`.
    pub spread: [[ImagePlane; 3]; 2],
}

/// The excess of a half: three channels, and the square of their mean.
type Excess = [ImagePlane; 4];

/// Separates the outliers from an image.
pub fn split(isa: Isa, color: &[[ImagePlane; 3]; 2], features: &[ImagePlane]) -> Split {
    let size = color[0][0].size;
    let shares = shares(color, features);
    let mut excess: [Excess; 2] = [0, 1].map(|half: usize| {
        let channel = |c: usize| ImagePlane::of(size, |x, y| color[half][c].at(x, y) * shares[half].at(x, y));
        let [r, g, b] = [0, 1, 2].map(channel);
        let square = ImagePlane::of(size, |x, y| {
            let mean = (r.at(x, y) + g.at(x, y) + b.at(x, y)) / 3.0;
            mean * mean
        });
        [r, g, b, square]
    });
    let dense = accepted(&smoothed(isa, &excess, features, [DENSE_RADIUS, 1]), 1.0);
    excess.iter_mut().flatten().for_each(|plane| *plane = without(plane, &dense));
    let base = [0, 1].map(|half: usize| {
        [0, 1, 2]
            .map(|c: usize| ImagePlane::of(size, |x, y| color[half][c].at(x, y) - excess[half][c].at(x, y)))
    });

    let mut spread = [0, 1].map(|_| [0, 1, 2].map(|_| ImagePlane::new(size, |_| 0.0)));
    for stride in STRIDES {
        let means = smoothed(isa, &excess, features, [RADIUS, stride]);
        // An outlier that has been averaged over the previous scales covers this many pixels of this one.
        let accepted = accepted(&means, (stride * stride) as f32);
        for (half, means) in means.iter().enumerate() {
            for (plane, mean) in spread[half].iter_mut().zip(means) {
                *plane = ImagePlane::of(size, |x, y| plane.at(x, y) + mean.at(x, y) * accepted.at(x, y));
            }
            for (plane, mean) in excess[half].iter_mut().zip(means) {
                *plane = without(mean, &accepted);
            }
        }
    }
    Split { base, spread }
}

fn without(plane: &ImagePlane, share: &ImagePlane) -> ImagePlane {
    ImagePlane::of(plane.size, |x, y| plane.at(x, y) * (1.0 - share.at(x, y)))
}

/// Returns the fraction of each pixel's light that is excess, in each half.
fn shares(color: &[[ImagePlane; 3]; 2], features: &[ImagePlane]) -> [ImagePlane; 2] {
    let size = color[0][0].size;
    let bright = color
        .each_ref()
        .map(|[r, g, b]| ImagePlane::of(size, |x, y| (r.at(x, y) + g.at(x, y) + b.at(x, y)) / 3.0));
    let share = |half: usize, x: usize, y: usize, trusted: bool| {
        let own = bright[half].at(x, y);
        let limit = limit(own, &bright[1 - half], features, [x, y], trusted);
        if own <= limit {
            return 0.0;
        }
        // Two outliers that coincide would agree on whatever is left of both.
        let rest = if trusted { limit } else { limit / FACTOR };
        1.0 - rest / own
    };
    let first = [0, 1].map(|half: usize| ImagePlane::of(size, |x, y| share(half, x, y, true)));
    // Where a half has outliers, some of them coincide with one of the other half.
    let near = first.each_ref().map(|share| {
        ImagePlane::of(size, |x, y| f32::from(u8::from(share.at(x, y) > 0.0))).smoothed(MEETING)
    });
    [0, 1].map(|half: usize| {
        ImagePlane::of(size, |x, y| match first[half].at(x, y) {
            0.0 if near[1 - half].at(x, y) > 0.0 => share(half, x, y, false),
            share => share,
        })
    })
}

/// Returns the brightness above which a pixel of one half is an outlier, judged by the other half. If the same pixel of
/// the other half is not trusted, two of its neighbours must confirm it. The result is `own` or more if the pixel is no
/// outlier.
fn limit(own: f32, other: &ImagePlane, features: &[ImagePlane], [x, y]: [usize; 2], trusted: bool) -> f32 {
    let [mut largest, mut second] = [0.0f32; 2];
    for (u, v) in (0..9).filter(|number| *number != 4).map(|number| (x + number % 3, y + number / 3)) {
        let value = other.around(1, u, v);
        second = second.max(largest.min(value));
        largest = largest.max(value);
    }
    let same = other.at(x, y);
    let confirmed = if trusted { same } else { second };
    if own <= FACTOR * confirmed + FLOOR {
        return own;
    }
    let unlike = |dx: usize, dy: usize| {
        let differ = |feature: &ImagePlane| feature.around(WINDOW, x + dx, y + dy) - feature.at(x, y);
        features.iter().any(|feature| differ(feature) * differ(feature) >= UNLIKE)
    };
    let (mut like, mut all, mut edge) = (Vec::new(), Vec::new(), false);
    for (dx, dy) in (0..=2 * WINDOW).flat_map(|dy| (0..=2 * WINDOW).map(move |dx| (dx, dy))) {
        let value = other.around(WINDOW, x + dx, y + dy);
        all.push(value);
        if !unlike(dx, dy) {
            like.push(value);
        } else if dx.abs_diff(WINDOW) <= 1 && dy.abs_diff(WINDOW) <= 1 {
            edge = true;
        }
    }
    let values = if like.len() >= ENOUGH { &mut like } else { &mut all };
    let place = ((values.len() - 1) as f32 * QUANTILE) as usize;
    let mut usual = confirmed.max(*values.select_nth_unstable_by(place, f32::total_cmp).1);
    if edge {
        // The fraction of a pixel on either side of an edge is noisy, too.
        usual = usual.max(same).max(largest);
    }
    FACTOR * usual + FLOOR
}

/// Averages excess over pixels with similar features; the last plane holds the sums of weights.
fn smoothed(
    isa: Isa,
    excess: &[Excess; 2],
    features: &[ImagePlane],
    [radius, stride]: [usize; 2],
) -> [Vec<ImagePlane>; 2] {
    let [even, odd] = excess.each_ref().map(Excess::each_ref);
    let pass = FilterPass {
        halves: [&even, &odd],
        compared: [&[], &[]],
        variance: &[],
        features,
        sharpness: 1.0,
        candidates: &[FilteredImage::FeaturesAlone],
        radius,
        stride: Some(stride),
        patch: 0,
        least: 0.0,
    };
    pass.run(isa).pop().unwrap_or_default()
}

/// Returns the fraction of the mean excess on which both halves agree: each has enough outliers, and their means are
/// similar.
fn accepted(means: &[Vec<ImagePlane>; 2], area: f32) -> ImagePlane {
    let [few, many] = RELIABLE;
    ImagePlane::of(means[0][0].size, |x, y| {
        let [(a, m), (b, n)] = means.each_ref().map(|planes| {
            let at = |number: usize| planes[number].at(x, y);
            let mean = (at(0) + at(1) + at(2)) / 3.0;
            // The number of outliers of one brightness that would have that mean and that mean of squares.
            let count = if at(3) > 0.0 { at(4) * area * mean * mean / at(3) } else { 0.0 };
            (mean, count)
        });
        let reliable = ((m.min(n) - few) / (many - few)).clamp(0.0, 1.0);
        if reliable > 0.0 { reliable * a.min(b) / a.max(b) } else { 0.0 }
    })
}
