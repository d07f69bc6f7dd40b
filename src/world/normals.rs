//! Shading normals worked out from triangles.

use crate::math::{DVec3, Vec3};

/// The unit normals of vertices from the triangles around them, each weighted by its area. A vertex without area around
/// it gets zero. Vertices of triangles must be within `positions`.
pub(crate) fn smooth_normals(positions: &[Vec3], triangles: impl IntoIterator<Item = [u32; 3]>) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize].as_dvec3());
        // Its length is twice the area.
        let normal = (b - a).cross(c - a);
        if normal.is_finite() {
            triangle.iter().for_each(|vertex| sums[*vertex as usize] += normal);
        }
    }
    sums.into_iter().map(|sum| sum.normalize_or_zero().as_vec3()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_an_edge_lean_towards_the_larger_triangle() {
        // Two triangles along the z axis: one of area 1/2 that faces up, one of area 1 that faces right.
        let positions = [Vec3::ZERO, Vec3::Z, Vec3::NEG_X, Vec3::new(0.0, -2.0, 0.0), Vec3::ONE];
        let normals = smooth_normals(&positions, [[0, 1, 2], [0, 3, 1]]);
        let lengths = [1.0, 2.0].map(|weight: f32| weight / 5.0f32.sqrt());
        for shared in [normals[0], normals[1]] {
            let found = [shared.y.abs(), shared.x.abs()];
            assert!(found.iter().zip(lengths).all(|(a, b)| (a - b).abs() < 1e-6), "{shared}");
        }
        assert_eq!((normals[2].abs(), normals[3].abs()), (Vec3::Y, Vec3::X));
        assert_eq!(normals[4], Vec3::ZERO, "no triangle uses it");
    }

    #[test]
    fn tiny_triangles_have_normals_and_flat_ones_have_none() {
        let tiny = [Vec3::ZERO, Vec3::X * 1e-30, Vec3::Y * 1e-30];
        assert_eq!(smooth_normals(&tiny, [[0, 1, 2]]), [Vec3::Z; 3]);
        assert_eq!(smooth_normals(&[Vec3::X; 3], [[0, 1, 2]]), [Vec3::ZERO; 3]);
    }
}
