//! `rayfront verify`, `explain`, `profile` and `study` as run by scripts.

use rayfront::internals::render::PixelCost;
use rayfront::render::Options;
use rayfront::world::Transport;

use super::program::{Place, folder};
use crate::support;

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

#[test]
fn verify_finds_the_rendered_film_in_all_ways() {
    let folder = folder(SCENE);
    let line = "verify scene.ron --size 12x9 --spp 2";
    let found = folder.json(line);
    assert_eq!(found["mismatches"], 0);
    assert!(found["difference"].is_null());
    let films = found["films"].as_array().expect("films");
    let rendered = folder.json("scene.ron --size 12x9 --spp 2");
    assert!(films.len() >= 10 && films.iter().all(|film| film["film_hash"] == rendered["film_hash"]));
    let table = folder.out(line);
    assert!(table.contains("all equal") && table.contains("wave 4096"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
}

#[test]
fn explain_names_entities_materials_and_lights() {
    let folder = folder(SCENE);
    let told = folder.json("explain scene.ron 8,6");
    let samples = told["samples"].as_array().expect("samples");
    assert_eq!(samples.len(), 4);
    let first = &samples[0]["paths"][0]["steps"][0];
    assert_eq!((&first["queue"], &first["vertex"]["entity"]), (&"camera".into(), &"ball".into()));
    assert_eq!(first["vertex"]["material"], "glass");
    assert!(samples[0]["paths"].as_array().map(Vec::len) > Some(1), "glass forks");
    // The mean equals that of the rendered image.
    folder.out("scene.ron -q -o image.exr");
    let pixel = folder.pixels("image.exr")[6 * 16 + 8].to_array();
    for (channel, value) in pixel.into_iter().enumerate() {
        assert!((told["mean"][channel].as_f64().expect("a number") - f64::from(value)).abs() < 1e-6);
    }

    let egg = folder.out("explain scene.ron 12,6 --sample 1");
    assert!(egg.contains("light       \"lamp\" sample 1"), "{egg}");
    assert!(egg.contains("\"egg\" of \"paper\"") && egg.contains("instance 0"), "{egg}");
    assert!(egg.contains("neither mirrors nor lets light through") && egg.starts_with("sample 1"), "{egg}");
}

/// A pixel has as many samples as the image; the page and JSON hold all.
#[test]
fn explain_prints_a_bounded_number_of_samples() {
    let folder = folder(SCENE);
    let line = "explain scene.ron 8,6 --spp 100";
    let told = folder.json(line);
    assert_eq!(told["samples"].as_array().map(Vec::len), Some(100));
    let text = folder.out(line);
    assert!(text.lines().count() < 210 && text.starts_with("sample 0"), "{text}");
    let shown = text.lines().filter(|line| line.starts_with("sample ")).count();
    let rest = format!("\n{} more, the brightest of which is sample ", 100 - shown);
    let hint = text.split(&rest).nth(1).expect("a hint");
    let number = hint.split_whitespace().next().expect("a number");
    assert!(hint.contains(&format!("(--sample {number} prints it, --json all)")), "{hint}");
    assert!(hint.contains("mean of all (100)"), "{hint}");
}

#[test]
fn furnace_names_a_material_without_a_name_by_its_entity() {
    let folder = folder(SCENE);
    let line = "furnace scene.ron tube --directions 64";
    folder.write(
        "scene.ron",
        SCENE.replace(
            "entities: [",
            r#"entities: [
        (name: "tube", shape: Cylinder(radius_m: 0.1, height_m: 0.2),
         material: Principled(metallic: 0, roughness: 0.5, transmission: 1, volume: ())),"#,
        ),
    );
    let text = folder.out(line);
    assert!(text.starts_with("\"tube\": "), "{text}");
    assert_eq!(text.matches("roughness 0.5").count(), 1, "{text}");
    assert!(text.contains("roughness 0.5, the material's own") && !text.contains("not reciprocal"), "{text}");
    assert!(text.contains("are not meant to be reciprocal"), "{text}");
    assert_eq!(folder.json(line)["material"], "tube");
}

/// The radiance of a sample's own path and the radiance given by others sum to the film's.
#[test]
fn explain_splits_radiance_under_path_reuse() {
    let folder = folder(SCENE);
    let scene = "(
        settings: (size: (20, 16), samples: 4, max_depth: 3, transport: Path, sharing: 32),
        entities: [
            (camera: Pinhole(vertical_fov_degrees: 50), transform: (translate: (0, 0, 4))),
            (shape: Plane(corners: ((-4, -1, -2), (-4, -1, 4), (4, -1, 4), (4, -1, -2)))),
            (shape: Plane(corners: ((-4, -1, -2), (4, -1, -2), (4, 4, -2), (-4, 4, -2)))),
            (light: Point(power_w: 100), transform: (translate: (1, 2, 1))),
        ],
    )";
    folder.write("corner.ron", scene);
    let line = "explain corner.ron 10,11";
    let told = folder.json(line);
    let samples = told["samples"].as_array().expect("samples");
    let mut mean = [0.0; 3];
    for sample in samples {
        let shares = &sample["paths"][0]["shares"];
        assert!(shares["vertices"].as_u64() > Some(1), "{shares}");
        for (channel, sum) in mean.iter_mut().enumerate() {
            let part = |name: &str| shares[name][channel].as_f64().expect("a number");
            let total = part("before") + part("own") + part("shared");
            assert!((sample["radiance"][channel].as_f64().expect("a number") - total).abs() < 1e-6);
            *sum += total / samples.len() as f64;
        }
    }
    for (channel, sum) in mean.into_iter().enumerate() {
        assert!((told["mean"][channel].as_f64().expect("a number") - sum).abs() < 1e-6, "{told}");
    }
    let text = folder.out(line);
    assert!(text.contains("second vertices of its group") && text.contains("is shared"), "{text}");
}

/// The path transport records its normals, lobes, lights and the ends of paths.
#[test]
fn explain_names_lobes_and_ends_of_paths() {
    let folder = folder(SCENE);
    let line = "explain scene.ron 8,10 --transport path --diffuse-depth 0";
    let told = folder.json(line);
    let paths: Vec<_> =
        told["samples"].as_array().expect("samples").iter().map(|sample| &sample["paths"][0]).collect();
    assert_eq!(paths.len(), 4);
    for path in &paths {
        let vertex = &path["steps"][0]["vertex"];
        assert_eq!(
            (&vertex["entity"], &vertex["normal"]),
            (&"floor".into(), &serde_json::json!([0.0, 1.0, 0.0]))
        );
        assert_eq!(vertex["lobe"]["kind"], "diffuse");
        assert!(
            vertex["lights"].as_array().is_some_and(|lights| lights.iter().all(|l| l["light"] == "lamp"))
        );
        assert!(["escaped", "diffuse limit"].iter().any(|end| path["end"] == *end), "{path}");
    }
    let text = folder.out(line);
    assert!(
        text.contains("draws       from a diffuse lobe") && text.contains("normal      (0.00000, 1.0"),
        "{text}"
    );
    assert!(text.contains("light       \"lamp\" at ") && text.contains("queue scatter"), "{text}");
    assert!(text.lines().last().is_some_and(|line| line.starts_with("mean of all (4)")), "{text}");
}

#[test]
fn missing_pixels_samples_and_scenes_are_refused() {
    let folder = folder(SCENE);
    for (code, line, wanted) in [
        (2, "explain scene.ron 16,3", "columns end at 15, rows at 11"),
        (2, "explain scene.ron 3,3 --sample 4", "the last one is 3"),
        (2, "explain scene.ron 3", "a column and a row"),
        (1, "explain none.ron 3,3", "none.ron"),
        (2, "verify scene.ron --size 0x3", "width x height"),
        (1, "verify none.ron", "none.ron"),
    ] {
        let run = folder.run(line);
        assert_eq!(run.out, "", "{line}");
        run.ends(code, &[wanted]);
    }
}

/// Checks that items leaving a stage enter the next one.
fn adds_up(profile: &serde_json::Value) {
    let bounces = profile["bounces"].as_array().expect("bounces");
    let sum = |name: &str| bounces.iter().filter_map(|bounce| bounce[name].as_u64()).sum::<u64>();
    let stage = |name: &str, way: &str| profile["stages"][name][way].as_u64().expect("a number");
    let rays = sum("camera") + sum("reflect") + sum("refract") + sum("scatter");
    let connecting = profile["stages"].get("connect").map_or(0, |_| stage("connect", "in"));
    assert_eq!(profile["wavefront"]["rays"]["total"], rays + sum("shadow") + connecting);
    assert_eq!(stage("generate", "out"), sum("camera"));
    assert!(stage("generate", "calls") > 0 && stage("generate", "calls") == stage("intersect", "calls"));
    assert_eq!(stage("generate", "out") + stage("advance", "out"), stage("intersect", "in"));
    assert_eq!(stage("intersect", "out"), stage("retire", "in"));
    assert_eq!((stage("intersect", "in"), stage("retire", "out")), (rays, sum("hits")));
    assert_eq!(stage("shade", "in"), sum("hits"));
    assert_eq!(stage("advance", "in"), sum("hits"));
    assert_eq!(stage("shadow", "in"), sum("shadow"));
    assert_eq!(stage("shadow", "out"), sum("shadow") - sum("blocked"));
    for (name, stage) in profile["stages"].as_object().expect("stages") {
        for ratio in ["fill", "lanes_taken", "lanes_going_on"] {
            let part = &stage[ratio];
            let is_ratio = part.as_f64().is_some_and(|part| (0.0..=1.0).contains(&part));
            assert!(part.is_null() || is_ratio, "{name}: {ratio} is {part}");
        }
        assert!(stage["seconds"].as_f64().is_some_and(f64::is_finite), "{name}");
    }
    let measured = profile["stages"]["shade"]["lanes_taken"].as_f64();
    assert!(measured > Some(0.0) && profile["stages"]["generate"]["fill"].is_null());
    assert_eq!(profile["stage_seconds_are_cpu"], cfg!(unix));
}

/// Under the path transport, with opaque and with half-transparent surfaces.
#[test]
fn profile_of_the_path_transport_is_consistent() {
    let folder = folder(SCENE);
    for alpha in ["", ", alpha: 0.5, alpha_mode: Blend"] {
        let scene = format!(
            "(
                settings: (max_depth: 3, transport: Path),
                entities: [
                    (camera: Pinhole(vertical_fov_degrees: 50), transform: (translate: (0, 0.5, 4))),
                    (shape: Sphere(radius_m: 1), material: Principled(metallic: 0.2{alpha})),
                    (shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4)))),
                    (light: Point(power_w: 100), transform: (translate: (2, 4, 1))),
                ],
            )"
        );
        folder.write("path.ron", scene);
        let line = "profile path.ron --size 24x18 --spp 4 --runs 1";
        let profile = folder.json(line);
        adds_up(&profile);
        let rays = &profile["recursive"]["rays"];
        assert_eq!(rays, &profile["wavefront"]["rays"]);
        assert!(rays["scatter"].as_u64() > Some(100) && rays["shadow"].as_u64() > Some(100), "{rays}");
        let blocked = profile["bounces"][0]["blocked"].as_u64().expect("a number");
        assert!(blocked > 0, "the ball throws a shadow, if half of one");
        let table = folder.out(line);
        assert!(table.contains("scattered rays") && !table.contains("reflect"), "{table}");
        let mut lines = table.lines().filter(|line| !line.starts_with("counters"));
        assert!(lines.all(|line| line.chars().count() <= 100), "{table}");
    }
}

