//! Profiles turned around the Y axis.

use super::curves::{CurvePoint, sample};
use super::revolve::{FEWEST, ProfilePoint, ProfileRun, limited, revolve};
use super::{Fineness, distinct};
use crate::error::CompileError;
use crate::math::{DVec2, DVec3, Vec2};
use crate::world::{Mesh, Spline};

/// Turns a profile of pairs (radius, y). One that ends where it begins is a ring; others are closed towards the axis,
/// unless they are open.
pub(super) fn mesh(
    profile: &[Vec2],
    curve: Spline,
    open: bool,
    segments: Option<u32>,
    fineness: Fineness,
) -> Result<Mesh, CompileError> {
    let points: Vec<(DVec3, f64)> = profile.iter().map(|p| (p.as_dvec2().extend(0.0), 0.0)).collect();
    let (points, is_ring) = distinct(points);
    let parts = sample(&points, curve, is_ring, segments, fineness);
    let length = parts.last().and_then(|part| part.last()).map_or(1.0, |point| point.along);
    let point = |of: &CurvePoint| {
        // A curve may lean across the axis between its points.
        let at = DVec2::new(of.at.x.max(0.0), of.at.y);
        ProfilePoint { at, normal: DVec2::new(-of.tangent.y, of.tangent.x), v: of.along / length }
    };
    let mut runs: Vec<ProfileRun> = parts
        .iter()
        .map(|part| ProfileRun { points: part.iter().map(point).collect(), square: None })
        .collect();
    let ends =
        runs.first().and_then(|run| run.points.first()).zip(runs.last().and_then(|run| run.points.last()));
    let Some([first, last]) = ends.map(|(first, last)| [first.at, last.at]) else {
        return Ok(Mesh::default());
    };
    // The volume that the profile encloses with the axis, over π: negative if it goes up its outside.
    let slice = |pair: &[ProfilePoint]| {
        let [a, b] = [pair[0].at, pair[1].at];
        (a.x * a.x + a.x * b.x + b.x * b.x) * (a.y - b.y) / 3.0
    };
    let volume: f64 = runs.iter().flat_map(|run| run.points.windows(2)).map(slice).sum();
    if !is_ring && !open {
        let cap =
            |ends: [DVec2; 2], rim: DVec2| (rim.x > 0.0).then(|| ProfileRun::straight(ends, Some(rim.x)));
        let axis = |rim: DVec2| DVec2::new(0.0, rim.y);
        runs.extend(cap([axis(first), first], first));
        runs.extend(cap([last, axis(last)], last));
    }
    if volume < 0.0 {
        for run in &mut runs {
            run.points.reverse();
            run.points.iter_mut().for_each(|point| (point.normal, point.v) = (-point.normal, 1.0 - point.v));
        }
    }
    let radius = runs.iter().flat_map(|run| &run.points).map(|point| point.at.x).fold(0.0, f64::max);
    let rings = runs.iter().map(|run| run.points.len()).sum();
    let around = fineness.segments(radius, segments, FEWEST);
    let [around, _] = if segments.is_none() { limited([around, rings]) } else { [around, rings] };
    revolve(&runs, around)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::tests::{area_of, assert_sound, is_closed, made, polygon, volume_of};
    use super::*;
    use crate::world::Shape;

    fn lathe(profile: &[[f32; 2]], curve: Spline, open: bool, segments: u32) -> Mesh {
        let profile = profile.iter().map(|point| Vec2::from_array(*point)).collect();
        made(&Shape::Lathe { profile, curve, open, segments: Some(segments) }, Fineness::DEFAULT)
    }

    #[test]
    fn turned_profiles_are_closed_with_their_outside_out_whichever_way_they_are_written() {
        let [disc, _] = polygon(24.0);
        let near = |mesh: &Mesh, exact: f64| {
            assert_sound(mesh);
            assert!(is_closed(mesh));
            assert!((volume_of(mesh) / (disc * exact) - 1.0).abs() < 1e-5, "{} {exact}", volume_of(mesh));
        };
        // A cylinder of its side only, a cup with a wall, a ring of square section, two cones tip to tip.
        let cases: [(&[[f32; 2]], f64); 4] = [
            (&[[1.0, 0.0], [1.0, 2.0]], 2.0 * PI),
            (&[[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [1.5, 3.0], [1.5, 0.5], [0.0, 0.5]], PI * (12.0 - 5.625)),
            (&[[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 0.0]], PI * 3.0),
            (&[[1.0, 1.0], [0.0, 0.0], [1.0, -1.0]], 2.0 * PI / 3.0),
        ];
        for (profile, volume) in cases {
            near(&lathe(profile, Spline::Linear, false, 24), volume);
            let backwards: Vec<_> = profile.iter().rev().copied().collect();
            near(&lathe(&backwards, Spline::Linear, false, 24), volume);
        }
    }

    #[test]
    fn open_lathe_has_no_caps_and_normals_outside() {
        let mesh = lathe(&[[1.0, 0.0], [1.0, 2.0]], Spline::Linear, true, 24);
        assert_sound(&mesh);
        assert!(!is_closed(&mesh));
        let [_, rim] = polygon(24.0);
        assert!((area_of(&mesh) / (rim * 4.0 * PI) - 1.0).abs() < 1e-5);
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!(
                (normal.as_dvec3() - DVec3::new(position.x.into(), 0.0, position.z.into())).length() < 1e-6
            );
        }
    }

    /// Half a circle of Bézier curves turned: nearly a ball, with a ball's normals.
    #[test]
    fn bezier_profile_makes_a_ball() {
        let k = 0.552_284_8;
        let half = [[0.0, 1.0], [k, 1.0], [1.0, k], [1.0, 0.0], [1.0, -k], [k, -1.0], [0.0, -1.0]];
        let mesh = lathe(&half, Spline::Bezier, false, 128);
        assert_sound(&mesh);
        assert!(is_closed(&mesh));
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((position.length() - 1.0).abs() < 3e-4);
            assert!((*position - *normal).length() < 4e-3, "{position} {normal}");
        }
        assert!((volume_of(&mesh) / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
    }
}
