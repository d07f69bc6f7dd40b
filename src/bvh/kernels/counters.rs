//! Counts the work of a ray in the single-ray kernel. Without counting, the same kernel is called with `NoCounter`, and
//! the counting compiles to nothing.

use crate::bvh::layout::sidedness::PrimitiveRef;
use crate::bvh::layout::{SphereBlock, TriangleBlock};

/// Receives the events of a traversal.
pub(in crate::bvh) trait Counter {
    /// Records a visit of a node, whose children's boxes are tested.
    fn node(&mut self);
    /// Records a visit of a leaf with that many primitives.
    fn leaf(&mut self, primitives: impl FnOnce() -> usize);
    /// Records the entry into an instance.
    fn instance(&mut self);
}

/// Counts nothing.
pub(in crate::bvh) struct NoCounter;

impl Counter for NoCounter {
    #[inline(always)]
    fn node(&mut self) {}
    #[inline(always)]
    fn leaf(&mut self, _: impl FnOnce() -> usize) {}
    #[inline(always)]
    fn instance(&mut self) {}
}

/// The work of one ray, or of several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Visited nodes, of sixteen boxes each.
    pub nodes: u64,
    /// Visited leaves.
    pub leaves: u64,
    /// Triangles and spheres in them.
    pub primitives: u64,
    /// Entered instances.
    pub instances: u64,
}

impl Visits {
    /// Adds the counts of another ray.
    pub fn add(&mut self, other: Visits) {
        self.nodes += other.nodes;
        self.leaves += other.leaves;
        self.primitives += other.primitives;
        self.instances += other.instances;
    }
}

impl Counter for Visits {
    #[inline(always)]
    fn node(&mut self) {
        self.nodes += 1;
    }
    #[inline(always)]
    fn leaf(&mut self, primitives: impl FnOnce() -> usize) {
        self.leaves += 1;
        self.primitives += primitives() as u64;
    }
    #[inline(always)]
    fn instance(&mut self) {
        self.instances += 1;
    }
}

/// The number of used slots of a triangle block.
#[inline(always)]
pub(in crate::bvh) fn triangles(block: &TriangleBlock) -> usize {
    block.words.iter().filter(|word| PrimitiveRef(**word).is_used()).count()
}

/// The number of used slots of a sphere block.
#[inline(always)]
pub(in crate::bvh) fn spheres(block: &SphereBlock) -> usize {
    block.words.iter().filter(|word| PrimitiveRef(**word).is_used()).count()
}
