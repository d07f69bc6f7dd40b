//! Light entities in world space, and the surfaces of visible area lights.

use hecs::Entity;

use super::geometry::PlacedWorld;
use super::materials;
use super::photometric::{self, BeamCone};
use super::sky::Air;
use crate::error::CompileError;
use crate::math::{DAffine3, Rgb, Vec3};
use crate::scene::MaterialRecord;
use crate::world::transforms::{direction, entity_error, point};
use crate::world::{
    self, BlinnPhong, ColorInput, ConeEdge, Falloff, Outline, Pattern, TextureId, Transport, World,
};

/// A light entity in world space.
#[derive(Debug)]
pub(super) enum WorldLight {
    /// A point light, perhaps within a cone.
    Point {
        place: Vec3,
        /// Φ/4π, W sr⁻¹.
        intensity: Rgb,
        /// True if irradiance falls with the square of the distance.
        falls: bool,
        cone: Option<SpotCone>,
    },
    /// A ball without a surface: each point of it emits the same in all directions, perhaps within a cone.
    Ball { center: Vec3, radius: f32, radiance: Rgb, cone: Option<SpotCone> },
    /// A point light with a photometric profile.
    Photometric {
        place: Vec3,
        /// The mean over all directions, Φ/4π, W sr⁻¹.
        intensity: Rgb,
        /// 1 over the profile's mean.
        scale: f32,
        /// Unit vectors: the axis, and the direction from which angles about it are measured.
        axes: [Vec3; 2],
        profile: TextureId,
        /// The cone that holds most of its light.
        beam: BeamCone,
    },
    /// Parallel light.
    Directional {
        /// Unit vector towards the light.
        to_light: Vec3,
        /// W m⁻² on a surface perpendicular to it.
        irradiance: Rgb,
        /// Its angular diameter, radians.
        angle: f32,
    },
    /// A rectangle, or a disc within it.
    Area {
        /// A corner, and the edges from it, up and across: their cross product points to the emitting side.
        corner: Vec3,
        edges: [Vec3; 2],
        outline: Outline,
        radiance: Rgb,
        samples: u32,
        pattern: Pattern,
        /// The material of its surface, if it has one.
        material: Option<u32>,
    },
}

/// The cone of a spot light.
#[derive(Debug)]
pub(super) struct SpotCone {
    /// Unit vector along its axis, away from the light.
    pub axis: Vec3,
    /// Cosine of the angle beyond which nothing arrives.
    pub cos_outer: f32,
    /// 1 / (cosine of the inner angle − cosine of the outer one).
    pub scale: f32,
    pub edge: ConeEdge,
}

impl SpotCone {
    /// The cone of a spotlight; none for other lights.
    fn of(light: &world::Light, matrix: &DAffine3) -> Option<SpotCone> {
        let world::Light::Spot { inner_angle, outer_angle, edge, .. } = *light else { return None };
        let [inner, outer] = [inner_angle, outer_angle].map(|angle| libm::cos(f64::from(angle)));
        // Equal angles make an edge that is hard even for the narrowest cone.
        let width = (inner - outer).max((1e-6 * (1.0 - outer)).max(1e-30));
        let (axis, cos_outer) = (direction(matrix, Vec3::NEG_Z), outer as f32);
        Some(SpotCone { axis, cos_outer, scale: (1.0 / width) as f32, edge })
    }
}

