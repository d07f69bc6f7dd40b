//! Options about what is around a scene, which way it points, and what is seen behind it.

use rayfront::formats::{Edits, LoadOptions, UpAxis, load_with};
use rayfront::math::{Quat, Rgb, Vec3};
use rayfront::render::{Options, Schedule};
use rayfront::world::{Transform, World};

use crate::program::{Folder, Place, empty_folder, folder};
use crate::support::{Picture, film};

/// The largest difference between two images.
#[track_caller]
fn far(a: &[Rgb], b: &[Rgb]) -> f32 {
    assert_eq!(a.len(), b.len());
    let differences = a.iter().zip(b).map(|(a, b)| {
        let [a, b] = [a, b].map(|color| color.to_array());
        (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
    });
    differences.fold(0.0, f32::max)
}

fn loaded(folder: &Folder, name: &str, options: &LoadOptions) -> World {
    load_with(folder.join(name), options).unwrap_or_else(|error| panic!("{error}"))
}

/// A wedge that stands on the ground, with different sides, as OBJ, PLY and glTF; `place` converts its corners.
fn wedge(folder: &Folder, name: &str, place: impl Fn([f32; 3]) -> [f32; 3]) {
    let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.5, 3.0, 0.25]].map(place);
    let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
    let line = |corner: &[f32; 3]| corner.map(|c| c.to_string()).join(" ");
    let vertices = |start: &str| corners.iter().map(|c| format!("{start}{}\n", line(c))).collect::<String>();
    let obj: String = faces.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect();
    folder.write(&format!("{name}.obj"), vertices("v ") + &obj);
    let ply: String = faces.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 4\nproperty list uchar int vertex_indices\nend_header\n";
    folder.write(&format!("{name}.ply"), header.to_owned() + &vertices("") + &ply);
    let floats = faces.iter().flatten().flat_map(|corner| corners[*corner as usize]);
    let bytes: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    folder.write(&format!("{name}.bin"), &bytes);
    folder.write(
        &format!("{name}.gltf"),
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 144}}],
            "buffers": [{{"byteLength": 144, "uri": "{name}.bin"}}]}}"#
        ),
    );
}

#[test]
fn files_with_z_up_are_turned_upright() {
    let folder = empty_folder();
    wedge(&folder, "upright", |corner| corner);
    // +Y of the scene is +Z of the file, and the scene's −Z is +Y.
    wedge(&folder, "lying", |[x, y, z]| [x, -z, y]);
    let size = Some([12, 12]);
    for kind in ["obj", "ply", "gltf"] {
        let image = |name: &str, up: UpAxis| {
            let options = LoadOptions { up, size, ..LoadOptions::default() };
            let mut world = loaded(&folder, &format!("{name}.{kind}"), &options);
            world.settings.samples = 4;
            Picture::of(&world).pixels
        };
        let upright = image("upright", UpAxis::Y);
        assert!(far(&upright, &image("lying", UpAxis::Z)) < 0.02, "{kind}");
        assert!(far(&upright, &image("lying", UpAxis::Y)) > 0.1, "{kind}");
    }
    folder.out("lying.ply --up z --size 8x8 --spp 1 -q -o a.png");
    folder.out("reproduce a.png -q");
    folder.write("scene.ron", "(entities: [(shape: Sphere(radius_m: 1))])");
    folder.fails(2, "scene.ron --up z", &["--up: ", "transform: (rotate_degrees: (-90, 0, 0))"]);
}

/// An environment, and a camera that looks along −Z into it.
fn around(light: &str) -> String {
    format!(
        "(settings: (transport: Path, size: (8, 4), samples: 4), entities: [
            (camera: Pinhole(vertical_fov_degrees: 60)), (name: \"around\", {light})])"
    )
}

/// Half of the sphere is red, towards −X, the other one blue.
fn halves(folder: &Folder) {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 4, 2);
    encoder.set_color(png::ColorType::Rgb);
    let row = [[255, 0, 0], [255, 30, 0], [0, 30, 255], [0, 0, 255]].concat();
    encoder.write_header().expect("a header").write_image_data(&[row.clone(), row].concat()).expect("pixels");
    folder.write("halves.png", file);
}

