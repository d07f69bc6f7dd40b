//! Hostile files, faulty machines and small limits: no panic, no damaged file, no exhaustion of the machine's memory,
//! no leak of private data. The table in `src/cli/SERVICE.md` names these tests.

mod faults;
mod finds;
mod limits;
mod load;
mod outputs;

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// A scene with a camera and a light, and more entities or settings.
fn scene(settings: &str, entities: &str) -> String {
    format!(
        r#"(settings: (size: (16, 12), samples: 2, {settings}), entities: [
            (name: "eye", camera: Pinhole(vertical_fov_degrees: 45), transform: LookAt(from: (0, 1, 5), to: (0, 0, 0))),
            (name: "lamp", light: Area(power_w: 300, size_m: 1), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
            {entities}
        ])"#
    )
}

/// A scene with a ball of some material.
fn ball(material: &str) -> String {
    scene("", &format!("(shape: Sphere(radius_m: 1), material: ({material})),"))
}

/// A folder with `scene.ron`.
fn folder(scene: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.ron"), scene).expect("a file");
    folder
}

/// Runs the program, which must end soon.
fn run<S: AsRef<std::ffi::OsStr>>(folder: &Path, arguments: &[S]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfront"));
    ended(command.current_dir(folder).args(arguments))
}

/// Runs a line in a shell, in which `rayfront` is the program.
fn shell(folder: &Path, line: &str) -> Output {
    let mut command = Command::new("bash");
    let program = format!("rayfront() {{ {} \"$@\"; }}\n{line}", env!("CARGO_BIN_EXE_rayfront"));
    ended(command.current_dir(folder).args(["-c", &program]))
}

fn ended(command: &mut Command) -> Output {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let start = Instant::now();
    // Its output fits into the pipes.
    while child.try_wait().expect("a state").is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().expect("to kill it");
            panic!("it does not end: {command:?}");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    child.wait_with_output().expect("its output")
}

#[track_caller]
fn expect(output: &Output, code: i32, words: &[&str]) -> String {
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{error}");
    for word in words {
        assert!(error.contains(word), "no {word:?} in {error}");
    }
    error
}

