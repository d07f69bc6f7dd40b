//! Points that positions in single precision are relative to, where those relative to (0, 0, 0) would be coarse.

use crate::math::DVec3;

/// A position may be this many times as far from the origin as from the camera, or as its shape is large. The rounding
/// error is then 1/16,384 of that distance: a sixteenth of a pixel in an image of 1,000 pixels.
pub(crate) const FARTHEST: f64 = 1024.0;

/// Rounds a point to multiples of the largest power of two that is at most half of a length.
pub(crate) fn rounded(point: DVec3, length: f64) -> DVec3 {
    let step = libm::exp2(libm::floor(libm::log2(length)) - 1.0);
    (point / step).round() * step
}