/// Each step from recursion to the wavefront changes one thing and gives the same film.
#[test]
fn profile_steps_change_one_thing_each() {
    let folder = folder(SCENE);
    let names = |profile: &serde_json::Value| -> Vec<String> {
        let steps = profile["steps"].as_array().expect("steps");
        assert!(steps.iter().all(|step| step["film_hash"] == steps[0]["film_hash"]), "{steps:?}");
        assert!(steps.iter().all(|step| step["wall_s"]["median"].as_f64() > Some(0.0)), "{steps:?}");
        assert_eq!(steps[0]["film_hash"], profile["wavefront"]["film_hash"]);
        let fields = ["schedule", "traversal", "shading", "sorted"];
        for pair in steps.windows(2).filter(|pair| pair[1]["schedule"] == "wavefront") {
            let changes = fields.iter().filter(|field| pair[0][**field] != pair[1][**field]).count();
            assert_eq!(changes, 1, "{pair:?}");
        }
        let last = &steps[steps.len() - 1];
        assert_eq!((&last["schedule"], &last["traversal"]), (&"recursive".into(), &profile["simd"]));
        steps.iter().map(|step| step["step"].as_str().expect("a name").to_owned()).collect()
    };
    let line = "profile scene.ron --size 24x18 --spp 1 --runs 1";
    let has_lanes = rayfront::internals::simd::Isa::available().len() > 1;
    for (transport, sorting) in [("whitted", None), ("path", Some("sorting"))] {
        let one_lane = folder.json(&format!("{line} --transport {transport} --simd portable"));
        let expected: Vec<&str> = ["order"].into_iter().chain(sorting).chain(["recursion"]).collect();
        assert_eq!(names(&one_lane), expected);
        if has_lanes {
            let lanes = folder.json(&format!("{line} --transport {transport}"));
            let before = ["recursion", "order", "traversal", "shading"].into_iter();
            let expected: Vec<&str> = before.chain(sorting).chain(["boxes"]).collect();
            assert_eq!(names(&lanes), expected);
        }
    }
    let table = folder.out(line);
    assert!(table.contains("wavefront, one lane: order of work"), "{table}");
}

