//! The shape of trees: the part of their boxes and blocks that is used, and their depth.

use std::collections::HashMap;

use super::sidedness::PrimitiveRef;
use super::{BLOCK, Bvh, Child, ChildKind, Instance, WIDTH};
use crate::math::{Aabb, Vec3};

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

/// A box of the tree.
pub struct TreeBox {
    /// Its corners; those whose numbers differ in one bit share an edge. The boxes of a placed subtree are turned.
    pub corners: [Vec3; 8],
    /// True if it holds primitives, and no other boxes.
    pub is_leaf: bool,
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
            depth: self.levels(),
        }
    }

    /// The largest level of [`Bvh::visit_level`] at which there are boxes.
    pub fn levels(&self) -> usize {
        self.root.map_or(0, |root| self.depth(root.child, &mut HashMap::new()))
    }

    /// Calls a function with the boxes at a level: that of the world's tree at level 0, those of its topmost node's
    /// children at level 1, and so on. Returns false if there are more, because it visits at most `most` boxes.
    pub fn visit_level(&self, level: usize, most: usize, visit: &mut dyn FnMut(TreeBox)) -> bool {
        let mut waiting: Vec<_> =
            self.root.iter().map(|root| (root.child, root.bounds, 0, None::<&Instance>)).collect();
        for _ in 0..most {
            let Some((mut child, mut bounds, depth, mut place)) = waiting.pop() else { return true };
            if child.kind() == ChildKind::Instance {
                let instance = &self.instances[child.index()];
                (child, bounds, place) = (instance.root.child, instance.root.bounds, Some(instance));
            }
            if depth == level {
                let is_leaf = child.kind() != ChildKind::Node;
                visit(TreeBox { corners: corners(&bounds, place), is_leaf });
            } else if child.kind() == ChildKind::Node {
                let node = &self.nodes[child.index()];
                let slots = (0..WIDTH).rev().filter(|slot| is_used(node, *slot));
                waiting
                    .extend(slots.map(|slot| (Child(node.child[slot]), node.bounds(slot), depth + 1, place)));
            }
        }
        waiting.is_empty()
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

/// The corners of a box in the world, from the space of an instance.
fn corners(bounds: &Aabb, place: Option<&Instance>) -> [Vec3; 8] {
    std::array::from_fn(|corner| {
        let side = |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let local = [0, 1, 2].map(side);
        let Some(instance) = place else { return Vec3::from_array(local) };
        let row = |[a, b, c, d]: [f32; 4]| a * local[0] + b * local[1] + c * local[2] + d;
        Vec3::from_array(instance.to_world.map(row))
    })
}

/// True if a node's box holds something.
fn is_used(node: &super::Node, slot: usize) -> bool {
    node.planes[0][0][slot] <= node.planes[0][1][slot]
}

#[cfg(test)]
mod tests {
    use super::super::{Node, Root, TriangleBlock};
    use super::*;
    use crate::math::DAffine3;

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
