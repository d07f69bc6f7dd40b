//! What a ray costs, counted by the kernel for one ray. Without counting, the same kernel is called with `NoCounter`,
//! and then nothing of it is compiled.

use super::Bvh;
use super::layout::{SphereBlock, TriangleBlock};
use super::query::Stack;
use super::sidedness::{AnyHitFilter, PrimitiveRef};
use super::traverse::{any_counted, closest_counted};
use crate::math::Ray;
use crate::simd::{Isa, Kernel, Lanes, dispatch};

/// Is told where a ray goes.
pub(super) trait Counter {
    /// Into a node, whose children's boxes are tested.
    fn node(&mut self);
    /// Into a leaf of that many primitives.
    fn leaf(&mut self, primitives: impl FnOnce() -> usize);
    /// Into an instance.
    fn instance(&mut self);
}

/// Counts nothing.
pub(super) struct NoCounter;

impl Counter for NoCounter {
    #[inline(always)]
    fn node(&mut self) {}
    #[inline(always)]
    fn leaf(&mut self, _: impl FnOnce() -> usize) {}
    #[inline(always)]
    fn instance(&mut self) {}
}

/// What one ray did, or several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes, of sixteen boxes each.
    pub nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Triangles and spheres in them.
    pub primitives: u64,
    /// Instances.
    pub instances: u64,
}

impl Visits {
    /// Adds another ray's.
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

/// How many places of a block are taken.
#[inline(always)]
pub(super) fn triangles(block: &TriangleBlock) -> usize {
    block.words.iter().filter(|word| PrimitiveRef(**word).is_used()).count()
}

/// The same for spheres.
#[inline(always)]
pub(super) fn spheres(block: &SphereBlock) -> usize {
    block.words.iter().filter(|word| PrimitiveRef(**word).is_used()).count()
}

/// What it costs to find a ray's nearest hit, or with `any` whether there is one, by itself.
pub fn visits(isa: Isa, bvh: &Bvh, ray: &Ray<f32>, any: bool, stack: &mut Stack) -> Visits {
    dispatch(isa, Count { bvh, ray, any, stack })
}

struct Count<'a> {
    bvh: &'a Bvh,
    ray: &'a Ray<f32>,
    any: bool,
    stack: &'a mut Stack,
}

impl Kernel for Count<'_> {
    type Output = Visits;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Visits {
        let mut visits = Visits::default();
        if self.any {
            any_counted::<L, _>(self.bvh, self.ray, AnyHitFilter::ACCEPT_ALL, self.stack, &mut visits);
        } else {
            closest_counted::<L, _>(self.bvh, self.ray, AnyHitFilter::ACCEPT_ALL, self.stack, &mut visits);
        }
        visits
    }
}
