//! The path transport compared with analytic results.

use rayfront::internals::integrator::Schedule;
use rayfront::math::{Rgb, Vec3};
use rayfront::render::Options;
use rayfront::world::{
    Background, BlinnPhong, Camera, ColorInput, DepthLimits, Light, Material, PixelFilter, Principled,
    Sampler, ScalarInput, Shape, Sharing, Transform, Transport, Volume, World,
};

use crate::support::{self, Picture, mean};

fn at(translation: Vec3) -> Transform {
    Transform::Trs {
        translation: translation.as_dvec3(),
        rotation: rayfront::math::Quat::IDENTITY,
        scale: Vec3::ONE,
    }
}

/// A path-traced world with a camera at the origin.
fn world(size: u32, samples: u32) -> World {
    let mut world = World::default();
    world.settings.size = [size, size];
    world.settings.samples = samples;
    world.settings.transport = Transport::Path;
    world.settings.filter = PixelFilter::Box;
    world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, at(Vec3::ZERO)));
    world
}

fn surface(base: f32, metallic: f32, roughness: f32) -> Material {
    Material::Principled(Box::new(Principled {
        base_color: ColorInput::Constant(Rgb::splat(base)),
        metallic: ScalarInput::constant(metallic),
        roughness: ScalarInput::constant(roughness),
        ..Principled::default()
    }))
}

/// Within a sphere that emits 1 and reflects a, radiance is 1 + a + a² + … = 1/(1 − a).
#[test]
fn furnace_of_albedo_one_half_doubles_the_radiance() {
    for sampler in [Sampler::Sobol, Sampler::Jittered, Sampler::Independent] {
        let mut world = world(16, 64);
        world.settings.sampler = sampler;
        world.settings.max_depth = 64;
        let half = Material::BlinnPhong(rayfront::world::BlinnPhong {
            diffuse: ColorInput::Constant(Rgb::splat(0.5)),
            emission: ColorInput::Constant(Rgb::WHITE),
            ..Default::default()
        });
        let material = world.assets.add_material(None, half);
        world.entities.spawn((Shape::Sphere { radius_m: 2.0 }, material, at(Vec3::new(0.3, 0.1, 0.0))));
        let found = mean(&Picture::of(&world));
        assert!((found - 2.0).abs() < 0.02, "{sampler:?}: {found}");
    }
}

/// White surfaces are invisible in white surroundings.
#[test]
fn white_surfaces_are_invisible_in_white_surroundings() {
    for (metallic, roughness) in
        [(0.0, 0.0), (0.0, 0.4), (0.0, 1.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0), (0.5, 0.7)]
    {
        let mut world = world(16, 256);
        world.settings.background = Background::Constant(Rgb::splat(0.5));
        world.settings.max_depth = 32;
        let material = world.assets.add_material(None, surface(1.0, metallic, roughness));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, material, at(Vec3::new(0.0, 0.0, -2.6))));
        let picture = Picture::of(&world);
        let found = mean(&picture);
        assert!((found / 0.5 - 1.0).abs() < 0.005, "metallic {metallic} roughness {roughness}: {found}");
    }
}

/// The radiance at the centre of a surface in white surroundings.
fn before_white(material: BlinnPhong) -> Rgb {
    let mut world = world(1, 4096);
    world.settings.background = Background::Constant(Rgb::WHITE);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, -1.0));
    let material = world.assets.add_material(None, Material::BlinnPhong(material));
    world.entities.spawn((Shape::Plane { corners: corners.map(|c| c.as_dvec3()) }, material));
    for (_, camera) in world.entities.query_mut::<(hecs::Entity, &mut Camera)>() {
        *camera = Camera::Pinhole { vertical_fov: 1e-3 };
    }
    Picture::of(&world).at(0, 0)
}

