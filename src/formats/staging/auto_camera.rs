//! Places cameras that were added or that the options move, and adds a floor.

use super::bounding_points::BoundingPoints;
use crate::error::{Diagnostic, LoadError};
use crate::formats::names::TakenNames;
use crate::formats::{Edits, Floor, LoadOptions};
use crate::math::{DVec3, Rgb};
use crate::world::{
    BlinnPhong, Camera, ColorInput, Material, OrbitCamera, Parent, Principled, ScalarInput, Shape, Transform,
    World, transforms,
};

/// Marks an added camera and stores its initial transform. As long as it keeps that, it is moved to where the image
/// shows everything.
pub(super) struct AutoCamera(pub Transform);

/// The extent of a floor to each side, in diameters of the scene.
const FLOOR: f64 = 100.0;

/// The reflectance of a floor that shows what is behind it: things on it are lit as if they stood on paper.
const PAPER: f32 = 0.8;

/// True if there is an added camera, whose place depends on the shape of the image.
pub(crate) fn has_added_camera(world: &World) -> bool {
    world.entities.query::<&AutoCamera>().iter().next().is_some()
}

/// Places cameras and a floor as the options require. Animation does not move them: `at_rest` reads the scene without
/// time.
pub(super) fn place(
    world: &mut World,
    options: &LoadOptions,
    at_rest: impl FnOnce() -> Result<World, LoadError>,
) -> Result<(), LoadError> {
    let Edits { orbit, zoom, ground, .. } = options.edits;
    if !has_added_camera(world) && orbit.is_none() && zoom.is_none() && ground.is_none() {
        return Ok(());
    }
    let moves = world.is_animated && options.time_s.is_some();
    let rest = if moves { Some(at_rest()?) } else { None };
    let extent = BoundingPoints::of(rest.as_ref().unwrap_or(world));
    let [least, most] = extent.as_ref().map_or([DVec3::NEG_ONE, DVec3::ONE], BoundingPoints::bounds);
    let cameras = cameras(world, extent.as_ref(), options, (0.5 * (least + most), (most - least).length()));
    for (entity, transform, camera) in cameras {
        // The transform is in world space, so its parent must not move it. The entity is known to exist.
        let _ = world.entities.remove_one::<Parent>(entity);
        let _ = world.entities.insert(entity, (transform, camera));
    }
    if let Some(ground) = ground {
        let height = add_floor(world, ground, [least, most]);
        if sees_from_below(world, height) {
            let text = "the camera is below the floor that --ground adds, which hides what stands on it";
            let remedy = "look from above, or leave the floor out";
            world.warnings.push(Diagnostic::warning("below-the-floor", text).fixed_by(remedy));
        }
    }
    Ok(())
}

/// The cameras that were added, as the default options place them.
pub(super) fn added(world: &World) -> Vec<(hecs::Entity, Transform, Camera)> {
    if !has_added_camera(world) {
        return Vec::new();
    }
    let extent = BoundingPoints::of(world);
    let [least, most] = extent.as_ref().map_or([DVec3::NEG_ONE, DVec3::ONE], BoundingPoints::bounds);
    let middle = (0.5 * (least + most), (most - least).length());
    cameras(world, extent.as_ref(), &LoadOptions::default(), middle)
}

/// The cameras that move, with their new transforms. `middle` and `diameter` are those of the scene.
fn cameras(
    world: &World,
    extent: Option<&BoundingPoints>,
    options: &LoadOptions,
    (middle, diameter): (DVec3, f64),
) -> Vec<(hecs::Entity, Transform, Camera)> {
    let Edits { look_at, orbit, zoom, .. } = &options.edits;
    let looked_at = look_at.as_ref().and_then(|[_, to]| point(to));
    // Errors are reported when the scene is compiled.
    let Ok(transforms) = transforms::to_world(world, &world.in_order()) else { return Vec::new() };
    let mut query =
        world.entities.query::<(hecs::Entity, &Camera, Option<&Transform>, Option<&AutoCamera>)>();
    let elsewhere = |(entity, camera, transform, added): (hecs::Entity, &Camera, _, Option<&AutoCamera>)| {
        let is_added = added.is_some_and(|added| transform == Some(&added.0));
        if !is_added && orbit.is_none() && zoom.is_none() {
            return None;
        }
        let matrix = transforms.get(&entity)?;
        let axis = |axis: DVec3| (matrix.matrix3 * axis).normalize();
        let forward = axis(DVec3::NEG_Z);
        let right = forward.cross(axis(DVec3::Y)).normalize();
        let ahead = (looked_at.unwrap_or(middle) - matrix.translation).dot(forward);
        let depth = match camera {
            Camera::ThinLens { focus_distance_m, .. } if looked_at.is_none() => f64::from(*focus_distance_m),
            _ if ahead > 0.01 * diameter => ahead,
            _ => diameter.max(1e-3),
        };
        let axes = [right, right.cross(forward), forward];
        let mut rig = OrbitCamera::new(matrix.translation, axes, *camera, depth);
        if let Some([yaw, pitch]) = orbit {
            // A drag of one image height is half a turn.
            rig.orbit([-yaw / 180.0, pitch / 180.0]);
        }
        if is_added {
            let [width, height] = world.settings.size.map(f64::from);
            let unit = |direction: DVec3| direction.abs().element_sum();
            rig.fit(width / height, |direction| match extent {
                Some(extent) => extent.along(direction),
                None => unit(direction),
            });
        }
        if let Some(zoom) = zoom {
            rig.zoom(*zoom);
        }
        Some((entity, rig.transform().ok()?, rig.camera))
    };
    query.iter().filter_map(elsewhere).collect()
}

/// Parses three numbers.
fn point(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split(',').map_while(|number| number.trim().parse().ok()).collect();
    Some(DVec3::from_array(numbers.try_into().ok()?))
}

/// True if the first camera is below a floor of this height.
fn sees_from_below(world: &World, height: f64) -> bool {
    let order = world.in_order();
    let camera = order.iter().find(|entity| world.entities.satisfies::<&Camera>(**entity));
    // Errors are reported when the scene is compiled.
    let Ok(transforms) = transforms::to_world(world, &order) else { return false };
    camera.and_then(|entity| transforms.get(entity)).is_some_and(|place| place.translation.y < height)
}

/// Adds a floor under everything; returns its height.
fn add_floor(world: &mut World, ground: Floor, [least, most]: [DVec3; 2]) -> f64 {
    let diameter = (most - least).length().max(1e-6);
    let (middle, reach) = (0.5 * (least + most), FLOOR * diameter);
    // A flat underside must not coincide with the floor.
    let height = least.y - 1e-4 * diameter;
    let corner = |x: f64, z: f64| DVec3::new(middle.x + x * reach, height, middle.z + z * reach);
    let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
    let material = match ground {
        Floor::Grey => Material::BlinnPhong(BlinnPhong {
            diffuse: ColorInput::Constant(Rgb::splat(0.4)),
            specular: ColorInput::Constant(Rgb::BLACK),
            ..BlinnPhong::default()
        }),
        Floor::Shadow => Material::Principled(Box::new(Principled {
            base_color: ColorInput::Constant(Rgb::splat(PAPER)),
            metallic: ScalarInput::constant(0.0),
            specular: ScalarInput::constant(0.0),
            shadow_catcher: true,
            ..Principled::default()
        })),
    };
    let name = TakenNames::of(world).unique("ground");
    let material = world.assets.add_material(Some("ground".into()), material);
    world.entities.spawn((name, Transform::IDENTITY, Shape::Plane { corners }, material));
    height
}
