//! Images of other renderers with the scenes that they show: those of the corpus at `RAYFRONT_CORPUS` with a
//! description of geometry, materials and camera.
//!
//! Each is rendered under the path transport and compared in linear light, after both have been averaged over blocks of
//! 4 × 4 pixels, where the reference is not clipped. The limits are slightly above the difference that an independent
//! path tracer (Mitsuba 3.9.1) left to the same images, to allow for our own noise.

use std::path::Path;

use rayfront::internals::formats::picture;
use rayfront::math::{Rgb, Vec3};
use rayfront::world::Texels;

use crate::support::Picture;
use crate::{corpus, support};

/// The side of a block, in pixels.
const BLOCK: usize = 4;

/// The largest allowed differences from the reference.
struct Limits {
    /// The difference of the ratio of the means from 1.
    mean: f64,
    /// The root mean squared difference of blocks.
    rmse: f64,
}

/// Returns the ratio of the means and the root mean squared difference, over blocks in which the reference has no
/// clipped pixel.
fn difference(ours: &Picture, theirs: &Picture) -> (f64, f64) {
    assert_eq!((ours.width, ours.height), (theirs.width, theirs.height));
    let (mut sums, mut squares, mut count) = ([0.0; 2], 0.0, 0.0);
    for y in (0..ours.height - BLOCK + 1).step_by(BLOCK) {
        for x in (0..ours.width - BLOCK + 1).step_by(BLOCK) {
            let mut means = [[0.0f64; 3]; 2];
            let mut clipped = false;
            for i in 0..BLOCK * BLOCK {
                let at = |picture: &Picture| picture.at(x + i % BLOCK, y + i / BLOCK).to_array();
                clipped |= at(theirs).iter().any(|value| *value >= 0.999);
                for (mean, picture) in means.iter_mut().zip([ours, theirs]) {
                    for (mean, value) in mean.iter_mut().zip(at(picture)) {
                        *mean += f64::from(value) / (BLOCK * BLOCK) as f64;
                    }
                }
            }
            if clipped {
                continue;
            }
            for (a, b) in means[0].iter().zip(means[1]) {
                sums = [sums[0] + a, sums[1] + b];
                squares += (a - b) * (a - b);
                count += 1.0;
            }
        }
    }
    (sums[0] / sums[1], f64::sqrt(squares / count))
}

fn check(name: &str, text: &str, reference: &Picture, limits: Limits) {
    let (ratio, rmse) = difference(&support::picture(text), reference);
    println!("{name}: mean ratio {ratio:.4}, RMSE {rmse:.4}");
    assert!((ratio - 1.0).abs() < limits.mean, "{name}: mean ratio {ratio}");
    assert!(rmse < limits.rmse, "{name}: RMSE {rmse}");
}

/// Loads an image of eight bits per channel and decodes its values.
fn bytes(path: &Path, decode: impl Fn(f32) -> f32) -> Picture {
    let image = picture::load(path, &Default::default()).unwrap_or_else(|error| panic!("{error}")).image;
    let Texels::Rgba8(texels) = &image.texels else { panic!("{}: not of bytes", path.display()) };
    let value = |byte: u8| decode(f32::from(byte) / 255.0);
    let pixels = texels.iter().map(|[r, g, b, _]| Rgb::new(value(*r), value(*g), value(*b))).collect();
    Picture { width: image.width as usize, height: image.height as usize, pixels }
}

/// "Ray Tracing in One Weekend", the first book: spheres under a sky.
mod weekend {
    use super::*;

    const GROUND: &str =
        "(shape: Sphere(radius_m: 100), material: \"ground\", transform: (translate: (0, -100.5, -1)))";

    fn ball(x: f32, radius: f32, material: &str) -> String {
        format!(
            "(shape: Sphere(radius_m: {radius}), material: \"{material}\", transform: (translate: ({x}, 0, -1)))"
        )
    }

