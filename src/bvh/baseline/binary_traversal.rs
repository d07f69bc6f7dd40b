//! Traversal of the binary tree itself: the baseline for the wide one.
//!
//! Nodes are as in PBRT (4th ed., 7.3.4): 32 bytes each, depth first, traversed with a stack, the nearer child first.
//! Leaves are the wide tree's blocks with the wide tree's test, so that the two differ only in the way to the leaves.

use crate::bvh::build::assemble::triangle_block;
use crate::bvh::build::binary::{BinaryNode, Tree};
use crate::bvh::build::builder::build;
use crate::bvh::build::primitives::{PrimitiveArrays, Primitives};
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::intersect::leaf::{self, LeafContext};
use crate::bvh::intersect::ray::LocalRay;
use crate::bvh::intersect::ray::is_finite;
use crate::bvh::layout::TriangleBlock;
use crate::bvh::{HitsMut, Rays};
use crate::math::{Aabb, Hit, Ray};
use crate::simd::{Isa, Kernel, Lanes, dispatch};

/// A binary tree over triangles.
pub struct BinaryBvh {
    nodes: Vec<BinaryBvhNode>,
    blocks: Vec<TriangleBlock>,
}

/// A node of 32 bytes.
struct BinaryBvhNode {
    bounds: Aabb,
    /// A leaf's block; for an inner node, the second child. The first child follows its parent.
    next: u32,
    /// The axis along which the second child lies beyond the first (`gap_axis`); 3 for a leaf.
    axis: u32,
}

const LEAF: u32 = 3;
const _: () = assert!(size_of::<BinaryBvhNode>() == 32);

impl BinaryBvh {
    /// Builds a tree over all triangles of `geometry`, as the wide tree is built.
    pub fn new(geometry: &PrimitiveArrays) -> Self {
        let count = geometry.triangles.len() as u32;
        let mut binary = Self { nodes: Vec::new(), blocks: Vec::new() };
        if count == 0 {
            return binary;
        }
        let primitives = Primitives::new(geometry, 0..count, 0..0, Vec::new());
        let Tree { nodes, order } = build(&primitives);
        binary.nodes.reserve_exact(nodes.len());
        for (index, node) in nodes.iter().enumerate() {
            let (next, axis) = if !node.has_children() {
                let ids = &order[node.offset as usize..][..usize::from(node.count)];
                binary.blocks.push(triangle_block(geometry, ids));
                (binary.blocks.len() - 1, LEAF)
            } else {
                let second = index + node.second();
                (second, gap_axis(&nodes[index + 1], &nodes[second]))
            };
            binary.nodes.push(BinaryBvhNode { bounds: node.bounds, next: next as u32, axis });
        }
        binary
    }

    /// The memory that it takes, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..])
    }

    /// Finds the nearest hit of each ray, as [`crate::bvh::closest`] does.
    pub fn closest(&self, isa: Isa, rays: Rays, hits: HitsMut) {
        dispatch(isa, BinaryWalk { tree: self, rays, hits });
    }
}

/// The axis along which two boxes' centres are farthest apart, plus 4 if the second lies before the first.
fn gap_axis(first: &BinaryNode, second: &BinaryNode) -> u32 {
    let way = second.bounds.center() - first.bounds.center();
    let axis = way.abs().max_position() as u32;
    axis | if way[axis as usize] < 0.0 { 4 } else { 0 }
}

struct BinaryWalk<'a> {
    tree: &'a BinaryBvh,
    rays: Rays<'a>,
    hits: HitsMut<'a>,
}

impl Kernel for BinaryWalk<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let mut stack = Vec::with_capacity(64);
        for i in 0..self.rays.len() {
            let ray = self.rays.get(i);
            let hit = self.tree.walk::<L>(&ray, &mut stack);
            self.hits.write(i, &hit);
        }
    }
}

impl BinaryBvh {
    #[inline(always)]
    fn walk<L: Lanes>(&self, ray: &Ray<f32>, stack: &mut Vec<u32>) -> Hit {
        let local = LocalRay::new(*ray);
        let mut best = Hit { t: ray.t_max, ..Hit::MISS };
        if self.nodes.is_empty() || !is_finite(ray) {
            return Hit::MISS;
        }
        stack.clear();
        stack.push(0);
        while let Some(mut index) = stack.pop() {
            loop {
                let node = &self.nodes[index as usize];
                let Some(near) = local.slabs.enter(&node.bounds).filter(|near| *near <= best.t) else {
                    break;
                };
                if node.axis == LEAF {
                    let visit = LeafContext::everywhere(near, ray.t_min);
                    let block = &self.blocks[node.next as usize];
                    leaf::triangles::<L, HitsMut>(block, ray, &local.shear, visit, &mut best);
                    break;
                }
                let backwards = local.slabs.near_planes[(node.axis & 3) as usize % 3] != 0;
                let (first, second) = (index + 1, node.next);
                let turned = backwards != (node.axis & 4 != 0);
                let (nearer, farther) = if turned { (second, first) } else { (first, second) };
                stack.push(farther);
                index = nearer;
            }
        }
        best
    }
}
