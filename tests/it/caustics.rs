//! Caustics by photons: analytic results, and comparisons with path tracing.

use rayfront::internals::integrator::Schedule;
use rayfront::render::Options;
use rayfront::world::{Caustics, Sharing, Transport, World};

use crate::support::{Picture, film, mean, world};

/// A scene with a box filter, many bounces and this many samples.
fn scene(samples: u32, entities: &str) -> World {
    world(&format!(
        "(settings: (size: (32, 24), samples: {samples}, max_depth: 16, transport: Path, filter: Box),
          entities: [{entities}])"
    ))
}

/// A dark floor, so that interreflection is negligible.
const FLOOR: &str = r#"(shape: Plane(corners: ((-50, 0, 50), (50, 0, 50), (50, 0, -50), (-50, 0, -50))),
                        material: (diffuse: 0.001)),"#;
/// A camera that faces the floor, and one that sees it in a mirror.
const CAMERA: &str =
    "(camera: Pinhole(vertical_fov_degrees: 12), transform: LookAt(from: (2, 1, 0), to: (0, 0, 0))),";
const IN_MIRROR: &str = r#"
    (camera: Pinhole(vertical_fov_degrees: 5), transform: LookAt(from: (2, 1, 0), to: (-1, 0.2, 0))),
    (shape: Plane(corners: ((-1, -1, 3), (-1, -1, -3), (-1, 1.5, -3), (-1, 1.5, 3))), material: (kr: 1, diffuse: 0)),"#;
/// A pane, and lights of all kinds above.
const PANE: &str = r#"(shape: Mesh("cube.ply"), material: (ior: 1.5), transform: (translate: (0, 2, 0), scale: (9, 0.2, 9))),"#;
const LAMPS: [&str; 8] = [
    "(light: Directional(irradiance: 5), transform: LookAt(from: (0.01, 10, 0), to: (0, 0, 0))),",
    "(light: Directional(irradiance: 5, angle_degrees: 8), transform: LookAt(from: (0.01, 10, 0), to: (0, 0, 0))),",
    "(light: Point(power_w: 10000), transform: (translate: (0, 10, 0))),",
    "(light: Point(power_w: 100, falloff: Constant), transform: (translate: (0, 10, 0))),",
    "(light: Spot(power_w: 10000, inner_degrees: 20, outer_degrees: 40), transform: LookAt(from: (0.01, 10, 0), to: (0, 0, 0))),",
    "(light: Spot(power_w: 10000, inner_degrees: 20, outer_degrees: 40, radius_m: 0.2), transform: LookAt(from: (0.01, 10, 0), to: (0, 0, 0))),",
    "(light: Area(power_w: 1000, size_m: 0.5, visible: true), transform: LookAt(from: (0.01, 10, 0), to: (0, 0, 0))),",
    "(shape: Sphere(radius_m: 0.2), material: (diffuse: 0, emission: 1000), transform: (translate: (0, 10, 0))),",
];

/// At normal incidence a pane transmits (1 − R) / (1 + R), including all its internal reflections. Paths could find
/// none of that light, except for emitters that they can hit.
#[test]
fn photons_through_panes_match_fresnel_for_all_lights() {
    let passes = (1.0 - 0.04) / (1.0 + 0.04);
    for lamp in LAMPS {
        for camera in [CAMERA, IN_MIRROR] {
            let bare = mean(&Picture::of(&scene(256, &format!("{camera}{FLOOR}{lamp}"))));
            let mut covered = scene(128, &format!("{camera}{FLOOR}{PANE}{lamp}"));
            covered.settings.caustics = Caustics::Photons { photons: 24.0, radius: 1.4 };
            // A pane shifts the light of a point and brings it nearer by a third of the pane's thickness.
            let nearer = if lamp.contains("Directional") || lamp.contains("Constant") { 1.0 } else { 1.014 };
            let found = mean(&Picture::of(&covered)) / bare;
            assert!((found / (passes * nearer) - 1.0).abs() < 0.012, "{lamp} {camera}: {found}");
            // Whitted's transport has the same photons.
            if lamp.contains("Directional(irradiance: 5)") {
                covered.settings.transport = Transport::Whitted;
                let mut bare = scene(4, &format!("{camera}{FLOOR}{lamp}"));
                bare.settings.transport = Transport::Whitted;
                let found = mean(&Picture::of(&covered)) / mean(&Picture::of(&bare));
                assert!((found / passes - 1.0).abs() < 0.012, "{camera}: {found} under Whitted's transport");
            }
        }
    }
}