#[test]
fn costs_of_pixels_add_up_to_the_visits_of_the_profile() {
    let folder = folder(SCENE);
    for (name, transport) in [("whitted", Transport::Whitted), ("path", Transport::Path)] {
        let line = "profile scene.ron --size 24x18 --spp 2 --runs 1 --depth 3";
        let profile = folder.json(&format!("{line} --transport {name}"));
        let mut world = support::world(SCENE);
        let settings = &mut world.settings;
        (settings.size, settings.samples, settings.max_depth) = ([24, 18], 2, 3);
        settings.transport = transport;
        let costs = support::session(&world, Options::default()).costs();
        let bounces = profile["bounces"].as_array().expect("bounces");
        let sum = |bounces: &[serde_json::Value], rays: &str, work: &str| {
            bounces.iter().filter_map(|bounce| bounce[rays][work].as_u64()).sum::<u64>()
        };
        let kinds = |work: &str| {
            let (camera, path) = bounces.split_at(1);
            [sum(camera, "visits", work), sum(path, "visits", work), sum(bounces, "shadow_visits", work)]
        };
        let all = |of: &dyn Fn(&PixelCost) -> [u64; 3]| {
            costs.iter().map(of).fold([0; 3], |sums, more| [0, 1, 2].map(|kind| sums[kind] + more[kind]))
        };
        assert_eq!(all(&|cost| cost.nodes), kinds("nodes"), "{name}");
        assert_eq!(all(&|cost| cost.tests), kinds("primitives"), "{name}");
        assert!(kinds("nodes").iter().all(|nodes| *nodes > 0), "{name}");
    }
}