/// Light that is transmitted by `d` of an OBJ's material library is not bent; the rest keeps its colour. Glass shows
/// lights by its own reflection, so `specular` adds none.
#[test]
fn veils_keep_their_colour_and_glass_reflects_once() {
    let red = ColorInput::Constant(Rgb::new(0.4, 0.0, 0.0));
    let veil = BlinnPhong { diffuse: red, kt: Rgb::splat(0.5), ior: Some(1.0), ..Default::default() };
    let found = before_white(veil);
    for (found, expected) in found.to_array().into_iter().zip([0.9, 0.5, 0.5]) {
        assert!((found - expected).abs() < 0.02, "{found} {expected}");
    }
    let glass = |specular: f32| BlinnPhong {
        diffuse: ColorInput::Constant(Rgb::BLACK),
        kr: ColorInput::Constant(Rgb::WHITE),
        kt: Rgb::splat(0.5),
        specular: ColorInput::Constant(Rgb::splat(specular)),
        ior: Some(1.5),
        ..Default::default()
    };
    // F is 0.04 at normal incidence.
    for specular in [0.0, 0.5, 1.0] {
        let found = before_white(glass(specular)).g;
        assert!((found - (0.04 + 0.96 * 0.5)).abs() < 0.02, "{specular}: {found}");
    }
}

/// A surface that faces a sun receives its irradiance, however wide the sun is.
#[test]
fn directional_lights_of_any_angle_give_their_irradiance() {
    for angle in [0.0f32, 0.5, 2.0, 3.1] {
        let mut world = world(1, 4096);
        world.settings.max_depth = 0;
        let corners =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, -1.0));
        let white = BlinnPhong { diffuse: ColorInput::Constant(Rgb::WHITE), ..Default::default() };
        let material = world.assets.add_material(None, Material::BlinnPhong(white));
        world.entities.spawn((Shape::Plane { corners: corners.map(|c| c.as_dvec3()) }, material));
        let light = Light::Directional { irradiance: Rgb::splat(std::f32::consts::PI), angle };
        world.entities.spawn((light, at(Vec3::ZERO)));
        let found = Picture::of(&world).at(0, 0).g;
        assert!((found - 1.0).abs() < 0.01, "{angle}: {found}");
    }
}

/// Direct light from a rectangle on a diffuse floor, by Lambert's formula for polygons.
#[test]
fn rectangular_light_matches_lamberts_formula() {
    let mut world = world(1, 4096);
    world.settings.max_depth = 0;
    let floor = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| Vec3::new(x, y, -5.0));
    let gray = Material::BlinnPhong(rayfront::world::BlinnPhong {
        diffuse: ColorInput::Constant(Rgb::splat(0.6)),
        ..Default::default()
    });
    let material = world.assets.add_material(None, gray);
    world.entities.spawn((Shape::Plane { corners: floor.map(|c| c.as_dvec3()) }, material));
    // A narrow view of the floor's centre.
    for (_, camera) in world.entities.query_mut::<(hecs::Entity, &mut Camera)>() {
        *camera = Camera::Pinhole { vertical_fov: 1e-3 };
    }
    let size = rayfront::math::Vec2::new(2.0, 1.0);
    let light = Light::Area {
        power_w: Rgb::splat(std::f32::consts::PI * 2.0 * 10.0),
        radiance: Rgb::BLACK,
        size_m: size,
        outline: Default::default(),
        samples: 1,
        pattern: Default::default(),
        visible: false,
    };
    // It emits along −Z, from 3 m above the floor, beside the camera.
    world.entities.spawn((light, at(Vec3::new(2.0, 0.5, -2.0))));
    let found = Picture::of(&world).at(0, 0).r as f64;

    let corners = [(1.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0)];
    let unit: Vec<[f64; 3]> = corners
        .iter()
        .map(|(x, y): &(f64, f64)| {
            let length = (x * x + y * y + 9.0).sqrt();
            [x / length, y / length, 3.0 / length]
        })
        .collect();
    let mut sum = 0.0;
    for k in 0..4 {
        let (a, b) = (unit[k], unit[(k + 1) % 4]);
        let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let length = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
        sum += libm::acos(dot) * cross[2] / length;
    }
    let expected = 0.6 / std::f64::consts::PI * 10.0 / 2.0 * sum;
    assert!((found / expected - 1.0).abs() < 0.003, "{found} {expected}");
}

