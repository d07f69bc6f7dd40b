//! The three methods by which nearly everything here is made: extruding, turning, sweeping.

use glam::{DVec2, DVec3};

use crate::mesh::{Face, Solid, sin_cos_degrees};
use crate::outline::{Outline, inset};
use crate::triangulate::triangulate;

/// Extrudes a flat shape: walls through the rows of `profile`, each an inset from the outline and a height (rising),
/// and a cap at both ends.
pub fn extrude(outline: &Outline, profile: &[(f64, f64)]) -> Solid {
    let mut solid = Solid::default();
    let mut rows: Vec<Outline> = Vec::new();
    for &(distance, z) in profile {
        let row = Outline {
            outer: inset(&outline.outer, distance),
            holes: outline.holes.iter().map(|h| inset(h, distance)).collect(),
        };
        solid.positions.extend(row.loops().flatten().map(|p| p.extend(z)));
        rows.push(row);
    }
    let row_len: u32 = solid.positions.len() as u32 / profile.len() as u32;
    for row in 0..profile.len() as u32 - 1 {
        let mut first = 0;
        for points in outline.loops() {
            let n = points.len() as u32;
            for i in 0..n {
                let (a, b) = (row * row_len + first + i, row * row_len + first + (i + 1) % n);
                solid.face(&[a, b, b + row_len, a + row_len], 0);
            }
            first += n;
        }
    }
    let top = row_len * (profile.len() as u32 - 1);
    for [a, b, c] in triangulate(&rows[0]) {
        solid.face(&[c, b, a], 1);
    }
    for [a, b, c] in triangulate(&rows[profile.len() - 1]) {
        solid.face(&[a + top, b + top, c + top], 2);
    }
    solid
}

/// The profile of a plate from `bottom` to `top` with its edges cut off by `bevel`.
pub fn beveled(bottom: f64, top: f64, bevel: f64) -> [(f64, f64); 4] {
    [(bevel, bottom), (0.0, bottom + bevel), (0.0, top - bevel), (bevel, top)]
}

/// The profile of a plate with its upper edges rounded by `radius` in `steps`, its lower edges cut off a little.
pub fn rounded(bottom: f64, top: f64, radius: f64, steps: usize) -> Vec<(f64, f64)> {
    let mut profile = vec![(radius * 0.3, bottom), (0.0, bottom + radius * 0.3)];
    for i in 0..=steps {
        let (sin, cos) = sin_cos_degrees(90.0 * i as f64 / steps as f64);
        profile.push((radius * (1.0 - cos), top - radius + radius * sin));
    }
    profile
}

/// Turns a profile of (radius, height) points about Y. The right side of a profile that runs upwards is outside. Points
/// with radius 0 become one vertex. `u` runs around, `v` along.
pub fn lathe(profile: &[DVec2], segments: u32) -> Solid {
    let mut solid = Solid::default();
    let mut length = vec![0.0];
    for pair in profile.windows(2) {
        length.push(length[length.len() - 1] + pair[0].distance(pair[1]));
    }
    let total = length[length.len() - 1];
    let closed = profile.first() == profile.last();
    let distinct = if closed { profile.len() - 1 } else { profile.len() };
    let starts: Vec<u32> = profile[..distinct]
        .iter()
        .map(|p| {
            let start = solid.positions.len() as u32;
            let copies = if p.x == 0.0 { 1 } else { segments };
            for i in 0..copies {
                // Negative: from +X towards −Z, so that the right side of the profile is outside.
                let (sin, cos) = sin_cos_degrees(-360.0 * f64::from(i) / f64::from(segments));
                solid.vertex(DVec3::new(p.x * cos, p.y, p.x * sin));
            }
            start
        })
        .collect();
    for row in 0..profile.len() - 1 {
        let ends = [row, row + 1];
        let id = |end: usize, i: u32| {
            let k = ends[end] % distinct;
            if profile[k].x == 0.0 { starts[k] } else { starts[k] + i % segments }
        };
        for i in 0..segments {
            let (u0, u1) = (f64::from(i) / f64::from(segments), f64::from(i + 1) / f64::from(segments));
            let (v0, v1) = (length[row] / total, length[row + 1] / total);
            let corners =
                [(id(0, i), u0, v0), (id(0, i + 1), u1, v0), (id(1, i + 1), u1, v1), (id(1, i), u0, v1)];
            let mut face = Face { corners: Vec::new(), uvs: Vec::new(), group: 0 };
            for (k, &(corner, u, v)) in corners.iter().enumerate() {
                if corner != corners[(k + 3) % 4].0 {
                    face.corners.push(corner);
                    face.uvs.push(DVec2::new(u, v));
                }
            }
            if face.corners.len() >= 3 {
                solid.faces.push(face);
            }
        }
    }
    solid
}

