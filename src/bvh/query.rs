//! Queries over queues of rays, and which kernel answers which queue.

use std::marker::PhantomData;
use std::time::Instant;

use super::answers::{Answers, Occluded, Shifted};
use super::direction_classes::DirectionClasses;
use super::few_leaves::{self, FewLeaves};
use super::flight::{self, Flight};
use super::packet::{self, Packet, Verdict};
use super::prepare::Prepared;
use super::race::Race;
use super::stream::{self, Stream};
use super::traverse;
use super::{Asker, Bvh, HitsMut, Rays};
use crate::math::{Hit, Ray};
use crate::simd::{Float, Kernel, Lanes, Level, Waiting, dispatch};

/// What the caller knows of a queue. It decides which kernel runs, never what comes out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// Nothing: the query looks for itself before it traces.
    #[default]
    Unknown,
    /// Rays that follow each other in the queue run side by side: camera rays, shadow rays
    /// to one light, mirror images in a flat surface.
    Coherent,
    /// Rays that go anywhere.
    Scattered,
}

/// Ways to answer a queue, or a part of it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Packets where rays run side by side.
    Packets,
    /// Streams, or in flight, whichever is faster.
    Scattered,
    /// Streams, except for directions at the limits of floats.
    Streams,
    /// In flight.
    InFlight,
}

/// Two ways that are compared.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Contest {
    /// Packets and none; whether the caller has said that rays run side by side.
    Packets(bool),
    /// Streams and rays in flight.
    Flight,
}

/// The number of rays of which a query makes the most: 16,384. More at once are no faster.
pub const QUEUE: usize = stream::RAYS;

/// A thread's buffers for queries on one tree. They grow with the longest queue so far and are kept, so that most
/// queries allocate nothing.
pub struct Stack {
    pub(super) single: Waiting,
    few: Option<FewLeaves>,
    classes: DirectionClasses,
    prepared: Box<Prepared>,
    flight: Flight,
    stream: Stream,
    /// With fewer rays, these go in flight.
    pub(super) least_stream: usize,
    packet: Box<Packet>,
    /// How many packets to pass over after one that was not worth it; if the nearest hit is asked
    /// for, and if any.
    packet_pause: [usize; 2],
    /// Whether packets have taken much of the last queue that was looked at.
    in_packets: [bool; 2],
    fan_pause: Pause,
    /// By [`Contest`]; if the nearest hit is asked for, and if any.
    races: [[Race; 2]; 3],
}

impl Stack {
    /// For queries on `bvh`.
    pub fn new(bvh: &Bvh) -> Self {
        Self {
            single: traverse::stack_for(bvh),
            few: FewLeaves::new(bvh),
            classes: DirectionClasses::default(),
            prepared: Box::default(),
            flight: Flight::new(bvh),
            stream: Stream::default(),
            least_stream: stream::FEWEST,
            packet: Box::new(Packet::new(bvh)),
            packet_pause: [0; 2],
            in_packets: [false; 2],
            fan_pause: Pause::default(),
            races: [[Race::NEW; 2]; 3],
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

/// [`any`] for rays that come in fans: side by side, those of each with one end in common. `fans` says where in
/// the queue each one ends; what lies behind the last is in none.
pub fn any_in_fans(
    level: Level,
    bvh: &Bvh,
    rays: Rays,
    fans: &[u32],
    stack: &mut Stack,
    occluded: &mut [u32],
) {
    let query = Query { bvh, rays, coherence: Coherence::Scattered, stack, answers: Occluded(occluded) };
    dispatch(level, FanQuery { query, fans });
}

/// The nearest hit of one ray with t_min < t ≤ t_max: what the recursive schedule asks for.
pub fn closest_ray(level: Level, bvh: &Bvh, ray: &Ray<f32>, asker: Asker, stack: &mut Stack) -> Hit {
    dispatch(level, Alone::<HitsMut> { bvh, ray, asker, stack, answers: PhantomData })
}

/// Whether one ray hits anything with t_min < t ≤ t_max.
pub fn any_ray(level: Level, bvh: &Bvh, ray: &Ray<f32>, asker: Asker, stack: &mut Stack) -> bool {
    !dispatch(level, Alone::<Occluded> { bvh, ray, asker, stack, answers: PhantomData }).is_miss()
}

struct Alone<'a, A> {
    bvh: &'a Bvh,
    ray: &'a Ray<f32>,
    asker: Asker<'a>,
    stack: &'a mut Stack,
    answers: PhantomData<A>,
}

impl<A: Answers> Kernel for Alone<'_, A> {
    type Output = Hit;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Hit {
        let Self { bvh, ray, asker, stack, .. } = self;
        if !A::ANY {
            return traverse::closest_one::<L>(bvh, ray, asker, stack);
        }
        let blocked = traverse::any_one::<L>(bvh, ray, asker, stack);
        // Which one it is does not matter.
        if blocked { Hit { primitive: 0, ..Hit::MISS } } else { Hit::MISS }
    }
}

/// Checking whether rays are coherent takes about a tenth of the time of tracing them, so a queue of scattered rays
/// is checked only here and there.
const LONGEST_PAUSE: usize = 15;

/// The pause after one that was in vain.
fn longer(pause: usize) -> usize {
    (2 * pause + 1).min(LONGEST_PAUSE)
}

/// Leaves something out for a while, and for longer each time that it was not worth it.
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

