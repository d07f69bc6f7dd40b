//! Light entities to compiled lights, and visible area lights to surfaces that shine.

use hecs::Entity;

use super::emitters::VisibleArea;
use super::transforms::{WorldTransforms, direction, entity_error, point};
use super::{materials, principled};
use crate::error::CompileError;
use crate::math::{DAffine3, Rgb, Vec3};
use crate::sampling::pattern::{Grid, MAX_STRATA};
use crate::scene::materials::flag;
use crate::scene::principled::Principled;
use crate::scene::{Light, Materials};
use crate::world::{self, BlinnPhong, ColorInput, Falloff, Material, World};

/// The rectangle of a visible area light.
pub(super) struct Emitter {
    /// In order around it, counter-clockwise seen from the side that shines.
    pub corners: [Vec3; 4],
    /// Black, but for what it gives off to the front.
    pub material: u32,
    /// The light's entity.
    pub entity: Entity,
}

/// The names of the lights in the order of [`crate::scene::CompiledScene::lights`].
pub fn light_names(world: &World) -> Vec<String> {
    let order = world.in_order().into_iter();
    let lights = order.filter(|entity| {
        let light = world.entities.get::<&world::Light>(*entity);
        light.is_ok_and(|light| !matches!(&*light, world::Light::Environment { .. }))
    });
    lights.map(|entity| world.name_of(entity)).collect()
}

/// What light entities come to.
#[derive(Default)]
pub(super) struct Compiled {
    pub lights: Vec<Light>,
    /// Rectangles that rays can hit.
    pub rectangles: Vec<Emitter>,
    /// Which lights these are.
    pub visible: Vec<VisibleArea>,
    /// Full angle of each light in the sky, 0 for all that are not there.
    pub angles: Vec<f32>,
}

pub(super) fn compile(
    world: &World,
    order: &[Entity],
    transforms: &WorldTransforms,
    materials: &mut Materials,
    principled: &mut Vec<Principled>,
) -> Result<Compiled, CompileError> {
    let mut out = Compiled::default();
    let Compiled { lights, rectangles: emitters, visible: seen, angles } = &mut out;
    for &entity in order {
        let Ok(light) = world.entities.get::<&world::Light>(entity) else { continue };
        let matrix = &transforms[&entity];
        match &*light {
            world::Light::Area { power_w, size_m, samples, pattern, visible } => {
                if *samples == 0 || *samples > MAX_STRATA {
                    let reason = format!("an area light takes 1 to {MAX_STRATA} samples, not {samples}");
                    return Err(entity_error(world, entity, reason));
                }
                let half = *size_m * 0.5;
                let corner = |x: f32, y: f32| point(matrix, Vec3::new(x * half.x, y * half.y, 0.0));
                let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
                let (edge_u, edge_v) = (corners[2] - corners[3], corners[0] - corners[3]);
                let area = edge_u.as_dvec3().cross(edge_v.as_dvec3()).length() as f32;
                if area <= 0.0 || !area.is_finite() {
                    return Err(entity_error(world, entity, "its area light has no area: give it a size_m"));
                }
                // A uniform Lambertian emitter: Φ = π A L.
                let radiance = *power_w * (1.0 / (std::f32::consts::PI * area));
                let normal = face_normal(edge_u, edge_v, direction(matrix, Vec3::NEG_Z));
                lights.push(Light::Area {
                    corner: corners[3],
                    edge_u,
                    edge_v,
                    normal,
                    intensity: radiance * (area / *samples as f32),
                    samples: *samples,
                    grid: Grid::new(*samples),
                    pattern: *pattern,
                });
                if *visible {
                    let mut corners = corners;
                    if edge_u.cross(edge_v).dot(normal) > 0.0 {
                        corners.reverse();
                    }
                    let emitter = emitter(world, entity, corners, radiance, materials, principled);
                    let light = lights.len() as u32 - 1;
                    seen.push(VisibleArea { material: emitter.material, light });
                    emitters.push(emitter);
                }
            }
            world::Light::Environment { .. } => {}
            other => lights.push(punctual(other, matrix)),
        }
        let angle = match &*light {
            world::Light::Directional { angle, .. } => *angle,
            _ => 0.0,
        };
        angles.resize(lights.len(), angle);
    }
    Ok(out)
}

/// Perpendicular to both edges on the side of `hint`; a sheared rectangle's is not its −Z.
fn face_normal(edge_u: Vec3, edge_v: Vec3, hint: Vec3) -> Vec3 {
    let normal = edge_u.as_dvec3().cross(edge_v.as_dvec3()).normalize();
    (normal * normal.dot(hint.as_dvec3()).signum()).as_vec3()
}

fn emitter(
    world: &World,
    entity: Entity,
    corners: [Vec3; 4],
    radiance: Rgb,
    materials: &mut Materials,
    principled: &mut Vec<Principled>,
) -> Emitter {
    let material_of_light = BlinnPhong {
        diffuse: ColorInput::Constant(Rgb::BLACK),
        emission: ColorInput::Constant(radiance),
        ..BlinnPhong::default()
    };
    let material =
        materials::push(materials, &material_of_light, format!("light of {}", world.name_of(entity)));
    materials.flags[material as usize] |= flag::ONE_SIDED_EMISSION;
    let record = principled::record(&Material::BlinnPhong(material_of_light));
    principled.push(Principled { one_sided_emission: true, ..record });
    Emitter { corners, material, entity }
}

fn punctual(light: &world::Light, matrix: &DAffine3) -> Light {
    let intensity = |power: Rgb| power * (1.0 / (4.0 * std::f32::consts::PI));
    let position = point(matrix, Vec3::ZERO);
    match light {
        world::Light::Point { power_w, falloff } => Light::Point {
            position,
            intensity: intensity(*power_w),
            falloff: *falloff == Falloff::InverseSquare,
        },
        world::Light::Spot { power_w, inner_angle, outer_angle, falloff } => {
            let cos = |angle: f32| libm::cos(angle as f64);
            let width = (cos(*inner_angle) - cos(*outer_angle)).max(1e-6);
            Light::Spot {
                position,
                intensity: intensity(*power_w),
                falloff: *falloff == Falloff::InverseSquare,
                axis: direction(matrix, Vec3::NEG_Z),
                cos_outer: cos(*outer_angle) as f32,
                scale: (1.0 / width) as f32,
            }
        }
        world::Light::Directional { irradiance, .. } => {
            Light::Directional { to_light: -direction(matrix, Vec3::NEG_Z), irradiance: *irradiance }
        }
        world::Light::Area { .. } | world::Light::Environment { .. } => {
            unreachable!("what is not a point is handled by the caller")
        }
    }
}
