//! Reads `shape`.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::schema;
use crate::formats::ron::source::{Raw, SceneText, VariantText};
use crate::math::{DVec3, Vec3};
use crate::world::{Shape, check_plane};

const SHAPES: &[&str] = &["Sphere", "Triangle", "Plane", "Mesh"];

impl<'a> Lowering<'_, 'a> {
    pub(super) fn shape(&mut self, raw: Raw<'a>) -> Result<Shape, LoadError> {
        let source = self.source;
        let Some(variant) = source.variant(raw) else {
            return Err(source.expected(raw, &format!("a shape: {}", SHAPES.join(", "))));
        };
        match variant.name {
            "Sphere" => {
                let read: schema::Sphere = source.variant_fields(variant)?;
                let radius_m =
                    read.radius_m.map_or(Ok(1.0), |raw| source.positive(raw, "a sphere's radius"))?;
                Ok(Shape::Sphere { radius_m })
            }
            "Triangle" => triangle(source, variant),
            "Plane" => plane(source, variant),
            "Mesh" => {
                let body = Raw(variant.body.unwrap_or(variant.name));
                let [path] = source.tuple(body, "Mesh(\"path\")")?;
                Ok(Shape::Mesh(self.assets.mesh(source, path, &mut self.world)?))
            }
            other => Err(source.unknown(other, "shape", SHAPES)),
        }
    }
}

fn triangle<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Shape, LoadError> {
    let read: schema::Triangle = source.variant_fields(variant)?;
    let three_vectors = |raw: Raw<'a>| -> Result<[Vec3; 3], LoadError> {
        let [a, b, c] = source.tuple(raw, "three vectors ((x, y, z), (x, y, z), (x, y, z))")?;
        Ok([source.vec3(a)?, source.vec3(b)?, source.vec3(c)?])
    };
    let vertices = three_vectors(read.vertices)?;
    let [a, b, c] = vertices.map(|vertex| vertex.as_dvec3());
    if (b - a).cross(c - a) == DVec3::ZERO {
        return Err(source.error(read.vertices.0, "the triangle has no area: its corners lie on one line"));
    }
    let normals = read.normals.map(three_vectors).transpose()?;
    let uvs = match read.uvs {
        None => None,
        Some(raw) => {
            let [a, b, c] = source.tuple(raw, "three pairs ((u, v), (u, v), (u, v))")?;
            Some([source.vec2(a)?, source.vec2(b)?, source.vec2(c)?])
        }
    };
    Ok(Shape::Triangle { vertices, normals, uvs })
}

fn plane<'a>(source: &SceneText<'a>, variant: VariantText<'a>) -> Result<Shape, LoadError> {
    let read: schema::Plane = source.variant_fields(variant)?;
    let raw_corners: [Raw; 4] =
        source.tuple(read.corners, "four corners ((x, y, z), (x, y, z), (x, y, z), (x, y, z))")?;
    let [a, b, c, d] = raw_corners;
    let corners = [source.vec3(a)?, source.vec3(b)?, source.vec3(c)?, source.vec3(d)?];
    check_plane(corners).map_err(|(corner, reason)| {
        let place = corner.and_then(|index| raw_corners.get(index)).unwrap_or(&read.corners);
        source.error(place.0, reason)
    })?;
    Ok(Shape::Plane { corners })
}