/// Photons are a stage of their own, which counts all their rays once, for any number of tiles.
#[test]
fn profile_has_a_stage_for_photons() {
    let folder = folder(SCENE);
    let line = "profile scene.ron --size 96x72 --spp 2 --runs 1";
    for transport in ["path", "whitted"] {
        let photons = format!("{line} --transport {transport} --caustics 1");
        let profile = folder.json(&photons);
        let stage = &profile["stages"]["photons"];
        let rays = &profile["wavefront"]["rays"]["photon"];
        assert!(rays.as_u64() > Some(10_000) && rays == &profile["recursive"]["rays"]["photon"], "{profile}");
        assert_eq!(&stage["in"], rays, "{transport}");
        assert!(stage["out"].as_u64() > Some(100) && stage["out"].as_u64() < rays.as_u64(), "{stage}");
        assert!(stage["seconds"].as_f64() > Some(0.0) && stage["calls"].as_u64() > Some(0), "{stage}");
        assert_eq!(profile["photons"]["a_sample"], 96 * 72);
        let table = folder.out(&photons);
        for part in ["rays of photons", "photons             6912 a sample", "\nphotons  "] {
            assert!(table.contains(part), "{part}: {table}");
        }
    }
    let table = folder.out(&format!("{line} --transport whitted"));
    assert!(
        table.contains("photons             none: under Whitted's transport")
            && !table.contains("rays of photons")
    );
    assert!(
        table.lines().filter(|line| !line.starts_with("counters")).all(|line| line.chars().count() <= 100)
    );
}

