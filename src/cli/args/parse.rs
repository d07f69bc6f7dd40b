//! The parsers of option values.

use std::time::Duration;

use crate::film::Region;
use crate::formats::Edits;
use crate::formats::film_file::RenderedView;
use crate::simd::Isa;
use crate::world::{Caustics, Settings, Sharing};

/// An exposure in stops; `None` is chosen from the image. An alias, because clap would take an option of an option for an
/// optional value.
pub type Exposure = Option<f32>;

/// A time between checkpoints; `None` for no checkpoints.
pub type Interval = Option<Duration>;

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

pub fn parse_variable(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim().to_owned(), value.trim().to_owned()));
    let example = "expected a name and a value as in scene files, such as height=1.2 or 'file=\"oak.png\"'";
    parts.filter(|(name, value)| !name.is_empty() && !value.is_empty()).ok_or_else(|| example.into())
}

pub fn parse_degrees(text: &str) -> Result<[f64; 2], String> {
    let number = |text: &str| {
        text.trim().parse().ok().filter(|degrees: &f64| degrees.abs() <= RenderedView::MOST_DEGREES)
    };
    let both = text.split_once(',').and_then(|(right, up)| Some([number(right)?, number(up)?]));
    both.or_else(|| Some([number(text)?, 0.0]))
        .ok_or_else(|| "expected degrees to the right and up, such as 30,15".into())
}

pub fn parse_turn(text: &str) -> Result<f64, String> {
    let degrees =
        text.trim().parse().ok().filter(|degrees: &f64| degrees.abs() <= RenderedView::MOST_DEGREES);
    degrees.ok_or_else(|| "expected degrees, clockwise seen from above, such as 90".into())
}

pub fn parse_strength(text: &str) -> Result<f32, String> {
    let factor = text.trim().parse().ok().filter(|factor| (0.0..=Edits::MOST_STRENGTH).contains(factor));
    factor.ok_or_else(|| "expected a factor from 0 to 1000000: 2 is twice as bright".into())
}

pub fn parse_roughness(text: &str) -> Result<f32, String> {
    let roughness = text.trim().parse().ok().filter(|roughness| (0.0..=1.0).contains(roughness));
    roughness.ok_or_else(|| "expected a roughness from 0 to 1, such as 0.3".into())
}

pub fn parse_zoom(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor: &f64| (1e-3..=1e3).contains(factor));
    factor.ok_or_else(|| "expected a factor from 0.001 to 1000: 2 is twice as near".into())
}

pub fn parse_fov(text: &str) -> Result<f64, String> {
    let degrees = text.trim().parse().ok().filter(|degrees: &f64| *degrees > 0.0 && *degrees < 180.0);
    degrees.ok_or_else(|| "expected degrees between 0 and 180, such as 40".into())
}

pub fn parse_focal_length(text: &str) -> Result<f64, String> {
    let length = text.trim().parse().ok().filter(|length| Edits::FOCAL_LENGTHS_MM.contains(length));
    length.ok_or_else(|| "expected millimetres from 0.1 to 100000: 50 sees as people do".into())
}

pub fn parse_f_stop(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number| Edits::F_STOPS.contains(number));
    number.ok_or_else(|| "expected an f-number from 0.01 to 1000, such as 2.8".into())
}

pub fn parse_exposure(text: &str) -> Result<f32, String> {
    let stops = text.parse().ok().filter(|s: &f32| s.is_finite() && s.abs() <= 64.0);
    stops.ok_or_else(|| "expected a number of stops from -64 to 64".into())
}

pub fn parse_exposure_or_auto(text: &str) -> Result<Exposure, String> {
    match text.eq_ignore_ascii_case("auto") {
        true => Ok(None),
        false => parse_exposure(text).map(Some).map_err(|reason| format!("{reason}, or auto")),
    }
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

pub fn parse_time(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s: &f32| s.is_finite());
    seconds.ok_or_else(|| "expected a number of seconds, such as 1.5".into())
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

pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let text = text.trim();
    let unit = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(unit);
    let seconds = match unit {
        "ms" => Some(0.001),
        "s" => Some(1.0),
        "m" | "min" => Some(60.0),
        "h" => Some(3600.0),
        "d" => Some(86_400.0),
        _ => None,
    };
    let number = number.trim().parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    let time = number.zip(seconds).and_then(|(number, unit)| Duration::try_from_secs_f64(number * unit).ok());
    time.filter(|time| *time >= Duration::from_millis(1))
        .ok_or_else(|| "expected a time with its unit, such as 500ms, 30s, 10m, 2h or 1d".into())
}

pub fn parse_checkpoint(text: &str) -> Result<Interval, String> {
    match text {
        "off" => Ok(None),
        _ => parse_duration(text).map(Some).map_err(|reason| format!("{reason}, or off")),
    }
}

pub fn parse_until(text: &str) -> Result<f64, String> {
    let number = text.strip_prefix("noise=").map(|rest| match rest.strip_suffix('%') {
        Some(percent) => percent.trim().parse().map(|percent: f64| percent / 100.0),
        None => rest.trim().parse(),
    });
    let number = number.and_then(Result::ok).filter(|noise| *noise > 0.0 && *noise < 1.0);
    number.ok_or_else(|| "expected noise= and a percentage above 0 and below 100, such as noise=1%".into())
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
        assert_eq!(parse_exposure_or_auto("auto"), Ok(None));
        assert_eq!(parse_exposure_or_auto("-2"), Ok(Some(-2.0)));
        assert!(parse_exposure_or_auto("automatic").is_err_and(|reason| reason.ends_with(", or auto")));
        assert!(
            parse_place("0,-1,2.5").is_ok() && parse_place("0,1").is_err() && parse_place("a,0,1").is_err()
        );
        assert!(parse_exposure("nan").is_err() && parse_exposure("-1.5") == Ok(-1.5));
    }

    #[test]
    fn durations_need_units() {
        assert_eq!(parse_duration("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_duration("1.5h"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse_duration("250 ms"), Ok(Duration::from_millis(250)));
        for wrong in ["", "5", "s", "-1s", "nan s", "1y", "1e999d", "0s", "0.1ms"] {
            assert!(parse_duration(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_checkpoint("off"), Ok(None));
        assert!(parse_checkpoint("never").is_err_and(|reason| reason.ends_with("or off")));
    }

    #[test]
    fn noise_limits_are_percentages_or_fractions() {
        assert_eq!(parse_until("noise=1%"), Ok(0.01));
        assert_eq!(parse_until("noise=0.25"), Ok(0.25));
        for wrong in ["1%", "noise=", "noise=0", "noise=100%", "noise=nan%", "time=3s"] {
            assert!(parse_until(wrong).is_err(), "{wrong}");
        }
    }
}
