//! Materials: ambient light, mirrors and glass.

use super::*;

#[test]
fn ambient_light_emission_and_vertex_colours_add_up() {
    let glow = "(shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9))),
                 material: (kd: (0.5, 0.25, 1), emission: (0.1, 0, 2)))";
    let found = pixel("ambient: (0.2, 0.4, 0.6)", &[ABOVE, glow]);
    for (found, expected) in found.into_iter().zip([0.2, 0.1, 2.6]) {
        near(found, expected, 1e-6);
    }
    // The centre of the tetrahedron's first face has the mean of its corners' colours, (1, .2, .2), (.2, .2, 1) and
    // (.2, 1, .2), and no other reflectance.
    let camera = "(camera: Orthographic(height_m: 1e-4), transform: LookAt(from: (-3, 3, 3), to: (0, 0, 0)))";
    let found = pixel("ambient: 1", &[camera, "(shape: Mesh(\"tetrahedron.ply\"))"]);
    for found in found {
        near(found, 1.4 / 3.0, 1e-5);
    }
}

/// From the origin along −Z onto a mirror that deflects the view to +X.
const INTO_MIRROR: &str = "(camera: Orthographic(height_m: 1e-4))";

#[test]
fn mirrors_reflect_by_the_law_of_reflection() {
    // d = (0, 0, −1), n = (1, 0, 1)/√2: d − 2(d·n)n = (1, 0, 0), from (0, 0, −3).
    let mirror = "(shape: Plane(corners: ((-1, -1, -2), (1, -1, -4), (1, 1, -4), (-1, 1, -2))),
                   material: (kd: 0, kr: (0.5, 0.25, 1)))";
    let lamp = |x: f64| {
        format!(
            "(shape: Plane(corners: (({x}, -0.01, -3.01), ({x}, -0.01, -2.99), ({x}, 0.01, -2.99), ({x}, 0.01, -3.01))),
              material: (kd: 0, emission: 2))"
        )
    };
    assert_eq!(pixel("", &[INTO_MIRROR, mirror, &lamp(4.0)]), [1.0, 0.5, 2.0]);
    assert_eq!(pixel("", &[INTO_MIRROR, mirror, &lamp(-4.0)]), [0.0; 3]);
}

/// Two facing mirrors that emit 1 and reflect ½: the sum over k of 2⁻ᵏ.
const FACING: [&str; 2] = [
    "(shape: Plane(corners: ((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1))), material: (kd: 0, kr: 0.5, emission: 1))",
    "(shape: Plane(corners: ((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1))), material: (kd: 0, kr: 0.5, emission: 1))",
];

#[test]
fn facing_mirrors_stop_at_depth_and_minimum_throughput() {
    let sum = |settings: &str| grey(settings, &["(camera: Pinhole)", FACING[0], FACING[1]]);
    let depth = |depth: u32| sum(&format!("max_depth: {depth}"));
    assert_eq!([depth(0), depth(1), depth(3)], [1.0, 1.5, 1.875]);
    assert_eq!(depth(256), 2.0);
    let least = |throughput: &str| {
        let settings = EXACT.replace("min_throughput: 0", &format!("min_throughput: {throughput}"));
        let text = scene(
            &format!("size: (1, 1), max_depth: 50, {settings}"),
            &["(camera: Pinhole)", FACING[0], FACING[1]],
        );
        picture(&text).at(0, 0).g
    };
    // 0.5 continues, 0.25 does not; a throughput must be above the minimum.
    assert_eq!(least("0.3"), 1.5);
    assert_eq!(least("0.5"), 1.0);
}

/// A slab of glass (n = 1.5) from y = 0 to 1, normals outwards.
const SLAB: [&str; 2] = [
    "(shape: Plane(corners: ((-9, 1, -9), (-9, 1, 9), (9, 1, 9), (9, 1, -9))), material: (ior: 1.5))",
    "(shape: Plane(corners: ((-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9))), material: (ior: 1.5))",
];

