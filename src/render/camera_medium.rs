//! The body that the camera is in.

use crate::bvh::{Asker, Stack, closest_ray};
use crate::math::{NONE, Ray, Vec3, Vector};
use crate::scene::{CompiledScene, Material};
use crate::shading::{HitLanes, Surface, camera};
use crate::simd::Level;

/// Rays that ask for it. A lens or a mesh with holes may let one of them out elsewhere.
const RAYS: [[f32; 3]; 7] = [
    [0.36, 0.48, 0.8],
    [-0.48, 0.8, 0.36],
    [0.8, -0.36, 0.48],
    [-0.36, -0.8, 0.48],
    [0.48, 0.36, -0.8],
    [-0.8, 0.48, -0.36],
    [-0.48, -0.36, -0.8],
];
/// The middle of a lens.
const CENTER: (f32, f32) = (0.0, 0.0);
/// The most surfaces that a ray is followed through.
const MOST: usize = 256;

/// The material of the body that all paths of an image begin in, or [`NONE`] if there is none that does anything to
/// light. (Those of an orthographic camera begin side by side: the middle, the corners and the middles of the edges are
/// looked at.)
pub fn find(scene: &CompiledScene, size: [u32; 2]) -> u32 {
    if !scene.materials.iter().any(Material::fills) {
        return NONE;
    }
    let mut stack = Stack::new(&scene.bvh);
    let aspect = size[0] as f32 / size[1] as f32;
    let sides = [0.0, -1.0, 1.0];
    let mut places: Vec<_> = sides
        .into_iter()
        .flat_map(|x| sides.map(|y| camera::ray::<f32>(&scene.camera, x * aspect, y, CENTER).origin))
        .collect();
    places.dedup_by_key(|place| [place.x, place.y, place.z].map(f32::to_bits));
    let mut bodies = places.into_iter().map(|place| body_around(scene, place, &mut stack));
    let first = bodies.next().unwrap_or(NONE);
    if bodies.all(|body| body == first) { first } else { NONE }
}

/// The material of the body around a place, if it does anything to light.
pub fn around(scene: &CompiledScene, place: Vec3, stack: &mut Stack) -> u32 {
    if !scene.materials.iter().any(Material::fills) {
        return NONE;
    }
    body_around(scene, Vector::new(place.x, place.y, place.z), stack)
}

/// The material of the body around a place, as most of some rays find it.
fn body_around(scene: &CompiledScene, place: Vector<f32>, stack: &mut Stack) -> u32 {
    let mut found = RAYS.map(|direction| left_by(scene, place, direction, stack));
    found.sort_unstable();
    // What more than half of them say is in the middle.
    let middle = found[RAYS.len() / 2];
    let votes = found.iter().filter(|material| **material == middle).count();
    if 2 * votes > RAYS.len() { middle } else { NONE }
}

/// The body that a ray leaves first without having entered it, if that acts on light.
fn left_by(scene: &CompiledScene, origin: Vector<f32>, direction: [f32; 3], stack: &mut Stack) -> u32 {
    let [x, y, z] = direction;
    let direction = Vector::new(x, y, z).normalize();
    let mut ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    let mut entered = Vec::new();
    for _ in 0..MOST {
        let hit = closest_ray(Level::detect(), &scene.bvh, &ray, Asker::CREDULOUS, stack);
        if hit.is_miss() {
            break;
        }
        ray.t_min = hit.t;
        let lane = HitLanes::one(&hit);
        let surface = Surface::new(&scene.geometry, &ray, &lane, true);
        let material = scene.geometry.material_of(hit.primitive, hit.instance);
        let record = &scene.materials[material as usize];
        if !record.encloses {
            continue;
        }
        let body = (material, scene.geometry.entity_of(hit.primitive, hit.instance));
        if !surface.inside {
            entered.push(body);
        } else if let Some(place) = entered.iter().rposition(|other| *other == body) {
            entered.remove(place);
        } else {
            return if record.fills() { material } else { NONE };
        }
    }
    NONE
}
