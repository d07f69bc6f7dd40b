//! The shape of trees: the part of their boxes and blocks that is used, and their depth.

use std::collections::HashMap;

use super::sidedness::PrimitiveRef;
use super::{BLOCK, Bvh, Child, ChildKind, WIDTH};

/// The shape of all trees together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeShape {
    /// The fraction of the nodes' boxes that are used.
    pub filled_nodes: f64,
    /// The fraction of the slots in blocks of triangles and spheres that are used.
    pub filled_blocks: f64,
    /// The largest number of nodes on a way from the world's topmost node to a primitive, placed subtrees included.
    pub depth: usize,
}

impl Bvh {
    /// Measures the trees; reads all of them.
    pub fn shape(&self) -> TreeShape {
        let boxes = |node: &super::Node| (0..WIDTH).filter(|slot| is_used(node, *slot)).count();
        let used_boxes: usize = self.nodes.iter().map(boxes).sum();
        let used = |words: &[u32; BLOCK]| words.iter().filter(|word| PrimitiveRef(**word).is_used()).count();
        let triangles: usize = self.triangles.iter().map(|block| used(&block.words)).sum();
        let spheres: usize = self.spheres.iter().map(|block| used(&block.words)).sum();
        let blocks = self.triangles.len() + self.spheres.len();
        let part = |used: usize, slots: usize| used as f64 / slots.max(1) as f64;
        TreeShape {
            filled_nodes: part(used_boxes, WIDTH * self.nodes.len()),
            filled_blocks: part(triangles + spheres, BLOCK * blocks),
            depth: self.root.map_or(0, |root| self.depth(root.child, &mut HashMap::new())),
        }
    }

    /// The depth of a subtree; `known` holds those of placed subtrees, by their topmost children.
    fn depth(&self, child: Child, known: &mut HashMap<u32, usize>) -> usize {
        match child.kind() {
            ChildKind::Triangles | ChildKind::Spheres => 0,
            ChildKind::Instance => {
                let root = self.instances[child.index()].root.child;
                if let Some(depth) = known.get(&root.0) {
                    return *depth;
                }
                let depth = self.depth(root, known);
                known.insert(root.0, depth);
                depth
            }
            ChildKind::Node => {
                let node = &self.nodes[child.index()];
                let below = (0..WIDTH).filter(|slot| is_used(node, *slot));
                1 + below.map(|slot| self.depth(Child(node.child[slot]), known)).max().unwrap_or(0)
            }
        }
    }
}

/// True if a node's box holds something.
fn is_used(node: &super::Node, slot: usize) -> bool {
    node.planes[0][0][slot] <= node.planes[0][1][slot]
}

#[cfg(test)]
mod tests {
    use super::super::{Instance, Node, Root, TriangleBlock};
    use super::*;
    use crate::math::{Aabb, DAffine3, Vec3};

    #[test]
    fn shape_of_a_node_with_a_block_and_a_placed_node() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let node = |children: &[Child]| {
            let mut node = Node::EMPTY;
            children.iter().enumerate().for_each(|(slot, child)| node.set(slot, &bounds, *child));
            node
        };
        let mut block = TriangleBlock::EMPTY;
        (0..6).for_each(|place| block.set(place, [[0.0; 3]; 3], place as u32));
        let block_of = |index| Child::new(ChildKind::Triangles, index);
        let placed = Root { child: Child::new(ChildKind::Node, 1), bounds };
        let bvh = Bvh {
            nodes: vec![node(&[block_of(0), Child::new(ChildKind::Instance, 0)]), node(&[block_of(0)])],
            triangles: vec![block],
            instances: vec![Instance::new(&DAffine3::IDENTITY, placed)],
            root: Some(Root { child: Child::new(ChildKind::Node, 0), bounds }),
            ..Bvh::default()
        };
        let expected = TreeShape { filled_nodes: 3.0 / 32.0, filled_blocks: 6.0 / 8.0, depth: 2 };
        assert_eq!(bvh.shape(), expected);
        let empty = TreeShape { filled_nodes: 0.0, filled_blocks: 0.0, depth: 0 };
        assert_eq!(Bvh::default().shape(), empty);
    }
}
