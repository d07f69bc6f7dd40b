//! Mesh files: one shape and its colours in all formats, and every mesh file of the corpus, if present (set
//! RAYFRONT_CORPUS to its folder).

use std::path::Path;

use rayfront::error::{Diagnostic, LoadError};
use rayfront::formats::{Edits, LoadOptions, load, load_with, save_scene};
use rayfront::internals::check::check as findings;
use rayfront::internals::formats::{obj, ply, stl};
use rayfront::math::Vec3;
use rayfront::render::Options;
use rayfront::world::{Assets, Image, Mesh, Name, Shape, Texels, World};

use crate::corpus;
use crate::support::{film, icosphere, mean_rgb};

/// Checks the invariants of every mesh.
fn check(mesh: &Mesh, assets: &Assets) {
    let vertices = mesh.positions.len();
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
    assert!(mesh.positions.iter().chain(&mesh.normals).all(|v| v.is_finite()));
    assert!(mesh.uvs.iter().all(|uv| uv.is_finite()));
    assert!(mesh.colors.iter().all(|color| color.is_finite()));
    for length in [mesh.normals.len(), mesh.uvs.len(), mesh.colors.len()] {
        assert!(length == 0 || length == vertices);
    }
    assert!([0, mesh.triangles.len()].contains(&mesh.triangle_materials.len()));
    assert!(mesh.triangle_materials.iter().all(|id| (id.0 as usize) < assets.materials.len()));
}

fn read_mesh(path: &Path, warnings: &mut Vec<Diagnostic>) -> Result<(Mesh, Assets), LoadError> {
    let mut assets = Assets::default();
    let is = |kind: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(kind));
    if is("ply") || is("stl") {
        let file = if is("ply") { ply::load(path) } else { stl::load(path) }?;
        warnings.extend(file.warnings.iter().cloned());
        return Ok((Mesh::clone(&file.mesh), assets));
    }
    let gray = || Image { source: None, width: 1, height: 1, texels: Texels::Rgba8(vec![[128; 4]]) };
    let mut images = |image: &Path| match image.is_file() {
        true => Ok(gray().into()),
        false => Err(LoadError::Invalid { file: image.into(), reason: "no such picture".into() }),
    };
    obj::load(path, &mut assets, warnings, &mut images).map(|mesh| (mesh, assets))
}

#[test]
fn corpus_meshes_load_or_fail_as_expected() {
    let Some(corpus) = corpus::folder() else { return };
    let files = corpus::files(&corpus, &["ply", "obj", "stl"]);
    let mut surprises = Vec::new();
    for path in &files {
        let name = path.strip_prefix(&corpus).unwrap_or(path).display().to_string();
        let mut warnings = Vec::new();
        let outcome = read_mesh(path, &mut warnings);
        match &outcome {
            Ok((mesh, assets)) => {
                check(mesh, assets);
                println!("{name}: {} triangles", mesh.triangles.len());
            }
            Err(error) => println!("{name}: {error}"),
        }
        for warning in &warnings {
            println!("    warning: {warning}");
            assert!(!warning.to_string().contains('\n'), "{warning:?}");
        }
        let error = outcome.as_ref().err().map(|error| error as &dyn std::error::Error);
        surprises.extend(corpus::surprise(&corpus, path, error));
    }
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

/// A folder with files.
fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("a file");
    }
    folder
}

/// An image (TGA) of a single pixel.
fn tga([r, g, b, a]: [u8; 4]) -> Vec<u8> {
    vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 32, 8, b, g, r, a]
}

/// A scene of a few pixels from a file.
fn small(path: &Path, options: &LoadOptions) -> World {
    let mut world = load_with(path, options).unwrap_or_else(|error| panic!("{error}"));
    (world.settings.size, world.settings.samples) = ([24, 24], 2);
    world
}

fn hash(path: &Path) -> String {
    film(&small(path, &LoadOptions::default()), Options::default()).hash().to_string()
}