/// A ball of some material under an emitter that is large enough to be hit by chance.
fn ball(samples: u32, material: &str) -> World {
    scene(samples, &ball_of(material))
}

fn ball_of(material: &str) -> String {
    format!(
        r#"(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 3, 4), to: (0, 0.3, 0))),
            (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.6)),
            (shape: Plane(corners: ((-9, 0, -2), (9, 0, -2), (9, 9, -2), (-9, 9, -2))),
             material: Principled(base_color: (0.8, 0.5, 0.3), metallic: 0, roughness: 0.5)),
            (shape: Sphere(radius_m: 0.7), material: {material}, transform: (translate: (0.2, 0.9, 0.2))),
            (shape: Sphere(radius_m: 0.5), material: (diffuse: 0, emission: 20), transform: (translate: (-1.5, 3.5, 0.5))),"#
    )
}

/// Compares means of blocks of 4 × 4 pixels.
fn assert_alike(found: &Picture, expected: &Picture, most: f64, what: &str) {
    let whole = mean(expected);
    assert!((mean(found) / whole - 1.0).abs() < 0.012, "{what}: {} and {whole} on average", mean(found));
    let block = |picture: &Picture, bx: usize, by: usize| {
        let pixels = (0..16).map(|i| picture.at(4 * bx + i % 4, 4 * by + i / 4));
        pixels.map(|p| f64::from(p.r + p.g + p.b) / 3.0).sum::<f64>() / 16.0
    };
    for (bx, by) in (0..6).flat_map(|y| (0..8).map(move |x| (x, y))) {
        let (a, b) = (block(found, bx, by), block(expected, bx, by));
        assert!((a - b).abs() < most * (b + 0.3 * whole), "{what}, block {bx} {by}: {a}, not {b}");
    }
}

#[test]
fn photons_match_paths_that_hit_emitters_by_chance() {
    for material in [
        "(ior: 1.5)",
        "(kr: (0.9, 0.7, 0.5), diffuse: 0)",
        "Principled(metallic: 1, roughness: 0.3, base_color: (0.9, 0.8, 0.6))",
        "Principled(metallic: 1, roughness: 0.45, base_color: 0.9)",
        "Principled(metallic: 1, roughness: 0.2, base_color: 0.9, anisotropy: (strength: 0.4))",
        "Principled(metallic: 1, roughness: 0.25, base_color: 0.9, anisotropy: (strength: 0.9))",
        "Principled(metallic: 1, roughness: 0.4, base_color: 0.9, clearcoat: 1, clearcoat_roughness: 0.3)",
        "Principled(metallic: 0, roughness: 0.2, transmission: 1, ior: 1.4, volume: (attenuation_color: (0.9, 0.4, 0.2), attenuation_distance_m: 1))",
        "Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, dispersion: 1, volume: ())",
    ] {
        let mut by_chance = ball(8192, material);
        by_chance.settings.caustics = Caustics::Off;
        let by_chance = Picture::of(&by_chance);
        let mut with_photons = ball(512, material);
        assert_alike(&Picture::of(&with_photons), &by_chance, 0.06, material);
        with_photons.settings.sharing = Sharing::Off;
        assert_alike(&Picture::of(&with_photons), &by_chance, 0.06, &format!("{material}, nothing shared"));
    }
}

