//! Scenes far from the origin of the world, where single precision has steps of half a metre.

use rayfront::math::DVec3;
use rayfront::render::Options;
use serde_json::Value;

use crate::program::{Place, empty_folder};
use crate::support::{session, world};

/// Whatever the compiled scene is relative to: reports are in the coordinates of the scene file.
#[test]
fn reports_give_places_as_the_file_does() {
    let folder = empty_folder();
    let [x, y, z] = [450_123.25, 312.5, -5_412_345.75];
    let entity = |place: &str, more: &str| format!("(transform: {place}, {more}),");
    let camera = entity(
        &format!("LookAt(from: ({x}, {y}, {}), to: ({x}, {y}, {z}))", z + 4.0),
        "camera: Pinhole(vertical_fov_degrees: 40)",
    );
    let ball =
        entity(&format!("(translate: ({x}, {y}, {z}))"), "name: \"ball\", shape: Sphere(radius_m: 0.5)");
    let lamp = entity(&format!("(translate: ({x}, {}, {z}))", y + 3.0), "light: Point(power_w: 200)");
    let text = |camera: &str| {
        let settings = "settings: (size: (16, 16), samples: 1)";
        format!("({settings}, entities: [{camera} {ball} {lamp}])")
    };
    folder.write("scene.ron", text(&camera));
    // Five digits are printed.
    let near =
        |value: &Value, place: f64| (value.as_f64().expect("a number") - place).abs() < 1e-4 * place.abs();
    let facts = folder.json("info scene.ron");
    let bounds = &facts["bounds_m"];
    assert!(near(&bounds[0][0], x) && near(&bounds[1][2], z), "{bounds}");
    let told = folder.json("explain scene.ron 8,8");
    let step = &told["samples"][0]["paths"][0]["steps"][0];
    let at = |value: &Value| [0, 1, 2].map(|axis| value[axis].as_f64().expect("a number"));
    let [from, hit] = [at(&step["origin"]), at(&step["vertex"]["position"])];
    assert!((from[2] - z - 4.0).abs() < 1e-3 && (from[0] - x).abs() < 1e-3, "{from:?}");
    assert!((hit[2] - z - 0.5).abs() < 0.05 && (hit[0] - x).abs() < 0.2, "{hit:?}");
    // What `check` prints can be pasted.
    let away = camera.replace(&format!("to: ({x}, {y}, {z})"), &format!("to: ({x}, {y}, {})", z + 9.0));
    folder.write("away.ron", text(&away));
    let finding = folder.run("check away.ron").out;
    let remedy = format!("to: ({x:.4}, {y:.4}, {z:.4})");
    assert!(finding.contains("LookAt(from: ") && finding.contains(&remedy), "{finding}");
    // A ray of another program.
    let ray = [x, y, z + 4.0, 0.0, 0.0, -1.0, 0.0, 100.0].map(|number| number as f32);
    folder.write("rays.f32", ray.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
    assert_eq!(folder.json("trace scene.ron --rays rays.f32")["hits"], 1);
}

/// Corners are in double precision, as places are.
#[test]
fn flat_shapes_far_away_are_seen_as_near_ones() {
    let seen = |far: DVec3| {
        let place = |x: f64, y: f64, z: f64| {
            let DVec3 { x, y, z } = far + DVec3::new(x, y, z);
            format!("({x}, {y}, {z})")
        };
        let text = format!(
            "(settings: (size: (24, 24), samples: 4, filter: Box, sharing: Off), entities: [
                (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: {}, to: {})),
                (shape: Plane(corners: ({}, {}, {}, {}))), (shape: Triangle(vertices: ({}, {}, {}))),
                (light: Point(power_w: 300), transform: (translate: {})),
            ])",
            place(1.0, 2.0, 4.0),
            place(0.0, 0.0, 0.0),
            place(-1.0, 0.0, 1.0),
            place(1.0, 0.0, 1.0),
            place(1.0, 0.0, -1.0),
            place(-1.0, 0.0, -1.0),
            place(-0.3, 0.1, 0.0),
            place(0.4, 0.1, 0.0),
            place(0.0, 0.8, 0.0),
            place(1.0, 2.0, 2.0),
        );
        let world = world(&text);
        let session = session(&world, Options::default());
        (session.features(), session.film().radiance())
    };
    let (near, far) = (seen(DVec3::ZERO), seen(DVec3::new(450_123.25, 312.5, -5_412_345.75)));
    for pixel in 0..near.0.len() {
        let (a, b) = (near.0[pixel], far.0[pixel]);
        assert!((a.coverage - b.coverage).abs() < 0.01, "{pixel}");
        assert!(a.coverage < 1.0 || (a.depth_m - b.depth_m).abs() < 1e-3, "{pixel}");
        let (a, b) = (near.1[pixel].to_array(), far.1[pixel].to_array());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3), "{pixel}: {a:?} {b:?}");
    }
}
