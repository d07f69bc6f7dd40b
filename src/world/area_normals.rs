//! Smooth normals for vertices that have none: the mean over the faces around a vertex, weighted by area.

use crate::math::{DVec3, Vec3};

/// Sums of the faces' areas as vectors, one sum for each of the vertices that get a normal.
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

#[cfg(test)]
mod tests {
    use super::*;

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
