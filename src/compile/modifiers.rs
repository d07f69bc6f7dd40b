//! Changes of meshes: subdivision, displacement, normals.

use std::collections::HashMap;

use super::catmull_clark;
use crate::error::CompileError;
use crate::math::{Color, DVec3, Rgb, Vec2, Vec3, Vector};
use crate::memory;
use crate::scene::Textures;
use crate::scene::material::ScalarParam;
use crate::shading::texture_lookup::{Coordinates, Texel, scalar};
use crate::world::{Mesh, Modifier, Modifiers, SubdivisionScheme};

/// The most triangles of a modified mesh.
const MOST: u64 = 1 << 28;
/// Bytes of memory for each triangle of a mesh that is subdivided.
const BYTES: u64 = 400;

/// Returns a mesh after all its modifiers. Errors: it would become too large.
pub(super) fn modified(
    mesh: &Mesh,
    modifiers: &Modifiers,
    textures: &Textures,
) -> Result<Mesh, CompileError> {
    let mut mesh = Mesh { tangents: Vec::new(), ..mesh.clone() };
    for modifier in &modifiers.0 {
        match modifier {
            Modifier::Subdivide { levels, scheme, smooth, crease } => {
                mesh = subdivided(&mesh, *levels, *scheme, smooth.then_some(*crease))?;
            }
            Modifier::Displace { texture: Some((texture, channel)), height_m, midlevel } => {
                let heights = ScalarParam { factor: 1.0, texture: texture.0, channel: channel.index() };
                displace(&mut mesh, |mesh, vertex| {
                    let uv = mesh.uvs.get(vertex).copied().unwrap_or_default();
                    let uvs = [uv, mesh.uvs1.get(vertex).copied().unwrap_or(uv)];
                    let at = Coordinates {
                        object: Vector::splat(mesh.positions[vertex]),
                        vertex: Texel {
                            color: Color::splat(mesh.colors.get(vertex).copied().unwrap_or(Rgb::WHITE)),
                            alpha: mesh.alphas.get(vertex).copied().unwrap_or(1.0),
                        },
                        ..Coordinates::point(uvs.map(|uv| (uv.x, uv.y)))
                    };
                    (scalar(&heights, textures, &at, true) - midlevel) * height_m
                });
            }
            Modifier::Displace { texture: None, .. } => {}
            Modifier::Normals { smooth } => mesh = with_normals(&mesh, *smooth),
        }
    }
    Ok(mesh)
}

/// A sphere of triangles, with normals and the texture coordinates of spheres.
pub(super) fn ball(radius: f32) -> Mesh {
    const ROWS: u32 = 64;
    let mut mesh = Mesh::default();
    let columns = 2 * ROWS;
    let turn = |part: f64| (libm::sin(part * std::f64::consts::TAU), libm::cos(part * std::f64::consts::TAU));
    for row in 0..=ROWS {
        let v = f64::from(row) / f64::from(ROWS);
        let (sin, cos) = turn(0.5 * v);
        for column in 0..=columns {
            let u = f64::from(column) / f64::from(columns);
            let (across, along) = turn(if column == columns { 0.0 } else { u });
            let normal = DVec3::new(-sin * along, cos, sin * across);
            mesh.positions.push((normal * f64::from(radius)).as_vec3());
            mesh.normals.push(normal.as_vec3());
            mesh.uvs.push(Vec2::new(u as f32, v as f32));
            if row < ROWS && column < columns {
                let at = row * (columns + 1) + column;
                let below = at + columns + 1;
                // The poles are points.
                if row > 0 {
                    mesh.triangles.push([at, below, at + 1]);
                }
                if row + 1 < ROWS {
                    mesh.triangles.push([at + 1, below, below + 1]);
                }
            }
        }
    }
    let end = mesh.positions.len() - columns as usize - 1;
    mesh.positions[..=columns as usize].fill(Vec3::Y * radius);
    mesh.positions[end..].fill(Vec3::NEG_Y * radius);
    mesh
}

/// The places of a mesh's vertices, of which several may be one place: seams of texture coordinates and of normals.
pub(super) struct MeshPoints {
    /// The place of each vertex.
    pub of: Vec<u32>,
    pub positions: Vec<DVec3>,
}