/// `info` reports the most memory that photons take, and why there are none.
#[test]
fn info_reports_the_memory_of_photons() {
    let folder = folder(SCENE);
    folder.write("path.ron", SCENE.replace("samples: 4,", "samples: 4, transport: Path,"));
    let facts = folder.json("info path.ron");
    let photons = &facts["photons"];
    assert_eq!((&photons["a_sample"], &photons["none"]), (&(4 * 16 * 12).into(), &serde_json::Value::Null));
    assert!(
        photons["ended_bytes"].as_u64() > Some(0) && photons["sorted_bytes"].as_u64() > Some(0),
        "{photons}"
    );
    let text = folder.out("info path.ron");
    assert!(
        text.contains("\nphotons    at most 768 a sample, if they turn out to be of use; in memory about "),
        "{text}"
    );
    let text = folder.out("info scene.ron");
    assert!(text.contains("\nphotons    none: under Whitted's transport"), "{text}");
}

#[test]
fn profile_counts_the_same_rays_as_rendering() {
    let folder = folder(SCENE);
    let line = "profile scene.ron --size 24x18 --spp 2 --runs 2";
    let profile = folder.json(&format!("{line} --trace trace.json"));
    let rendered = folder.json("scene.ron --size 24x18 --spp 2");
    let bounces = profile["bounces"].as_array().expect("bounces");
    let sum = |name: &str| bounces.iter().filter_map(|bounce| bounce[name].as_u64()).sum::<u64>();
    for schedule in ["wavefront", "recursive"] {
        assert_eq!(profile[schedule]["film_hash"], rendered["film_hash"]);
        for kind in ["camera", "reflect", "refract", "shadow"] {
            assert_eq!(profile[schedule]["rays"][kind], rendered["rays"][kind]);
            assert_eq!(rendered["rays"][kind], sum(kind), "{kind}");
        }
        let wall = &profile[schedule]["wall_s"];
        assert!(wall["least"].as_f64() <= wall["median"].as_f64() && wall["median"].as_f64() > Some(0.0));
    }
    assert_eq!(bounces.len(), 4, "max_depth is 3");
    adds_up(&profile);
    assert!(bounces[0]["visits"]["nodes"].as_u64() > Some(0));
    let shade = &profile["stages"]["shade"];
    assert_eq!(shade["in"], sum("hits"));
    assert_eq!(profile["stages"]["shadow"]["in"], sum("shadow"));
    assert_eq!(profile["stages"]["shadow"]["out"].as_u64(), Some(sum("shadow") - sum("blocked")));
    let groups: u64 =
        shade["lanes_histogram"].as_array().expect("a histogram").iter().filter_map(|n| n.as_u64()).sum();
    assert!(groups >= sum("hits") / 16);
    assert!(profile["counters"].is_object());

    let trace = folder.text("trace.json");
    let trace: serde_json::Value = serde_json::from_str(&trace).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events");
    assert!(
        events.iter().any(|event| event["name"] == "shade")
            && events.iter().any(|event| event["name"] == "tile")
    );
    let counted = |queue: &str| {
        let counters = events.iter().filter(|event| event["name"] == format!("{queue}, thread 0"));
        counters.filter_map(|event| event["args"]["items"].as_u64()).sum::<u64>()
    };
    let rays = sum("camera") + sum("reflect") + sum("refract");
    assert_eq!([counted("rays"), counted("hits")], [rays, sum("hits")]);
    assert_eq!(counted("rays to lights"), sum("shadow"));

    let table = folder.out(line);
    assert!(table.contains("wavefront") && table.contains("bounce"), "{table}");
    for line in table.lines().filter(|line| !line.starts_with("counters")) {
        assert!(line.chars().count() <= 100, "{line}");
    }
}

