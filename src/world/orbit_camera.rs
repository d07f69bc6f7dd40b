//! An orbit camera, moved interactively.

use super::camera::Camera;
use super::components::{LookAtFault, Pattern, Transform};
use crate::math::{DMat3, DQuat, DVec3, Vec3};

/// A camera with a pose, a pivot that it orbits, and its optics.
#[derive(Clone, Debug, PartialEq)]
pub struct OrbitCamera {
    /// The position in world space.
    place: DVec3,
    /// The axes: right, up, backward.
    axes: DMat3,
    /// The point that it orbits and zooms towards.
    pivot: DVec3,
    /// The optics.
    pub camera: Camera,
}

/// The pose of an orbit camera, as in scene files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The position, in metres.
    pub from: DVec3,
    /// The point that it looks at.
    pub to: DVec3,
    /// The up vector; +Y unless the camera is tilted.
    pub up: Vec3,
}

/// The smallest angle in radians between the direction of view and the vertical.
const STEEPEST: f64 = 0.01;

impl OrbitCamera {
    /// Returns a camera at a position, with unit vectors to the right, up and forward; the pivot is `depth_m` ahead.
    pub fn new(place: DVec3, [right, up, forward]: [DVec3; 3], camera: Camera, depth_m: f64) -> OrbitCamera {
        // A pose cannot represent a mirrored camera.
        let right = if right.cross(forward).dot(up) < 0.0 { -right } else { right };
        let axes = DMat3::from_cols(right, up, -forward);
        OrbitCamera { place, axes, pivot: place + forward * depth_m, camera }
    }

    /// The direction of view.
    fn forward(&self) -> DVec3 {
        -self.axes.z_axis
    }

    /// The depth of the pivot along the direction of view.
    fn depth(&self) -> f64 {
        (self.pivot - self.place).dot(self.forward()).max(1e-6)
    }

    /// The height of an image of an aspect ratio at the pivot's depth, in metres.
    fn height(&self, aspect: f64) -> f64 {
        match (self.camera, self.camera.slope(aspect)) {
            (Camera::Orthographic { height_m }, _) => f64::from(height_m),
            (_, slope) => 2.0 * slope.unwrap_or(1.0) * self.depth(),
        }
    }

    /// Orbits the pivot: `dx` and `dy` are the pointer's movement to the right and down, in image heights.
    pub fn orbit(&mut self, [dx, dy]: [f64; 2]) {
        let turn = |angle: f64, axis: DVec3| DQuat::from_axis_angle(axis, angle);
        let pi = std::f64::consts::PI;
        // Do not pass the poles.
        let pitch = libm::asin(self.forward().y.clamp(-1.0, 1.0));
        let steepest = 0.5 * pi - STEEPEST;
        let tilt = (pitch - dy * pi).clamp(-steepest.max(pitch.abs()), steepest.max(pitch.abs())) - pitch;
        let level = turn(tilt, self.axes.x_axis);
        let turned = turn(-dx * pi, DVec3::Y) * level;
        self.place = self.pivot + turned * (self.place - self.pivot);
        let [x, y, z] =
            [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis].map(|axis| (turned * axis).normalize());
        self.axes = DMat3::from_cols(x, y, z);
    }

    /// Moves parallel to the image plane: points at the pivot's depth follow the pointer, whose way is in heights of an
    /// image of the aspect ratio `aspect` (width over height).
    pub fn pan(&mut self, [dx, dy]: [f64; 2], aspect: f64) {
        let shift = (self.axes.y_axis * dy - self.axes.x_axis * dx) * self.height(aspect);
        (self.place, self.pivot) = (self.place + shift, self.pivot + shift);
    }

    /// Moves closer to the pivot by a factor; an orthographic camera shrinks its height instead.
    pub fn zoom(&mut self, factor: f64) {
        let factor = factor.clamp(1e-3, 1e3);
        match &mut self.camera {
            Camera::Orthographic { height_m } => *height_m = (f64::from(*height_m) / factor) as f32,
            _ => self.place = self.pivot + (self.place - self.pivot) / factor,
        }
    }

