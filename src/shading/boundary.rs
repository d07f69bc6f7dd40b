//! The media on both sides of a surface, for paths that are in bodies ([`Bodies`]).

use super::emitter;
use super::principled::parameters::Outside;
use crate::scene::bodies::NOWHERE;
use crate::scene::{Bodies, MaterialRecord};
use crate::simd::{Float, Int, Mask, Outlined};

/// A surface with the stack of bodies on either side.
pub struct Boundary<F: Float> {
    /// The stack of bodies on the viewer's side.
    near: F::Int,
    /// The stack of bodies on the other side.
    far: F::Int,
    /// The medium outside of the body that the surface encloses.
    pub outside: Outside<F>,
    /// Set if another body fills both sides: there is no boundary, whatever the surface is like.
    pub gone: F::Mask,
}

/// The numbers of the bodies on both sides of a surface, or 0.
#[derive(Clone, Copy)]
pub struct BodyPair<F: Float> {
    /// The number of the body that the surface encloses.
    pub number: F::Int,
    /// The number of the body that touches its front.
    pub beside: F::Int,
}

impl<F: Float> BodyPair<F> {
    /// The bodies at surfaces of one material.
    #[inline(always)]
    pub fn of(material: &MaterialRecord) -> Self {
        Self { number: F::Int::splat(material.body), beside: F::Int::splat(material.beside) }
    }

    /// `yes` where `mask` is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            number: F::Int::select(mask, yes.number, no.number),
            beside: F::Int::select(mask, yes.beside, no.beside),
        }
    }

    /// The bodies at surfaces that enclose nothing.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { number: F::Int::splat(0), beside: F::Int::splat(0) }
    }
}

impl<F: Float> Boundary<F> {
    /// The boundary of surfaces between two bodies, for paths with the stacks `near` that come from within the first
    /// body (`inside`) or not.
    #[inline(always)]
    pub fn new(bodies: &Bodies, near: F::Int, between: &BodyPair<F>, inside: F::Mask, mask: F::Mask) -> Self {
        let BodyPair { number, beside } = *between;
        let nowhere = F::Int::splat(NOWHERE);
        let encloses = !number.eq(nowhere);
        let far = F::Int::select(encloses, F::Int::select(inside, nowhere, number), near);
        let plain = Self { near, far, outside: Outside::air(), gone: F::Mask::from_bits(0) };
        // Most places are in one body at most.
        let alone = (near.eq(nowhere) | (inside & encloses & near.eq(number))) & beside.eq(nowhere);
        let mut nested = mask & !alone;
        if !bodies.bend() {
            nested = nested & encloses;
        }
        if bodies.are_none() || !nested.any() {
            return plain;
        }
        F::outlined(Nested { bodies, between, inside, plain, nested })
    }

    /// The stack of bodies after passing `through` the surface or not.
    #[inline(always)]
    pub fn beyond(&self, through: F::Mask) -> F::Int {
        F::Int::select(through, self.far, self.near)
    }

    /// Set if the boundary does not bend light, for a material that does not bend it in air: thin sheets, and bodies
    /// with the index of their surroundings.
    #[inline(always)]
    pub fn is_straight(&self, material: &MaterialRecord) -> F::Mask {
        let all = F::Mask::from_bits(u32::MAX);
        if material.thin || self.outside.is_air { all } else { self.outside.index.eq(F::one()) }
    }
}

/// Computes the boundaries of surfaces within bodies.
struct Nested<'a, F: Float> {
    bodies: &'a Bodies,
    between: &'a BodyPair<F>,
    inside: F::Mask,
    /// The boundary for at most one body.
    plain: Boundary<F>,
    nested: F::Mask,
}

impl<F: Float> Outlined for Nested<'_, F> {
    type Output = Boundary<F>;
    #[inline(always)]
    fn run(self) -> Boundary<F> {
        let Self { bodies, plain, nested, .. } = self;
        let ([mut near, mut far, mut numbers, mut beside], mut gone) = ([[0; 16]; 4], 0);
        let ([mut index, mut dispersion], inside) = ([[1.0; 16], [0.0; 16]], self.inside.bits());
        plain.near.store(&mut near);
        plain.far.store(&mut far);
        self.between.number.store(&mut numbers);
        self.between.beside.store(&mut beside);
        let mut todo = nested.bits();
        while todo != 0 {
            let lane = todo.trailing_zeros() as usize & 15;
            todo &= todo - 1;
            let mut outside = bodies.filling(near[lane]);
            if numbers[lane] != 0 {
                let sides = bodies.sides(near[lane], numbers[lane], beside[lane], inside >> lane & 1 != 0);
                (far[lane], outside) = (sides.far, bodies.numbered(sides.outside));
                gone |= u32::from(sides.gone) << lane;
            }
            if let Some(body) = outside {
                (index[lane], dispersion[lane]) = (body.index, body.dispersion);
            }
        }
        let is_air = !bodies.bend();
        let outside = Outside { is_air, index: F::load(&index), dispersion: F::load(&dispersion) };
        Boundary { far: F::Int::load(&far), outside, gone: F::Mask::from_bits(gone), ..plain }
    }
}

/// The lanes, among some within bodies, that straight rays from lights reach: out of bodies that do not bend light,
/// into air.
#[inline(always)]
pub fn is_lit<I: Int>(bodies: &Bodies, around: I, mask: I::Mask) -> I::Mask {
    let (mut lit, mut todo) = (0, mask);
    while todo.any() {
        let stack = emitter::lane(around, todo);
        let same = todo & around.eq(I::splat(stack));
        todo = todo & !same;
        let mut all = bodies.all(stack);
        let lets_in = all.next().is_some_and(|body| body.passes_shadow_rays)
            && all.next().is_none_or(|body| body.index == 1.0);
        lit |= if lets_in { same.bits() } else { 0 };
    }
    I::Mask::from_bits(lit)
}
