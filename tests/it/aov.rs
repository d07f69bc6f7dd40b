//! Output variables: analytic results, identical bits in all ways to render, and their file.

use std::path::Path;
use std::sync::Arc;

use exr::prelude::*;
use rayfront::compile::compile;
use rayfront::internals::film::{Features, Film, FilmChannel, Moments, Values};
use rayfront::internals::integrator::Schedule;
use rayfront::internals::render::PixelCost;
use rayfront::internals::simd::Isa;
use rayfront::render::{Options, Session, on_threads};
use rayfront::world::{Aov, Sampler, Transport, World};

use crate::support::{self, session};

/// Orthographic view from z = 5, half a metre per pixel: a floating square 2 m wide at z = 1, and in front of its right
/// half a ball of radius 0.5 m at (0.5, 0, 2).
const PLANE_AND_BALL: &str = r#"(
    settings: (size: (8, 8), samples: 4, filter: Box, pixel_pattern: Regular, background: 0.5),
    materials: { "paint": (diffuse: (0.1, 0.2, 0.3), specular: 0.5), "rubber": (diffuse: (0.9, 0.5, 0.1)) },
    entities: [
        (name: "eye", camera: Orthographic(height_m: 4), transform: (translate: (0, 0, 5))),
        (name: "square", shape: Plane(corners: ((-1, 1, 1), (-1, -1, 1), (1, -1, 1), (1, 1, 1))), material: "paint"),
        (name: "ball", shape: Sphere(radius_m: 0.5), material: "rubber", transform: (translate: (0.5, 0, 2))),
        (light: Point(power_w: 100), transform: (translate: (0, 2, 6))),
    ],
)"#;

fn features(world: &World) -> Vec<Features> {
    session(world, Options::default()).features()
}

fn near(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

#[test]
fn features_of_a_plane_and_a_ball_match_analytic_values() {
    for transport in [Transport::Whitted, Transport::Path] {
        let mut world = support::world(PLANE_AND_BALL);
        world.settings.transport = transport;
        // The path transport has no regular pattern; a pixel within the square is uniform.
        let found = features(&world);
        let at = |x: usize, y: usize| found[y * 8 + x];

        assert_eq!(at(0, 0), Features::NOTHING, "past the square");

        let square = at(2, 2);
        assert_eq!((square.coverage, square.depth_m), (1.0, 4.0), "from z = 5 to z = 1");
        assert!(near(square.normal, [0.0, 0.0, 1.0]), "{square:?}");
        assert!(near(square.albedo.to_array(), [0.1, 0.2, 0.3]), "{square:?}");
        assert_eq!(square.position[2], 1.0);
        if transport == Transport::Whitted {
            // Pixel (2, 2) spans x from −1 to −0.5 and y from 0.5 to 1; a regular grid has their mean.
            assert!(near(square.position, [-0.75, 0.75, 1.0]), "{square:?}");
        }
        // Numbers in the order of the file, from 1; material 0 is the default one.
        assert_eq!((square.entity, square.material), (2, 2));

        let ball = at(4, 3);
        assert_eq!((ball.entity, ball.material, ball.coverage), (3, 3, 1.0));
        if transport == Transport::Whitted {
            // Of the four samples, the one at (0.375, 0.375) is more than 0.5 m from the ball's axis and shows the
            // square.
            assert!(near(ball.albedo.to_array(), [0.7, 0.425, 0.15]), "{ball:?}");
        }
    }
}

#[test]
fn normals_of_a_ball_are_its_radii() {
    let mut world = support::world(PLANE_AND_BALL);
    // One sample per pixel, at its centre: pixel (4, 3) is (0.25, 0.25).
    world.settings.samples = 1;
    let ball = features(&world)[3 * 8 + 4];
    let z = (0.25f32 - 2.0 * 0.0625).sqrt();
    assert!(near(ball.normal, [-0.5, 0.5, z / 0.5]), "{ball:?}");
    assert!(near(ball.position, [0.25, 0.25, 2.0 + z]), "{ball:?}");
    assert!((ball.depth_m - (3.0 - z)).abs() < 1e-5, "{ball:?}");
}

#[test]
fn depth_is_along_the_cameras_axis() {
    // 90 degrees wide: rays to the corners are 1.7 times as long as the central one.
    let world = support::world(
        r#"(settings: (size: (9, 9), samples: 4), entities: [
            (camera: ThinLens(vertical_fov_degrees: 90, lens_radius_m: 0.2, focus_distance_m: 3)),
            (shape: Plane(corners: ((-9, 9, -3), (-9, -9, -3), (9, -9, -3), (9, 9, -3)))),
        ])"#,
    );
    for pixel in features(&world) {
        assert!((pixel.depth_m - 3.0).abs() < 1e-5 && pixel.coverage == 1.0, "{pixel:?}");
    }
}

