//! `rayfront view` from outside: its pages and their access control, its commands, and edits of the scene's file.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::program::{Folder, Place, folder};

const PATIENCE: Duration = Duration::from_secs(60);

/// A scene in a folder of its own.
pub const SCENE: &str = r#"(
    settings: (size: (96, 54), samples: 4, transport: Path),
    materials: { "paint": (diffuse: (0.8, 0.2, 0.1)) },
    entities: [
        // Where we stand.
        (name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 6), to: (0, 0, 0))),
        (name: "floor", shape: Plane(corners: ((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4)))),
        (name: "ball", shape: Sphere(radius_m: 1), material: "paint"),
        (name: "lamp", light: Area(power_w: 300, size_m: 2), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

/// A model of a camera alone.
const EYE: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"name": "eye", "camera": 0, "translation": [0, 1, 6], "rotation": [-0.08, 0, 0, 0.9968]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]}"#;

/// The running program.
pub struct Shown {
    program: Child,
    pub folder: Folder,
    /// `http://127.0.0.1:PORT`.
    base: String,
    token: String,
}

impl Drop for Shown {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Shown {
    pub fn new() -> Shown {
        Shown::with(SCENE, &[])
    }

    pub fn with(scene: &str, options: &[&str]) -> Shown {
        let folder = folder(scene);
        folder.write("eye.gltf", EYE);
        let mut program = folder
            .command("view scene.ron --no-open --threads 2")
            .args(options)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("rayfront");
        let mut line = String::new();
        BufReader::new(program.stdout.take().expect("its output")).read_line(&mut line).expect("an address");
        let (base, token) = line.trim().split_once("/?token=").expect("an address with a token");
        Shown { base: base.into(), token: token.into(), program, folder }
    }

    pub fn address(&self) -> String {
        format!("{}/?token={}", self.base, self.token)
    }

    pub fn scene(&self) -> PathBuf {
        self.folder.join("scene.ron")
    }

    pub fn get(&self, path: &str) -> (u16, Vec<u8>) {
        let joint = if path.contains('?') { '&' } else { '?' };
        get(&format!("{}{path}{joint}token={}", self.base, self.token), None)
    }