/// The surface of a visible area light.
#[derive(PartialEq)]
pub(super) struct LightMesh {
    /// The vertices of a convex polygon, counter-clockwise as seen from the emitting side.
    pub corners: Vec<Vec3>,
    /// A black material that emits to the front.
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

/// All lights, and those that send no photons.
#[derive(Debug, Default)]
pub(super) struct WorldLights {
    pub all: Vec<WorldLight>,
    /// True for each light that sends no photons.
    pub without_caustics: Vec<bool>,
    /// True if the environment or sky sends no photons.
    pub around_without_caustics: bool,
    /// The light group of each light, or [`NONE`].
    pub groups: Vec<u32>,
    /// That of the environment or sky.
    pub around_group: u32,
}

/// Compiles the lights: returns them, and the surfaces of those that rays can hit. Materials of these are added to those
/// of the assets.
pub(super) fn compile(
    placed: &PlacedWorld,
    materials: &mut Vec<MaterialRecord>,
    names: &mut Vec<String>,
) -> Result<(WorldLights, Vec<LightMesh>), CompileError> {
    let PlacedWorld { world, order, transforms, copies, groups, .. } = *placed;
    let (mut lamps, mut panels) = (WorldLights::default(), Vec::new());
    lamps.around_group = groups.around;
    let mut around = None;
    for &entity in order {
        let Ok(light) = world.entities.get::<&world::Light>(entity) else { continue };
        let own = &transforms[&entity];
        let matrices: Vec<DAffine3> =
            if light.is_around() { vec![*own] } else { copies.matrices(entity, own).collect() };
        for matrix in &matrices {
            match &*light {
                world::Light::Area { power_w, radiance, size_m, outline, samples, pattern, visible } => {
                    let (corners, area) = rectangle(world, entity, matrix, *size_m)?;
                    // A uniform Lambertian emitter: Φ = π A L.
                    let radiance =
                        *radiance + *power_w * (1.0 / (std::f32::consts::PI * area * outline.part()));
                    let material = visible.then(|| {
                        let material = materials.len() as u32;
                        materials.push(MaterialRecord { group: groups.of(entity), ..surface(radiance) });
                        names.push(format!("light of {}", world.name_of(entity)));
                        panels.push(LightMesh { corners: cut_out(corners, *outline), material, entity });
                        material
                    });
                    let [corner, first, _, second] = corners;
                    let edges = [first - corner, second - corner];
                    let (samples, pattern) = (*samples, *pattern);
                    let outline = *outline;
                    lamps.all.push(WorldLight::Area {
                        corner,
                        edges,
                        outline,
                        radiance,
                        samples,
                        pattern,
                        material,
                    });
                }
                world::Light::Environment { .. } => {}
                world::Light::Photometric { power_w, profile } => {
                    let image = world.assets.image_of(*profile);
                    let (mean, beam) =
                        image.and_then(|image| photometric::summary(image)).ok_or_else(|| {
                            entity_error(world, entity, "its photometric profile is dark in all directions")
                        })?;
                    let intensity = *power_w * (1.0 / (4.0 * std::f32::consts::PI));
                    let axis = direction(matrix, Vec3::NEG_Z);
                    let along = direction(matrix, Vec3::X);
                    let across = (along - axis * along.dot(axis)).normalize();
                    let (place, profile) = (point(matrix, Vec3::ZERO), *profile);
                    let (axes, scale) = ([axis, across], 1.0 / mean);
                    lamps.all.push(WorldLight::Photometric { place, intensity, scale, axes, profile, beam });
                }
                sky @ world::Light::Sky { .. } => lamps.all.extend(sun(world, sky, matrix)),
                other => lamps
                    .all
                    .push(ball(world, other, matrix).unwrap_or_else(|| punctual(world, other, matrix))),
            }
        }
        let sends_none = world.entities.satisfies::<&world::WithoutCaustics>(entity);
        if light.is_around() {
            around.get_or_insert(sends_none);
        }
        lamps.without_caustics.resize(lamps.all.len(), sends_none);
        lamps.groups.resize(lamps.all.len(), groups.of(entity));
    }
    lamps.around_without_caustics = around.unwrap_or(false);
    Ok((lamps, panels))
}

/// The corners of an area light, counter-clockwise as seen from the emitting side, and the area between them.
fn rectangle(
    world: &World,
    entity: Entity,
    matrix: &DAffine3,
    size_m: crate::math::Vec2,
) -> Result<([Vec3; 4], f32), CompileError> {
    let half = size_m * 0.5;
    let corner = |x: f32, y: f32| point(matrix, Vec3::new(x * half.x, y * half.y, 0.0));
    let mut corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    let cross = (corners[1] - corners[0]).as_dvec3().cross((corners[3] - corners[0]).as_dvec3());
    let area = cross.length() as f32;
    if area <= 0.0 || !area.is_finite() {
        return Err(entity_error(world, entity, "its area light has no area: give it a size_m"));
    }
    // Faces −Z, to which a sheared rectangle need not be perpendicular.
    if cross.dot(direction(matrix, Vec3::NEG_Z).as_dvec3()) < 0.0 {
        corners.swap(1, 3);
    }
    Ok((corners, area))
}

/// Corners of the polygon that rays hit in place of a disc: its area is the disc's to a thousandth.
const ROUND: usize = 96;

/// The outline within the corners of a rectangle, in the same order.
fn cut_out(corners: [Vec3; 4], outline: Outline) -> Vec<Vec3> {
    if outline == Outline::Rectangle {
        return corners.to_vec();
    }
    let [corner, first, _, second] = corners;
    let (up, across) = ((first - corner) * 0.5, (second - corner) * 0.5);
    let turn = |i: usize| std::f64::consts::TAU * i as f64 / ROUND as f64;
    let place = |angle: f64| up * libm::cos(angle) as f32 + across * libm::sin(angle) as f32;
    (0..ROUND).map(|i| corner + up + across + place(turn(i))).collect()
}

/// A black material that emits to the front.
fn surface(radiance: Rgb) -> MaterialRecord {
    let material = BlinnPhong {
        diffuse: ColorInput::Constant(Rgb::BLACK),
        emission: ColorInput::Constant(radiance),
        ..BlinnPhong::default()
    };
    MaterialRecord { one_sided_emission: true, ..materials::from_blinn_phong(&material) }
}

/// True if lights other than areas may have an extent: under the Whitted transport, they are points.
fn has_extent(world: &World) -> bool {
    world.settings.transport == Transport::Path
}

/// The sun of a sky; none for other lights.
fn sun(world: &World, light: &world::Light, matrix: &DAffine3) -> Option<WorldLight> {
    let world::Light::Sky { elevation, azimuth, haze, radiance, sun, sun_angle } = light else { return None };
    let (elevation, azimuth) = (f64::from(*elevation), f64::from(*azimuth));
    let level = libm::cos(elevation);
    let [x, z] = [libm::sin(azimuth) * level, -libm::cos(azimuth) * level];
    let to_light = direction(matrix, Vec3::new(x as f32, libm::sin(elevation) as f32, z as f32));
    let irradiance = Air::sun(*haze, elevation).map(|c| c as f32);
    Some(WorldLight::Directional {
        to_light,
        irradiance: Rgb::from(irradiance) * *radiance * *sun,
        angle: if has_extent(world) { *sun_angle } else { 0.0 },
    })
}

/// A point light or spotlight with a radius under the path transport; none for other lights.
fn ball(world: &World, light: &world::Light, matrix: &DAffine3) -> Option<WorldLight> {
    use world::Light::{Point, Spot};
    let (Point { power_w, falloff: Falloff::InverseSquare, radius_m }
    | Spot { power_w, falloff: Falloff::InverseSquare, radius_m, .. }) = *light
    else {
        return None;
    };
    // Like the side of a cube of the same volume.
    let radius = radius_m * libm::cbrt(matrix.matrix3.determinant().abs()) as f32;
    // A uniform Lambertian emitter: Φ = π A L, A = 4π r².
    let radiance = power_w * (1.0 / (4.0 * std::f32::consts::PI.powi(2) * radius * radius));
    let is_ball = has_extent(world) && radius > 0.0 && radiance.is_finite();
    let (center, cone) = (point(matrix, Vec3::ZERO), SpotCone::of(light, matrix));
    is_ball.then_some(WorldLight::Ball { center, radius, radiance, cone })
}

fn punctual(world: &World, light: &world::Light, matrix: &DAffine3) -> WorldLight {
    let intensity = |power: Rgb| power * (1.0 / (4.0 * std::f32::consts::PI));
    let place = point(matrix, Vec3::ZERO);
    match light {
        world::Light::Point { power_w, falloff, .. } | world::Light::Spot { power_w, falloff, .. } => {
            let (falls, cone) = (*falloff == Falloff::InverseSquare, SpotCone::of(light, matrix));
            WorldLight::Point { place, intensity: intensity(*power_w), falls, cone }
        }
        world::Light::Directional { irradiance, angle } => {
            let to_light = -direction(matrix, Vec3::NEG_Z);
            let angle = if has_extent(world) { *angle } else { 0.0 };
            WorldLight::Directional { to_light, irradiance: *irradiance, angle }
        }
        world::Light::Area { .. }
        | world::Light::Environment { .. }
        | world::Light::Photometric { .. }
        | world::Light::Sky { .. } => {
            unreachable!("what is not a point is handled by the caller")
        }
    }
}
