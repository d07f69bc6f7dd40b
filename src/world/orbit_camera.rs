//! A camera that is moved by hand.

use super::components::{Camera, LookAtFault, Pattern, Transform};
use crate::math::{DMat3, DQuat, DVec3, Vec3};

/// Where a camera stands, what it turns about, and through what it looks.
#[derive(Clone, Debug, PartialEq)]
pub struct OrbitCamera {
    /// In world space.
    place: DVec3,
    /// Its axes: to the right, up, backward.
    axes: DMat3,
    /// What it turns about and comes nearer to.
    pivot: DVec3,
    /// Its optics.
    pub camera: Camera,
}

/// Where a rig stands, as a scene file says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where it stands, in metres.
    pub from: Vec3,
    /// What it looks at.
    pub to: Vec3,
    /// What is up; +Y unless it is tilted.
    pub up: Vec3,
}

/// How near to straight up or down it may turn, in radians.
const STEEPEST: f64 = 0.01;

impl OrbitCamera {
    /// A camera at a place, with unit vectors to the right, up and forward, which turns about what is `depth_m`
    /// ahead of it.
    pub fn new(place: DVec3, [right, up, forward]: [DVec3; 3], camera: Camera, depth_m: f64) -> OrbitCamera {
        // Mirror images have no pose.
        let right = if right.cross(forward).dot(up) < 0.0 { -right } else { right };
        let axes = DMat3::from_cols(right, up, -forward);
        OrbitCamera { place, axes, pivot: place + forward * depth_m, camera }
    }

    /// The way it looks.
    fn forward(&self) -> DVec3 {
        -self.axes.z_axis
    }

    /// How far ahead the pivot is.
    fn depth(&self) -> f64 {
        (self.pivot - self.place).dot(self.forward()).max(1e-6)
    }

    /// The height of what the image shows at the pivot, in metres.
    fn height(&self) -> f64 {
        match self.camera {
            Camera::Pinhole { vertical_fov } | Camera::ThinLens { vertical_fov, .. } => {
                2.0 * libm::tan(0.5 * f64::from(vertical_fov)) * self.depth()
            }
            Camera::Orthographic { height_m } => f64::from(height_m),
        }
    }

    /// Turns about the pivot: `dx` and `dy` are how far the hand has moved, in image heights, to the right and down.
    pub fn orbit(&mut self, [dx, dy]: [f64; 2]) {
        let turn = |angle: f64, axis: DVec3| DQuat::from_axis_angle(axis, angle);
        let pi = std::f64::consts::PI;
        // Not over the top.
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

    /// Moves along the image: what lies at the pivot's depth follows the hand.
    pub fn pan(&mut self, [dx, dy]: [f64; 2]) {
        let shift = (self.axes.y_axis * dy - self.axes.x_axis * dx) * self.height();
        (self.place, self.pivot) = (self.place + shift, self.pivot + shift);
    }

    /// Comes nearer to the pivot by a factor; an orthographic camera shows a smaller part instead.
    pub fn zoom(&mut self, factor: f64) {
        let factor = factor.clamp(1e-3, 1e3);
        match &mut self.camera {
            Camera::Orthographic { height_m } => *height_m = (f64::from(*height_m) / factor) as f32,
            Camera::Pinhole { .. } | Camera::ThinLens { .. } => {
                self.place = self.pivot + (self.place - self.pivot) / factor;
            }
        }
    }

    /// Moves to where the picture, of some width over height, just holds a thing that reaches as far along a
    /// direction of any length as `along` says. An orthographic camera also changes its height.
    pub fn fit(&mut self, aspect: f64, along: impl Fn(DVec3) -> f64) {
        /// The part of the picture that is filled; the rest is left free around it.
        const PART: f64 = 0.92;
        let [right, up, back] = [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis];
        let [nearest, farthest] = [along(back), -along(-back)];
        let room = 1e-3 * (nearest - farthest).max(1e-3);
        // How far it reaches to one side and the other, the more the nearer: planes through the image's borders touch
        // it.
        let span = |axis: DVec3, slope: f64| [along(axis + slope * back), along(slope * back - axis)];
        let (place, depth) = match &mut self.camera {
            Camera::Pinhole { vertical_fov } | Camera::ThinLens { vertical_fov, .. } => {
                let slope = PART * libm::tan(0.5 * f64::from(*vertical_fov));
                let slopes = [slope * aspect, slope];
                let [[a, b], [c, d]] = [span(right, slopes[0]), span(up, slopes[1])];
                let far = ((a + b) / (2.0 * slopes[0])).max((c + d) / (2.0 * slopes[1])).max(nearest + room);
                (0.5 * ((a - b) * right + (c - d) * up) + far * back, far - 0.5 * (nearest + farthest))
            }
            Camera::Orthographic { height_m } => {
                let [[a, b], [c, d]] = [span(right, 0.0), span(up, 0.0)];
                *height_m = ((c + d).max((a + b) / aspect) / PART) as f32;
                let far = nearest + f64::from(*height_m);
                (0.5 * ((a - b) * right + (c - d) * up) + far * back, far - 0.5 * (nearest + farthest))
            }
        };
        (self.place, self.pivot) = (place, place - depth * back);
    }

    /// From now on turns about a point, and has it in focus.
    pub fn focus(&mut self, point: Vec3) {
        self.pivot = point.as_dvec3();
        let depth = self.depth() as f32;
        if let Camera::ThinLens { focus_distance_m, .. } = &mut self.camera {
            *focus_distance_m = rounded(f64::from(depth), f64::from(depth)) as f32;
        }
    }

    /// Sets the vertical angle of view in degrees, if it has one.
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
            other => other,
        };
    }

    /// What a scene file says of it: rounded to what can be seen, so that what is saved is what is shown.
    pub fn pose(&self) -> Pose {
        let depth = self.depth();
        let point = |p: DVec3| p.to_array().map(|c| rounded(c, depth) as f32).into();
        let is_level = self.axes.x_axis.y.abs() < 1e-6 && self.axes.y_axis.y > 0.0;
        let up = if is_level { DVec3::Y } else { self.axes.y_axis };
        let up = Vec3::from(up.to_array().map(|c| rounded(c, 1.0) as f32));
        Pose { from: point(self.place), to: point(self.place + self.forward() * depth), up }
    }

    /// The pose as its entity's transform.
    pub fn transform(&self) -> Result<Transform, LookAtFault> {
        let Pose { from, to, up } = self.pose();
        Transform::look_at(from, to, up)
    }
}

