//! Conversion of local transforms to world matrices, through the hierarchy.

use std::collections::HashMap;

use hecs::Entity;

use super::{Parent, Shape, Transform, World};
use crate::error::CompileError;
use crate::math::{DAffine3, DMat3, DQuat, DVec3, Vec3};

/// The local-to-world matrix of every entity, in double precision: rounded only once, when geometry is made.
pub type WorldTransforms = HashMap<Entity, DAffine3>;

/// Computes the world matrix of every entity. Errors: a cycle of parents, a matrix that is singular or not finite.
pub fn to_world(world: &World, order: &[Entity]) -> Result<WorldTransforms, CompileError> {
    let mut done = WorldTransforms::with_capacity(order.len());
    for &entity in order {
        resolve(world, entity, &mut done)?;
    }
    Ok(done)
}

/// Moves the origin of world space to a point.
pub(crate) fn relative_to(transforms: &mut WorldTransforms, origin: DVec3) {
    if origin != DVec3::ZERO {
        transforms.values_mut().for_each(|matrix| matrix.translation -= origin);
    }
}

/// Returns the matrix that places a shape's vertices, from its entity's matrix.
pub(crate) fn placement(world: &World, shape: &Shape, matrix: &DAffine3) -> DAffine3 {
    let origin = match shape {
        Shape::Mesh(id) => world.assets.meshes.get(id.0 as usize).map_or(DVec3::ZERO, |mesh| mesh.origin),
        _ => shape.flat_corners().map_or(DVec3::ZERO, |(origin, _)| origin),
    };
    DAffine3 { translation: matrix.transform_point3(origin), ..*matrix }
}

fn resolve(world: &World, entity: Entity, done: &mut WorldTransforms) -> Result<(), CompileError> {
    // Climb from the entity to the first known ancestor, then descend: no recursion, however deep the hierarchy.
    let mut chain = vec![entity];
    let mut parent_matrix = DAffine3::IDENTITY;
    while let Ok(parent) = world.entities.get::<&Parent>(chain[chain.len() - 1]) {
        if let Some(known) = done.get(&parent.0) {
            parent_matrix = *known;
            break;
        }
        if chain.len() > world.entities.len() as usize {
            return Err(entity_error(world, entity, "its parents form a circle: remove one parent"));
        }
        chain.push(parent.0);
    }
    while let Some(entity) = chain.pop() {
        if let Some(known) = done.get(&entity) {
            parent_matrix = *known;
            continue;
        }
        let local = world.entities.get::<&Transform>(entity).map(|t| *t).unwrap_or_default();
        let matrix = parent_matrix * to_matrix(&local);
        let determinant = matrix.matrix3.determinant();
        if !(matrix.is_finite() && matrix.translation.as_vec3().is_finite() && determinant.is_finite()) {
            let reason =
                "its transform is NaN, infinite or far too large, or turns by a rotation of length zero";
            return Err(entity_error(world, entity, reason));
        }
        if determinant == 0.0 {
            let reason = "its transform squeezes space flat: use a scale that is nowhere zero";
            return Err(entity_error(world, entity, reason));
        }
        done.insert(entity, matrix);
        parent_matrix = matrix;
    }
    Ok(())
}

/// Returns a [`CompileError::Entity`] for an entity.
pub(crate) fn entity_error(world: &World, entity: Entity, reason: impl Into<String>) -> CompileError {
    CompileError::Entity { entity: world.name_of(entity), reason: reason.into() }
}

/// The matrix of a transform.
pub(crate) fn to_matrix(transform: &Transform) -> DAffine3 {
    match transform {
        Transform::Trs { translation, rotation, scale } => {
            let q = rotation.to_array().map(f64::from);
            let rotation = rotation_matrix(DQuat::from_array(q));
            let scale = scale.as_dvec3();
            let matrix3 = DMat3::from_cols(
                rotation.x_axis * scale.x,
                rotation.y_axis * scale.y,
                rotation.z_axis * scale.z,
            );
            DAffine3 { matrix3, translation: *translation }
        }
        Transform::Matrix(matrix) => *matrix,
    }
}

impl Transform {
    /// Returns this transform below a parent, turned in world space about +Y, clockwise seen from above.
    pub(crate) fn turned(&self, degrees: f64, parent: Option<DMat3>) -> Transform {
        let half = -degrees.to_radians() / 2.0;
        let turn = DQuat::from_xyzw(0.0, libm::sin(half), 0.0, libm::cos(half));
        match (self, parent) {
            (Transform::Trs { translation, rotation, scale }, None) => {
                let rotation = (turn * rotation.as_dquat()).as_quat();
                let translation = rotation_matrix(turn) * *translation;
                Transform::Trs { translation, rotation, scale: *scale }
            }
            (own, parent) => {
                let (own, above) = (to_matrix(own), parent.unwrap_or(DMat3::IDENTITY));
                let turn = above.inverse() * rotation_matrix(turn) * above;
                let turned = DAffine3 { matrix3: turn * own.matrix3, translation: turn * own.translation };
                Transform::Matrix(turned)
            }
        }
    }
}

/// The rotation matrix of a quaternion; its length need not be exactly 1.
fn rotation_matrix(q: DQuat) -> DMat3 {
    let (x, y, z, w) = (q.x, q.y, q.z, q.w);
    let s = 2.0 / (x * x + y * y + z * z + w * w);
    DMat3::from_cols(
        DVec3::new(1.0 - s * (y * y + z * z), s * (x * y + z * w), s * (x * z - y * w)),
        DVec3::new(s * (x * y - z * w), 1.0 - s * (x * x + z * z), s * (y * z + x * w)),
        DVec3::new(s * (x * z + y * w), s * (y * z - x * w), 1.0 - s * (x * x + y * y)),
    )
}

