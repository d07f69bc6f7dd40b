//! Energy conservation: white materials of all kinds in white surroundings, lights of all sizes, within bodies and next
//! to blockers.

use std::f64::consts::PI;

use rayfront::internals::integrator::Schedule;
use rayfront::math::Rgb;
use rayfront::render::Options;
use rayfront::world::{
    Anisotropy, Background, Camera, ColorInput, Iridescence, Material, PixelFilter, Principled, ScalarInput,
    Shape, Sharing, Texels, Transform, Transport, Volume, World,
};

use crate::support::{Picture, at, film, mean, picture, world};

/// Random numbers between 0 and 1 (SplitMix, Steele and others 2014).
struct Chance(u64);

impl Chance {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / (1 << 24) as f32
    }

    fn happens(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// Nothing, all, or a random fraction.
    fn part(&mut self) -> f32 {
        [0.0, 1.0, self.unit(), self.unit()][(self.unit() * 4.0) as usize]
    }
}

/// A surface that reflects or transmits all light, with random fields that include their extreme values.
fn white(chance: &mut Chance) -> Principled {
    let white = ColorInput::Constant(Rgb::WHITE);
    let sometimes = |chance: &mut Chance| if chance.happens(0.3) { chance.part() } else { 0.0 };
    Principled {
        base_color: white,
        metallic: ScalarInput::constant(sometimes(chance)),
        roughness: ScalarInput::constant(chance.part()),
        ior: [1.0 + 0.5 * chance.unit(), 1.0 + 4.0 * chance.unit()][usize::from(chance.happens(0.4))],
        specular: ScalarInput::constant(1.0),
        specular_color: white,
        transmission: ScalarInput::constant(if chance.happens(0.6) { chance.part() } else { 0.0 }),
        volume: chance.happens(0.6).then_some(Volume::default()),
        diffuse_transmission: ScalarInput::constant(if chance.happens(0.4) { chance.part() } else { 0.0 }),
        clearcoat: ScalarInput::constant(if chance.happens(0.15) { chance.part() } else { 0.0 }),
        clearcoat_roughness: ScalarInput::constant(chance.part()),
        sheen_color: ColorInput::Constant(Rgb::splat(if chance.happens(0.1) { chance.part() } else { 0.0 })),
        sheen_roughness: ScalarInput::constant(chance.part()),
        anisotropy: Anisotropy {
            strength: sometimes(chance),
            rotation: chance.unit() * 6.0,
            ..Anisotropy::default()
        },
        iridescence: Iridescence {
            factor: ScalarInput::constant(if chance.happens(0.15) { chance.part() } else { 0.0 }),
            ior: 1.0 + 1.5 * chance.unit(),
            thickness_maximum: 1000.0 * chance.unit(),
            ..Iridescence::default()
        },
        double_sided: chance.happens(0.5),
        ..Principled::default()
    }
}

/// The mean radiance of a ball in white surroundings, and its standard error.
fn before_white(material: &Principled) -> (f64, f64) {
    let mut world = World::default();
    let settings = &mut world.settings;
    (settings.size, settings.samples, settings.max_depth) = ([8, 8], 64, 1000);
    (settings.transport, settings.filter, settings.sharing) =
        (Transport::Path, PixelFilter::Box, Sharing::Off);
    settings.roulette_depth = None;
    settings.background = Background::Constant(Rgb::WHITE);
    world.entities.spawn((Camera::Orthographic { height_m: 1.6 }, at(0.0, 0.0, 5.0)));
    let id = world.assets.add_material(None, Material::Principled(Box::new(material.clone())));
    world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, id, Transform::IDENTITY));
    let picture = Picture::of(&world);
    let found = mean(&picture);
    let count = picture.pixels.len() as f64;
    let square: f64 = picture.pixels.iter().map(|p| (f64::from(p.r + p.g + p.b) / 3.0 - found).powi(2)).sum();
    (found, (square / count / count).sqrt())
}

#[test]
fn white_balls_of_random_materials_conserve_energy() {
    let mut chance = Chance(7);
    let (mut gained, mut lost, mut count) = (0.0, 0.0, 0.0);
    for number in 0..400 {
        let material = white(&mut chance);
        // If microfacets lose most light and the path meets them repeatedly, a few paths carry most of it.
        let width = material.roughness.factor.max(material.anisotropy.strength);
        if material.volume.is_some() && width * (material.ior - 1.0) > 1.0 {
            continue;
        }
        let (found, deviation) = before_white(&material);
        let layers = material.clearcoat.factor + material.iridescence.factor.factor > 0.0
            || material.sheen_color != ColorInput::Constant(Rgb::BLACK);
        // The approximate number of boundaries that light meets before it leaves the body.
        let leaves = (material.transmission.factor + material.diffuse_transmission.factor).clamp(0.05, 1.0);
        let meetings = if material.volume.is_some() { material.ior.powi(2) / leaves } else { 1.0 };
        let most = f64::from(0.01 + 0.002 * meetings + if layers { 0.04 } else { 0.0 }) + 4.0 * deviation;
        assert!((found - 1.0).abs() < most, "ball {number}: {found} ± {deviation}, {material:?}");
        let beyond_chance = ((found - 1.0).abs() - 2.0 * deviation).max(0.0);
        if found > 1.0 {
            gained += beyond_chance
        } else {
            lost += beyond_chance
        }
        count += 1.0;
    }
    assert!(count > 250.0);
    assert!(gained / count < 0.002 && lost / count < 0.003, "gained {gained}, lost {lost} of {count}");
}

