//! The `face` and `tristrips` elements.

use std::collections::HashMap;

use crate::formats::triangulate::Triangulator;
use crate::math::Vec2;
use crate::world::Mesh;

use super::header::{Element, PropertyKind, Scalar};
use super::source::{NumberFault, NumberSource};
use super::vertices::uv_from_file;

enum FaceField {
    Indices { count: Scalar, item: Scalar },
    Uvs { count: Scalar, item: Scalar },
    Skip(PropertyKind),
}

/// What to do with each property of a row.
fn steps(element: &Element) -> Result<Vec<FaceField>, String> {
    let mut has_indices = false;
    let mut steps = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        steps.push(match (property.name.as_str(), property.kind) {
            ("vertex_indices" | "vertex_index", PropertyKind::List { count, item }) if !has_indices => {
                if item.is_float() {
                    return Err(format!("{} of {} are not of an integer type", property.name, element.name));
                }
                has_indices = true;
                FaceField::Indices { count, item }
            }
            ("texcoord", PropertyKind::List { count, item }) => FaceField::Uvs { count, item },
            (_, kind) => FaceField::Skip(kind),
        });
    }
    if has_indices {
        Ok(steps)
    } else {
        Err(format!("element {} has no list property vertex_indices", element.name))
    }
}

/// Reads all faces or strips of an element onto a mesh that has its vertices.
pub fn read<S: NumberSource>(source: &mut S, element: &Element, mesh: &mut Mesh) -> Result<(), String> {
    let steps = steps(element)?;
    let is_strips = element.name == "tristrips";
    if !is_strips {
        // A triangle takes at least three indices, so the file's size limits this.
        mesh.triangles.reserve(element.count as usize);
    }
    let mut row = Row::default();
    let mut triangulator = Triangulator::default();
    let mut wedges = Wedges::default();
    // Those of the file; faces may add copies.
    let vertices = mesh.positions.len();
    for i in 0..element.count {
        let place = |reason: String| format!("{} {i}: {reason}", element.name);
        row.read(source, &steps).map_err(|fault| place(source.describe(fault)))?;
        if is_strips {
            row.strip(mesh).map_err(place)?;
            continue;
        }
        row.check_indices(vertices).map_err(place)?;
        if !row.uvs.is_empty() {
            wedges.apply(&mut row.corners, &row.uvs, mesh).map_err(place)?;
        }
        let Mesh { positions, triangles, .. } = &mut *mesh;
        if let [a, b, c] = row.corners[..] {
            triangles.push([a, b, c]);
            continue;
        }
        let corners = &row.corners;
        let split = triangulator.split(positions, corners, |t| triangles.push(t.map(|k| corners[k])));
        split.map_err(|fault| place(fault.to_string()))?;
    }
    Ok(())
}

/// One face as it was read; kept for its buffers.
#[derive(Default)]
struct Row {
    indices: Vec<i64>,
    corners: Vec<u32>,
    uvs: Vec<f32>,
}

impl Row {
    fn read<S: NumberSource>(&mut self, source: &mut S, steps: &[FaceField]) -> Result<(), NumberFault> {
        self.uvs.clear();
        for step in steps {
            match *step {
                FaceField::Indices { count, item } => {
                    self.indices.clear();
                    for _ in 0..source.list_length(count, item)? {
                        self.indices.push(source.integer(item)?);
                    }
                }
                FaceField::Uvs { count, item } => {
                    self.uvs.clear();
                    for _ in 0..source.list_length(count, item)? {
                        self.uvs.push(source.float(item)?);
                    }
                }
                FaceField::Skip(kind) => source.skip_property(kind)?,
            }
        }
        Ok(())
    }

    /// Turns indices into corners.
    fn check_indices(&mut self, vertices: usize) -> Result<(), String> {
        self.corners.clear();
        for &index in &self.indices {
            self.corners.push(check_index(index, vertices)?);
        }
        Ok(())
    }

    /// Reads the indices as strips of triangles with −1 between them; every second triangle
    /// of a strip is turned. Triangles that only connect two parts have two equal corners.
    fn strip(&self, mesh: &mut Mesh) -> Result<(), String> {
        for strip in self.indices.split(|&index| index == -1) {
            for &index in strip {
                check_index(index, mesh.positions.len())?;
            }
            for (i, window) in strip.windows(3).enumerate() {
                let [a, b, c] = [window[0], window[1], window[2]].map(|index| index as u32);
                if a != b && b != c && c != a {
                    mesh.triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
                }
            }
        }
        Ok(())
    }
}

fn check_index(index: i64, vertices: usize) -> Result<u32, String> {
    if (0..vertices as i64).contains(&index) {
        Ok(index as u32)
    } else {
        Err(format!("vertex index {index} is out of range: there are {vertices} vertices"))
    }
}

/// Texture coordinates by face: a vertex that is seen with more than one pair becomes several.
#[derive(Default)]
struct Wedges {
    /// For each original vertex, whether a face has given it its uv.
    taken: Vec<bool>,
    copies: HashMap<(u32, [u32; 2]), u32>,
}

impl Wedges {
    /// Gives each of `corners` its pair of `uvs`. A face whose pairs do not match its corners
    /// stays as it is.
    fn apply(&mut self, corners: &mut [u32], uvs: &[f32], mesh: &mut Mesh) -> Result<(), String> {
        if uvs.len() != 2 * corners.len() {
            return Ok(());
        }
        if self.taken.is_empty() {
            self.taken.resize(mesh.positions.len(), false);
            mesh.uvs.resize(mesh.positions.len(), Vec2::ZERO);
        }
        for (corner, uv) in corners.iter_mut().zip(uvs.chunks_exact(2)) {
            let uv = uv_from_file(uv[0], uv[1]);
            let vertex = *corner as usize;
            if !self.taken[vertex] {
                self.taken[vertex] = true;
                mesh.uvs[vertex] = uv;
            } else if mesh.uvs[vertex] != uv {
                *corner = self.copy(*corner, uv, mesh)?;
            }
        }
        Ok(())
    }

    fn copy(&mut self, vertex: u32, uv: Vec2, mesh: &mut Mesh) -> Result<u32, String> {
        let key = (vertex, [uv.x.to_bits(), uv.y.to_bits()]);
        if let Some(&copy) = self.copies.get(&key) {
            return Ok(copy);
        }
        let copy = u32::try_from(mesh.positions.len()).map_err(|_| "too many vertices")?;
        mesh.positions.push(mesh.positions[vertex as usize]);
        mesh.uvs.push(uv);
        if let Some(&normal) = mesh.normals.get(vertex as usize) {
            mesh.normals.push(normal);
        }
        if let Some(&color) = mesh.colors.get(vertex as usize) {
            mesh.colors.push(color);
        }
        self.copies.insert(key, copy);
        Ok(copy)
    }
}
