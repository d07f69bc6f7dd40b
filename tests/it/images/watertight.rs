//! Surfaces neither shadow themselves nor let light through.

use super::*;

/// A closed box of planes with half size `s` around `(x, 0, 0)`.
fn room(s: f64, x: f64) -> Vec<String> {
    let mut planes = Vec::new();
    for axis in 0..3 {
        for side in [-s, s] {
            let corner = |a: f64, b: f64| {
                let mut p = [0.0; 3];
                p[axis] = side;
                p[(axis + 1) % 3] = a * s;
                p[(axis + 2) % 3] = b * s;
                format!("({}, {}, {})", p[0] + x, p[1], p[2])
            };
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            planes.push(format!("(shape: Plane(corners: ({})), material: (kd: 0.5))", corners.join(", ")));
        }
    }
    planes
}

fn camera_at(s: f64, x: f64) -> String {
    let (from, to) = ([x + 0.7 * s, 0.5 * s, 0.6 * s], [x, 0.0, 0.0]);
    format!(
        "(camera: Pinhole(vertical_fov_degrees: 100), transform: LookAt(from: {}, to: {}))",
        text(from),
        text(to)
    )
}

fn text([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}

const SIZE: &str = "size: (96, 72), samples: 1, filter: Box";

#[test]
fn walls_do_not_shadow_themselves() {
    for (s, x) in [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 1e4), (1e3, 1e4)] {
        let light = format!(
            "(light: Point(power_w: {}), transform: (translate: {}))",
            1000.0 * s * s,
            text([x + 0.9 * s, -0.9 * s, 0.3 * s])
        );
        let (camera, walls) = (camera_at(s, x), room(s, x));
        let mut entities = vec![camera.as_str(), light.as_str()];
        entities.extend(walls.iter().map(String::as_str));
        let image = picture(&scene(SIZE, &entities));
        // The farthest and most oblique point: d² ≤ (1.9² + 1.9² + 1.3²) s², cos θ ≥ 0.1 s / d.
        let least = 0.5 * 1000.0 / (4.0 * PI) * 0.1 / 8.91f64.powf(1.5);
        let dark = image.pixels.iter().filter(|p| f64::from(p.g) < 0.98 * least).count();
        assert_eq!(dark, 0, "of size {s} at {x}");
    }
}

/// A floor through the origin has no rounding error in its own coordinates, but rays along it do.
#[test]
fn floor_in_grazing_light_has_no_dark_spots() {
    for height in [0.0, 0.001, 1.0, 1000.0] {
        for slope in [0.5f64, 0.2, 0.02] {
            let camera = format!(
                "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, {}, 9), to: (0, {height}, 0)))",
                height + 4.0
            );
            let floor = format!(
                "(shape: Plane(corners: ((-99, {height}, -99), (-99, {height}, 99), (99, {height}, 99), (99, {height}, -99))))"
            );
            let light = format!(
                "(light: Directional(irradiance: 10), transform: LookAt(from: (1, {slope}, 0.3), to: (0, 0, 0)))"
            );
            let image = picture(&scene(SIZE, &[&camera, &floor, &light]));
            let expected = 8.0 * slope / (1.09 + slope * slope).sqrt();
            let dark = image.pixels.iter().filter(|p| f64::from(p.g) < 0.99 * expected).count();
            assert_eq!(dark, 0, "at the height {height}, slope {slope}");
        }
    }
}

#[test]
fn ball_around_a_light_is_lit_evenly() {
    // With the light at the centre: kd Φ/(4π r²) everywhere.
    for (s, x) in [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 1e4), (1e3, 1e4)] {
        let place = format!("transform: (translate: ({x}, 0, 0), scale: {s})");
        let light = format!("(light: Point(power_w: {}), {place})", 1000.0 * s * s);
        for shape in ["Sphere", "Mesh(\"ball.ply\")"] {
            let ball = format!("(shape: {shape}, material: (kd: 0.5), {place})");
            let image = picture(&scene(SIZE, &[&camera_at(0.9 * s, x), &ball, &light]));
            let expected = 0.5 * 1000.0 / (4.0 * PI);
            let tolerance = if shape == "Sphere" { 1e-3 } else { 0.05 };
            let off = |p: &&rayfront::math::Rgb| (f64::from(p.g) / expected - 1.0).abs() > tolerance;
            let wrong: Vec<_> = image.pixels.iter().filter(off).map(|p| p.g).collect();
            // Where floats are a millimetre apart, a point may lie beyond an edge of its own facet.
            let most = if x > 1.0 && s < 10.0 { 2 } else { 0 };
            assert!(
                wrong.len() <= most,
                "{shape} of size {s} at {x}: {} pixels, {:?}",
                wrong.len(),
                wrong[0]
            );
        }
    }
}

#[test]
fn closed_surfaces_block_all_light() {
    for (s, x) in [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 1e4)] {
        let lights = [
            format!("(light: Point(power_w: 1e9), transform: (translate: ({}, {}, 0)))", x + 1.5 * s, s),
            "(light: Directional(irradiance: 1e4), transform: (rotate_degrees: (20, 30, 0)))".to_owned(),
            format!(
                "(light: Area(power_w: 1e6, size_m: {s}), transform: (translate: ({x}, 0, {})))",
                1.8 * s
            ),
        ];
        let place = format!("transform: (translate: ({x}, 0, 0), scale: {s})");
        let twin = format!("transform: (translate: ({x}, {}, 0), scale: (-{s}, {s}, {s}))", 5.0 * s);
        let ball = format!("(shape: Mesh(\"ball.ply\"), {place})");
        let instances = vec![ball.clone(), format!("(shape: Mesh(\"ball.ply\"), {twin})")];
        for walls in [room(s, x), vec![ball], instances, vec![format!("(shape: Sphere, {place})")]] {
            let camera = camera_at(0.5 * s, x);
            let mut entities = vec![camera.as_str()];
            entities.extend(lights.iter().chain(&walls).map(String::as_str));
            let image = picture(&scene(&format!("background: 1000, copied_triangles: 0, {SIZE}"), &entities));
            let lit = image.pixels.iter().filter(|p| p.max_component() > 0.0).count();
            assert_eq!(lit, 0, "of size {s} at {x}: {}", walls[0]);
        }
    }
}