/// The radiance of a floor, viewed from below the light.
fn floor(lamp: &str, samples: u32) -> f64 {
    mean(&picture(&format!(
        "(settings: (size: (4, 4), samples: {samples}, transport: Path, filter: Box, max_depth: 0, sharing: Off),
          entities: [
              (camera: Orthographic(height_m: 0.001),
               transform: LookAt(from: (0, 0.5, 0), to: (0, 0, 0), up: (0, 0, -1))),
              (shape: Plane(corners: ((-90, 0, -90), (-90, 0, 90), (90, 0, 90), (90, 0, -90))),
               material: (diffuse: 0.8)),
              {lamp}
          ])"
    )))
}

/// The radiance of a floor below a ball of radiance L, radius r, at height h and distance d: albedo · L (r/d)² h/d
/// (PBRT 4th ed., 4.2: the ball's irradiance does not depend on the distribution over its cone, if that is entirely
/// above the horizon).
#[test]
fn spherical_emitters_of_all_sizes_light_by_their_solid_angle() {
    let (place, distance) = ([0.3f64, 2.0, -0.7], (0.09f64 + 4.0 + 0.49).sqrt());
    for scale in [1.0, 1e-4, 1e4] {
        for ratio in [0.4, 0.1, 1e-2, 4e-3, 2e-3, 1e-3, 4e-4, 1e-4, 1e-5, 3e-6, 1e-6, 1e-7, 1e-9, 1e-12] {
            let radius = ratio * distance;
            let light = 1.0 / ratio.powi(2);
            // Light and floor are scaled together.
            let text = format!(
                "(settings: (size: (2, 2), samples: 256, transport: Path, filter: Box, max_depth: 0, sharing: Off),
                  entities: [
                      (camera: Orthographic(height_m: {}),
                       transform: LookAt(from: (0, {}, 0), to: (0, 0, 0), up: (0, 0, -1))),
                      (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
                       transform: (scale: {scale}), material: (diffuse: 0.8)),
                      (shape: Sphere(radius_m: {:e}), material: (diffuse: 0, emission: {light:e}),
                       transform: (translate: ({}, {}, {}))),
                  ])",
                0.001 * scale,
                0.5 * scale,
                radius * scale,
                place[0] * scale,
                place[1] * scale,
                place[2] * scale,
            );
            let found = mean(&picture(&text));
            let expected = 0.8 * place[1] / distance;
            assert!((found / expected - 1.0).abs() < 0.005, "{scale} {ratio}: {found}, not {expected}");
        }
    }
}

/// A blocker next to a light hides it at any distance; the light does not shadow itself.
#[test]
fn blockers_next_to_lights_hide_them() {
    let plane = |half: f64, height: f64| {
        format!(
            "shape: Plane(corners: ((-{half}, {height}, -{half}), ({half}, {height}, -{half}),
                                    ({half}, {height}, {half}), (-{half}, {height}, {half})))"
        )
    };
    let lamps = [
        format!("({}, material: (diffuse: 0, emission: 10)),", plane(0.5, 10.0)),
        "(light: Area(power_w: 100, size_m: (1, 1), visible: true),
          transform: (translate: (0, 10, 0), rotate_degrees: (-90, 0, 0))),"
            .into(),
        "(shape: Sphere(radius_m: 0.2), material: (diffuse: 0, emission: 100), transform: (translate: (0, 10.2, 0))),"
            .into(),
        "(shape: Mesh(\"cube.ply\"), material: (diffuse: 0, emission: 10), transform: (translate: (0, 11, 0))),"
            .into(),
    ];
    for lamp in lamps {
        for transport in ["Path", "Whitted"] {
            let of = |more: &str| {
                let text = format!("{lamp} {more}");
                let mut world = world(&format!(
                    "(settings: (size: (4, 4), samples: 16, filter: Box, max_depth: 0, sharing: Off),
                      entities: [
                          (camera: Orthographic(height_m: 0.001),
                           transform: LookAt(from: (0, 0.5, 0), to: (0, 0, 0), up: (0, 0, -1))),
                          (shape: Plane(corners: ((-90, 0, -90), (-90, 0, 90), (90, 0, 90), (90, 0, -90))),
                           material: (diffuse: 0.8)),
                          {text}
                      ])"
                ));
                world.settings.transport =
                    if transport == "Path" { Transport::Path } else { Transport::Whitted };
                mean(&Picture::of(&world))
            };
            let bare = of("");
            if transport == "Whitted" && bare == 0.0 {
                // Under Whitted's transport only light entities light surfaces.
                continue;
            }
            assert!(bare > 0.0, "{lamp} {transport}");
            for gap in [0.1, 1e-2, 1e-3, 2e-4] {
                let cover = format!("({}, material: (diffuse: 0)),", plane(3.0, 10.0 - gap));
                assert_eq!(of(&cover), 0.0, "{lamp} {transport}, {gap} m");
            }
        }
    }
}

