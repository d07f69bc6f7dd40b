//! Scenes in several files, and variables, as the program renders them.

use super::program::{Place, folder};

const LAMP: &str = r#"(
    variables: {"power": 100, "paint": (0.8, 0.3, 0.1)},
    materials: {"enamel": (diffuse: $paint)},
    entities: [
        (name: "bulb", light: Point(power_w: $power), transform: (translate: (0, 2, 1))),
        (name: "foot", shape: Sphere(radius_m: 0.5), material: "enamel"),
    ],
)"#;

const SCENE: &str = r#"(
    settings: (size: (32, 24), samples: 4),
    variables: {"height": 0.5},
    include: [(file: "parts/lamp.ron", transform: (translate: (-1, $height, 0)))],
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 1), material: "enamel"),
    ],
)"#;

const WHOLE: &str = r#"(
    settings: (size: (32, 24), samples: 4),
    materials: {"enamel": (diffuse: (0.8, 0.3, 0.1))},
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 1), material: "enamel"),
        (name: "place", transform: (translate: (-1, 0.5, 0))),
        (name: "bulb", parent: "place", light: Point(power_w: 100), transform: (translate: (0, 2, 1))),
        (name: "foot", parent: "place", shape: Sphere(radius_m: 0.5), material: "enamel"),
    ],
)"#;

#[test]
fn parts_and_variables_render_the_film_of_the_whole() {
    let here = folder(SCENE);
    std::fs::create_dir(here.join("parts")).expect("a folder");
    here.write("parts/lamp.ron", LAMP);
    here.write("whole.ron", WHOLE);
    let film = here.hash("whole.ron -o whole.png");
    assert_eq!(here.hash("scene.ron -o a.png"), film);
    let statement = "\"bulb\".light.power_w *= 2";
    let doubled = here.hash(&["whole.ron", "-o", "b.png", "--set", statement]);
    assert_ne!(doubled, film);
    assert_eq!(here.hash(&["scene.ron", "-o", "b.png", "--set", statement]), doubled);
    assert_eq!(here.hash("scene.ron -o b.png --var power=200 --var height=0.5"), doubled);
    // What was given is recorded, and the included file belongs to the scene.
    let paint = "paint=Srgb(0.2, 0.4, 0.9)";
    here.out(&["scene.ron", "--var", "power=60", "--var", paint, "-o", "c.png", "-o", "c.film", "-q"]);
    for name in ["c.png", "c.film"] {
        assert_eq!(here.json(&format!("reproduce {name} --schedule recursive"))["identical"], true, "{name}");
    }
    here.write("parts/lamp.ron", LAMP.replace("0.5", "0.6"));
    here.fails(1, "reproduce c.png", &["of another scene", "lamp.ron differs"]);
    here.write("parts/lamp.ron", LAMP.replace("Sphere", "Shere"));
    here.fails(1, "scene.ron -o d.png", &["parts/lamp.ron:6:31: unknown shape \"Shere\""]);
}

#[test]
fn mistakes_in_variables_are_refused_by_the_program() {
    let here = folder(WHOLE);
    here.write("a.ron", "(variables: {\"r\": 1}, entities: [(shape: Sphere(radius_m: $r))])");
    here.fails(2, "a.ron --var radius=2", &["--var: unknown variable \"radius\"; variables: r"]);
    here.fails(
        2,
        "a.ron --var r=tall",
        &["--var: r=tall: expected a number, found tall (for $r at a.ron:1:59)"],
    );
    here.fails(2, "a.ron --var r", &["expected a name and a value as in scene files"]);
    here.write("a.stl", "solid a\nendsolid a\n");
    here.fails(2, "a.stl --var r=2", &["--var: this is for .ron files, not for a.stl"]);
}
