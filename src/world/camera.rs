//! Cameras, and what stands beside one at its entity.

use super::assets::ImageId;
use super::components::Pattern;
use super::fields::{Range, fields, forms, radians};
use crate::math::Vec2;

forms! {
    /// A camera, which generates rays for image points. The scale of its entity is ignored.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum Camera, "camera" {
        /// All rays pass through the local origin.
        Pinhole {
            /// the full vertical angle of view
            vertical_fov ["vertical_fov_degrees"]: f32 = radians(45.0), Degrees(Range::Between(0.0, 180.0));
        },
        /// Rays pass through a lens around the local origin; those of one image point meet in the focal plane.
        ThinLens {
            /// the full vertical angle of view
            vertical_fov ["vertical_fov_degrees"]: f32 = radians(45.0), Degrees(Range::Between(0.0, 180.0));
            /// the lens's radius
            lens_radius_m: f32 = 0.0, Number(Range::From(0.0)), required;
            /// from the lens to the plane in focus, along −Z; needed unless there is a `focus_on`
            focus_distance_m: f32 = 1.0, Number(Range::Above0);
            /// an image of the opening, over the square around the lens, top up: the brighter a texel, the more light
            /// comes through; without one the opening is round
            aperture: Option<ImageId> = None, Image;
            /// how a pixel's samples are spread over the lens, under the Whitted transport
            pattern: Pattern = Pattern::Jittered, Form;
        },
        /// Parallel rays along −Z.
        Orthographic {
            /// height of the image
            height_m: f32 = 2.0, Number(Range::Above0);
        },
        /// A camera as photographers describe it: the angle of view follows from the focal length and the sensor, the
        /// radius of the lens from the f-number. (A lens that focuses near by is not moved away from the sensor.)
        Photographic {
            /// the focal length
            focal_length_mm: f32 = 50.0, Number(Range::FromTo(0.1, 100_000.0));
            /// the sensor's side along the image's longer side: 36 is full frame
            sensor_width_mm: f32 = 36.0, Number(Range::FromTo(0.1, 10_000.0));
            /// the f-number, the focal length over the diameter of the opening; without one everything is sharp
            f_stop: Option<f32> = None, OptionalNumber(Range::FromTo(0.01, 1000.0));
            /// from the lens to the plane in focus, along −Z; needed with an `f_stop` unless there is a `focus_on`
            focus_distance_m: f32 = 1.0, Number(Range::Above0);
            /// the movement of the lens across the sensor (shift, rise), in widths and heights of the image: (0, 0.5)
            /// shows what lies above the axis, with upright lines
            shift: Vec2 = Vec2::ZERO, Pair(Range::FromTo(-10.0, 10.0));
            /// the turn of the lens to the right and downwards, which tilts the plane in focus: it meets the plane through
            /// the lens parallel to the sensor at the focal length over the sine of the angle (Scheimpflug, Merklinger)
            tilt_degrees: Vec2 = Vec2::ZERO, Pair(Range::FromTo(-45.0, 45.0));
            /// as of `ThinLens`
            aperture: Option<ImageId> = None, Image;
            /// as of `ThinLens`
            pattern: Pattern = Pattern::Jittered, Form;
        },
        /// A pinhole as data sets describe it: focal lengths and the principal point in pixels, from the image's top
        /// left corner.
        Intrinsics {
            /// the focal length in pixels, along rows
            fx: f32 = 500.0, Number(Range::FromTo(1e-3, 1e9)), required;
            /// the focal length along columns
            fy: f32 = 500.0, Number(Range::FromTo(1e-3, 1e9)), required;
            /// the principal point's distance from the left of the image; where pixels are counted from the centre of
            /// the first one (OpenCV), add 0.5
            cx: f32 = 320.0, Number(Range::FromTo(-1e6, 1e6)), required;
            /// its distance from the top
            cy: f32 = 240.0, Number(Range::FromTo(-1e6, 1e6)), required;
            /// the image for which these hold; one of another size shows the same
            size: [u32; 2] = [640, 480], Size, required;
        },
        /// All directions around the origin, as in an environment's image: columns are angles about +Y, rows angles
        /// above the horizon, and −Z is in the centre (equirectangular).
        Panorama {
            /// the angle from the image's left to its right
            horizontal ["horizontal_degrees"]: f32 = radians(360.0), Degrees(Range::UpTo(360.0));
            /// the angle from its top to its bottom
            vertical ["vertical_degrees"]: f32 = radians(180.0), Degrees(Range::UpTo(180.0));
        },
        /// A disc that touches the image's shorter sides, and shows directions by their angle to −Z.
        Fisheye {
            /// the full angle across the disc; at most 180 with `Orthographic`, and 340 with `Stereographic`
            fov ["fov_degrees"]: f32 = radians(180.0), Degrees(Range::UpTo(360.0));
            /// the distance from the centre of what lies at the angle θ to the axis: proportional to θ, sin θ/2, tan θ/2
            /// or sin θ
            mapping: FisheyeMapping = FisheyeMapping::Equidistant, Form;
            /// whether the image is black outside the disc
            circular: bool = true, Flag;
        },
    }
}

