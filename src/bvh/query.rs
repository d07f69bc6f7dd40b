//! Queries over queues of rays, and which kernel answers which queue.

use super::flight::{Answers, Flight};
use super::traverse;
use super::{Bvh, HitsMut, Rays};
use crate::math::Hit;
use crate::simd::{Kernel, Lanes, Level, dispatch};

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

/// A thread's buffers for queries on one tree, made once, so that no query allocates.
pub struct Stack {
    pub(super) single: traverse::Keys,
    flight: Flight,
}

impl Stack {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        Self { single: traverse::Keys::new(bvh), flight: Flight::new() }
    }
}

/// The nearest hit of each ray with t_min < t ≤ t_max.
pub fn closest(level: Level, bvh: &Bvh, rays: Rays, coherence: Coherence, stack: &mut Stack, hits: HitsMut) {
    dispatch(level, Query { bvh, rays, coherence, stack, answers: hits });
}

/// For each ray 1 if something lies between its ends, else 0.
pub fn any(
    level: Level,
    bvh: &Bvh,
    rays: Rays,
    coherence: Coherence,
    stack: &mut Stack,
    occluded: &mut [u32],
) {
    dispatch(level, Query { bvh, rays, coherence, stack, answers: Occluded(occluded) });
}

struct Query<'a, A> {
    bvh: &'a Bvh,
    rays: Rays<'a>,
    coherence: Coherence,
    stack: &'a mut Stack,
    answers: A,
}

impl<A: Answers> Kernel for Query<'_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        if self.coherence == Coherence::Coherent || !Flight::holds(self.bvh) {
            traverse::each::<L, A>(self.bvh, self.rays, &mut self.stack.single, &mut self.answers);
        } else {
            self.stack.flight.trace::<L, A>(self.bvh, self.rays, &mut self.answers);
        }
    }
}

impl Answers for HitsMut<'_> {
    const ANY: bool = false;
    #[inline(always)]
    fn put(&mut self, index: usize, hit: &Hit) {
        let missed = hit.is_miss();
        self.t[index] = if missed { f32::INFINITY } else { hit.t };
        self.u[index] = hit.u;
        self.v[index] = hit.v;
        self.primitive[index] = hit.primitive;
        self.instance[index] = hit.instance;
    }
}

/// 1 for each ray that is blocked, 0 for the others.
struct Occluded<'a>(&'a mut [u32]);

impl Answers for Occluded<'_> {
    const ANY: bool = true;
    #[inline(always)]
    fn put(&mut self, index: usize, hit: &Hit) {
        self.0[index] = u32::from(!hit.is_miss());
    }
}
