//! Rays from emitters, as starts of photon paths. One ray at a time.

use std::num::Wrapping;

use super::emitter::{self, cone_part, patterned_light, planar_place};
use super::surface::{HitLanes, sphere_uv};
use crate::bvh::layout::sidedness::SPHERE;
use crate::math::{Color, NONE, Vector};
use crate::scene::CompiledScene;
use crate::scene::emitter_rows::{AnyRow, ConeRow, PlanarRow, PointRow};
use crate::scene::emitters::{flag, kind};

/// A point on an emitter with area.
pub struct EmitterPoint {
    /// The point in world space.
    pub position: Vector<f32>,
    /// Unit normal of the emitter's front.
    pub normal: Vector<f32>,
    /// The coordinates along both edges, as fractions from the corner.
    uv: (f32, f32),
}

/// The area of a triangle, a parallelogram or a disc; 0 for all other emitters.
pub fn area(scene: &CompiledScene, emitter: u32) -> f32 {
    let (what, row) = scene.emitters.row(emitter);
    let part = match what {
        kind::TRIANGLE => 0.5,
        kind::QUAD if scene.emitters.flags[emitter as usize] & flag::ROUND != 0 => {
            std::f32::consts::FRAC_PI_4
        }
        kind::QUAD => 1.0,
        _ => 0.0,
    };
    let (e1, e2) = (PlanarRow::e1::<f32>(row), PlanarRow::e2(row));
    e1.cross(e2).length() * part
}

/// Samples a point of a flat emitter, uniformly by area.
pub fn point_of(scene: &CompiledScene, emitter: u32, u: (f32, f32)) -> EmitterPoint {
    let (what, row) = scene.emitters.row(emitter);
    let flags = scene.emitters.flags[emitter as usize];
    let (a, b) = planar_place(what == kind::TRIANGLE, flags & flag::ROUND != 0, u);
    let (e1, e2) = (PlanarRow::e1::<f32>(row), PlanarRow::e2(row));
    let normal = e1.cross(e2).normalize();
    EmitterPoint {
        position: PlanarRow::corner(row) + e1 * a + e2 * b,
        normal: if flags & flag::REVERSED != 0 { -normal } else { normal },
        uv: (a, b),
    }
}

/// The radiance that a point of a flat emitter emits in a direction.
pub fn radiance_of(
    scene: &CompiledScene,
    emitter: u32,
    point: &EmitterPoint,
    direction: Vector<f32>,
) -> Color<f32> {
    let flags = scene.emitters.flags[emitter as usize];
    if flags & flag::TWO_SIDED == 0 && point.normal.dot(direction) <= 0.0 {
        return Color::black();
    }
    let primitive = scene.emitters.primitive[emitter as usize];
    radiance_at(scene, emitter, primitive, point.uv)
}

/// The radiance of an emitting sphere's outside at the point with a unit normal.
pub fn radiance_of_sphere(
    scene: &CompiledScene,
    emitter: u32,
    normal: Vector<f32>,
    direction: Vector<f32>,
) -> Color<f32> {
    if is_even(scene, emitter) {
        let row = scene.emitters.row(emitter).1;
        let has_cone = scene.emitters.flags[emitter as usize] & flag::CONE != 0;
        let part = if has_cone { cone_part(row, direction.dot(ConeRow::axis(row))) } else { 1.0 };
        return AnyRow::light::<f32>(row) * part;
    }
    let primitive = scene.emitters.primitive[emitter as usize];
    let uv = sphere_uv(&scene.geometry, Wrapping(primitive ^ SPHERE), normal, true);
    radiance_at(scene, emitter, primitive, uv)
}

/// True if all points of an emitter emit the same.
fn is_even(scene: &CompiledScene, emitter: u32) -> bool {
    scene.emitters.flags[emitter as usize] & (flag::TEXTURED | flag::COVERED) == 0
}

fn radiance_at(scene: &CompiledScene, emitter: u32, primitive: u32, uv: (f32, f32)) -> Color<f32> {
    if is_even(scene, emitter) {
        return AnyRow::light(scene.emitters.row(emitter).1);
    }
    let primitive = Wrapping(primitive);
    let hit = HitLanes { t: 0.0, u: uv.0, v: uv.1, primitive, instance: Wrapping(NONE) };
    patterned_light(scene, Wrapping(emitter), &hit, uv, true)
}

/// The intensity of a point light, a spotlight or a photometric light in a direction: that of a light sample a metre
/// away.
pub fn intensity(scene: &CompiledScene, emitter: u32, direction: Vector<f32>) -> Color<f32> {
    let place = PointRow::position::<f32>(scene.emitters.row(emitter).1);
    emitter::sample_light(scene, emitter, place + direction, (0.0, 0.0)).radiance
}
