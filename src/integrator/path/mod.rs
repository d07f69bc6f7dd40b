//! The state of a path while it is traced.

pub mod any_hit;
pub mod bounces;
pub mod camera_path;
pub mod columns;
pub mod light_groups;
pub mod mis;
pub mod shadow;
pub mod termination;

use crate::math::{Color, Ray, Vector};
use crate::sampling::SampleKey;
use crate::simd::{Float, Int};

/// One path in each lane: its next ray and the radiance it has gathered.
#[derive(Clone, Copy)]
pub struct Path<F: Float> {
    /// The origin of the next ray.
    pub origin: Vector<F>,
    /// Its unit direction.
    pub direction: Vector<F>,
    /// The fraction of the radiance found next that reaches the film.
    pub throughput: Color<F>,
    /// The radiance found so far.
    pub radiance: Color<F>,
    /// The pixel: column in the low, row in the high 16 bits.
    pub pixel: F::Int,
    /// The number of the sample within the pixel.
    pub sample: F::Int,
    /// Under the Whitted transport 0 for the path that began at the camera, a hash for forks. The path transport counts
    /// bounces by kind here ([`bounces`]).
    pub bounce_counts: F::Int,
    /// Vertices so far: bounces and [`Path::scatterings`].
    pub depth: F::Int,
    /// Density per steradian with which the direction was drawn; 0 if no other technique could have found it (camera,
    /// mirrors). Under the Whitted transport 0 as long as the path goes straight on from the camera, then 0.5 until it is
    /// reflected, then 1.
    pub pdf: F,
    /// The facing of the surface that the path has left (`shading::facing`), or [`crate::math::NONE`]. Only for the
    /// path transport.
    pub packed_normal: F::Int,
    /// The width of the ray at its origin, in metres.
    pub width: F,
    /// The growth of the width per metre.
    pub spread: F,
    /// The bodies that the path is in ([`crate::scene::Bodies`]).
    pub bodies: F::Int,
    /// The number of vertices so far that are no bounces: within bodies, and where the path went straight through.
    pub scatterings: F::Int,
    /// The distance from where the direction was drawn to the origin: 0 unless the path went straight through surfaces.
    pub travelled: F,
    /// The state for dividing light with photons, or 0: see [`super::photons::gather`].
    pub landing: F::Int,
}

impl<F: Float> Path<F> {
    /// The path's next ray.
    #[inline(always)]
    pub fn ray(&self) -> Ray<F> {
        Ray {
            origin: self.origin,
            direction: self.direction,
            t_min: F::zero(),
            t_max: F::splat(f32::INFINITY),
        }
    }

    /// The point where the path's direction was drawn.
    #[inline(always)]
    pub fn seen_from(&self) -> Vector<F> {
        self.origin - self.direction * self.travelled
    }

    /// Selects one or the other, lane by lane, of two continuations of the same samples.
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
            packed_normal: F::Int::select(mask, yes.packed_normal, no.packed_normal),
            width: F::select(mask, yes.width, no.width),
            spread: F::select(mask, yes.spread, no.spread),
            bodies: F::Int::select(mask, yes.bodies, no.bodies),
            scatterings: F::Int::select(mask, yes.scatterings, no.scatterings),
            travelled: F::select(mask, yes.travelled, no.travelled),
            landing: F::Int::select(mask, yes.landing, no.landing),
            ..*yes
        }
    }

    /// The key of the path's random numbers under the Whitted transport.
    #[inline(always)]
    pub fn key(&self, seed: u64) -> SampleKey<F::Int> {
        SampleKey::new(seed, self.pixel, self.sample, self.bounce_counts)
    }

    /// The key of the path's random numbers under the path transport.
    #[inline(always)]
    pub fn path_key(&self, seed: u64) -> SampleKey<F::Int> {
        SampleKey::new(seed, self.pixel, self.sample, F::Int::splat(0))
    }
}

/// Packs a pixel's column and row into one integer.
#[inline(always)]
pub fn pack_pixel(x: u32, y: u32) -> u32 {
    x | y << 16
}

/// The inverse of [`pack_pixel`].
#[inline(always)]
pub fn unpack_pixel(pixel: u32) -> (u32, u32) {
    (pixel & 0xffff, pixel >> 16)
}

/// The column and row of a packed pixel as floats.
#[inline(always)]
pub fn pixel_place<F: Float>(pixel: F::Int) -> (F, F) {
    ((pixel & F::Int::splat(0xffff)).to_float(), pixel.shr::<16>().to_float())
}