    /// Moves so that an image with the aspect ratio `aspect` (width over height) just contains an object. `along` is
    /// its support function: the maximum dot product of its points with a direction of any length. An orthographic
    /// camera also changes its height.
    pub fn fit(&mut self, aspect: f64, along: impl Fn(DVec3) -> f64) {
        /// The fraction of the image that the object fills; the rest is a margin.
        const PART: f64 = 0.92;
        let [right, up, back] = [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis];
        let [nearest, farthest] = [along(back), -along(-back)];
        let room = 1e-3 * (nearest - farthest).max(1e-3);
        // The object's extent to either side, larger for nearer points: planes through the image's borders touch it.
        let span = |axis: DVec3, slope: f64| [along(axis + slope * back), along(slope * back - axis)];
        let half = self.camera.slope(aspect).unwrap_or(1.0);
        let (place, depth) = match &mut self.camera {
            Camera::Orthographic { height_m } => {
                let [[a, b], [c, d]] = [span(right, 0.0), span(up, 0.0)];
                *height_m = ((c + d).max((a + b) / aspect) / PART) as f32;
                let far = nearest + f64::from(*height_m);
                (0.5 * ((a - b) * right + (c - d) * up) + far * back, far - 0.5 * (nearest + farthest))
            }
            _ => {
                let slope = PART * half;
                let slopes = [slope * aspect, slope];
                let [[a, b], [c, d]] = [span(right, slopes[0]), span(up, slopes[1])];
                let far = ((a + b) / (2.0 * slopes[0])).max((c + d) / (2.0 * slopes[1])).max(nearest + room);
                (0.5 * ((a - b) * right + (c - d) * up) + far * back, far - 0.5 * (nearest + farthest))
            }
        };
        (self.place, self.pivot) = (place, place - depth * back);
    }

    /// Sets the pivot, and focuses on it.
    pub fn focus(&mut self, point: DVec3) {
        self.pivot = point;
        let depth = self.depth() as f32;
        if let Some(focus_distance_m) = self.camera.focus_distance_m() {
            *focus_distance_m = rounded(f64::from(depth), f64::from(depth)) as f32;
        }
    }

    /// Sets the vertical angle of view in degrees, if the camera has one.
    pub fn set_fov(&mut self, degrees: f64) {
        let radians = degrees.clamp(1.0, 170.0).to_radians() as f32;
        if let Camera::Pinhole { vertical_fov } | Camera::ThinLens { vertical_fov, .. } = &mut self.camera {
            *vertical_fov = radians;
        }
    }

    /// Sets the radius of the lens in metres; 0 makes it a pinhole.
    pub fn set_lens(&mut self, radius_m: f64) {
        let depth = rounded(self.depth(), self.depth()) as f32;
        let radius = radius_m.max(0.0) as f32;
        self.camera = match self.camera {
            Camera::Pinhole { vertical_fov } if radius > 0.0 => Camera::ThinLens {
                vertical_fov,
                lens_radius_m: radius,
                focus_distance_m: depth,
                aperture: None,
                pattern: Pattern::default(),
            },
            Camera::ThinLens { vertical_fov, .. } if radius == 0.0 => Camera::Pinhole { vertical_fov },
            Camera::ThinLens { vertical_fov, focus_distance_m, aperture, pattern, .. } => {
                Camera::ThinLens { vertical_fov, lens_radius_m: radius, focus_distance_m, aperture, pattern }
            }
            Camera::Photographic {
                focal_length_mm,
                sensor_width_mm,
                f_stop,
                focus_distance_m,
                shift,
                tilt_degrees,
                aperture,
                pattern,
            } => Camera::Photographic {
                focal_length_mm,
                sensor_width_mm,
                f_stop: (radius > 0.0).then(|| (0.5e-3 * focal_length_mm / radius).clamp(0.01, 1000.0)),
                focus_distance_m: if f_stop.is_none() { depth } else { focus_distance_m },
                shift,
                tilt_degrees,
                aperture,
                pattern,
            },
            other => other,
        };
    }

    /// Returns the pose for a scene file, rounded to visible precision so that the saved pose is the displayed one.
    pub fn pose(&self) -> Pose {
        let depth = self.depth();
        let point = |p: DVec3| p.map(|c| rounded(c, depth));
        let is_level = self.axes.x_axis.y.abs() < 1e-6 && self.axes.y_axis.y > 0.0;
        let up = if is_level { DVec3::Y } else { self.axes.y_axis };
        let up = Vec3::from(up.to_array().map(|c| rounded(c, 1.0) as f32));
        Pose { from: point(self.place), to: point(self.place + self.forward() * depth), up }
    }

    /// Returns the pose as the transform of its entity.
    pub fn transform(&self) -> Result<Transform, LookAtFault> {
        let Pose { from, to, up } = self.pose();
        Transform::look_at(from, to, up)
    }
}

