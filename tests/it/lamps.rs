//! Emissive surfaces as lights of the path transport, with any placement.

use rayfront::compile::compile;
use rayfront::internals::film::Film;
use rayfront::internals::scene::Emitters;
use rayfront::math::Rgb;
use rayfront::render::{Options, Session};
use rayfront::world::{Settings, Shape, World};

use crate::support::world;

/// A floor below emitters that are out of view.
fn scene(lamps: &str) -> World {
    world(&format!(
        "(
        settings: (size: (16, 12), samples: 256, max_depth: 1, transport: Path, filter: Box,
            copied_triangles: 0),
        materials: {{
            \"glow\": BlinnPhong(diffuse: 0, emission: (4, 3, 2)),
            \"bright\": BlinnPhong(diffuse: 0, emission: 12),
            \"front\": Principled(base_color: 0, metallic: 0, emission: (5, 3, 4)),
            \"colours\": BlinnPhong(diffuse: 0, emission: Image(\"quarters.png\")),
        }},
        entities: [
            (camera: Pinhole(vertical_fov_degrees: 90), transform: LookAt(from: (0, 1, 0.1), to: (0, 0, 0))),
            (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))), material: (diffuse: 0.7)),
            {lamps}
        ],
    )"
    ))
}

/// Gives each entity a mesh of its own.
fn apart(mut world: World) -> World {
    let mut entities = world.in_order();
    entities.retain(|entity| world.entities.get::<&Shape>(*entity).is_ok());
    for entity in entities {
        let shape = (*world.entities.get::<&Shape>(entity).expect("it has one")).clone();
        if let Shape::Mesh(id) = shape {
            let copy = world.assets.meshes[id.0 as usize].clone();
            let copy = world.assets.add_mesh(copy);
            world.entities.insert_one(entity, Shape::Mesh(copy)).expect("it is there");
        }
    }
    world
}

fn film(world: &World, sampled: bool) -> Film {
    film_of(world, world.settings.samples, sampled)
}

/// Light that is only hit by chance takes many more samples for the same accuracy.
const MORE: u32 = 64;

fn film_of(world: &World, samples: u32, sampled: bool) -> Film {
    let mut scene = compile(world, None).unwrap();
    assert!(!scene.emitters.is_empty());
    if !sampled {
        scene.emitters = Emitters::default().into();
    }
    let settings = Settings { samples, ..world.settings.clone() };
    let mut session = Session::new(scene, &settings, Options::default());
    session.advance(u32::MAX);
    session.film().clone()
}

fn mean(film: &Film) -> f64 {
    crate::support::mean(&film.radiance())
}

/// Three instances: rotated, mirrored and scaled.
fn three(mesh: &str, materials: [&str; 3]) -> World {
    let places = [
        "(translate: (-1.5, 2.2, 0.5), rotate_degrees: (20, 40, 60), scale: 0.4)",
        "(translate: (1.5, 2.4, 0.3), scale: (-0.4, 0.5, 0.4))",
        "(translate: (0.2, 2.1, -1), rotate_degrees: (200, 10, 0), scale: 0.5)",
    ];
    let entity = |(place, material): (&str, &str)| {
        format!("(shape: Mesh(\"{mesh}.ply\"), material: \"{material}\", transform: {place}),")
    };
    scene(&places.into_iter().zip(materials).map(entity).collect::<String>())
}

#[test]
fn emissive_instances_light_like_separate_meshes() {
    for (mesh, materials) in [
        ("tetrahedron", ["glow"; 3]),
        ("tetrahedron", ["front", "front", "bright"]),
        ("bowl", ["glow", "bright", "colours"]),
    ] {
        let shared = three(mesh, materials);
        let emitters = |world: &World| compile(world, None).unwrap().emitters.len();
        // Transformed corners may be too inexact for two triangles to be one parallelogram.
        assert!((1..=emitters(&apart(three(mesh, materials)))).contains(&emitters(&shared)));
        let (placed, apart) = (film(&shared, true), film(&apart(three(mesh, materials)), true));
        let mut copied = three(mesh, materials);
        copied.settings.copied_triangles = 1000;
        assert!(film(&copied, true) == apart, "{mesh} {materials:?}: copies are meshes like others");
        assert!((mean(&placed) / mean(&apart) - 1.0).abs() < 0.01, "{} {}", mean(&placed), mean(&apart));
        let by_chance = film(&shared, false);
        let samples = shared.settings.samples;
        let (a, b) = (film_of(&shared, 16 * samples, true), film_of(&shared, MORE * samples, false));
        assert!((mean(&b) / mean(&a) - 1.0).abs() < 0.01, "{} {}", mean(&b), mean(&a));
        let (noise, before) = (placed.noise().unwrap(), by_chance.noise().unwrap());
        println!("{mesh} {materials:?}: noise {noise} {before}");
        assert!(noise < 0.5 * before, "{mesh} {materials:?}: {noise} {before}");
    }
}