#[test]
fn environments_are_turned_and_made_stronger() {
    let folder = empty_folder();
    halves(&folder);
    let image = |light: &str, edits: Edits| {
        folder.write("scene.ron", around(light));
        let options = LoadOptions { edits, ..LoadOptions::default() };
        Picture::of(&loaded(&folder, "scene.ron", &options)).pixels
    };
    let turn = |degrees: f64| Edits { env_turn_degrees: Some(degrees), ..Edits::default() };
    let plain = "light: Environment(image: \"halves.png\")";
    for (light, turned) in [
        (plain, "light: Environment(image: \"halves.png\"), transform: (rotate_degrees: (0, -70, 0))"),
        (
            "light: Sky(elevation_degrees: 20, azimuth_degrees: 10)",
            "light: Sky(elevation_degrees: 20, azimuth_degrees: 80)",
        ),
        (
            "light: Environment(image: \"halves.png\"), transform: Matrix(((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)))",
            "light: Environment(image: \"halves.png\"), transform: (rotate_degrees: (0, -70, 0))",
        ),
    ] {
        let after = image(light, turn(70.0));
        assert!(far(&after, &image(turned, Edits::default())) < 1e-3, "{light}");
        assert!(far(&after, &image(light, Edits::default())) > 0.01, "{light}");
    }
    // To the right of the picture's middle is +X; turned clockwise by a quarter, what lay there lies behind.
    let right = image(plain, turn(-90.0));
    assert!(right[0].b > 0.5 && right[7].b > 0.5 && right[0].r < 0.3, "{right:?}");
    let strong = Edits { env_strength: Some(2.5), ..Edits::default() };
    let radiance = "light: Environment(image: \"halves.png\", radiance: 2.5)";
    assert!(image(plain, strong.clone()) == image(radiance, Edits::default()));

    // Below a turned and stretched parent, too.
    let below = |light: &str, edits: Edits| {
        let parent = "parent: \"above\", light: Environment(image: \"halves.png\")";
        let scene = around(parent).replace(
            "])",
            &format!(", (name: \"above\", transform: (rotate_degrees: (20, {light}, 0), scale: 2))])"),
        );
        folder.write("scene.ron", scene);
        let options = LoadOptions { edits, ..LoadOptions::default() };
        Picture::of(&loaded(&folder, "scene.ron", &options)).pixels
    };
    assert!(far(&below("-45", turn(30.0)), &below("-75", Edits::default())) < 1e-3);

    folder.write(
        "scene.ron",
        "(entities: [(camera: Orthographic(height_m: 2)), (shape: Sphere(radius_m: 1))])",
    );
    let messages = folder.messages("scene.ron --env-turn 90 --size 4x4 --spp 1 -o a.png");
    assert!(messages.contains("there is no environment and no sky (--env studio adds one)"), "{messages}");
    folder.out("scene.ron --env halves.png --env-turn=-90 --env-strength 0.5 --size 4x4 --spp 1 -q -o a.png");
    folder.out("reproduce a.png -q");
    folder.fails(2, "scene.ron --env studio --env-strength=-1", &["expected a factor"]);
}

#[test]
fn pictures_of_environments_that_are_not_two_to_one_get_a_note() {
    let folder = empty_folder();
    halves(&folder);
    let image = |width: u32, height: u32| {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(png::ColorType::Grayscale);
        let pixels = vec![200; (width * height) as usize];
        encoder.write_header().expect("a header").write_image_data(&pixels).expect("pixels");
        folder.write("a.png", file);
        folder.write("scene.ron", around("light: Environment(image: \"a.png\")"));
        folder.messages("scene.ron --spp 1 -o out.png")
    };
    for (width, height) in [(16, 16), (6, 16), (40, 16)] {
        let messages = image(width, height);
        let note = format!("\"around\": its picture has {width}x{height} texels");
        assert_eq!(messages.matches(&note).count(), 1, "{messages}");
    }
    for (width, height) in [(32, 16), (33, 16), (1, 1)] {
        assert!(!image(width, height).contains("texels"), "{width}x{height}");
    }
}

