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
    let radiance = session.film().radiance();
    let shown = FinishedImage::new(settings, session.film().region(), &radiance);
    of_image(session.setup(), &shown, false)
}

fn error_of(error: &rayfront::error::CompileError) -> Diagnostic {
    let severity = rayfront::error::Severity::Warning;
    Diagnostic { code: "error", severity, subject: None, text: error.to_string(), remedy: None }
}

/// True if a part of a command line can be typed, perhaps with a value.
fn is_typed(words: &[&str]) -> bool {
    let start = match words[0] {
        "rayfront" => vec![],
        _ => vec!["rayfront", "scene.ron"],
    };
    let ends = [&[][..], &["1"], &["scene.ron"]];
    ends.into_iter().any(|end| {
        let line = [&start[..], words, end].concat();
        understands(&line.into_iter().map(str::to_owned).collect::<Vec<_>>()).is_ok()
    })
}

const EYE: &str = r#"(name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 6), to: (0, 0, 0)))"#;
const FLOOR: &str =
    r#"(name: "floor", shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4))))"#;
const BALL: &str = r#"(name: "ball", shape: Sphere(radius_m: 1))"#;
const LAMP: &str = r#"(name: "lamp", light: Point(power_w: 600), transform: (translate: (2, 4, 3)))"#;

const SUN: &str = r#"(name: "sun", light: Directional(irradiance: 3, angle_degrees: 0.53), transform: LookAt(from: (3, 3, 0), to: (0, 0, 0)))"#;

/// A scene of some entities under the path transport.
fn scene(entities: &[&str]) -> String {
    format!("(settings: (transport: Path), entities: [{}])", entities.join(", "))
}

/// A pane in front of the camera.
const PANE: &str = r#"(name: "pane", shape: Plane(corners: ((-3, 3, 3), (-3, -1, 3), (3, -1, 3), (3, 3, 3))),
    material: Principled(metallic: 0, roughness: 0, transmission: 1,
                         volume: (attenuation_color: 0.5, attenuation_distance_m: 0.02)))"#;

/// A glass mesh.
fn glass(mesh: &str, scale: f32, more: &str) -> String {
    format!(
        "(name: \"glass\", shape: Mesh(\"{mesh}\"), transform: (translate: (0, 0, 0), scale: {scale}),
          material: Principled(metallic: 0, roughness: 0, transmission: 1, {more}))"
    )
}

