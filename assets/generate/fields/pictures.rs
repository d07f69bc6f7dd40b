//! Small files that the scenes of strips refer to.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path;

use glam::{DVec2, DVec3};

use crate::mesh::polar;
use crate::outline::contains;
use crate::textures::paint;

/// Paints and writes all files.
pub fn save_all(folder: &Path) -> Result<(), Box<dyn Error>> {
    paint(128, 128, stud).save(folder.join("studs.png"))?;
    paint(128, 128, star).save(folder.join("star.png"))?;
    std::fs::write(folder.join("lamp.ies"), lamp())?;
    std::fs::write(folder.join("hill.ply"), hill())?;
    Ok(())
}

/// A round stud on a flat surface, as a normal map.
fn stud(p: DVec2) -> DVec3 {
    let slope = (p - DVec2::splat(0.5)) * 2.0 / 0.75;
    let tilt = if slope.length() < 1.0 { slope * DVec2::new(0.9, -0.9) } else { DVec2::ZERO };
    let normal = tilt.extend((1.0 - tilt.length_squared()).sqrt());
    normal * 0.5 + DVec3::splat(0.5)
}

/// A star of five points, white on black.
fn star(p: DVec2) -> DVec3 {
    let corner = |i: u32| polar(if i.is_multiple_of(2) { 0.98 } else { 0.41 }, f64::from(i) * 36.0 - 90.0);
    let corners: Vec<DVec2> = (0..10).map(corner).collect();
    if contains(&corners, p * 2.0 - DVec2::ONE) { DVec3::ONE } else { DVec3::ZERO }
}

/// A photometric profile: a bright core, and a ring around it.
fn lamp() -> String {
    let angles = "0 10 20 25 30 35 40 45 60 90";
    let candelas = "1000 900 300 100 400 900 700 100 0 0";
    format!("IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 10 1 1 2 0 0 0\n1 1 100\n{angles}\n0\n{candelas}\n")
}

/// A hill whose vertices are painted: red from the foot to the top, green in its gullies, blue nowhere.
fn hill() -> String {
    const CELLS: u32 = 32;
    let (mut vertices, mut faces) = (String::new(), String::new());
    for row in 0..=CELLS {
        for column in 0..=CELLS {
            let p = DVec2::new(f64::from(column), f64::from(row)) / f64::from(CELLS) * 2.0 - DVec2::ONE;
            let away = p.length().min(1.0);
            let swell = (0.5 + 0.5 * (away * PI).cos()).powf(0.8);
            let gully = swell * (1.0 - swell) * 2.0 * (0.5 + 0.5 * (p.y.atan2(p.x) * 7.0 + away * 4.0).sin());
            let height = 0.8 * swell - 0.25 * gully;
            let [red, green] = [swell, 1.6 * gully].map(|part| (part.clamp(0.0, 1.0) * 255.0).round());
            vertices += &format!("{:.3} {height:.3} {:.3} {red} {green} 0\n", p.x, p.y);
            if row < CELLS && column < CELLS {
                let at = row * (CELLS + 1) + column;
                let below = at + CELLS + 1;
                faces += &format!("4 {at} {below} {} {}\n", below + 1, at + 1);
            }
        }
    }
    let (points, count) = ((CELLS + 1) * (CELLS + 1), CELLS * CELLS);
    format!(
        "ply\nformat ascii 1.0\nelement vertex {points}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {count}\n\
         property list uchar uint vertex_indices\nend_header\n{vertices}{faces}"
    )
}
