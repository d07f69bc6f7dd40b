//! Parametric shapes as surfaces: rays hit them where they are, they emit light as lamps do, and those that are closed are
//! bodies of glass.

use rayfront::compile::compile;
use rayfront::internals::check::check;
use rayfront::render::Options;
use rayfront::world::{Settings, World};

use crate::support::{Picture, film, mean, world};

const CLOSED: [&str; 10] = [
    "Box(size_m: (1, 1.2, 0.8), bevel_m: 0.1)",
    "Box(size_m: 1)",
    "Cylinder(radius_m: 0.5, height_m: 1)",
    "Cone(radius_m: 0.6, top_radius_m: 0.2, height_m: 1)",
    "Capsule(radius_m: 0.4, height_m: 1.4)",
    "Torus(radius_m: 0.6, tube_radius_m: 0.2)",
    "Prism(outline: [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], holes: [[(-0.2, -0.2), (0.2, -0.2), (0, 0.2)]])",
    "Lathe(curve: CatmullRom, profile: [(0, -0.6), (0.5, -0.5), (0.3, 0), (0.5, 0.6)])",
    "Tube(points: [(-0.6, 0, 0), (0, 0.6, 0), (0.6, 0, 0)], radius_m: [0.2, 0.1, 0.2], ends: Flat)",
    "Tube(points: [(-0.5, 0, 0), (0, 0.5, 0.2), (0.5, 0, 0), (-0.5, 0, 0)], radius_m: 0.1)",
];

fn scene(shape: &str, material: &str, more: &str) -> World {
    world(&format!(
        "(settings: (size: (48, 36), samples: 4, transport: Path), entities: [
            (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 1, 4), to: (0, 0, 0))),
            (name: \"it\", shape: {shape}, material: {material}), {more}])"
    ))
}

#[test]
fn closed_shapes_are_bodies_of_glass_without_findings() {
    const GLASS: &str = "Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: (attenuation_color: 0.5, attenuation_distance_m: 1))";
    for shape in CLOSED {
        let world = scene(shape, GLASS, "(light: Environment(radiance: 1))");
        let compiled = compile(&world, None).unwrap();
        let told: Vec<String> = compiled.warnings.iter().map(ToString::to_string).collect();
        assert!(told.iter().all(|text| text.contains("path transport was chosen")), "{shape}: {told:?}");
        let setup = rayfront::internals::render::setup(compiled, &world.settings);
        let found = check(&world, &setup, true);
        assert!(found.iter().all(|finding| !finding.code.contains("glass")), "{shape}: {found:?}");
    }
}

/// Within a uniform environment, a body of clear glass sends on what comes to it: it cannot be seen.
#[test]
fn clear_bodies_of_glass_vanish_in_a_uniform_environment() {
    const CLEAR: &str = "Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: ())";
    for shape in CLOSED {
        let mut world = scene(shape, CLEAR, "(light: Environment(radiance: 1))");
        (world.settings.max_depth, world.settings.min_throughput) = (256, 0.0);
        let picture = Picture::of(&world);
        let off = picture.pixels.iter().map(|p| (p.r - 1.0).abs()).fold(0.0, f32::max);
        // Shading normals and faces differ where curves are strong.
        assert!((mean(&picture) - 1.0).abs() < 0.01, "{shape}: {}", mean(&picture));
        assert!(off < 1.0, "{shape}: {off}");
    }
}

/// A disc that emits light lights a floor as the area light of the same power does.
#[test]
fn shapes_that_emit_light_are_lamps() {
    let lit = |lamp: &str| {
        let text = format!(
            "(settings: (size: (32, 24), samples: 64, transport: Path), entities: [
                (camera: Pinhole(vertical_fov_degrees: 15), transform: LookAt(from: (0, 3, 6), to: (0, 0, 0))),
                (shape: Grid(size_m: 8), material: (diffuse: 0.5)),
                {lamp}])"
        );
        mean(&Picture::of(&world(&text)))
    };
    let area = std::f64::consts::PI * 0.25;
    let power = area * std::f64::consts::PI * 20.0;
    let lamp = lit(&format!(
        "(light: Area(power_w: {power}, size_m: 1, outline: Disc), transform: (translate: (0, 2, 0), rotate_degrees: (-90, 0, 0)))"
    ));
    let disc = lit(
        "(shape: Disc(radius_m: 0.5), material: Principled(base_color: 0, emission: 20, metallic: 0, specular: 0), transform: (translate: (0, 2, 0), rotate_degrees: (180, 0, 0)))",
    );
    assert!(lamp > 0.05 && (disc / lamp - 1.0).abs() < 0.03, "{disc} {lamp}");
    let world = scene("Tube(points: [(-1, 0, 0), (1, 0, 0)])", "(diffuse: 0, emission: 5)", "");
    assert!(!compile(&world, None).unwrap().emitters.is_empty());
}

/// The lamp is seen from both sides, and the picture of a stretched and mirrored shape is that of its stretched formula.
#[test]
fn stretched_and_mirrored_shapes_cover_the_pixels_of_their_formulas() {
    let text = "(settings: (size: (64, 64), samples: 16, background: 0, pixel_pattern: Regular, filter: Box), entities: [
        (camera: Orthographic(height_m: 4), transform: LookAt(from: (0, 0, 9), to: (0, 0, 0))),
        (shape: Cylinder(radius_m: 0.5, height_m: 1), material: (diffuse: 0, emission: 1),
         transform: (scale: (-3, 1.5, 1), rotate_degrees: (90, 0, 0)))])";
    // Seen along its axis: an ellipse with the half axes 1.5 and 0.5, for the turn comes after the scale.
    let covered = mean(&Picture::of(&world(text))) * 16.0;
    assert!((covered / (std::f64::consts::PI * 1.5 * 0.5) - 1.0).abs() < 0.01, "{covered}");
}

#[test]
fn shapes_have_the_same_bits_as_copies_and_instances_and_in_both_schedules() {
    use rayfront::internals::integrator::Schedule;
    let mut entities = String::new();
    for (number, shape) in CLOSED.iter().enumerate() {
        for copy in 0..2 {
            let [x, y] = [number as f32 - 4.5, copy as f32 * 1.5 - 0.7];
            entities += &format!("(shape: {shape}, transform: (translate: ({x}, {y}, -8), scale: 0.5)),\n");
        }
    }
    let mut world = world(&format!(
        "(settings: (size: (64, 24), samples: 2, transport: Path), entities: [(camera: Pinhole()),
         (light: Environment(radiance: 1)), {entities}])"
    ));
    for copied in [Settings::default().copied_triangles, 0] {
        world.settings.copied_triangles = copied;
        let hash = |schedule| film(&world, Options { schedule, ..Options::default() }).hash();
        assert_eq!(hash(Schedule::Wavefront), hash(Schedule::Recursive));
    }
    assert_eq!(compile(&world, None).unwrap().geometry.instances.len(), 20);
}
