//! Automatic exposure.

use crate::math::Rgb;
use crate::world::Settings;

/// The target for the log-average of luminance: the reflectance of a grey card.
const MIDDLE_GREY: f64 = 0.18;
/// One in this many lit pixels is ignored at the dark end, and as many at the bright end.
const TAIL: usize = 10;
/// The limit in stops, as for a fixed exposure.
const MOST_EV: f64 = 64.0;

/// Returns the exposure in stops that brings the log-average of luminance to 0.18 (Reinhard and others 2002, equation 1
/// with their key of a normal scene), rounded to hundredths so that the printed value can be passed on.
///
/// The eye perceives ratios of light, hence logarithms. Black pixels do not count; nor do the darkest tenth of the
/// others, which are corners, and the brightest tenth, which are lights and highlights. An image that is all black gets
/// 0.
pub fn automatic_ev(pixels: &[Rgb]) -> f32 {
    let lit = pixels.iter().map(|pixel| pixel.luminance());
    let mut lit: Vec<f32> = lit.filter(|luminance| *luminance > 0.0 && luminance.is_finite()).collect();
    lit.sort_unstable_by(f32::total_cmp);
    let tail = lit.len() / TAIL;
    let middle = &lit[tail..lit.len() - tail];
    if middle.is_empty() {
        return 0.0;
    }
    let sum: f64 = middle.iter().map(|luminance| libm::log2(f64::from(*luminance))).sum();
    let ev = libm::log2(MIDDLE_GREY) - sum / middle.len() as f64;
    // A negative zero would be printed with its sign.
    (libm::round(ev * 100.0) / 100.0).clamp(-MOST_EV, MOST_EV) as f32 + 0.0
}

/// Returns the exposure of an image in stops: that of the settings, plus the automatic one if they enable it.
pub fn exposure_ev(settings: &Settings, radiance: &[Rgb]) -> f32 {
    let own_ev = if settings.auto_exposure { automatic_ev(radiance) } else { 0.0 };
    own_ev + settings.exposure_ev
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_image_is_exposed_to_middle_grey() {
        for (light, ev) in [(0.18, 0.0), (0.36, -1.0), (0.045, 2.0), (18_000.0, -16.61), (1e-30, 64.0)] {
            assert_eq!(automatic_ev(&[Rgb::splat(light); 7]), ev, "{light}");
        }
        assert_eq!(automatic_ev(&[]), 0.0);
        assert_eq!(automatic_ev(&[Rgb::BLACK; 5]), 0.0);
    }

    #[test]
    fn automatic_exposure_ignores_black_extremes_and_order() {
        let mut image = vec![Rgb::splat(0.09); 40];
        image.extend([Rgb::splat(0.36); 40]);
        assert_eq!(automatic_ev(&image), 0.0, "the geometric mean is 0.18");
        image.extend([Rgb::splat(1e5); 8]);
        image.extend([Rgb::splat(1e-5); 8]);
        image.extend([Rgb::BLACK; 500]);
        image.push(Rgb::splat(f32::NAN));
        assert_eq!(automatic_ev(&image), 0.0);
        image.reverse();
        assert_eq!(automatic_ev(&image), 0.0);
    }

    #[test]
    fn automatic_exposure_uses_luminance_of_colours() {
        assert_eq!(automatic_ev(&[Rgb::new(0.0, 0.18 / 0.7152, 0.0)]), 0.0);
    }
}
