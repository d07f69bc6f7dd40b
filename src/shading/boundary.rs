//! What lies on both sides of a surface, for paths that are in bodies ([`Bodies`]).

use super::emitter;
use super::principled::parameters::Outside;
use crate::scene::bodies::NOWHERE;
use crate::scene::{Bodies, Material};
use crate::simd::{Float, Int, Mask, Outlined};

/// A surface between two places, each in bodies of its own.
pub struct Boundary<F: Float> {
    /// The bodies on the viewer's side.
    near: F::Int,
    /// Those on the other side.
    far: F::Int,
    /// What fills the side that lies outside of what the surface encloses.
    pub outside: Outside<F>,
    /// Where another body fills both sides: there is no boundary, whatever the surface is like.
    pub gone: F::Mask,
}

/// The numbers of the bodies that a surface lies between, or 0.
#[derive(Clone, Copy)]
pub struct BodyPair<F: Float> {
    /// Of the one that it encloses.
    pub number: F::Int,
    /// Of the one that its front touches.
    pub beside: F::Int,
}

impl<F: Float> BodyPair<F> {
    /// For surfaces of one material.
    #[inline(always)]
    pub fn of(material: &Material) -> Self {
        Self { number: F::Int::splat(material.body), beside: F::Int::splat(material.beside) }
    }

    /// One or the other, lane by lane.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        Self {
            number: F::Int::select(mask, yes.number, no.number),
            beside: F::Int::select(mask, yes.beside, no.beside),
        }
    }

    /// For surfaces that enclose nothing.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { number: F::Int::splat(0), beside: F::Int::splat(0) }
    }
}

impl<F: Float> Boundary<F> {
    /// A surface between two bodies, which is met by paths that are in some, from within the first or not.
    #[inline(always)]
    pub fn new(bodies: &Bodies, near: F::Int, between: &BodyPair<F>, inside: F::Mask, mask: F::Mask) -> Self {
        let BodyPair { number, beside } = *between;
        let nowhere = F::Int::splat(NOWHERE);
        let encloses = !number.eq(nowhere);
        let far = F::Int::select(encloses, F::Int::select(inside, nowhere, number), near);
        let plain = Self { near, far, outside: Outside::air(), gone: F::Mask::from_bits(0) };
        // In most places there is but one body.
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

    /// The bodies that light is in next, depending on whether it passed through the surface.
    #[inline(always)]
    pub fn beyond(&self, through: F::Mask) -> F::Int {
        F::Int::select(through, self.far, self.near)
    }

    /// Where it does not bend light, if the material says that it does not in air: thin sheets, and what refracts like
    /// its surroundings.
    #[inline(always)]
    pub fn is_straight(&self, material: &Material) -> F::Mask {
        let all = F::Mask::from_bits(u32::MAX);
        if material.thin || self.outside.is_air { all } else { self.outside.index.eq(F::one()) }
    }
}

/// Surfaces within bodies.
struct Nested<'a, F: Float> {
    bodies: &'a Bodies,
    between: &'a BodyPair<F>,
    inside: F::Mask,
    /// As if there were but one.
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

/// The lanes, among some that are within bodies, to which rays from lights come straight: out of bodies that bend no
/// light, and into air.
#[inline(always)]
pub fn is_lit<I: Int>(bodies: &Bodies, around: I, mask: I::Mask) -> I::Mask {
    let (mut lit, mut todo) = (0, mask);
    while todo.any() {
        let stack = emitter::lane(around, todo);
        let same = todo & around.eq(I::splat(stack));
        todo = todo & !same;
        let mut all = bodies.all(stack);
        let lets_in =
            all.next().is_some_and(|body| body.straight) && all.next().is_none_or(|body| body.index == 1.0);
        lit |= if lets_in { same.bits() } else { 0 };
    }
    I::Mask::from_bits(lit)
}
