use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::math::{Rgb, Vec2, Vec3};

fn parse_bytes(bytes: &[u8]) -> Result<Mesh, String> {
    parse_file(bytes).map(|file| Arc::unwrap_or_clone(file.mesh))
}

fn parse_file(bytes: &[u8]) -> Result<MeshFile, String> {
    parse(bytes, Path::new("a.ply")).map_err(|error| error.to_string())
}

/// The mesh of a text, and its warnings.
fn mended(text: &str) -> (Mesh, Vec<String>) {
    let MeshFile { mesh, warnings, .. } = parse_file(text.as_bytes()).unwrap();
    (Arc::unwrap_or_clone(mesh), warnings.iter().map(ToString::to_string).collect())
}

fn refusal(text: &str) -> String {
    parse_bytes(text.as_bytes()).expect_err("must be refused")
}

/// A file given by typed numbers, for each of the three encodings.
struct Sample {
    header: &'static str,
    numbers: Vec<(&'static str, f64)>,
}

impl Sample {
    /// All types, lists before and after the supported properties, unknown elements, faces before vertices.
    fn rich() -> Sample {
        let mut numbers = vec![];
        // extra: a list and a scalar.
        numbers.extend([("uchar", 2.0), ("double", 0.5), ("double", 1.5), ("short", -7.0)]);
        // face: list before, indices, list after, scalar.
        for corners in [&[0.0, 1.0, 2.0, 3.0][..], &[0.0, 2.0, 4.0], &[1.0]] {
            numbers.extend([("ushort", 1.0), ("char", -1.0), ("int", corners.len() as f64)]);
            numbers.extend(corners.iter().map(|&c| ("ushort", c)));
            numbers.extend([("uint", 0.0), ("float", 0.25)]);
        }
        // vertex: blue z list y x red green nz ny nx v u.
        for i in 0..5 {
            let (x, y) = (f64::from(i % 2), f64::from(i / 2));
            numbers.extend([("uchar", 255.0), ("int", -3.0), ("uchar", 1.0), ("float", 9.0)]);
            numbers.extend([("double", y), ("char", x), ("uchar", 0.0), ("uchar", 188.0)]);
            numbers.extend([
                ("short", 1.0),
                ("float", 0.0),
                ("float", 0.0),
                ("float", 0.25),
                ("uchar", 255.0),
            ]);
        }
        let header = "comment by \u{e9}\nobj_info x y\n\nelement extra 1\nproperty list uchar double a\n\
            property int16 b\nelement face 3\nproperty list uint16 char first\n\
            property list int ushort vertex_index\nproperty list uint32 float64 none\nproperty float32 quality\n\
            element vertex 5\nproperty uchar blue\nproperty int z\nproperty list uint8 float extra\n\
            property double y\nproperty int8 x\nproperty uchar red\nproperty uchar green\nproperty short nz\n\
            property float ny\nproperty float nx\nproperty float texture_v\nproperty uchar texture_u\n\
            end_header\n";
        Sample { header, numbers }
    }

    fn ascii(&self) -> Vec<u8> {
        let body: Vec<String> = self.numbers.iter().map(|(_, n)| n.to_string()).collect();
        format!("ply\nformat ascii 1.0\n{}{}\n", self.header, body.join(" ")).into_bytes()
    }

    fn binary(&self, big: bool) -> Vec<u8> {
        let format = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut file = format!("ply\nformat {format} 1.0\n{}", self.header).into_bytes();
        for &(name, n) in &self.numbers {
            let mut bytes = match name {
                "char" => (n as i8).to_le_bytes().to_vec(),
                "uchar" => (n as u8).to_le_bytes().to_vec(),
                "short" => (n as i16).to_le_bytes().to_vec(),
                "ushort" => (n as u16).to_le_bytes().to_vec(),
                "int" => (n as i32).to_le_bytes().to_vec(),
                "uint" => (n as u32).to_le_bytes().to_vec(),
                "float" => (n as f32).to_le_bytes().to_vec(),
                _ => n.to_le_bytes().to_vec(),
            };
            if big {
                bytes.reverse();
            }
            file.extend(bytes);
        }
        file
    }