/// Names, scenes, and parts of the expected finding.
fn broken() -> Vec<(&'static str, String, Vec<&'static str>)> {
    let lamp = |text: &str| format!("(name: \"lamp\", {text})");
    let ball_of =
        |material: &str| format!("(name: \"ball\", shape: Sphere(radius_m: 1), material: {material})");
    let settings = |settings: &str, entities: &[&str]| {
        format!("(settings: ({settings}), entities: [{}])", entities.join(", "))
    };
    let eye = |from: &str, to: &str| {
        format!("(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: {from}, to: {to}))")
    };
    vec![
        ("no shape", scene(&[EYE, LAMP]), vec!["no shape"]),
        ("no camera", scene(&[BALL, LAMP]), vec!["no camera", "camera: Pinhole"]),
        ("no light", scene(&[EYE, BALL, FLOOR]), vec!["there is no light", "--env studio"]),
        (
            "an environment under Whitted's transport",
            settings("transport: Whitted", &[EYE, BALL, "(light: Environment(radiance: 1))"]),
            vec!["lights no surface under Whitted's transport", "--transport path"],
        ),
        (
            "what shines as the only light, under Whitted's transport",
            settings("transport: Whitted", &[EYE, &ball_of("(emission: 5)"), FLOOR]),
            vec!["lights nothing else under Whitted's transport", "--transport path"],
        ),
        (
            "an angle of view in radians",
            scene(&[&EYE.replace("40", "0.8"), BALL, FLOOR, LAMP]),
            vec!["angle of view is 0.80 degrees", "vertical_fov_degrees: 46"],
        ),
        (
            "a lens in millimetres",
            scene(&[
                &EYE.replace("Pinhole(", "ThinLens(lens_radius_m: 25, focus_distance_m: 5, "),
                BALL,
                FLOOR,
                LAMP,
            ]),
            vec!["lens's radius is 25 m", "lens_radius_m: 0.025"],
        ),
        (
            "a camera in the middle of everything",
            scene(&[
                &eye("(0, 0, 0)", "(0, 1, 0)"),
                "(shape: Sphere(radius_m: 0.1), transform: (translate: (3, 0, 0)))",
                "(shape: Sphere(radius_m: 0.1), transform: (translate: (-3, 0, 0)))",
                LAMP,
            ]),
            vec!["the camera sees nothing", "LookAt(from: (0.0000, -"],
        ),
        (
            "a camera that looks away",
            scene(&[&eye("(0, 1, 6)", "(0, 1, 12)"), BALL, LAMP]),
            vec!["the camera sees nothing", "behind it", "LookAt"],
        ),
        (
            "a camera that looks past everything",
            scene(&[&eye("(0, 1, 6)", "(9, 1, 3)"), BALL, LAMP]),
            vec!["the camera sees nothing", "outside its view"],
        ),
        (
            "a camera in a ball",
            scene(&[&eye("(0, 0, 0.5)", "(0, 0, 0)"), BALL, FLOOR, LAMP]),
            vec!["the camera is inside \"ball\""],
        ),
        (
            "a lamp in a ball",
            scene(&[EYE, BALL, FLOOR, &lamp("light: Point(power_w: 600)")]),
            vec!["lamp", "it is inside \"ball\"", "emission"],
        ),
        (
            "a lamp in a ball beside one that shines",
            scene(&[EYE, BALL, FLOOR, LAMP, "(name: \"core\", light: Point(power_w: 600))"]),
            vec!["core", "it is inside \"ball\""],
        ),
        (
            "a lamp in a ball, not in its middle, under Whitted's transport",
            settings(
                "transport: Whitted",
                &[
                    EYE,
                    BALL,
                    FLOOR,
                    &lamp("light: Point(power_w: 600), transform: (translate: (0.3, 0.1, 0))"),
                ],
            ),
            vec!["lamp", "it is inside \"ball\"", "(move it out)"],
        ),
        (
            "a spot that shines past everything",
            scene(&[
                EYE,
                BALL,
                FLOOR,
                &lamp(
                    "light: Spot(power_w: 600, inner_degrees: 10, outer_degrees: 20), transform: LookAt(from: (0, 4, 0), to: (0, 9, 0.1))",
                ),
            ]),
            vec!["lamp", "it shines past everything", "-Z", "LookAt"],
        ),
        (
            "a panel that shines at the ceiling, where there is none",
            scene(&[
                EYE,
                BALL,
                FLOOR,
                &lamp(
                    "light: Area(power_w: 600, size_m: 1), transform: (translate: (0, 4, 0), rotate_degrees: (90, 0, 0))",
                ),
            ]),
            vec!["lamp", "it shines past everything"],
        ),
        (
            "a panel that faces away from what is seen",
            scene(&[
                EYE,
                BALL,
                "(name: \"wall\", shape: Sphere(radius_m: 15), material: (diffuse: 0), transform: (translate: (0, 0, 40)))",
                &lamp(
                    "light: Area(power_w: 600, size_m: 1), transform: LookAt(from: (0, 0, 20), to: (0, 0, 40))",
                ),
            ]),
            vec!["lamp", "it faces away from everything that is seen"],
        ),
        (
            "a lamp behind a wall",
            scene(&[
                EYE,
                "(name: \"wall\", shape: Plane(corners: ((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))))",
                &lamp(
                    "light: Spot(power_w: 600, inner_degrees: 20, outer_degrees: 30), transform: LookAt(from: (0, 0, -3), to: (0, 0, 0))",
                ),
            ]),
            vec!["lamp", "nothing that is seen is lit by it", "\"wall\" stands between"],
        ),
        (
            "a lamp without power",
            scene(&[EYE, BALL, FLOOR, &lamp("light: Point(power_w: 0), transform: (translate: (2, 4, 3))")]),
            vec!["lamp", "a power of 0 W"],
        ),
        (
            "a sun without irradiance",
            scene(&[EYE, BALL, FLOOR, &lamp("light: Directional(irradiance: 0)")]),
            vec!["lamp", "an irradiance of 0"],
        ),
        (
            "a sheet seen from behind",
            scene(&[
                EYE,
                LAMP,
                "(name: \"fan\", shape: Triangle(vertices: ((-3, -2, 0), (0, 3, 0), (3, -2, 0))), material: Principled(double_sided: false))",
            ]),
            vec!["fan", "it is seen from behind", "double_sided: true"],
        ),
        (
            "sheets seen from behind, each of which is small in the image",
            scene(&[
                EYE,
                LAMP,
                "(name: \"left\", shape: Triangle(vertices: ((-2, -0.5, 0), (-1.5, 0.5, 0), (-1, -0.5, 0))), material: Principled(double_sided: false))",
                "(name: \"right\", shape: Triangle(vertices: ((1, -0.5, 0), (1.5, 0.5, 0), (2, -0.5, 0))), material: Principled(double_sided: false))",
            ]),
            vec!["right", "it is seen from behind", "double_sided: true"],
        ),
        (
            "alpha zero everywhere",
            scene(&[EYE, FLOOR, LAMP, &ball_of("Principled(alpha: 0, alpha_mode: Blend)")]),
            vec!["its alpha is 0 everywhere", "alpha_mode: Opaque"],
        ),
        (
            "emission of zero as the only light",
            scene(&[EYE, FLOOR, &ball_of("Principled(emission: 0)")]),
            vec!["there is no light"],
        ),
        (
            "colours up to 255",
            scene(&[EYE, FLOOR, LAMP, &ball_of("(diffuse: (255, 128, 0))")]),
            vec!["its diffuse is 255", "divide it by 255", "Srgb"],
        ),
        (
            "a picture of colours that is read as numbers",
            scene(&[
                EYE,
                FLOOR,
                LAMP,
                &ball_of("Principled(base_color: Texture(image: \"quarters.png\", color_space: Linear))"),
            ]),
            vec!["base_color is read as numbers", "color_space: Srgb"],
        ),
        (
            "a picture of roughness that is read as colours",
            scene(&[
                EYE,
                FLOOR,
                LAMP,
                &ball_of("Principled(roughness: Texture(image: \"quarters.png\", color_space: Srgb))"),
            ]),
            vec!["roughness is read as colours", "color_space: Linear"],
        ),
        (
            "a scene in millimetres",
            scene(&[
                &eye("(0, 1000, 6000)", "(0, 0, 0)"),
                "(name: \"ball\", shape: Sphere(radius_m: 1000))",
                &lamp("light: Point(power_w: 60), transform: (translate: (2000, 4000, 3000))"),
            ]),
            vec!["its lamps, which shine with watts, are lost in it", "scale: 0.001"],
        ),
        (
            "everything in a dot",
            scene(&[
                &eye("(0, 1000, 6000)", "(0, 0, 0)"),
                BALL,
                "(light: Directional(irradiance: 3), transform: LookAt(from: (0, 5, 5), to: (0, 0, 0)))",
            ]),
            vec!["smaller than two pixels"],
        ),
        (
            "far too much light",
            scene(&[
                EYE,
                BALL,
                FLOOR,
                &lamp("light: Point(power_w: 100000), transform: (translate: (2, 4, 3))"),
            ]),
            vec!["of what is seen is white", "--exposure auto"],
        ),
        (
            "far too little",
            scene(&[
                EYE,
                BALL,
                FLOOR,
                &lamp("light: Point(power_w: 0.05), transform: (translate: (2, 4, 3))"),
            ]),
            vec!["of what is seen is black", "--exposure auto"],
        ),
        (
            "settings that the transport makes no use of",
            settings("transport: Whitted, clamp: 3, sharing: 16", &[EYE, BALL, LAMP]),
            vec!["makes no use of clamp, sharing", "transport: Path does"],
        ),
        (
            "a background behind an environment",
            settings(
                "transport: Path, background: 0.5",
                &[EYE, BALL, "(name: \"haze\", light: Environment(radiance: 1))"],
            ),
            vec!["background does nothing", "\"haze\"", "--env none"],
        ),
        (
            "glass of metal",
            scene(&[EYE, FLOOR, LAMP, &ball_of("Principled(transmission: 1, metallic: 1)")]),
            vec!["metals let no light through", "metallic: 0"],
        ),
        (
            "a pane that is there from the other side alone",
            scene(&[
                EYE,
                FLOOR,
                LAMP,
                r#"(name: "pane", shape: Triangle(vertices: ((-3, -1, 2), (0, 4, 2), (3, -1, 2))),
                    material: Principled(metallic: 0, roughness: 0, transmission: 1))"#,
            ]),
            vec!["pane", "seen from behind", "double_sided: true"],
        ),
        (
            "a window of solid glass before the sun",
            scene(&[
                EYE,
                BALL,
                FLOOR,
                SUN,
                r#"(name: "window", shape: Mesh("cube.ply"), transform: (translate: (3, 4, 0), scale: (0.02, 10, 8)),
                    material: Principled(metallic: 0, roughness: 0, transmission: 0.9, volume: ()))"#,
                "(light: Environment(radiance: 0.1))",
            ]),
            vec![
                "sun",
                "the glass of \"window\" keeps its light from",
                "transmission: 1",
                "without a volume",
            ],
        ),
        (
            "glass that is deeper than paths",
            settings(
                "transport: Path, max_depth: 0",
                &[EYE, FLOOR, LAMP, &glass("ball.ply", 1.0, "volume: ()")],
            ),
            vec![
                "% of the light that the camera would see is lost inside \"glass\"",
                "0 bounces",
                "--depth 8",
            ],
        ),
        (
            "glass with a hole",
            scene(&[EYE, FLOOR, LAMP, &glass("nicked ball.ply", 1.0, "volume: ()")]),
            vec!["glass: it has holes", "of its"],
        ),
        (
            "glass that is turned inside out",
            scene(&[EYE, FLOOR, LAMP, &glass("inward cube.ply", 1.0, "volume: ()")]),
            vec!["glass: its faces are wound inwards", "Recalculate Outside"],
        ),
        (
            "water that shares a wall with its glass",
            scene(&[
                EYE,
                FLOOR,
                LAMP,
                &glass("cube.ply", 1.0, "volume: ()"),
                &glass("cube.ply", 1.0, "ior: 1.33, volume: ()")
                    .replace("\"glass\"", "\"water\"")
                    .replace("(0, 0, 0)", "(1, 0.2, 0.1)"),
            ]),
            vec!["glass: ", "% of its surface is also that of \"water\"", "a little into the other"],
        ),
        (
            "a pane of a volume with nothing behind it",
            scene(&[EYE, BALL, FLOOR, LAMP, PANE]),
            vec!["pane: it encloses nothing (4 of its 5 edges are open)", "thickness_m: 0.01"],
        ),
        (
            "a pane of a volume that is so thick",
            scene(&[EYE, BALL, FLOOR, LAMP, &PANE.replace("volume: (", "volume: (thickness_m: 0.02, ")]),
            vec!["thin sheets", "pane (0.02 m, 4 of 5 edges open)"],
        ),
        (
            "fog that no light gets into",
            scene(&[
                EYE,
                FLOOR,
                LAMP,
                &ball_of(
                    "Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.33, volume: (attenuation_color: 0.5, \
                     attenuation_distance_m: 2, multiscatter_color: 1))",
                ),
            ]),
            vec!["none of the lamps' light is scattered in it", "Area(visible: true"],
        ),
        (
            "more bodies than a path can remember",
            scene(&[
                EYE,
                LAMP,
                &(1..12)
                    .map(|i| {
                        format!(
                            "(name: \"shell {i}\", shape: Sphere(radius_m: {}), material: Principled(metallic: 0, \
                             roughness: 0, transmission: 1, volume: ()))",
                            f64::from(i) / 12.0
                        )
                    })
                    .collect::<Vec<_>>()
                    .join(", "),
            ]),
            vec!["9 bodies are within each other", "paths know of 8", "shell 11, shell 10"],
        ),
        (
            "a bubble that says what is around it",
            scene(&[
                EYE,
                LAMP,
                &ball_of("(ior: 1.5)"),
                "(shape: Sphere(radius_m: 0.5), material: (ior: 0.6667))",
            ]),
            vec!["0.6667, below that of air", "ior: 1 for a bubble"],
        ),
        (
            "two skies",
            scene(&[EYE, BALL, r#"(name: "a", light: Environment())"#, r#"(name: "b", light: Sky())"#]),
            vec!["\"a\" is the first", "no light comes from b"],
        ),
        (
            "an alpha that does nothing",
            scene(&[EYE, FLOOR, LAMP, &ball_of("Principled(metallic: 0, alpha: 0.2)")]),
            vec!["alpha does nothing", "alpha_mode: Blend"],
        ),
        (
            "glass with a diffuse colour",
            scene(&[EYE, FLOOR, LAMP, &ball_of("(diffuse: 0.5, ior: 1.5)")]),
            vec!["makes no use of diffuse of materials with an ior", "transport: Whitted does"],
        ),
        (
            "a transport that nobody named",
            format!("(entities: [{EYE}, {LAMP}, {}])", ball_of("Principled(metallic: 0)")),
            vec!["the path transport was chosen"],
        ),
    ]
}

