//! The places of the copies that arrays and scatters make.

use std::collections::HashMap;
use std::num::Wrapping;
use std::sync::Arc;

use hecs::Entity;

use super::modifiers;
use super::shape_meshes::{ShapeMeshes, flat_mesh};
use crate::error::CompileError;
use crate::math::hash::{combine, mix, to_unit};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::memory;
use crate::world::copies::{check_array, check_scatter};
use crate::world::transforms::{WorldTransforms, entity_error, to_matrix};
use crate::world::{Array, Mesh, Name, Parent, ScatteredCopies, Shape, World};

/// Matrices that take an entity to its copies, in world space; none for entities without copies.
#[derive(Default)]
pub(super) struct Copies(HashMap<Entity, Arc<Vec<DAffine3>>>);

impl Copies {
    /// Finds the places of all copies. Errors: a surface that does not exist or has no area, too many copies.
    /// `transforms` are relative to `origin`.
    pub fn new(
        world: &World,
        order: &[Entity],
        transforms: &WorldTransforms,
        origin: DVec3,
        shapes: &ShapeMeshes,
    ) -> Result<Self, CompileError> {
        let mut own: HashMap<Entity, Arc<Vec<DAffine3>>> = HashMap::new();
        for &entity in order {
            let array = world.entities.get::<&Array>(entity).ok();
            let scatter = world.entities.get::<&ScatteredCopies>(entity).ok();
            if array.is_none() && scatter.is_none() {
                continue;
            }
            let above = world.entities.get::<&Parent>(entity).map(|parent| transforms[&parent.0]);
            let above = above.unwrap_or(DAffine3::from_translation(-origin));
            let inverse = above.inverse();
            let fault = |reason: String| entity_error(world, entity, reason);
            let mut places = vec![above];
            if let Some(scatter) = scatter {
                check_scatter(&scatter).map_err(fault)?;
                places = scattered(world, &scatter, transforms, shapes).map_err(fault)?;
            }
            if let Some(array) = array {
                check_array(&array).map_err(fault)?;
                places = product(&places, &in_array(&array)).map_err(fault)?;
            }
            places.iter_mut().for_each(|place| *place *= inverse);
            own.insert(entity, Arc::new(places));
        }
        if own.is_empty() {
            return Ok(Copies::default());
        }
        let mut all = HashMap::new();
        for &entity in order {
            let mut places: Option<Arc<Vec<DAffine3>>> = None;
            let mut at = Some(entity);
            // The hierarchy has no cycles: transforms are resolved.
            while let Some(above) = at {
                places = match (places, own.get(&above)) {
                    (inner, None) => inner,
                    (None, Some(outer)) => Some(outer.clone()),
                    (Some(inner), Some(outer)) => {
                        let both = product(outer, &inner);
                        Some(Arc::new(both.map_err(|reason| entity_error(world, entity, reason))?))
                    }
                };
                at = world.entities.get::<&Parent>(above).ok().map(|parent| parent.0);
            }
            all.extend(places.map(|places| (entity, places)));
        }
        Ok(Copies(all))
    }

    /// The places of an entity's copies, if it has any.
    pub fn of(&self, entity: Entity) -> Option<&Arc<Vec<DAffine3>>> {
        self.0.get(&entity)
    }

    /// The matrices of an entity and its copies, from that of the entity alone.
    pub fn matrices<'a>(
        &'a self,
        entity: Entity,
        matrix: &'a DAffine3,
    ) -> impl Iterator<Item = DAffine3> + 'a {
        let places = self.of(entity);
        let alone = places.is_none().then_some(*matrix);
        alone
            .into_iter()
            .chain(places.into_iter().flat_map(|places| places.iter().map(|place| *place * *matrix)))
    }
}

/// All products of two lists.
fn product(outer: &[DAffine3], inner: &[DAffine3]) -> Result<Vec<DAffine3>, String> {
    let count = outer.len() as u64 * inner.len() as u64;
    if count > u64::from(ScatteredCopies::MOST) {
        return Err(format!("{count} copies of it: at most {} fit into a scene", ScatteredCopies::MOST));
    }
    let what = format_args!("the places of {count} copies");
    let _claim = memory::reserve(what, count * size_of::<DAffine3>() as u64).map_err(|it| it.to_string())?;
    Ok(outer.iter().flat_map(|outer| inner.iter().map(|inner| *outer * *inner)).collect())
}

