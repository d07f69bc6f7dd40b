//! The options of cameras: angle of view, focal length, f-number, focus, and a turn around what they look at.

use crate::program::{Folder, Place, empty_folder};

/// Two balls at different distances, seen by a camera of a form.
const BALLS: &str = r#"(
    settings: (size: (40, 24), samples: 8),
    entities: [
        (name: "eye", camera: CAMERA, transform: LookAt(from: (0, 0.5, 4), to: (0, 0.3, 0))),
        (light: Directional(irradiance: 3), transform: (rotate_degrees: (-40, 20, 0))),
        (name: "near", shape: Sphere(radius_m: 0.4), transform: (translate: (-0.5, 0.3, 1))),
        (name: "far", shape: Sphere(radius_m: 0.4), transform: (translate: (0.6, 0.3, -1.5))),
    ],
)"#;

fn balls(camera: &str) -> Folder {
    let folder = empty_folder();
    folder.write("balls.ron", BALLS.replace("CAMERA", camera));
    folder
}

/// The hash of what a command renders.
fn hash(folder: &Folder, options: &str) -> String {
    let json = folder.out(&format!("balls.ron --json -q -o a.png --overwrite {options}"));
    let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    value["film_hash"].as_str().expect("a hash").to_owned()
}

/// The hash of the scene with another camera.
fn with(folder: &Folder, camera: &str) -> String {
    folder.write("balls.ron", BALLS.replace("CAMERA", camera));
    let found = hash(folder, "");
    folder.write("balls.ron", BALLS.replace("CAMERA", "Pinhole(vertical_fov_degrees: 45)"));
    found
}

