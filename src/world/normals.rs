//! Shading normals worked out from faces.

use crate::math::{DVec3, Vec3};

/// Sums of faces' areas as vectors, one sum for each of the vertices that get a normal.
#[derive(Default)]
pub(crate) struct AreaNormals(Vec<DVec3>);

impl AreaNormals {
    /// Adds a face to the sum `place`; the sums before it exist then, too.
    pub(crate) fn add(&mut self, place: usize, area: DVec3) {
        if self.0.len() <= place {
            self.0.resize(place + 1, DVec3::ZERO);
        }
        self.0[place] += area;
    }

    /// The normals of all sums, of length 1; 0, which means flat shading, where the areas cancel out.
    pub(crate) fn normals(&self) -> impl Iterator<Item = Vec3> {
        self.0.iter().map(|sum| sum.normalize_or_zero().as_vec3())
    }
}

/// Twice the area of a polygon, along its normal (Newell's method).
pub(crate) fn area_vector(corners: impl ExactSizeIterator<Item = Vec3> + Clone) -> DVec3 {
    let Some(origin) = corners.clone().next() else { return DVec3::ZERO };
    // Differences from a corner lose no digits far from the origin.
    let from = move |corner: Vec3| corner.as_dvec3() - origin.as_dvec3();
    let next = corners.clone().skip(1).map(from);
    corners.map(from).zip(next).fold(DVec3::ZERO, |sum, (a, b)| sum + a.cross(b))
}

/// The unit normals of vertices from the triangles around them, each weighted by its area. A vertex without area around
/// it gets zero. Vertices of triangles must be within `positions`.
pub(crate) fn smooth_normals(positions: &[Vec3], triangles: impl IntoIterator<Item = [u32; 3]>) -> Vec<Vec3> {
    let mut sums = AreaNormals(vec![DVec3::ZERO; positions.len()]);
    for triangle in triangles {
        let area = area_vector(triangle.iter().map(|vertex| positions[*vertex as usize]));
        if area.is_finite() {
            triangle.iter().for_each(|vertex| sums.add(*vertex as usize, area));
        }
    }
    sums.normals().collect()
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

    #[test]
    fn area_vectors_have_the_area_and_side_of_polygons() {
        let shift = Vec3::new(1e6, -3e5, 7e5);
        let square = [Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 3.0, 0.0), Vec3::Y * 3.0].map(|p| p + shift);
        assert_eq!(area_vector(square.iter().copied()), DVec3::Z * 12.0);
        assert_eq!(area_vector(square.iter().rev().copied()), DVec3::Z * -12.0);
        assert_eq!(area_vector(square[..2].iter().copied()), DVec3::ZERO);
        assert_eq!(area_vector([].into_iter()), DVec3::ZERO);
    }

    #[test]
    fn larger_faces_count_more() {
        let mut sums = AreaNormals::default();
        sums.add(1, DVec3::Z * 3.0);
        sums.add(1, DVec3::X * 4.0);
        let normals: Vec<Vec3> = sums.normals().collect();
        assert_eq!(normals, [Vec3::ZERO, Vec3::new(0.8, 0.0, 0.6)]);
    }
}
