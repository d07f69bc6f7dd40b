//! The compiled camera.

use crate::math::Vec3;
use crate::sampling::table::Distribution2d;
use crate::world::{FisheyeMapping, Pattern, StereoLayout};

/// A position, three unit axes and a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompiledCamera {
    /// The pinhole, or the centre of the lens; of a stereo pair the point between both.
    pub origin: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Unit vector into the scene.
    pub forward: Vec3,
    /// The mapping from image points to rays.
    pub projection: Projection,
    /// The division of the image between two eyes, if there is one.
    pub stereo: Option<StereoPair>,
}

impl CompiledCamera {
    /// The distance along the axis at which a lens is in focus, in metres; none without a lens.
    pub fn focus_distance_m(&self) -> Option<f32> {
        match self.projection {
            Projection::ThinLens { lens, .. } => Some(1.0 / lens.focus.dot(self.forward)),
            _ => None,
        }
    }

    /// True if depths are along the axis; otherwise they are distances.
    pub fn is_flat(&self) -> bool {
        !matches!(self.projection, Projection::Panorama { .. } | Projection::Fisheye { .. })
    }
}

/// Two eyes that share an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoPair {
    /// The arrangement of both images.
    pub layout: StereoLayout,
    /// Half of the distance between the eyes, in metres.
    pub half_distance: f32,
    /// 1 over the distance at which both see the same: 0 for parallel axes.
    pub convergence: f32,
}

impl CompiledCamera {
    /// The height of a pixel, in metres, of an image of that many rows at a depth along the axis, or a distance if the
    /// image is not flat; at most that of pixels in the middle of the image.
    pub fn pixel_at(&self, depth: f64, rows: u32) -> f64 {
        let half = match self.projection {
            Projection::Pinhole(view) | Projection::ThinLens { view, .. } => {
                // An image twice as wide as high has the smallest pixels of usual ones.
                let [_, half] = view.scale(2.0);
                depth * f64::from(half)
            }
            Projection::Orthographic { half_height } => f64::from(half_height),
            Projection::Panorama { half_turns: [_, above] } => {
                depth * f64::from(above) * std::f64::consts::TAU
            }
            Projection::Fisheye { rim, .. } => depth * f64::from(rim),
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

/// The half size of a flat image at a distance of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HalfSize {
    /// Half of the height.
    Height(f32),
    /// Half of the longer side.
    LongerSide(f32),
    /// Half of the width and half of the height.
    Both([f32; 2]),
}

/// A round lens around the origin of a camera, or one with an aperture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The radius in metres.
    pub radius: f32,
    /// Unit vectors to the right and up in the plane of the lens.
    pub axes: [Vec3; 2],
    /// The plane in focus: the points whose product with this vector, in 1/m, is 1.
    pub focus: Vec3,
}

impl Lens {
    /// A lens of a camera whose axes point to the right, up and forward, in focus at a distance along its axis. It has a
    /// focal length, and is turned to the right and downwards by angles with two tangents. (The thin lens equation along a
    /// turned axis n, for the plane of the image across f: 1/s = 1/d + (s · n)/F for points s at depth 1, without the
    /// part of n along f.)
    pub fn new(
        [right, up, forward]: [Vec3; 3],
        radius: f32,
        focus_distance: f32,
        (focal_length, [to_right, down]): (f32, [f64; 2]),
    ) -> Lens {
        let focus = forward / focus_distance;
        if [to_right, down] == [0.0; 2] {
            return Lens { radius, axes: [right, up], focus };
        }
        let [right, up, forward] = [right, up, forward].map(|axis| axis.as_dvec3());
        let axis = (forward + right * to_right - up * down).normalize();
        let to_side = (right - axis * right.dot(axis)).normalize();
        // The third axis is on the side of `up` in mirrored cameras, too.
        let to_top = up - axis * up.dot(axis);
        let to_top = (to_top - to_side * to_top.dot(to_side)).normalize();
        let across = (axis - forward * axis.dot(forward)) / f64::from(focal_length);
        Lens { radius, axes: [to_side, to_top].map(|axis| axis.as_vec3()), focus: focus + across.as_vec3() }
    }
}

/// A flat image, a perspective view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perspective {
    /// Its half size.
    pub half: HalfSize,
    /// The distance of its centre from the axis, to the right and up, in widths and heights of the image.
    pub shift: [f32; 2],
}

impl Perspective {
    /// A view with a tangent of half its vertical angle.
    pub const fn upright(tan_half_fov: f32) -> Self {
        Self { half: HalfSize::Height(tan_half_fov), shift: [0.0; 2] }
    }

    /// The distances on the image a metre ahead per half of the image's height, along its width and its height, for a
    /// width over height of `aspect`.
    #[inline(always)]
    pub fn scale(&self, aspect: f32) -> [f32; 2] {
        match self.half {
            HalfSize::Height(half) => [half; 2],
            HalfSize::LongerSide(half) => [half / aspect.max(1.0); 2],
            HalfSize::Both([width, height]) => [width / aspect, height],
        }
    }

    /// The shift in halves of the image's height.
    #[inline(always)]
    pub fn offset(&self, aspect: f32) -> [f32; 2] {
        let [across, up] = self.shift;
        [2.0 * aspect * across, 2.0 * up]
    }
}

/// The mapping from image points to rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays pass through one point.
    Pinhole(Perspective),
    /// Rays pass through a lens.
    ThinLens {
        /// The view from its centre.
        view: Perspective,
        /// The lens.
        lens: Lens,
        /// The pattern of a pixel's samples over the lens.
        pattern: Pattern,
    },
    /// All rays are parallel.
    Orthographic {
        /// Half the height of the image in metres.
        half_height: f32,
    },
    /// Columns are angles about the up axis, rows angles above the horizon.
    Panorama {
        /// Half of the image's width and height, in turns.
        half_turns: [f32; 2],
    },
    /// Directions are mapped to a disc by their angle to the axis.
    Fisheye {
        /// The radius by that angle.
        mapping: FisheyeMapping,
        /// The angle at the rim of the disc, which touches the image's shorter sides, in turns.
        half_turns: f32,
        /// The function of that angle to which the mapping's radius is proportional.
        rim: f32,
        /// True if there is nothing outside the disc.
        is_circular: bool,
    },
}
