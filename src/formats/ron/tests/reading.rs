//! Tests of reading the keys of a scene.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{EVERYTHING, Fake, grey, only, read, read_entity};
use crate::formats::ron::{load, parse};
use crate::math::{DVec3, Quat, Rgb, Vec2, Vec3};
use crate::world::assets::{ColorSpace, TextureFilter, Wrap};
use crate::world::*;

#[test]
fn settings_are_read_and_have_defaults() {
    let world = read(EVERYTHING).unwrap();
    assert_eq!(
        world.settings,
        Settings {
            size: [320, 200],
            samples: 4,
            max_depth: 3,
            depth_limits: DepthLimits { diffuse: Some(2), glossy: Some(5), transmission: None },
            min_throughput: 0.01,
            transport: Transport::Whitted,
            seed: 7,
            filter: PixelFilter::Gaussian { radius: 2.0 },
            pixel_pattern: Pattern::Regular,
            background: Background::Gradient { bottom: grey(0.25), top: Rgb::new(0.1, 0.2, 1.0) },
            backdrop: Some(Background::Constant(grey(0.75))),
            backplate: Some(Backplate::Gradient { bottom: grey(1.0), top: Rgb::new(0.0, 0.5, 1.0) }),
            transparent: true,
            ambient: grey(0.01),
            roulette_depth: None,
            clamp: Some(20.0),
            filter_glossy: 0.5,
            sampler: Sampler::Independent,
            sharing: Sharing::Groups(16),
            caustics: Caustics::Photons { photons: 2.5, radius: 1.4 },
            adaptive: Adaptive::On,
            tonemap: Tonemap::Aces,
            exposure_ev: -1.5,
            auto_exposure: true,
            copied_triangles: 1000,
            light_groups: true,
            light_by_bounce: true,
            aov: vec![Aov::Normal, Aov::Depth],
        }
    );
    assert_eq!(read("(entities: [])").unwrap().settings, Settings::default());
    let settings = |keys: &str| read(&format!("(settings: ({keys}), entities: [])")).unwrap().settings;
    assert_eq!(settings("filter: Tent").filter, PixelFilter::Tent { radius: 1.0 });
    assert_eq!(settings("filter: BlackmanHarris()").filter, PixelFilter::BlackmanHarris { radius: 1.5 });
    assert_eq!(settings("filter: Box").filter, PixelFilter::Box);
    assert_eq!(settings("roulette_depth: 7").roulette_depth, Some(7));
    assert_eq!(settings("roulette_depth: Some(7), clamp: None").roulette_depth, Some(7));
    assert_eq!(settings("transport: Path").transport, Transport::Path);
    assert_eq!(settings("aov: All").aov, Aov::IMAGE);
    assert_eq!(settings("aov: [Depth, Depth, Variance]").aov, [Aov::Depth, Aov::Variance]);
    assert_eq!(settings("sharing: Off").sharing, Sharing::Off);
    assert_eq!(settings("sharing: Auto").sharing, Sharing::Auto);
    assert_eq!(settings("caustics: Off").caustics, Caustics::Off);
    assert_eq!(settings("caustics: (radius: 2)").caustics, Caustics::Photons { photons: 1.0, radius: 2.0 });
    assert_eq!(settings("backplate: \"white\"").backplate, Some(Backplate::Constant(Rgb::WHITE)));
    assert_eq!(settings("backplate: None").backplate, None);
    assert_eq!(settings("sampler: Jittered").sampler, Sampler::Jittered);
    assert_eq!(settings("seed: 18446744073709551615").seed, u64::MAX);
    assert_eq!(settings("background: (1, 2, 3)").background, Background::Constant(Rgb::new(1.0, 2.0, 3.0)));
    assert_eq!(settings("samples: 4194304, size: (65536, 1)").samples, 1 << 22);
}

