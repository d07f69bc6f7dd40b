//! The program as run by users and scripts.

mod manners;

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use rayfront::internals::formats::picture;
use tempfile::TempDir;

const SCENE: &str = r#"(
    settings: (size: (16, 12), samples: 4),
    entities: [
        (name: "front", camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (name: "above", camera: Orthographic(height_m: 4),
         transform: LookAt(from: (0, 5, 0), to: (0, 0, 0), up: (0, 0, -1))),
        (name: "ball", shape: Sphere, material: (diffuse: (0.8, 0.4, 0.2), kr: 0.2)),
        (name: "floor", shape: Plane(corners: ((-3, -1, -3), (3, -1, -3), (3, -1, 3), (-3, -1, 3)))),
        (name: "lamp", light: Area(power_w: 300, size_m: 1, samples: 2),
         transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

/// A folder with `scene.ron`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.ron"), SCENE).expect("a file");
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the program runs")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// Returns the standard output of a successful run.
#[track_caller]
fn stdout(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout).to_owned()
}

#[track_caller]
fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let out = stdout(folder, arguments);
    serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}"))
}

/// Returns the single line on standard error of a run that fails with `code` and renders nothing.
#[track_caller]
fn failure(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = run(folder, arguments);
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", text(&output.stdout));
    if code == 1 || code > 2 {
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(error.starts_with("error: "), "{error}");
    }
    let images = std::fs::read_dir(folder).expect("a folder").flatten();
    let written = images.filter(|f| f.path().extension().is_some_and(|e| e == "png" || e == "part")).count();
    assert_eq!(written, 0, "{arguments:?} left a file behind");
    error.to_owned()
}

#[test]
fn images_have_all_formats_and_a_default_name() {
    let folder = folder();
    let out = stdout(folder.path(), &["scene.ron"]);
    assert!(out.contains("scene.png") && out.contains("camera") && out.contains("film"), "{out}");
    let arguments = ["scene.ron", "-o", "a.exr", "-o", "b.hdr", "-o", "c.png", "--quiet"];
    assert_eq!(stdout(folder.path(), &arguments), "");
    let load = |name: &str| {
        let (width, height, pixels) = picture::load_linear(&folder.path().join(name)).expect(name);
        assert_eq!((width, height), (16, 12), "{name}");
        pixels
    };
    let [exr, hdr, png, default] = ["a.exr", "b.hdr", "c.png", "scene.png"].map(load);
    assert_eq!(png, default);
    assert!(exr.iter().any(|p| p.g > 0.05) && exr.contains(&rayfront::math::Rgb::BLACK));
    for ((exact, rgbe), byte) in exr.iter().zip(&hdr).zip(&png) {
        let largest = exact.max_component();
        for ((e, r), b) in exact.to_array().into_iter().zip(rgbe.to_array()).zip(byte.to_array()) {
            assert!((e - r).abs() <= largest / 128.0, "{exact:?} {rgbe:?}");
            assert!((e.min(1.0) - b).abs() <= 0.005, "{exact:?} {byte:?}");
        }
    }
}

#[test]
fn film_hash_does_not_depend_on_schedule_threads_or_isa() {
    let folder = folder();
    let report = json(folder.path(), &["scene.ron", "--json"]);
    let hash = report["film_hash"].as_str().expect("a hash").to_owned();
    assert_eq!(hash.len(), 32);
    assert_eq!(report["samples"], 4);
    assert_eq!(report["rays"]["camera"], 16 * 12 * 4);
    assert_eq!((&report["spheres"], &report["triangles"]), (&1.into(), &2.into()));
    for more in [
        &["--schedule", "recursive"][..],
        &["--schedule", "wavefront", "--wave", "3"],
        &["--threads", "1"],
        &["--threads", "2", "--schedule", "recursive"],
        &["--simd", "portable"],
    ] {
        let arguments = [&["scene.ron", "--json"][..], more].concat();
        assert_eq!(json(folder.path(), &arguments)["film_hash"], hash.as_str(), "{more:?}");
    }
    for more in
        [["--seed", "1"], ["--spp", "5"], ["--depth", "0"], ["--camera", "above"], ["--size", "17x12"]]
    {
        let arguments = [&["scene.ron", "--json"][..], &more].concat();
        assert_ne!(json(folder.path(), &arguments)["film_hash"], hash.as_str(), "{more:?}");
    }
}

