//! The parsers of option values.

use super::options::Exposure;
use crate::film::Region;
use crate::formats::LightUnits;
use crate::formats::film_file::RenderedView;
use crate::simd::Isa;
use crate::world::{Adaptive, Caustics, Settings, Sharing};

pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X', '×']);
    let side = |s: &str| s.trim().parse().ok().filter(|n| (1..=Settings::MOST_PIXELS_A_SIDE).contains(n));
    parts
        .and_then(|(w, h)| Some([side(w)?, side(h)?]))
        .ok_or_else(|| "expected width x height, each 1 to 65536, such as 1280x720".into())
}

pub fn parse_crop(text: &str) -> Result<Region, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Region { x0, y0, x1, y1 }),
        _ => Err("expected X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1, such as 100,50,200,150".into()),
    }
}

pub fn parse_samples(text: &str) -> Result<[u32; 2], String> {
    let range = text.split_once("..").and_then(|(start, end)| Some([start.parse().ok()?, end.parse().ok()?]));
    range.filter(|[start, end]| start < end).ok_or_else(|| "expected FIRST..END, such as 0..16".into())
}

/// Checks that the text is a point, and returns it as text, the form that scene files take.
pub fn parse_place(text: &str) -> Result<String, String> {
    let is_number = |text: &str| text.trim().parse().is_ok_and(f64::is_finite);
    let is_place = text.split(',').count() == 3 && text.split(',').all(is_number);
    is_place
        .then(|| text.to_owned())
        .ok_or_else(|| "expected two places, each as X,Y,Z in metres, such as --look-at 0,1,4 0,0,0".into())
}

pub fn parse_degrees(text: &str) -> Result<[f64; 2], String> {
    let number = |text: &str| {
        text.trim().parse().ok().filter(|degrees: &f64| degrees.abs() <= RenderedView::MOST_DEGREES)
    };
    let both = text.split_once(',').and_then(|(right, up)| Some([number(right)?, number(up)?]));
    both.or_else(|| Some([number(text)?, 0.0]))
        .ok_or_else(|| "expected degrees to the right and up, such as 30,15".into())
}

pub fn parse_zoom(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor: &f64| (1e-3..=1e3).contains(factor));
    factor.ok_or_else(|| "expected a factor from 0.001 to 1000: 2 is twice as near".into())
}

pub fn parse_exposure(text: &str) -> Result<f32, String> {
    let stops = text.parse().ok().filter(|s: &f32| s.is_finite() && s.abs() <= 64.0);
    stops.ok_or_else(|| "expected a number of stops from -64 to 64".into())
}

pub fn parse_exposure_or_auto(text: &str) -> Result<Exposure, String> {
    if text.eq_ignore_ascii_case("auto") {
        return Ok(Exposure::Auto);
    }
    parse_exposure(text).map(Exposure::Stops).map_err(|reason| format!("{reason}, or auto"))
}

pub fn parse_sharing(text: &str) -> Result<Sharing, String> {
    match text {
        "auto" => Ok(Sharing::Auto),
        "off" => Ok(Sharing::Off),
        _ => {
            let pixels = text.parse().ok().filter(|pixels| Sharing::SIZES.contains(pixels));
            pixels.map(Sharing::Groups).ok_or_else(|| "expected auto, off, 2, 4, 8, 16, 32 or 64".into())
        }
    }
}

pub fn parse_caustics(text: &str) -> Result<Caustics, String> {
    let number = |text: &str, most: f32| text.parse().ok().filter(|number| *number > 0.0 && *number <= most);
    let (photons, radius) =
        text.split_once(',').map_or((text, None), |(photons, radius)| (photons, Some(radius)));
    match text {
        "auto" => return Ok(Caustics::Auto),
        "off" => return Ok(Caustics::Off),
        _ => {}
    }
    let photons = number(photons, Caustics::MOST_PHOTONS);
    let radius = radius.map_or(Some(Caustics::RADIUS), |radius| number(radius, Caustics::LARGEST_RADIUS));
    let radius = radius.filter(|radius| *radius >= Caustics::LEAST_RADIUS);
    photons.zip(radius).map(|(photons, radius)| Caustics::Photons { photons, radius }).ok_or_else(|| {
        "expected auto, off, or photons for each pixel above 0, at most 64, and perhaps a radius from 0.01 to 64, as in 2,1.4".into()
    })
}

pub fn parse_adaptive(text: &str) -> Result<Adaptive, String> {
    match text {
        "on" => Ok(Adaptive::On),
        "off" => Ok(Adaptive::Off),
        "unbiased" => Ok(Adaptive::Unbiased),
        _ => Err("expected on, off or unbiased".into()),
    }
}

pub fn parse_time(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s: &f32| s.is_finite());
    seconds.ok_or_else(|| "expected a number of seconds, such as 1.5".into())
}

pub fn parse_light_units(text: &str) -> Result<LightUnits, String> {
    match text {
        "auto" => Ok(LightUnits::Auto),
        "candela" => Ok(LightUnits::Candela),
        "watt" => Ok(LightUnits::Watt),
        _ => Err("expected auto, candela or watt".into()),
    }
}

pub fn parse_bits(text: &str) -> Result<u8, String> {
    text.parse().ok().filter(|b| [8, 16].contains(b)).ok_or_else(|| "expected 8 or 16".into())
}

pub fn parse_level(text: &str) -> Result<Isa, String> {
    Isa::from_name(text).ok_or_else(|| {
        let names: Vec<_> = Isa::available().into_iter().map(Isa::name).collect();
        format!("this processor has: {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parsers_reject_invalid_values() {
        assert_eq!(parse_size("1280x720"), Ok([1280, 720]));
        assert!(parse_size("0x5").is_err() && parse_size("70000x5").is_err() && parse_size("12").is_err());
        assert!(parse_crop("1,2,3,4").is_ok());
        assert!(parse_crop("3,2,3,4").is_err() && parse_crop("1,2,3").is_err());
        assert_eq!(parse_exposure_or_auto("auto"), Ok(Exposure::Auto));
        assert_eq!(parse_exposure_or_auto("-2"), Ok(Exposure::Stops(-2.0)));
        assert!(parse_exposure_or_auto("automatic").is_err_and(|reason| reason.ends_with(", or auto")));
        assert!(
            parse_place("0,-1,2.5").is_ok() && parse_place("0,1").is_err() && parse_place("a,0,1").is_err()
        );
        assert!(parse_exposure("nan").is_err() && parse_exposure("-1.5") == Ok(-1.5));
    }
}
