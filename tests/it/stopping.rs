//! Renderings that are stopped early: promptly, with a warning, and without a wrong bit.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfront::compile::compile;
use rayfront::internals::integrator::Stop;
use rayfront::render::{Options, Schedule, Session};
use rayfront::world::{Sharing, World};

use super::program::{Place, folder, kill};
use super::support::world;

/// Stopping takes seconds; the probes before it take half a second in an optimised build.
const PATIENCE: Duration = Duration::from_secs(100);

/// Glass shells: a path splits in two at each, up to 2^40 times.
fn shells(settings: &str) -> String {
    // Alternately glass and air, so that light is reflected at each shell.
    let shells: String = (0..8)
        .map(|i| {
            let (radius, ior) = (1.0 + 0.01 * f64::from(i), if i % 2 == 1 { 1.5 } else { 1.0 });
            format!("(shape: Sphere(radius_m: {radius}), material: (ior: {ior})),")
        })
        .collect();
    format!(
        "(settings: (max_depth: 40, min_throughput: 0, transport: Whitted, {settings}), entities: [
            (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0, 4), to: (0, 0, 0))),
            (light: Point(power_w: 200), transform: (translate: (2, 3, 3))),
            {shells}
        ])"
    )
}

/// A closed room with a glass ball, under the path transport.
fn room(samples: u32, sharing: Sharing) -> World {
    let mut world = world(
        "(settings: (size: (48, 40), transport: Path), entities: [
            (camera: Pinhole(vertical_fov_degrees: 60), transform: LookAt(from: (0, 0, 1.8), to: (0, 0, 0))),
            (shape: Sphere(radius_m: 2), material: (diffuse: 0.9)),
            (shape: Sphere(radius_m: 0.5), material: Principled(transmission: 1, roughness: 0)),
            (light: Area(power_w: 100, size_m: 0.5), transform: LookAt(from: (0, 1.5, 0), to: (0, 0, 0))),
        ])",
    );
    (world.settings.samples, world.settings.sharing) = (samples, sharing);
    world
}

/// A tile that is stopped midway leaves nothing in the film and nothing in its worker: continuing gives the same result
/// as without the stop.
#[test]
fn stopped_tiles_are_dropped_completely() {
    const SAMPLES: u32 = 4;
    let mut forks = world(&shells("size: (24, 20), samples: 4").replace("max_depth: 40", "max_depth: 5"));
    forks.settings.samples = SAMPLES;
    let scenes = [
        forks,
        room(SAMPLES, Sharing::Off),
        room(SAMPLES, Sharing::Auto),
        room(SAMPLES, Sharing::Groups(16)),
    ];
    for (number, world) in scenes.iter().enumerate() {
        let setup = Arc::new(rayfront::internals::render::setup(
            compile(world, None).expect("a scene"),
            &world.settings,
        ));
        for (schedule, variance) in
            [(Schedule::Wavefront, false), (Schedule::Recursive, false), (Schedule::Wavefront, true)]
        {
            let options = Options { schedule, variance, tile: 16, wave: 256, ..Options::default() };
            let session = || Session::of(setup.clone(), SAMPLES, options);
            let mut whole = session();
            whole.advance(SAMPLES);
            let tiles = whole.film().region().area().div_ceil(16 * 16) as u64;
            let usual = whole.statistics().rays.total() / tiles;
            let mut dropped = 0;
            for part in [4, 8, 12, 16, 20] {
                let mut stopped = session();
                stopped.advance_until(SAMPLES, &Stop::after_rays(usual * part / 16), &|_| ());
                let count = |counts: [u32; 2]| counts[0] + counts[1];
                let counts: Vec<u32> = stopped.film().pixels().iter().map(|sums| count(sums.count)).collect();
                assert!(
                    counts.iter().all(|count| [0, SAMPLES].contains(count)),
                    "scene {number} {schedule:?}"
                );
                dropped += u32::from(counts.contains(&0));
                stopped.advance(SAMPLES);
                assert!(stopped.state() == whole.state(), "scene {number} {schedule:?} {part}");
            }
            assert!(dropped > 0, "scene {number} {schedule:?}: every tile was whole");
        }
    }
}

fn start(folder: &Path, line: &str) -> Child {
    let mut command = folder.command(line);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program runs")
}

