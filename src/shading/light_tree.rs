//! Importance sampling of many lights: descends the light tree from the root to a leaf by estimated contribution (PBRT
//! 4th ed., 12.6.3, without its inverse cosines).
//!
//! Every light that can contribute has a positive probability: cones have a margin for rounding, and small factors are
//! clamped from below. Lights behind a surface that transmits no light do not contribute.
//!
//! Distant lights are chosen among each other by their irradiance. The choice between distant and local lights is by
//! the square roots of both irradiances, because one of them may well be occluded, as the sun is from most of a room.

use super::packed_normal::Facing;
use crate::math::Vector;
use crate::scene::light_tree::{LEAF, LightTree, NODE, field};
use crate::simd::{Float, Int, Mask};

/// The margin of cosines for rounding: their sines come from a square root, which is steep at zero.
const MARGIN: f32 = 1.0 / 1024.0;
/// The least value of a cosine factor. It and [`RAREST`], the least probability of a child that can contribute, limit
/// underestimates, which then cause noise instead of fireflies.
const LEAST_COSINE: f32 = 1.0 / 64.0;
/// See [`LEAST_COSINE`].
const RAREST: f32 = 1.0 / 1024.0;
/// Less than the square of any distance that matters.
const NEAREST: f32 = 1e-24;
/// The largest float below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Samples a light for a point of a surface. Returns the light, its probability, and the rest of the random number `u`,
/// again in [0, 1). A probability of zero means no light: `mask` is not set, or no light in the part of the tree
/// selected by `u` can reach the point.
///
/// Each level of the tree uses up bits of `u`: of its 2²⁴ values, p · 2²⁴ are left for a light of probability p.
#[inline(always)]
pub fn sample<F: Float>(
    tree: &LightTree,
    position: Vector<F>,
    packed_normal: F::Int,
    u: F,
    mask: F::Mask,
) -> (F::Int, F, F) {
    if tree.is_empty() {
        return (F::Int::splat(0), F::zero(), u);
    }
    let nodes = tree.nodes.as_flattened();
    let point = LitPoint::new(position, packed_normal);
    let mut walk = Descent::new(tree, &point, mask);
    let mut rest = u;
    let mut inner = walk.inner(mask);
    while inner.any() {
        let children = walk.children(nodes, &point, inner);
        let first = children.chances.0;
        let is_first = rest.lt(first);
        let chance = F::select(is_first, first, children.chances.1);
        let begin = F::select(is_first, F::zero(), first);
        let within = (rest - begin) / F::select(chance.gt(F::zero()), chance, F::one());
        rest = F::select(inner, within.max(F::zero()).min(F::splat(BELOW_ONE)), rest);
        walk.turn(nodes, &children, is_first, inner);
        inner = walk.inner(mask);
    }
    let Descent { pmf, next, .. } = walk;
    let light = F::Int::select(pmf.gt(F::zero()), next ^ F::Int::splat(LEAF), F::Int::splat(0));
    (light, pmf, rest)
}

/// The probability with which [`sample`] chooses a light, to the bit; zero if `mask` is not set or the light is not in
/// the tree.
#[inline(always)]
pub fn pmf<F: Float>(
    tree: &LightTree,
    position: Vector<F>,
    packed_normal: F::Int,
    light: F::Int,
    mask: F::Mask,
) -> F {
    if tree.is_empty() {
        return F::zero();
    }
    let mask = mask & light.lt(F::Int::splat(tree.len() as u32));
    let nodes = tree.nodes.as_flattened();
    let point = LitPoint::new(position, packed_normal);
    let mut walk = Descent::new(tree, &point, mask);
    let mut path = F::Int::gather(&tree.paths, light, mask);
    let mut inner = walk.inner(mask);
    while inner.any() {
        let children = walk.children(nodes, &point, inner);
        let is_first = (path & F::Int::splat(1)).eq(F::Int::splat(0));
        path = path.shr::<1>();
        walk.turn(nodes, &children, is_first, inner);
        inner = walk.inner(mask);
    }
    walk.pmf
}