/// The sheet's left half is masked out, its right half has alpha ½.
const CUT_OUT: &str = r#"(
    settings: (size: (8, 4), samples: 256, transport: Path, filter: Box),
    materials: {
        "hole": Principled(alpha: 0.2, alpha_mode: Mask(cutoff: 0.5), double_sided: true, metallic: 0),
        "veil": Principled(alpha: 0.5, alpha_mode: Blend, double_sided: true, metallic: 0, base_color: 0.25),
        "wall": Principled(metallic: 0, base_color: 0.75),
    },
    entities: [
        (camera: Orthographic(height_m: 2), transform: (translate: (0, 0, 5))),
        (shape: Plane(corners: ((-2, 1, 1), (-2, -1, 1), (0, -1, 1), (0, 1, 1))), material: "hole"),
        (shape: Plane(corners: ((0, 1, 1), (0, -1, 1), (2, -1, 1), (2, 1, 1))), material: "veil"),
        (shape: Plane(corners: ((-2, 1, 0), (-2, -1, 0), (2, -1, 0), (2, 1, 0))), material: "wall"),
        (light: Point(power_w: 100), transform: (translate: (0, 2, 6))),
    ],
)"#;

#[test]
fn masked_out_surfaces_have_no_features() {
    let found = features(&support::world(CUT_OUT));
    let (through, veiled) = (found[8 + 1], found[8 + 6]);
    assert_eq!((through.depth_m, through.entity, through.albedo.r), (5.0, 4, 0.75));
    // Half of the samples hit the veil, half the wall behind it, at random.
    assert!((veiled.depth_m - 4.5).abs() < 0.1, "{veiled:?}");
    assert!((veiled.albedo.r - 0.5).abs() < 0.05, "{veiled:?}");
    assert_eq!(veiled.coverage, 1.0);
}

/// Film, features, moments and costs.
type Bits = (Film, Vec<Features>, Moments, Vec<FilmChannel>);

const COSTS: [Aov; 3] = [Aov::Nodes, Aov::Tests, Aov::PathLength];

fn bits(world: &World, options: Options, threads: usize, passes: &[u32]) -> Bits {
    let gather = || {
        let scene = compile(world, None).expect("a scene");
        let mut session = Session::new(scene, &world.settings, Options { variance: true, ..options });
        passes.iter().for_each(|pass| session.advance(*pass));
        session.advance(u32::MAX);
        let moments = session.moments().expect("moments").clone();
        (session.film().clone(), session.features(), moments, session.channels(&COSTS))
    };
    on_threads(threads, gather).expect("threads")
}

