//! Crossings of rays with surfaces: whether anything is there.

use super::point::{Tables, coverage};
use super::surface::{HitLanes, Surface};
use super::texture_coordinates::point_coordinates;
use crate::bvh::layout::sidedness::SPHERE;
use crate::bvh::{Crossing, FaceCulling};
use crate::math::{Hit, Ray};
use crate::scene::{CompiledScene, MaterialRecord};

/// Returns the material at a crossing, if it has a side that the ray meets.
pub fn crossed<'a>(
    scene: &'a CompiledScene,
    crossing: &Crossing,
    culling: FaceCulling,
) -> Option<&'a MaterialRecord> {
    let Hit { primitive, instance, .. } = crossing.hit;
    let material = &scene.materials[scene.geometry.material_of(primitive, instance) as usize];
    let front = crossing.front != scene.geometry.is_mirrored(primitive);
    let shows = match culling {
        FaceCulling::AsBuilt => material.has_side(front),
        FaceCulling::Opposite => material.has_side(!front),
        FaceCulling::Off => material.has_side(true),
    };
    shows.then_some(material)
}

/// The coverage of the surface of a material at a crossing. The ray is asked for only where a sphere is crossed.
pub fn coverage_at(
    scene: &CompiledScene,
    material: &MaterialRecord,
    crossing: &Crossing,
    ray: impl FnOnce() -> Ray<f32>,
) -> f32 {
    let Hit { u, v, primitive, .. } = crossing.hit;
    let hit = HitLanes::one(&crossing.hit);
    let uv = match primitive & SPHERE {
        0 => (u, v),
        _ => Surface::new(&scene.geometry, &ray(), &hit, true).uv,
    };
    let at = point_coordinates(&scene.geometry, &hit, uv, true);
    let tables = Tables { geometry: &scene.geometry, textures: &scene.textures };
    coverage(material, tables, &hit, &at, true)
}
