//! What stands behind and below things: a photographer's backdrop and a table top.

use glam::DVec2;

use crate::mesh::Solid;
use crate::outline::{Outline, rounded_rectangle};
use crate::solids::{Station, extrude, rounded, sweep};

/// A sheet that runs along the floor (+Z towards the camera), bends upwards and becomes the
/// wall: 8 m wide, 5 m deep, 4 m high, in metres.
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

/// A wooden board of 1.4 × 0.8 m, 30 mm thick, its top at y = 0; grain along X, the image
/// covers 0.7 m.
pub fn table_top() -> Solid {
    let outline = Outline::new(rounded_rectangle(1.4, 0.8, 0.03, 10));
    let profile = rounded(-0.03, 0.0, 0.006, 5);
    extrude(&outline, &profile).rotated(0, -90.0).with_box_uvs(0.7)
}
