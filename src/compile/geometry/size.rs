//! The size of compiled geometry: which meshes are copied, what it may be, and the memory that it takes.

use super::{ByPtr, GeometryInputs, PlacedShape};
use crate::bvh::build::builder::peak_bytes;
use crate::error::CompileError;
use crate::memory::{self, Reservation};
use crate::world::{Mesh, Shape};

/// Chooses the meshes that are copied to world space at all of their places: those whose copies are smallest, as many
/// as the limit allows.
pub(super) fn choose_copied(inputs: &GeometryInputs, uses: &[u32]) -> Vec<bool> {
    // Vertices count, too: a mesh may have any number that no triangle uses.
    let size = |mesh: &ByPtr<Mesh>| mesh.0.triangles.len().max(mesh.0.positions.len()) as u64;
    let sizes = inputs.meshes.iter().map(size);
    let extra: Vec<u64> = uses.iter().zip(sizes).map(|(n, size)| n.saturating_sub(1) as u64 * size).collect();
    let mut meshes: Vec<usize> = (0..extra.len()).collect();
    meshes.sort_by_key(|mesh| extra[*mesh]);
    let mut copied = vec![false; extra.len()];
    let mut left = inputs.copied_triangles as u64;
    for mesh in meshes {
        let Some(rest) = left.checked_sub(extra[mesh]) else { break };
        copied[mesh] = true;
        left = rest;
    }
    copied
}

/// The number of entities that place each mesh.
pub(super) fn count_uses(inputs: &GeometryInputs) -> Vec<u32> {
    let mut uses = vec![0; inputs.meshes.len()];
    for placed in &inputs.shapes {
        if let Shape::Mesh(id) = placed.shape {
            uses[id.0 as usize] += placed.places() as u32;
        }
    }
    uses
}

/// Checks sizes and reserves memory for geometry and trees. Ids have 31 bits, and lanes address three floats a vertex
/// with 31 bits.
pub(super) fn check(
    inputs: &GeometryInputs,
    uses: &[u32],
    copied: &[bool],
) -> Result<Reservation<'static>, CompileError> {
    let (mut vertices, mut triangles, mut bytes) = (0usize, 0usize, 0usize);
    for (ByPtr(mesh), (uses, copied)) in inputs.meshes.iter().zip(uses.iter().zip(copied)) {
        let copies = if *copied { (*uses).max(1) as usize } else { 1 };
        vertices = vertices.saturating_add(copies.saturating_mul(mesh.positions.len()));
        triangles = triangles.saturating_add(copies.saturating_mul(mesh.triangles.len()));
        bytes = bytes.saturating_add(copies.saturating_mul(mesh.bytes()));
        if inputs.keeps_object_space {
            bytes = bytes.saturating_add(copies.saturating_mul(size_of_val(&mesh.positions[..])));
        }
    }
    for corners in inputs.flat_shapes() {
        vertices = vertices.saturating_add(corners);
        triangles = triangles.saturating_add(Shape::fan(corners).count());
        bytes = bytes.saturating_add(corners * CORNER_BYTES);
    }
    let most = (i32::MAX as usize) / 3 - (1 << 20);
    if vertices.max(triangles) > most {
        return Err(CompileError::TooLarge(format!(
            "{vertices} vertices and {triangles} triangles; the most is {most}"
        )));
    }
    let spheres = inputs.shapes.iter().filter(|placed| matches!(placed.shape, Shape::Sphere { .. }));
    let spheres = spheres.map(PlacedShape::places).sum::<usize>();
    let primitives = triangles + spheres;
    bytes = bytes.saturating_add(inputs.shapes.iter().map(PlacedShape::places).sum::<usize>() * PLACED_BYTES);
    // The part of each triangle, and the finished tree.
    let built = peak_bytes(primitives, true) + primitives * (4 + TREE_BYTES);
    let what = format_args!("the geometry of {triangles} triangles with its tree");
    Ok(memory::reserve(what, bytes.saturating_add(built) as u64)?)
}

/// Bytes of an instance, or of another placed shape.
const PLACED_BYTES: usize = 320;
/// Bytes of a corner of a flat shape, with its triangle.
const CORNER_BYTES: usize = 48;
/// Bytes of nodes and blocks, for each triangle.
const TREE_BYTES: usize = 60;
