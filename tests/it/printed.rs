//! What the program prints to be typed, typed: it must be about the same rendering, whatever the options were.

use std::path::Path;

use serde_json::Value;

use super::program::{Place, folder};

/// A spark in glass, which single samples find: each rendering prints a command that explains one of them.
const SPARK: &str = r#"(
    settings: (size: (32, 24), samples: 16, transport: Path, max_depth: 6, caustics: Off),
    materials: {
        "glow": BlinnPhong(diffuse: 0, emission: 4000000),
        "clear": Principled(metallic: 0, transmission: 1, roughness: 0, volume: ()),
    },
    entities: [
        (name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 2, 5), to: (0, 0, 0))),
        (name: "it's an \"ear\"", camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (1, 2, 5), to: (0, 0, 0))),
        (name: "floor", shape: Plane(corners: ((-6, -1, -6), (-6, -1, 6), (6, -1, 6), (6, -1, -6))), material: (diffuse: 0.6)),
        (name: "ball", shape: Sphere(radius_m: 0.5), material: Principled(metallic: 1, roughness: 0.3, base_color: 0.9), transform: (translate: (1, -0.4, 0))),
        (name: "spark", shape: Sphere(radius_m: 0.01), material: "glow", transform: (translate: (0.2, 0.3, 0.5))),
        (name: "glass", shape: Sphere(radius_m: 0.3), material: "clear", transform: (translate: (0.2, 0.3, 0.5))),
        (name: "lamp", light: Point(power_w: Keys([(0, 20), (4, 2000)])), transform: (translate: (2, 3, 3))),
    ],
)"#;

/// Types a printed command, with more words behind it.
#[track_caller]
pub fn typed(folder: &Path, line: &str, more: &str) -> String {
    assert!(line.trim().starts_with("rayfront "), "no command: {line}");
    // The note behind a command is none of it.
    let command = line.split("  #").next().unwrap_or_default();
    folder.shell(&format!("{command} {more}")).printed()
}

/// The commands that stand in a text between two others.
fn between<'a>(text: &'a str, before: &str, after: &str) -> Vec<&'a str> {
    text.split(before).skip(1).filter_map(|rest| rest.split(after).next()).collect()
}

fn hash(report: &str) -> String {
    let report: Value = serde_json::from_str(report).expect("JSON");
    report["film_hash"].as_str().expect("a hash").to_owned()
}

/// Options whose every value changes what a sample finds. Those of a row do not suit each other.
const OPTIONS: [&[&[&str]]; 17] = [
    &[&["--set", "Material[\"glow\"].emission *= 3", "--set", "settings.roulette_depth = None"]],
    &[&["--env", "sky:30,-20"], &["--env", "studio"], &["--background", "#203040"]],
    &[&["--time", "1.1"], &["--frames", "3"], &["--frames", "5", "--shutter", "0.7", "--fps", "3"]],
    &[&["--size", "40x31"]],
    &[&["--depth", "5"]],
    &[&["--diffuse-depth", "1"], &["--glossy-depth", "1"]],
    &[&["--transmission-depth", "5"]],
    &[&["--sampler", "independent"], &["--sampler", "jittered"]],
    &[&["--sharing", "off"], &["--sharing", "8"]],
    &[&["--caustics", "auto"], &["--caustics", "0.5,3"]],
    &[&["--filter-glossy", "0.4"]],
    &[&["--adaptive=unbiased"]],
    &[&["--seed", "18446744073709551615"], &["--seed", "3"]],
    &[&["--spp", "24"]],
    &[&["--camera", "it's an \"ear\""]],
    &[&["--look-at", "-0.5,2.5,4", "0.1,0,0"], &["--orbit", "-7,-3"], &["--zoom", "1.125"]],
    &[&["--hide", "\"ball\""], &["--only", "!\"ball\""], &["--ground", "--crop", "4,4,30,24"]],
];

