//! MikkTSpace tangents for meshes that lack them; normal maps assume these.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, Ops, TangentSpace};
use xxhash_rust::xxh3::Xxh3;

use super::document::Document;
use super::vertex::across;
use crate::error::{Diagnostic, LoadError};
use crate::math::{Vec2, Vec3, Vec4};
use crate::world::{Mesh, SourceFiles};

/// The largest number of triangles around a vertex: the algorithm walks around it recursively, and compares each pair
/// that shares an edge.
const MOST_AROUND: u32 = 1024;
/// Bytes charged for each additional vertex.
const VERTEX_BYTES: u64 = 80;
/// Bytes that the algorithm uses per corner.
const CORNER_BYTES: u64 = 32;

/// Math functions with bit-identical results on all platforms.
struct Libm;

impl Ops for Libm {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        libm::acos(f64::from(x)) as f32
    }
}

struct MeshCorners<'m> {
    mesh: &'m Mesh,
    uvs: &'m [Vec2],
    tangents: Vec<Option<Vec4>>,
}

impl MeshCorners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }

    /// True if no vertex, as the algorithm distinguishes them, has too many triangles.
    fn is_fit(&self) -> bool {
        let mut around: HashMap<[u32; 8], u32> = HashMap::new();
        (0..self.tangents.len()).all(|corner| {
            let (face, corner) = (corner / 3, corner % 3);
            let ([a, b, c], [d, e, f]) = (self.position(face, corner), self.normal(face, corner));
            let [g, h] = self.tex_coord(face, corner);
            let count = around.entry([a, b, c, d, e, f, g, h].map(f32::to_bits)).or_default();
            *count += 1;
            *count <= MOST_AROUND
        })
    }
}

impl Geometry<Libm> for MeshCorners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        // Adding zero removes negative zeros, which would count as other positions.
        (self.mesh.positions[self.vertex(face, corner)] + Vec3::ZERO).to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal =
            self.mesh.normals.get(self.vertex(face, corner)).and_then(|normal| normal.try_normalize());
        let flat = || {
            let [a, b, c] = self.mesh.triangles[face].map(|vertex| self.mesh.positions[vertex as usize]);
            (b - a).cross(c - a).normalize_or(Vec3::Z)
        };
        normal.unwrap_or_else(flat).to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // The v axis of MikkTSpace points up, that of glTF down.
        self.tangents[face * 3 + corner] = space.map(|space| {
            let [x, y, z, sign] = space.tangent_encoded();
            Vec4::new(x, y, z, -sign)
        });
    }
}

/// Generates tangents along one set of a mesh's texture coordinates. A vertex whose corners get different tangents is
/// split. A mesh without these texture coordinates gets none.
pub(super) fn generate(
    document: &Document,
    mesh: &mut Mesh,
    set: u32,
    at: &str,
    sources: &SourceFiles,
    warnings: &mut Vec<Diagnostic>,
) -> Result<(), LoadError> {
    let uvs = if set == 0 { &mesh.uvs } else { &mesh.uvs1 };
    if uvs.is_empty() || mesh.triangles.is_empty() {
        return Ok(());
    }
    let corners = mesh.triangles.len() * 3;
    document.charge(corners as u64 * CORNER_BYTES, at)?;
    let made = sources.kept.tangents.get_or_insert(
        || key(mesh, uvs),
        || {
            let mut space = MeshCorners { mesh, uvs, tangents: vec![None; corners] };
            if !space.is_fit() {
                return Err(Unfit::Crowded);
            }
            // It fails for meshes of practically no area.
            bevy_mikktspace::generate_tangents(&mut space).map_err(|_| Unfit::Flat)?;
            Ok(space.tangents)
        },
    );
    match made {
        Ok(tangents) => split(mesh, &tangents, |bytes| document.charge(bytes, at)),
        Err(Unfit::Flat) => Ok(()),
        Err(Unfit::Crowded) => {
            let what =
                format!("{at}: more than {MOST_AROUND} triangles meet in a vertex: it gets no tangents");
            warnings.push(document.warning(what));
            Ok(())
        }
    }
}

/// A hash of all inputs of the tangents.
fn key(mesh: &Mesh, uvs: &[Vec2]) -> u128 {
    let mut hasher = Xxh3::new();
    let mut add = |numbers: &mut dyn Iterator<Item = u32>| {
        let bytes: Vec<u8> = numbers.flat_map(u32::to_le_bytes).collect();
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(&bytes);
    };
    add(&mut mesh.positions.iter().flat_map(|p| p.to_array()).map(f32::to_bits));
    add(&mut mesh.normals.iter().flat_map(|n| n.to_array()).map(f32::to_bits));
    add(&mut uvs.iter().flat_map(|uv| uv.to_array()).map(f32::to_bits));
    add(&mut mesh.triangles.as_flattened().iter().copied());
    hasher.digest128()
}

/// The reason why a mesh has no tangents.
enum Unfit {
    /// Too many triangles meet in a vertex.
    Crowded,
    /// The mesh has no area.
    Flat,
}

/// Assigns each corner its tangent, and splits vertices where they differ.
fn split(
    mesh: &mut Mesh,
    tangents: &[Option<Vec4>],
    mut charge: impl FnMut(u64) -> Result<(), LoadError>,
) -> Result<(), LoadError> {
    let vertices = mesh.positions.len();
    let mut first: Vec<Option<Vec4>> = vec![None; vertices];
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut more: Vec<(u32, Vec4)> = Vec::new();
    for (corner, tangent) in mesh.triangles.as_flattened_mut().iter_mut().zip(tangents) {
        let tangent = tangent.filter(|tangent| tangent.is_finite() && tangent.truncate().length() > 0.5);
        let Some(tangent) = tangent else { continue };
        let known = &mut first[*corner as usize];
        if *known.get_or_insert(tangent) == tangent {
            continue;
        }
        let vertex = *corner;
        let copy = copies.entry((vertex, tangent.to_array().map(f32::to_bits)));
        *corner = *copy.or_insert_with(|| {
            more.push((vertex, tangent));
            (vertices + more.len() - 1) as u32
        });
    }
    charge(more.len() as u64 * VERTEX_BYTES)?;
    fn extend<T: Copy>(column: &mut Vec<T>, more: &[(u32, Vec4)]) {
        if !column.is_empty() {
            column.reserve(more.len());
            more.iter().for_each(|(vertex, _)| column.push(column[*vertex as usize]));
        }
    }
    let normal = |vertex: usize| mesh.normals.get(vertex).copied().unwrap_or_default();
    let filled = first
        .iter()
        .enumerate()
        .map(|(vertex, tangent)| tangent.unwrap_or_else(|| across(normal(vertex)).extend(1.0)));
    mesh.tangents = filled.chain(more.iter().map(|(_, tangent)| *tangent)).collect();
    extend(&mut mesh.positions, &more);
    extend(&mut mesh.normals, &more);
    extend(&mut mesh.uvs, &more);
    extend(&mut mesh.uvs1, &more);
    extend(&mut mesh.colors, &more);
    extend(&mut mesh.alphas, &more);
    Ok(())
}