    fn files(&self) -> [Vec<u8>; 3] {
        [self.ascii(), self.binary(false), self.binary(true)]
    }
}

#[test]
fn all_encodings_give_the_same_mesh() {
    for file in Sample::rich().files() {
        let mesh = parse_bytes(&file).unwrap();
        assert_eq!((mesh.name.as_str(), mesh.source.as_deref()), ("a", Some(Path::new("a.ply"))));
        assert_eq!(mesh.positions[3], Vec3::new(1.0, 1.0, -3.0));
        assert_eq!(mesh.normals, [Vec3::Z; 5]);
        assert_eq!(mesh.uvs, [Vec2::new(1.0, 0.75); 5]);
        assert_eq!((mesh.colors[0].r, mesh.colors[0].b), (0.0, 1.0));
        assert!((mesh.colors[0].g - 0.502_886_5).abs() < 1e-6, "{:?}", mesh.colors[0]);
        // The quad 0 1 2 3 intersects itself (a bow tie), so either diagonal will do.
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 4]]);
    }
}

#[test]
fn truncated_files_are_rejected_without_panics() {
    for file in Sample::rich().files() {
        // A text file may lose digits of its last number, 255, undetected.
        for length in 0..file.len() - "55\n".len() {
            assert!(parse_bytes(&file[..length]).is_err(), "{length} of {} bytes", file.len());
        }
    }
}

#[test]
fn windows_and_old_mac_line_endings_are_read() {
    let lf = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\n\
        property uchar z\nelement face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
    // The first coordinate is a line feed.
    let body = [10, 0, 0, 1, 13, 0, 0, 1, 10, 3, 0, 1, 2];
    let text = String::from_utf8(lf.to_vec()).unwrap();
    for ending in ["\n", "\r\n", "\r"] {
        let mut file = text.replace('\n', ending).into_bytes();
        file.extend(body);
        let mesh = parse_bytes(&file).unwrap();
        assert_eq!(mesh.positions[0], Vec3::new(10.0, 0.0, 0.0), "{ending:?}");
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }
}

fn ascii(vertex_properties: &str, face: &str, vertices: &str, faces: &str) -> String {
    let properties: String =
        vertex_properties.split(' ').map(|name| format!("property float {name}\n")).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\n{properties}element {face}\nend_header\n{vertices}\n{faces}\n",
        vertices.lines().count()
    )
}

const FACES: &str = "\nproperty list uchar int vertex_indices";
const CORNERS: &str = "0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0";
const WITH_NORMALS: &str = "0 0 0 0 0 1\n4 0 0 0 0 1\n4 4 0 1 0 0\n2 1 0 0 0 1\n0 4 0 0 0 1";

#[test]
fn concave_polygons_are_triangulated() {
    let mesh =
        parse_bytes(ascii("x y z", &format!("face 2{FACES}"), CORNERS, "5 0 1 2 3 4 2 0 1").as_bytes())
            .unwrap();
    assert_eq!(mesh.triangles.len(), 3);
    let area: f32 = mesh
        .triangles
        .iter()
        .map(|t| t.map(|i| mesh.positions[i as usize]))
        .map(|[a, b, c]| (b - a).cross(c - a).z / 2.0)
        .inspect(|area| assert!(*area > 0.0))
        .sum();
    assert_eq!(area, 10.0);
}

#[test]
fn strips_flip_every_second_triangle_and_restart() {
    let face = "tristrips 1\nproperty list int int vertex_indices";
    let mesh = parse_bytes(ascii("x y z", face, CORNERS, "9 0 1 2 3 3 4 -1 4 0").as_bytes()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
    assert!(refusal(&ascii("x y z", face, CORNERS, "4 0 1 2 5")).contains("tristrips 0: vertex index 5"));
}

#[test]
fn texture_coordinates_per_face_split_vertices() {
    let face = "face 3\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord";
    let faces = "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 4 6 0 0 .5 .5 0 1\n3 0 1 2 0";
    let mesh = parse_bytes(ascii("x y z nx ny nz", face, WITH_NORMALS, faces).as_bytes()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 5, 4], [0, 1, 2]]);
    assert_eq!(mesh.positions[5], mesh.positions[2]);
    assert_eq!(mesh.normals[5], Vec3::X);
    assert_eq!(mesh.uvs[5], Vec2::new(0.5, 0.5));
    assert_eq!(mesh.uvs[0], Vec2::new(0.0, 1.0));
    // The file's faces must not refer to copied vertices.
    let beyond = faces.replace("3 0 1 2 0", "3 0 1 5 6 0 0 0 0 0 0");
    assert!(
        refusal(&ascii("x y z", face, CORNERS, &beyond))
            .ends_with("vertex index 5 is out of range: there are 5 vertices")
    );
}

