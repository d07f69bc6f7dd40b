//! Checks an OBJ file and normalises it to the simplest form.

use std::io::BufRead;

use super::faces::{FaceFault, FaceLines, Faces, UsedNames};
use super::lines::{LineFault, NORMAL, UV, fault_at, logical_lines};
use super::vertices::{self, VertexLines};
use crate::math::DVec3;

/// OBJ text normalised for tobj: finite numbers; a colour for every vertex; all three indices in every corner, absolute
/// and in range; only polygons; one material library; materials and objects by their numbers; all vertices first.
///
/// Corners without texture coordinates or normals refer to two initial lines: zero texture coordinates, and the zero
/// normal, which means a flat normal. So indices of these two kinds are one more than in the file. Further normals, of
/// the smoothing groups, come last.
pub struct Tidied {
    /// The lines of the vertices.
    vertex_lines: String,
    /// The other lines.
    face_lines: String,
    /// The point that positions are relative to.
    pub origin: DVec3,
    /// True if any face has texture coordinates.
    pub has_uvs: bool,
    /// True if any face has normals.
    pub has_normals: bool,
    /// True if any vertex has a colour. Colours are as the file has them; missing components are not finite.
    pub has_colors: bool,
    /// The material libraries that the file names, as written.
    pub libraries: UsedNames,
    /// The materials that the file uses.
    pub materials: UsedNames,
    /// The objects that have faces, if they are to stay apart.
    pub objects: Vec<String>,
    /// Warnings about skipped and mended values, with their lines.
    pub warnings: Vec<(usize, String)>,
}

impl Tidied {
    /// Checks and normalises a file. With `apart`, its objects are kept apart: those of its `o` lines or, if there are
    /// none, of its `g` lines.
    pub fn new(text: &str, apart: bool) -> Result<Tidied, LineFault> {
        let mut vertices = VertexLines::new(vertices::origin(text));
        for (number, line) in logical_lines(text) {
            vertices.read_line(&line, number);
        }
        let object_word = if !apart {
            ""
        } else if vertices.has_objects {
            "o"
        } else {
            "g"
        };
        let mut faces = Faces::new(&vertices, object_word);
        for (number, line) in logical_lines(text) {
            faces.read_line(&line, number).map_err(|complaint| match complaint {
                FaceFault::Here(place, reason) => fault_at(&line, number, place, reason),
                FaceFault::OfVertex(vertex) => vertices.fault_of(text, vertex),
            })?;
        }
        let FaceLines { lines, normals, has, libraries, materials, objects, mut told } = faces.finish();
        vertices.lines.push_str(&normals);
        told.extend(vertices.told());
        told.sort_unstable_by_key(|(line, _)| *line);
        Ok(Tidied {
            vertex_lines: vertices.lines,
            face_lines: lines,
            origin: vertices.origin,
            has_uvs: has[UV],
            has_normals: has[NORMAL],
            has_colors: vertices.has_colors,
            libraries,
            materials,
            objects,
            warnings: told,
        })
    }

    /// The text for tobj.
    pub fn text(&self) -> impl BufRead + '_ {
        std::io::Read::chain(self.vertex_lines.as_bytes(), self.face_lines.as_bytes())
    }
}
