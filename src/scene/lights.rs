//! Compiled lights, in world space.

use crate::math::{Rgb, Vec3};
use crate::sampling::pattern::Grid;
use crate::world::Pattern;

/// One light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// From one point.
    Point {
        /// Where.
        position: Vec3,
        /// Φ/4π, W sr⁻¹.
        intensity: Rgb,
        /// Whether irradiance falls with the square of the distance.
        falloff: bool,
    },
    /// From one point within a cone.
    Spot {
        /// Where.
        position: Vec3,
        /// Φ/4π, W sr⁻¹.
        intensity: Rgb,
        /// Whether irradiance falls with the square of the distance.
        falloff: bool,
        /// Unit vector along the cone's axis, away from the light.
        axis: Vec3,
        /// Cosine of the angle beyond which nothing arrives.
        cos_outer: f32,
        /// 1 / (cosine of the inner angle − cosine of the outer one).
        scale: f32,
    },
    /// Parallel.
    Directional {
        /// Unit vector towards the light.
        to_light: Vec3,
        /// W m⁻² on a surface across it.
        irradiance: Rgb,
    },
    /// A rectangle.
    Area {
        /// One of its corners.
        corner: Vec3,
        /// Along its width.
        edge_u: Vec3,
        /// Along its height.
        edge_v: Vec3,
        /// Unit vector to the side that shines.
        normal: Vec3,
        /// Φ/(πA) · A / N: radiance times the area of one sample, W sr⁻¹.
        intensity: Rgb,
        /// Shadow rays for a hit.
        samples: u32,
        /// The grid of their strata.
        grid: Grid,
        /// How they are spread.
        pattern: Pattern,
    },
}

impl Light {
    /// How many shadow rays a hit sends to it.
    pub fn samples(&self) -> u32 {
        match self {
            Light::Area { samples, .. } => *samples,
            _ => 1,
        }
    }
}
