//! STL, the format of stereolithography (3D Systems 1989): the triangles of one mesh, as text or binary.
//!
//! Vertices of equal position are merged. Shading is flat, by the order of the corners: the normals that a file has are
//! not used, because many programs leave them 0 or turn them. Colours, which a few programs keep in the two bytes after
//! a triangle, are not used. STL has no unit; numbers are taken for metres. Messages count facets from 0.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use crate::error::{Diagnostic, LoadError};
use crate::formats::mended::precise_number;
use crate::math::{DVec3, Vec3};
use crate::memory;
use crate::world::Mesh;
use crate::world::asset_cache::MeshFile;
use crate::world::origin;
use crate::world::triangulate::Triangulator;

/// The bytes before the triangles of a binary file: a comment, and their number.
const HEADER: usize = 84;
/// The bytes of a triangle: normal, corners, and two more.
const FACET: usize = 50;
/// Memory used per byte of a file: vertices, and the table in which equal ones are found.
const BYTES_OF_FILE: u64 = 5;

/// Reads a mesh from an STL file.
pub fn load(path: &Path) -> Result<MeshFile, LoadError> {
    let bytes = crate::files::read(path).map_err(LoadError::io(path))?;
    parse(&bytes, path)
}

/// Reads a mesh from the contents of an STL file; messages call it `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    let _claim = memory::reserve("its triangles", BYTES_OF_FILE * bytes.len() as u64)
        .map_err(LoadError::shortage(path))?;
    let mut facets = Facets::default();
    let said = if is_text(bytes) {
        read_text(bytes, &mut facets).map_err(|fault| {
            let before = &bytes[..fault.place];
            let start = before.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
            LoadError::At {
                file: path.to_owned(),
                line: before.iter().filter(|b| **b == b'\n').count() + 1,
                column: String::from_utf8_lossy(&before[start..]).chars().count() + 1,
                reason: fault.reason,
            }
        })?
    } else {
        read_binary(bytes, &mut facets).map_err(|reason| LoadError::invalid(path, reason))?
    };
    let mut mesh = facets.mesh;
    (mesh.origin, mesh.positions) = origin::split(&facets.points);
    if mesh.triangles.is_empty() {
        return Err(LoadError::invalid(path, "has no triangles"));
    }
    mesh.name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    mesh.source = Some(path.to_owned());
    let warnings = said.iter().map(|what| Diagnostic::in_file("import", path, what)).collect();
    Ok(MeshFile { mesh: Arc::new(mesh), images: Vec::new(), image_of: Vec::new(), warnings })
}

/// The facets read so far, and the vertices by the bits of their positions.
#[derive(Default)]
struct Facets {
    mesh: Mesh,
    points: Vec<DVec3>,
    vertices: HashMap<[u64; 3], u32>,
    triangulator: Triangulator,
    corners: Vec<u32>,
    /// The corners of a facet, relative to the first one.
    relative: Vec<Vec3>,
    count: usize,
}

impl Facets {
    /// Adds a facet, which may be a polygon.
    fn add(&mut self, corners: &[DVec3]) -> Result<(), String> {
        let facet = self.count;
        self.count += 1;
        self.corners.clear();
        self.relative.clear();
        for corner in corners {
            if !corner.as_vec3().is_finite() {
                let corner = corner.as_vec3();
                return Err(format!("facet {facet}: its corner {corner} is not finite"));
            }
            self.relative.push((*corner - corners[0]).as_vec3());
            // Zeros of both signs are equal.
            let position = *corner + DVec3::ZERO;
            let next = u32::try_from(self.points.len()).map_err(|_| "too many vertices")?;
            let vertex = *self.vertices.entry(position.to_array().map(f64::to_bits)).or_insert(next);
            if vertex == next {
                self.points.push(position);
            }
            self.corners.push(vertex);
        }
        let Self { corners, relative, triangulator, .. } = self;
        let triangles = &mut self.mesh.triangles;
        let own: Vec<u32> = (0..corners.len() as u32).collect();
        let split = triangulator.split(relative, &own, |t| triangles.push(t.map(|k| corners[k])));
        split.map_err(|fault| format!("facet {facet}: {fault}"))
    }
}

/// True if a file is text. Binary files may begin with `solid`, too; they have the length that their number of triangles
/// gives, or bytes that no text has.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let is_solid = start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let has_length = promised(bytes).is_some_and(|count| Some(bytes.len()) == length_of(count));
    let is_control = |byte: &u8| *byte < b' ' && !byte.is_ascii_whitespace();
    is_solid && !has_length && !bytes.iter().take(4 * HEADER).any(is_control)
}

