//! The `face` and `tristrips` elements.

use std::collections::HashMap;

use crate::math::{Rgb, Vec2};
use crate::world::Mesh;
use crate::world::triangulate::Triangulator;

use super::PlyMesh;
use super::header::{Element, PropertyKind, Scalar};
use super::source::{NumberFault, NumberSource};
use super::vertices::{ALPHA, COLOR, ColorCurve, NAMES, uv_from_file};

enum FaceField {
    Indices {
        count: Scalar,
        item: Scalar,
    },
    Uvs {
        count: Scalar,
        item: Scalar,
    },
    /// Red, green or blue.
    Color(usize, Scalar),
    /// The number of the texture.
    Texture(Scalar),
    Skip(PropertyKind),
}

/// Returns the field of each property of a row.
fn steps(element: &Element) -> Result<Vec<FaceField>, String> {
    let mut has_indices = false;
    let mut steps = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let is_of = |names: &&[&str]| names.contains(&property.name.as_str());
        let channel = NAMES[COLOR..ALPHA].iter().position(is_of);
        steps.push(match (property.name.as_str(), property.kind, channel) {
            ("vertex_indices" | "vertex_index", PropertyKind::List { count, item }, _) if !has_indices => {
                has_indices = true;
                FaceField::Indices { count, item }
            }
            ("texcoord", PropertyKind::List { count, item }, _) => FaceField::Uvs { count, item },
            ("texnumber", PropertyKind::Scalar(scalar), _) if !scalar.is_float() => {
                FaceField::Texture(scalar)
            }
            (_, PropertyKind::Scalar(scalar), Some(channel)) => FaceField::Color(channel, scalar),
            (_, kind, _) => FaceField::Skip(kind),
        });
    }
    if has_indices {
        Ok(steps)
    } else {
        Err(format!("element {} has no list property vertex_indices", element.name))
    }
}

/// Reads all faces or strips of an element into a mesh that already has its vertices.
pub fn read<S: NumberSource>(source: &mut S, element: &Element, ply: &mut PlyMesh) -> Result<(), String> {
    let steps = steps(element)?;
    let is_strips = element.name == "tristrips";
    if !is_strips {
        // A triangle takes at least three indices, so the file's size limits this allocation.
        ply.mesh.triangles.reserve(element.count as usize);
    }
    let mut triangulator = Triangulator::default();
    let mut wedges = Wedges::default();
    // Indices in the file refer to the original vertices; faces may add copies.
    let vertices = ply.mesh.positions.len();
    let has_color =
        |c: usize| steps.iter().any(|step| matches!(step, FaceField::Color(channel, _) if *channel == c));
    // Vertex colours take precedence over face colours.
    let has_colors = (0..3).all(has_color) && ply.mesh.colors.is_empty();
    let types = steps.iter().filter_map(|step| match step {
        FaceField::Color(_, scalar) => Some(scalar),
        _ => None,
    });
    let curve = ColorCurve::of(types);
    ply.colors_are_encoded |= has_colors && curve.is_encoded;
    let mut row = FaceRow::new(curve);
    let has_textures = steps.iter().any(|step| matches!(step, FaceField::Texture(_)));
    for i in 0..element.count {
        let place = |reason: String| format!("{} {i}: {reason}", element.name);
        row.read(source, &steps).map_err(|fault| place(source.describe(fault)))?;
        let first = ply.mesh.triangles.len();
        if is_strips {
            row.strip(&mut ply.mesh).map_err(place)?;
        } else {
            row.check_indices(vertices).map_err(place)?;
            if has_colors && row.color.iter().any(|component| !component.is_finite()) {
                ply.faults.face_colors.note(i as usize);
            }
            if row.uvs.iter().any(|number| !number.is_finite()) {
                ply.faults.face_uvs.note(i as usize);
            }
            let color = has_colors.then_some(Rgb::from(row.color));
            if !row.uvs.is_empty() || has_colors {
                wedges.apply(&mut row.corners, &row.uvs, color, ply).map_err(place)?;
            }
            let Mesh { positions, triangles, .. } = &mut ply.mesh;
            if let [a, b, c] = row.corners[..] {
                triangles.push([a, b, c]);
            } else {
                let corners = &row.corners;
                let split = triangulator.split(positions, corners, |t| triangles.push(t.map(|k| corners[k])));
                split.map_err(|fault| place(fault.to_string()))?;
            }
        }
        ply.refuse_bad_positions(first).map_err(place)?;
        if has_textures {
            ply.textures.resize(first, 0);
            ply.textures.resize(ply.mesh.triangles.len(), row.texture);
        }
    }
    Ok(())
}

