//! Reads the corners of flat shapes.

use crate::error::LoadError;
use crate::formats::ron::source::{Raw, SceneText};
use crate::math::{DVec3, Vec3};
use crate::world::check_plane;

impl<'a> SceneText<'a> {
    /// `((x, y, z), (x, y, z), (x, y, z))`.
    pub(super) fn three_vectors(&self, raw: Raw<'a>) -> Result<[Vec3; 3], LoadError> {
        let [a, b, c] = self.tuple(raw, "three vectors ((x, y, z), (x, y, z), (x, y, z))")?;
        Ok([self.vec3(a)?, self.vec3(b)?, self.vec3(c)?])
    }

    /// The corners of a triangle, which must have an area.
    pub(super) fn triangle(&self, raw: Raw<'a>) -> Result<[DVec3; 3], LoadError> {
        let [a, b, c] = self.tuple(raw, "three corners ((x, y, z), (x, y, z), (x, y, z))")?;
        let [a, b, c] = [self.point(a)?, self.point(b)?, self.point(c)?];
        if (b - a).cross(c - a) == DVec3::ZERO {
            return Err(self.error(raw.0, "the triangle has no area: its corners lie on one line"));
        }
        Ok([a, b, c])
    }

    /// The corners of a quadrilateral, which must be flat and convex.
    pub(super) fn quadrilateral(&self, raw: Raw<'a>) -> Result<[DVec3; 4], LoadError> {
        let raw_corners: [Raw; 4] =
            self.tuple(raw, "four corners ((x, y, z), (x, y, z), (x, y, z), (x, y, z))")?;
        let [a, b, c, d] = raw_corners;
        let corners = [self.point(a)?, self.point(b)?, self.point(c)?, self.point(d)?];
        check_plane(corners).map_err(|(corner, reason)| {
            let place = corner.and_then(|index| raw_corners.get(index)).unwrap_or(&raw);
            self.error(place.0, reason)
        })?;
        Ok(corners)
    }
}
