//! Chooses the point of the world around which the compiled scene is stored in single precision.
//!
//! Positions far from the origin are coarse in single precision: 0.5 m at 5,000 km. Survey data and models of cities lie
//! that far away. Cf. camera-world space in PBRT, 4th edition, section 5.1.

use hecs::Entity;

use crate::math::{DAffine3, DVec3, Vec3};
use crate::world::origin::{FARTHEST, rounded};
use crate::world::transforms::WorldTransforms;
use crate::world::{Assets, Shape, World};

/// The distance of the origin from what it is to be near to, relative to the nearest shape's distance from the camera.
/// A camera that moves by less does not move the origin.
const NEAR: f64 = 16.0;
/// The number of vertices that determine the place and size of a mesh.
const MOST_VERTICES: usize = 256;

/// The place of a shape, as its distance to the camera and to the origin matter.
struct Extent {
    center: DVec3,
    /// The distance at which it is seen, or its radius if that is larger.
    scale: f64,
}

/// Returns the origin of the compiled scene in world space: 0 unless that would be coarse. It hardly depends on the
/// camera, so that a camera that moves does not recompile the shapes.
pub(super) fn choose(
    world: &World,
    order: &[Entity],
    transforms: &WorldTransforms,
    camera: &DAffine3,
) -> DVec3 {
    let extents: Vec<Extent> = order
        .iter()
        .filter_map(|entity| {
            let shape = world.entities.get::<&Shape>(*entity).ok()?;
            let (center, radius) = ball_around(&shape, &transforms[entity], &world.assets)?;
            let scale = (center - camera.translation).length().max(radius);
            Some(Extent { center, scale })
        })
        .filter(|extent| extent.scale > 0.0)
        .collect();
    let coarseness = |origin: DVec3| {
        let of = |extent: &Extent| (extent.center - origin).length() / extent.scale;
        extents.iter().map(of).fold(0.0, f64::max)
    };
    if coarseness(DVec3::ZERO) <= FARTHEST {
        return DVec3::ZERO;
    }
    let middle = rounded(median(&extents), NEAR * nearest(&extents));
    if coarseness(middle) <= FARTHEST {
        return middle;
    }
    let around_the_camera = rounded(camera.translation, NEAR * nearest(&extents));
    if coarseness(around_the_camera) < coarseness(middle) { around_the_camera } else { middle }
}

/// The centre and radius of a ball around a shape, roughly; none around nothing.
pub(super) fn ball_around(shape: &Shape, matrix: &DAffine3, assets: &Assets) -> Option<(DVec3, f64)> {
    let around = |points: &mut dyn Iterator<Item = Vec3>, origin: DVec3| {
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points {
            (least, most) = (least.min(point.as_dvec3()), most.max(point.as_dvec3()));
        }
        let (center, half) = (origin + 0.5 * (least + most), 0.5 * (most - least));
        let radius = (matrix.matrix3 * half).length();
        radius.is_finite().then(|| (matrix.transform_point3(center), radius))
    };
    match shape {
        Shape::Mesh(id) => {
            let mesh = assets.meshes.get(id.0 as usize)?;
            let step = (mesh.positions.len() / MOST_VERTICES).max(1);
            around(&mut mesh.positions.iter().step_by(step).copied(), mesh.origin)
        }
        Shape::Triangle { .. } | Shape::Plane { .. } => {
            let (origin, corners) = shape.flat_corners()?;
            around(&mut corners.into_iter(), origin)
        }
        _ => around(&mut shape.corners_around(assets)?.into_iter(), DVec3::ZERO),
    }
}

/// The median of each coordinate of the shapes' centres.
fn median(extents: &[Extent]) -> DVec3 {
    let of = |axis: usize| {
        let mut all: Vec<f64> = extents.iter().map(|extent| extent.center[axis]).collect();
        let middle = all.len() / 2;
        *all.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    DVec3::new(of(0), of(1), of(2))
}

fn nearest(extents: &[Extent]) -> f64 {
    extents.iter().map(|extent| extent.scale).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Quat;
    use crate::world::{Camera, Transform};

    fn chosen(camera: DVec3, shapes: &[(DVec3, f32)]) -> DVec3 {
        let mut world = World::default();
        let at = |translation| Transform::Trs { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE };
        let eye = world.entities.spawn((Camera::Pinhole { vertical_fov: 1.0 }, at(camera)));
        for (center, radius_m) in shapes {
            world.entities.spawn((Shape::Sphere { radius_m: *radius_m }, at(*center)));
        }
        let order = world.in_order();
        let transforms = crate::world::transforms::to_world(&world, &order).unwrap();
        choose(&world, &order, &transforms, &transforms[&eye])
    }

    #[test]
    fn origin_stays_where_single_precision_is_fine() {
        let far = DVec3::new(450_123.25, 312.0, -5_412_345.77);
        assert_eq!(chosen(DVec3::new(3.0, 2.0, 5.0), &[(DVec3::ZERO, 1.0)]), DVec3::ZERO);
        // A telescope, a globe, a scene of nothing, a ball on a planet.
        assert_eq!(chosen(far, &[(DVec3::ZERO, 1.0)]), DVec3::ZERO);
        assert_eq!(chosen(DVec3::Z * 2e7, &[(DVec3::ZERO, 6.4e6)]), DVec3::ZERO);
        assert_eq!(chosen(far, &[]), DVec3::ZERO);
    }

    #[test]
    fn origin_moves_to_far_shapes_whatever_their_unit_and_the_camera() {
        for unit in [1e-3, 1.0, 1e6] {
            let far = DVec3::new(450_123.25, 312.0, -5_412_345.77) * unit;
            let [ball, eye] = [far, far + DVec3::new(0.0, 1.0, 4.0) * unit];
            let size = unit as f32;
            let origin = chosen(eye, &[(ball, size), (ball + DVec3::X * unit, size)]);
            assert!((origin - ball).length() < 1024.0 * 4.0 * unit, "{unit}: {origin}");
            let moved = chosen(eye + DVec3::new(0.3, -0.2, 0.1) * unit, &[(ball, size), (ball, size)]);
            assert_eq!(moved, origin, "{unit}");
            // Most shapes may be elsewhere: the camera's place decides.
            let others = [(DVec3::ZERO, 1e7 * size), (DVec3::ZERO, 1e7 * size), (ball, size)];
            let origin = chosen(eye, &others);
            assert!((origin - ball).length() < 1024.0 * 4.0 * unit, "{unit}: {origin}");
        }
    }
}