#[test]
fn scenes_with_glass_are_traced_deeper_unless_they_set_max_depth() {
    let world = |settings: &str, material: &str| {
        let ball = format!("(shape: Sphere(radius_m: 1), material: {material})");
        read(&format!("(settings: ({settings}), entities: [{ball}])")).unwrap()
    };
    let glass = "Principled(metallic: 0, transmission: 1, volume: ())";
    for (settings, material, depth) in [
        ("", glass, 64),
        ("transport: Path", "(ior: 1.5)", 64),
        ("max_depth: 8", glass, 8),
        ("max_depth: 5", glass, 5),
        ("transport: Whitted", glass, 8),
        ("", "Principled(metallic: 0, transmission: 1)", 8),
        ("", "Principled(metallic: 0, transmission: 1, ior: 1, volume: ())", 8),
    ] {
        let world = world(settings, material);
        assert_eq!(world.settings.max_depth, depth, "{settings} {material}");
        let text = crate::formats::ron::write(&world, Path::new("scenes/test.ron")).unwrap();
        assert_eq!(read(&text).unwrap().settings.max_depth, depth, "{text}");
    }
}

#[test]
fn materials_are_read_and_have_defaults() {
    let world = read(EVERYTHING).unwrap();
    let named = |name: &str| {
        let found = world.assets.materials.iter().find(|m| m.name.as_deref() == Some(name)).unwrap();
        let Material::BlinnPhong(material) = found.material.clone() else { panic!() };
        material
    };
    let glass = named("glass");
    assert_eq!(glass.ior, Some(1.5));
    assert_eq!(glass.diffuse, ColorInput::Constant(Rgb::BLACK));
    assert_eq!(glass.kr, ColorInput::Constant(Rgb::WHITE));
    assert_eq!((glass.kt, glass.shininess), (Rgb::WHITE, 200.0));
    assert_eq!(glass.specular, ColorInput::Constant(grey(0.2)));
    let wall = named("wall");
    let ColorInput::Texture(id) = wall.diffuse else { panic!("no texture") };
    let texture = world.assets.textures[id.0 as usize];
    assert_eq!(
        texture,
        Texture {
            source: TextureSource::Image(ImageId(0)),
            filter: TextureFilter::Nearest,
            wrap: [Wrap::Clamp, Wrap::Mirror],
            scale: Vec2::splat(4.0),
            offset: Vec2::new(0.5, 0.0),
            color_space: ColorSpace::Linear,
            factor: Rgb::new(1.0, 0.5, 0.25),
            ..Texture::new(ImageId(0))
        }
    );
    assert_eq!(named("floor").highlight, Highlight::Phong);
    // An empty material is the default one.
    assert_eq!(only::<MaterialId>(&read_entity("material: ()")), MaterialId::DEFAULT);
    let bare = read_entity("material: (diffuse: 0.5)");
    let inline = &bare.assets.materials[only::<MaterialId>(&bare).0 as usize];
    let diffuse = ColorInput::Constant(grey(0.5));
    assert_eq!(inline.material, Material::BlinnPhong(BlinnPhong { diffuse, ..Default::default() }));
    assert_eq!(inline.name, None);
}

#[test]
fn shapes_lights_and_cameras_have_defaults() {
    assert_eq!(only::<Shape>(&read_entity("shape: Sphere")), Shape::Sphere { radius_m: 1.0 });
    assert_eq!(only::<Shape>(&read_entity("shape: Sphere()")), Shape::Sphere { radius_m: 1.0 });
    assert_eq!(
        only::<Light>(&read_entity("light: Area(power_w: 1, size_m: 2)")),
        Light::Area {
            power_w: grey(1.0),
            radiance: Rgb::BLACK,
            size_m: Vec2::splat(2.0),
            outline: Outline::Rectangle,
            samples: 1,
            pattern: Pattern::Jittered,
            visible: false
        }
    );
    let right_angle = std::f32::consts::FRAC_PI_2;
    assert_eq!(
        only::<Light>(&read_entity("light: Spot(power_w: 1, outer_degrees: 90)")),
        Light::Spot {
            power_w: grey(1.0),
            inner_angle: std::f32::consts::FRAC_PI_6,
            outer_angle: right_angle,
            edge: ConeEdge::Squared,
            falloff: Falloff::InverseSquare,
            radius_m: 0.0
        }
    );
    let fov = std::f32::consts::FRAC_PI_4;
    assert_eq!(only::<Camera>(&read_entity("camera: Pinhole")), Camera::Pinhole { vertical_fov: fov });
    assert_eq!(only::<Camera>(&read_entity("camera: Orthographic")), Camera::Orthographic { height_m: 2.0 });
}