/// Emissive instances among others that are not, whichever mesh comes first.
#[test]
fn only_emissive_instances_become_emitters() {
    let dark = "(shape: Mesh(\"ball.ply\"), material: (diffuse: 0.5), transform: (translate: (-2, 0, 0))),";
    let lamp = |x: f32| {
        format!(
            "(shape: Mesh(\"tetrahedron.ply\"), material: \"bright\",
              transform: (translate: ({x}, 2, 1), scale: 0.4)),"
        )
    };
    let (one, two) = (lamp(0.5), lamp(1.5));
    let expected = mean(&film(&apart(scene(&format!("{dark}{dark}{one}{two}"))), true));
    for order in [[dark, dark, &one, &two], [&one, dark, &two, dark], [&one, &two, dark, dark]] {
        let world = scene(&order.concat());
        assert_eq!(compile(&world, None).unwrap().emitters.len(), 8);
        let found = mean(&film(&world, true));
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }
}

#[test]
fn textured_emissive_spheres_are_sampled_as_lights() {
    let lamp = "(shape: Sphere(radius_m: 0.4), material: \"colours\",
                 transform: (translate: (0.3, 2.2, 0), rotate_degrees: (30, 70, 10))),";
    let world = scene(lamp);
    let (sampled, by_chance) = (film(&world, true), film(&world, false));
    let samples = world.settings.samples;
    let (many, more) = (film_of(&world, 16 * samples, true), film_of(&world, MORE * samples, false));
    let (a, b) = (mean(&many), mean(&more));
    assert!((a / b - 1.0).abs() < 0.01, "{a} {b}");
    let (noise, before) = (sampled.noise().unwrap(), by_chance.noise().unwrap());
    assert!(noise < 0.5 * before, "{noise} {before}");
    // Each half of the floor has the colours that it faces.
    let (sampled, by_chance) = (many.radiance(), more.radiance());
    for side in 0..2 {
        let sum = |pixels: &[Rgb]| {
            let half = pixels.iter().enumerate().filter(|(i, _)| i % 16 / 8 == side);
            half.fold(Rgb::BLACK, |sum, (_, pixel)| sum + *pixel).to_array()
        };
        let (a, b) = (sum(&sampled), sum(&by_chance));
        assert!((0..3).all(|i| (a[i] / b[i] - 1.0).abs() < 0.02), "{a:?} {b:?}");
    }
}