/// The data of a face; reused for its buffers.
struct FaceRow {
    indices: Vec<i64>,
    corners: Vec<u32>,
    uvs: Vec<f32>,
    /// Red, green and blue.
    color: [f32; 3],
    curve: ColorCurve,
    texture: u32,
}

impl FaceRow {
    fn new(curve: ColorCurve) -> FaceRow {
        let (indices, corners, uvs) = (Vec::new(), Vec::new(), Vec::new());
        FaceRow { indices, corners, uvs, color: [0.0; 3], curve, texture: 0 }
    }

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
                        self.uvs.push(source.float(item)? as f32);
                    }
                }
                FaceField::Color(channel, scalar) => {
                    let value = source.float(scalar)? as f32;
                    self.color[channel] = self.curve.convert(value, Some(scalar));
                }
                // A number below 0 means no texture.
                FaceField::Texture(scalar) => {
                    self.texture = u32::try_from(source.integer(scalar)?).unwrap_or(u32::MAX);
                }
                FaceField::Skip(kind) => source.skip_property(kind)?,
            }
        }
        Ok(())
    }

    /// Converts the indices to corners, with a range check.
    fn check_indices(&mut self, vertices: usize) -> Result<(), String> {
        self.corners.clear();
        for &index in &self.indices {
            self.corners.push(check_index(index, vertices)?);
        }
        Ok(())
    }

    /// Reads the indices as triangle strips separated by −1; every second triangle of a strip is flipped. Triangles
    /// with two equal corners only connect two parts and are skipped.
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

/// Texture coordinates and colours per face: a vertex used with several values is split.
#[derive(Default)]
struct Wedges {
    /// True for each original vertex that a face has given its values.
    taken: Vec<bool>,
    copies: HashMap<(u32, [u32; 5]), u32>,
}

impl Wedges {
    /// Assigns each of `corners` its pair of `uvs`, and all of them a colour if there is one. A face whose pairs do not
    /// match its corners keeps the existing ones.
    fn apply(
        &mut self,
        corners: &mut [u32],
        uvs: &[f32],
        color: Option<Rgb>,
        ply: &mut PlyMesh,
    ) -> Result<(), String> {
        let mesh = &mut ply.mesh;
        let has_uvs = !uvs.is_empty() && uvs.len() == 2 * corners.len();
        if !has_uvs && color.is_none() {
            return Ok(());
        }
        let count = mesh.positions.len();
        if self.taken.is_empty() {
            self.taken.resize(count, false);
        }
        if has_uvs {
            mesh.uvs.resize(count, Vec2::ZERO);
        }
        if color.is_some() {
            mesh.colors.resize(count, Rgb::WHITE);
        }
        for (k, corner) in corners.iter_mut().enumerate() {
            let vertex = *corner as usize;
            let is_taken = self.taken[vertex];
            let uv = if has_uvs {
                Some(uv_from_file(uvs[2 * k], uvs[2 * k + 1]).unwrap_or_default())
            } else {
                mesh.uvs.get(vertex).copied()
            };
            let color = color.or_else(|| mesh.colors.get(vertex).copied());
            let bits = |color: Option<Rgb>| color.map(|color| color.to_array().map(f32::to_bits));
            if !is_taken {
                self.taken[vertex] = true;
                set(&mut mesh.uvs, vertex, uv);
                set(&mut mesh.colors, vertex, color);
            } else if mesh.uvs.get(vertex).copied() != uv
                || bits(mesh.colors.get(vertex).copied()) != bits(color)
            {
                *corner = self.copy(*corner, uv, color, mesh, &mut ply.copies)?;
            }
        }
        Ok(())
    }

    fn copy(
        &mut self,
        vertex: u32,
        uv: Option<Vec2>,
        color: Option<Rgb>,
        mesh: &mut Mesh,
        originals: &mut Vec<u32>,
    ) -> Result<u32, String> {
        let (Vec2 { x: u, y: v }, Rgb { r, g, b }) = (uv.unwrap_or_default(), color.unwrap_or_default());
        let key = (vertex, [u, v, r, g, b].map(f32::to_bits));
        if let Some(&copy) = self.copies.get(&key) {
            return Ok(copy);
        }
        let copy = u32::try_from(mesh.positions.len()).map_err(|_| "too many vertices")?;
        mesh.positions.push(mesh.positions[vertex as usize]);
        mesh.uvs.extend(uv);
        mesh.colors.extend(color);
        if let Some(&normal) = mesh.normals.get(vertex as usize) {
            mesh.normals.push(normal);
        }
        originals.push(vertex);
        self.copies.insert(key, copy);
        Ok(copy)
    }
}

fn set<T>(values: &mut [T], place: usize, value: Option<T>) {
    if let Some((to, value)) = values.get_mut(place).zip(value) {
        *to = value;
    }
}