#[test]
fn face_colours_split_vertices() {
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue";
    let face = format!("face 3{FACES}\n{colors}");
    let faces = "3 0 1 2 255 0 0\n3 0 2 4 0 0 255\n3 0 1 2 255 0 0";
    let mesh = parse_bytes(ascii("x y z nx ny nz", &face, WITH_NORMALS, faces).as_bytes()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [5, 6, 4], [0, 1, 2]]);
    let (red, blue) = (Rgb::new(1.0, 0.0, 0.0), Rgb::new(0.0, 0.0, 1.0));
    // No face uses the fourth vertex.
    assert_eq!(mesh.colors, [red, red, red, Rgb::WHITE, blue, blue, blue]);
    assert_eq!((mesh.positions[6], mesh.normals[6]), (mesh.positions[2], Vec3::X));

    // With texture coordinates per face, both count.
    let face = format!("face 2{FACES}\nproperty list uchar float texcoord\n{colors}");
    let faces = "3 0 1 2 6 0 0 1 0 1 1 255 0 0\n3 0 2 4 6 0 0 .5 .5 0 1 255 0 0";
    let mesh = parse_bytes(ascii("x y z", &face, CORNERS, faces).as_bytes()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 5, 4]]);
    assert_eq!((mesh.colors[5], mesh.uvs[5]), (red, Vec2::new(0.5, 0.5)));

    // Vertex colours take precedence.
    let vertices = "0 0 0 .5 .5 .5\n4 0 0 .5 .5 .5\n4 4 0 .5 .5 .5";
    let file =
        ascii("x y z red green blue", &format!("face 1{FACES}\n{colors}"), vertices, "3 0 1 2 255 0 0");
    let gray = crate::film::tonemap::srgb_decode(0.5);
    assert_eq!(parse_bytes(file.as_bytes()).unwrap().colors, [Rgb::splat(gray); 3]);
}

#[test]
fn bad_values_that_are_no_geometry_are_mended_and_told() {
    let face = format!("face 2{FACES}");
    let columns = "x y z nx ny nz u v red green blue alpha";
    // The second face is upright and three times as large. No face uses the last vertex.
    let vertices = "0 0 0 nan 0 0 inf 0 nan -1 1 1\n1 0 0 0 0 1 0 0 0 0 0 1\n0 1 0 0 0 1 0 0 0 0 0 .5\n\
                    0 0 3 0 0 1 0 0 1.#QNAN 0 0 .5\n0 inf 0 0 1.#IND 1 0 0 0 0 0 1";
    let (mesh, warnings) = mended(&ascii(columns, &face, vertices, "3 0 1 2\n3 0 2 3"));
    let normal = mesh.normals[0];
    assert!((normal - Vec3::new(3.0, 0.0, 1.0).normalize()).length() < 1e-6, "{normal}");
    assert_eq!((mesh.uvs[0], mesh.colors[0]), (Vec2::ZERO, Rgb::new(1.0, 0.0, 1.0)));
    assert_eq!(mesh.positions[4], Vec3::ZERO, "inside of the others");
    let expected = [
        "positions that are not finite: 1, of vertex 4; no face uses them, so they are left out",
        "normals that are not finite: 2, the first of vertex 0; worked out from the faces instead",
        "texture coordinates that are not finite: 1, of vertex 0; (0, 0) instead",
        "colours that are not finite: 2, the first of vertex 0; 1 instead",
        "alphas below 1: 2, the first of vertex 2; not supported and ignored: the mesh is opaque",
    ];
    assert_eq!(warnings, expected.map(|line| format!("a.ply: {line}")));
    let message = refusal(&ascii("x y z", &face, "0 0 0\n0 -inf 0\n0 1 0", "3 0 2 2\n3 0 1 2"));
    assert_eq!(message, "a.ply: face 1: the position of its vertex 1 is [0, -inf, 0], which is not finite");
}

