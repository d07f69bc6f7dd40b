//! The two forms of a file: JSON text, or GLB, which holds JSON and binary data in chunks.

use std::collections::HashSet;
use std::path::Path;

use gltf::json::Root;
use gltf::json::animation::{Channel, Sampler};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

use super::mending::{self, Mended, Unmendable};
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
            let json = without_mark(bytes);
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
        let json = without_mark(json);
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

    /// Parses the JSON of a file of version 2. Also returns the faults that were mended.
    pub(super) fn parse(&self, path: &Path) -> Result<(Root, Mended), LoadError> {
        let refuse = |error: serde_json::Error| self.json_error(&error, path);
        // Other programs write NaN and Infinity, which JSON does not have.
        let (head, numbered) = match serde_json::from_slice::<Head>(self.json) {
            Ok(head) => (head, None),
            Err(error) => {
                let numbered = without_nan(self.json).ok_or_else(|| refuse(error))?;
                (serde_json::from_slice(&numbered).map_err(refuse)?, Some(numbered))
            }
        };
        let invalid = |reason: String| LoadError::invalid(path, reason);
        let Some(Asset { version, min_version }) = head.asset else {
            return Err(invalid("this is not glTF: it has no \"asset\"".to_owned()));
        };
        // A later 2.x file may be read as 2.0, unless it requires a newer version.
        let least = min_version.as_ref().map(in_words);
        let too_new = least.filter(|least| least != "2.0");
        let version = too_new.or_else(|| {
            Some(in_words(&version)).filter(|version| version != "2" && !version.starts_with("2."))
        });
        if let Some(version) = version {
            let reason = format!("/asset: glTF of version {version}: only 2.0 can be read, convert it first");
            return Err(invalid(reason));
        }
        let error = match numbered {
            None => match serde_json::from_slice(self.json) {
                Ok(root) => return Ok((root, Mended::default())),
                Err(error) => Some(error),
            },
            Some(_) => None,
        };
        let json = numbered.as_deref().unwrap_or(self.json);
        let mut mended = Mended::default();
        match mended_root(json, &mut mended) {
            Ok(root) => Ok((root, mended)),
            Err(Unmendable { place, reason }) => Err(match error {
                // Only the JSON's own error has a line.
                Some(error) if place.is_empty() => refuse(error),
                _ => invalid(format!("{place}: {reason}")),
            }),
        }
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

/// Removes a byte order mark.
fn without_mark(json: &[u8]) -> &[u8] {
    json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json)
}

/// The text in the place of a number that is not finite.
const NOT_FINITE: &str = "\u{0}NaN";

/// Replaces `NaN`, `Infinity` and `-Infinity` outside of texts by [`NOT_FINITE`]; none if there are none.
fn without_nan(json: &[u8]) -> Option<Vec<u8>> {
    let mut written = Vec::with_capacity(json.len());
    let (mut at, mut is_text, mut count) = (0, false, 0);
    while let Some(byte) = json.get(at) {
        let rest = &json[at..];
        let number = [&b"NaN"[..], b"Infinity", b"-Infinity"].into_iter().find(|name| rest.starts_with(name));
        match number.filter(|_| !is_text) {
            Some(name) => {
                written.extend(b"\"\\u0000NaN\"");
                (at, count) = (at + name.len(), count + 1);
            }
            None => {
                // What follows a backslash does not end a text.
                let length = if is_text && *byte == b'\\' { 2.min(rest.len()) } else { 1 };
                is_text ^= *byte == b'"';
                written.extend(&rest[..length]);
                at += length;
            }
        }
    }
    (count > 0).then_some(written)
}