/// Camera rays pass single-sided surfaces from behind, so light passes them from the front, and not from behind.
#[test]
fn photons_respect_single_sided_surfaces() {
    let shell = |roughness: f32| {
        format!(
            "(shape: Sphere(radius_m: 0.85), material: Principled(metallic: 0, roughness: {roughness}, transmission: 1),
              transform: (translate: (0.2, 0.95, 0.2))),"
        )
    };
    // Planes are always two-sided.
    let wall = |material: &str, vertices: &str, transform: &str| {
        format!("(shape: Triangle(vertices: ({vertices})), material: {material}, transform: ({transform})),")
    };
    let up = "(-1.9, 2.2, 1.2), (0.3, 2.2, 1), (-0.9, 2.2, -0.9)";
    let down = "(0.3, 2.2, 1), (-1.9, 2.2, 1.2), (-0.9, 2.2, -0.9)";
    let up_in_a_mirror = "(-0.3, 2.2, 1), (1.9, 2.2, 1.2), (0.9, 2.2, -0.9)";
    let (matte, metal) = ("Principled(metallic: 0, specular: 0)", "Principled(roughness: 0.2)");
    for between in [
        shell(0.5),
        shell(0.3),
        shell(0.0),
        wall(matte, up, ""),
        wall(matte, down, ""),
        wall(metal, up, ""),
        wall(metal, down, ""),
        wall(matte, up_in_a_mirror, "scale: (-1, 1, 1)"),
    ] {
        let with = |samples, caustics| {
            let mut world = scene(samples, &format!("{between}{}", ball_of("(ior: 1.5)")));
            world.settings.caustics = caustics;
            Picture::of(&world)
        };
        let (by_chance, with_photons) = (with(8192, Caustics::Off), with(512, Caustics::Auto));
        assert_alike(&with_photons, &by_chance, 0.06, &between);
    }
}

/// No light is counted twice or lost: photons and paths divide what either can find, and paths find the rest.
#[test]
fn photons_and_paths_together_count_all_light_once() {
    let rough = "Principled(metallic: 1, roughness: 0.3, base_color: (0.9, 0.8, 0.6))";
    let ball = |material: &str| {
        format!(
            "(shape: Sphere(radius_m: 0.7), material: {material}, transform: (translate: (0.2, 0.9, 0.2))),"
        )
    };
    let floor = |material: &str| {
        format!(
            "(shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: {material}),"
        )
    };
    let eye =
        "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 3, 4), to: (0, 0.3, 0))),";
    let point = "(light: Point(power_w: 500), transform: (translate: (-1.5, 3.5, 0.5))),";
    let lamp = "(shape: Sphere(radius_m: 0.5), material: (diffuse: 0, emission: 20), transform: (translate: (-1.5, 3.5, 0.5))),";
    let matte = floor("(diffuse: 0.6)");
    for (what, entities) in [
        (
            "an environment with a sun in it",
            format!("{eye}{matte}{}(light: Environment(image: \"sun.hdr\")),", ball(rough)),
        ),
        ("a highlight in a mirror", format!("{eye}{}{}{point}", floor("(kr: 0.5, diffuse: 0.3)"), ball(rough))),
        (
            "a lamp, and one without caustics",
            format!("{eye}{matte}{}{lamp}{}", ball("(ior: 1.5)"), lamp.replace("emission: 20", "emission: (5, 20, 9), caustics: false").replace("-1.5, 3.5", "1.5, 3")),
        ),
        (
            "a ball, and one without caustics",
            format!("{eye}{matte}{}{lamp}{}", ball("(ior: 1.5)"), ball("(ior: 1.5, caustics: false)").replace("0.2, 0.9, 0.2", "-1, 2, 0.4")),
        ),
        (
            "a highlight in fog",
            format!(
                "{eye}{matte}{}{point}(shape: Mesh(\"cube.ply\"), transform: (scale: 8),
                 material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1,
                    volume: (attenuation_color: 0.9, attenuation_distance_m: 2, multiscatter_color: 0.5))),",
                ball(rough)
            ),
        ),
        (
            "a dome around all",
            format!("{eye}{matte}{}{lamp}(shape: Sphere(radius_m: 9), material: (diffuse: 0, emission: 0.5)),", ball("(ior: 1.5)")),
        ),
        (
            "the back of paper in a mirror",
            format!(
                "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, -1, 2), to: (0, -3, 0.5))),
                 (shape: Plane(corners: ((-9, -3, 9), (9, -3, 9), (9, -3, -9), (-9, -3, -9))), material: (kr: 1, diffuse: 0)),
                 {}{}{lamp}",
                floor("Principled(metallic: 0, roughness: 1, specular: 0, base_color: 0.8, diffuse_transmission: 0.7)"),
                ball("(ior: 1.5)")
            ),
        ),
    ] {
        let mut by_chance = scene(4096, &entities);
        by_chance.settings.caustics = Caustics::Off;
        let mut with_photons = scene(512, &entities);
        // Pixels are large here: the default radius would blur the edges of shadows.
        with_photons.settings.caustics = Caustics::Photons { photons: 4.0, radius: 0.6 };
        assert_alike(&Picture::of(&with_photons), &Picture::of(&by_chance), 0.12, what);
    }
}

