//! Tubes along curves.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::builder::{MeshBuilder, ShapeVertex};
use super::curves::{CurvePoint, sample};
use super::{Fineness, distinct};
use crate::error::CompileError;
use crate::math::DVec3;
use crate::world::{Mesh, Spline, TubeEnds};

/// The least number of sides that is chosen: thinner than a pixel, a tube need not be round.
const FEWEST: f64 = 4.0;
/// The cosine of half the sharpest turn that is mitred in full.
const SHARPEST: f64 = 0.2;

/// The look of a tube, but for its points.
#[derive(Clone, Copy)]
pub(super) struct TubeStyle {
    pub curve: Spline,
    pub ends: TubeEnds,
    pub segments: Option<u32>,
    pub fineness: Fineness,
}

/// A cross-section.
struct Ring {
    center: DVec3,
    tangent: DVec3,
    /// Unit vectors across the curve, which with the tangent make right-handed axes.
    across: [DVec3; 2],
    radius: f64,
    slope: f64,
    along: f64,
    /// The normal of the plane in which the ring lies, at corners between two of them.
    mitre: DVec3,
}

/// The tubes along several curves, each of points with their radii.
pub(super) fn mesh<'a>(
    curves: impl Iterator<Item = Vec<(DVec3, f64)>> + Clone + 'a,
    style: TubeStyle,
) -> Result<Mesh, CompileError> {
    // Counts first: an array that grows holds its content twice while it does.
    let (mut vertices, mut triangles) = (0usize, 0usize);
    let tube = |points: Vec<(DVec3, f64)>| {
        let radius = points.iter().map(|point| point.1).fold(0.0, f64::max);
        let sides = style.fineness.segments(radius, style.segments, FEWEST);
        let (points, is_ring) = distinct(points);
        let parts = match points.len() {
            0 | 1 => Vec::new(),
            _ => sample(&points, style.curve, is_ring, style.segments, style.fineness),
        };
        (parts, is_ring, sides)
    };
    for points in curves.clone() {
        let (parts, _, sides) = tube(points);
        let rings = parts.iter().map(Vec::len).sum::<usize>() + 2 * (sides.div_ceil(4) + 1);
        vertices = vertices.saturating_add(rings * (sides + 1));
        triangles = triangles.saturating_add(2 * rings * sides);
    }
    let mut builder = MeshBuilder::with_room(vertices, triangles)?;
    for points in curves {
        let (parts, is_ring, sides) = tube(points);
        // The sides of a polygon as wide as the circle, seen from all around (Cauchy: its perimeter over π).
        let half = PI / sides as f64;
        let wide = if style.segments.is_none() { half / libm::sin(half) } else { 1.0 };
        let rings = rings(&parts, is_ring, wide);
        add(&mut builder, &rings, is_ring, sides, style.ends);
    }
    Ok(builder.finish())
}

/// The cross-sections of the parts of a curve.
fn rings(parts: &[Vec<CurvePoint>], is_ring: bool, wide: f64) -> Vec<Vec<Ring>> {
    let mut across = None;
    let mut before: Option<CurvePoint> = None;
    let mut rings: Vec<Vec<Ring>> = Vec::with_capacity(parts.len());
    for part in parts {
        let mut part_rings = Vec::with_capacity(part.len());
        for (index, point) in part.iter().enumerate() {
            let axes = match (across, before) {
                (None, _) => first_across(point.tangent),
                (Some(axes), Some(before)) if index > 0 => carried(axes, &before, point),
                // Mirrored in the plane of the mitre, so that both rings of a corner are one.
                (Some(axes), Some(before)) => {
                    let normal = (before.tangent + point.tangent).normalize_or(before.tangent);
                    axes.map(|axis: DVec3| axis - 2.0 * axis.dot(normal) * normal)
                }
                (Some(axes), None) => axes,
            };
            across = Some(axes);
            before = Some(*point);
            part_rings.push(Ring {
                center: point.at,
                tangent: point.tangent,
                across: axes,
                radius: point.radius * wide,
                slope: point.slope * wide,
                along: point.along,
                mitre: point.tangent,
            });
        }
        rings.push(part_rings);
    }
    untwist(&mut rings, is_ring);
    // Corners, and that between the last part and the first one of a closed curve.
    let count = rings.len();
    for number in 0..count {
        let next = (number + 1) % count;
        if next == 0 && !is_ring {
            break;
        }
        let tangents = [rings[number].last(), rings[next].first()].map(|ring| ring.map(|ring| ring.tangent));
        let [Some(a), Some(b)] = tangents else { continue };
        let mitre = (a + b).normalize_or(a);
        if let Some(ring) = rings[number].last_mut() {
            ring.mitre = mitre;
        }
        if let Some(ring) = rings[next].first_mut() {
            ring.mitre = mitre;
        }
    }
    rings
}

