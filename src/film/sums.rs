//! Exact sums of samples.

use super::light_groups::{GroupKinds, GroupSum};
use crate::math::Rgb;

/// The radiance of a quantum, times the film scale. Sums are integers in quanta, so they do not depend on the order of
/// samples.
pub const QUANTUM: f64 = 1.0 / (1 << 24) as f64;
/// Components of a sample are clamped to this, times the film scale, so that 2²¹ samples of each parity fit 63 bits.
pub const MAX_RADIANCE: f32 = 262_143.0;

/// The film scale: the unit in which a film counts radiance, a power of two so that scaling does not round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct FilmScale(i32);

impl FilmScale {
    /// The exponents of the brightest radiance for which the scale is 1.
    const USUAL: std::ops::RangeInclusive<i32> = -4..=16;

    /// The light on surfaces is at least this many quanta, as a power of two.
    const FINENESS: i32 = 20;

    /// Chooses the scale for a scene whose brightest radiance is `brightest` and whose surfaces are lit by about
    /// `usual`: suns must not be clamped, and starlight must be more than a few quanta. If both is impossible, because
    /// something small is a million times as bright as everything it lights, it is clamped.
    #[doc(hidden)]
    pub fn new(brightest: f32, usual: f32) -> FilmScale {
        if !(brightest > 0.0 && brightest.is_finite() && usual > 0.0) {
            return FilmScale(0);
        }
        let [brightest, usual] = [brightest, usual].map(|radiance| libm::ilogb(f64::from(radiance)));
        // Limited so that both this power of two and its inverse are floats.
        let largest = (usual + 24 - Self::FINENESS).clamp(0, 100);
        match brightest {
            _ if Self::USUAL.contains(&brightest) => FilmScale(0),
            _ if brightest > *Self::USUAL.end() => FilmScale((brightest - Self::USUAL.end()).min(largest)),
            _ => FilmScale(brightest.max(-100)),
        }
    }

    /// True if [`FilmScale::new`] can return this scale.
    pub(crate) fn is_sound(self) -> bool {
        self.0.abs() <= 100
    }

    /// The radiance of a quantum.
    pub fn quantum(self) -> f64 {
        libm::scalbn(QUANTUM, self.0)
    }

    /// The radiance that counts as 1.
    pub(crate) fn one(self) -> f32 {
        libm::scalbnf(1.0, self.0)
    }

    /// The factor on radiance before it is counted.
    fn inverse(self) -> f32 {
        libm::scalbnf(1.0, -self.0)
    }

    /// Converts radiance to quanta, whose sums do not depend on their order; negative values and NaN count as 0.
    #[inline(always)]
    pub(crate) fn counted(self, radiance: Rgb) -> [i64; 3] {
        (radiance * self.inverse()).to_array().map(quanta)
    }
}

/// A rectangle of pixels of an image: columns `x0..x1` and rows `y0..y1`, row 0 at the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Region {
    /// The first column.
    pub x0: u32,
    /// The first row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl Region {
    /// The region of a whole image.
    pub fn whole([width, height]: [u32; 2]) -> Region {
        Region { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// The number of pixels per row.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// The number of rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// The number of pixels.
    pub fn area(&self) -> usize {
        self.width() as usize * self.height() as usize
    }

    /// Returns the index of a pixel, given by its column and row in the image, in data that go row by row from the top
    /// of the region. The pixel must lie within the region.
    #[inline(always)]
    pub fn index(&self, x: u32, y: u32) -> usize {
        (y - self.y0) as usize * self.width() as usize + (x - self.x0) as usize
    }
}

/// The sums of a pixel, even and odd samples separate: their difference estimates the error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelSum {
    /// Radiance in quanta: even samples, odd samples; red, green, blue.
    pub sum: [[i64; 3]; 2],
    /// The number of samples begun, even and odd. A sample may be added in several parts.
    pub count: [u32; 2],
}

impl PixelSum {
    /// The sums of even and odd samples together.
    pub fn total(&self) -> [i128; 3] {
        let [even, odd] = self.sum;
        [0, 1, 2].map(|channel| i128::from(even[channel]) + i128::from(odd[channel]))
    }

    /// [`PixelSum::total`], rounded.
    fn rounded_total(&self) -> [f64; 3] {
        let [even, odd] = self.sum;
        // Both are positive, and their sum fits unless there are millions of samples.
        [0, 1, 2].map(|channel| match even[channel].checked_add(odd[channel]) {
            Some(sum) => sum as f64,
            None => self.total()[channel] as f64,
        })
    }

