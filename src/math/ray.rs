//! Rays and hits.

use std::fmt;

use super::Vector;

/// A ray in each lane: the points `origin + t * direction` for t_min < t ≤ t_max.
#[derive(Clone, Copy)]
pub struct Ray<F> {
    /// The origin.
    pub origin: Vector<F>,
    /// The direction, of unit length.
    pub direction: Vector<F>,
    /// The lower end of the interval of t, exclusive; at least 0.
    pub t_min: F,
    /// The upper end of the interval of t, inclusive; infinity if the ray is unbounded.
    pub t_max: F,
}

/// The id that stands for no primitive or no instance.
pub const NONE: u32 = u32::MAX;

/// The closest hit of one ray, or a miss.
#[derive(Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction; infinity for a miss.
    pub t: f32,
    /// Barycentric weight of a triangle's second corner, 0 to 1; 0 for a sphere and for a miss.
    pub u: f32,
    /// Barycentric weight of a triangle's third corner, 0 to 1; 0 for a sphere and for a miss.
    pub v: f32,
    /// The primitive's id; [`NONE`] for a miss.
    pub primitive: u32,
    /// The id of the primitive's instance; [`NONE`] for a miss and for a primitive in world space.
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
    /// A miss.
    pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: NONE, instance: NONE };

    /// True if nothing was hit.
    pub fn is_miss(&self) -> bool {
        self.primitive == NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hit_prints_an_absent_id_as_none() {
        let hit = Hit { t: 1.5, u: 0.0, v: 0.25, primitive: 3, instance: NONE };
        assert_eq!(format!("{hit:?}"), "Hit { t: 1.5, u: 0.0, v: 0.25, primitive: 3, instance: NONE }");
        assert!(format!("{:?}", Hit::MISS).contains("primitive: NONE"));
        assert!(format!("{:?}", Hit { instance: 7, ..hit }).contains("instance: 7"));
    }
}