    fn scene(camera: &str, samples: u32, entities: &[String]) -> String {
        format!(
            "(
            settings: (size: (400, 225), samples: {samples}, max_depth: 50, transport: Path, filter: Box,
                       background: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1))),
            materials: {{
                \"grey\": (diffuse: 0.5), \"red\": (diffuse: (1, 0, 0)), \"blue\": (diffuse: (0, 0, 1)),
                \"brown\": (diffuse: (0.7, 0.3, 0.3)), \"navy\": (diffuse: (0.1, 0.2, 0.5)),
                \"ground\": (diffuse: (0.8, 0.8, 0)),
                \"silver\": (diffuse: 0, kr: 0.8), \"gold\": (diffuse: 0, kr: (0.8, 0.6, 0.2)),
                \"glass\": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1.5, volume: ()),
                \"air\": Principled(metallic: 0, roughness: 0, transmission: 1, ior: 1, volume: ()),
            }},
            entities: [{camera}, {}],
            )",
            entities.join(", ")
        )
    }

    fn front() -> &'static str {
        "(camera: Pinhole(vertical_fov_degrees: 90), transform: LookAt(from: (0, 0, 0), to: (0, 0, -1)))"
    }

    fn from_above(camera: &str) -> String {
        format!("(camera: {camera}, transform: LookAt(from: (-2, 2, 1), to: (0, 0, -1)))")
    }

    /// A diffuse ball between a hollow glass ball and a metal one.
    fn three() -> Vec<String> {
        let balls = [
            ball(0.0, 0.5, "navy"),
            ball(-1.0, 0.5, "glass"),
            ball(-1.0, 0.4, "air"),
            ball(1.0, 0.5, "gold"),
        ];
        [vec![GROUND.to_owned()], balls.to_vec()].concat()
    }

    fn reference(name: &str) -> Option<Picture> {
        let path = corpus::folder()?.join("rtow/images").join(name);
        // Gamma 2, except for the one that is stored linearly.
        Some(bytes(&path, |value| if name.contains("1.10") { value } else { value * value }))
    }

    #[test]
    fn diffuse_ball_matches_the_reference() {
        let Some(reference) = reference("img-1.10-correct-lambertian.png") else { return };
        let ground = GROUND.replace("ground", "grey");
        let text = scene(front(), 36, &[ground, ball(0.0, 0.5, "grey")]);
        // Means over six seeds differ by up to 0.0006 among each other, with path reuse and without.
        check("img-1.10", &text, &reference, Limits { mean: 0.0025, rmse: 0.004 });
    }

    #[test]
    fn mirrors_match_the_reference() {
        let Some(reference) = reference("img-1.13-metal-shiny.png") else { return };
        let balls = [ball(0.0, 0.5, "brown"), ball(-1.0, 0.5, "silver"), ball(1.0, 0.5, "gold")];
        let text = scene(front(), 36, &[vec![GROUND.to_owned()], balls.to_vec()].concat());
        check("img-1.13", &text, &reference, Limits { mean: 0.004, rmse: 0.005 });
    }

    #[test]
    fn hollow_glass_matches_the_reference() {
        let Some(reference) = reference("img-1.18-glass-hollow.png") else { return };
        let text = scene(front(), 36, &three());
        check("img-1.18", &text, &reference, Limits { mean: 0.004, rmse: 0.012 });
    }

    #[test]
    fn wide_view_of_two_balls_matches_the_reference() {
        let Some(reference) = reference("img-1.19-wide-view.png") else { return };
        let r = std::f32::consts::FRAC_1_SQRT_2;
        let text = scene(front(), 36, &[ball(-r, r, "blue"), ball(r, r, "red")]);
        check("img-1.19", &text, &reference, Limits { mean: 0.005, rmse: 0.006 });
    }

    #[test]
    fn distant_view_matches_the_reference() {
        let Some(reference) = reference("img-1.20-view-distant.png") else { return };
        let text = scene(&from_above("Pinhole(vertical_fov_degrees: 90)"), 36, &three());
        check("img-1.20", &text, &reference, Limits { mean: 0.004, rmse: 0.005 });
    }

    #[test]
    fn zoomed_view_matches_the_reference() {
        let Some(reference) = reference("img-1.21-view-zoom.png") else { return };
        let text = scene(&from_above("Pinhole(vertical_fov_degrees: 20)"), 36, &three());
        check("img-1.21", &text, &reference, Limits { mean: 0.007, rmse: 0.014 });
    }

    #[test]
    fn depth_of_field_matches_the_reference() {
        let Some(reference) = reference("img-1.22-depth-of-field.png") else { return };
        let lens = "ThinLens(vertical_fov_degrees: 20, lens_radius_m: 0.29746, focus_distance_m: 3.4)";
        let text = scene(&from_above(lens), 64, &three());
        check("img-1.22", &text, &reference, Limits { mean: 0.007, rmse: 0.012 });
    }
}

/// "Ray Tracing: The Next Week", the second book: rectangles.
mod next_week {
    use super::*;

    fn point(p: Vec3) -> String {
        format!("({}, {}, {})", p.x, p.y, p.z)
    }

