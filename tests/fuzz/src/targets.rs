//! What is done with any bytes that call themselves a scene, a mesh, a picture or whatever else rayfront reads: it
//! is read or refused in one line; what is read is compiled and rendered a few pixels large by both schedules, to the
//! same bits. Whatever else happens is a fault.

use std::ffi::{OsStr, OsString};
use std::io::{Cursor, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use rayfront::compile::compile;
use rayfront::internals::cli;
use rayfront::internals::formats::ron::query::{Query, select, set};
use rayfront::internals::formats::{self, LoadOptions, film_file, picture, rays, ron, study};
use rayfront::internals::integrator::Schedule;
use rayfront::internals::view::scene::LiveScene;
use rayfront::internals::view::server::{MakeCommands, Server};
use rayfront::internals::view::viewer::{RenderWork, Viewer};
use rayfront::internals::world::SourceFiles;
use rayfront::render::{Options, Session};
use rayfront::world::{Adaptive, Texels, World};

use crate::support::MadeUp;

/// A kind of input.
pub type Target = fn(&[u8]);

/// All kinds, by the names of their folders.
pub const ALL: [(&str, Target); 15] = [
    ("ron", scene),
    ("gltf", model),
    ("ply", ply),
    ("obj", obj),
    ("stl", stl),
    ("strands", strands),
    ("font", font),
    ("picture", image),
    ("rays", ray_file),
    ("film", film),
    ("films", films),
    ("study", study_file),
    ("query", query),
    ("edit", edit),
    ("http", request),
];

/// Separates two films.
pub const NEXT_FILM: &[u8] = b"\n#---- b.film\n";

/// Separates an OBJ file from its library.
pub const LIBRARY: &[u8] = b"\n#---- a.mtl\n";

/// A folder in memory, where there is one.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    folder.expect("a folder for files")
});

fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = FOLDER.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    path
}

/// Checks that a message fits on a line.
fn is_fair(error: &dyn std::fmt::Display) {
    let message = error.to_string();
    assert!(!message.is_empty() && !message.contains(char::is_control), "not one line: {message:?}");
}

/// The same of one that shows the place in what was typed.
fn is_fair_in_lines(error: &dyn std::fmt::Display) {
    let message = error.to_string();
    let harmful = |c: char| c.is_control() && c != '\n';
    assert!(!message.is_empty() && !message.contains(harmful), "it moves the cursor: {message:?}");
}

/// Compiles and renders a world in two ways.
fn renders(mut world: World) {
    let settings = &mut world.settings;
    // Enough for everything to happen, and not more.
    settings.size = [4, 3];
    settings.samples = settings.samples.min(2);
    settings.max_depth = settings.max_depth.min(4);
    settings.copied_triangles = settings.copied_triangles.min(1 << 12);
    settings.adaptive = Adaptive::Off;
    let scene = match compile(&world, None) {
        Ok(scene) => scene,
        Err(error) => return is_fair(&error),
    };
    let setup = Arc::new(rayfront::internals::render::setup(scene, &world.settings));
    let hash = |schedule, wave| {
        let options = Options { schedule, wave, ..Options::default() };
        let mut session = Session::of(setup.clone(), world.settings.samples, options);
        session.advance(u32::MAX);
        let channels = session.channels(&world.settings.aov);
        assert_eq!(channels.is_empty(), world.settings.aov.is_empty());
        session.film().hash()
    };
    assert_eq!(hash(Schedule::Wavefront, 64), hash(Schedule::Recursive, 64), "the schedules differ");
}

fn loads(path: &Path, options: &LoadOptions) {
    match formats::load_with(path, options) {
        Ok(world) => renders(world),
        Err(error) => is_fair(&error),
    }
}

fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let world = match ron::parse(text, Path::new("test.ron"), &mut MadeUp) {
        Ok(world) => world,
        Err(error) => return is_fair(&error),
    };
    if let Ok(written) = ron::write(&world, Path::new("test.ron")) {
        let again = ron::parse(&written, Path::new("test.ron"), &mut MadeUp);
        let again = again.unwrap_or_else(|error| panic!("written, it is not read: {error}\n{written}"));
        assert_eq!(again.entities.len(), world.entities.len(), "written, it is another:\n{written}");
    }
    renders(world);
}

fn model(bytes: &[u8]) {
    let is_glb = bytes.starts_with(b"glTF");
    let path = file(if is_glb { "a.glb" } else { "a.gltf" }, bytes);
    loads(&path, &LoadOptions::default());
    let moment =
        LoadOptions { time_s: Some(0.7), solid_glass: true, double_sided: true, ..LoadOptions::default() };
    loads(&path, &moment);
    match formats::gltf::contents(&path, &SourceFiles::default()) {
        Ok(_) => {}
        Err(error) => is_fair(&error),
    }
}

