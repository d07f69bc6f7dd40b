//! One thing written in all formats, in all their encodings, here and far away, is the same surface in albedo,
//! normals, positions and light.

use std::path::Path;

use base64::prelude::*;
use rayfront::internals::film::Features;
use rayfront::math::{DVec3, Rgb};
use rayfront::render::Options;
use serde_json::{Value, json};

use crate::program::{Folder, Place, empty_folder};
use crate::support::session;

/// A box of 2 × 1.2 × 0.8 m around a point, with flat faces: four vertices each.
struct Block {
    center: DVec3,
    positions: Vec<DVec3>,
    normals: Vec<[f32; 3]>,
    /// (0, 0) is the image's top left.
    uvs: Vec<[f32; 2]>,
    /// On the sRGB curve.
    colors: Vec<[u8; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Block {
    fn at(center: DVec3) -> Block {
        let mut block = Block {
            center,
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            triangles: Vec::new(),
        };
        let half = DVec3::new(1.0, 0.6, 0.4);
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let across = |step: usize| {
                let mut unit = DVec3::ZERO;
                unit[(axis + step) % 3] = 1.0;
                unit
            };
            let (normal, right, up) = (across(0) * sign, across(1) * sign, across(2));
            let first = block.positions.len() as u32;
            for (u, v) in [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
                let corner = normal + right * (2.0 * u - 1.0) + up * (1.0 - 2.0 * v);
                block.positions.push(center + corner * half);
                block.normals.push(normal.as_vec3().to_array());
                block.uvs.push([u as f32, v as f32]);
                let number = block.colors.len() as u8;
                block.colors.push([255 - 9 * number, 128, 40 + 8 * number]);
            }
            block.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        block
    }

    fn rows(&self) -> impl Iterator<Item = (DVec3, [f32; 3], [f32; 2], [u8; 3])> {
        (0..self.positions.len())
            .map(|at| (self.positions[at], self.normals[at], self.uvs[at], self.colors[at]))
    }
}

/// The colours that a file gives a surface.
#[derive(Clone, Copy, PartialEq)]
enum Paint {
    /// A colour for each vertex.
    Vertices,
    /// A picture, by its file name.
    Picture(&'static str),
    /// Nothing: white, or the default.
    None,
}

/// A number type of PLY files.
#[derive(Clone, Copy)]
enum Number {
    Float,
    Double,
    Byte,
}

impl Number {
    fn name(self) -> &'static str {
        match self {
            Number::Float => "float",
            Number::Double => "double",
            Number::Byte => "uchar",
        }
    }

    fn bytes(self, value: f64, big: bool) -> Vec<u8> {
        let mut bytes = match self {
            Number::Float => (value as f32).to_le_bytes().to_vec(),
            Number::Double => value.to_le_bytes().to_vec(),
            Number::Byte => vec![value as u8],
        };
        if big {
            bytes.reverse();
        }
        bytes
    }
}

/// A PLY file: `encoding` is `ascii`, `binary_little_endian` or `binary_big_endian`.
fn ply(block: &Block, encoding: &str, positions: Number, colors: Number, paint: Paint) -> Vec<u8> {
    let mut header = format!("ply\nformat {encoding} 1.0\n");
    if let Paint::Picture(name) = paint {
        header += &format!("comment TextureFile {name}\n");
    }
    header += &format!("element vertex {}\n", block.positions.len());
    let mut kinds = vec![(positions, ["x", "y", "z"].as_slice()), (Number::Float, &["nx", "ny", "nz"])];
    match paint {
        Paint::Vertices => kinds.push((colors, &["red", "green", "blue"])),
        Paint::Picture(_) => kinds.push((Number::Float, &["s", "t"])),
        Paint::None => {}
    }
    for (kind, name) in kinds.iter().flat_map(|(kind, names)| names.iter().map(move |name| (kind, name))) {
        header += &format!("property {} {name}\n", kind.name());
    }
    header += &format!(
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        block.triangles.len()
    );
    let mut file = header.into_bytes();
    let big = encoding == "binary_big_endian";
    let mut row = |numbers: &[(Number, f64)]| {
        if encoding == "ascii" {
            let words: Vec<String> = numbers.iter().map(|(_, value)| format!("{value}")).collect();
            file.extend((words.join(" ") + "\n").into_bytes());
        } else {
            file.extend(numbers.iter().flat_map(|(kind, value)| kind.bytes(*value, big)));
        }
    };
    for (position, normal, [u, v], color) in block.rows() {
        let mut numbers: Vec<_> = position.to_array().map(|value| (positions, value)).to_vec();
        numbers.extend(normal.map(|value| (Number::Float, f64::from(value))));
        match paint {
            Paint::Vertices => numbers.extend(color.map(|value| match colors {
                Number::Byte => (colors, f64::from(value)),
                _ => (colors, f64::from(value) / 255.0),
            })),
            // v points up.
            Paint::Picture(_) => {
                numbers.extend([u, 1.0 - v].map(|value| (Number::Float, f64::from(value))));
            }
            Paint::None => {}
        }
        row(&numbers);
    }
    for triangle in &block.triangles {
        if encoding == "ascii" {
            file.extend(format!("3 {} {} {}\n", triangle[0], triangle[1], triangle[2]).into_bytes());
        } else {
            file.push(3);
            for index in triangle {
                file.extend(if big { index.to_be_bytes() } else { index.to_le_bytes() });
            }
        }
    }
    file
}

/// An OBJ file; with a picture it names the library `block.mtl`.
fn obj(block: &Block, paint: Paint) -> Vec<u8> {
    let mut text = String::new();
    if let Paint::Picture(_) = paint {
        text += "mtllib block.mtl\nusemtl paint\n";
    }
    for (DVec3 { x, y, z }, [nx, ny, nz], [u, v], color) in block.rows() {
        text += &format!("v {x} {y} {z}");
        if paint == Paint::Vertices {
            let [r, g, b] = color.map(|value| f64::from(value) / 255.0);
            text += &format!(" {r} {g} {b}");
        }
        text += &format!("\nvn {nx} {ny} {nz}\nvt {u} {}\n", 1.0 - v);
    }
    for triangle in &block.triangles {
        let [a, b, c] = triangle.map(|index| index + 1);
        text += &format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\n");
    }
    text.into_bytes()
}

fn stl(block: &Block, binary: bool) -> Vec<u8> {
    let corners = |triangle: &[u32; 3]| triangle.map(|index| block.positions[index as usize]);
    if !binary {
        let mut text = "solid block\n".to_owned();
        for triangle in &block.triangles {
            let [nx, ny, nz] = block.normals[triangle[0] as usize];
            text += &format!("facet normal {nx} {ny} {nz}\nouter loop\n");
            for DVec3 { x, y, z } in corners(triangle) {
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
        return (text + "endsolid block\n").into_bytes();
    }
    let mut file = vec![0; 80];
    file.extend((block.triangles.len() as u32).to_le_bytes());
    for triangle in &block.triangles {
        let normal = block.normals[triangle[0] as usize];
        file.extend(normal.iter().flat_map(|value| value.to_le_bytes()));
        for corner in corners(triangle) {
            file.extend(corner.as_vec3().to_array().iter().flat_map(|value| value.to_le_bytes()));
        }
        file.extend([0; 2]);
    }
    file
}

/// A way to write a glTF file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    /// JSON with its data within.
    Embedded,
    /// JSON and data in one binary file.
    Glb,
    /// Positions of 16 bits, normals and texture coordinates of 8 and 16 (`KHR_mesh_quantization`).
    Quantized,
    /// The first half of the positions in a sparse accessor over zeros, the second over values.
    Sparse,
}

/// A glTF file. Its node places the box, so that positions may have single precision.
fn gltf(block: &Block, encoding: Encoding, paint: Paint) -> Vec<u8> {
    let mut binary: Vec<u8> = Vec::new();
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    let mut view = |bytes: Vec<u8>| {
        binary.resize(binary.len().next_multiple_of(4), 0);
        views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()}));
        binary.extend(bytes);
        views.len() - 1
    };
    let floats =
        |numbers: &[f32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let count = block.positions.len();
    let local: Vec<[f32; 3]> =
        block.positions.iter().map(|position| (*position - block.center).as_vec3().to_array()).collect();
    let mut attributes = serde_json::Map::new();
    let mut add = |name: &str, accessor: Value| {
        attributes.insert(name.to_owned(), json!(accessors.len()));
        accessors.push(accessor);
    };
    let whole = |view: usize, component: u32, kind: &str| json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
    let quantized = encoding == Encoding::Quantized;
    if quantized {
        // Steps of 1/25,000 m: see the node's scale.
        let words = local.iter().flat_map(|p| [p[0], p[1], p[2], 0.0]).map(|c| (c * 25_000.0).round() as i16);
        let place = view(words.flat_map(i16::to_le_bytes).collect());
        add("POSITION", whole(place, 5122, "VEC3"));
        let bytes =
            block.normals.iter().flat_map(|n| [n[0], n[1], n[2], 0.0]).map(|c| (c * 127.0).round() as i8);
        let place = view(bytes.map(|byte| byte as u8).collect());
        let mut accessor = whole(place, 5120, "VEC3");
        accessor["normalized"] = json!(true);
        add("NORMAL", accessor);
    } else if encoding == Encoding::Sparse {
        let half = count / 2;
        let indices: Vec<u8> = (0..half as u16).flat_map(u16::to_le_bytes).collect();
        let base: Vec<f32> = (0..count).flat_map(|at| if at < half { [0.0; 3] } else { local[at] }).collect();
        let (base, at) = (view(floats(&base)), view(indices));
        let values = view(floats(local[..half].as_flattened()));
        let mut accessor = whole(base, 5126, "VEC3");
        accessor["sparse"] = json!({
            "count": half, "indices": {"bufferView": at, "componentType": 5123}, "values": {"bufferView": values},
        });
        add("POSITION", accessor);
        let place = view(floats(block.normals.as_flattened()));
        add("NORMAL", whole(place, 5126, "VEC3"));
    } else {
        let place = view(floats(local.as_flattened()));
        add("POSITION", whole(place, 5126, "VEC3"));
        let place = view(floats(block.normals.as_flattened()));
        add("NORMAL", whole(place, 5126, "VEC3"));
    }
    // Only the diffuse lobe.
    let mut material = json!({
        "pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
    });
    let mut more = json!({});
    match paint {
        Paint::Vertices => {
            // Linear, by the specification.
            let linear = |byte: u8| srgb_decode(f64::from(byte) / 255.0);
            let place = if quantized {
                let words =
                    block.colors.iter().flat_map(|[r, g, b]| [linear(*r), linear(*g), linear(*b), 1.0]);
                view(words.flat_map(|value| ((value * 65535.0).round() as u16).to_le_bytes()).collect())
            } else {
                let colors: Vec<f32> =
                    block.colors.as_flattened().iter().map(|byte| linear(*byte) as f32).collect();
                view(floats(&colors))
            };
            let mut accessor =
                whole(place, if quantized { 5123 } else { 5126 }, if quantized { "VEC4" } else { "VEC3" });
            accessor["normalized"] = json!(quantized);
            add("COLOR_0", accessor);
        }
        Paint::Picture(name) => {
            let place = if quantized {
                view(
                    block
                        .uvs
                        .as_flattened()
                        .iter()
                        .flat_map(|c| ((c * 65535.0) as u16).to_le_bytes())
                        .collect(),
                )
            } else {
                view(floats(block.uvs.as_flattened()))
            };
            let mut accessor = whole(place, if quantized { 5123 } else { 5126 }, "VEC2");
            accessor["normalized"] = json!(quantized);
            add("TEXCOORD_0", accessor);
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
            more = json!({"textures": [{"source": 0}], "images": [{"uri": name}]});
        }
        Paint::None => {}
    }
    let place =
        view(block.triangles.as_flattened().iter().flat_map(|index| (*index as u16).to_le_bytes()).collect());
    let indices = accessors.len();
    accessors.push(json!({"bufferView": place, "componentType": 5123, "count": 3 * block.triangles.len(), "type": "SCALAR"}));
    if quantized {
        for place in [0, 1] {
            views[place]["byteStride"] = json!(if place == 0 { 8 } else { 4 });
        }
    }
    let mut node = json!({"mesh": 0, "translation": block.center.to_array()});
    if quantized {
        node["scale"] = json!([1.0 / 25_000.0, 1.0 / 25_000.0, 1.0 / 25_000.0]);
    }
    let mut buffer = json!({"byteLength": binary.len()});
    if encoding != Encoding::Glb {
        buffer["uri"] =
            json!(format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(&binary)));
    }
    let mut file = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [node],
        "extensionsUsed": ["KHR_materials_specular", "KHR_mesh_quantization"],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": indices, "material": 0}]}],
        "materials": [material], "accessors": accessors, "bufferViews": views, "buffers": [buffer],
    });
    if let (Value::Object(file), Value::Object(more)) = (&mut file, more) {
        file.extend(more);
    }
    if encoding == Encoding::Glb { glb(&file, binary) } else { file.to_string().into_bytes() }
}

