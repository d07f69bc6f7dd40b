//! Lights and shadows.

use super::*;

fn floor_under(light: &str) -> f64 {
    grey("", &[ABOVE, FLOOR, light])
}

#[test]
fn point_light_falls_off_with_the_squared_distance() {
    // d² = 3² + 4² = 25, cos θ = 4/5, intensity Φ/4π: kd · Φ/(4π d²) · cos θ.
    let light = "(light: Point(power_w: 1000), transform: (translate: (3, 4, 0)))";
    near(floor_under(light), 0.5 * 1000.0 / (4.0 * PI * 25.0) * 0.8, 1e-5);
    let constant = "(light: Point(power_w: 1000, falloff: Constant), transform: (translate: (3, 4, 0)))";
    near(floor_under(constant), 0.5 * 1000.0 / (4.0 * PI) * 0.8, 1e-5);
    let below = "(light: Point(power_w: 1000), transform: (translate: (3, -4, 0)))";
    assert_eq!(floor_under(below), 0.0);
}

#[test]
fn directional_light_falls_off_with_the_cosine() {
    let light = "(light: Directional(irradiance: 2), transform: LookAt(from: (3, 4, 0), to: (0, 0, 0)))";
    near(floor_under(light), 0.5 * 2.0 * 0.8, 1e-5);
}

#[test]
fn highlights_have_no_cosine_factor() {
    // The viewer looks along the normal, the light is at cos θ = 4/5: h halves the angle, and
    // cos²(θ/2) = (1 + 4/5)/2 = 0.9. With shininess 6 Blinn's lobe is 0.9³; Phong's is 0.8⁶.
    let light = "(light: Directional(irradiance: 2), transform: LookAt(from: (3, 4, 0), to: (0, 0, 0)))";
    let plane = "shape: Plane(corners: ((-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9)))";
    let shiny = |more: &str| {
        let floor = format!("({plane}, material: (kd: 0.5, ks: 0.3, shininess: 6 {more}))");
        grey("", &[ABOVE, &floor, light])
    };
    near(shiny(""), 2.0 * (0.5 * 0.8 + 0.3 * 0.9f64.powi(3)), 1e-5);
    near(shiny(", highlight: Phong"), 2.0 * (0.5 * 0.8 + 0.3 * 0.8f64.powi(6)), 1e-5);
}

#[test]
fn spot_light_falls_off_between_inner_and_outer_angle() {
    // 4 m above the pixel, with its axis off by an angle: Φ/(4π·16) times the square of the cosine's position between
    // those of the outer and the inner angle.
    let at = |off_degrees: f64| {
        let x = 4.0 * off_degrees.to_radians().tan();
        floor_under(&format!(
            "(light: Spot(power_w: 1000, inner_degrees: 20, outer_degrees: 40),
              transform: LookAt(from: (0, 4, 0), to: ({x}, 0, 0), up: (0, 0, 1)))"
        ))
    };
    let whole = 0.5 * 1000.0 / (4.0 * PI * 16.0);
    near(at(0.0), whole, 1e-5);
    near(at(19.9), whole, 1e-5);
    let half_way = (20f64.to_radians().cos() + 40f64.to_radians().cos()) / 2.0;
    near(at(half_way.acos().to_degrees()), whole / 4.0, 1e-4);
    assert_eq!(at(40.1), 0.0);
    assert_eq!(at(85.0), 0.0);
}

/// Φ = 100 W, 3 m × 2 m, 2 m above the floor's centre.
fn area(pattern: &str, samples: u32) -> String {
    format!(
        "(light: Area(power_w: 100, size_m: (3, 2), samples: {samples}, pattern: {pattern}),
          transform: LookAt(from: (0, 2, 0), to: (0, 0, 0), up: (0, 0, 1)))"
    )
}

