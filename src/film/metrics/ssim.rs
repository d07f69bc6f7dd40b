//! Structural similarity: Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From
//! Error Visibility to Structural Similarity" (2004).
//!
//! Existing crates work on 8 bits in blocks of 8 × 8 pixels, not with the paper's window.

use super::raster::{Raster, gaussian, normalised};

/// The paper's window.
const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
/// The paper's (K L)² with the range L = 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Returns the mean over all windows that lie within the image (over all pixels if none does): 1 for equal images, less
/// for others. Values are sRGB-encoded, 0 to 1.
pub(super) fn mean(a: &Raster, b: &Raster) -> f64 {
    let window = normalised(&gaussian(SIGMA, RADIUS));
    let blurred = |plane: &Raster| plane.filtered(&window, &window);
    let (mean_a, mean_b) = (blurred(a), blurred(b));
    let (aa, bb, ab) = (
        blurred(&a.zip(a, |x, y| x * y)),
        blurred(&b.zip(b, |x, y| x * y)),
        blurred(&a.zip(b, |x, y| x * y)),
    );
    let similarity = |i: usize| {
        let (ma, mb) = (mean_a.values[i], mean_b.values[i]);
        let (va, vb, cov) = (aa.values[i] - ma * ma, bb.values[i] - mb * mb, ab.values[i] - ma * mb);
        (2.0 * ma * mb + C1) * (2.0 * cov + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2))
    };
    let whole = a.width > 2 * RADIUS && a.height > 2 * RADIUS;
    let margin = if whole { RADIUS } else { 0 };
    let rows = margin..a.height - margin;
    let places = rows.flat_map(|y| (margin..a.width - margin).map(move |x| (x, y)));
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, y) in places {
        sum += similarity(y * a.width + x);
        count += 1.0;
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(value: impl Fn(usize) -> f64) -> Raster {
        let pixels: Vec<usize> = (0..24 * 20).collect();
        Raster::new(24, &pixels, |i| value(*i))
    }

    #[test]
    fn ssim_is_one_for_equal_images_and_follows_the_formula_for_constants() {
        let texture = plane(|i| (i * 37 % 100) as f64 / 100.0);
        assert!((mean(&texture, &texture) - 1.0).abs() < 1e-12);
        let (a, b) = (plane(|_| 0.25), plane(|_| 0.75));
        let wanted = (2.0 * 0.25 * 0.75 + C1) / (0.0625 + 0.5625 + C1);
        assert!((mean(&a, &b) - wanted).abs() < 1e-9);
        let inverse = texture.zip(&texture, |x, _| 1.0 - x);
        assert!(mean(&texture, &inverse) < -0.5);
    }
}