/// Lights without falloff illuminate a ball behind a thin pane as without the pane.
#[test]
fn photons_through_panes_keep_the_falloff_of_lights() {
    let ball = single_ball(1.0, "(ior: 1.000001)");
    for lamp in [
        "(light: Point(power_w: 1000, falloff: Constant), transform: (translate: (0, 6, 0))),",
        "(light: Point(power_w: 1000), transform: (translate: (0, 6, 0))),",
    ] {
        let pane = "(shape: Plane(corners: ((-9, 5, 9), (9, 5, 9), (9, 5, -9), (-9, 5, -9))),
                     material: Principled(metallic: 0, roughness: 0, transmission: 1, specular: 0)),";
        let bare = landed(&format!("{ROOM}{ball}{lamp}"), 8).0;
        let behind = landed(&format!("{ROOM}{ball}{pane}{lamp}"), 8).0;
        assert!((behind / bare - 1.0).abs() < 0.01, "{lamp}: {behind}, and {bare} without the pane");
    }
}

/// The number of photons adapts to the scene. Photons are only omitted where they would be single dots on an image with
/// enough other light.
#[test]
fn photon_counts_adapt_to_the_scene() {
    let photons = |entities: &str| {
        use rayfront::render::Session;
        let world = scene(1, entities);
        let compiled = rayfront::compile::compile(&world, None).expect("a scene");
        let mut session = Session::new(compiled, &world.settings, Options::default());
        session.advance(1);
        session.statistics().rays.photon
    };
    let pool = "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 4, 3), to: (0, 0, 0))),
        (shape: Plane(corners: ((-9, -1, 9), (9, -1, 9), (9, -1, -9), (-9, -1, -9))), material: (diffuse: 0.6)),
        (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (ior: 1.333)),
        (light: Directional(irradiance: 3), transform: LookAt(from: (1, 2, 0), to: (0, 0, 0))),";
    // All light in a pool comes by photons: there are four for each pixel.
    assert!(photons(pool) > 4 * 32 * 24, "{} rays of photons in a pool", photons(pool));
    let ball =
        "(camera: Pinhole(vertical_fov_degrees: 60), transform: LookAt(from: (0, 3, 4), to: (0, 0.3, 0))),
        (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.6)),
        (shape: Sphere(radius_m: 0.2), material: (ior: 1.5), transform: (translate: (0, 0.3, 0))),
        (light: Point(power_w: 500), transform: (translate: (-1.5, 3.5, 0.5))),";
    let few = photons(ball);
    assert!((1..2 * 32 * 24).contains(&few), "{few} rays of photons for a small ball");
    let lake = "(camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 2, 14), to: (0, 1.5, 0))),
        (shape: Plane(corners: ((-2000, 0, -3), (2000, 0, -3), (2000, 0, -4000), (-2000, 0, -4000))), material: (ior: 1.333)),
        (shape: Plane(corners: ((-200, 0, 50), (200, 0, 50), (200, 0, -3), (-200, 0, -3))), material: (diffuse: 0.4)),
        (shape: Plane(corners: ((-3, 0, -1), (3, 0, -1), (3, 4, -1), (-3, 4, -1))), material: (diffuse: 0.6)),
        (light: Sky(elevation_degrees: 40, azimuth_degrees: 200)),";
    assert_eq!(photons(lake), 0, "few of the photons that fall on a lake shine on a house beside it");
    let (sun, water) = ("(light: Directional(irradiance: 3),", "(ior: 1.333)");
    assert!(pool.contains(sun) && pool.contains(water));
    assert_eq!(
        photons(&pool.replace(sun, &format!("(caustics: false, {}", &sun[1..]))),
        0,
        "a lamp without caustics"
    );
    assert_eq!(photons(&pool.replace(water, "(ior: 1.333, caustics: false)")), 0, "water without caustics");
}

