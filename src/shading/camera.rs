//! Image points to rays.

use crate::math::{Ray, Vector};
use crate::sampling::warp;
use crate::scene::{Camera, Projection};
use crate::simd::Float;

/// How wide a pixel's ray is at the camera, in metres, and how much wider it becomes with every
/// metre; `height` is that of the image in pixels.
pub fn pixel_width(camera: &Camera, height: f32) -> (f32, f32) {
    match camera.projection {
        Projection::Pinhole { tan_half_fov } => (0.0, 2.0 * tan_half_fov / height),
        Projection::ThinLens { tan_half_fov, .. } => (0.0, 2.0 * tan_half_fov / height),
        Projection::Orthographic { half_height } => (2.0 * half_height / height, 0.0),
    }
}

/// The ray through (x, y), which go from −1 to 1 over the image's height, x to the right
/// and y up (PBRT 4th ed., 5.2), through a point of the lens that one of the unit square stands for.
#[inline(always)]
pub fn ray<F: Float>(camera: &Camera, x: F, y: F, lens: (F, F)) -> Ray<F> {
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
            let (a, b) = warp::concentric_disk(lens.0, lens.1);
            let radius = F::splat(lens_radius);
            let offset = right * (a * radius) + up * (b * radius);
            (origin + offset, focus - offset)
        }
        Projection::Orthographic { half_height } => {
            let h = F::splat(half_height);
            (origin + right * (x * h) + up * (y * h), forward)
        }
    };
    Ray { origin, direction: direction.normalize(), t_min: F::zero(), t_max: F::splat(f32::INFINITY) }
}
