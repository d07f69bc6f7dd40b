//! Brute force: every primitive for every ray, the baseline for a tree.

use crate::bvh::intersect::leaf::{self, LeafContext};
use crate::bvh::intersect::ray::LocalRay;
use crate::bvh::layout::sidedness::AnyHitFilter;
use crate::bvh::{Bvh, HitsMut};
use crate::math::{Hit, NONE, Ray};
use crate::simd::{Isa, Kernel, Lanes, dispatch};

/// Finds the nearest hit of a ray among all triangles and spheres, without the tree. Meant for scenes without
/// instances, which it ignores. Distances may differ in their last bits from those of the tree, which raises them to
/// the ray's entry into a leaf.
pub fn closest(isa: Isa, bvh: &Bvh, ray: &Ray<f32>) -> Hit {
    dispatch(isa, BruteForce { bvh, ray })
}

struct BruteForce<'a> {
    bvh: &'a Bvh,
    ray: &'a Ray<f32>,
}

impl Kernel for BruteForce<'_> {
    type Output = Hit;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Hit {
        let local = LocalRay::new(*self.ray);
        let t_min = self.ray.t_min;
        let visit = LeafContext::new(self.bvh, t_min, t_min, NONE, AnyHitFilter::ACCEPT_ALL);
        let mut best = Hit { t: self.ray.t_max, ..Hit::MISS };
        for block in self.bvh.triangles.iter() {
            leaf::triangles::<L, HitsMut>(block, &local.ray, &local.shear, visit, &mut best);
        }
        for block in self.bvh.spheres.iter() {
            leaf::spheres::<L, HitsMut>(block, &local.ray, visit, &mut best);
        }
        if best.is_miss() { Hit::MISS } else { best }
    }
}
