//! Hostile files, faulty machines and small limits: no panic, no damaged file, no exhaustion of the machine's memory,
//! no leak of private data. The table in `src/cli/SERVICE.md` names these tests.

mod faults;
mod finds;
mod limits;
mod load;
mod outputs;

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;

use super::program::{Folder, Place, empty_folder, folder};

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

/// File names need not be UTF-8.
#[test]
fn paths_are_any_bytes() {
    let name = |end: &str| OsString::from_vec([b"b\xff.", end.as_bytes()].concat());
    let here = folder(&ball(""));
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
        let text = here.out(&words(line));
        let is_json = serde_json::from_str::<serde_json::Value>(&text).is_ok();
        assert!(is_json || !line.contains("--json"), "{line}: {text}");
    }
}

const PICTURE: &[u8] = include_bytes!("../../../assets/checker.png");
const SECRET: &str = "root:$6$salt$hash:19000:0:99999:7:::";

/// A folder `inner` with scenes of every kind that refer to files outside it.
fn prying() -> Folder {
    let folder = empty_folder();
    let write = |name: &str, text: &str| folder.write(name, text);
    std::fs::create_dir(folder.join("inner")).expect("a folder");
    folder.write("secret.png", PICTURE);
    write("secret.mtl", &format!("{SECRET}\nnewmtl m\nKd 1 0 0\n"));
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    write("secret.obj", &format!("{triangle}f 1 2 3\n"));
    write("inner/image.ron", &ball(r#"diffuse: Image("../secret.png")"#));
    let absolute = folder.join("secret.png");
    write("inner/absolute.ron", &ball(&format!("diffuse: Image({absolute:?})")));
    write("inner/mesh.ron", &scene("", r#"(shape: Mesh("../secret.obj")),"#));
    write("inner/library.obj", &format!("mtllib ../secret.mtl\n{triangle}usemtl m\nf 1 2 3\n"));
    write("inner/a.mtl", "newmtl m\nmap_Kd ../secret.png\n");
    write("inner/texture.obj", &format!("mtllib a.mtl\n{triangle}usemtl m\nf 1 2 3\n"));
    std::os::unix::fs::symlink("../secret.png", folder.join("inner/link.png")).expect("a link");
    write("inner/link.ron", &ball(r#"diffuse: Image("link.png")"#));
    let gltf = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "images": [{"uri": "IMAGE"}], "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    write("secret.ron", &format!("// {SECRET}\n{}", ball("")));
    write("inner/include.ron", r#"(include: ["../secret.ron"])"#);
    write("inner/link.gltf", &gltf.replace("IMAGE", "link.png"));
    write("inner/up.gltf", &gltf.replace("IMAGE", "../secret.png"));
    folder
}

#[test]
fn scenes_read_no_file_outside_of_their_folder() {
    let folder = prying();
    let inner = folder.join("inner");
    let files = [
        "image.ron", "absolute.ron", "mesh.ron", "library.obj", "texture.obj", "link.ron", "link.gltf",
        "up.gltf", "include.ron",
    ];
    for file in files {
        let line = format!("{file} --size 8x6 -s 1 -o a.png");
        // (A model without its images is still valid.)
        let code = if file.ends_with(".ron") { 1 } else { 0 };
        let said = inner.run(&line).ends(code, &["--allow-outside"]);
        assert!(!said.contains("root") && !said.contains("salt"), "{file}: {said}");
        let said = inner.messages(&format!("{line} --allow-outside"));
        assert!(
            !said.contains("outside") && !said.contains("root") && !said.contains("salt"),
            "{file}: {said}"
        );
    }
    // Files named on the command line may lie anywhere, and a marker file makes a larger folder the scene's.
    inner.out("library.obj --env ../secret.png --size 8x6 -s 1 -o a.png");
    folder.write(".rayfront-root", "");
    for file in files.iter().filter(|file| **file != "up.gltf") {
        let said = inner.messages(&["info", file]);
        assert!(!said.contains("outside"), "{file}: {said}");
    }
}

/// The author of a film does not choose which images are replaced.
#[test]
fn a_film_replaces_no_picture_but_its_own() {
    let here = folder(&ball(""));
    here.out("scene.ron -q -o a.film -o mine.png");
    here.out("resume a.film -q");
    here.write("mine.png", PICTURE);
    here.run("resume a.film -q").ends(3, &["mine.png", "holds something else", "-o"]);
    assert_eq!(here.bytes("mine.png"), PICTURE);
    here.out("resume a.film -q -o mine.png");
}

/// Files that never end are not opened for reading.
#[test]
fn devices_and_pipes_are_no_files() {
    let here = folder(&ball(""));
    let write = |name: &str, text: &str| here.write(name, text);
    here.shell("mkfifo pipe.png pipe.ron pipe.film pipe.rays").ends(0, &[]);
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
        let run = here.run(&format!("{line} --allow-outside"));
        let said = run.out.clone() + &run.ends(code, &[]);
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
    let here = folder(&named("x\u{1b}[31m\r\n\u{9b}\u{202e}y"));
    here.write("fine.ron", ball("").replace("\"lamp\"", "\"\\u{1b}[31m\\nerror: fake\\u{202e}\""));
    here.write("x\u{1b}.obj", "v 0 0 0\n\u{1b}f 1 2\u{1b} 3\n");
    for line in [
        "scene.ron", "x\u{1b}.obj", "info fine.ron", "ls fine.ron", "check fine.ron", "explain fine.ron 8,6",
        "furnace fine.ron b --directions 64", "diff fine.ron scene.ron", "fine.ron -o a.exr",
        "fine.ron --camera \u{1b}[31m", "nowhere\u{1b}[31m.ron",
    ] {
        let run = here.run(line);
        for text in [&run.out, &run.err] {
            let harmful = |c: char| c.is_control() && c != '\n' && c != '\t' || c == '\u{202e}';
            assert!(!text.contains(harmful), "{line}: {text:?}");
            assert!(!text.lines().any(|line| line.starts_with("error: fake")), "{line}: {text}");
        }
    }
}