    pub fn json(&self, path: &str) -> Value {
        let (code, body) = self.get(path);
        assert_eq!(code, 200, "{path}: {}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).expect("JSON")
    }

    /// Sends a command and returns the response.
    pub fn wish(&self, wish: Value) -> (u16, Value) {
        let address = format!("{}/do?token={}", self.base, self.token);
        let mut response = agent().post(&address).send(wish.to_string()).expect("an answer");
        let text = response.body_mut().read_to_string().expect("text");
        (response.status().as_u16(), serde_json::from_str(&text).expect("JSON"))
    }

    /// Sends bytes and returns the code of the response.
    pub fn post(&self, path: &str, bytes: &[u8]) -> u16 {
        let address = format!("{}{path}&token={}", self.base, self.token);
        agent().post(&address).send(bytes).expect("an answer").status().as_u16()
    }

    /// Polls the status until a condition holds, and returns it.
    pub fn when(&self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let status = self.json("/status");
            if is_so(&status) {
                return status;
            }
            assert!(start.elapsed() < PATIENCE, "{what} has not come: {status}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// The finished image as the page receives it, without the fourth byte.
    pub fn image(&self) -> Vec<u8> {
        self.when("the image", |status| status["is_done"] == true);
        let (code, pixels) = self.get("/image?layer=light&exposure=0&tonemap=Clamp");
        assert_eq!((code, pixels.len()), (200, 96 * 54 * 4));
        pixels.chunks(4).flat_map(|pixel| pixel[..3].to_vec()).collect()
    }
}

/// A scene without black pixels, of some size.
pub fn bright(size: &str) -> String {
    let sky = "entities: [(name: \"sky\", light: Environment(radiance: 1)),";
    let text = SCENE.replace("(96, 54)", size).replace("entities: [", sky);
    // A rectangle's back is black.
    text.replace("Area(power_w: 300, size_m: 2)", "Point(power_w: 30)")
}

fn agent() -> ureq::Agent {
    ureq::Agent::config_builder().http_status_as_error(false).timeout_global(Some(PATIENCE)).build().into()
}

/// Sends a request, optionally with another host name, and returns the response.
fn get(address: &str, host: Option<&str>) -> (u16, Vec<u8>) {
    let request = agent().get(address);
    let request = if let Some(host) = host { request.header("Host", host) } else { request };
    let mut response = request.call().expect("an answer");
    (response.status().as_u16(), response.body_mut().read_to_vec().expect("a body"))
}

/// The pixels of the scene rendered without the page.
pub fn rendered(scene: &Path) -> Vec<u8> {
    let folder = scene.parent().expect("a folder");
    folder.out("scene.ron --quiet -o scene.png");
    image::open(folder.join("scene.png")).expect("a picture").into_rgb8().into_raw()
}

#[test]
fn view_serves_the_rendered_image_and_only_with_the_token() {
    let shown = Shown::new();
    assert!(shown.image() == rendered(&shown.scene()), "what is shown is what is rendered");
    let (code, page) = get(&shown.address(), None);
    let page = String::from_utf8_lossy(&page);
    assert!(code == 200 && page.contains(&shown.token) && !page.contains("{token}"));
    for name in ["page.js", "page.css"] {
        assert_eq!(shown.get(&format!("/{name}")).0, 200);
    }
    // Access without the token, with another host, or to other files is denied.
    assert_eq!(get(&format!("{}/", shown.base), None).0, 403);
    assert_eq!(get(&format!("{}/image?token=0123", shown.base), None).0, 403);
    assert_eq!(get(&shown.address(), Some("rebound.example:8421")).0, 403);
    assert_eq!(get(&shown.address(), Some("localhost:9000")).0, 200, "as through ssh -L");
    assert_eq!(shown.get("/scene.ron").0, 404);
    assert_eq!(shown.get("/../scene.ron").0, 404);
    for wrong in ["/image?layer=secrets", "/image?exposure=bright", "/image?tonemap=Film"] {
        assert_eq!(shown.get(wrong).0, 400, "{wrong}");
    }
    assert_eq!(shown.get("/pixel?x=96&y=0").0, 404);
    assert_eq!(shown.wish(json!({"read": "/etc/passwd"})).0, 400);
}

#[test]
fn view_serves_all_layers_and_explains_pixels() {
    let shown = Shown::new();
    shown.image();
    let layers = [
        "light", "denoised", "depth", "normal", "albedo", "entity", "material", "noise", "samples", "nodes",
        "tests", "path-length", "time",
    ];
    for layer in layers {
        let (code, pixels) = shown.get(&format!("/image?layer={layer}&exposure=auto"));
        assert_eq!((code, pixels.len()), (200, 96 * 54 * 4), "{layer}");
        let differs = layer == "samples" || pixels.chunks(4).any(|pixel| pixel != &pixels[..4]);
        assert!(differs, "{layer} is the same everywhere");
    }
    let pixel = shown.json("/pixel?x=48&y=30");
    assert_eq!((&pixel["entity"], &pixel["material"]), (&json!("ball"), &json!("paint")));
    let explained = shown.json("/explain?x=48&y=30&sample=1");
    assert_eq!((&explained["agrees"], &explained["sample"]), (&json!(true), &json!(1)));
    let first = &explained["paths"][0]["steps"][0];
    assert_eq!(first["vertex"]["entity"], "ball");
    let [x, y] = [0, 1].map(|axis| first["to"][axis].as_f64().expect("a place in the image"));
    assert!((x - 48.5).abs() <= 1.0 && (y - 30.5).abs() <= 1.0, "the vertex lies in its pixel: {x}, {y}");
    assert_eq!(first["vertex"]["lights"][0]["light"], "lamp");
}

/// A scene with a glass ball and a box filter, so that each pixel gathers its own samples only.
pub fn glass() -> String {
    SCENE
        .replace("(diffuse: (0.8, 0.2, 0.1))", "(ior: 1.5)")
        .replace("samples: 4,", "samples: 4, filter: Box,")
}

/// The photons that the page shows lie on the floor, in the pixels where the renderer draws them, in equal number.
#[test]
fn photons_on_the_page_match_those_of_the_renderer() {
    let shown = Shown::with(&glass(), &["--caustics", "1"]);
    shown.when("the image", |status| status["is_done"] == true);
    let status = shown.json("/status");
    assert_eq!(status["photons"], json!({"a_sample": 96 * 54, "none": null}));
    let found = shown.json("/photons?sample=2");
    let number = |name: &str| found[name].as_u64().expect(name);
    assert_eq!((number("emitted"), number("sample"), &found["none"]), (96 * 54, 2, &Value::Null));
    assert!(number("emitted") >= number("landed") && number("landed") >= number("in_picture"), "{found}");
    assert!(number("in_picture") > number("seen") && number("seen") > 50, "{found}");
    let points = found["points"].as_array().expect("points");
    assert_eq!(points.len() as u64, number("in_picture"));
    // The photons visible to the camera, by pixel.
    let mut counts = std::collections::BTreeMap::new();
    for point in points.iter().filter(|point| point[5] == 1) {
        let place = [0, 1].map(|axis| point[axis].as_f64().expect("a place") as u32);
        *counts.entry(place).or_insert(0) += 1;
    }
    let most = counts.iter().max_by_key(|(_, count)| **count).map(|(place, _)| *place).expect("a pixel");
    let (mut on_floor, mut looked_at) = (0, 0);
    for [x, y] in [most, [0, 0]].into_iter().chain(counts.keys().step_by(counts.len() / 12).copied()) {
        let explained = shown.json(&format!("/explain?x={x}&y={y}&sample=2"));
        let count = counts.get(&[x, y]).copied().unwrap_or(0);
        assert_eq!(explained["photons"]["count"], count, "{x}, {y}");
        assert_eq!(explained["agrees"], true);
        if count > 0 {
            looked_at += 1;
            on_floor += u32::from(shown.json(&format!("/pixel?x={x}&y={y}"))["entity"] == "floor");
        }
    }
    // In a pixel at the edge of the ball, the floor may cover the smaller part.
    assert!(2 * on_floor > looked_at, "{on_floor} of {looked_at}");
    // A path through the ball gathers them.
    let explained = shown.json("/explain?x=42&y=38&sample=2");
    assert!(explained["paths"][0]["steps"][1]["vertex"]["photons"][0].as_f64() > Some(0.01), "{explained}");
    // Photons depend only on the sample, the scene and its settings.
    assert!(
        shown.json("/photons?sample=2") == found
            && shown.json("/photons?sample=1")["points"] != found["points"]
    );
    assert_eq!(shown.wish(json!({"orbit": [0.1, 0.0]})).0, 200);
    let status = shown
        .when("another camera", |status| status["camera"]["is_moved"] == true && status["is_done"] == true);
    let moved = shown.json("/photons?sample=2");
    assert!(moved["generation"] == status["generation"] && moved["points"] != found["points"]);
}

/// The page receives as many photons as it can show, and their total number.
#[test]
fn photons_on_the_page_are_limited_in_number() {
    let shown = Shown::with(&glass(), &["--caustics", "6", "--spp", "1"]);
    shown.when("the image", |status| status["is_done"] == true);
    let found = shown.json("/photons");
    assert_eq!(found["points"].as_array().map(Vec::len), Some(4000));
    assert!(found["in_picture"].as_u64() > Some(4000), "{}", found["in_picture"]);
}

#[test]
fn page_gives_the_reason_for_missing_photons() {
    let glass = glass();
    for (scene, options, why) in [
        (SCENE, &[][..], "no material throws light"),
        (&glass, &["--caustics", "off"], "caustics are off"),
        (&glass, &["--transport", "whitted"], "only if asked for"),
        (&glass, &["--depth", "0"], "no bounces"),
        (&glass, &["--hide", "Light", "--caustics", "1"], "no lamp"),
    ] {
        let shown = Shown::with(scene, options);
        let status = shown.when("the first pass", |status| !status["photons"].is_null());
        let none = status["photons"]["none"].as_str().unwrap_or_default();
        assert!(none.contains(why) && status["photons"]["a_sample"] == 0, "{options:?}: {status}");
        let found = shown.json("/photons");
        assert!(found["none"] == none && found["points"] == json!([]) && found["landed"] == 0, "{found}");
    }
}

/// The command printed by the page explains the sample that the page shows, with any options and changes.
#[cfg(unix)]
#[test]
fn printed_command_explains_the_sample_of_the_page() {
    let hangs = SCENE.replace(
        "(name: \"eye\",",
        "(name: \"crane\", transform: (translate: (0, 0.25, 0))), (name: \"eye\", parent: \"crane\",",
    );
    let of_scene = |scene: &str, options: &[&str], wishes: &[Value]| {
        let shown = Shown::with(scene, options);
        for wish in wishes {
            let (code, answer) = shown.wish(wish.clone());
            assert_eq!(code, 200, "{wish}: {answer}");
        }
        shown.when("the image", |status| status["is_done"] == true);
        let explained = shown.json("/explain?x=38&y=23&sample=2");
        let command = explained["command"].as_str().expect("a command").to_owned();
        let typed = crate::printed::typed(&shown.folder, &command, "--json");
        let typed: Value = serde_json::from_str(&typed).expect("JSON");
        let is_same = typed["samples"][0]["radiance"] == explained["radiance"];
        (command, is_same && explained["radiance"][0].as_f64() > Some(0.0))
    };
    let settings = json!({"settings": {"depth": 3, "spp": 7, "sharing": false, "sampler": "independent"}});
    let (orbit, zoom) = (json!({"orbit": [0.1, 0.05]}), json!({"zoom": 1.2}));
    let all = ["--set", "Material[\"paint\"].diffuse = (0.1, 0.9, 0.2)", "--env", "sky", "--size", "64x40"];
    let turned = ["--orbit", "-10,5", "--diffuse-depth", "2", "--transport", "path", "--seed", "9"];
    for (options, wishes) in [
        (&[][..], &[][..]),
        (&all, &[]),
        (&turned, &[]),
        (&turned, &[orbit.clone(), zoom.clone()]),
        (&all, &[settings.clone(), orbit.clone(), json!({"fov_deg": 30.0})]),
        (&[], &[json!({"settings": {"transport": "whitted"}}), zoom]),
    ] {
        let (command, is_same) = of_scene(SCENE, options, wishes);
        assert!(is_same && !command.contains('#'), "{options:?} {wishes:?}: {command}");
    }
    let (command, is_same) = of_scene(&hangs, &[], &[settings]);
    assert!(is_same && !command.contains('#'), "{command}");
    // No option moves a camera with a parent, so the command states that its camera differs.
    let (command, is_same) = of_scene(&hangs, &[], &[orbit]);
    assert!(!is_same && command.ends_with("# but that the camera is where its file says"), "{command}");
}

#[test]
fn saved_camera_renders_the_image_of_the_page() {
    let shown = Shown::new();
    let before = shown.image();
    let (code, _) = shown.wish(json!({"orbit": [0.1, 0.05]}));
    assert_eq!(code, 200);
    assert_eq!(shown.wish(json!({"zoom": 1.2})).0, 200);
    let status = shown.when("a moved camera", |status| status["camera"]["is_moved"] == true);
    assert_eq!(status["can_save"], true);
    let moved = shown.image();
    assert!(moved != before);
    assert_eq!(shown.wish(json!({"save_camera": true})).0, 200);
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    assert!(text.contains("// Where we stand.") && text.contains("\"paint\": (diffuse: (0.8, 0.2, 0.1))"));
    assert!(rendered(&shown.scene()) == moved, "the file says what was seen");
    // And back again.
    assert_eq!(shown.wish(json!({"orbit": [0.3, 0.0]})).0, 200);
    assert_eq!(shown.wish(json!({"reset": true})).0, 200);
    assert!(shown.image() == moved);
    let (code, refused) = shown.wish(json!({"camera": "ear"}));
    assert!(code == 400 && refused["error"].as_str().is_some_and(|error| error.contains("eye")), "{refused}");
}

#[test]
fn included_files_are_watched_and_a_camera_is_saved_in_them() {
    let shown = Shown::new();
    shown.image();
    let changed = |path: &Path, text: &str| {
        let serial = shown.json("/status")["serial"].as_u64();
        std::fs::write(path, text).expect("a file");
        shown.when("the change", |status| status["serial"].as_u64() > serial && status["is_done"] == true);
        shown.image()
    };
    let eye = SCENE.lines().find(|line| line.contains("\"eye\"")).expect("the camera");
    let part = shown.scene().with_file_name("eye.ron");
    let eye_file = format!("(variables: {{\"angle\": 40}}, entities: [\n{}\n])", eye.replace("40", "$angle"));
    std::fs::write(&part, &eye_file).expect("a part");
    let whole = shown.image();
    let scene = SCENE.replace(eye, "").replace("materials:", "include: [\"eye.ron\"],\n    materials:");
    assert!(changed(&shown.scene(), &scene) == whole, "parts render as the whole");
    let wide = changed(&part, &eye_file.replace(": 40", ": 60"));
    assert!(wide != whole);
    assert_eq!(shown.wish(json!({"orbit": [0.1, 0.05]})).0, 200);
    let moved = shown.image();
    assert!(moved != wide && shown.json("/status")["can_save"] == true);
    assert_eq!(shown.wish(json!({"save_camera": true})).0, 200);
    assert_eq!(std::fs::read_to_string(shown.scene()).expect("the scene"), scene);
    let saved = std::fs::read_to_string(&part).expect("the part");
    assert!(
        saved.starts_with("(variables: {\"angle\": 60}, entities: [") && !saved.contains("$angle"),
        "{saved}"
    );
    assert!(rendered(&shown.scene()) == moved, "the files say what was seen");
}

#[test]
fn edits_are_rendered_and_invalid_ones_reported_without_losing_the_image() {
    let shown = Shown::new();
    shown.image();
    assert_eq!(shown.wish(json!({"orbit": [0.1, 0.0]})).0, 200);
    let moved = shown.image();
    let edit = |from: &str, to: &str| {
        let serial = shown.json("/status")["serial"].as_u64();
        std::fs::write(shown.scene(), SCENE.replace(from, to)).expect("an edit");
        serial
    };
    let serial = edit("(0.8, 0.2, 0.1)", "(0.1, 0.2, 0.8)");
    shown.when("the edit", |status| status["serial"].as_u64() > serial && status["is_done"] == true);
    let blue = shown.image();
    assert!(blue != moved);
    assert_eq!(shown.json("/status")["camera"]["is_moved"], true, "a hand's camera stays");
    edit("diffuse", "diffues");
    // Not the error of an early end of file: the file may be read while it is being written.
    let is_told =
        |status: &serde_json::Value| status["error"].as_str().is_some_and(|error| error.contains(":3:"));
    let status = shown.when("the mistake", is_told);
    let error = status["error"].as_str().unwrap_or_default();
    assert!(error.contains("scene.ron:3:") && error.contains("did you mean \"diffuse\""), "{error}");
    assert!(shown.image() == blue, "the last good image stays");
    edit("(0.8, 0.2, 0.1)", "(0.1, 0.2, 0.8)");
    shown.when("its mending", |status| status["error"].is_null());
    assert!(shown.image() == blue);
    // Like editors that replace the file. Its camera differs, so it is used.
    let serial = shown.json("/status")["serial"].as_u64();
    let other = shown.scene().with_extension("new");
    std::fs::write(&other, SCENE.replace("(0, 1, 6)", "(0, 1, 5)")).expect("another file");
    std::fs::rename(&other, shown.scene()).expect("a rename");
    shown.when("the other file", |status| {
        status["serial"].as_u64() > serial
            && status["camera"]["is_moved"] == false
            && status["is_done"] == true
    });
    assert!(shown.image() == rendered(&shown.scene()));
}

#[test]
fn settings_can_be_changed_and_schedules_give_the_same_image() {
    let shown = Shown::new();
    let wavefront = shown.image();
    assert_eq!(shown.wish(json!({"settings": {"schedule": "recursive"}})).0, 200);
    let status = shown.when("the other schedule", |status| status["settings"]["schedule"] == "recursive");
    assert!(status["queues"].is_null(), "it has no queues");
    assert!(shown.image() == wavefront);
    assert_eq!(shown.wish(json!({"settings": {"schedule": "wavefront", "depth": 0, "spp": 2}})).0, 200);
    shown.when("two samples", |status| status["wanted"] == 2);
    assert!(shown.image() != wavefront);
    let status = shown.when("queues", |status| !status["queues"].is_null());
    assert_eq!(status["queues"]["stages"].as_array().map(Vec::len), Some(9));
    for wrong in [json!({"settings": {"depth": 100_000}}), json!({"settings": {"schedule": "fast"}})] {
        assert_eq!(shown.wish(wrong).0, 400);
    }
}

/// The image during the first pass: finished small pixels next to large preliminary ones.
#[test]
fn images_of_an_unfinished_first_pass_have_few_black_pixels() {
    let shown = Shown::new();
    shown.image();
    let (mut partly, mut black_of, mut generation) = (0, 0, shown.json("/status")["generation"].as_u64());
    let changes: [&dyn Fn(); 4] = [
        &|| std::fs::write(shown.scene(), bright("(1920, 1080)")).expect("an edit"),
        &|| assert_eq!(shown.wish(json!({"orbit": [0.1, 0.0]})).0, 200),
        &|| assert_eq!(shown.wish(json!({"save_camera": true})).0, 200),
        &|| assert_eq!(shown.wish(json!({"settings": {"spp": 3}})).0, 200),
    ];
    for change in changes {
        change();
        let begun = shown.when("a change", |status| status["generation"].as_u64() > generation);
        shown.when("a picture of it", |status| status["serial"].as_u64() > begun["serial"].as_u64());
        loop {
            let layer = ["light", "denoised"][black_of % 2];
            black_of += 1;
            let parts = format!("layer={layer}&exposure=0&tonemap=Clamp&token={}", shown.token);
            let mut response =
                agent().get(&format!("{}/image?{parts}", shown.base)).call().expect("an answer");
            let header = |name: &str| response.headers()[name].to_str().expect("text").parse::<f64>();
            let (width, samples) =
                (header("x-width").expect("a width"), header("x-samples").expect("samples"));
            let pixels = response.body_mut().read_to_vec().expect("a picture");
            let black = pixels.chunks(4).filter(|pixel| pixel[..3] == [0; 3]).count();
            // Single samples may be black.
            assert!(20 * black < pixels.len() / 4, "{black} pixels are black at {samples} samples");
            let is_whole = width == 1920.0;
            partly += u32::from(is_whole && samples < 1.0);
            if is_whole && samples >= 1.0 {
                break;
            }
        }
        generation = shown.json("/status")["generation"].as_u64();
    }
    assert!(partly > 1, "only {partly} pictures were partly done");
}

#[test]
fn incomplete_requests_time_out_and_other_origins_are_denied() {
    use std::io::{Read, Write};

    let shown = Shown::new();
    let (host, token) = (shown.base.strip_prefix("http://").expect("an address"), &shown.token);
    let halves = [
        String::new(),
        "GET /status HTTP/1.1\r\nHost: local".into(),
        format!("POST /do?token={token} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 99\r\n\r\n{{\"pause"),
    ];
    let start = Instant::now();
    let streams = halves.map(|half| {
        let mut stream = std::net::TcpStream::connect(host).expect("a connection");
        stream.write_all(half.as_bytes()).expect("half a request");
        stream.set_read_timeout(Some(PATIENCE)).expect("a limit");
        stream
    });
    for mut stream in streams {
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("it is closed");
        let answer = String::from_utf8_lossy(&answer);
        assert!(answer.is_empty() || answer.contains(" 408 "), "{answer}");
        assert!(start.elapsed() < PATIENCE / 2);
    }
    let from = |origin: &str| {
        agent().get(shown.address()).header("Origin", origin).call().expect("an answer").status()
    };
    assert_eq!(from(&shown.base), 200);
    assert!(["http://evil.example", "null"].iter().all(|origin| from(origin) == 403));
}
