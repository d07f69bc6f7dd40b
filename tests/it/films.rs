//! Films on disk: interrupted, split or continued renderings have the same bits as uninterrupted ones.

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use base64::prelude::*;
use rayfront::internals::film::Film;
use rayfront::internals::formats::film_file;
use serde_json::Value;

use super::program::{Folder, Place, empty_folder, ended, folder, kill};

/// A scene with everything that depends on the numbering of samples: path reuse, textures with footprints, a lens, and
/// lights of several kinds.
const SCENE: &str = r#"(
    settings: (size: (70, 50), samples: 24, transport: Path, max_depth: 5),
    entities: [
        (name: "camera", camera: ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.05, focus_distance_m: 5),
         transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (name: "ball", shape: Sphere, material: Principled(base_color: (0.8, 0.4, 0.2), roughness: 0.2)),
        (name: "glass", shape: Sphere, material: Principled(metallic: 0, transmission: 1, roughness: 0.1),
         transform: (translate: (1.5, -0.4, 1), scale: 0.5)),
        (name: "floor", shape: Plane(corners: ((-3, -1, -3), (3, -1, -3), (3, -1, 3), (-3, -1, 3))),
         material: Principled(base_color: Image("checks.png"), roughness: 1)),
        (name: "lamp", light: Area(power_w: 300, size_m: 1), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

fn checkered() -> Folder {
    let folder = folder(SCENE);
    let checks =
        image::GrayImage::from_fn(64, 64, |x, y| image::Luma([if (x ^ y) & 1 == 0 { 230 } else { 20 }]));
    checks.save(folder.join("checks.png")).expect("a picture");
    folder
}

#[test]
fn merged_parts_in_any_order_equal_the_whole() {
    let here = checkered();
    let whole = here.hash("scene.ron -o whole.png --aov variance");
    for (count, ways) in [
        (1, &["--threads 2"][..]),
        (2, &["--simd portable", "--threads 1"]),
        (7, &["--wave 7", "--schedule recursive", "--threads 3"]),
    ] {
        let mut parts = Vec::new();
        for index in 0..count {
            let (film, way) = (format!("part-{count}-{index}.film"), ways[index % ways.len()]);
            here.json(&format!("scene.ron --aov variance --shard {index}/{count} -o {film} {way}"));
            parts.insert(index * 5 % (parts.len() + 1), film);
        }
        let merged = here.json(&format!("merge {} -o merged.exr -o merged.film", parts.join(" ")));
        assert_eq!(merged["film_hash"], whole[..], "{count} parts");
        assert_eq!((&merged["samples"], &merged["missing"]), (&24.into(), &"".into()));
        // A complete film needs no rendering and gives the same image.
        let again = here.json("resume merged.film -o again.exr");
        assert_eq!((&again["film_hash"], &again["rays"]["camera"]), (&whole.clone().into(), &0.into()));
    }
    let equal = here.run("compare merged.exr again.exr --json");
    assert!(equal.out.contains("\"mse\":0.0"), "{}", equal.out);
    // As many parts as samples, through a pipe.
    let mut input = Vec::new();
    for index in [3, 0, 2, 1] {
        let mut part = here.command(&format!("scene.ron --spp 4 --shard {index}/4 -o - --quiet"));
        input.extend(part.output().expect("a film").stdout);
    }
    let mut merge = here.command("merge - -o piped.png --json");
    let mut merge = merge.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program runs");
    std::io::Write::write_all(&mut merge.stdin.take().expect("a pipe"), &input).expect("the pipe takes it");
    let merged: Value =
        serde_json::from_slice(&merge.wait_with_output().expect("an end").stdout).expect("JSON");
    assert_eq!(merged["film_hash"], here.hash("scene.ron --spp 4 -o four.png")[..]);
}

#[test]
fn merge_reports_missing_samples_and_refuses_other_films() {
    let here = checkered();
    for index in [0, 2, 3] {
        here.json(&format!("scene.ron --shard {index}/4 -o part-{index}.film"));
    }
    let parts = "merge part-0.film part-3.film part-2.film -o a.png";
    let error = here.fails(1, parts, &["6..12 of 24 are missing"]);
    let command =
        error.lines().last().expect("a command").trim().strip_prefix("rayfront ").expect("a command");
    assert!(command.ends_with("--shard 1/4 -o part-1.film"), "{command}");
    let partial = here.json(&format!("{parts} --partial"));
    assert_eq!((&partial["samples"], &partial["missing"]), (&18.into(), &"6..12".into()));
    here.out(command);
    let whole = here.hash("merge part-0.film part-3.film part-2.film part-1.film -o a.png");
    assert_eq!(whole, here.hash("scene.ron -o b.png"));

    here.fails(1, "merge part-0.film part-1.film part-0.film", &["part-0.film has samples 0..6, too"]);
    here.json("scene.ron --shard 1/4 --seed 3 -o other.film");
    here.fails(1, "merge part-0.film other.film", &["other.film: of other settings: seed is 3, not 0"]);
    // Another image of the same name.
    image::GrayImage::new(64, 64).save(here.join("checks.png")).expect("a picture");
    here.json("scene.ron --shard 1/4 -o changed.film");
    here.fails(1, "merge part-0.film changed.film", &["of another scene: checks.png differs"]);
    here.fails(1, "resume part-0.film", &["of another scene: checks.png differs"]);
    here.fails(3, "scene.ron --shard 0/4 -o part-0.film", &["checks.png differs: --overwrite"]);
}

#[test]
fn resumed_films_equal_longer_renderings() {
    let here = checkered();
    let elsewhere = "--size 40x60 --orbit 30,10 --zoom 0.5 --ground --hide '\"glass\"'";
    for options in ["", "--sampler independent --sharing off", "--sharing 8", elsewhere] {
        let film = format!("a{}.film", options.len());
        for (i, spp) in [3, 5, 24].into_iter().enumerate() {
            let line = match i {
                0 => format!("scene.ron {options} --spp {spp} -o {film}"),
                _ => format!("resume {film} --spp {spp}"),
            };
            let whole = here.hash(&format!("scene.ron {options} --spp {spp} -o b.png"));
            assert_eq!(here.hash(&line), whole, "{line}");
        }
    }
    here.json("scene.ron --sampler jittered --spp 4 -o grid.film");
    here.fails(2, "resume grid.film --spp 8", &["grid", "render it anew"]);
    here.fails(2, "resume a0.film --spp 8", &["24 samples"]);
}

/// Copies a film with a difference of one quantum in one pixel.
fn forge(from: &Path, to: &Path, pixel: usize) {
    let mut forged = film_file::load(from).expect("a film");
    let mut pixels = forged.film.pixels().to_vec();
    pixels[pixel].sum[0][1] += 1;
    forged.film = Film::with_pixels(forged.film.region(), forged.film.unit(), pixels).expect("a film");
    forged.header.set_film(&forged.film, None);
    film_file::save(to, &forged.header, &forged.film, None).expect("saved");
}

#[test]
fn audit_detects_a_single_altered_quantum() {
    let here = checkered();
    here.json("scene.ron --shard 0/2 -o a.film");
    here.json("scene.ron --shard 1/2 -o b.film");
    let sound = here.json("merge a.film b.film --audit 100%");
    assert_eq!(
        sound["audited"][0],
        serde_json::json!({"film": "a.film", "hosts": sound["hosts"], "tiles": 20, "differing": 0})
    );
    forge(&here.join("b.film"), &here.join("b.film"), 70 * 20 + 35);
    here.fails(5, "merge a.film b.film --audit 100%", &["b.film (rendered on", "1 of 20 tiles"]);
}

/// After an interrupted pass only some tiles have its samples; an audit renders these again, too.
#[cfg(unix)]
#[test]
fn audit_checks_tiles_of_interrupted_passes() {
    let here = checkered();
    let path = here.join("a.film");
    // The first and the last tile of the image are 64 pixels wide and far apart.
    let line = "scene.ron --size 320x100 --spp 4000 -o a.film --checkpoint 10ms --quiet --threads 1";
    let begun = loop {
        assert_eq!(stopped("-TERM", Duration::ZERO, &here, line, "a.film"), Some(143));
        let film = film_file::load(&path).expect("a film");
        match film.header.begun.filter(|begun| !begun.tiles.is_empty()) {
            Some(begun) => break begun,
            None => std::fs::remove_file(&path).expect("it is there"),
        }
    };
    let sound = here.json("merge a.film --partial --audit 100% -o a.png");
    assert_eq!((&sound["audited"][0]["tiles"], &sound["audited"][0]["differing"]), (&140.into(), &0.into()));
    // A difference of one quantum in a tile with the samples, and in tiles without them.
    let columns = 320_u32.div_ceil(begun.tile);
    let all = 0..columns * 100_u32.div_ceil(begun.tile);
    let (with, without): (Vec<u32>, Vec<u32>) = all.partition(|tile| begun.tiles.contains(tile));
    for tile in with.first().into_iter().chain(&without) {
        let (column, row) = (tile % columns, tile / columns);
        let pixel = row * begun.tile * 320 + column * begun.tile;
        forge(&path, &here.join("b.film"), pixel as usize);
        here.fails(5, "merge b.film --partial --audit 100%", &["1 of 140 tiles differ"]);
    }
}

#[test]
fn stop_rules_print_a_command_for_the_same_image() {
    let here = checkered();
    let stopped = here.json("scene.ron --spp 4096 --until noise=40% -o a.png -o a.film");
    let samples = stopped["samples"].as_u64().expect("a number");
    assert!(
        samples < 4096 && stopped["stopped_by"].as_str().is_some_and(|rule| rule.contains("noise")),
        "{stopped}"
    );
    assert_eq!(stopped["film_hash"], here.hash(&format!("scene.ron --spp {samples} -o b.png"))[..]);
    let text = here.out("scene.ron --spp 4096 --until noise=40% -o a2.png");
    let (_, line) = text.split_once("the same image: rayfront ").expect(&text);
    let line = line.lines().next().expect("a line");
    assert_eq!(stopped["film_hash"], here.hash(&format!("{line} -o b.png"))[..]);
    let timed = here.json("scene.ron --spp 4194304 --max-time 300ms -o c.png");
    assert!(timed["stopped_by"].as_str().is_some_and(|rule| rule.contains("time")), "{timed}");
    // The film is continued.
    let more = here.json("resume a.film --until noise=10%");
    assert!(more["samples"].as_u64() > Some(samples), "{more}");
}

/// Ends a rendering by a signal some time after it has saved a film, or after its start if `film` is empty. Returns its
/// exit code.
fn stopped(signal: &str, time: Duration, here: &Path, line: &str, film: &str) -> Option<i32> {
    let mut child = here.command(line).spawn().expect("the program runs");
    while !here.has(film) {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(time);
    kill(child.id(), signal);
    child.wait().expect("an end").code()
}

/// [`stopped`], and continues the rendering. Returns its exit code, its hash, and true if there was a film.
fn after(signal: &str, has_film: bool, time: Duration, here: &Path) -> (Option<i32>, String, bool) {
    let _ = std::fs::remove_file(here.join("a.film"));
    let line = "scene.ron --size 96x64 --spp 96 -o a.film --checkpoint 5ms --quiet";
    let code = stopped(signal, time, here, line, if has_film { "a.film" } else { "" });
    let is_there = here.has("a.film");
    let line = if is_there { "resume a.film -o a.png" } else { &line.replace("--quiet", "") };
    (code, here.hash(line), is_there)
}

#[cfg(unix)]
#[test]
fn killed_renderings_resume_to_the_same_film() {
    let here = checkered();
    let start = Instant::now();
    let expected = here.hash("scene.ron --size 96x64 --spp 96 -o whole.png");
    let time = start.elapsed();
    let mut gone_on_with = 0;
    for moment in 0..30u32 {
        // Pseudo-random and all different.
        let part = f64::from(moment.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX);
        let has_film = moment % 2 == 0;
        let wait = if has_film { time.mul_f64(0.5 * part) } else { time.mul_f64(part) };
        let (_, found, is_there) = after("-KILL", has_film, wait, &here);
        assert_eq!(found, expected, "killed after {part} of the time");
        gone_on_with += u32::from(is_there);
    }
    assert!(gone_on_with >= 15, "{gone_on_with} of 30 left a film behind");
    for (signal, code) in [("-TERM", 143), ("-INT", 130)] {
        let (found, hash, is_there) = after(signal, true, Duration::ZERO, &here);
        assert!(is_there && hash == expected, "{signal}");
        assert!(found == Some(code) || found == Some(0), "{signal}: {found:?}");
    }
}

/// A full disk while a checkpoint is written, simulated by a limit on the size of files.
#[cfg(target_os = "linux")]
#[test]
fn full_disk_keeps_the_previous_checkpoint() {
    let here = checkered();
    here.json("scene.ron --spp 8 -o a.film");
    let before = here.bytes("a.film");
    let limit = before.len() / 2 / 512;
    let line = "resume a.film --spp 64 -o a.png --checkpoint 1ms --threads 1 --quiet";
    let run = here.shell(&format!("trap '' XFSZ; ulimit -f {limit}; rayfront {line}"));
    run.ends(3, &["warning: a.film: cannot write", "goes on"]);
    assert_eq!(here.bytes("a.film"), before);
    assert_eq!(here.hash("resume a.film --spp 64"), here.hash("scene.ron --spp 64 -o b.png"));
}

#[test]
fn images_are_reproduced_from_their_metadata() {
    let here = checkered();
    let names = ["a.png", "a.exr", "a.hdr", "a.film"];
    let line = "scene.ron --crop 10,5,40,45 --sampler jittered --seed 4 --spp 3";
    here.json(&format!("{line} --denoise -o a.png -o a.exr -o a.hdr -o a.film"));
    for name in names.into_iter().chain(["a.denoised.exr"]) {
        let found = here.json(&format!("reproduce {name} --schedule recursive"));
        assert_eq!(found["identical"], true, "{name}: {found}");
    }
    // The same image is the same file, whoever rendered it and in however many parts.
    let before = ["a.png", "a.exr", "a.hdr"].map(|name| here.bytes(name));
    (0..2).for_each(|i| drop(here.json(&format!("{line} --threads 1 --shard {i}/2 -o part-{i}.film"))));
    here.json("merge part-1.film part-0.film -o a.png -o a.exr -o a.hdr");
    let after = ["a.png", "a.exr", "a.hdr"].map(|name| here.bytes(name));
    assert!(before == after);
    // An image with other pixels still has the original metadata.
    let bytes = here.bytes("a.png");
    let reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a picture");
    let mut info = png::Info::with_size(reader.info().width, reader.info().height);
    (info.color_type, info.bit_depth) = (reader.info().color_type, reader.info().bit_depth);
    info.uncompressed_latin1_text = reader.info().uncompressed_latin1_text.clone();
    let black = vec![0; reader.output_buffer_size().expect("a size")];
    let file = std::fs::File::create(here.join("black.png")).expect("a file");
    let mut writer = png::Encoder::with_info(file, info).expect("a header").write_header().expect("a header");
    writer.write_image_data(&black).expect("pixels");
    writer.finish().expect("an end");
    let run = here.run("reproduce black.png");
    assert_eq!((run.code, run.out.contains("its pixels are others")), (Some(5), true), "{}", run.out);
    // The error names the changed file.
    let scene = here.text("scene.ron");
    here.write("scene.ron", scene.replace("power_w: 300", "power_w: 301"));
    here.fails(1, "reproduce a.png", &["of another scene: scene.ron differs"]);
    image::GrayImage::new(4, 4).save(here.join("plain.png")).expect("a picture");
    here.fails(1, "reproduce plain.png", &["does not say how it was rendered"]);
}

#[cfg(unix)]
#[test]
fn interrupted_renderings_are_reproduced() {
    let here = checkered();
    let line = "scene.ron --size 320x200 --spp 4000 -o a.exr -o a.film --checkpoint 20ms --quiet";
    assert_eq!(stopped("-TERM", Duration::ZERO, &here, line, "a.film"), Some(143));
    for name in ["a.exr", "a.film"] {
        let found = here.json(&format!("reproduce {name}"));
        assert_eq!(found["identical"], true, "{name}: {found}");
    }
}

#[cfg(unix)]
#[test]
fn planned_commands_run_in_a_shell() {
    let folder = checkered();
    let here = folder.join("it's a $cene; & so on");
    std::fs::create_dir(&here).expect("a folder");
    for name in ["scene.ron", "checks.png"] {
        std::fs::copy(folder.join(name), here.join(name)).expect("a copy");
    }
    let plan = "plan scene.ron --shards 3 --for commands --output out.png -- --spp 6 --size 40x30";
    here.out(plan);
    let lines = here.text("scene.jobs/parts.txt");
    assert_eq!(lines.lines().count(), 3);
    for line in lines.lines() {
        // In any folder.
        folder.shell(line).ends(0, &[]);
    }
    folder.shell("sh \"it's a \\$cene; & so on/scene.jobs/merge.sh\"").ends(0, &[]);
    assert!(here.has("out.png"));
    let parts = (0..3).map(|i| format!("scene.jobs/part-{i}.film")).collect::<Vec<_>>().join(" ");
    let whole = here.hash("scene.ron --spp 6 --size 40x30 -o whole.png");
    assert_eq!(here.hash(&format!("merge {parts}")), whole);
    // Frames need no merging, and each belongs to a task.
    let plan = "plan scene.ron --for commands -o f.##.png -- --frames 3-7x4,12 --spp 2 --size 40x30";
    here.out(plan);
    let lines = here.text("scene.jobs/parts.txt");
    for line in lines.lines() {
        folder.shell(line).ends(0, &[]);
    }
    for frame in ["f.03.png", "f.07.png", "f.12.png"] {
        assert!(here.has(frame), "{frame}");
    }
    let told = here.messages("scene.ron --frames 1-3 --spp 1 --size 40x30 -o h.#.png");
    let told = told.matches("every moment looks the same").count();
    assert_eq!(told, 1, "what is told once need not be told for every frame");
    let task = |number: &str| {
        let mut task = here.command("scene.ron --frames auto/3-7x4,12 --spp 2 --size 40x30 -o g.##.png");
        ended(task.env("SLURM_ARRAY_TASK_ID", number))
    };
    task("1").ends(0, &[]);
    assert!(here.pixels("g.07.png") == here.pixels("f.07.png") && !here.has("g.03.png"));
    task("3").ends(2, &["there are 3, from 0 on"]);
    here.fails(2, "plan scene.ron --for slurm -o f.png -- --frames 1-2", &["####"]);
    here.fails(2, "plan scene.ron --shards 25 --for slurm", &["there are 24 samples"]);
    here.fails(2, "plan scene.ron --shards 2 --for slurm -- --sppp 3", &["--sppp"]);
}

/// Adaptive samples do not depend on the way of rendering or on interruptions, and can be continued.
#[cfg(unix)]
#[test]
fn adaptive_samples_are_identical_in_all_ways() {
    let here = checkered();
    let line = "scene.ron --adaptive --spp 32 --aov samples";
    let expected = here.hash(&format!("{line} -o a.exr"));
    assert_ne!(expected, here.hash("scene.ron --spp 32 -o b.exr"));
    for way in ["--schedule recursive --threads 1", "--wave 7 --simd portable", "--threads 3"] {
        assert_eq!(here.hash(&format!("{line} {way} -o b.exr")), expected, "{way}");
    }
    let verified = here.json("verify scene.ron --adaptive --size 48x40 --spp 32");
    assert_eq!(verified["mismatches"], 0, "{verified}");
    assert_eq!(here.json("reproduce a.exr")["identical"], true);
    // Killed and continued.
    let longer = "scene.ron --adaptive --aov samples --size 120x80 --spp 64 -o long.film";
    let whole = here.hash(longer);
    for moment in [0, 50, 150] {
        std::fs::remove_file(here.join("long.film")).expect("a film");
        let line = format!("{longer} --checkpoint 2ms --quiet");
        stopped("-KILL", Duration::from_millis(moment), &here, &line, "long.film");
        assert_eq!(here.hash("resume long.film"), whole, "after {moment} ms");
    }
    for (line, code) in [
        ("scene.ron --adaptive --spp 32 --shard 0/2", 2),
        ("resume long.film --spp 128", 2),
        ("merge long.film", 1),
    ] {
        here.fails(code, line, &["adaptive"]);
    }
}

/// A default checkpoint exists as long as there is something to continue.
#[cfg(unix)]
#[test]
fn default_checkpoint_is_removed_when_the_image_is_done() {
    let here = checkered();
    let line = "scene.ron --size 160x120 --spp 64 -o a.png --checkpoint 2ms --threads 1 --quiet";
    let checkpoint = here.join("a.checkpoint.film");
    stopped("-KILL", Duration::ZERO, &here, line, "a.checkpoint.film");
    assert!(!here.has("a.png"));
    // Another rendering with the same output does not touch it.
    let before = std::fs::read(&checkpoint).expect("a film");
    let other = here.run("scene.ron --spp 2 -o a.png --checkpoint 1ms");
    other.ends(0, &["this rendering is saved to a.checkpoint-"]);
    assert!(std::fs::read(&checkpoint).expect("a film") == before);
    // Interrupted, that one has a checkpoint of its own, which the same command continues.
    let interrupted = "scene.ron --size 160x120 --spp 4096 -o a.png --threads 1";
    let child = here.command(interrupted).stderr(Stdio::piped()).spawn().expect("the program runs");
    std::thread::sleep(Duration::from_millis(700));
    kill(child.id(), "-TERM");
    let output = child.wait_with_output().expect("an end");
    let text = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(143));
    assert!(text.contains("to go on: rayfront resume a.checkpoint-"), "{text}");
    here.run(&format!("{interrupted} --max-time 1ms")).ends(0, &["going on with"]);
    std::fs::remove_file(here.join("a.png")).expect("an image");
    // Stopped before its end, it keeps its checkpoint.
    here.json("resume a.checkpoint.film --max-time 1ms");
    assert!(checkpoint.exists() && here.has("a.png"));
    let whole = here.hash("scene.ron --size 160x120 --spp 64 -o b.png");
    // The same command continues it, too.
    let again = here.run(&line.replace("--quiet", "--json"));
    let found: Value = serde_json::from_str(&again.out).expect("JSON");
    assert_eq!(found["film_hash"], whole[..]);
    again.ends(0, &["going on with"]);
    assert!(!checkpoint.exists());
}

/// A square of one metre that emits 2 and moves from x = −1 to 1 within a second, in front of an orthographic camera
/// with a view of 4 × 4 metres.
fn moving() -> String {
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    let corners = floats(&[-0.5, -0.5, 0.0, 0.5, -0.5, 0.0, 0.5, 0.5, 0.0, -0.5, 0.5, 0.0]);
    let indices: Vec<u8> = [0u16, 1, 2, 0, 2, 3].iter().flat_map(|n| n.to_le_bytes()).collect();
    let (times, places) = (floats(&[0.0, 1.0]), floats(&[-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    let bytes = [corners, indices, times, places].concat();
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "extensionsUsed": ["KHR_materials_emissive_strength"], "scene": 0, "scenes": [{{"nodes": [0, 1]}}],
        "nodes": [{{"mesh": 0}}, {{"camera": 0, "translation": [0, 0, 5]}}],
        "cameras": [{{"type": "orthographic", "orthographic": {{"xmag": 2, "ymag": 2, "znear": 0.1, "zfar": 10}}}}],
        "materials": [{{"emissiveFactor": [1, 1, 1], "extensions": {{"KHR_materials_emissive_strength": {{"emissiveStrength": 2}}}},
                        "pbrMetallicRoughness": {{"baseColorFactor": [0, 0, 0, 1]}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "material": 0}}]}}],
        "animations": [{{"channels": [{{"sampler": 0, "target": {{"node": 0, "path": "translation"}}}}],
                         "samplers": [{{"input": 2, "output": 3}}]}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-0.5, -0.5, 0], "max": [0.5, 0.5, 0]}},
            {{"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}},
            {{"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]}},
            {{"bufferView": 3, "componentType": 5126, "count": 2, "type": "VEC3"}}],
        "bufferViews": [
            {{"buffer": 0, "byteOffset": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 12}},
            {{"buffer": 0, "byteOffset": 60, "byteLength": 8}}, {{"buffer": 0, "byteOffset": 68, "byteLength": 24}}],
        "buffers": [{{"byteLength": 92, "uri": "data:application/octet-stream;base64,{}"}}]}}"#,
        BASE64_STANDARD.encode(bytes)
    )
}

#[test]
fn motion_blur_follows_the_time_of_coverage() {
    let here = empty_folder();
    here.write("moving.gltf", moving());
    let scene = r#"(settings: (transport: Path), entities: [(gltf: "moving.gltf")])"#;
    here.write("scene.ron", scene);
    let scene = r#"(settings: (transport: Path), entities: [
        (camera: Orthographic(height_m: 4), transform: (translate: (0, 0, 5))),
        (shape: Plane(corners: ((-0.5, -0.5, 0), (-0.5, 0.5, 0), (0.5, 0.5, 0), (0.5, -0.5, 0))),
         material: Principled(base_color: 0, emission: 2), transform: (translate: Keys([(0, (-1, 0, 0)), (1, (1, 0, 0))])))])"#;
    here.write("keys.ron", scene);
    let red = |name: &str| {
        let (width, _, pixels) = here.image(name);
        let row = pixels[8 * width as usize..9 * width as usize].to_vec();
        row.iter().map(|pixel| pixel.r / 2.0).collect::<Vec<f32>>()
    };
    for file in ["moving.gltf", "scene.ron", "keys.ron"] {
        // Pixels are a quarter of a metre wide. At half a second the square is at the centre.
        let options = "--size 16x16 --spp 32";
        let name = file.replace('.', "-");
        here.out(&format!("{file} {options} --fps 4 --frames 0-4x2 -o {name}.##.exr --quiet"));
        let (first, middle) = (red(&format!("{name}.00.exr")), red(&format!("{name}.02.exr")));
        assert!(first[4] > 0.99 && first[9] < 0.01, "{first:?}");
        assert!(middle[8] > 0.99 && middle[3] < 0.01, "{middle:?}");
        // With the shutter open for the whole second, each place inside is covered for half of it.
        let blur = format!("{file} {options} --time 0 --fps 1 --shutter 1");
        let whole = here.hash(&format!("{blur} -o {name}.exr -o {name}.film"));
        let blurred = red(&format!("{name}.exr"));
        let is_blurred = |blurred: &[f32], margin: f32| {
            for (x, expected) in [(7, 0.5), (8, 0.5), (5, 0.4375), (10, 0.4375), (0, 0.0), (15, 0.0)] {
                assert!((blurred[x] - expected).abs() < margin, "{file} at {x}: {blurred:?}");
            }
        };
        is_blurred(&blurred, 0.07);
        // A quarter of the samples also covers the whole time; fewer cause a warning.
        for (range, few) in [("0..32", false), ("0..16", true)] {
            let line = format!("{blur} --spp 128 --samples {range} -o early.exr --quiet");
            let text = here.messages(&line.replace("--spp 32 ", ""));
            assert_eq!(text.contains("motion is blurred by 8 of 16 moments"), few, "{text}");
            is_blurred(&red("early.exr"), if few { 0.25 } else { 0.2 });
        }
        here.fails(2, &format!("resume {name}.film --spp 64"), &["render it anew with --spp 64"]);
        // In parts, and repeated.
        for index in 0..3 {
            here.json(&format!("{blur} --shard {index}/3 -o {name}-{index}.film --overwrite"));
        }
        let parts = (0..3).map(|i| format!("{name}-{i}.film")).collect::<Vec<_>>().join(" ");
        assert_eq!(here.hash(&format!("merge {parts} --audit 100%")), whole);
        assert_eq!(here.json(&format!("reproduce {name}.exr"))["identical"], true);
        assert_eq!(here.hash(&format!("resume {name}.film")), whole);
    }
    // All frames as a video: each shows the same as its image.
    let mut video = here.command("keys.ron --size 16x16 --spp 32 --fps 4 --frames 0-4x2 -o - -o again.#.png");
    let video = video.output().expect("a video");
    let header = b"YUV4MPEG2 W16 H16 F4:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
    let stream = video.stdout.strip_prefix(header).expect("a video");
    let frames: Vec<&[u8]> = stream.chunks(6 + 3 * 256).collect();
    assert_eq!((frames.len(), stream.len()), (3, 3 * (6 + 3 * 256)));
    for (frame, number) in frames.iter().zip([0, 2, 4]) {
        let pixels = here.pixels(&format!("again.{number}.png"));
        let luma = frame.strip_prefix(b"FRAME\n").expect("a frame");
        for (luma, pixel) in luma.iter().zip(&pixels) {
            let shown = rayfront::internals::film::tonemap::srgb_encode(pixel.r);
            assert!((f32::from(*luma) - 16.0 - 219.0 * shown).abs() < 1.0, "{luma} for {pixel:?}");
        }
    }
    // Existing frames are kept.
    let modified =
        || here.join("moving-gltf.02.exr").metadata().expect("a frame").modified().expect("a time");
    let before = modified();
    let again = here.run("moving.gltf --size 16x16 --spp 32 --fps 4 --frames 2 -o moving-gltf.##.exr");
    again.ends(0, &["frame 2 is there"]);
    assert_eq!(before, modified());
    here.fails(2, "moving.gltf --frames 1-2 -o a.png", &["####"]);
}

