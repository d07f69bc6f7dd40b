//! Shadow catchers: they show exactly what is behind them, darkened as an ordinary floor would be.

use rayfront::film::Film;
use rayfront::internals::integrator::Schedule;
use rayfront::render::Options;
use rayfront::world::World;

use crate::support::{self, film, mean};

/// A floor with things on it that block light, let it through, and reflect it.
const SCENE: &str = r#"(
    settings: (size: (24, 16), samples: SAMPLES, transport: Path, SETTINGS),
    materials: {
        "floor": Principled(metallic: 0, base_color: 0.6, roughness: ROUGHNESS, shadow_catcher: CATCHES),
        "red": Principled(metallic: 0, base_color: (0.8, 0.1, 0.1)),
        "grey": Principled(metallic: 0, base_color: 0.4),
        "glass": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: Some(())),
        "lamp": Principled(metallic: 0, base_color: 0, specular: 0, emission: 20),
        "pane": Principled(metallic: 0, base_color: 0.3, roughness: 0, transmission: 1),
        "veil": Principled(metallic: 0, base_color: 0.2, alpha: 0.5, alpha_mode: Blend),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 2, 6), to: (0, 0.4, 0))),
        (shape: Plane(corners: ((-50, 0, 50), (50, 0, 50), (50, 0, -50), (-50, 0, -50))), material: "floor"),
        THINGS
        LIGHTS
    ],
)"#;

const THINGS: &str = r#"
    (shape: Sphere(radius_m: 0.5), material: "red", transform: (translate: (-1.2, 0.5, 0))),
    (shape: Sphere(radius_m: 0.5), material: "glass", transform: (translate: (0, 0.6, 0))),
    (shape: Plane(corners: ((0.8, 0.1, 0), (1.8, 0.1, 0), (1.8, 1, 0), (0.8, 1, 0))), material: "veil"),
"#;

/// Each kind of light, and all together.
const LIGHTS: [&str; 5] = [
    "(light: Point(power_w: 200), transform: (translate: (0.5, 4, -2.5))),",
    "(light: Directional(irradiance: 2, angle_degrees: 4), transform: (rotate_degrees: (-50, 210, 0))),",
    "(light: Environment(radiance: (0.4, 0.6, 1))),",
    r#"(shape: Sphere(radius_m: 0.4), material: "lamp", transform: (translate: (-1, 3.7, -2))),"#,
    r#"(light: Point(power_w: 200), transform: (translate: (0.5, 4, -2.5))), (light: Sky(elevation_degrees: 30)),
    (light: Area(power_w: 60, size_m: (1, 1)), transform: (translate: (-1, 3.7, -2), rotate_degrees: (-90, 0, 0))),"#,
];

fn scene(catches: bool, things: &str, lights: &str, samples: u32, settings: &str) -> World {
    let text = SCENE.replace("CATCHES", if catches { "true" } else { "false" });
    let text = text.replace("SAMPLES", &samples.to_string()).replace("SETTINGS", settings);
    support::world(&text.replace("ROUGHNESS", "1").replace("THINGS", things).replace("LIGHTS", lights))
}

fn render(world: &World) -> Film {
    film(world, Options::default())
}

/// White stays white, whatever lights the floor and however few samples find that light.
#[test]
fn floors_without_things_show_exactly_what_is_behind() {
    for lights in LIGHTS {
        let film = render(&scene(true, "", lights, 2, "backdrop: (0.25, 1, 3)"));
        for pixel in film.radiance() {
            for (shown, behind) in pixel.to_array().into_iter().zip([0.25, 1.0, 3.0]) {
                assert!((shown - behind).abs() < 1e-6, "{lights}: {pixel:?}");
            }
        }
        let film = render(&scene(true, "", lights, 2, "transparent: true"));
        assert!(film.alpha().unwrap().iter().all(|alpha| *alpha == 0.0), "{lights}");
        assert!(mean(&film.radiance()) < 1e-6, "{lights}");
    }
}

