//! PLY, the Stanford polygon format (Turk 1994): one mesh per file, as text or in either byte order.
//!
//! Written by hand because the one maintained crate for it (ply-rs-bw) stores each element by property names, which
//! takes minutes and many times the memory for ten million triangles, and because it supports neither strips nor
//! texture coordinates per face.
//!
//! Supported elements: `vertex` with x, y, z, normals, texture coordinates and colours; `face` with `vertex_indices`,
//! colours and MeshLab's `texcoord`; `tristrips`. All others are skipped. Integer colours are assumed to be sRGB,
//! floating-point ones linear. PLY's v points up, that of meshes here down, so v becomes 1 − v. Messages count vertices
//! and faces from 0, like the file's own indices.

mod faces;
mod header;
mod source;
mod vertices;
mod write;

use std::path::Path;

use crate::error::LoadError;
use crate::memory;
use crate::world::Mesh;

use header::{Element, PlyEncoding, PlyHeader};
use source::{Ascii, Binary, NumberSource};

pub use write::{save, write};

/// Reads a mesh from a PLY file.
pub fn load(path: &Path) -> Result<Mesh, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    parse(&bytes, path)
}

/// Reads a mesh from the contents of a PLY file; messages call it `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, LoadError> {
    let (header, body) = PlyHeader::parse(bytes).map_err(|fault| LoadError::At {
        file: path.to_owned(),
        line: fault.line,
        column: 1,
        reason: fault.reason,
    })?;
    let count = |name: &str| {
        let elements = header.elements.iter().filter(|element| element.name == name);
        elements.fold(0u64, |sum, element| sum.saturating_add(element.count))
    };
    let (vertices, faces) = (count("vertex"), count("face"));
    let what = format_args!("the mesh of {vertices} vertices and {faces} faces");
    // Positions, normals and texture coordinates; two triangles per face. Vertices that faces split are not known yet.
    // The file's size is a limit because a header can promise more than the file contains.
    let bytes =
        vertices.saturating_mul(32).saturating_add(faces.saturating_mul(24)).min(12 * body.len() as u64);
    let _claim = memory::reserve(what, bytes).map_err(LoadError::shortage(path))?;
    let mesh = match header.encoding {
        PlyEncoding::Ascii => read_body(Ascii::new(body), &header),
        PlyEncoding::LittleEndian => read_body(Binary::<false>::new(body), &header),
        PlyEncoding::BigEndian => read_body(Binary::<true>::new(body), &header),
    };
    let mut mesh = mesh.map_err(|reason| LoadError::invalid(path, reason))?;
    mesh.name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    mesh.source = Some(path.to_owned());
    Ok(mesh)
}

/// Reads all supported elements. Faces may precede the vertices, but cannot be read before them, so their position is
/// stored.
fn read_body<S: NumberSource>(mut source: S, header: &PlyHeader) -> Result<Mesh, String> {
    let mut mesh = Mesh::default();
    let mut has_vertices = false;
    let mut polygons: Vec<(S, &Element)> = Vec::new();
    let last = header.elements.iter().rposition(|element| Element::is_wanted(&element.name));
    for (i, element) in header.elements.iter().enumerate() {
        source.check_room(element)?;
        match element.name.as_str() {
            "vertex" => {
                vertices::read(&mut source, element, &mut mesh)?;
                has_vertices = true;
                continue;
            }
            "face" | "tristrips" if element.count > 0 => polygons.push((source.clone(), element)),
            _ => {}
        }
        if last.is_none_or(|last| i >= last) {
            break;
        }
        source.skip_element(element)?;
    }
    if !has_vertices {
        return Err("has no vertices: there is no element \"vertex\" in its header".into());
    }
    for (mut source, element) in polygons {
        faces::read(&mut source, element, &mut mesh)?;
    }
    if mesh.triangles.is_empty() {
        return Err("has no faces (is it a point cloud?): make a surface of it first".into());
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests;
