//! Polygon meshes under construction, and the binary PLY files written from them.
//!
//! Renderers load triangles; these files keep quads and larger polygons, which halves their size and is the subject of
//! Figure 8 of the report.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

/// Sine and cosine of an angle in degrees, the same bits on every platform.
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    libm::sincos(degrees.to_radians())
}

/// The point at `radius` and `degrees` from the origin.
pub fn polar(radius: f64, degrees: f64) -> DVec2 {
    let (sin, cos) = sin_cos_degrees(degrees);
    DVec2::new(cos, sin) * radius
}

/// A rotation about X (0), Y (1) or Z (2).
pub fn rotation(axis: usize, degrees: f64) -> DMat3 {
    let (sin, cos) = sin_cos_degrees(degrees);
    let mut columns = [DVec3::X, DVec3::Y, DVec3::Z];
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    columns[b] = DVec3::ZERO;
    columns[b][b] = cos;
    columns[b][c] = sin;
    columns[c] = DVec3::ZERO;
    columns[c][c] = cos;
    columns[c][b] = -sin;
    DMat3::from_cols(columns[0], columns[1], columns[2])
}

/// A polygon. Only faces of the same group are smoothed into each other.
#[derive(Clone, Debug)]
pub struct Face {
    /// Indices of positions, counter-clockwise seen from the front.
    pub corners: Vec<u32>,
    /// One for each corner, v upwards; or empty.
    pub uvs: Vec<DVec2>,
    /// Smoothing group.
    pub group: u32,
}

/// A polygon mesh under construction.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    /// Shared by all faces that touch at a position.
    pub positions: Vec<DVec3>,
    /// The polygons.
    pub faces: Vec<Face>,
}

impl Solid {
    /// Adds a vertex.
    pub fn vertex(&mut self, position: DVec3) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    /// Adds a face without texture coordinates.
    pub fn face(&mut self, corners: &[u32], group: u32) {
        self.faces.push(Face { corners: corners.to_vec(), uvs: Vec::new(), group });
    }

    /// Adds another solid; their smoothing groups stay separate.
    pub fn append(&mut self, other: &Solid) {
        let first_vertex = self.positions.len() as u32;
        let first_group = self.faces.iter().map(|f| f.group + 1).max().unwrap_or(0);
        self.positions.extend_from_slice(&other.positions);
        self.faces.extend(other.faces.iter().map(|face| Face {
            corners: face.corners.iter().map(|c| c + first_vertex).collect(),
            uvs: face.uvs.clone(),
            group: face.group + first_group,
        }));
    }

    /// Moves every vertex; `map` must not mirror.
    pub fn map(mut self, map: impl Fn(DVec3) -> DVec3) -> Solid {
        for p in &mut self.positions {
            *p = map(*p);
        }
        self
    }

    /// Rotates about X (0), Y (1) or Z (2).
    pub fn rotated(self, axis: usize, degrees: f64) -> Solid {
        let matrix = rotation(axis, degrees);
        self.map(|p| matrix * p)
    }

    /// Moves by an offset.
    pub fn translated(self, x: f64, y: f64, z: f64) -> Solid {
        self.map(|p| p + DVec3::new(x, y, z))
    }

    /// Sets texture coordinates by projecting each face along the axis that it faces most; `size` is the length that
    /// the image covers.
    pub fn with_box_uvs(mut self, size: f64) -> Solid {
        for index in 0..self.faces.len() {
            let n = self.face_normal(&self.faces[index]);
            let a = n.abs();
            let project = |p: DVec3| {
                if a.y >= a.x && a.y >= a.z {
                    DVec2::new(p.x, -p.z)
                } else if a.z >= a.x {
                    DVec2::new(p.x, p.y)
                } else {
                    DVec2::new(p.z, p.y)
                }
            };
            let uvs = self.faces[index].corners.iter();
            let uvs = uvs.map(|&c| project(self.positions[c as usize]) / size).collect();
            self.faces[index].uvs = uvs;
        }
        self
    }

    /// Sets texture coordinates by projection along Z: the image covers `size` about the origin.
    pub fn with_planar_uvs(mut self, size: f64) -> Solid {
        for face in &mut self.faces {
            let uv = |&c: &u32| self.positions[c as usize].truncate() / size + DVec2::splat(0.5);
            face.uvs = face.corners.iter().map(uv).collect();
        }
        self
    }

    /// Newell's normal of a polygon; its length is twice the area.
    fn face_normal(&self, face: &Face) -> DVec3 {
        let n = face.corners.len();
        let mut sum = DVec3::ZERO;
        for i in 0..n {
            let p = self.positions[face.corners[i] as usize];
            let q = self.positions[face.corners[(i + 1) % n] as usize];
            sum += p.cross(q);
        }
        sum
    }

