//! A mesh file by itself: put before a camera that sees all of it, in plain light.

use std::path::Path;

use super::{AssetFiles, Files};
use crate::error::LoadError;
use crate::math::{Aabb, DMat3, DVec3, Quat, Rgb, Vec3};
use crate::world::{Background, Camera, Light, Name, Shape, Transform, World};

/// Loads a mesh and adds what is missing to see it.
pub(super) fn load(path: &Path) -> Result<World, LoadError> {
    let mut world = World::default();
    let mut mesh = Files.mesh(path, &mut world.assets, &mut world.warnings)?;
    mesh.source = Some(path.to_owned());
    let bounds = Aabb::around(mesh.triangles.as_flattened().iter().map(|v| mesh.positions[*v as usize]));
    let id = world.assets.add_mesh(mesh);
    world.entities.spawn((Name("mesh".into()), Transform::IDENTITY, Shape::Mesh(id)));
    frame(&mut world, bounds);
    world.warnings.push("a mesh by itself: camera and light were added".into());
    Ok(world)
}

/// A camera from the front, right and above, and a key and a fill light from beside it.
fn frame(world: &mut World, bounds: Aabb) {
    let half_fov = 20f64.to_radians();
    let center = bounds.center().as_dvec3();
    let radius = (bounds.size().as_dvec3().length() * 0.5).max(1e-6);
    let towards = DVec3::new(0.45, 0.35, 1.0).normalize();
    let distance = 1.05 * radius / libm::sin(half_fov);
    let looking = |from: DVec3| looking_along(-from.normalize(), center + from.normalize() * distance);
    let camera = Camera::Pinhole { vertical_fov: (2.0 * half_fov) as f32 };
    world.entities.spawn((Name("camera".into()), camera, looking(towards)));
    let sun = |irradiance: f32| Light::Directional { irradiance: Rgb::splat(irradiance) };
    world.entities.spawn((Name("key".into()), sun(0.75), looking(DVec3::new(1.2, 1.6, 0.9))));
    world.entities.spawn((Name("fill".into()), sun(0.25), looking(DVec3::new(-1.5, 0.4, 0.8))));
    world.settings.ambient = Rgb::splat(0.15);
    world.settings.background =
        Background::Gradient { bottom: Rgb::splat(0.25), top: Rgb::new(0.55, 0.6, 0.65) };
}

/// −Z along a unit direction, +Y up.
fn looking_along(direction: DVec3, place: DVec3) -> Transform {
    let right = direction.cross(DVec3::Y).normalize();
    let axes = DMat3::from_cols(right, right.cross(direction), -direction);
    let rotation = glam::DQuat::from_mat3(&axes).normalize();
    let rotation = Quat::from_array(rotation.to_array().map(|c| c as f32));
    Transform::Trs { translation: place.as_vec3(), rotation, scale: Vec3::ONE }
}
