//! Surroundings for other objects: a photographer's backdrop, a table top, a tool.

use glam::DVec2;

use crate::mesh::Solid;
use crate::outline::{Outline, circle, rounded_rectangle};
use crate::solids::{Station, bezier, extrude, lathe, rounded, sweep};

/// A sheet that runs along the floor (+Z towards the camera), bends upwards and becomes the wall: 8 m wide, 5 m deep, 4
/// m high, in metres.
pub fn cyclorama() -> Solid {
    // The extra points beside the bend keep its normals out of the flat parts.
    let mut line = vec![DVec2::new(3.0, 0.0), DVec2::new(-0.78, 0.0)];
    for i in 0..=24 {
        let p = crate::mesh::polar(1.2, -90.0 - 90.0 * f64::from(i) / 24.0);
        line.push(DVec2::new(p.x - 0.8, p.y + 1.2));
    }
    line.extend([DVec2::new(-2.0, 1.22), DVec2::new(-2.0, 4.0)]);
    // Swept along X; the sheet is thin but closed.
    let mut section = line.clone();
    section.extend(line.iter().rev().map(|p| *p + DVec2::new(-0.01, -0.01)));
    let place = |x: f64| Station { origin: glam::DVec3::X * x, x: glam::DVec3::Z, y: glam::DVec3::Y };
    let mut solid = sweep(&[place(4.0), place(-4.0)], &section, false, 1.0);
    solid.faces.retain(|face| face.group == 0);
    for face in &mut solid.faces {
        face.uvs.clear();
    }
    solid
}

/// A wooden board of 1.4 × 0.8 m, 30 mm thick, its top at y = 0; grain along X, the image covers 0.7 m.
pub fn table_top() -> Solid {
    let outline = Outline::new(rounded_rectangle(1.4, 0.8, 0.03, 10));
    let profile = rounded(-0.03, 0.0, 0.006, 5);
    extrude(&outline, &profile).rotated(0, -90.0).with_box_uvs(0.7)
}

/// The turned handle of a screwdriver along Y, from y = 0 (where the blade goes in) to 58 mm, at most 12 mm thick;
/// millimetres.
pub fn screwdriver_handle() -> Solid {
    let mut profile = vec![DVec2::ZERO, DVec2::new(2.6, 0.0), DVec2::new(3.0, 0.4), DVec2::new(3.0, 5.0)];
    profile.extend([(2.6, 5.6), (2.6, 6.4), (3.4, 7.0)].map(DVec2::from));
    profile.extend(bezier([(3.4, 7.0), (6.4, 12.0), (4.0, 22.0), (5.2, 32.0)], 16));
    profile.extend(bezier([(5.2, 32.0), (6.2, 40.0), (6.4, 50.0), (5.4, 52.0)], 10));
    profile.extend([(4.4, 52.6), (4.4, 53.4), (5.6, 54.0)].map(DVec2::from));
    profile.extend(bezier([(5.6, 54.0), (6.2, 56.0), (4.0, 58.0), (0.0, 58.0)], 8));
    let last = profile.len() - 1;
    profile[last].x = 0.0;
    lathe(&profile, 48)
}

/// The blade of the screwdriver, from y = 0 down to a flat tip at y = −62; millimetres.
pub fn screwdriver_blade() -> Solid {
    // (y, half width, half thickness)
    let rows =
        [(0.0, 1.5, 1.5), (-44.0, 1.5, 1.5), (-50.0, 1.6, 1.3), (-58.0, 1.9, 0.55), (-62.0, 1.9, 0.35)];
    let stations: Vec<Station> = rows
        .iter()
        .map(|&(y, width, depth)| Station {
            origin: glam::DVec3::Y * y,
            x: glam::DVec3::X * width,
            y: glam::DVec3::Z * depth,
        })
        .collect();
    sweep(&stations, &circle(DVec2::ZERO, 1.0, 28), false, 1.0)
}
