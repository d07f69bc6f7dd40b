//! A path under way.

use crate::math::{Color, Ray, Vector};
use crate::sampling::SampleKey;
use crate::simd::{Float, Int};

/// One path in each lane: the ray it goes along next and what it has gathered.
#[derive(Clone, Copy)]
pub struct Path<F: Float> {
    /// Where the next ray begins.
    pub origin: Vector<F>,
    /// Its unit direction.
    pub direction: Vector<F>,
    /// The part of what it finds that reaches the film.
    pub throughput: Color<F>,
    /// What has been found so far.
    pub radiance: Color<F>,
    /// Column in the low, row in the high 16 bits.
    pub pixel: F::Int,
    /// Which of the pixel's samples.
    pub sample: F::Int,
    /// 0 for the path that the camera began, a hash for those that were forked off. The path
    /// transport forks none and counts its bounces by kind here ([`super::bounces`]).
    pub bounce_counts: F::Int,
    /// Bounces so far.
    pub depth: F::Int,
    /// Density per steradian with which the direction was drawn; 0 where nothing else could have
    /// found it (the camera's, a mirror's). Only for the path
    /// transport.
    pub pdf: F,
    /// The way that the surface it has left was facing (`shading::facing`), or [`crate::math::NONE`]. Only for the
    /// path transport.
    pub facing: F::Int,
    /// How wide the ray is at its origin, in metres.
    pub width: F,
    /// How much wider it becomes with every metre.
    pub spread: F,
    /// The bodies that the path is in ([`crate::scene::Bodies`]).
    pub bodies: F::Int,
    /// How many of its vertices so far do not count as bounces: within bodies, and where it went straight through.
    pub scatterings: F::Int,
    /// How far it had come, when its ray began, since its direction was drawn: 0 unless it went straight through
    /// surfaces.
    pub travelled: F,
    /// What it must know to share light with photons, or 0: see [`super::photons::gather`].
    pub landing: F::Int,
}

impl<F: Float> Path<F> {
    /// The ray it goes along next.
    #[inline(always)]
    pub fn ray(&self) -> Ray<F> {
        Ray {
            origin: self.origin,
            direction: self.direction,
            t_min: F::zero(),
            t_max: F::splat(f32::INFINITY),
        }
    }

    /// Where its direction was drawn.
    #[inline(always)]
    pub fn seen_from(&self) -> Vector<F> {
        self.origin - self.direction * self.travelled
    }

    /// One or the other, lane by lane, for paths with a common origin.
    #[inline(always)]
    pub fn select(mask: F::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            origin: Vector::select(mask, yes.origin, no.origin),
            direction: Vector::select(mask, yes.direction, no.direction),
            throughput: Color::select(mask, yes.throughput, no.throughput),
            radiance: Color::select(mask, yes.radiance, no.radiance),
            bounce_counts: F::Int::select(mask, yes.bounce_counts, no.bounce_counts),
            depth: F::Int::select(mask, yes.depth, no.depth),
            pdf: F::select(mask, yes.pdf, no.pdf),
            facing: F::Int::select(mask, yes.facing, no.facing),
            width: F::select(mask, yes.width, no.width),
            spread: F::select(mask, yes.spread, no.spread),
            bodies: F::Int::select(mask, yes.bodies, no.bodies),
            scatterings: F::Int::select(mask, yes.scatterings, no.scatterings),
            travelled: F::select(mask, yes.travelled, no.travelled),
            landing: F::Int::select(mask, yes.landing, no.landing),
            ..*yes
        }
    }

    /// Says which random numbers it draws under Whitted's transport.
    #[inline(always)]
    pub fn key(&self, seed: u64) -> SampleKey<F::Int> {
        SampleKey::new(seed, self.pixel, self.sample, self.bounce_counts)
    }

    /// The same under the path transport.
    #[inline(always)]
    pub fn path_key(&self, seed: u64) -> SampleKey<F::Int> {
        SampleKey::new(seed, self.pixel, self.sample, F::Int::splat(0))
    }
}

/// A pixel's column and row in one integer.
#[inline(always)]
pub fn pack_pixel(x: u32, y: u32) -> u32 {
    x | y << 16
}

/// The inverse of [`pack_pixel`].
#[inline(always)]
pub fn unpack_pixel(pixel: u32) -> (u32, u32) {
    (pixel & 0xffff, pixel >> 16)
}

/// Column and row as floats.
#[inline(always)]
pub fn pixel_place<F: Float>(pixel: F::Int) -> (F, F) {
    ((pixel & F::Int::splat(0xffff)).to_float(), pixel.shr::<16>().to_float())
}
