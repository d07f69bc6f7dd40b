//! Checks that a finished image is neither mostly white nor mostly black.

use std::sync::Arc;

use super::finding;
use crate::error::Diagnostic;
use crate::film::exposure::{LightMeter, exposure_ev};
use crate::film::tonemap::DisplayTransform;
use crate::film::{Film, Region};
use crate::integrator::RenderSetup;
use crate::math::Rgb;
use crate::render::{Options, Session};
use crate::world::{Settings, Tonemap};

/// The fraction of visible surfaces that may be white or black without a finding.
const TOO_MUCH: f64 = 0.5;
/// Surfaces with an albedo below this are meant to be dark.
const DARKEST: f32 = 0.02;
/// The difference to the suggested exposure, in stops, that is worth mentioning.
const WORTH: f32 = 1.0;

/// The fraction of visible surfaces that may be nearly black, too, and the brightest byte that is: 4 stops below grey.
const NEARLY_ALL: f64 = 0.9;
const NEARLY_BLACK: u8 = 24;

/// Pixels along the longer side of the image that are tested for visible surfaces.
const LOOKED_AT: u32 = 128;

/// A finished image.
pub struct FinishedImage<'a> {
    /// Its samples.
    pub film: &'a Film,
    /// The tone mapping.
    pub tonemap: Tonemap,
    /// The exposure, in stops.
    pub exposure_ev: f32,
}

impl<'a> FinishedImage<'a> {
    /// Creates an image with the exposure of the settings.
    pub fn new(settings: &Settings, film: &'a Film) -> Self {
        Self { film, tonemap: settings.tonemap, exposure_ev: exposure_ev(settings, film) }
    }
}

/// Checks a finished image. `told` is true if findings about the scene have already been reported.
pub fn of_image(setup: &RenderSetup, image: &FinishedImage, told: bool) -> Option<Diagnostic> {
    let FinishedImage { film, tonemap, exposure_ev } = *image;
    let radiance = film.own_radiance();
    let seen = seen(setup, film, &radiance);
    if seen.is_empty() {
        return None;
    }
    let curve = DisplayTransform::new(tonemap, exposure_ev, &radiance);
    let shown: Vec<[u8; 3]> = seen.iter().map(|light| curve.apply_8_bit(*light)).collect();
    let part = |is: fn(&u8) -> bool| {
        shown.iter().filter(|pixel| pixel.iter().all(is)).count() as f64 / shown.len() as f64
    };
    let (white, black) = (part(|byte| *byte >= 254), part(|byte| *byte <= 1));
    let nearly_black = part(|byte| *byte <= NEARLY_BLACK);
    if white.max(black) <= TOO_MUCH && nearly_black <= NEARLY_ALL {
        return None;
    }
    let better = LightMeter::of_film(film).automatic_ev();
    let stops = better - exposure_ev;
    if white > TOO_MUCH && stops < -WORTH {
        let white = percent(white);
        let what = format!(
            "{white} % of what is seen is white: there is more light than exposure {exposure_ev:+.2} can show"
        );
        return Some(finding("overexposed", None, what, format!("`--exposure auto` would be {better:+.2}")));
    }
    if black > TOO_MUCH {
        let unlit = seen.iter().filter(|light| light.is_black()).count() as f64 / seen.len() as f64;
        if unlit > TOO_MUCH {
            let what = format!("no light gets to {} % of what is seen", percent(unlit));
            let remedy = match told {
                true => "the warnings before this one may say why",
                false => {
                    "`rayfront view`, and a click on a pixel, shows where its light ends; `--env studio` lights everything"
                }
            };
            return Some(finding("no-light-arrives", None, what, remedy));
        }
    }
    if stops > WORTH && (black > TOO_MUCH || nearly_black > NEARLY_ALL) {
        let black = match black > TOO_MUCH {
            true => format!("{} % of what is seen is", percent(black)),
            false => format!("{} % of what is seen is nearly", percent(nearly_black)),
        };
        let what = format!("{black} black: there is too little light for exposure {exposure_ev:+.2}");
        return Some(finding("underexposed", None, what, format!("`--exposure auto` would be {better:+.2}")));
    }
    None
}

/// Converts a fraction to a whole percentage; only 1 gives 100.
fn percent(part: f64) -> f64 {
    if part < 1.0 { (100.0 * part).round().min(99.0) } else { 100.0 }
}

/// Returns the radiance of a sparse grid of pixels that show a surface on which light falls, and not only its shadows.
fn seen(setup: &RenderSetup, film: &Film, radiance: &[Rgb]) -> Vec<Rgb> {
    let (region, [width, height]) = (film.region(), setup.size);
    let by = width.max(height).div_ceil(LOOKED_AT).max(1);
    let small = setup.small(LOOKED_AT);
    let size = small.size;
    let options = Options { region: Some(Region::whole(size)), ..Options::default() };
    let features = Session::of(Arc::new(small), 1, options).features();
    let (scene, mut seen) = (&setup.scene, Vec::new());
    for (at, features) in features.iter().enumerate() {
        let [x, y] = [at as u32 % size[0], at as u32 / size[0]].map(|place| place * by + by / 2);
        let is_inside = (region.x0..region.x1).contains(&x) && (region.y0..region.y1).contains(&y);
        let material = features.material.checked_sub(1).and_then(|id| scene.materials.get(id as usize));
        // The author chose the colours of unlit surfaces, white among them.
        let is_lit = material.is_none_or(|material| !material.unlit);
        let is_thing = || film.coverage_of(region.index(x, y)) > 0.5;
        // Black surfaces stay black under any light.
        if is_inside
            && is_lit
            && is_thing()
            && features.coverage > 0.5
            && features.albedo.max_component() > DARKEST
        {
            seen.extend(radiance.get(region.index(x, y)));
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::percent;

    #[test]
    fn percent_of_nearly_all_is_99() {
        assert_eq!([0.504, 0.996, 0.999_999, 1.0].map(percent), [50.0, 99.0, 99.0, 100.0]);
    }
}
