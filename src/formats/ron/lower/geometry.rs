//! `shape`.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::schema;
use crate::formats::ron::source::{Raw, Source, Variant};
use crate::math::{DVec3, Vec3};
use crate::world::Shape;

const SHAPES: &[&str] = &["Sphere", "Triangle", "Plane", "Mesh"];
/// How far a plane's corners may be from one plane, over its diameter.
const PLANAR: f64 = 1e-4;
/// Sine of the angle at a corner below which its edges count as one line.
const STRAIGHT: f64 = 1e-9;

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

fn triangle<'a>(source: &Source<'a>, variant: Variant<'a>) -> Result<Shape, LoadError> {
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

fn plane<'a>(source: &Source<'a>, variant: Variant<'a>) -> Result<Shape, LoadError> {
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

/// Whether the corners go around a flat convex quadrilateral; else what is wrong and at
/// which of them.
fn check_plane(corners: [Vec3; 4]) -> Result<(), (Option<usize>, String)> {
    let [a, b, c, d] = corners.map(|corner| corner.as_dvec3());
    // Twice the area, along the normal: what the two diagonals span.
    let normal = (c - a).cross(d - b);
    let diameter =
        [b - a, c - a, d - a, c - b, d - b, d - c].map(DVec3::length).into_iter().fold(0.0, f64::max);
    if normal.length() <= STRAIGHT * diameter * diameter {
        return Err((None, "the plane has no area: give its corners in order around it".to_owned()));
    }
    let normal = normal / normal.length();
    let centre = (a + b + c + d) / 4.0;
    for (index, corner) in [a, b, c, d].into_iter().enumerate() {
        let distance = (corner - centre).dot(normal).abs();
        if distance > PLANAR * diameter {
            let reason = format!(
                "the corners are not in one plane (this one is {distance:.3e} m off): move it or use two triangles"
            );
            return Err((Some(index), reason));
        }
    }
    for (index, [before, at, after]) in [[d, a, b], [a, b, c], [b, c, d], [c, d, a]].into_iter().enumerate() {
        let (incoming, outgoing) = (at - before, after - at);
        if incoming.cross(outgoing).dot(normal) <= STRAIGHT * incoming.length() * outgoing.length() {
            let reason = "the plane is not convex at this corner: give the corners in order around it, \
                          or use two triangles";
            return Err((Some(index), reason.to_owned()));
        }
    }
    Ok(())
}