#[test]
fn pages_of_profiles_show_every_stage_and_part() {
    let folder = folder(SCENE);
    folder.write("path&more.ron", SCENE.replace("samples: 4,", "samples: 4, transport: Path,"));
    // Nothing is hit, shaded or lit.
    folder.write("empty.ron", "(entities: [(camera: Pinhole(vertical_fov_degrees: 40))])");
    for scene in ["scene.ron", "path&more.ron", "empty.ron"] {
        let line = format!("profile {scene} --size 24x18 --spp 2 --runs 1 --wave 64 --html page.html");
        let profile = folder.json(&line);
        let page = folder.text("page.html");
        for title in [
            "The stages of the wavefront", "Queues over time", "Time by stage and bounce",
            "What makes the difference", "Lanes", "Roofline", "What costs", "The tree", "Machine",
        ] {
            assert!(page.contains(&format!("<h2>{title}</h2>")), "{title}");
        }
        assert!(!page.contains("NaN") && !page.contains("inf ") && !page.contains("path&more"), "{page}");
        let rays = profile["stages"]["intersect"]["in"].as_u64().expect("a number");
        let entity = profile["entities"][0]["name"].as_str().expect("a name");
        for wanted in [rays.to_string(), entity.to_owned()] {
            assert!(page.replace('\u{2009}', "").contains(&wanted), "{wanted}");
        }
        let tags = |tag: &str| page.matches(tag).count();
        for tag in ["svg", "table", "tr", "figure", "h2"] {
            let opened = tags(&format!("<{tag} ")) + tags(&format!("<{tag}>"));
            assert_eq!(opened, tags(&format!("</{tag}>")), "{tag}");
        }
    }
}

const STUDY: &str = r#"(
    title: "A <small> study",
    text: "First.

    Second.",
    experiments: [
        (name: "light", scenes: [File("scene.ron")], with: (size: (12, 9), samples: 1, pixel_pattern: Regular, max_depth: 0),
         x: LightSamples([1, 4, 16]), series: [(label: "uniform", with: (light_pattern: Uniform)),
                                               (label: "jittered, of course", with: (light_pattern: Jittered))],
         seeds: 3, reference: (light_samples: 400), plots: [(y: Mse, fit: true)]),
        (name: "tree", scenes: [Ball, Cloud], with: (rays: 500), x: Triangles([100, 1000]),
         series: [(label: "tree"), (label: "none", with: (by: BruteForce), most: 100)],
         plots: [(y: NanosecondsPerRay), (y: TreeBytes, log_y: false)]),
    ],
)"#;

#[test]
fn study_resumes_and_writes_a_self_contained_page() {
    let folder = folder(SCENE);
    folder.write("small.ron", STUDY);
    let out = folder.out("study small.ron");
    assert!(out.contains("index.html"), "{out}");
    let results = "out/small/results.csv";
    let text = folder.text(results);
    assert_eq!(text.lines().count(), 1 + 3 * 2 * 3 + 2 * (2 + 1), "{text}");
    let page = folder.text("out/small/index.html");
    for wanted in
        ["A &lt;small&gt; study", "<p>Second.</p>", "uniform: order -", "data:image/png;base64,", "tree, MB"]
    {
        assert!(page.contains(wanted), "{wanted} is missing");
    }
    assert!(!page.contains("http://") || !page.contains("src=\"http"), "the page needs nothing else");
    for plot in ["light_mse.svg", "light_mse.png", "tree_treebytes.svg"] {
        assert!(folder.join("out/small/plots").has(plot), "{plot}");
    }

    // Interrupted after a few jobs: the others run, and existing results are kept.
    let kept: String = text.split_inclusive('\n').take(6).collect();
    folder.write(results, &kept);
    folder.out("study small.ron --quiet");
    let again = folder.text(results);
    assert!(again.starts_with(&kept) && again.lines().count() == text.lines().count());
    let errors = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| line.contains(",light,"));
        let mut lines: Vec<String> =
            lines.map(|line| line.rsplit(',').nth(10).unwrap_or_default().into()).collect();
        lines.sort();
        lines
    };
    assert_eq!(errors(&again), errors(&text));
}

#[test]
fn series_can_edit_the_scene() {
    let folder = folder(SCENE);
    // Twice the light is twice the error, against a reference of its own.
    let study = r#"(title: "t", experiments: [
        (name: "light", scenes: [File("scene.ron")], with: (size: (12, 9), max_depth: 0, set: ["settings.background = 0"]),
         x: Samples([1, 4]), series: [(label: "dim"), (label: "bright", with: (set: ["Light.power_w *= 2"]))],
         seeds: 2, reference: (samples: 100), plots: [(y: Mse)]),
    ])"#;
    folder.write("small.ron", study);
    folder.out("study small.ron");
    let text = folder.text("out/small/results.csv");
    let [dim, bright] = ["dim", "bright"].map(|label| column(&text, "mse", label));
    assert_eq!((dim.len(), bright.len()), (4, 4), "{text}");
    for (dim, bright) in dim.iter().zip(bright) {
        assert!((bright / dim - 4.0).abs() < 0.01, "{dim} {bright}");
    }
}

