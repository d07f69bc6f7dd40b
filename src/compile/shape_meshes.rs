//! The triangles of flat shapes.

use crate::math::{Vec2, Vec3};
use crate::world::{Mesh, Shape};

/// The triangles of a flat shape, with its texture coordinates; none of other shapes.
pub(super) fn flat_mesh(shape: &Shape) -> Mesh {
    let Some((origin, corners)) = shape.flat_corners() else { return Mesh::default() };
    let flat = fan_mesh(&corners);
    match shape {
        Shape::Triangle { normals, uvs, .. } => Mesh {
            normals: normals.map_or_else(Vec::new, |n| n.to_vec()),
            uvs: uvs.unwrap_or([Vec2::ZERO, Vec2::X, Vec2::Y]).to_vec(),
            origin,
            ..flat
        },
        _ => Mesh { uvs: plane_uvs(&corners), origin, ..flat },
    }
}

/// The projections of each corner on the two edges that meet in the first one, divided by the edges' lengths.
fn plane_uvs(corners: &[Vec3]) -> Vec<Vec2> {
    let [a, b, _, d] = [0, 1, 2, 3].map(|at| corners[at].as_dvec3());
    let (u_edge, v_edge) = (b - a, d - a);
    let project = |p: &Vec3| {
        let q = p.as_dvec3() - a;
        Vec2::new(
            (q.dot(u_edge) / u_edge.length_squared()) as f32,
            (q.dot(v_edge) / v_edge.length_squared()) as f32,
        )
    };
    corners.iter().map(project).collect()
}

/// A convex polygon as a fan of triangles.
pub(super) fn fan_mesh(corners: &[Vec3]) -> Mesh {
    let triangles = Shape::fan(corners.len()).collect();
    Mesh { positions: corners.to_vec(), triangles, ..Mesh::default() }
}