/// Emissive shapes that are no emitters, such as ellipsoids, block lights in both schedules.
#[test]
fn emissive_ellipsoids_cast_shadows() {
    for transport in ["Path", "Whitted"] {
        let of = |light: &str, schedule: Schedule| {
            let text = format!(
                "(settings: (size: (4, 4), samples: 4, transport: {transport}, filter: Box, max_depth: 0, sharing: Off),
                  entities: [
                      (camera: Orthographic(height_m: 0.001),
                       transform: LookAt(from: (0, 0.2, 0), to: (0, 0, 0), up: (0, 0, -1))),
                      (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))), material: (diffuse: 0.8)),
                      (shape: Sphere(radius_m: 0.3), material: (diffuse: 0, emission: 1),
                       transform: (translate: (0, 1, 0), scale: (1, 0.5, 1.5))), {light}
                  ])"
            );
            film(&world(&text), Options { schedule, ..Options::default() }).hash()
        };
        let lamp = "(light: Point(power_w: 1000), transform: (translate: (0, 2, 0)))";
        let dark = of("", Schedule::Wavefront);
        for schedule in [Schedule::Wavefront, Schedule::Recursive] {
            assert_eq!(of(lamp, schedule), dark, "{transport} {schedule:?}");
        }
    }
}

/// A light in the plane of a ceiling is not blocked by it.
#[test]
fn lights_in_the_plane_of_a_ceiling_are_not_blocked() {
    for height in [2.0, 2.7, 3.1, 5.3] {
        for size in [1.0, 7.0, 60.0] {
            let lamp = |lower: f64, ceiling: bool| {
                let ceiling = format!(
                    "(shape: Plane(corners: ((-{size}, {height}, -{size}), ({size}, {height}, -{size}),
                                             ({size}, {height}, {size}), (-{size}, {height}, {size}))),
                      material: (diffuse: 0)),"
                )
                .repeat(usize::from(ceiling));
                floor(
                    &format!(
                        "(light: Area(power_w: 100, size_m: (1, 1)),
                          transform: (translate: (0.3, {}, 0.2), rotate_degrees: (-90, 0, 0))), {ceiling}",
                        height - lower
                    ),
                    64,
                )
            };
            let (alone, within) = (lamp(0.0, false), lamp(0.0, true));
            assert!((within / alone - 1.0).abs() < 1e-3, "{height} {size}: {within}, not {alone}");
        }
    }
}

/// Radiance within a body of index n is n² times that outside, for light that enters or leaves.
#[test]
fn radiance_scales_with_the_square_of_the_index() {
    for ior in [1.33f64, 1.5, 2.4] {
        let reflected = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let ball = |light: &str, from: f64| {
            format!(
                "(settings: (size: (4, 4), samples: 1024, transport: Path, filter: Box, max_depth: 64,
                             sharing: Off, background: {}),
                  entities: [
                      (camera: Orthographic(height_m: 0.001), transform: LookAt(from: (0, 0, {from}), to: (0, 0, -9))),
                      (shape: Sphere(radius_m: 1), material: Principled(metallic: 0, roughness: 0, transmission: 1,
                       ior: {ior}, volume: ())), {light}
                  ])",
                u8::from(light.is_empty())
            )
        };
        // From outside, at an emitter in the centre.
        let lamp = "(shape: Sphere(radius_m: 0.2), material: (diffuse: 0, emission: 1))";
        let (found, expected) = (mean(&picture(&ball(lamp, 5.0))), (1.0 - reflected) / (ior * ior));
        assert!((found / expected - 1.0).abs() < 0.02, "{ior}: {found}, not {expected}");
        // From the centre, at white surroundings, after any number of internal reflections.
        let (found, expected) = (mean(&picture(&ball("", 0.0))), ior * ior);
        assert!((found / expected - 1.0).abs() < 0.02, "{ior}: {found}, not {expected}");
        // Both within: the radiance does not change.
        let found = mean(&picture(&ball(lamp, 0.5)));
        assert!((found - 1.0).abs() < 1e-6, "{ior}: {found}");
    }
}

