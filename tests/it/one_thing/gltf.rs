//! Solids as glTF files, in all their encodings.

use base64::prelude::*;
use serde_json::{Map, Value, json};

use super::files::Paint;
use super::packed::{self, Filter};
use super::solid::Solid;
use super::{EXACT, Tolerance, rounded, srgb_decode};

/// A way to write a glTF file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// JSON with its data within.
    Embedded,
    /// JSON and data in one binary file.
    Glb,
    /// Positions of 16 bits, normals and texture coordinates of 8 and 16 (`KHR_mesh_quantization`).
    Quantized,
    /// The first half of the positions in a sparse accessor over zeros, the second over values.
    Sparse,
    /// `EXT_meshopt_compression`: floats in the first version of attributes.
    Meshopt,
    /// `KHR_meshopt_compression`: the second version of attributes, after filters.
    MeshoptFiltered,
    /// `KHR_draco_mesh_compression` of floats.
    Draco,
    /// The same of integers, and normals on an octahedron.
    DracoQuantized,
}

impl Encoding {
    pub const ALL: [Encoding; 8] = [
        Encoding::Embedded,
        Encoding::Glb,
        Encoding::Quantized,
        Encoding::Sparse,
        Encoding::Meshopt,
        Encoding::MeshoptFiltered,
        Encoding::Draco,
        Encoding::DracoQuantized,
    ];

    pub fn file_name(self) -> String {
        format!("{self:?}.{}", if self == Encoding::Glb { "glb" } else { "gltf" })
    }

    /// What rounding may do to places, and to normals that lie on no axis.
    pub fn tolerance(self) -> Tolerance {
        match self {
            Encoding::Quantized => rounded(0.02),
            Encoding::MeshoptFiltered | Encoding::DracoQuantized => rounded(5e-4),
            _ => EXACT,
        }
    }
}

/// Numbers of all vertices.
pub struct Column {
    pub name: &'static str,
    /// Components of a vertex.
    pub width: usize,
    pub numbers: Vec<f32>,
}

const FLOAT: u32 = 5126;

/// A number type of accessors.
#[derive(Clone, Copy)]
enum Kind {
    Float,
    /// Integers: `componentType`, bytes, 1 as an integer, whether they are `normalized`.
    Integer(u32, usize, f32, bool),
}

const BYTES: Kind = Kind::Integer(5120, 1, 127.0, true);
const SHORTS: Kind = Kind::Integer(5122, 2, 32_767.0, true);
const WORDS: Kind = Kind::Integer(5123, 2, 65_535.0, true);
/// Steps of 1/25,000 m: see the node's scale.
const LENGTHS: Kind = Kind::Integer(5122, 2, 25_000.0, false);

