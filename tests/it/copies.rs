//! Copies of entities: arrays and scatters show what the same entities written one by one do.

use rayfront::render::Options;
use rayfront::world::Transport;

use crate::support::{film, session, world};

const STAGE: &str = "settings: (size: (32, 20), samples: 4, max_depth: 3, sharing: Off), entities: [
    (camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (1.5, 2, 6), to: (1.5, 0.5, 0))),
    (light: Point(power_w: 300), transform: (translate: (0, 5, 5))),
    (name: \"floor\", shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9)))),";

/// Renders a scene, under both transports.
fn hashes(entities: &str) -> [u128; 2] {
    [Transport::Whitted, Transport::Path].map(|transport| {
        let mut world = world(&format!("({STAGE} {entities}])"));
        world.settings.transport = transport;
        film(&world, Options::default()).hash()
    })
}

#[test]
fn arrays_are_as_entities_one_by_one() {
    for shape in ["shape: Sphere(radius_m: 0.3)", "shape: Mesh(\"cube.ply\")", "shape: Mesh(\"ball.ply\")"] {
        let one_by_one: String = (0..3)
            .flat_map(|z| (0..4).map(move |x| (x, z)))
            .map(|(x, z)| format!("({shape}, transform: (translate: ({x}, 0.5, -{z}), scale: 0.5)),"))
            .collect();
        let array = format!(
            "({shape}, transform: (translate: (0, 0.5, 0), scale: 0.5), \
             array: [(count: 4, step: (translate: (1, 0, 0))), (count: 3, step: (translate: (0, 0, -1)))]),"
        );
        assert_eq!(hashes(&array), hashes(&one_by_one), "{shape}");
        // An array of a group is one of all in it.
        let group = format!(
            "(name: \"row\", transform: (translate: (0, 0.5, 0)), \
              array: [(count: 4, step: (translate: (1, 0, 0))), (count: 3, step: (translate: (0, 0, -1)))]),
             ({shape}, parent: \"row\", transform: (scale: 0.5)),"
        );
        assert_eq!(hashes(&group), hashes(&one_by_one), "{shape} in a group");
        // Rows of a row.
        let rows = format!(
            "(name: \"rows\", array: (count: 3, step: (translate: (0, 0, -1)))),
             ({shape}, parent: \"rows\", transform: (translate: (0, 0.5, 0), scale: 0.5),
              array: (count: 4, step: (translate: (1, 0, 0)))),"
        );
        assert_eq!(hashes(&rows), hashes(&one_by_one), "{shape} in rows of a row");
    }
}

#[test]
fn lamps_of_an_array_are_as_lamps_one_by_one() {
    for light in ["Point(power_w: 9)", "Area(power_w: 5, size_m: 0.2, visible: true)", "Spot(power_w: 20)"] {
        let place =
            |x: i32| format!("(transform: LookAt(from: ({x}, 1, 0), to: ({x}, 0, 0.1)), light: {light}),");
        let one_by_one: String = (0..4).map(place).collect();
        let array =
            format!("{}, array: (count: 4, step: (translate: (1, 0, 0)))),", place(0).trim_end_matches("),"));
        assert_eq!(hashes(&array), hashes(&one_by_one), "{light}");
    }
}

/// Copies on a floor that is far away, or in a group that is turned, are where they are on the floor.
#[test]
fn scattered_copies_move_with_their_surface() {
    let scene = |x: f64| {
        format!(
            "(settings: (size: (24, 16), samples: 4, sharing: Off, filter: Box), entities: [
            (camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: ({x}, 2, 6), to: ({x}, 0.5, 0))),
            (light: Directional(irradiance: 1), transform: LookAt(from: (0, 5, 5), to: (0, 0, 0))),
            (name: \"floor\", shape: Mesh(\"square.ply\"), transform: (translate: ({x}, 0, 0), rotate_degrees: (-90, 0, 0), scale: 3)),
            (scatter: (on: \"floor\", count: 60, scale: (0.5, 1.5)), shape: Sphere(radius_m: 0.2), material: (diffuse: 0.2)),
            ])"
        )
    };
    let pixels = |x: f64| film(&world(&scene(x)), Options::default()).radiance();
    let (near, far) = (pixels(0.0), pixels(8_000_000.0));
    assert!(near.iter().any(|pixel| pixel.r < 0.15 && pixel.r > 0.0), "a copy is seen");
    let apart = near.iter().zip(&far).filter(|(a, b)| (a.g - b.g).abs() > 0.02).count();
    assert!(apart < 8, "{apart} pixels differ");
    let other = film(&world(&scene(0.0).replace("count: 60", "count: 60, seed: 2")), Options::default());
    assert_ne!(other.radiance(), near);
}

/// A plane that a gradient lifts is a slope; under a sphere, a smooth one stays one.
#[test]
fn modifiers_change_what_is_seen() {
    let depths = |entity: &str| {
        let world = world(&format!(
            "(settings: (size: (8, 8), samples: 1, filter: Box, pixel_pattern: Regular), entities: [
                (camera: Orthographic(height_m: 1.6), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))), ({entity})])"
        ));
        session(&world, Options::default()).features()
    };
    let plane = "shape: Plane(corners: ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)))";
    let lifted = depths(&format!(
        "{plane}, modifiers: [Subdivide(levels: 4, smooth: false), \
         Displace(texture: Gradient(offset: -0.25, wrap: Clamp), height_m: 2, midlevel: 0)]"
    ));
    for (pixel, seen) in lifted.iter().enumerate() {
        let x = -0.7 + 0.2 * (pixel % 8) as f32;
        let u = 0.5 + 0.5 * x;
        // The edge of the clamped part lies at a vertex.
        let height = 2.0 * (u - 0.25).max(0.0);
        assert!((seen.depth_m - (5.0 - height)).abs() < 1e-4, "pixel {pixel}: {} of {height}", seen.depth_m);
    }
    let round = depths("shape: Sphere(radius_m: 0.9), modifiers: [Normals(smooth_degrees: 60)]");
    let sphere = depths("shape: Sphere(radius_m: 0.9)");
    for (a, b) in round.iter().zip(&sphere) {
        if a.coverage == 1.0 && b.coverage == 1.0 {
            assert!((a.depth_m - b.depth_m).abs() < 5e-3, "{} {}", a.depth_m, b.depth_m);
            assert!(a.normal.iter().zip(b.normal).all(|(a, b)| (a - b).abs() < 0.05));
        }
    }
}
