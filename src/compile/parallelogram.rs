//! Pairs of triangles that make a parallelogram.

use crate::math::Vec3;
use crate::scene::Geometry;

/// A corner and two edges of the parallelogram that a triangle and the next one make, if they do: one emitter is
/// sampled better than two. The edges' cross product points to the side of `front`.
pub(super) fn parallelogram(geometry: &Geometry, index: usize, front: Vec3) -> Option<[Vec3; 3]> {
    let place = |v: u32| Vec3::from_array(geometry.positions[v as usize]);
    let [one, other] = [index, index + 1].map(|i| geometry.triangles[i].map(place));
    for k in 0..3 {
        // The first triangle's corner that is opposite to the edge, if they share it.
        let (corner, left, right) = (one[k], one[(k + 1) % 3], one[(k + 2) % 3]);
        for j in 0..3 {
            let (far, a, b) = (other[j], other[(j + 1) % 3], other[(j + 2) % 3]);
            if [a, b] == [right, left]
                && (left + right - corner - far).length() <= 1e-6 * (left - right).length()
            {
                let (e1, e2) = (left - corner, right - corner);
                return Some(if e1.cross(e2).dot(front) > 0.0 { [corner, e1, e2] } else { [corner, e2, e1] });
            }
        }
    }
    None
}