/// The corners of all triangles.
fn corners(world: &World) -> Vec<[Vec3; 3]> {
    let mesh = &world.assets.meshes[0];
    mesh.triangles.iter().map(|triangle| triangle.map(|vertex| mesh.positions[vertex as usize])).collect()
}

/// A mesh in all formats, by file name.
fn in_all_formats(mesh: &Mesh) -> Vec<(&'static str, Vec<u8>)> {
    let lines = |line: &dyn Fn(usize) -> String, count: usize| (0..count).map(line).collect::<String>();
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let text_of = |p: Vec3| format!("{} {} {}", p.x, p.y, p.z);
    let vertex = |i: usize| text_of(mesh.positions[i]);
    let face = |i: usize, from: u32| {
        let [a, b, c] = mesh.triangles[i].map(|vertex| vertex + from);
        format!("{a} {b} {c}")
    };
    let header = |format: &str, kind: &str, count: &str, index: &str| {
        let columns: String = ["x", "y", "z"].map(|axis| format!("property {kind} {axis}\n")).concat();
        let list = format!("property list {count} {index} vertex_indices");
        format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\n{columns}element face {faces}\n{list}\nend_header\n"
        )
    };
    let numbers = mesh.positions.iter().flat_map(|p| p.to_array());
    let little: Vec<u8> = numbers.clone().flat_map(f32::to_le_bytes).collect();
    let big: Vec<u8> = numbers.clone().flat_map(f32::to_be_bytes).collect();
    let double: Vec<u8> = numbers.flat_map(|number| f64::from(number).to_le_bytes()).collect();
    let indices = |count: &[u8], bytes: fn(u32) -> [u8; 4]| -> Vec<u8> {
        let list = |t: &[u32; 3]| [count, &t.map(bytes).concat()].concat();
        mesh.triangles.iter().flat_map(list).collect()
    };
    let stl_corners = |i: usize| mesh.triangles[i].map(|vertex| mesh.positions[vertex as usize]);
    let stl_text = |i: usize| {
        let loops = stl_corners(i).map(|p| format!("vertex {}\n", text_of(p))).concat();
        format!("facet normal 0 0 0\nouter loop\n{loops}endloop\nendfacet\n")
    };
    let mut stl_binary = format!("{:80}", "solid").into_bytes();
    stl_binary.extend((faces as u32).to_le_bytes());
    for i in 0..faces {
        stl_binary.extend([0; 12]);
        stl_binary.extend(stl_corners(i).iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
        stl_binary.extend([0; 2]);
    }
    let obj = format!(
        "{}{}",
        lines(&|i| format!("v {}\n", vertex(i)), vertices),
        lines(&|i| format!("f {}\n", face(i, 1)), faces)
    );
    let ascii = format!(
        "{}{}{}",
        header("ascii", "float", "uchar", "int"),
        lines(&|i| vertex(i) + "\n", vertices),
        lines(&|i| format!("3 {}\n", face(i, 0)), faces)
    );
    let binary =
        |header: String, vertices: &[u8], faces: &[u8]| [header.as_bytes(), vertices, faces].concat();
    let [le, be] = ["binary_little_endian", "binary_big_endian"];
    vec![
        ("a.obj", obj.into_bytes()),
        ("ascii.ply", ascii.into_bytes()),
        (
            "little.ply",
            binary(header(le, "float", "uchar", "uint"), &little, &indices(&[3], u32::to_le_bytes)),
        ),
        (
            "big.ply",
            binary(header(be, "float32", "ushort", "int32"), &big, &indices(&[0, 3], u32::to_be_bytes)),
        ),
        (
            "double.ply",
            binary(header(le, "double", "int", "int"), &double, &indices(&[3, 0, 0, 0], u32::to_le_bytes)),
        ),
        ("text.stl", format!("solid a\n{}endsolid a\n", lines(&stl_text, faces)).into_bytes()),
        ("binary.stl", stl_binary),
    ]
}

