//! Transparent bodies: closed surfaces whose normals point out of the glass.

use glam::{DVec2, DVec3};

use crate::mesh::{Solid, polar, sin_cos_degrees};
use crate::outline::{Outline, rounded_rectangle};
use crate::solids::{bezier, extrude, lathe, rounded};

/// A wine glass of 180 mm, one closed surface with an outer and an inner wall.
pub fn wine_glass() -> Solid {
    let mut profile = vec![DVec2::ZERO];
    profile.extend(bezier([(0.0, 0.0), (12.0, 0.6), (22.0, 0.6), (33.0, 0.0)], 6));
    profile.extend(bezier([(33.0, 0.0), (35.0, 0.1), (35.0, 1.6), (33.0, 1.8)], 5));
    profile.extend(bezier([(33.0, 1.8), (16.0, 3.4), (5.6, 5.0), (4.2, 16.0)], 14));
    profile.extend(bezier([(4.2, 16.0), (3.6, 40.0), (3.6, 60.0), (4.4, 76.0)], 12));
    profile.extend(bezier([(4.4, 76.0), (6.0, 88.0), (37.0, 90.0), (38.0, 122.0)], 22));
    profile.extend(bezier([(38.0, 122.0), (38.4, 146.0), (33.0, 164.0), (30.0, 179.4)], 18));
    profile.extend(bezier([(30.0, 179.4), (29.8, 180.4), (28.6, 180.4), (28.5, 179.4)], 6));
    profile.extend(bezier([(28.5, 179.4), (31.5, 164.0), (36.8, 146.0), (36.4, 122.0)], 18));
    profile.extend(bezier([(36.4, 122.0), (35.4, 96.0), (12.0, 90.5), (0.0, 90.0)], 22));
    end_on_axis(profile)
}

/// The wine in [`wine_glass`], up to 128 mm. It reaches 0.4 mm into the glass, whose inner wall bounds it.
pub fn wine() -> Solid {
    let mut profile = vec![DVec2::new(0.0, 89.6)];
    profile.extend(bezier([(0.0, 89.6), (12.2, 90.1), (35.8, 95.8), (36.8, 122.0)], 22));
    profile.extend([
        DVec2::new(36.9, 128.0),
        DVec2::new(36.0, 128.0),
        DVec2::new(20.0, 128.0),
        DVec2::new(0.0, 128.0),
    ]);
    end_on_axis(profile)
}

/// A tumbler of 95 mm with a thick bottom.
pub fn tumbler() -> Solid {
    let mut profile = vec![DVec2::ZERO, DVec2::new(28.0, 0.0)];
    profile.extend(bezier([(28.0, 0.0), (30.5, 0.0), (31.0, 1.0), (31.2, 3.0)], 6));
    profile.extend(bezier([(31.2, 3.0), (33.0, 40.0), (35.0, 70.0), (36.0, 94.4)], 10));
    profile.extend(bezier([(36.0, 94.4), (36.0, 95.4), (34.2, 95.4), (34.1, 94.4)], 6));
    profile.extend(bezier([(34.1, 94.4), (33.0, 70.0), (31.0, 40.0), (29.6, 16.0)], 10));
    profile.extend(bezier([(29.6, 16.0), (29.0, 12.0), (24.0, 11.0), (0.0, 11.0)], 8));
    end_on_axis(profile)
}

/// The drink in [`tumbler`], up to 70 mm. It reaches 0.4 mm into the glass.
pub fn drink() -> Solid {
    let mut profile = vec![DVec2::new(0.0, 10.6)];
    profile.extend(bezier([(0.0, 10.6), (24.2, 10.6), (29.4, 11.6), (30.0, 16.0)], 8));
    profile.extend(bezier([(30.0, 16.0), (31.0, 34.0), (32.0, 52.0), (33.0, 70.0)], 8));
    profile.extend([DVec2::new(32.0, 70.0), DVec2::new(16.0, 70.0), DVec2::new(0.0, 70.0)]);
    end_on_axis(profile)
}

