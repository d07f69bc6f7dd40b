//! A torus knot with normals and texture coordinates.

use glam::DVec3;

use crate::mesh::{Solid, polar};
use crate::outline::circle;
use crate::solids::{Station, sweep};

/// A tube along a curve that runs `around` times about the axis of a torus and `through` times about its ring, in
/// metres, about the origin; +Z is the axis.
pub fn torus_knot(around: f64, through: f64, radius: f64) -> Solid {
    const STEPS: usize = 320;
    let at = |t: f64| {
        let ring = polar(1.0, 360.0 * around * t);
        let tube = polar(1.0, 360.0 * through * t);
        (ring * (1.0 + 0.46 * tube.x)).extend(0.46 * tube.y) * radius
    };
    let frame = |i: usize| {
        let t = i as f64 / STEPS as f64;
        let tangent = (at(t + 0.0005) - at(t - 0.0005)).normalize();
        let center = (polar(1.0, 360.0 * around * t) * radius).extend(0.0);
        let out: DVec3 = at(t) - center;
        let x = (out - tangent * out.dot(tangent)).normalize();
        Station { origin: at(t), x, y: tangent.cross(x) }
    };
    let path: Vec<Station> = (0..STEPS).map(frame).collect();
    sweep(&path, &circle(glam::DVec2::ZERO, 0.19 * radius, 28), true, 16.0)
}
