//! The compiled camera.

use crate::math::Vec3;
use crate::sampling::table::Distribution2d;
use crate::world::Pattern;

/// A position, three unit axes and a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompiledCamera {
    /// The pinhole, or the centre of the lens.
    pub origin: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Unit vector into the scene.
    pub forward: Vec3,
    /// The mapping from image points to rays.
    pub projection: Projection,
}

impl CompiledCamera {
    /// The height of a pixel, in metres, of an image of that many rows at a depth along the axis.
    pub fn pixel_at(&self, depth: f64, rows: u32) -> f64 {
        let half = match self.projection {
            Projection::Pinhole { tan_half_fov } | Projection::ThinLens { tan_half_fov, .. } => {
                depth * f64::from(tan_half_fov)
            }
            Projection::Orthographic { half_height } => f64::from(half_height),
        };
        2.0 * half / f64::from(rows)
    }
}

/// A lens opening of arbitrary shape.
#[derive(Clone, Debug)]
pub struct Aperture {
    /// The transmitted light by position, over a square a little larger than the square around the lens.
    pub table: Distribution2d,
    /// The size of that square relative to the square around the lens, horizontally and vertically.
    pub scale: [f32; 2],
}

/// The mapping from image points to rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays pass through one point.
    Pinhole {
        /// Tangent of half the vertical angle of view.
        tan_half_fov: f32,
    },
    /// Rays pass through a lens.
    ThinLens {
        /// Tangent of half the vertical angle of view.
        tan_half_fov: f32,
        /// Radius of the lens in metres.
        lens_radius: f32,
        /// Distance to the plane of focus along the axis, in metres.
        focus_distance: f32,
        /// The pattern of a pixel's samples over the lens.
        pattern: Pattern,
    },
    /// All rays are parallel.
    Orthographic {
        /// Half the height of the image in metres.
        half_height: f32,
    },
}
