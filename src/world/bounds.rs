//! Range checks of the numbers in worlds built by programs and in film records. Readers of scene files produce only
//! numbers that pass.

use crate::math::Rgb;

/// Checks that a number or an angle is within a range, up to rounding.
pub(crate) fn within(what: &str, value: f32, least: f32, most: f32) -> Result<(), String> {
    let slack = 1e-6 * most.abs().min(1e6);
    if least - slack <= value && value <= most + slack {
        return Ok(());
    }
    match (least, most) {
        (0.0, f32::MAX) => Err(format!("{what} is {value}: it must be at least 0, and finite")),
        (_, f32::MAX) => Err(format!("{what} is {value}: it must be finite")),
        _ => Err(format!("{what} is {value}: it must be {least} to {most}")),
    }
}

/// Checks that a number is above a limit, and finite.
pub(crate) fn above(what: &str, value: f32, limit: f32) -> Result<(), String> {
    if value > limit && value.is_finite() {
        return Ok(());
    }
    Err(format!("{what} is {value}: it must be above {limit}, and finite"))
}

/// Checks that all components of a colour are at least 0, and finite.
pub(crate) fn check_color(what: &str, color: Rgb) -> Result<(), String> {
    let is_light = |part: &f32| *part >= 0.0 && part.is_finite();
    if color.to_array().iter().all(is_light) {
        return Ok(());
    }
    Err(format!("{what} is {:?}: it must be nowhere below 0, and finite", color.to_array()))
}