/// Sample counts chosen by a pilot can be rendered anywhere, in parts and in any order.
#[cfg(unix)]
#[test]
fn unbiased_adaptive_renderings_can_be_split_into_parts() {
    let here = checkered();
    let options = "scene.ron --adaptive=unbiased --size 72x56 --seed 5";
    let line = format!("{options} --spp 64");
    let expected = here.hash(&format!("{line} -o whole.png -o whole.film"));
    for way in ["--schedule recursive --threads 1", "--wave 7 --simd portable --threads 3"] {
        assert_eq!(here.hash(&format!("{line} {way} -o b.exr")), expected, "{way}");
    }
    assert_ne!(here.hash("scene.ron --spp 64 --size 72x56 --seed 5 -o b.exr"), expected);
    assert_eq!(here.json("reproduce whole.png")["identical"], true);
    // With a saved pilot, or each part with its own.
    here.out(&format!("{line} --pilot pilot.film --pilot-only"));
    let of_pilot = here.json(&format!("{line} --pilot pilot.film -o b.exr"));
    assert_eq!(of_pilot["film_hash"], expected);
    for (index, pilot) in [(2, "--pilot pilot.film"), (0, ""), (1, "--pilot pilot.film")] {
        here.json(&format!("{line} {pilot} --shard {index}/3 -o part-{index}.film"));
    }
    assert_eq!(here.hash("merge part-1.film part-2.film part-0.film --audit 100%"), expected);
    here.fails(1, "merge part-0.film part-2.film", &["are missing", "--shard 1/3"]);
    // A crop uses the choice for the whole image.
    here.json(&format!("{line} --pilot pilot.film -o whole.exr"));
    here.json(&format!("{line} --pilot pilot.film --crop 21,9,60,50 -o crop.exr"));
    let (whole, crop) = (here.pixels("whole.exr"), here.pixels("crop.exr"));
    let rows = (9..50).flat_map(|y| whole[y * 72 + 21..y * 72 + 60].iter().copied());
    assert!(rows.eq(crop), "the crop shows other pixels");
    // Killed midway and continued.
    let long = format!("{options} --spp 512");
    let saved = format!("{long} -o long.film --checkpoint 2ms --quiet");
    stopped("-KILL", Duration::from_millis(30), &here, &saved, "long.film");
    assert_eq!(here.hash("resume long.film"), here.hash(&format!("{long} -o other.film")));
    // A pilot of another rendering is refused.
    let other = line.replace("--seed 5", "--seed 6");
    here.fails(1, &format!("{other} --pilot pilot.film -o b.png"), &["pilot.film", "seed is 5, not 6"]);
    here.fails(2, "scene.ron --pilot pilot.film -o b.png", &["--adaptive=unbiased"]);
    let options = line.strip_prefix("scene.ron").expect("options");
    here.out(&format!("plan scene.ron --shards 2 --for commands -o p.png -- {options}"));
    let jobs = here.join("scene.jobs");
    let parts = jobs.text("parts.txt");
    let pilot = jobs.text("pilot.sh");
    for line in std::iter::once(pilot.lines().last().expect("a command")).chain(parts.lines()) {
        Path::new("/").shell(line).ends(0, &[]);
    }
    assert_eq!(here.hash("merge scene.jobs/part-0.film scene.jobs/part-1.film"), expected);
}

