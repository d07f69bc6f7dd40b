//! Films on disk: what is interrupted, cut into parts or gone on with has the bits of what is rendered in one
//! go.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Everything that depends on how samples are numbered: paths that are shared, textures by their footprints,
/// a lens, lights of many kinds.
const SCENE: &str = r#"(
    settings: (size: (70, 50), samples: 24, transport: Path, max_depth: 5),
    entities: [
        (name: "camera", camera: ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.05, focus_distance_m: 5),
         transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (name: "ball", shape: Sphere, material: Principled(base_color: (0.8, 0.4, 0.2), roughness: 0.2)),
        (name: "glass", shape: Sphere, material: Principled(transmission: 1, roughness: 0.1),
         transform: (translate: (1.5, -0.4, 1), scale: 0.5)),
        (name: "floor", shape: Plane(corners: ((-3, -1, -3), (3, -1, -3), (3, -1, 3), (-3, -1, 3))),
         material: Principled(base_color: Image("checks.png"), roughness: 1)),
        (name: "lamp", light: Area(power_w: 300, size_m: 1), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.ron"), SCENE).expect("a scene");
    let checks =
        image::GrayImage::from_fn(64, 64, |x, y| image::Luma([if (x ^ y) & 1 == 0 { 230 } else { 20 }]));
    checks.save(folder.path().join("checks.png")).expect("a picture");
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

fn run(folder: &Path, line: &str) -> Output {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    command(folder, &arguments).output().expect("the program runs")
}

#[track_caller]
fn json(folder: &Path, line: &str) -> Value {
    let output = run(folder, &format!("{line} --json"));
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{line}: {error}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{line}: {error}"))
}

#[track_caller]
fn hash(folder: &Path, line: &str) -> String {
    json(folder, line)["film_hash"].as_str().expect("a hash").to_owned()
}

#[track_caller]
fn failure(folder: &Path, line: &str) -> String {
    let output = run(folder, line);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{line}: {error}");
    assert!(error.starts_with("error: "), "{line}: {error}");
    error
}

#[test]
fn parts_in_any_order_are_the_whole() {
    let folder = folder();
    let here = folder.path();
    let whole = hash(here, "scene.ron -o whole.png --aov variance");
    for (count, ways) in [
        (1, &["--threads 2"][..]),
        (2, &["--simd portable", "--threads 1"]),
        (7, &["--wave 7", "--schedule recursive", "--threads 3"]),
    ] {
        let mut parts = Vec::new();
        for index in 0..count {
            let (film, way) = (format!("part-{count}-{index}.film"), ways[index % ways.len()]);
            json(here, &format!("scene.ron --aov variance --shard {index}/{count} -o {film} {way}"));
            parts.insert(index * 5 % (parts.len() + 1), film);
        }
        let merged = json(here, &format!("merge {} -o merged.exr -o merged.film", parts.join(" ")));
        assert_eq!(merged["film_hash"], whole[..], "{count} parts");
        assert_eq!((&merged["samples"], &merged["missing"]), (&24.into(), &"".into()));
        // A film that is whole needs no rendering, and shows the same.
        let again = json(here, "resume merged.film -o again.exr");
        assert_eq!((&again["film_hash"], &again["rays"]["camera"]), (&whole.clone().into(), &0.into()));
    }
    let equal = run(here, "compare merged.exr again.exr --json");
    assert!(
        String::from_utf8_lossy(&equal.stdout).contains("\"mse\":0.0"),
        "{}",
        String::from_utf8_lossy(&equal.stdout)
    );
    // As many parts as samples, through a pipe.
    let mut input = Vec::new();
    for index in [3, 0, 2, 1] {
        let part = run(here, &format!("scene.ron --spp 4 --shard {index}/4 -o - --quiet"));
        assert_eq!(part.status.code(), Some(0));
        input.extend(part.stdout);
    }
    let mut merge = command(here, &["merge", "-", "-o", "piped.png", "--json"]);
    let mut merge = merge.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the program runs");
    std::io::Write::write_all(&mut merge.stdin.take().expect("a pipe"), &input).expect("the pipe takes it");
    let merged: Value =
        serde_json::from_slice(&merge.wait_with_output().expect("an end").stdout).expect("JSON");
    assert_eq!(merged["film_hash"], hash(here, "scene.ron --spp 4 -o four.png")[..]);
}

#[test]
fn merging_says_what_is_missing_and_refuses_strangers() {
    let folder = folder();
    let here = folder.path();
    for index in [0, 2, 3] {
        json(here, &format!("scene.ron --shard {index}/4 -o part-{index}.film"));
    }
    let error = failure(here, "merge part-0.film part-3.film part-2.film -o a.png");
    assert!(error.contains("6..12 of 24 are missing"), "{error}");
    let command =
        error.lines().last().expect("a command").trim().strip_prefix("rayfront ").expect("a command");
    assert!(command.ends_with("--shard 1/4 -o part-1.film"), "{command}");
    let partial = json(here, "merge part-0.film part-3.film part-2.film -o a.png --partial");
    assert_eq!((&partial["samples"], &partial["missing"]), (&18.into(), &"6..12".into()));
    assert_eq!(run(here, command).status.code(), Some(0), "{command}");
    let whole = hash(here, "merge part-0.film part-3.film part-2.film part-1.film -o a.png");
    assert_eq!(whole, hash(here, "scene.ron -o b.png"));

    let error = failure(here, "merge part-0.film part-1.film part-0.film");
    assert!(error.contains("part-0.film has samples 0..6, too"), "{error}");
    json(here, "scene.ron --shard 1/4 --seed 3 -o other.film");
    let error = failure(here, "merge part-0.film other.film");
    assert!(error.contains("other.film: of other settings: seed is 3, not 0"), "{error}");
    // Another picture of the same name.
    image::GrayImage::new(64, 64).save(here.join("checks.png")).expect("a picture");
    json(here, "scene.ron --shard 1/4 -o changed.film");
    let error = failure(here, "merge part-0.film changed.film");
    assert!(error.contains("of another scene: checks.png differs"), "{error}");
    let error = failure(here, "resume part-0.film");
    assert!(error.contains("of another scene: checks.png differs"), "{error}");
    let error = failure(here, "scene.ron --shard 0/4 -o part-0.film");
    assert!(error.contains("checks.png differs: --overwrite"), "{error}");
}

#[test]
fn a_film_gets_more_samples_with_the_bits_of_the_longer_rendering() {
    let folder = folder();
    let here = folder.path();
    for options in ["", "--sampler independent --sharing off", "--sharing 8"] {
        let film = format!("a{}.film", options.len());
        for (i, spp) in [3, 5, 24].into_iter().enumerate() {
            let line = match i {
                0 => format!("scene.ron {options} --spp {spp} -o {film}"),
                _ => format!("resume {film} --spp {spp}"),
            };
            assert_eq!(
                hash(here, &line),
                hash(here, &format!("scene.ron {options} --spp {spp} -o b.png")),
                "{line}"
            );
        }
    }
    json(here, "scene.ron --sampler jittered --spp 4 -o grid.film");
    let error = failure(here, "resume grid.film --spp 8");
    assert!(error.contains("grid") && error.contains("render it anew"), "{error}");
    let error = failure(here, "resume a0.film --spp 8");
    assert!(error.contains("24 samples"), "{error}");
}

#[test]
fn an_audit_finds_what_another_machine_has_made_of_it() {
    let folder = folder();
    let here = folder.path();
    json(here, "scene.ron --shard 0/2 -o a.film");
    json(here, "scene.ron --shard 1/2 -o b.film");
    let sound = json(here, "merge a.film b.film --audit 100%");
    assert_eq!(
        sound["audited"][0],
        serde_json::json!({"film": "a.film", "hosts": sound["hosts"], "tiles": 20, "differing": 0})
    );
    // One quantum in one pixel.
    let mut forged = rayfront::formats::film_file::load(&here.join("b.film")).expect("a film");
    let mut pixels = forged.film.pixels().to_vec();
    pixels[70 * 20 + 35].sum[0][1] += 1;
    let film = rayfront::film::Film::with_pixels(forged.film.region(), forged.film.unit(), pixels);
    forged.film = film.expect("a film");
    forged.header.set_film(&forged.film, None);
    rayfront::formats::film_file::save(&here.join("b.film"), &forged.header, &forged.film, None)
        .expect("saved");
    let error = failure(here, "merge a.film b.film --audit 100%");
    assert!(error.contains("b.film (rendered on") && error.contains("1 of 20 tiles"), "{error}");
}

#[test]
fn rules_stop_a_rendering_and_say_how_to_get_the_same() {
    let folder = folder();
    let here = folder.path();
    let stopped = json(here, "scene.ron --spp 4096 --until noise=40% -o a.png -o a.film");
    let samples = stopped["samples"].as_u64().expect("a number");
    assert!(
        samples < 4096 && stopped["stopped_by"].as_str().is_some_and(|rule| rule.contains("noise")),
        "{stopped}"
    );
    assert_eq!(stopped["film_hash"], hash(here, &format!("scene.ron --spp {samples} -o b.png"))[..]);
    let again = run(here, "scene.ron --spp 4096 --until noise=40% -o a2.png");
    let text = String::from_utf8_lossy(&again.stdout).into_owned();
    let (_, line) = text.split_once("the same image: rayfront ").expect(&text);
    let line = line.lines().next().expect("a line");
    assert_eq!(stopped["film_hash"], hash(here, &format!("{line} -o b.png"))[..]);
    let timed = json(here, "scene.ron --spp 4194304 --max-time 300ms -o c.png");
    assert!(timed["stopped_by"].as_str().is_some_and(|rule| rule.contains("time")), "{timed}");
    // The film goes on from where it was.
    let more = json(here, "resume a.film --until noise=10%");
    assert!(more["samples"].as_u64() > Some(samples), "{more}");
}

/// A rendering that was ended by a signal some time after it began, or after there was a film, and gone on with:
/// its exit code, its hash, and whether there was a film.
fn after(signal: &str, has_film: bool, time: Duration, here: &Path) -> (Option<i32>, String, bool) {
    let _ = std::fs::remove_file(here.join("a.film"));
    let line = "scene.ron --size 96x64 --spp 96 -o a.film --checkpoint 5ms --quiet";
    let mut child =
        command(here, &line.split_whitespace().collect::<Vec<_>>()).spawn().expect("the program runs");
    while has_film && !here.join("a.film").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(time);
    let id = child.id().to_string();
    let sent = Command::new("kill").args([signal, &id]).status().expect("kill runs");
    let code = child.wait().expect("an end").code();
    let is_there = here.join("a.film").exists();
    let line = if is_there { "resume a.film -o a.png" } else { &line.replace("--quiet", "") };
    let _ = sent;
    (code, hash(here, line), is_there)
}

#[cfg(unix)]
#[test]
fn whatever_ends_it_a_rendering_is_gone_on_with() {
    let folder = folder();
    let here = folder.path();
    let start = Instant::now();
    let expected = hash(here, "scene.ron --size 96x64 --spp 96 -o whole.png");
    let time = start.elapsed();
    let mut gone_on_with = 0;
    for moment in 0..30u32 {
        // As if at random, and no two alike.
        let part = f64::from(moment.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX);
        let has_film = moment % 2 == 0;
        let wait = if has_film { time.mul_f64(0.5 * part) } else { time.mul_f64(part) };
        let (_, found, is_there) = after("-KILL", has_film, wait, here);
        assert_eq!(found, expected, "killed after {part} of the time");
        gone_on_with += u32::from(is_there);
    }
    assert!(gone_on_with >= 15, "{gone_on_with} of 30 left a film behind");
    for (signal, code) in [("-TERM", 143), ("-INT", 130)] {
        let (found, hash, is_there) = after(signal, true, Duration::ZERO, here);
        assert!(is_there && hash == expected, "{signal}");
        assert!(found == Some(code) || found == Some(0), "{signal}: {found:?}");
    }
}

/// What a disk that is full does to a checkpoint: here, files that may not grow further.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_costs_no_older_checkpoint() {
    let folder = folder();
    let here = folder.path();
    json(here, "scene.ron --spp 8 --samples 0..4 -o a.film");
    let before = std::fs::read(here.join("a.film")).expect("a film");
    let limit = before.len() / 2 / 512;
    let script = format!(
        "trap '' XFSZ; ulimit -f {limit}; exec {} resume a.film -o a.png --checkpoint 1ms --threads 1 --quiet",
        env!("CARGO_BIN_EXE_rayfront")
    );
    // That the film has no more to get shows nothing: it needs work to be saved.
    json(here, "scene.ron --spp 8 --samples 4..8 -o b.film");
    json(here, "merge a.film b.film -o c.film");
    std::fs::rename(here.join("c.film"), here.join("a.film")).expect("a film");
    let before = std::fs::read(here.join("a.film")).expect("a film");
    let script = script.replace("--quiet", "--quiet --spp 64");
    let output = Command::new("sh").args(["-c", &script]).current_dir(here).output().expect("a shell");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("warning: a.film: cannot write") && error.contains("goes on"), "{error}");
    assert_eq!(output.status.code(), Some(1), "at the end it says so: {error}");
    assert_eq!(std::fs::read(here.join("a.film")).expect("a film"), before);
    assert_eq!(hash(here, "resume a.film --spp 64"), hash(here, "scene.ron --spp 64 -o b.png"));
}

