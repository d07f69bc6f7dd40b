//! The compiled camera.

use crate::math::Vec3;
use crate::sampling::table::Distribution2d;
use crate::world::Pattern;

/// A place, three unit axes and a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole or the centre of the lens.
    pub origin: Vec3,
    /// To the right of the image.
    pub right: Vec3,
    /// To its top.
    pub up: Vec3,
    /// Into the scene.
    pub forward: Vec3,
    /// From image points to rays.
    pub projection: Projection,
}

/// An opening of any shape.
#[derive(Clone, Debug)]
pub struct Aperture {
    /// How much light comes through where, over a square a little larger than that around the lens.
    pub table: Distribution2d,
    /// How many times as large it is, across and down.
    pub scale: [f32; 2],
}

/// How image points become rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Through one point.
    Pinhole {
        /// Tangent of half the vertical angle of view.
        tan_half_fov: f32,
    },
    /// Through a lens.
    ThinLens {
        /// Tangent of half the vertical angle of view.
        tan_half_fov: f32,
        /// In metres.
        lens_radius: f32,
        /// Along the axis, in metres.
        focus_distance: f32,
        /// How a pixel's samples are spread over the lens.
        pattern: Pattern,
    },
    /// Parallel.
    Orthographic {
        /// Half the height of the image in metres.
        half_height: f32,
    },
}