impl Kind {
    /// Returns `componentType`, `normalized`, and elements padded to multiples of four bytes, with their size.
    fn encoded(self, column: &Column) -> (u32, bool, Vec<u8>, usize) {
        let mut bytes = Vec::new();
        let (component, normalized) = match self {
            Kind::Float => (FLOAT, false),
            Kind::Integer(component, _, _, normalized) => (component, normalized),
        };
        let rows = column.numbers.chunks_exact(column.width);
        let count = rows.len();
        for row in rows {
            for number in row {
                match self {
                    Kind::Float => bytes.extend(number.to_le_bytes()),
                    Kind::Integer(_, size, one, _) => {
                        bytes.extend(&((number * one).round() as i32).to_le_bytes()[..size]);
                    }
                }
            }
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
        let stride = bytes.len() / count;
        (component, normalized, bytes, stride)
    }
}

fn columns(solid: &Solid, paint: Paint) -> Vec<Column> {
    let local = solid.positions.iter().flat_map(|position| (*position - solid.center).as_vec3().to_array());
    let mut columns = vec![Column { name: "POSITION", width: 3, numbers: local.collect() }];
    if solid.has_normals {
        columns.push(Column { name: "NORMAL", width: 3, numbers: solid.normals.as_flattened().to_vec() });
    }
    match paint {
        Paint::Vertices => {
            // Linear, by the specification.
            let linear = |byte: u8| srgb_decode(f64::from(byte) / 255.0) as f32;
            let numbers = solid.colors.iter().flat_map(|[r, g, b]| [linear(*r), linear(*g), linear(*b), 1.0]);
            columns.push(Column { name: "COLOR_0", width: 4, numbers: numbers.collect() });
        }
        Paint::Picture(_) => {
            let numbers = solid.uvs.as_flattened().to_vec();
            columns.push(Column { name: "TEXCOORD_0", width: 2, numbers });
        }
        Paint::None => {}
    }
    columns
}

/// A file whose parts are added one by one.
#[derive(Default)]
struct File {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()}));
        self.binary.extend(bytes);
        self.views.len() - 1
    }

    /// A view of `count` elements that are compressed.
    fn packed(&mut self, extension: &str, bytes: &[u8], count: usize, stride: usize, more: Value) -> usize {
        let view = self.view(bytes);
        let mut compressed = self.views[view].clone();
        compressed["byteStride"] = json!(stride);
        compressed["count"] = json!(count);
        if let (Value::Object(compressed), Value::Object(more)) = (&mut compressed, more) {
            compressed.extend(more);
        }
        // The second buffer has no data: see `fallback`.
        self.views[view] =
            json!({"buffer": 1, "byteLength": count * stride, "extensions": {extension: compressed}});
        view
    }

    fn accessor(&mut self, mut accessor: Value, view: Option<usize>) -> Value {
        if let Some(view) = view {
            accessor["bufferView"] = json!(view);
        }
        self.accessors.push(accessor);
        json!(self.accessors.len() - 1)
    }

    /// Adds an attribute of all vertices; returns its accessor.
    fn attribute(&mut self, column: &Column, encoding: Encoding) -> Value {
        let kind = match (encoding, column.name) {
            (Encoding::Quantized, "POSITION") => LENGTHS,
            (Encoding::Quantized, "NORMAL") => BYTES,
            (Encoding::MeshoptFiltered, "NORMAL") => SHORTS,
            (Encoding::Quantized, _) | (Encoding::MeshoptFiltered, "COLOR_0" | "TEXCOORD_0") => WORDS,
            _ => Kind::Float,
        };
        let count = column.numbers.len() / column.width;
        let (component, normalized, bytes, stride) = kind.encoded(column);
        let mut accessor = json!({
            "componentType": component, "count": count, "type": (format!("VEC{}", column.width)),
            "normalized": normalized,
        });
        if column.name == "POSITION" {
            let [least, most] = [f32::min, f32::max].map(|pick| {
                [0, 1, 2].map(|axis| column.numbers[axis..].iter().step_by(3).copied().reduce(pick).unwrap())
            });
            if component == FLOAT {
                (accessor["min"], accessor["max"]) = (json!(least), json!(most));
            }
        }
        let view = match (encoding, column.name) {
            (Encoding::Draco | Encoding::DracoQuantized, _) => None,
            (Encoding::Sparse, "POSITION") => {
                let half = count / 2;
                let (first, rest) = bytes.split_at(half * stride);
                let base = self.view(&[&vec![0; first.len()], rest].concat());
                let indices: Vec<u8> = (0..half as u16).flat_map(u16::to_le_bytes).collect();
                let (indices, values) = (self.view(&indices), self.view(first));
                accessor["sparse"] = json!({
                    "count": half, "indices": {"bufferView": indices, "componentType": 5123},
                    "values": {"bufferView": values},
                });
                Some(base)
            }
            (Encoding::Meshopt, _) => {
                let data = packed::meshopt_attributes(&bytes, stride);
                Some(self.packed(
                    "EXT_meshopt_compression",
                    &data,
                    count,
                    stride,
                    json!({"mode": "ATTRIBUTES"}),
                ))
            }
            (Encoding::MeshoptFiltered, name) => {
                let filter = match name {
                    "POSITION" => Filter::Exponential,
                    "NORMAL" => Filter::Octahedral,
                    "COLOR_0" => Filter::Color,
                    _ => Filter::None,
                };
                let data = packed::meshopt_attributes_2(&filter.apply(&bytes), stride);
                let more = json!({"mode": "ATTRIBUTES", "filter": format!("{filter:?}").to_uppercase()});
                Some(self.packed("KHR_meshopt_compression", &data, count, stride, more))
            }
            _ => Some(self.view(&bytes)),
        };
        if let Some(view) = view {
            self.views[view]["byteStride"] = json!(stride);
        }
        self.accessor(accessor, view)
    }

    /// Adds the numbers of triangles' vertices; returns their accessor.
    fn triangles(&mut self, triangles: &[[u32; 3]], encoding: Encoding) -> Value {
        let count = 3 * triangles.len();
        let view = match encoding {
            Encoding::Draco | Encoding::DracoQuantized => None,
            Encoding::Meshopt | Encoding::MeshoptFiltered => {
                let extension = if encoding == Encoding::Meshopt { "EXT" } else { "KHR" };
                let extension = format!("{extension}_meshopt_compression");
                let (data, mode) = if encoding == Encoding::Meshopt {
                    (packed::meshopt_triangles(triangles), "TRIANGLES")
                } else {
                    (packed::meshopt_sequence(triangles.as_flattened()), "INDICES")
                };
                Some(self.packed(&extension, &data, count, 2, json!({"mode": mode})))
            }
            _ => {
                let indices = triangles.as_flattened().iter().flat_map(|index| (*index as u16).to_le_bytes());
                Some(self.view(&indices.collect::<Vec<u8>>()))
            }
        };
        self.accessor(json!({"componentType": 5123, "count": count, "type": "SCALAR"}), view)
    }
}

