//! The program as run by users and scripts.

mod manners;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rayfront::math::Rgb;
use serde_json::json;

use super::program::{Place, Words, folder, kill};

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

/// Checks that a run ends with an error of one line and leaves no image.
#[track_caller]
fn refused(here: &Path, code: i32, words: impl Words, parts: &[&str]) {
    let run = here.run(words);
    assert_eq!(run.out, "");
    let error = run.ends(code, parts);
    assert!(code == 2 || error.starts_with("error: ") && error.lines().count() == 1, "{error}");
    let files = std::fs::read_dir(here).expect("a folder").flatten();
    let written = files.filter(|f| f.path().extension().is_some_and(|e| e == "png" || e == "part")).count();
    assert_eq!(written, 0, "{error} left a file behind");
}

#[test]
fn images_have_all_formats_and_a_default_name() {
    let folder = folder(SCENE);
    let out = folder.out("scene.ron");
    assert!(out.contains("scene.png") && out.contains("camera") && out.contains("film"), "{out}");
    assert_eq!(folder.out("scene.ron -o a.exr -o b.hdr -o c.png --quiet"), "");
    let load = |name: &str| {
        let (width, height, pixels) = folder.image(name);
        assert_eq!((width, height), (16, 12), "{name}");
        pixels
    };
    let [exr, hdr, png, default] = ["a.exr", "b.hdr", "c.png", "scene.png"].map(load);
    assert_eq!(png, default);
    assert!(exr.iter().any(|p| p.g > 0.05) && exr.contains(&Rgb::BLACK));
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
    let folder = folder(SCENE);
    let report = folder.json("scene.ron");
    let hash = report["film_hash"].as_str().expect("a hash").to_owned();
    assert_eq!(hash.len(), 32);
    assert_eq!(report["samples"], 4);
    assert_eq!(report["rays"]["camera"], 16 * 12 * 4);
    assert_eq!((&report["spheres"], &report["triangles"]), (&1.into(), &2.into()));
    for more in [
        "--schedule recursive", "--schedule wavefront --wave 3", "--threads 1",
        "--threads 2 --schedule recursive", "--simd portable",
    ] {
        assert_eq!(folder.hash(&format!("scene.ron {more}")), hash, "{more}");
    }
    for more in ["--seed 1", "--spp 5", "--depth 0", "--camera above", "--size 17x12"] {
        assert_ne!(folder.hash(&format!("scene.ron {more}")), hash, "{more}");
    }
}

#[test]
fn crops_sizes_and_tone_curves_apply() {
    let folder = folder(SCENE);
    let render = |name: &str, more: &str| {
        folder.out(&format!("scene.ron -q -o {name} {more}"));
        folder.image(name)
    };
    let (_, _, whole) = render("whole.exr", "");
    let (width, height, part) = render("part.exr", "--crop 3,2,10,9");
    assert_eq!((width, height), (7, 7));
    for y in 0..7 {
        assert_eq!(part[y * 7..][..7], whole[(y + 2) * 16 + 3..][..7], "row {y}");
    }
    let (width, height, _) = render("size.png", "--size 20x10 --spp 1");
    assert_eq!((width, height), (20, 10));
    let (_, _, plain) = render("plain.png", "");
    let (_, _, bright) = render("bright.png", "--exposure 1");
    let (_, _, fine) = render("fine.png", "--exposure=-1 --bits 16");
    let of = |pixels: &[Rgb]| pixels.iter().map(|p| p.g.min(0.5)).sum::<f32>();
    assert!(of(&plain) < of(&bright) && of(&fine) < of(&plain));
    for curve in ["clamp", "scale-by-maximum", "reinhard", "aces", "agx", "pbr-neutral"] {
        let (_, _, toned) = render("toned.png", &format!("--tonemap {curve}"));
        assert_eq!(toned == plain, curve == "clamp", "{curve}");
    }
    // Tone curves do not apply to radiance.
    assert_eq!(render("toned.exr", "--tonemap agx --exposure 2").2, whole);
}

