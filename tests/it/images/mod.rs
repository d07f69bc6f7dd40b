//! Pictures whose answers are known by hand.

mod cameras;
mod lights;
mod materials;
mod textures;
mod watertight;

use std::f64::consts::PI;

use crate::support::{Picture, picture};

/// One ray through each pixel's centre.
const EXACT: &str = "samples: 1, filter: Box, pixel_pattern: Regular, min_throughput: 0";
/// A camera above the origin.
const ABOVE: &str = "(camera: Orthographic(height_m: 1e-4), transform: LookAt(from: (0, 5, 0), to: (0, 0, 0), up: (0, 0, -1)))";
/// A floor of reflectance ½, facing up.
const FLOOR: &str =
    "(shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))), material: (kd: 0.5))";

fn scene(settings: &str, entities: &[&str]) -> String {
    format!("(settings: ({settings}), entities: [{}])", entities.join(", "))
}

/// The only pixel of an image of one.
fn pixel(settings: &str, entities: &[&str]) -> [f64; 3] {
    let image = picture(&scene(&format!("size: (1, 1), {EXACT}, {settings}"), entities));
    image.at(0, 0).to_array().map(f64::from)
}

fn grey(settings: &str, entities: &[&str]) -> f64 {
    pixel(settings, entities)[1]
}

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs() + 1e-7, "{found} instead of {expected}");
}

/// A mesh is the same whether it lies in the world's tree or is placed several times.
#[test]
fn an_instance_looks_like_the_mesh_itself() {
    let settings = "size: (40, 30), samples: 4, ambient: 0.1, background: Gradient(bottom: 0, top: 1)";
    for transform in [
        "translate: (0.3, 0, 0), rotate_degrees: (20, 40, 60)",
        "scale: (-1, 1, 1), rotate_degrees: (20, 40, 60)",
        "scale: (0.5, 1.5, -0.7), translate: (0, 0.2, 0)",
    ] {
        for (mesh, material) in [
            ("tetrahedron", "(kd: Image(\"noise.png\"))"),
            ("bowl", "(kd: 0.6, ks: 0.5)"),
            ("tetrahedron", "(ior: 1.5)"),
        ] {
            let shape = |transform: &str| {
                format!("(shape: Mesh(\"{mesh}.ply\"), material: {material}, transform: ({transform}))")
            };
            let common = [
                "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 2, 5), to: (0, 0, 0)))",
                "(light: Point(power_w: 300), transform: (translate: (2, 4, 3)))",
            ];
            let once = picture(&scene(settings, &[common[0], common[1], &shape(transform)]));
            // The second one stands behind the camera.
            let away = shape("translate: (0, 0, 50)");
            let twice = picture(&scene(settings, &[common[0], common[1], &shape(transform), &away]));
            let nothing = picture(&scene(settings, &common));
            let far = |(a, b): (&rayfront::math::Rgb, &rayfront::math::Rgb)| {
                a.to_array().iter().zip(b.to_array()).any(|(a, b)| (a - b).abs() > 1e-3)
            };
            assert!(once.pixels.iter().zip(&nothing.pixels).filter(|pair| far(*pair)).count() > 60);
            // Rays that graze an edge may fall to either side of it.
            let different = once.pixels.iter().zip(&twice.pixels).filter(|pair| far(*pair)).count();
            assert!(different <= 4, "{mesh} {material} {transform}: {different} pixels differ");
        }
    }
}
