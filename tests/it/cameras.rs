//! Cameras of all kinds: what their pixels show, and photons that they see.

use rayfront::world::{Caustics, Texels, Transport, World};

use crate::program::{Place, empty_folder};
use crate::support::{Picture, mean, world};

/// Balls of many colours all around, each with its own brightness, with a sample in the centre of each pixel.
fn around(size: [u32; 2], camera: &str) -> World {
    let mut balls = String::new();
    for number in 0..48 {
        let (angle, height) = (number as f64 * 2.399_963, (number as f64 + 0.5) / 24.0 - 1.0);
        let level = (1.0 - height * height).sqrt();
        let place = [angle.cos() * level, height, angle.sin() * level].map(|part| 3.0 * part + 0.2);
        let color = [0.1 + 0.018 * number as f64, (number % 7) as f64 / 7.0, (number % 5) as f64 / 5.0];
        let [[x, y, z], [r, g, b]] = [place, color];
        balls += &format!(
            "(shape: Sphere(radius_m: 0.5), transform: (translate: ({x}, {y}, {z})), material: (diffuse: ({r}, {g}, {b}))),"
        );
    }
    let [width, height] = size;
    world(&format!(
        "(settings: (size: ({width}, {height}), samples: 1, filter: Box, pixel_pattern: Center, transport: Whitted,
                     background: Gradient(bottom: 0.1, top: 0.9), ambient: 1),
          entities: [{camera} {balls}])"
    ))
}

fn of(world: &World) -> Vec<[f32; 3]> {
    Picture::of(world).pixels.iter().map(|pixel| pixel.to_array()).collect()
}

/// The radiance in a direction, by a pinhole of one pixel that looks there.
fn seen_along([x, y, z]: [f64; 3]) -> [f32; 3] {
    let up = if y.abs() > 0.99 { ", up: (0, 0, -1)" } else { "" };
    of(&around(
        [1, 1],
        &format!(
            "(camera: Pinhole(vertical_fov_degrees: 1), transform: LookAt(from: (0, 0, 0), to: ({x}, {y}, {z}){up})),"
        ),
    ))[0]
}

/// Compares some pixels of a camera with pinholes that look where a formula says; none where nothing is seen.
fn assert_sees(size: [u32; 2], camera: &str, direction: impl Fn(f64, f64) -> Option<[f64; 3]>) {
    let picture = of(&around(size, camera));
    let (mut colors, mut dark) = (std::collections::HashSet::new(), 0);
    for (column, row) in (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| (column, row))) {
        if !(column * 7 + row * 3).is_multiple_of(11) {
            continue;
        }
        let found = picture[(row * size[0] + column) as usize];
        let Some(direction) = direction(f64::from(column) + 0.5, f64::from(row) + 0.5) else {
            dark += 1;
            assert_eq!(found, [0.0; 3], "{camera} {column} {row}");
            continue;
        };
        let expected = seen_along(direction);
        // A pixel at the edge of a ball may see what is beside it.
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-3);
        if !near {
            let turned = direction.map(|part| part + 2e-3);
            let other = [seen_along(turned), seen_along(direction.map(|part| part - 2e-3))];
            assert!(
                other.iter().any(|other| *other != expected),
                "{camera} {column} {row}: {found:?} {expected:?}"
            );
        }
        colors.insert(found.map(f32::to_bits));
    }
    assert!(colors.len() > 20, "{camera}: only {} colours", colors.len());
    assert!(dark < size[0] * size[1] / 20);
}

#[test]
fn pixels_of_panoramas_and_fisheyes_see_what_pinholes_see_there() {
    let turned = |longitude: f64, latitude: f64| {
        let [(sin, cos), (rise, level)] = [longitude, latitude].map(|angle| angle.to_radians().sin_cos());
        Some([sin * level, rise, -cos * level])
    };
    assert_sees([36, 18], "(camera: Panorama()),", |x, y| turned(10.0 * (x - 18.0), 10.0 * (9.0 - y)));
    assert_sees([20, 20], "(camera: Panorama(horizontal_degrees: 180)),", |x, y| {
        turned(9.0 * (x - 10.0), 9.0 * (10.0 - y))
    });
    let fisheye = |half_degrees: f64| {
        move |x: f64, y: f64| {
            let (across, up) = ((x - 15.0) / 10.0, (10.0 - y) / 10.0);
            let radius = across.hypot(up);
            let (sin, cos) = (radius * half_degrees).to_radians().sin_cos();
            (radius <= 1.0).then_some([across / radius * sin, up / radius * sin, -cos])
        }
    };
    assert_sees([30, 20], "(camera: Fisheye()),", fisheye(90.0));
    assert_sees([30, 20], "(camera: Fisheye(fov_degrees: 360)),", fisheye(180.0));
}