/// The form factor from a small surface to a parallel rectangle a × b at the distance c, with one corner above it: F =
/// (A/√(1+A²) · atan(B/√(1+A²)) + B/√(1+B²) · atan(A/√(1+B²))) / 2π, A = a/c, B = b/c. The light consists of four such
/// rectangles. Its radiance is Φ/(π·6 m²), so E = π L F.
fn area_expected() -> f64 {
    let (a, b) = (1.5f64 / 2.0, 1.0f64 / 2.0);
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    let factor = 4.0 * (a / ra * (b / ra).atan() + b / rb * (a / rb).atan()) / (2.0 * PI);
    0.5 * 100.0 / 6.0 * factor
}

/// A profile of 2 and 1 in front and 0 behind has a mean of ¾.
#[test]
fn photometric_profile_distributes_the_power_over_directions() {
    let at = |x: f64, z: f64, turned: f64| {
        // 2 m above the floor, its axis down: its +Y, where angles are 90°, points to the scene's −Z.
        let lamp = format!(
            "(light: Photometric(power_w: 1000, profile: \"lamp.hdr\"),
              transform: (translate: ({x}, 2, {z}), rotate_degrees: (-90, {turned}, 0)))"
        );
        let whitted = floor_under(&lamp);
        let path = grey("transport: Path, sharing: Off", &[ABOVE, FLOOR, &lamp]) * PI;
        near(path, whitted, 1e-4);
        whitted
    };
    let cosine = 2.0 / 5f64.sqrt();
    let even = 0.5 * 1000.0 / (4.0 * PI * 5.0) * cosine;
    // The pixel lies towards −Z of the light, then towards +Z.
    near(at(0.0, 1.0, 0.0), even * 2.0 / 0.75, 1e-4);
    near(at(0.0, -1.0, 0.0), even / 0.75, 1e-4);
    // Half a turn about the axis swaps them.
    near(at(0.0, 1.0, 180.0), even / 0.75, 1e-4);
    // Aimed up from below, it emits nothing downwards.
    let below = "(light: Photometric(power_w: 1000, profile: \"lamp.hdr\"), transform: (translate: (0, 2, 0), rotate_degrees: (90, 0, 0)))";
    assert_eq!(floor_under(below), 0.0);
}

/// A profile's unit does not matter, not even next to another light if one of them is chosen for each path.
#[test]
fn photometric_profile_is_scale_invariant() {
    let seen = |profile: &str| {
        let lamp = format!(
            "(light: Photometric(power_w: 300, profile: \"{profile}\"),
              transform: (translate: (1, 2, 0), rotate_degrees: (-90, 0, 0)))"
        );
        let other = "(light: Point(power_w: 300), transform: (translate: (-1, 2, 0)))";
        let text =
            scene("size: (8, 8), samples: 4, transport: Path, sharing: Off", &[ABOVE, FLOOR, &lamp, other]);
        picture(&text).pixels
    };
    for (one, other) in seen("lamp.hdr").iter().zip(seen("bright-lamp.hdr")) {
        near(f64::from(one.g), f64::from(other.g), 1e-4);
    }
}

/// On the axis of a disc of radius R at the distance d: F = R²/(R² + d²), so E = Φ/(π (R² + d²)).
#[test]
fn disc_light_matches_its_form_factor() {
    let expected = 100.0 / (PI * (1.2 * 1.2 + 2.0 * 2.0));
    for visible in [false, true] {
        let light = format!(
            "(light: Area(power_w: 100, size_m: 2.4, outline: Disc, samples: 16, visible: {visible}),
              transform: LookAt(from: (0, 2, 0), to: (0, 0, 0), up: (0, 0, 1)))"
        );
        // If visible, it lies between the camera and the floor, so the camera is below it.
        let camera = "(camera: Orthographic(height_m: 1e-4),
            transform: LookAt(from: (0, 1, 0), to: (0, 0, 0), up: (0, 0, -1)))";
        for (transport, factor) in [("Whitted", 0.5), ("Path", 0.5 / PI)] {
            let settings =
                format!("size: (8, 8), samples: 256, filter: Box, sharing: Off, transport: {transport}");
            let pixels = picture(&scene(&settings, &[camera, FLOOR, &light])).pixels;
            let mean = pixels.iter().map(|pixel| f64::from(pixel.g)).sum::<f64>() / 64.0;
            near(mean / factor, expected, 2e-3);
        }
    }
    // Seen directly it is round: π/4 of its square.
    let light = "(light: Area(power_w: 100, size_m: 2, outline: Disc, visible: true))";
    let camera = "(camera: Orthographic(height_m: 2), transform: LookAt(from: (0, 0, -5), to: (0, 0, 0)))";
    let pixels = picture(&scene("size: (128, 128), samples: 4, filter: Box", &[camera, light])).pixels;
    let mean = pixels.iter().map(|pixel| f64::from(pixel.g)).sum::<f64>() / (128.0 * 128.0);
    near(mean, 100.0 / (PI * PI) * PI / 4.0, 2e-3);
}

