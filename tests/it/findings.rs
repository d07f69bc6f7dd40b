//! Findings about broken scenes, and their absence for good ones.

use std::path::Path;

use rayfront::compile::compile;
use rayfront::error::Diagnostic;
use rayfront::internals::check::{FinishedImage, check, of_image};
use rayfront::internals::cli::understands;
use rayfront::render::{Options, Session};
use rayfront::world::{Settings, World};

use super::support::world;

/// Returns all findings about a scene: from its compilation, from the rules, and about its image.
fn told(world: &World) -> Vec<Diagnostic> {
    let mut settings = world.settings.clone();
    (settings.size, settings.samples) = ([96, 54], 2);
    let mut told = world.warnings.clone();
    let scene = match compile(world, None) {
        Ok(scene) => scene,
        Err(error) => return vec![error_of(&error)],
    };
    told.extend(scene.warnings.iter().cloned());
    let setup = rayfront::internals::render::setup(scene, &settings);
    told.extend(check(world, &setup, true));
    let mut session = Session::of(setup.into(), settings.samples, Options::default());
    session.advance(settings.samples);
    told.extend(told_of_image(&session, &settings));
    told
}

/// Returns the finding about its image.
fn told_of_image(session: &Session, settings: &Settings) -> Option<Diagnostic> {
    of_image(session.setup(), &FinishedImage::new(settings, session.film()), false)
}

fn error_of(error: &rayfront::error::CompileError) -> Diagnostic {
    let severity = rayfront::error::Severity::Warning;
    Diagnostic { code: "error", severity, subject: None, text: error.to_string(), remedy: None }
}

/// True if a part of a command line can be typed, perhaps with a value.
fn is_typed(words: &[String]) -> bool {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let start = match words[0] {
        "rayfront" => vec![],
        _ => vec!["rayfront", "scene.ron"],
    };
    let ends = [&[][..], &["1"], &["scene.ron"]];
    ends.into_iter().any(|end| {
        let line = [&start[..], &words, end].concat();
        understands(&line.into_iter().map(str::to_owned).collect::<Vec<_>>()).is_ok()
    })
}

const EYE: &str = r#"(name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 6), to: (0, 0, 0)))"#;
const FLOOR: &str =
    r#"(name: "floor", shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))))"#;
const BALL: &str = r#"(name: "ball", shape: Sphere(radius_m: 1))"#;
const LAMP: &str = r#"(name: "lamp", light: Point(power_w: 600), transform: (translate: (2, 4, 3)))"#;

const SUN: &str = r#"(name: "sun", light: Directional(irradiance: 3, angle_degrees: 0.53), transform: LookAt(from: (3, 3, 0), to: (0, 0, 0)))"#;

/// The material of a glass body.
const GLASS: &str = "Principled(metallic: 0, roughness: 0, transmission: 1, volume: ())";

/// A pane in front of the camera.
const PANE: &str = r#"(name: "pane", shape: Plane(corners: ((-3, 3, 3), (-3, -1, 3), (3, -1, 3), (3, 3, 3))),
    material: Principled(metallic: 0, roughness: 0, transmission: 1,
                         volume: (attenuation_color: 0.5, attenuation_distance_m: 0.02)))"#;

/// A scene of some entities, in which the names of the above stand for them.
fn scene(settings: &str, entities: &str) -> String {
    let named = [
        ("EYE", EYE),
        ("FLOOR", FLOOR),
        ("BALL", BALL),
        ("LAMP", LAMP),
        ("SUN", SUN),
        ("GLASS", GLASS),
        ("PANE", PANE),
    ];
    let named = named.iter().fold(entities.to_owned(), |text, (name, value)| text.replace(name, value));
    format!("(settings: ({settings}), entities: [{named}])")
}