/// The number of photons and their radius affect only noise and blur.
#[test]
fn photon_count_and_radius_do_not_change_the_mean() {
    let usual = Picture::of(&ball(256, "(ior: 1.5)"));
    for (photons, radius) in [(0.1, 1.4), (4.0, 1.4), (1.0, 0.5), (1.0, 4.0)] {
        let mut other = ball(256, "(ior: 1.5)");
        other.settings.caustics = Caustics::Photons { photons, radius };
        assert_alike(&Picture::of(&other), &usual, 0.08, &format!("{photons} photons, radius {radius}"));
    }
}

#[test]
fn moving_a_light_moves_its_caustic() {
    // The camera views the floor below the ball from the side.
    let at = |x: f64| {
        let text = format!(
            r#"(camera: Orthographic(height_m: 1.2), transform: LookAt(from: (0, 2, 5), to: (0, 0, 0))),
            (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.5)),
            (shape: Sphere(radius_m: 0.3), material: (ior: 1.5), transform: (translate: (0, 0.5, 0))),
            (light: Point(power_w: 100), transform: (translate: ({x}, 3, 0))),"#
        );
        let picture = Picture::of(&scene(64, &text));
        let height = picture.pixels.len() / picture.width;
        let (mut sum, mut weighted) = (0.0, 0.0);
        for (i, pixel) in picture.pixels.iter().enumerate() {
            // Below the ball in the image, pixels brighter than direct light can make them.
            let light = f64::from(pixel.g) - 0.3;
            if light > 0.0 && i / picture.width >= height * 2 / 5 {
                sum += light;
                weighted += light * (i % picture.width) as f64;
            }
        }
        weighted / sum
    };
    // A pixel is 5 cm wide. Light through the ball's centre moves the spot in the opposite direction by a fifth of the
    // light's movement: it is 0.5 m below the centre, and the light 2.5 m above.
    let (middle, aside) = (at(0.0), at(0.25));
    let moved = (aside - middle).abs();
    assert!((0.8..1.2).contains(&moved), "the spot is at column {aside}, and was at {middle}");
}

/// Every kind of light, lens and filter, absorbing, rough and dispersive glass, mirrors, instances, fog.
const EVERYTHING: &str = r#"(
    settings: (size: (24, 18), samples: 4, max_depth: 12, transport: Path, copied_triangles: 0,
               filter: Gaussian(radius: 1.6), background: (0.1, 0.2, 0.3)),
    materials: {
        "glass": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, dispersion: 2,
                            volume: (attenuation_color: (0.9, 0.5, 0.3), attenuation_distance_m: 1)),
        "rough": Principled(metallic: 0, roughness: 0.35, transmission: 1, volume: ()),
        "gold": Principled(metallic: 1, roughness: 0.1, base_color: (1, 0.8, 0.3)),
        "pane": Principled(metallic: 0, roughness: 0, transmission: 1),
        "fog": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1,
                          volume: (attenuation_color: 0.7, attenuation_distance_m: 2, multiscatter_color: 0.8)),
        "paper": (diffuse: Image("noise.png"), specular: 0.1),
    },
    entities: [
        (camera: ThinLens(vertical_fov_degrees: 50, lens_radius_m: 0.05, focus_distance_m: 4),
         transform: LookAt(from: (0.3, 2, 5), to: (0, 0.5, 0))),
        (shape: Sphere(radius_m: 0.7), material: "glass", transform: (translate: (-0.8, 0.9, 0.5))),
        (shape: Mesh("ball.ply"), material: "rough", transform: (translate: (0.9, 0.6, 0.8), scale: 0.5)),
        (shape: Mesh("ball.ply"), material: "glass", transform: (translate: (2, 0.6, 0), scale: (0.4, 0.5, -0.3))),
        (shape: Mesh("bowl.ply"), material: "gold", transform: (translate: (0, 0.1, -1), scale: 0.8)),
        (shape: Mesh("cube.ply"), material: "fog", transform: (translate: (0.5, 1, -0.5), scale: (3, 2, 2))),
        (shape: Plane(corners: ((-1, 0.2, 2), (0, 0.2, 2), (0, 1.5, 1.6), (-1, 1.5, 1.6))), material: "pane"),
        (shape: Plane(corners: ((-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6))), material: "paper"),
        (shape: Plane(corners: ((-6, 0, -3), (6, 0, -3), (6, 6, -3), (-6, 6, -3))), material: "paper"),
        (light: Point(power_w: (150, 140, 130)), transform: (translate: (1, 4, 3))),
        (light: Point(power_w: 0.8, falloff: Constant), transform: (translate: (-4, 3, 0))),
        (light: Spot(power_w: (300, 100, 50), inner_degrees: 10, outer_degrees: 35, edge: Smoothstep, radius_m: 0.2),
         transform: LookAt(from: (-2, 4, 3), to: (0, 0, 0))),
        (light: Directional(irradiance: (0.2, 0.25, 0.3), angle_degrees: 3), transform: LookAt(from: (1, 2, 0.5), to: (0, 0, 0))),
        (light: Area(power_w: 30, size_m: 0.5), transform: LookAt(from: (2, 3, -1), to: (0, 0, 0))),
        (light: Area(power_w: 30, size_m: 0.3, outline: Disc, visible: true), transform: LookAt(from: (-2, 3, -1), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 0.1), material: (diffuse: 0, emission: (20, 10, 5)), transform: (translate: (0, 3, 1))),
        (shape: Mesh("tetrahedron.ply"), material: (diffuse: 0, emission: 30), transform: (translate: (1.5, 2.5, 1), scale: 0.05)),
    ],
)"#;

