//! Surfaces of revolution around the Y axis.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::Fineness;
use super::builder::{MeshBuilder, ShapeVertex};
use crate::error::CompileError;
use crate::math::{DVec2, DVec3};
use crate::world::Mesh;

/// The least number of chords in a circle that is chosen.
pub(super) const FEWEST: f64 = 12.0;
/// The most quadrilaterals of a shape with two curvatures whose fineness is chosen.
const MOST_QUADS: f64 = (1 << 18) as f64;

/// A point of a profile.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProfilePoint {
    /// The distance from the axis, and y.
    pub at: DVec2,
    /// The normal, likewise.
    pub normal: DVec2,
    pub v: f64,
}

/// A smooth part of a profile. Between two of them there is an edge.
#[derive(Clone, Debug)]
pub(super) struct ProfileRun {
    pub points: Vec<ProfilePoint>,
    /// True if texture coordinates are those of a square above or below a disc, whose half side this is.
    pub square: Option<f64>,
}

impl ProfileRun {
    /// A part along a straight line.
    pub(super) fn straight(ends: [DVec2; 2], square: Option<f64>) -> ProfileRun {
        let along = ends[1] - ends[0];
        let normal = DVec2::new(-along.y, along.x);
        let point = |at: DVec2, v: f64| ProfilePoint { at, normal, v };
        ProfileRun { points: vec![point(ends[0], 0.0), point(ends[1], 1.0)], square }
    }
}

/// Chosen numbers of chords in two directions, or as many fewer as keep their quadrilaterals to a limit.
pub(super) fn limited(chords: [usize; 2]) -> [usize; 2] {
    let excess = ((chords[0] * chords[1]) as f64 / MOST_QUADS).sqrt().max(1.0);
    chords.map(|count| if excess > 1.0 { 4 * (count as f64 / excess / 4.0).ceil() as usize } else { count })
}

/// Revolves a profile, which goes down where its outside is away from the axis.
pub(super) fn revolve(runs: &[ProfileRun], segments: usize) -> Result<Mesh, CompileError> {
    let rings: usize = runs.iter().map(|run| run.points.len()).sum();
    let mut builder = MeshBuilder::with_room(rings * (segments + 1), 2 * rings * segments)?;
    // As on spheres: from −X by way of +Z.
    let way = |segment: f64| {
        let (sin, cos) = libm::sincos(TAU * segment / segments as f64);
        DVec2::new(-cos, sin)
    };
    let around: Vec<DVec2> = (0..=segments).map(|segment| way((segment % segments) as f64)).collect();
    let middles: Vec<DVec2> = (0..=segments).map(|segment| way(segment as f64 + 0.5)).collect();
    for run in runs {
        let first = builder.len();
        for point in &run.points {
            // Each triangle at a pole has a vertex of its own there, in its middle.
            let is_pole = point.at.x == 0.0;
            for (segment, way) in around.iter().enumerate() {
                let place = |of: DVec2, way: DVec2| DVec3::new(of.x * way.x, of.y, of.x * way.y);
                let position = place(point.at, *way);
                let uv = match run.square {
                    // Top and bottom are both upright from where they are seen.
                    Some(half) => {
                        let down = if point.normal.y < 0.0 { -position.z } else { position.z };
                        [0.5 + 0.5 * position.x / half, 0.5 + 0.5 * down / half]
                    }
                    None => {
                        let middle = if is_pole { 0.5 } else { 0.0 };
                        [(segment as f64 + middle) / segments as f64, point.v]
                    }
                };
                let normal = place(point.normal, if is_pole { middles[segment] } else { *way });
                builder.vertex(ShapeVertex { position, normal, uv });
            }
        }
        for (ring, pair) in run.points.windows(2).enumerate() {
            for segment in 0..segments {
                let at = |i: usize, k: usize| first + ((ring + i) * (segments + 1) + segment + k) as u32;
                let [above, below] = [pair[0], pair[1]].map(|point| point.at.x == 0.0);
                match (above, below) {
                    (true, _) => builder.triangle([at(0, 0), at(1, 0), at(1, 1)]),
                    (_, true) => builder.triangle([at(0, 0), at(1, 0), at(0, 1)]),
                    _ => builder.quad([at(0, 0), at(1, 0), at(1, 1), at(0, 1)]),
                }
            }
        }
    }
    Ok(builder.finish())
}

