//! The bodies that contain the camera.

use crate::bvh::{AnyHitFilter, Stack, closest_ray};
use crate::math::{Ray, Vec3, Vector};
use crate::scene::CompiledScene;
use crate::scene::bodies::NOWHERE;
use crate::shading::camera::CameraImage;
use crate::shading::{HitLanes, Surface};
use crate::simd::Isa;

/// The directions of probe rays. A lens or a mesh with holes may let one of them out elsewhere.
const RAYS: [[f32; 3]; 7] = [
    [0.36, 0.48, 0.8],
    [-0.48, 0.8, 0.36],
    [0.8, -0.36, 0.48],
    [-0.36, -0.8, 0.48],
    [0.48, 0.36, -0.8],
    [-0.8, 0.48, -0.36],
    [-0.48, -0.36, -0.8],
];
/// The centre of the lens.
const CENTER: (f32, f32) = (0.0, 0.0);
/// The largest number of surfaces that a ray is followed through.
const MOST: usize = 256;

/// Finds the bodies in which all paths of an image begin ([`crate::scene::Bodies`]). (Those of an orthographic camera
/// begin side by side: the centre, the corners and the midpoints of the edges are checked.)
pub fn find(scene: &CompiledScene, size: [u32; 2]) -> u32 {
    if !scene.materials.iter().any(|material| material.body != 0) {
        return NOWHERE;
    }
    let mut stack = Stack::new(&scene.bvh);
    let image = CameraImage::new(&scene.camera, size);
    let sides = [0.5, 0.0, 1.0];
    let mut places: Vec<_> = sides
        .into_iter()
        .flat_map(|x| sides.map(|y| (x * size[0] as f32, y * size[1] as f32)))
        .map(|place| image.ray(place, place, CENTER).0.origin)
        .collect();
    places.dedup_by_key(|place| [place.x, place.y, place.z].map(f32::to_bits));
    let mut bodies = places.into_iter().map(|place| bodies_around(scene, place, &mut stack));
    let first = bodies.next().unwrap_or(NOWHERE);
    if bodies.all(|bodies| bodies == first) { first } else { NOWHERE }
}

/// Finds the bodies around a place.
pub fn around(scene: &CompiledScene, place: Vec3, stack: &mut Stack) -> u32 {
    if scene.bodies.are_none() {
        return NOWHERE;
    }
    bodies_around(scene, Vector::splat(place), stack)
}

/// Finds the bodies around a place: those that most probe rays leave.
fn bodies_around(scene: &CompiledScene, place: Vector<f32>, stack: &mut Stack) -> u32 {
    let mut left = RAYS.map(|direction| left_by(scene, place, direction, stack));
    let all = left.clone();
    let is_usual = |number: &u32| 2 * all.iter().filter(|left| left.contains(number)).count() > RAYS.len();
    left.iter_mut().for_each(|left| left.retain(is_usual));
    // Rays may pass from body to body in several orders.
    let found = left.into_iter().max_by_key(Vec::len).unwrap_or_default();
    found.iter().rev().fold(NOWHERE, |around, number| scene.bodies.sides(around, *number, 0, false).far)
}

/// Returns the numbers of the bodies that a ray leaves without having entered them.
fn left_by(scene: &CompiledScene, origin: Vector<f32>, direction: [f32; 3], stack: &mut Stack) -> Vec<u32> {
    let [x, y, z] = direction;
    let (mut entered, mut left) = (Vec::new(), Vec::new());
    for Crossed { number, entity, inside } in crossed(scene, origin, Vector::new(x, y, z), stack) {
        let body = (number, entity);
        if !inside {
            entered.push(body);
        } else if let Some(place) = entered.iter().rposition(|other| *other == body) {
            entered.remove(place);
        } else {
            left.push(number);
        }
    }
    left
}

/// A surface of a body that a ray crosses.
pub struct Crossed {
    /// The body's number.
    pub number: u32,
    /// The number of its entity.
    pub entity: u32,
    /// True if the ray leaves the body at this surface.
    pub inside: bool,
}

/// Returns the surfaces of bodies that a ray crosses, ignoring all others.
pub fn crossed(
    scene: &CompiledScene,
    origin: Vector<f32>,
    direction: Vector<f32>,
    stack: &mut Stack,
) -> Vec<Crossed> {
    let direction = direction.normalize();
    let mut ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    let mut crossed = Vec::new();
    for _ in 0..MOST {
        let hit = closest_ray(Isa::detect(), &scene.bvh, &ray, AnyHitFilter::ACCEPT_ALL, stack);
        if hit.is_miss() {
            break;
        }
        ray.t_min = hit.t;
        let surface = Surface::new(&scene.geometry, &ray, &HitLanes::one(&hit), true);
        let material = scene.geometry.material_of(hit.primitive, hit.instance);
        let number = scene.materials[material as usize].body;
        if number != 0 {
            let entity = scene.geometry.entity_of(hit.primitive, hit.instance);
            crossed.push(Crossed { number, entity, inside: surface.inside });
        }
    }
    crossed
}