#[test]
fn photons_are_identical_in_all_ways_to_render() {
    let photons = Caustics::Photons { photons: 1.5, radius: 2.0 };
    for (transport, sharing, caustics) in [
        (Transport::Path, Sharing::Auto, photons),
        (Transport::Path, Sharing::Off, Caustics::Auto),
        (Transport::Whitted, Sharing::Off, photons),
    ] {
        let made = |caustics: Caustics| {
            let mut world = world(EVERYTHING);
            (world.settings.transport, world.settings.sharing) = (transport, sharing);
            world.settings.caustics = caustics;
            world
        };
        crate::agreement::check_world(&|| made(caustics));
        let [with, without] =
            [caustics, Caustics::Off].map(|caustics| film(&made(caustics), Options::default()));
        assert!(with != without, "photons are of some use");
    }
}

/// Returns the power of landed photons in watts, averaged over `samples` samples, and the number of photons in each.
fn landed(entities: &str, samples: u32) -> (f64, u32) {
    use rayfront::internals::integrator::{RayStatistics, Stop, Worker};
    use rayfront::internals::render::{Prepared, setup};
    let world = world(&format!(
        "(settings: (size: (64, 64), transport: Path, max_depth: 200, caustics: (photons: 1)),
          entities: [(camera: Pinhole, transform: LookAt(from: (0, 2, 6), to: (0, 0, 0))), {entities}])"
    ));
    let setup = setup(rayfront::compile::compile(&world, None).expect("a scene"), &world.settings);
    let plan = Prepared::now(&setup).plan.expect("photons");
    let (options, mut sum) = (Options::default(), 0.0);
    for schedule in [Schedule::Wavefront, Schedule::Recursive] {
        let mut worker = Worker::new(&setup, schedule, options.wave, options.sorting);
        for sample in 0..samples {
            let (statistics, all) = (&mut RayStatistics::default(), 0..plan.count());
            let landed = worker.trace_photons(&plan, options.isa, sample, all, statistics, &Stop::NEVER);
            sum += landed.photons.iter().map(|(_, photon)| f64::from(photon.flux[1])).sum::<f64>();
        }
    }
    (sum / f64::from(2 * samples), plan.count())
}

/// A room around a ball, in which photons from the ball land.
const ROOM: &str = "(shape: Sphere(radius_m: 20), material: (diffuse: 0.5)),";