/// Options of one rendering after another: each by itself, and then several at random.
fn combinations() -> Vec<Vec<&'static str>> {
    let mut all: Vec<Vec<&str>> =
        OPTIONS.iter().flat_map(|row| row.iter().map(|words| words.to_vec())).collect();
    all.push(Vec::new());
    let mut state = 1_u64;
    let mut draw = |count: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % count
    };
    for _ in 0..10 {
        let mut words = Vec::new();
        for row in OPTIONS {
            let which = draw(2 * row.len());
            words.extend(row.get(which).copied().unwrap_or_default());
        }
        all.push(words);
    }
    all
}

/// The noise line of a report names samples that halve the noise.
#[test]
fn samples_of_the_noise_line_halve_the_noise() {
    let here = folder(
        "(settings: (size: (32, 24), transport: Path, sharing: Off), entities: [
            (camera: Pinhole(), transform: LookAt(from: (0, 2, 5), to: (0, 0, 0))),
            (shape: Plane(corners: ((-6, 0, -6), (-6, 0, 6), (6, 0, 6), (6, 0, -6)))),
            (shape: Sphere(radius_m: 0.5), transform: (translate: (0, 0.5, 0))),
            (light: Area(power_w: 50, size_m: 1), transform: LookAt(from: (1, 3, 1), to: (0, 0, 0))),
        ])",
    );
    let noise = |spp: &str| {
        let report = here.out(&["scene.ron", "--spp", spp]);
        let line = report.lines().find(|line| line.starts_with("noise")).expect("a noise line").to_owned();
        let percent = line.split_whitespace().nth(1).and_then(|word| word.parse::<f64>().ok());
        let needed = between(&line, "(--spp ", ")").first().expect("an option").to_string();
        (percent.expect("a number"), needed)
    };
    let (before, needed) = noise("16");
    assert_eq!(needed, "64");
    let (after, _) = noise(&needed);
    assert!((0.35..0.65).contains(&(after / before)), "{before} {after}");
}