/// An ice cube of 24 mm with worn edges.
pub fn ice_cube() -> Solid {
    extrude(&Outline::new(rounded_rectangle(24.0, 24.0, 4.0, 6)), &rounded(-12.0, 12.0, 4.0, 6))
}

/// A pool of 4 × 4 m about the origin, with waves on its surface: a closed body that is `depth` metres deep.
pub fn pool(depth: f64) -> Solid {
    const SIDE: u32 = 128;
    // Waves of this height focus light about a metre below them.
    const WAVES: [(f64, f64, f64, f64); 6] = [
        (0.012, 2.6, 1.1, 0.3),
        (0.011, -5.3, 7.1, 1.1),
        (0.009, 8.7, -3.3, 2.2),
        (0.006, 7.1, 10.3, 0.7),
        (0.004, -13.9, 5.1, 3.9),
        (0.003, 12.7, 11.3, 5.1),
    ];
    let mut solid = Solid::default();
    let at = |i: u32| 4.0 * f64::from(i) / f64::from(SIDE) - 2.0;
    for (z, x) in (0..=SIDE).flat_map(|z| (0..=SIDE).map(move |x| (at(z), at(x)))) {
        let wave =
            |(height, kx, kz, phase): (f64, f64, f64, f64)| height * libm::sin(kx * x + kz * z + phase);
        solid.vertex(DVec3::new(x, WAVES.into_iter().map(wave).sum(), z));
    }
    let row = SIDE + 1;
    for (z, x) in (0..SIDE).flat_map(|z| (0..SIDE).map(move |x| (z, x))) {
        let corner = z * row + x;
        solid.face(&[corner, corner + row, corner + row + 1, corner + 1], 0);
    }
    // Walls and the bottom.
    let rim: Vec<u32> = (0..SIDE)
        .map(|x| SIDE * row + x)
        .chain((0..SIDE).map(|z| (SIDE - z) * row + SIDE))
        .chain((0..SIDE).map(|x| SIDE - x))
        .chain((0..SIDE).map(|z| z * row))
        .collect();
    let below: Vec<u32> = rim
        .iter()
        .map(|id| {
            let top = solid.positions[*id as usize];
            solid.vertex(DVec3::new(top.x, -depth, top.z))
        })
        .collect();
    for i in 0..rim.len() {
        let next = (i + 1) % rim.len();
        let wall = 1 + (i / SIDE as usize) as u32;
        solid.face(&[rim[i], below[i], below[next], rim[next]], wall);
    }
    let center = solid.vertex(DVec3::Y * -depth);
    for (i, id) in below.iter().enumerate() {
        solid.face(&[center, below[(i + 1) % below.len()], *id], 5);
    }
    solid
}

/// A stoppered flask of 150 mm with thick walls.
pub fn flask() -> Solid {
    let mut profile = vec![DVec2::ZERO, DVec2::new(30.0, 0.0)];
    profile.extend(bezier([(30.0, 0.0), (52.0, 3.0), (54.0, 44.0), (36.0, 62.0)], 24));
    profile.extend(bezier([(36.0, 62.0), (22.0, 76.0), (12.0, 82.0), (11.0, 100.0)], 16));
    profile.extend(bezier([(11.0, 100.0), (11.0, 116.0), (12.0, 122.0), (18.0, 125.0)], 10));
    profile.extend(bezier([(18.0, 125.0), (19.6, 126.0), (18.0, 128.0), (15.0, 126.8)], 6));
    profile.extend(bezier([(15.0, 126.8), (8.4, 124.0), (7.8, 116.0), (7.8, 100.0)], 10));
    profile.extend(bezier([(7.8, 100.0), (8.0, 82.0), (18.0, 76.0), (32.0, 60.0)], 16));
    profile.extend(bezier([(32.0, 60.0), (48.0, 42.0), (48.0, 8.0), (28.0, 6.0)], 24));
    profile.extend(bezier([(28.0, 6.0), (18.0, 5.4), (8.0, 6.0), (0.0, 8.0)], 8));
    end_on_axis(profile)
}

