//! A crooked little table clock of few quads, for the stages of mesh loading (Figure 8). Its texture has wood in the
//! left half and a dial in the right.

use glam::{DVec2, DVec3};

use crate::mesh::{Face, Polygons, Solid, polar, sin_cos_degrees};
use crate::solids::{Station, lathe, sweep};

/// The clock with normals and texture coordinates, with one normal a face that is the mean of its corners' normals, without
/// normals, and as read by a loader that takes the first three corners of every face for a triangle.
pub fn stages() -> [(&'static str, Polygons); 4] {
    let solid = cabinet();
    let mut missing = solid.flat();
    for face in &mut missing.faces {
        face.truncate(3);
    }
    let smooth = solid.smoothed(60.0);
    [
        ("cabinet_averaged", averaged(&smooth)),
        ("cabinet", smooth),
        ("cabinet_flat", solid.flat()),
        ("cabinet_missing", missing),
    ]
}

/// A mesh whose corners all have the mean normal of their face.
fn averaged(mesh: &Polygons) -> Polygons {
    let mut result = Polygons::default();
    for face in &mesh.faces {
        let normals =
            face.iter().map(|corner| DVec3::from_array(mesh.normals[*corner as usize].map(f64::from)));
        let mean = normals.sum::<DVec3>().normalize_or_zero().to_array().map(|c| c as f32);
        let first = result.positions.len() as u32;
        result.positions.extend(face.iter().map(|corner| mesh.positions[*corner as usize]));
        result.normals.extend(face.iter().map(|_| mean));
        result.faces.push((first..first + face.len() as u32).collect());
    }
    result
}

/// The sideways offset of the leaning body at height `y` (metres).
fn lean(y: f64) -> f64 {
    0.022 * sin_cos_degrees(y * 900.0).0
}

fn cabinet() -> Solid {
    // (height, half width, half depth)
    let rows = [
        (0.030, 0.075, 0.055),
        (0.034, 0.088, 0.066),
        (0.046, 0.090, 0.068),
        (0.056, 0.084, 0.062),
        (0.062, 0.066, 0.048),
        (0.090, 0.058, 0.042),
        (0.120, 0.053, 0.039),
        (0.150, 0.055, 0.040),
        (0.180, 0.066, 0.045),
        (0.205, 0.080, 0.050),
        (0.240, 0.087, 0.053),
        (0.275, 0.084, 0.052),
        (0.298, 0.074, 0.048),
        (0.303, 0.084, 0.058),
        (0.312, 0.086, 0.060),
        (0.320, 0.078, 0.054),
        (0.340, 0.050, 0.038),
        (0.365, 0.026, 0.022),
        (0.395, 0.012, 0.011),
        (0.420, 0.006, 0.006),
    ];
    let section = squircle(20);
    let stations: Vec<Station> = rows
        .iter()
        .map(|&(y, width, depth)| Station {
            origin: DVec3::new(lean(y), y, 0.0),
            x: DVec3::Z * depth,
            y: DVec3::X * width,
        })
        .collect();
    let mut solid = sweep(&stations, &section, false, 1.0);
    for face in &mut solid.faces {
        for uv in &mut face.uvs {
            *uv = DVec2::new(0.01 + 0.48 * uv.y, uv.x);
        }
    }
    for (x, z) in [(-0.06, -0.04), (0.06, -0.04), (0.06, 0.04), (-0.06, 0.04)] {
        solid.append(&wooden(ball(0.019, 8, 12)).translated(x, 0.0185, z));
    }
    solid.append(&wooden(ball(0.013, 8, 12)).translated(lean(0.425), 0.428, 0.0));
    solid.append(&dial().translated(lean(0.245), 0.245, 0.049));
    solid
}

/// A round-cornered square of half width 1, counter-clockwise.
fn squircle(points: usize) -> Vec<DVec2> {
    (0..points)
        .map(|i| {
            let p = polar(1.0, 360.0 * (i as f64 + 0.5) / points as f64);
            let fourth = |v: f64| v * v * v * v;
            p / libm::sqrt(libm::sqrt(fourth(p.x) + fourth(p.y)))
        })
        .collect()
}

fn ball(radius: f64, rows: usize, segments: u32) -> Solid {
    let mut profile: Vec<DVec2> =
        (0..=rows).map(|i| polar(radius, -90.0 + 180.0 * i as f64 / rows as f64)).collect();
    profile[0].x = 0.0;
    profile[rows].x = 0.0;
    lathe(&profile, segments)
}

fn wooden(mut solid: Solid) -> Solid {
    for uv in solid.faces.iter_mut().flat_map(|f| &mut f.uvs) {
        *uv = DVec2::new(0.02 + 0.2 * uv.x, 0.02 + 0.2 * uv.y);
    }
    solid
}

/// A disc of quads, slightly domed, with a rim; it faces +Z.
fn dial() -> Solid {
    const SIDE: usize = 8;
    let (radius, height) = (0.066, 0.012);
    let mut solid = Solid::default();
    for j in 0..=SIDE {
        for i in 0..=SIDE {
            let (x, y) = (2.0 * i as f64 / SIDE as f64 - 1.0, 2.0 * j as f64 / SIDE as f64 - 1.0);
            // Maps a square grid to a disc.
            let p = DVec2::new(x * libm::sqrt(1.0 - y * y / 2.0), y * libm::sqrt(1.0 - x * x / 2.0));
            solid.vertex((p * radius).extend(height + 0.004 * (1.0 - p.length_squared())));
        }
    }
    let uv = |p: DVec3| DVec2::new(0.75 + p.x / radius * 0.245, 0.5 + p.y / radius * 0.49);
    let id = |i: usize, j: usize| (j * (SIDE + 1) + i) as u32;
    for j in 0..SIDE {
        for i in 0..SIDE {
            let corners = vec![id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            let uvs = corners.iter().map(|&c| uv(solid.positions[c as usize])).collect();
            solid.faces.push(Face { corners, uvs, group: 0 });
        }
    }
    let rim: Vec<(usize, usize)> = (0..SIDE)
        .map(|i| (i, 0))
        .chain((0..SIDE).map(|j| (SIDE, j)))
        .chain((0..SIDE).map(|i| (SIDE - i, SIDE)))
        .chain((0..SIDE).map(|j| (0, SIDE - j)))
        .collect();
    let first = solid.positions.len() as u32;
    for &(i, j) in &rim {
        let p = solid.positions[id(i, j) as usize];
        solid.vertex(DVec3::new(p.x * 1.06, p.y * 1.06, -0.01));
    }
    let n = rim.len();
    for k in 0..n {
        let next = (k + 1) % n;
        let corners =
            vec![first + k as u32, first + next as u32, id(rim[next].0, rim[next].1), id(rim[k].0, rim[k].1)];
        let uvs = [0.0, 0.02, 0.02, 0.0].map(|u| DVec2::new(0.1 + u, 0.5)).to_vec();
        solid.faces.push(Face { corners, uvs, group: 1 });
    }
    solid
}
