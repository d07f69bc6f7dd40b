//! Queries over queues of rays, and the choice of a kernel for each queue.

use std::marker::PhantomData;
use std::time::Instant;

use super::counters::Visits;
use super::direction_classes::DirectionClasses;
use super::interleaved::{self, InterleavedRays};
use super::leaf_list::{self, LeafList};
use super::packet::{self, Packet, Verdict};
use super::prepare::PreparedRays;
use super::stream::{self, StreamBuffers};
use super::traverse::{self, any_counted, closest_counted};
use crate::bvh::intersect::hit_sink::{HitSink, Occluded, Offset};
use crate::bvh::{AnyHitFilter, Bvh, HitsMut, Rays};
use crate::math::{Hit, Ray, Vec3};
use crate::simd::{Float, Isa, Kernel, Lanes, TraversalStack, dispatch};

/// The caller's knowledge about a queue. It selects the kernel and never changes the result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// Nothing: the query checks before it traces.
    #[default]
    Unknown,
    /// Consecutive rays run side by side: camera rays, shadow rays to one light, mirror images in a flat surface.
    Coherent,
    /// Rays that go anywhere.
    Scattered,
}

/// The kernels for a queue, or a part of it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TraversalKernel {
    /// Packets where rays are coherent.
    Packets,
    /// Streams or interleaved rays, whichever is faster.
    Scattered,
    /// Streams, except for directions at the limits of floats.
    Streams,
    /// Interleaved rays.
    Interleaved,
}

/// Two kernels whose speeds are compared.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pairing {
    /// Packets and no packets; true if the rays are coherent, as far as is known.
    Packets(bool),
    /// Streams and interleaved rays.
    StreamsOrInterleaved,
}

/// Best batch size: 16,384 rays; larger batches are not faster.
pub const QUEUE: usize = stream::RAYS;

/// A thread's buffers for queries on one tree. They grow with the longest queue so far and are reused, so that most
/// queries allocate nothing.
pub struct Stack {
    pub(crate) single: TraversalStack,
    few: Option<LeafList>,
    classes: DirectionClasses,
    prepared: Box<PreparedRays>,
    interleaved: InterleavedRays,
    stream: StreamBuffers,
    /// Parts with fewer rays are interleaved.
    pub(in crate::bvh) least_stream: usize,
    packet: Box<Packet>,
    /// The number of packets to skip after one that was not worth it, for nearest-hit and for any-hit queries.
    packet_pause: [usize; 2],
    bundle_backoff: Backoff,
}

impl Stack {
    /// Creates the buffers for queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        Self {
            single: traverse::stack_for(bvh),
            few: LeafList::new(bvh),
            classes: DirectionClasses::default(),
            prepared: Box::default(),
            interleaved: InterleavedRays::new(bvh),
            stream: StreamBuffers::default(),
            least_stream: stream::FEWEST,
            packet: Box::new(Packet::new(bvh)),
            packet_pause: [0; 2],
            bundle_backoff: Backoff::default(),
        }
    }
}

/// Finds the nearest hit of each ray with t_min < t ≤ t_max.
pub fn closest(isa: Isa, bvh: &Bvh, rays: Rays, coherence: Coherence, stack: &mut Stack, hits: HitsMut) {
    dispatch(isa, QueueQuery { bvh, rays, coherence, stack, sink: hits });
}

/// Writes 1 for each ray that hits anything with t_min < t ≤ t_max, else 0.
pub fn any(isa: Isa, bvh: &Bvh, rays: Rays, coherence: Coherence, stack: &mut Stack, occluded: &mut [u32]) {
    dispatch(isa, QueueQuery { bvh, rays, coherence, stack, sink: Occluded(occluded) });
}

