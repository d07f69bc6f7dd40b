//! Single samples that spoil an image: far too bright, or not a number (NaN).

use crate::error::words;
use crate::film::Film;
use crate::render::Session;
use crate::study::explain::{GivenNames, explain};

/// A pixel is examined if it has at least this fraction of the image's light.
const SHARE: f32 = 1e-3;
/// It must also have at least this many times the average light of all pixels.
const TIMES: f32 = 100.0;
/// One sample must have at least this fraction of its pixel's light.
const OF_PIXEL: f32 = 0.8;
/// The most pixels that are examined.
const MOST: usize = 3;
/// The most samples of a pixel that are searched.
const LONGEST: u32 = 1024;

/// A suspicious sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlier {
    /// Column and row.
    pub pixel: [u32; 2],
    /// The number of the sample.
    pub sample: u32,
    /// The reason.
    pub oddity: Oddity,
    /// The materials that its path hit, in order.
    pub materials: Vec<String>,
}

/// The reason why a sample is suspicious.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Oddity {
    /// It has this fraction of the image's light.
    Bright(f32),
    /// It is the first of this many samples with a component that is NaN or negative infinity.
    NoNumber(u64),
    /// It is the first of this many samples that were clamped to this radiance.
    Cut(u64, f64),
}

impl std::fmt::Display for Outlier {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let ([x, y], sample) = (self.pixel, self.sample);
        let names: Vec<String> = self.materials.iter().map(|name| words(name)).collect();
        let through =
            if names.is_empty() { String::new() } else { format!(", through {},", names.join(", ")) };
        match self.oddity {
            Oddity::Bright(share) => write!(
                f,
                "firefly: sample {sample} of pixel ({x}, {y}){through} holds {:.1} % of the image's light",
                100.0 * share
            ),
            Oddity::NoNumber(count) => write!(
                f,
                "samples are not numbers (NaN) and count as black ({count} times): the first is {sample} of pixel ({x}, {y})"
            ),
            Oddity::Cut(count, brightest) => write!(
                f,
                "samples are brighter than {brightest:.4e} W/(m² sr) and count as that ({count} times): the first is {sample} of pixel ({x}, {y})"
            ),
        }
    }
}

/// Returns the brightest samples that no others confirm, and the first ones that are not a number or were clamped.
pub fn outliers(session: &Session) -> Vec<Outlier> {
    let film = session.film();
    let mut outliers = Vec::new();
    let (non_finite, cut) = (film.non_finite(), film.clamped());
    let noted = [
        (non_finite.first, Oddity::NoNumber(non_finite.count)),
        (cut.first, Oddity::Cut(cut.count, film.brightest())),
    ];
    for (first, oddity) in noted {
        if let Some([y, x, sample]) = first {
            outliers.push(outlier(session, [x, y], sample, oddity));
        }
    }
    let (pixels, shares): (Vec<_>, Vec<_>) = suspects(film).into_iter().unzip();
    for ((pixel, share), (sample, part)) in pixels.iter().zip(shares).zip(brightest(session, &pixels)) {
        if part > OF_PIXEL {
            outliers.push(outlier(session, *pixel, sample, Oddity::Bright(share * part)));
        }
    }
    outliers
}

/// Returns pixels with light almost only in even samples, or almost only in odd ones, and their fractions of the light.
fn suspects(film: &Film) -> Vec<([u32; 2], f32)> {
    let (region, quantum) = (film.region(), film.unit().quantum());
    let (mut all, mut brightest) = (0.0, Vec::with_capacity(MOST + 1));
    for (at, pixel) in film.pixels().iter().enumerate() {
        if pixel.count.contains(&0) {
            return Vec::new();
        }
        all += pixel.mean(quantum).luminance();
        let [even, odd] = pixel.halves(quantum).map(|light| light.luminance());
        let light = 0.5 * (even + odd);
        let is_brighter = brightest.get(MOST - 1).is_none_or(|(_, other)| light > *other);
        if is_brighter && (even - odd).abs() > OF_PIXEL * (even + odd) {
            let place = brightest.partition_point(|(_, other)| *other >= light);
            brightest.insert(place, (at as u32, light));
            brightest.truncate(MOST);
        }
    }
    let least = SHARE.max(TIMES / region.area().max(1) as f32) * all;
    brightest.retain(|(_, light)| *light > least);
    let pixel = |at: u32| [region.x0 + at % region.width(), region.y0 + at / region.width()];
    brightest.into_iter().map(|(at, light)| (pixel(at), light / all)).collect()
}

/// Returns the brightest sample of each pixel, and its fraction of the light; nothing if there are too many samples.
fn brightest(session: &Session, pixels: &[[u32; 2]]) -> Vec<(u32, f32)> {
    if pixels.is_empty() || session.state().samples.count() > LONGEST {
        return Vec::new();
    }
    let mut found = vec![(0, 0.0, 0.0); pixels.len()];
    session.each_sample_of(pixels, &mut |sample, pixel, light| {
        let (best, most, sum) = &mut found[pixel];
        *sum += light;
        if light > *most {
            (*best, *most) = (sample, light);
        }
    });
    found.into_iter().map(|(best, most, sum)| (best, most / sum.max(f32::MIN_POSITIVE))).collect()
}

fn outlier(session: &Session, pixel: [u32; 2], sample: u32, oddity: Oddity) -> Outlier {
    let (lives, _) = explain(session.setup().clone(), &GivenNames::none(), pixel, sample..sample + 1);
    let paths = lives.iter().flat_map(|life| &life.paths).take(1);
    let met = paths.flat_map(|path| path.steps.iter().filter_map(|step| step.vertex.as_ref()));
    Outlier { pixel, sample, oddity, materials: met.map(|vertex| vertex.material.clone()).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmScale, Region};
    use crate::math::Rgb;

    /// One sample has a tenth of the light of all others.
    #[test]
    fn suspects_are_pixels_with_light_from_one_sample() {
        let region = Region::whole([100, 100]);
        let mut film = Film::new(region, FilmScale::default());
        for (y, x, sample) in
            (0..100).flat_map(|y| (0..100).flat_map(move |x| (0..4).map(move |s| (y, x, s))))
        {
            film.count(x, y, sample);
            film.add(x, y, sample, Rgb::WHITE);
        }
        assert_eq!(suspects(&film), []);
        film.add(7, 3, 2, Rgb::splat(4e3));
        let found = suspects(&film);
        assert_eq!(found.len(), 1);
        assert!(found[0].0 == [7, 3] && (0.08..0.1).contains(&found[0].1), "{found:?}");
        // A light is equally bright in all samples.
        (0..4).for_each(|sample| film.add(50, 50, sample, Rgb::splat(4e3)));
        assert_eq!(suspects(&film).len(), 1);
    }

    #[test]
    fn nan_is_counted_and_black_and_infinity_is_clamped() {
        let mut film = Film::new(Region::whole([4, 4]), FilmScale::default());
        film.add(1, 2, 5, Rgb::new(f32::NAN, 1.0, 1.0));
        film.add(3, 1, 0, Rgb::new(1.0, f32::INFINITY, 0.0));
        let mut whole = Film::new(Region::whole([4, 4]), FilmScale::default());
        whole.merge(&film);
        assert_eq!((whole.non_finite().count, whole.non_finite().first), (1, Some([2, 1, 5])));
        assert_eq!((whole.clamped().count, whole.clamped().first), (1, Some([1, 3, 0])));
        assert_eq!(film.radiance()[2 * 4 + 1].r, 0.0);
    }
}
