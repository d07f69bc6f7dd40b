//! A clear sky and its sun, computed from the air: molecules (Rayleigh) and haze (Mie) scatter light, and ozone absorbs
//! it, each with its own profile of heights. Single scattering is integrated along every line of sight; multiple
//! scattering is taken to be isotropic at each height (Hillaire, "A scalable and production ready sky and atmosphere
//! rendering technique", 2020, whose coefficients these are, except for haze).
//!
//! Lengths are in kilometres. Above the air, sunlight is white.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::world::Light;

/// A colour's red, green and blue.
type SkyColor = [f64; 3];

/// Distances from the middle of the earth to its ground, and to the top of the air.
const GROUND: f64 = 6360.0;
const TOP: f64 = 6460.0;
/// The albedo of the ground.
const GROUND_ALBEDO: f64 = 0.3;
/// The viewer's height above the ground.
const EYE: f64 = 0.1;

/// The scattering coefficient of molecules at the ground, km⁻¹, and their scale height.
const RAYLEIGH: (SkyColor, f64) = ([5.802e-3, 13.558e-3, 33.1e-3], 8.0);
/// The scattering and absorption coefficients of haze at the ground, km⁻¹, and its scale height (a tenth is absorbed,
/// as in Bruneton and Neyret; 15 times as much as theirs, which is the haze of high mountains: an optical depth of
/// 0.08).
const HAZE: ([f64; 2], f64) = ([60e-3, 6.7e-3], 1.2);
/// The Henyey-Greenstein anisotropy g of haze.
const HAZE_ANISOTROPY: f64 = 0.8;
/// The absorption coefficient of ozone where it is densest, km⁻¹, that height, and its extent above and below.
const OZONE: (SkyColor, f64, f64) = ([0.65e-3, 1.881e-3, 0.085e-3], 25.0, 15.0);

/// The sun's irradiance above the air, chosen so that white in the sun at noon has a radiance of about 1.
pub(super) const SOLAR: f64 = 4.0;

/// Width and height of the panorama in texels.
pub(super) const SIZE: [usize; 2] = [512, 256];

/// The atmosphere with its haze.
pub(super) struct Air {
    /// Haze, relative to that of a clear day.
    haze: f64,
    /// Transmittance from the top of the air: see [`Air::transmittance`].
    transmittance: Vec<SkyColor>,
    /// Light that was scattered twice or more, for a sun of irradiance 1: see [`Air::again`].
    again: Vec<SkyColor>,
}

/// Sizes of the tables: heights and cosines.
const TRANSMITTANCE: [usize; 2] = [64, 256];
const AGAIN: [usize; 2] = [24, 32];

/// Coefficients of the air at some height, km⁻¹.
struct Matter {
    rayleigh: SkyColor,
    haze: f64,
    extinction: SkyColor,
}

impl Air {
    /// Air without tables.
    fn bare(haze: f32) -> Self {
        Self { haze: f64::from(haze), transmittance: Vec::new(), again: Vec::new() }
    }

    /// Computes the tables. With the panorama, this takes some tenths of a CPU second.
    pub(super) fn new(haze: f32) -> Self {
        let mut air = Self::bare(haze);
        let [heights, cosines] = TRANSMITTANCE;
        let entry = |i: usize| {
            let (r, mu) = place_of(part(i / cosines, heights), part(i % cosines, cosines));
            air.through(r, mu)
        };
        air.transmittance = (0..heights * cosines).into_par_iter().map(entry).collect();
        let [heights, cosines] = AGAIN;
        let entry = |i: usize| {
            let part_up = part(i / cosines, heights);
            let height = (TOP - GROUND) * part_up * part_up;
            air.scattered_again(GROUND + height.max(0.01), sun_cosine(part(i % cosines, cosines)))
        };
        air.again = (0..heights * cosines).into_par_iter().map(entry).collect();
        air
    }

    fn matter(&self, height: f64) -> Matter {
        let rayleigh = RAYLEIGH.0.map(|c| c * libm::exp(-height / RAYLEIGH.1));
        let haze = self.haze * libm::exp(-height / HAZE.1);
        let ozone = (1.0 - (height - OZONE.1).abs() / OZONE.2).max(0.0);
        let extinction =
            std::array::from_fn(|k| rayleigh[k] + (HAZE.0[0] + HAZE.0[1]) * haze + OZONE.0[k] * ozone);
        Matter { rayleigh, haze: HAZE.0[0] * haze, extinction }
    }

