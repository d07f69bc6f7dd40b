//! The extent of a scene's shapes in any direction.

use std::collections::HashMap;

use glam::BVec3;

use crate::math::{Aabb, DAffine3, DVec3, Vec3};
use crate::world::shapes::Fineness;
use crate::world::transforms::{self, WorldTransforms, placement};
use crate::world::{Mesh, Shape, World};

/// The most vertices that are used, each counted as often as its mesh is placed. If there are more, the corners of
/// meshes' boxes stand for them.
const MOST_VERTICES: usize = 4_000_000;

/// All shapes of a scene, with their transforms.
pub(in crate::formats) struct BoundingPoints {
    shapes: Vec<(DAffine3, Hull)>,
    /// Points that determine the extents of shapes; of meshes, the vertices that triangles use.
    points: Vec<Vec<Vec3>>,
}

/// The extent of a shape.
enum Hull {
    /// A sphere of that radius.
    Sphere(f32),
    /// Points, by their index.
    Points(usize),
}

impl BoundingPoints {
    /// The extent of a world; none if it is empty, or if its transforms are invalid.
    pub fn of(world: &World) -> Option<BoundingPoints> {
        BoundingPoints::up_to(world, MOST_VERTICES)
    }

    fn up_to(world: &World, most_vertices: usize) -> Option<BoundingPoints> {
        let transforms: WorldTransforms = transforms::to_world(world, &world.in_order()).ok()?;
        let mut points: Vec<Vec<Vec3>> = world.assets.meshes.iter().map(|mesh| used_vertices(mesh)).collect();
        // Equal parametric shapes share their points.
        let mut known: HashMap<String, usize> = HashMap::new();
        let mut hull = |shape: &Shape| {
            let mut add = |of: Vec<Vec3>| {
                points.push(of);
                points.len() - 1
            };
            Hull::Points(match shape {
                Shape::Sphere { radius_m } => return Hull::Sphere(*radius_m),
                Shape::Mesh(id) => id.0 as usize,
                _ => match shape.flat_corners() {
                    Some((_, corners)) => add(corners),
                    // Those that may be large.
                    None if matches!(shape, Shape::Strands { .. } | Shape::HeightField { .. }) => {
                        add(shape.corners_around(&world.assets).map_or_else(Vec::new, |ends| corners(&ends)))
                    }
                    None => *known.entry(format!("{shape:?}")).or_insert_with(|| {
                        let mesh = shape.to_mesh(&world.assets, Fineness::DEFAULT);
                        add(mesh.and_then(Result::ok).map_or_else(Vec::new, |mesh| used_vertices(&mesh)))
                    }),
                },
            })
        };
        let mut query = world.entities.query::<(hecs::Entity, &Shape)>();
        let placed = query.iter().filter_map(|(entity, shape)| {
            Some((placement(world, shape, transforms.get(&entity)?), hull(shape)))
        });
        let mut shapes: Vec<_> = placed.collect();
        shapes.retain(|(_, hull)| match hull {
            Hull::Sphere(_) => true,
            Hull::Points(number) => points.get(*number).is_some_and(|points| !points.is_empty()),
        });
        let vertices = |(_, hull): &(_, Hull)| match hull {
            Hull::Sphere(_) => 0,
            Hull::Points(number) => points[*number].len(),
        };
        if shapes.iter().map(vertices).sum::<usize>() > most_vertices {
            points.iter_mut().filter(|points| points.len() > 8).for_each(|points| *points = corners(points));
        }
        (!shapes.is_empty()).then_some(BoundingPoints { shapes, points })
    }

    /// The largest dot product of any point with `direction`, which may have any length (the support function).
    pub fn along(&self, direction: DVec3) -> f64 {
        self.shapes
            .iter()
            .map(|(matrix, hull)| self.of_shape(matrix, hull, direction))
            .fold(f64::MIN, f64::max)
    }

    /// The least and greatest corner of the box around everything.
    pub fn bounds(&self) -> [DVec3; 2] {
        let most = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| [-self.along(-axis), self.along(axis)]);
        [0, 1].map(|end| DVec3::new(most[0][end], most[1][end], most[2][end]))
    }

    fn of_shape(&self, matrix: &DAffine3, hull: &Hull, direction: DVec3) -> f64 {
        // In local space: one product a vertex.
        let local = matrix.matrix3.transpose() * direction;
        let start = matrix.translation.dot(direction);
        let most = |points: &[Vec3]| points.iter().map(|p| p.as_dvec3().dot(local)).fold(f64::MIN, f64::max);
        start
            + match hull {
                Hull::Sphere(radius_m) => f64::from(*radius_m) * local.length(),
                Hull::Points(number) => most(&self.points[*number]),
            }
    }
}

fn used_vertices(mesh: &Mesh) -> Vec<Vec3> {
    let mut is_used = vec![false; mesh.positions.len()];
    for vertex in mesh.triangles.as_flattened() {
        if let Some(is_used) = is_used.get_mut(*vertex as usize) {
            *is_used = true;
        }
    }
    let used = mesh.positions.iter().zip(is_used).filter(|(_, is_used)| *is_used);
    used.map(|(position, _)| *position).collect()
}

/// The corners of the box around some points.
fn corners(points: &[Vec3]) -> Vec<Vec3> {
    let Aabb { min, max } = Aabb::around(points.iter().copied());
    let corner = |number: u32| {
        let is_far = BVec3::new(number & 1 != 0, number & 2 != 0, number & 4 != 0);
        Vec3::select(is_far, max, min)
    };
    (0..8).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{Parent, Transform};

    fn moved(to: DVec3, scale: Vec3) -> Transform {
        Transform::Trs { translation: to, rotation: glam::Quat::IDENTITY, scale }
    }

    fn world() -> World {
        let mut world = World::default();
        let root = world.entities.spawn((moved(DVec3::new(10.0, 0.0, 0.0), Vec3::ONE),));
        let egg = Shape::Sphere { radius_m: 1.0 };
        world.entities.spawn((egg, moved(DVec3::ZERO, Vec3::new(1.0, 2.0, 3.0)), Parent(root)));
        // The first nine are used, the last is not.
        let mut positions = vec![Vec3::ZERO; 7];
        positions.extend([Vec3::new(0.0, -5.0, 0.0), Vec3::new(1.0, 0.0, 8.0), Vec3::splat(100.0)]);
        let triangles = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        let mesh = world.assets.add_mesh(Mesh { positions, triangles, ..Mesh::default() });
        world.entities.spawn((Shape::Mesh(mesh), Transform::IDENTITY));
        world
    }

    #[test]
    fn extent_is_that_of_the_used_vertices() {
        let world = world();
        let extent = BoundingPoints::of(&world).unwrap();
        assert_eq!(extent.bounds(), [DVec3::new(0.0, -5.0, -3.0), DVec3::new(11.0, 2.0, 8.0)]);
        // The ellipsoid's farthest point in a direction between its axes.
        let aslant = extent.along(DVec3::new(1.0, 1.0, 0.0));
        assert!((aslant - (10.0 + f64::sqrt(5.0))).abs() < 1e-12, "{aslant}");
        // Boxes have the same extent along the axes, and at least the same between them.
        let boxed = BoundingPoints::up_to(&world, 8).unwrap();
        assert_eq!(boxed.bounds(), extent.bounds());
        assert_eq!(extent.along(DVec3::new(0.0, -1.0, 1.0)), 8.0);
        assert_eq!(boxed.along(DVec3::new(0.0, -1.0, 1.0)), 13.0);
        assert!(BoundingPoints::of(&World::default()).is_none());
    }
}
