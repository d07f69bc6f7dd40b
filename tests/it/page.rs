//! The page of `rayfront view`: movements, layers, files, commands, and values that it changes.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::program::Place;
use super::view::{SCENE, Shown, bright, rendered};

/// A page that is opened at once shows no image before there is one.
#[test]
fn page_opened_before_the_first_image_shows_none() {
    let shown = Shown::with(&bright("(640, 360)"), &[]);
    let start = Instant::now();
    loop {
        let (code, pixels) = shown.get("/image?exposure=0&tonemap=Clamp");
        if code == 200 {
            let black = pixels.chunks(4).filter(|pixel| pixel[..3] == [0; 3]).count();
            return assert!(20 * black < pixels.len() / 4, "{black} pixels are black");
        }
        assert!(code == 204 && pixels.is_empty() && start.elapsed() < Duration::from_secs(60), "{code}");
    }
}

/// Movements that follow each other faster than images are rendered show small images, and then the whole one.
#[test]
fn movements_show_small_images_until_they_end() {
    let shown = Shown::with(&bright("(320, 180)"), &[]);
    shown.when("an image", |status| status["serial"].as_u64() > Some(0));
    const MOVEMENTS: usize = 20;
    let mut serials = Vec::new();
    for _ in 0..MOVEMENTS {
        assert_eq!(shown.wish(json!({"orbit": [0.01, 0.0]})).0, 200);
        let moved = Instant::now();
        let status = shown.json("/status");
        // A busy machine may make the movement seem to have ended.
        let has_rested = serials.is_empty() || moved.elapsed() > Duration::from_millis(50);
        assert!(has_rested || status["shown"][0].as_u64() < Some(320), "{status}");
        serials.push(status["serial"].as_u64().expect("a serial"));
    }
    serials.dedup();
    assert!(2 * serials.len() > MOVEMENTS, "{} images", serials.len());
    shown.when("the whole image", |status| {
        status["shown"][0] == 320 && status["samples"].as_f64() >= Some(1.0)
    });
}

/// The command that the page copies mixes the lights as it shows them.
#[cfg(unix)]
#[test]
fn copied_command_mixes_the_lights_of_the_page() {
    let orbit = json!({"orbit": [0.2, 0.05]});
    let child = SCENE
        .replace("(name: \"eye\",", "(name: \"base\", transform: ()), (name: \"eye\", parent: \"base\",");
    let mix = "mix=%5B%5B0.3,0.123456,0%5D%5D";
    for (scene, options, wishes, look) in [
        (SCENE, &["--light-groups"][..], &[][..], "layer=light&exposure=0&tonemap=Clamp"),
        (SCENE, &["--light-groups", "--exposure", "2"], &[orbit], "layer=light&exposure=auto&tonemap=Agx"),
        (SCENE, &["--light-groups"], &[], "layer=denoised&exposure=1&tonemap=Aces"),
        (&child, &["--light-groups"], &[], "layer=light&exposure=0&tonemap=Clamp"),
    ] {
        let shown = Shown::with(scene, options);
        for wish in wishes {
            assert_eq!(shown.wish(wish.clone()).0, 200, "{wish}");
        }
        shown.when("the image", |status| status["is_done"] == true);
        let command = shown.json(&format!("/command?{look}&{mix}"))["command"].clone();
        let command = command.as_str().expect("a command");
        crate::printed::typed(&shown.folder, command, "--quiet");
        let name = if look.contains("denoised") { "scene.denoised.png" } else { "scene.png" };
        let (_, pixels) = shown.get(&format!("/image?{look}&{mix}"));
        let file = image::open(shown.folder.join(name)).expect("a picture").into_rgba8().into_raw();
        assert!(file == pixels, "{options:?}: {command}");
        let (_, plain) = shown.get(&format!("/image?{look}"));
        assert!(plain != pixels, "the mix changes the image");
    }
}

