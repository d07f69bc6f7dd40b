//! Cuts without a heuristic, and the limits of those with one.

use super::binary::NodeBudget;
use super::binning::{partition, partition_by};
use super::reference::{Reference, SimdAabb};
use crate::bvh::layout::BLOCK;

/// Subtrees with fewer references are built by one thread.
pub(in crate::bvh) const PARALLEL: usize = 8192;

/// From this depth on, ranges are halved by count, so that no input makes a deep tree.
pub(in crate::bvh) const MAX_SAH_DEPTH: u32 = 48;

/// The position of a range in the tree.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct TreePosition {
    pub depth: u32,
    pub room: NodeBudget,
}

impl TreePosition {
    /// The positions of the two sides of a cut.
    pub fn below(&self, left: usize, right: usize) -> [TreePosition; 2] {
        self.room.split(left, right).map(|room| TreePosition { depth: self.depth + 1, room })
    }
}

/// The fallback if there is no good cut: separates the kinds if a block could hold all, else halves the range along the
/// longest side of the box of the centroids.
pub(in crate::bvh) fn halve(references: &mut [Reference]) -> usize {
    let kind = references[0].kind();
    if references.len() <= BLOCK {
        let middle = partition_by(references, |r| r.kind() == kind);
        if middle != references.len() {
            return middle;
        }
    }
    let half = references.len() / 2;
    let axis = SimdAabb::around_centers(references).longest_axis();
    references.select_nth_unstable_by(half, |a, b| {
        let order = a.center()[axis].total_cmp(&b.center()[axis]);
        order.then((a.kind() as u8).cmp(&(b.kind() as u8))).then(a.id().cmp(&b.id()))
    });
    half
}

/// Cuts the box of the centroids in the middle of its longest side.
pub(in crate::bvh) fn split_middle(references: &mut [Reference]) -> usize {
    let centers = SimdAabb::around_centers(references);
    let axis = centers.longest_axis();
    partition(references, axis, (centers.min[axis] + centers.max[axis]) * 0.5)
}