/// A part of a circle of a radius around `center` from one polar angle to another, both measured from +Y outwards.
fn arc(center: DVec2, radius: f64, [from, to]: [f64; 2], chords: usize, v: [f64; 2]) -> Vec<ProfilePoint> {
    let point = |chord: usize| {
        let part = chord as f64 / chords as f64;
        let (sin, cos) = libm::sincos(from + (to - from) * part);
        let clean = |value: f64| if value.abs() < 1e-15 { 0.0 } else { value };
        let normal = DVec2::new(clean(sin), clean(cos));
        ProfilePoint { at: center + radius * normal, normal, v: v[0] + (v[1] - v[0]) * part }
    };
    (0..=chords).map(point).collect()
}

pub(super) fn disc(radii: [f32; 2], segments: Option<u32>, fineness: Fineness) -> Result<Mesh, CompileError> {
    let [inner, outer] = radii.map(f64::from);
    let ends = [inner, outer].map(|radius| DVec2::new(radius, 0.0));
    revolve(&[ProfileRun::straight(ends, Some(outer))], fineness.segments(outer, segments, FEWEST))
}

/// A cone with a radius at the top and one at the bottom.
pub(super) fn cone(
    radii: [f32; 2],
    height: f32,
    segments: Option<u32>,
    fineness: Fineness,
) -> Result<Mesh, CompileError> {
    let [top, bottom] = radii.map(f64::from);
    let half = 0.5 * f64::from(height);
    let [a, b] = [DVec2::new(top, half), DVec2::new(bottom, -half)];
    let mut runs = vec![ProfileRun::straight([a, b], None)];
    if top > 0.0 {
        runs.push(ProfileRun::straight([DVec2::new(0.0, half), a], Some(top)));
    }
    if bottom > 0.0 {
        runs.push(ProfileRun::straight([b, DVec2::new(0.0, -half)], Some(bottom)));
    }
    revolve(&runs, fineness.segments(top.max(bottom), segments, FEWEST))
}

pub(super) fn capsule(
    radius: f32,
    height: f32,
    segments: Option<u32>,
    fineness: Fineness,
) -> Result<Mesh, CompileError> {
    let radius = f64::from(radius);
    let half = (0.5 * f64::from(height) - radius).max(0.0);
    let around = fineness.segments(radius, segments, FEWEST);
    // The length of a quarter circle, relative to the profile's.
    let part = FRAC_PI_2 * radius / (PI * radius + 2.0 * half);
    let quarter = around.div_ceil(4);
    let mut points = arc(DVec2::new(0.0, half), radius, [0.0, FRAC_PI_2], quarter, [0.0, part]);
    let below = arc(DVec2::new(0.0, -half), radius, [FRAC_PI_2, PI], quarter, [1.0 - part, 1.0]);
    points.extend(below.into_iter().skip(usize::from(half == 0.0)));
    revolve(&[ProfileRun { points, square: None }], around)
}

pub(super) fn torus(
    radius: f32,
    tube: f32,
    segments: Option<u32>,
    fineness: Fineness,
) -> Result<Mesh, CompileError> {
    let [radius, tube] = [radius, tube].map(f64::from);
    let [mut around, mut across] = [radius + tube, tube].map(|r| fineness.segments(r, segments, FEWEST));
    if segments.is_none() {
        [around, across] = limited([around, across]);
    }
    let mut points = arc(DVec2::new(radius, 0.0), tube, [-FRAC_PI_2, 1.5 * PI], across, [0.0, 1.0]);
    // The circle closes exactly.
    let (first, last) = (points[0], points.len() - 1);
    points[last] = ProfilePoint { v: 1.0, ..first };
    revolve(&[ProfileRun { points, square: None }], around)
}