/// A point to be lit.
struct LitPoint<F: Float> {
    position: Vector<F>,
    packed_normal: Facing<F>,
}

impl<F: Float> LitPoint<F> {
    #[inline(always)]
    fn new(position: Vector<F>, packed_normal: F::Int) -> Self {
        Self { position, packed_normal: Facing::new(packed_normal) }
    }
}

/// A descent from the root to a light.
struct Descent<F: Float> {
    /// The probability of reaching the current node.
    pmf: F,
    /// The `next` of the current node; see [`crate::scene::light_tree::LightNode::next`].
    next: F::Int,
    /// The contribution of the node's lights as estimated by [`looked_into`]; zero if that is no better than the
    /// estimate of the node.
    known: F,
    /// True if the node's children are the local and the distant lights.
    mixed: bool,
}

/// The children at which a [`Descent`] can continue.
struct Children<F> {
    /// The probabilities of both children: their sum is one, or both are zero if neither has light for the point.
    chances: (F, F),
    /// [`Descent::known`] of both children.
    known: (F, F),
}

impl<F: Float> Descent<F> {
    #[inline(always)]
    fn new(tree: &LightTree, point: &LitPoint<F>, mask: F::Mask) -> Self {
        let (nodes, root) = (tree.nodes.as_flattened(), F::Int::splat(0));
        let next = next_of::<F>(nodes, root, mask);
        let (mut some, mut known) = (mask, F::zero());
        // If there are just two lights, the children are all that there is to estimate.
        if !tree.mixed && tree.len() != 2 {
            let all = Brought::new(nodes, root, point, mask);
            some = mask & all.light.gt(F::zero());
            known = looked_into(nodes, point, root, &all, some);
        }
        Self { pmf: F::select(some, F::one(), F::zero()), next, known, mixed: tree.mixed }
    }

    /// The lanes whose descent has not reached a leaf.
    #[inline(always)]
    fn inner(&self, mask: F::Mask) -> F::Mask {
        mask & self.pmf.gt(F::zero()) & self.next.lt(F::Int::splat(LEAF))
    }

    #[inline(always)]
    fn children(&self, nodes: &[f32], point: &LitPoint<F>, mask: F::Mask) -> Children<F> {
        let (zero, other) = (F::zero(), self.next + F::Int::splat(1));
        let (first, second) =
            (Brought::new(nodes, self.next, point, mask), Brought::new(nodes, other, point, mask));
        if self.mixed {
            let known = looked_into(nodes, point, self.next, &first, mask);
            let near = F::select(known.gt(zero), known, first.light);
            return Children {
                chances: shares(near.sqrt(), second.light.sqrt(), zero),
                known: (known, zero),
            };
        }
        // The child that [`looked_into`] descended into gets the rest of its estimate.
        let on = self.known.gt(zero);
        let is_second = second.is_nearer(&first);
        let into = Brought::select(is_second, &second, &first);
        let besides = F::select(is_second, first.light, second.light);
        let rest = (self.known - besides).max(into.light * F::splat(LEAST_COSINE));
        let on = on & into.light.gt(zero);
        let light =
            (F::select(on & !is_second, rest, first.light), F::select(on & is_second, rest, second.light));
        let known = F::select(on & into.is_near(), rest, zero);
        let known = (F::select(is_second, zero, known), F::select(is_second, known, zero));
        // The irradiance of distant lights is not an estimate.
        let rarest = F::select(second.is_far(), zero, F::splat(RAREST));
        Children { chances: shares(light.0, light.1, rarest), known }
    }