    /// Transmittance from a place at distance `r` from the middle of the earth, along a direction of cosine `mu` to the
    /// zenith, to the top of the air.
    fn through(&self, r: f64, mu: f64) -> SkyColor {
        const STEPS: usize = 192;
        let length = to_top(r, mu);
        let step = length / STEPS as f64;
        let mut depth = [0.0; 3];
        for i in 0..STEPS {
            let t = (i as f64 + 0.5) * step;
            let extinction = self.matter(height_at(r, mu, t)).extinction;
            depth = std::array::from_fn(|k| depth[k] + extinction[k] * step);
        }
        depth.map(|depth| libm::exp(-depth))
    }

    /// The part of the sun's light that arrives at a place.
    fn transmittance(&self, r: f64, mu: f64) -> SkyColor {
        let (there, mu) = part_of_sun(r, mu);
        if there == 0.0 {
            return [0.0; 3];
        }
        let (x, y) = coordinates_of(r, mu);
        between(&self.transmittance, TRANSMITTANCE, x, y).map(|c| c * there)
    }

    /// The sun's irradiance at the ground on a surface that faces it.
    pub(super) fn sun(haze: f32, elevation: f64) -> SkyColor {
        let r = GROUND + EYE;
        let (there, mu) = part_of_sun(r, libm::sin(elevation));
        Self::bare(haze).through(r, mu).map(|c| c * there * SOLAR)
    }

    /// Radiance of light that has been scattered at least twice, for a sun of irradiance 1; isotropic.
    fn again(&self, r: f64, sun: f64) -> SkyColor {
        let x = ((r - GROUND) / (TOP - GROUND)).max(0.0).sqrt();
        // The inverse of `sun_cosine`.
        let y = if sun < 0.0 { 0.5 - (-sun).sqrt() * 0.5 } else { 0.5 + sun.sqrt() * 0.5 };
        between(&self.again, AGAIN, x, y)
    }

    /// An entry of the table [`Air::again`]: light scattered twice, divided by the part that is not scattered again
    /// (equations 5 to 10).
    fn scattered_again(&self, r: f64, sun: f64) -> SkyColor {
        const DIRECTIONS: usize = 8;
        let (mut second, mut onwards) = ([0.0; 3], [0.0; 3]);
        let sun_way = DVec3::new((1.0 - sun * sun).max(0.0).sqrt(), sun, 0.0);
        for i in 0..DIRECTIONS * DIRECTIONS {
            let cos = 1.0 - 2.0 * (part(i / DIRECTIONS, DIRECTIONS + 1) + 0.5 / DIRECTIONS as f64);
            let turn = 2.0 * PI * ((i % DIRECTIONS) as f64 + 0.5) / DIRECTIONS as f64;
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            let way = DVec3::new(sin * libm::cos(turn), cos, sin * libm::sin(turn));
            let seen = self.seen(r, way, sun_way, Phase::Even);
            for k in 0..3 {
                second[k] += seen.light[k] / (DIRECTIONS * DIRECTIONS) as f64;
                onwards[k] += seen.scattered[k] / (DIRECTIONS * DIRECTIONS) as f64;
            }
        }
        std::array::from_fn(|k| second[k] / (1.0 - onwards[k]))
    }

    /// Light along a line of sight, for a sun of irradiance 1.
    fn seen(&self, r: f64, way: DVec3, sun: DVec3, phase: Phase) -> SightLight {
        const STEPS: usize = 32;
        let mu = way.y;
        let ground = to_ground(r, mu);
        let length = ground.unwrap_or_else(|| to_top(r, mu));
        let [by_molecules, by_haze] = phase.values(way.dot(sun));
        let mut seen = SightLight { light: [0.0; 3], scattered: [0.0; 3] };
        let (mut left, mut before) = ([1.0; 3], 0.0);
        for i in 0..STEPS {
            // Shorter steps where the air is denser.
            let part = (i + 1) as f64 / STEPS as f64;
            let end = length * part * part;
            let (step, t) = (end - before, (end + before) * 0.5);
            before = end;
            let place = DVec3::new(0.0, r, 0.0) + way * t;
            let here = place.length();
            let matter = self.matter(here - GROUND);
            let sun_cos = place.dot(sun) / here;
            let sunlight = self.transmittance(here, sun_cos);
            let again = if phase == Phase::Even { [0.0; 3] } else { self.again(here, sun_cos) };
            for k in 0..3 {
                let scattering = matter.rayleigh[k] + matter.haze;
                let once = sunlight[k] * (matter.rayleigh[k] * by_molecules + matter.haze * by_haze);
                let passes = libm::exp(-matter.extinction[k] * step);
                let within = left[k] * (1.0 - passes) / matter.extinction[k].max(1e-12);
                seen.light[k] += within * (once + scattering * again[k]);
                seen.scattered[k] += within * scattering;
                left[k] *= passes;
            }
        }
        if ground.is_some() {
            let place = DVec3::new(0.0, r, 0.0) + way * length;
            let sun_cos = place.dot(sun) / place.length();
            let sunlight = self.transmittance(GROUND, sun_cos);
            for k in 0..3 {
                seen.light[k] += left[k] * sunlight[k] * sun_cos.max(0.0) * GROUND_ALBEDO / PI;
            }
        }
        seen
    }