/// Lights that do not reach the floor or are a million times weaker.
fn beside() -> [(&'static str, String); 3] {
    let place = |i: i32| format!("{}, {}, {}", (i % 8) as f32 * 0.5 - 2.0, -0.3, (i / 8) as f32 * 0.5 - 2.0);
    let below = |i| format!("(light: Point(power_w: 300), transform: (translate: ({}))),", place(i));
    let suns = |i: i32| {
        let from = format!("({}, 1, 0.2)", i as f32 * 0.2 - 1.0);
        format!("(light: Directional(irradiance: 0.000002), transform: LookAt(from: {from}, to: (0, 0, 0))),")
    };
    let ball = "(light: Directional(irradiance: 2), transform: LookAt(from: (0, -1, 0), to: (0, 0, 0), up: (1, 0, 0))),";
    [
        ("below the floor", (0..64).map(below).collect()),
        ("weak suns", (0..9).map(suns).collect()),
        ("a sun from below", ball.into()),
    ]
}

/// A single relevant light is chosen as if it were the only one.
#[test]
fn lights_without_contribution_add_no_noise() {
    let sun = "(light: Directional(irradiance: 2, angle_degrees: 2), transform: LookAt(from: (1, 2, 1), to: (0, 0, 0))),";
    let lamp = "(light: Point(power_w: 100), transform: (translate: (0.5, 2, 0.5))),";
    let noise = |lights: &str| film(&scene(lights), true).noise().expect("more than one sample");
    for alone in [sun, lamp] {
        let before = noise(alone);
        for (name, besides) in beside() {
            let now = noise(&format!("{alone}{besides}"));
            assert!(now < 1.2 * before + 0.001, "{alone} {name}: {now}, alone {before}");
        }
    }
}

/// Light adds up, whatever the choice of lights.
#[test]
fn light_of_several_lights_adds_up() {
    // Shapes stay in place when their emission is removed.
    let (colours, front, dark) = ("material: \"colours\"", "material: \"front\"", "material: (diffuse: 0)");
    let lights = [
        "(light: Directional(irradiance: 0.5, angle_degrees: 1), transform: LookAt(from: (1, 2, 1), to: (0, 0, 0))),",
        "(light: Directional(irradiance: 0.01), transform: LookAt(from: (-1, 1, 1), to: (0, 0, 0))),",
        "(light: Point(power_w: 20), transform: (translate: (1, 0.5, 0.5))),",
        "(light: Point(power_w: 60), transform: (translate: (-2, 2, 0.5))),",
        "(shape: Sphere(radius_m: 0.2), material: \"colours\", transform: (translate: (0.3, 2.2, 0))),",
        "(shape: Mesh(\"bowl.ply\"), material: \"colours\", transform: (translate: (2, 2.4, 0.3), scale: 0.4)),",
        "(shape: Mesh(\"tetrahedron.ply\"), material: \"front\", transform: (translate: (-1.5, 2, 0.3), scale: 0.3)),",
    ];
    let put_out = |light: &str| match light.contains("shape") {
        true => light.replace(colours, dark).replace(front, dark),
        false => String::new(),
    };
    let only = |lit: usize| {
        let one = |(i, light): (usize, &&str)| if i == lit { light.to_string() } else { put_out(light) };
        mean(&film(&scene(&lights.iter().enumerate().map(one).collect::<String>()), true))
    };
    let apart: f64 = (0..lights.len()).map(only).sum();
    let together = mean(&film(&scene(&lights.concat()), true));
    assert!((together / apart - 1.0).abs() < 0.01, "{together} {apart}");
}

/// A floor seen from above, lit by a spotlight 2 m above it.
fn below_a_spot(cone: [f32; 2], height_m: f32, at: f32) -> f64 {
    below_a_ball_with_a_cone(cone, "", height_m, at)
}

fn below_a_ball_with_a_cone([inner, outer]: [f32; 2], fields: &str, height_m: f32, at: f32) -> f64 {
    let world = world(&format!(
        "(
        settings: (size: (8, 8), samples: 16, max_depth: 1, transport: Path, filter: Box),
        entities: [
            (camera: Orthographic(height_m: {height_m}),
                transform: LookAt(from: ({at}, 1, 0), to: ({at}, 0, 0), up: (0, 0, -1))),
            (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))), material: (diffuse: 0.7)),
            (light: Spot(power_w: 100, inner_degrees: {inner}, outer_degrees: {outer}{fields}),
                transform: LookAt(from: (0, 2, 0), to: (0, 0, 0), up: (0, 0, -1))),
        ],
    )"
    ));
    let mut session = Session::new(compile(&world, None).unwrap(), &world.settings, Options::default());
    session.advance(u32::MAX);
    mean(session.film())
}

#[test]
fn spotlights_with_equal_angles_have_a_hard_edge_however_narrow() {
    // A power of 100 W is 100 / 4π W/sr; the floor 2 m below reflects 0.7 / π of what arrives.
    let expected = 0.7 / std::f64::consts::PI * (100.0 / (4.0 * std::f64::consts::PI)) / 4.0;
    for degrees in [0.05, 1.0, 30.0, 90.0] {
        let found = below_a_spot([degrees, degrees], 0.001, 0.0);
        assert!((found / expected - 1.0).abs() < 1e-3, "{degrees} degrees: {found} {expected}");
    }
    // The edge at 30° is 1.1547 m away: bright within 1 mm of it, dark beyond.
    let edge = 2.0 * 30f32.to_radians().tan();
    let inside = below_a_spot([30.0, 30.0], 0.001, edge - 0.001);
    let cos = 30f64.to_radians().cos();
    assert!((inside / (expected * cos.powi(3)) - 1.0).abs() < 0.01, "{inside}");
    assert_eq!(below_a_spot([30.0, 30.0], 0.001, edge + 0.001), 0.0);
}