/// Scanners write what belongs to no image, too: it is no fault.
#[test]
fn properties_that_make_no_whole_are_left_out_and_told() {
    let face = format!("face 1{FACES}");
    let told = |columns: &str, values: &str| {
        let vertices = format!("0 0 0 {values}\n1 0 0 {values}\n0 1 0 {values}");
        let (mesh, warnings) = mended(&ascii(&format!("x y z {columns}"), &face, &vertices, "3 0 1 2"));
        assert!(mesh.colors.is_empty() && mesh.normals.is_empty() && mesh.uvs.is_empty());
        warnings
    };
    let expected = |names: &str| {
        format!("a.ply: its vertices have not all of {names}: what they have of these is left out")
    };
    assert_eq!(told("red green", "255 128"), [expected("red, green, blue")]);
    assert_eq!(told("nx ny s", "1 0 0.5"), [expected("nx, ny, nz"), expected("u, v")]);
    assert!(told("intensity confidence", "0.5 1").is_empty());
}

#[test]
fn bad_values_of_faces_are_mended_where_faces_split_vertices() {
    let face = "face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
                property float red\nproperty float green\nproperty float blue";
    let vertices = "0 0 0 0 0 1\n4 0 0 0 nan 1\n4 4 0 0 0 1\nnan 0 0 0 0 1";
    let faces = "3 0 1 2 6 0 0 nan 0 1 1 0.5 0.5 nan\n3 0 2 1 6 0 1 1 1 .5 0 1 1 1";
    let (mesh, warnings) = mended(&ascii("x y z nx ny nz", face, vertices, faces));
    // The two faces cancel out at the vertex and its copy.
    let second: Vec<usize> =
        (0..mesh.positions.len()).filter(|i| mesh.positions[*i] == Vec3::X * 4.0).collect();
    assert!(second.len() == 2 && second.iter().all(|i| mesh.normals[*i] == Vec3::ZERO), "{mesh:?}");
    assert_eq!(mesh.uvs[1], Vec2::ZERO);
    assert_eq!(mesh.colors[0].b, 1.0);
    assert_eq!(warnings.len(), 4, "{warnings:?}");
    assert!(warnings[2].ends_with("not finite: 1, of face 0; (0, 0) instead"), "{warnings:?}");
    // A copy of a vertex without a position is refused by the number of the original.
    let bad = faces.replace("3 0 2 1", "3 3 2 1");
    let message = refusal(&ascii("x y z nx ny nz", face, vertices, &bad));
    assert!(message.contains("face 1: the position of its vertex 3"), "{message}");
}

#[test]
fn numbers_and_headers_of_other_programs_are_read() {
    let face = format!("face 1{FACES}");
    let plain = ascii("x y z", &face, "0 0 0\n1.5 0 0\n0 2000 0", "3 0 1 2");
    let expected = parse_bytes(plain.as_bytes()).unwrap();
    let body = plain.replace("1.5", "1,5").replace("2000", "2D+03");
    let header = plain
        .replace("format", "comment before it\nformat")
        .replace("\nend_header", "\nobj_info\nend_header ");
    let marked = format!("\u{feff}{plain}");
    let singular = plain.replace("vertex_indices", "vertex_index");
    let floats = plain.replace("uchar int", "uchar float").replace("3 0 1 2", "3 0 1.0 2");
    let upper = plain.replace("ply\n", "PLY\n").replace("float x", "FLOAT x");
    let comments = plain
        .replace("end_header\n", "end_header\ncomment the vertices\n")
        .replace("3 0", "comment faces\n3 0");
    for text in [body, floats, upper, comments, header.clone(), header.replace('\n', "\r"), marked, singular]
    {
        assert_eq!(parse_bytes(text.as_bytes()).as_ref(), Ok(&expected), "{text}");
    }
}

