//! The binary tree that is collapsed into wide nodes.

use super::costs::{CollapseChoice, Costs};
use super::reference::{Reference, SimdAabb};
use crate::bvh::layout::{BLOCK, Child, ChildKind};
use crate::math::Aabb;

/// The fewest references on either side of a cut through a range larger than a block, unless kinds are mixed or there
/// is budget for an exception ([`NodeBudget`]). So there are hardly more than a quarter as many blocks as references,
/// which bounds memory.
pub const FEWEST: usize = 4;
/// A block with more references than this may be halved ([`Nodes::block`]).
const WHOLE: usize = 6;
/// One exception, which costs two nodes, is allowed for this many references.
const EXCEPTION: usize = 16;

/// A node of the binary tree, depth first: the first child follows its parent. 48 bytes.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// The bounds of the subtree.
    pub bounds: Aabb,
    /// For a block, its first index in the order; for an inner node, the distance to its second child.
    pub offset: u32,
    /// The number of references of a block; 0 for an inner node.
    pub count: u8,
    /// The kind of a block's primitives.
    pub kind: ChildKind,
    /// The child word of the wide tree, once it is known.
    pub child: Child,
    /// The choice of nodes below it that become children of a wide node.
    pub opening: CollapseChoice,
}

impl BinaryNode {
    const EMPTY: BinaryNode = BinaryNode {
        bounds: Aabb::EMPTY,
        offset: 0,
        count: 0,
        kind: ChildKind::Node,
        child: Child(0),
        opening: CollapseChoice::NONE,
    };

    /// True if its contents fit a block.
    #[inline(always)]
    pub fn is_block(&self) -> bool {
        self.count > 0
    }

    /// True if it has children. A block may, if it could be two smaller ones.
    #[inline(always)]
    pub fn has_children(&self) -> bool {
        !self.is_block() || !self.opening.is_none()
    }

    /// The distance to its second child, if it has any; the first one follows it.
    #[inline(always)]
    pub fn second(&self) -> usize {
        if self.is_block() { 2 } else { self.offset as usize }
    }
}

/// True if one block can hold the references: up to 8 of a kind, or a single instance.
#[inline(always)]
pub fn is_block(references: &[Reference]) -> bool {
    let kind = references[0].kind();
    let most = if kind == ChildKind::Instance { 1 } else { BLOCK };
    references.len() <= most && references.iter().all(|r| r.kind() == kind)
}

/// A binary tree and the contents of its leaves.
pub struct Tree {
    /// The nodes, the root first.
    pub nodes: Vec<BinaryNode>,
    /// Ids of primitives, leaf by leaf; there may be gaps between leaves.
    pub order: Vec<u32>,
}

/// The bounds and costs of a subtree, for its parent.
#[derive(Clone, Copy)]
pub struct Summary {
    bounds: SimdAabb,
    costs: Costs,
}

impl Summary {
    /// The cost of the subtree as one child of a wide node.
    pub fn cost(&self) -> f32 {
        self.costs.whole()
    }
}

/// The number of nodes that a subtree may have. A large triangle among small ones is best off in a leaf of its own, but
/// if every leaf held one primitive there would be eight times as many as necessary.
#[derive(Clone, Copy, Debug)]
pub struct NodeBudget {
    /// The number of nodes.
    pub nodes: usize,
    mixed: bool,
}

impl NodeBudget {
    /// The budget of a tree; `mixed`: over more than one kind, or over instances.
    pub fn new(references: usize, mixed: bool) -> Self {
        let exceptions = if mixed { 0 } else { references / EXCEPTION };
        Self { nodes: Self::least(references, mixed) + 2 * exceptions, mixed }
    }

    /// The most nodes that a tree without exceptions needs: if every block has seven references and is halved, there
    /// are two leaves for each seven. Two such trees and a node above need no more than one over all their references.
    fn least(references: usize, mixed: bool) -> usize {
        if mixed { 2 * references - 1 } else { 2 * (2 * references / 7).max(1) - 1 }
    }

    /// The fewest references that a side of a cut may have.
    #[inline(always)]
    pub fn fewest(&self, references: usize) -> usize {
        let exception = self.mixed || self.nodes >= Self::least(references, false) + 2;
        if references <= BLOCK || exception { 1 } else { FEWEST }
    }