#[test]
fn options_of_the_lens_mean_the_fields_of_cameras() {
    let folder = balls("Pinhole(vertical_fov_degrees: 45)");
    assert_eq!(hash(&folder, "--fov 30"), with(&folder, "Pinhole(vertical_fov_degrees: 30)"));
    assert_eq!(hash(&folder, "--focal-length 85"), with(&folder, "Photographic(focal_length_mm: 85)"));
    let sharp = hash(&folder, "--focal-length 85 --f-stop 2 --focus near");
    let same = with(&folder, r#"Photographic(focal_length_mm: 85, f_stop: 2), focus_on: "near""#);
    assert_eq!(sharp, same);
    assert_eq!(hash(&folder, "--focal-length 85 --f-stop 2 --focus '\"near\"'"), same);
    assert_ne!(hash(&folder, "--focal-length 85 --f-stop 2 --focus far"), same);
}

/// The focus is where the layer of depths has that pixel.
#[test]
fn focus_on_a_pixel_is_on_what_it_shows() {
    let folder = balls("Pinhole(vertical_fov_degrees: 45)");
    let pixel = hash(&folder, "--focal-length 50 --f-stop 1.4 --focus 12,12");
    // The front of the near ball: its depth along the axis of view, measured by the layer.
    folder.out("balls.ron -q --focal-length 50 --spp 64 --aov depth --crop 12,12,13,13 -o d.exr");
    let depth = exr::prelude::read_first_flat_layer_from_file(folder.join("d.exr")).expect("layers");
    let depth =
        depth.layer_data.channel_data.list.iter().find(|channel| channel.name.to_string() == "depth.Z");
    let depth = depth.expect("depth").sample_data.values_as_f32().next().expect("a pixel");
    let around = |distance: f32| {
        folder.write(
            "balls.ron",
            BALLS.replace("CAMERA", &format!("Photographic(f_stop: 1.4, focus_distance_m: {distance})")),
        );
        let run = folder.out("balls.ron -q -o b.png --overwrite");
        assert!(run.is_empty());
        image::open(folder.join("b.png")).expect("an image").to_rgb8().into_raw()
    };
    let (same, other) = (around(depth), around(1.5 * depth));
    folder.write("balls.ron", BALLS.replace("CAMERA", "Pinhole(vertical_fov_degrees: 45)"));
    assert_eq!(hash(&folder, "--focal-length 50 --f-stop 1.4 --focus 12,12"), pixel);
    let found = image::open(folder.join("a.png")).expect("an image").to_rgb8().into_raw();
    let far = |other: &[u8]| found.iter().zip(other).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
    assert!(far(&same) * 20 < far(&other), "{} against {}", far(&same), far(&other));
    folder.fails(1, "balls.ron --f-stop 2 --focus 0,0", &["pixel 0,0", "nothing is"]);
    folder.fails(2, "balls.ron --focus near", &["--focus", "such as 2.8"]);
    folder.fails(2, "balls.ron --fov 180", &["between 0 and 180"]);
}

/// Surfaces that the pixel does not show are not in focus: cut-out ones.
#[test]
fn focus_passes_surfaces_that_are_not_seen() {
    let folder = balls("Pinhole(vertical_fov_degrees: 45)");
    let plain = folder.text("balls.ron").replace("samples: 8", "samples: 8, transport: Path");
    let plane =
        "shape: Plane(corners: ((-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2))), material: Principled";
    let focused = |scene: &str| {
        folder.write("balls.ron", scene);
        hash(&folder, "--f-stop 1.4 --focus 12,12")
    };
    let expected = focused(&plain);
    for hidden in ["(alpha: 0, alpha_mode: Mask(cutoff: 0.5))", "(alpha: 0.3, alpha_mode: Mask(cutoff: 0.5))"]
    {
        let scene = plain.replace("    ],\n)", &format!("        ({plane}{hidden}),\n    ],\n)"));
        assert!(scene != plain);
        assert_eq!(focused(&scene), expected, "{hidden}");
    }
    let shown = plain.replace("    ],\n)", &format!("        ({plane}()),\n    ],\n)"));
    assert_ne!(focused(&shown), expected);
}

#[test]
fn turntables_go_once_around() {
    let folder = balls("Pinhole(vertical_fov_degrees: 45)");
    folder.out("balls.ron --turntable 4 --orbit 10,5 -q --exposure auto -o t.#.png");
    let pixels = |name: &str| image::open(folder.join(name)).expect(name).to_rgb8().into_raw();
    let all: Vec<_> = (1..=4).map(|frame| pixels(&format!("t.{frame}.png"))).collect();
    assert!((1..4).all(|frame| all[frame] != all[0]));
    // One exposure for all: that of the first frame.
    let json = folder.out("reproduce t.3.png --json");
    let found: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(found["identical"], true, "{json}");
    let film = folder.out("balls.ron --turntable 4 --orbit 10,5 --frames 3 --json -q -o one.png");
    let film: serde_json::Value = serde_json::from_str(&film).expect("JSON");
    assert_eq!(film["film_hash"], hash(&folder, "--orbit 190,5"));
    folder.fails(2, "balls.ron --frames 1-2 --time 0.5", &["--time", "--turntable"]);
    for (frames, wrong) in [("4-6", "no frame 5"), ("0-2", "no frame 0")] {
        let words = format!("balls.ron --turntable 4 --frames {frames} -o t.#.png");
        folder.fails(2, &words, &[wrong, "its frames are 1 to 4"]);
    }
}

/// Without a focus, the lens finds what is nearest to the middle of the image, as cameras do.
#[test]
fn lenses_focus_near_the_middle_where_nothing_is_in_it() {
    let folder = balls("Pinhole(vertical_fov_degrees: 45)");
    folder.fails(1, "balls.ron --f-stop 2 --focus 20,12", &["nothing is"]);
    // In focus are the limbs of the balls, not their middles.
    let found = hash(&folder, "--f-stop 2");
    for other in ["", "--f-stop 2 --focus near", "--f-stop 2 --focus far"] {
        assert_ne!(hash(&folder, other), found, "{other}");
    }
    folder.out("balls.ron -q --hide '\"near\"' --f-stop 2 -o only.png");
    // A floor of which only shadows are seen is nothing to focus on, unless its pixel is named.
    let floor = "balls.ron -q --transport path --hide Shape --f-stop 2 --ground=shadow -o floor.png";
    folder.fails(1, floor, &["nothing is"]);
    folder.out(&format!("{floor} --focus 20,20"));
    folder.fails(1, "balls.ron -q --hide Shape --f-stop 2 -o none.png", &["nothing is"]);
}
