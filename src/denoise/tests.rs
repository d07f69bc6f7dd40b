//! Tests of the denoiser on films with known truth.

use rand::RngExt;

use super::*;
use crate::film::{FilmScale, Region};
use crate::sampling::Stream;

const SIZE: [u32; 2] = [100, 70];

/// The true radiance of a pixel, and its depth.
type Scene<'a> = &'a dyn Fn(u32, u32) -> (Rgb, f32);

/// Samples with noise as large as the radiance, and their first hits: walls, each at its depth.
fn noisy(scene: Scene, samples: u32, seed: u64) -> (Film, [Vec<Features>; 2]) {
    let (region, mut stream) = (Region::whole(SIZE), Stream::new(seed));
    let mut film = Film::new(region, FilmScale::default());
    let mut features = Vec::new();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let (radiance, depth_m) = scene(x, y);
            for sample in 0..samples {
                film.count(x, y, sample);
                film.add(x, y, sample, radiance * stream.random_range(0.0..2.0));
            }
            let normal = [0.0, 0.0, 1.0];
            let at =
                Features { coverage: 1.0, depth_m, normal, albedo: Rgb::splat(0.5), ..Features::NOTHING };
            features.push(at);
        }
    }
    (film, [features.clone(), features])
}

fn clean(film: &Film, features: &[Vec<Features>; 2], isa: Isa) -> Denoised {
    denoise(isa, &Noisy { film, features: [&features[0], &features[1]] }).expect("two samples and more")
}

fn error(pixels: &[Rgb], scene: Scene) -> f64 {
    let square = |(at, found): (usize, &Rgb)| {
        let truth = scene(at as u32 % SIZE[0], at as u32 / SIZE[0]).0;
        [0, 1, 2].map(|c| f64::from(found.to_array()[c] - truth.to_array()[c]).powi(2)).iter().sum::<f64>()
            / 3.0
    };
    (pixels.iter().enumerate().map(square).sum::<f64>() / pixels.len() as f64).sqrt()
}

fn slope(x: u32, y: u32) -> (Rgb, f32) {
    (Rgb::new(0.4, 0.3, 0.2) * (1.0 + 0.004 * x as f32 - 0.003 * y as f32), 5.0)
}

/// Two walls, one twenty times as bright and behind the other.
fn edge(x: u32, _: u32) -> (Rgb, f32) {
    if x < 41 { (Rgb::splat(0.05), 2.0) } else { (Rgb::splat(1.0), 3.0) }
}

/// A shadow on one wall, which features do not show.
fn shadow(x: u32, _: u32) -> (Rgb, f32) {
    (Rgb::splat(if x < 41 { 0.02 } else { 1.0 }), 2.0)
}

#[test]
fn denoising_reduces_error_and_keeps_brightness() {
    for (name, scene, least) in
        [("slope", &slope as Scene, 10.0), ("edge", &edge, 10.0), ("shadow", &shadow, 4.0)]
    {
        let (film, features) = noisy(scene, 16, 3);
        let found = clean(&film, &features, Isa::detect());
        let (before, after) = (error(&film.radiance(), scene), error(&found.radiance, scene));
        assert!(after * least < before, "{name}: {before} before, {after} after");
        assert!(found.noise < 0.5 * film.noise().expect("two halves"), "{name}: {}", found.noise);
        let mean = |pixels: &[Rgb]| pixels.iter().map(|p| f64::from(p.luminance())).sum::<f64>();
        let ratio = mean(&found.radiance) / mean(&film.radiance());
        assert!((ratio - 1.0).abs() < 0.01, "{name}: as bright as before: {ratio}");
    }
}

/// Pixels with different features are not averaged, however similar their colours.
#[test]
fn feature_edges_stay_sharp() {
    let (film, features) = noisy(&edge, 4, 5);
    let found = clean(&film, &features, Isa::detect());
    let row = |x: u32| found.radiance[(35 * SIZE[0] + x) as usize].g;
    assert!((38..41).all(|x| row(x) < 0.1) && (41..44).all(|x| row(x) > 0.6), "{} {}", row(40), row(41));
}

