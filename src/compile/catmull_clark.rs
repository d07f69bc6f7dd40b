//! Subdivision of faces with any number of corners into quadrilaterals (Catmull and Clark, "Recursively generated B-spline
//! surfaces on arbitrary topological meshes", 1978; creases after DeRose and others, "Subdivision surfaces in character
//! animation", 1998).

use std::collections::HashMap;

use smallvec::SmallVec;

use super::modifiers::{MeshPoints, between, key};
use crate::math::DVec3;
use crate::world::Mesh;

/// The vertices of a face, around it.
type FaceVertices = SmallVec<[u32; 4]>;

/// An edge between two places.
struct FaceEdge {
    ends: [u32; 2],
    faces: u32,
    /// The sum of the middles of its faces.
    middles: DVec3,
    /// The unit normal of the first face.
    normal: DVec3,
    is_sharp: bool,
}

/// The faces that pairs of triangles were cut from, with their materials if there are any.
fn faces(mesh: &Mesh) -> (Vec<FaceVertices>, Vec<usize>) {
    let (mut faces, mut firsts) = (Vec::new(), Vec::new());
    let mut at = 0;
    let material = |triangle: usize| mesh.triangle_materials.get(triangle);
    while let Some(&[a, b, c]) = mesh.triangles.get(at) {
        let mut face = FaceVertices::from_slice(&[a, b, c]);
        firsts.push(at);
        if let Some(&[first, second, d]) = mesh.triangles.get(at + 1)
            && (first, second) == (a, c)
            && material(at) == material(at + 1)
        {
            face.push(d);
            at += 1;
        }
        faces.push(face);
        at += 1;
    }
    (faces, firsts)
}

/// A mesh whose faces are split into quadrilaterals, several times; smoothed if there is a crease angle. Its normals are
/// those of the old mesh.
pub(super) fn subdivided(mesh: &Mesh, levels: u32, crease: Option<f32>) -> Mesh {
    let (mut faces, firsts) = faces(mesh);
    let mut materials: Vec<_> =
        firsts.iter().filter_map(|first| mesh.triangle_materials.get(*first).copied()).collect();
    let mut mesh = mesh.clone();
    let mut points = MeshPoints::new(&mesh);
    let mut sharp: Option<Vec<[u32; 2]>> = None;
    for _ in 0..levels {
        let corners = faces.iter().map(SmallVec::len);
        materials =
            materials.iter().zip(corners).flat_map(|(own, count)| std::iter::repeat_n(*own, count)).collect();
        (mesh, points, faces, sharp) = split(&mesh, &points, &faces, crease, sharp);
    }
    let fans = faces.iter().map(|face| face.len() - 2);
    mesh.triangle_materials =
        materials.iter().zip(fans).flat_map(|(own, count)| std::iter::repeat_n(*own, count)).collect();
    let fan =
        |face: &FaceVertices| (2..face.len()).map(|at| [face[0], face[at - 1], face[at]]).collect::<Vec<_>>();
    mesh.triangles = faces.iter().flat_map(fan).collect();
    mesh
}

type SplitMesh = (Mesh, MeshPoints, Vec<FaceVertices>, Option<Vec<[u32; 2]>>);