#[test]
fn a_printed_explanation_is_of_the_sample_that_was_rendered() {
    let here = folder(SPARK);
    let mut count = 0;
    for options in combinations() {
        let words = |more: &[&'static str]| [&["scene.ron"], &options[..], more].concat();
        let told = here.messages(&words(&["-o", "a.png"]));
        for command in between(&told, "(rayfront explain", " shows its path)").into_iter().take(2) {
            let explained = typed(&here, &format!("rayfront explain{command}"), "--json");
            let explained: Value = serde_json::from_str(&explained).expect("JSON");
            let sample = explained["samples"][0]["sample"].as_u64().expect("a sample");
            let part = format!("{sample}..{}", sample + 1);
            here.out(&[&words(&["-o", "one.exr", "-q"])[..], &["--samples", &part]].concat());
            let (width, _, pixels) = here.image("one.exr");
            let [x, y] = [0, 1].map(|axis| explained["pixel"][axis].as_u64().expect("a place") as u32);
            let [x, y] = if options.contains(&"--crop") { [x - 4, y - 4] } else { [x, y] };
            let rendered = pixels[(y * width + x) as usize].to_array();
            let mean = [0, 1, 2].map(|channel| explained["mean"][channel].as_f64().expect("a number") as f32);
            // A film counts in a unit, and where time passes that is the first moment's.
            let is_same = |(a, b): (&f32, &f32)| {
                a.to_bits() == b.to_bits()
                    || options.contains(&"--shutter") && (a - b).abs() <= 1e-4 * a.abs()
            };
            assert!(
                mean.iter().zip(&rendered).all(is_same) && mean[0] > 0.0,
                "{options:?}: {command}: {mean:?}, not {rendered:?}"
            );
            count += 1;
        }
    }
    assert!(count > 30, "only {count} commands were printed");
}

#[test]
fn the_sample_of_a_printed_explanation_is_one_of_those_that_were_rendered() {
    let folder = folder(SPARK);
    let told = folder.messages("scene.ron --samples 9..16 -o a.png");
    let commands = between(&told, "(rayfront explain", " shows its path)");
    for command in &commands {
        let sample = between(command, "--sample ", " ").first().map_or("", |sample| *sample);
        assert!(sample.parse().is_ok_and(|sample: u32| (9..16).contains(&sample)), "{command}");
    }
    assert!(!commands.is_empty(), "{told}");
}

#[test]
fn what_gives_the_same_image_again_does_also_for_frames_and_longer_films() {
    let here = folder(&SPARK.replace("max_depth: 6", "max_depth: 6, exposure: Auto"));
    let again =
        |report: &str| between(report, "the same image: ", "\n").first().map(|line| (*line).to_owned());
    // Of several frames the one that it is about, as bright as all of them.
    let report = here.out("scene.ron --frames 2-3 --fps 1 -o f.#.png --spp 256 --until noise=90%");
    for (line, frame) in report.lines().filter_map(|line| again(&format!("{line}\n"))).zip([2, 3]) {
        typed(&here, &line, "-o same.png");
        let [one, same] =
            [format!("f.{frame}.png"), "same.png".into()].map(|name| image::open(here.join(name)));
        assert!(one.expect("a picture") == same.expect("a picture"), "{line}");
    }
    // A film that was given more samples than its own command says.
    here.out("scene.ron --spp 8 -o 'a b.film'");
    let report = here.out("resume 'a b.film' --spp 512 --until noise=80%");
    let line = again(&report).expect(&report);
    let whole = here.hash("merge 'a b.film' --partial");
    assert_eq!(hash(&typed(&here, &line, "-o same.png --json")), whole, "{line}");
}

#[test]
fn what_is_missing_is_rendered_by_what_is_printed() {
    let here = folder(SPARK);
    // A name that a shell would take apart, and one of several frames.
    for index in [0, 2] {
        here.out(&format!("scene.ron --frames 1-2 --fps 1 --shard {index}/3 -o \"it's {{shard}}.#.film\""));
    }
    let told = here.run("merge \"it's 0.2.film\" \"it's 2.2.film\"").err;
    let line = told.lines().find(|line| line.contains("--shard 1/3")).expect(&told);
    typed(&here, line, "-q");
    let merged = here.hash(&["merge", "it's 0.2.film", "it's 1.2.film", "it's 2.2.film"]);
    assert_eq!(merged, here.hash("scene.ron --time 2 -o w.png"), "{line}");
}

/// Whatever the tree depends on: size, camera, changes, and an origin that is not the world's.
#[test]
fn captured_queues_are_traced_again_by_the_printed_command() {
    let far = |x: f64| format!("({}, 0.5, 5412345.75)", 450_123.25 + x);
    let here = folder(&format!(
        r#"(
            settings: (samples: 2, max_depth: 4),
            materials: {{"clear": Principled(metallic: 0, transmission: 1, roughness: 0, volume: ())}},
            entities: [
                (name: "eye", camera: Pinhole(), transform: LookAt(from: (450123.25, 1.5, 5412350), to: {})),
                (name: "ear", camera: Pinhole(), transform: LookAt(from: (450125.25, 1.5, 5412348), to: {})),
                (name: "ring", shape: Torus(radius_m: 0.7, tube_radius_m: 0.3), transform: (translate: {})),
                (name: "glass", shape: Sphere(radius_m: 0.4), material: "clear", transform: (translate: {})),
                (name: "egg", shape: Sphere(radius_m: 0.4), transform: (translate: {})),
                (shape: Plane(corners: ((450120, -0.3, 5412340), (450120, -0.3, 5412350), (450130, -0.3, 5412350), (450130, -0.3, 5412340)))),
                (light: Area(power_w: 100, size_m: 1), transform: LookAt(from: (450123, 4, 5412346), to: {})),
            ],
        )"#,
        far(0.0),
        far(0.0),
        far(0.0),
        far(-0.5),
        far(1.0),
        far(0.0)
    ));
    let mut hashes = std::collections::BTreeSet::new();
    for more in [
        "",
        "--size 60x40 --camera ear",
        "--stage shadow --bounce 1 --simd portable",
        "--transport path --bounce 3 --wave 200 --set 'settings.copied_triangles = 0'",
        "--transport path --stage shadow --hide '\"egg\"' --orbit 20,5",
    ] {
        let line = format!("profile scene.ron --size 24x18 --capture \"it's q.rays\" {more} --spp 2");
        let line = if more.contains("--size") { line.replace("--size 24x18 ", "") } else { line };
        let captured = here.json(&line);
        let traced = typed(&here, captured["command"].as_str().expect("a command"), "--json");
        let traced: Value = serde_json::from_str(&traced).expect("JSON");
        for name in ["rays", "hits", "hits_hash"] {
            assert_eq!(captured[name], traced[name], "{more}: {captured}");
        }
        assert_eq!(captured["differing"], 0, "{more}: {captured}");
        assert!(captured["hits"].as_u64() > Some(3) && captured["hits"] != captured["rays"], "{captured}");
        let rays = captured["rays_by_bounce"].as_array().expect("a list").iter().filter_map(Value::as_u64);
        assert_eq!(captured["rays"], rays.sum::<u64>());
        assert_eq!(here.bytes("it's q.rays").len() as u64, 32 * captured["rays"].as_u64().expect("a number"));
        hashes.insert(captured["hits_hash"].to_string());
        let text = here.out(&line);
        let command = text.split("replay     ").nth(1).and_then(|rest| rest.lines().next());
        assert_eq!(command, captured["command"].as_str(), "{text}");
        let queue = format!("queue      {} of {} of stage", captured["queue"], captured["queues"]);
        assert!(text.starts_with(&queue), "{text}, not {queue}");
    }
    assert_eq!(hashes.len(), 5);
}