#[test]
fn statements_replace_the_rotation_of_models_nodes() {
    let folder = empty_folder();
    let nodes = |own: &str| {
        folder.write(
            "a.gltf",
            format!(
                r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
                "nodes": [{{"name": "Suzanne", {own}}}]}}"#
            ),
        );
    };
    let set = |statement: &str| {
        let edits = Edits { set: vec![format!("\"Suzanne\".transform.{statement}")], ..Edits::default() };
        let world = load_with(folder.join("a.gltf"), &LoadOptions { edits, ..LoadOptions::default() })?;
        let found = world.in_order().into_iter().find(|entity| world.name_of(*entity) == "Suzanne");
        Ok::<_, rayfront::error::LoadError>(
            *world.entities.get::<&Transform>(found.expect("a node")).expect("a transform"),
        )
    };
    let near = |found: Transform, at: Vec3, turn: Quat, size: Vec3| {
        let Transform::Trs { translation, rotation, scale } = found else { panic!("{found:?}") };
        assert!((translation.as_vec3() - at).length() < 1e-5 && (scale - size).length() < 1e-5, "{found:?}");
        assert!(rotation.dot(turn).abs() > 1.0 - 1e-6, "{found:?} instead of {turn}");
    };
    let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    // By quaternion, and by a matrix that moves by (1, 2, 3), turns by 90 degrees about X and doubles.
    let matrix = "\"matrix\": [2, 0, 0, 0, 0, 0, 2, 0, 0, -2, 0, 0, 1, 2, 3, 1]";
    for (own, at, size) in [
        ("\"rotation\": [0.5, 0.5, 0.5, 0.5]", Vec3::ZERO, Vec3::ONE),
        (
            "\"rotation\": [0.5, 0.5, 0.5, 0.5], \"scale\": [1, 2, 3], \"translation\": [0, 0, 4]",
            Vec3::new(0.0, 0.0, 4.0),
            Vec3::new(1.0, 2.0, 3.0),
        ),
        ("\"translation\": [0, 0, 4]", Vec3::new(0.0, 0.0, 4.0), Vec3::ONE),
        (matrix, Vec3::new(1.0, 2.0, 3.0), Vec3::splat(2.0)),
    ] {
        nodes(own);
        near(set("rotate_degrees = (0, 90, 0)").expect(own), at, quarter, size);
        near(set("rotate_quaternion = (0, 0, 0, 1)").expect(own), at, Quat::IDENTITY, size);
    }
    let tilted = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    near(
        set("translate += (1, 0, 0)").expect("a matrix"),
        Vec3::new(2.0, 2.0, 3.0),
        tilted,
        Vec3::splat(2.0),
    );
    // Angles are added to those of a quaternion: (100, 20, -30) degrees.
    let angles = |x: f32, y: f32, z: f32| {
        let [x, y, z] = [x, y, z].map(f32::to_radians);
        Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x)
    };
    nodes(&format!("\"rotation\": {:?}", angles(100.0, 20.0, -30.0).to_array()));
    near(
        set("rotate_degrees += (5, 0, 10)").expect("angles"),
        Vec3::ZERO,
        angles(105.0, 20.0, -20.0),
        Vec3::ONE,
    );
    nodes(&format!("\"rotation\": {:?}", angles(40.0, 90.0, 0.0).to_array()));
    near(set("rotate_degrees += (0, 0, 0)").expect("angles"), Vec3::ZERO, angles(40.0, 90.0, 0.0), Vec3::ONE);
    nodes("\"matrix\": [1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]");
    let error = set("rotate_degrees = (0, 90, 0)").expect_err("it shears").to_string();
    assert!(error.contains("a Matrix that shears: set all of it, as .transform = (…)"), "{error}");
    set("scale = 1").expect_err("it shears");
}

