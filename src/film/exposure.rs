//! Automatic exposure.

use super::Film;
use crate::math::Rgb;
use crate::world::Settings;

/// The target for the log-average of luminance: the reflectance of a grey card.
const MIDDLE_GREY: f64 = 0.18;
/// The part of an image that lamps and the sun may cover without being metered.
const LAMPS: f64 = 0.02;
/// One in this many parts of what counts is ignored at the bright end, and as many at the dark end.
const TAIL: f64 = 10.0;
/// Light this much fainter than the average counts half: six stops are about what a screen shows below middle grey.
const FAINT: f64 = 1.0 / 64.0;
/// The cells of a light meter along an image's longer side, at most.
const CELLS: u32 = 96;
/// The reflectance of white paper, which shadow catchers are taken for.
const PAPER: f64 = 0.8;
/// The limit in stops, as for a fixed exposure.
const MOST_EV: f64 = 64.0;

/// An image as a light meter sees it: means over small cells. So noise does not count for more than the light that it
/// is the noise of, and images of all sizes and numbers of samples get nearly one exposure.
#[derive(Clone, Debug)]
pub struct LightMeter {
    cells: Vec<Cell>,
    /// The luminance of shadow catchers without other things.
    catchers: Option<f64>,
}

/// A part of an image.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    /// The sum of its pixels' luminance, associated with their coverage.
    luminance: f64,
    /// The sum of its pixels' coverage.
    coverage: f64,
}

impl LightMeter {
    /// A meter that looks at all pixels of an image, given by their indices, row by row: their radiance, and the part of
    /// them that counts, from 0 to 1, with which the radiance is associated.
    pub fn new([width, height]: [u32; 2], pixel: impl Fn(usize) -> (Rgb, f32)) -> LightMeter {
        let side = width.max(height).div_ceil(CELLS).max(1);
        let columns = width.div_ceil(side) as usize;
        let mut cells = vec![Cell::default(); columns * height.div_ceil(side) as usize];
        for y in 0..height {
            for x in 0..width {
                let (light, coverage) = pixel(y as usize * width as usize + x as usize);
                let luminance = light.luminance();
                if coverage > 0.0 && luminance.is_finite() {
                    let cell = &mut cells[(y / side) as usize * columns + (x / side) as usize];
                    cell.luminance += f64::from(luminance);
                    cell.coverage += f64::from(coverage);
                }
            }
        }
        LightMeter { cells, catchers: None }
    }

    /// A meter that looks at opaque pixels, row by row.
    pub fn of_pixels(size: [u32; 2], pixels: &[Rgb]) -> LightMeter {
        LightMeter::new(size, |index| pixels.get(index).map_or((Rgb::BLACK, 0.0), |light| (*light, 1.0)))
    }

    /// A meter that looks at a film: at the things in it. What shadow catchers and the surroundings of transparent films
    /// show does not count: it is not the picture's own.
    pub fn of_film(film: &Film) -> LightMeter {
        let (region, quantum) = (film.region(), film.unit().quantum());
        let size = [region.width(), region.height()];
        let meter = LightMeter::new(size, |index| (film.shown(index).mean(quantum), film.coverage_of(index)));
        meter.beside_catchers(film)
    }

    /// The meter, held at the shadow catchers of a film, if it has any.
    pub fn beside_catchers(self, film: &Film) -> LightMeter {
        LightMeter { catchers: film.catcher_luminance(), ..self }
    }