    /// The mean of its samples, given the radiance of a quantum.
    pub(crate) fn mean(&self, quantum: f64) -> Rgb {
        let count = (self.count[0] as f64 + self.count[1] as f64).max(1.0);
        self.rounded_total().map(|sum| (sum * quantum / count) as f32).into()
    }

    /// The means of its even and of its odd samples; there must be some of both.
    pub(crate) fn halves(&self, quantum: f64) -> [Rgb; 2] {
        [0, 1].map(|parity: usize| {
            let mean = |sum: i64| (sum as f64 * quantum / f64::from(self.count[parity])) as f32;
            self.sum[parity].map(mean).into()
        })
    }
}

/// The saturated sum of two numbers of at least 0, without a branch, so that the compiler can use wide registers.
#[inline(always)]
pub(super) fn saturated_sum(a: i64, b: i64) -> i64 {
    let sum = a.wrapping_add(b) as u64;
    // All ones if the sum is too large.
    ((sum | 0u64.wrapping_sub(sum >> 63)) & i64::MAX as u64) as i64
}

/// Exact sums of the samples of a region's pixels: the film is the same in whatever order samples are added.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub(super) region: Region,
    pub(super) unit: FilmScale,
    /// The inverse of the unit.
    pub(super) inverse: f32,
    pub(super) pixels: Vec<PixelSum>,
    /// The sums of groups: all of a pixel's one after another.
    pub(super) groups: Vec<GroupSum>,
    pub(super) kinds: GroupKinds,
    non_finite: RejectedCounts,
    clamped: RejectedCounts,
}

/// The number of parts of samples that were changed when they were added, and the first of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RejectedCounts {
    /// The number of parts.
    pub count: u64,
    /// The row, column and sample of the first one.
    pub first: Option<[u32; 3]>,
}

impl RejectedCounts {
    #[cold]
    fn note(&mut self, place: [u32; 3]) {
        self.merge(&RejectedCounts { count: 1, first: Some(place) });
    }

    fn merge(&mut self, other: &RejectedCounts) {
        self.count += other.count;
        self.first = [self.first, other.first].into_iter().flatten().min();
    }
}

impl Film {
    /// Creates a black film.
    #[doc(hidden)]
    pub fn new(region: Region, unit: FilmScale) -> Film {
        Film::of(region, unit, vec![PixelSum::default(); region.area()])
    }

    fn of(region: Region, unit: FilmScale, pixels: Vec<PixelSum>) -> Film {
        Film {
            region,
            unit,
            inverse: unit.inverse(),
            pixels,
            groups: Vec::new(),
            kinds: GroupKinds::default(),
            non_finite: RejectedCounts::default(),
            clamped: RejectedCounts::default(),
        }
    }

    /// Creates a film from sums, row by row from the top; `None` if there is not one for each pixel, or if one is
    /// negative or counts more samples than 32 bits can hold.
    #[doc(hidden)]
    pub fn with_pixels(region: Region, unit: FilmScale, pixels: Vec<PixelSum>) -> Option<Film> {
        let sound = |pixel: &PixelSum| {
            let count = pixel.count[0].checked_add(pixel.count[1]);
            pixel.sum.as_flattened().iter().all(|sum| *sum >= 0) && count.is_some()
        };
        let fits = pixels.len() == region.area() && pixels.iter().all(sound);
        fits.then(|| Film::of(region, unit, pixels))
    }

    /// The film scale.
    #[doc(hidden)]
    pub fn unit(&self) -> FilmScale {
        self.unit
    }

    /// The region of its pixels.
    pub fn region(&self) -> Region {
        self.region
    }

    /// The sums of its pixels, row by row from the top.
    #[doc(hidden)]
    pub fn pixels(&self) -> &[PixelSum] {
        &self.pixels
    }

    /// Adds a part of a sample's radiance.
    #[inline(always)]
    pub(crate) fn add(&mut self, x: u32, y: u32, sample: u32, radiance: Rgb) {
        let sum = &mut self.pixels[self.region.index(x, y)].sum[(sample & 1) as usize];
        let counted = radiance * self.inverse;
        // Nothing is ever subtracted, so saturation does not depend on the order either.
        sum[0] = sum[0].saturating_add(quanta(counted.r));
        sum[1] = sum[1].saturating_add(quanta(counted.g));
        sum[2] = sum[2].saturating_add(quanta(counted.b));
        // Comparisons with NaN are false.
        if !(counted.r.abs() < MAX_RADIANCE
            && counted.g.abs() < MAX_RADIANCE
            && counted.b.abs() < MAX_RADIANCE)
        {
            self.note(counted, [y, x, sample]);
        }
    }

