//! Bounds on the rays of a list, which cull most of a node's children for all of them.

use super::{FARTHER, StreamGroup};
use crate::bvh::layout::Node;
use crate::simd::{Float, Sixteen};

/// The least lane of each of six columns, and of another one.
#[inline(always)]
fn ends<F: Float>([[a, b, c], [d, e, f]]: [[F; 3]; 2], last: F) -> [[f32; 4]; 2] {
    [F::least_of_four([a, b, c, last]), F::least_of_four([d, e, f, last])]
}

/// Bounds on the values of a list's rays, whose directions all have the same signs.
pub struct ListBounds {
    origin: [[f32; 2]; 3],
    scale: [[f32; 2]; 3],
    /// The farthest distance that one of the rays has still to go.
    best: f32,
}

impl ListBounds {
    /// Bounds the rays of a list's groups.
    #[inline(always)]
    pub fn new<F: Float>(groups: &[StreamGroup]) -> Self {
        let none = [F::splat(f32::INFINITY); 3];
        // Minima, and minima of the negated values.
        let (mut origin, mut scale, mut best) = ([none; 2], [none; 2], none[0]);
        for group in groups {
            for lane in (0..group.best.len()).step_by(F::WIDTH) {
                for axis in 0..3 {
                    let (o, s) = (F::load(&group.origin[axis][lane..]), F::load(&group.scale[axis][lane..]));
                    origin[0][axis] = o.min(origin[0][axis]);
                    origin[1][axis] = (-o).min(origin[1][axis]);
                    scale[0][axis] = s.min(scale[0][axis]);
                    scale[1][axis] = (-s).min(scale[1][axis]);
                }
                best = (-F::load(&group.best[lane..])).min(best);
            }
        }
        let [low, high] = ends(origin, best);
        let [least, most] = ends(scale, best);
        let mut bounds = Self { origin: [[0.0; 2]; 3], scale: [[0.0; 2]; 3], best: -low[3] };
        for axis in 0..3 {
            bounds.origin[axis] = [low[axis], -high[axis]];
            bounds.scale[axis] = [least[axis], -most[axis]];
        }
        bounds
    }

    /// The children of a node that some ray within the bounds may meet. (Rounding is monotonic: no value computed for a
    /// ray lies beyond those computed for the bounds.)
    #[inline(always)]
    pub fn meet<S: Sixteen>(&self, node: &Node, way: usize) -> u32 {
        let (mut near, mut far) = (S::splat(0.0), S::splat(f32::INFINITY));
        for axis in 0..3 {
            let side = way >> axis & 1;
            let [low, high] = self.origin[axis];
            let [least, most] = self.scale[axis];
            // Scales are negative for rays that go up.
            let ([first, last], [small, large]) =
                if side == 0 { ([high, low], [most, least]) } else { ([low, high], [least, most]) };
            let (small, large) = (S::splat(small), S::splat(large));
            let first = S::splat(first) - S::load(&node.planes[axis][side]);
            let last = S::splat(last) - S::load(&node.planes[axis][side ^ 1]);
            // A NaN (0 · ∞, a ray in the plane) leaves the interval as it is.
            near = (first * small).min(first * large).max(near);
            far = (last * small).max(last * large).min(far);
        }
        near.le((far * S::splat(FARTHER)).min(S::splat(self.best)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bvh::intersect::ray::slab_scales;
    use crate::bvh::kernels::stream::LANES;
    use crate::bvh::layout::{Child, ChildKind, WIDTH};
    use crate::math::{Aabb, Vec3};
    use crate::simd::{Isa, Kernel, Lanes, dispatch};

    struct Meeting<'a> {
        groups: &'a [StreamGroup],
        node: &'a Node,
        way: usize,
    }

    impl Kernel for Meeting<'_> {
        type Output = u32;
        #[inline(always)]
        fn run<L: Lanes>(self) -> u32 {
            ListBounds::new::<L::Queue>(self.groups).meet::<L::Node>(self.node, self.way)
        }
    }

    /// True if a ray meets a child, by the test of [`super::StreamWalk::enter`].
    fn enters(group: &StreamGroup, lane: usize, node: &Node, slot: usize, way: usize) -> bool {
        let (mut near, mut far) = (0.0, f32::INFINITY);
        for axis in 0..3 {
            let side = way >> axis & 1;
            let (o, s) = (group.origin[axis][lane], group.scale[axis][lane]);
            near = Float::max((o - node.planes[axis][side][slot]) * s, near);
            far = Float::min((o - node.planes[axis][side ^ 1][slot]) * s, far);
        }
        near <= Float::min(far * FARTHER, group.best[lane])
    }

    proptest! {
        #[test]
        fn bounds_include_every_child_that_a_ray_meets(
            way in 0usize..8,
            boxes in prop::collection::vec((prop::array::uniform3(-4i8..5), prop::array::uniform3(0i8..4)), 1..=WIDTH),
            // Integers: many rays start or run in the planes of boxes.
            rays in prop::collection::vec(
                (prop::array::uniform3(-4i8..5), prop::array::uniform3(0i8..4), prop_oneof![Just(-1.0f32), 0.0f32..9.0]),
                1..40,
            ),
        ) {
            let mut node = Node::EMPTY;
            for (slot, (low, size)) in boxes.iter().enumerate() {
                let min = Vec3::from_array(low.map(f32::from));
                let max = min + Vec3::from_array(size.map(f32::from));
                node.set(slot, &Aabb { min, max }, Child::new(ChildKind::Node, slot));
            }
            let empty = StreamGroup {
                origin: [[0.0; LANES]; 3],
                scale: [[0.0; LANES]; 3],
                best: [-1.0; LANES],
                id: [0; LANES],
            };
            let mut groups = vec![empty; rays.len().div_ceil(LANES)];
            for place in 0..groups.len() * LANES {
                // Behind the last ray, the first one again, as a finished ray.
                let (origin, size, best) = *rays.get(place).unwrap_or(&(rays[0].0, rays[0].1, -1.0));
                let (group, lane) = (&mut groups[place / LANES], place % LANES);
                for axis in 0..3 {
                    let sign = if way >> axis & 1 == 0 { 1.0 } else { -1.0 };
                    group.origin[axis][lane] = f32::from(origin[axis]);
                    group.scale[axis][lane] = slab_scales(1.0 / (sign * f32::from(size[axis]))).0;
                }
                group.best[lane] = best;
            }
            let mut met = 0;
            for (group, slot) in groups.iter().flat_map(|group| (0..WIDTH).map(move |slot| (group, slot))) {
                let entered = (0..LANES).any(|lane| enters(group, lane, &node, slot, way));
                met |= u32::from(entered) << slot;
            }
            for isa in Isa::available() {
                let within = dispatch(isa, Meeting { groups: &groups, node: &node, way });
                prop_assert_eq!(met & !within, 0, "{:?}", isa);
                prop_assert!(within < 1 << boxes.len());
            }
            // A single ray: nothing else is met.
            if rays.len() == 1 && rays[0].1.iter().all(|size| *size != 0) {
                let within = dispatch(Isa::detect(), Meeting { groups: &groups, node: &node, way });
                prop_assert_eq!(met, within);
            }
        }
    }
}