#[test]
fn images_say_how_they_are_rendered_again() {
    let folder = folder();
    let here = folder.path();
    let names = ["a.png", "a.exr", "a.hdr", "a.film"];
    json(
        here,
        "scene.ron --spp 3 --crop 10,5,40,45 --sampler jittered --denoise --seed 4 -o a.png -o a.exr -o a.hdr -o a.film",
    );
    for name in names.into_iter().chain(["a.denoised.exr"]) {
        let found = json(here, &format!("reproduce {name} --schedule recursive"));
        assert_eq!(found["identical"], true, "{name}: {found}");
    }
    // The same image is the same file, whoever rendered it and in how many parts.
    let before = ["a.png", "a.exr", "a.hdr"].map(|name| std::fs::read(here.join(name)).expect(name));
    let line = "scene.ron --crop 10,5,40,45 --sampler jittered --seed 4 --spp 3";
    (0..2).for_each(|i| drop(json(here, &format!("{line} --threads 1 --shard {i}/2 -o part-{i}.film"))));
    json(here, "merge part-1.film part-0.film -o a.png -o a.exr -o a.hdr");
    let after = ["a.png", "a.exr", "a.hdr"].map(|name| std::fs::read(here.join(name)).expect(name));
    assert!(before == after);
    // What has been changed is named.
    let scene = std::fs::read_to_string(here.join("scene.ron")).expect("a scene");
    std::fs::write(here.join("scene.ron"), scene.replace("power_w: 300", "power_w: 301")).expect("a scene");
    let error = failure(here, "reproduce a.png");
    assert!(error.contains("of another scene: scene.ron differs"), "{error}");
    image::GrayImage::new(4, 4).save(here.join("plain.png")).expect("a picture");
    let error = failure(here, "reproduce plain.png");
    assert!(error.contains("does not say how it was rendered"), "{error}");
}