/// Two unit vectors across a direction.
fn first_across(tangent: DVec3) -> [DVec3; 2] {
    let u = tangent.any_orthonormal_vector();
    [u, tangent.cross(u)]
}

/// Carries axes from one point to the next without turning them about the curve (Wang, Jüttler, Zheng and Liu,
/// "Computation of rotation minimizing frames", 2008: two reflections).
fn carried(axes: [DVec3; 2], from: &CurvePoint, to: &CurvePoint) -> [DVec3; 2] {
    let step = to.at - from.at;
    if step.length_squared() == 0.0 {
        return axes;
    }
    let mirrored = |of: DVec3, normal: DVec3| of - 2.0 * of.dot(normal) / normal.length_squared() * normal;
    let tangent = mirrored(from.tangent, step);
    let second = to.tangent - tangent;
    let turn = |axis: DVec3| {
        let axis = mirrored(axis, step);
        if second.length_squared() > 1e-24 { mirrored(axis, second) } else { axis }
    };
    let u = turn(axes[0]);
    // Rounding errors must not add up.
    let u = (u - u.dot(to.tangent) * to.tangent).normalize_or(axes[0]);
    [u, to.tangent.cross(u)]
}

/// Turns the axes of a closed curve little by little, so that they end as they begin.
fn untwist(rings: &mut [Vec<Ring>], is_ring: bool) {
    let ends = rings.first().and_then(|part| part.first()).zip(rings.last().and_then(|part| part.last()));
    let Some((first, last)) = ends.filter(|_| is_ring) else { return };
    let (length, mut u) = (last.along.max(f64::MIN_POSITIVE), last.across[0]);
    if last.tangent.dot(first.tangent) < 0.999_999 {
        // Across the corner where the curve closes.
        let normal = (last.tangent + first.tangent).normalize_or(first.tangent);
        u -= 2.0 * u.dot(normal) * normal;
    }
    let twist = libm::atan2(u.dot(first.across[1]), u.dot(first.across[0]));
    for ring in rings.iter_mut().flatten() {
        let (sin, cos) = libm::sincos(-twist * ring.along / length);
        let [u, v] = ring.across;
        ring.across = [cos * u + sin * v, cos * v - sin * u];
    }
}

fn add(builder: &mut MeshBuilder, parts: &[Vec<Ring>], is_ring: bool, sides: usize, ends: TubeEnds) {
    let bounds = parts.first().and_then(|part| part.first()).zip(parts.last().and_then(|part| part.last()));
    let Some((first, last)) = bounds else { return };
    let round = |ring: &Ring| match ends {
        TubeEnds::Round if !is_ring => ring.radius,
        _ => 0.0,
    };
    let whole = FRAC_PI_2 * (round(first) + round(last)) + last.along;
    let mut previous: Option<u32> = None;
    let begin = builder.len();
    for part in parts {
        let lattice = builder.len();
        for ring in part {
            let v = (FRAC_PI_2 * round(first) + ring.along) / whole;
            for side in 0..=sides {
                let way = ring.way(side, sides);
                let normal = way - ring.slope * ring.tangent;
                builder.vertex(ShapeVertex {
                    position: ring.place(way),
                    normal,
                    uv: [side as f64 / sides as f64, v],
                });
            }
        }
        // Corners that meet are one, to the last bit.
        if let Some(from) = previous {
            builder.weld(from, lattice, sides + 1);
        }
        previous = Some(builder.len() - (sides + 1) as u32);
        builder.lattice(lattice, part.len(), sides + 1);
    }
    if is_ring {
        return;
    }
    for (ring, facing, rim) in [(first, -1.0, begin), (last, 1.0, builder.len() - (sides + 1) as u32)] {
        if ring.radius == 0.0 {
            continue;
        }
        match ends {
            TubeEnds::Open => {}
            TubeEnds::Flat => flat_end(builder, ring, facing, rim, sides),
            TubeEnds::Round => {
                let quarter = FRAC_PI_2 * ring.radius / whole;
                round_end(builder, ring, facing, rim, sides, quarter);
            }
        }
    }
}

/// A disc that closes a tube.
fn flat_end(builder: &mut MeshBuilder, ring: &Ring, facing: f64, rim: u32, sides: usize) {
    let normal = facing * ring.tangent;
    let first = builder.len();
    for side in 0..sides {
        let (sin, cos) = libm::sincos(TAU * side as f64 / sides as f64);
        let uv = [0.5 - 0.5 * facing * cos, 0.5 - 0.5 * sin];
        builder.copy(rim + side as u32, normal, uv);
    }
    let middle = builder.vertex(ShapeVertex { position: ring.center, normal, uv: [0.5; 2] });
    for side in 0..sides {
        let [a, b] = [side, (side + 1) % sides].map(|side| first + side as u32);
        builder.triangle(if facing < 0.0 { [middle, a, b] } else { [middle, b, a] });
    }
}