/// Light sampling combined with sampled directions gives the same light as sampled directions only.
#[test]
fn light_sampling_and_sampled_directions_agree() {
    let lit = |radius: f32, distance: f32| {
        let mut world = world(8, 16_384);
        world.settings.max_depth = 1;
        let material = world.assets.add_material(None, surface(0.8, 0.3, 0.4));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, material, at(Vec3::new(0.0, 0.0, -3.0))));
        let power = 20.0 / (radius * radius);
        let lamp = Material::BlinnPhong(rayfront::world::BlinnPhong {
            diffuse: ColorInput::default(),
            emission: ColorInput::Constant(Rgb::splat(power)),
            ..Default::default()
        });
        let lamp = world.assets.add_material(None, lamp);
        world.entities.spawn((Shape::Sphere { radius_m: radius }, lamp, at(Vec3::new(0.0, distance, 0.0))));
        world
    };
    let with_lights = mean(&Picture::of(&lit(2.0, 6.0)));
    // The slightest stretch makes it an instance, which is not sampled as a light.
    let mut alone = lit(2.0, 6.0);
    for (shape, transform) in alone.entities.query_mut::<(&Shape, &mut Transform)>() {
        if *shape == (Shape::Sphere { radius_m: 2.0 })
            && let Transform::Trs { scale, .. } = transform
        {
            *scale = Vec3::new(1.0, 1.0, 1.0001);
        }
    }
    let by_directions = mean(&Picture::of(&alone));
    assert!((with_lights / by_directions - 1.0).abs() < 0.02, "{with_lights} {by_directions}");
}

/// The error decreases with the square root of the number of samples.
#[test]
fn noise_falls_with_the_root_of_the_samples() {
    let render = |samples: u32, seed: u64| {
        let mut world = world(12, samples);
        // Each pixel uses its own samples only.
        (world.settings.seed, world.settings.sharing) = (seed, Sharing::Off);
        world.settings.background = Background::Gradient { bottom: Rgb::BLACK, top: Rgb::WHITE };
        let material = world.assets.add_material(None, surface(0.7, 0.0, 0.6));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, material, at(Vec3::new(0.0, 0.0, -2.6))));
        Picture::of(&world).pixels
    };
    let expected = render(4096, 1);
    let error = |samples: u32| {
        let squares = render(samples, 2).into_iter().zip(&expected).map(|(a, b)| (a.g - b.g).powi(2) as f64);
        (squares.sum::<f64>() / expected.len() as f64).sqrt()
    };
    let (few, many) = (error(8), error(128));
    // A quarter, with a margin for the noise of the two estimated errors.
    assert!(many < few / 3.7, "{few} {many}");
}

/// Masked-out surfaces transmit light, half-transparent ones transmit half of it, and both schedules agree.
#[test]
fn alpha_transmits_light() {
    use rayfront::world::AlphaMode;
    let seen = |alpha: f32, mode: AlphaMode, schedule: Schedule| {
        let mut world = world(8, 256);
        world.settings.background = Background::Constant(Rgb::WHITE);
        world.settings.max_depth = 4;
        let material = Principled {
            base_color: ColorInput::Constant(Rgb::BLACK),
            specular: ScalarInput::constant(0.0),
            metallic: ScalarInput::constant(0.0),
            alpha: ScalarInput::constant(alpha),
            alpha_mode: mode,
            double_sided: true,
            ..Principled::default()
        };
        let material = world.assets.add_material(None, Material::Principled(Box::new(material)));
        for z in [-1.0, -2.0] {
            let corners =
                [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| Vec3::new(x, y, z));
            world.entities.spawn((Shape::Plane { corners: corners.map(|c| c.as_dvec3()) }, material));
        }
        let film = support::film(&world, Options { schedule, ..Options::default() });
        let pixels = film.radiance();
        pixels.iter().map(|p| p.r as f64).sum::<f64>() / pixels.len() as f64
    };
    for schedule in [Schedule::Wavefront, Schedule::Recursive] {
        assert_eq!(seen(0.4, AlphaMode::Mask { cutoff: 0.5 }, schedule), 1.0);
        assert_eq!(seen(0.6, AlphaMode::Mask { cutoff: 0.5 }, schedule), 0.0);
        assert_eq!(seen(0.6, AlphaMode::Opaque, schedule), 0.0);
        let twice_half = seen(0.5, AlphaMode::Blend, schedule);
        assert!((twice_half - 0.25).abs() < 0.01, "{twice_half}");
    }
}

