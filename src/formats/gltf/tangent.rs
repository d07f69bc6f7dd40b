//! MikkTSpace tangents for meshes that lack them; normal maps assume these.

use std::collections::HashMap;

use xxhash_rust::xxh3::Xxh3;

use super::document::Document;
use super::mikktspace::{CORNER_BYTES, Crowded, MOST_AROUND, corner_tangents};
use super::vertex::across;
use crate::error::{Diagnostic, LoadError};
use crate::math::{Vec2, Vec4};
use crate::world::{Mesh, SourceFiles};

/// Bytes charged for each additional vertex.
const VERTEX_BYTES: u64 = 80;

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
    let made = sources.kept.tangents.get_or_insert(|| key(mesh, uvs), || corner_tangents(mesh, uvs));
    match made {
        Ok(tangents) => split(mesh, &tangents, |bytes| document.charge(bytes, at)),
        Err(Crowded) => {
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
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    add(bytemuck::cast_slice(&mesh.positions));
    add(bytemuck::cast_slice(&mesh.normals));
    add(bytemuck::cast_slice(uvs));
    add(bytemuck::cast_slice(&mesh.triangles));
    hasher.digest128()
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