/// Parses the JSON after mending what an image can do without, and what the crate does not expect although the
/// specification allows it.
fn mended_root(json: &[u8], mended: &mut Mended) -> Result<Root, Unmendable> {
    let fault = |place: &str, reason: &str| Unmendable { place: place.to_owned(), reason: reason.to_owned() };
    let mut json: Value = serde_json::from_slice(json).map_err(|_| fault("", "it is no JSON"))?;
    whole_numbers(&mut json);
    remove_nan(&mut json, "", mended);
    let Some(root) = json.as_object_mut() else { return Err(fault("", "it is no object")) };
    root.retain(|_, value| !value.is_null());
    if let Some(asset) = root.get_mut("asset") {
        // Files may give their version as a number.
        if let Some(version) = asset.get_mut("version").filter(|version| version.is_number()) {
            *version = Value::from("2.0");
        }
        mending::read::<gltf::json::Asset>(asset, "/asset", &|name| name != "version", mended)?;
    }
    let any = |_: &str| true;
    let mut sections = Sections { root, mended };
    sections.mend::<gltf::json::Accessor>(
        "accessors",
        &|name| ["name", "min", "max"].contains(&name),
        None,
    )?;
    sections.mend::<gltf::json::Buffer>("buffers", &|name| name == "name", None)?;
    sections.mend::<gltf::json::buffer::View>(
        "bufferViews",
        &|name| ["name", "target"].contains(&name),
        None,
    )?;
    sections.each("cameras", &mut complete_camera)?;
    sections.mend::<gltf::json::Camera>("cameras", &any, Some(json!({"type": "none"})))?;
    sections.mend::<gltf::json::Image>("images", &any, Some(json!({})))?;
    sections.mend::<gltf::json::Material>("materials", &any, Some(json!({})))?;
    sections.mend::<gltf::json::texture::Sampler>("samplers", &any, Some(json!({})))?;
    sections.mend::<gltf::json::Texture>("textures", &any, Some(json!({})))?;
    sections.mend::<gltf::json::Skin>(
        "skins",
        &|name| !["joints", "inverseBindMatrices"].contains(&name),
        Some(json!({"joints": []})),
    )?;
    let of_node = ["name", "camera", "skin", "weights"];
    sections.mend::<gltf::json::Node>("nodes", &|name| of_node.contains(&name), None)?;
    // An empty scene may omit its nodes.
    sections.each("scenes", &mut |scene, _, _| {
        let scene = scene.as_object_mut();
        scene.map(|scene| scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new())));
        Ok(())
    })?;
    sections.mend::<gltf::json::Scene>("scenes", &|name| name == "name", None)?;
    sections.each("meshes", &mut mend_mesh)?;
    sections.each("animations", &mut mend_animation)?;
    if let Some(scene) = root.get("scene").filter(|scene| !scene.is_u64()) {
        mended.add("/scene", format_args!("{} is no number of a scene: the first one counts", brief(scene)));
        root.remove("scene");
    }
    for name in ["extensionsUsed", "extensionsRequired", "extensions"] {
        let is_fit = |value: &Value| match name {
            "extensions" => value.is_object(),
            _ => value.as_array().is_some_and(|names| names.iter().all(Value::is_string)),
        };
        if root.get(name).is_some_and(|value| !is_fit(value)) {
            mended.add(format_args!("/{name}"), "this is not as expected: left out");
            root.remove(name);
        }
    }
    mending::read(&mut json, "", &|_| false, mended)
}

/// The lists of items in a file.
struct Sections<'s> {
    root: &'s mut Map<String, Value>,
    mended: &'s mut Mended,
}

impl Sections<'_> {
    /// Calls `mend` for each item of a list, with its place.
    fn each(
        &mut self,
        name: &str,
        mend: &mut dyn FnMut(&mut Value, &str, &mut Mended) -> Result<(), Unmendable>,
    ) -> Result<(), Unmendable> {
        let Some(Value::Array(items)) = self.root.get_mut(name) else { return Ok(()) };
        let mut numbered = items.iter_mut().enumerate();
        numbered.try_for_each(|(number, item)| mend(item, &format!("/{name}/{number}"), self.mended))
    }

    /// Mends the items of a list of `T`s. What cannot be mended is replaced; without a replacement it is an error.
    fn mend<T: DeserializeOwned>(
        &mut self,
        name: &str,
        is_optional: &dyn Fn(&str) -> bool,
        replacement: Option<Value>,
    ) -> Result<(), Unmendable> {
        self.each(name, &mut |item, at, mended| {
            let Err(fault) = mending::read::<T>(item, at, is_optional, mended) else { return Ok(()) };
            let Some(replacement) = &replacement else { return Err(fault) };
            mended.add(&fault.place, format_args!("{}: left out", fault.reason));
            *item = replacement.clone();
            Ok(())
        })
    }
}