/// An image without noise is unchanged, whatever its brightness.
#[test]
fn noise_free_image_is_unchanged() {
    for unit in [1e-6, 1.0, 1e5f32] {
        let scene = |x: u32, y: u32| (Rgb::new(((x * 7 + y * 13) % 5) as f32 + 0.5, 0.25, 1.0) * unit, 2.0);
        let mut film = Film::new(Region::whole(SIZE), FilmScale::new(6.0 * unit, unit));
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            (0..2).for_each(|sample| {
                film.count(x, y, sample);
                film.add(x, y, sample, scene(x, y).0);
            });
        }
        let features = noisy(&scene, 1, 1).1;
        let found = clean(&film, &features, Isa::detect());
        assert!(error(&found.radiance, &scene) < 1e-3 * f64::from(unit), "{unit}");
    }
}

#[test]
fn result_is_independent_of_isa_and_threads() {
    let (film, features) = noisy(&edge, 4, 7);
    let expected = clean(&film, &features, Isa::PORTABLE);
    for isa in Isa::available() {
        assert_eq!(clean(&film, &features, isa).hash(), expected.hash(), "{isa:?}");
    }
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    assert_eq!(one.install(|| clean(&film, &features, Isa::detect())).hash(), expected.hash());
}

#[test]
fn denoise_returns_none_for_one_sample() {
    let (film, features) = noisy(&edge, 1, 7);
    assert!(denoise(Isa::detect(), &Noisy { film: &film, features: [&features[0], &features[1]] }).is_none());
}

/// A film with 16 samples of each pixel, given by column, row and sample number.
fn film_of(sample: impl Fn(u32, u32, u32) -> f32) -> Film {
    let mut film = Film::new(Region::whole(SIZE), FilmScale::default());
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        for number in 0..16 {
            film.count(x, y, number);
            film.add(x, y, number, Rgb::splat(sample(x, y, number)));
        }
    }
    film
}

/// Noise around 1, different for each pixel and sample.
fn noise(x: u32, y: u32, number: u32) -> f32 {
    Stream::new(u64::from((y * SIZE[0] + x) * 16 + number)).random_range(0.0..2.0)
}

fn wall() -> [Vec<Features>; 2] {
    noisy(&|_, _| (Rgb::WHITE, 2.0), 1, 1).1
}

/// True if an outlier is planted: isolated, in corners and at edges, in both halves of one pixel among others, and in
/// every other pixel of a group, as path reuse leaves them.
fn planted(x: u32, y: u32, number: u32) -> bool {
    let single = [(0, 0), (99, 35), (50, 69), (20, 20), (24, 25), (33, 22), (27, 31)].contains(&(x, y));
    let group = (70..74).contains(&x) && (40..44).contains(&y) && (x + y).is_multiple_of(2);
    (number == 3 && (single || group))
        || (number == 6 && (x, y) == (27, 31))
        || (number == 8 && (x, y) == (30, 27))
}

#[test]
fn outliers_leave_no_halo() {
    let film = film_of(|x, y, number| noise(x, y, number) + f32::from(u8::from(planted(x, y, number))) * 1e4);
    let found = clean(&film, &wall(), Isa::detect());
    for (at, pixel) in found.radiance.iter().enumerate() {
        let (x, y) = (at as u32 % SIZE[0], at as u32 / SIZE[0]);
        assert!((pixel.g - 1.0).abs() < 0.4, "{x}, {y}: {}", pixel.g);
    }
}