    /// A rectangle with a corner and two edges, visible from both sides.
    fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3], material: &str) -> String {
        let [corner, u, v] = [corner, u, v].map(Vec3::from_array);
        let corners = [corner, corner + u, corner + u + v, corner + v].map(point).join(", ");
        format!("(shape: Plane(corners: ({corners})), material: \"{material}\")")
    }

    /// A box, rotated about a vertical edge and moved.
    fn block(size: [f32; 3], degrees: f32, corner: [f32; 3]) -> Vec<String> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let turned = |p: Vec3| Vec3::new(cos * p.x + sin * p.z, p.y, -sin * p.x + cos * p.z).to_array();
        let [x, y, z] = [Vec3::X * size[0], Vec3::Y * size[1], Vec3::Z * size[2]];
        let faces =
            [(Vec3::ZERO, x, y), (z, x, y), (Vec3::ZERO, z, y), (x, z, y), (Vec3::ZERO, x, z), (y, x, z)];
        let face = |(at, u, v): (Vec3, Vec3, Vec3)| {
            let at = Vec3::from_array(turned(at)) + Vec3::from_array(corner);
            quad(at.to_array(), turned(u), turned(v), "white")
        };
        faces.into_iter().map(face).collect()
    }

    fn scene(settings: &str, camera: &str, quads: &[String]) -> String {
        format!(
            "(
            settings: ({settings}, max_depth: 50, transport: Path, filter: Box),
            materials: {{
                \"left\": (diffuse: (1, 0.2, 0.2)), \"back\": (diffuse: (0.2, 1, 0.2)), \"right\": (diffuse: (0.2, 0.2, 1)),
                \"upper\": (diffuse: (1, 0.5, 0)), \"lower\": (diffuse: (0.2, 0.8, 0.8)),
                \"red\": (diffuse: (0.65, 0.05, 0.05)), \"white\": (diffuse: 0.73), \"green\": (diffuse: (0.12, 0.45, 0.15)),
                \"black\": (diffuse: 0),
                \"light\": Principled(base_color: 0, metallic: 0, specular: 0, emission: 15),
            }},
            entities: [{camera}, {}],
            )",
            quads.join(", ")
        )
    }

    fn reference(name: &str) -> Option<Picture> {
        Some(bytes(&corpus::folder()?.join("rtow/images").join(name), |value| value * value))
    }

    #[test]
    fn rectangles_match_the_reference() {
        let Some(reference) = reference("img-2.16-quads.png") else { return };
        let quads = [
            quad([-3.0, -2.0, 5.0], [0.0, 0.0, -4.0], [0.0, 4.0, 0.0], "left"),
            quad([-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], "back"),
            quad([3.0, -2.0, 1.0], [0.0, 0.0, 4.0], [0.0, 4.0, 0.0], "right"),
            quad([-2.0, 3.0, 1.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0], "upper"),
            quad([-2.0, -3.0, 5.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0], "lower"),
        ];
        let camera =
            "(camera: Pinhole(vertical_fov_degrees: 80), transform: LookAt(from: (0, 0, 9), to: (0, 0, 0)))";
        let text = scene("size: (400, 400), samples: 16, background: (0.7, 0.8, 1)", camera, &quads);
        check("img-2.16", &text, &reference, Limits { mean: 0.006, rmse: 0.025 });
    }

    const CAMERA: &str = "(camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (278, 278, -800), to: (278, 278, 0)))";

    fn cornell() -> Vec<String> {
        vec![
            quad([555.0, 0.0, 0.0], [0.0, 555.0, 0.0], [0.0, 0.0, 555.0], "green"),
            quad([0.0, 0.0, 0.0], [0.0, 555.0, 0.0], [0.0, 0.0, 555.0], "red"),
            quad([0.0, 0.0, 0.0], [555.0, 0.0, 0.0], [0.0, 0.0, 555.0], "white"),
            quad([555.0, 555.0, 555.0], [-555.0, 0.0, 0.0], [0.0, 0.0, -555.0], "white"),
            quad([0.0, 0.0, 555.0], [555.0, 0.0, 0.0], [0.0, 555.0, 0.0], "white"),
            // The black rectangle behind it makes it emit downwards only.
            quad([343.0, 554.0, 332.0], [-130.0, 0.0, 0.0], [0.0, 0.0, -105.0], "light"),
            quad([343.0, 554.1, 332.0], [-130.0, 0.0, 0.0], [0.0, 0.0, -105.0], "black"),
        ]
    }

    #[test]
    fn empty_cornell_box_matches_the_reference() {
        let Some(reference) = reference("img-2.19-cornell-empty.png") else { return };
        let text = scene("size: (400, 400), samples: 25, background: 0", CAMERA, &cornell());
        check("img-2.19", &text, &reference, Limits { mean: 0.02, rmse: 0.017 });
    }

    #[test]
    fn cornell_box_with_blocks_matches_the_reference() {
        let Some(reference) = reference("img-2.21-cornell-standard.png") else { return };
        let blocks = [
            block([165.0, 330.0, 165.0], 15.0, [265.0, 0.0, 295.0]),
            block([165.0, 165.0, 165.0], -18.0, [130.0, 0.0, 65.0]),
        ];
        let text = scene(
            "size: (600, 600), samples: 16, background: 0",
            CAMERA,
            &[cornell(), blocks.concat()].concat(),
        );
        check("img-2.21", &text, &reference, Limits { mean: 0.015, rmse: 0.021 });
    }
}
