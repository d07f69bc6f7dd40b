//! Small files that the scenes of strips refer to.

use std::error::Error;
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
