//! Nested, touching and overlapping bodies: refraction depends on the media on both sides of a surface.

use std::f64::consts::PI;

use crate::support::{Picture, mean_rgb, picture};

/// A slab of some index across the view, between two points of the axis.
fn slab(ior: f64, from: f64, to: f64, priority: i32) -> String {
    format!(
        "(shape: Mesh(\"cube.ply\"), transform: (translate: (0, 0, {}), scale: (900, 900, {})),
          material: (ior: {ior}, priority: {priority})),",
        (from + to) / 2.0,
        to - from
    )
}

const TRANSPORTS: [&str; 2] = [
    "transport: Whitted, max_depth: 30, min_throughput: 0.00001, samples: 1",
    "transport: Path, max_depth: 60, samples: 512",
];

/// The fraction of a white surface's light that passes slabs at an angle in degrees.
fn transmittance(transport: &str, slabs: &str, degrees: f64) -> f64 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let text = format!(
        "(settings: (size: (4, 4), {transport}, filter: Box, sharing: Off, roulette_depth: None),
          entities: [
              (camera: Orthographic(height_m: 0.1), transform: LookAt(from: ({}, 0, {}), to: (0, 0, 0))),
              (shape: Plane(corners: ((-99, -99, -9), (99, -99, -9), (99, 99, -9), (-99, 99, -9))),
               material: (diffuse: 0, emission: 1)),
              {slabs}
          ])",
        9.0 * sin,
        9.0 * cos
    );
    mean_rgb(&picture(&text))[1]
}

/// The reflectance of a boundary for unpolarised light, for a ray whose angle in air has this sine.
fn reflected(from: f64, to: f64, sine: f64) -> f64 {
    let [a, b] = [from, to].map(|index| (1.0 - (sine / index) * (sine / index)).sqrt());
    let across = (from * a - to * b) / (from * a + to * b);
    let along = (to * a - from * b) / (to * a + from * b);
    (across * across + along * along) / 2.0
}

/// The transmittance of a row of bodies, including all interreflection between their boundaries.
fn through(indices: &[f64], degrees: f64) -> f64 {
    let sine = degrees.to_radians().sin();
    let lost = |pair: &[f64]| {
        let part = reflected(pair[0], pair[1], sine);
        part / (1.0 - part)
    };
    1.0 / (1.0 + indices.windows(2).map(lost).sum::<f64>())
}

const GLASS: f64 = 1.5;
const WATER: f64 = 1.33;

#[test]
fn water_between_panes_transmits_by_fresnels_equations() {
    let panes = |priority| slab(GLASS, -1.5, -0.5, priority) + &slab(GLASS, 0.5, 1.5, priority);
    let touching = [1.0, GLASS, WATER, GLASS, 1.0];
    let apart = [1.0, GLASS, 1.0, WATER, 1.0, GLASS, 1.0];
    assert!((through(&touching, 0.0) - 0.9169).abs() < 1e-4);
    let ways = [
        ("one within the other", slab(GLASS, -1.5, 1.5, 0) + &slab(WATER, -0.5, 0.5, 0), &touching[..]),
        ("water that reaches into its glass", panes(1) + &slab(WATER, -0.6, 0.6, 0), &touching),
        ("water of a low priority", panes(0) + &slab(WATER, -0.7, 0.7, -3), &touching),
        (
            "glass around all, and water that displaces it",
            slab(GLASS, -1.5, 1.5, 1) + &slab(WATER, -0.5, 0.5, 2),
            &touching,
        ),
        ("a shared face", panes(0) + &slab(WATER, -0.5, 0.5, 0), &touching),
        ("a shared face of equal bodies", panes(0) + &slab(GLASS, -0.5, 0.5, 0), &[1.0, GLASS, 1.0]),
        ("a gap", panes(0) + &slab(WATER, -0.49, 0.49, 0), &apart),
        ("nothing but glass", panes(1) + &slab(GLASS, -0.6, 0.6, 0), &[1.0, GLASS, 1.0]),
    ];
    for transport in TRANSPORTS {
        for degrees in [0.0, 45.0] {
            for (what, slabs, indices) in &ways {
                let (found, expected) = (transmittance(transport, slabs, degrees), through(indices, degrees));
                let tolerance = if transport.contains("Path") { 0.006 } else { 0.001 };
                assert!(
                    (found - expected).abs() < tolerance,
                    "{what}, {degrees}°, {transport}: {found}, not {expected}"
                );
            }
        }
    }
}