#[test]
fn output_variables_are_saved_as_exr() {
    let here = folder(SCENE);
    let out = here.out("scene.ron --aov depth,entity,material,variance");
    assert!(here.has("scene.png") && here.has("scene.aov.exr"), "{out}");
    assert!(out.contains("aov       depth, entity, material, variance as layers of scene.aov.exr"), "{out}");
    let report = here.json("scene.ron --aov all -o a.exr -o b.png");
    assert_eq!(report["outputs"], json!(["a.exr", "b.png"]));
    assert_eq!(report["aov"][8], "variance");
    assert!(!here.has("a.aov.exr") && !here.has("b.aov.exr"));
    let plain = here.json("scene.ron -o c.exr");
    assert_eq!((&plain["film_hash"], &plain["aov"]), (&report["film_hash"], &json!([])));
    assert_eq!(here.pixels("a.exr"), here.pixels("c.exr"));

    let header =
        exr::meta::MetaData::read_from_file(here.join("a.exr"), true).expect("a header").headers.remove(0);
    let manifest = match header.own_attributes.other.get(&exr::prelude::Text::from("manifest")) {
        Some(exr::meta::attribute::AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{other:?}"),
    };
    let manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
    assert_eq!(manifest["entity.id"], json!({"3": "ball", "4": "floor"}));
    assert_eq!(manifest["material.id"], json!({"1": "default", "2": "material 1"}));

    let scene = SCENE.replace("samples: 4)", "samples: 4, aov: All)");
    here.write("scene.ron", scene);
    assert_eq!(here.json("scene.ron")["aov"].as_array().map(Vec::len), Some(9));
    let none = here.json("scene.ron --aov none");
    assert_eq!((&none["aov"], &none["outputs"]), (&json!([]), &json!(["scene.png"])));
    here.fails(2, "scene.ron --aov deep", &["depth"]);
}

#[test]
fn denoised_images_are_saved_beside_the_others() {
    let here = folder(SCENE);
    let out = here.out("scene.ron --denoise -o a.png -o a.exr");
    assert!(out.contains("denoised  a.denoised.png, a.denoised.exr in"), "{out}");
    let report = |more: &str| here.json(&format!("scene.ron -o b.exr {more}"));
    let (plain, clean) = (report(""), report("--denoise"));
    assert_eq!((&plain["film_hash"], &plain["denoised"]), (&clean["film_hash"], &serde_json::Value::Null));
    assert_eq!(here.pixels("a.exr"), here.pixels("b.exr"));
    assert!(
        here.pixels("a.denoised.exr") == here.pixels("b.denoised.exr")
            && here.pixels("b.denoised.exr") != here.pixels("b.exr")
    );
    // With any schedule, number of threads and instruction set.
    for way in ["--schedule recursive", "--threads 1", "--simd portable"] {
        let other = report(&format!("--denoise {way}"));
        assert_eq!(other["denoised"]["hash"], clean["denoised"]["hash"], "{way}");
    }
    // A crop is denoised by itself, without its surroundings.
    assert!(report("--denoise --crop 3,2,9,7")["denoised"]["hash"].is_string());
    here.run("scene.ron --spp 1 --denoise -o one.png").ends(0, &["--spp 2 or more"]);
    assert!(here.has("one.png") && !here.has("one.denoised.png"));
}

#[test]
fn automatic_exposure_can_be_reused() {
    let here = folder(SCENE);
    let flat = "(settings: (size: (4, 4), samples: 1, background: 720), entities: [(camera: Pinhole())])";
    here.write("flat.ron", flat);
    let report = here.json("flat.ron --exposure auto -q");
    assert_eq!(report["exposure_ev"].as_f64(), Some(f64::from(-11.97f32)), "log2(0.18 / 720)");
    let grey = here.pixels("flat.png")[5].g;
    assert!((grey - 0.18).abs() < 0.003, "{grey}");

    let pixels = |exposure: &str| {
        let out = here.out(&format!("scene.ron -o a.png --exposure={exposure}"));
        (out, here.pixels("a.png"))
    };
    let (out, auto) = pixels("auto");
    let line = out.lines().find(|line| line.starts_with("exposure")).expect("a line about it");
    let chosen = line.rsplit(' ').next().expect("a number");
    assert!(chosen.parse::<f32>().is_ok_and(|ev| ev != 0.0), "{line}");
    assert_eq!(pixels(chosen).1, auto, "{line}");
    assert!(!pixels("0").0.contains("exposure"));
    let brighter = SCENE.replace("samples: 4)", "samples: 4, exposure: Auto, exposure_ev: 1)");
    here.write("scene.ron", brighter);
    let by_scene = here.json("scene.ron")["exposure_ev"].as_f64().expect("a number");
    assert!((by_scene - chosen.parse::<f64>().expect("a number") - 1.0).abs() < 1e-5);
    assert_eq!(pixels("auto").1, auto, "the command line says it all");
}

#[test]
fn errors_in_scenes_are_one_line_with_the_position() {
    let here = folder(SCENE);
    refused(&here, 1, "nowhere.ron", &["nowhere.ron"]);
    refused(&here, 2, "scene.ron --camera side", &["\"side\"", "front, above"]);
    refused(&here, 2, "scene.ron --crop 0,0,17,12", &["16x12"]);
    here.write("scene.txt", SCENE);
    refused(&here, 1, "scene.txt", &[".ron"]);

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
    here.write("long.ron", lines.join("\n"));
    refused(&here, 1, "long.ron", &["long.ron:1500:20: ", "radius_m"]);
    refused(&here, 1, "info long.ron", &["long.ron:1500:20: "]);
}

#[test]
fn errors_on_the_command_line_exit_with_2() {
    let folder = folder(SCENE);
    for line in [
        "", "--no-such-flag", "scene.ron --spp 0", "scene.ron --size 12", "scene.ron --crop 5,5,5,9",
        "scene.ron --simd mmx", "scene.ron --schedule sideways", "scene.ron --bits 12",
        "scene.ron scene.ron", "info",
    ] {
        refused(&folder, 2, line, &[]);
    }
    refused(&folder, 2, "scene.ron --ground white", &["white", "grey", "shadow"]);
    folder.out("--help");
    assert!(folder.out("--version").starts_with("rayfront "));
}

#[test]
fn unwritable_outputs_are_refused_before_rendering() {
    let folder = folder(SCENE);
    // This would take hours.
    for output in ["missing/image.png", "image.gif", "image", "."] {
        let start = Instant::now();
        let line = format!("scene.ron --spp 4000000 --size 2000x2000 -o {output}");
        refused(&folder, 3, &line, &[output]);
        assert!(start.elapsed() < Duration::from_secs(60));
    }
}

#[test]
fn info_lists_the_contents_of_a_scene() {
    let folder = folder(SCENE);
    let out = folder.out("info scene.ron");
    for word in ["entities   5", "triangles  2", "spheres    1", "front", "above", "area ", "2 samples"] {
        assert!(out.contains(word), "{word}: {out}");
    }
    let facts = folder.json("info scene.ron");
    assert_eq!(facts["entities"], 5);
    assert_eq!(facts["cameras"], json!(["front", "above"]));
    assert_eq!(facts["lights"].as_array().map(Vec::len), Some(1));
    assert!(facts["memory_bytes"]["bvh"].as_u64() > Some(0));
    assert!(!folder.has("scene.png"));
}

#[test]
fn saved_scenes_render_identically() {
    let folder = folder(SCENE);
    let world = rayfront::internals::formats::load(folder.join("scene.ron")).expect("the scene");
    rayfront::internals::formats::ron::save(&world, &folder.join("again.ron")).expect("saved");
    assert_eq!(folder.hash("scene.ron"), folder.hash("again.ron"));
}

#[test]
fn mesh_files_get_a_camera_and_a_light() {
    let folder = folder(SCENE);
    folder.write("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
    let report = folder.json("quad.obj --size 32x24 --spp 1");
    assert_eq!(report["triangles"], 2);
    assert!(report["rays"]["shadow"].as_u64() > Some(50));
    assert!(folder.has("quad.png"));
}

/// Starts a rendering that takes hours, by way of `env` or `nohup`, sends signals in quick succession, and returns its exit code and output.
#[cfg(unix)]
fn interrupted(folder: &Path, prefix: &str, signals: &[&str]) -> (Option<i32>, String) {
    let plain = folder.command("scene.ron --size 320x240 --spp 4000000 --json");
    let mut command = Command::new(prefix);
    command.arg(plain.get_program()).args(plain.get_args()).current_dir(folder);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program runs");
    std::thread::sleep(Duration::from_millis(1500));
    for signal in signals {
        assert!(kill(child.id(), signal), "the program had ended by itself");
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
        let folder = folder(SCENE);
        let (status, _) = interrupted(&folder, "env", signals);
        assert_eq!(status, Some(code), "{signals:?}");
        assert!(folder.has("scene.png"), "{signals:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn hangup_ends_a_rendering_except_under_nohup() {
    let folder = folder(SCENE);
    let (status, _) = interrupted(&folder, "nohup", &["-HUP", "-TERM"]);
    assert_eq!(status, Some(143));
    // The tests themselves may be run under it.
    let status = std::fs::read_to_string("/proc/self/status").expect("a status");
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).expect("a mask");
    if u64::from_str_radix(ignored.trim(), 16).expect("bits") & 1 == 0 {
        let (status, _) = interrupted(&folder, "env", &["-HUP"]);
        assert_eq!(status, Some(129));
        assert!(folder.has("scene.png"));
    }
}

#[cfg(unix)]
#[test]
fn interrupted_renderings_save_a_complete_image_and_checkpoint() {
    let folder = folder(SCENE);
    let (code, out) = interrupted(&folder, "env", &["-INT"]);
    assert_eq!(code, Some(130));
    let (width, height, pixels) = folder.image("scene.png");
    assert_eq!((width, height), (320, 240));
    assert!(pixels.iter().any(|p| p.g > 0.05));
    let report: serde_json::Value = serde_json::from_str(&out).expect("a report");
    assert!(report["samples"].as_u64() < report["samples_asked"].as_u64(), "{out}");
    let left = std::fs::read_dir(&folder).expect("a folder").count();
    assert!(folder.has("scene.checkpoint.film"), "to go on from");
    assert_eq!(left, 3, "no temporary file is left");
}