/// The mean over a ball by midpoints, as seen from a place on the floor, 2 m below it.
#[test]
fn each_point_of_a_spotlight_with_a_radius_emits_within_its_cone() {
    let pi = std::f64::consts::PI;
    let [inner, outer] = [20f64, 40.0].map(|angle| angle.to_radians().cos());
    let (radius, steps) = (0.5, 400);
    let radiance = 100.0 / (4.0 * pi * pi * radius * radius);
    let irradiance = |at: f64, fade: fn(f64) -> f64| {
        let mut sum = 0.0;
        for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
            let y = (f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0;
            let (sin, cos) = ((f64::from(j) + 0.5) / f64::from(steps) * 2.0 * pi).sin_cos();
            let across = (1.0 - y * y).sqrt();
            let normal = [across * cos, y, across * sin];
            let way = [at - radius * normal[0], -2.0 - radius * normal[1], -radius * normal[2]];
            let distance = way.iter().map(|part| part * part).sum::<f64>().sqrt();
            let leaves = (0..3).map(|axis| way[axis] * normal[axis]).sum::<f64>() / distance;
            let cos = -way[1] / distance;
            let t = ((cos - outer) / (inner - outer)).clamp(0.0, 1.0);
            sum += leaves.max(0.0) * cos / (distance * distance) * fade(t);
        }
        radiance * sum * 4.0 * pi * radius * radius / f64::from(steps * steps)
    };
    for at in [0.0f32, 0.9, 1.3, 1.6] {
        for (edge, fade) in
            [("Squared", (|t| t * t) as fn(f64) -> f64), ("Smoothstep", |t| t * t * (3.0 - 2.0 * t))]
        {
            let fields = format!(", radius_m: {radius}, edge: {edge}");
            let found = below_a_ball_with_a_cone([20.0, 40.0], &fields, 0.001, at);
            let expected = 0.7 / pi * irradiance(f64::from(at), fade);
            assert!((found / expected - 1.0).abs() < 0.04, "{edge}, {at} m: {found}, not {expected}");
        }
    }
}

/// A ball that shines and that the camera does not see, above a floor with a post, and beside glass.
fn under_a_ball(lamp: &str, caustics: &str, glass: &str) -> World {
    crate::support::world(&format!(
        r#"(
            settings: (size: (32, 18), samples: 64, transport: Path, max_depth: 6, sharing: Off, caustics: {caustics}),
            materials: {{ "glow": (diffuse: 0, emission: LAMP), "glass": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: Some(())) }},
            entities: [
                (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 1.5, 6), to: (0, 0.2, 0))),
                {lamp},
                (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.6)),
                (shape: Box(size_m: (0.3, 1, 0.3)), transform: (translate: (-0.5, 0.5, 0))),
                {glass}
            ],
        )"#
    )
    .replace("LAMP", &format!("{}", 60.0 / (4.0 * std::f64::consts::PI.powi(2) * 0.25))))
}