/// The shadow of a half-transparent sheet is half as dark.
#[test]
fn shadows_of_half_transparent_sheets_are_half_as_dark() {
    use rayfront::world::{AlphaMode, Falloff};
    let lit = |sheet: Option<f32>| {
        // A shadow ray passes the sheet at random.
        let mut world = world(1, 1024);
        world.settings.max_depth = 0;
        let white = world.assets.add_material(None, surface(0.8, 0.0, 1.0));
        let corners =
            |z: f32| [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| Vec3::new(x, y, z));
        world.entities.spawn((Shape::Plane { corners: corners(-5.0).map(|c| c.as_dvec3()) }, white));
        if let Some(alpha) = sheet {
            let sheet = Principled {
                alpha: ScalarInput::constant(alpha),
                alpha_mode: AlphaMode::Blend,
                double_sided: true,
                ..Principled::default()
            };
            let sheet = world.assets.add_material(None, Material::Principled(Box::new(sheet)));
            // Between the light and the floor, behind the camera.
            world.entities.spawn((Shape::Plane { corners: corners(1.0).map(|c| c.as_dvec3()) }, sheet));
        }
        let lamp =
            Light::Point { power_w: Rgb::splat(1000.0), falloff: Falloff::InverseSquare, radius_m: 0.0 };
        world.entities.spawn((lamp, at(Vec3::new(0.0, 0.0, 2.0))));
        Picture::of(&world).at(0, 0).r as f64
    };
    let open = lit(None);
    assert!(open > 0.1);
    assert!((lit(Some(0.3)) / open - 0.7).abs() < 0.01);
    assert_eq!(lit(Some(1.0)), 0.0);
}

/// Glass with dispersion, and thin films, are invisible in white surroundings in each channel.
#[test]
fn dispersion_and_thin_films_conserve_each_channel() {
    use rayfront::world::{Iridescence, Volume};
    let clear = Volume::default();
    for (dispersion, film, transmission, roughness, allowed) in [
        (1.0, 0.0, 1.0, 0.0, 0.01),
        // Fewer colours, more noise.
        (2.0, 0.0, 1.0, 0.4, 0.03),
        (0.0, 1.0, 1.0, 0.0, 0.01),
        (0.0, 1.0, 0.0, 0.2, 0.01),
    ] {
        let mut world = world(16, 1024);
        world.settings.background = Background::Constant(Rgb::splat(0.5));
        world.settings.max_depth = 64;
        let material = Principled {
            metallic: ScalarInput::constant(0.0),
            roughness: ScalarInput::constant(roughness),
            transmission: ScalarInput::constant(transmission),
            volume: Some(clear),
            dispersion,
            iridescence: Iridescence { factor: ScalarInput::constant(film), ..Iridescence::default() },
            ..Principled::default()
        };
        let material = world.assets.add_material(None, Material::Principled(Box::new(material)));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, material, at(Vec3::new(0.0, 0.0, -2.6))));
        let picture = Picture::of(&world);
        let count = picture.pixels.len() as f64;
        let sum = |channel: fn(&Rgb) -> f32| picture.pixels.iter().map(|p| channel(p) as f64).sum::<f64>();
        for found in [sum(|p| p.r), sum(|p| p.g), sum(|p| p.b)].map(|sum| sum / count / 0.5) {
            assert!((found - 1.0).abs() < allowed, "{dispersion} {film} {transmission} {roughness}: {found}");
        }
    }
}

/// The Beer-Lambert law: along the attenuation distance, the attenuation colour remains of the entering light.
#[test]
fn bodies_absorb_by_the_beer_lambert_law() {
    let mut world = world(1, 64);
    world.settings.background = Background::Constant(Rgb::WHITE);
    world.settings.max_depth = 16;
    for (_, camera) in world.entities.query_mut::<(hecs::Entity, &mut Camera)>() {
        *camera = Camera::Pinhole { vertical_fov: 1e-3 };
    }
    let glass = Principled {
        metallic: ScalarInput::constant(0.0),
        roughness: ScalarInput::constant(0.0),
        transmission: ScalarInput::constant(1.0),
        ior: 1.0,
        volume: Some(Volume {
            attenuation_color: Rgb::new(0.25, 0.5, 1.0),
            attenuation_distance: 2.0,
            ..Volume::default()
        }),
        ..Principled::default()
    };
    let glass = world.assets.add_material(None, Material::Principled(Box::new(glass)));
    // Two metres thick, which is the attenuation distance.
    world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, glass, at(Vec3::new(0.0, 0.0, -5.0))));
    let found = Picture::of(&world).at(0, 0);
    assert!(
        (found.r - 0.25).abs() < 2e-3 && (found.g - 0.5).abs() < 2e-3 && (found.b - 1.0).abs() < 2e-3,
        "{found:?}"
    );
}

