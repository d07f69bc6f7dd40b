//! Collapses a binary tree into wide nodes with the least expected cost, by dynamic programming (Ylitie, Karras and
//! Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017, section 4). The costs are
//! computed while the binary tree is built, from its leaves up, and discarded; a node stores only how to open it.

use smallvec::SmallVec;

use super::binary::BinaryNode;
use super::layout::{Child, ChildKind, WIDTH};

/// The cost of testing a node's 16 boxes, in block tests.
pub const NODE_COST: f32 = 0.8;

/// The cost of a binary subtree as at most 1, 2, … 16 children of a wide node.
#[derive(Clone, Copy, Debug)]
pub struct Costs {
    cost: [f32; WIDTH],
    /// The number of leaves, at most 16. More roots than leaves never reduce the cost.
    most: usize,
}

/// The way to open a binary node: for each number of roots that it may have, the number of them that go to its first
/// child, in four bits; 0 for a wide node of its own. The lowest four bits are for the wide node's own children.
#[derive(Clone, Copy, Debug)]
pub struct CollapseChoice(u64);

impl CollapseChoice {
    /// The choice of a block that stays whole.
    pub const NONE: CollapseChoice = CollapseChoice(0);

    /// True for [`CollapseChoice::NONE`].
    #[inline(always)]
    pub fn is_none(self) -> bool {
        self.0 == 0
    }

    fn first(self, roots: usize) -> usize {
        (self.0 >> (4 * (roots - 1))) as usize % WIDTH
    }

    fn set(&mut self, roots: usize, first: usize) {
        self.0 |= (first as u64) << (4 * (roots - 1));
    }
}

impl Costs {
    /// The costs of a block.
    pub fn block(half_area: f32) -> Self {
        Self { cost: [half_area; WIDTH], most: 1 }
    }

    /// The costs of a block that can be two, from the areas of its halves, if that is better.
    pub fn halved(half_area: f32, [left, right]: [f32; 2]) -> Option<(Self, CollapseChoice)> {
        let mut cost = [left + right; WIDTH];
        cost[0] = half_area;
        let mut opening = CollapseChoice::NONE;
        (2..=WIDTH).for_each(|roots| opening.set(roots, 1));
        (cost[1] < half_area).then_some((Self { cost, most: 2 }, opening))
    }

    /// The costs of a node over two subtrees.
    #[inline]
    pub fn node(half_area: f32, left: &Costs, right: &Costs) -> (Self, CollapseChoice) {
        let most = (left.most + right.most).min(WIDTH);
        let mut cost = [f32::INFINITY; WIDTH];
        let mut firsts = [1; WIDTH];
        for roots in 2..=most {
            let fewest = roots.saturating_sub(right.most).max(1);
            let mut best = (left.cost[fewest - 1] + right.cost[roots - fewest - 1], fewest);
            for first in fewest + 1..=left.most.min(roots - 1) {
                let cost = left.cost[first - 1] + right.cost[roots - first - 1];
                if cost < best.0 {
                    best = (cost, first);
                }
            }
            (cost[roots - 1], firsts[roots - 1]) = best;
        }
        let mut opening = CollapseChoice::NONE;
        opening.set(1, firsts[most - 1]);
        cost[0] = half_area * NODE_COST + cost[most - 1];
        for roots in 2..=WIDTH {
            if roots > most {
                (cost[roots - 1], firsts[roots - 1]) = (cost[most - 1], firsts[most - 1]);
            }
            // More roots are never worse than one wide node.
            if cost[0] < cost[roots - 1] {
                cost[roots - 1] = cost[0];
            } else {
                opening.set(roots, firsts[roots - 1]);
            }
        }
        (Self { cost, most }, opening)
    }
}

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