/// A biconvex lens of 100 mm about the origin, its axis along Y.
pub fn lens() -> Solid {
    let (radius, half_aperture) = (104.0f64, 50.0f64);
    let most = libm::asin(half_aperture / radius).to_degrees();
    let depth = radius - sin_cos_degrees(most).1 * radius;
    let face = |i: usize| {
        let p = polar(radius, 90.0 - most * f64::from(i as u32) / 22.0);
        DVec2::new(p.x, p.y - radius + depth + 1.5)
    };
    let mut profile: Vec<DVec2> = (0..=22).map(|i| face(i) * DVec2::new(1.0, -1.0)).collect();
    profile[0].x = 0.0;
    profile.extend((0..=22).rev().map(face));
    end_on_axis(profile)
}

fn end_on_axis(mut profile: Vec<DVec2>) -> Solid {
    let last = profile.len() - 1;
    profile[last].x = 0.0;
    let mut solid = lathe(&profile, 80);
    for face in &mut solid.faces {
        face.uvs.clear();
    }
    solid
}

/// A brilliant of 57 facets and a girdle, radius 1, table upwards (+Y): the intersection of the half-spaces of its
/// planes.
pub fn brilliant() -> Solid {
    let mut planes: Vec<(DVec3, f64)> = vec![(DVec3::Y, 0.34)];
    // (count, first azimuth, slope of the facet against the horizontal, distance from the origin).
    let rings: [(u32, f64, f64, f64); 6] = [
        (8, 0.0, 34.5, 0.596),
        (8, 22.5, 21.0, 0.4766),
        (16, 11.25, 41.0, 0.6700),
        (8, 0.0, 180.0 - 41.0, 0.6660),
        (16, 11.25, 180.0 - 42.3, 0.6840),
        (32, 5.625, 90.0, 1.0),
    ];
    for (count, first, slope, distance) in rings {
        let (sin, cos) = sin_cos_degrees(slope);
        for i in 0..count {
            let around = polar(sin, first + 360.0 * f64::from(i) / f64::from(count));
            planes.push((DVec3::new(around.x, cos, around.y), distance));
        }
    }
    convex(&planes)
}

/// The convex solid below all planes (unit normal, distance), each facet a polygon.
fn convex(planes: &[(DVec3, f64)]) -> Solid {
    let mut solid = Solid::default();
    for (index, &(normal, distance)) in planes.iter().enumerate() {
        let x =
            if normal.y.abs() < 0.9 { normal.cross(DVec3::Y) } else { normal.cross(DVec3::X) }.normalize();
        let y = normal.cross(x);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let mut facet: Vec<DVec3> =
            corners.iter().map(|&(a, b)| normal * distance + (x * a + y * b) * 10.0).collect();
        for (other, &(n, d)) in planes.iter().enumerate() {
            if other != index {
                facet = clipped(&facet, n, d);
            }
        }
        let mut corners: Vec<u32> = Vec::new();
        for p in facet {
            // Neighbouring facets find a common corner by different sums.
            let known = solid.positions.iter().position(|q| q.distance(p) < 1e-6);
            let id = known.map_or_else(|| solid.vertex(p), |id| id as u32);
            if !corners.contains(&id) {
                corners.push(id);
            }
        }
        if corners.len() >= 3 {
            solid.face(&corners, index as u32);
        }
    }
    solid
}

fn clipped(polygon: &[DVec3], normal: DVec3, distance: f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (p, q) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (a, b) = (normal.dot(*p) - distance, normal.dot(*q) - distance);
        if a <= 0.0 {
            kept.push(*p);
        }
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            kept.push(p.lerp(*q, a / (a - b)));
        }
    }
    kept
}