#[test]
fn entities_keep_the_order_of_the_file_and_parents_may_follow() {
    let world = read(EVERYTHING).unwrap();
    let order = world.in_order();
    assert_eq!(order.len(), 19);
    let child = order[1];
    assert_eq!(world.name_of(child), "child");
    assert_eq!(world.entities.get::<&Parent>(child).unwrap().0, order[2]);
    assert!(order.iter().all(|entity| world.entities.get::<&Transform>(*entity).is_ok()));
    assert_eq!(*world.entities.get::<&Transform>(child).unwrap(), Transform::IDENTITY);
    assert_eq!(world.name_of(order[3]), "kn\"o\"t");
    assert_eq!(world.name_of(order[10]), "raw \"name\"");
    assert!(world.entities.get::<&Shape>(order[0]).is_err());
}

#[test]
fn each_file_is_read_once_relative_to_the_scene() {
    let mut files = Fake::default();
    let world = parse(EVERYTHING, Path::new("scenes/test.ron"), &mut files).unwrap();
    let paths = ["scenes/../assets/knot.ply", "scenes/../assets/checker.png"].map(PathBuf::from);
    assert_eq!(files.loaded, paths);
    assert_eq!((world.assets.images.len(), world.assets.meshes.len()), (1, 1));
    assert_eq!(world.assets.textures.len(), 4);
    assert_eq!(world.assets.meshes[0].source.as_deref(), Some(paths[0].as_path()));
    assert_eq!(world.warnings.len(), 1);
    // A file is read once, even if its path is written in different ways.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.ply"), "").unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    let text =
        "(entities: [(shape: Mesh(\"a.ply\")), (shape: Mesh(\"sub/../a.ply\")), (shape: Mesh(\"./a.ply\"))])";
    let scene = folder.path().join("scene.ron");
    std::fs::write(&scene, text).unwrap();
    let mut files = Fake::default();
    assert_eq!(load(&scene, &mut files).unwrap().assets.meshes.len(), 1);
    assert_eq!(files.loaded.len(), 1);
}

fn rotation_of(keys: &str) -> Quat {
    match only::<Transform>(&read_entity(&format!("transform: {keys}"))) {
        Transform::Trs { rotation, .. } => rotation,
        Transform::Matrix(_) => panic!("a matrix"),
    }
}

#[test]
fn look_at_points_minus_z_at_the_target_and_y_up() {
    for (from, to, up) in [
        ((0.0, 1.0, 5.0), (0.0, 0.5, 0.0), (0.0, 1.0, 0.0)),
        ((1.0, 2.0, 3.0), (-4.0, 7.0, 11.0), (0.3, 1.0, 0.2)),
        ((0.0, 5.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), (0.0, 3.0, 0.0)),
    ] {
        let rotation = rotation_of(&format!("LookAt(from: {from:?}, to: {to:?}, up: {up:?})"));
        let [from, to, up] = [from, to, up].map(Vec3::from);
        let forward = (to - from).normalize();
        assert!((rotation * Vec3::NEG_Z - forward).length() < 1e-6, "{rotation}");
        let upright = (rotation * Vec3::Y).dot(up.normalize());
        let best = up.normalize().cross(forward).length();
        assert!((upright - best).abs() < 1e-6 && rotation.is_normalized());
    }
}

