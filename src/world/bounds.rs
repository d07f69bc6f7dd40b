//! Range checks of the numbers in worlds built by programs and in film records. Readers of scene files produce only
//! numbers that pass.

use super::fields::{Field, Fields, Forms, Range, Slot, visit_all};
use super::material::ColorInput;
use super::settings::{Background, Backplate, Caustics, Settings, Sharing};
use crate::math::Rgb;

/// Checks that a number or an angle is within a range, up to rounding.
pub(crate) fn within(what: &str, value: f32, least: f32, most: f32) -> Result<(), String> {
    let slack = if most == f32::MAX { 0.0 } else { 1e-6 * most.abs().min(1e6) };
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

/// Errors: the first number of a structure that is out of its range. Colours of a program may be above 1.
pub(crate) fn check(part: &mut dyn Fields) -> Result<(), String> {
    let mut result = Ok(());
    visit_all(part, &mut |field| {
        if result.is_ok() {
            result = check_field(field);
        }
    });
    result
}

/// Checks a form like [`check`].
pub(crate) fn check_form(form: &mut dyn Forms) -> Result<(), String> {
    form.fields().into_iter().try_for_each(check_field)
}

/// Checks the stops of a ramp; the error is the number of the wrong one, and the reason.
pub(crate) fn check_stops(stops: &[(f32, Rgb)]) -> Result<(), (usize, String)> {
    let mut last = 0.0;
    for (number, (at, color)) in stops.iter().enumerate() {
        if !(last..=1.0).contains(at) {
            let reason = "stops must be in order, from 0 to 1".to_owned();
            return Err((number, format!("{reason}: {at} comes after {last}")));
        }
        check_color("the colour of a stop", *color).map_err(|reason| (number, reason))?;
        last = *at;
    }
    Ok(())
}

fn check_field(Field { name, slot, .. }: Field) -> Result<(), String> {
    match slot {
        // A distance that a scene file leaves out.
        Slot::Number(value, Range::Distance) if *value == f32::INFINITY => {}
        Slot::Number(value, range) | Slot::OptionalNumber(Some(value), range) => {
            number(name, *value, range)?;
        }
        // Degrees of a large number of radians may be infinite.
        Slot::Azimuth(angle) | Slot::Degrees(angle, Range::Finite) => number(name, *angle, Range::Finite)?,
        Slot::Degrees(angle, range) => number(name, angle.to_degrees(), range)?,
        Slot::Sides(size) => {
            above("its width", size.x, 0.0)?;
            above("its height", size.y, 0.0)?;
        }
        Slot::Vector(vector, _) => finite(name, vector.is_finite())?,
        Slot::Stops(stops) => check_stops(stops).map_err(|(_, reason)| format!("{name}: {reason}"))?,
        Slot::Extents(size) => {
            size.to_array().into_iter().try_for_each(|side| above(name, side, 0.0))?;
        }
        Slot::Pairs(points) => finite(name, points.iter().all(|point| point.is_finite()))?,
        Slot::PairLists(lists) => finite(name, lists.iter().flatten().all(|point| point.is_finite()))?,
        Slot::Path(points) => finite(name, points.iter().all(|point| point.is_finite()))?,
        Slot::Numbers(values, range) => {
            values.iter().try_for_each(|value| number(name, *value, range))?;
        }
        Slot::Pair(pair, range) => {
            number(name, pair.x, range)?;
            number(name, pair.y, range)?;
        }
        Slot::Color(color, _) | Slot::ColorMap(ColorInput::Constant(color), _) => {
            check_color(name, *color)?;
        }
        Slot::NumberMap(input, _) => within(name, input.factor, 0.0, 1.0)?,
        Slot::Whole(value, least, most) => whole(name, *value, least, most)?,
        Slot::OptionalWhole(Some(value), least, most) => whole(name, *value, least, most)?,
        Slot::Size(size) => {
            for (name, value) in ["width", "height"].into_iter().zip(size) {
                whole(name, *value, 1, Settings::MOST_PIXELS_A_SIDE)?;
            }
        }
        Slot::Sharing(Sharing::Groups(pixels)) if !Sharing::SIZES.contains(pixels) => {
            return Err(format!("{name} is {pixels}: it must be one of {:?}", Sharing::SIZES));
        }
        Slot::Caustics(Caustics::Photons { photons, radius }) => {
            number("the photons of caustics", *photons, Caustics::PHOTON_RANGE)?;
            number("the radius of caustics", *radius, Caustics::RADIUS_RANGE)?;
        }
        Slot::Background(Background::Constant(color))
        | Slot::OptionalBackground(Some(Background::Constant(color))) => check_color(name, *color)?,
        Slot::Background(Background::Gradient { bottom, top })
        | Slot::OptionalBackground(Some(Background::Gradient { bottom, top })) => {
            check_color(name, *bottom)?;
            check_color(name, *top)?;
        }
        Slot::Backplate(Some(Backplate::Constant(color))) => on_screen(name, *color)?,
        Slot::Backplate(Some(Backplate::Gradient { bottom, top })) => {
            on_screen(name, *bottom)?;
            on_screen(name, *top)?;
        }
        Slot::Triangle(corners) => finite("its corners", corners.iter().all(|corner| corner.is_finite()))?,
        Slot::Quadrilateral(corners) => {
            finite("its corners", corners.iter().all(|corner| corner.is_finite()))?;
        }
        Slot::CornerVectors(Some(vectors)) => {
            finite("its normals", vectors.iter().all(|vector| vector.is_finite()))?;
        }
        Slot::CornerUvs(Some(uvs)) => {
            finite("its texture coordinates", uvs.iter().all(|uv| uv.is_finite()))?;
        }
        Slot::Form(form) => {
            let kind = form.kind();
            check_form(form).map_err(|reason| format!("the {kind}'s {reason}"))?;
        }
        Slot::Part(part) => check(part)?,
        Slot::OptionalPart(part) => part.part().map_or(Ok(()), check)?,
        _ => {}
    }
    Ok(())
}

/// Checks a colour of a screen.
fn on_screen(name: &str, color: Rgb) -> Result<(), String> {
    color.to_array().into_iter().try_for_each(|part| within(name, part, 0.0, 1.0))
}

fn finite(what: &str, is_finite: bool) -> Result<(), String> {
    is_finite.then_some(()).ok_or_else(|| format!("{what} must be finite"))
}

fn number(name: &str, value: f32, range: Range) -> Result<(), String> {
    match range {
        Range::Finite => within(name, value, -f32::MAX, f32::MAX),
        Range::Above0 | Range::Distance => above(name, value, 0.0),
        Range::From(least) => within(name, value, least, f32::MAX),
        Range::Light(_) => within(name, value, 0.0, f32::MAX),
        Range::FromTo(least, most) => within(name, value, least, most),
        Range::UpTo(_) | Range::Between(..) if range.contains(value) => Ok(()),
        Range::UpTo(_) | Range::Between(..) => Err(format!("{name} is {value}: it must be {range}")),
    }
}

fn whole(name: &str, value: u32, least: u32, most: u32) -> Result<(), String> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(format!("{name} is {value}: it must be {least} to {most}"))
}
