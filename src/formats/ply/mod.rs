//! PLY, the Stanford polygon format (Turk 1994): one mesh per file, as text or in either byte order.
//!
//! Written by hand because the one maintained crate for it (ply-rs-bw) stores each element by property names, which
//! takes minutes and many times the memory for ten million triangles, and because it supports neither strips nor
//! texture coordinates per face.
//!
//! Supported elements: `vertex` with x, y, z, normals, texture coordinates and colours; `face` with `vertex_indices`,
//! colours and MeshLab's `texcoord` and `texnumber`; `tristrips`. All others are skipped. The comment `TextureFile`
//! names an image on the surface. Colours are encoded by the sRGB curve, whatever their type. PLY's v points up, that of
//! meshes here down, so v becomes 1 − v. Messages count vertices and faces from 0, like the file's own indices.

mod faces;
mod header;
mod source;
mod vertices;
mod write;

use std::path::Path;
use std::sync::Arc;

use crate::error::{Diagnostic, LoadError};
use crate::formats::mended::MendedValues;
use crate::formats::vertex_colors::{self, ColorRange};
use crate::math::Vec3;
use crate::memory;
use crate::world::Mesh;
use crate::world::asset_cache::MeshFile;
use crate::world::normals::smooth_normals;

use header::{Element, PlyEncoding, PlyHeader};
use source::{Ascii, Binary, NumberSource};

pub use write::{save, write};

/// Reads a mesh from a PLY file.
pub fn load(path: &Path) -> Result<MeshFile, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    parse(&bytes, path)
}

/// Reads a mesh from the contents of a PLY file; messages call it `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
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
    let read = match header.encoding {
        PlyEncoding::Ascii => read_body(Ascii::new(body), &header),
        PlyEncoding::LittleEndian => read_body(Binary::<false>::new(body), &header),
        PlyEncoding::BigEndian => read_body(Binary::<true>::new(body), &header),
    };
    let mut ply = read.map_err(|reason| LoadError::invalid(path, reason))?;
    let mut lines = ply.mend();
    if ply.colors_are_encoded {
        let range = ColorRange::of(vertex_colors::largest(&ply.mesh.colors));
        range.decode(&mut ply.mesh.colors);
        lines.extend(range.told());
    }
    let warnings = lines.iter().map(|line| Diagnostic::in_file("import", path, line)).collect();
    let PlyMesh { mut mesh, textures, .. } = ply;
    mesh.name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    mesh.source = Some(path.to_owned());
    Ok(MeshFile { mesh: Arc::new(mesh), images: header.textures, image_of: textures, warnings })
}

/// A mesh while it is read.
#[derive(Default)]
struct PlyMesh {
    mesh: Mesh,
    /// True if the colours are still as the file has them.
    colors_are_encoded: bool,
    /// The vertices that the last vertices of the mesh are copies of.
    copies: Vec<u32>,
    /// The number of the texture on each triangle, or empty.
    textures: Vec<u32>,
    faults: PlyFaults,
}

/// The values of a file that are not as they should be.
#[derive(Default)]
struct PlyFaults {
    /// Vertices without a finite position, which faces may not use.
    positions: Vec<(u32, Vec3)>,
    /// Vertices without a finite normal.
    normals: Vec<u32>,
    uvs: MendedValues,
    colors: MendedValues,
    /// Vertices with an alpha below 1.
    alphas: MendedValues,
    /// The names of properties that are of use together only, where some are missing.
    incomplete: Vec<String>,
    face_uvs: MendedValues,
    face_colors: MendedValues,
}

impl PlyMesh {
    /// Fails if a triangle from `first` on uses a vertex without a finite position.
    fn refuse_bad_positions(&self, first: usize) -> Result<(), String> {
        let bad = &self.faults.positions;
        if bad.is_empty() {
            return Ok(());
        }
        let original = |vertex: u32| match (vertex as usize).checked_sub(self.originals()) {
            Some(copy) => self.copies[copy],
            None => vertex,
        };
        let mut corners = self.mesh.triangles[first..].iter().flatten().map(|vertex| original(*vertex));
        let found = corners.find_map(|vertex| bad.binary_search_by_key(&vertex, |(bad, _)| *bad).ok());
        found.map_or(Ok(()), |at| {
            let (vertex, position) = bad[at];
            Err(format!("the position of its vertex {vertex} is {position}, which is not finite"))
        })
    }