/// A mirror ball before a red and blue environment; to its left a pane that lets half of the light through.
fn staged(transport: &str, settings: &str) -> String {
    let (mirror, pane) = match transport {
        "Path" => (
            "Principled(metallic: 1, roughness: 0, base_color: 1)",
            "Principled(base_color: 0, specular: 0, metallic: 0, alpha: 0.5, alpha_mode: Blend)",
        ),
        _ => (
            "BlinnPhong(diffuse: 0, specular: 0, kr: 1)",
            "BlinnPhong(diffuse: 0, specular: 0, kt: 0.5, ior: 1)",
        ),
    };
    format!(
        "(settings: (transport: {transport}, size: (24, 8), samples: 16, ambient: 0, {settings}), entities: [
            (camera: Orthographic(height_m: 2), transform: (translate: (0, 0, 5))),
            (light: Environment(image: \"halves.png\")),
            (shape: Sphere(radius_m: 0.9), material: {mirror}),
            (shape: Plane(corners: ((-3, 1, 0), (-2, 1, 0), (-2, -1, 0), (-3, -1, 0))), material: {pane})])"
    )
}

#[test]
fn backdrops_are_seen_and_environments_light() {
    let folder = empty_folder();
    halves(&folder);
    for transport in ["Path", "Whitted"] {
        let image = |settings: &str, options: Options| {
            folder.write("scene.ron", staged(transport, settings));
            film(&loaded(&folder, "scene.ron", &LoadOptions::default()), options).radiance()
        };
        let schedules = [Schedule::Wavefront, Schedule::Recursive]
            .map(|schedule| Options { schedule, ..Options::default() });
        let [plain, seen] = ["", "backdrop: (0, 0.7, 0)"].map(|settings| {
            let [wave, depth] = schedules.map(|options| image(settings, options));
            assert!(wave == depth, "{transport}, {settings}");
            wave
        });
        let green = Rgb::new(0.0, 0.7, 0.0);
        let at = |image: &[Rgb], x: usize, y: usize| image[y * 24 + x];
        // Right of the ball nothing is hit.
        assert!(far(&[at(&seen, 22, 4)], &[green]) < 1e-5, "{transport}");
        // Through the pane half of it is seen.
        let through = at(&seen, 1, 4);
        assert!(
            (through.g - 0.35).abs() < 0.12 && through.r < 1e-5 && through.b < 1e-5,
            "{transport}: {through:?}"
        );
        // The ball shows the environment, bit by bit.
        for (x, y) in [(12, 4), (11, 3), (10, 4)] {
            assert!(at(&seen, x, y) == at(&plain, x, y) && at(&seen, x, y).g < 0.1, "{transport}");
        }
        let gradient = image("backdrop: Gradient(bottom: 0, top: (0, 1, 0))", Options::default());
        assert!(far(&[at(&gradient, 22, 4)], &[Rgb::new(0.0, 0.5, 0.0)]) < 1e-5);
    }
}