#[test]
fn a_shape_is_the_same_in_all_formats() {
    let mesh = icosphere(1, |p| 1.0 + 0.3 * p.y);
    let files = in_all_formats(&mesh);
    let named: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let folder = folder(&named);
    let first = folder.path().join("a.obj");
    let (triangles, picture) = (corners(&small(&first, &LoadOptions::default())), hash(&first));
    assert_eq!(triangles.len(), mesh.triangles.len());
    for (name, _) in &files {
        let path = folder.path().join(name);
        let world = small(&path, &LoadOptions::default());
        assert!(world.warnings.iter().all(|it| it.code != "import"), "{name}: {:?}", world.warnings);
        assert_eq!(corners(&world), triangles, "{name}");
        assert_eq!(world.assets.meshes[0].positions.len(), mesh.positions.len(), "{name}");
        assert_eq!(hash(&path), picture, "{name}");
    }
    let scene = folder.path().join("a.ron");
    std::fs::write(&scene, "(entities: [(shape: Mesh(\"binary.stl\"))])").expect("a file");
    assert_eq!(corners(&small(&scene, &LoadOptions::default())), triangles);
    save_scene(&scene, &load(folder.path().join("text.stl")).expect("a mesh")).expect("a scene");
    assert_eq!(hash(&scene), picture);
}

const SQUARE: [&str; 4] = ["-1 -1 0", "1 -1 0", "1 1 0", "-1 1 0"];

/// A square as PLY, with columns of a type beside the position.
fn square_ply(kind: &str, columns: &str, values: &str) -> String {
    let columns: String = columns.split(' ').map(|name| format!("property {kind} {name}\n")).collect();
    let vertices: String = SQUARE.map(|corner| format!("{corner} {values}\n")).concat();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{columns}\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{vertices}4 0 1 2 3\n"
    )
}

fn square_obj(color: &str, more: &str) -> String {
    SQUARE.map(|corner| format!("v {corner} {color}\n")).concat() + more + "f 1 2 3 4\n"
}

/// The mean of a picture of a square that fills it, in even light of radiance 1: its albedo.
fn albedo(folder: &Path, mesh: &str, more: &str) -> [f64; 3] {
    let text = format!(
        "(settings: (transport: Path, sharing: Off), entities: [(camera: Orthographic(height_m: 1), transform: \
         (translate: (0, 0, 3))), (light: Environment()), (shape: {mesh}{more})])"
    );
    let scene = folder.join("albedo.ron");
    std::fs::write(&scene, text).expect("a file");
    let world = small(&scene, &LoadOptions::default());
    mean_rgb(&film(&world, Options::default()).radiance())
}

#[test]
fn colours_of_vertices_are_the_albedo_in_all_formats() {
    let unit = (128.0f32 / 255.0).to_string();
    let of = |values: &str| [values; 3].join(" ");
    let names = "red green blue";
    let files = [
        ("a.obj", square_obj(&of(&unit), "")),
        ("bytes.obj", square_obj("128 128 128", "")),
        ("bytes.ply", square_ply("uchar", names, &of("128"))),
        ("floats.ply", square_ply("float", names, &of(&unit))),
        ("doubles.ply", square_ply("double", "diffuse_red diffuse_green diffuse_blue", &of("128"))),
        ("shorts.ply", square_ply("ushort", names, &of("32896"))),
    ];
    let named: Vec<(&str, &[u8])> = files.iter().map(|(name, text)| (*name, text.as_bytes())).collect();
    let folder = folder(&named);
    let picture = hash(&folder.path().join("bytes.ply"));
    for (name, _) in &files {
        let found = albedo(folder.path(), &format!("Mesh(\"{name}\")"), "");
        assert!(found.iter().all(|c| (c - 0.215_86).abs() < 1e-4), "{name}: {found:?}");
        let bytes = small(&folder.path().join(name), &LoadOptions::default());
        assert_eq!(film(&bytes, Options::default()).hash().to_string(), picture, "{name}");
    }
    // A material of the scene is multiplied, in copies and instances, too.
    let mesh = "Mesh(\"bytes.ply\")";
    let found = albedo(folder.path(), mesh, ", material: (diffuse: 0.8)");
    assert!((found[0] - 0.8 * 0.215_86).abs() < 1e-4, "{found:?}");
    let twice =
        format!(", transform: (translate: (0, 0, 0))), (shape: {mesh}, transform: (translate: (0, 9, 0))");
    assert_eq!(albedo(folder.path(), mesh, &twice), albedo(folder.path(), mesh, ""));
    // Without colours, the default material is as it was.
    std::fs::write(folder.path().join("plain.obj"), square_obj("", "")).expect("a file");
    let plain = albedo(folder.path(), "Mesh(\"plain.obj\")", "");
    assert!((plain[0] - 0.8).abs() < 1e-4, "{plain:?}");
}

