//! The contract: the same scene and options give the same film, bit for bit, for every schedule, wave size, instruction
//! set, tile size, number of threads and split.

use rayfront::compile::compile;
use rayfront::internals::film::{Film, Region};
use rayfront::internals::integrator::{RayCounts, Schedule, Sorting};
use rayfront::internals::simd::Isa;
use rayfront::render::{Options, Session};
use rayfront::world::{Sharing, Transport, World};

use crate::support;

/// Every kind of shape, flat and smooth, as single copies and instances, mirrored and stretched, under lights without
/// an area.
pub const SHAPES: &str = r#"(
    settings: (size: (24, 18), samples: 4, background: Gradient(bottom: 0.1, top: (0.3, 0.5, 0.9)), ambient: 0.02,
               copied_triangles: 0),
    materials: {
        "paper": (diffuse: Image("noise.png"), specular: 0.2, shininess: 40),
        "phong": (diffuse: (0.7, 0.3, 0.1), specular: (0.5, 0.6, 0.7), shininess: 12.5, highlight: Phong, kr: 0.2),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 55), transform: LookAt(from: (0.3, 2, 6), to: (0, 0.3, 0))),
        (shape: Sphere(radius_m: 0.7), material: "phong", transform: (translate: (-1.5, 0.7, 0.5))),
        (shape: Sphere(radius_m: 0.5), material: "paper",
         transform: (translate: (1.4, 0.6, 1), rotate_degrees: (20, 50, 10), scale: (1.5, 0.8, 0.5))),
        (shape: Sphere, transform: (translate: (2.4, 1.2, -1), scale: (0.4, -0.9, 0.4))),
        (shape: Triangle(vertices: ((-3, 0, -1), (-1, 0, -2), (-2, 2.5, -1.5)),
                         normals: ((-0.3, 0, 1), (0.3, 0, 1), (0, 0.5, 1)), uvs: ((0, 0), (1, 0), (0.5, 1))),
         material: "paper"),
        (shape: Plane(corners: ((-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4))), material: "paper"),
        (shape: Mesh("bowl.ply"), material: (kr: 0.3), transform: (translate: (0, 0.2, 1.5), scale: 0.6)),
        (shape: Mesh("tetrahedron.ply"), material: (diffuse: Image("quarters.png")),
         transform: (translate: (0.2, 1, -1), rotate_degrees: (10, 30, 0), scale: 0.6)),
        (shape: Mesh("tetrahedron.ply"), transform: (translate: (1.5, 1.8, -2), scale: (-0.5, 0.7, 0.5))),
        (shape: Mesh("tetrahedron.ply"), transform: (translate: (-0.6, 2, -2), rotate_degrees: (0, 0, 45), scale: 0.4)),
        (light: Point(power_w: (150, 140, 130)), transform: (translate: (1, 4, 3))),
        (light: Point(power_w: 0.8, falloff: Constant), transform: (translate: (-4, 3, 0))),
        (light: Spot(power_w: (300, 100, 50), inner_degrees: 10, outer_degrees: 35, edge: Smoothstep, radius_m: 0.2),
         transform: LookAt(from: (-2, 4, 3), to: (0, 0, 0))),
        (light: Directional(irradiance: (0.2, 0.25, 0.3)), transform: LookAt(from: (1, 2, 0.5), to: (0, 0, 0))),
    ],
)"#;