#[test]
fn crops_sizes_and_tone_curves_apply() {
    let folder = folder();
    let render = |name: &str, more: &[&str]| {
        stdout(folder.path(), &[&["scene.ron", "-q", "-o", name][..], more].concat());
        picture::load_linear(&folder.path().join(name)).expect(name)
    };
    let (_, _, whole) = render("whole.exr", &[]);
    let (width, height, part) = render("part.exr", &["--crop", "3,2,10,9"]);
    assert_eq!((width, height), (7, 7));
    for y in 0..7 {
        assert_eq!(part[y * 7..][..7], whole[(y + 2) * 16 + 3..][..7], "row {y}");
    }
    let (width, height, _) = render("size.png", &["--size", "20x10", "--spp", "1"]);
    assert_eq!((width, height), (20, 10));
    let (_, _, plain) = render("plain.png", &[]);
    let (_, _, bright) = render("bright.png", &["--exposure", "1"]);
    let (_, _, fine) = render("fine.png", &["--exposure=-1", "--bits", "16"]);
    let of = |pixels: &[rayfront::math::Rgb]| pixels.iter().map(|p| p.g.min(0.5)).sum::<f32>();
    assert!(of(&plain) < of(&bright) && of(&fine) < of(&plain));
    for curve in ["clamp", "scale-by-maximum", "reinhard", "aces", "agx", "pbr-neutral"] {
        let (_, _, toned) = render("toned.png", &["--tonemap", curve]);
        assert_eq!(toned == plain, curve == "clamp", "{curve}");
    }
    // Tone curves do not apply to radiance.
    assert_eq!(render("toned.exr", &["--tonemap", "agx", "--exposure", "2"]).2, whole);
}

