//! The components of an entity.

use super::Written;
use super::assets::AssetPaths;
use super::number::{Keys, color, degrees, number, pairs, same, tuple, uniform_or_tuple, vectors};
use crate::math::{Mat4, Rgb, Vec3};
use crate::world::{Camera, Falloff, Light, Outline, Pattern, Shape, Transform};

/// None for the identity, which need not be said.
pub(super) fn transform(transform: &Transform) -> Written<Option<String>> {
    match transform {
        Transform::Matrix(matrix) => affine(matrix).map(Some),
        Transform::Trs { translation, rotation, scale } => {
            let [translation, scale] = [translation.to_array(), scale.to_array()];
            let rotation = rotation.to_array();
            let mut keys = Keys::default();
            keys.push_unless(same(&translation, &[0.0; 3]), "translate", || tuple(&translation))?;
            let is_default = same(&rotation, &[0.0, 0.0, 0.0, 1.0]);
            keys.push_unless(is_default, "rotate_quaternion", || tuple(&rotation))?;
            keys.push_unless(same(&scale, &[1.0; 3]), "scale", || uniform_or_tuple(&scale))?;
            let written = keys.finish("");
            Ok((written != "()").then_some(written))
        }
    }
}

pub(super) fn look_at(from: Vec3, to: Vec3, up: Vec3) -> Written {
    let mut keys = Keys::default();
    keys.push("from", tuple(&from.to_array())?);
    keys.push("to", tuple(&to.to_array())?);
    keys.push_unless(same(&up.to_array(), &Vec3::Y.to_array()), "up", || tuple(&up.to_array()))?;
    Ok(keys.finish("LookAt"))
}

fn affine(matrix: &Mat4) -> Written {
    if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
        return Err("its matrix is not affine: the last row must be 0 0 0 1".to_owned());
    }
    let row = |index| tuple(&matrix.row(index).to_array());
    Ok(format!("Matrix(({}, {}, {}))", row(0)?, row(1)?, row(2)?))
}

pub(super) fn shape(shape: &Shape, paths: &AssetPaths) -> Written {
    Ok(match shape {
        Shape::Sphere { radius_m } => format!("Sphere(radius_m: {})", number(*radius_m)?),
        Shape::Triangle { vertices, normals, uvs } => {
            let mut keys = Keys::default();
            keys.push("vertices", vectors(vertices)?);
            if let Some(normals) = normals {
                keys.push("normals", vectors(normals)?);
            }
            if let Some(uvs) = uvs {
                keys.push("uvs", pairs(uvs)?);
            }
            keys.finish("Triangle")
        }
        Shape::Plane { corners } => format!("Plane(corners: {})", vectors(corners)?),
        Shape::Mesh(id) => format!("Mesh({})", paths.mesh(*id)?),
    })
}

pub(super) fn light(light: &Light, paths: &AssetPaths) -> Written {
    let mut keys = Keys::default();
    let with_falloff = |mut keys: Keys, falloff: &Falloff, name: &str| {
        keys.push_unless(*falloff == Falloff::default(), "falloff", || Ok(format!("{falloff:?}")))?;
        Ok(keys.finish(name))
    };
    match light {
        Light::Point { power_w, falloff } => {
            keys.push("power_w", color(*power_w)?);
            with_falloff(keys, falloff, "Point")
        }
        Light::Spot { power_w, inner_angle, outer_angle, falloff } => {
            keys.push("power_w", color(*power_w)?);
            keys.push("inner_degrees", degrees(*inner_angle)?);
            keys.push("outer_degrees", degrees(*outer_angle)?);
            with_falloff(keys, falloff, "Spot")
        }
        Light::Photometric { power_w, profile } => {
            keys.push("power_w", color(*power_w)?);
            keys.push("profile", paths.image_of(*profile)?);
            Ok(keys.finish("Photometric"))
        }
        Light::Directional { irradiance, angle } => {
            keys.push("irradiance", color(*irradiance)?);
            keys.push_unless(same(&[*angle], &[0.0]), "angle_degrees", || degrees(*angle))?;
            Ok(keys.finish("Directional"))
        }
        Light::Environment { radiance, image } => {
            let is_default = same(&radiance.to_array(), &Rgb::WHITE.to_array());
            keys.push_unless(is_default, "radiance", || color(*radiance))?;
            if let Some(image) = image {
                keys.push("image", paths.image(*image)?);
            }
            Ok(keys.finish("Environment"))
        }
        Light::Sky { elevation, azimuth, haze, radiance } => {
            keys.push("elevation_degrees", degrees(*elevation)?);
            keys.push("azimuth_degrees", degrees(*azimuth)?);
            keys.push("haze", number(*haze)?);
            keys.push_unless(*radiance == Rgb::WHITE, "radiance", || color(*radiance))?;
            Ok(keys.finish("Sky"))
        }
        Light::Area { power_w, size_m, outline, samples, pattern, visible } => {
            keys.push("power_w", color(*power_w)?);
            keys.push("size_m", uniform_or_tuple(&size_m.to_array())?);
            keys.push_unless(*outline == Outline::default(), "outline", || Ok(format!("{outline:?}")))?;
            keys.push_unless(*samples == 1, "samples", || Ok(samples.to_string()))?;
            keys.push_unless(*pattern == Pattern::default(), "pattern", || Ok(format!("{pattern:?}")))?;
            keys.push_unless(!*visible, "visible", || Ok("true".to_owned()))?;
            Ok(keys.finish("Area"))
        }
    }
}

pub(super) fn camera(camera: &Camera, paths: &AssetPaths) -> Written {
    Ok(match camera {
        Camera::Pinhole { vertical_fov } => {
            format!("Pinhole(vertical_fov_degrees: {})", degrees(*vertical_fov)?)
        }
        Camera::ThinLens { vertical_fov, lens_radius_m, focus_distance_m, aperture, pattern } => {
            let mut keys = Keys::default();
            keys.push("vertical_fov_degrees", degrees(*vertical_fov)?);
            keys.push("lens_radius_m", number(*lens_radius_m)?);
            keys.push("focus_distance_m", number(*focus_distance_m)?);
            if let Some(aperture) = aperture {
                keys.push("aperture", paths.image(*aperture)?);
            }
            keys.push_unless(*pattern == Pattern::default(), "pattern", || Ok(format!("{pattern:?}")))?;
            keys.finish("ThinLens")
        }
        Camera::Orthographic { height_m } => format!("Orthographic(height_m: {})", number(*height_m)?),
    })
}
