//! Polygons and closed curves with a height.

use super::curves::{CurvePoint, sample};
use super::extrude::{Area, SectionLine, extrude, triangles, twice_area};
use super::{Fineness, distinct};
use crate::error::CompileError;
use crate::math::{DVec2, DVec3, Vec2};
use crate::world::{Mesh, Spline};

/// The parts of a closed curve of points (x, z), counter-clockwise seen from above, or clockwise for a hole.
fn parts(
    points: &[Vec2],
    is_hole: bool,
    (curve, segments, fineness): (Spline, Option<u32>, Fineness),
) -> Vec<Vec<CurvePoint>> {
    // Seen from above, z goes down.
    let points: Vec<(DVec3, f64)> =
        points.iter().map(|p| (DVec3::new(p.x.into(), -f64::from(p.y), 0.0), 0.0)).collect();
    let (mut points, _) = distinct(points);
    let parts = sample(&points, curve, true, segments, fineness);
    let area = twice_area(parts.iter().flatten().map(|point| point.at.truncate()));
    if (area < 0.0) == is_hole {
        return parts;
    }
    // Of a Bézier curve, the first point stays one that is passed through.
    points[1..].reverse();
    sample(&points, curve, true, segments, fineness)
}

fn area(outline: &[Vec2], holes: &[Vec<Vec2>], how: (Spline, Option<u32>, Fineness)) -> Area {
    let all = std::iter::once(parts(outline, false, how));
    Area { regions: vec![all.chain(holes.iter().map(|hole| parts(hole, true, how))).collect()] }
}

/// True if an outline and its holes can be told from the outside: no edges cross.
pub(super) fn is_simple(outline: &[Vec2], holes: &[Vec<Vec2>], curve: Spline) -> bool {
    let Area { regions } = area(outline, holes, (curve, None, Fineness::DEFAULT));
    let contour = |parts: &Vec<Vec<CurvePoint>>| -> Vec<DVec2> {
        parts.iter().flat_map(|part| &part[..part.len() - 1]).map(|point| point.at.truncate()).collect()
    };
    let contours: Vec<Vec<DVec2>> = regions.iter().flatten().map(contour).collect();
    triangles(&contours).is_some()
}