    /// Moves to a child.
    #[inline(always)]
    fn turn(&mut self, nodes: &[f32], children: &Children<F>, is_first: F::Mask, mask: F::Mask) {
        let (chances, known) = (&children.chances, &children.known);
        self.mixed = false;
        self.pmf = F::select(mask, self.pmf * F::select(is_first, chances.0, chances.1), self.pmf);
        self.known = F::select(is_first, known.0, known.1);
        let child = self.next + F::Int::select(is_first, F::Int::splat(0), F::Int::splat(1));
        self.next = F::Int::select(mask, next_of::<F>(nodes, child, mask), self.next);
    }
}

/// The probabilities of two nodes of these contributions; at least `rarest` if the contribution is not zero.
#[inline(always)]
fn shares<F: Float>(first: F, second: F, rarest: F) -> (F, F) {
    let (some_first, some_second) = (first.gt(F::zero()), second.gt(F::zero()));
    let sum = first + second;
    let share = (first / F::select(sum.gt(F::zero()), sum, F::one())).max(rarest).min(F::one() - rarest);
    let share = F::select(some_second, F::select(some_first, share, F::zero()), F::one());
    let some = some_first | some_second;
    (F::select(some, share, F::zero()), F::select(some, F::one() - share, F::zero()))
}

/// The index of a node's first child, or its light.
#[inline(always)]
fn next_of<F: Float>(nodes: &[f32], node: F::Int, mask: F::Mask) -> F::Int {
    let place = node * F::Int::splat(NODE as u32) + F::Int::splat(field::NEXT);
    // Only bits are moved; their value as a float does not matter.
    F::gather(nodes, place, mask).to_bits()
}

/// An estimate like [`Brought::light`], computed from a node's descendants as long as the point is near their lights:
/// there the nearest lights matter more than the sum of all. Zero if the point is not near the node.
#[inline(always)]
fn looked_into<F: Float>(
    nodes: &[f32],
    point: &LitPoint<F>,
    node: F::Int,
    all: &Brought<F>,
    mask: F::Mask,
) -> F {
    let (mut node, mut sum, mut into) = (node, F::zero(), *all);
    let mut near = mask;
    loop {
        let next = next_of::<F>(nodes, node, near);
        near = near & next.lt(F::Int::splat(LEAF)) & into.is_near();
        if !near.any() {
            return F::select(mask & all.is_near(), sum + into.light, F::zero());
        }
        let first = Brought::new(nodes, next, point, near);
        let second = Brought::new(nodes, next + F::Int::splat(1), point, near);
        let is_second = second.is_nearer(&first);
        node =
            F::Int::select(near, next + F::Int::select(is_second, F::Int::splat(1), F::Int::splat(0)), node);
        sum = F::select(near, sum + F::select(is_second, first.light, second.light), sum);
        into = Brought::select(near, &Brought::select(is_second, &second, &first), &into);
    }
}

/// The estimated contribution of a node's lights at a point.
#[derive(Clone, Copy)]
struct Brought<F> {
    /// The estimate; zero only if the lights cannot contribute.
    light: F,
    /// The square of the distance to their bounding box.
    away: F,
    /// See [`crate::scene::light_tree::LightNode::radius_square`].
    radius_square: F,
}

impl<F: Float> Brought<F> {
    /// True if the point is among the lights, or not farther from them than they are from each other.
    #[inline(always)]
    fn is_near(&self) -> F::Mask {
        self.away.lt(self.radius_square)
    }

    #[inline(always)]
    fn is_far(&self) -> F::Mask {
        self.radius_square.lt(F::zero())
    }

    /// True if this node can contribute, and `other` either cannot or its box is not nearer to the point.
    #[inline(always)]
    fn is_nearer(&self, other: &Self) -> F::Mask {
        let lit = self.light.gt(F::zero());
        lit & (self.away.lt(other.away) | other.light.le(F::zero()))
    }

