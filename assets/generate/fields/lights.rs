//! The strip of mixed lights: one film, in several mixes.

use std::error::Error;
use std::path::Path;

use image::RgbImage;
use rayfront::math::Rgb;

use super::{SIDE, Strip, rendered, shown};

pub const NAME: &str = "light_groups";

const SCENE: Strip = Strip {
    name: NAME,
    scene: &[r#"(
    settings: (samples: 256, transport: Path, light_groups: true, max_depth: 6, exposure_ev: 0.5),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 1.2, 4), to: (0, 0.62, 0))),
        (shape: Grid(size_m: 8, columns: 1, rows: 1), material: (diffuse: 0.6)),
        (shape: Plane(corners: ((-4, 0, -1), (4, 0, -1), (4, 4, -1), (-4, 4, -1))), material: (diffuse: 0.6)),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (-0.45, 0.5, -0.2)), material: Metal(name: "silver", roughness: 0.3)),
        (shape: Box(size_m: 0.6, bevel_m: 0.05), transform: (translate: (0.5, 0.3, 0.3), rotate_degrees: (0, 30, 0)), material: (diffuse: 0.7)),
        (name: "ceiling", light: Area(power_w: 24, size_m: (1, 1)), transform: LookAt(from: (0, 3, 1), to: (0, 0, 0))),
        (name: "window", light: Area(power_w: (14, 20, 30), size_m: (1, 1.5)), transform: LookAt(from: (-2.5, 1.5, 1), to: (0, 0.5, 0))),
        (name: "lamp", shape: Sphere(radius_m: 0.08), transform: (translate: (0.15, 0.12, 0.75)), material: (diffuse: 0, emission: (60, 32, 12))),
    ],
)"#],
    values: &[""],
    zoom: 1,
};

/// All lights; each by itself; the window as a sunset; the lamp in blue.
pub fn mixes(folder: &Path) -> Result<Vec<RgbImage>, Box<dyn Error>> {
    let mut world = SCENE.load(folder, "")?;
    world.settings.size = [SIDE; 2];
    let film = rendered(&world)?;
    let (on, off) = (Rgb::WHITE, Rgb::BLACK);
    let mixes = [
        [on, on, on],
        [on, off, off],
        [off, on, off],
        [off, off, on],
        [Rgb::splat(0.1), Rgb::new(6.0, 1.6, 0.5), on],
        [off, Rgb::splat(0.3), Rgb::new(0.3, 1.5, 10.0)],
    ];
    Ok(mixes.iter().map(|factors| shown(&film.mixed(factors), &world.settings, 1)).collect())
}