/// The light of an emitter within a glass ball leaves it, however it is found.
#[test]
fn emitters_within_glass_lose_no_light() {
    let of = |glass: &str| {
        mean(&picture(&format!(
            "(settings: (size: (24, 24), samples: 256, transport: Path, filter: Box, max_depth: 200, sharing: Off),
              entities: [
                  (camera: Orthographic(height_m: 2), transform: LookAt(from: (0, 0, 9), to: (0, 0, 0))),
                  (shape: Sphere(radius_m: 0.2), material: (diffuse: 1, emission: 1)), {glass}
              ])"
        )))
    };
    let bare = of("");
    // Rougher glass is not reciprocal enough for this test.
    for (roughness, ior) in [(0.0, 1.5), (0.0, 2.2), (0.3, 1.5), (0.3, 2.5)] {
        let found = of(&format!(
            "(shape: Sphere(radius_m: 0.95), material: Principled(metallic: 0, roughness: {roughness},
              transmission: 1, ior: {ior}, volume: ()))"
        ));
        assert!((found / bare - 1.0).abs() < 0.03, "{roughness} {ior}: {found}, not {bare}");
    }
}

/// Directly visible emission is not clamped, even if a texture gives its radiance.
#[test]
fn emissive_textures_are_not_clamped() {
    let text = "(settings: (size: (4, 4), samples: 4, transport: Path, filter: Box),
                 entities: [
                     (camera: Orthographic(height_m: 2), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
                     (shape: Plane(corners: ((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0))),
                      material: (diffuse: 0, emission: Image(\"floats.exr\"))),
                 ])";
    for unlit in [false, true] {
        let mut world = world(text);
        for image in &mut world.assets.images {
            let pixels = vec![[3e6, 2e6, 1e6]; image.width as usize * image.height as usize];
            std::sync::Arc::make_mut(image).texels = Texels::Rgb32(pixels);
        }
        if unlit {
            for named in &mut world.assets.materials {
                if let Material::BlinnPhong(material) = &named.material {
                    let base_color = material.emission;
                    let material = Principled { base_color, unlit: true, ..Principled::default() };
                    named.material = Material::Principled(Box::new(material));
                }
            }
        }
        let found = Picture::of(&world).at(1, 1);
        let off = (found.r / 3e6 - 1.0).abs().max((found.b / 1e6 - 1.0).abs());
        assert!(off < 1e-4, "unlit {unlit}: {found:?}");
    }
}

/// A photometric profile that is a narrow cone has no more noise than a spotlight with that cone.
#[test]
fn narrow_photometric_profiles_have_the_noise_of_spotlights() {
    let of = |lamp: &str, seed: u32| {
        let mut world = world(&format!(
            "(settings: (size: (48, 27), samples: 16, seed: {seed}, transport: Path, max_depth: 0, sharing: Off),
              entities: [
                  (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 4, 6), to: (0, 0, 0))),
                  (light: Point(power_w: 100), transform: (translate: (-3, 2, 0))),
                  (light: {lamp}, transform: LookAt(from: (0, 4, 0), to: (0, 0, 0))),
                  (shape: Plane(corners: ((-6, 0, -6), (-6, 0, 6), (6, 0, 6), (6, 0, -6)))),
              ])"
        ));
        for image in &mut world.assets.images {
            let rows = 361usize;
            let bright = |row: usize| if row <= 20 { 1.0 } else { 0.0 };
            let image = std::sync::Arc::make_mut(image);
            (image.width, image.height) = (1, rows as u32);
            image.texels = Texels::Rgb32((0..rows).map(|row| [bright(row); 3]).collect());
        }
        Picture::of(&world)
    };
    let noise = |lamp: &str| {
        let [a, b] = [1, 2].map(|seed| of(lamp, seed));
        let differences = a.pixels.iter().zip(&b.pixels).map(|(a, b)| f64::from(a.g - b.g).powi(2));
        (mean(&a), (differences.sum::<f64>() / a.pixels.len() as f64).sqrt())
    };
    let (photometric, its_noise) = noise("Photometric(power_w: 9.046, profile: \"lamp.ies\")");
    let cosine = (10.0 * PI / 180.0).cos();
    // The same intensity: Φ / (2π (1 − cos)), of a point light Φ / 4π.
    let power = 9.046 * 2.0 / (1.0 - cosine);
    let (spot, spot_noise) =
        noise(&format!("Spot(power_w: {power}, inner_degrees: 9.99, outer_degrees: 10)"));
    assert!((photometric / spot - 1.0).abs() < 0.05, "{photometric} {spot}");
    assert!(its_noise < 2.0 * spot_noise, "{its_noise} {spot_noise}");
}
