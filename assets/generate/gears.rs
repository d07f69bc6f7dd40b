//! Toothed wheels in the XY plane, in millimetres. The first tooth points along +X.

use glam::DVec2;

use crate::mesh::{Solid, polar};
use crate::outline::{Loop, Outline, circle, contours, distance};
use crate::solids::{beveled, extrude};

/// Radius of the pitch circle.
pub fn pitch_radius(module: f64, teeth: u32) -> f64 {
    module * f64::from(teeth) / 2.0
}

/// The rotation in degrees of the second of two meshing wheels, if the first is turned by `first_turn` and the second's
/// centre lies at `direction` from the first's.
pub fn meshing_turn(first_teeth: u32, first_turn: f64, second_teeth: u32, direction: f64) -> f64 {
    let fraction = (direction - first_turn) * f64::from(first_teeth) / 360.0;
    let turn = direction + 180.0 - (0.5 - fraction) * 360.0 / f64::from(second_teeth);
    turn - 360.0 / f64::from(second_teeth) * (turn * f64::from(second_teeth) / 360.0).floor()
}

/// An involute profile with a pressure angle of 20°, a little thinned for backlash. Below the base circle the flanks
/// are radial, as in clocks.
pub fn teeth(module: f64, count: u32, flank_steps: usize) -> Loop {
    let pitch = pitch_radius(module, count);
    let base = pitch * 0.939_692_620_785_908_4;
    let (tip, root) = (pitch + module, pitch - 1.25 * module);
    let involute = |radius: f64| {
        let tangent = libm::sqrt((radius / base) * (radius / base) - 1.0);
        (tangent - libm::atan(tangent)).to_degrees()
    };
    let half_at_pitch = 90.0 / f64::from(count) * 0.94;
    let half_angle = |radius: f64| {
        let free = half_at_pitch + involute(pitch) - involute(radius.max(base));
        free.max(half_at_pitch * 0.12)
    };
    let start = root.max(base);
    let mut flank: Vec<(f64, f64)> = Vec::new();
    if root < base {
        flank.push((root, half_angle(base) * 1.02));
    }
    for i in 0..=flank_steps {
        let radius = start + (tip - start) * i as f64 / flank_steps as f64;
        flank.push((radius, half_angle(radius)));
    }
    let mut points = Vec::new();
    for tooth in 0..count {
        let axis = 360.0 * f64::from(tooth) / f64::from(count);
        points.extend(flank.iter().map(|&(r, half)| polar(r, axis - half)));
        points.extend(flank.iter().rev().map(|&(r, half)| polar(r, axis + half)));
    }
    points
}

/// The gaps between `count` tapering spokes from a hub to a rim, with rounded corners.
pub fn windows(hub: f64, rim: f64, count: u32, spoke_width: f64, fillet: f64) -> Vec<Loop> {
    let field = |p: DVec2| {
        let spoke = (0..count)
            .map(|i| {
                let end = polar(rim + 2.0, 360.0 * (f64::from(i) + 0.5) / f64::from(count));
                distance::bar(p, DVec2::ZERO, end, spoke_width * 0.68, spoke_width * 0.42)
            })
            .fold(f64::INFINITY, f64::min);
        let ring = distance::smooth_intersection(p.length() - rim, hub - p.length(), fillet);
        distance::smooth_intersection(ring, -spoke, fillet)
    };
    let corner = DVec2::splat(rim + 1.0);
    contours(field, -corner, corner, rim / 90.0, 0.015).into_iter().map(|o| o.outer).collect()
}

/// A spoked wheel.
pub struct Wheel {
    /// Module of the teeth.
    pub module: f64,
    /// Number of teeth.
    pub teeth: u32,
    /// Width between root circle and windows.
    pub rim: f64,
    /// Radius of the hub.
    pub hub: f64,
    /// Number of spokes.
    pub spokes: u32,
    /// Width of a spoke half-way along.
    pub spoke_width: f64,
    /// Half the thickness; the wheel lies about z = 0.
    pub half_thickness: f64,
}

impl Wheel {
    /// The wheel with bevelled edges, and a turned hub on both sides.
    pub fn solid(&self) -> Solid {
        let root = pitch_radius(self.module, self.teeth) - 1.25 * self.module;
        let mut outline = Outline::new(teeth(self.module, self.teeth, 3));
        for window in windows(self.hub, root - self.rim, self.spokes, self.spoke_width, 2.2) {
            outline = outline.with_hole(window);
        }
        let h = self.half_thickness;
        let mut solid = extrude(&outline, &beveled(-h, h, self.module * 0.16));
        let boss = extrude(
            &Outline::new(circle(DVec2::ZERO, self.hub * 0.68, 48)),
            &beveled(-h - 0.9, h + 0.9, 0.35),
        );
        solid.append(&boss);
        solid
    }
}

/// A pinion of the given length about z = 0, its ends sloped as turned leaves are.
pub fn pinion(module: f64, leaves: u32, length: f64) -> Solid {
    let half = length / 2.0;
    let outline = Outline::new(teeth(module, leaves, 4));
    let slope = module * 0.22;
    extrude(&outline, &[(slope, -half), (0.0, -half + slope), (0.0, half - slope), (slope, half)])
}

/// A club-toothed escape wheel of 15 teeth.
pub fn escape_wheel(radius: f64, half_thickness: f64) -> Solid {
    // One tooth: (radius as a part of the whole, degrees from the tooth's start).
    let tooth = [
        (0.80, 0.0),
        (0.775, 3.2),
        (0.775, 7.0),
        (0.80, 11.0),
        (0.86, 14.0),
        (0.93, 16.4),
        (0.985, 17.8),
        (1.0, 22.6),
        (0.965, 22.9),
        (0.88, 21.0),
        (0.82, 21.6),
    ];
    let mut outer = Vec::new();
    for i in 0..15 {
        outer.extend(tooth.iter().map(|&(r, degrees)| polar(radius * r, 24.0 * f64::from(i) + degrees)));
    }
    let mut outline = Outline::new(outer);
    for window in windows(radius * 0.2, radius * 0.66, 5, radius * 0.1, 0.8) {
        outline = outline.with_hole(window);
    }
    let h = half_thickness;
    let mut solid = extrude(&outline, &beveled(-h, h, 0.12));
    let boss = Outline::new(circle(DVec2::ZERO, radius * 0.15, 32));
    solid.append(&extrude(&boss, &beveled(-h - 0.8, h + 0.8, 0.25)));
    solid
}
