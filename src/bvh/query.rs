//! Queries over queues of rays, and which kernel answers which queue.

use super::flight::Flight;
use super::packet::{self, Packet};
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
    packet: Box<Packet>,
}

impl Stack {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        Self { single: traverse::Keys::new(bvh), flight: Flight::new(), packet: Box::new(Packet::new(bvh)) }
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

/// Where a query's answers go.
pub(super) trait Answers {
    /// Whether the first hit is as good as the nearest.
    const ANY: bool;
    /// The answer for a ray. A miss has no primitive.
    fn put(&mut self, index: usize, hit: &Hit);
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
        let count = self.rays.len();
        let mut first = 0;
        // The first ray that no kernel has been found for.
        let mut behind = 0;
        while self.coherence != Coherence::Scattered && first < count {
            let size = (count - first).min(packet::RAYS);
            let Stack { single, packet, .. } = &mut *self.stack;
            if packet.trace::<L, A>(self.bvh, &self.rays, first, size, single, &mut self.answers) {
                self.scattered::<L>(behind, first);
                behind = first + size;
            }
            first += size;
        }
        self.scattered::<L>(behind, count);
    }
}

impl<A: Answers> Query<'_, A> {
    #[inline(always)]
    fn scattered<L: Lanes>(&mut self, first: usize, end: usize) {
        if first == end {
            return;
        }
        let rays = self.rays.range(first..end);
        let mut answers = Shifted { answers: &mut self.answers, by: first };
        if Flight::holds(self.bvh) {
            self.stack.flight.trace::<L, _>(self.bvh, rays, &mut answers);
        } else {
            traverse::each::<L, _>(self.bvh, rays, &mut self.stack.single, &mut answers);
        }
    }
}

/// Answers for a part of a queue.
struct Shifted<'a, A> {
    answers: &'a mut A,
    by: usize,
}

impl<A: Answers> Answers for Shifted<'_, A> {
    const ANY: bool = A::ANY;
    #[inline(always)]
    fn put(&mut self, index: usize, hit: &Hit) {
        self.answers.put(self.by + index, hit);
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
