//! Binary tree to wide nodes with the least expected cost, by dynamic programming
//! (Ylitie, Karras and Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", 2017, section 4).

use super::build::{BinaryNode, Reference};
use super::layout::{Bvh, Child, Kind, Node, Root, WIDTH};

/// Cost of testing a node's 16 boxes, in block tests.
const NODE_COST: f32 = 0.8;

/// For each binary node the cost of its subtree as at most 1, 2, … 16 children of a wide node.
struct Costs(Vec<[f32; WIDTH]>);

impl Costs {
    fn new(tree: &[BinaryNode]) -> Self {
        let mut costs = vec![[0.0; WIDTH]; tree.len()];
        for index in (0..tree.len()).rev() {
            let node = &tree[index];
            let area = node.bounds.half_area();
            if node.count > 0 {
                costs[index] = [area; WIDTH];
                continue;
            }
            let (left, right) = (&costs[index + 1], &costs[index + node.offset as usize]);
            let mut cost = [f32::INFINITY; WIDTH];
            for roots in 2..=WIDTH {
                let best =
                    (1..roots).map(|k| left[k - 1] + right[roots - k - 1]).fold(f32::INFINITY, f32::min);
                cost[roots - 1] = best.min(cost[roots - 2]);
            }
            cost[0] = area * NODE_COST + cost[WIDTH - 1];
            // More roots are never worse than one wide node.
            for roots in 1..WIDTH {
                cost[roots] = cost[roots].min(cost[0]);
            }
            costs[index] = cost;
        }
        Self(costs)
    }
}

/// Folds a tree into `bvh`. `block` stores the references of a leaf there and returns its word.
pub fn collapse(
    tree: &[BinaryNode],
    references: &[Reference],
    bvh: &mut Bvh,
    block: &mut dyn FnMut(&mut Bvh, &[Reference]) -> Child,
) -> Root {
    let costs = Costs::new(tree);
    let mut fold = Fold { tree, references, costs, block };
    let (child, depth) = fold.emit(0, bvh);
    bvh.stack_size = bvh.stack_size.max(WIDTH * (depth + 1));
    Root { child, bounds: tree[0].bounds }
}

struct Fold<'a> {
    tree: &'a [BinaryNode],
    references: &'a [Reference],
    costs: Costs,
    block: &'a mut dyn FnMut(&mut Bvh, &[Reference]) -> Child,
}

impl Fold<'_> {
    /// Writes a binary subtree as one child; returns it and the wide nodes on its longest path.
    fn emit(&mut self, index: usize, bvh: &mut Bvh) -> (Child, usize) {
        let node = self.tree[index];
        if node.count > 0 {
            let range = node.offset as usize..(node.offset + node.count) as usize;
            return ((self.block)(bvh, &self.references[range]), 0);
        }
        let mut children = smallvec::SmallVec::<[usize; WIDTH]>::new();
        self.open(index, WIDTH, true, &mut children);
        let place = bvh.nodes.len();
        bvh.nodes.push(Node::EMPTY);
        let mut depth = 0;
        for (slot, &child_index) in children.iter().enumerate() {
            let (child, below) = self.emit(child_index, bvh);
            bvh.nodes[place].set(slot, &self.tree[child_index].bounds, child);
            depth = depth.max(below);
        }
        (Child::new(Kind::Node, place), depth + 1)
    }

    /// Collects at most `roots` subtrees of a node at the least cost, as the table was computed.
    fn open(&self, index: usize, roots: usize, top: bool, out: &mut smallvec::SmallVec<[usize; WIDTH]>) {
        let node = &self.tree[index];
        if node.count > 0 || roots == 1 {
            out.push(index);
            return;
        }
        let (first, second) = (index + 1, index + node.offset as usize);
        let (left, right) = (&self.costs.0[first], &self.costs.0[second]);
        let split = |k: usize| left[k - 1] + right[roots - k - 1];
        let mut best = 1;
        for k in 2..roots {
            if split(k) < split(best) {
                best = k;
            }
        }
        if !top && self.costs.0[index][0] < split(best) {
            out.push(index);
            return;
        }
        self.open(first, best, false, out);
        self.open(second, roots - best, false, out);
    }
}