#[test]
fn degrees_turn_about_fixed_axes_x_first() {
    let rotation = rotation_of("(rotate_degrees: (90, 90, 0))");
    // Y goes to Z about X, then to X about Y.
    assert!((rotation * Vec3::Y - Vec3::X).length() < 1e-6);
    let rotation = rotation_of("(rotate_degrees: (0, 90, 90))");
    assert!((rotation * Vec3::Z - Vec3::Y).length() < 1e-6);
    assert_eq!(rotation_of("(rotate_degrees: (0, 0, 0))"), Quat::IDENTITY);
    let half = std::f64::consts::FRAC_1_SQRT_2 as f32;
    assert_eq!(rotation_of("(rotate_degrees: (0, 90, 0))"), Quat::from_xyzw(0.0, half, 0.0, half));
}

#[test]
fn unit_quaternions_are_kept_and_nearly_unit_ones_normalised() {
    let kept = Quat::from_xyzw(0.18257418, 0.36514837, 0.5477225, 0.73029673);
    let text = format!("(rotate_quaternion: ({}, {}, {}, {}))", kept.x, kept.y, kept.z, kept.w);
    assert_eq!(rotation_of(&text).to_array().map(f32::to_bits), kept.to_array().map(f32::to_bits));
    assert_eq!(rotation_of("(rotate_quaternion: (0, 0, 0, 1.004))"), Quat::IDENTITY);
    assert!(rotation_of("(rotate_quaternion: (0.183, 0.365, 0.548, 0.73))").is_normalized());
}

#[test]
fn matrices_are_read_by_rows() {
    let world = read_entity("transform: Matrix(((1, 0, 0, 7), (0, 2, 0, 8), (0, 0, 3, 9)))");
    let Transform::Matrix(matrix) = only::<Transform>(&world) else { panic!("no matrix") };
    assert_eq!(matrix.transform_point3(DVec3::ONE), DVec3::new(8.0, 10.0, 12.0));
}

#[test]
fn numbers_are_rounded_once() {
    for text in ["0.1", "16777217", "1e-45", "3.4028235e38", "0.30000000000000004", "1_000.5", "+2.5", "7e0"]
    {
        let world = read(&format!("(settings: (min_throughput: {text}), entities: [])")).unwrap();
        let expected: f32 = text.replace('_', "").parse().unwrap();
        assert_eq!(world.settings.min_throughput.to_bits(), expected.to_bits(), "{text}");
    }
}

#[test]
fn byte_order_mark_and_windows_line_ends_are_accepted() {
    let world = read(&format!("\u{feff}{}", EVERYTHING.replace('\n', "\r\n"))).unwrap();
    assert_eq!(world.in_order().len(), 19);
}

#[test]
fn reading_thousands_of_entities_takes_less_than_a_second() {
    let mut text = String::from("(entities: [\n");
    for ball in 0..7382 {
        let x = ball as f32 * 0.013;
        text.push_str(&format!(
            "    (shape: Sphere(radius_m: 0.05), material: \"gold\", transform: (translate: ({x}, 0.25, -1.75))),\n"
        ));
    }
    text.push_str("], materials: {\"gold\": (ks: 1)})");
    let start = Instant::now();
    assert_eq!(read(&text).unwrap().in_order().len(), 7382);
    let took = start.elapsed();
    println!("7382 entities in {took:?}");
    // Ten times the usual duration, for slow or busy machines.
    assert!(took < Duration::from_secs(1), "{took:?}");
}

