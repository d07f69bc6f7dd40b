//! Images with results known analytically.

mod cameras;
mod lights;
mod materials;
mod path_panoramas;
mod path_textures;
mod procedural;
mod textures;
mod watertight;

use std::f64::consts::PI;

use crate::support::{Picture, picture};

/// One ray through the centre of each pixel.
const EXACT: &str = "samples: 1, filter: Box, pixel_pattern: Regular, min_throughput: 0";
/// A camera above the origin.
const ABOVE: &str = "(camera: Orthographic(height_m: 1e-4), transform: LookAt(from: (0, 5, 0), to: (0, 0, 0), up: (0, 0, -1)))";
/// A floor of reflectance ½, facing up.
const FLOOR: &str =
    "(shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))), material: (kd: 0.5))";

fn scene(settings: &str, entities: &[&str]) -> String {
    format!("(settings: ({settings}), entities: [{}])", entities.join(", "))
}

/// Copying a mesh costs its triangles or its vertices, whichever are more, for each place but the first.
#[test]
fn meshes_are_copied_up_to_the_limit() {
    let place = |mesh: &str, x: u32| {
        format!(
            "(shape: Mesh(\"{mesh}.ply\"), material: (diffuse: 0.5), transform: (translate: ({x}, 0, 0)))"
        )
    };
    let camera = "(camera: Pinhole(vertical_fov_degrees: 40))".to_owned();
    let mut entities =
        vec![camera, place("tetrahedron", 0), place("tetrahedron", 1), place("tetrahedron", 2)];
    entities.extend([place("ball", 3), place("ball", 4)]);
    let entities: Vec<&str> = entities.iter().map(String::as_str).collect();
    let size = |mesh: &str| {
        let world = crate::support::world(&scene("", &[entities[0], &place(mesh, 0)]));
        let mesh = &world.assets.meshes[0];
        mesh.triangles.len().max(mesh.positions.len())
    };
    let (small, large) = (2 * size("tetrahedron"), size("ball"));
    assert!(small < large);
    for (allowed, instances) in
        [(0, 5), (small - 1, 5), (small, 2), (small + large - 1, 2), (small + large, 0)]
    {
        let world = crate::support::world(&scene(&format!("copied_triangles: {allowed}"), &entities));
        let compiled = rayfront::compile::compile(&world, None).unwrap();
        assert_eq!(compiled.geometry.instances.len(), instances, "{allowed}");
    }
}

/// The pixel of a 1 × 1 image.
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

/// A mesh looks the same in the world's BVH, copied to several places, and as an instance.
#[test]
fn instances_look_like_the_mesh_itself() {
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
            // The second one is behind the camera.
            let away = shape("translate: (0, 0, 50)");
            let both = [common[0], common[1], &shape(transform), &away];
            let copied = picture(&scene(settings, &both));
            assert!(copied.pixels == once.pixels, "{mesh} {material} {transform}");
            let twice = picture(&scene(&format!("{settings}, copied_triangles: 0"), &both));
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
