//! Rays and what they find.

use super::Vector;

/// The points `origin + t * direction` for t_min < t ≤ t_max, one ray a lane.
#[derive(Clone, Copy)]
pub struct Ray<F> {
    /// Where it starts.
    pub origin: Vector<F>,
    /// Of unit length.
    pub direction: Vector<F>,
    /// At least 0.
    pub t_min: F,
    /// Infinity where nothing bounds it.
    pub t_max: F,
}

/// No primitive, no instance.
pub const NONE: u32 = u32::MAX;

/// Where one ray first meets something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Along the ray; infinity for a miss.
    pub t: f32,
    /// Barycentric weight of a triangle's second corner; 0 for a sphere.
    pub u: f32,
    /// Barycentric weight of its third corner.
    pub v: f32,
    /// The primitive's id, [`NONE`] for a miss.
    pub primitive: u32,
    /// The instance it belongs to, [`NONE`] when it is in world space.
    pub instance: u32,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: NONE, instance: NONE };

    /// Whether nothing was hit.
    pub fn is_miss(&self) -> bool {
        self.primitive == NONE
    }
}