fn glb(file: &Value, mut binary: Vec<u8>) -> Vec<u8> {
    let mut text = file.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + text.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn srgb_decode(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// The first hits and the light of an image of the box.
struct Seen {
    features: Vec<Features>,
    light: Vec<Rgb>,
}

const SIDE: u32 = 24;

impl Seen {
    /// Renders a box around `center` that an entity shows.
    fn of(folder: &Folder, entity: &str, center: DVec3) -> Seen {
        let place = |offset: [f64; 3]| {
            let [x, y, z] = (center + DVec3::from(offset)).to_array();
            format!("({x}, {y}, {z})")
        };
        let text = format!(
            r#"(
    settings: (size: ({SIDE}, {SIDE}), samples: 16, transport: Path, filter: Box, sharing: Off),
    materials: {{ "white": (diffuse: 1), "paint": (diffuse: Image("paint.png")) }},
    entities: [
        (camera: Pinhole(vertical_fov_degrees: 40), transform: LookAt(from: {}, to: {})),
        ({entity}),
        (light: Point(power_w: 300), transform: (translate: {})),
        (light: Directional(irradiance: 1.5), transform: LookAt(from: {}, to: {})),
    ],
)"#,
            place([1.6, 1.5, 2.4]),
            place([0.0; 3]),
            place([-1.0, 1.7, 1.3]),
            place([3.0, 2.0, 0.5]),
            place([0.0; 3]),
        );
        folder.write("scene.ron", &text);
        let world =
            rayfront::formats::load(folder.join("scene.ron")).unwrap_or_else(|error| panic!("{error}"));
        let session = session(&world, Options::default());
        Seen { features: session.features(), light: session.film().radiance() }
    }

    /// Errors: the largest difference if it is larger than `step`, relative to the value or 1.
    fn differs(&self, other: &Seen, step: f32) -> Option<String> {
        let mut worst: Option<(f32, String)> = None;
        let mut note = |what: &str, pixel: usize, a: &[f32], b: &[f32]| {
            let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, f32::max);
            if apart > step && worst.as_ref().is_none_or(|(most, _)| apart > *most) {
                worst = Some((apart, format!("{what} of pixel {pixel}: {a:?} and {b:?}")));
            }
        };
        for (pixel, (a, b)) in self.features.iter().zip(&other.features).enumerate() {
            note("coverage", pixel, &[a.coverage], &[b.coverage]);
            if a.coverage == 1.0 && b.coverage == 1.0 {
                note("depth", pixel, &[a.depth_m], &[b.depth_m]);
                note("normal", pixel, &a.normal, &b.normal);
                note("albedo", pixel, &a.albedo.to_array(), &b.albedo.to_array());
            }
        }
        for (pixel, (a, b)) in self.light.iter().zip(&other.light).enumerate() {
            note("light", pixel, &a.to_array(), &b.to_array());
        }
        worst.map(|(_, text)| text)
    }

    fn albedo(&self) -> [f64; 3] {
        let on = self.features.iter().filter(|features| features.coverage == 1.0);
        let count = on.clone().count() as f64;
        [0, 1, 2]
            .map(|channel| on.clone().map(|f| f64::from(f.albedo.to_array()[channel])).sum::<f64>() / count)
    }
}

