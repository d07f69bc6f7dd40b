//! Metrics of the difference between an image and a reference, and a map of the error.
//!
//! The squared errors are measured on linear light as it is; PSNR, SSIM and FLIP on light that is clamped to [0, 1], as
//! a screen shows it.

pub mod colormap;
mod flip;
mod raster;
mod ssim;

use super::tonemap::srgb_encode;
use crate::math::Rgb;
use crate::memory::{self, Reservation, Shortage};
use raster::Raster;

/// The upper limit of light in the relative error, so that a few very bright pixels do not outweigh all others.
pub const RELATIVE_LIMIT: f64 = 20.0;

/// The sides of blocks in pixels.
pub const BLOCKS: [usize; 3] = [2, 4, 8];

/// The bytes that [`compare`] takes for each pixel, besides the two images.
const BYTES: u64 = 150;

/// Reserves the memory that [`compare`] takes for images of a size.
pub fn claim([width, height]: [u32; 2]) -> Result<Reservation<'static>, Shortage> {
    let what = format_args!("comparing images of {width}x{height}");
    memory::reserve(what, u64::from(width) * u64::from(height) * BYTES)
}

/// The difference between an image and a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// The mean of (a − b)² over all components.
    pub mse: f64,
    /// The square root of `mse`.
    pub rmse: f64,
    /// The mean of (a − b)² / (b² + 0.01), with both clamped to [`RELATIVE_LIMIT`].
    pub relative_mse: f64,
    /// The relative MSE of the means of blocks of [`BLOCKS`] pixels to a side: the error that remains when the image is
    /// seen from afar or scaled down. Errors that neighbours have in common remain.
    pub relative_mse_of_blocks: [f64; BLOCKS.len()],
    /// The peak signal-to-noise ratio in dB, peak 1, of light clamped to [0, 1]; infinite for equal images.
    pub psnr_db: f64,
    /// The structural similarity of sRGB luma: 1 for equal images.
    pub ssim: f64,
    /// The mean of FLIP's error: 0 for equal images, at most 1.
    pub flip: f64,
    /// The mean of the image divided by that of the reference: red, green, blue. 1 if both are black.
    pub mean_ratio: [f64; 3],
    /// True if all components are equal.
    pub identical: bool,
}

/// [`Metrics`] and the map of FLIP's error.
pub struct ImageComparison {
    /// The metrics of the whole image.
    pub metrics: Metrics,
    /// FLIP's error of each pixel, 0 to 1, row by row.
    pub flip: Vec<f64>,
}

/// Compares an image with a reference of the same size, at least one pixel. Before PSNR, SSIM and FLIP both are
/// multiplied by `exposure`. All components have to be finite.
pub fn compare(width: usize, image: &[Rgb], reference: &[Rgb], exposure: f32) -> ImageComparison {
    assert!(image.len() == reference.len() && !image.is_empty(), "two images of one size");
    let shown = |pixels: &[Rgb]| -> Vec<Rgb> {
        pixels.iter().map(|pixel| pixel.map(|c| (c * exposure).clamp(0.0, 1.0))).collect()
    };
    let (screen, screen_reference) = (shown(image), shown(reference));
    let flip = flip::map(width, &screen_reference, &screen);
    let mse = mean_square(image, reference, |a, b| (a - b) * (a - b));
    let relative_mse = mean_square(image, reference, relative_square);
    let of_blocks = |side| {
        mean_square(&block_means(width, image, side), &block_means(width, reference, side), relative_square)
    };
    let shown_mse = mean_square(&screen, &screen_reference, |a, b| (a - b) * (a - b));
    let metrics = Metrics {
        mse,
        rmse: mse.sqrt(),
        relative_mse,
        relative_mse_of_blocks: BLOCKS.map(of_blocks),
        psnr_db: -10.0 * libm::log10(shown_mse),
        ssim: ssim::mean(&luma(width, &screen_reference), &luma(width, &screen)),
        flip: flip.iter().sum::<f64>() / flip.len() as f64,
        mean_ratio: ratios(image, reference),
        identical: image == reference,
    };
    ImageComparison { metrics, flip }
}

fn relative_square(a: f64, b: f64) -> f64 {
    let (a, b) = (a.min(RELATIVE_LIMIT), b.min(RELATIVE_LIMIT));
    (a - b) * (a - b) / (b * b + 0.01)
}

