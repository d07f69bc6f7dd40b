//! Sums of squared samples, from which the variance of a pixel is estimated.

use super::{Film, PixelSum, Region};
use crate::math::Rgb;

/// The limit of a sample's components, in quanta: 2²² squares, times 2²² samples, fit 128 bits.
const LARGEST: u128 = 1 << 42;

/// Sums of squared samples, in squared quanta: integers like those of [`Film`], so that order does not matter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moments {
    region: Region,
    squares: Vec<[u128; 3]>,
}

impl Moments {
    /// Creates the moments of no samples.
    pub fn new(region: Region) -> Moments {
        Moments { region, squares: vec![[0; 3]; region.area()] }
    }

    /// Creates moments from sums; `None` if there is not one for each pixel.
    pub fn with_squares(region: Region, squares: Vec<[u128; 3]>) -> Option<Moments> {
        (squares.len() == region.area()).then_some(Moments { region, squares })
    }

    /// The sums, row by row from the top.
    pub fn squares(&self) -> &[[u128; 3]] {
        &self.squares
    }

    /// A 128-bit hash (XXH3) of the region and all sums.
    pub fn hash(&self) -> u128 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        let r = self.region;
        [r.x0, r.y0, r.x1, r.y1].iter().for_each(|value| hasher.update(&value.to_le_bytes()));
        self.squares.as_flattened().iter().for_each(|sum| hasher.update(&sum.to_le_bytes()));
        hasher.digest128()
    }

    /// Adds the squares of a film that holds one sample of each pixel, with all its parts.
    pub fn add_sample(&mut self, film: &Film) {
        for (squares, pixel) in self.squares.iter_mut().zip(film.pixels()) {
            for (square, sum) in squares.iter_mut().zip(pixel.total()) {
                let value = (sum.max(0) as u128).min(LARGEST - 1);
                *square = square.saturating_add(value * value);
            }
        }
    }

    /// Adds the moments of a region that lies within this one's.
    pub fn merge(&mut self, other: &Moments) {
        let (from, width) = (other.region, other.region.width() as usize);
        for (y, row) in (from.y0..from.y1).zip(other.squares.chunks(width.max(1))) {
            let start = self.region.index(from.x0, y);
            for (to, more) in self.squares[start..start + width].iter_mut().zip(row) {
                (0..3).for_each(|channel| to[channel] = to[channel].saturating_add(more[channel]));
            }
        }
    }

    /// The variance of each pixel's mean, in (radiance)²: (Σx² − (Σx)² / n) / (n (n − 1)), an unbiased estimate if
    /// samples are independent. It is too large for stratified samples, which differ more than their means do. Infinite
    /// for fewer than two samples.
    pub fn variance_of_mean(&self, film: &Film) -> Vec<Rgb> {
        let quantum = film.unit().quantum();
        let pixels = self.squares.iter().zip(film.pixels());
        pixels.map(|(squares, pixel)| variance(squares, pixel, quantum)).collect()
    }
}

fn variance(squares: &[u128; 3], pixel: &PixelSum, quantum: f64) -> Rgb {
    let count = u128::from(pixel.count[0]) + u128::from(pixel.count[1]);
    if count < 2 {
        return Rgb::splat(f32::INFINITY);
    }
    let n = count as f64;
    let sums = pixel.total().map(|sum| (sum.max(0) as u128).min(count * (LARGEST - 1)));
    let channel = |c: usize| {
        // Exact up to here, so there is no cancellation error.
        let spread = count.saturating_mul(squares[c]).saturating_sub(sums[c].saturating_mul(sums[c]));
        (spread as f64 * quantum * quantum / (n * n * (n - 1.0))) as f32
    };
    Rgb::new(channel(0), channel(1), channel(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FilmScale;

    /// One pixel's samples, each in two parts.
    fn gather(samples: &[f32]) -> (Film, Moments) {
        let region = Region::whole([1, 1]);
        let (mut film, mut moments) = (Film::new(region, FilmScale::default()), Moments::new(region));
        for (sample, value) in (0..).zip(samples) {
            let mut one = Film::new(region, FilmScale::default());
            one.count(0, 0, sample);
            one.add(0, 0, sample, Rgb::new(0.75 * value, 0.0, 1.0));
            one.add(0, 0, sample, Rgb::new(0.25 * value, 0.0, 1.0));
            moments.add_sample(&one);
            film.merge(&one);
        }
        (film, moments)
    }

    #[test]
    fn variance_of_four_samples_matches_hand_computation() {
        let (film, moments) = gather(&[1.0, 3.0, 4.0, 8.0]);
        // Mean 4, squared deviations 9 + 1 + 0 + 16, over 3 for a sample's variance, over 4 for the mean's.
        assert_eq!(moments.variance_of_mean(&film), [Rgb::new(26.0 / 12.0, 0.0, 0.0)]);
        assert_eq!(gather(&[1.0]).1.variance_of_mean(&gather(&[1.0]).0), [Rgb::splat(f32::INFINITY)]);
    }

    #[test]
    fn variance_of_bright_samples_is_exact_and_does_not_overflow() {
        let (film, moments) = gather(&[262_000.0, 262_000.0 + 1.0 / 16.0]);
        let found = moments.variance_of_mean(&film)[0].r;
        assert_eq!(found, 1.0 / 1024.0, "half of (1/16)² / 2");
        let (film, moments) = gather(&[f32::INFINITY; 3]);
        assert_eq!(moments.variance_of_mean(&film)[0].r, 0.0);
    }
}
