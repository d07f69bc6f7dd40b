//! From geometry to a tree: references, build, collapse, blocks.

use std::ops::Range;

use rayon::prelude::*;
use smallvec::SmallVec;

use super::binary::{BinaryNode, Tree};
use super::builder::{build, peak_bytes};
use super::collapse::{CollapsePlan, open};
use super::primitives::{PrimitiveArrays, Primitives};
use crate::bvh::intersect::sphere::stored_radius;
use crate::bvh::layout::sidedness::{PrimitiveRef, Sidedness};
use crate::bvh::layout::{Bvh, ChildKind, Instance, Node, Root, SphereBlock, TriangleBlock, WIDTH, pad};
use crate::math::{Aabb, DVec3, Vec3};
use crate::simd::prefer_large_pages;

impl Bvh {
    /// Adds a tree over parts of the geometry; `None` if they are empty.
    pub fn add_tree(
        &mut self,
        geometry: &PrimitiveArrays,
        triangles: Range<u32>,
        spheres: Range<u32>,
    ) -> Option<Root> {
        self.timed(|bvh| bvh.add(Primitives::new(geometry, triangles, spheres, Vec::new())))
    }

    /// Adds the world's tree over parts of the geometry and over all instances, whose subtrees must have been added
    /// before.
    pub fn add_root(&mut self, geometry: &PrimitiveArrays, triangles: Range<u32>, spheres: Range<u32>) {
        let instances = self.instances.par_iter().map(|instance| self.around(instance)).collect();
        self.root = self.timed(|bvh| bvh.add(Primitives::new(geometry, triangles, spheres, instances)));
    }

    /// A padded box in world space around an instance: around the transformed boxes of its topmost node's children,
    /// which is a good deal smaller than its own box transformed.
    fn around(&self, instance: &Instance) -> Aabb {
        let Root { child, bounds } = instance.root;
        if child.kind() != ChildKind::Node {
            return pad(transformed(&bounds, &instance.to_world));
        }
        let node = &self.nodes[child.index()];
        let mut around = Aabb::EMPTY;
        for slot in 0..WIDTH {
            let bounds = node.bounds(slot);
            if !bounds.is_empty() {
                around = around.union(transformed(&bounds, &instance.to_world));
            }
        }
        pad(around)
    }

    fn timed<T>(&mut self, build: impl FnOnce(&mut Self) -> T) -> T {
        let start = std::time::Instant::now();
        let built = build(self);
        self.statistics.time += start.elapsed();
        built
    }

    /// Adds a tree over primitives; `None` if there are none.
    pub(in crate::bvh) fn add(&mut self, primitives: Primitives) -> Option<Root> {
        if primitives.count() == 0 {
            return None;
        }
        let Tree { mut nodes, order } = build(&primitives);
        let peak =
            peak_bytes(primitives.count(), primitives.are_mixed()) + size_of_val(&primitives.parts[..]);
        let geometry = primitives.geometry;
        drop(primitives);
        let before = [self.nodes.len(), self.triangles.len(), self.spheres.len()];
        let plan = CollapsePlan::new(&mut nodes, &order, before);
        self.stack_size = self.stack_size.max(WIDTH * (plan.depth + 1));
        let leaf = |index: &u32| {
            let leaf = &nodes[*index as usize];
            &order[leaf.offset as usize..][..leaf.count as usize]
        };
        make_room(&mut self.nodes, plan.nodes.len());
        make_room(&mut self.triangles, plan.triangles.len());
        make_room(&mut self.spheres, plan.spheres.len());
        // The size of these chunks hardly matters, but chunks of one would cause much work stealing.
        self.nodes.par_extend(plan.nodes.par_iter().with_min_len(64).map(|index| wide_node(&nodes, *index)));
        let triangles = plan.triangles.par_iter().with_min_len(256);
        self.triangles.par_extend(triangles.map(|index| triangle_block(geometry, leaf(index))));
        let spheres = plan.spheres.par_iter().with_min_len(256);
        self.spheres.par_extend(spheres.map(|index| sphere_block(geometry, leaf(index))));
        self.statistics.peak_bytes = self.statistics.peak_bytes.max(peak);
        Some(Root { child: nodes[0].child, bounds: nodes[0].bounds })
    }
}

/// Reserves memory for more elements. Rays visit a large tree in no order, so large pages are better.
fn make_room<T>(array: &mut Vec<T>, more: usize) {
    array.reserve(more);
    prefer_large_pages(array.spare_capacity_mut());
}

fn wide_node(tree: &[BinaryNode], index: u32) -> Node {
    let mut node = Node::EMPTY;
    let mut children = SmallVec::new();
    open(tree, index as usize, &mut children);
    for (slot, child) in children.into_iter().enumerate() {
        let child = &tree[child as usize];
        node.set(slot, &child.bounds, child.child);
    }
    node.put_in_order();
    node
}

pub(in crate::bvh) fn triangle_block(geometry: &PrimitiveArrays, ids: &[u32]) -> TriangleBlock {
    let mut block = TriangleBlock::EMPTY;
    // Parts of one triangle may meet in a leaf.
    let once = ids.iter().enumerate().filter(|(place, id)| !ids[..*place].contains(id));
    for (lane, (_, id)) in once.enumerate() {
        let corners = geometry.corners(*id);
        // Rounding may let rays hit a triangle without area beside its ends: collapsed to a point, it is never hit.
        block.set(lane, if has_area(corners) { corners } else { [corners[0]; 3] }, *id);
    }
    block
}

/// True if three corners are not collinear: products of differences of floats of like size are exact.
fn has_area(corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
    (b - a).cross(c - a) != DVec3::ZERO
}

fn sphere_block(geometry: &PrimitiveArrays, ids: &[u32]) -> SphereBlock {
    let mut block = SphereBlock::EMPTY;
    for (lane, id) in ids.iter().enumerate() {
        let [x, y, z, radius] = geometry.spheres[*id as usize];
        for (axis, value) in [x, y, z].into_iter().enumerate() {
            block.center[axis][lane] = value;
        }
        block.radius[lane] = stored_radius([x, y, z], radius);
        block.words[lane] = PrimitiveRef::new(*id, Sidedness::Always).0;
    }
    block
}

/// The box around a transformed box, a little larger than necessary: rays are transformed with rounding, too.
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