#[test]
fn colours_brighter_than_white_are_found() {
    let names = "red green blue";
    let bright = folder(&[("a.ply", square_ply("float", names, "1.5 0.5 0.5").as_bytes())]);
    let white = folder(&[("a.ply", square_ply("float", names, "1 1 1").as_bytes())]);
    let told = |folder: &tempfile::TempDir| {
        let world = small(&folder.path().join("a.ply"), &LoadOptions::default());
        let scene = rayfront::compile::compile(&world, None).expect("a scene");
        let setup = rayfront::internals::render::setup(scene, &world.settings);
        let found = findings(&world, &setup, true);
        found.iter().find(|it| it.code == "bright-material").map(ToString::to_string)
    };
    assert!(told(&bright).is_some_and(|it| it.starts_with("mesh: the colours of its vertices go up to ")));
    assert_eq!(told(&white), None);
}

#[test]
fn images_that_a_ply_file_names_cover_it() {
    let text = square_ply("float", "s t", "0.5 0.5");
    let named = text.replace("element vertex", "comment TextureFile a paint.tga\nelement vertex");
    let bare = square_ply("float", "quality", "1")
        .replace("element vertex", "comment TextureFile a paint.tga\nelement vertex");
    let folder = folder(&[
        ("named.ply", named.as_bytes()),
        ("bare.ply", bare.as_bytes()),
        ("plain.ply", text.as_bytes()),
    ]);
    let told = |name: &str| {
        let world = small(&folder.path().join(name), &LoadOptions::default());
        world
            .warnings
            .iter()
            .map(ToString::to_string)
            .filter(|line| line.contains("paint"))
            .collect::<Vec<_>>()
    };
    assert_eq!(told("plain.ply"), Vec::<String>::new());
    assert!(told("named.ply")[0].contains("a paint.tga: cannot read"), "{:?}", told("named.ply"));
    assert!(
        told("bare.ply")[0].contains("bare.ply:3: the image \"a paint.tga\" is not used"),
        "{:?}",
        told("bare.ply")
    );
    std::fs::write(folder.path().join("a paint.tga"), tga([255, 128, 0, 255])).expect("an image");
    assert_eq!(told("named.ply"), Vec::<String>::new());
    let found = albedo(folder.path(), "Mesh(\"named.ply\")", "");
    assert!(found[0] > 0.99 && (0.21..0.22).contains(&found[1]) && found[2] < 0.01, "{found:?}");
}