/// Half a ball that closes a tube.
fn round_end(builder: &mut MeshBuilder, ring: &Ring, facing: f64, rim: u32, sides: usize, quarter: f64) {
    let steps = sides.div_ceil(4);
    let first = builder.len();
    // From the pole down to the rim, or from the rim down to the pole.
    for step in 0..=steps {
        let height = if facing < 0.0 { steps - step } else { step };
        let (sin, cos) = libm::sincos(FRAC_PI_2 * height as f64 / steps as f64);
        let part = quarter * height as f64 / steps as f64;
        let v = if facing < 0.0 { quarter - part } else { 1.0 - quarter + part };
        for side in 0..=sides {
            let way = ring.way(side, sides);
            let normal = cos * way + facing * sin * ring.tangent;
            let uv = [side as f64 / sides as f64, v];
            match height {
                0 => builder.copy(rim + side as u32, normal, uv),
                _ if height == steps => {
                    let position = ring.center + facing * ring.radius * ring.tangent;
                    builder.vertex(ShapeVertex { position, normal: facing * ring.tangent, uv })
                }
                _ => builder.vertex(ShapeVertex { position: ring.center + ring.radius * normal, normal, uv }),
            };
        }
    }
    builder.lattice(first, steps + 1, sides + 1);
}

impl Ring {
    /// The direction of a side's edge, clockwise about the tangent: to the right where the curve goes down.
    fn way(&self, side: usize, sides: usize) -> DVec3 {
        let (sin, cos) = libm::sincos(TAU * (side % sides) as f64 / sides as f64);
        cos * self.across[0] - sin * self.across[1]
    }