/// From within a sphere that emits 1 and reflects half: 1 + a + … up to the light found one segment after the last
/// bounce.
#[test]
fn depth_limits_by_kind_truncate_the_furnace_series() {
    let furnace = |mirrors: bool, depth_limits: DepthLimits| {
        let mut world = world(8, 64);
        world.settings.max_depth = 64;
        world.settings.depth_limits = depth_limits;
        let half = ColorInput::Constant(Rgb::splat(0.5));
        let black = ColorInput::Constant(Rgb::BLACK);
        let (diffuse, kr) = if mirrors { (black, half) } else { (half, black) };
        let emission = ColorInput::Constant(Rgb::WHITE);
        let surface = BlinnPhong { diffuse, kr, emission, ..BlinnPhong::default() };
        let material = world.assets.add_material(None, Material::BlinnPhong(surface));
        world.entities.spawn((Shape::Sphere { radius_m: 2.0 }, material, at(Vec3::new(0.3, 0.1, 0.0))));
        mean(&Picture::of(&world))
    };
    for most in 0..4 {
        let (diffuse, glossy) = (Some(most), Some(most));
        let expected = 2.0 - 0.5_f64.powi(most as i32 + 1);
        let found = furnace(false, DepthLimits { diffuse, glossy: Some(0), transmission: Some(0) });
        assert!((found - expected).abs() < 0.01, "diffuse {most}: {found} {expected}");
        let found = furnace(true, DepthLimits { diffuse: Some(0), glossy, transmission: Some(0) });
        assert!((found - expected).abs() < 1e-4, "glossy {most}: {found} {expected}");
    }
}

/// If all bounces are of one kind, its limit equals `max_depth` to the bit: direct light is still found in both ways.
#[test]
fn depth_limit_of_the_only_kind_equals_max_depth() {
    let lit = |max_depth: u32, depth_limits: DepthLimits| {
        let mut world = world(12, 16);
        // Limits by kind disable path reuse.
        world.settings.sharing = Sharing::Off;
        (world.settings.max_depth, world.settings.depth_limits) = (max_depth, depth_limits);
        let matte = |emission: f32| {
            Material::BlinnPhong(BlinnPhong {
                diffuse: ColorInput::Constant(Rgb::splat(0.7)),
                emission: ColorInput::Constant(Rgb::splat(emission)),
                ..BlinnPhong::default()
            })
        };
        let (wall, lamp) = (matte(0.0), matte(3.0));
        let (wall, lamp) = (world.assets.add_material(None, wall), world.assets.add_material(None, lamp));
        world.entities.spawn((Shape::Sphere { radius_m: 5.0 }, wall, at(Vec3::ZERO)));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, lamp, at(Vec3::new(1.5, 1.0, -2.5))));
        support::film(&world, Options::default()).hash()
    };
    let diffuse = |most: u32| DepthLimits { diffuse: Some(most), ..DepthLimits::default() };
    for most in 0..3 {
        assert_eq!(lit(most, DepthLimits::default()), lit(9, diffuse(most)), "{most}");
    }
    assert_ne!(lit(9, diffuse(1)), lit(9, diffuse(2)));
    let others = DepthLimits { diffuse: None, glossy: Some(0), transmission: Some(0) };
    assert_eq!(lit(9, DepthLimits::default()), lit(9, others));
}

