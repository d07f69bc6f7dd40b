//! The scene builder: checks of the input, and the distribution of primitives over trees.

use std::mem::take;
use std::ops::Range;

use super::error::BuildError;
use super::scene::{Owners, Scene, Statistics};
use crate::bvh::build::primitives::PrimitiveArrays;
use crate::bvh::{Bvh, Instance};
use crate::math::{Aabb, DAffine3, DMat3, DVec3, NONE};

/// The largest magnitude of coordinates, radii and matrix entries: products of three of them, as in the triangle
/// test, must be finite in single precision.
pub const MAX_COORDINATE: f32 = 1e12;

/// The largest number of vertices, triangles, spheres, shapes and instances of a scene, each: 2²⁹.
pub const MAX_PRIMITIVES: usize = 1 << 29;

/// The number of a mesh or of a set of spheres: shapes count from 0 in the order in which they are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ShapeId(pub u32);

/// The number of a placed shape: instances count from 0 in the order in which they are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct InstanceId(pub u32);

/// Collects shapes and their placements. See the [module](super) for an example.
///
/// Input is checked and copied immediately. After an error the builder is unchanged and can still be used.
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    /// The vertices of all meshes.
    positions: Vec<[f32; 3]>,
    /// The triangles of all meshes, by indices into all positions.
    triangles: Vec<[u32; 3]>,
    /// The centres and radii of spheres.
    spheres: Vec<[f32; 4]>,
    shapes: Vec<ShapeRange>,
    placed: Vec<(ShapeId, DAffine3)>,
}

/// The parts of the builder's arrays that hold a shape.
#[derive(Clone, Debug)]
struct ShapeRange {
    vertices: Range<usize>,
    triangles: Range<usize>,
    spheres: Range<usize>,
}

impl SceneBuilder {
    /// Creates an empty builder.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mesh: vertices, and triangles as indices into them, counted from 0.
    ///
    /// Triangles without area are allowed and never hit, vertices that no triangle uses are allowed, and so are meshes
    /// without triangles.
    ///
    /// # Errors
    ///
    /// [`BuildError::Vertex`], [`BuildError::Index`] and [`BuildError::TooMany`].
    pub fn add_mesh(
        &mut self,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
    ) -> Result<ShapeId, BuildError> {
        let shape = self.next_shape()?;
        let first = self.positions.len();
        count("vertices", first, positions.len())?;
        count("triangles", self.triangles.len(), triangles.len())?;
        if let Some(vertex) = positions.iter().position(|p| !p.iter().all(|c| in_range(*c))) {
            return Err(BuildError::Vertex { shape: shape.0, vertex, position: positions[vertex] });
        }
        let vertices = positions.len();
        let wrong = triangles.iter().enumerate().find_map(|(triangle, corners)| {
            let index = corners.iter().find(|index| **index as usize >= vertices)?;
            Some(BuildError::Index { shape: shape.0, triangle, index: *index, vertices })
        });
        if let Some(error) = wrong {
            return Err(error);
        }
        self.positions.extend_from_slice(positions);
        self.triangles.extend(triangles.iter().map(|corners| corners.map(|index| first as u32 + index)));
        let triangles = self.triangles.len() - triangles.len()..self.triangles.len();
        self.shapes.push(ShapeRange { vertices: first..self.positions.len(), triangles, spheres: 0..0 });
        Ok(shape)
    }

    /// Adds a set of spheres: x, y, z and radius of each.
    ///
    /// # Errors
    ///
    /// [`BuildError::Sphere`] and [`BuildError::TooMany`].
    pub fn add_spheres(&mut self, spheres: &[[f32; 4]]) -> Result<ShapeId, BuildError> {
        let shape = self.next_shape()?;
        let first = self.spheres.len();
        count("spheres", first, spheres.len())?;
        let fine = |s: &[f32; 4]| s.iter().all(|c| in_range(*c)) && s[3] > 0.0;
        if let Some(sphere) = spheres.iter().position(|s| !fine(s)) {
            let [x, y, z, radius] = spheres[sphere];
            return Err(BuildError::Sphere { shape: shape.0, sphere, center: [x, y, z], radius });
        }
        self.spheres.extend_from_slice(spheres);
        self.shapes.push(ShapeRange { vertices: 0..0, triangles: 0..0, spheres: first..self.spheres.len() });
        Ok(shape)
    }