/// Glass within glass within glass, below a water surface with total internal reflection, at a high depth.
pub const GLASS: &str = r#"(
    settings: (size: (24, 18), samples: 4, max_depth: 256, min_throughput: 0.004, filter: Gaussian(radius: 1.2),
               copied_triangles: 0,
               background: Gradient(bottom: (0.9, 0.4, 0.1), top: (0.1, 0.3, 0.9))),
    materials: {
        "glass": (ior: 1.5), "water": (ior: 1.33, kt: (0.8, 0.9, 1), specular: 0.3),
        "diamond": (ior: 2.4, kr: (1, 0.9, 0.8)), "bubble": (ior: 0.6),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 0.5, 5), to: (0, 0, 0))),
        (shape: Sphere(radius_m: 1.2), material: "glass"),
        (shape: Sphere(radius_m: 0.8), material: "water", transform: (translate: (0.1, 0, 0))),
        (shape: Sphere(radius_m: 0.4), material: "bubble", transform: (translate: (0.2, 0.1, 0.1))),
        (shape: Mesh("tetrahedron.ply"), material: "diamond", transform: (translate: (-0.1, -0.3, 0), scale: 0.2)),
        (shape: Mesh("tetrahedron.ply"), material: "diamond", transform: (translate: (1.6, 0.5, 0.5), scale: 0.5)),
        (shape: Sphere(radius_m: 0.6), material: "glass", transform: (translate: (-1.6, -0.4, 0), scale: (1, 0.5, 1))),
        (shape: Plane(corners: ((-6, -1, -6), (6, -1, -6), (6, -1, 6), (-6, -1, 6))), material: "water"),
        (shape: Plane(corners: ((-6, -2, -6), (6, -2, -6), (6, -2, 6), (-6, -2, 6))),
         material: (diffuse: Image("noise.png"))),
        (light: Point(power_w: 200), transform: (translate: (2, 3, 2))),
    ],
)"#;

/// Nested bodies that scatter light, with every kind of boundary.
const MEDIA: &str = r#"(
    settings: (size: (24, 18), samples: 4, transport: Path, background: (0.5, 0.7, 1)),
    entities: [
        (camera: Pinhole, transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
        (light: Point(power_w: 100), transform: (translate: (2, 3, 1))),
        (shape: Sphere(radius_m: 1), transform: (translate: (-0.8, 0, 0)),
         material: Principled(metallic: 0, roughness: 0.3, diffuse_transmission: 1,
                              volume: (attenuation_color: (0.5, 0.2, 0.05), attenuation_distance_m: 0.05,
                                       multiscatter_color: (0.9, 0.6, 0.4)))),
        (shape: Sphere(radius_m: 0.8), transform: (translate: (0.8, 0, 0)),
         material: Principled(metallic: 0, roughness: 0.2, transmission: 1,
                              volume: (attenuation_color: (0.5, 0.6, 0.8), attenuation_distance_m: 0.3,
                                       multiscatter_color: 0.9, scatter_anisotropy: 0.7))),
        (shape: Sphere(radius_m: 0.2), transform: (translate: (0.8, 0, 0)), material: (diffuse: (0.8, 0.1, 0.1))),
        (shape: Mesh("tetrahedron.ply"), transform: (translate: (0, -0.8, 1), scale: 0.4),
         material: Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1,
                              volume: (attenuation_color: (0.5, 1, 0.8), attenuation_distance_m: 0.1))),
    ],
)"#;