/// Transforms a single-precision point by a double-precision matrix.
pub(crate) fn point(matrix: &DAffine3, p: Vec3) -> Vec3 {
    matrix.transform_point3(p.as_dvec3()).as_vec3()
}

/// Transforms a direction and normalises it.
pub(crate) fn direction(matrix: &DAffine3, d: Vec3) -> Vec3 {
    matrix.transform_vector3(d.as_dvec3()).normalize().as_vec3()
}

/// The matrix that transforms normals: the inverse transpose.
pub(crate) fn normal_matrix(matrix: &DAffine3) -> DMat3 {
    matrix.matrix3.inverse().transpose()
}

/// The scale of a rotation (possibly mirrored) with uniform scale; `None` for any other matrix.
pub(crate) fn uniform_scale(matrix: &DAffine3) -> Option<f64> {
    let m = matrix.matrix3;
    let lengths = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.length());
    let largest = lengths.into_iter().fold(0.0, f64::max);
    let same = lengths.iter().all(|l| (l - largest).abs() <= 1e-6 * largest);
    let skew = [m.x_axis.dot(m.y_axis), m.y_axis.dot(m.z_axis), m.z_axis.dot(m.x_axis)];
    let straight = skew.iter().all(|d| d.abs() <= 1e-6 * largest * largest);
    (same && straight).then_some(largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Quat;
    use crate::world::Name;
    use proptest::prelude::*;

    fn trs(translation: Vec3, rotation: Quat, scale: Vec3) -> Transform {
        Transform::Trs { translation: translation.as_dvec3(), rotation, scale }
    }

    #[test]
    fn children_spawned_before_their_parents_follow_them() {
        let mut world = World::default();
        let child = world.entities.spawn((trs(Vec3::X, Quat::IDENTITY, Vec3::ONE),));
        let quarter = Quat::from_xyzw(0.0, 0.0, 0.5f32.sqrt(), 0.5f32.sqrt());
        let parent = world.entities.spawn((trs(Vec3::Y, quarter, Vec3::splat(2.0)),));
        world.entities.insert_one(child, Parent(parent)).unwrap();
        let all = to_world(&world, &world.in_order()).unwrap();
        // X is scaled to 2, turned onto Y, moved up by 1.
        let origin = point(&all[&child], Vec3::ZERO);
        assert!((origin - Vec3::new(0.0, 3.0, 0.0)).length() < 1e-6, "{origin}");
    }

    #[test]
    fn cyclic_parents_are_an_error() {
        let mut world = World::default();
        let a = world.entities.spawn((Name("a".into()),));
        let b = world.entities.spawn((Name("b".into()), Parent(a)));
        world.entities.insert_one(a, Parent(b)).unwrap();
        let error = to_world(&world, &world.in_order()).unwrap_err().to_string();
        assert!(error.contains("circle"), "{error}");
    }

    #[test]
    fn to_world_rejects_non_finite_and_singular_transforms_with_their_reason() {
        let refused = |transform| {
            let mut world = World::default();
            world.entities.spawn((transform,));
            to_world(&world, &world.in_order()).unwrap_err().to_string()
        };
        let (place, turn, size) = (Vec3::X, Quat::IDENTITY, Vec3::ONE);
        for wrong in [
            trs(Vec3::new(f32::NAN, 0.0, 0.0), turn, size),
            trs(Vec3::new(0.0, f32::INFINITY, 0.0), turn, size),
            trs(place, turn, Vec3::new(1.0, f32::NAN, 1.0)),
            trs(place, Quat::from_array([0.0; 4]), size),
        ] {
            let error = refused(wrong);
            assert!(error.contains("NaN") && !error.contains("flat"), "{error}");
        }
        assert!(refused(trs(place, turn, Vec3::new(1.0, 0.0, 1.0))).contains("flat"));
    }

    #[test]
    fn long_parent_chains_are_resolved_without_recursion() {
        let mut world = World::default();
        let mut last = world.entities.spawn((trs(Vec3::X, Quat::IDENTITY, Vec3::ONE),));
        for _ in 0..20_000 {
            last = world.entities.spawn((trs(Vec3::X, Quat::IDENTITY, Vec3::ONE), Parent(last)));
        }
        let all = to_world(&world, &world.in_order()).unwrap();
        assert_eq!(point(&all[&last], Vec3::ZERO).x, 20_001.0);
    }

    proptest! {
        #[test]
        fn matrix_inverse_undoes_it_and_normals_stay_perpendicular(
            t in prop::array::uniform3(-10.0f32..10.0),
            q in prop::array::uniform4(0.1f32..1.0),
            s in prop::array::uniform3(0.1f32..5.0),
            p in prop::array::uniform3(-10.0f32..10.0),
        ) {
            let m = to_matrix(&trs(t.into(), Quat::from_array(q), s.into()));
            let p = DVec3::from_array(p.map(f64::from));
            prop_assert!((m.inverse().transform_point3(m.transform_point3(p)) - p).length() < 1e-9);
            let (u, v) = (DVec3::new(1.0, 0.3, 0.0), DVec3::new(0.2, 1.0, 0.5));
            let n = normal_matrix(&m) * u.cross(v);
            let across = n.dot(m.transform_vector3(u)).abs() + n.dot(m.transform_vector3(v)).abs();
            prop_assert!(across < 1e-9 * n.length() * 10.0);
        }
    }
}