    /// Places a shape: `to_world` maps its coordinates to those of the scene. A shape can be placed any number of
    /// times, and one that is not placed cannot be hit.
    ///
    /// Any affine transform with an inverse will do: one that scales unevenly turns spheres into ellipsoids, and
    /// mirroring is fine, too. A shape that is placed once costs no more than its triangles would without a transform.
    /// Each placement of a shape that is placed several times costs some memory, and a transform of every ray that
    /// comes near it.
    ///
    /// # Errors
    ///
    /// [`BuildError::UnknownShape`], [`BuildError::Transform`] and [`BuildError::TooMany`].
    pub fn place(&mut self, shape: ShapeId, to_world: &DAffine3) -> Result<InstanceId, BuildError> {
        let instance = self.placed.len() as u32;
        count("instances", self.placed.len(), 1)?;
        if shape.0 as usize >= self.shapes.len() {
            let shapes = self.shapes.len();
            return Err(BuildError::UnknownShape { instance, shape: shape.0, shapes });
        }
        let wrong = |reason| Err(BuildError::Transform { instance, reason });
        if !to_world.is_finite() {
            return wrong("is not made of numbers");
        }
        let determinant = to_world.matrix3.determinant();
        if determinant == 0.0 || !determinant.is_finite() {
            return wrong("squeezes space flat");
        }
        let entries = |m: &DAffine3| m.to_cols_array().into_iter().all(|entry| in_range(entry as f32));
        if !entries(to_world) || !entries(&to_world.inverse()) {
            return wrong("or its inverse is too large");
        }
        self.placed.push((shape, *to_world));
        Ok(InstanceId(instance))
    }

    fn next_shape(&self) -> Result<ShapeId, BuildError> {
        count("shapes", self.shapes.len(), 1)?;
        Ok(ShapeId(self.shapes.len() as u32))
    }

    /// Builds the acceleration structure, on all threads of the rayon pool that this is called from (the global one, if
    /// from none). Time grows as n log n with the number of primitives. An empty scene is allowed: no ray hits it.
    ///
    /// # Errors
    ///
    /// [`BuildError::OutOfReach`].
    pub fn build(mut self) -> Result<Scene, BuildError> {
        let in_world = self.move_to_world()?;
        let ordered = self.in_order(&in_world);
        let geometry = PrimitiveArrays {
            positions: &self.positions,
            triangles: &ordered.triangles,
            spheres: &ordered.spheres,
        };
        let mut bvh = Bvh::default();
        let mut roots = vec![None; self.shapes.len()];
        for (shape, triangles, spheres) in &ordered.subtrees {
            roots[*shape] = bvh.add_tree(&geometry, triangles.clone(), spheres.clone());
        }
        let mut owners = Owners { in_world, ..ordered.owners };
        for (instance, (shape, to_world)) in self.placed.iter().enumerate() {
            let Some(root) = roots[shape.0 as usize] else { continue };
            if !stays_in_reach(&root.bounds, to_world) {
                return Err(BuildError::OutOfReach { instance: instance as u32, shape: shape.0 });
            }
            bvh.instances.push(Instance::new(to_world, root));
            owners.instances.push(instance as u32);
        }
        let [triangles, spheres] = ordered.world;
        bvh.add_root(&geometry, 0..triangles, 0..spheres);
        let statistics = Statistics {
            shapes: self.shapes.len(),
            instances: self.placed.len(),
            triangles: ordered.triangles.len(),
            spheres: ordered.spheres.len(),
            build: bvh.statistics,
        };
        Ok(Scene { bvh, owners, statistics })
    }