#[test]
fn glass_transmits_96_percent_at_each_face() {
    // Fresnel at normal incidence: ((1.5 − 1)/(1.5 + 1))² = 0.04. The plane below the slab emits 100.
    let lamp = "(shape: Plane(corners: ((-9, -1, -9), (9, -1, -9), (9, -1, 9), (-9, -1, 9))), material: (kd: 0, emission: 100))";
    let depth = |depth: u32| grey(&format!("max_depth: {depth}"), &[ABOVE, SLAB[0], SLAB[1], lamp]);
    assert_eq!([depth(0), depth(1)], [0.0, 0.0]);
    let straight = 100.0 * 0.96 * 0.96;
    near(depth(2), straight, 1e-5);
    near(depth(3), straight, 1e-5);
    // With one reflection back and forth within the slab.
    near(depth(4), straight * (1.0 + 0.04 * 0.04), 1e-6);
    assert!(depth(4) > depth(3));
    // Also the reflection: a sky of 10 above, 4 % of it at the first face; light from below does not arrive.
    near(grey("max_depth: 1, background: 10", &[ABOVE, SLAB[0], SLAB[1], lamp]), 0.4, 1e-5);
}

#[test]
fn slabs_shift_the_view_by_snells_law() {
    // At 45°: sin θt = sin 45° / 1.5. From (0, 1) to (tan θt, 0), on to (tan θt + 1, −1).
    let sin_t = 0.5f64.sqrt() / 1.5;
    let place = sin_t / (1.0 - sin_t * sin_t).sqrt() + 1.0;
    // Fresnel: across ((cos i − n cos t)/(cos i + n cos t))², along ((n cos i − cos t)/(n cos i + cos t))².
    let (cos_i, cos_t) = (0.5f64.sqrt(), (1.0 - sin_t * sin_t).sqrt());
    let across = (cos_i - 1.5 * cos_t) / (cos_i + 1.5 * cos_t);
    let along = (1.5 * cos_i - cos_t) / (1.5 * cos_i + cos_t);
    let passes = 1.0 - (across * across + along * along) / 2.0;
    let camera = "(camera: Orthographic(height_m: 1e-5), transform: LookAt(from: (-2, 3, 0), to: (0, 1, 0)))";
    let up_to = |x: f64| {
        let lamp = format!(
            "(shape: Plane(corners: ((-9, -1, -9), ({x}, -1, -9), ({x}, -1, 9), (-9, -1, 9))), material: (kd: 0, emission: 1))"
        );
        grey("max_depth: 2", &[camera, SLAB[0], SLAB[1], &lamp])
    };
    assert_eq!(up_to(place - 2e-5), 0.0);
    near(up_to(place + 2e-5), passes * passes, 1e-5);
}

#[test]
fn total_internal_reflection_begins_at_the_critical_angle() {
    // From within the slab at 60° (critical: 41.8°) onto its top: the reflection of an emitter is complete, and none of
    // the bright sky is visible.
    let camera =
        "(camera: Orthographic(height_m: 1e-5), transform: LookAt(from: (0, 0.5, 0), to: (0.8660254, 1, 0)))";
    let lamp = "(shape: Plane(corners: ((1.2, 0.1, -9), (1.2, 0.9, -9), (1.2, 0.9, 9), (1.2, 0.1, 9))), material: (kd: 0, emission: 3))";
    assert_eq!(grey("background: 50, max_depth: 1", &[camera, SLAB[0], lamp]), 3.0);
    // Slightly within the critical angle some of the sky is visible.
    let steep =
        "(camera: Orthographic(height_m: 1e-5), transform: LookAt(from: (0, 0.5, 0), to: (0.44, 1, 0)))";
    assert!(grey("background: 50, max_depth: 1", &[steep, SLAB[0]]) > 10.0);
}

#[test]
fn clear_glass_is_invisible_in_a_furnace() {
    // All reflected and transmitted radiance is 1, and nothing is lost.
    let balls = [
        "(camera: Pinhole(vertical_fov_degrees: 25), transform: (translate: (0, 0, 5)))",
        "(shape: Sphere, material: (ior: 1.5))",
        "(shape: Sphere(radius_m: 0.5), material: (ior: 0.8), transform: (translate: (0.2, 0.1, 0)))",
    ];
    let settings =
        "size: (12, 12), samples: 1, filter: Box, background: 1, max_depth: 200, min_throughput: 1e-5";
    let image = picture(&scene(settings, &balls));
    for pixel in &image.pixels {
        assert!(pixel.g > 0.9985 && pixel.g < 1.0001, "{pixel:?}");
    }
    // The check can fail: glass that absorbs a tenth is visible.
    let dim = balls[1].replace("ior: 1.5", "ior: 1.5, kt: 0.9");
    assert!(picture(&scene(settings, &[balls[0], &dim])).at(6, 6).g < 0.9);
}
