//! Every triangle for every ray: what a tree is measured against.

use super::leaf::{self, Visit};
use super::presence::Asker;
use super::ray::LocalRay;
use super::{Bvh, HitsMut};
use crate::math::{Hit, NONE, Ray};
use crate::simd::{Kernel, Lanes, Level, dispatch};

/// The nearest hit of a ray among all triangles and spheres, without looking at the tree. Made for scenes without
/// instances, which it ignores. Distances may differ in their last bits from those of the tree, which raises them to
/// where the ray enters a leaf.
pub fn closest(level: Level, bvh: &Bvh, ray: &Ray<f32>) -> Hit {
    dispatch(level, BruteForce { bvh, ray })
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
        let visit = Visit::new(self.bvh, t_min, t_min, NONE, Asker::CREDULOUS);
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