/// Rounds to a multiple of the largest power of ten that is at most 10⁻⁵ of a length.
fn rounded(value: f64, length: f64) -> f64 {
    let digits = 5 - libm::floor(libm::log10(length.abs().max(1e-30))) as i32;
    let scale = libm::pow(10.0, f64::from(digits.clamp(-30, 30)));
    let rounded = libm::round(value * scale) / scale;
    // Avoid negative zero.
    if rounded == 0.0 { 0.0 } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera at z = 10 m that looks along −Z.
    fn rig() -> OrbitCamera {
        let vertical_fov = 2.0 * libm::atan(0.5) as f32;
        let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
        OrbitCamera::new(DVec3::new(0.0, 0.0, 10.0), axes, Camera::Pinhole { vertical_fov }, 10.0)
    }

    #[test]
    fn orbit_keeps_the_distance_and_looks_at_the_pivot() {
        let mut rig = rig();
        rig.orbit([-0.5, 0.0]);
        let Pose { from, to, up } = rig.pose();
        assert!((from - DVec3::new(10.0, 0.0, 0.0)).length() < 1e-4, "{from}");
        assert!(to.length() < 1e-4, "{to}");
        assert_eq!(up, Vec3::Y);
        rig.orbit([0.3, 0.2]);
        assert!((rig.pose().from.length() - 10.0).abs() < 1e-3);
        assert!(rig.pose().from.y > 0.0, "a hand that goes down sees it from above");
        // The pitch is clamped near the pole.
        rig.orbit([0.0, 5.0]);
        assert!(rig.pose().from.y > 9.99 && rig.transform().is_ok(), "{:?}", rig.pose());
    }

    #[test]
    fn pan_moves_points_at_the_pivots_depth_with_the_pointer() {
        let mut rig = rig();
        // The image is ten metres high at the pivot.
        rig.pan([0.1, 0.0], 1.5);
        assert_eq!(rig.pose().from, DVec3::new(-1.0, 0.0, 10.0));
        rig.pan([0.0, 0.2], 1.5);
        assert_eq!(rig.pose().to, DVec3::new(-1.0, 2.0, 0.0));
    }

    #[test]
    fn zoom_halves_the_distance_or_the_orthographic_height() {
        let mut rig = rig();
        rig.zoom(2.0);
        assert_eq!((rig.pose().from.z, rig.pose().to), (5.0, DVec3::ZERO));
        rig.camera = Camera::Orthographic { height_m: 4.0 };
        rig.zoom(2.0);
        assert_eq!((rig.pose().from.z, &rig.camera), (5.0, &Camera::Orthographic { height_m: 2.0 }));
    }

    /// All corners of a box seen at an angle are within the image, and one touches the margin.
    #[test]
    fn fit_fills_the_image_up_to_the_margin() {
        let photographic = Camera::Photographic {
            focal_length_mm: 50.0,
            sensor_width_mm: 36.0,
            f_stop: None,
            focus_distance_m: 1.0,
            shift: Default::default(),
            tilt_degrees: Default::default(),
            aperture: None,
            pattern: Pattern::default(),
        };
        for (aspect, camera) in [
            (1.5, rig().camera),
            (0.5, rig().camera),
            (4.0, rig().camera),
            (1.5, Camera::Orthographic { height_m: 1.0 }),
            (1.5, photographic),
            (0.5, photographic),
        ] {
            let mut rig = rig();
            rig.camera = camera;
            rig.orbit([0.2, 0.1]);
            let corners: Vec<DVec3> = (0..8)
                .map(|i| {
                    DVec3::new(f64::from(i & 1) * 3.0, f64::from(i >> 1 & 1), f64::from(i >> 2) * 7.0 - 20.0)
                })
                .collect();
            rig.fit(aspect, |direction| {
                corners.iter().map(|corner| corner.dot(direction)).fold(f64::MIN, f64::max)
            });
            let largest = corners.iter().map(|corner| {
                let seen = rig.axes.transpose() * (*corner - rig.place);
                assert!(seen.z < 0.0, "{seen}");
                let half = match rig.camera {
                    Camera::Orthographic { height_m } => 0.5 * f64::from(height_m),
                    // Half of the longer side of the image is seen at 18 mm in a distance of 50 mm.
                    Camera::Photographic { .. } => -seen.z * 18.0 / 50.0 / f64::max(aspect, 1.0),
                    _ => -0.5 * seen.z,
                };
                (seen.x / (aspect * half)).abs().max((seen.y / half).abs())
            });
            let largest = largest.fold(0.0, f64::max);
            assert!((largest - 0.92).abs() < 1e-3, "{aspect}: {largest}");
        }
    }

    #[test]
    fn lens_focuses_on_the_pivot() {
        let mut rig = rig();
        rig.focus(DVec3::new(1.0, 1.0, 3.0));
        rig.set_lens(0.1);
        let focus = |rig: &OrbitCamera| match rig.camera {
            Camera::ThinLens { focus_distance_m, .. } => Some(focus_distance_m),
            _ => None,
        };
        assert_eq!(focus(&rig), Some(7.0));
        rig.focus(DVec3::new(0.0, 0.0, -2.0));
        assert_eq!(focus(&rig), Some(12.0));
        rig.set_lens(0.0);
        assert_eq!(focus(&rig), None);
    }
}