/// Where things stand: here, and so far away that single precision has steps of a metre.
const PLACES: [DVec3; 2] = [DVec3::ZERO, DVec3::new(450_123.37, 10_000_000.3, -5_412_345.71)];

/// All files of a box with their contents, the entity that shows each, and the largest difference.
fn written(center: DVec3, paint: Paint) -> Vec<(String, Vec<u8>, String, f32)> {
    let block = Block::at(center);
    let is_far = center != DVec3::ZERO;
    let mut files = Vec::new();
    let mut add = |name: String, bytes: Vec<u8>, more: &str, step: f32| {
        let shape = if name.ends_with("gltf") || name.ends_with("glb") {
            format!("gltf: \"{name}\"")
        } else {
            format!("shape: Mesh(\"{name}\"){more}")
        };
        files.push((name, bytes, shape, step));
    };
    let white = if paint == Paint::None { ", material: \"white\"" } else { "" };
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (positions, colors) in
            [(Number::Double, Number::Byte), (Number::Double, Number::Float), (Number::Float, Number::Float)]
        {
            let is_coarse = matches!(positions, Number::Float) && encoding != "ascii";
            if !(is_coarse && is_far) {
                let name = format!("{encoding}_{}_{}.ply", positions.name(), colors.name());
                add(name, ply(&block, encoding, positions, colors, paint), white, 2e-4);
            }
        }
    }
    if paint == Paint::None {
        add("block.stl".to_owned(), stl(&block, false), white, 2e-4);
        if !is_far {
            add("binary.stl".to_owned(), stl(&block, true), white, 2e-4);
        }
    }
    add("block.obj".to_owned(), obj(&block, paint), white, 2e-4);
    for encoding in [Encoding::Embedded, Encoding::Sparse, Encoding::Quantized, Encoding::Glb] {
        let ending = if encoding == Encoding::Glb { "glb" } else { "gltf" };
        add(format!("{encoding:?}.{ending}"), gltf(&block, encoding, paint), "", 2e-4);
    }
    files
}

