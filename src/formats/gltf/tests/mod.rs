//! Tests with tiny files that are generated here.

mod errors;
mod geometry;
mod materials;
mod mending;
mod moving;
mod robust;
mod scene;

use std::path::Path;

use base64::prelude::*;
use serde_json::{Value, json};

use super::GltfModel;
use crate::error::LoadError;
use crate::formats::{LightUnits, LoadOptions};
use crate::world::{Assets, Material, Mesh, Principled};

/// The result of reading a file.
#[derive(Debug)]
struct Read {
    model: GltfModel,
    assets: Assets,
    warnings: Vec<String>,
}

impl Read {
    fn mesh(&self) -> &Mesh {
        &self.assets.meshes[0]
    }

    /// The material of the first triangle.
    fn material(&self) -> &Principled {
        let id = self.mesh().triangle_materials[0];
        let Material::Principled(material) = &self.assets.materials[id.0 as usize].material else { panic!() };
        material
    }
}

fn read_with(bytes: &[u8], options: &LoadOptions) -> Result<Read, LoadError> {
    let (mut assets, mut warnings) = (Assets::default(), Vec::new());
    let model = super::parse(bytes, Path::new("dir/test.gltf"), options, &mut assets, &mut warnings)?;
    let warnings = warnings.iter().map(ToString::to_string).collect();
    Ok(Read { model, assets, warnings })
}

fn read_bytes(bytes: &[u8]) -> Result<Read, LoadError> {
    read_with(bytes, &LoadOptions::default())
}

fn read(file: &Value) -> Read {
    read_bytes(file.to_string().as_bytes()).unwrap()
}

/// Returns the error message, which must name the file and be one line.
fn refused(file: &Value) -> String {
    let message = read_bytes(file.to_string().as_bytes()).unwrap_err().to_string();
    assert!(message.starts_with("dir/test.gltf: ") && !message.contains('\n'), "{message}");
    message["dir/test.gltf: ".len()..].to_owned()
}

/// A triangle in the XY plane with 16-bit indices.
fn triangle() -> Value {
    let mut bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    bytes.extend([0, 0, 1, 0, 2, 0]);
    json!({
        "asset": {"version": "2.0"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "buffers": [{"byteLength": 42, "uri": data_uri(&bytes)}],
    })
}

/// [`triangle`] with changed values at some JSON pointers.
fn with(changes: &[(&str, Value)]) -> Value {
    let mut file = triangle();
    for (pointer, value) in changes {
        set(&mut file, pointer, value.clone());
    }
    file
}

/// Sets a value whose parent exists.
fn set(file: &mut Value, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    match file.pointer_mut(parent).unwrap() {
        Value::Array(items) if key == items.len().to_string() => items.push(value),
        Value::Array(items) => items[key.parse::<usize>().unwrap()] = value,
        Value::Object(members) => drop(members.insert(key.to_owned(), value)),
        other => panic!("{other}"),
    }
}

/// Adds a buffer, its view and an accessor of it; returns the accessor's number.
fn add_accessor(file: &mut Value, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
    let next = |file: &Value, key: &str| file[key].as_array().unwrap().len();
    let (buffer, view, accessor) =
        (next(file, "buffers"), next(file, "bufferViews"), next(file, "accessors"));
    let uri = data_uri(bytes);
    set(file, &format!("/buffers/{buffer}"), json!({"byteLength": bytes.len(), "uri": uri}));
    set(file, &format!("/bufferViews/{view}"), json!({"buffer": buffer, "byteLength": bytes.len()}));
    let value = json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
    set(file, &format!("/accessors/{accessor}"), value);
    accessor
}

/// [`triangle`] with an additional attribute.
fn with_attribute(name: &str, bytes: &[u8], component: u32, kind: &str) -> Value {
    let mut file = triangle();
    let accessor = add_accessor(&mut file, bytes, component, kind, 3);
    set(&mut file, &format!("/meshes/0/primitives/0/attributes/{name}"), json!(accessor));
    file
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes))
}

/// Encodes the file as GLB with its first buffer in the binary chunk.
fn glb(file: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = file.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = Vec::new();
    for (word, kind, data) in [
        (length, None, None),
        (json.len(), Some(b"JSON"), Some(json)),
        (binary.len(), Some(b"BIN\0"), Some(binary)),
    ] {
        match (kind, data) {
            (Some(kind), Some(data)) => {
                bytes.extend((word as u32).to_le_bytes());
                bytes.extend(kind);
                bytes.extend(data);
            }
            _ => {
                bytes.extend(b"glTF");
                bytes.extend(2u32.to_le_bytes());
                bytes.extend((word as u32).to_le_bytes());
            }
        }
    }
    bytes
}