/// A panorama of an environment's image is that image; half of one, turned, is a quarter further.
#[test]
fn panorama_of_an_environment_is_its_image() {
    let surroundings = |width: u32, camera: &str| {
        world(&format!(
            "(settings: (size: ({width}, 4), samples: 1, filter: Box, pixel_pattern: Center, transport: Whitted),
              entities: [({camera}), (light: Environment(image: \"floats.hdr\"))])"
        ))
    };
    let whole = surroundings(4, "camera: Panorama()");
    let Texels::Rgb32(texels) = &whole.assets.images[0].texels else { panic!("floats") };
    let near = |found: &[f32; 3], expected: &[f32; 3]| {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-3 * b.abs().max(1.0))
    };
    for (found, expected) in of(&whole).iter().zip(texels) {
        assert!(near(found, expected), "{found:?} {expected:?}");
    }
    // A quarter to the right of the centre is the border between the last two columns.
    let half = of(&surroundings(
        2,
        "camera: Panorama(horizontal_degrees: 180), transform: (rotate_degrees: (0, -90, 0))",
    ));
    for (row, line) in texels.chunks(4).enumerate() {
        assert!(near(&half[2 * row], &line[2]) && near(&half[2 * row + 1], &line[3]), "{half:?}");
    }
}

/// Data sets' pose and intrinsics: the centre of a ball at a known place is in the pixel that OpenCV computes.
#[test]
fn poses_of_data_sets_put_known_points_into_known_pixels() {
    // Looks along +X of the world, with −Y (the image's down) along −Z... of the camera's columns right, down, forward.
    let (right, down, forward, place) = ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 3.0]);
    let [fx, fy, cx, cy] = [40.0, 44.0, 17.0, 10.0];
    let point = [5.0, 1.6, 3.5];
    let to: Vec<f64> = (0..3).map(|i| point[i] - place[i]).collect();
    let along = |axis: [f64; 3]| axis.iter().zip(&to).map(|(a, b)| a * b).sum::<f64>();
    let [x, y, z] = [along(right), along(down), along(forward)];
    let expected = [fx * x / z + cx, fy * y / z + cy];
    let row = |i: usize| format!("({}, {}, {}, {})", right[i], down[i], forward[i], place[i]);
    let to_world = format!("OpenCv(camera_to_world: ({}, {}, {}))", row(0), row(1), row(2));
    let inverse = |axis: [f64; 3]| {
        let moved: f64 = axis.iter().zip(place).map(|(a, b)| -a * b).sum();
        format!("({}, {}, {}, {moved})", axis[0], axis[1], axis[2])
    };
    let to_camera =
        format!("OpenCv(world_to_camera: ({}, {}, {}))", inverse(right), inverse(down), inverse(forward));
    let pictures = [to_world, to_camera].map(|pose| {
        of(&world(&format!(
            "(settings: (size: (32, 24), samples: 64, filter: Box, transport: Whitted),
              entities: [
                (camera: Intrinsics(fx: {fx}, fy: {fy}, cx: {cx}, cy: {cy}, size: (32, 24)), transform: {pose}),
                (shape: Sphere(radius_m: 0.1), transform: (translate: ({}, {}, {})), material: (diffuse: 0, emission: 1)),
              ])",
            point[0], point[1], point[2]
        )))
    });
    assert_eq!(pictures[0], pictures[1]);
    let (mut sum, mut middle) = (0.0, [0.0; 2]);
    for (number, [light, ..]) in pictures[0].iter().enumerate() {
        let light = f64::from(*light);
        sum += light;
        middle[0] += light * ((number % 32) as f64 + 0.5);
        middle[1] += light * ((number / 32) as f64 + 0.5);
    }
    for (found, expected) in middle.iter().zip(expected) {
        assert!((found / sum - expected).abs() < 0.1, "{found} / {sum} is not {expected}");
    }
}

/// A camera shows the point of focus as sharply as a pinhole does, and blurs the points behind.
#[test]
fn focus_stays_on_an_entity() {
    let scene = |camera: &str, z: f64| {
        of(&world(&format!(
            "(settings: (size: (40, 30), samples: 64, filter: Box, transport: Whitted),
              entities: [
                {camera}
                (name: \"ball\", shape: Sphere(radius_m: 0.2), transform: (translate: (0, 0, {z})),
                 material: (diffuse: 0, emission: 1)),
              ])"
        )))
    };
    let half_dark = |picture: &[[f32; 3]]| picture.iter().filter(|[r, ..]| *r > 0.05 && *r < 0.95).count();
    for z in [-2.0, -5.0] {
        let pinhole = half_dark(&scene("(camera: Photographic(focal_length_mm: 100)),", z));
        let lens = |focus: &str| half_dark(&scene(focus, z));
        let sharp = lens("(camera: Photographic(focal_length_mm: 100, f_stop: 0.5), focus_on: \"ball\"),");
        let blurred = lens("(camera: Photographic(focal_length_mm: 100, f_stop: 0.5, focus_distance_m: 1)),");
        assert!(sharp <= pinhole + pinhole / 3 + 6, "{z}: {sharp} {pinhole}");
        assert!(blurred > 2 * sharp, "{z}: {blurred} {sharp}");
    }
}