#[test]
fn point_lights_with_a_radius_light_like_balls_that_emit() {
    let place = "transform: (translate: (-1, 3.5, 1))";
    let glass =
        r#"(shape: Sphere(radius_m: 0.4), material: "glass", transform: (translate: (0.7, 0.4, 0))),"#;
    let shape = format!("(shape: Sphere(radius_m: 0.5), material: \"glow\", {place})");
    let light = |radius: f32| format!("(light: Point(power_w: 60, radius_m: {radius}), {place})");
    let of = |lamp: &str, caustics: &str, glass: &str| whole_film(&under_a_ball(lamp, caustics, glass));
    for caustics in ["Off", "(photons: 4)"] {
        let [shape, light] = [&shape, &light(0.5)].map(|lamp| mean(&of(lamp, caustics, glass)));
        assert!((light / shape - 1.0).abs() < 0.01, "{caustics}: {light} {shape}");
    }
    // Without glass there is little noise.
    let [shape, light, point] = [&shape, &light(0.5), &light(0.0)].map(|lamp| of(lamp, "Off", ""));
    let far = |film: &Film| {
        let pairs = film.radiance().into_iter().zip(shape.radiance());
        pairs.map(|(a, b)| f64::from((a.g - b.g).powi(2))).sum::<f64>()
    };
    assert!(far(&light) * 4.0 < far(&point), "its shadows are soft: {} {}", far(&light), far(&point));
    // Seen from nearby, nothing is there.
    let dark = crate::support::world(
        r#"(settings: (size: (4, 4), samples: 4, transport: Path), entities: [
            (camera: Pinhole(vertical_fov_degrees: 20), transform: (translate: (0, 0, 3))),
            (light: Point(power_w: 60, radius_m: 0.5))])"#,
    );
    assert_eq!(mean(&whole_film(&dark)), 0.0);
}

fn whole_film(world: &World) -> Film {
    crate::support::film(world, Options::default())
}

/// Things that show lamps, before a camera that looks away from them; `lamp` stands where nothing is behind it.
fn before_a_mirror(thing: &str, lamp: &str, settings: &str) -> World {
    crate::support::world(&format!(
        r#"(
            settings: (size: (48, 36), samples: 16, transport: Path, max_depth: 8, {settings}),
            materials: {{
                "glow": (diffuse: 0, emission: LAMP),
                "chrome": Principled(base_color: (0.9, 0.8, 0.7), metallic: 1, roughness: 0),
                "brushed": Principled(base_color: (0.9, 0.8, 0.7), metallic: 1, roughness: 0.02),
                "satin": Principled(base_color: (0.9, 0.8, 0.7), metallic: 1, roughness: 0.3),
                "lacquer": Principled(base_color: (0.7, 0.1, 0.1), metallic: 0, roughness: 0),
                "matte": Principled(base_color: (0.5, 0.5, 0.5), metallic: 0, roughness: 1),
                "glass": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5,
                    volume: (attenuation_color: (0.5, 0.9, 0.6), attenuation_distance_m: 0.5)),
                "wax": Principled(base_color: (1, 1, 1), metallic: 0, roughness: 0, transmission: 1, ior: 1.4, volume:
                    (attenuation_color: (0.9, 0.8, 0.6), attenuation_distance_m: 0.2, multiscatter_color: (0.9, 0.8, 0.6))),
                "fog": Principled(base_color: (1, 1, 1), metallic: 0, roughness: 0, transmission: 1, ior: 1, volume:
                    (attenuation_color: (0.8, 0.8, 0.9), attenuation_distance_m: 3, multiscatter_color: (0.7, 0.7, 0.8))),
            }},
            entities: [
                (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
                {lamp},
                {thing},
            ],
        )"#
    )
    .replace("LAMP", &format!("{}", 60.0 / (4.0 * std::f64::consts::PI.powi(2) * 0.25))))
}