    #[cold]
    fn note(&mut self, counted: Rgb, place: [u32; 3]) {
        let components = counted.to_array();
        if components.iter().any(|component| component.is_nan() || *component == f32::NEG_INFINITY) {
            self.non_finite.note(place);
        }
        if components.iter().any(|component| *component >= MAX_RADIANCE) {
            self.clamped.note(place);
        }
    }

    /// The parts with a component that was NaN or −∞, which counts as 0.
    pub(crate) fn non_finite(&self) -> RejectedCounts {
        self.non_finite
    }

    /// The parts with a component of [`Film::brightest`] or more, which is clamped to that.
    pub(crate) fn clamped(&self) -> RejectedCounts {
        self.clamped
    }

    /// The largest radiance that a part of a sample counts as.
    pub(crate) fn brightest(&self) -> f64 {
        f64::from(MAX_RADIANCE) / QUANTUM * self.unit.quantum()
    }

    /// Counts a sample.
    #[inline(always)]
    pub(crate) fn count(&mut self, x: u32, y: u32, sample: u32) {
        let count = &mut self.pixels[self.region.index(x, y)].count[(sample & 1) as usize];
        *count = count.saturating_add(1);
    }

    /// Adds another film of the same scale, whose region must lie within this one's.
    #[doc(hidden)]
    pub fn merge(&mut self, other: &Film) {
        self.non_finite.merge(&other.non_finite);
        self.clamped.merge(&other.clamped);
        assert_eq!(self.unit, other.unit, "films of different units");
        assert_eq!(self.kinds, other.kinds, "films of different groups");
        let from = other.region;
        for y in from.y0..from.y1 {
            let (to, start) = (self.region.index(from.x0, y), from.index(from.x0, y));
            let width = from.width() as usize;
            let source = &other.pixels[start..start + width];
            for (pixel, more) in self.pixels[to..to + width].iter_mut().zip(source) {
                for parity in 0..2 {
                    for channel in 0..3 {
                        let sum = &mut pixel.sum[parity][channel];
                        *sum = saturated_sum(*sum, more.sum[parity][channel]);
                    }
                    pixel.count[parity] = pixel.count[parity].saturating_add(more.count[parity]);
                }
            }
            let count = self.kinds.count();
            let source = &other.groups[start * count..(start + width) * count];
            let target = &mut self.groups[to * count..(to + width) * count];
            let target = target.as_flattened_mut().as_flattened_mut();
            for (sum, more) in target.iter_mut().zip(source.as_flattened().as_flattened()) {
                *sum = saturated_sum(*sum, *more);
            }
        }
    }

    /// The mean number of samples per pixel.
    pub fn samples_per_pixel(&self) -> f64 {
        let all: u64 = self.pixels.iter().map(|p| u64::from(p.count[0]) + u64::from(p.count[1])).sum();
        all as f64 / self.pixels.len().max(1) as f64
    }

    /// The mean radiance of each pixel in W m⁻² sr⁻¹, row by row from the top, width × height of the region; black
    /// where there is no sample.
    pub fn radiance(&self) -> Vec<Rgb> {
        self.means().collect()
    }

    /// An iterator over the pixels of [`Film::radiance`].
    pub(crate) fn means(&self) -> impl ExactSizeIterator<Item = Rgb> {
        let quantum = self.unit.quantum();
        (0..self.pixels.len()).map(move |index| self.shown(index).mean(quantum))
    }

    /// The mean radiance of each pixel's even and of its odd samples; `None` until every pixel has some of both.
    pub(crate) fn halves(&self) -> Option<impl Iterator<Item = [Rgb; 2]>> {
        let quantum = self.unit.quantum();
        self.has_halves().then(|| (0..self.pixels.len()).map(move |index| self.shown(index).halves(quantum)))
    }

    /// True if every pixel has even and odd samples.
    pub(super) fn has_halves(&self) -> bool {
        self.pixels.iter().all(|p| !p.count.contains(&0))
    }