/// Whatever the exposure, the tone curve, the noise and the environment.
#[test]
fn backgrounds_are_shown_as_they_are_typed() {
    for (transport, look) in [("Path", "tonemap: Aces, exposure_ev: 3"), ("Whitted", "exposure: Auto")] {
        let folder = folder(&staged(transport, look));
        halves(&folder);
        let corner = |name: &str| {
            let image = image::open(folder.join(name)).expect("an image").into_rgb8();
            image.get_pixel(image.width() - 1, image.height() - 1).0
        };
        folder.write("key.ron", staged(transport, &format!("{look}, backplate: \"#ff8040\"")));
        let by_key = folder.hash("key.ron -q -o key.png");
        assert_eq!(folder.hash("scene.ron -q --background '#ff8040' -o a.png"), by_key);
        for name in ["a.png", "key.png"] {
            assert_eq!(corner(name), [255, 128, 64], "{transport}");
        }
        // Samples are those of a transparent image, which floats still are; no lamp comes from behind.
        assert_eq!(folder.hash("scene.ron -q --transparent -o t.exr"), by_key);
        folder.out("scene.ron -q --background white -o w.exr");
        assert_eq!(folder.pixels("w.exr"), folder.pixels("t.exr"));
        // The ball is opaque, and shows the environment as before.
        folder.out("scene.ron -q -o plain.png --exposure 3");
        folder.out("scene.ron -q --background white -o w.png --exposure 3");
        let ball =
            |name: &str| image::open(folder.join(name)).expect("an image").into_rgb8().get_pixel(12, 4).0;
        assert_eq!(ball("w.png"), ball("plain.png"));
        for (words, shown) in [("white", [255; 3]), ("e4002b", [228, 0, 43]), ("1,0,0", [255, 0, 0])] {
            folder.out(&format!("scene.ron -q --background {words} --denoise -o w.png"));
            assert_eq!([corner("w.png"), corner("w.denoised.png")], [shown; 2], "{words}");
        }
        folder.out("reproduce w.png -q");
    }
}

#[test]
fn backgrounds_may_be_pictures() {
    let folder = folder(&staged("Path", ""));
    halves(&folder);
    // As wide as high: the top and the bottom are cut off.
    let file = image::RgbImage::from_fn(24, 24, |x, y| image::Rgb([x as u8 * 10, y as u8 * 10, 77]));
    file.save(folder.join("street.png")).expect("room");
    folder.out("scene.ron -q --background street.png -o a.png");
    let seen = image::open(folder.join("a.png")).expect("an image").into_rgb8();
    for [x, y] in [[6, 0], [23, 0], [20, 7]] {
        assert_eq!(seen.get_pixel(x, y), file.get_pixel(x, y + 8), "{x}, {y}");
    }
    // In a scene it is relative to its folder; a region shows its part.
    folder.write("key.ron", staged("Path", "backplate: Image(\"street.png\")"));
    folder.out("key.ron -q -o b.png --crop 20,2,24,8");
    let part = image::open(folder.join("b.png")).expect("an image").into_rgb8();
    assert_eq!(part.get_pixel(3, 0), file.get_pixel(23, 10));
    for (code, words, reason) in [
        (1, "--background none.png -o a.png", "none.png"),
        (2, "--background 228,0,43 -o a.png", "this is '#e4002b'"),
        (2, "--background 2 -o a.png", "from 0 to 1"),
        (2, "--background whiter -o a.png", "whiter"),
        (1, "--background street/none -o a.png", "street/none: cannot read"),
        (2, "--background (3,0,-1) -o a.png", "  --background (3,0,-1)"),
        (3, "--background white -o a.hdr", "holds light"),
    ] {
        folder.run(&format!("scene.ron {words}")).ends(code, &[reason]);
    }
}

#[test]
fn a_camera_below_the_added_floor_is_told() {
    let folder = empty_folder();
    wedge(&folder, "wedge", |corner| corner);
    let told = |words: &str| folder.messages(&format!("wedge.gltf --size 8x8 --spp 1 -o a.png {words}"));
    assert!(told("--ground shadow --orbit 0,-60").contains("the camera is below the floor"));
    for above in ["--ground shadow", "--orbit 0,-60", "--ground --orbit 0,10"] {
        assert!(!told(above).contains("below the floor"), "{above}");
    }
}

/// `--hide Light --env studio` replaces the lights of a scene; so the advice of the warning about darkness works.
#[test]
fn hidden_lights_are_those_of_the_files() {
    let folder = folder(&staged("Path", ""));
    halves(&folder);
    let dark = folder.hash("scene.ron -q --hide Light -o a.exr");
    let studio = folder.hash("scene.ron -q --env studio -o a.exr");
    assert_ne!(studio, dark);
    assert_eq!(folder.hash("scene.ron -q --env studio --hide Light -o a.exr"), studio);
    wedge(&folder, "wedge", |corner| corner);
    let told = folder.messages("wedge.gltf --hide Light --size 8x8 --spp 1 -o w.png");
    assert!(told.contains("nothing is hidden") && !told.contains("no light gets"), "{told}");
}