#[test]
fn broken_scenes_get_their_findings() {
    let mut table = String::new();
    let mut wrong = Vec::new();
    for (name, text, parts) in broken() {
        let diagnostics = told(&world(&text));
        for command in diagnostics.iter().filter_map(|it| it.remedy.as_ref()).flat_map(|it| it.commands()) {
            assert!(is_typed(&command), "{name}: {command:?}");
        }
        let told: Vec<String> = diagnostics.iter().map(ToString::to_string).collect();
        let found = told.iter().find(|sentence| parts.iter().all(|part| sentence.contains(part)));
        table += &format!("| {name} | {} |\n", found.unwrap_or(&"nothing of the kind".to_owned()));
        if found.is_none() {
            wrong.push(format!("{name}: wanted {parts:?}, told {told:?}"));
        }
    }
    println!("{table}");
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
    for more in [&[LAMP][..], &[SUN, pane], &[LAMP, &fog(20.0)], &[LAMP, &fog(1.5)]] {
        let entities = [&[EYE, BALL, FLOOR], more].concat();
        assert_eq!(told(&world(&scene(&entities))), [], "{more:?}");
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
    let world =
        world(&scene(&[EYE, LAMP, FLOOR, "\n\n  (shape: Sphere(radius_m: 1), light: Point(power_w: 0))"]));
    let found = told(&world).into_iter().find(|it| it.code == "light-without-power").expect("a finding");
    let subject = found.subject.expect("a subject");
    assert!(subject.name.starts_with("the sphere of ") && subject.name.ends_with(":3"), "{subject:?}");
    assert_eq!(subject.position, Some([3, 3]));
    assert!(subject.file.is_some());
}