#[cfg(unix)]
#[test]
fn what_was_interrupted_is_reproduced_as_it_is() {
    let folder = folder();
    let here = folder.path();
    let line = "scene.ron --size 320x200 --spp 4000 -o a.exr -o a.film --checkpoint 20ms --quiet";
    let mut child =
        command(here, &line.split_whitespace().collect::<Vec<_>>()).spawn().expect("the program runs");
    while !here.join("a.film").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill runs");
    assert_eq!(child.wait().expect("an end").code(), Some(143));
    for name in ["a.exr", "a.film"] {
        let found = json(here, &format!("reproduce {name}"));
        assert_eq!(found["identical"], true, "{name}: {found}");
    }
}

#[cfg(unix)]
#[test]
fn planned_commands_are_what_a_shell_takes() {
    let folder = folder();
    let here = folder.path().join("it's a $cene; & so on");
    std::fs::create_dir(&here).expect("a folder");
    for name in ["scene.ron", "checks.png"] {
        std::fs::copy(folder.path().join(name), here.join(name)).expect("a copy");
    }
    let plan = "plan scene.ron --shards 3 --for commands --output out.png -- --spp 6 --size 40x30";
    assert_eq!(run(&here, plan).status.code(), Some(0));
    let lines = std::fs::read_to_string(here.join("scene.jobs/parts.txt")).expect("commands");
    assert_eq!(lines.lines().count(), 3);
    for line in lines.lines() {
        // Wherever it is run.
        let status = Command::new("sh").args(["-c", line]).current_dir(folder.path()).status();
        assert!(status.expect("a shell").success(), "{line}");
    }
    let merge = Command::new("sh").arg(here.join("scene.jobs/merge.sh")).current_dir(folder.path()).output();
    assert!(merge.expect("a shell").status.success());
    assert!(here.join("out.png").is_file());
    let parts = (0..3).map(|i| format!("scene.jobs/part-{i}.film")).collect::<Vec<_>>().join(" ");
    let whole = hash(&here, "scene.ron --spp 6 --size 40x30 -o whole.png");
    assert_eq!(hash(&here, &format!("merge {parts}")), whole);
    let error = failure(&here, "plan scene.ron --shards 25 --for slurm");
    assert!(error.contains("there are 24 samples"), "{error}");
    let error = failure(&here, "plan scene.ron --shards 2 --for slurm -- --sppp 3");
    assert!(error.contains("--sppp"), "{error}");
}