impl MeshPoints {
    pub fn new(mesh: &Mesh) -> MeshPoints {
        let mut known = HashMap::with_capacity(mesh.positions.len());
        let mut positions = Vec::new();
        let mut number = |position: &Vec3| {
            // 0 and −0 are one place.
            *known.entry((*position + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert_with(|| {
                positions.push(position.as_dvec3());
                positions.len() as u32 - 1
            })
        };
        MeshPoints { of: mesh.positions.iter().map(&mut number).collect(), positions }
    }

    /// The triangles as places; none of those without area.
    fn faces<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = [u32; 3]> + 'a {
        mesh.triangles.iter().map(|triangle| triangle.map(|vertex| self.of[vertex as usize]))
    }

    /// Twice the area of each face, along its normal.
    fn areas(&self, mesh: &Mesh) -> Vec<DVec3> {
        let area = |face: [u32; 3]| {
            let [a, b, c] = face.map(|point| self.positions[point as usize]);
            (b - a).cross(c - a)
        };
        self.faces(mesh).map(area).collect()
    }
}

/// An edge between two places.
struct Edge {
    ends: [u32; 2],
    /// The places across the edge in its first two faces.
    across: [u32; 2],
    faces: u32,
    /// The area vector of the first face.
    normal: DVec3,
    is_sharp: bool,
}

/// The key of an edge.
pub(super) fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// A mesh whose triangles are split into four, several times: with a crease angle, smoothed (Loop, "Smooth Subdivision
/// Surfaces Based on Triangles", 1987; creases after Hoppe and others, "Piecewise Smooth Surface Reconstruction", 1994).
fn subdivided(
    mesh: &Mesh,
    levels: u32,
    scheme: SubdivisionScheme,
    crease: Option<f32>,
) -> Result<Mesh, CompileError> {
    let count = (mesh.triangles.len() as u64).saturating_mul(1 << (2 * levels));
    // A triangle becomes three quadrilaterals.
    let count = if scheme == SubdivisionScheme::Loop { count } else { count.saturating_mul(3) / 2 };
    if count > MOST {
        return Err(CompileError::TooLarge(format!(
            "{} subdivided {levels} times has {count} triangles; the most is {MOST}",
            mesh.name
        )));
    }
    let _claim = memory::reserve(format_args!("{count} triangles of a subdivided mesh"), count * BYTES)?;
    let mut mesh = mesh.clone();
    let mut sharp: Option<Vec<[u32; 2]>> = None;
    let mut points = MeshPoints::new(&mesh);
    match scheme {
        SubdivisionScheme::CatmullClark => mesh = catmull_clark::subdivided(&mesh, levels, crease),
        SubdivisionScheme::Loop => {
            for _ in 0..levels {
                (mesh, points, sharp) = split(&mesh, &points, crease, sharp);
            }
        }
    }
    if let (Some(crease), true) = (crease, levels > 0) {
        mesh = with_normals(&mesh, crease);
    }
    Ok(mesh)
}

/// One step of [`subdivided`]. `sharp` are the sharp edges, once they are known.
fn split(
    mesh: &Mesh,
    points: &MeshPoints,
    crease: Option<f32>,
    sharp: Option<Vec<[u32; 2]>>,
) -> (Mesh, MeshPoints, Option<Vec<[u32; 2]>>) {
    let areas = points.areas(mesh);
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
    let mut edges: Vec<Edge> = Vec::new();
    for (face, area) in points.faces(mesh).zip(&areas) {
        for corner in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|step| face[(corner + step) % 3]);
            let next = edges.len() as u32;
            let number = *numbers.entry(key(a, b)).or_insert(next);
            if number == next {
                let normal = *area;
                edges.push(Edge { ends: key(a, b), across: [c, c], faces: 1, normal, is_sharp: false });
                continue;
            }
            let edge = &mut edges[number as usize];
            edge.faces += 1;
            edge.across[1] = c;
            if let (None, Some(crease)) = (&sharp, crease) {
                let cos = libm::cos(f64::from(crease));
                let turn = edge.normal.normalize_or_zero().dot(area.normalize_or_zero());
                edge.is_sharp |= turn < cos - 1e-6;
            }
        }
    }
    for [a, b] in sharp.iter().flatten() {
        if let Some(number) = numbers.get(&key(*a, *b)) {
            edges[*number as usize].is_sharp = true;
        }
    }
    // A boundary, and a place where more than two faces meet, is sharp, too.
    edges.iter_mut().for_each(|edge| edge.is_sharp |= edge.faces != 2);
    let at = |point: u32| points.positions[point as usize];
    let mut positions = match crease {
        Some(_) => smoothed(points, &edges),
        None => points.positions.clone(),
    };
    let first = positions.len() as u32;
    positions.extend(edges.iter().map(|edge| {
        let ends = at(edge.ends[0]) + at(edge.ends[1]);
        match crease {
            Some(_) if !edge.is_sharp => ends * 0.375 + (at(edge.across[0]) + at(edge.across[1])) * 0.125,
            _ => ends * 0.5,
        }
    }));
    let mut children = Vec::new();
    if crease.is_some() {
        for (number, edge) in edges.iter().enumerate().filter(|(_, edge)| edge.is_sharp) {
            let middle = first + number as u32;
            children.extend(edge.ends.map(|end| [end, middle]));
        }
    }
    // Vertices: the old ones in their new places, and one in the middle of each different pair.
    let mut out = Mesh { triangles: Vec::new(), triangle_materials: Vec::new(), ..mesh.clone() };
    let mut of = points.of.clone();
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    for triangle in &mesh.triangles {
        let mut middle = [0; 3];
        for (corner, middle) in middle.iter_mut().enumerate() {
            let [a, b] = [triangle[corner], triangle[(corner + 1) % 3]];
            *middle = *middles.entry(key(a, b)).or_insert_with(|| {
                let edge = numbers[&key(points.of[a as usize], points.of[b as usize])];
                of.push(first + edge);
                between(&mut out, mesh, &[a, b])
            });
        }
        let ([a, b, c], [ab, bc, ca]) = (*triangle, middle);
        out.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    out.triangle_materials = mesh.triangle_materials.iter().flat_map(|material| [*material; 4]).collect();
    out.positions = of.iter().map(|point| positions[*point as usize].as_vec3()).collect();
    (out, MeshPoints { of, positions }, Some(children))
}

