//! Queries over queues of rays, and which kernel answers which queue.

use super::few::Few;
use super::flight::Flight;
use super::packet::{self, Packet, Verdict};
use super::prepare::Prepared;
use super::stream::{self, Density, Stream};
use super::traverse;
use super::ways::Ways;
use super::{Bvh, HitsMut, Rays};
use crate::math::{Hit, NONE};
use crate::simd::{Float, Int, Kernel, Lanes, Level, dispatch};

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

/// Rays of which a query makes the most: longer queues are answered in parts.
pub const QUEUE: usize = stream::RAYS;

/// A thread's buffers for queries on one tree, made once, so that no query allocates.
pub struct Stack {
    pub(super) single: traverse::Keys,
    few: Option<Few>,
    ways: Ways,
    prepared: Box<Prepared>,
    flight: Flight,
    stream: Stream,
    /// Fewer rays go in flight.
    pub(super) least_stream: usize,
    packet: Box<Packet>,
    /// How many packets to pass over after one that was not worth it, and how many streams; if
    /// the nearest hit is asked for, and if any.
    packet_pause: [usize; 2],
    stream_pause: [Pause; 2],
}

impl Stack {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        Self {
            single: traverse::Keys::new(bvh),
            few: Few::new(bvh),
            ways: Ways::default(),
            prepared: Box::default(),
            flight: Flight::new(),
            stream: Stream::default(),
            least_stream: stream::FEWEST,
            packet: Box::new(Packet::new(bvh)),
            packet_pause: [0; 2],
            stream_pause: [Pause::default(); 2],
        }
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
    /// The answers for rays that follow each other.
    fn put_all(&mut self, first: usize, hits: &Hits);
}

/// Hits by columns, all of one length.
pub(super) struct Hits<'a> {
    pub t: &'a [f32],
    pub u: &'a [f32],
    pub v: &'a [f32],
    pub primitive: &'a [u32],
    pub instance: &'a [u32],
}

/// Answers `count` rays that follow each other, a lane each: t, u, v; primitive and instance.
#[inline(always)]
pub(super) fn put_lanes<F: Float, A: Answers>(
    answers: &mut A,
    first: usize,
    count: usize,
    weights: [F; 3],
    numbers: [F::Int; 2],
) {
    let (mut columns, mut ids) = ([[0.0; 16]; 3], [[0; 16]; 2]);
    for (column, values) in columns.iter_mut().zip(weights) {
        values.store(column);
    }
    for (column, values) in ids.iter_mut().zip(numbers) {
        values.store(column);
    }
    let ([t, u, v], [primitive, instance]) = (&columns, &ids);
    let hits = Hits {
        t: &t[..count],
        u: &u[..count],
        v: &v[..count],
        primitive: &primitive[..count],
        instance: &instance[..count],
    };
    answers.put_all(first, &hits);
}

/// Looking whether rays are coherent takes about a tenth of the time of tracing them, so a queue of
/// scattered ones is looked at here and there only.
const LONGEST_PAUSE: usize = 15;

/// The pause after one that was in vain.
fn longer(pause: usize) -> usize {
    (2 * pause + 1).min(LONGEST_PAUSE)
}

/// Something that is left for a while, and for longer each time that it was not worth it.
#[derive(Clone, Copy, Default)]
struct Pause {
    length: usize,
    left: usize,
}

impl Pause {
    /// Whether it is still on; counts down.
    fn goes_on(&mut self) -> bool {
        let on = self.left > 0;
        self.left = self.left.saturating_sub(1);
        on
    }

