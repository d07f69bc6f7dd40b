//! The costs of collapsing a binary tree, and the choice for each node ([`super::collapse`]).

use crate::bvh::layout::WIDTH;

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

    pub(super) fn first(self, roots: usize) -> usize {
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

    /// The cost as one child.
    pub fn whole(&self) -> f32 {
        self.cost[0]
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