/// After any number of tiles of a pass or round, continuing gives the same result.
#[test]
fn renderings_can_be_interrupted_after_any_tile() {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    use rayfront::internals::integrator::Stop;
    use rayfront::render::{Options, Session};
    use rayfront::world::Adaptive;

    for adaptive in [Adaptive::Off, Adaptive::On, Adaptive::Unbiased] {
        let mut world = rayfront::internals::formats::load(checkered().join("scene.ron")).expect("a scene");
        world.settings.size = [40, 30];
        (world.settings.samples, world.settings.adaptive) = (64, adaptive);
        let scene = rayfront::compile::compile(&world, None).expect("a scene");
        let setup = std::sync::Arc::new(rayfront::internals::render::setup(scene, &world.settings));
        let session =
            || Session::of(setup.clone(), 64, Options { tile: 16, variance: true, ..Options::default() });
        let finish = |mut session: Session| {
            while !session.is_done() {
                session.advance(16);
            }
            session.state().clone()
        };
        let whole = finish(session());
        let mut in_rounds = 0;
        for tiles in 1..30 {
            let (stop, done) = (AtomicBool::new(false), AtomicUsize::new(0));
            let mut interrupted = session();
            while !stop.load(Ordering::Relaxed) && !interrupted.is_done() {
                interrupted.advance_until(16, &Stop::at(&stop), &|_| {
                    stop.store(done.fetch_add(1, Ordering::Relaxed) + 1 >= tiles, Ordering::Relaxed);
                });
            }
            let gathered = interrupted.state().clone();
            in_rounds += u32::from(gathered.pass.as_ref().is_some_and(|pass| pass.blocks.is_some()));
            let mut again = session();
            assert!(again.resume_from(gathered));
            assert!(finish(again) == whole, "after {tiles} tiles, adaptive {adaptive:?}");
        }
        assert_eq!(in_rounds > 3, adaptive != Adaptive::Off, "{in_rounds}");
    }
}