/// Panes of all kinds in front of lights of all kinds, in nested fog around the camera.
const WINDOWS: &str = r#"(
    settings: (size: (24, 18), samples: 4, transport: Path, background: (0.1, 0.2, 0.4), copied_triangles: 0),
    materials: {
        "pane": Principled(metallic: 0, roughness: 0, transmission: 1, base_color: (0.9, 0.7, 0.8)),
        "milky": Principled(metallic: 0, roughness: 0, transmission: 0.6, base_color: 0.9, clearcoat: 0.5),
        "here and there": Principled(metallic: 0, roughness: Texture(image: "noise.png", filter: Nearest),
                                     transmission: Image("noise.png"), base_color: Image("noise.png"), alpha: 0.6,
                                     alpha_mode: Blend),
        "fog": Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1,
                          volume: (attenuation_color: (0.9, 0.8, 0.7), attenuation_distance_m: 3,
                                   multiscatter_color: 0.9, scatter_anisotropy: 0.4)),
        "smoke": Principled(metallic: 0, roughness: 0, ior: 1, transmission: 1, base_color: (0.8, 0.9, 1),
                            volume: (attenuation_color: (0.2, 0.3, 0.5), attenuation_distance_m: 1,
                                     multiscatter_color: (0.4, 0.5, 0.6))),
    },
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 55), transform: LookAt(from: (0.3, 2, 6), to: (0, 0.3, 0))),
        (shape: Sphere(radius_m: 7), material: "fog"), // around the camera
        (shape: Sphere(radius_m: 0.8), material: "smoke", transform: (translate: (-1.5, 0.9, 1))),
        (shape: Mesh("cube.ply"), material: "smoke", transform: (translate: (-0.9, 0.6, 1), rotate_degrees: (20, 30, 0))),
        (shape: Plane(corners: ((-4, 0, 4), (4, 0, 4), (4, 0, -4), (-4, 0, -4))), material: (diffuse: 0.7)),
        (shape: Sphere(radius_m: 0.5), transform: (translate: (1, 0.5, 0)), material: (diffuse: (0.8, 0.3, 0.1), specular: 0.4)),
        (shape: Sphere(radius_m: 0.3), transform: (translate: (2, 0.4, 1)), material: (ior: 1.5)),
        (shape: Plane(corners: ((-2, 0, -1), (3, 0, -1), (3, 3, -1), (-2, 3, -1))), material: "pane"),
        (shape: Plane(corners: ((-3, 1.5, -3), (3, 1.5, -3), (3, 1.5, 3), (-3, 1.5, 3))), material: "milky"),
        (shape: Mesh("bowl.ply"), transform: (translate: (0.8, 1, 1), scale: 0.8), material: "here and there"),
        (shape: Mesh("bowl.ply"), transform: (translate: (-0.5, 0.4, 2), scale: (-0.6, 0.8, 0.6)), material: "pane"),
        (light: Point(power_w: 60), transform: (translate: (1, 4, -2))),
        (light: Area(power_w: 60, size_m: 1, visible: true), transform: LookAt(from: (-1, 3, -3), to: (0, 0, 0))),
        (light: Directional(irradiance: 0.7), transform: LookAt(from: (1, 3, 2), to: (0, 0, 0))),
        (light: Environment(image: "floats.hdr")),
    ],
)"#;

/// Variant with the camera in air, where paths can be reused.
pub fn windows_in_air() -> String {
    let without = |line: &&str| !line.contains("// around the camera");
    WINDOWS.lines().filter(without).collect::<Vec<_>>().join("\n")
}

/// Facing mirrors with textured weights, through a lens, under area lights with several samples.
pub const MIRRORS: &str = r#"(
    settings: (size: (24, 18), samples: 4, max_depth: 20, filter: Tent(radius: 1.25)),
    materials: {
        "mirror": (diffuse: 0.05, kr: Texture(image: "floats.hdr", filter: Nearest, factor: (0.6, 0.6, 0.45))),
        "wall": (diffuse: Texture(image: "noise.png", scale: (3, 2), offset: (0.3, -0.2), wrap: Mirror)),
    },
    entities: [
        (camera: ThinLens(vertical_fov_degrees: 50, lens_radius_m: 0.15, focus_distance_m: 4),
         transform: LookAt(from: (0.4, 1.2, 3.5), to: (0, 1, 0))),
        (shape: Plane(corners: ((-2, 3, -2), (-2, 3, 4), (-2, 0, 4), (-2, 0, -2))), material: "mirror"),
        (shape: Plane(corners: ((2, 3, 4), (2, 3, -2), (2, 0, -2), (2, 0, 4))), material: "mirror"),
        (shape: Plane(corners: ((-2, 0, -2), (2, 0, -2), (2, 0, 4), (-2, 0, 4))), material: "wall"),
        (shape: Sphere(radius_m: 0.5), material: (kr: 0.9, diffuse: 0), transform: (translate: (0, 0.5, 0))),
        (shape: Mesh("ball.ply"), material: "wall", transform: (translate: (1, 0.4, 1), scale: 0.4)),
        (light: Area(power_w: (60, 50, 40), size_m: (1, 0.7), samples: 3, pattern: Uniform),
         transform: LookAt(from: (-0.5, 2.9, 0), to: (-0.5, 0, 0), up: (0, 0, -1))),
        (light: Area(power_w: 40, size_m: 0.8, samples: 5, visible: true),
         transform: LookAt(from: (0.5, 2.5, -1.9), to: (0, 0.5, 1))),
        (light: Area(power_w: 10, size_m: 0.5, samples: 4, pattern: Regular),
         transform: (translate: (0, 1.5, 3.9))),
    ],
)"#;