#[test]
fn area_light_matches_its_form_factor() {
    let settings = "size: (1, 1), samples: 1024, filter: Box";
    for (pattern, samples, tolerance) in
        [("Uniform", 16, 0.01), ("Jittered", 16, 0.0005), ("Regular", 400, 0.001)]
    {
        let image = picture(&scene(settings, &[ABOVE, FLOOR, &area(pattern, samples)]));
        near(image.at(0, 0).g.into(), area_expected(), tolerance);
    }
}

#[test]
fn jittered_light_samples_have_less_error_than_uniform_ones() {
    let error = |pattern: &str| {
        let settings = "size: (16, 16), samples: 1, filter: Box";
        let image = picture(&scene(settings, &[ABOVE, FLOOR, &area(pattern, 16)]));
        let square = |p: &rayfront::math::Rgb| (f64::from(p.g) - area_expected()).powi(2);
        (image.pixels.iter().map(square).sum::<f64>() / 256.0).sqrt()
    };
    let (jittered, uniform) = (error("Jittered"), error("Uniform"));
    assert!(uniform > 0.01 * area_expected(), "{uniform}");
    // A simulation of both patterns by another program gave errors in the ratio 2.09 to 1.
    assert!(jittered < uniform / 1.7, "{jittered} against {uniform}");
}

#[test]
fn area_light_emits_on_one_side_and_shows_its_radiance() {
    let above = "(light: Area(power_w: 100, size_m: 2, samples: 4, visible: true),
                  transform: LookAt(from: (0, 2, 0), to: (0, 4, 0), up: (0, 0, 1)))";
    let side = "(camera: Orthographic(height_m: 1e-4), transform: LookAt(from: (6, 3, 0), to: (0, 0, 0)))";
    assert_eq!(grey("", &[side, FLOOR, above]), 0.0);
    // From above its bright face is visible: Φ/(π A).
    near(grey("", &[ABOVE, FLOOR, above]), 100.0 / (PI * 4.0), 1e-5);
    let down = "(light: Area(power_w: 100, size_m: 2, samples: 4, visible: true),
                 transform: LookAt(from: (0, 2, 0), to: (0, 0, 0), up: (0, 0, 1)))";
    assert_eq!(grey("", &[ABOVE, FLOOR, down]), 0.0);
}

#[test]
fn umbra_of_a_ball_is_black_up_to_its_edge() {
    // A ball of ½ m, 1 m below the light, blocks a cone of sin α = ½; on the floor, 2 m below the light, its edge is at
    // 2 tan 30° = 1.1547 m.
    let at = |x: f64| {
        let camera = format!(
            "(camera: Orthographic(height_m: 1e-4), transform: LookAt(from: ({x}, 1, 5), to: ({x}, 0, 0)))"
        );
        let ball = "(shape: Sphere(radius_m: 0.5), transform: (translate: (0, 1, 0)))";
        let light = "(light: Point(power_w: 1000), transform: (translate: (0, 2, 0)))";
        grey("", &[&camera, FLOOR, ball, light])
    };
    for x in [0.0, 0.5, 1.0, 1.154, -1.154] {
        assert_eq!(at(x), 0.0, "at {x}");
    }
    for x in [1.156, -1.156, 2.0f64] {
        let square = 4.0 + x * x;
        near(at(x), 0.5 * 1000.0 / (4.0 * PI * square) * 2.0 / square.sqrt(), 1e-4);
    }
}
