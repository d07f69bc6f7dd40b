//! The two forms of a file: JSON text, or GLB, which holds JSON and binary data in chunks.

use std::path::Path;

use gltf::json::Root;
use serde::Deserialize;
use serde_json::Value;

use crate::error::LoadError;
use crate::formats::extension;

/// The JSON, and the binary chunk if there is one.
pub(super) struct Container<'b> {
    json: &'b [u8],
    pub binary: Option<&'b [u8]>,
    is_glb: bool,
}

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");
const HEADER_LENGTH: usize = 12;

impl<'b> Container<'b> {
    /// Splits a file into its parts; its first four bytes tell JSON from GLB.
    pub(super) fn open(bytes: &'b [u8], path: &Path) -> Result<Self, LoadError> {
        if !bytes.starts_with(MAGIC) {
            let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            if extension(path) == "glb" && json.trim_ascii_start().first() != Some(&b'{') {
                let reason =
                    "this is no GLB file: it does not begin with \"glTF\" (was it downloaded whole?)";
                return Err(LoadError::invalid(path, reason));
            }
            return Ok(Self { json, binary: None, is_glb: false });
        }
        Self::open_glb(bytes).map_err(|reason| LoadError::invalid(path, reason))
    }

    fn open_glb(bytes: &'b [u8]) -> Result<Self, String> {
        let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
            return Err("the file ends within the header of 12 bytes".to_owned());
        };
        if version != 2 {
            return Err(format!("GLB of version {version}: only 2 can be read"));
        }
        let contents = bytes.get(..length as usize).filter(|contents| contents.len() >= HEADER_LENGTH);
        let Some(contents) = contents else {
            let actual = bytes.len();
            return Err(format!("the header speaks of {length} bytes, the file has {actual}"));
        };
        let (json, kind, mut next) = chunk(contents, HEADER_LENGTH)?;
        if kind != JSON {
            return Err("the first chunk must be JSON".to_owned());
        }
        // Only the second chunk may be the binary one; all others belong to extensions.
        let mut binary = None;
        if next < contents.len() {
            let (data, kind, end) = chunk(contents, next)?;
            binary = (kind == BINARY).then_some(data);
            next = end;
        }
        while next < contents.len() {
            next = chunk(contents, next)?.2;
        }
        Ok(Self { json, binary, is_glb: true })
    }

    /// Parses the JSON of a file of version 2.
    pub(super) fn parse(&self, path: &Path) -> Result<Root, LoadError> {
        let refuse = |error: serde_json::Error| self.json_error(&error, path);
        let head: Head = serde_json::from_slice(self.json).map_err(refuse)?;
        let invalid = |reason: String| LoadError::invalid(path, reason);
        let Some(Asset { version, min_version }) = head.asset else {
            return Err(invalid("this is not glTF: it has no \"asset\"".to_owned()));
        };
        // A later 2.x file may be read as 2.0, unless it requires a newer version.
        let least = min_version.as_ref().map(in_words);
        let too_new = least.filter(|least| least != "2.0");
        let version =
            too_new.or_else(|| Some(in_words(&version)).filter(|version| !version.starts_with("2.")));
        if let Some(version) = version {
            let reason = format!("/asset: glTF of version {version}: only 2.0 can be read, convert it first");
            return Err(invalid(reason));
        }
        serde_json::from_slice(self.json).or_else(|error| self.as_expected().ok_or_else(|| refuse(error)))
    }

    /// Parses the JSON after removing what the specification allows and the crate does not expect. None if it is
    /// invalid for another reason.
    fn as_expected(&self) -> Option<Root> {
        let mut json: Value = serde_json::from_slice(self.json).ok()?;
        whole_numbers(&mut json);
        let list = |json: &'_ mut Value, name: &str| match json.get_mut(name).map(Value::take) {
            Some(Value::Array(items)) => items,
            _ => Vec::new(),
        };
        let mut scenes = list(&mut json, "scenes");
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            // An empty scene may omit its nodes.
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
        let mut animations = list(&mut json, "animations");
        for animation in &mut animations {
            if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
                // A channel without a node belongs to an extension (KHR_animation_pointer) or moves nothing.
                let has_node = |target: &Value| target.get("node").is_some();
                channels.retain(|channel| channel.get("target").is_none_or(has_node));
            }
        }
        for (name, items) in [("scenes", scenes), ("animations", animations)] {
            if let Some(place) = json.get_mut(name) {
                *place = Value::Array(items);
            }
        }
        Root::deserialize(json).ok()
    }

    /// The translations and matrices of all nodes, in double precision: the crate rounds them. Empty if they are not as
    /// expected, which [`Container::parse`] says.
    pub(super) fn placements(&self) -> Vec<Placement> {
        let nodes: Result<Placements, _> = serde_json::from_slice(self.json);
        nodes.map_or_else(|_| Vec::new(), |read| read.nodes)
    }

    fn json_error(&self, error: &serde_json::Error, path: &Path) -> LoadError {
        let (line, column) = (error.line(), error.column());
        let reason = error.to_string();
        let reason = reason.rsplit_once(" at line ").map_or(&reason[..], |(reason, _)| reason);
        let reason = reason.escape_debug().to_string().replace("\\\"", "\"");
        if self.is_glb {
            LoadError::invalid(path, format!("JSON chunk, line {line}, column {column}: {reason}"))
        } else {
            LoadError::At { file: path.to_owned(), line, column, reason }
        }
    }
}

/// Rewrites 1.0 as 1: JSON does not distinguish integers from floats.
fn whole_numbers(json: &mut Value) {
    match json {
        Value::Number(number) => {
            // Beyond this, not every integer is representable as a float.
            let whole = number.as_f64().filter(|value| value.fract() == 0.0 && value.abs() < 9e15);
            if let Some(value) = whole.filter(|_| number.is_f64()) {
                *json = Value::from(value as i64);
            }
        }
        Value::Array(items) => items.iter_mut().for_each(whole_numbers),
        Value::Object(fields) => fields.values_mut().for_each(whole_numbers),
        _ => {}
    }
}

/// The part of the JSON that is needed to detect files that cannot be read.
#[derive(Deserialize)]
struct Head {
    asset: Option<Asset>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: Value,
    min_version: Option<Value>,
}

#[derive(Deserialize)]
struct Placements {
    #[serde(default)]
    nodes: Vec<Placement>,
}

/// The place of a node in its parent.
#[derive(Deserialize)]
pub(super) struct Placement {
    pub translation: Option<[f64; 3]>,
    /// Column by column.
    pub matrix: Option<[f64; 16]>,
}

/// A version as text; files before 2.0 may give it as a number.
fn in_words(version: &Value) -> String {
    match version.as_str() {
        Some(text) => text.chars().take(16).flat_map(char::escape_debug).collect(),
        None => version.as_f64().map_or_else(|| "unknown".to_owned(), |number| number.to_string()),
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|word| u32::from_le_bytes(*word))
}

/// The data and type of the chunk at a byte offset, and the offset of its end.
fn chunk(bytes: &[u8], at: usize) -> Result<(&[u8], u32, usize), String> {
    let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) else {
        return Err(format!("the chunk at byte {at} ends within its header"));
    };
    let data = bytes.get(at + 8..).and_then(|rest| rest.get(..length as usize));
    let data =
        data.ok_or_else(|| format!("the chunk at byte {at} claims {length} bytes, more than there are"))?;
    Ok((data, kind, at + 8 + data.len()))
}