fn ply(bytes: &[u8]) {
    loads(&file("a.ply", bytes), &LoadOptions::default());
}

fn obj(bytes: &[u8]) {
    let cut = bytes.windows(LIBRARY.len()).position(|window| window == LIBRARY);
    let (mesh, library) = bytes.split_at(cut.unwrap_or(bytes.len()));
    file("a.mtl", library.get(LIBRARY.len()..).unwrap_or_default());
    loads(&file("a.obj", mesh), &LoadOptions::default());
}

fn stl(bytes: &[u8]) {
    loads(&file("a.stl", bytes), &LoadOptions::default());
}

fn strands(bytes: &[u8]) {
    let Some((first, rest)) = bytes.split_first() else { return };
    let name = if first % 2 == 0 { "a.txt" } else { "a.hair" };
    let path = file(name, rest);
    let shape = format!("Strands(file: \"{name}\", curve: Linear)");
    shape_of_file(&path, &shape);
}

fn font(bytes: &[u8]) {
    shape_of_file(&file("a.ttf", bytes), "Text(text: \"IO\", font: \"a.ttf\", bevel_m: 0.01)");
}

/// Loads and compiles a scene of one shape beside its file.
fn shape_of_file(file: &Path, shape: &str) {
    let scene = file.with_file_name("scene.ron");
    std::fs::write(&scene, format!("(entities: [(shape: {shape}), (camera: Pinhole())])")).expect("a scene");
    loads(&scene, &LoadOptions::default());
}

fn image(bytes: &[u8]) {
    let Some((first, rest)) = bytes.split_first() else { return };
    let names = ["a.png", "a.jpg", "a.tga", "a.bmp", "a.webp", "a.hdr", "a.exr", "a.ies"];
    let name = names[usize::from(*first) % names.len()];
    match picture::decode(rest, Path::new(name)) {
        Ok((image, _)) => {
            let count = match &image.texels {
                Texels::Rgba8(texels) => texels.len(),
                Texels::Rgba16(texels) => texels.len(),
                Texels::Rgb32(texels) => texels.len(),
            };
            assert_eq!(count, image.width as usize * image.height as usize);
        }
        Err(error) => is_fair(&error),
    }
    let path = file(name, rest);
    for error in [picture::load_linear(&path).err(), picture::load_text(&path, "rayfront").err()] {
        error.iter().for_each(|error| is_fair(error));
    }
}

fn ray_file(bytes: &[u8]) {
    let path = file("a.rays", bytes);
    let refused = [rays::load_rays(&path, 1 << 16).err(), rays::load_hits(&path, 1 << 16).err()];
    refused.iter().flatten().for_each(|error| is_fair(error));
}

fn film(bytes: &[u8]) {
    match film_file::read(&mut Cursor::new(bytes), Path::new("a.film")) {
        Ok(Some(film)) => {
            let mut written = Vec::new();
            film_file::write(&mut written, &film.header, &film.film, film.moments.as_ref()).expect("written");
            let again = film_file::read(&mut Cursor::new(&written), Path::new("a.film"));
            assert!(again.is_ok_and(|again| again.as_ref() == Some(&film)), "written, it is another");
            // What its record says is soon worked out.
            let header = &film.header;
            assert!(header.view.moments_among(&header.samples, header.total()) <= header.view.moments());
            let _ = (header.part(0, 2), header.view.at(header.view.moments() - 1));
            let radiance = film.film.radiance();
            assert!(radiance.iter().all(|pixel| pixel.max_component() >= 0.0 || pixel.r.is_nan()));
        }
        Ok(None) => {}
        Err(error) => is_fair(&error),
    }
}

/// Two films are merged, and the first of them continued, by the program itself: that ends with an exit code, changes
/// nothing but its outputs, and there are outputs exactly if it says so.
fn films(bytes: &[u8]) {
    let cut = bytes.windows(NEXT_FILM.len()).position(|window| window == NEXT_FILM);
    let (first, second) = bytes.split_at(cut.unwrap_or(bytes.len()));
    let second = second.get(NEXT_FILM.len()..).unwrap_or_default();
    let scene = file("films.ron", SHOWN.as_bytes());
    let (a, b) = (file("films-a.film", first), file("films-b.film", second));
    let to = ["png", "film"].map(|extension| FOLDER.path().join("films-out").with_extension(extension));
    let run = |words: &[&dyn AsRef<OsStr>], is_written: &[&PathBuf]| {
        for output in &to {
            let _ = std::fs::remove_file(output);
        }
        let words = words.iter().map(|word| word.as_ref().to_owned());
        let code = cli::run(std::iter::once(OsString::from("rayfront")).chain(words));
        for (path, bytes) in [(&scene, SHOWN.as_bytes()), (&a, first), (&b, second)] {
            assert!(std::fs::read(path).is_ok_and(|now| now == bytes), "{} has changed", path.display());
        }
        for output in is_written {
            let there = output.exists();
            assert_eq!(there, code == ExitCode::SUCCESS, "{}: {code:?}", output.display());
        }
    };
    let [image, film] = &to;
    run(&[&"merge", &"--partial", &"--quiet", &a, &b, &"-o", image, &"-o", film], &[image, film]);
    // That takes ten times as long.
    if !bytes.len().is_multiple_of(4) {
        return;
    }
    let scene = &scene;
    run(&[&"resume", &"--quiet", &a, &"--scene-file", scene, &"--max-time", &"1s", &"-o", image], &[image]);
}