    /// Transforms shapes that are placed once, so that they lie in the world's own tree. Returns the instance of each
    /// of these shapes, and [`NONE`] for the others.
    fn move_to_world(&mut self) -> Result<Vec<u32>, BuildError> {
        let mut uses = vec![0u32; self.shapes.len()];
        self.placed.iter().for_each(|(shape, _)| uses[shape.0 as usize] += 1);
        let mut in_world = vec![NONE; self.shapes.len()];
        for (instance, (shape, to_world)) in self.placed.iter().enumerate() {
            let ShapeRange { vertices, spheres, .. } = &self.shapes[shape.0 as usize];
            // Spheres must stay spheres.
            let is_possible = spheres.is_empty() || to_world.matrix3 == DMat3::IDENTITY;
            if uses[shape.0 as usize] > 1 || !is_possible {
                continue;
            }
            in_world[shape.0 as usize] = instance as u32;
            if *to_world == DAffine3::IDENTITY {
                continue;
            }
            let positions = self.positions[vertices.clone()].iter_mut();
            let centers = self.spheres[spheres.clone()].iter_mut().filter_map(|s| s.first_chunk_mut());
            if !positions.chain(centers).all(|position: &mut [f32; 3]| transform(position, to_world)) {
                return Err(BuildError::OutOfReach { instance: instance as u32, shape: shape.0 });
            }
        }
        Ok(in_world)
    }

    /// Puts the primitives of the world first and those of each subtree together; shapes that are not placed are left
    /// out.
    fn in_order(&mut self, in_world: &[u32]) -> Ordered {
        let mut is_placed = vec![false; self.shapes.len()];
        self.placed.iter().for_each(|(shape, _)| is_placed[shape.0 as usize] = true);
        let (world, below): (Vec<usize>, Vec<usize>) =
            (0..self.shapes.len()).filter(|s| is_placed[*s]).partition(|s| in_world[*s] != NONE);
        let mut out = Ordered::default();
        let is_sorted = world.len() == self.shapes.len();
        if is_sorted {
            // The usual case, and a large one: moved, not copied.
            (out.triangles, out.spheres) = (take(&mut self.triangles), take(&mut self.spheres));
        }
        let mut ends = [0u32; 2];
        for (order, &shape) in world.iter().chain(&below).enumerate() {
            let ShapeRange { triangles, spheres, .. } = &self.shapes[shape];
            let firsts = ends;
            ends = [ends[0] + triangles.len() as u32, ends[1] + spheres.len() as u32];
            if !is_sorted {
                out.triangles.extend_from_slice(&self.triangles[triangles.clone()]);
                out.spheres.extend_from_slice(&self.spheres[spheres.clone()]);
            }
            if !triangles.is_empty() {
                out.owners.triangles.push((firsts[0], shape as u32));
            }
            if !spheres.is_empty() {
                out.owners.spheres.push((firsts[1], shape as u32));
            }
            if order < world.len() {
                out.world = ends;
            } else {
                out.subtrees.push((shape, firsts[0]..ends[0], firsts[1]..ends[1]));
            }
        }
        out
    }
}

/// Primitives in the order of their ids.
#[derive(Default)]
struct Ordered {
    triangles: Vec<[u32; 3]>,
    spheres: Vec<[f32; 4]>,
    owners: Owners,
    /// The number of triangles and of spheres in the world's own tree.
    world: [u32; 2],
    /// Shapes with a tree of their own, with their triangles and spheres.
    subtrees: Vec<(usize, Range<u32>, Range<u32>)>,
}

/// Transforms a point, rounded once; returns true if it is still in range.
fn transform(position: &mut [f32; 3], matrix: &DAffine3) -> bool {
    let moved = matrix.transform_point3(DVec3::from_array(position.map(f64::from))).as_vec3();
    *position = moved.to_array();
    position.iter().all(|c| in_range(*c))
}

/// True if all of a box is in range after the transform.
fn stays_in_reach(bounds: &Aabb, to_world: &DAffine3) -> bool {
    let corners = (0..8).map(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        [pick(0), pick(1), pick(2)]
    });
    corners.into_iter().all(|mut corner| transform(&mut corner, to_world))
}

fn in_range(coordinate: f32) -> bool {
    coordinate.abs() <= MAX_COORDINATE
}

fn count(what: &'static str, there: usize, more: usize) -> Result<(), BuildError> {
    let count = there.saturating_add(more);
    if count > MAX_PRIMITIVES { Err(BuildError::TooMany { what, count }) } else { Ok(()) }
}