forms! {
    /// The distance from the centre of a fisheye's image at which it shows what lies at an angle θ to its axis.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum FisheyeMapping, "mapping" {
        /// Proportional to θ.
        #[default]
        Equidistant,
        /// Proportional to sin θ/2: equal areas show equal solid angles, as most lenses do nearly.
        Equisolid,
        /// Proportional to tan θ/2: circles stay circles.
        Stereographic,
        /// Proportional to sin θ, at most a half space.
        Orthographic,
    }
}

impl Camera {
    /// The reason why a fisheye's angle is too large for its mapping, if it is.
    pub(crate) fn check_angle(&self) -> Result<(), String> {
        let Camera::Fisheye { fov, mapping, .. } = self else { return Ok(()) };
        let most = match mapping {
            FisheyeMapping::Equidistant | FisheyeMapping::Equisolid => 360.0,
            FisheyeMapping::Stereographic => 340.0,
            FisheyeMapping::Orthographic => 180.0,
        };
        let degrees = fov.to_degrees();
        if degrees <= most * 1.000_001 {
            return Ok(());
        }
        Err(format!(
            "fov_degrees must be above 0 and at most {most} with mapping: {mapping:?}, not {degrees}"
        ))
    }

    /// The tangent of half the vertical angle of view, if the camera has one, in an image of an aspect ratio (width over
    /// height).
    pub(crate) fn slope(&self, aspect: f64) -> Option<f64> {
        match *self {
            Camera::Pinhole { vertical_fov } | Camera::ThinLens { vertical_fov, .. } => {
                Some(libm::tan(0.5 * f64::from(vertical_fov)))
            }
            Camera::Photographic { focal_length_mm, sensor_width_mm, .. } => {
                // The sensor's side lies along the longer side of the image.
                Some(0.5 * f64::from(sensor_width_mm) / f64::from(focal_length_mm) / aspect.max(1.0))
            }
            Camera::Intrinsics { fy, size: [_, height], .. } => Some(0.5 * f64::from(height) / f64::from(fy)),
            Camera::Orthographic { .. } | Camera::Panorama { .. } | Camera::Fisheye { .. } => None,
        }
    }

    /// The distance to the plane in focus, if the camera has a lens.
    pub(crate) fn focus_distance_m(&mut self) -> Option<&mut f32> {
        match self {
            Camera::ThinLens { focus_distance_m, .. }
            | Camera::Photographic { f_stop: Some(_), focus_distance_m, .. } => Some(focus_distance_m),
            _ => None,
        }
    }
}

forms! {
    /// The arrangement of the images of a [`Stereo`] pair.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum StereoLayout, "layout" {
        /// The left eye's image on the left.
        #[default]
        SideBySide,
        /// The left eye's image on top.
        OverUnder,
        /// The left eye's image alone.
        Left,
        /// The right eye's image alone.
        Right,
    }
}

fields! {
    /// Makes the image of an entity's [`Camera`] two images, for two eyes beside each other, each with its half of the
    /// pixels, or one of them. In a panorama the eyes turn with the direction of view (omnidirectional stereo: Peleg,
    /// Ben-Ezra and Pritch 2001).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Stereo, "a stereo pair" {
        /// the left eye's image on the left or on top, or one eye's image alone
        layout: StereoLayout = StereoLayout::SideBySide, Form;
        /// the distance between the eyes
        eye_distance_m: f32 = 0.065, Number(Range::From(0.0));
        /// the distance at which both images show the same in the same place; without one the eyes look in parallel;
        /// not in panoramas and fisheyes
        convergence_m: f32 = f32::INFINITY, Number(Range::Distance);
    }
}

/// Keeps the lens of an entity's [`Camera`] focused on another entity: on the middle of its shape, or on its origin if it
/// has none. The camera's own distance does not count then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FocusOn(pub hecs::Entity);

/// Keeps the lens of an entity's [`Camera`] focused on what is seen in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FocusAt {
    /// At a place, in widths and heights of the image from its top left corner.
    Place([f32; 2]),
    /// On the thing nearest to its middle.
    Middle,
}