/// [`any`] for rays in bundles: coherent rays, those of each bundle with one end in common. `bundles` holds the end of
/// each in the queue; rays behind the last are in none.
pub fn any_in_bundles(
    isa: Isa,
    bvh: &Bvh,
    rays: Rays,
    bundles: &[u32],
    stack: &mut Stack,
    occluded: &mut [u32],
) {
    let query = QueueQuery { bvh, rays, coherence: Coherence::Scattered, stack, sink: Occluded(occluded) };
    dispatch(isa, BundleQuery { query, bundles });
}

/// Finds the nearest hit of one ray with t_min < t ≤ t_max, for the recursive schedule.
pub fn closest_ray(isa: Isa, bvh: &Bvh, ray: &Ray<f32>, filter: AnyHitFilter, stack: &mut Stack) -> Hit {
    dispatch(isa, Alone::<HitsMut> { bvh, ray, filter, stack, sink: PhantomData })
}

/// True if one ray hits anything with t_min < t ≤ t_max.
pub fn any_ray(isa: Isa, bvh: &Bvh, ray: &Ray<f32>, filter: AnyHitFilter, stack: &mut Stack) -> bool {
    !dispatch(isa, Alone::<Occluded> { bvh, ray, filter, stack, sink: PhantomData }).is_miss()
}

struct Alone<'a, A> {
    bvh: &'a Bvh,
    ray: &'a Ray<f32>,
    filter: AnyHitFilter<'a>,
    stack: &'a mut Stack,
    sink: PhantomData<A>,
}

impl<A: HitSink> Kernel for Alone<'_, A> {
    type Output = Hit;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Hit {
        let Self { bvh, ray, filter, stack, .. } = self;
        if !A::ANY {
            return traverse::closest_one::<L>(bvh, ray, filter, &mut stack.single);
        }
        let blocked = traverse::any_one::<L>(bvh, ray, filter, &mut stack.single);
        // Any-hit: the primitive's id is not needed.
        if blocked { Hit { primitive: 0, ..Hit::MISS } } else { Hit::MISS }
    }
}

/// The longest pause. Checking whether rays are coherent takes about a tenth of the time of tracing them, so a queue of
/// scattered rays is checked only now and then.
const LONGEST_PAUSE: usize = 15;

/// The pause after an unsuccessful one.
fn longer(pause: usize) -> usize {
    (2 * pause + 1).min(LONGEST_PAUSE)
}

/// Exponential back-off.
#[derive(Clone, Copy, Default)]
struct Backoff {
    length: usize,
    left: usize,
}

impl Backoff {
    /// True while the pause lasts; counts down.
    fn is_active(&mut self) -> bool {
        let on = self.left > 0;
        self.left = self.left.saturating_sub(1);
        on
    }

    /// Restarts the pause after an attempt that was `worthwhile` or not.
    fn begin(&mut self, worthwhile: bool) {
        self.length = if worthwhile { 0 } else { longer(self.length) };
        self.left = self.length;
    }
}

struct QueueQuery<'a, A> {
    bvh: &'a Bvh,
    rays: Rays<'a>,
    coherence: Coherence,
    stack: &'a mut Stack,
    sink: A,
}

impl<A: HitSink> Kernel for QueueQuery<'_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let count = self.rays.len();
        if is_wide::<L>()
            && let Some(few) = &self.stack.few
        {
            let (rays, classes, sink) = (&self.rays, &mut self.stack.classes, &mut self.sink);
            return L::outlined(leaf_list::LeafListQuery { few, rays, classes, sink });
        }
        if !is_wide::<L>() || self.coherence == Coherence::Scattered {
            return self.scattered::<L>(0, count);
        }
        let coherent = self.coherence == Coherence::Coherent || are_parallel(&self.rays);
        self.best_of_two::<L>(Pairing::Packets(coherent), 0, count);
    }
}