#[test]
fn images_on_the_surface_are_named_by_comments() {
    let face = format!("face 2{FACES}\nproperty int texnumber");
    let text = ascii("x y z s t", &face, "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1", "3 0 1 2 1\n3 0 2 1 -1");
    let named =
        "comment TextureFile  a b.png \ncomment made by hand\ncomment TextureFile c.png\nelement vertex";
    let file = parse_file(text.replace("element vertex", named).as_bytes()).unwrap();
    assert_eq!(file.images, [("a b.png".to_owned(), 3), ("c.png".to_owned(), 5)]);
    assert_eq!(file.image_of, [1, u32::MAX]);
    assert!(parse_file(text.as_bytes()).unwrap().images.is_empty());
}

#[test]
fn colours_follow_the_srgb_curve() {
    let file = |kind: &str, colors: &str| {
        let text = ascii("x y z red green blue", &format!("face 1{FACES}"), colors, "3 0 1 2");
        let text = ["red", "green", "blue"]
            .iter()
            .fold(text, |text, name| text.replace(&format!("float {name}"), &format!("{kind} {name}")));
        parse_bytes(text.as_bytes()).unwrap().colors[0].to_array()
    };
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    // 0.5 on the curve is 0.214041 in linear light; below 0.04045 the curve is a line.
    assert!(near(file("ushort", "0 0 0 0 65535 1285\n1 0 0 0 0 0\n0 1 0 0 0 0"), [0.0, 1.0, 0.001_517_635]));
    for kind in ["uchar", "int"] {
        assert!(near(
            file(kind, "0 0 0 128 255 5\n1 0 0 0 0 0\n0 1 0 0 0 0"),
            [0.215_860_5, 1.0, 0.001_517_635]
        ));
    }
    // Floats are on the same curve, from 0 to 1 or to 255.
    let [r, g, b] = file("double", "0 0 0 0.5 1.5 -1\n1 0 0 0 0 0\n0 1 0 0 0 0");
    assert!(near([r, 0.0, b], [0.214_041_1, 0.0, 0.0]) && g > 1.0);
    for kind in ["float", "double"] {
        assert!(near(
            file(kind, "0 0 0 128 255 5\n1 0 0 0 0 0\n0 1 0 0 0 0"),
            [0.215_860_5, 1.0, 0.001_517_635]
        ));
    }
}

#[test]
fn errors_name_the_place_and_the_reason() {
    let face = format!("face 2{FACES}");
    let body = |vertices: &str, faces: &str| refusal(&ascii("x y z", &face, vertices, faces));
    let good = "0 0 0\n1 0 0\n0 1 0";
    assert_eq!(
        body(good, "3 0 1 2\n3 0 1 3"),
        "a.ply: face 1: vertex index 3 is out of range: there are 3 vertices"
    );
    assert_eq!(body(good, "3 0 1 2 3 0 1"), "a.ply: face 1: the file ends here: it is cut short");
    assert_eq!(body("0 0 0\n1 O 0\n0 1 0", "3 0 1 2 3 0 1 2"), "a.ply: vertex 1: \"O\" is not a number");
    assert_eq!(body(good, "3 0 1 2\n3.5 0 1 2"), "a.ply: face 1: \"3.5\" is not an integer that fits here");
    assert_eq!(body(good, "0\n0"), "a.ply: has no faces (is it a point cloud?): make a surface of it first");
    let header = |lines: &str| refusal(&format!("ply\n{lines}"));
    assert!(refusal("solid cube").starts_with("a.ply:1:1: not a PLY file"));
    assert!(header("format ascii 2.0\n").starts_with("a.ply:2:1: unknown format version"));
    assert!(header("format ascii 1.0\nelement vertex -1\n").starts_with("a.ply:3:1: \"-1\" is not a number"));
    assert!(header("format ascii 1.0\nproperty float x\n").starts_with("a.ply:3:1: a property before"));
    assert!(
        header("format ascii 1.0\nelement a 1\nproperty half x\n")
            .starts_with("a.ply:4:1: unknown type \"half\"")
    );
    assert!(header("format ascii 1.0\nelement a 1\nproperty list float int x\n").contains("integer type"));
    assert!(header("format ascii 1.0\nend_header\n").contains("has no vertices"));
    assert!(header("end_header\n").contains("a.ply:2:1: no \"format\" line"));
    assert!(
        header("format ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nend_header\n")
            .contains("element vertex has no property z")
    );
}