/// Every kind of texture lookup in an orthographic view, and emission.
const TEXTURES: &str = r#"(
    settings: (size: (24, 18), samples: 4, filter: Box, pixel_pattern: Uniform, ambient: 0.3),
    entities: [
        (camera: Orthographic(height_m: 3), transform: (translate: (0, 0, 5))),
        (shape: Plane(corners: ((-2, 1.5, 0), (-0.7, 1.5, 0), (-0.7, 0, 0), (-2, 0, 0))),
         material: (diffuse: Texture(image: "noise.png", scale: 2.5, offset: (-0.8, 0.3), wrap: Repeat))),
        (shape: Plane(corners: ((-0.7, 1.5, 0), (0.7, 1.5, 0), (0.7, 0, 0), (-0.7, 0, 0))),
         material: (diffuse: Texture(image: "noise.png", scale: 2.5, offset: (-0.8, 0.3), wrap: (Clamp, Mirror),
                                     color_space: Linear))),
        (shape: Plane(corners: ((0.7, 1.5, 0), (2, 1.5, 0), (2, 0, 0), (0.7, 0, 0))),
         material: (diffuse: Texture(image: "floats.hdr", scale: 3, wrap: (Mirror, Clamp)))),
        (shape: Plane(corners: ((-2, 0, 0), (-0.7, 0, 0.5), (-0.7, -1.5, 0.5), (-2, -1.5, 0))),
         material: (specular: Texture(image: "noise.png", filter: Nearest), shininess: 3)),
        (shape: Plane(corners: ((-0.7, 0, 0), (0.7, 0, 0), (0.7, -1.5, 0), (-0.7, -1.5, 0))),
         material: (emission: Texture(image: "floats.hdr", filter: Nearest, scale: -2, wrap: Repeat))),
        (shape: Sphere(radius_m: 0.7), material: (diffuse: Texture(image: "quarters.png", scale: (4, 2), wrap: Clamp)),
         transform: (translate: (1.3, -0.8, 1))),
        (light: Directional(irradiance: 0.7), transform: LookAt(from: (1, 1, 3), to: (0, 0, 0))),
    ],
)"#;

/// Every procedural texture, in all spaces and uses, on spheres, copies and instances.
const PROCEDURES: &str = r#"(
    settings: (size: (24, 18), samples: 4, transport: Path, max_depth: 3, copied_triangles: 0),
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 50), transform: LookAt(from: (0, 1.5, 5), to: (0, 0.4, 0))),
        (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))),
         material: (diffuse: Checker(scale: 30, a: Bricks(scale: 90), b: Image("noise.png")))),
        (shape: Sphere(radius_m: 0.6), transform: (translate: (-1.6, 0.6, 0)),
         material: Principled(base_color: Marble(scale: 2), roughness: Noise(scale: 9, kind: Ridged), metallic: 0,
                              bump: (texture: Noise(scale: 7), height_m: 0.03))),
        (shape: Sphere(radius_m: 0.6), transform: (translate: (0, 0.8, 0), scale: (1, 1.3, 0.7)),
         material: Principled(base_color: Wood(scale: 5, rotate_degrees: (80, 0, 10)), metallic: Voronoi(kind: Cells))),
        (shape: Mesh("ball.ply"), transform: (translate: (1.5, 0.7, 0.4), scale: 0.6),
         material: Principled(alpha: Noise(scale: 4, kind: Turbulence), alpha_mode: Blend, double_sided: true,
                              base_color: Mix(a: (1, 0.2, 0.1), b: Voronoi(kind: Edges, scale: 3), by: Gradient(space: Object)))),
        (shape: Mesh("ball.ply"), transform: (translate: (0.6, 1.8, -0.5), scale: 0.3),
         material: Principled(base_color: 0, emission: Curve(of: Subtract(a: 1, b: Noise(scale: 3)),
                              stops: [(0, 0), (0.5, (4, 2, 1)), (1, 9)]))),
        (light: Point(power_w: 200), transform: (translate: (2, 4, 3))),
    ],
)"#;