impl<A: HitSink> QueueQuery<'_, A> {
    /// Traces coherent rays in packets, and all others with [`QueueQuery::scattered`].
    #[inline(always)]
    fn in_packets<L: Lanes>(&mut self, mut first: usize, end: usize) {
        // The first ray that no packet has taken.
        let mut behind = first;
        while first < end {
            let size = (end - first).min(packet::RAYS);
            let Stack { single, packet, .. } = &mut *self.stack;
            let (bvh, rays, sink) = (self.bvh, &self.rays, &mut self.sink);
            let query = packet::PacketQuery { packet, bvh, rays, first, count: size, keys: single, sink };
            let verdict = L::outlined(query);
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
        self.scattered::<L>(behind, end);
    }
}

/// Fewer rays are not traced as a bundle.
const LEAST_BUNDLE: usize = 12;

/// See [`any_in_bundles`].
struct BundleQuery<'a, A> {
    query: QueueQuery<'a, A>,
    bundles: &'a [u32],
}

impl<A: HitSink> Kernel for BundleQuery<'_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { mut query, bundles } = self;
        if !is_wide::<L>() {
            return query.run::<L>();
        }
        // The first ray that no bundle has taken.
        let (mut behind, mut first) = (0, 0);
        for end in bundles {
            let end = *end as usize;
            let count = end - first;
            if let Some(few) = &query.stack.few {
                let (rays, sink) = (&query.rays, &mut query.sink);
                let bundle = leaf_list::LeafListBundleQuery { few, rays, bundle: first..end, sink };
                if count >= LEAST_BUNDLE && L::outlined(bundle) {
                    query.scattered::<L>(behind, first);
                    behind = end;
                }
            } else if (LEAST_BUNDLE..=packet::RAYS).contains(&count)
                && !query.stack.bundle_backoff.is_active()
            {
                let Stack { single, packet, .. } = &mut *query.stack;
                let (bvh, rays, sink) = (query.bvh, &query.rays, &mut query.sink);
                let packet = packet::PacketQuery { packet, bvh, rays, first, count, keys: single, sink };
                let verdict = L::outlined(packet);
                // Regardless of the number of boxes: there is no better kernel for so few rays.
                query.stack.bundle_backoff.begin(verdict != Verdict::Refused);
                if verdict != Verdict::Refused {
                    query.scattered::<L>(behind, first);
                    behind = end;
                }
            }
            first = end;
        }
        query.scattered::<L>(behind, query.rays.len());
    }
}