/// A pixel that is bright in both halves is no outlier, even a single one, and does not brighten its surroundings.
#[test]
fn small_lights_are_kept_without_halo() {
    let lights = [(30, 30, 1), (60, 20, 2), (80, 50, 3)];
    let light = |x: u32, y: u32| {
        let within =
            |&(u, v, side): &(u32, u32, u32)| (u..u + side).contains(&x) && (v..v + side).contains(&y);
        lights.iter().any(within)
    };
    let radiance = |x: u32, y: u32| if light(x, y) { 200.0 } else { 1.0 };
    let film = film_of(|x, y, number| noise(x, y, number) * radiance(x, y));
    let found = clean(&film, &wall(), Isa::detect());
    let lit = |(x, y)| found.radiance[(y * SIZE[0] + x) as usize].g;
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let beside =
            (-1..=1).any(|dy| (-1..=1).any(|dx| light(x.wrapping_add_signed(dx), y.wrapping_add_signed(dy))));
        match (light(x, y), beside) {
            (true, _) => assert!((100.0..300.0).contains(&lit((x, y))), "{x}, {y}: {}", lit((x, y))),
            (false, true) => {}
            (false, false) => assert!((lit((x, y)) - 1.0).abs() < 0.5, "{x}, {y}: {}", lit((x, y))),
        }
    }
}

/// The light of many outliers together, as in a caustic, is not lost.
#[test]
fn light_of_many_outliers_is_spread() {
    let rare = |x, y, number| if noise(y, x + 31, number) < 0.005 { 800.0 } else { 0.0 };
    let film = film_of(|x, y, number| noise(x, y, number) + rare(x, y, number));
    let found = clean(&film, &wall(), Isa::detect());
    let mean = |pixels: &[Rgb]| pixels.iter().map(|p| f64::from(p.g)).sum::<f64>() / pixels.len() as f64;
    let (before, after) = (mean(&film.radiance()), mean(&found.radiance));
    assert!(before > 2.0 && (after / before - 1.0).abs() < 0.2, "{before} before, {after} after");
    let largest = found.radiance.iter().map(|p| f64::from(p.g)).fold(0.0, f64::max);
    assert!(largest < 3.0 * before, "{largest} somewhere");
}

/// A pattern in the albedo survives light that is as noisy as it is bright.
#[test]
fn albedo_texture_is_kept() {
    let albedo = |x: u32, y: u32| 0.3 + 0.05 * ((x * 3 + y * 5) % 7) as f32;
    let film = film_of(|x, y, number| albedo(x, y) * noise(x, y, number));
    let mut features = wall();
    for half in &mut features {
        for (at, of) in half.iter_mut().enumerate() {
            of.albedo = Rgb::splat(albedo(at as u32 % SIZE[0], at as u32 / SIZE[0]));
            of.material = 3;
        }
    }
    let found = clean(&film, &features, Isa::detect());
    let scene = |x: u32, y: u32| (Rgb::splat(albedo(x, y)), 2.0);
    let (before, after) = (error(&film.radiance(), &scene), error(&found.radiance, &scene));
    assert!(after * 5.0 < before, "{before} before, {after} after");
}

/// Pixels of a silhouette differ from each other, and are averaged nevertheless.
#[test]
fn dissimilar_pixels_are_denoised() {
    let mut features = wall();
    for half in &mut features {
        for (at, of) in half.iter_mut().enumerate().filter(|(at, _)| *at as u32 % SIZE[0] == 50) {
            of.depth_m = 2.6 + 0.55 * ((at as u32 / SIZE[0]) % 3) as f32;
        }
    }
    let film = film_of(noise);
    let found = clean(&film, &features, Isa::detect());
    let spread = |pixels: &[Rgb]| {
        let column = pixels.iter().skip(50).step_by(SIZE[0] as usize);
        column.map(|p| f64::from(p.g - 1.0).powi(2)).sum::<f64>().sqrt()
    };
    let (before, after) = (spread(&film.radiance()), spread(&found.radiance));
    assert!(after * 1.5 < before, "{before} before, {after} after");
}
