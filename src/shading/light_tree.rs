//! Choosing one of many lights by what each may bring to a point, from the root of the light
//! tree to a leaf (PBRT 4th ed., 12.6.3, without its inverse cosines).
//!
//! A light that can bring anything has a probability above zero: cones are given a margin for
//! rounding, and small factors are cut off below. Lights behind the surface count as those
//! before it, as it may let light through.

use crate::math::Vector;
use crate::scene::light_tree::{LEAF, LightTree, NODE, field};
use crate::simd::{Float, Int, Mask};

/// Cosines may be off by this: their sines come from a root, which is steep at zero.
const MARGIN: f32 = 1.0 / 1024.0;
/// Cosines count as this at least, and no child with lights to offer is chosen less often than
/// [`RAREST`]: an estimate that was too low costs noise, not fireflies.
const LEAST_COSINE: f32 = 1.0 / 64.0;
/// See [`LEAST_COSINE`].
const RAREST: f32 = 1.0 / 1024.0;
/// Below any distance's square that matters.
const NEAREST: f32 = 1e-24;
/// The largest float below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A light for a point of a surface, its probability, and what of the random number `u` is left,
/// in [0, 1) again. The normal is a unit vector, or zero where there is no surface. A
/// probability of zero: no light, where `mask` is not set or no light of the part of the tree
/// that `u` led to can reach the point.
///
/// Each level of the tree uses up bits of `u`. Of 24 a light of probability p gets p · 2²⁴ values.
#[inline(always)]
pub fn sample<F: Float>(
    tree: &LightTree,
    position: Vector<F>,
    normal: Vector<F>,
    u: F,
    mask: F::Mask,
) -> (F::Int, F, F) {
    if tree.is_empty() {
        return (F::Int::splat(0), F::zero(), u);
    }
    let nodes = tree.nodes.as_flattened();
    let point = LitPoint::new(position, normal);
    let (mut pmf, mut next) = root(nodes, &point, mask);
    let mut rest = u;
    let mut inner = mask & pmf.gt(F::zero()) & next.lt(F::Int::splat(LEAF));
    while inner.any() {
        let (first, second) = chances(nodes, &point, next, inner);
        let is_first = rest.lt(first);
        let chance = F::select(is_first, first, second);
        let begin = F::select(is_first, F::zero(), first);
        let within = (rest - begin) / F::select(chance.gt(F::zero()), chance, F::one());
        rest = F::select(inner, within.max(F::zero()).min(F::splat(BELOW_ONE)), rest);
        pmf = F::select(inner, pmf * chance, pmf);
        let child = next + F::Int::select(is_first, F::Int::splat(0), F::Int::splat(1));
        next = F::Int::select(inner, next_of::<F>(nodes, child, inner), next);
        inner = inner & pmf.gt(F::zero()) & next.lt(F::Int::splat(LEAF));
    }
    let light = F::Int::select(pmf.gt(F::zero()), next ^ F::Int::splat(LEAF), F::Int::splat(0));
    (light, pmf, rest)
}

/// The probability with which [`sample`] gives a light, to the bit; zero where `mask` is not set
/// and for what is not in the tree.
#[inline(always)]
pub fn pmf<F: Float>(
    tree: &LightTree,
    position: Vector<F>,
    normal: Vector<F>,
    light: F::Int,
    mask: F::Mask,
) -> F {
    if tree.is_empty() {
        return F::zero();
    }
    let mask = mask & light.lt(F::Int::splat(tree.len() as u32));
    let nodes = tree.nodes.as_flattened();
    let point = LitPoint::new(position, normal);
    let (mut pmf, mut next) = root(nodes, &point, mask);
    let mut path = F::Int::gather(&tree.paths, light, mask);
    let mut inner = mask & pmf.gt(F::zero()) & next.lt(F::Int::splat(LEAF));
    while inner.any() {
        let (first, second) = chances(nodes, &point, next, inner);
        let turn = path & F::Int::splat(1);
        path = path.shr::<1>();
        let chance = F::select(turn.eq(F::Int::splat(0)), first, second);
        pmf = F::select(inner, pmf * chance, pmf);
        next = F::Int::select(inner, next_of::<F>(nodes, next + turn, inner), next);
        inner = inner & pmf.gt(F::zero()) & next.lt(F::Int::splat(LEAF));
    }
    pmf
}

/// What is to be lit.
struct LitPoint<F> {
    position: Vector<F>,
    normal: Vector<F>,
    /// 1 where the normal counts, 0 where there is none.
    surface: F,
}

impl<F: Float> LitPoint<F> {
    #[inline(always)]
    fn new(position: Vector<F>, normal: Vector<F>) -> Self {
        let surface = F::select(normal.dot(normal).gt(F::zero()), F::one(), F::zero());
        Self { position, normal, surface }
    }
}