/// Interfaces that meet in a distant edge: each refracts by the index behind it relative to the one in front.
#[test]
fn interfaces_that_meet_in_an_edge_transmit_by_fresnels_equations() {
    let interface =
        |ior: f64, corners: &str| format!("(shape: Plane(corners: ({corners})), material: (ior: {ior})),");
    let slabs = interface(GLASS, "(-900, -99, 0), (900, -99, 3), (900, 99, 3), (-900, 99, 0)")
        + &interface(WATER / GLASS, "(-900, -99, 0), (900, -99, 0), (900, 99, 0), (-900, 99, 0)")
        + &interface(WATER, "(-900, -99, 0), (-900, 99, 0), (900, 99, -3), (900, -99, -3)");
    for transport in TRANSPORTS {
        for degrees in [0.0, 45.0] {
            let found = transmittance(transport, &slabs, degrees);
            let expected = through(&[1.0, GLASS, WATER, 1.0], degrees);
            let tolerance = if transport.contains("Path") { 0.006 } else { 0.001 };
            assert!((found - expected).abs() < tolerance, "{degrees}°, {transport}: {found}, not {expected}");
        }
    }
}

/// A ball in water, with camera and lights in the water, too.
fn in_water(transport: &str, water: Option<&str>, material: &str) -> Picture {
    let around = water.map_or(String::new(), |volume| {
        format!(
            "(shape: Sphere(radius_m: 60), material: Principled(metallic: 0, roughness: 0, transmission: 1,
                 ior: 1.25, volume: ({volume}))),"
        )
    });
    picture(&format!(
        "(settings: (size: (16, 16), {transport}, filter: Box, sharing: Off),
          entities: [
              (camera: Pinhole(vertical_fov_degrees: 30), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
              (shape: Plane(corners: ((-50, -1, 50), (50, -1, 50), (50, -1, -50), (-50, -1, -50))),
               material: (diffuse: Texture(image: \"noise.png\", scale: 40))),
              (light: Area(power_w: 900, size_m: 6, visible: true),
               transform: LookAt(from: (0, 6, 0), to: (0, 0, 0), up: (1, 0, 0))),
              (shape: Sphere(radius_m: 1), material: {material}),
              {around}
          ])"
    ))
}

/// Only the ratio of two indices matters: in water, everything looks as in air with its index divided by the water's.
/// But the water's surface reflects a hundredth of the light.
#[test]
fn bodies_in_water_look_like_a_smaller_index_in_air() {
    let cases = [
        "ior: IOR, transmission: 1, volume: ()",
        "ior: IOR, transmission: 1, volume: (), roughness: 0.3",
        "ior: IOR, transmission: 1, volume: (attenuation_color: (0.3, 0.6, 0.9), attenuation_distance_m: 1)",
        "ior: IOR, transmission: 0.5, volume: (), base_color: 0.8",
        "ior: IOR, transmission: 1",
        "ior: IOR, base_color: (0.1, 0.2, 0.3)",
        "ior: IOR, base_color: (0.1, 0.2, 0.3), roughness: 0.4, specular: 0.7",
        "ior: IOR, metallic: 0.5, base_color: (0.8, 0.6, 0.3), roughness: 0.2",
        "ior: IOR, transmission: 1, volume: (multiscatter_color: 0.8, attenuation_color: 0.5, attenuation_distance_m: 0.3)",
    ];
    for case in cases {
        for ior in [1.875, 1.0, 1.3] {
            // Opaque materials with the index of air have no specular reflection anywhere.
            if ior == 1.0 && !case.contains("transmission") {
                continue;
            }
            let of = |ior: f64| {
                let has_roughness = case.contains("roughness");
                let smooth = if has_roughness { "" } else { "roughness: 0, " };
                let metallic = if case.contains("metallic") { "" } else { "metallic: 0, " };
                format!("Principled({metallic}{smooth}{})", case.replace("IOR", &ior.to_string()))
            };
            let samples = "transport: Path, samples: 128, max_depth: 8";
            let under = in_water(samples, Some(""), &of(ior));
            let over = in_water(samples, None, &of(ior / 1.25));
            let [under, over] = [mean_rgb(&under), mean_rgb(&over)];
            for (under, over) in under.iter().zip(over) {
                assert!((under / over - 1.01).abs() < 0.02, "{case}, {ior}: {under}, not {over}");
            }
        }
    }
}

/// A glass with water, ice and air in it, some of which overlap.
pub const DRINK: &str = "
    (shape: Sphere(radius_m: 1), material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5,
     volume: (priority: 2))),
    (shape: Sphere(radius_m: 0.9), material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1,
     volume: (priority: 3))),
    (shape: Sphere(radius_m: 0.95), transform: (translate: (0, -0.05, 0)),
     material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.33, volume: (priority: 4))),
    (shape: Mesh(\"cube.ply\"), transform: (translate: (0.3, 0.2, 0.1), rotate_degrees: (20, 30, 40), scale: 0.5),
     material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.31, volume: (priority: 5))),
    (shape: Sphere(radius_m: 0.1), transform: (translate: (0.3, 0.2, 0.1)),
     material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1, volume: (priority: 6))),
    (shape: Sphere(radius_m: 0.2), transform: (translate: (-0.3, -0.2, 0.1)),
     material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1, volume: (priority: 6))),";

