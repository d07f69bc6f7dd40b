//! `rayfront verify` and `rayfront explain` as a script runs them.

use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = r#"(
    settings: (size: (16, 12), samples: 4, max_depth: 3),
    materials: {"glass": (ior: 1.5), "paper": (diffuse: (0.8, 0.4, 0.2))},
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (name: "ball", shape: Sphere, material: "glass"),
        (name: "egg", shape: Sphere(radius_m: 0.5), material: "paper", transform: (translate: (2, 0, 0), scale: (1, 1.5, 1))),
        (name: "floor", shape: Plane(corners: ((-3, -1, -3), (3, -1, -3), (3, -1, 3), (-3, -1, 3))), material: "paper"),
        (name: "lamp", light: Area(power_w: 300, size_m: 1, samples: 2),
         transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.ron"), SCENE).expect("a file");
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command.output().expect("the program runs")
}

#[track_caller]
fn stdout(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[track_caller]
fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    serde_json::from_str(&stdout(folder, &[arguments, &["--json"]].concat())).expect("JSON")
}

#[test]
fn every_way_gives_the_film_of_rendering() {
    let folder = folder();
    let arguments = ["verify", "scene.ron", "--size", "12x9", "--spp", "2"];
    let found = json(folder.path(), &arguments);
    assert_eq!(found["mismatches"], 0);
    assert!(found["difference"].is_null());
    let films = found["films"].as_array().expect("films");
    let rendered = json(folder.path(), &["scene.ron", "--size", "12x9", "--spp", "2"]);
    assert!(films.len() >= 10 && films.iter().all(|film| film["film_hash"] == rendered["film_hash"]));
    let table = stdout(folder.path(), &arguments);
    assert!(table.contains("all equal") && table.contains("wave 4096"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
}

#[test]
fn a_pixel_is_told_by_names() {
    let folder = folder();
    let told = json(folder.path(), &["explain", "scene.ron", "8,6"]);
    let samples = told["samples"].as_array().expect("samples");
    assert_eq!(samples.len(), 4);
    let first = &samples[0]["paths"][0]["steps"][0];
    assert_eq!((&first["queue"], &first["vertex"]["entity"]), (&"camera".into(), &"ball".into()));
    assert_eq!(first["vertex"]["material"], "glass");
    assert_eq!(first["vertex"]["lights"][0]["light"], "lamp");
    assert!(samples[0]["paths"].as_array().map(Vec::len) > Some(1), "glass forks");
    // The mean is that of the rendered image.
    stdout(folder.path(), &["scene.ron", "-q", "-o", "image.exr"]);
    let image = rayfront::formats::picture::load_linear(&folder.path().join("image.exr")).expect("an image");
    let pixel = image.2[6 * 16 + 8].to_array();
    for (channel, value) in pixel.into_iter().enumerate() {
        assert!((told["mean"][channel].as_f64().expect("a number") - f64::from(value)).abs() < 1e-6);
    }

    let egg = stdout(folder.path(), &["explain", "scene.ron", "12,6", "--sample", "1"]);
    assert!(egg.contains("\"egg\" of \"paper\"") && egg.contains("instance 0"), "{egg}");
    assert!(egg.contains("neither mirrors nor lets light through") && egg.starts_with("sample 1"), "{egg}");
}

#[test]
fn there_is_no_such_pixel_or_sample() {
    let folder = folder();
    for (arguments, code, wanted) in [
        (&["explain", "scene.ron", "16,3"][..], 1, "columns end at 15, rows at 11"),
        (&["explain", "scene.ron", "3,3", "--sample", "4"], 1, "the last is 3"),
        (&["explain", "scene.ron", "3"], 2, "a column and a row"),
        (&["explain", "none.ron", "3,3"], 1, "none.ron"),
        (&["verify", "scene.ron", "--size", "0x3"], 2, "width x height"),
        (&["verify", "none.ron"], 1, "none.ron"),
    ] {
        let output = run(folder.path(), arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(wanted) && output.stdout.is_empty(), "{error}");
    }
}