/// Returns the means of blocks of pixels, with each component clamped to [`RELATIVE_LIMIT`]; blocks at the right and
/// lower edges may be smaller.
fn block_means(width: usize, pixels: &[Rgb], side: usize) -> Vec<Rgb> {
    let rows: Vec<&[Rgb]> = pixels.chunks(width).collect();
    let mean = |rows: &[&[Rgb]], x: usize| {
        let (mut sum, mut count) = ([0.0f64; 3], 0.0);
        for pixel in rows.iter().flat_map(|row| &row[x..width.min(x + side)]) {
            let components = pixel.to_array().map(|c| f64::from(c).min(RELATIVE_LIMIT));
            sum.iter_mut().zip(components).for_each(|(sum, c)| *sum += c);
            count += 1.0;
        }
        let [r, g, b] = sum.map(|sum| (sum / count) as f32);
        Rgb::new(r, g, b)
    };
    let row = |rows: &[&[Rgb]]| (0..width).step_by(side).map(|x| mean(rows, x)).collect::<Vec<_>>();
    rows.chunks(side).flat_map(row).collect()
}

/// The mean over all components of all pixels.
fn mean_square(a: &[Rgb], b: &[Rgb], error: impl Fn(f64, f64) -> f64) -> f64 {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.to_array().into_iter().zip(b.to_array()));
    let sum: f64 = pairs.map(|(a, b)| error(f64::from(a), f64::from(b))).sum();
    sum / (3 * a.len()) as f64
}

/// Returns the luma of sRGB-encoded pixels.
fn luma(width: usize, shown: &[Rgb]) -> Raster {
    Raster::new(width, shown, |pixel| f64::from(pixel.map(srgb_encode).luminance()))
}

fn ratios(image: &[Rgb], reference: &[Rgb]) -> [f64; 3] {
    let sum = |pixels: &[Rgb], c: usize| pixels.iter().map(|p| f64::from(p.to_array()[c])).sum::<f64>();
    [0, 1, 2].map(|channel| {
        let (a, b) = (sum(image, channel), sum(reference, channel));
        if a == b { 1.0 } else { a / b }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(value: impl Fn(usize) -> f32) -> Vec<Rgb> {
        (0..16 * 16).map(|i| Rgb::new(value(i), 0.5 * value(i), 0.25)).collect()
    }

    #[test]
    fn metrics_of_equal_images_are_zero() {
        let a = picture(|i| (i % 7) as f32);
        let ImageComparison { metrics, flip } = compare(16, &a, &a, 1.0);
        assert_eq!((metrics.mse, metrics.rmse, metrics.relative_mse, metrics.flip), (0.0, 0.0, 0.0, 0.0));
        assert_eq!((metrics.psnr_db, metrics.mean_ratio), (f64::INFINITY, [1.0; 3]));
        assert!(metrics.identical && (metrics.ssim - 1.0).abs() < 1e-12);
        assert!(flip.iter().all(|error| *error == 0.0));
    }

    #[test]
    fn metrics_match_hand_computation() {
        let (a, b) = (vec![Rgb::splat(0.5); 144], vec![Rgb::splat(0.4); 144]);
        let m = compare(12, &a, &b, 1.0).metrics;
        assert!((m.mse - 0.01).abs() < 1e-8 && (m.rmse - 0.1).abs() < 1e-7);
        assert!((m.relative_mse - 0.01 / 0.17).abs() < 1e-7);
        assert!((m.psnr_db - 20.0).abs() < 1e-5);
        assert!(m.mean_ratio.iter().all(|r| (r - 1.25).abs() < 1e-6));
        assert!(!m.identical && m.flip > 0.01 && m.ssim < 1.0);
    }

    /// Alternating errors vanish in the mean of a block; constant ones remain.
    #[test]
    fn block_error_ignores_alternating_errors() {
        let b = vec![Rgb::splat(0.5); 20 * 20];
        let chequered = |i: usize| if (i % 20 + i / 20).is_multiple_of(2) { 0.6 } else { 0.4 };
        let a: Vec<Rgb> = (0..20 * 20).map(|i| Rgb::splat(chequered(i))).collect();
        let m = compare(20, &a, &b, 1.0).metrics;
        assert!((m.relative_mse - 0.01 / 0.26).abs() < 1e-6, "{}", m.relative_mse);
        assert!(m.relative_mse_of_blocks.iter().all(|error| *error < 1e-12));
        let even = vec![Rgb::splat(0.6); 20 * 20];
        let m = compare(20, &even, &b, 1.0).metrics;
        assert!(m.relative_mse_of_blocks.iter().all(|error| (error - 0.01 / 0.26).abs() < 1e-6));
    }

    #[test]
    fn display_metrics_ignore_differences_above_one() {
        let (a, b) = (vec![Rgb::splat(100.0); 4], vec![Rgb::splat(25.0); 4]);
        let m = compare(2, &a, &b, 1.0).metrics;
        assert_eq!((m.relative_mse, m.flip, m.psnr_db), (0.0, 0.0, f64::INFINITY));
        assert!(m.mse > 5000.0 && !m.identical);
        assert!(compare(2, &a, &b, 0.02).metrics.flip > 0.1);
    }
}