    /// Divides the budget between the two sides of a cut.
    #[inline(always)]
    pub fn split(&self, left: usize, right: usize) -> [NodeBudget; 2] {
        let [first, second] = [left, right].map(|references| Self::least(references, self.mixed));
        let spare = self.nodes.saturating_sub(first + second + 1);
        let share = (spare as u64 * left as u64 / (left + right) as u64) as usize;
        [first + share, second + spare - share].map(|nodes| NodeBudget { nodes, ..*self })
    }
}

/// A subtree under construction, in preallocated memory.
pub struct Nodes<'a> {
    free: &'a mut [BinaryNode],
    used: usize,
}

impl<'a> Nodes<'a> {
    /// Allocates memory for this many nodes.
    pub fn room(nodes: usize) -> Vec<BinaryNode> {
        vec![BinaryNode::EMPTY; nodes]
    }

    /// An empty tree.
    pub fn new(free: &'a mut [BinaryNode]) -> Self {
        Self { free, used: 0 }
    }

    /// The number of nodes so far.
    pub fn count(&self) -> usize {
        self.used
    }

    fn push(&mut self, node: BinaryNode) {
        self.free[self.used] = node;
        self.used += 1;
    }

    /// Adds a subtree that was built elsewhere.
    pub fn append(&mut self, nodes: &[BinaryNode]) {
        self.free[self.used..][..nodes.len()].copy_from_slice(nodes);
        self.used += nodes.len();
    }

    /// Adds a block whose first reference has index `first`. If it has many references, `cut` halves them: it moves one
    /// half to the front and returns its size. A wide node with a child to spare takes the halves instead of the block,
    /// so that a ray tests half as many primitives that it misses.
    #[inline(always)]
    pub fn block(
        &mut self,
        references: &mut [Reference],
        first: usize,
        cut: impl FnOnce(&mut [Reference]) -> usize,
    ) -> Summary {
        let place = self.used;
        let bounds = self.leaf(references, first);
        let mut costs = Costs::block(bounds.half_area());
        let middle = if references.len() > WHOLE { cut(references) } else { 0 };
        if 0 < middle && middle < references.len() {
            let left = self.leaf(&references[..middle], first);
            let right = self.leaf(&references[middle..], first + middle);
            match Costs::halved(bounds.half_area(), [left.half_area(), right.half_area()]) {
                Some(better) => (costs, self.free[place].opening) = better,
                None => self.used = place + 1,
            }
        }
        Summary { bounds, costs }
    }

    fn leaf(&mut self, references: &[Reference], first: usize) -> SimdAabb {
        let bounds = SimdAabb::around(references);
        self.push(BinaryNode {
            bounds: bounds.bounds(),
            offset: first as u32,
            count: references.len() as u8,
            kind: references[0].kind(),
            ..BinaryNode::EMPTY
        });
        bounds
    }

    /// Adds a node, whose first child comes next, and returns its index.
    #[inline(always)]
    pub fn begin(&mut self) -> usize {
        self.push(BinaryNode::EMPTY);
        self.used - 1
    }

    /// Adds a node and builds both children, on two threads; the first child has room for `room` nodes.
    pub fn node_in_parallel(
        &mut self,
        room: usize,
        left: impl FnOnce(&mut Nodes) -> Summary + Send,
        right: impl FnOnce(&mut Nodes) -> Summary + Send,
    ) -> Summary {
        let node = self.begin();
        let first = node + 1;
        let (free, others) = self.free[first..].split_at_mut(room);
        let (mut free, mut others) = (Nodes::new(free), Nodes::new(others));
        let (left, right) = rayon::join(|| left(&mut free), || right(&mut others));
        let (second, count) = (first + free.used, others.used);
        self.free.copy_within(first + room..first + room + count, second);
        self.used = second + count;
        self.complete(node, second, &left, &right)
    }

    /// Completes a node, once both children are built.
    #[inline(always)]
    pub fn complete(&mut self, node: usize, second: usize, left: &Summary, right: &Summary) -> Summary {
        let bounds = left.bounds.union(right.bounds);
        let (costs, opening) = Costs::node(bounds.half_area(), &left.costs, &right.costs);
        let place = &mut self.free[node];
        place.bounds = bounds.bounds();
        place.offset = (second - node) as u32;
        place.opening = opening;
        Summary { bounds, costs }
    }
}