    /// Begins again, after something that was `worthwhile` or not.
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
            let (rays, classes, answers) = (&self.rays, &mut self.stack.classes, &mut self.answers);
            return L::outlined(few_leaves::FewQuery { few, rays, classes, answers });
        }
        if !is_wide::<L>() || self.coherence == Coherence::Scattered {
            return self.scattered::<L>(0, count);
        }
        let race = Contest::Packets(self.coherence == Coherence::Coherent);
        self.best_of_two::<L>(race, 0, count);
    }
}

impl<A: Answers> Query<'_, A> {
    /// Rays side by side in packets, and all others as [`Query::scattered`].
    #[inline(always)]
    fn in_packets<L: Lanes>(&mut self, mut first: usize, end: usize) {
        let (all, mut taken) = (end - first, 0);
        // The first ray that no packet has taken.
        let mut behind = first;
        while first < end {
            let size = (end - first).min(packet::RAYS);
            let Stack { single, packet, .. } = &mut *self.stack;
            let (bvh, rays, answers) = (self.bvh, &self.rays, &mut self.answers);
            let query = packet::PacketQuery { packet, bvh, rays, first, count: size, keys: single, answers };
            let verdict = L::outlined(query);
            if verdict != Verdict::Refused {
                self.scattered::<L>(behind, first);
                behind = first + size;
                taken += size;
            }
            let pause = &mut self.stack.packet_pause[usize::from(A::ANY)];
            *pause = match verdict {
                Verdict::Worthwhile => 0,
                Verdict::Refused if self.coherence == Coherence::Coherent => 0,
                _ => longer(*pause),
            };
            first += size + *pause * packet::RAYS;
        }
        self.stack.in_packets[usize::from(A::ANY)] = taken > all / 4;
        self.scattered::<L>(behind, end);
    }
}

/// Fewer rays are no fan.
const LEAST_FAN: usize = 12;

/// See [`any_in_fans`].
struct FanQuery<'a, A> {
    query: Query<'a, A>,
    fans: &'a [u32],
}

