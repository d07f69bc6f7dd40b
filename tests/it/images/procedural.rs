//! Procedural textures on surfaces.

use super::*;

/// A gradient along the object's x: 0.5 + x / 4.
const ALONG_X: &str = "Gradient(space: Object, scale: 0.25, offset: 0.5)";

/// The gradient's value at the centre of the view from `direction`.
fn value_from([x, y, z]: [f64; 3], settings: &str, shapes: &[&str]) -> f64 {
    let [x, y, z] = [x, y, z].map(|c| 9.0 * c);
    let camera = format!(
        "(camera: Orthographic(height_m: 1e-5), transform: LookAt(from: ({x}, {y}, {z}), to: (0, 0, 0), up: (0.3, 1, 0.1)))"
    );
    let entities: Vec<String> =
        shapes.iter().map(|shape| format!("({shape}, material: (kd: 0, emission: {ALONG_X}))")).collect();
    let entities: Vec<&str> = std::iter::once(&*camera).chain(entities.iter().map(|it| &**it)).collect();
    pixel(settings, &entities)[0]
}

#[test]
fn textures_in_object_space_follow_their_object() {
    let directions = [[0.0, 0.0, 1.0], [0.6, 0.64, 0.48], [-0.48, -0.64, -0.6], [-0.48, 0.6, 0.64]];
    for d in directions {
        let expect = |x: f64, settings: &str, shapes: &[&str]| {
            near(value_from(d, settings, shapes), 0.5 + x / 4.0, 2e-4);
        };
        expect(d[0], "", &["shape: Sphere"]);
        expect(1.5 * d[0], "", &["shape: Sphere(radius_m: 1.5)"]);
        // A quarter turn about Y takes X to −Z.
        expect(-d[2], "", &["shape: Sphere, transform: (rotate_degrees: (0, 90, 0), scale: 2)"]);
        // Stretched: instances of unit spheres.
        let reach = 1.0 / (d[0] * d[0] + d[1] * d[1] / 4.0 + d[2] * d[2]).sqrt();
        expect(reach * d[0], "", &["shape: Sphere, transform: (scale: (1, 2, 1))"]);
        let stretched = "shape: Sphere(radius_m: 0.5), transform: (scale: (2, 4, 2))";
        let behind = "shape: Sphere(radius_m: 0.1), transform: (scale: (1, 2, 1))";
        expect(0.5 * reach * d[0], "", &[stretched, behind]);
        // Meshes, copied to world space and as instances.
        for settings in ["", "copied_triangles: 0"] {
            let cube = |more: &str| format!("shape: Mesh(\"cube.ply\"), transform: ({more})");
            let [own, other] = ["rotate_degrees: (0, 90, 0), scale: 2", "scale: 0.1"].map(cube);
            let (plain, small) = (cube("scale: 1"), cube("scale: 0.1"));
            let x = value_from(d, settings, &[&plain, &small]);
            let turned = [-d[2], d[1], d[0]];
            let same = value_from(turned, settings, &[&plain, &small]);
            near(value_from(d, settings, &[&own, &other]), same, 2e-4);
            assert!((0.0..=1.0).contains(&x));
        }
    }
}

/// The error of one sample a pixel towards the horizon, where a cell is far smaller than a pixel.
#[test]
fn fine_patterns_are_smooth_at_one_sample_a_pixel() {
    let rows = |texture: &str, samples: u32| {
        let settings = format!(
            "size: (48, 24), samples: {samples}, filter: Box, pixel_pattern: Jittered, transport: Path, max_depth: 1"
        );
        let image = picture(&scene(
            &settings,
            &[
                "(camera: Pinhole(vertical_fov_degrees: 20), transform: LookAt(from: (0, 1, 0), to: (0, 0.8, -1)))",
                &format!(
                    "(shape: Plane(corners: ((-90, 0, 9), (90, 0, 9), (90, 0, -90), (-90, 0, -90))), \
                     material: Principled(base_color: 0, specular: 0, emission: {texture}))"
                ),
            ],
        ));
        image.pixels.iter().map(|pixel| f64::from(pixel.to_array()[0])).collect::<Vec<f64>>()
    };
    for texture in [
        "Checker(scale: 600)",
        "Checker(space: Object, scale: 5)",
        "Bricks(scale: 400, a: 0, b: 1)",
        "Gradient(scale: 300, wrap: Repeat)",
        "Noise(space: Object, scale: 6)",
        "Voronoi(space: Object, scale: 6, kind: Cells)",
        "Marble(space: Object, scale: 4, a: 0, b: 1)",
    ] {
        let (one, many) = (rows(texture, 1), rows(texture, 64));
        let mean = many.iter().sum::<f64>() / many.len() as f64;
        let rms = |of: &[f64], towards: &dyn Fn(usize) -> f64| {
            (of.iter().enumerate().map(|(at, v)| (v - towards(at)).powi(2)).sum::<f64>() / of.len() as f64)
                .sqrt()
        };
        // The upper half of the image.
        let (one, many) = (&one[..one.len() / 2], &many[..many.len() / 2]);
        let error = rms(one, &|at| many[at]);
        // Points of these patterns would be off by a third to a half.
        assert!(error < 0.12, "{texture}: {error} of {mean}");
        let upper = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        near(upper(one), upper(many), 0.02);
    }
}