    /// The number of vertices of the file.
    fn originals(&self) -> usize {
        self.mesh.positions.len() - self.copies.len()
    }

    /// Mends what can be mended; returns a message for each kind of fault.
    fn mend(&mut self) -> Vec<String> {
        self.mend_normals();
        if let Some(corner) = self.mesh.triangles.first() {
            // The mesh reaches no further than its faces.
            let inside = self.mesh.positions[corner[0] as usize];
            self.faults
                .positions
                .iter()
                .for_each(|(vertex, _)| self.mesh.positions[*vertex as usize] = inside);
        }
        let of = |vertices: &mut dyn Iterator<Item = u32>| {
            let mut mended = MendedValues::default();
            vertices.for_each(|vertex| mended.note(vertex as usize));
            mended
        };
        let faults = &self.faults;
        let positions = of(&mut faults.positions.iter().map(|(vertex, _)| *vertex));
        let normals = of(&mut faults.normals.iter().copied());
        let kinds = [
            (positions, "vertex", "positions that are not finite", "no face uses them, so they are left out"),
            (normals, "vertex", "normals that are not finite", "worked out from the faces instead"),
            (faults.uvs, "vertex", "texture coordinates that are not finite", "(0, 0) instead"),
            (faults.face_uvs, "face", "texture coordinates that are not finite", "(0, 0) instead"),
            (faults.colors, "vertex", "colours that are not finite", "1 instead"),
            (faults.face_colors, "face", "colours that are not finite", "1 instead"),
            (faults.alphas, "vertex", "alphas below 1", "not supported and ignored: the mesh is opaque"),
        ];
        let found = kinds.into_iter().filter(|(mended, ..)| mended.count > 0);
        let line = |(MendedValues { count, first }, place, what, done)| {
            let first = if count > 1 {
                format!("the first of {place} {first}")
            } else {
                format!("of {place} {first}")
            };
            format!("{what}: {count}, {first}; {done}")
        };
        let incomplete = faults.incomplete.iter().map(|names| {
            format!("its vertices have not all of {names}: what they have of these is left out")
        });
        incomplete.chain(found.map(line)).collect()
    }

    /// Replaces normals that are not finite by the mean of the faces around the vertex.
    fn mend_normals(&mut self) {
        let (bad, first_copy) = (&self.faults.normals, self.originals());
        if bad.is_empty() {
            return;
        }
        let original =
            |vertex: u32| (vertex as usize).checked_sub(first_copy).map_or(vertex, |copy| self.copies[copy]);
        let Mesh { positions, normals, triangles, .. } = &mut self.mesh;
        let smooth = smooth_normals(positions, triangles.iter().map(|triangle| triangle.map(original)));
        for (vertex, normal) in normals.iter_mut().enumerate() {
            let vertex = original(vertex as u32);
            if bad.binary_search(&vertex).is_ok() {
                *normal = smooth[vertex as usize];
            }
        }
    }
}

/// Reads all supported elements. Faces may precede the vertices, but cannot be read before them, so their position is
/// stored.
fn read_body<S: NumberSource>(mut source: S, header: &PlyHeader) -> Result<PlyMesh, String> {
    let mut ply = PlyMesh::default();
    let mut has_vertices = false;
    let mut polygons: Vec<(S, &Element)> = Vec::new();
    let last = header.elements.iter().rposition(|element| Element::is_wanted(&element.name));
    for (i, element) in header.elements.iter().enumerate() {
        source.check_room(element)?;
        match element.name.as_str() {
            "vertex" => {
                vertices::read(&mut source, element, &mut ply)?;
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
        faces::read(&mut source, element, &mut ply)?;
    }
    if ply.mesh.triangles.is_empty() {
        return Err("has no faces (is it a point cloud?): make a surface of it first".into());
    }
    if !ply.textures.is_empty() {
        ply.textures.resize(ply.mesh.triangles.len(), 0);
    }
    Ok(ply)
}

#[cfg(test)]
mod tests;