#[test]
fn film_features_moments_and_costs_are_identical_in_all_ways() {
    for text in [crate::agreement::SHAPES, crate::agreement::GLASS, crate::agreement::MIRRORS, CUT_OUT] {
        for transport in [Transport::Whitted, Transport::Path] {
            let mut world = support::world(text);
            (world.settings.transport, world.settings.samples) = (transport, 4);
            let simple = Options { schedule: Schedule::Recursive, isa: Isa::PORTABLE, ..Options::default() };
            let expected = bits(&world, simple, 1, &[]);
            assert_eq!(&expected.0, session(&world, simple).film(), "variance changes the film");
            let check = |options: Options, threads, passes: &[u32]| {
                let (film, features, moments, costs) = bits(&world, options, threads, passes);
                assert_eq!(film, expected.0, "{options:?}");
                assert_eq!(features, expected.1, "{options:?}");
                assert_eq!(moments, expected.2, "{options:?}");
                assert_eq!(costs, expected.3, "{options:?}");
            };
            for isa in Isa::available() {
                for schedule in [Schedule::Wavefront, Schedule::Recursive] {
                    check(Options { schedule, isa, ..Options::default() }, 1, &[]);
                }
            }
            for wave in [1, 7, 64] {
                check(Options { wave, tile: 8, ..Options::default() }, 2, &[1, 2]);
            }
        }
    }
}

/// Two mirrors that face each other, and a ball off to the side.
const CORRIDOR: &str = r#"(
    settings: (size: (6, 4), samples: 2, max_depth: 5, filter: Box, pixel_pattern: Regular),
    materials: { "mirror": (diffuse: 0, kr: 1) },
    entities: [
        (camera: Orthographic(height_m: 1), transform: (translate: (0, 0, 2))),
        (shape: Plane(corners: ((-9, 9, 0), (-9, -9, 0), (9, -9, 0), (9, 9, 0))), material: "mirror"),
        (shape: Plane(corners: ((-9, 9, 4), (9, 9, 4), (9, -9, 4), (-9, -9, 4))), material: "mirror"),
        (shape: Sphere(radius_m: 1), transform: (translate: (30, 0, 0))),
        (light: Point(power_w: 100), transform: (translate: (0, 0, 2))),
    ],
)"#;

fn floats(channel: &FilmChannel) -> &[f32] {
    match &channel.values {
        Values::Float(values) => values,
        Values::Whole(_) => panic!("{} holds whole numbers", channel.name),
    }
}

#[test]
fn path_length_between_mirrors_is_that_of_the_depth() {
    for depth in [0, 5] {
        let mut world = support::world(CORRIDOR);
        world.settings.max_depth = depth;
        let channels = session(&world, Options::default()).channels(&[Aov::PathLength, Aov::Tests]);
        let [length, camera, path, shadow] = &channels[..] else { panic!("four channels") };
        assert_eq!((&*length.name, &*camera.name), ("path-length", "tests.camera"));
        assert!(floats(length).iter().all(|rays| *rays == 1.0 + depth as f32), "{length:?}");
        // The two planes are four triangles, and share a leaf; the ball is elsewhere.
        assert!(floats(camera).iter().all(|tests| (2.0..=4.0).contains(tests)), "{camera:?}");
        assert!(floats(path).iter().all(|tests| *tests >= depth as f32), "{path:?}");
        assert_eq!(floats(path).iter().any(|tests| *tests > 0.0), depth > 0, "{path:?}");
        assert!(floats(shadow).iter().all(|tests| *tests == 0.0), "mirrors send no shadow rays: {shadow:?}");
    }
}

#[test]
fn path_lengths_add_up_to_the_rays_of_the_rendering() {
    for text in [crate::agreement::SHAPES, crate::agreement::GLASS, crate::agreement::MIRRORS, CUT_OUT] {
        for transport in [Transport::Whitted, Transport::Path] {
            let mut world = support::world(text);
            (world.settings.transport, world.settings.samples) = (transport, 4);
            let session = session(&world, Options::default());
            let rays = session.statistics().rays;
            let costs = session.costs();
            let sum = |part: &dyn Fn(&PixelCost) -> u64| costs.iter().map(part).sum::<u64>();
            assert_eq!(sum(&|cost| cost.path_rays), rays.camera + rays.reflect + rays.refract + rays.scatter);
            // A tree of one leaf has no node.
            assert!(sum(&|cost| cost.tests[0]) > 0);
        }
    }
}