#[test]
fn clear_nested_bodies_are_invisible_in_uniform_light() {
    let without =
        DRINK.split("priority: ").enumerate().map(|(i, part)| if i == 0 { part } else { &part[1..] });
    let equal: String = without.collect();
    for transport in
        ["transport: Path, max_depth: 200", "transport: Whitted, max_depth: 60, min_throughput: 0.0001"]
    {
        for drink in [DRINK, &equal] {
            let text = format!(
                "(settings: (size: (8, 8), samples: 4, {transport}, filter: Box, background: 1, sharing: Off,
                             roulette_depth: None),
                  entities: [
                      (camera: Pinhole(vertical_fov_degrees: 25), transform: LookAt(from: (0, 0.5, 5), to: (0, 0, 0))),
                      {drink}
                  ])"
            );
            // Some light is reflected for longer than paths are traced.
            let found = mean_rgb(&picture(&text))[1];
            assert!((found - 1.0).abs() < 0.02, "{transport}: {found}");
        }
    }
}

/// Radiance within a body is n² times that outside, whatever lies between.
#[test]
fn camera_within_bodies_sees_radiance_scaled_by_their_index() {
    let looks = |from: &str| {
        let text = format!(
            "(settings: (size: (8, 8), samples: 16, transport: Path, max_depth: 200, filter: Box, background: 1,
                         roulette_depth: None),
              entities: [
                  (camera: Pinhole, transform: LookAt(from: {from}, to: (0, 5, 0))),
                  {DRINK}
              ])"
        );
        mean_rgb(&picture(&text))[1]
    };
    let places = [
        ("(3, 0, 0)", 1.0),
        ("(0, 0.94, 0)", 1.5),
        ("(0, -0.5, 0)", 1.33),
        ("(0.45, 0.2, 0.1)", 1.31),
        ("(0.3, 0.2, 0.1)", 1.0),
        ("(-0.3, -0.2, 0.1)", 1.0),
    ];
    for (place, index) in places {
        let found = looks(place);
        assert!((found / (index * index) - 1.0).abs() < 0.01, "{place}: {found}, not {}", index * index);
    }
}

