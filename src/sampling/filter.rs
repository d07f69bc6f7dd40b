//! Importance sampling of pixel filters by a table of the inverse cumulative distribution.

use crate::simd::{Float, Int};
use crate::world::PixelFilter;

/// Intervals of the table; the inverse is interpolated linearly.
const STEPS: usize = 1024;
/// The quantiles of all filters for a radius of 1, in the order of `SHAPES` below. To integrate them takes milliseconds:
/// `UPDATE=1 cargo test --lib as_the_code` does that, and writes this file.
const QUANTILES: &[u8] = include_bytes!("filter.bin");

/// Maps a uniform number to an offset from the pixel's centre along one axis, with the filter's density. All filters
/// are products of a function of x and a function of y.
#[derive(Clone, Debug)]
pub struct FilterTable {
    /// Offsets in pixels at the quantiles 0, 1/1024, …, 1.
    quantiles: Vec<f32>,
    /// The density per pixel, averaged over equal steps of the filter's width.
    densities: Vec<f32>,
    /// Half of the filter's width in pixels.
    radius: f32,
}

impl FilterTable {
    /// Tabulates a filter.
    pub fn new(filter: PixelFilter) -> Self {
        let (shape, radius) = match filter {
            PixelFilter::Box => (0, 0.5),
            PixelFilter::Tent { radius } => (1, radius),
            PixelFilter::Gaussian { radius } => (2, radius),
            PixelFilter::BlackmanHarris { radius } => (3, radius),
        };
        let words = QUANTILES.as_chunks().0.iter().skip(shape * (STEPS + 1)).take(STEPS + 1);
        let quantiles: Vec<_> =
            words.map(|word| (f64::from_le_bytes(*word) * radius as f64) as f32).collect();
        let densities = densities(&quantiles, radius);
        Self { quantiles, densities, radius }
    }

    /// The filter's radius around a pixel's centre, in pixels.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The density per pixel of an offset returned by [`FilterTable::sample`].
    pub fn density(&self, offset: f32) -> f32 {
        let place = (offset / self.radius + 1.0) * 0.5 * self.densities.len() as f32;
        if place >= 0.0 { self.densities.get(place as usize).copied().unwrap_or(0.0) } else { 0.0 }
    }

    /// The offset in pixels for a uniform number in [0, 1).
    #[inline(always)]
    pub fn sample<F: Float>(&self, u: F) -> F {
        let place = u * F::splat(STEPS as f32);
        let index = place.floor();
        let (cell, all) = (index.to_int(), crate::simd::Mask::first(F::WIDTH));
        let low = F::gather(&self.quantiles, cell, all);
        let high = F::gather(&self.quantiles, cell + F::Int::splat(1), all);
        low + (high - low) * (place - index)
    }
}