impl<A: Answers> Kernel for FanQuery<'_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { mut query, fans } = self;
        if !is_wide::<L>() {
            return query.run::<L>();
        }
        // The first ray that no fan has taken.
        let (mut behind, mut first) = (0, 0);
        for end in fans {
            let end = *end as usize;
            let count = end - first;
            if let Some(few) = &query.stack.few {
                let (rays, answers) = (&query.rays, &mut query.answers);
                let fan = few_leaves::FanQuery { few, rays, fan: first..end, answers };
                if count >= LEAST_FAN && L::outlined(fan) {
                    query.scattered::<L>(behind, first);
                    behind = end;
                }
            } else if (LEAST_FAN..=packet::RAYS).contains(&count) && !query.stack.fan_pause.goes_on() {
                let Stack { single, packet, .. } = &mut *query.stack;
                let (bvh, rays, answers) = (query.bvh, &query.rays, &mut query.answers);
                let packet = packet::PacketQuery { packet, bvh, rays, first, count, keys: single, answers };
                let verdict = L::outlined(packet);
                // However many boxes it meets: there is no better way for so few rays.
                query.stack.fan_pause.begin(verdict != Verdict::Refused);
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
        if let Some(few) = &self.stack.few {
            if first < end {
                let rays = &self.rays.range(first..end);
                let (classes, answers) =
                    (&mut self.stack.classes, &mut Shifted { answers: &mut self.answers, by: first });
                L::outlined(few_leaves::FewQuery { few, rays, classes, answers });
            }
            return;
        }
        for first in (first..end).step_by(stream::RAYS) {
            self.best_of_two::<L>(Contest::Flight, first, end.min(first + stream::RAYS));
        }
    }

    /// Answers rays in the faster one of two ways, as far as is known, and now and then in the other one.
    #[inline(always)]
    fn best_of_two<L: Lanes>(&mut self, contest: Contest, first: usize, end: usize) {
        let nearest_or_any = usize::from(A::ANY);
        let (ways, place) = match contest {
            Contest::Packets(coherent) => ([Way::Packets, Way::Scattered], usize::from(coherent)),
            // Streams share boxes and blocks where there are many more rays than blocks: so they come first.
            Contest::Flight if 4 * (self.bvh.triangles.len() + self.bvh.spheres.len()) < stream::RAYS => {
                ([Way::Streams, Way::InFlight], 2)
            }
            Contest::Flight => ([Way::InFlight, Way::Streams], 2),
        };
        let (is_choice, otherwise) = match contest {
            // If packets take no rays, trying them makes no difference.
            Contest::Packets(_) => (self.stack.in_packets[nearest_or_any], Way::Packets),
            Contest::Flight => (true, Way::InFlight),
        };
        // Few rays say little about how fast a kernel is.
        if end - first < self.stack.least_stream || !is_choice {
            return self.answer::<L>(otherwise, first, end);
        }
        let mut first = first;
        while first < end {
            let race = self.stack.races[place][nearest_or_any];
            let (way, count) = (race.next(), end - first);
            let is_slower = way != race.faster();
            let count = if is_slower { count.min(contest.slower_gets()) } else { count };
            let start = Instant::now();
            self.answer::<L>(ways[way], first, first + count);
            let took = start.elapsed().as_nanos() as f32 / count as f32;
            self.stack.races[place][nearest_or_any].has_taken(way, took);
            first += count;
        }
    }

    /// A part of the rays in one of two ways, where that can be.
    #[inline(always)]
    fn answer<L: Lanes>(&mut self, way: Way, first: usize, end: usize) {
        L::outlined(WayQuery { query: self, way, first, end });
    }
}

impl Contest {
    /// The most rays of a queue that the slower way answers, to see whether it is still slower. Without packets, rays
    /// that run side by side take several times as long; but streams get faster the more rays they have.
    fn slower_gets(self) -> usize {
        match self {
            Contest::Packets(_) => 2048,
            Contest::Flight => usize::MAX,
        }
    }
}

/// Some rays of a query in one way.
struct WayQuery<'q, 'a, A> {
    query: &'q mut Query<'a, A>,
    way: Way,
    first: usize,
    end: usize,
}

impl<A: Answers> Kernel for WayQuery<'_, '_, A> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { query, way, first, end } = self;
        match way {
            Way::Packets => return query.in_packets::<L>(first, end),
            Way::Scattered => return query.scattered::<L>(first, end),
            Way::Streams | Way::InFlight => {}
        }
        let (bvh, rays) = (query.bvh, query.rays.range(first..end));
        let answers = &mut Shifted { answers: &mut query.answers, by: first };
        let Stack { single, flight, classes, stream, .. } = &mut *query.stack;
        if way == Way::Streams {
            let (keys, rays, answers) = (&mut *single, &rays, &mut *answers);
            if L::outlined(stream::StreamQuery { stream, bvh, rays, classes, keys, answers }) {
                return;
            }
        }
        L::outlined(flight::FlightQuery { flight, bvh, rays, answers });
    }
}

/// Whether the kernels for many rays are worth it: without wide registers, other rays hide nothing.
#[inline(always)]
fn is_wide<L: Lanes>() -> bool {
    L::Queue::WIDTH >= packet::LEAST_WIDTH
}