    /// Begins anew after something that was `worthwhile` or not.
    fn begin(&mut self, worthwhile: bool) {
        self.length = if worthwhile { 0 } else { longer(self.length) };
        self.left = self.length;
    }
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
        if is_wide::<L>()
            && let Some(few) = &self.stack.few
        {
            return few.trace::<L, A>(&self.rays, &mut self.stack.ways, &mut self.answers);
        }
        // The first ray that no packet has taken.
        let mut behind = 0;
        let packets = is_wide::<L>() && self.coherence != Coherence::Scattered;
        let mut first = if packets { 0 } else { count };
        while first < count {
            let size = (count - first).min(packet::RAYS);
            let Stack { single, packet, .. } = &mut *self.stack;
            let verdict = packet.trace::<L, A>(self.bvh, &self.rays, first, size, single, &mut self.answers);
            if verdict != Verdict::Refused {
                self.scattered::<L>(behind, first);
                behind = first + size;
            }
            let pause = &mut self.stack.packet_pause[usize::from(A::ANY)];
            *pause = match verdict {
                Verdict::Worthwhile => 0,
                Verdict::Refused if self.coherence == Coherence::Coherent => 0,
                _ => longer(*pause),
            };
            first += size + *pause * packet::RAYS;
        }
        self.scattered::<L>(behind, count);
    }
}

impl<A: Answers> Query<'_, A> {
    /// Rays that no packet has taken: in streams, or in flight if they are few or thinly spread.
    #[inline(always)]
    fn scattered<L: Lanes>(&mut self, first: usize, end: usize) {
        if !is_wide::<L>() {
            let Stack { single, prepared, .. } = &mut *self.stack;
            let mut answers = Shifted { answers: &mut self.answers, by: first };
            let rays = self.rays.range(first..end);
            return traverse::each::<L, _>(self.bvh, rays, prepared, single, &mut answers);
        }
        for first in (first..end).step_by(stream::RAYS) {
            let rays = self.rays.range(first..end.min(first + stream::RAYS));
            let mut answers = Shifted { answers: &mut self.answers, by: first };
            let Stack { single, prepared, flight, ways, stream, least_stream, stream_pause, .. } =
                &mut *self.stack;
            let pause = &mut stream_pause[usize::from(A::ANY)];
            if rays.len() >= *least_stream && !pause.goes_on() {
                let density = stream.trace::<L, _>(self.bvh, &rays, ways, single, &mut answers);
                pause.begin(density == Density::Dense);
                if density != Density::Refused {
                    continue;
                }
            }
            if Flight::holds(self.bvh) {
                flight.trace::<L, _>(self.bvh, rays, &mut answers);
            } else {
                traverse::each::<L, _>(self.bvh, rays, prepared, single, &mut answers);
            }
        }
    }
}

/// Whether the kernels for many rays are worth it: without wide registers there is nothing to hide behind
/// other rays.
#[inline(always)]
fn is_wide<L: Lanes>() -> bool {
    L::Queue::WIDTH >= packet::LEAST_WIDTH
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
    #[inline(always)]
    fn put_all(&mut self, first: usize, hits: &Hits) {
        self.answers.put_all(self.by + first, hits);
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
    #[inline(always)]
    fn put_all(&mut self, first: usize, hits: &Hits) {
        let range = first..first + hits.t.len();
        for ((to, t), primitive) in self.t[range.clone()].iter_mut().zip(hits.t).zip(hits.primitive) {
            *to = if *primitive == NONE { f32::INFINITY } else { *t };
        }
        self.u[range.clone()].copy_from_slice(hits.u);
        self.v[range.clone()].copy_from_slice(hits.v);
        self.primitive[range.clone()].copy_from_slice(hits.primitive);
        self.instance[range].copy_from_slice(hits.instance);
    }
}

/// 1 for each ray that is blocked, 0 for the others.
pub(super) struct Occluded<'a>(&'a mut [u32]);

impl Answers for Occluded<'_> {
    const ANY: bool = true;
    #[inline(always)]
    fn put(&mut self, index: usize, hit: &Hit) {
        self.0[index] = u32::from(!hit.is_miss());
    }
    #[inline(always)]
    fn put_all(&mut self, first: usize, hits: &Hits) {
        for (to, primitive) in self.0[first..first + hits.primitive.len()].iter_mut().zip(hits.primitive) {
            *to = u32::from(*primitive != NONE);
        }
    }
}