/// Photons through a pane, seen by cameras of all kinds, bring what Fresnel's equations say: (1 − R) / (1 + R) of the
/// light without it.
#[test]
fn photons_count_the_same_in_all_cameras() {
    const FLOOR: &str = "(shape: Plane(corners: ((-50, 0, 50), (50, 0, 50), (50, 0, -50), (-50, 0, -50))),
                          material: (diffuse: 0.001)),";
    const PANE: &str = "(shape: Mesh(\"cube.ply\"), material: (ior: 1.5), transform: (translate: (0, 2, 0), scale: (1.5, 0.2, 1.5))),";
    const LAMP: &str =
        "(light: Directional(irradiance: 5), transform: LookAt(from: (0.01, 10, 0), to: (0, 0, 0))),";
    let cameras = [
        "camera: Panorama(horizontal_degrees: 14, vertical_degrees: 12)",
        "camera: Fisheye(fov_degrees: 14, circular: false)",
        "camera: Fisheye(fov_degrees: 14, mapping: Equisolid, circular: false)",
        "camera: Fisheye(fov_degrees: 14, mapping: Stereographic, circular: false)",
        "camera: Photographic(focal_length_mm: 150, f_stop: 4, focus_distance_m: 2.2, shift: (0.2, -0.1))",
        "camera: Intrinsics(fx: 90, fy: 80, cx: 7, cy: 3, size: (16, 12))",
        "camera: Pinhole(vertical_fov_degrees: 12), stereo: ()",
        "camera: Panorama(horizontal_degrees: 14, vertical_degrees: 12), stereo: (layout: OverUnder)",
    ];
    for camera in cameras {
        let scene = |samples: u32, between: &str| {
            world(&format!(
                "(settings: (size: (16, 12), samples: {samples}, max_depth: 16, transport: Path, filter: Box),
                  entities: [({camera}, transform: LookAt(from: (2, 1, 0), to: (0, 0, 0))), {FLOOR} {between} {LAMP}])"
            ))
        };
        let bare = mean(&Picture::of(&scene(4, "")));
        let mut covered = scene(32, PANE);
        covered.settings.caustics = Caustics::Photons { photons: 8.0, radius: 1.4 };
        let expected = (1.0 - 0.04) / (1.0 + 0.04);
        for transport in [Transport::Path, Transport::Whitted] {
            covered.settings.transport = transport;
            // Whitted's surfaces are π times as bright.
            let units = if transport == Transport::Whitted { std::f64::consts::PI } else { 1.0 };
            let found = mean(&Picture::of(&covered)) / (bare * units);
            assert!((found / expected - 1.0).abs() < 0.02, "{camera} {transport:?}: {found}");
        }
    }
}

/// Without the first camera the next one counts, and without all of them one is added that sees everything.
#[test]
fn hidden_cameras_give_way_to_others() {
    let folder = empty_folder();
    let eye = |name: &str, x: f32| {
        format!("(name: \"{name}\", camera: Pinhole(), transform: LookAt(from: ({x}, 0, 4), to: (0, 0, 0))),")
    };
    folder.write(
        "scene.ron",
        format!(
            "(settings: (size: (24, 16), samples: 1), entities: [{}{}(light: Point(power_w: 100), transform: (translate: (1, 2, 5))), (shape: Sphere())])",
            eye("one", 1.0),
            eye("two", -2.0)
        ),
    );
    let image = |options: &str| {
        folder.out(&format!("scene.ron -q -o a.png {options}"));
        image::open(folder.join("a.png")).expect("an image").to_rgb8()
    };
    let two = image("--camera two");
    assert_ne!(image(""), two);
    assert_eq!(image("--hide 'Entity[\"one\"]'"), two);
    let around = image("--hide Camera");
    assert!(around != two && around.pixels().any(|pixel| pixel.0[0] > 50));
    let told = folder.messages("scene.ron -o a.png --hide Camera");
    assert!(told.contains("camera") && !told.contains("nothing is hidden"), "{told}");
}