#[test]
fn display_colours_are_decoded_and_malformed_ones_refused() {
    let color = |text: &str| {
        let keys = format!("(entities: [(light: Environment(radiance: {text}))])");
        read(&keys).map(|world| match only::<Light>(&world) {
            Light::Environment { radiance, .. } => radiance.to_array(),
            _ => panic!("an environment"),
        })
    };
    assert_eq!(color("\"#fff\"").unwrap(), [1.0; 3]);
    assert_eq!(color("\"#ff8000\"").unwrap(), color("Srgb(1, 0.5019608, 0)").unwrap());
    let [half, ..] = color("Srgb(0.5, 0, 0)").unwrap();
    assert!((half - 0.21404114).abs() < 1e-6, "{half}");
    assert_eq!(color("\"ff8000\"").unwrap(), color("\"#ff8000\"").unwrap());
    assert_eq!(color("\"DarkOrange\"").unwrap(), color("\"#ff8c00\"").unwrap());
    for wrong in [
        "\"#ff80\"", "\"#gg0000\"", "Srgb(255, 0, 0)", "Srgb(1, 0)", "\"reddish\"", "red",
        "Metal(\"tin foil\")",
    ] {
        assert!(color(wrong).is_err(), "{wrong}");
    }
    // A black body keeps the brightness of a grey, whatever its temperature.
    let luminance = |text: &str| Rgb::from(color(text).unwrap()).luminance();
    assert!((luminance("Kelvin(2700)") - 1.0).abs() < 1e-5);
    assert!((luminance("Kelvin(9000, 7)") - 7.0).abs() < 1e-4);
    assert_eq!(color("Keys([(0, Kelvin(2700)), (1, 1)])").unwrap(), color("Kelvin(2700)").unwrap());
    assert_eq!(color("Metal(\"silver\")").unwrap(), [0.989, 0.984, 0.978]);
}

/// A lumen is 1/683 W of light; a lamp's colour does not change its lumens.
#[test]
fn photometric_units_are_683_to_a_watt_at_the_luminance_of_the_colour() {
    use std::f32::consts::PI;
    let light = |text: &str| {
        let world = read(&format!("(entities: [(light: {text})])")).unwrap();
        match only::<Light>(&world) {
            Light::Point { power_w: light, .. }
            | Light::Spot { power_w: light, .. }
            | Light::Area { power_w: Rgb::BLACK, radiance: light, .. }
            | Light::Area { power_w: light, .. }
            | Light::Directional { irradiance: light, .. }
            | Light::Environment { radiance: light, .. } => light,
            other => panic!("{other:?}"),
        }
    };
    let watts = [
        ("Point(power_w: Lumens(683))", 1.0),
        ("Point(power_w: Lumens(683, Kelvin(2700)))", 1.0),
        ("Point(power_w: Lumens(683, \"red\"))", 1.0),
        ("Point(power_w: Candela(683))", 4.0 * PI),
        ("Spot(power_w: Candela(683, (1, 0.5, 0.2)))", 4.0 * PI),
        ("Area(size_m: 2, power_w: Lumens(683))", 1.0),
        ("Area(size_m: 2, power_w: Candela(683))", PI),
        ("Area(size_m: 2, radiance: Nits(683))", 1.0),
        ("Directional(irradiance: Lux(683))", 1.0),
        ("Environment(radiance: Nits(683))", 1.0),
    ];
    for (text, expected) in watts {
        let found = light(text);
        assert!((found.luminance() / expected - 1.0).abs() < 1e-5, "{text}: {found:?}");
    }
    let [warm, tint] =
        ["Point(power_w: Lumens(800, Kelvin(2700)))", "Point(power_w: Kelvin(2700))"].map(light);
    assert!((warm.r / warm.g - tint.r / tint.g).abs() < 1e-5, "{warm:?} {tint:?}");
    let material = read("(entities: [(material: (emission: Nits(683)))])").unwrap();
    let Material::BlinnPhong(paint) = &material.assets.materials[1].material else { panic!("a paint") };
    assert_eq!(paint.emission, ColorInput::Constant(Rgb::WHITE));
}
