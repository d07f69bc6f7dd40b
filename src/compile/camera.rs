//! The camera entity to the compiled camera.

use hecs::Entity;

use super::transforms::{WorldTransforms, direction, point};
use crate::error::CompileError;
use crate::math::Vec3;
use crate::scene::{Camera, Projection};
use crate::world::{self, World};

/// Names of all cameras in the order of the world.
pub fn camera_names(world: &World) -> Vec<String> {
    let cameras = world.in_order().into_iter().filter(|e| world.entities.get::<&world::Camera>(*e).is_ok());
    cameras.map(|e| world.name_of(e)).collect()
}

pub(super) fn compile(
    world: &World,
    order: &[Entity],
    transforms: &WorldTransforms,
    name: Option<&str>,
) -> Result<Camera, CompileError> {
    let mut cameras = order.iter().filter_map(|&entity| {
        let camera = world.entities.get::<&world::Camera>(entity).ok()?;
        Some((entity, *camera))
    });
    let found = match name {
        None => cameras.next().ok_or(CompileError::NoCamera)?,
        Some(name) => cameras.find(|(entity, _)| world.name_of(*entity) == name).ok_or_else(|| {
            let known = camera_names(world);
            let known = if known.is_empty() { "none".into() } else { known.join(", ") };
            CompileError::UnknownCamera { name: name.into(), known }
        })?,
    };
    let matrix = &transforms[&found.0];
    // Only place and direction count; a scale would otherwise bend the angle of view.
    let forward = direction(matrix, Vec3::NEG_Z);
    let up = direction(matrix, Vec3::Y).as_dvec3();
    let right = forward.as_dvec3().cross(up).normalize();
    let right = right * matrix.matrix3.determinant().signum();
    let up = right.cross(forward.as_dvec3()) * matrix.matrix3.determinant().signum();
    let tangent = |fov: f32| libm::tan(fov as f64 * 0.5) as f32;
    Ok(Camera {
        origin: point(matrix, Vec3::ZERO),
        right: right.as_vec3(),
        up: up.normalize().as_vec3(),
        forward,
        projection: match found.1 {
            world::Camera::Pinhole { vertical_fov } => {
                Projection::Pinhole { tan_half_fov: tangent(vertical_fov) }
            }
            world::Camera::ThinLens { vertical_fov, lens_radius_m, focus_distance_m, pattern } => {
                Projection::ThinLens {
                    tan_half_fov: tangent(vertical_fov),
                    lens_radius: lens_radius_m,
                    focus_distance: focus_distance_m,
                    pattern,
                }
            }
            world::Camera::Orthographic { height_m } => {
                Projection::Orthographic { half_height: height_m * 0.5 }
            }
        },
    })
}
