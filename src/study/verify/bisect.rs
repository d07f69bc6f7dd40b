//! Narrows down two differing films to the first event that differs.

use super::Way;
use crate::film::{Film, PixelSum};
use crate::integrator::Stage;
use crate::integrator::observe::{Event, EventKind, PathKey};
use crate::render::Session;
use crate::world::Transport;

/// A difference between two ways of rendering.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Column and row of the first differing pixel, in row order.
    pub pixel: [u32; 2],
    /// The number of differing pixels.
    pub pixels: usize,
    /// The two ways and their sums in that pixel.
    pub sides: [Side; 2],
    /// The first differing event in that pixel. None if all observed events are equal when its tile is rendered again
    /// by itself: then threads or memory are at fault.
    pub first: Option<First>,
}

/// One of two ways.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// The way to render.
    pub way: Way,
    /// The sum in the pixel.
    pub sum: PixelSum,
}

/// The first differing event.
#[derive(Clone, Debug)]
pub struct First {
    /// The sample, the fork, and the bounce.
    pub place: PathKey,
    /// The stage of the wave that is responsible.
    pub stage: Stage,
    /// The events on both sides; none for a side that did not get this far.
    pub happened: [Option<EventKind>; 2],
}

/// Finds the first differing pixel, and the first differing event of its samples.
pub(super) fn narrow(sides: [(Way, Session, &Film); 2]) -> Option<Difference> {
    let [(_, _, a), (_, _, b)] = &sides;
    let differing = || (0..a.pixels().len()).filter(|i| a.pixels()[*i] != b.pixels()[*i]);
    let index = differing().next()?;
    let width = a.region().width();
    let pixel = [a.region().x0 + index as u32 % width, a.region().y0 + index as u32 / width];
    let first = first([0, 1].map(|side| history(&sides[side].1, pixel)));
    let sides = [0, 1].map(|side| Side { way: sides[side].0, sum: sides[side].2.pixels()[index] });
    Some(Difference { pixel, pixels: differing().count(), sides, first })
}

/// An event, in an order that does not depend on the schedule.
struct Occurrence {
    place: PathKey,
    /// Distinguishes events of the same kind with the same key.
    ordinal: usize,
    what: EventKind,
}

impl Occurrence {
    fn key(&self) -> (u32, u32, usize, u32, usize) {
        (self.place.sample, self.place.depth, rank(&self.what), self.place.branch, self.ordinal)
    }
}

/// The order of events at one depth.
fn rank(what: &EventKind) -> usize {
    match what {
        EventKind::Onward { .. } => 0,
        EventKind::Ray { .. } => 1,
        EventKind::LampFound { .. } => 2,
        EventKind::Vertex { .. } => 3,
        EventKind::Choice { .. } => 4,
        EventKind::Gathered { .. } => 5,
        EventKind::Light { .. } => 6,
        EventKind::Shadow { .. } => 7,
        EventKind::Spilled => 8,
        EventKind::End { .. } => 9,
        EventKind::Received { .. } => 10,
        EventKind::Drawn { .. } => 11,
    }
}

/// Returns all events of a pixel's samples.
fn history(session: &Session, pixel: [u32; 2]) -> Vec<Occurrence> {
    let mut entries: Vec<Occurrence> = Vec::new();
    let mut counts = std::collections::HashMap::new();
    session.observe(Some(pixel), &mut |event| {
        if let Event::Sample(place, what) = event
            && place.pixel == (pixel[0], pixel[1])
        {
            let count = counts.entry((*place, rank(what))).or_insert(0);
            entries.push(Occurrence { place: *place, ordinal: *count, what: *what });
            *count += 1;
        }
    });
    entries.sort_by_key(Occurrence::key);
    if session.setup().transport == Transport::Path {
        // Only forks with the same numbers of bounces by kind share a key: the schedule decides their order.
        for same in entries.chunk_by_mut(|a, b| a.ordinal < b.ordinal) {
            same.sort_by_cached_key(|entry| format!("{:?}", entry.what));
            same.iter_mut().enumerate().for_each(|(at, entry)| entry.ordinal = at);
        }
    }
    entries
}

fn first([a, b]: [Vec<Occurrence>; 2]) -> Option<First> {
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    loop {
        let (left, right) = match (a.peek(), b.peek()) {
            (None, None) => return None,
            (left, right) => {
                let key = |entry: &Option<&&Occurrence>| entry.map(|entry| entry.key());
                // If one side has no event with a key, the other side's event comes first.
                let before = |x: &Option<&&Occurrence>, y: &Option<&&Occurrence>| {
                    y.is_none() || (x.is_some() && key(x) <= key(y))
                };
                (
                    left.filter(|_| before(&left, &right)).copied(),
                    right.filter(|_| before(&right, &left)).copied(),
                )
            }
        };
        let _ = left.and_then(|_| a.next());
        let _ = right.and_then(|_| b.next());
        if let (Some(left), Some(right)) = (left, right)
            && same(&left.what, &right.what)
        {
            continue;
        }
        let place = left.or(right)?.place;
        let happened = [left, right].map(|entry| entry.map(|entry| entry.what));
        return Some(First { place, stage: stage(place, &happened), happened });
    }
}

/// True if both are equal to the bit: −0 differs from 0, and NaN equals itself.
fn same(a: &EventKind, b: &EventKind) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

/// Returns the stage that produced the difference.
fn stage(place: PathKey, happened: &[Option<EventKind>; 2]) -> Stage {
    match happened {
        [
            Some(EventKind::Ray { origin: a, direction: b, throughput: c, .. }),
            Some(EventKind::Ray { origin: d, direction: e, throughput: f, .. }),
        ] if (a, b, c) != (d, e, f) => {
            if place.depth == 0 {
                Stage::Generate
            } else {
                Stage::Shade
            }
        }
        // Shading continued one path and not the other.
        [None, Some(EventKind::End { .. })] | [Some(EventKind::End { .. }), None] => Stage::Shade,
        [Some(one), _] | [None, Some(one)] => match one {
            EventKind::Ray { .. } | EventKind::LampFound { .. } => Stage::Intersect,
            EventKind::Vertex { .. } | EventKind::Choice { .. } | EventKind::Onward { .. } => Stage::Shade,
            EventKind::Light { .. } => Stage::Light,
            EventKind::Shadow { .. } => Stage::Shadow,
            EventKind::Received { .. } => Stage::Connect,
            EventKind::Gathered { .. } | EventKind::Drawn { .. } => Stage::Photons,
            EventKind::Spilled | EventKind::End { .. } => Stage::Advance,
        },
        [None, None] => Stage::Advance,
    }
}