    /// Returns the exposure in stops that brings the log-average of luminance to 0.18 (Reinhard and others 2002,
    /// equation 1 with their key of a normal scene), rounded to hundredths so that the printed value can be passed on.
    ///
    /// The eye perceives ratios of light, hence logarithms. Of two lights, the fainter counts less the fainter it is, and
    /// black does not count at all: so what is in the light decides in a scene that is otherwise dark, and an image with
    /// a faint background has the exposure of the same image before black. Ignored are the brightest fiftieth of the
    /// image, for the sake of lamps, and of what counts the darkest tenth, which are corners, and the brightest, which
    /// are highlights. An image that is all black gets 0.
    ///
    /// A shadow catcher is the measure where there is one: the light that arrives, as photographers measure it with a grey
    /// card. It would be shown as white paper, so black things stay black; but no things are brighter than that in the mean,
    /// as they would be if little light arrived at a floor.
    pub fn automatic_ev(&self) -> f32 {
        let to = |target: f64, average: f64| libm::log2(target) - average;
        let ev = match (self.average(), self.catchers) {
            (None, None) => 0.0,
            (Some(things), None) => to(MIDDLE_GREY, things),
            (None, Some(paper)) => to(PAPER, libm::log2(paper)),
            (Some(things), Some(paper)) => to(PAPER, libm::log2(paper).max(things)),
        };
        // A negative zero would be printed with its sign.
        (libm::round(ev * 100.0) / 100.0).clamp(-MOST_EV, MOST_EV) as f32 + 0.0
    }

    /// The logarithm of the mean luminance; none if all is black.
    fn average(&self) -> Option<f64> {
        let mean = |cell: &Cell| cell.luminance / cell.coverage;
        let lit = self.cells.iter().filter(|cell| cell.luminance > 0.0);
        let mut lit: Vec<(f64, f64)> = lit.map(|cell| (libm::log2(mean(cell)), cell.coverage)).collect();
        lit.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let area: f64 = self.cells.iter().map(|cell| cell.coverage).sum();
        let lit_area: f64 = lit.iter().map(|(_, coverage)| coverage).sum();
        let mut lamps = (LAMPS * area).min(lit_area / TAIL);
        for (_, coverage) in lit.iter_mut().rev() {
            let part = coverage.min(lamps);
            (*coverage, lamps) = (*coverage - part, lamps - part);
        }
        let brightest = lit.iter().rfind(|(_, coverage)| *coverage > 0.0);
        let (mut average, _) = *brightest?;
        // From the brightest light down: where two averages agree with themselves, the brighter one is chosen.
        for _ in 0..64 {
            let next = middle_mean(&lit, average);
            let is_found = (next - average).abs() < 1e-6;
            average = next;
            if is_found {
                break;
            }
        }
        Some(average)
    }
}

/// The weighted mean of increasing logarithms of luminance, each with its coverage, without the tails. Weights fall with
/// the square of the luminance where it is far below an average.
fn middle_mean(lit: &[(f64, f64)], average: f64) -> f64 {
    let weight = |(light, coverage): (f64, f64)| {
        let relative = libm::exp2((light - average).min(64.0)) / FAINT;
        coverage * relative * relative / (1.0 + relative * relative)
    };
    let all: f64 = lit.iter().map(|cell| weight(*cell)).sum();
    let (first, last) = (all / TAIL, all - all / TAIL);
    let (mut before, mut sum) = (0.0, 0.0);
    for cell in lit {
        let after = before + weight(*cell);
        sum += cell.0 * (after.min(last) - before.max(first)).max(0.0);
        before = after;
    }
    sum / (last - first)
}