#[test]
fn features_and_variance_of_a_crop_equal_those_of_the_whole() {
    let world = support::world(crate::agreement::SHAPES);
    let region = rayfront::internals::film::Region { x0: 5, y0: 3, x1: 18, y1: 16 };
    let whole = session(&world, Options { variance: true, ..Options::default() });
    let part =
        session(&world, Options { variance: true, region: Some(region), tile: 8, ..Options::default() });
    let (all, some) = (whole.features(), part.features());
    for y in region.y0..region.y1 {
        for x in region.x0..region.x1 {
            assert_eq!(some[region.index(x, y)], all[whole.film().region().index(x, y)], "pixel {x} {y}");
        }
    }
    let [all, some] = [&whole, &part].map(|s| s.moments().expect("moments").variance_of_mean(s.film()));
    assert_eq!(some[0], all[3 * 24 + 5]);
    assert_eq!(part.costs()[0], whole.costs()[3 * 24 + 5]);
}

/// Returns the mean over all pixels of the estimated variances of 64 renderings, and of the variance over their seeds.
fn variances(text: &str, transport: Transport, sampler: Sampler) -> (f64, f64) {
    const SEEDS: u64 = 64;
    let mut world = support::world(text);
    (world.settings.transport, world.settings.sampler) = (transport, sampler);
    let (mut estimated, mut values) = (0.0, Vec::new());
    for seed in 0..SEEDS {
        world.settings.seed = seed;
        let session = session(&world, Options { variance: true, ..Options::default() });
        let film = session.film();
        let moments = session.moments().expect("moments");
        estimated += moments.variance_of_mean(film).iter().map(|v| f64::from(v.g)).sum::<f64>();
        values.push(film.radiance());
    }
    let (mut over_seeds, pixels) = (0.0, values[0].len());
    for pixel in 0..pixels {
        let own = || values.iter().map(|film| f64::from(film[pixel].g));
        let mean = own().sum::<f64>() / SEEDS as f64;
        over_seeds += own().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (SEEDS - 1) as f64;
    }
    (estimated / (SEEDS as usize * pixels) as f64, over_seeds / pixels as f64)
}

/// A ball with glass in front of it, under a rectangular light, with independent samples.
const NOISY: &str = r#"(
    settings: (size: (12, 10), samples: 16, max_depth: 4, filter: Box, pixel_pattern: Uniform, background: 0.1),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
        (shape: Sphere),
        (shape: Sphere(radius_m: 0.4), material: (ior: 1.5), transform: (translate: (-0.5, 0.5, 2))),
        (shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4)))),
        (light: Area(power_w: 200, size_m: 2, pattern: Uniform), transform: LookAt(from: (2, 3, 2), to: (0, 0, 0))),
    ],
)"#;

#[test]
fn estimated_variance_matches_the_variance_over_seeds() {
    for transport in [Transport::Whitted, Transport::Path] {
        let (estimated, over_seeds) = variances(NOISY, transport, Sampler::Independent);
        let ratio = estimated / over_seeds;
        println!("{transport:?}: estimated {estimated:e}, over seeds {over_seeds:e}, ratio {ratio:.3}");
        assert!((0.9..1.1).contains(&ratio), "{transport:?}: {estimated:e} for {over_seeds:e}");
    }
    // Stratified samples vary as much, but their means less.
    let (estimated, over_seeds) = variances(NOISY, Transport::Path, Sampler::Sobol);
    println!("Sobol: estimated {estimated:e}, over seeds {over_seeds:e}");
    assert!(estimated > over_seeds, "{estimated:e} for {over_seeds:e}");
}

