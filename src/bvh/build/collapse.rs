//! Collapses a binary tree into wide nodes with the least expected cost, by dynamic programming (Ylitie, Karras and
//! Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017, section 4). The costs are
//! computed while the binary tree is built, from its leaves up, and discarded; a node stores only how to open it.

use smallvec::SmallVec;

use super::binary::BinaryNode;
use crate::bvh::layout::{Child, ChildKind, WIDTH};

/// The roles of the binary nodes in the wide tree.
pub struct CollapsePlan {
    /// Binary nodes that become wide ones, depth first.
    pub nodes: Vec<u32>,
    /// Leaves that become blocks of triangles, in their order.
    pub triangles: Vec<u32>,
    /// Leaves that become blocks of spheres, in their order.
    pub spheres: Vec<u32>,
    /// The number of wide nodes on the longest path.
    pub depth: usize,
}

impl CollapsePlan {
    /// Plans a tree and writes every child's word into it. Its nodes and blocks come after the existing ones
    /// (`before`); `order` holds the ids of instances.
    pub fn new(tree: &mut [BinaryNode], order: &[u32], before: [usize; 3]) -> Self {
        let leaves = tree.iter().filter(|node| !node.has_children()).count();
        let mut plan =
            Self { nodes: Vec::new(), triangles: Vec::with_capacity(leaves), spheres: Vec::new(), depth: 0 };
        let [nodes, triangles, spheres] = before;
        let mut todo = vec![(0u32, 1)];
        let mut children = SmallVec::new();
        while let Some((index, depth)) = todo.pop() {
            let node = &mut tree[index as usize];
            let (kind, list, before) = match node.kind {
                ChildKind::Node => (ChildKind::Node, &mut plan.nodes, nodes),
                ChildKind::Triangles => (ChildKind::Triangles, &mut plan.triangles, triangles),
                ChildKind::Spheres => (ChildKind::Spheres, &mut plan.spheres, spheres),
                ChildKind::Instance => {
                    node.child = Child::new(ChildKind::Instance, order[node.offset as usize] as usize);
                    continue;
                }
            };
            node.child = Child::new(kind, before + list.len());
            list.push(index);
            if kind == ChildKind::Node {
                plan.depth = plan.depth.max(depth);
                children.clear();
                open(tree, index as usize, &mut children);
                todo.extend(children.iter().rev().map(|child| (*child, depth + 1)));
            }
        }
        plan
    }
}

/// Collects the binary nodes that are the children of a wide node.
pub fn open(tree: &[BinaryNode], index: usize, children: &mut SmallVec<[u32; WIDTH]>) {
    open_as(tree, index, 1, true, children);
}

fn open_as(
    tree: &[BinaryNode],
    index: usize,
    roots: usize,
    is_top: bool,
    children: &mut SmallVec<[u32; WIDTH]>,
) {
    let node = &tree[index];
    let first = node.opening.first(roots);
    if first == 0 || (roots == 1 && !is_top) {
        children.push(index as u32);
        return;
    }
    let roots = if is_top { WIDTH } else { roots };
    open_as(tree, index + 1, first, false, children);
    open_as(tree, index + node.second(), roots - first, false, children);
}