/// A column of a study's results, in rows that contain a text.
fn column(results: &str, name: &str, text: &str) -> Vec<f64> {
    let at = results.lines().next().and_then(|line| line.split(',').position(|head| head == name));
    let rows = results.lines().filter(|line| line.contains(text));
    rows.filter_map(|row| row.split(',').nth(at?)?.parse().ok()).collect()
}

/// The radius is the only cause of blur of gathered photons. Bias decreases with r², and with a bias this large, in
/// images this small, noise is a tenth of it.
#[test]
fn halving_the_radius_of_photons_quarters_their_bias() {
    let folder = folder(SCENE);
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/studies/photons_scene.ron");
    std::fs::copy(shipped, folder.join("photons_scene.ron")).expect("a scene");
    let study = r#"(title: "t", experiments: [
        (name: "radius", scenes: [File("photons_scene.ron")], with: (size: (64, 48), samples: 4, photons: 4),
         x: PhotonRadius([3, 6]), series: [(label: "gathered")], seeds: 2,
         reference: (samples: 64, hide: ["\"mirror\""],
                     set: ["\"camera\".transform = LookAt(from: (0, 3.5, -1.8), to: (0, 2.5, -1))"]),
         plots: [(y: SquaredBias), (y: Variance)]),
    ])"#;
    folder.write("small.ron", study);
    folder.out("study small.ron");
    let results = folder.text("out/small/results.csv");
    let mean = |name: &str, radius: u32| {
        let values = column(&results, name, &format!("photons_scene,gathered,{radius},"));
        assert_eq!(values.len(), 2, "{results}");
        0.5 * (values[0] + values[1])
    };
    let bias = (mean("squared_bias", 6) / mean("squared_bias", 3)).sqrt();
    assert!((2.9..4.4).contains(&bias), "{bias}\n{results}");
    assert!(mean("variance", 3) > 1.5 * mean("variance", 6), "{results}");
    // Squared bias and variance sum to the error.
    for radius in [3, 6] {
        let parts = mean("squared_bias", radius) + mean("variance", radius);
        assert!((parts / mean("mse", radius) - 1.0).abs() < 0.1, "{radius}: {parts}\n{results}");
    }
}

#[test]
fn study_by_lanes_has_a_job_for_each_instruction_set_and_one_film() {
    let folder = folder(SCENE);
    let study = r#"(title: "t", experiments: [
        (name: "lanes", scenes: [File("scene.ron")], with: (size: (12, 9), samples: 1), x: Lanes([1, 8, 16]),
         series: [(label: "all"), (label: "queries", with: (shading_lanes: 1)), (label: "recursive", with: (schedule: Recursive))],
         plots: [(y: RenderSeconds)]),
    ])"#;
    folder.write("lanes.ron", study);
    folder.out("study lanes.ron");
    let text = folder.text("out/lanes/results.csv");
    let lanes: std::collections::BTreeSet<usize> =
        rayfront::internals::simd::Isa::available().into_iter().map(|isa| isa.lanes()).collect();
    assert!(lanes.contains(&1) && lanes.iter().all(|lanes| [1, 8, 16].contains(lanes)), "{lanes:?}");
    assert_eq!(text.lines().count(), 1 + 3 * lanes.len(), "{text}");
    let films: std::collections::BTreeSet<&str> =
        text.lines().skip(1).filter_map(|line| line.rsplit(',').next()).collect();
    assert_eq!(films.len(), 1, "{text}");
}

#[test]
fn errors_in_studies_are_reported() {
    let folder = folder(SCENE);
    for (from, to, wanted) in [
        ("scene.ron", "none.ron", "none.ron: cannot read"),
        ("seeds: 3", "seed: 3", "small.ron:10:"),
        ("reference: (light_samples: 400), ", "", "no reference"),
    ] {
        folder.write("small.ron", STUDY.replace(from, to));
        let error = folder.fails(1, "study small.ron", &[wanted]);
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
