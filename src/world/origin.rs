//! Points that positions in single precision are relative to, where those relative to (0, 0, 0) would be coarse.

use crate::math::{DVec3, Vec3};

/// A position may be this many times as far from the origin as from the camera, or as its shape is large. The rounding
/// error is then 1/16,384 of that distance: a sixteenth of a pixel in an image of 1,000 pixels.
pub(crate) const FARTHEST: f64 = 1024.0;

/// Rounds a point to multiples of the largest power of two that is at most half of a length.
pub(crate) fn rounded(point: DVec3, length: f64) -> DVec3 {
    let step = libm::exp2(libm::floor(libm::log2(length)) - 1.0);
    (point / step).round() * step
}

/// True if single precision around (0, 0, 0) is coarse for a shape between two corners.
pub(crate) fn is_coarse(least: DVec3, most: DVec3) -> bool {
    least.abs().max(most.abs()).length() > FARTHEST * (most - least).length()
}

/// Returns an origin for a shape between two corners: (0, 0, 0) unless it is small and far from there.
pub(crate) fn between(least: DVec3, most: DVec3) -> DVec3 {
    let size = (most - least).length();
    let is_far = size > 0.0 && size.is_finite() && is_coarse(least, most);
    if is_far { rounded(0.5 * (least + most), size) } else { DVec3::ZERO }
}

/// Returns an origin for the points of one shape as [`between`] does, and the points relative to it.
pub(crate) fn split(points: &[DVec3]) -> (DVec3, Vec<Vec3>) {
    let finite = || points.iter().filter(|point| point.is_finite());
    let least = finite().fold(DVec3::INFINITY, |least, point| least.min(*point));
    let most = finite().fold(DVec3::NEG_INFINITY, |most, point| most.max(*point));
    let origin = between(least, most);
    (origin, points.iter().map(|point| (*point - origin).as_vec3()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_points_keep_their_differences_and_near_ones_their_bits() {
        let shape = [DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.2, DVec3::new(0.3, 0.1, 0.7)];
        let far = DVec3::new(450_123.4, 312.7, -5_412_345.6);
        let points = shape.map(|point| point + far);
        let (origin, relative) = split(&points);
        for (point, relative) in points.iter().zip(&relative) {
            assert!((origin + relative.as_dvec3() - *point).length() < 1e-7, "{point}");
        }
        let (origin, same) = split(&shape);
        assert_eq!((origin, same), (DVec3::ZERO, shape.map(|point| point.as_vec3()).to_vec()));
        // Many small things far apart, one point, and none.
        assert_eq!(split(&[shape[1], far]).0, DVec3::ZERO);
        assert_eq!(split(&[far]), (DVec3::ZERO, vec![far.as_vec3()]));
        assert_eq!(split(&[]), (DVec3::ZERO, Vec::new()));
    }
}