pub(super) fn mesh(
    outline: &[Vec2],
    holes: &[Vec<Vec2>],
    height: f32,
    how: (Spline, Option<u32>, Fineness),
) -> Result<Mesh, CompileError> {
    let half = 0.5 * f64::from(height);
    let line = |depth: f64, v: f64| SectionLine { out: 0.0, depth, normal: DVec2::X, v };
    let section = [line(half, 0.0), line(-half, 1.0)];
    let area = area(outline, holes, how);
    extrude(&area, &section, [DVec3::X, DVec3::NEG_Z, DVec3::Y])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::tests::{area_of, assert_sound, is_closed, made, volume_of};
    use super::*;
    use crate::world::{Assets, Shape};

    fn points(of: &[[f32; 2]]) -> Vec<Vec2> {
        of.iter().map(|point| Vec2::from_array(*point)).collect()
    }

    fn prism(outline: &[Vec2], holes: &[Vec<Vec2>], curve: Spline) -> Mesh {
        let (outline, holes) = (outline.to_vec(), holes.to_vec());
        let shape = Shape::Prism { outline, holes, height_m: 2.0, curve, segments: None };
        made(&shape, Fineness::Metres(1e-4))
    }

    fn square(x: f32, y: f32, half: f32) -> Vec<Vec2> {
        points(&[[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])
    }

    #[test]
    fn prisms_have_the_volume_and_area_of_their_outlines_whichever_way_these_go() {
        let arrow = points(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        let edges = 4.0 + 4.0 + 2.0 * f64::sqrt(13.0) + 4.0;
        for outline in [arrow.clone(), arrow.iter().rev().copied().collect()] {
            let mesh = prism(&outline, &[], Spline::Linear);
            assert_sound(&mesh);
            assert!(is_closed(&mesh));
            assert!((volume_of(&mesh) - 20.0).abs() < 1e-5);
            assert!((area_of(&mesh) - (20.0 + 2.0 * edges)).abs() < 1e-4);
            assert!(mesh.positions.iter().all(|p| p.y.abs() == 1.0));
        }
        // Seen from above, x goes right and z down.
        let mesh = prism(&arrow, &[], Spline::Linear);
        assert!(mesh.positions.iter().any(|p| (p.x, p.z) == (2.0, 1.0)));
    }

    #[test]
    fn holes_are_left_out_whichever_way_they_go() {
        let mut holes = vec![square(-1.0, -1.0, 0.5), square(1.0, 1.0, 0.5), square(1.0, -1.0, 0.25)];
        holes[1].reverse();
        let mesh = prism(&square(0.0, 0.0, 2.0), &holes, Spline::Linear);
        assert_sound(&mesh);
        assert!(is_closed(&mesh));
        let area = 16.0 - 1.0 - 1.0 - 0.25;
        assert!((volume_of(&mesh) - 2.0 * area).abs() < 1e-5, "{}", volume_of(&mesh));
        assert!((area_of(&mesh) - (2.0 * area + 2.0 * (16.0 + 4.0 + 4.0 + 2.0))).abs() < 1e-4);
    }

    #[test]
    fn outlines_that_cross_and_holes_outside_are_refused_at_their_place() {
        let refused = |outline: &[Vec2], holes: &[Vec<Vec2>], curve: Spline| {
            let (outline, holes) = (outline.to_vec(), holes.to_vec());
            let shape = Shape::Prism { outline, holes, height_m: 1.0, curve, segments: None };
            shape.check(&Assets::default()).map_err(|fault| (fault.fields[0], fault.item, fault.reason))
        };
        let own = square(0.0, 0.0, 1.0);
        let bow = points(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]);
        let lopsided = points(&[[0.0, 0.0], [3.0, 3.0], [3.0, 0.0], [0.0, 1.0]]);
        let flat = points(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]);
        assert!(refused(&own, &[square(0.0, 0.0, 0.5)], Spline::Linear).is_ok());
        for outline in [&bow, &lopsided, &flat] {
            let (field, item, reason) = refused(outline, &[], Spline::Linear).unwrap_err();
            assert!(field == "outline" && item.is_none() && reason.contains("crosses itself"), "{reason}");
        }
        let inside = square(0.0, 0.0, 0.25);
        for outside in [square(3.0, 0.0, 0.5), square(1.0, 0.0, 0.5), square(-3.0, 0.0, 0.5)] {
            let (field, item, _) = refused(&own, &[inside.clone(), outside], Spline::Linear).unwrap_err();
            assert_eq!((field, item), ("holes", Some(1)));
        }
        let twice = refused(&own, &[inside.clone(), inside.clone()], Spline::Linear).unwrap_err();
        assert_eq!((twice.0, twice.1), ("holes", None));
        assert!(refused(&own[..2], &[], Spline::Linear).unwrap_err().2.contains("give at least 3"));
        assert!(refused(&own, &[], Spline::Bezier).unwrap_err().2.contains("give 6 points, not 4"));
        let repeated = [&own[..1], &own[..]].concat();
        assert_eq!(refused(&repeated, &[], Spline::Linear).unwrap_err().1, Some(1));
    }

    #[test]
    fn curved_outlines_are_smooth_on_their_side() {
        let circle: Vec<Vec2> = (0..12)
            .map(|i| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 12.0);
                Vec2::new(cos as f32, sin as f32)
            })
            .collect();
        let mesh = prism(&circle, &[], Spline::CatmullRom);
        assert_sound(&mesh);
        assert!(is_closed(&mesh));
        assert!((volume_of(&mesh) / std::f64::consts::TAU - 1.0).abs() < 2e-3);
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals).filter(|(_, n)| n.y.abs() < 0.5) {
            let out = DVec2::new(position.x.into(), position.z.into());
            assert!(out.normalize().dot(DVec2::new(normal.x.into(), normal.z.into())) > 0.999);
        }
    }

    proptest! {
        /// Stars with square holes around their middle, turned and moved.
        #[test]
        fn stars_with_holes_are_closed(
            radii in prop::collection::vec(0.5f32..3.0, 3..40),
            hole in 0.01f32..0.12,
            shift in -0.1f32..0.1,
            backwards: bool,
        ) {
            let n = radii.len() as f64;
            let mut outline: Vec<Vec2> = radii.iter().enumerate().map(|(i, radius)| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * i as f64 / n);
                Vec2::new(radius * cos as f32, radius * sin as f32)
            }).collect();
            if backwards {
                outline.reverse();
            }
            // A triangle's edges come nearest to its middle.
            let holes = [square(shift.abs() * 0.5, 0.0, hole * 0.5), square(-0.13, shift * 0.2, 0.02)];
            let mesh = prism(&outline, &holes, Spline::Linear);
            assert_sound(&mesh);
            prop_assert!(is_closed(&mesh));
            let own = twice_area(outline.iter().map(|p| p.as_dvec2())).abs() / 2.0;
            let exact = 2.0 * (own - f64::from(hole * hole) - 0.04 * 0.04);
            prop_assert!((volume_of(&mesh) / exact - 1.0).abs() < 1e-4, "{} {}", volume_of(&mesh), exact);
        }
    }
}