/// Adds a vertex in the middle of others, and returns its number; its position, for the time being that of the first,
/// follows.
pub(super) fn between(out: &mut Mesh, mesh: &Mesh, others: &[u32]) -> u32 {
    let part = 1.0 / others.len() as f32;
    let others = || others.iter().map(|vertex| *vertex as usize);
    if let Some(first) = others().next().and_then(|first| mesh.normals.get(first)) {
        let sum: Vec3 = others().map(|vertex| mesh.normals[vertex]).sum();
        out.normals.push(sum.normalize_or(*first));
    }
    let mean = |table: &[Vec2]| others().map(|vertex| table[vertex]).sum::<Vec2>() * part;
    if !mesh.uvs.is_empty() {
        out.uvs.push(mean(&mesh.uvs));
    }
    if !mesh.uvs1.is_empty() {
        out.uvs1.push(mean(&mesh.uvs1));
    }
    if !mesh.colors.is_empty() {
        let sum = others().fold(Rgb::BLACK, |sum, vertex| sum + mesh.colors[vertex]);
        out.colors.push(sum * part);
    }
    if !mesh.alphas.is_empty() {
        out.alphas.push(part * others().map(|vertex| mesh.alphas[vertex]).sum::<f32>());
    }
    out.positions.extend(others().next().map(|first| mesh.positions[first]));
    out.positions.len() as u32 - 1
}

/// The new places of the old vertices.
fn smoothed(points: &MeshPoints, edges: &[Edge]) -> Vec<DVec3> {
    let count = points.positions.len();
    let (mut sums, mut degrees) = (vec![DVec3::ZERO; count], vec![0u32; count]);
    let (mut sharp_sums, mut sharp) = (vec![DVec3::ZERO; count], vec![0u32; count]);
    for edge in edges {
        for [from, to] in [edge.ends, [edge.ends[1], edge.ends[0]]] {
            let (at, other) = (from as usize, points.positions[to as usize]);
            sums[at] += other;
            degrees[at] += 1;
            if edge.is_sharp {
                sharp_sums[at] += other;
                sharp[at] += 1;
            }
        }
    }
    let place = |(at, position): (usize, &DVec3)| match (sharp[at], degrees[at]) {
        (0 | 1, degree) if degree > 0 => {
            let cos = libm::cos(std::f64::consts::TAU / f64::from(degree));
            let part = 0.375 + 0.25 * cos;
            let weight = 0.625 - part * part;
            *position * (1.0 - weight) + sums[at] * (weight / f64::from(degree))
        }
        (2, _) => *position * 0.75 + sharp_sums[at] * 0.125,
        // A corner of creases.
        _ => *position,
    };
    points.positions.iter().enumerate().map(place).collect()
}