/// The channels of an OpenEXR file, by name.
fn read(path: &Path) -> Vec<(String, FlatSamples)> {
    let image = read_all_flat_layers_from_file(path).expect("an image");
    assert_eq!(image.layer_data.len(), 1);
    let channels = &image.layer_data[0].channel_data.list;
    channels.iter().map(|c| (c.name.to_string(), c.sample_data.clone())).collect()
}

#[test]
fn exr_files_contain_all_output_variables() {
    let folder = tempfile::tempdir().expect("a folder");
    let world = support::world(PLANE_AND_BALL);
    let setup = Arc::new(rayfront::internals::render::setup(
        compile(&world, None).expect("a scene"),
        &world.settings,
    ));
    let options = Options { variance: true, ..Options::default() };
    let mut session = Session::of(setup, world.settings.samples, options);
    session.advance(u32::MAX);
    let radiance = session.film().radiance();
    let channels = session.channels(&Aov::ALL);
    let display = rayfront::internals::film::tonemap::DisplayTransform::new(Default::default(), 0.0, &[]);
    let output = rayfront::internals::formats::picture::Output::plain([8, 8], &radiance, display);
    let output = rayfront::internals::formats::picture::Output { channels: &channels, ..output };
    let path = folder.path().join("a.exr");
    rayfront::internals::formats::picture::save(&path, &output).expect("saving");
    assert_eq!(
        rayfront::internals::formats::picture::load_linear(&path).expect("light"),
        (8, 8, radiance.clone())
    );

    let found = read(&path);
    let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    let expected = [
        "A", "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "coverage.A", "depth.Z", "entity.id",
        "material.id", "nodes.camera", "nodes.path", "nodes.shadow", "normal.X", "normal.Y", "normal.Z",
        "path-length", "position.X", "position.Y", "position.Z", "samples", "tests.camera", "tests.path",
        "tests.shadow", "time", "variance.B", "variance.G", "variance.R",
    ];
    assert_eq!(names, expected);
    for FilmChannel { name, values } in &channels {
        let (_, read) = found.iter().find(|(other, _)| other == name).expect("a channel");
        match (values, read) {
            (Values::Float(values), FlatSamples::F32(read)) => {
                assert_eq!(
                    values.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
                    read.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
                    "{name}"
                );
            }
            (Values::Whole(values), FlatSamples::U32(read)) => assert_eq!(values, read, "{name}"),
            _ => panic!("{name} has another type"),
        }
    }
    let wrong = [FilmChannel { name: "depth.Z".into(), values: Values::Float(vec![0.0; 3]) }];
    let wrong = rayfront::internals::formats::picture::Output { channels: &wrong, ..output };
    let error = rayfront::internals::formats::picture::save(&path, &wrong).unwrap_err().to_string();
    assert!(error.contains("3 values of depth.Z for 64 pixels"), "{error}");
}

#[test]
fn paths_through_glass_take_longer_than_those_that_hit_nothing() {
    let scene = r#"(
        settings: (size: (16, 16), samples: 8, max_depth: 32, transport: Path, background: 0.5),
        entities: [
            (camera: Orthographic(height_m: 2), transform: (translate: (0, 0, 5))),
            (shape: Sphere(radius_m: 0.7), material: (ior: 1.5)),
        ],
    )"#;
    let session = support::session(&support::world(scene), Options::default());
    let channels = session.channels(&[Aov::Time]);
    let Values::Float(times) = &channels[0].values else { panic!("times are floats") };
    assert!(times.iter().all(|time| time.is_finite() && *time > 0.0));
    let square = |from: usize| {
        let mut times: Vec<f32> =
            (0..4).flat_map(|y| times[16 * (from + y) + from..][..4].iter().copied()).collect();
        times.sort_by(f32::total_cmp);
        times[8]
    };
    let (nothing, glass) = (square(0), square(6));
    assert!(glass > 2.0 * nothing, "{glass} µs, {nothing} µs");
}