/// The density that the quantiles represent; it is constant between neighbouring quantiles.
fn densities(quantiles: &[f32], radius: f32) -> Vec<f32> {
    let width = 2.0 * radius / STEPS as f32;
    // The cumulative distribution at growing positions.
    let mut next = 1;
    let mut below = |x: f32| {
        while next < STEPS && quantiles[next] <= x {
            next += 1;
        }
        let (low, high) = (quantiles[next - 1], quantiles[next]);
        (next as f32 - 1.0 + ((x - low) / (high - low).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)) / STEPS as f32
    };
    let mut last = below(-radius);
    let steps = (1..=STEPS).map(|step| {
        let before = std::mem::replace(&mut last, below(step as f32 * width - radius));
        (last - before) / width
    });
    steps.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::is_up_to_date;

    /// The densities of all filters for a radius of 1, up to a factor.
    const SHAPES: [fn(f64) -> f64; 4] =
        [|_| 1.0, |x| 1.0 - x.abs(), |x| libm::exp(-4.5 * x * x), blackman_harris];

    /// The Blackman–Harris window over −1 to 1 (Harris 1978, minimum four-term).
    fn blackman_harris(x: f64) -> f64 {
        let turn = std::f64::consts::PI * (x + 1.0);
        0.35875 - 0.48829 * libm::cos(turn) + 0.14128 * libm::cos(2.0 * turn)
            - 0.01168 * libm::cos(3.0 * turn)
    }

    /// The quantiles of a density over −1 to 1, by the trapezium rule.
    fn invert(density: impl Fn(f64) -> f64) -> Vec<f64> {
        const FINE: usize = 64 * STEPS;
        let x = |i: usize| i as f64 / FINE as f64 * 2.0 - 1.0;
        let mut cumulative = vec![0.0; FINE + 1];
        for i in 0..FINE {
            cumulative[i + 1] = cumulative[i] + density(x(i)).max(0.0) + density(x(i + 1)).max(0.0);
        }
        let total = cumulative[FINE];
        let mut quantiles = Vec::with_capacity(STEPS + 1);
        let mut i = 0;
        for step in 0..=STEPS {
            let target = total * step as f64 / STEPS as f64;
            while i < FINE - 1 && cumulative[i + 1] < target {
                i += 1;
            }
            let within =
                (target - cumulative[i]) / (cumulative[i + 1] - cumulative[i]).max(f64::MIN_POSITIVE);
            quantiles.push(x(i) + within.clamp(0.0, 1.0) * 2.0 / FINE as f64);
        }
        quantiles
    }

    #[test]
    fn quantiles_are_as_the_code() {
        let quantiles = SHAPES.into_iter().flat_map(invert);
        is_up_to_date("src/sampling/filter.bin", &quantiles.flat_map(f64::to_le_bytes).collect::<Vec<_>>());
    }

    /// The standard deviation of a filter's samples, in pixels.
    fn deviation(filter: PixelFilter) -> f64 {
        let table = FilterTable::new(filter);
        let n = 100_000;
        let offsets = (0..n).map(|i| table.sample((i as f32 + 0.5) / n as f32) as f64);
        (offsets.map(|x| x * x).sum::<f64>() / n as f64).sqrt()
    }

    #[test]
    fn samples_have_the_standard_deviation_of_their_filter() {
        // Box of width 1: √(1/12). Tent of radius 1: √(1/6). Gaussian of σ = radius / 3, truncated at 3 σ: 0.98658 σ.
        assert!((deviation(PixelFilter::Box) - (1.0f64 / 12.0).sqrt()).abs() < 1e-4);
        assert!((deviation(PixelFilter::Tent { radius: 1.0 }) - (1.0f64 / 6.0).sqrt()).abs() < 1e-3);
        assert!((deviation(PixelFilter::Gaussian { radius: 1.5 }) - 0.5 * 0.98658).abs() < 1e-3);
        // ∫ x² w / ∫ w of the window over ±1 by hand: 1/3 − (2/π²)(a₁ − a₂/4 + a₃/9) / a₀, signs alternating.
        let pi2 = std::f64::consts::PI.powi(2);
        let variance = 1.0 / 3.0 - 2.0 / pi2 * (0.48829 - 0.14128 / 4.0 + 0.01168 / 9.0) / 0.35875 * 1.0;
        let expected = 1.5 * variance.abs().sqrt();
        assert!(
            (deviation(PixelFilter::BlackmanHarris { radius: 1.5 }) - expected).abs() < 5e-3,
            "{expected}"
        );
    }

    #[test]
    fn density_matches_the_histogram_of_samples() {
        for filter in [
            PixelFilter::Box,
            PixelFilter::Tent { radius: 1.2 },
            PixelFilter::Gaussian { radius: 1.5 },
            PixelFilter::BlackmanHarris { radius: 2.0 },
        ] {
            let table = FilterTable::new(filter);
            let (n, cells) = (200_000, 16);
            let mut counts = vec![0.0f32; cells];
            for i in 0..n {
                let offset = table.sample((i as f32 + 0.5) / n as f32);
                let cell = ((offset / table.radius() + 1.0) * 0.5 * cells as f32) as usize;
                counts[cell.min(cells - 1)] += 1.0 / n as f32;
            }
            let width = 2.0 * table.radius() / cells as f32;
            for (cell, counted) in counts.into_iter().enumerate() {
                let steps =
                    (0..100).map(|i| (cell as f32 + (i as f32 + 0.5) / 100.0) * width - table.radius());
                let mean = steps.map(|x| table.density(x)).sum::<f32>() / 100.0 * width;
                assert!((mean - counted).abs() < 2e-3, "{filter:?} {cell}: {mean}, not {counted}");
            }
        }
        assert_eq!(FilterTable::new(PixelFilter::Box).density(0.49), 1.0);
        assert_eq!(FilterTable::new(PixelFilter::Box).density(0.51), 0.0);
    }

    #[test]
    fn box_filter_maps_numbers_to_offsets_linearly() {
        assert_eq!(FilterTable::new(PixelFilter::Box).sample(0.5f32), 0.0);
        assert!((FilterTable::new(PixelFilter::Box).sample(0.25f32) + 0.25).abs() < 1e-6);
    }
}