/// The places of an array's copies, relative to the first.
fn in_array(array: &Array) -> Vec<DAffine3> {
    let mut places = vec![DAffine3::IDENTITY];
    for row in &array.0 {
        let step = to_matrix(&row.step);
        let powers = std::iter::successors(Some(DAffine3::IDENTITY), |power| Some(*power * step));
        let powers: Vec<DAffine3> = powers.take(row.count as usize).collect();
        places = powers.iter().flat_map(|power| places.iter().map(|place| *power * *place)).collect();
    }
    places
}

/// A surface, by its triangles in world space.
struct Ground {
    corners: Vec<[DVec3; 3]>,
    /// The area of each triangle and all before it.
    areas: Vec<f64>,
}

impl Ground {
    /// The surface of an entity.
    fn named(
        world: &World,
        name: &str,
        transforms: &WorldTransforms,
        shapes: &ShapeMeshes,
    ) -> Result<Ground, String> {
        let mut found = world.entities.query::<(Entity, &Name)>();
        let found = found.iter().find(|(_, own)| own.0 == name).map(|(entity, _)| entity);
        let shape = found.and_then(|entity| Some((entity, shapes.shape(world, entity)?)));
        let (entity, shape) = shape
            .ok_or_else(|| format!("it is scattered on \"{name}\", but there is no shape of that name"))?;
        let made;
        let mesh: &Mesh = match &shape {
            Shape::Mesh(id) => &shapes.meshes[id.0 as usize],
            Shape::Sphere { radius_m } => {
                made = modifiers::ball(*radius_m);
                &made
            }
            flat => {
                made = flat_mesh(flat);
                &made
            }
        };
        let matrix = shapes.placement(world, entity, &shape, &transforms[&entity]);
        let mirrored = matrix.matrix3.determinant() < 0.0;
        let point = |vertex: u32| matrix.transform_point3(mesh.positions[vertex as usize].as_dvec3());
        let mut corners: Vec<[DVec3; 3]> =
            mesh.triangles.iter().map(|triangle| triangle.map(point)).collect();
        if mirrored {
            corners.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let mut sum = 0.0;
        let mut areas = Vec::with_capacity(corners.len());
        for [a, b, c] in &corners {
            sum += 0.5 * (*b - *a).cross(*c - *a).length();
            areas.push(sum);
        }
        if sum > 0.0 && sum.is_finite() {
            Ok(Ground { corners, areas })
        } else {
            Err(format!("it is scattered on \"{name}\", which has no area"))
        }
    }

    fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or_default()
    }

    /// The point and the unit normal at three numbers from 0 to 1.
    fn at(&self, [which, u, v]: [f64; 3]) -> (DVec3, DVec3) {
        let target = which * self.area();
        let triangle = self.areas.partition_point(|area| *area <= target).min(self.areas.len() - 1);
        let [a, b, c] = self.corners[triangle];
        // Uniform in the triangle (Turk, Graphics Gems, 1990).
        let root = u.sqrt();
        let point = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
        (point, (b - a).cross(c - a).normalize_or(DVec3::Y))
    }
}

/// The places of scattered copies in world space.
fn scattered(
    world: &World,
    scatter: &ScatteredCopies,
    transforms: &WorldTransforms,
    shapes: &ShapeMeshes,
) -> Result<Vec<DAffine3>, String> {
    let surface = Ground::named(world, &scatter.on, transforms, shapes)?;
    let count = match scatter.count {
        0 => (f64::from(scatter.density) * surface.area()).round(),
        count => f64::from(count),
    };
    if count > f64::from(ScatteredCopies::MOST) {
        return Err(format!("{count} copies of it: at most {} fit into a scene", ScatteredCopies::MOST));
    }
    let what = format_args!("the places of {count} copies");
    let bytes = count as u64 * size_of::<DAffine3>() as u64;
    let _claim = memory::reserve(what, bytes).map_err(|it| it.to_string())?;
    let seed = combine(mix(Wrapping(scatter.seed as u32)), Wrapping((scatter.seed >> 32) as u32));
    let place = |number: u32| {
        let random =
            |which: u32| f64::from(to_unit::<f32>(combine(combine(seed, Wrapping(number)), Wrapping(which))));
        // One place for each equal part of the area.
        let which = (f64::from(number) + random(0)) / count;
        let (point, normal) = surface.at([which, random(1), random(2)]);
        let (least, most) = (f64::from(scatter.scale.x), f64::from(scatter.scale.y));
        let size = least + (most - least) * random(3);
        let turns = if scatter.turn { random(4) } else { 0.0 };
        let up = DVec3::Y.lerp(normal, f64::from(scatter.align)).normalize_or(normal);
        DAffine3 { matrix3: upright(up) * about_y(turns) * size, translation: point }
    };
    Ok((0..count as u32).map(place).collect())
}