/// The replay has no any-hit filter.
#[test]
fn captured_queues_say_where_their_replay_ends_elsewhere() {
    let here = folder(
        &SPARK
            .replace("\"glow\": ", "\"leaf\": (diffuse: 0.5, alpha: 0.5, alpha_mode: Blend), \"glow\": ")
            .replace("material: (diffuse: 0.6)", "material: \"leaf\""),
    );
    let line = "profile scene.ron --size 24x18 --spp 2 --capture q.rays --bounce 1";
    let captured = here.json(line);
    let differing = captured["differing"].as_u64().expect("a number");
    assert!(differing > 3, "{captured}");
    let traced = typed(&here, captured["command"].as_str().expect("a command"), "--json");
    let traced: Value = serde_json::from_str(&traced).expect("JSON");
    assert_eq!(traced["hits"], captured["replayed_hits"]);
    assert_eq!(traced["hits_hash"], captured["replayed_hits_hash"]);
    assert!(traced["hits"] != captured["hits"], "{captured}");
    let note = format!("note       {differing} rays end elsewhere when replayed ({} hits", traced["hits"]);
    assert!(here.out(line).contains(&note), "{note}");
    for (code, options, part) in [
        (2, "--capture q.rays --bounce 99", "traces no ray after so many bounces, but after 0, 1, 2, 3, 4"),
        (2, "--capture q.rays --stage shade", "possible values: intersect, shadow"),
        (2, "--capture q.rays --stage shadow --hide Light --hide '\"spark\"'", "choose another stage"),
        (2, "--capture scene.ron", "scene.ron is read for this scene: name another --capture"),
        (2, "--capture q.rays --html p.html", "cannot be used with"),
        (2, "--bounce 1", "--capture <FILE>"),
        (3, "--capture none/q.rays", "none/q.rays"),
    ] {
        here.fails(code, &format!("profile scene.ron --size 24x18 --spp 2 {options}"), &[part]);
    }
}