/// Returns the exposure of a film's image in stops: that of the settings, plus the automatic one if they enable it.
pub fn exposure_ev(settings: &Settings, film: &Film) -> f32 {
    let own_ev = if settings.auto_exposure { LightMeter::of_film(film).automatic_ev() } else { 0.0 };
    own_ev + settings.exposure_ev
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ev(pixels: &[Rgb]) -> f32 {
        LightMeter::of_pixels([pixels.len() as u32, 1], pixels).automatic_ev()
    }

    /// Pixels of a square image.
    fn square(side: u32, pixel: impl Fn(u32, u32) -> f32) -> f32 {
        let pixels = (0..side * side).map(|at| Rgb::splat(pixel(at % side, at / side)));
        LightMeter::of_pixels([side; 2], &pixels.collect::<Vec<_>>()).automatic_ev()
    }

    #[test]
    fn constant_image_is_exposed_to_middle_grey() {
        for (light, expected) in [(0.18, 0.0), (0.36, -1.0), (0.045, 2.0), (18_000.0, -16.61), (1e-30, 64.0)]
        {
            assert_eq!(ev(&[Rgb::splat(light); 7]), expected, "{light}");
        }
        assert_eq!(ev(&[]), 0.0);
        assert_eq!(ev(&[Rgb::BLACK; 5]), 0.0);
    }

    #[test]
    fn automatic_exposure_ignores_black_extremes_and_order() {
        let is_near = |is: f32, expected: f32| (is - expected).abs() < 0.03;
        let mut image = vec![Rgb::splat(0.09); 35];
        image.extend([Rgb::splat(0.36); 35]);
        assert!(is_near(ev(&image), 0.0), "the geometric mean is 0.18, not {}", ev(&image));
        image.push(Rgb::splat(1e5));
        image.extend([Rgb::splat(1e-5); 7]);
        image.extend([Rgb::BLACK; 16]);
        image.push(Rgb::splat(f32::NAN));
        let once = ev(&image);
        assert!(is_near(once, 0.0), "{once}");
        image.reverse();
        assert_eq!(ev(&image), once);
    }

    #[test]
    fn what_is_in_the_light_decides_in_a_scene_that_is_otherwise_dark() {
        // A strip of light, a tenth of the image, before black or before light that a screen cannot show beside it.
        let strip = |behind: f32| square(100, |_, y| if y < 10 { 1.0 } else { behind });
        let before_black = strip(0.0);
        assert_eq!(before_black, -2.47);
        for behind in [1e-30, 1e-8, 1e-5, 1e-4] {
            assert!((strip(behind) - before_black).abs() < 0.02, "{behind}: {}", strip(behind));
        }
        // Most of a room is darker than its window, but not black beside it.
        assert!(strip(0.02) > 2.0, "{}", strip(0.02));
    }

    #[test]
    fn noise_does_not_count_for_more_than_its_mean() {
        let quiet = square(384, |_, _| 0.09);
        // One pixel of sixteen has all the light; then some have nearly none of it.
        let noisy = square(384, |x, y| if x % 4 + y % 4 == 0 { 1.44 } else { 0.0 });
        let faint = square(384, |x, y| if x % 4 + y % 4 == 0 { 1.44 } else { 1e-7 });
        assert_eq!([quiet, noisy, faint], [1.0; 3]);
    }

    #[test]
    fn pixels_count_as_far_as_things_cover_them() {
        // A thing of 0.36, its edges, and shadows: nothing but opacity and the residue of rounding.
        let pixel = |index: usize| match index % 10 {
            0..3 => (Rgb::splat(0.36), 1.0),
            3 => (Rgb::splat(0.18), 0.5),
            4 => (Rgb::splat(1e-9), 0.0),
            _ => (Rgb::splat(5.0), 0.0),
        };
        assert_eq!(LightMeter::new([100, 10], pixel).automatic_ev(), -1.0);
    }

    #[test]
    fn shadow_catchers_are_exposed_as_white_paper_unless_things_are_brighter() {
        let with = |things: f32, catchers| {
            let meter = LightMeter::of_pixels([4, 4], &[Rgb::splat(things); 16]);
            LightMeter { catchers, ..meter }.automatic_ev()
        };
        assert_eq!(with(0.02, Some(0.8)), 0.0, "a black thing");
        assert_eq!(with(0.7, Some(0.8)), 0.0, "a white one");
        assert_eq!(with(0.7, Some(0.4)), 0.19, "little light from above");
        assert_eq!(with(0.0, Some(1.6)), -1.0);
        assert_eq!(with(0.36, None), -1.0);
    }

    #[test]
    fn automatic_exposure_uses_luminance_of_colours() {
        assert_eq!(ev(&[Rgb::new(0.0, 0.18 / 0.7152, 0.0)]), 0.0);
    }
}