    #[inline(always)]
    fn select(mask: F::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            light: F::select(mask, yes.light, no.light),
            away: F::select(mask, yes.away, no.away),
            radius_square: F::select(mask, yes.radius_square, no.radius_square),
        }
    }

    #[inline(always)]
    fn new(nodes: &[f32], node: F::Int, point: &LitPoint<F>, mask: F::Mask) -> Self {
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
        let sides = read::<F>(nodes, base, field::SIDES, mask);
        let two_sided = sides.gt(F::zero());

        let way = point.position - center;
        let square = way.dot(way).max(F::splat(NEAREST));
        let far = radius_square.lt(F::zero());
        let direction = Vector::select(far, -axis, way * (F::one() / square.sqrt()));
        // The directions to the bounding sphere of the lights; all directions from inside.
        let inside = square.le(radius_square);
        let part = (radius_square / square).max(F::zero()).min(F::one());
        let seen = Angle {
            cos: F::select(far, spread.cos, (F::one() - part).sqrt()),
            sin: F::select(far, spread.sin, part.sqrt()),
        };

        // The smallest possible angle between the direction to the point and the normal of a light, over all positions
        // and normals of the lights.
        let cos = direction.dot(axis);
        let off_axis = Angle::of(F::select(two_sided, cos.abs(), cos));
        let off_normal = off_axis.less(&spread).less(&seen);
        let cos_light = F::select(inside | far, F::one(), off_normal.cos);
        let lit = (cos_light + F::splat(MARGIN)).gt(cos_emission);
        // The intensity outside is a mean over all directions.
        let power = F::select(lit, power, power * (-sides).max(F::zero()));
        let cos_light = F::select(lit, cos_light, F::one());
        let reached = mask & power.gt(F::zero());

        let cos_surface = F::select(inside, F::one(), point.packed_normal.cos(-direction, &seen));
        // The box bounds the side of a surface better than the sphere.
        let half = Vector::gather_flat(nodes, base + F::Int::splat(field::HALF), mask);
        let margin = (square.sqrt() + half.x + half.y + half.z) * F::splat(MARGIN);
        let before =
            F::select(far, cos_surface + F::splat(MARGIN), point.packed_normal.reach(-way, half) + margin);
        let reached = reached & before.gt(F::zero());

        let least = F::splat(LEAST_COSINE);
        let cosines = cos_light.max(least) * cos_surface.max(least);
        let value = power * cosines / F::select(far, F::one(), square.max(radius_square));
        let light = F::select(reached, value.max(F::splat(f32::MIN_POSITIVE)), F::zero());
        let zero = F::zero();
        let beside = Vector::new(
            (way.x.abs() - half.x).max(zero),
            (way.y.abs() - half.y).max(zero),
            (way.z.abs() - half.z).max(zero),
        );
        let away = beside.dot(beside);
        Self { light, away, radius_square }
    }
}

/// A field of the node whose floats begin at `base`.
#[inline(always)]
fn read<F: Float>(nodes: &[f32], base: F::Int, field: u32, mask: F::Mask) -> F {
    F::gather(nodes, base + F::Int::splat(field), mask)
}

/// An angle between 0 and π, as cosine and sine.
pub(super) struct Angle<F> {
    pub cos: F,
    pub sin: F,
}

impl<F: Float> Angle<F> {
    /// The angle of a given cosine.
    #[inline(always)]
    pub fn of(cos: F) -> Self {
        let cos = cos.clamp(-1.0, 1.0);
        Self { cos, sin: (F::one() - cos * cos).sqrt() }
    }

    /// The difference from a smaller angle; zero if `other` is larger.
    #[inline(always)]
    pub fn less(&self, other: &Self) -> Self {
        let zero = self.cos.gt(other.cos);
        let cos = self.cos * other.cos + self.sin * other.sin;
        let sin = self.sin * other.cos - self.cos * other.sin;
        Self { cos: F::select(zero, F::one(), cos), sin: F::select(zero, F::zero(), sin) }
    }
}

#[cfg(test)]
mod tests;
