//! Rasters of one number per pixel, and separable filters.

/// A raster, row by row from the top.
pub(super) struct Raster {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f64>,
}

impl Raster {
    /// Creates a raster from rows of pixels.
    pub fn new<T>(width: usize, pixels: &[T], value: impl Fn(&T) -> f64) -> Raster {
        let width = width.max(1);
        Raster { width, height: pixels.len() / width, values: pixels.iter().map(value).collect() }
    }

    /// Combines two rasters of one size pixel by pixel.
    pub fn zip(&self, other: &Raster, value: impl Fn(f64, f64) -> f64) -> Raster {
        let values = self.values.iter().zip(&other.values).map(|(a, b)| value(*a, *b)).collect();
        Raster { values, ..*self }
    }

    /// Filters rows by the weights `across`, then columns by the weights `down`; both have an odd length. Border pixels
    /// are repeated beyond the border.
    pub fn filtered(&self, across: &[f64], down: &[f64]) -> Raster {
        let rows = convolve(&self.values, self.width, self.height, [1, self.width], across);
        Raster { values: convolve(&rows, self.height, self.width, [self.width, 1], down), ..*self }
    }
}

/// Filters each of `lines` lines, which lie `line_step` apart, along its `length` values, which lie `step` apart.
fn convolve(
    values: &[f64],
    length: usize,
    lines: usize,
    [step, line_step]: [usize; 2],
    weights: &[f64],
) -> Vec<f64> {
    let radius = weights.len() / 2;
    let mut out = vec![0.0; values.len()];
    let mut padded = vec![0.0; length + 2 * radius];
    for line in 0..lines {
        let start = line * line_step;
        for (i, value) in padded.iter_mut().enumerate() {
            let at = i.saturating_sub(radius).min(length - 1);
            *value = values[start + at * step];
        }
        for i in 0..length {
            let window = &padded[i..i + weights.len()];
            out[start + i * step] = window.iter().zip(weights).map(|(value, weight)| value * weight).sum();
        }
    }
    out
}

/// Returns exp(−x²/2σ²) for whole x from −`radius` to `radius`.
pub(super) fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    let offsets = -(radius as i64)..=radius as i64;
    offsets.map(|x| libm::exp(-((x * x) as f64) / (2.0 * sigma * sigma))).collect()
}

/// Scales weights so that they add up to 1.
pub(super) fn normalised(weights: &[f64]) -> Vec<f64> {
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_apply_to_rows_and_columns_and_repeat_the_border() {
        let pixels = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let plane = Raster::new(3, &pixels, |value| *value);
        let left = plane.filtered(&[1.0, 0.0, 0.0], &[1.0]);
        assert_eq!(left.values, [1.0, 1.0, 2.0, 4.0, 4.0, 5.0]);
        let below = plane.filtered(&[1.0], &[0.0, 0.0, 1.0]);
        assert_eq!(below.values, [4.0, 5.0, 6.0, 4.0, 5.0, 6.0]);
        let mean = plane.filtered(&normalised(&gaussian(2.0, 30)), &normalised(&gaussian(2.0, 30)));
        assert!(mean.values.iter().all(|v| (1.0..6.0).contains(v)));
    }
}