/// Three parts of the light, not one opacity.
#[test]
fn coloured_glass_tints_the_background() {
    let folder = folder(
        "(settings: (size: (8, 8), samples: 4, tonemap: Aces), entities: [
            (camera: Orthographic(height_m: 2), transform: (translate: (0, 0, 5))),
            (shape: Plane(corners: ((-2, 2, 0), (-2, -2, 0), (2, -2, 0), (2, 2, 0))),
             material: BlinnPhong(diffuse: 0, specular: 0, kt: (1, 0.5, 0), ior: 1))])",
    );
    folder.out("scene.ron -q --background white -o a.png");
    let seen = image::open(folder.join("a.png")).expect("an image").into_rgb8();
    assert!(seen.pixels().all(|pixel| pixel.0 == [255, 188, 0]), "{:?}", seen.get_pixel(4, 4));
}

/// Surroundings hide the background of a scene, and the warning names the keys that they do not.
#[test]
fn hidden_backgrounds_are_reported_with_what_to_write() {
    let folder = folder(&staged("Path", "background: 0.4"));
    halves(&folder);
    let message = folder.messages("scene.ron -o a.png");
    assert!(message.contains("write backplate or backdrop instead, or --env none"), "{message}");
    // What that does is written like the option.
    folder.write("seen.ron", staged("Path", "backdrop: 0.4"));
    folder.write("shown.ron", staged("Path", "backplate: 0.4"));
    for name in ["seen.ron", "shown.ron"] {
        assert!(!folder.messages(&format!("{name} -o a.png")).contains("background"), "{name}");
    }
}

/// A floor and a ball that throws a shadow, in the light of a sky.
fn under_a_sky(fields: &str) -> Vec<Rgb> {
    let scene = format!(
        r#"(
            settings: (size: (32, 24), samples: 64, transport: Path, max_depth: 1, filter: Box),
            entities: [
                (camera: Orthographic(height_m: 4), transform: LookAt(from: (0, 5, 0), to: (0, 0, 0), up: (0, 0, -1))),
                (shape: Sphere(radius_m: 0.5), transform: (translate: (0.8, 1.5, 0)), material: (diffuse: 0)),
                (shape: Plane(corners: ((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9))), material: (diffuse: 0.5)),
                (light: Sky(elevation_degrees: 45, azimuth_degrees: 90{fields})),
            ],
        )"#
    );
    film(&crate::support::world(&scene), Options::default()).radiance()
}

#[test]
fn suns_are_weaker_stronger_or_larger_than_the_sky_has_them() {
    let mean =
        |pixels: &[Rgb]| pixels.iter().map(|pixel| f64::from(pixel.g)).sum::<f64>() / pixels.len() as f64;
    let [none, usual, strong, large] = [", sun: 0", "", ", sun: 3", ", sun_degrees: 20"].map(under_a_sky);
    let sun = mean(&usual) - mean(&none);
    assert!(sun > 0.5 * mean(&none), "the sun is most of the light");
    assert!(((mean(&strong) - mean(&none)) / sun / 3.0 - 1.0).abs() < 0.02);
    assert!(((mean(&large) - mean(&none)) / sun - 1.0).abs() < 0.05);
    // Pixels in half shadow.
    let lit = 0.5 * usual.iter().map(|pixel| pixel.g).fold(0.0, f32::max);
    let half = |pixels: &[Rgb]| pixels.iter().filter(|pixel| (0.5..1.5).contains(&(pixel.g / lit))).count();
    assert!(half(&large) > 2 * half(&usual), "{} {}", half(&large), half(&usual));
}