    /// Radiance from all directions, row by row from the zenith, with the sun's azimuth in the middle; without the sun.
    pub(super) fn panorama(&self, elevation: f64) -> Vec<[f32; 3]> {
        let [width, height] = SIZE;
        let sun = DVec3::new(0.0, libm::sin(elevation), -libm::cos(elevation));
        let row = |row: usize| {
            let polar = PI * (row as f64 + 0.5) / height as f64;
            // The sky is symmetric about the sun's azimuth.
            let half = (0..width / 2).map(|column| {
                let turn = PI * (1.0 - (column as f64 + 0.5) / (width / 2) as f64);
                let level = libm::sin(polar);
                let way = DVec3::new(libm::sin(turn) * level, libm::cos(polar), -libm::cos(turn) * level);
                let light = self.seen(GROUND + EYE, way, sun, Phase::Own).light;
                light.map(|c| (c * SOLAR) as f32)
            });
            let half: Vec<[f32; 3]> = half.collect();
            half.iter().chain(half.iter().rev()).copied().collect::<Vec<_>>()
        };
        (0..height).into_par_iter().flat_map_iter(row).collect()
    }
}

/// Light that arrives along a line of sight.
struct SightLight {
    light: SkyColor,
    /// The part of isotropic light of radiance 1 along it that would be scattered towards the eye.
    scattered: SkyColor,
}

/// A phase function.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    /// Isotropic.
    Even,
    /// Those of molecules and haze.
    Own,
}

impl Phase {
    /// The values for molecules and for haze (Cornette and Shanks 1992).
    fn values(self, cos: f64) -> [f64; 2] {
        if self == Phase::Even {
            return [0.25 / PI; 2];
        }
        let g = HAZE_ANISOTROPY;
        let away = 1.0 + g * g - 2.0 * g * cos;
        let haze =
            3.0 / (8.0 * PI) * (1.0 - g * g) * (1.0 + cos * cos) / ((2.0 + g * g) * away * away.sqrt());
        [3.0 / (16.0 * PI) * (1.0 + cos * cos), haze]
    }
}

fn part(i: usize, count: usize) -> f64 {
    i as f64 / (count - 1) as f64
}

/// The part of the sun's disc above the horizon, and the cosine to the zenith, clamped to the horizon.
fn part_of_sun(r: f64, mu: f64) -> (f64, f64) {
    let horizon = -(1.0 - (GROUND / r) * (GROUND / r)).max(0.0).sqrt();
    let half = f64::from(Light::SUN_ANGLE) / 2.0;
    (((mu - horizon) / half * 0.5 + 0.5).clamp(0.0, 1.0), mu.max(horizon))
}

/// The cosine of the sun's zenith angle in a column of the table; columns are closer together about the horizon.
fn sun_cosine(part: f64) -> f64 {
    let odd = 2.0 * part - 1.0;
    odd * odd.abs()
}

fn height_at(r: f64, mu: f64, t: f64) -> f64 {
    (r * r + t * t + 2.0 * r * mu * t).sqrt() - GROUND
}

fn to_top(r: f64, mu: f64) -> f64 {
    -r * mu + (r * r * (mu * mu - 1.0) + TOP * TOP).max(0.0).sqrt()
}

fn to_ground(r: f64, mu: f64) -> Option<f64> {
    let root = r * r * (mu * mu - 1.0) + GROUND * GROUND;
    (mu < 0.0 && root >= 0.0).then(|| (-r * mu - root.sqrt()).max(0.0))
}

/// The distance from a place on the ground to the top along the horizon.
fn horizon() -> f64 {
    (TOP * TOP - GROUND * GROUND).sqrt()
}

/// Distance from the middle of the earth and cosine to the zenith, by two numbers from 0 to 1; closer together where
/// the air is dense and about the horizon (Bruneton and Neyret 2008).
fn place_of(x: f64, y: f64) -> (f64, f64) {
    let rho = horizon() * x;
    let r = (rho * rho + GROUND * GROUND).sqrt();
    let (least, most) = (TOP - r, rho + horizon());
    let distance = least + y * (most - least);
    let mu = if distance <= 0.0 {
        1.0
    } else {
        (horizon() * horizon() - rho * rho - distance * distance) / (2.0 * r * distance)
    };
    (r, mu.clamp(-1.0, 1.0))
}