/// One step of [`subdivided`]. `sharp` are the sharp edges, once they are known.
fn split(
    mesh: &Mesh,
    points: &MeshPoints,
    faces: &[FaceVertices],
    crease: Option<f32>,
    sharp: Option<Vec<[u32; 2]>>,
) -> SplitMesh {
    let at = |vertex: u32| points.positions[points.of[vertex as usize] as usize];
    let middle =
        |face: &FaceVertices| face.iter().map(|vertex| at(*vertex)).sum::<DVec3>() / face.len() as f64;
    let middles: Vec<DVec3> = faces.iter().map(middle).collect();
    let (numbers, mut edges) = edges(points, faces, &middles, crease.filter(|_| sharp.is_none()));
    for [a, b] in sharp.iter().flatten() {
        if let Some(number) = numbers.get(&key(*a, *b)) {
            edges[*number as usize].is_sharp = true;
        }
    }
    // A boundary, and a place where more than two faces meet, is sharp, too.
    edges.iter_mut().for_each(|edge| edge.is_sharp |= edge.faces != 2);
    let mut positions = match crease {
        Some(_) => smoothed(points, faces, &edges, &middles),
        None => points.positions.clone(),
    };
    let first = positions.len() as u32;
    positions.extend(edges.iter().map(|edge| {
        let ends = edge.ends.map(|end| points.positions[end as usize]);
        let sum = ends[0] + ends[1];
        if crease.is_some() && !edge.is_sharp { (sum + edge.middles) * 0.25 } else { sum * 0.5 }
    }));
    let inner = positions.len() as u32;
    positions.extend(&middles);
    let mut children = Vec::new();
    for (number, edge) in edges.iter().enumerate().filter(|(_, edge)| edge.is_sharp && crease.is_some()) {
        children.extend(edge.ends.map(|end| [end, first + number as u32]));
    }
    let mut out = Mesh { triangles: Vec::new(), triangle_materials: Vec::new(), ..mesh.clone() };
    let mut of = points.of.clone();
    let mut known: HashMap<[u32; 2], u32> = HashMap::new();
    let mut smaller = Vec::with_capacity(4 * faces.len());
    for (number, face) in faces.iter().enumerate() {
        let count = face.len();
        let mut on_edges = FaceVertices::new();
        for corner in 0..count {
            let [a, b] = [face[corner], face[(corner + 1) % count]];
            on_edges.push(*known.entry(key(a, b)).or_insert_with(|| {
                of.push(first + numbers[&key(points.of[a as usize], points.of[b as usize])]);
                between(&mut out, mesh, &[a, b])
            }));
        }
        of.push(inner + number as u32);
        let center = between(&mut out, mesh, face);
        for corner in 0..count {
            let before = on_edges[(corner + count - 1) % count];
            smaller.push(FaceVertices::from_slice(&[face[corner], on_edges[corner], center, before]));
        }
    }
    out.positions = of.iter().map(|point| positions[*point as usize].as_vec3()).collect();
    (out, MeshPoints { of, positions }, smaller, Some(children))
}

/// The edges of faces, and their numbers. Those at which faces meet at more than the crease angle are sharp.
fn edges(
    points: &MeshPoints,
    faces: &[FaceVertices],
    middles: &[DVec3],
    crease: Option<f32>,
) -> (HashMap<[u32; 2], u32>, Vec<FaceEdge>) {
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
    let mut edges: Vec<FaceEdge> = Vec::new();
    let cos = libm::cos(f64::from(crease.unwrap_or(std::f32::consts::PI)));
    for (face, middle) in faces.iter().zip(middles) {
        let places: FaceVertices = face.iter().map(|vertex| points.of[*vertex as usize]).collect();
        let at = |corner: usize| points.positions[places[corner % places.len()] as usize] - *middle;
        let normal = (0..places.len()).map(|corner| at(corner).cross(at(corner + 1))).sum::<DVec3>();
        let normal = normal.normalize_or_zero();
        for corner in 0..places.len() {
            let ends = key(places[corner], places[(corner + 1) % places.len()]);
            let number = *numbers.entry(ends).or_insert(edges.len() as u32);
            if number == edges.len() as u32 {
                edges.push(FaceEdge { ends, faces: 0, middles: DVec3::ZERO, normal, is_sharp: false });
            }
            let edge = &mut edges[number as usize];
            edge.faces += 1;
            edge.middles += *middle;
            edge.is_sharp |= crease.is_some() && edge.normal.dot(normal) < cos - 1e-6;
        }
    }
    (numbers, edges)
}

