//! A mesh or model by itself gets what it lacks to be seen: a camera that sees all of it,
//! and plain light.

use std::path::Path;

use super::names::Names;
use super::{AssetFiles, Files};
use crate::error::LoadError;
use crate::math::{Aabb, DMat3, DVec3, Quat, Rgb, Vec3};
use crate::world::{Background, Camera, Light, Model, Name, Shape, Transform, World};

/// Loads a mesh and adds camera and light.
pub(super) fn load_mesh(path: &Path) -> Result<World, LoadError> {
    let mut world = World::default();
    let mut mesh = Files.mesh(path, &mut world.assets, &mut world.warnings)?;
    mesh.source = Some(path.to_owned());
    let bounds = Aabb::around(mesh.triangles.as_flattened().iter().map(|v| mesh.positions[*v as usize]));
    let id = world.assets.add_mesh(mesh);
    world.entities.spawn((Name("mesh".into()), Transform::IDENTITY, Shape::Mesh(id)));
    complete(&mut world, bounds);
    Ok(world)
}

/// Loads a model and adds camera and light where it has none.
pub(super) fn load_model(path: &Path) -> Result<World, LoadError> {
    let mut world = World::default();
    let model = Files.model(path, &mut world.assets, &mut world.warnings)?;
    let root = world.entities.spawn((Transform::IDENTITY, Model(path.to_owned())));
    model.place(&mut world, Some(root));
    complete(&mut world, model.bounds);
    Ok(world)
}

/// Adds a camera and light if there are none, each with a warning. `bounds` hold all shapes.
fn complete(world: &mut World, bounds: Aabb) {
    let bounds = if bounds.is_empty() { Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE } } else { bounds };
    let center = bounds.center().as_dvec3();
    let radius = (bounds.size().as_dvec3().length() * 0.5).max(1e-6);
    if world.entities.query::<&Camera>().iter().next().is_none() {
        add_camera(world, center, radius);
        world.warnings.push("there is no camera: one that sees everything was added".into());
    }
    if world.entities.query::<&Light>().iter().next().is_none() {
        add_light(world, center, radius);
        world.warnings.push("there is no light: key, fill and ambient light were added".into());
    }
}

const HALF_FOV_DEGREES: f64 = 20.0;

/// From the front, right and above.
fn add_camera(world: &mut World, center: DVec3, radius: f64) {
    let half_fov = HALF_FOV_DEGREES.to_radians();
    let distance = 1.05 * radius / libm::sin(half_fov);
    let place = looking_at(center, DVec3::new(0.45, 0.35, 1.0), distance);
    let camera = Camera::Pinhole { vertical_fov: (2.0 * half_fov) as f32 };
    let name = Names::of(world).unique("camera");
    world.entities.spawn((name, camera, place));
}

/// A key light on the right and a fill light on the left of who stands before it.
fn add_light(world: &mut World, center: DVec3, radius: f64) {
    let mut names = Names::of(world);
    let mut sun = |name: &str, irradiance: f32, from: DVec3| {
        let light = Light::Directional { irradiance: Rgb::splat(irradiance), angle: 0.0 };
        world.entities.spawn((names.unique(name), light, looking_at(center, from, 2.0 * radius)));
    };
    sun("key", 0.75, DVec3::new(1.2, 1.6, 0.9));
    sun("fill", 0.25, DVec3::new(-1.5, 0.4, 0.8));
    world.settings.ambient = Rgb::splat(0.15);
    world.settings.background =
        Background::Gradient { bottom: Rgb::splat(0.25), top: Rgb::new(0.55, 0.6, 0.65) };
}

/// −Z towards a point, seen from a distance in some direction, +Y up.
fn looking_at(center: DVec3, from: DVec3, distance: f64) -> Transform {
    let backward = from.normalize();
    let right = DVec3::Y.cross(backward).normalize();
    let axes = DMat3::from_cols(right, backward.cross(right), backward);
    let rotation = glam::DQuat::from_mat3(&axes).normalize();
    let rotation = Quat::from_array(rotation.to_array().map(|c| c as f32));
    Transform::Trs { translation: (center + backward * distance).as_vec3(), rotation, scale: Vec3::ONE }
}