#[test]
fn broken_scenes_get_their_findings() {
    let mut wrong = Vec::new();
    for case in include_str!("findings.txt").split("\n\n").skip(1) {
        let (name, case) = case.split_once('\n').expect("a name");
        let (text, parts) = case.split_once("\n> ").expect("parts");
        let settings = text.strip_prefix("settings:").and_then(|text| text.split_once('\n'));
        let (settings, entities) = settings.unwrap_or(("transport: Path", text));
        let told = told(&world(&scene(settings, entities)));
        for command in told.iter().filter_map(|it| it.remedy.as_ref()).flat_map(|it| it.commands()) {
            assert!(is_typed(&command), "{name}: {command:?}");
        }
        let told: Vec<String> = told.iter().map(ToString::to_string).collect();
        if !told.iter().any(|finding| parts.trim_end().split(" | ").all(|part| finding.contains(part))) {
            wrong.push(format!("{name}: wanted {parts}, told {told:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The scene that all broken ones are derived from.
#[test]
fn good_scenes_get_no_findings() {
    let pane = r#"(name: "window", shape: Plane(corners: ((3, -1, -4), (3, 9, -4), (3, 9, 4), (3, -1, 4))),
        material: Principled(metallic: 0, roughness: 0, transmission: 1))"#;
    let fog = |radius: f32| {
        format!(
            "(name: \"fog\", shape: Sphere(radius_m: {radius}), material: Principled(metallic: 0, roughness: 0,
              ior: 1, transmission: 1, volume: (attenuation_color: 0.8, attenuation_distance_m: 5,
              multiscatter_color: 0.9)))"
        )
    };
    for more in
        ["LAMP".into(), format!("SUN, {pane}"), format!("LAMP, {}", fog(20.0)), format!("LAMP, {}", fog(1.5))]
    {
        let text = scene("transport: Path", &format!("EYE, BALL, FLOOR, {more}"));
        assert_eq!(told(&world(&text)), [], "{more}");
    }
    // In rooms: with a lamp, with a small bulb, before a picture all around, and before one with something small.
    let eye =
        "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0, 0.3), to: (0, 0, 0)))";
    for room in [
        r#"(shape: Box(size_m: 4)), (light: Point(power_w: 20), transform: (translate: (0.5, 1.5, 0.5)))"#,
        r#"(shape: Box(size_m: 4)), FLOOR, (light: Point(power_w: 20), transform: (translate: (0.5, 1.5, 0.5)))"#,
        r#"(shape: Sphere(radius_m: 4), material: (emission: 0.5))"#,
        r#"(shape: Box(size_m: 4)), (shape: Sphere(radius_m: 0.03), material: (emission: 900), transform: (translate: (0.3, 1.7, 0.9)))"#,
        r#"(shape: Sphere(radius_m: 100), material: (emission: 0.5)), (shape: Sphere(radius_m: 0.02))"#,
    ] {
        let told = told(&world(&scene("transport: Path", &format!("{eye}, {room}"))));
        assert!(told.iter().all(|finding| finding.code != "camera-inside"), "{room}: {told:?}");
    }
}

/// Returns a scene's findings, without the messages of loading and compilation.
fn findings(path: &Path) -> Vec<Diagnostic> {
    let world = rayfront::internals::formats::load(path).expect("a scene");
    let mut settings = world.settings.clone();
    let by = settings.size[0].max(settings.size[1]).div_ceil(96).max(1);
    settings.size = settings.size.map(|side| side.div_ceil(by));
    settings.samples = 2;
    let setup = rayfront::internals::render::setup(compile(&world, None).expect("a scene"), &settings);
    let mut told = check(&world, &setup, true);
    let mut session = Session::of(setup.into(), settings.samples, Options::default());
    session.advance(settings.samples);
    told.extend(told_of_image(&session, &settings));
    told
}

#[test]
fn shipped_scenes_get_no_findings() {
    let mut told = Vec::new();
    for entry in std::fs::read_dir("scenes").expect("scenes") {
        let path = entry.expect("a file").path();
        // It shows silhouettes.
        let is_dark = path.ends_with("figure_01_pinhole.ron");
        if path.extension().is_some_and(|extension| extension == "ron") && !is_dark {
            told.extend(findings(&path).iter().map(|finding| format!("{}: {finding}", path.display())));
        }
    }
    assert!(told.is_empty(), "{}", told.join("\n"));
}

#[test]
fn findings_name_the_place_of_an_entity_without_a_name() {
    let world = world(&scene(
        "transport: Path",
        "EYE, LAMP, FLOOR,\n\n  (shape: Sphere(radius_m: 1), light: Point(power_w: 0))",
    ));
    let found = told(&world).into_iter().find(|it| it.code == "light-without-power").expect("a finding");
    let subject = found.subject.expect("a subject");
    assert!(subject.name.starts_with("the sphere of ") && subject.name.ends_with(":3"), "{subject:?}");
    assert_eq!(subject.position, Some([3, 3]));
    assert!(subject.file.is_some());
}
