//! Rays and what they find.

use std::fmt;

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

/// The id that stands for no primitive or no instance.
pub const NONE: u32 = u32::MAX;

/// The nearest hit of one ray, or a miss.
#[derive(Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction; infinity for a miss.
    pub t: f32,
    /// Barycentric weight of a triangle's second corner, 0 to 1; 0 for a sphere and for a miss.
    pub u: f32,
    /// Barycentric weight of its third corner, likewise.
    pub v: f32,
    /// The primitive's id, [`NONE`] for a miss.
    pub primitive: u32,
    /// The id of the instance that it belongs to; [`NONE`] if it lies in world space, and for a miss.
    pub instance: u32,
}

impl fmt::Debug for Hit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Hit { t, u, v, primitive, instance } = *self;
        let [primitive, instance] = [primitive, instance].map(|id| match id {
            NONE => "NONE".to_owned(),
            id => id.to_string(),
        });
        write!(f, "Hit {{ t: {t:?}, u: {u:?}, v: {v:?}, primitive: {primitive}, instance: {instance} }}")
    }
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: NONE, instance: NONE };

    /// Whether nothing was hit.
    pub fn is_miss(&self) -> bool {
        self.primitive == NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_absence_of_an_instance_is_not_printed_as_a_number() {
        let hit = Hit { t: 1.5, u: 0.0, v: 0.25, primitive: 3, instance: NONE };
        assert_eq!(format!("{hit:?}"), "Hit { t: 1.5, u: 0.0, v: 0.25, primitive: 3, instance: NONE }");
        assert!(format!("{:?}", Hit::MISS).contains("primitive: NONE"));
        assert!(format!("{:?}", Hit { instance: 7, ..hit }).contains("instance: 7"));
    }
}