/// File names need not be UTF-8.
#[test]
fn paths_are_any_bytes() {
    let name = |end: &str| OsString::from_vec([b"b\xff.", end.as_bytes()].concat());
    let folder = folder(&ball(""));
    let here = folder.path();
    std::fs::rename(here.join("scene.ron"), here.join(name("ron"))).expect("renamed");
    std::fs::write(here.join(name("rays")), [0; 32]).expect("a file");
    let words = |line: &str| -> Vec<OsString> {
        let words = line.split(' ').map(|word| match word.strip_prefix('@') {
            Some(end) => name(end),
            None => word.into(),
        });
        words.collect()
    };
    for line in [
        "@ron --json -o @png -o @film --aov entity",
        "@ron --json --denoise -o @exr",
        "info @ron --json",
        "info @ron",
        "trace @ron --rays @rays --json",
        "compare @png @png --json",
        "verify @ron --size 8x6 --spp 1 --json",
        "explain @ron 3,3 --json",
        "profile @ron --size 8x6 --spp 1 --runs 1 --json",
        "resume @film --scene-file @ron --json -o @hdr",
        "merge @film --scene-file @ron --json -o @png",
        "ab @ron --hide Light --spp 2 --json -o @png",
        "ls @ron --json",
        "diff @ron @ron",
        "check @ron --json",
        "reproduce @exr --scene-file @ron --json",
    ] {
        let output = run(here, &words(line));
        assert_eq!(output.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        if line.contains("--json") {
            let text = std::str::from_utf8(&output.stdout).expect("UTF-8");
            assert!(serde_json::from_str::<serde_json::Value>(text).is_ok(), "{line}: {text}");
        }
    }
}

const SECRET: &str = "root:$6$salt$hash:19000:0:99999:7:::";

/// A folder `inner` with scenes of every kind that refer to files outside it.
fn prying() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    std::fs::create_dir(folder.path().join("inner")).expect("a folder");
    let picture =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/checker.png")).expect("a picture");
    std::fs::write(folder.path().join("secret.png"), picture).expect("a file");
    write("secret.mtl", &format!("{SECRET}\nnewmtl m\nKd 1 0 0\n"));
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    write("secret.obj", &format!("{triangle}f 1 2 3\n"));
    write("inner/image.ron", &ball(r#"diffuse: Image("../secret.png")"#));
    let absolute = folder.path().join("secret.png");
    write("inner/absolute.ron", &ball(&format!("diffuse: Image({absolute:?})")));
    write("inner/mesh.ron", &scene("", r#"(shape: Mesh("../secret.obj")),"#));
    write("inner/library.obj", &format!("mtllib ../secret.mtl\n{triangle}usemtl m\nf 1 2 3\n"));
    write("inner/a.mtl", "newmtl m\nmap_Kd ../secret.png\n");
    write("inner/texture.obj", &format!("mtllib a.mtl\n{triangle}usemtl m\nf 1 2 3\n"));
    std::os::unix::fs::symlink("../secret.png", folder.path().join("inner/link.png")).expect("a link");
    write("inner/link.ron", &ball(r#"diffuse: Image("link.png")"#));
    let gltf = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "images": [{"uri": "IMAGE"}], "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    write("inner/link.gltf", &gltf.replace("IMAGE", "link.png"));
    write("inner/up.gltf", &gltf.replace("IMAGE", "../secret.png"));
    folder
}

#[test]
fn scenes_read_no_file_outside_of_their_folder() {
    let folder = prying();
    let inner = folder.path().join("inner");
    let files = [
        "image.ron",
        "absolute.ron",
        "mesh.ron",
        "library.obj",
        "texture.obj",
        "link.ron",
        "link.gltf",
        "up.gltf",
    ];
    for file in files {
        let output = run(&inner, &[file, "--size", "8x6", "-s", "1", "-o", "a.png"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("--allow-outside"), "{file}: {said}");
        assert!(!said.contains("root") && !said.contains("salt"), "{file}: {said}");
        // (A model without its images is still valid.)
        let code = if file.ends_with(".ron") || file == "up.gltf" { 1 } else { 0 };
        assert_eq!(output.status.code(), Some(code), "{file}: {said}");
        let output = run(&inner, &[file, "--allow-outside", "--size", "8x6", "-s", "1", "-o", "a.png"]);
        let said = expect(&output, 0, &[]);
        assert!(
            !said.contains("outside") && !said.contains("root") && !said.contains("salt"),
            "{file}: {said}"
        );
    }
    // Files named on the command line may lie anywhere, and a marker file makes a larger folder the scene's.
    let output =
        run(&inner, &["library.obj", "--env", "../secret.png", "--size", "8x6", "-s", "1", "-o", "a.png"]);
    expect(&output, 0, &[]);
    std::fs::write(folder.path().join(".rayfront-root"), "").expect("a file");
    for file in files.iter().filter(|file| **file != "up.gltf") {
        let said = expect(&run(&inner, &["info", file]), 0, &[]);
        assert!(!said.contains("outside"), "{file}: {said}");
    }
}

/// The author of a film does not choose which images are replaced.
#[test]
fn a_film_replaces_no_picture_but_its_own() {
    let folder = folder(&ball(""));
    let here = folder.path();
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    expect(&run(here, &words("scene.ron -q -o a.film -o mine.png")), 0, &[]);
    expect(&run(here, &words("resume a.film -q")), 0, &[]);
    let picture =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/checker.png")).expect("a picture");
    std::fs::write(here.join("mine.png"), &picture).expect("a file");
    expect(&run(here, &words("resume a.film -q")), 3, &["mine.png", "holds something else", "-o"]);
    assert_eq!(std::fs::read(here.join("mine.png")).expect("a file"), picture);
    expect(&run(here, &words("resume a.film -q -o mine.png")), 0, &[]);
}

/// Files that never end are not opened for reading.
#[test]
fn devices_and_pipes_are_no_files() {
    let folder = folder(&ball(""));
    let here = folder.path();
    let write = |name: &str, text: &str| std::fs::write(here.join(name), text).expect("a file");
    assert_eq!(shell(here, "mkfifo pipe.png pipe.ron pipe.film pipe.rays").status.code(), Some(0));
    write("zero.ron", &ball(r#"diffuse: Image("/dev/zero")"#));
    write("pipe_image.ron", &ball(r#"diffuse: Image("pipe.png")"#));
    write("zero.obj", "mtllib zero.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::os::unix::fs::symlink("/dev/zero", here.join("zero.mtl")).expect("a link");
    write("b.mtl", "newmtl m\nmap_Kd pipe.png\n");
    write("pipe.obj", "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
    for (line, code) in [
        ("zero.ron", 1),
        ("pipe_image.ron", 1),
        ("pipe.ron -o a.png", 1),
        ("info zero.obj", 0),
        ("info pipe.obj", 0),
        ("resume pipe.film", 1),
        ("merge pipe.film -o a.png", 1),
        ("compare pipe.png pipe.png", 1),
        ("trace scene.ron --rays pipe.rays", 1),
        ("trace scene.ron --rays /dev/zero", 1),
        ("scene.ron --env pipe.png", 1),
        ("study pipe.ron", 1),
    ] {
        let words: Vec<&str> = line.split(' ').chain(["--allow-outside"]).collect();
        let output = run(here, &words);
        let said = [&output.stdout[..], &output.stderr[..]].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(code), "{line}: {said}");
        assert!(said.contains("this is a device, a pipe or the like"), "{line}: {said}");
    }
}

/// Control characters are printed in escaped form.
#[test]
fn names_move_no_cursor() {
    let named = |name: &str| {
        let name = format!("{name:?}");
        scene(
            "aov: [Entity]",
            &format!(
                r#"(name: {name}, shape: Sphere(radius_m: 1), material: (diffuse: 0.5)),
            (name: "b", shape: Mesh({name})),"#
            ),
        )
    };
    let folder = folder(&named("x\u{1b}[31m\r\n\u{9b}\u{202e}y"));
    let here = folder.path();
    std::fs::write(
        here.join("fine.ron"),
        ball("").replace("\"lamp\"", "\"\\u{1b}[31m\\nerror: fake\\u{202e}\""),
    )
    .expect("a file");
    std::fs::write(here.join("x\u{1b}.obj"), "v 0 0 0\n\u{1b}f 1 2\u{1b} 3\n").expect("a file");
    for line in [
        "scene.ron",
        "x\u{1b}.obj",
        "info fine.ron",
        "ls fine.ron",
        "check fine.ron",
        "explain fine.ron 8,6",
        "diff fine.ron scene.ron",
        "fine.ron -o a.exr",
        "fine.ron --camera \u{1b}[31m",
        "nowhere\u{1b}[31m.ron",
    ] {
        let output = run(here, &line.split(' ').collect::<Vec<_>>());
        for bytes in [&output.stdout, &output.stderr] {
            let text = std::str::from_utf8(bytes).expect("UTF-8");
            let harmful = |c: char| c.is_control() && c != '\n' && c != '\t' || c == '\u{202e}';
            assert!(!text.contains(harmful), "{line}: {text:?}");
            assert!(!text.lines().any(|line| line.starts_with("error: fake")), "{line}: {text}");
        }
    }
}