#[test]
fn output_variables_are_saved_as_exr() {
    let folder = folder();
    let here = folder.path();
    let files = |name: &str| here.join(name).exists();
    let out = stdout(here, &["scene.ron", "--aov", "depth,entity,material,variance"]);
    assert!(files("scene.png") && files("scene.aov.exr"), "{out}");
    assert!(out.contains("aov       depth, entity, material, variance as layers of scene.aov.exr"), "{out}");
    let report = json(here, &["scene.ron", "--aov", "all", "-o", "a.exr", "-o", "b.png", "--json"]);
    assert_eq!(report["outputs"], serde_json::json!(["a.exr", "b.png"]));
    assert_eq!(report["aov"][8], "variance");
    assert!(!files("a.aov.exr") && !files("b.aov.exr"));
    let plain = json(here, &["scene.ron", "-o", "c.exr", "--json"]);
    assert_eq!((&plain["film_hash"], &plain["aov"]), (&report["film_hash"], &serde_json::json!([])));
    let load = |name: &str| picture::load_linear(&here.join(name)).expect(name).2;
    assert_eq!(load("a.exr"), load("c.exr"));

    let header =
        exr::meta::MetaData::read_from_file(here.join("a.exr"), true).expect("a header").headers.remove(0);
    let manifest = match header.own_attributes.other.get(&exr::prelude::Text::from("manifest")) {
        Some(exr::meta::attribute::AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{other:?}"),
    };
    let manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
    assert_eq!(manifest["entity.id"], serde_json::json!({"3": "ball", "4": "floor"}));
    assert_eq!(manifest["material.id"], serde_json::json!({"1": "default", "2": "material 1"}));

    let scene = SCENE.replace("samples: 4)", "samples: 4, aov: All)");
    std::fs::write(here.join("scene.ron"), scene).expect("a file");
    assert_eq!(json(here, &["scene.ron", "--json"])["aov"].as_array().map(Vec::len), Some(9));
    let none = json(here, &["scene.ron", "--json", "--aov", "none"]);
    assert_eq!((&none["aov"], &none["outputs"]), (&serde_json::json!([]), &serde_json::json!(["scene.png"])));
    let error = text(&run(here, &["scene.ron", "--aov", "deep"]).stderr).to_owned();
    assert!(error.contains("depth"), "{error}");
}

#[test]
fn denoised_images_are_saved_beside_the_others() {
    let folder = folder();
    let here = folder.path();
    let out = stdout(here, &["scene.ron", "--denoise", "-o", "a.png", "-o", "a.exr"]);
    assert!(out.contains("denoised  a.denoised.png, a.denoised.exr in"), "{out}");
    let report = |more: &[&str]| json(here, &[&["scene.ron", "-o", "b.exr", "--json"], more].concat());
    let (plain, clean) = (report(&[]), report(&["--denoise"]));
    assert_eq!((&plain["film_hash"], &plain["denoised"]), (&clean["film_hash"], &serde_json::Value::Null));
    let load = |name: &str| picture::load_linear(&here.join(name)).expect(name).2;
    assert_eq!(load("a.exr"), load("b.exr"));
    assert!(load("a.denoised.exr") == load("b.denoised.exr") && load("b.denoised.exr") != load("b.exr"));
    // With any schedule, number of threads and instruction set.
    for ways in [["--schedule", "recursive"], ["--threads", "1"], ["--simd", "portable"]] {
        let other = report(&[&["--denoise"][..], &ways].concat());
        assert_eq!(other["denoised"]["hash"], clean["denoised"]["hash"], "{ways:?}");
    }
    // A crop is denoised by itself, without its surroundings.
    assert!(report(&["--denoise", "--crop", "3,2,9,7"])["denoised"]["hash"].is_string());
    let one = run(here, &["scene.ron", "--spp", "1", "--denoise", "-o", "one.png"]);
    assert!(text(&one.stderr).contains("--spp 2 or more"), "{}", text(&one.stderr));
    assert!(one.status.success() && here.join("one.png").exists() && !here.join("one.denoised.png").exists());
}

#[test]
fn automatic_exposure_can_be_reused() {
    let folder = folder();
    let here = folder.path();
    let flat = "(settings: (size: (4, 4), samples: 1, background: 720), entities: [(camera: Pinhole())])";
    std::fs::write(here.join("flat.ron"), flat).expect("a file");
    let report = json(here, &["flat.ron", "--exposure", "auto", "--json", "-q"]);
    assert_eq!(report["exposure_ev"].as_f64(), Some(f64::from(-11.97f32)), "log2(0.18 / 720)");
    let grey = picture::load_linear(&here.join("flat.png")).expect("a picture").2[5].g;
    assert!((grey - 0.18).abs() < 0.003, "{grey}");

    let pixels = |more: &[&str]| {
        let out = stdout(here, &[&["scene.ron", "-o", "a.png"][..], more].concat());
        (out, picture::load_linear(&here.join("a.png")).expect("a picture").2)
    };
    let (out, auto) = pixels(&["--exposure", "auto"]);
    let line = out.lines().find(|line| line.starts_with("exposure")).expect("a line about it");
    let chosen = line.rsplit(' ').next().expect("a number");
    assert!(chosen.parse::<f32>().is_ok_and(|ev| ev != 0.0), "{line}");
    assert_eq!(pixels(&["--exposure", chosen]).1, auto, "{line}");
    assert!(!pixels(&["--exposure", "0"]).0.contains("exposure"));
    let brighter = SCENE.replace("samples: 4)", "samples: 4, exposure: Auto, exposure_ev: 1)");
    std::fs::write(here.join("scene.ron"), brighter).expect("a file");
    let by_scene = json(here, &["scene.ron", "--json"])["exposure_ev"].as_f64().expect("a number");
    assert!((by_scene - chosen.parse::<f64>().expect("a number") - 1.0).abs() < 1e-5);
    assert_eq!(pixels(&["--exposure", "auto"]).1, auto, "the command line says it all");
}

#[test]
fn errors_in_scenes_are_one_line_with_the_position() {
    let folder = folder();
    let here = folder.path();
    let error = failure(here, &["nowhere.ron"], 1);
    assert!(error.contains("nowhere.ron"), "{error}");
    let error = failure(here, &["scene.ron", "--camera", "side"], 2);
    assert!(error.contains("\"side\"") && error.contains("front, above"), "{error}");
    let error = failure(here, &["scene.ron", "--crop", "0,0,17,12"], 2);
    assert!(error.contains("16x12"), "{error}");
    std::fs::write(here.join("scene.txt"), SCENE).expect("a file");
    let error = failure(here, &["scene.txt"], 1);
    assert!(error.contains(".ron"), "{error}");

    // Two thousand lines, one of them wrong.
    let mut lines = vec!["(entities: [".to_owned()];
    for i in 2..2000 {
        lines.push(match i {
            1500 => "    (shape: Sphere(radius: 0.5)),".to_owned(),
            _ => format!(
                "    (name: \"{i}\", shape: Sphere(radius_m: 0.5), transform: (translate: ({i}, 0, 0))),"
            ),
        });
    }
    lines.push("])".to_owned());
    std::fs::write(here.join("long.ron"), lines.join("\n")).expect("a file");
    let error = failure(here, &["long.ron"], 1);
    assert!(error.contains("long.ron:1500:20: ") && error.contains("radius_m"), "{error}");
    let error = failure(here, &["info", "long.ron"], 1);
    assert!(error.contains("long.ron:1500:20: "), "{error}");
}

#[test]
fn errors_on_the_command_line_exit_with_2() {
    let folder = folder();
    for arguments in [
        &[][..],
        &["--no-such-flag"],
        &["scene.ron", "--spp", "0"],
        &["scene.ron", "--size", "12"],
        &["scene.ron", "--crop", "5,5,5,9"],
        &["scene.ron", "--simd", "mmx"],
        &["scene.ron", "--schedule", "sideways"],
        &["scene.ron", "--bits", "12"],
        &["scene.ron", "scene.ron"],
        &["info"],
    ] {
        failure(folder.path(), arguments, 2);
    }
    assert_eq!(run(folder.path(), &["--help"]).status.code(), Some(0));
    assert!(stdout(folder.path(), &["--version"]).starts_with("rayfront "));
}

#[test]
fn unwritable_outputs_are_refused_before_rendering() {
    let folder = folder();
    // This would take hours.
    let long = ["scene.ron", "--spp", "4000000", "--size", "2000x2000"];
    for output in ["missing/image.png", "image.jpg", "image", "."] {
        let start = Instant::now();
        let error = failure(folder.path(), &[&long[..], &["-o", output]].concat(), 3);
        assert!(error.contains(output), "{error}");
        assert!(start.elapsed() < Duration::from_secs(60));
    }
}

#[test]
fn info_lists_the_contents_of_a_scene() {
    let folder = folder();
    let out = stdout(folder.path(), &["info", "scene.ron"]);
    for word in ["entities   5", "triangles  2", "spheres    1", "front", "above", "area ", "2 samples"] {
        assert!(out.contains(word), "{word}: {out}");
    }
    let facts = json(folder.path(), &["info", "scene.ron", "--json"]);
    assert_eq!(facts["entities"], 5);
    assert_eq!(facts["cameras"], serde_json::json!(["front", "above"]));
    assert_eq!(facts["lights"].as_array().map(Vec::len), Some(1));
    assert!(facts["memory_bytes"]["bvh"].as_u64() > Some(0));
    assert!(!folder.path().join("scene.png").exists());
}

#[test]
fn saved_scenes_render_identically() {
    let folder = folder();
    let path = folder.path().join("scene.ron");
    let world = rayfront::internals::formats::load(&path).expect("the scene");
    rayfront::internals::formats::ron::save(&world, &folder.path().join("again.ron")).expect("saved");
    let hash = |name: &str| json(folder.path(), &[name, "--json"])["film_hash"].clone();
    assert!(hash("scene.ron").is_string());
    assert_eq!(hash("scene.ron"), hash("again.ron"));
}

#[test]
fn mesh_files_get_a_camera_and_a_light() {
    let folder = folder();
    std::fs::write(folder.path().join("quad.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
        .expect("a file");
    let report = json(folder.path(), &["quad.obj", "--json", "--size", "32x24", "--spp", "1"]);
    assert_eq!(report["triangles"], 2);
    assert!(report["rays"]["shadow"].as_u64() > Some(50));
    assert!(folder.path().join("quad.png").is_file());
}

/// Starts a rendering that takes hours, sends signals in quick succession, and returns its exit code and output.
#[cfg(unix)]
fn interrupted(folder: &Path, prefix: &[&str], signals: &[&str]) -> (Option<i32>, String) {
    let arguments = ["scene.ron", "--size", "320x240", "--spp", "4000000", "--json"];
    let mut child = if prefix.is_empty() {
        command(folder, &arguments)
    } else {
        let plain = command(folder, &arguments);
        let mut with = Command::new(prefix[0]);
        with.args(&prefix[1..]).arg(plain.get_program()).args(plain.get_args()).current_dir(folder);
        with
    }
    .stdout(Stdio::piped())
    .stderr(Stdio::null())
    .spawn()
    .expect("the program runs");
    std::thread::sleep(Duration::from_millis(1500));
    for signal in signals {
        let killed = Command::new("kill").args([*signal, &child.id().to_string()]).status().expect("kill");
        assert!(killed.success(), "the program had ended by itself");
    }
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().expect("a child");
            panic!("it did not stop");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let out = std::io::read_to_string(child.stdout.take().expect("its output")).expect("UTF-8");
    (status.code(), out)
}

#[cfg(unix)]
#[test]
fn signals_end_a_rendering_with_an_image() {
    // Twice in a row, as when a signal is sent to a program and to its group.
    for (signals, code) in [(&["-TERM", "-TERM"][..], 143), (&["-INT", "-INT"], 130)] {
        let folder = folder();
        let (status, _) = interrupted(folder.path(), &[], signals);
        assert_eq!(status, Some(code), "{signals:?}");
        assert!(folder.path().join("scene.png").is_file(), "{signals:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn hangup_ends_a_rendering_except_under_nohup() {
    let folder = folder();
    let (status, _) = interrupted(folder.path(), &["nohup"], &["-HUP", "-TERM"]);
    assert_eq!(status, Some(143));
    // The tests themselves may be run under it.
    let status = std::fs::read_to_string("/proc/self/status").expect("a status");
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).expect("a mask");
    if u64::from_str_radix(ignored.trim(), 16).expect("bits") & 1 == 0 {
        let (status, _) = interrupted(folder.path(), &[], &["-HUP"]);
        assert_eq!(status, Some(129));
        assert!(folder.path().join("scene.png").is_file());
    }
}

#[cfg(unix)]
#[test]
fn interrupted_renderings_save_a_complete_image_and_checkpoint() {
    let folder = folder();
    let (code, out) = interrupted(folder.path(), &[], &["-INT"]);
    assert_eq!(code, Some(130));
    let (width, height, pixels) =
        picture::load_linear(&folder.path().join("scene.png")).expect("a whole image");
    assert_eq!((width, height), (320, 240));
    assert!(pixels.iter().any(|p| p.g > 0.05));
    let report: serde_json::Value = serde_json::from_str(&out).expect("a report");
    assert!(report["samples"].as_u64() < report["samples_asked"].as_u64(), "{out}");
    let left = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert!(folder.path().join("scene.checkpoint.film").is_file(), "to go on from");
    assert_eq!(left, 3, "no temporary file is left");
}