    /// The root mean square of the remaining noise in the pixels' components, in W m⁻² sr⁻¹, estimated from the
    /// difference of even and odd samples; `None` until every pixel has some of both.
    pub fn noise(&self) -> Option<f64> {
        if !self.has_halves() {
            return None;
        }
        let (mut sum, quantum) = (0.0, self.unit.quantum());
        for index in 0..self.pixels.len() {
            let p = self.shown(index);
            for c in 0..3 {
                let mean = |parity: usize| p.sum[parity][c] as f64 * quantum / p.count[parity] as f64;
                // The mean of two halves has a quarter of the variance of their difference.
                sum += (mean(0) - mean(1)).powi(2) / 4.0;
            }
        }
        Some((sum / (3 * self.pixels.len()).max(1) as f64).sqrt())
    }

    /// The noise relative to the image, from 0 to 1, as a human-readable measure: the root mean square over the pixels
    /// of their noise (estimated from the difference of even and odd samples) relative to their brightness, or to a
    /// tenth of the image's mean where they are darker than that. No pixel counts for more than 1. `None` until every
    /// pixel has some of both.
    pub fn relative_noise(&self) -> Option<f64> {
        // A pixel's brightness, and its variance: the mean of two halves has a quarter of that of their difference.
        let look = |p: &PixelSum| {
            let scales = p.count.map(|count| 1.0 / f64::from(count));
            let (mut both, mut squares) = (0.0, 0.0);
            for c in 0..3 {
                let [even, odd] = [0, 1].map(|parity| p.sum[parity][c] as f64 * scales[parity]);
                both += even + odd;
                squares += (even - odd) * (even - odd);
            }
            (both / 2.0, squares / 4.0)
        };
        let count = self.pixels.len() as f64;
        let mut sum = 0.0;
        for index in 0..self.pixels.len() {
            let p = self.shown(index);
            if p.count.contains(&0) {
                return None;
            }
            sum += look(&p).0;
        }
        if self.pixels.is_empty() {
            return None;
        }
        let floor = 0.1 * sum / count;
        let relative = |p: &PixelSum| {
            let (brightness, squares) = look(p);
            let brightness = brightness.max(floor);
            // The mean over three components, each relative to a third of the brightness.
            if squares == 0.0 { 0.0 } else { (3.0 * squares / (brightness * brightness)).min(1.0) }
        };
        let each = (0..self.pixels.len()).map(|index| relative(&self.shown(index)));
        Some((each.sum::<f64>() / count).sqrt())
    }

    /// A 128-bit hash (XXH3) of the region, the unit and all sums and counts: equal films have equal hashes.
    pub fn hash(&self) -> u128 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        let r = self.region;
        for value in [r.x0, r.y0, r.x1, r.y1] {
            hasher.update(&value.to_le_bytes());
        }
        if self.unit != FilmScale::default() {
            hasher.update(&self.unit.0.to_le_bytes());
        }
        // Many at a time: the hasher takes longer for a few bytes than for some kilobytes.
        let mut bytes = Vec::new();
        for some in self.pixels.chunks(256) {
            bytes.clear();
            for pixel in some {
                for sum in pixel.sum.as_flattened() {
                    bytes.extend_from_slice(&sum.to_le_bytes());
                }
                for count in pixel.count {
                    bytes.extend_from_slice(&count.to_le_bytes());
                }
            }
            hasher.update(&bytes);
        }
        for some in self.groups.chunks(256) {
            bytes.clear();
            let sums = some.as_flattened().as_flattened();
            sums.iter().for_each(|sum| bytes.extend_from_slice(&sum.to_le_bytes()));
            hasher.update(&bytes);
        }
        hasher.digest128()
    }
}