impl<A: HitSink> QueueQuery<'_, A> {
    /// Traces rays that no packet has taken: in streams, or interleaved if they are few or thinly spread.
    #[inline(always)]
    fn scattered<L: Lanes>(&mut self, first: usize, end: usize) {
        if !is_wide::<L>() {
            let Stack { single, prepared, .. } = &mut *self.stack;
            let mut sink = Offset { sink: &mut self.sink, by: first };
            let rays = self.rays.range(first..end);
            return traverse::each::<L, _>(self.bvh, rays, prepared, single, &mut sink);
        }
        if let Some(few) = &self.stack.few {
            if first < end {
                let rays = &self.rays.range(first..end);
                let (classes, sink) =
                    (&mut self.stack.classes, &mut Offset { sink: &mut self.sink, by: first });
                L::outlined(leaf_list::LeafListQuery { few, rays, classes, sink });
            }
            return;
        }
        for first in (first..end).step_by(stream::RAYS) {
            self.best_of_two::<L>(Pairing::StreamsOrInterleaved, first, end.min(first + stream::RAYS));
        }
    }

    /// Traces rays with the faster of two kernels, as far as is known, and now and then some of them with the other.
    #[inline(always)]
    fn best_of_two<L: Lanes>(&mut self, pairing: Pairing, first: usize, end: usize) {
        let bvh = self.bvh;
        let nearest_or_any = usize::from(A::ANY);
        // The kernels, the place of their speeds, and the first choice.
        let (ways, place, unknown) = match pairing {
            Pairing::Packets(coherent) => {
                ([TraversalKernel::Packets, TraversalKernel::Scattered], usize::from(coherent), 0)
            }
            // Streams share boxes and blocks if there are many more rays than blocks.
            Pairing::StreamsOrInterleaved => {
                let is_small = 4 * (bvh.triangles.len() + bvh.spheres.len()) < stream::RAYS;
                ([TraversalKernel::Interleaved, TraversalKernel::Streams], 2, usize::from(is_small))
            }
        };
        let count = end - first;
        // Few rays are a poor measure of speed.
        if count < self.stack.least_stream {
            return self.answer::<L>(ways[0], first, end);
        }
        let speeds = &bvh.speeds[place][nearest_or_any];
        let faster = speeds.faster(unknown);
        if count < pairing.least_split() || !speeds.is_due() {
            return self.answer::<L>(ways[faster], first, end);
        }
        let (mut nanoseconds, mut counts, mut begin) = ([0.0; 2], [0.0; 2], 0);
        let shift = speeds.shift();
        for part in 0..pairing.parts() {
            let (way, end) = pairing.part(part, count, faster, shift);
            let start = Instant::now();
            self.answer::<L>(ways[way], first + begin, first + end);
            nanoseconds[way] += start.elapsed().as_nanos() as f32;
            counts[way] += (end - begin) as f32;
            begin = end;
        }
        speeds.record([nanoseconds[0] / counts[0], nanoseconds[1] / counts[1]]);
    }

    /// Traces a part of the rays with a kernel, where possible.
    #[inline(always)]
    fn answer<L: Lanes>(&mut self, way: TraversalKernel, first: usize, end: usize) {
        L::outlined(KernelQuery { query: self, way, first, end });
    }
}

impl Pairing {
    /// Queues with fewer rays are not split: a part would be a poor measure.
    fn least_split(self) -> usize {
        match self {
            Pairing::Packets(_) => 2 * stream::FEWEST,
            Pairing::StreamsOrInterleaved => 4 * stream::FEWEST,
        }
    }

    /// The number of parts of a split queue. Rays of one part may be much dearer than those of the next, so both kernels
    /// get rays from all over the queue.
    fn parts(self) -> usize {
        match self {
            Pairing::Packets(_) => 2 * SECTIONS + 1,
            Pairing::StreamsOrInterleaved => 3,
        }
    }

    /// A part of a split queue of `count` rays: its kernel, and the end of the part in the queue. `shift`, 0 to 1, moves
    /// the parts: queues may go through an image in rows, and must not be sampled in columns.
    fn part(self, part: usize, count: usize, faster: usize, shift: f32) -> (usize, usize) {
        match self {
            // Without packets, coherent rays take several times as long: the slower kernel gets few.
            Pairing::Packets(_) => {
                let (section, few) = (count / SECTIONS, (count / SECTIONS / 4).min(stream::FEWEST / 2));
                let end = part / 2 * section + ((section - few) as f32 * shift) as usize;
                match part {
                    last if last == 2 * SECTIONS => (faster, count),
                    _ if part.is_multiple_of(2) => (faster, end),
                    _ => (1 - faster, end + few),
                }
            }
            // Streams get faster the more rays they have.
            Pairing::StreamsOrInterleaved => {
                let first = ((count / 4) as f32 * 0.5 * (1.0 + shift)) as usize;
                let ends = [first, count - (count / 4 - first), count];
                (part % 2, ends[part])
            }
        }
    }
}

/// Packets and no packets take turns in so many sections of a split queue.
const SECTIONS: usize = 8;

/// Some rays of a query, for one kernel.
struct KernelQuery<'q, 'a, A> {
    query: &'q mut QueueQuery<'a, A>,
    way: TraversalKernel,
    first: usize,
    end: usize,
}

