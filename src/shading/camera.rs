//! Camera rays from image points.

use crate::math::{Ray, Vector};
use crate::sampling::warp;
use crate::scene::{Aperture, CompiledCamera, Projection};
use crate::simd::{Float, Mask};

/// The width of a pixel's ray at the camera, in metres, and its growth per metre; `height` is that of the image in
/// pixels.
pub fn pixel_width(camera: &CompiledCamera, height: f32) -> (f32, f32) {
    match camera.projection {
        Projection::Pinhole { tan_half_fov } => (0.0, 2.0 * tan_half_fov / height),
        Projection::ThinLens { tan_half_fov, .. } => (0.0, 2.0 * tan_half_fov / height),
        Projection::Orthographic { half_height } => (2.0 * half_height / height, 0.0),
    }
}

/// Maps a point of the unit square to a point of a lens of radius 1.
#[inline(always)]
pub fn on_lens<F: Float>(aperture: Option<&Aperture>, u: (F, F)) -> (F, F) {
    let Some(Aperture { table, scale: [across, down] }) = aperture else {
        return warp::concentric_disk(u.0, u.1);
    };
    let ((s, t), _) = table.sample(u, F::Mask::from_bits(u32::MAX));
    let (two, one) = (F::splat(2.0), F::one());
    ((s * two - one) * F::splat(*across), (one - t * two) * F::splat(*down))
}

/// The ray through (x, y), which range from −1 to 1 over the image's height, x to the right and y up (PBRT 4th ed.,
/// 5.2), and through a point of the lens, whose radius is 1 in these coordinates.
#[inline(always)]
pub fn ray<F: Float>(camera: &CompiledCamera, x: F, y: F, lens: (F, F)) -> Ray<F> {
    let origin = Vector::splat(camera.origin);
    let right = Vector::splat(camera.right);
    let up = Vector::splat(camera.up);
    let forward = Vector::splat(camera.forward);
    let (origin, direction) = match camera.projection {
        Projection::Pinhole { tan_half_fov } => {
            let k = F::splat(tan_half_fov);
            (origin, forward + right * (x * k) + up * (y * k))
        }
        Projection::ThinLens { tan_half_fov, lens_radius, focus_distance, .. } => {
            let k = F::splat(tan_half_fov);
            let focus = (forward + right * (x * k) + up * (y * k)) * F::splat(focus_distance);
            let radius = F::splat(lens_radius);
            let offset = right * (lens.0 * radius) + up * (lens.1 * radius);
            (origin + offset, focus - offset)
        }
        Projection::Orthographic { half_height } => {
            let h = F::splat(half_height);
            (origin + right * (x * h) + up * (y * h), forward)
        }
    };
    Ray { origin, direction: direction.normalize(), t_min: F::zero(), t_max: F::splat(f32::INFINITY) }
}
