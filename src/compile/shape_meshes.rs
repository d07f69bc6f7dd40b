//! The triangles of flat shapes.

use crate::math::{Vec2, Vec3};
use crate::world::{Mesh, Shape};

/// The triangles of a flat shape, with its texture coordinates; none of other shapes.
pub(super) fn flat_mesh(shape: &Shape) -> Mesh {
    match shape {
        Shape::Triangle { vertices, normals, uvs } => triangle_mesh(*vertices, *normals, *uvs),
        Shape::Plane { corners } => plane_mesh(*corners),
        Shape::Sphere { .. } | Shape::Mesh(_) => Mesh::default(),
    }
}

fn triangle_mesh(vertices: [Vec3; 3], normals: Option<[Vec3; 3]>, uvs: Option<[Vec2; 3]>) -> Mesh {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
    Mesh {
        positions: vertices.to_vec(),
        normals: normals.map_or_else(Vec::new, |n| n.to_vec()),
        uvs: uvs.unwrap_or(corners).to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    }
}

/// Two triangles. Texture coordinates are projections of each corner on the two edges that meet in the first one,
/// divided by the edges' lengths.
fn plane_mesh(corners: [Vec3; 4]) -> Mesh {
    let [a, b, _, d] = corners.map(|c| c.as_dvec3());
    let (u_edge, v_edge) = (b - a, d - a);
    let project = |p: Vec3| {
        let q = p.as_dvec3() - a;
        Vec2::new(
            (q.dot(u_edge) / u_edge.length_squared()) as f32,
            (q.dot(v_edge) / v_edge.length_squared()) as f32,
        )
    };
    Mesh { uvs: corners.map(project).to_vec(), ..fan_mesh(&corners) }
}

/// A convex polygon as a fan of triangles.
pub(super) fn fan_mesh(corners: &[Vec3]) -> Mesh {
    let triangles = Shape::fan(corners.len()).collect();
    Mesh { positions: corners.to_vec(), triangles, ..Mesh::default() }
}
