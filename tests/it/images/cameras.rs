//! Positions of objects in the image.

use super::*;

/// Returns the pixels of 8 × 8 that show a square from (0.25, 0.5) to (0.75, 0.75) in the plane z = −1.
fn lit(camera: &str) -> Vec<(usize, usize)> {
    let square =
        "(shape: Plane(corners: ((0.25, 0.5, -1), (0.75, 0.5, -1), (0.75, 0.75, -1), (0.25, 0.75, -1))),
                   material: (kd: 0, emission: 1))";
    let image = picture(&scene(&format!("size: (8, 8), {EXACT}"), &[camera, square]));
    let places = (0..8).flat_map(|y| (0..8).map(move |x| (x, y)));
    places.filter(|(x, y)| image.at(*x, *y).g == 1.0).collect()
}

#[test]
fn cameras_have_x_right_y_up_and_the_stated_size() {
    // Two metres are eight pixels: columns from x = 0.25 are 5 and 6, the row from y = 0.75 down is 1.
    let expected = vec![(5, 1), (6, 1)];
    assert_eq!(lit("(camera: Orthographic(height_m: 2))"), expected);
    // 90° cover two metres at a distance of one.
    assert_eq!(lit("(camera: Pinhole(vertical_fov_degrees: 90))"), expected);
    let lens = "(camera: ThinLens(vertical_fov_degrees: 90, lens_radius_m: 0.5, focus_distance_m: 1))";
    assert_eq!(lit(lens), expected);
    // A camera ignores its scale; a mirrored one sees the mirror image.
    assert_eq!(lit("(camera: Pinhole(vertical_fov_degrees: 90), transform: (scale: (3, 2, 5)))"), expected);
    let mirrored = lit("(camera: Pinhole(vertical_fov_degrees: 90), transform: (scale: (-1, 1, 1)))");
    assert_eq!(mirrored, vec![(1, 1), (2, 1)]);
    // Rotated by half a turn about Y and moved behind: left and right are swapped.
    let behind = "(camera: Pinhole(vertical_fov_degrees: 90), transform: (translate: (0, 0, -2), rotate_degrees: (0, 180, 0)))";
    assert_eq!(lit(behind), vec![(1, 1), (2, 1)]);
}

#[test]
fn wide_images_extend_the_view_sideways() {
    let square = "(shape: Plane(corners: ((1.5, -1, -1), (2, -1, -1), (2, 1, -1), (1.5, 1, -1))), material: (kd: 0, emission: 1))";
    let camera = "(camera: Pinhole(vertical_fov_degrees: 90))";
    let image = picture(&scene(&format!("size: (8, 4), {EXACT}"), &[camera, square]));
    for x in 0..8 {
        assert_eq!(image.at(x, 1).g, if x == 7 { 1.0 } else { 0.0 });
    }
}

const RAMP: &str = "(shape: Plane(corners: ((-2, 2, -2), (2, 2, -2), (2, -2, -2), (-2, -2, -2))),
                     material: (kd: 0, emission: Image(\"ramp.hdr\")))";

#[test]
fn thin_lens_is_sharp_in_the_focal_plane() {
    let through = |camera: &str| picture(&scene("size: (10, 10), samples: 9, filter: Box", &[camera, RAMP]));
    let pinhole = through("(camera: Pinhole(vertical_fov_degrees: 60))");
    let difference = |other: Picture| {
        let pairs = pinhole.pixels.iter().zip(&other.pixels);
        pairs.map(|(a, b)| (a.r - b.r).abs().max((a.g - b.g).abs())).fold(0.0, f32::max)
    };
    let lens = |focus: f32| {
        format!("(camera: ThinLens(vertical_fov_degrees: 60, lens_radius_m: 0.4, focus_distance_m: {focus}))")
    };
    assert!(difference(through(&lens(2.0))) < 1e-5);
    assert!(difference(through(&lens(1.0))) > 0.01);
}

#[test]
fn circle_of_confusion_follows_from_similar_triangles() {
    // Rays from a lens of radius R to a point at the distance d meet the focal plane at f in a disc of radius
    // c = R |d − f| / d. The image there is 2 f tan(fov/2) high, which gives c in pixels. A disc's variance along an
    // axis is c²/4; the sphere's own image adds s²/4 and the pixels 1/12.
    const SIZE: usize = 32;
    let variance = |distance: f64, focus: f64, pattern: &str| {
        let camera = format!(
            "(camera: ThinLens(vertical_fov_degrees: 20, lens_radius_m: 0.2, focus_distance_m: {focus}, pattern: {pattern}))"
        );
        let lamp = format!(
            "(shape: Sphere(radius_m: 0.08), material: (kd: 0, emission: 1000), transform: (translate: (0, 0, {})))",
            -distance
        );
        let image = picture(&scene("size: (32, 32), samples: 1024, filter: Box", &[&camera, &lamp]));
        let (mut sum, mut square) = (0.0, [0.0; 2]);
        for y in 0..SIZE {
            for x in 0..SIZE {
                let weight = f64::from(image.at(x, y).g);
                sum += weight;
                square[0] += weight * (x as f64 + 0.5 - 16.0).powi(2);
                square[1] += weight * (y as f64 + 0.5 - 16.0).powi(2);
            }
        }
        square.map(|s| s / sum)
    };
    for (distance, focus) in [(2.0f64, 4.0f64), (6.0, 2.0), (3.0, 3.0)] {
        let scale = SIZE as f64 / (2.0 * focus * 10f64.to_radians().tan());
        let confusion = 0.2 * (distance - focus).abs() / distance * scale;
        let lamp = 0.08 * focus / distance * scale;
        let expected = (confusion * confusion + lamp * lamp) / 4.0 + 1.0 / 12.0;
        for pattern in ["Jittered", "Uniform"] {
            for found in variance(distance, focus, pattern) {
                near(found, expected, 0.06);
            }
        }
    }
}
