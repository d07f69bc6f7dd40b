//! Geometry to tree: references, build, collapse, blocks.

use std::ops::Range;

use rayon::prelude::*;

use super::build::{Reference, build};
use super::collapse::collapse;
use super::layout::{Bvh, Child, Kind, Root, SPHERE, SphereBlock, TriangleBlock, pad};
use crate::math::{Aabb, Vec3};

/// The arrays that primitive ids refer to.
#[derive(Clone, Copy)]
pub struct Geometry<'a> {
    /// Vertices.
    pub positions: &'a [[f32; 3]],
    /// Triangles by vertex indices; a triangle's id is its place here.
    pub triangles: &'a [[u32; 3]],
    /// Centres and radii; a sphere's id is its place here with the [`SPHERE`] bit.
    pub spheres: &'a [[f32; 4]],
}

impl Geometry<'_> {
    fn corners(&self, triangle: u32) -> [[f32; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    fn triangle_bounds(&self, triangle: u32) -> Aabb {
        Aabb::around(self.corners(triangle).map(Vec3::from_array))
    }

    fn sphere_bounds(&self, sphere: u32) -> Aabb {
        let [x, y, z, radius] = self.spheres[sphere as usize];
        let (center, radius) = (Vec3::new(x, y, z), Vec3::splat(radius));
        // Centre ± radius may cancel: pad by what went into it, not by what came out.
        let extra = (center.abs() + radius) * super::layout::PADDING;
        Aabb { min: center - radius - extra, max: center + radius + extra }
    }
}

impl Bvh {
    /// Adds a tree over some of the geometry; nothing to hold, no tree.
    pub fn add_tree(
        &mut self,
        geometry: &Geometry,
        triangles: Range<u32>,
        spheres: Range<u32>,
    ) -> Option<Root> {
        let references = references(geometry, triangles, spheres);
        self.add_references(geometry, references)
    }

    /// Adds the world's tree over geometry and over all instances, whose subtrees must
    /// have been added before, with the box of each in its own space.
    pub fn add_root(
        &mut self,
        geometry: &Geometry,
        triangles: Range<u32>,
        spheres: Range<u32>,
        subtrees: &[Aabb],
    ) {
        let mut references = references(geometry, triangles, spheres);
        references.extend(self.instances.iter().zip(subtrees).enumerate().map(|(i, (instance, bounds))| {
            Reference::new(pad(transformed(bounds, &instance.to_world)), Kind::Instance, i as u32)
        }));
        self.root = self.add_references(geometry, references);
    }

    fn add_references(&mut self, geometry: &Geometry, mut references: Vec<Reference>) -> Option<Root> {
        if references.is_empty() {
            return None;
        }
        let start = std::time::Instant::now();
        let tree = build(&mut references);
        let root = collapse(&tree, &references, self, &mut |bvh, leaf| bvh.add_leaf(geometry, leaf));
        self.statistics.time += start.elapsed();
        Some(root)
    }

    fn add_leaf(&mut self, geometry: &Geometry, leaf: &[Reference]) -> Child {
        match leaf[0].kind() {
            Kind::Spheres => {
                let mut block = SphereBlock::EMPTY;
                for (lane, reference) in leaf.iter().enumerate() {
                    let [x, y, z, radius] = geometry.spheres[reference.id as usize];
                    for (axis, value) in [x, y, z].into_iter().enumerate() {
                        block.center[axis][lane] = value;
                    }
                    block.radius[lane] = radius;
                    block.primitive[lane] = reference.id | SPHERE;
                }
                self.spheres.push(block);
                Child::new(Kind::Spheres, self.spheres.len() - 1)
            }
            Kind::Triangles => {
                let mut block = TriangleBlock::EMPTY;
                for (lane, reference) in leaf.iter().enumerate() {
                    block.set(lane, geometry.corners(reference.id), reference.id);
                }
                self.triangles.push(block);
                Child::new(Kind::Triangles, self.triangles.len() - 1)
            }
            _ => Child::new(Kind::Instance, leaf[0].id as usize),
        }
    }
}

fn references(geometry: &Geometry, triangles: Range<u32>, spheres: Range<u32>) -> Vec<Reference> {
    let mut references = Vec::with_capacity(triangles.len() + spheres.len());
    let triangle = |id| Reference::new(pad(geometry.triangle_bounds(id)), Kind::Triangles, id);
    references.par_extend(triangles.into_par_iter().map(triangle));
    references.extend(spheres.map(|id| Reference::new(geometry.sphere_bounds(id), Kind::Spheres, id)));
    references
}

/// The box around a transformed box. A little larger than need be: rays are transformed
/// with rounding, too.
fn transformed(bounds: &Aabb, rows: &[[f32; 4]; 3]) -> Aabb {
    let (center, half) = (bounds.center(), bounds.size() * 0.5);
    let mut out = Aabb::EMPTY;
    let (mut middle, mut extent) = ([0.0f32; 3], [0.0f32; 3]);
    for (axis, [a, b, c, t]) in rows.iter().enumerate() {
        middle[axis] = a * center.x + b * center.y + c * center.z + t;
        let size = a.abs() * half.x + b.abs() * half.y + c.abs() * half.z;
        let moved = (a * center.x).abs() + (b * center.y).abs() + (c * center.z).abs() + t.abs();
        extent[axis] = size + (size + moved) * 4.0 * f32::EPSILON;
    }
    out.min = Vec3::from_array(middle) - Vec3::from_array(extent);
    out.max = Vec3::from_array(middle) + Vec3::from_array(extent);
    out
}