/// A glTF file. Its node places the solid, so that positions may have single precision.
pub fn gltf(solid: &Solid, encoding: Encoding, paint: Paint) -> Vec<u8> {
    let mut file = File::default();
    let columns = columns(solid, paint);
    let mut attributes = Map::new();
    for column in &columns {
        attributes.insert(column.name.to_owned(), file.attribute(column, encoding));
    }
    let indices = file.triangles(&solid.triangles, encoding);
    let mut primitive = json!({"attributes": attributes, "indices": indices, "material": 0});
    if matches!(encoding, Encoding::Draco | Encoding::DracoQuantized) {
        let data = packed::draco(&columns, &solid.triangles, encoding == Encoding::DracoQuantized);
        let numbers: Map<String, Value> =
            columns.iter().enumerate().map(|(id, column)| (column.name.to_owned(), json!(id))).collect();
        let draco = json!({"bufferView": file.view(&data), "attributes": numbers});
        primitive["extensions"] = json!({"KHR_draco_mesh_compression": draco});
    }
    // Only the diffuse lobe.
    let mut material = json!({
        "pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
    });
    let mut node = json!({"mesh": 0, "translation": solid.center.to_array()});
    if encoding == Encoding::Quantized {
        node["scale"] = json!([1.0 / 25_000.0, 1.0 / 25_000.0, 1.0 / 25_000.0]);
    }
    let mut whole = json!({"meshes": [{"primitives": [primitive]}], "nodes": [node]});
    if let Paint::Picture(name) = paint {
        material["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        let source = json!({"source": 0});
        let is_webp = name.ends_with("webp");
        whole["textures"] =
            json!([if is_webp { json!({"extensions": {"EXT_texture_webp": source}}) } else { source }]);
        whole["images"] = json!([{"uri": name}]);
    }
    whole["materials"] = json!([material]);
    file.finish(whole, encoding)
}

impl File {
    /// Adds what every file has to the rest of a file.
    fn finish(self, mut file: Value, encoding: Encoding) -> Vec<u8> {
        let File { binary, views, accessors } = self;
        let mut buffers = vec![json!({"byteLength": binary.len()})];
        if encoding != Encoding::Glb {
            let data = BASE64_STANDARD.encode(&binary);
            buffers[0]["uri"] = json!(format!("data:application/octet-stream;base64,{data}"));
        }
        let mut used = vec!["KHR_materials_specular", "KHR_mesh_quantization", "EXT_texture_webp"];
        let needed = match encoding {
            Encoding::Meshopt => Some("EXT_meshopt_compression"),
            Encoding::MeshoptFiltered => Some("KHR_meshopt_compression"),
            Encoding::Draco | Encoding::DracoQuantized => Some("KHR_draco_mesh_compression"),
            _ => None,
        };
        used.extend(needed);
        if let Some(extension @ ("EXT_meshopt_compression" | "KHR_meshopt_compression")) = needed {
            let length: u64 = views.iter().filter_map(|view| view["byteLength"].as_u64()).sum();
            buffers.push(json!({"byteLength": length, "extensions": {extension: {"fallback": true}}}));
        }
        file["asset"] = json!({"version": "2.0"});
        file["scene"] = json!(0);
        file["scenes"] = json!([{"nodes": [0]}]);
        file["extensionsUsed"] = json!(used);
        file["extensionsRequired"] = json!(needed.into_iter().collect::<Vec<_>>());
        file["buffers"] = json!(buffers);
        file["bufferViews"] = json!(views);
        file["accessors"] = json!(accessors);
        if encoding == Encoding::Glb { glb(&file, binary) } else { file.to_string().into_bytes() }
    }
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

/// What moves a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mover {
    Node,
    /// A node whose turns are compressed quaternions.
    PackedNode,
    /// A skin of two bones, of which the second has no movement of its own.
    Skin,
}

/// A file in which the solid moves. `moves` are the seconds, the places and the turns about +Y in degrees.
pub fn moving(solid: &Solid, mover: Mover, moves: &[(f32, [f32; 3], f32)]) -> Vec<u8> {
    let (has_skin, is_packed) = (mover == Mover::Skin, mover == Mover::PackedNode);
    let mut file = File::default();
    let mut attributes = Map::new();
    for column in columns(solid, Paint::None) {
        attributes.insert(column.name.to_owned(), file.attribute(&column, Encoding::Embedded));
    }
    let indices = file.triangles(&solid.triangles, Encoding::Embedded);
    let floats = |file: &mut File, width: usize, numbers: &[f32]| {
        let view = file.view(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
        let kind = match width {
            1 => "SCALAR".to_owned(),
            16 => "MAT4".to_owned(),
            width => format!("VEC{width}"),
        };
        let accessor = json!({"componentType": FLOAT, "count": numbers.len() / width, "type": kind});
        file.accessor(accessor, Some(view))
    };
    let mut turned = Vec::new();
    for (_, _, degrees) in moves {
        let half = degrees.to_radians() * 0.5;
        turned.extend([0.0, half.sin(), 0.0, half.cos()]);
    }
    let seconds = floats(&mut file, 1, &moves.iter().map(|(time, ..)| *time).collect::<Vec<_>>());
    let places =
        floats(&mut file, 3, moves.iter().map(|(_, place, _)| *place).collect::<Vec<_>>().as_flattened());
    let turns = if is_packed {
        let filter = Filter::Quaternion;
        let bytes: Vec<u8> = turned.iter().flat_map(|number: &f32| number.to_le_bytes()).collect();
        let data = packed::meshopt_attributes_2(&filter.apply(&bytes), 8);
        let more = json!({"mode": "ATTRIBUTES", "filter": "QUATERNION"});
        let view = file.packed("KHR_meshopt_compression", &data, moves.len(), 8, more);
        let accessor =
            json!({"componentType": 5122, "normalized": true, "count": moves.len(), "type": "VEC4"});
        file.accessor(accessor, Some(view))
    } else {
        floats(&mut file, 4, &turned)
    };
    // The node of the first bone, or of the solid, below the one that places it.
    let target = |path: &str| json!({"node": 1, "path": path});
    let animation = json!({
        "samplers": [{"input": seconds, "output": places}, {"input": seconds, "output": turns}],
        "channels": [
            {"sampler": 0, "target": target("translation")}, {"sampler": 1, "target": target("rotation")},
        ],
    });
    let mut whole = json!({"animations": [animation]});
    if has_skin {
        let count = solid.positions.len();
        let joints = file.view(&[0, 1, 0, 0].repeat(count));
        let joints =
            file.accessor(json!({"componentType": 5121, "count": count, "type": "VEC4"}), Some(joints));
        let weights = floats(&mut file, 4, &[0.25, 0.75, 0.0, 0.0].repeat(count));
        attributes.insert("JOINTS_0".to_owned(), joints);
        attributes.insert("WEIGHTS_0".to_owned(), weights);
        // The second bone rests half a metre above the first.
        let mut binds = [[0.0; 16]; 2];
        for bind in &mut binds {
            [0, 5, 10, 15].into_iter().for_each(|at| bind[at] = 1.0);
        }
        binds[1][13] = -0.5;
        let binds = floats(&mut file, 16, binds.as_flattened());
        whole["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": binds}]);
        // A skinned mesh stands where its bones are, whatever its own node says.
        whole["nodes"] = json!([
            {"translation": solid.center.to_array(), "children": [1, 3]},
            {"children": [2]}, {"translation": [0, 0.5, 0]}, {"mesh": 0, "skin": 0, "translation": [7, 8, 9]},
        ]);
    } else {
        whole["nodes"] = json!([{"translation": solid.center.to_array(), "children": [1]}, {"mesh": 0}]);
    }
    whole["meshes"] =
        json!([{"primitives": [{"attributes": attributes, "indices": indices, "material": 0}]}]);
    whole["materials"] = json!([{
        "pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
    }]);
    file.finish(whole, if is_packed { Encoding::MeshoptFiltered } else { Encoding::Embedded })
}