/// The command that the page copies renders the bytes that it shows.
#[cfg(unix)]
#[test]
fn copied_command_renders_the_image_of_the_page() {
    let set = json!({"set": r#"Material["paint"].diffuse = (0.1, 0.9, 0.2)"#});
    let (orbit, fov) = (json!({"orbit": [0.1, 0.05]}), json!({"fov_deg": 30.0}));
    let settings = json!({"settings": {"depth": 3, "spp": 7, "sampler": "independent"}});
    let look = "layer=light&exposure=0&tonemap=Clamp";
    let other = "layer=light&exposure=-1.5&tonemap=Agx";
    for (options, wishes, look) in [
        (&[][..], &[][..], look),
        (&["--exposure", "2", "--tonemap", "aces"], &[], look),
        (&["--exposure", "auto"], &[], other),
        (&["--f-stop", "0.5", "--focus", "48,30"], &[], look),
        (&["--f-stop", "0.5", "--focus", "48,30"], &[json!({"orbit": [0.2, 0.0]})], look),
        (&["--f-stop", "0.5", "--focus", "ball"], &[json!({"orbit": [0.2, 0.0]})], look),
        (&["--background", "#ff8000"], &[], "layer=denoised&exposure=auto&tonemap=Agx"),
        (&["--transparent"], &[], "layer=light&exposure=auto&tonemap=Aces"),
        (&["--ground=shadow"], &[], look),
        (&["--zoom", "1.5"], &[set.clone(), settings.clone(), orbit.clone(), fov.clone()], other),
        (&[], &[orbit, set, settings, fov], "layer=denoised&exposure=auto&tonemap=PbrNeutral"),
    ] {
        let shown = Shown::with(SCENE, options);
        for wish in wishes {
            assert_eq!(shown.wish(wish.clone()).0, 200, "{wish}");
        }
        shown.when("the image", |status| status["is_done"] == true);
        let command =
            shown.json(&format!("/command?{look}"))["command"].as_str().expect("a command").to_owned();
        crate::printed::typed(&shown.folder, &command, "--quiet");
        assert!(!command.contains("--sharing"), "{command}");
        let name = if command.contains("--denoise") { "scene.denoised.png" } else { "scene.png" };
        let (_, pixels) = shown.get(&format!("/image?{look}"));
        let file = image::open(shown.folder.join(name)).expect("a picture").into_rgba8().into_raw();
        assert!(file == pixels, "{options:?} {wishes:?}: {command}");
    }
}

/// The command places cameras of models, and those of parents that stay where they are, as the page does; of other parents
/// it says that it does not.
#[cfg(unix)]
#[test]
fn copied_command_places_cameras_of_models_and_parents() {
    let eye = SCENE.lines().find(|line| line.contains("\"eye\"")).expect("the camera");
    let child = |base: &str| {
        SCENE.replace(
            "(name: \"eye\",",
            &format!("(name: \"base\", transform: {base}), (name: \"eye\", parent: \"base\","),
        )
    };
    let look = "layer=light&exposure=0&tonemap=Clamp";
    for (scene, is_placed) in [
        (SCENE.replace(eye, "(name: \"model\", gltf: \"eye.gltf\"),"), true),
        (child("()"), true),
        (child("(translate: (0, 0.1, 0))"), false),
    ] {
        let shown = Shown::with(&scene, &[]);
        assert_eq!(shown.wish(json!({"orbit": [0.2, 0.1]})).0, 200);
        shown.when("the image", |status| status["is_done"] == true);
        let command =
            shown.json(&format!("/command?{look}"))["command"].as_str().expect("a command").to_owned();
        assert_eq!(command.contains("where its file says"), !is_placed, "{command}");
        if is_placed {
            crate::printed::typed(&shown.folder, &command, "--quiet");
            let (_, pixels) = shown.get(&format!("/image?{look}"));
            let file =
                image::open(shown.folder.join("scene.png")).expect("a picture").into_rgba8().into_raw();
            assert!(file == pixels, "{command}");
        }
    }
}

/// A camera, copied as a line or saved, gives the image that the page shows, whatever it is focused on.
#[test]
fn copied_and_saved_cameras_keep_their_focus() {
    let eye = r#"(name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 6), to: (0, 0, 0))),"#;
    let optics = "camera: ThinLens(vertical_fov_degrees: 40, lens_radius_m: 0.3)";
    let turned = "transform: LookAt(from: (0.123456789, 1, 6), to: (0.3, 0.1, 0.7))";
    let thin = format!("(name: \"eye\", {optics}, focus_on: \"ball\", {turned}),");
    let pair =
        format!("(name: \"eye\", {optics}, focus_on: \"ball\", {turned}, stereo: (eye_distance_m: 0.3)),");
    let orbit = &[json!({"orbit": [0.2, 0.05]})][..];
    for (entity, options, wishes) in [
        (&thin[..], &[][..], &[][..]),
        (&thin, &[], orbit),
        (&pair, &[], &[]),
        (&pair, &[], orbit),
        (eye, &["--f-stop", "0.5", "--focus", "ball"], &[]),
        (eye, &["--f-stop", "0.5", "--focus", "ball"], orbit),
        (eye, &["--f-stop", "0.5", "--focus", "48,30"], orbit),
    ] {
        assert!(SCENE.contains(eye));
        let scene = SCENE.replace(eye, entity);
        let shown = Shown::with(&scene, options);
        for wish in wishes {
            assert_eq!(shown.wish(wish.clone()).0, 200, "{wish}");
        }
        let seen = shown.image();
        let camera = shown.json("/status")["camera"].clone();
        let focus = camera["focus_m"].as_f64().expect("a focus");
        assert!((4.9..6.5).contains(&focus), "{camera}");
        let line = camera["line"].as_str().expect("a line");
        let copy = shown.folder.join("copy.ron");
        std::fs::write(&copy, scene.replace(entity, &format!("{line},"))).expect("a scene");
        shown.folder.out("copy.ron --quiet -o copy.png");
        let copied = image::open(shown.folder.join("copy.png")).expect("a picture").into_rgb8().into_raw();
        assert!(copied == seen, "{options:?} {wishes:?}: {line}");
        if !wishes.is_empty() {
            assert_eq!(shown.wish(json!({"save_camera": true})).0, 200);
            assert!(rendered(&shown.scene()) == seen, "{options:?}: {line}");
        }
    }
}

/// The layers of work have the numbers that a rendering writes into a file.
#[test]
fn layers_of_work_have_the_numbers_of_a_rendering() {
    let shown = Shown::new();
    shown.image();
    shown.folder.out("scene.ron --quiet -o scene.exr --aov nodes,tests,path-length");
    let file = exr::prelude::read_first_flat_layer_from_file(shown.folder.join("scene.exr")).expect("a file");
    let (x, y) = (48, 30);
    for (layer, channels) in [
        ("nodes", &["nodes.camera", "nodes.path", "nodes.shadow"][..]),
        ("tests", &["tests.camera", "tests.path", "tests.shadow"]),
        ("path-length", &["path-length"]),
    ] {
        let found = shown.json(&format!("/values?layer={layer}&x0={x}&y0={y}&x1={}&y1={}", x + 1, y + 1));
        let own = |name: &&str| {
            let channel = file.layer_data.channel_data.list.iter().find(|it| it.name == **name);
            f64::from(channel.expect("a channel").sample_data.value_by_flat_index(x + 96 * y).to_f32())
        };
        let expected: Vec<f64> = channels.iter().map(own).collect();
        assert_eq!(found["values"][0], json!(expected), "{layer}");
        assert!(expected.iter().sum::<f64>() > 0.9, "{layer}: {expected:?}");
    }
}

#[test]
fn layers_have_numbers_and_a_bar_of_their_colours() {
    let shown = Shown::new();
    shown.image();
    let pixel = shown.json("/pixel?x=48&y=30");
    let of = |layer: &str| shown.json(&format!("/values?layer={layer}&x0=48&y0=30&x1=50&y1=31"));
    assert_eq!(of("light")["values"][0], pixel["radiance"]);
    assert_eq!(
        (&of("samples")["values"], &of("light")["region"]),
        (&json!([[4.0], [4.0]]), &json!([48, 30, 50, 31]))
    );
    let depth = of("depth")["values"][0][0].as_f64().expect("a depth");
    let near = shown.json("/pixel?x=48&y=30")["depth_m"].as_f64().expect("a depth");
    assert!((depth - near).abs() < 1e-4, "{depth} {near}");
    for none in [
        "layer=entity&x0=0&y0=0&x1=1&y1=1", "layer=light&x0=0&y0=0&x1=96&y1=54",
        "layer=light&x0=95&y0=0&x1=97&y1=1",
    ] {
        assert_eq!(shown.get(&format!("/values?{none}")).0, 204, "{none}");
    }
    let (code, outline) = shown.get("/outline?entity=ball");
    assert_eq!((code, outline.len()), (200, 96 * 54));
    assert!(outline.contains(&1) && outline.contains(&2) && outline[48 + 30 * 96] == 0);
    assert_eq!(shown.get("/outline?entity=bell").0, 404);
}

/// A file of a layer has the pixels of the page, and below them the bar, if there is one.
#[test]
fn layers_in_files_have_the_pixels_of_the_page() {
    let shown = Shown::new();
    shown.image();
    for (layer, bar) in [
        ("depth", true),
        ("normal", true),
        ("albedo", true),
        ("entity", false),
        ("material", false),
        ("noise", true),
        ("samples", true),
        ("nodes", true),
        ("tests", true),
        ("path-length", true),
    ] {
        let (code, pixels) = shown.get(&format!("/image?layer={layer}"));
        assert_eq!((code, pixels.len()), (200, 4 * 96 * 54), "{layer}");
        let page: Vec<u8> = pixels.chunks(4).flat_map(|pixel| &pixel[..3]).copied().collect();
        let name = format!("{layer}.png");
        assert_eq!(
            shown.folder.out(&format!("view scene.ron --layer {layer} -o {name}")),
            format!("{name}\n")
        );
        let file = image::open(shown.folder.join(&name)).expect("a picture").into_rgb8();
        assert_eq!(file.dimensions(), (96, if bar { 54 + 28 } else { 54 }), "{layer}");
        let (image, below) = file.as_raw().split_at(page.len());
        assert!(image == page, "{layer}");
        // The bar goes from its first colour to its last, and the number of its end stands below.
        if bar {
            let row = |y: usize| &below[3 * 96 * y..3 * 96 * (y + 1)];
            let (first, last) = (&row(6)[..3], &row(6)[3 * 95..]);
            assert!(first != last || layer == "normal", "{layer}: {first:?} {last:?}");
            let is_text = |pixel: &[u8]| pixel.iter().all(|part| *part < 100);
            assert!((14..27).any(|y| row(y).chunks(3).skip(48).any(is_text)), "{layer}: a number");
        }
    }
    let scene = r#"(entities: [(camera: Pinhole()), (shape: Sphere(radius_m: 1), material: (diffuse: Image("depth.png")))])"#;
    shown.folder.write("picture.ron", scene);
    for (code, line, part) in [
        (2, "view scene.ron --layer nodes", "--output <FILE>"),
        (2, "view scene.ron -o a.png", "--layer <NAME>"),
        (2, "view scene.ron --layer light -o a.png", "light is what rayfront SCENE renders"),
        (2, "view scene.ron --layer nodes -o a.png --port 8421", "cannot be used with"),
        (3, "view scene.ron --layer nodes -o none/a.png", "none/a.png"),
        (2, "view picture.ron --layer nodes -o depth.png", "depth.png is read for this scene"),
    ] {
        shown.folder.fails(code, line, &[part]);
    }
}

/// The OpenEXR file has the radiance of the image that a command renders.
#[test]
fn saved_openexr_has_the_radiance_of_the_rendering() {
    let shown = Shown::new();
    shown.image();
    let (code, bytes) = shown.get("/image.exr?layer=light");
    assert_eq!(code, 200);
    std::fs::write(shown.folder.join("page.exr"), bytes).expect("a file");
    shown.folder.out("scene.ron --quiet -o scene.exr");
    let [page, whole] = ["page.exr", "scene.exr"].map(|name| shown.folder.pixels(name));
    assert!(page == whole);
    // As an image to compare with, it looks the same.
    assert_eq!(shown.get("/reference?exposure=1&tonemap=Agx").0, 204);
    let post = |name: &str, bytes: &[u8]| shown.post(&format!("/reference?name={name}"), bytes);
    assert_eq!(post("a.exr", &std::fs::read(shown.folder.join("scene.exr")).expect("a file")), 200);
    let [(_, image), (_, reference)] =
        ["image", "reference"].map(|path| shown.get(&format!("/{path}?exposure=1&tonemap=Agx")));
    assert!(image == reference);
    assert_eq!(post("a.exr", b"no picture"), 400);
}

/// The forms of a scene, as the page requests them.
fn form(shown: &Shown, target: &str) -> Value {
    let (code, answer) = shown.wish(json!({"form": target}));
    assert_eq!(code, 200, "{answer}");
    serde_json::from_str(answer["said"].as_str().expect("a form")).expect("JSON")
}

#[test]
fn changed_values_show_and_are_saved_where_the_file_has_them() {
    let shown = Shown::new();
    let before = shown.image();
    let (_, listed) = shown.wish(json!({"forms": true}));
    let listed: Value = serde_json::from_str(listed["said"].as_str().expect("a list")).expect("JSON");
    for target in [r#"Material["paint"]"#, r#""lamp".light"#, r#"Camera[name="eye"].camera"#, "settings"] {
        assert!(
            listed.as_array().is_some_and(|all| all.iter().any(|it| it["statement"] == target)),
            "{listed}"
        );
    }
    let power = &form(&shown, r#""lamp".light"#)["fields"][0];
    assert_eq!((&power["path"], &power["value"]), (&json!("power_w"), &json!([300.0, 300.0, 300.0])));
    let set = |statement: &str| shown.wish(json!({"set": statement}));
    assert_eq!(set(r#"Material["paint"].diffuse = (0.1, 0.2, 0.9)"#).0, 200);
    let start = Instant::now();
    shown.when("the change", |status| status["shown"] != json!([0, 0]));
    assert!(start.elapsed() < Duration::from_secs(1));
    assert!(shown.image() != before);
    assert_eq!(set(r#""lamp".light.power_w = 100"#).0, 200);
    assert_eq!(set(r#"Camera[name="eye"].camera.vertical_fov_degrees = 30"#).0, 200);
    assert_eq!(set(r#"settings.samples = 3"#).0, 200);
    // A mistake changes nothing, and names the range.
    let (code, answer) = set(r#"Material["paint"].shininess = -1"#);
    assert!(
        code == 400 && answer["error"].as_str().is_some_and(|error| error.contains("at least 0")),
        "{answer}"
    );
    // A request names no file.
    assert_eq!(set(r#"Material["paint"].diffuse = "/etc/passwd""#).0, 400);
    assert_eq!(set(r#""lamp".light.power_w = 200"#).0, 200);
    let status = shown.when("the image", |status| status["is_done"] == true);
    assert_eq!(status["edits"].as_array().map(Vec::len), Some(4));
    let changed = shown.image();
    assert_eq!(shown.wish(json!({"save_edits": true})).0, 200);
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    let expected = SCENE
        .replace("(0.8, 0.2, 0.1)", "(0.1, 0.2, 0.9)")
        .replace("power_w: 300", "power_w: 200")
        .replace("vertical_fov_degrees: 40", "vertical_fov_degrees: 30")
        .replace("samples: 4", "samples: 3");
    assert_eq!(text, expected);
    assert!(shown.image() == changed && rendered(&shown.scene()) == changed, "the file says what was seen");
    assert_eq!(shown.json("/status")["edits"], json!([]));
    // Taken back.
    assert_eq!(set("settings.samples = 1").0, 200);
    assert_eq!(shown.wish(json!({"undo": "last"})).0, 200);
    assert!(shown.image() == changed);
    assert_eq!(shown.wish(json!({"undo": "all"})).0, 400);
    // Another value leaves nothing of the parts of the one before.
    for value in [" = Checker()", ".scale = (9, 9, 1)", " = Gradient()", ".scale = (2, 2, 1)", " = 0.5"] {
        assert_eq!(set(&format!(r#"Material["paint"].diffuse{value}"#)).0, 200, "{value}");
    }
    assert_eq!(shown.json("/status")["edits"], json!([r#"Material["paint"].diffuse = 0.5"#]));
}

/// A value of a camera that was moved by hand changes from there, and both are saved.
#[test]
fn values_of_a_moved_camera_keep_its_place() {
    let shown = Shown::new();
    assert_eq!(shown.wish(json!({"orbit": [0.2, 0.1]})).0, 200);
    let origin =
        shown.when("a moved camera", |status| status["camera"]["is_moved"] == true)["camera"]["origin"]
            .clone();
    assert_eq!(shown.wish(json!({"set": r#"Camera[name="eye"].camera.vertical_fov_degrees = 30"#})).0, 200);
    let status = shown.json("/status");
    let distance = |axis: usize| {
        (status["camera"]["origin"][axis].as_f64().expect("x") - origin[axis].as_f64().expect("x")).abs()
    };
    assert!(
        (0..3).all(|axis| distance(axis) < 1e-4) && status["camera"]["fov_deg"].as_f64() < Some(30.1),
        "{status}"
    );
    let moved = shown.image();
    assert_eq!(shown.wish(json!({"save_edits": true})).0, 200);
    assert!(shown.image() == moved && rendered(&shown.scene()) == moved);
    assert!(!std::fs::read_to_string(shown.scene()).expect("the scene").contains("edits"));
    // A camera that is saved after both has no value of before.
    assert_eq!(shown.wish(json!({"set": r#"Camera[name="eye"].camera.vertical_fov_degrees = 50"#})).0, 200);
    assert_eq!(shown.wish(json!({"orbit": [0.1, 0.0]})).0, 200);
    let moved = shown.image();
    assert_eq!(shown.wish(json!({"save_camera": true})).0, 200);
    assert!(shown.image() == moved && rendered(&shown.scene()) == moved);
}

/// Values that the file does not write where they belong become statements in its `edits`.
#[test]
fn values_of_shared_materials_and_variables_are_saved_as_edits() {
    let scene = SCENE
        .replace("settings:", "variables: {\"power\": Area(power_w: 300, size_m: 2)},\n    settings:")
        .replace("light: Area(power_w: 300, size_m: 2)", "light: $power");
    let shown = Shown::with(&scene, &[]);
    assert_eq!(shown.wish(json!({"set": r#""lamp".light.power_w = 100"#})).0, 200);
    let darker = shown.image();
    assert_eq!(shown.wish(json!({"save_edits": true})).0, 200);
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    assert!(
        text.contains("// Where we stand.") && text.contains(r#""\"lamp\".light.power_w = 100""#),
        "{text}"
    );
    assert!(rendered(&shown.scene()) == darker);
    assert_eq!(shown.wish(json!({"set": r#""lamp".light.power_w = 50"#})).0, 200);
    let darkest = shown.image();
    assert_eq!(shown.wish(json!({"save_edits": true})).0, 200);
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    assert_eq!(text.matches("power_w =").count(), 1, "{text}");
    assert!(darkest != darker && rendered(&shown.scene()) == darkest);
}

#[test]
fn animated_scenes_are_shown_at_any_time() {
    let scene = SCENE.replace("power_w: 300", "power_w: Keys([(0, 300), (4, 30)])");
    let shown = Shown::with(&scene, &[]);
    let first = shown.image();
    assert_eq!(shown.json("/status")["time"]["end_s"], 4.0);
    assert_eq!(shown.wish(json!({"time_s": 4.0})).0, 200);
    assert!(shown.image() != first);
    shown.folder.out("scene.ron --quiet --time 4 -o last.png");
    let last = image::open(shown.folder.join("last.png")).expect("a picture").into_rgb8().into_raw();
    assert!(shown.image() == last);
    let still = Shown::new();
    assert_eq!(still.json("/status")["time"], Value::Null);
}

/// A shape, a place and a texture change within a second, and are saved where the file has them.
#[test]
fn shapes_transforms_and_textures_are_saved_where_the_file_has_them() {
    let scene = SCENE.replace("diffuse: (0.8, 0.2, 0.1)", "diffuse: Checker(scale: 4 /* wide */)");
    let shown = Shown::with(&scene, &[]);
    let before = shown.image();
    let fields = form(&shown, r#"Material["paint"]"#)["fields"].clone();
    let diffuse = fields.as_array().and_then(|all| all.iter().find(|field| field["path"] == "diffuse"));
    assert_eq!(diffuse.map(|field| &field["value"]), Some(&json!("Checker")));
    let moved = &form(&shown, r#""lamp".transform"#)["fields"][0];
    assert_eq!((&moved["kind"], &moved["unit"]), (&json!("vector"), &json!("m")));
    let set = |statement: &str| assert_eq!(shown.wish(json!({"set": statement})).0, 200, "{statement}");
    set(r#"Material["paint"].diffuse.scale = (9, 9, 1)"#);
    let start = Instant::now();
    shown.when("the change", |status| status["shown"] != json!([0, 0]));
    assert!(start.elapsed() < Duration::from_secs(1));
    set(r#""ball".shape.radius_m = 0.75"#);
    set(r#""ball".transform.translate = (0.25, 0, 0)"#);
    let changed = shown.image();
    assert!(changed != before);
    assert_eq!(shown.wish(json!({"save_edits": true})).0, 200);
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    assert!(
        text.contains("Checker(scale: (9, 9, 1) /* wide */)") && text.contains("radius_m: 0.75"),
        "{text}"
    );
    assert!(text.contains("(0.25, 0, 0)") && text.contains("// Where we stand."), "{text}");
    assert!(rendered(&shown.scene()) == changed, "the file says what was seen");
}

/// The boxes of the tree move with the camera, and have levels up to the last one.
#[test]
fn boxes_of_the_tree_are_lines_over_the_image() {
    let shown = Shown::new();
    shown.image();
    let whole = shown.json("/boxes?level=0");
    assert_eq!(
        (&whole["level"], &whole["count"], &whole["is_complete"]),
        (&json!(0), &json!(1), &json!(true))
    );
    let lines = whole["boxes"][0][1].as_array().expect("lines");
    assert!((1..=12).contains(&lines.len()), "{whole}");
    let last = shown.json("/boxes?level=99");
    assert_eq!(last["level"], last["last"]);
    assert!(last["boxes"].as_array().is_some_and(|all| all.iter().any(|it| it[0] == 1)), "{last}");
    assert_eq!(shown.wish(json!({"orbit": [0.1, 0.0]})).0, 200);
    shown.when("another camera", |status| status["camera"]["is_moved"] == true && status["is_done"] == true);
    let moved = shown.json("/boxes?level=0");
    assert!(moved["boxes"] != whole["boxes"] && moved["generation"] != whole["generation"]);
    assert_eq!(shown.get("/boxes?level=-1").0, 400);
}

/// A wave is followed where one asks for it, with rays in the image and the materials by name.
#[test]
fn steps_of_a_wave_show_its_rays_and_materials() {
    let shown = Shown::new();
    shown.image();
    let all = shown.json("/steps?x=0&y=0");
    assert_eq!((&all["region"][0], &all["region"][1]), (&json!(0), &json!(0)));
    let steps = all["steps"].as_array().expect("steps");
    let stages: Vec<&str> = steps.iter().filter_map(|step| step["stage"].as_str()).collect();
    assert_eq!(stages[..3], ["generate", "intersect", "retire"]);
    assert_eq!(stages.last(), Some(&"advance"));
    let traced = &steps[1];
    assert_eq!(traced["rays"].as_array().map(Vec::len), traced["entering"].as_u64().map(|it| it as usize));
    // A ray of the camera lies at its pixel.
    assert_eq!(traced["rays"][0][2], json!([[0.5, 0.5, 0.5, 0.5]]));
    let names: Vec<&str> =
        all["materials"].as_array().expect("materials").iter().filter_map(|it| it[1].as_str()).collect();
    assert!(!names.is_empty() && names.iter().all(|name| !name.is_empty()), "{names:?}");
    // Beyond the image, the last block.
    assert!(shown.json("/steps?x=99999&y=99999")["steps"].as_array().is_some_and(|it| !it.is_empty()));
    assert_eq!(shown.get("/steps?x=-1&y=0").0, 400);
}