/// Rounds to the nearest quantum; negative values and NaN count as 0.
#[inline(always)]
fn quanta(radiance: f32) -> i64 {
    let limited = if radiance > 0.0 { radiance } else { 0.0 };
    let limited = if limited < MAX_RADIANCE { limited } else { MAX_RADIANCE };
    (limited as f64 * (1.0 / QUANTUM) + 0.5) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Suns and starlight are counted as precisely as ordinary radiances.
    #[test]
    fn film_scale_preserves_precision_of_brightest_radiance() {
        for exponent in [-90, -40, -5, -4, 0, 16, 17, 40, 100] {
            let brightest = libm::scalbnf(1.37, exponent);
            let mut film = Film::new(Region::whole([1, 1]), FilmScale::new(brightest, brightest));
            film.count(0, 0, 0);
            film.add(0, 0, 0, Rgb::new(brightest, brightest / 3.0, 0.0));
            let found = film.radiance()[0];
            assert!((found.r / brightest - 1.0).abs() < 1e-6, "2^{exponent}: {found:?}");
            assert!((found.g / brightest * 3.0 - 1.0).abs() < 3e-6, "2^{exponent}: {found:?}");
        }
        for nothing in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(FilmScale::new(nothing, nothing), FilmScale::default());
        }
        // A spark in a dim room: the light on surfaces has priority over the brightness of the spark.
        assert_eq!(FilmScale::new(1e9, 0.05), FilmScale::default());
        assert_eq!((FilmScale::new(1e9, 1.0), FilmScale::new(1e9, 1e9)), (FilmScale(4), FilmScale(13)));
    }

    #[test]
    fn film_reports_means_noise_and_clamped_parts() {
        let mut film = Film::new(Region { x0: 2, y0: 3, x1: 4, y1: 4 }, FilmScale::default());
        for sample in 0..4 {
            film.count(2, 3, sample);
            film.count(3, 3, sample);
            film.add(2, 3, sample, Rgb::splat(sample as f32));
            film.add(3, 3, sample, Rgb::new(f32::INFINITY, f32::NAN, -1.0));
        }
        let mean = film.radiance();
        assert_eq!(mean[0], Rgb::splat(1.5));
        assert_eq!(mean[1], Rgb::new(MAX_RADIANCE, 0.0, 0.0));
        // Even mean 1, odd mean 2: (1 / 2)² in one of two pixels.
        assert!((film.noise().unwrap() - 0.125f64.sqrt()).abs() < 1e-9);
        let all = RejectedCounts { count: 4, first: Some([3, 3, 0]) };
        assert_eq!(
            (film.non_finite(), film.clamped(), film.brightest()),
            (all, all, f64::from(MAX_RADIANCE))
        );
    }

    /// A path that forks may add its sample in any number of parts.
    #[test]
    fn sums_saturate_in_any_order() {
        let region = Region::whole([1, 1]);
        let bright = |parity: u32, count: u32| {
            let mut film = Film::new(region, FilmScale::default());
            film.count(0, 0, parity);
            (0..count).for_each(|_| film.add(0, 0, parity, Rgb::splat(MAX_RADIANCE)));
            film
        };
        let mut film = Film::new(region, FilmScale::default());
        // 2²¹ parts fit.
        [1 << 20, 1 << 20].iter().for_each(|count| film.merge(&bright(0, *count)));
        assert!((0..i64::MAX).contains(&film.pixels()[0].sum[0][0]));
        let reversed = |parts: &[Film]| {
            let mut film = Film::new(region, FilmScale::default());
            parts.iter().rev().for_each(|part| film.merge(part));
            film
        };
        let parts = [film, bright(1, 1 << 20), bright(1, 1 << 21), bright(0, 100)];
        let mut film = parts[0].clone();
        parts[1..].iter().for_each(|part| film.merge(part));
        assert_eq!(film.pixels()[0].sum, [[i64::MAX; 3]; 2]);
        assert_eq!(reversed(&parts), film);
        assert!(film.radiance()[0].r > 0.0 && film.noise().is_some());
    }

    proptest! {
        #[test]
        fn film_is_independent_of_split_and_order(
            samples in prop::collection::vec((0u32..4, 0u32..3, 0u32..8, 0f32..10.0), 1..50),
            clamped in 0usize..50,
        ) {
            let region = Region::whole([4, 3]);
            let fill = |samples: &mut dyn Iterator<Item = &(u32, u32, u32, f32)>| {
                let mut film = Film::new(region, FilmScale::default());
                for &(x, y, sample, value) in samples {
                    film.count(x, y, sample);
                    film.add(x, y, sample, Rgb::new(value, value * 0.3, 1.0 / (value + 0.1)));
                }
                film
            };
            let whole = fill(&mut samples.iter());
            let clamped = clamped.min(samples.len());
            let mut parts = fill(&mut samples[clamped..].iter().rev());
            parts.merge(&fill(&mut samples[..clamped].iter()));
            prop_assert_eq!(whole.hash(), parts.hash());
            prop_assert_eq!(whole, parts);
        }
    }
}