/// Light is attenuated by the body that fills each place on its way.
#[test]
fn light_is_absorbed_by_the_body_that_fills_a_place() {
    let body = |from: f64, to: f64, color: f64, priority: i32| {
        format!(
            "(shape: Mesh(\"cube.ply\"), transform: (translate: (0, 0, {}), scale: (9, 9, {})),
              material: Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1,
              volume: (attenuation_color: {color}, attenuation_distance_m: 1, priority: {priority}))),",
            (from + to) / 2.0,
            to - from
        )
    };
    let picture_of = |bodies: &str, what: &str| {
        picture(&format!(
            "(settings: (size: (4, 4), samples: 4, transport: Path, filter: Box, sharing: Off),
              entities: [
                  (camera: Orthographic(height_m: 0.1), transform: LookAt(from: (0, 0, 9), to: (0, 0, 0))),
                  {what} {bodies}
              ])"
        ))
    };
    let far = "(shape: Plane(corners: ((-9, -9, -9), (9, -9, -9), (9, 9, -9), (-9, 9, -9))),
                material: (diffuse: 0, emission: 1)),";
    // The same with rays to a light: light travels in the view direction, and back.
    let lit = "(shape: Plane(corners: ((-9, -9, -9), (9, -9, -9), (9, 9, -9), (-9, 9, -9))), material: (diffuse: 0.5)),
               (light: Directional(irradiance: 1), transform: LookAt(from: (0, 0, 9), to: (0, 0, 0))),";
    let cases = [
        ("within", body(-2.0, 2.0, 0.5, 0) + &body(-1.0, 1.0, 0.8, 0), 0.5 * 0.5 * 0.8 * 0.8),
        ("a hole", body(-2.0, 2.0, 0.5, 0) + &body(-1.0, 1.0, 1.0, 0), 0.5 * 0.5),
        ("hidden", body(-2.0, 2.0, 0.5, 1) + &body(-1.0, 1.0, 0.8, 0), 0.5f64.powi(4)),
        ("overlapping", body(-2.0, 1.0, 0.5, 1) + &body(-1.0, 2.0, 0.8, 0), 0.5f64.powi(3) * 0.8),
        (
            "three",
            body(-3.0, 3.0, 0.9, -5) + &body(-2.0, 1.0, 0.5, 1) + &body(-1.0, 2.0, 0.8, 0),
            0.81 * 0.125 * 0.8,
        ),
    ];
    for (what, bodies, expected) in cases {
        let found = mean_rgb(&picture_of(&bodies, far))[1];
        assert!((found / expected - 1.0).abs() < 1e-3, "{what}: {found}, not {expected}");
        let found = mean_rgb(&picture_of(&bodies, lit))[1] * PI / 0.5;
        assert!((found / (expected * expected) - 1.0).abs() < 1e-3, "{what}, lit: {found}");
    }
}

/// Fog with the index of air within glass: rays to lights do not enter it straight, but paths find the same light.
#[test]
fn fog_within_glass_is_lit_through_the_glass() {
    let scene = |fog: f64| {
        let text = format!(
            "(settings: (size: (8, 8), samples: 1024, transport: Path, filter: Box, sharing: Off, max_depth: 30),
              entities: [
                  (camera: Pinhole(vertical_fov_degrees: 25), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0))),
                  (light: Area(power_w: 300, size_m: 8, visible: true),
                   transform: LookAt(from: (0, 4, 0), to: (0, 0, 0), up: (1, 0, 0))),
                  (shape: Sphere(radius_m: 1), material: Principled(metallic: 0, roughness: 0, transmission: 1,
                   volume: ())),
                  (shape: Sphere(radius_m: 0.7), material: Principled(metallic: 0, roughness: 0, ior: {fog},
                   transmission: 1, volume: (attenuation_color: 0.5, attenuation_distance_m: 0.5,
                   multiscatter_color: 0.9))),
              ])"
        );
        mean_rgb(&picture(&text))[1]
    };
    // With an index that differs from that of air, no light is sampled from within.
    let (found, by_chance) = (scene(1.0), scene(1.0001));
    assert!((found / by_chance - 1.0).abs() < 0.02, "{found}, not {by_chance}");
}