/// Samples where they are worth it: the same whatever renders and interrupts, and fit to be gone on with.
#[cfg(unix)]
#[test]
fn adaptive_samples_are_chosen_alike_by_all() {
    let folder = folder();
    let here = folder.path();
    let line = "scene.ron --adaptive --spp 32 --aov samples";
    let expected = hash(here, &format!("{line} -o a.exr"));
    assert_ne!(expected, hash(here, "scene.ron --spp 32 -o b.exr"));
    for way in ["--schedule recursive --threads 1", "--wave 7 --simd portable", "--threads 3"] {
        assert_eq!(hash(here, &format!("{line} {way} -o b.exr")), expected, "{way}");
    }
    let verified = json(here, "verify scene.ron --adaptive --size 48x40 --spp 32");
    assert_eq!(verified["mismatches"], 0, "{verified}");
    assert_eq!(json(here, "reproduce a.exr")["identical"], true);
    // Interrupted in its rounds, and gone on with.
    let longer = "scene.ron --adaptive --aov samples --size 120x80 --spp 64 -o long.film";
    let whole = hash(here, longer);
    let (mut in_rounds, mut moment) = (0, 5);
    while in_rounds < 3 && moment < 4000 {
        std::fs::remove_file(here.join("long.film")).expect("a film");
        let arguments = format!("{longer} --checkpoint 2ms --quiet");
        let arguments: Vec<_> = arguments.split_whitespace().collect();
        let mut child = command(here, &arguments).spawn().expect("the program runs");
        while !here.join("long.film").exists() {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(moment));
        child.kill().expect("killed");
        child.wait().expect("an end");
        let found = rayfront::formats::film_file::load_header(&here.join("long.film")).expect("a film");
        in_rounds += u32::from(found.begun.is_some_and(|begun| begun.blocks.is_some()));
        assert_eq!(hash(here, "resume long.film"), whole, "after {moment} ms");
        moment += moment / 2;
    }
    assert!(in_rounds > 0, "no rendering was killed within a round");
    for line in ["scene.ron --adaptive --spp 32 --shard 0/2", "resume long.film --spp 128", "merge long.film"]
    {
        assert!(failure(here, line).contains("adaptive"), "{line}");
    }
}