/// Pairs of the same lamp, with a surface and without one.
fn with_and_without_a_surface() -> [(&'static str, String, String); 5] {
    let placed = "transform: LookAt(from: (-3, 2.5, 4), to: (0, 0, 0))";
    let area = |fields: &str| format!("(light: Area(power_w: 60, {fields}), {placed})");
    // A disc of 4° as seen from the origin, a kilometre away.
    let (far, across) = (1000.0, 2000.0 * f64::tan(2.0_f64.to_radians()));
    let [x, y, z] = [-0.6, 0.5, 0.62].map(|part: f64| part * far / 0.9966_f64);
    let toward = format!("transform: LookAt(from: ({x}, {y}, {z}), to: (0, 0, 0))");
    // The irradiance of a disc of that radiance.
    let irradiance = 400.0 * std::f64::consts::PI * f64::sin(2.0_f64.to_radians()).powi(2);
    [
        ("panel", area("size_m: (2, 1), visible: true"), area("size_m: (2, 1)")),
        // Directions from matte surfaces find a good part of its light, too.
        ("wall", area("size_m: (7, 7), visible: true"), area("size_m: (7, 7)")),
        (
            "disc",
            area("size_m: (1.5, 1.5), outline: Disc, visible: true"),
            area("size_m: (1.5, 1.5), outline: Disc"),
        ),
        (
            "ball",
            format!("(shape: Sphere(radius_m: 0.5), material: \"glow\", {placed})"),
            format!("(light: Point(power_w: 60, radius_m: 0.5), {placed})"),
        ),
        (
            "sun",
            format!(
                "(light: Area(radiance: 400, size_m: ({across}, {across}), outline: Disc, visible: true), {toward})"
            ),
            format!("(light: Directional(irradiance: {irradiance}, angle_degrees: 4), {toward})"),
        ),
    ]
}

/// The part of pixels whose samples find something else: a polygon stands for a disc, and edges are rounded.
fn unlike(a: &Film, b: &Film) -> f64 {
    let pairs = a.radiance().into_iter().zip(b.radiance());
    let channel = |a: f32, b: f32| (a - b).abs() > 0.02 * a.abs() + 1e-3;
    let differs = |(a, b): (Rgb, Rgb)| channel(a.r, b.r) || channel(a.g, b.g) || channel(a.b, b.b);
    let all = a.radiance().len() as f64;
    pairs.filter(|pair| differs(*pair)).count() as f64 / all
}

#[test]
fn lamps_without_a_surface_are_found_like_those_with_one() {
    let ball = |material: &str| format!("(shape: Sphere(radius_m: 1), material: \"{material}\")");
    for (name, with, without) in with_and_without_a_surface() {
        for material in ["chrome", "brushed", "satin", "lacquer", "matte", "glass"] {
            for settings in ["sharing: Off, caustics: Off", "sharing: 16, caustics: Off"] {
                let [with, without] = [&with, &without]
                    .map(|lamp| whole_film(&before_a_mirror(&ball(material), lamp, settings)));
                let (unlike, means) = (unlike(&with, &without), [mean(&with), mean(&without)]);
                println!("{name} {material} {settings}: {unlike} {means:?}");
                assert!(unlike < 0.02, "{name}, {material}, {settings}: {unlike} of the pixels");
                assert!((means[1] / means[0] - 1.0).abs() < 0.01, "{name}, {material}: {means:?}");
            }
        }
    }
}

#[test]
fn lamps_without_a_surface_shine_into_bodies_that_scatter_light() {
    let in_fog =
        r#"(shape: Sphere(radius_m: 9), material: "fog"), (shape: Sphere(radius_m: 1), material: "satin")"#;
    for thing in [r#"(shape: Sphere(radius_m: 1), material: "wax")"#, in_fog] {
        // Not of the sun: paths that have been blurred and then pass glass do not find it.
        for (name, with, without) in &with_and_without_a_surface()[..4] {
            let settings = "sharing: Off, caustics: Off";
            let [with, without] =
                [with, without].map(|lamp| mean(&whole_film(&before_a_mirror(thing, lamp, settings))));
            println!("{name} {thing}: {with} {without}");
            assert!((without / with - 1.0).abs() < 0.05, "{name}, {thing}: {with} {without}");
        }
    }
}

/// Behind a matte bounce, photons alone bring what mirrors and glass throw from lamps without a surface: the sum is that of
/// lamps with one, of which paths find a part.
#[test]
fn photons_bring_the_caustics_of_lamps_without_a_surface() {
    let things = |material: &str| {
        format!(
            r#"(shape: Sphere(radius_m: 0.6), material: "{material}"),
            (shape: Plane(corners: ((-4, -0.6, 2), (4, -0.6, 2), (4, -0.6, -4), (-4, -0.6, -4))), material: "matte")"#
        )
    };
    for (name, with, without) in with_and_without_a_surface() {
        for material in ["chrome", "satin", "glass"] {
            let settings = "caustics: (photons: 4)";
            let [with, without] = [&with, &without]
                .map(|lamp| mean(&whole_film(&before_a_mirror(&things(material), lamp, settings))));
            println!("{name} {material}: {with} {without}");
            assert!((without / with - 1.0).abs() < 0.03, "{name}, {material}: {with} {without}");
        }
    }
}