/// The new places of the old vertices.
fn smoothed(
    points: &MeshPoints,
    faces: &[FaceVertices],
    edges: &[FaceEdge],
    middles: &[DVec3],
) -> Vec<DVec3> {
    let count = points.positions.len();
    // Sums and numbers by place: middles of faces, other ends of edges, and of sharp ones.
    let mut around = vec![[(DVec3::ZERO, 0u32); 3]; count];
    let mut add = |place: u32, kind: usize, point: DVec3| {
        let (sum, number) = &mut around[place as usize][kind];
        (*sum, *number) = (*sum + point, *number + 1);
    };
    for (face, middle) in faces.iter().zip(middles) {
        face.iter().for_each(|vertex| add(points.of[*vertex as usize], 0, *middle));
    }
    for edge in edges {
        for [from, to] in [edge.ends, [edge.ends[1], edge.ends[0]]] {
            let other = points.positions[to as usize];
            add(from, 1, other);
            if edge.is_sharp {
                add(from, 2, other);
            }
        }
    }
    let place = |(position, [faces, ends, sharp]): (&DVec3, &[(DVec3, u32); 3])| match sharp.1 {
        0 | 1 if faces.1 > 0 && ends.1 > 0 => {
            let n = f64::from(ends.1);
            // F + 2 R + (n − 3) P over n, where R is the mean of the edges' middles.
            let middles = (*position + ends.0 / n) * 0.5;
            (faces.0 / f64::from(faces.1) + 2.0 * middles + *position * (n - 3.0)) / n
        }
        2 => *position * 0.75 + sharp.0 * 0.125,
        // A corner of creases.
        _ => *position,
    };
    points.positions.iter().zip(&around).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Vec2, Vec3};
    use crate::world::MaterialId;

    /// A cube of quadrilaterals, as shapes and files cut them.
    fn cube() -> Mesh {
        let corner = |i: usize| Vec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -1.0 } else { 1.0 }));
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Mesh { positions: (0..8).map(corner).collect(), triangles, ..Mesh::default() }
    }

    #[test]
    fn first_step_of_a_cube_matches_the_rules() {
        let mesh = subdivided(&cube(), 1, Some(std::f32::consts::PI));
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (26, 48));
        // Corners: (F + 2 R + 0) / 3 with F = (1, 1, 1) / 3 and R = (2, 2, 2) / 3, so 5 / 9.
        let close = |point: &Vec3, wanted: f32| (point.abs() - Vec3::splat(wanted)).length() < 1e-6;
        assert!(mesh.positions[..8].iter().all(|point| close(point, 5.0 / 9.0)), "{:?}", mesh.positions);
        // Edges: (two ends + two middles of faces) / 4 = (0, 3, 3) / 4; faces: their middles.
        let count = |wanted: f32, zeros: usize| {
            let is = |point: &&Vec3| {
                let all = point.to_array();
                all.iter().filter(|c| c.abs() < 1e-6).count() == zeros
                    && all.iter().all(|c| c.abs() < 1e-6 || (c.abs() - wanted).abs() < 1e-6)
            };
            mesh.positions.iter().filter(is).count()
        };
        assert_eq!((count(0.75, 1), count(1.0, 2)), (12, 6));
    }

    #[test]
    fn creases_keep_a_cube_and_grids_stay_flat() {
        let sharp = subdivided(&cube(), 3, Some(0.5));
        let on_cube = |point: &Vec3| (point.abs().max_element() - 1.0).abs() < 1e-6;
        assert!(sharp.positions.iter().all(on_cube));
        let plain = subdivided(&cube(), 3, None);
        assert!(plain.positions.iter().all(on_cube) && plain.triangles.len() == 12 << 6);
        // A flat grid with texture coordinates: these stay where they are, and its border keeps its lines.
        let positions: Vec<Vec3> = (0..9).map(|i| Vec3::new((i % 3) as f32, 0.0, (i / 3) as f32)).collect();
        let quads = [0u32, 1, 3, 4].map(|i| [i, i + 3, i + 4, i + 1]);
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let uvs = positions.iter().map(|point| Vec2::new(point.x, point.z)).collect();
        let triangle_materials = (0..8).map(|i| MaterialId(i / 2)).collect();
        let grid = Mesh { positions, uvs, triangles, triangle_materials, ..Mesh::default() };
        let fine = subdivided(&grid, 2, Some(std::f32::consts::PI));
        assert_eq!((fine.triangles.len(), fine.triangle_materials.len()), (8 * 16, 8 * 16));
        for (point, uv) in fine.positions.iter().zip(&fine.uvs) {
            assert!(point.y == 0.0 && (0.0..=2.0).contains(&point.x) && (0.0..=2.0).contains(&point.z));
            assert!((0.0..=2.0).contains(&uv.x) && (Vec2::new(point.x, point.z) - *uv).length() < 0.3);
        }
        for (triangle, material) in fine.triangles.iter().zip(&fine.triangle_materials) {
            let middle: Vec3 =
                triangle.iter().map(|vertex| fine.positions[*vertex as usize]).sum::<Vec3>() / 3.0;
            let quad = u32::from(middle.x > 1.0) + 2 * u32::from(middle.z > 1.0);
            assert_eq!(material.0, quad, "{middle}");
        }
    }

    #[test]
    fn triangles_that_form_no_quadrilateral_become_three() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let fine = subdivided(&mesh, 2, Some(std::f32::consts::PI));
        // The first two triangles form a quadrilateral, the others none; a second pass divides each face by 4.
        assert_eq!(fine.triangles.len(), (4 + 3 + 3) * 4 * 2);
        let inside = |point: &Vec3| point.min_element() >= 0.0 && point.element_sum() <= 1.0 + 1e-6;
        assert!(fine.positions.iter().all(inside));
    }
}