/// Points along a cubic Bézier curve, without the first.
pub fn bezier(points: [(f64, f64); 4], steps: usize) -> impl Iterator<Item = DVec2> {
    let [a, b, c, d] = points.map(DVec2::from);
    (1..=steps).map(move |i| {
        let t = i as f64 / steps as f64;
        let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
        ab.lerp(bc, t).lerp(bc.lerp(cd, t), t)
    })
}

/// A place along a sweep: the origin and the axes of the cross-section.
#[derive(Clone, Copy, Debug)]
pub struct Station {
    /// The cross-section's origin.
    pub origin: DVec3,
    /// Its X axis; may have any length.
    pub x: DVec3,
    /// Its Y axis; may have any length.
    pub y: DVec3,
}

/// Moves a cross-section (counter-clockwise, seen against the direction of travel) through the stations. Open sweeps
/// get caps. `u` runs along the path `repeat_u` times, `v` around.
pub fn sweep(stations: &[Station], section: &[DVec2], closed: bool, repeat_u: f64) -> Solid {
    let mut solid = Solid::default();
    for s in stations {
        for p in section {
            solid.vertex(s.origin + s.x * p.x + s.y * p.y);
        }
    }
    let (rows, n) = (stations.len() as u32, section.len() as u32);
    let steps = if closed { rows } else { rows - 1 };
    for row in 0..steps {
        let (a, b) = (row * n, (row + 1) % rows * n);
        let u = |r: u32| f64::from(r) / f64::from(steps) * repeat_u;
        let v = |i: u32| f64::from(i) / f64::from(n);
        for i in 0..n {
            let j = (i + 1) % n;
            let uvs = [(row, i), (row, i + 1), (row + 1, i + 1), (row + 1, i)];
            solid.faces.push(Face {
                corners: vec![a + i, a + j, b + j, b + i],
                uvs: uvs.map(|(r, i)| DVec2::new(u(r), v(i))).to_vec(),
                group: 0,
            });
        }
    }
    if !closed {
        let cap_uvs = vec![DVec2::ZERO; section.len()];
        let end = (rows - 1) * n;
        solid.faces.push(Face { corners: (0..n).rev().collect(), uvs: cap_uvs.clone(), group: 1 });
        solid.faces.push(Face { corners: (end..end + n).collect(), uvs: cap_uvs, group: 2 });
    }
    solid
}

/// Stations with minimal rotation along an open path (double reflection, Wang and others 2008).
pub fn stations(path: &[DVec3], up: DVec3) -> Vec<Station> {
    let tangent = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(path.len() - 1));
        (path[b] - path[a]).normalize()
    };
    let mut x = tangent(0).cross(up).normalize();
    let mut result = Vec::with_capacity(path.len());
    for i in 0..path.len() {
        let t = tangent(i);
        if i > 0 {
            let reflect = |v: DVec3, axis: DVec3| {
                let squared = axis.length_squared();
                if squared == 0.0 { v } else { v - axis * (2.0 * v.dot(axis) / squared) }
            };
            let step = path[i] - path[i - 1];
            let turned = reflect(tangent(i - 1), step);
            x = reflect(reflect(x, step), t - turned);
        }
        x = (x - t * x.dot(t)).normalize();
        result.push(Station { origin: path[i], x, y: t.cross(x) });
    }
    result
}

/// A round tube along an open path.
pub fn tube(path: &[DVec3], up: DVec3, radius: f64, sides: usize) -> Solid {
    let section = crate::outline::circle(DVec2::ZERO, radius, sides);
    sweep(&stations(path, up), &section, false, 1.0)
}