/// Light enters a body and leaves it: two bounces.
#[test]
fn bodies_transmit_with_two_bounces() {
    let seen = |ior: f32, transmission: u32| {
        let mut world = world(1, 16);
        world.settings.background = Background::Constant(Rgb::WHITE);
        world.settings.depth_limits.transmission = Some(transmission);
        let clear = BlinnPhong { ior: Some(ior), ..BlinnPhong::default() };
        let clear = world.assets.add_material(None, Material::BlinnPhong(clear));
        world.entities.spawn((Shape::Sphere { radius_m: 1.0 }, clear, at(Vec3::new(0.0, 0.0, -1.5))));
        Picture::of(&world).at(0, 0).r
    };
    let bending = 1.0001;
    assert_eq!(seen(bending, 0), 0.0);
    // The second transmission is the segment after the last bounce.
    assert!((seen(bending, 1) - 1.0).abs() < 1e-5 && (seen(bending, 2) - 1.0).abs() < 1e-5);
    // Straight transmission is no bounce.
    assert!((seen(1.0, 0) - 1.0).abs() < 1e-5);
}

/// The kind of bounce is chosen with the same random numbers in every schedule.
#[test]
fn schedules_agree_with_depth_limits_by_kind() {
    let text = "(
        settings: (size: (20, 16), samples: 4, max_depth: 12, transport: Path,
                   diffuse_depth: 1, glossy_depth: 2, transmission_depth: 3),
        entities: [
            (camera: Pinhole(vertical_fov_degrees: 60), transform: LookAt(from: (0, 1, 4), to: (0, 0.6, 0))),
            (shape: Sphere(radius_m: 0.7), material: (ior: 1.5), transform: (translate: (-0.8, 0.7, 0))),
            (shape: Sphere(radius_m: 0.7), material: (diffuse: 0.3, kr: 0.4, specular: 0.2, shininess: 20),
             transform: (translate: (0.8, 0.7, 0))),
            (shape: Plane(corners: ((-3, 0, -3), (-3, 0, 3), (3, 0, 3), (3, 0, -3))), material: (diffuse: 0.6)),
            (light: Area(power_w: 60, size_m: (1, 1), visible: true),
             transform: LookAt(from: (0, 3, 1), to: (0, 0, 0))),
        ],
    )";
    crate::agreement::check_world(&|| support::world(text));
    let mut free = support::world(text);
    free.settings.depth_limits = DepthLimits::default();
    assert!(
        support::film(&free, Options::default()) != support::film(&support::world(text), Options::default())
    );
}

/// A sheet of frosted glass in front of a white environment is equally white: light that microfacets do not transmit at
/// first is reflected or transmitted later.
#[test]
fn frosted_sheets_lose_no_light() {
    for roughness in [0.25, 0.5, 1.0] {
        let picture = crate::support::picture(&format!(
            "(settings: (size: (16, 16), samples: 256, transport: Path), entities: [
                (camera: Orthographic(height_m: 1), transform: LookAt(from: (0, 1, 2), to: (0, 0, 0))),
                (light: Environment(radiance: 1)),
                (shape: Plane(corners: ((-2, -2, 0), (-2, 2, 0), (2, 2, 0), (2, -2, 0))),
                 material: Principled(base_color: 1, metallic: 0, transmission: 1, roughness: {roughness}))])"
        ));
        let found = mean(&picture);
        assert!((found - 1.0).abs() < 0.005, "roughness {roughness}: {found}");
    }
}

/// F90 is `specular` only: a black specular colour keeps its reflection at grazing angles, like a nearly black one.
#[test]
fn black_specular_colour_keeps_f90() {
    let rim = |color: &str| {
        let picture = crate::support::picture(&format!(
            "(settings: (size: (16, 16), samples: 64, transport: Path), entities: [
                (camera: Orthographic(height_m: 0.1), transform: LookAt(from: (0, 0.2, 2), to: (0, 0, 0))),
                (light: Environment(radiance: 1)),
                (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
                 material: Principled(base_color: 0, metallic: 0, specular_color: {color}, roughness: 0.1))])"
        ));
        mean(&picture)
    };
    let [black, nearly] = ["0", "0.00001"].map(rim);
    // Schlick's approximation at a cosine of 0.0995.
    assert!((nearly - 0.592).abs() < 0.02 && (black - nearly).abs() < 0.001, "{black} {nearly}");
}