/// The inverse of [`place_of`].
fn coordinates_of(r: f64, mu: f64) -> (f64, f64) {
    let rho = (r * r - GROUND * GROUND).max(0.0).sqrt();
    let (least, most) = (TOP - r, rho + horizon());
    (rho / horizon(), (to_top(r, mu) - least) / (most - least))
}

/// Interpolates between the entries of a table.
fn between(table: &[SkyColor], [rows, columns]: [usize; 2], x: f64, y: f64) -> SkyColor {
    let place = |part: f64, count: usize| {
        let at = part.clamp(0.0, 1.0) * (count - 1) as f64;
        let low = (at as usize).min(count - 2);
        (low, at - low as f64)
    };
    let ((row, down), (column, across)) = (place(x, rows), place(y, columns));
    let first = row * columns + column;
    std::array::from_fn(|k| {
        let line = |first: usize| table[first][k] * (1.0 - across) + table[first + 1][k] * across;
        line(first) * (1.0 - down) + line(first + columns) * down
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transmittance_to_the_zenith_is_that_of_the_vertical_columns() {
        let found = Air::sun(1.0, PI / 2.0);
        for (k, found) in found.into_iter().enumerate() {
            // ∫ of each component's density over the height; for ozone's tent, half its width.
            let column = |scale: f64| scale * (libm::exp(-EYE / scale) - libm::exp(-(TOP - GROUND) / scale));
            let depth = RAYLEIGH.0[k] * column(RAYLEIGH.1)
                + (HAZE.0[0] + HAZE.0[1]) * column(HAZE.1)
                + OZONE.0[k] * OZONE.2;
            let expected = SOLAR * libm::exp(-depth);
            assert!((found / expected - 1.0).abs() < 2e-3, "{k}: {found} {expected}");
        }
    }

    /// Irradiance on the ground: all of it, and the sky's part.
    fn ground(haze: f32, elevation: f64) -> [SkyColor; 2] {
        let mut sky = [0.0; 3];
        let texels = Air::new(haze).panorama(elevation);
        let [width, height] = SIZE;
        for (row, texels) in texels.chunks(width).take(height / 2).enumerate() {
            let polar = PI * (row as f64 + 0.5) / height as f64;
            let weight = libm::sin(polar) * libm::cos(polar) * 2.0 * PI * PI / (width * height) as f64;
            for texel in texels {
                (0..3).for_each(|k| sky[k] += f64::from(texel[k]) * weight);
            }
        }
        let sun = Air::sun(haze, elevation).map(|c| c * libm::sin(elevation).max(0.0));
        [std::array::from_fn(|k| sun[k] + sky[k]), sky]
    }

    #[test]
    fn sky_brightness_and_colour_are_within_measured_ranges() {
        let [all, sky] = ground(1.0, 60f64.to_radians());
        let share = sky[1] / all[1];
        assert!((0.08..0.2).contains(&share), "diffuse share at noon {share}");
        assert!(sky[2] > 1.7 * sky[0], "{sky:?}");
        // A white surface in the sun.
        assert!((0.8..1.1).contains(&(all[1] / PI)), "{all:?}");
        let [all, sky] = ground(1.0, 5f64.to_radians());
        assert!(sky[1] / all[1] > 0.4, "{all:?} {sky:?}");
        let sun = Air::sun(1.0, 2f64.to_radians());
        assert!(sun[0] > 2.0 * sun[1] && sun[1] > 5.0 * sun[2], "the low sun is red: {sun:?}");
        let [_, night] = ground(1.0, -18f64.to_radians());
        assert!(night[1] < 1e-4 * SOLAR, "{night:?}");
        // Haze scatters more about the sun.
        let hazy = ground(6.0, 60f64.to_radians());
        let clear = ground(1.0, 60f64.to_radians());
        assert!(hazy[1][1] > 1.5 * clear[1][1] && hazy[0][1] < clear[0][1], "{hazy:?} {clear:?}");
    }

    #[test]
    fn table_coordinates_round_trip() {
        for (x, y) in [(0.0, 0.3), (0.2, 0.0), (0.5, 0.5), (0.9, 1.0), (1.0, 0.7)] {
            let (r, mu) = place_of(x, y);
            let (a, b) = coordinates_of(r, mu);
            assert!((a - x).abs() < 1e-6 && (b - y).abs() < 1e-3, "{x} {y}: {a} {b}");
        }
    }
}