/// Adds what the crate needs of a camera. The clip distances are not used; a lens that is 0 and a type that is none are
/// mended where the camera is used.
fn complete_camera(camera: &mut Value, _: &str, _: &mut Mended) -> Result<(), Unmendable> {
    if let Some(camera) =
        camera.as_object_mut().filter(|camera| !camera.get("type").is_some_and(Value::is_string))
    {
        camera.insert("type".to_owned(), Value::from("none"));
    }
    for (lens, names) in
        [("perspective", &["yfov", "znear"][..]), ("orthographic", &["xmag", "ymag", "zfar", "znear"])]
    {
        if let Some(lens) = camera.get_mut(lens).and_then(Value::as_object_mut) {
            for name in names {
                lens.entry(*name).or_insert_with(|| Value::from(0));
            }
        }
    }
    Ok(())
}

/// Mends the primitives of a mesh, of which only positions and indices are needed.
fn mend_mesh(mesh: &mut Value, at: &str, mended: &mut Mended) -> Result<(), Unmendable> {
    let needed = ["primitives", "attributes", "POSITION", "indices", "mode", "targets", "extensions"];
    let is_optional =
        |name: &str| !needed.contains(&name) && !name.starts_with("JOINTS") && !name.starts_with("WEIGHTS");
    if let Some(primitives) = mesh.get_mut("primitives").and_then(Value::as_array_mut) {
        for (number, primitive) in primitives.iter_mut().enumerate() {
            let at = format!("{at}/primitives/{number}");
            mending::read::<gltf::json::mesh::Primitive>(primitive, &at, &is_optional, mended)?;
        }
    }
    mending::read::<gltf::json::Mesh>(mesh, at, &is_optional, mended).map(drop)
}

/// Leaves out the channels of an animation that are not as expected, or whose sampler is not.
fn mend_animation(animation: &mut Value, at: &str, mended: &mut Mended) -> Result<(), Unmendable> {
    if !animation.is_object() {
        mended.add(at, "this is no object: left out");
        *animation = json!({});
    }
    let mut unusable = HashSet::new();
    for name in ["samplers", "channels"] {
        let mut items = match animation.get_mut(name).map(Value::take) {
            Some(Value::Array(items)) => items,
            _ => Vec::new(),
        };
        let mut number = 0;
        items.retain_mut(|item| {
            let at = format!("{at}/{name}/{number}");
            number += 1;
            let read = if name == "samplers" {
                let read = mending::read::<Sampler>(item, &at, &|name| name == "interpolation", mended);
                if read.is_err() {
                    unusable.insert(number - 1);
                    // Channels refer to samplers by their numbers.
                    *item = json!({"input": 0, "output": 0});
                }
                read.map(drop)
            } else {
                // A channel without a node belongs to an extension (KHR_animation_pointer) or moves nothing.
                if item.get("target").is_some_and(|target| target.get("node").is_none()) {
                    return false;
                }
                let sampler = item.get("sampler").and_then(Value::as_u64);
                if sampler.is_some_and(|sampler| unusable.contains(&sampler)) {
                    return false;
                }
                mending::read::<Channel>(item, &at, &|_| false, mended).map(drop)
            };
            if let Err(Unmendable { place, reason }) = &read {
                let what = if name == "samplers" { "its channels are" } else { "the channel is" };
                mended.add(place, format_args!("{reason}: {what} left out"));
            }
            read.is_ok() || name == "samplers"
        });
        animation[name] = Value::Array(items);
    }
    mending::read::<gltf::json::Animation>(animation, at, &|name| name == "name", mended).map(drop)
}

/// Removes members that are [`NOT_FINITE`], so that their defaults count, and makes those in lists null.
fn remove_nan(json: &mut Value, at: &str, mended: &mut Mended) {
    let is_nan = |value: &Value| value.as_str() == Some(NOT_FINITE);
    match json {
        Value::Array(items) => {
            for (number, item) in items.iter_mut().enumerate() {
                if is_nan(item) {
                    *item = Value::Null;
                }
                remove_nan(item, &format!("{at}/{number}"), mended);
            }
        }
        Value::Object(members) => {
            members.retain(|name, value| {
                let is_nan = is_nan(value);
                if is_nan && !at.contains("/extras") && name != "extras" {
                    mended.add(
                        format_args!("{at}/{name}"),
                        "this is not finite: left out, as if it were not written",
                    );
                }
                !is_nan
            });
            for (name, value) in members.iter_mut() {
                remove_nan(value, &format!("{at}/{name}"), mended);
            }
        }
        _ => {}
    }
}

/// The beginning of a value's text, for messages.
fn brief(value: &Value) -> String {
    value.to_string().chars().take(40).flat_map(char::escape_debug).collect()
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