fn check(paint: Paint) -> Seen {
    let folder = &empty_folder();
    picture(&folder.join("paint.png"));
    folder.write("block.mtl", "newmtl paint\nKd 1 1 1\nKs 0 0 0\nmap_Kd paint.png\n");
    let mut first: Option<(String, Seen)> = None;
    let mut faults = Vec::new();
    for center in PLACES {
        for (name, bytes, entity, step) in written(center, paint) {
            folder.write(&name, bytes);
            let seen = Seen::of(folder, &entity, center);
            let Some((other, same)) = &first else {
                assert!(seen.features.iter().any(|features| features.coverage == 1.0));
                first = Some((name, seen));
                continue;
            };
            let fault = seen.differs(same, step);
            faults.extend(fault.map(|fault| format!("{name} at {center} and {other}: {fault}")));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    first.expect("files").1
}

#[test]
fn one_box_looks_the_same_in_all_formats() {
    let seen = check(Paint::None);
    assert_eq!(seen.albedo(), [1.0; 3]);
}

/// Colours of vertices are on the sRGB curve in PLY and OBJ files, and linear in glTF; nothing else darkens them.
#[test]
fn colors_of_vertices_look_the_same_in_all_formats() {
    let seen = check(Paint::Vertices);
    let green = srgb_decode(128.0 / 255.0);
    assert!((seen.albedo()[1] - green).abs() < 1e-4, "{:?}", seen.albedo());
}

/// Four by four squares of distinct colours.
fn picture(path: &Path) {
    let color = |x: u32, y: u32| {
        [40 + 13 * (x / 8 + 4 * (y / 8)) as u8, 255 - 40 * (x / 8) as u8, 90 + 30 * (y / 8) as u8]
    };
    image::RgbImage::from_fn(32, 32, |x, y| image::Rgb(color(x, y))).save(path).expect("a picture");
}

#[test]
fn textures_look_the_same_in_all_formats() {
    check(Paint::Picture("paint.png"));
}