fn study_file(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match study::parse(text, Path::new("a.ron")) {
        Ok(_) => {}
        Err(error) => is_fair(&error),
    }
}

/// A scene that has something of everything that queries ask for.
const SHOWN: &str = r#"(
    settings: (size: (4, 3), samples: 1),
    materials: { "paint": (diffuse: (0.8, 0.2, 0.1)), "glass": Principled(metallic: 0, transmission: 1) },
    entities: [
        (name: "eye", camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: (0, 1, 6), to: (0, 0, 0))),
        (name: "table"),
        (name: "ball", shape: Sphere(radius_m: 1), material: "paint", parent: "table"),
        (name: "drop", shape: Sphere(radius_m: 0.3), material: "glass", transform: (translate: (1, 1, 0))),
        (name: "lamp", light: Area(power_w: 300, size_m: 2), transform: LookAt(from: (1, 4, 2), to: (0, 0, 0))),
    ],
)"#;

fn shown() -> World {
    ron::parse(SHOWN, Path::new("test.ron"), &mut MadeUp).expect("a scene")
}

fn query(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let world = shown();
    match Query::parse(text, &world) {
        Ok(query) => {
            let _ = select(&world, &query).len();
        }
        Err(error) => is_fair_in_lines(&error),
    }
}

/// Statements that change a scene, one a line.
fn edit(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let mut world = shown();
    for line in text.lines().take(8) {
        if let Err(error) = set(&mut world, line, &mut MadeUp) {
            is_fair_in_lines(&error);
        }
    }
    renders(world);
}

/// A page that is served for as long as the process lives: where, and its token.
static PAGE: LazyLock<(String, String)> = LazyLock::new(|| {
    let path = file("shown.ron", SHOWN.as_bytes());
    let scene = LiveScene::load(&path, LoadOptions::default(), None, Box::new(|_| ())).expect("a scene");
    let server = Server::new(0).expect("a server");
    let address = server.address().expect("an address");
    let (base, token) = address.split_once("/?token=").expect("a token");
    let place = (base.trim_start_matches("http://").to_owned(), token.to_owned());
    let viewer = Arc::new(Viewer::new(&scene, RenderWork::default()));
    let served = viewer.clone();
    let commands = MakeCommands { explain: |_, _, _| String::new(), render: |_, _, _, _| String::new() };
    std::thread::spawn(move || server.serve(served, commands));
    std::thread::spawn(move || viewer.run(scene, RenderWork::default()));
    place
});

/// A request as it goes over the wire; `TOKEN` stands for the page's own.
fn request(bytes: &[u8]) {
    let (place, token) = &*PAGE;
    let bytes = replaced(bytes, b"TOKEN", token.as_bytes());
    let answer = ask(place, &bytes, Duration::from_millis(60));
    if let Ok(answer) = std::str::from_utf8(&answer) {
        assert!(!answer.starts_with("HTTP/1.1 5"), "{answer}");
    }
    // Whatever that was, the next one is answered.
    let next = format!("GET /status?token={token} HTTP/1.1\r\nHost: {place}\r\nConnection: close\r\n\r\n");
    let answer = ask(place, next.as_bytes(), Duration::from_secs(10));
    assert!(answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer));
}

fn replaced(bytes: &[u8], what: &[u8], by: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(what.len()).position(|window| window == what) {
        out.extend_from_slice(&rest[..at]);
        out.extend_from_slice(by);
        rest = &rest[at + what.len()..];
    }
    out.extend_from_slice(rest);
    out
}

/// The beginning of the answer; nothing if there is none for some time.
fn ask(place: &str, bytes: &[u8], patience: Duration) -> Vec<u8> {
    let mut stream = TcpStream::connect(place).expect("a connection");
    stream.set_read_timeout(Some(patience)).expect("a time");
    let mut answer = vec![0; 4096];
    // The server may close while it is being written to.
    let _ = stream.write_all(bytes);
    let mut length = 0;
    while length < answer.len() {
        match stream.read(&mut answer[length..]) {
            Ok(0) | Err(_) => break,
            Ok(more) => length += more,
        }
        // News never end.
        if answer[..length].windows(18).any(|window| window == b"text/event-stream\r") {
            break;
        }
    }
    answer.truncate(length);
    answer
}