/// Moves vertices along their normals by a height, a function of the mesh and a vertex of it.
fn displace(mesh: &mut Mesh, height: impl Fn(&Mesh, usize) -> f32) {
    let points = MeshPoints::new(mesh);
    let mut normals = vec![DVec3::ZERO; points.positions.len()];
    for (face, area) in points.faces(mesh).zip(points.areas(mesh)) {
        face.iter().for_each(|point| normals[*point as usize] += area);
    }
    // Vertices at one place move by one height, or the surface would crack.
    let (mut heights, mut counts) = (vec![0.0f64; normals.len()], vec![0.0f64; normals.len()]);
    for (vertex, point) in points.of.iter().enumerate() {
        heights[*point as usize] += f64::from(height(mesh, vertex));
        counts[*point as usize] += 1.0;
    }
    for (vertex, point) in points.of.iter().enumerate() {
        let at = *point as usize;
        let along = normals[at].normalize_or_zero() * (heights[at] / counts[at]);
        mesh.positions[vertex] = (points.positions[at] + along).as_vec3();
    }
    let angle = if mesh.normals.is_empty() { 0.0 } else { std::f32::consts::PI };
    *mesh = with_normals(mesh, angle);
}

/// A mesh with normals of its own for each corner: means of the faces around it that face away by less than an angle,
/// by their areas. With an angle of 0, flat.
fn with_normals(mesh: &Mesh, angle: f32) -> Mesh {
    if angle <= 0.0 {
        return Mesh { normals: Vec::new(), ..mesh.clone() };
    }
    let points = MeshPoints::new(mesh);
    let areas = points.areas(mesh);
    let faces: Vec<[u32; 3]> = points.faces(mesh).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); points.positions.len()];
    for (number, face) in faces.iter().enumerate() {
        face.iter().for_each(|point| around[*point as usize].push(number as u32));
    }
    let units: Vec<DVec3> = areas.iter().map(|area| area.normalize_or_zero()).collect();
    let least = libm::cos(f64::from(angle)) - 1e-6;
    let mut out = Mesh { normals: Vec::new(), ..mesh.clone() };
    let mut known: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    let mut taken = vec![false; mesh.positions.len()];
    out.normals.resize(mesh.positions.len(), Vec3::ZERO);
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        for corner in 0..3 {
            let vertex = triangle[corner];
            let near = around[faces[number][corner] as usize].iter().map(|face| *face as usize);
            let near = near.filter(|face| units[*face].dot(units[number]) >= least);
            let normal = near.map(|face| areas[face]).sum::<DVec3>().normalize_or_zero().as_vec3();
            let bits = normal.to_array().map(f32::to_bits);
            let place = *known.entry((vertex, bits)).or_insert_with(|| {
                if !std::mem::replace(&mut taken[vertex as usize], true) {
                    out.normals[vertex as usize] = normal;
                    return vertex;
                }
                let added = between(&mut out, mesh, &[vertex]);
                out.normals.resize(added as usize, Vec3::ZERO);
                out.normals.push(normal);
                added
            });
            out.triangles[number][corner] = place;
        }
    }
    out.normals.truncate(out.positions.len());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOP: SubdivisionScheme = SubdivisionScheme::Loop;

    fn octahedron() -> Mesh {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let triangles =
            vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        Mesh { positions: axes.to_vec(), triangles, ..Mesh::default() }
    }

    fn volume(mesh: &Mesh) -> f64 {
        let corner = |vertex: u32| mesh.positions[vertex as usize].as_dvec3();
        mesh.triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0).sum()
    }

    fn area(mesh: &Mesh) -> f64 {
        MeshPoints::new(mesh).areas(mesh).iter().map(|area| 0.5 * area.length()).sum()
    }

    #[test]
    fn balls_are_closed_and_face_outwards() {
        let ball = ball(2.0);
        let whole = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        assert!((volume(&ball) / whole - 1.0).abs() < 2e-3, "{}", volume(&ball) / whole);
        let points = MeshPoints::new(&ball);
        let faces = ball.triangles.len() as i64;
        assert_eq!(points.positions.len() as i64 - 3 * faces / 2 + faces, 2, "Euler's formula");
    }

    #[test]
    fn plain_subdivision_keeps_the_shape_and_its_attributes() {
        let square = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            colors: vec![Rgb::BLACK, Rgb::WHITE, Rgb::WHITE, Rgb::BLACK],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_materials: vec![crate::world::MaterialId(3), crate::world::MaterialId(5)],
            ..Mesh::default()
        };
        let fine = subdivided(&square, 3, LOOP, None).unwrap();
        assert_eq!((fine.triangles.len(), fine.positions.len()), (128, 81));
        assert!((area(&fine) - 1.0).abs() < 1e-6);
        for (vertex, position) in fine.positions.iter().enumerate() {
            assert_eq!(fine.uvs[vertex], position.truncate());
            assert!((fine.colors[vertex].r - position.x).abs() < 1e-6);
        }
        let of = |material: u32| fine.triangle_materials.iter().filter(|id| id.0 == material).count();
        assert_eq!((of(3), of(5)), (64, 64));
    }

    #[test]
    fn smooth_subdivision_rounds_a_closed_mesh_and_keeps_it_closed() {
        let round = subdivided(&octahedron(), 4, LOOP, Some(std::f32::consts::PI)).unwrap();
        assert_eq!(round.triangles.len(), 8 << 8);
        let lengths: Vec<f32> = round.positions.iter().map(|position| position.length()).collect();
        let [least, most] = [f32::min, f32::max].map(|of| lengths.iter().copied().reduce(of).unwrap());
        assert!(least > 0.4 && most < 0.75 && most / least < 1.2, "{least} {most}");
        let points = MeshPoints::new(&round);
        assert_eq!(points.positions.len() as i64 - 3 * (8 << 8) / 2 + (8 << 8), 2, "Euler's formula");
        for (position, normal) in round.positions.iter().zip(&round.normals) {
            assert!(normal.dot(position.normalize()) > 0.97);
        }
    }

    #[test]
    fn creases_and_boundaries_stay_sharp() {
        // All edges of an octahedron turn by 70.5°.
        let sharp = subdivided(&octahedron(), 3, LOOP, Some(60f32.to_radians())).unwrap();
        assert!((volume(&sharp) - 4.0 / 3.0).abs() < 1e-5, "{}", volume(&sharp));
        // The boundary of a square: its corners are rounded, its edges stay straight lines in the plane.
        let square = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let fine = subdivided(&square, 3, LOOP, Some(std::f32::consts::PI)).unwrap();
        assert!(
            fine.positions.iter().all(|p| p.z == 0.0 && p.min_element() >= 0.0 && p.max_element() <= 1.0)
        );
    }

    #[test]
    fn normals_are_smooth_within_the_angle_and_flat_beyond() {
        let mesh = octahedron();
        let smooth = with_normals(&mesh, 80f32.to_radians());
        // Opposite faces at a corner turn by 109°: each of the four has a mean of its own, of three faces.
        assert_eq!(smooth.positions.len(), 24);
        let n = smooth.normals[smooth.triangles[0][0] as usize];
        assert!((n - Vec3::new(3.0, 1.0, 1.0).normalize()).length() < 1e-6, "{n}");
        let all = with_normals(&mesh, std::f32::consts::PI);
        assert_eq!(all.positions.len(), 6);
        assert!(all.normals.iter().zip(&all.positions).all(|(n, p)| (*n - *p).length() < 1e-6));
        let flat = with_normals(&mesh, 60f32.to_radians());
        assert_eq!((flat.positions.len(), flat.normals.len()), (24, 24));
        let n = flat.normals[flat.triangles[0][0] as usize];
        assert!((n - Vec3::splat(1.0 / 3f32.sqrt())).length() < 1e-6);
        assert!(with_normals(&mesh, 0.0).normals.is_empty());
    }

    #[test]
    fn displacement_moves_along_normals_without_cracks() {
        let mut ball = subdivided(&octahedron(), 3, LOOP, Some(std::f32::consts::PI)).unwrap();
        let before = ball.clone();
        displace(&mut ball, |_, _| 0.25);
        for (moved, still) in ball.positions.iter().zip(&before.positions) {
            assert!(((*moved - *still).length() - 0.25).abs() < 1e-6);
            assert!(moved.length() > still.length() + 0.24);
        }
        // A seam: two vertices at one place with different heights.
        let mut seam = octahedron();
        seam.positions.push(Vec3::X);
        seam.triangles[0][0] = 6;
        seam.uvs = (0..7).map(|vertex| Vec2::splat(vertex as f32)).collect();
        displace(&mut seam, |mesh, vertex| mesh.uvs[vertex].x);
        assert_eq!(seam.positions[0], seam.positions[6]);
        assert!((seam.positions[0] - Vec3::X * 4.0).length() < 1e-6);
    }
}
