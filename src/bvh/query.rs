//! Queries over queues of rays, and which kernel answers which queue.

pub use super::traverse::Stack;
use super::traverse::{Any, Closest};
use super::{Bvh, HitsMut, Rays};
use crate::simd::{Level, dispatch};

/// What the caller knows of a queue. It decides which kernel runs, never what comes out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// Nothing: looked at before tracing.
    #[default]
    Unknown,
    /// Rays that follow each other in the queue run side by side: camera rays, shadow rays
    /// to one light, mirror images in a flat surface.
    Coherent,
    /// They go anywhere.
    Scattered,
}

/// The nearest hit of each ray with t_min < t ≤ t_max.
pub fn closest(level: Level, bvh: &Bvh, rays: Rays, _: Coherence, stack: &mut Stack, hits: HitsMut) {
    dispatch(level, Closest { bvh, rays, stack, hits });
}

/// For each ray 1 if something lies between its ends, else 0.
pub fn any(level: Level, bvh: &Bvh, rays: Rays, _: Coherence, stack: &mut Stack, occluded: &mut [u32]) {
    dispatch(level, Any { bvh, rays, stack, occluded });
}