/// The number of triangles in the header of a binary file.
fn promised(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*count) as usize)
}

/// The length of a binary file of some triangles.
fn length_of(count: usize) -> Option<usize> {
    count.checked_mul(FACET)?.checked_add(HEADER)
}

/// Reads a binary file; also returns a message if its number of triangles is wrong.
fn read_binary(bytes: &[u8], facets: &mut Facets) -> Result<Option<String>, String> {
    // A binary file of ordinary numbers has zeros.
    let is_text = !bytes.iter().any(|byte| *byte == 0 || *byte >= 128);
    let Some(promised) = promised(bytes).filter(|_| !is_text) else {
        return Err(
            "not an STL file: neither text that begins with \"solid\", nor the header of a binary file \
                    (80 bytes and the number of triangles)"
                .into(),
        );
    };
    let body = &bytes[HEADER..];
    let (whole, rest) = (body.len() / FACET, body.len() % FACET);
    // Bytes after the last triangle are no triangles unless they have their length.
    let count = if rest == 0 { whole } else { promised.min(whole) };
    if count == 0 {
        return Err(format!(
            "its header promises {promised} triangles, but none follows: it is cut short or no STL file"
        ));
    }
    facets.mesh.triangles.reserve_exact(count);
    for facet in body.chunks_exact(FACET).take(count) {
        let float = |at: usize| {
            let bytes = facet.get(at..).and_then(|bytes| bytes.first_chunk::<4>());
            bytes.map_or(f32::NAN, |bytes| f32::from_le_bytes(*bytes))
        };
        let corner =
            |k: usize| Vec3::new(float(12 + 12 * k), float(16 + 12 * k), float(20 + 12 * k)).as_dvec3();
        facets.add(&[corner(0), corner(1), corner(2)])?;
    }
    let said = if promised > count {
        Some(format!("its header promises {promised} triangles, but only {count} follow: it is cut short"))
    } else if promised < count {
        Some(format!("its header promises {promised} triangles, but {count} follow: all are read"))
    } else if rest > 0 {
        Some(format!("{} bytes after the last triangle are ignored", body.len() - count * FACET))
    } else {
        None
    };
    Ok(said)
}

/// A fault in a text, and its byte offset.
struct TextFault {
    place: usize,
    reason: String,
}

/// Reads a text; also returns a message if it ends within a facet. Only corners, and the ends of their loops, matter.
fn read_text(bytes: &[u8], facets: &mut Facets) -> Result<Option<String>, TextFault> {
    let mut words = Words { bytes, at: 0 };
    let mut corners: Vec<DVec3> = Vec::new();
    let mut is_open = false;
    while let Some((place, word)) = words.next() {
        let is = |keyword: &str| word.eq_ignore_ascii_case(keyword.as_bytes());
        if is("solid") || is("endsolid") {
            // The rest of the line is a name.
            words.skip_line();
        } else if is("facet") {
            is_open = true;
            corners.clear();
        } else if is("vertex") {
            let mut numbers = [0.0; 3];
            for number in &mut numbers {
                let Some((place, word)) = words.next() else { return Ok(Some(facets.cut_short())) };
                match parse_number(word) {
                    Ok(value) => *number = value,
                    Err(_) if words.at == bytes.len() => return Ok(Some(facets.cut_short())),
                    Err(reason) => return Err(TextFault { place, reason }),
                }
            }
            corners.push(DVec3::from_array(numbers));
        } else if is("endloop") || is("endfacet") {
            if corners.len() >= 3 {
                facets.add(&corners).map_err(|reason| TextFault { place, reason })?;
            }
            corners.clear();
            is_open &= is("endloop");
        }
    }
    Ok((is_open || !corners.is_empty()).then(|| facets.cut_short()))
}

impl Facets {
    fn cut_short(&self) -> String {
        format!("the file ends within facet {}: it is cut short, and what comes before is shown", self.count)
    }
}

fn parse_number(word: &[u8]) -> Result<f64, String> {
    let text = String::from_utf8_lossy(word);
    precise_number(&text).ok_or_else(|| {
        let shown: String = text.chars().take(40).collect();
        format!("{shown:?} is not a number")
    })
}

/// The words of a text, with their byte offsets.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<(usize, &'a [u8])> {
        let rest = &self.bytes[self.at..];
        let start = self.at + rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &self.bytes[start..];
        self.at = start + rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        Some((start, &self.bytes[start..self.at]))
    }

    fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
    }
}

#[cfg(test)]
mod tests;