    fn place(&self, way: DVec3) -> DVec3 {
        let out = self.radius * way;
        let shift = out.dot(self.mitre) / self.tangent.dot(self.mitre).max(SHARPEST);
        self.center + out - shift * self.tangent
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{area_of, assert_sound, corners, is_closed, made, polygon, volume_of};
    use super::*;
    use crate::math::Vec3;
    use crate::world::{Assets, Shape};

    fn tube(
        points: &[[f32; 3]],
        radius_m: &[f32],
        curve: Spline,
        ends: TubeEnds,
        segments: Option<u32>,
    ) -> Mesh {
        let points = points.iter().map(|point| Vec3::from_array(*point)).collect();
        let shape = Shape::Tube { points, radius_m: radius_m.to_vec(), curve, ends, segments };
        made(&shape, Fineness::Metres(1e-3))
    }

    #[test]
    fn straight_tubes_are_cylinders_cones_and_capsules() {
        let line = [[1.0, 2.0, 3.0], [1.0, 2.0, 7.0]];
        let [disc, _] = polygon(32.0);
        for curve in [Spline::Linear, Spline::CatmullRom] {
            let flat = tube(&line, &[0.5], curve, TubeEnds::Flat, Some(32));
            assert_sound(&flat);
            assert!(is_closed(&flat));
            assert!((volume_of(&flat) / (disc * PI * 0.25 * 4.0) - 1.0).abs() < 1e-5);
            let cone = tube(&line, &[0.5, 0.0], curve, TubeEnds::Flat, Some(32));
            assert!(is_closed(&cone));
            assert!((volume_of(&cone) / (disc * PI / 3.0) - 1.0).abs() < 1e-5);
            // Normals tilt with the slope of the side.
            let side = cone.normals.iter().filter(|normal| normal.z > -0.9);
            let expected = 0.125 / libm::sqrt(1.0 + 0.125 * 0.125);
            assert!(side.clone().count() > 0);
            side.for_each(|normal| assert!((f64::from(normal.z) - expected).abs() < 1e-5, "{normal}"));
        }
        let round = tube(&line, &[0.5], Spline::Linear, TubeEnds::Round, Some(128));
        assert_sound(&round);
        assert!(is_closed(&round));
        assert!((volume_of(&round) / (PI * (1.0 + 4.0 / 3.0 * 0.125)) - 1.0).abs() < 2e-3);
        for (position, normal) in round.positions.iter().zip(&round.normals) {
            let nearest = Vec3::new(1.0, 2.0, position.z.clamp(3.0, 7.0));
            assert!(((*position - nearest) * 2.0 - *normal).length() < 1e-5, "{position} {normal}");
        }
        let open = tube(&line, &[0.5], Spline::Linear, TubeEnds::Open, Some(32));
        assert_sound(&open);
        assert!(!is_closed(&open));
    }

    #[test]
    fn mitred_corners_are_closed_and_keep_the_section() {
        let bend = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 3.0, 0.0], [3.0, 3.0, -3.0], [1.0, 4.0, 0.0]];
        let mesh = tube(&bend, &[0.2], Spline::Linear, TubeEnds::Flat, Some(24));
        assert_sound(&mesh);
        assert!(is_closed(&mesh));
        // The volume of mitred prisms is area times the length of the axis.
        let [disc, _] = polygon(24.0);
        let length = 9.0 + libm::sqrt(4.0 + 1.0 + 9.0);
        assert!((volume_of(&mesh) / (disc * PI * 0.04 * length) - 1.0).abs() < 1e-4, "{}", volume_of(&mesh));
        // A frame closes, too, though its corners twist the axes.
        let frame = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]];
        let mesh = tube(&frame, &[0.1], Spline::Linear, TubeEnds::Flat, Some(24));
        assert!(is_closed(&mesh));
        assert_sound(&mesh);
    }

    /// A closed curve in space: by Pappus, its tube has the volume of its section times its length.
    #[test]
    fn closed_curves_have_closed_tubes_without_a_seam() {
        let knot: Vec<[f32; 3]> = (0..=60)
            .map(|i| {
                let t = TAU * f64::from(i % 60) / 60.0;
                let r = 2.0 + libm::cos(3.0 * t);
                [r * libm::cos(2.0 * t), r * libm::sin(2.0 * t), libm::sin(3.0 * t)].map(|c| c as f32)
            })
            .collect();
        let mesh = tube(&knot, &[0.2], Spline::CatmullRom, TubeEnds::Round, None);
        assert_sound(&mesh);
        assert!(is_closed(&mesh));
        let length: f64 = (0..3600)
            .map(|i| {
                let t = TAU * f64::from(i) / 3600.0;
                let (r, dr) = (2.0 + libm::cos(3.0 * t), -3.0 * libm::sin(3.0 * t));
                let dz = 3.0 * libm::cos(3.0 * t);
                libm::sqrt(dr * dr + 4.0 * r * r + dz * dz) * TAU / 3600.0
            })
            .sum();
        assert!((volume_of(&mesh) / (PI * 0.04 * length) - 1.0).abs() < 0.01);
        // At the seam, both rings have the same normals.
        let mut seen = std::collections::HashMap::new();
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            let known = seen.entry(position.to_array().map(f32::to_bits)).or_insert(*normal);
            assert!((*known - *normal).length() < 2e-2, "{position}: {known} {normal}");
        }
    }

    /// However few its sides, a thin tube covers on average what a round one does.
    #[test]
    fn thin_tubes_are_as_wide_as_round_ones_on_average() {
        let hair = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = tube(&hair, &[1e-4], Spline::Linear, TubeEnds::Open, None);
        assert_eq!(mesh.triangles.len(), 8);
        // A convex body's mean shadow is a quarter of its area.
        assert!((area_of(&mesh) / (TAU * 1e-4) - 1.0).abs() < 1e-5);
        assert!(corners(&mesh).flatten().all(|p| (p.y == 0.0 || p.y == 1.0) && p.x.hypot(p.z) < 1.2e-4));
    }

    #[test]
    fn odd_points_and_radii_are_refused_and_sharp_turns_stay_finite() {
        let fault = |points: &[[f32; 3]], radius_m: &[f32]| {
            let points = points.iter().map(|point| Vec3::from_array(*point)).collect();
            let (radius_m, curve, ends) = (radius_m.to_vec(), Spline::Linear, TubeEnds::Flat);
            Shape::Tube { points, radius_m, curve, ends, segments: None }
                .check(&Assets::default())
                .map_err(|fault| fault.reason)
        };
        let line = [[0.0; 3], [1.0; 3], [2.0, 0.0, 0.0]];
        assert!(fault(&line, &[0.1]).is_ok() && fault(&line, &[0.1, 0.2, 0.0]).is_ok());
        assert!(fault(&line, &[0.1, 0.2]).unwrap_err().contains("2 numbers for 3 points"));
        assert!(fault(&line, &[]).unwrap_err().contains("0 numbers"));
        assert!(fault(&line, &[0.0]).unwrap_err().contains("above 0"));
        assert!(fault(&line[..1], &[0.1]).unwrap_err().contains("give at least 2"));
        assert!(fault(&[[1.0; 3]; 2], &[0.1]).unwrap_err().contains("the same"));
        let back = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = tube(&back, &[0.1], Spline::Linear, TubeEnds::Round, None);
        assert!(is_closed(&mesh));
        assert!(mesh.positions.iter().all(|p| p.is_finite() && p.length() < 2.0));
    }
}