    /// Computes normals at the corners, averaged over the faces of the group at the same vertex that bend by less than
    /// `crease_degrees`; equal corners become one vertex.
    pub fn smoothed(&self, crease_degrees: f64) -> Polygons {
        let limit = sin_cos_degrees(crease_degrees).1;
        let normals: Vec<DVec3> =
            self.faces.iter().map(|f| self.face_normal(f).normalize_or_zero()).collect();
        let mut around: Vec<Vec<(u32, f64)>> = vec![Vec::new(); self.positions.len()];
        for (index, face) in self.faces.iter().enumerate() {
            let n = face.corners.len();
            for (i, &corner) in face.corners.iter().enumerate() {
                let p = self.positions[corner as usize];
                let before = self.positions[face.corners[(i + n - 1) % n] as usize] - p;
                let after = self.positions[face.corners[(i + 1) % n] as usize] - p;
                let angle = libm::atan2(before.cross(after).length(), before.dot(after));
                around[corner as usize].push((index as u32, angle));
            }
        }
        let mut result = Polygons::default();
        let mut known: HashMap<(u32, [u32; 5]), u32> = HashMap::new();
        for (index, face) in self.faces.iter().enumerate() {
            let own = normals[index];
            let mut corners = Vec::with_capacity(face.corners.len());
            for (i, &corner) in face.corners.iter().enumerate() {
                let mut sum = DVec3::ZERO;
                for &(other, angle) in &around[corner as usize] {
                    let normal = normals[other as usize];
                    let smooth = self.faces[other as usize].group == face.group && normal.dot(own) > limit;
                    if smooth || other as usize == index {
                        sum += normal * angle;
                    }
                }
                // Adding zero turns −0 into +0, so that equal normals have equal bits.
                let normal = (sum.normalize_or(own) + DVec3::ZERO).to_array().map(|c| c as f32);
                let uv = face.uvs.get(i).map_or([0.0; 2], |uv| uv.to_array().map(|c| c as f32));
                let bits = [normal[0], normal[1], normal[2], uv[0], uv[1]].map(f32::to_bits);
                corners.push(*known.entry((corner, bits)).or_insert_with(|| {
                    let position = self.positions[corner as usize];
                    result.positions.push(position.to_array().map(|c| c as f32));
                    result.normals.push(normal);
                    result.uvs.push(uv);
                    result.positions.len() as u32 - 1
                }));
            }
            result.faces.push(corners);
        }
        if self.faces.iter().all(|f| f.uvs.is_empty()) {
            result.uvs.clear();
        }
        result
    }

    /// The mesh without normals and texture coordinates, to be rendered flat.
    pub fn flat(&self) -> Polygons {
        Polygons {
            positions: self.positions.iter().map(|p| p.to_array().map(|c| c as f32)).collect(),
            faces: self.faces.iter().map(|f| f.corners.clone()).collect(),
            ..Polygons::default()
        }
    }
}

/// A finished mesh, as a PLY file stores it.
#[derive(Clone, Debug, Default)]
pub struct Polygons {
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// One for each vertex, or empty.
    pub normals: Vec<[f32; 3]>,
    /// One for each vertex, v upwards; or empty.
    pub uvs: Vec<[f32; 2]>,
    /// Polygons of up to 255 corners.
    pub faces: Vec<Vec<u32>>,
}

impl Polygons {
    /// The number of triangles that a renderer makes of it.
    pub fn triangle_count(&self) -> usize {
        self.faces.iter().map(|f| f.len() - 2).sum()
    }

    /// Multiplies all lengths by `factor`: the mechanical parts are drawn in millimetres.
    pub fn scaled(mut self, factor: f64) -> Polygons {
        for p in &mut self.positions {
            *p = p.map(|c| (f64::from(c) * factor) as f32);
        }
        self
    }

    /// Writes a binary little-endian PLY file.
    pub fn save(&self, path: &Path) -> std::io::Result<()> {
        let mut header = format!(
            "ply\nformat binary_little_endian 1.0\ncomment made by rayfront's generate-assets\n\
             element vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
            self.positions.len()
        );
        if !self.normals.is_empty() {
            header += "property float nx\nproperty float ny\nproperty float nz\n";
        }
        if !self.uvs.is_empty() {
            header += "property float u\nproperty float v\n";
        }
        header += &format!(
            "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.faces.len()
        );
        let mut bytes = header.into_bytes();
        for (i, position) in self.positions.iter().enumerate() {
            let normal = self.normals.get(i).map_or(&[][..], |n| &n[..]);
            let uv = self.uvs.get(i).map_or(&[][..], |uv| &uv[..]);
            for value in position.iter().chain(normal).chain(uv) {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
        }
        for face in &self.faces {
            bytes.push(u8::try_from(face.len()).expect("polygons stay below 256 corners"));
            for &corner in face {
                bytes.extend_from_slice(&(corner as i32).to_le_bytes());
            }
        }
        std::fs::File::create(path)?.write_all(&bytes)
    }
}