/// The probability that there is any light, and the root's [`Node::next`](crate::scene::light_tree::Node).
#[inline(always)]
fn root<F: Float>(nodes: &[f32], point: &LitPoint<F>, mask: F::Mask) -> (F, F::Int) {
    let root = F::Int::splat(0);
    let some = importance(nodes, root, point, mask).gt(F::zero());
    (F::select(mask & some, F::one(), F::zero()), next_of::<F>(nodes, root, mask))
}

/// Where a node's children are, or its light.
#[inline(always)]
fn next_of<F: Float>(nodes: &[f32], node: F::Int, mask: F::Mask) -> F::Int {
    let place = node * F::Int::splat(NODE as u32) + F::Int::splat(field::NEXT);
    // Only bits are moved: what they mean as a float does not matter.
    F::gather(nodes, place, mask).to_bits()
}

/// The probabilities of two children, the first at `node`: they add up to one, or are both zero
/// where neither has light for the point.
#[inline(always)]
fn chances<F: Float>(nodes: &[f32], point: &LitPoint<F>, node: F::Int, mask: F::Mask) -> (F, F) {
    let first = importance(nodes, node, point, mask);
    let second = importance(nodes, node + F::Int::splat(1), point, mask);
    let (some_first, some_second) = (first.gt(F::zero()), second.gt(F::zero()));
    let sum = first + second;
    let share = (first / F::select(sum.gt(F::zero()), sum, F::one())).clamp(RAREST, 1.0 - RAREST);
    let share = F::select(some_second, F::select(some_first, share, F::zero()), F::one());
    let some = some_first | some_second;
    (F::select(some, share, F::zero()), F::select(some, F::one() - share, F::zero()))
}

/// About what the lights of a node would bring; zero only if they can bring nothing.
#[inline(always)]
fn importance<F: Float>(nodes: &[f32], node: F::Int, point: &LitPoint<F>, mask: F::Mask) -> F {
    let base = node * F::Int::splat(NODE as u32);
    let center = Vector::gather_flat(nodes, base + F::Int::splat(field::CENTER), mask);
    let axis = Vector::gather_flat(nodes, base + F::Int::splat(field::AXIS), mask);
    let radius_square = read::<F>(nodes, base, field::RADIUS_SQUARE, mask);
    let spread = Angle {
        cos: read(nodes, base, field::COS_SPREAD, mask),
        sin: read(nodes, base, field::SIN_SPREAD, mask),
    };
    let cos_emission = read::<F>(nodes, base, field::COS_EMISSION, mask);
    let power = read::<F>(nodes, base, field::POWER, mask);
    let two_sided = read::<F>(nodes, base, field::TWO_SIDED, mask).gt(F::zero());

    let way = point.position - center;
    let square = way.dot(way).max(F::splat(NEAREST));
    let direction = way * (F::one() / square.sqrt());
    // The directions to the sphere around the lights; all of them from inside.
    let inside = square.le(radius_square);
    let part = (radius_square / square).min(F::one());
    let seen = Angle { cos: (F::one() - part).sqrt(), sin: part.sqrt() };

    // The angle between the direction to the point and the nearest that a light's normal may
    // have, at the nearest place that the light may be.
    let cos = direction.dot(axis);
    let off_axis = Angle::of(F::select(two_sided, cos.abs(), cos));
    let off_normal = off_axis.less(&spread).less(&seen);
    let cos_light = F::select(inside, F::one(), off_normal.cos);
    let reached = mask & power.gt(F::zero()) & (cos_light + F::splat(MARGIN)).gt(cos_emission);

    let off_surface = Angle::of(direction.dot(point.normal).abs()).less(&seen);
    let cos_surface = F::select(inside, F::one(), off_surface.cos).max(F::splat(LEAST_COSINE));
    let cos_surface = F::select(point.surface.gt(F::zero()), cos_surface, F::one());

    let cosines = cos_light.max(F::splat(LEAST_COSINE)) * cos_surface;
    let value = power * cosines / square.max(radius_square);
    F::select(reached, value.max(F::splat(f32::MIN_POSITIVE)), F::zero())
}

/// One field of the node whose floats begin at `base`.
#[inline(always)]
fn read<F: Float>(nodes: &[f32], base: F::Int, field: u32, mask: F::Mask) -> F {
    F::gather(nodes, base + F::Int::splat(field), mask)
}

/// An angle between 0 and π, by cosine and sine.
struct Angle<F> {
    cos: F,
    sin: F,
}

impl<F: Float> Angle<F> {
    /// By its cosine.
    #[inline(always)]
    fn of(cos: F) -> Self {
        let cos = cos.clamp(-1.0, 1.0);
        Self { cos, sin: (F::one() - cos * cos).sqrt() }
    }

    /// Less by another; zero if that is larger.
    #[inline(always)]
    fn less(&self, other: &Self) -> Self {
        let zero = self.cos.gt(other.cos);
        let cos = self.cos * other.cos + self.sin * other.sin;
        let sin = self.sin * other.cos - self.cos * other.sin;
        Self { cos: F::select(zero, F::one(), cos), sin: F::select(zero, F::zero(), sin) }
    }
}

#[cfg(test)]
mod tests;