/// A lens with independent samples, a regular grid over the pixel, and a spotlight.
const LENS: &str = r#"(
    settings: (size: (24, 18), samples: 4, filter: BlackmanHarris(radius: 2), pixel_pattern: Regular, seed: 77,
               background: 0.05),
    entities: [
        (camera: ThinLens(vertical_fov_degrees: 60, lens_radius_m: 0.3, focus_distance_m: 2, pattern: Uniform),
         transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
        (shape: Mesh("ball.ply"), material: (diffuse: (0.2, 0.5, 0.8), specular: 0.4, shininess: 0)),
        (shape: Mesh("ball.ply"), material: (ior: 1.4), transform: (translate: (0.8, 0.5, 2), scale: (0.5, -0.5, 0.3))),
        (shape: Mesh("bowl.ply"), transform: (translate: (0, -1.5, 0), scale: 3)),
        (light: Spot(power_w: 500, inner_degrees: 30, outer_degrees: 30), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

struct Rendered {
    film: Film,
    rays: RayCounts,
}

/// Renders `passes` of the given numbers of samples, and the rest in one more.
fn render(world: &World, options: Options, threads: usize, passes: &[u32]) -> Rendered {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        let mut session = Session::new(compile(world, None).expect("a scene"), &world.settings, options);
        for pass in passes {
            session.advance(*pass);
        }
        session.advance(u32::MAX);
        assert!(session.is_done());
        Rendered { film: session.film().clone(), rays: session.statistics().rays }
    })
}

/// Checks that most pixels differ and have all their samples.
fn is_worth_comparing(film: &Film) {
    let pixels: std::collections::HashSet<_> =
        film.radiance().iter().map(|p| p.to_array().map(f32::to_bits)).collect();
    assert!(pixels.len() > film.pixels().len() / 3, "only {} different pixels", pixels.len());
    assert!(film.pixels().iter().all(|pixel| pixel.count == [2, 2]));
}

/// Checks both transports, with and without path reuse.
fn check(text: &str) {
    let path = [Sharing::Off, Sharing::Auto, Sharing::Groups(32)].map(|sharing| (Transport::Path, sharing));
    for (transport, sharing) in [(Transport::Whitted, Sharing::Off)].into_iter().chain(path) {
        let world = || {
            let mut world = support::world(text);
            (world.settings.transport, world.settings.sharing) = (transport, sharing);
            world
        };
        check_world(&world);
    }
}

/// Checks that a world's film is the same in all ways to render.
pub fn check_world(made: &dyn Fn() -> World) {
    let world = made();
    let base = Options { isa: Isa::PORTABLE, schedule: Schedule::Recursive, ..Options::default() };
    let expected = render(&world, base, 1, &[]);
    is_worth_comparing(&expected.film);

    let equal = |options: Options, threads: usize, passes: &[u32]| {
        let got = render(&world, options, threads, passes);
        assert_eq!(
            got.film.hash(),
            expected.film.hash(),
            "{options:?}, {threads} threads, passes {passes:?}"
        );
        assert_eq!(got.film, expected.film);
        assert_eq!(got.rays, expected.rays, "{options:?}");
    };
    for schedule in [Schedule::Wavefront, Schedule::Recursive] {
        for isa in Isa::available() {
            equal(Options { schedule, isa, ..Options::default() }, 1, &[]);
        }
        for threads in [2, 5] {
            equal(Options { schedule, tile: 8, ..Options::default() }, threads, &[]);
        }
        for passes in [&[1, 1, 2][..], &[3]] {
            equal(Options { schedule, tile: 1000, ..Options::default() }, 2, passes);
        }
        parts_make_the_whole(&world, Options { schedule, ..Options::default() }, &expected.film);
    }
    for wave in [1, 7, 64] {
        equal(Options { wave, ..Options::default() }, 1, &[]);
        equal(Options { wave, sorting: Sorting::Unsorted, ..Options::default() }, 1, &[]);
        equal(Options { wave, tile: 8, isa: Isa::PORTABLE, ..Options::default() }, 2, &[2]);
        let traversal = Some(Isa::detect());
        equal(Options { wave, isa: Isa::PORTABLE, traversal, ..Options::default() }, 1, &[]);
    }
    equal(Options { variance: true, ..Options::default() }, 1, &[]);

    let mut other = made();
    other.settings.seed += 1;
    let other = render(&other, base, 1, &[]);
    assert_ne!(other.film.hash(), expected.film.hash(), "another seed, the same film");
}

/// Checks that films of ranges of samples merge to the whole, and that a crop equals that part of the whole.
fn parts_make_the_whole(world: &World, options: Options, expected: &Film) {
    let mut merged = Film::new(Region::whole(world.settings.size), expected.unit());
    for range in [2..4, 0..1, 1..2] {
        let session = Session::new(compile(world, None).expect("a scene"), &world.settings, options);
        let mut session = session.with_samples(range);
        session.advance(u32::MAX);
        assert_ne!(session.film(), expected);
        merged.merge(session.film());
    }
    assert_eq!(&merged, expected, "{options:?}, ranges of samples");

    let crop = Region { x0: 5, y0: 3, x1: 18, y1: 16 };
    let part = render(world, Options { region: Some(crop), tile: 8, ..options }, 2, &[]).film;
    for y in crop.y0..crop.y1 {
        for x in crop.x0..crop.x1 {
            let there = expected.pixels()[expected.region().index(x, y)];
            assert_eq!(part.pixels()[crop.index(x, y)], there, "{options:?}, pixel {x} {y}");
        }
    }
}

#[test]
fn shapes_render_identically_in_all_ways() {
    check(SHAPES);
}

#[test]
fn glass_renders_identically_in_all_ways() {
    check(GLASS);
}

#[test]
fn media_render_identically_in_all_ways() {
    check(MEDIA);
}

/// Nested bodies, some of which touch or overlap, in fog.
fn nested() -> String {
    let drink = crate::nested::DRINK;
    format!(
        "(
    settings: (size: (24, 18), samples: 4, max_depth: 14),
    entities: [
        (camera: ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.05, focus_distance_m: 3),
         transform: LookAt(from: (0, 0.7, 3.5), to: (0, 0, 0))),
        {drink}
        (shape: Mesh(\"cube.ply\"), transform: (translate: (1.5, 0, 0)), material: Principled(metallic: 0, roughness: 0.2,
         transmission: 1, ior: 1.6, dispersion: 3, volume: ())),
        (shape: Mesh(\"cube.ply\"), transform: (translate: (1.5, 1, 0)), material: Principled(metallic: 0, roughness: 0,
         transmission: 1, ior: 1.33, volume: (attenuation_color: (0.5, 0.7, 0.9), attenuation_distance_m: 1))),
        (shape: Sphere(radius_m: 0.3), transform: (translate: (1.5, 0.5, 0)), material: Principled(metallic: 0,
         roughness: 0.1, base_color: (0.7, 0.2, 0.1), clearcoat: 0.5)),
        (shape: Sphere(radius_m: 9), material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1,
         volume: (attenuation_color: 0.6, attenuation_distance_m: 5, multiscatter_color: 0.7, priority: -1))),
        (shape: Plane(corners: ((1.2, 1.4, 0.4), (1.8, 1.4, 0.4), (1.8, 0.6, 0.4), (1.2, 0.6, 0.4))),
         material: Principled(metallic: 0, roughness: 0, transmission: 1, base_color: (0.9, 0.8, 0.7))),
        (shape: Plane(corners: ((1.2, 0.6, -0.4), (1.8, 0.6, -0.4), (1.8, 0.6, 0.4), (1.2, 0.6, 0.4))),
         material: (diffuse: 0.6)),
        (light: Area(power_w: 3, size_m: 0.1, visible: true), transform: LookAt(from: (1.4, 1.4, 0.45), to: (1.5, 1, 0))),
        (shape: Plane(corners: ((-4, -1, 4), (4, -1, 4), (4, -1, -4), (-4, -1, -4)))),
        (light: Area(power_w: 300, size_m: 1, visible: true),
         transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
        (light: Point(power_w: 100), transform: (translate: (-2, 3, 1))),
    ],
)"
    )
}