/// Rounds to the power of ten that is at most a hundred thousandth of a length.
fn rounded(value: f64, length: f64) -> f64 {
    let digits = 5 - libm::floor(libm::log10(length.abs().max(1e-30))) as i32;
    let scale = libm::pow(10.0, f64::from(digits.clamp(-30, 30)));
    let rounded = libm::round(value * scale) / scale;
    // No minus before a zero.
    if rounded == 0.0 { 0.0 } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten metres before the origin, looking along −Z.
    fn rig() -> OrbitCamera {
        let vertical_fov = 2.0 * libm::atan(0.5) as f32;
        let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
        OrbitCamera::new(DVec3::new(0.0, 0.0, 10.0), axes, Camera::Pinhole { vertical_fov }, 10.0)
    }

    #[test]
    fn turning_keeps_the_distance_and_looks_at_the_pivot() {
        let mut rig = rig();
        rig.orbit([-0.5, 0.0]);
        let Pose { from, to, up } = rig.pose();
        assert!((from - Vec3::new(10.0, 0.0, 0.0)).length() < 1e-4, "{from}");
        assert!(to.length() < 1e-4, "{to}");
        assert_eq!(up, Vec3::Y);
        rig.orbit([0.3, 0.2]);
        assert!((rig.pose().from.length() - 10.0).abs() < 1e-3);
        assert!(rig.pose().from.y > 0.0, "a hand that goes down sees it from above");
        // As far up as a hand may go, and no further.
        rig.orbit([0.0, 5.0]);
        assert!(rig.pose().from.y > 9.99 && rig.transform().is_ok(), "{:?}", rig.pose());
    }

    #[test]
    fn what_is_at_the_pivot_follows_the_hand() {
        let mut rig = rig();
        // The image is ten metres high there.
        rig.pan([0.1, 0.0]);
        assert_eq!(rig.pose().from, Vec3::new(-1.0, 0.0, 10.0));
        rig.pan([0.0, 0.2]);
        assert_eq!(rig.pose().to, Vec3::new(-1.0, 2.0, 0.0));
    }

    #[test]
    fn nearer_is_nearer_to_the_pivot_alone() {
        let mut rig = rig();
        rig.zoom(2.0);
        assert_eq!((rig.pose().from.z, rig.pose().to), (5.0, Vec3::ZERO));
        rig.camera = Camera::Orthographic { height_m: 4.0 };
        rig.zoom(2.0);
        assert_eq!((rig.pose().from.z, &rig.camera), (5.0, &Camera::Orthographic { height_m: 2.0 }));
    }

    /// A box is seen at an angle: its corners are within the picture, and one touches the margin.
    #[test]
    fn what_is_fitted_fills_the_picture() {
        for (aspect, parallel) in [(1.5, false), (0.5, false), (4.0, false), (1.5, true)] {
            let mut rig = rig();
            if parallel {
                rig.camera = Camera::Orthographic { height_m: 1.0 };
            }
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
                    _ => -0.5 * seen.z,
                };
                (seen.x / (aspect * half)).abs().max((seen.y / half).abs())
            });
            let largest = largest.fold(0.0, f64::max);
            assert!((largest - 0.92).abs() < 1e-3, "{aspect}: {largest}");
        }
    }

    #[test]
    fn a_lens_comes_in_focus_where_the_pivot_is() {
        let mut rig = rig();
        rig.focus(Vec3::new(1.0, 1.0, 3.0));
        rig.set_lens(0.1);
        let focus = |rig: &OrbitCamera| match rig.camera {
            Camera::ThinLens { focus_distance_m, .. } => Some(focus_distance_m),
            _ => None,
        };
        assert_eq!(focus(&rig), Some(7.0));
        rig.focus(Vec3::new(0.0, 0.0, -2.0));
        assert_eq!(focus(&rig), Some(12.0));
        rig.set_lens(0.0);
        assert_eq!(focus(&rig), None);
    }
}