impl<A: HitSink> Kernel for KernelQuery<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { query, way, first, end } = self;
        match way {
            TraversalKernel::Packets => return query.in_packets::<L>(first, end),
            TraversalKernel::Scattered => return query.scattered::<L>(first, end),
            TraversalKernel::Streams | TraversalKernel::Interleaved => {}
        }
        let (bvh, rays) = (query.bvh, query.rays.range(first..end));
        let sink = &mut Offset { sink: &mut query.sink, by: first };
        let Stack { single, interleaved, classes, stream, .. } = &mut *query.stack;
        if way == TraversalKernel::Streams {
            let (keys, rays, sink) = (&mut *single, &rays, &mut *sink);
            if L::outlined(stream::StreamQuery { stream, bvh, rays, classes, keys, sink }) {
                return;
            }
        }
        L::outlined(interleaved::InterleavedQuery { interleaved, bvh, rays, sink });
    }
}

/// True if most of some rays go in about the direction of those that are soon behind them. Queues of both kinds come in
/// turn, such as camera rays and bounces, and differ in which kernel is faster.
fn are_parallel(rays: &Rays) -> bool {
    const SAMPLES: usize = 16;
    const APART: usize = 8;
    let Some(last) = rays.len().checked_sub(APART + 1) else { return true };
    let direction = |i: usize| Vec3::from_array(rays.direction.map(|column| column[i]));
    let is_parallel = |sample: &usize| {
        let first = sample * last / SAMPLES;
        let (a, b) = (direction(first), direction(first + APART));
        a.dot(b) > 0.9 * (a.length_squared() * b.length_squared()).sqrt()
    };
    2 * (0..SAMPLES).filter(is_parallel).count() >= SAMPLES
}

/// True if the kernels for many rays are worth it: without wide registers, other rays hide no latency.
#[inline(always)]
fn is_wide<L: Lanes>() -> bool {
    L::Queue::WIDTH >= packet::LEAST_WIDTH
}

/// Counts the work of finding a ray's nearest hit, or any hit if `any`, with the single-ray kernel.
pub fn visits(isa: Isa, bvh: &Bvh, ray: &Ray<f32>, any: bool, stack: &mut Stack) -> Visits {
    dispatch(isa, Count { bvh, ray, any, stack })
}

struct Count<'a> {
    bvh: &'a Bvh,
    ray: &'a Ray<f32>,
    any: bool,
    stack: &'a mut Stack,
}

impl Kernel for Count<'_> {
    type Output = Visits;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Visits {
        let mut visits = Visits::default();
        if self.any {
            any_counted::<L, _>(
                self.bvh,
                self.ray,
                AnyHitFilter::ACCEPT_ALL,
                &mut self.stack.single,
                &mut visits,
            );
        } else {
            closest_counted::<L, _>(
                self.bvh,
                self.ray,
                AnyHitFilter::ACCEPT_ALL,
                &mut self.stack.single,
                &mut visits,
            );
        }
        visits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_split_queue_follow_each_other_and_both_kernels_get_some() {
        for pairing in [Pairing::Packets(true), Pairing::StreamsOrInterleaved] {
            for count in (pairing.least_split()..pairing.least_split() + 40).chain([16_383, 16_384, 100_000])
            {
                for (faster, shift) in [(0, 0.0), (1, 0.0), (0, 0.618), (1, 0.999_999)] {
                    let (mut begin, mut rays) = (0, [0; 2]);
                    for part in 0..pairing.parts() {
                        let (way, end) = pairing.part(part, count, faster, shift);
                        assert!(end >= begin, "part {part} of {count}");
                        rays[way] += end - begin;
                        begin = end;
                    }
                    assert_eq!(begin, count);
                    assert!(rays.into_iter().all(|rays| rays >= count / 64), "{rays:?} of {count}");
                    let few = if pairing == Pairing::StreamsOrInterleaved { 0 } else { 1 - faster };
                    assert!(rays[few] <= count / 4, "{rays:?} of {count}");
                }
            }
        }
    }
}