/// Light samples and hits see the same texture: a panel of fine checks lights a floor as a grey one does.
#[test]
fn glowing_patterns_light_what_their_mean_lights() {
    for (transport, shape) in [
        ("Path", "Plane(corners: ((-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1)))"),
        ("Path", "Sphere(radius_m: 0.4)"),
    ] {
        let lit = |emission: &str| {
            let image = picture(&scene(
                &format!("size: (8, 8), samples: 256, transport: {transport}, max_depth: 2"),
                &[
                    "(camera: Orthographic(height_m: 3), transform: LookAt(from: (0, 1.2, 0), to: (0, 0, 0), up: (0, 0, -1)))",
                    FLOOR,
                    &format!(
                        "(shape: {shape}, transform: (translate: (0, {}, 0)), \
                         material: Principled(base_color: 0, specular: 0, double_sided: true, emission: {emission}))",
                        if shape.starts_with('S') { 2.0 } else { 0.0 }
                    ),
                ],
            ));
            crate::support::mean(&image)
        };
        let (checked, grey) = (lit("Checker(scale: 40, b: 3)"), lit("1.5"));
        near(checked / grey, 1.0, 0.02);
        // Half of it is dark: where a pattern is bright, it lights.
        let split = lit("Checker(scale: (2, 1), b: 3)");
        near(split / grey, 1.0, 0.1);
    }
}

/// A slope of height over distance tilts the normal by its arc tangent.
#[test]
fn bump_of_a_gradient_is_a_slope() {
    let slope = 0.5f64;
    let lit = |shape: &str, texture: &str| {
        let shape = format!(
            "({shape}, material: Principled(base_color: 1, metallic: 0, specular: 0, \
             bump: (texture: {texture}, height_m: {slope})))"
        );
        pixel(
            "transport: Path, max_depth: 1",
            &[
                "(camera: Orthographic(height_m: 1e-3), transform: LookAt(from: (0.1, 0.2, 5), to: (0.1, 0.2, 0)))",
                "(light: Directional(irradiance: 1), transform: LookAt(from: (0, 0, 5), to: (0, 0, 0)))",
                &shape,
            ],
        )[0]
    };
    let expected = 1.0 / PI / (1.0 + slope * slope).sqrt();
    let plane = "shape: Plane(corners: ((-0.5, 0.5, 0), (0.5, 0.5, 0), (0.5, -0.5, 0), (-0.5, -0.5, 0)))";
    for texture in [
        "Gradient(space: Object, offset: 0.5)",
        "Gradient",
        "Gradient(rotate_degrees: (0, 0, 90), offset: (1, 0))",
        "Mix(a: 0, b: 1, by: Gradient)",
        "Multiply(a: Gradient, b: Gradient(space: Object, scale: 0, offset: 1))",
    ] {
        near(lit(plane, texture), expected, 1e-3);
    }
    // Scaled by 2, the slope over the world's metres is half as large.
    let half = 1.0 / PI / (1.0 + slope * slope / 4.0).sqrt();
    let scaled = format!("{plane}, transform: (scale: 2)");
    near(lit(&scaled, "Gradient(space: Object, offset: 0.5)"), half, 1e-3);
    // A sphere's front, where x runs along the surface.
    let ball = lit(
        "shape: Sphere(radius_m: 1000), transform: (translate: (0, 0, -1000))",
        "Gradient(space: Object, offset: 0.5)",
    );
    near(ball, expected, 1e-3);
}