/// Differential rendering in two ways: by the catcher, and by two renderings of an ordinary floor.
#[test]
fn shadows_are_those_of_an_ordinary_floor() {
    // Caustics of glass are noisy.
    let things = &THINGS.replace("glass", "grey");
    let seen = |film: &Film| film.radiance().into_iter().map(|light| light.g).collect::<Vec<f32>>();
    // Where only the floor is seen: no light darkens it.
    let free = render(&scene(true, things, "", 64, "transparent: true")).alpha().unwrap();
    for lights in LIGHTS {
        let caught = seen(&render(&scene(true, things, lights, 128, "caustics: Off, backdrop: 1")));
        let with = seen(&render(&scene(false, things, lights, 256, "caustics: Off, backdrop: 1")));
        let without = seen(&render(&scene(false, "", lights, 256, "caustics: Off, backdrop: 1")));
        let (mut sum, mut count, mut darkest) = (0.0f32, 0.0f32, 1.0f32);
        for at in (0..caught.len()).filter(|at| free[*at] == 0.0) {
            let expected = (with[at] / without[at]).min(1.0);
            assert!(
                (caught[at] - expected).abs() < 0.06,
                "{lights}, pixel {at}: {}, not {expected}",
                caught[at]
            );
            (sum, count) = (sum + caught[at] - expected, count + 1.0);
            darkest = darkest.min(expected);
        }
        assert!((sum / count).abs() < 0.01, "{lights}: {} in the mean", sum / count);
        assert!(count > 100.0 && darkest < 0.9, "{lights}: nothing is in shadow here, {darkest}");
    }
}

/// Shadows of grey light are the same on a background as over it.
#[test]
fn transparent_shadows_over_a_background_are_those_on_it() {
    let things = THINGS.replace("red", "grey");
    let on = render(&scene(true, &things, LIGHTS[0], 64, "background: 0.7"));
    let over = render(&scene(true, &things, LIGHTS[0], 64, "background: 0.7, transparent: true"));
    let alpha = over.alpha().unwrap();
    for ((on, own), alpha) in on.radiance().iter().zip(over.radiance()).zip(alpha) {
        let over = own.r + 0.7 * (1.0 - alpha);
        assert!((on.r - over).abs() < 2e-3, "{} on it, {over} over it", on.r);
    }
}

#[test]
fn catchers_are_the_same_in_all_ways_to_render() {
    let ways = [
        "backdrop: 1, sharing: 16, caustics: (photons: 1)",
        "transparent: true",
        "clamp: 0.5, light_groups: true",
        "backdrop: 2, adaptive: On",
    ];
    for settings in ways {
        let world = scene(true, THINGS, LIGHTS[4], 8, settings);
        let expected = render(&world);
        assert!(mean(&expected.radiance()) > 1e-3, "{settings}");
        for (schedule, wave) in
            [(Schedule::Recursive, 64), (Schedule::Wavefront, 50), (Schedule::Wavefront, 1)]
        {
            let found = film(&world, Options { schedule, wave, ..Options::default() });
            assert_eq!(found, expected, "{settings}, {schedule:?}, wave {wave}");
        }
    }
}

/// Light that goes straight on through something is found by light samples and by drawn directions, and counts once.
#[test]
fn shadows_of_a_pane_let_the_same_light_through() {
    let pane = r#"(shape: Plane(corners: ((-9, 2.5, 9), (9, 2.5, 9), (9, 2.5, -9), (-9, 2.5, -9))), material: "pane"),"#;
    let lamp = r#"(shape: Sphere(radius_m: 20), material: "lamp", transform: (translate: (0, 23, 0))),"#;
    // The lowest rows show nothing but the floor.
    let seen = |catches, things| {
        let film = render(&scene(catches, things, lamp, 64, "background: 0.001"));
        mean(&film.radiance()[12 * 24..])
    };
    let (caught, with, without) = (seen(true, pane), seen(false, pane), seen(false, ""));
    let (found, expected) = (caught / 0.001, with / without);
    assert!((found - expected).abs() < 0.02, "{found}, not {expected}");
}