/// Waits for the end of the program and returns its exit code and messages. Terminates it after it has printed `cue`,
/// unless that is empty.
fn end(mut child: Child, cue: &str) -> (Option<i32>, String) {
    let start = Instant::now();
    let mut lines = BufReader::new(child.stderr.take().expect("its messages"));
    let mut said = String::new();
    while !said.contains(cue) && lines.read_line(&mut said).expect("a line") > 0 {}
    if !cue.is_empty() {
        // By then it has started to render, or is about to.
        std::thread::sleep(Duration::from_secs(1));
        assert!(kill(child.id(), "-TERM"));
    }
    while child.try_wait().expect("its state").is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().expect("it can be killed");
            panic!("it goes on after {PATIENCE:?}: {said}");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    lines.read_to_string(&mut said).expect("text");
    (child.wait().expect("its end").code(), said)
}

#[test]
#[cfg(unix)]
fn endless_forks_are_reported_and_end_at_limits_and_signals() {
    let here = folder(&shells("size: (4, 4), samples: 1"));
    for schedule in ["wavefront", "recursive"] {
        for more in ["--max-time 100ms", "--max-time 100ms -q", ""] {
            let line = format!("scene.ron -t 1 --schedule {schedule} -o a.png {more}");
            let cue = if more.is_empty() { "each sample takes more than" } else { "" };
            let (code, said) = end(start(&here, &line), cue);
            assert_eq!(code, Some(if more.is_empty() { 143 } else { 0 }), "{schedule} {more}: {said}");
            let announced = said.find("glass splits paths in two");
            assert_eq!(announced.is_some(), !more.contains("-q"), "{said}");
            let slow = said.find("each sample takes more than");
            assert!(more.contains("-q") || announced < slow, "{said}");
            assert_eq!(said.contains("pixels that have none are black"), !more.is_empty(), "{said}");
            assert!(here.has("a.png"));
        }
    }
    // Frames choose their exposure before they are rendered.
    let text = shells("size: (4, 4), samples: 1, exposure: Auto");
    here.write("scene.ron", text);
    let (code, said) = end(start(&here, "scene.ron -t 1 --frames 1-2 --max-time 100ms -o a.#.png"), "");
    assert!(code == Some(2) && said.contains("--exposure 0") && said.contains("glass splits"), "{said}");
}

/// A job that is stopped midway has no result.
#[test]
#[cfg(unix)]
fn study_stops_in_the_middle_of_a_job() {
    let here = folder(&shells("size: (4, 4), samples: 1"));
    let study = r#"(title: "t", experiments: [
        (name: "endless", scenes: [File("scene.ron")], x: Samples([1]), series: [(label: "a")], plots: [(y: RenderSeconds)]),
    ])"#;
    here.write("study.ron", study);
    let mut child = start(&here, "study study.ron");
    std::thread::sleep(Duration::from_secs(5));
    let ended = child.try_wait().expect("its state");
    assert!(ended.is_none(), "{ended:?}");
    assert!(kill(child.id(), "-TERM"));
    let (code, said) = end(child, "");
    assert_eq!(code, Some(143), "{said}");
    let results = std::fs::read_to_string(here.join("out/study/results.csv")).unwrap_or_default();
    assert!(results.lines().count() <= 1, "{results}");
}

/// A picture behind things that vanishes meanwhile costs the images, not the film.
#[test]
#[cfg(unix)]
fn a_background_that_vanishes_costs_no_samples() {
    let here = folder(&shells("size: (4, 4), samples: 1"));
    let keep = || image::RgbImage::new(4, 4).save(here.join("street.png")).expect("room");
    keep();
    let mut child = start(&here, "scene.ron -t 1 --background street.png -o a.png");
    let mut lines = BufReader::new(child.stderr.take().expect("its messages"));
    let mut said = String::new();
    while !said.contains("each sample takes more than") && lines.read_line(&mut said).expect("a line") > 0 {}
    // By then it watches for signals.
    std::thread::sleep(Duration::from_secs(1));
    std::fs::remove_file(here.join("street.png")).expect("it is there");
    assert!(kill(child.id(), "-TERM"));
    lines.read_to_string(&mut said).expect("text");
    assert!(!child.wait().expect("its end").success());
    assert!(said.contains("street.png: cannot read") && !here.has("a.png"), "{said}");
    let (_, film) = said.split_once("what was rendered is in ").expect("the film's place");
    let film = film.split(':').next().expect("a name").to_owned();
    here.fails(1, &format!("merge {film} --partial -o b.png"), &["street.png", "films", "as they were"]);
    keep();
    here.out(&format!("merge {film} --partial -o b.png"));
}