/// The shortest rotation that takes +Y to a unit vector.
fn upright(up: DVec3) -> DMat3 {
    if up.y < -0.999_999 {
        return DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    }
    let part = 1.0 / (1.0 + up.y);
    DMat3::from_cols(
        DVec3::new(1.0 - up.x * up.x * part, -up.x, -up.x * up.z * part),
        up,
        DVec3::new(-up.x * up.z * part, -up.z, 1.0 - up.z * up.z * part),
    )
}

fn about_y(turns: f64) -> DMat3 {
    let angle = turns * std::f64::consts::TAU;
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DQuat, Quat, Vec3};
    use crate::world::{ArrayRow, Transform};

    #[test]
    fn rotations_take_the_y_axis_to_any_direction() {
        for up in [DVec3::Y, DVec3::X, DVec3::NEG_Y, DVec3::new(0.6, -0.64, 0.48), DVec3::new(0.0, 0.8, -0.6)]
        {
            let matrix = upright(up);
            assert!((matrix * DVec3::Y - up).length() < 1e-6, "{up}");
            assert!(
                (matrix.transpose() * matrix - DMat3::IDENTITY)
                    .to_cols_array()
                    .iter()
                    .all(|c| c.abs() < 1e-6)
            );
            assert!((matrix.determinant() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn arrays_repeat_their_steps() {
        let step = |translation, rotation: DQuat| Transform::Trs {
            translation,
            rotation: rotation.as_quat(),
            scale: Vec3::ONE,
        };
        let still = DQuat::IDENTITY;
        let quarter = Quat::from_xyzw(0.0, 0.5f32.sqrt(), 0.0, 0.5f32.sqrt()).as_dquat();
        let rows = vec![
            ArrayRow { count: 3, step: step(DVec3::X, still) },
            ArrayRow { count: 4, step: step(DVec3::ZERO, quarter) },
        ];
        let places = in_array(&Array(rows));
        assert_eq!(places.len(), 12);
        let at = |number: usize| places[number].transform_point3(DVec3::X);
        assert!((at(2) - DVec3::X * 3.0).length() < 1e-6);
        assert!((at(5) - DVec3::NEG_Z * 3.0).length() < 1e-6, "a quarter turn takes X to −Z");
    }

    #[test]
    fn scattered_copies_cover_a_surface_evenly() {
        let mut world = World::default();
        let corners =
            [[-2.0, 0.0], [2.0, 0.0], [2.0, 2.0], [-2.0, 2.0]].map(|[x, z]| DVec3::new(x, 0.1 * x, -z));
        let on = world.entities.spawn((Name("floor".into()), Shape::Plane { corners }, Transform::IDENTITY));
        let transforms = HashMap::from([(on, DAffine3::IDENTITY)]);
        let scatter = ScatteredCopies {
            on: "floor".into(),
            density: 1000.0,
            scale: [0.5, 2.0].into(),
            ..ScatteredCopies::default()
        };
        let shapes = ShapeMeshes::new(&world, &[on], &transforms, None, None).unwrap();
        let scattered = |scatter: &ScatteredCopies| scattered(&world, scatter, &transforms, &shapes);
        let places = scattered(&scatter).unwrap();
        let area = 8.0 * 1.01f64.sqrt();
        assert_eq!(places.len(), (1000.0 * area).round() as usize);
        let mean = places.iter().map(|place| place.translation).sum::<DVec3>() / places.len() as f64;
        assert!((mean - DVec3::new(0.0, 0.0, -1.0)).length() < 0.03, "{mean}");
        let quarter = places.iter().filter(|place| place.translation.x > 1.0).count() as f64;
        assert!((quarter / places.len() as f64 - 0.25).abs() < 0.02);
        let normal = DVec3::new(-0.1, 1.0, 0.0).normalize();
        for place in &places {
            assert!((place.translation.y - 0.1 * place.translation.x).abs() < 1e-6);
            let up = place.matrix3.y_axis;
            assert!((up.normalize() - normal).length() < 1e-6 && (0.5..=2.0).contains(&up.length()));
        }
        let other = ScatteredCopies { seed: 1, ..scatter.clone() };
        assert_ne!(scattered(&other).unwrap()[0], places[0]);
        assert_eq!(scattered(&scatter).unwrap(), places);
        let lost = ScatteredCopies { on: "flor".into(), ..scatter };
        assert!(scattered(&lost).unwrap_err().contains("no shape of that name"));
    }
}
