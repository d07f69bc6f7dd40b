//! Checks of fields against each other.

use super::{prism, text};
use crate::math::{Vec2, Vec3};
use crate::world::{Assets, Shape, Spline};

/// A value that does not go with another one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShapeFault {
    /// The fields at fault; the first one that the author gave is the place of the fault.
    pub fields: &'static [&'static str],
    /// The number of the item in that field's list, if it is one.
    pub item: Option<usize>,
    /// The fault and what would be right.
    pub reason: String,
}

impl Shape {
    /// Checks fields against each other, each of which is in its range.
    pub(crate) fn check(&self, assets: &Assets) -> Result<(), ShapeFault> {
        let fault =
            |fields: &'static [&'static str], reason: String| Err(ShapeFault { fields, item: None, reason });
        match self {
            Shape::Box { size_m, bevel_m, .. } if 2.0 * bevel_m > size_m.min_element() => {
                let most = 0.5 * size_m.min_element();
                let reason = format!("bevel_m ({bevel_m}) must be at most half of the shortest side: {most}");
                fault(&["bevel_m", "size_m"], reason)
            }
            Shape::Disc { radius_m, inner_radius_m, .. } if inner_radius_m >= radius_m => {
                let reason = format!("inner_radius_m ({inner_radius_m}) must be below radius_m ({radius_m})");
                fault(&["inner_radius_m", "radius_m"], reason)
            }
            Shape::Cone { radius_m, top_radius_m, .. } if *radius_m == 0.0 && *top_radius_m == 0.0 => {
                fault(&["radius_m"], "radius_m or top_radius_m must be above 0".to_owned())
            }
            Shape::Capsule { radius_m, height_m, .. } if 2.0 * radius_m > *height_m => {
                let reason = format!("height_m ({height_m}) must be at least twice radius_m ({radius_m})");
                fault(&["height_m", "radius_m"], reason)
            }
            Shape::Torus { radius_m, tube_radius_m, .. } if tube_radius_m > radius_m => {
                let reason = format!("tube_radius_m ({tube_radius_m}) must be at most radius_m ({radius_m})");
                fault(&["tube_radius_m", "radius_m"], reason)
            }
            Shape::Prism { outline, holes, curve, .. } => check_prism(outline, holes, *curve),
            Shape::Lathe { profile, curve, .. } => {
                let points = || profile.iter().map(|point| point.extend(0.0));
                check_curve("profile", points(), *curve, false)?;
                if let Some(item) = profile.iter().position(|point| point.x < 0.0) {
                    let distance = profile[item].x;
                    let reason = format!("the distance from the axis ({distance}) must be at least 0");
                    return Err(ShapeFault { fields: &["profile"], item: Some(item), reason });
                }
                if profile.iter().all(|point| point.x == 0.0) {
                    return fault(
                        &["profile"],
                        "the profile lies on the axis: give a distance from it".to_owned(),
                    );
                }
                Ok(())
            }
            Shape::Tube { points, radius_m, curve, .. } => {
                check_curve("points", points.iter().copied(), *curve, false)?;
                check_radii(radius_m, points)?;
                if radius_m.iter().all(|radius| *radius == 0.0) {
                    return fault(&["radius_m"], "radius_m must be above 0 somewhere".to_owned());
                }
                Ok(())
            }
            Shape::Metaballs { points, .. } if points.is_empty() => {
                fault(&["points"], "there are no balls: give at least one point".to_owned())
            }
            Shape::Metaballs { points, radius_m, .. } => check_radii(radius_m, points),
            Shape::Text { text, .. } if text.chars().all(char::is_whitespace) => {
                fault(&["text"], "the text is blank".to_owned())
            }
            Shape::Text { depth_m, bevel_m, .. } if 2.0 * bevel_m > *depth_m => {
                let reason = format!("bevel_m ({bevel_m}) must be at most half of depth_m ({depth_m})");
                fault(&["bevel_m", "depth_m"], reason)
            }
            Shape::Text { text, font, .. } => {
                let font = assets.fonts.get(font.0 as usize);
                match font.and_then(|font| text::missing(text, font)) {
                    Some(letter) => fault(
                        &["text"],
                        format!("the font has no {letter:?}: take another font, or leave it out"),
                    ),
                    None => Ok(()),
                }
            }
            Shape::HeightField { image: None, .. } => fault(&["image"], "it needs an image".to_owned()),
            _ => Ok(()),
        }
    }
}

fn check_prism(outline: &[Vec2], holes: &[Vec<Vec2>], curve: Spline) -> Result<(), ShapeFault> {
    check_curve("outline", outline.iter().map(|point| point.extend(0.0)), curve, true)?;
    for (item, hole) in holes.iter().enumerate() {
        check_curve("holes", hole.iter().map(|point| point.extend(0.0)), curve, true)
            .map_err(|fault| ShapeFault { item: Some(item), ..fault })?;
    }
    if prism::is_simple(outline, holes, curve) {
        return Ok(());
    }
    let is_outline = !prism::is_simple(outline, &[], curve);
    let wrong = |hole: &Vec<Vec2>| !prism::is_simple(outline, std::slice::from_ref(hole), curve);
    let item = holes.iter().position(wrong).filter(|_| !is_outline);
    let (fields, reason): (&[&str], _) = match is_outline {
        true => (&["outline"], "the outline crosses itself, or has no area"),
        false => (&["holes"], "holes must be within the outline, and apart from it and from each other"),
    };
    Err(ShapeFault { fields, item, reason: reason.to_owned() })
}

/// Checks that there is a radius for each point, or one for all.
fn check_radii(radii: &[f32], points: &[Vec3]) -> Result<(), ShapeFault> {
    if radii.len() == 1 || radii.len() == points.len() {
        return Ok(());
    }
    let [radii, points] = [radii.len(), points.len()];
    let reason = format!("radius_m has {radii} numbers for {points} points: give one for each, or one");
    Err(ShapeFault { fields: &["radius_m"], item: None, reason })
}

/// Checks the number of a curve's points, and that neighbours differ.
fn check_curve(
    field: &'static str,
    points: impl ExactSizeIterator<Item = Vec3> + Clone,
    curve: Spline,
    closed: bool,
) -> Result<(), ShapeFault> {
    let fields: &'static [&'static str] = match field {
        "outline" => &["outline"],
        "holes" => &["holes"],
        "profile" => &["profile"],
        _ => &["points"],
    };
    let fault = |item: Option<usize>, reason: String| Err(ShapeFault { fields, item, reason });
    let count = points.len();
    // The first point may be repeated at the end.
    let repeated = count > 2 && points.clone().next() == points.clone().last();
    let (least, closed) = if closed { (3, true) } else { (2, repeated) };
    let own = count - usize::from(repeated);
    if own < least {
        return fault(None, format!("{field} has {own} points: give at least {least}"));
    }
    let next = points.clone().skip(1);
    if let Some(index) = points.zip(next).position(|(point, next)| point == next)
        && curve != Spline::Bezier
    {
        return fault(Some(index + 1), "this point is the same as the one before: leave it out".to_owned());
    }
    let spans = own - usize::from(!closed);
    if curve == Spline::Bezier && !spans.is_multiple_of(3) {
        let right = spans.next_multiple_of(3) + usize::from(!closed);
        let reason = format!(
            "a Bezier curve has two points between any two that it passes through: give {right} points, not {own}"
        );
        return fault(None, reason);
    }
    Ok(())
}
