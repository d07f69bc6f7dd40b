//! Bounds of lights in double precision, from which nodes of the tree are made: a box, a cone of normals, a power.

use std::f64::consts::PI;

use super::LightBounds;
use crate::math::{Aabb, DVec3, Vec3};
use crate::scene::light_tree::{FAR, LightNode};

/// Cones are widened by this angle, and spheres by this part, to allow for rounding.
const SLACK: f64 = 1e-5;

/// [`LightBounds`] of one light or many, in double precision, angles in radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct WideBounds {
    pub(super) min: DVec3,
    pub(super) max: DVec3,
    pub(super) far: bool,
    pub(super) power: f64,
    pub(super) cone: DirectionCone,
    pub(super) emission: f64,
    pub(super) cos_emission: f64,
    pub(super) two_sided: bool,
    /// See [`LightBounds::outside`].
    pub(super) outside: f64,
}

/// The directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct DirectionCone {
    pub(super) axis: DVec3,
    pub(super) spread: f64,
    /// Its cosine, stored because trigonometry takes most of the time for large numbers of lights.
    pub(super) cos: f64,
}

impl DirectionCone {
    fn new(axis: DVec3, spread: f64) -> Self {
        if spread < PI { Self { axis, spread, cos: libm::cos(spread) } } else { Self::all(axis) }
    }

    fn all(axis: DVec3) -> Self {
        Self { axis, spread: PI, cos: -1.0 }
    }

    /// The narrowest cone around both (PBRT 3.8.4).
    fn union(&self, other: &Self) -> Self {
        let (a, b) = (self.axis, other.axis);
        if self.spread >= PI || other.spread >= PI {
            return Self::all(a);
        }
        let cos = a.dot(b);
        if other.spread == 0.0 && cos >= self.cos {
            return *self;
        }
        let sin = a.cross(b).length();
        let between = libm::atan2(sin, cos);
        if between + other.spread <= self.spread {
            return *self;
        }
        if between + self.spread <= other.spread {
            return *other;
        }
        let spread = 0.5 * (self.spread + between + other.spread);
        if sin < 1e-9 {
            // Parallel within rounding, or opposite: then any perpendicular axis would do.
            return if cos > 0.0 { Self::new(a, spread + SLACK) } else { Self::all(a) };
        }
        let turn = spread - self.spread;
        let axis = a * libm::sin(between - turn) + b * libm::sin(turn);
        Self::new(axis.normalize(), spread)
    }
}

impl WideBounds {
    /// The bounds of no light. Like lights without power, they widen nothing.
    pub(super) const NONE: WideBounds = WideBounds {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
        far: false,
        power: 0.0,
        cone: DirectionCone { axis: DVec3::Z, spread: 0.0, cos: 1.0 },
        emission: 0.0,
        cos_emission: 1.0,
        two_sided: false,
        outside: 0.0,
    };

    pub(super) fn new(light: &LightBounds) -> Self {
        let around = if light.far { Aabb { min: Vec3::ZERO, max: Vec3::ZERO } } else { light.bounds };
        let (min, max) = (around.min.as_dvec3(), around.max.as_dvec3());
        let power = light.power as f64;
        if !(min.is_finite() && max.is_finite() && power.is_finite() && power > 0.0) || around.is_empty() {
            return Self { min: DVec3::ZERO, max: DVec3::ZERO, far: light.far, ..Self::NONE };
        }
        let axis = light.axis.as_dvec3();
        let length = axis.length();
        let directed = length > 0.0 && length.is_finite();
        let angle = |cos: f32| libm::acos(cos.clamp(-1.0, 1.0) as f64);
        Self {
            min,
            max,
            far: light.far,
            power,
            cone: if directed {
                DirectionCone::new(axis / length, angle(light.cos_spread))
            } else {
                DirectionCone::all(DVec3::Z)
            },
            emission: angle(light.cos_emission),
            cos_emission: light.cos_emission.clamp(-1.0, 1.0) as f64,
            two_sided: light.two_sided,
            outside: f64::from(light.outside),
        }
    }

    pub(super) fn union(&self, other: &Self) -> Self {
        if other.power == 0.0 {
            return *self;
        }
        if self.power == 0.0 {
            return *other;
        }
        // The normals of a two-sided light may be reversed.
        let turned = if other.two_sided && self.cone.axis.dot(other.cone.axis) < 0.0 {
            DirectionCone { axis: -other.cone.axis, ..other.cone }
        } else {
            other.cone
        };
        let wider = if other.emission > self.emission { other } else { self };
        let power = self.power + other.power;
        let two_sided = self.two_sided | other.two_sided;
        let outside = (self.outside * self.power + other.outside * other.power) / power;
        // A node stores only one of the two.
        let everywhere = two_sided && outside > 0.0;
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            far: self.far,
            power,
            cone: self.cone.union(&turned),
            emission: if everywhere { PI } else { wider.emission },
            cos_emission: if everywhere { -1.0 } else { wider.cos_emission },
            two_sided,
            outside: if everywhere { 0.0 } else { outside },
        }
    }

    pub(super) fn node(&self, scale: f64, next: u32) -> LightNode {
        let center = ((self.min + self.max) * 0.5).as_vec3();
        let reach = (self.max - center.as_dvec3()).max(center.as_dvec3() - self.min);
        let spread = (self.cone.spread + SLACK).min(PI);
        let power = if self.power > 0.0 { (self.power * scale).max(1e-30) } else { 0.0 };
        let radius_square = (reach.length_squared() * (1.0 + SLACK)) as f32;
        LightNode {
            center: center.to_array(),
            radius_square: if self.far { FAR } else { radius_square },
            axis: self.cone.axis.as_vec3().to_array(),
            cos_spread: libm::cos(spread) as f32,
            sin_spread: libm::sin(spread) as f32,
            cos_emission: libm::cos((self.emission + SLACK).min(PI)) as f32,
            power: power as f32,
            sides: if self.two_sided { 1.0 } else { -self.outside as f32 },
            next,
            half: reach.as_vec3().to_array(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use rand::RngExt;

    #[test]
    fn union_of_cones_contains_both() {
        let mut stream = Stream::new(3);
        for round in 0..5000 {
            let mut cone = || {
                let axis = DVec3::from_array([0; 3].map(|_| stream.random_range(-1.0..1.0)));
                let spread = if round % 3 == 0 { 0.0 } else { stream.random_range(0.0..3.0) };
                DirectionCone::new(axis.normalize(), spread)
            };
            let (a, b) = (cone(), cone());
            let both = a.union(&b);
            for part in [a, b] {
                let between = libm::acos(part.axis.dot(both.axis).clamp(-1.0, 1.0));
                assert!(between + part.spread <= both.spread + 1e-7 || both.spread >= PI);
            }
        }
    }
}