#[test]
fn declared_counts_beyond_the_file_cost_no_memory() {
    let count = u64::MAX;
    for format in ["ascii", "binary_little_endian"] {
        let vertices = format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
             property float z\nend_header\n1 2 3 4 5 6"
        );
        assert!(refusal(&vertices).contains("the header promises"));
        let list = format!(
            "ply\nformat {format} 1.0\nelement other 1\nproperty list uint double x\nelement vertex 0\n\
             property float x\nproperty float y\nproperty float z\nend_header\n4294967295 0 0 0"
        );
        assert!(refusal(&list).contains("other 0: the file ends here"));
        // Rows without columns take no space, and must not take time either.
        let empty = format!(
            "ply\nformat {format} 1.0\nelement other {count}\nelement vertex 0\nproperty float x\n\
             property float y\nproperty float z\nend_header\n"
        );
        assert!(refusal(&empty).contains("has no faces"));
    }
}

/// Meshes whose v coordinates survive 1 − v without loss.
fn any_mesh() -> impl Strategy<Value = Mesh> {
    let finite = || prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO;
    let vertex = (
        prop::array::uniform3(finite()),
        prop::array::uniform3(finite()),
        (finite(), 0u32..=1 << 24),
        prop::array::uniform3(0.0f32..4.0),
    );
    let columns = prop::array::uniform3(any::<bool>());
    (prop::collection::vec(vertex, 3..20), columns).prop_flat_map(|(vertices, [normals, uvs, colors])| {
        let index = 0..vertices.len() as u32;
        prop::collection::vec(prop::array::uniform3(index), 1..20).prop_map(move |triangles| {
            let keep = |flag: bool| vertices.iter().filter(move |_| flag);
            Mesh {
                name: "a".into(),
                source: Some("a.ply".into()),
                positions: vertices.iter().map(|v| v.0.into()).collect(),
                normals: keep(normals).map(|v| v.1.into()).collect(),
                uvs: keep(uvs).map(|v| Vec2::new(v.2.0, v.2.1 as f32 / (1 << 24) as f32)).collect(),
                colors: keep(colors).map(|v| v.3.into()).collect(),
                triangles,
                ..Mesh::default()
            }
        })
    })
}

proptest! {
    #[test]
    fn written_meshes_read_back_unchanged(mesh in any_mesh()) {
        let mut file = Vec::new();
        write(&mesh, &mut file).unwrap();
        let mut read = parse_bytes(&file).unwrap();
        for (color, written) in read.colors.iter_mut().zip(&mesh.colors) {
            let pairs = color.to_array().into_iter().zip(written.to_array());
            prop_assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= 1e-6 * b.max(1.0)), "{color:?}: {written:?}");
            *color = *written;
        }
        prop_assert_eq!(read, mesh);
    }

    #[test]
    fn damaged_files_do_not_panic(
        which in 0usize..3,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut file = Sample::rich().files()[which].clone();
        for (place, value) in damage {
            let place = place.index(file.len());
            file[place] = value;
        }
        if let Ok(mesh) = parse_bytes(&file) {
            prop_assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
            prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
        }
    }
}

#[test]
fn meshes_with_columns_of_unequal_length_are_not_written() {
    let mesh = Mesh { positions: vec![Vec3::ZERO; 3], normals: vec![Vec3::X], ..Mesh::default() };
    assert!(write(&mesh, std::io::sink()).is_err());
}

/// Blender names properties by its vertex groups.
#[test]
fn names_of_properties_may_have_blanks() {
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float bone 0\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int old list\nproperty list uchar int vertex_indices\n\
        end_header\n";
    let file = format!("{head}0 9 0 0\n1 9 0 0\n0 9 1 0\n1 7 3 0 1 2\n");
    let mesh = parse(file.as_bytes(), Path::new("a.ply")).unwrap().mesh;
    assert_eq!(
        (&mesh.positions[..], &mesh.triangles[..]),
        (&[Vec3::ZERO, Vec3::X, Vec3::Y][..], &[[0, 1, 2]][..])
    );
}
