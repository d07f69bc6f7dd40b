//! Random numbers of the path transport: one or two dimensions for each use, spread over a pixel's samples by the
//! sampler.

use super::pattern::{self, Grid};
use super::sobol;
use crate::math::hash::SampleKey;
use crate::simd::{Float, Int};
use crate::world::{Pattern, Sampler};

/// Draws a point in the unit square. `grid` is made for the number of samples of the pixel. The use has three
/// dimensions, starting at `dimension`.
#[inline(always)]
pub fn draw_2d<F: Float>(sampler: Sampler, grid: Grid, key: SampleKey<F::Int>, dimension: F::Int) -> (F, F) {
    match sampler {
        Sampler::Sobol => sobol::two(key.sample, key.pixel_hash(dimension)),
        Sampler::Jittered => pattern::point(Pattern::Jittered, grid, key, dimension),
        Sampler::Independent => pattern::point(Pattern::Uniform, grid, key, dimension),
    }
}

/// Draws a number in the unit interval. The use has two dimensions, starting at `dimension`.
#[inline(always)]
pub fn draw_1d<F: Float>(sampler: Sampler, grid: Grid, key: SampleKey<F::Int>, dimension: F::Int) -> F {
    match sampler {
        Sampler::Sobol => sobol::one(key.sample, key.pixel_hash(dimension)),
        Sampler::Jittered => {
            let order = key.pixel_hash(dimension + F::Int::splat(1));
            let cell = pattern::permute(key.sample, grid.cells(), order);
            let place = cell.to_float() + key.uniform::<F>(dimension);
            (place * F::splat(1.0 / grid.cells() as f32)).min(F::splat(1.0 - f32::EPSILON / 2.0))
        }
        Sampler::Independent => key.uniform(dimension),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::Wrapping;

    const ALL: [Sampler; 3] = [Sampler::Sobol, Sampler::Jittered, Sampler::Independent];

    fn key(pixel: u32, sample: u32) -> SampleKey<Wrapping<u32>> {
        SampleKey::new(5, Wrapping(pixel), Wrapping(sample), Wrapping(0))
    }

    /// The variance of the mean of a number over a pixel's 16 samples, relative to independent samples.
    fn variance(draw: impl Fn(u32, u32) -> f64) -> f64 {
        let pixels = 1000;
        let error = |pixel| (0..16).map(|s| draw(pixel, s) - 0.5).sum::<f64>() / 16.0;
        (0..pixels).map(|pixel| error(pixel) * error(pixel)).sum::<f64>() / pixels as f64 * 12.0 * 16.0
    }

    #[test]
    fn samplers_reduce_variance_as_their_strata_predict() {
        let grid = Grid::new(16);
        for (sampler, one, two) in [
            // 16 strata along the axis reduce the variance to 1/16², 4 strata to 1/4².
            (Sampler::Sobol, 0.003..0.005, 0.003..0.005),
            (Sampler::Jittered, 0.003..0.005, 0.05..0.075),
            (Sampler::Independent, 0.85..1.15, 0.85..1.15),
        ] {
            let line = variance(|p, s| draw_1d::<f32>(sampler, grid, key(p, s), Wrapping(3)) as f64);
            let square = variance(|p, s| draw_2d::<f32>(sampler, grid, key(p, s), Wrapping(3)).0 as f64);
            assert!(one.contains(&line), "{sampler:?}: {line}");
            assert!(two.contains(&square), "{sampler:?}: {square}");
        }
    }

    #[test]
    fn one_sample_index_is_uniform_over_pixels() {
        let grid = Grid::new(9);
        for sampler in ALL {
            let (mut line, mut square) = ([0u32; 64], [0u32; 64]);
            for pixel in 0..4000 {
                // Only the third sample: stratification cannot help.
                let key = key(pixel, 2);
                line[(draw_1d::<f32>(sampler, grid, key, Wrapping(1)) * 64.0) as usize] += 1;
                let (u, v) = draw_2d::<f32>(sampler, grid, key, Wrapping(4));
                square[(u * 8.0) as usize * 8 + (v * 8.0) as usize] += 1;
            }
            for counts in [line, square] {
                let chi2: f64 = counts.iter().map(|&c| (c as f64 - 62.5).powi(2) / 62.5).sum();
                assert!(chi2 < 103.4, "chi² of 63 degrees of freedom, 0.1 %: {chi2} of {sampler:?}");
            }
        }
    }
}