#[test]
fn nested_bodies_render_identically_in_all_ways() {
    check(&nested());
}

#[test]
fn windows_render_identically_in_all_ways() {
    check(WINDOWS);
    check(&windows_in_air());
}

#[test]
fn mirrors_render_identically_in_all_ways() {
    check(MIRRORS);
}

#[test]
fn textures_render_identically_in_all_ways() {
    check(TEXTURES);
}

#[test]
fn procedural_textures_render_identically_in_all_ways() {
    check(PROCEDURES);
}

#[test]
fn lens_renders_identically_in_all_ways() {
    check(LENS);
}

/// Every other camera, before glass that sends photons: two eyes, points of the image that see nothing, both ends of a
/// panorama.
#[test]
fn cameras_of_all_kinds_render_identically_in_all_ways() {
    let cameras = [
        "camera: Panorama(), stereo: (layout: OverUnder)",
        "camera: Fisheye(fov_degrees: 200, mapping: Equisolid)",
        "camera: Photographic(focal_length_mm: 24, f_stop: 0.3, shift: (0.1, 0.2)), focus_on: \"ball\", stereo: (convergence_m: 4)",
    ];
    for camera in cameras {
        let text = format!(
            r#"(
    settings: (size: (24, 18), samples: 4, transport: Path, caustics: (photons: 1), background: Gradient(bottom: 0.1, top: (0.3, 0.5, 0.9))),
    entities: [
        ({camera}, transform: LookAt(from: (0.3, 2, 4), to: (0, 0.3, 0))),
        (name: "ball", shape: Sphere(radius_m: 0.7), material: (ior: 1.5), transform: (translate: (-0.5, 0.8, 0.5))),
        (shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))), material: (diffuse: Image("noise.png"))),
        (shape: Plane(corners: ((-9, 0, 6), (9, 0, 6), (9, 9, 6), (-9, 9, 6))), material: (diffuse: (0.7, 0.4, 0.2))),
        (shape: Mesh("tetrahedron.ply"), transform: (translate: (1.5, 0.6, 1)), material: Metal(name: "iron", roughness: 0.4)),
        (light: Area(power_w: 100, size_m: 0.5, visible: true), transform: LookAt(from: (-1, 4, 2), to: (0, 0, 0))),
    ],
)"#
        );
        check_world(&|| support::world(&text));
    }
}

/// All rays of the glass scene down to a tiny throughput: forks outgrow the wave and are deferred.
#[test]
fn forks_that_outgrow_the_wave_give_the_same_film() {
    let mut world = support::world(GLASS);
    world.settings.size = [6, 4];
    world.settings.samples = 1;
    world.settings.min_throughput = 1e-6;
    let options = |schedule, wave| Options { schedule, wave, ..Options::default() };
    let expected = render(&world, options(Schedule::Recursive, 1), 1, &[]);
    for wave in [1, 7, 64, 4096] {
        let session = support::session(&world, options(Schedule::Wavefront, wave));
        assert_eq!(session.film().hash(), expected.film.hash(), "wave {wave}");
        assert_eq!(session.statistics().rays, expected.rays);
        assert!(wave > 7 || session.statistics().spilled > 0, "wave {wave} never spilled");
    }
}
