//! Builds a mesh within a limit of memory.

use crate::error::CompileError;
use crate::math::{DVec3, Vec2};
use crate::memory::{self, Reservation};
use crate::world::Mesh;

/// The most triangles of a shape: ids have 31 bits, and a scene holds more than one shape.
const MOST: usize = 1 << 28;
/// Bytes of a vertex with normal and texture coordinates, and of a triangle.
const BYTES: [usize; 2] = [32, 12];

/// A mesh that is being built.
pub(super) struct MeshBuilder {
    mesh: Mesh,
    _claim: Reservation<'static>,
}

/// A vertex, as its parameters give it.
#[derive(Clone, Copy)]
pub(super) struct ShapeVertex {
    pub position: DVec3,
    pub normal: DVec3,
    pub uv: [f64; 2],
}

impl MeshBuilder {
    /// Reserves memory for at most that many vertices and triangles.
    pub(super) fn with_room(vertices: usize, triangles: usize) -> Result<MeshBuilder, CompileError> {
        if vertices.max(triangles) > MOST {
            let text = format!("a shape of {triangles} triangles; the most is {MOST}: make it coarser");
            return Err(CompileError::TooLarge(text));
        }
        let bytes = vertices * BYTES[0] + triangles * BYTES[1];
        let claim = memory::reserve(format_args!("a shape of {triangles} triangles"), bytes as u64)?;
        let mut mesh = Mesh::default();
        mesh.positions.reserve_exact(vertices);
        mesh.normals.reserve_exact(vertices);
        mesh.uvs.reserve_exact(vertices);
        mesh.triangles.reserve_exact(triangles);
        Ok(MeshBuilder { mesh, _claim: claim })
    }

    /// Adds a vertex and returns its index.
    pub(super) fn vertex(&mut self, ShapeVertex { position, normal, uv }: ShapeVertex) -> u32 {
        self.mesh.positions.push(position.as_vec3());
        self.mesh.normals.push(normal.normalize_or_zero().as_vec3());
        self.mesh.uvs.push(Vec2::new(uv[0] as f32, uv[1] as f32));
        self.mesh.positions.len() as u32 - 1
    }

    /// Adds a vertex in the place of another.
    pub(super) fn copy(&mut self, of: u32, normal: DVec3, uv: [f64; 2]) -> u32 {
        let position = self.mesh.positions[of as usize];
        let added = self.vertex(ShapeVertex { position: DVec3::ZERO, normal, uv });
        self.mesh.positions[added as usize] = position;
        added
    }

    /// Moves vertices to the places of others, as many from `from` on.
    pub(super) fn weld(&mut self, from: u32, to: u32, count: usize) {
        self.mesh.positions.copy_within(from as usize..from as usize + count, to as usize);
    }

    /// Adds a triangle, unless two of its corners are in the same place.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|corner| self.mesh.positions[corner as usize]);
        if a != b && b != c && c != a {
            self.mesh.triangles.push(corners);
        }
    }

    /// Adds a quadrilateral, counter-clockwise seen from outside.
    pub(super) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// Adds quadrilaterals between rows of `columns` vertices each, the first of which is `first`. Seen from outside, rows
    /// go down and columns to the right.
    pub(super) fn lattice(&mut self, first: u32, rows: usize, columns: usize) {
        for row in 0..rows.saturating_sub(1) {
            for column in 0..columns.saturating_sub(1) {
                let at = |i: usize, k: usize| first + ((row + i) * columns + column + k) as u32;
                self.quad([at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
            }
        }
    }

    /// The number of vertices.
    pub(super) fn len(&self) -> u32 {
        self.mesh.positions.len() as u32
    }

    pub(super) fn finish(self) -> Mesh {
        self.mesh
    }
}