fn single_ball(radius: f64, material: &str) -> String {
    format!("(shape: Sphere(radius_m: {radius}), material: {material}),")
}

/// All light of a point light that hits a ball lands somewhere, except for what the ball absorbs.
#[test]
fn point_light_through_a_ball_lands_completely() {
    let lamp = "(light: Point(power_w: 1000), transform: (translate: (0, 3, 0))),";
    // 4 π steradians have 1000 W; the ball subtends 2 π (1 − √(1 − 1/9)).
    let falls = 1000.0 * 0.5 * (1.0 - (1.0f64 - 1.0 / 9.0).sqrt());
    for (material, part) in [
        ("(ior: 1.5)", 1.0),
        ("(ior: 2.4)", 1.0),
        ("(kr: 0.75, diffuse: 0)", 0.75),
        ("Principled(metallic: 0, transmission: 1, roughness: 0, ior: 1.3, volume: ())", 1.0),
    ] {
        let entities = format!("{ROOM}{}{lamp}", single_ball(1.0, material));
        let (light, count) = landed(&entities, 16);
        assert_eq!(count, 64 * 64);
        assert!((light / (falls * part) - 1.0).abs() < 2e-3, "{material}: {light} of {falls} W");
    }
}

/// Lights with an area, and distant ones, emit the analytic power towards a ball.
#[test]
fn lights_of_all_kinds_send_the_analytic_power_to_a_ball() {
    // A small surface far away: its intensity along the normal is its power over π.
    let solid_angle =
        |distance: f64| 2.0 * std::f64::consts::PI * (1.0 - (1.0 - 1.0 / (distance * distance)).sqrt());
    for (lamp, falls) in [
        (
            "(light: Area(power_w: 1000, size_m: 0.01), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
            1000.0 / std::f64::consts::PI * solid_angle(10.0),
        ),
        (
            "(shape: Sphere(radius_m: 0.05), material: (diffuse: 0, emission: 1000), transform: (translate: (0, 10, 0))),",
            1000.0 * std::f64::consts::PI * 0.05 * 0.05 * solid_angle(10.0),
        ),
        (
            "(light: Directional(irradiance: 10, angle_degrees: 2), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
            10.0 * std::f64::consts::PI,
        ),
        (
            "(light: Spot(power_w: 1000, inner_degrees: 30, outer_degrees: 40), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
            1000.0 / (4.0 * std::f64::consts::PI) * solid_angle(10.0),
        ),
        (
            "(light: Spot(power_w: 1000, inner_degrees: 30, outer_degrees: 40, radius_m: 0.05), transform: LookAt(from: (0, 10, 0.01), to: (0, 0, 0))),",
            1000.0 / (4.0 * std::f64::consts::PI) * solid_angle(10.0),
        ),
    ] {
        // A directional light starts outside the room.
        let room = if lamp.contains("Directional") {
            "(shape: Plane(corners: ((-99, -3, 99), (99, -3, 99), (99, -3, -99), (-99, -3, -99))), material: (diffuse: 0.5)),"
        } else {
            ROOM
        };
        let (light, _) = landed(&format!("{room}{}{lamp}", single_ball(1.0, "(ior: 1.000001)")), 16);
        assert!((light / falls - 1.0).abs() < 4e-3, "{lamp}: {light} of {falls} W");
    }
}

/// Light that is aimed at several balls counts once.
#[test]
fn light_aimed_at_several_balls_counts_once() {
    let lamp = "(light: Point(power_w: 1000), transform: (translate: (0, 5, 0))),";
    let at = |x: f64| {
        format!(
            "(shape: Sphere(radius_m: 1), material: (ior: 1.000001), transform: (translate: ({x}, 0, 0))),"
        )
    };
    let alone = landed(&format!("{ROOM}{}{lamp}", at(0.0)), 8).0;
    let apart = landed(&format!("{ROOM}{}{}{}{lamp}", at(-4.0), at(0.0), at(4.0)), 16);
    let side = landed(&format!("{ROOM}{}{lamp}", at(4.0)), 8).0;
    assert!((apart.0 / (alone + 2.0 * side) - 1.0).abs() < 6e-3, "{} {alone} {side}", apart.0);
}