#[test]
fn objects_of_an_obj_file_are_entities_of_their_names() {
    let faces = "o left wheel\nf 1 2 3\no right\nf 1 3 4\n";
    let obj = SQUARE.map(|corner| format!("v {corner}\n")).concat() + faces;
    let folder = folder(&[("a.obj", obj.as_bytes()), ("plain.obj", obj.replace("o ", "# ").as_bytes())]);
    let path = folder.path().join("a.obj");
    let edited = |set: &[&str], hide: &[&str]| {
        let owned = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect();
        let edits = Edits { set: owned(set), hide: owned(hide), ..Edits::default() };
        film(&small(&path, &LoadOptions { edits, ..LoadOptions::default() }), Options::default())
            .hash()
            .to_string()
    };
    let whole = edited(&[], &[]);
    assert_eq!(whole, hash(&folder.path().join("plain.obj")), "apart, they look the same");
    let pictures = [
        whole.clone(),
        edited(&["\"left wheel\".material = (diffuse: (1, 0, 0))"], &[]),
        edited(&["\"right\".material = (diffuse: (1, 0, 0))"], &[]),
        edited(&[], &["\"right\""]),
        edited(&["\"mesh\".transform = (rotate_degrees: (0, 0, 30))"], &[]),
    ];
    for (i, a) in pictures.iter().enumerate() {
        assert!(pictures[..i].iter().all(|b| a != b), "{i}");
    }
    let edits = Edits { set: vec!["\"mesh\".material = (diffuse: 1)".into()], ..Edits::default() };
    let world = small(&path, &LoadOptions { edits, ..LoadOptions::default() });
    assert!(world.warnings.iter().any(|it| it.code == "set-without-effect"), "{:?}", world.warnings);
    let scene = folder.path().join("a.ron");
    save_scene(&scene, &load(&path).expect("a mesh")).expect("a scene");
    let text = std::fs::read_to_string(&scene).expect("a scene");
    assert!(text.contains("Mesh(\"a.obj#left wheel\")") && text.contains("Mesh(\"a.obj#right\")"), "{text}");
    assert_eq!(hash(&scene), whole);
    // In a scene, the file is one mesh.
    std::fs::write(&scene, "(entities: [(name: \"all\", shape: Mesh(\"a.obj\"))])").expect("a file");
    let world = small(&scene, &LoadOptions::default());
    assert_eq!((corners(&world).len(), world.entities.query::<&Shape>().iter().count()), (2, 1));
    std::fs::write(&scene, "(entities: [(shape: Mesh(\"a.obj#wheel\"))])").expect("a file");
    let error = load(&scene).err().expect("no such object").to_string();
    assert!(error.contains("has no object \"wheel\"; there are: \"left wheel\", \"right\""), "{error}");
    let names: Vec<String> =
        load(&path).expect("a mesh").entities.query::<&Name>().iter().map(|name| name.0.clone()).collect();
    assert!(names.contains(&"left wheel".to_owned()), "{names:?}");
}

#[test]
fn cut_outs_of_libraries_let_light_through() {
    let uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let obj = |name: &str| {
        let faces = format!("mtllib {name}.mtl\n{uvs}f 1/1 2/2 3/3 4/4\n");
        SQUARE.map(|corner| format!("v {corner}\n")).concat() + &faces
    };
    let folder = folder(&[
        ("whole.obj", obj("whole").as_bytes()),
        ("map.obj", obj("map").as_bytes()),
        ("part.obj", obj("part").as_bytes()),
        ("whole.mtl", b"newmtl a\nKd 0.5 0.5 0.5\n"),
        ("map.mtl", b"newmtl a\nKd 0.5 0.5 0.5\nmap_d black.tga\n"),
        ("part.mtl", b"newmtl a\nKd 0.5 0.5 0.5\nd 0.5\nmap_d white.tga\n"),
        ("leaf.mtl", b"newmtl a\nKd 0.5 0.5 0.5\nmap_Kd leaf.tga\n"),
        ("leaf.obj", obj("leaf").as_bytes()),
        ("black.tga", &tga([0, 0, 0, 255])),
        ("white.tga", &tga([255; 4])),
        ("leaf.tga", &tga([0, 0, 0, 128])),
    ]);
    let of = |name: &str| albedo(folder.path(), &format!("Mesh(\"{name}.obj\")"), "")[0];
    assert!((of("whole") - 0.5).abs() < 1e-3 && (of("map") - 1.0).abs() < 1e-3);
    assert!((0.65..0.85).contains(&of("part")), "{}", of("part"));
    assert!((0.4..0.6).contains(&of("leaf")), "{}", of("leaf"));
    // Under Whitted's transport, too, which shows bare meshes.
    let picture = |name: &str| hash(&folder.path().join(name));
    assert!(picture("map.obj") != picture("whole.obj") && picture("part.obj") != picture("whole.obj"));
}
