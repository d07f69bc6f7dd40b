//! From two films that differ to the first thing that happened otherwise.

use super::Way;
use crate::film::{Film, PixelSum};
use crate::integrator::Stage;
use crate::integrator::observe::{Event, EventKind, PathKey};
use crate::render::Session;
use crate::world::Transport;

/// Where two ways of rendering diverge.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Column and row of the first pixel that differs, row by row.
    pub pixel: [u32; 2],
    /// How many pixels differ.
    pub pixels: usize,
    /// The two ways and their sums in that pixel.
    pub sides: [Side; 2],
    /// The first event that differs in that pixel. None if everything observed is equal when its tile is rendered
    /// again on its own: then threads or memory are at fault.
    pub first: Option<First>,
}

/// One of two ways.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Which.
    pub way: Way,
    /// What the pixel has gathered.
    pub sum: PixelSum,
}

/// The first event that differs.
#[derive(Clone, Debug)]
pub struct First {
    /// Which sample, which bounce, which fork.
    pub place: PathKey,
    /// The stage of the wave in which it shows.
    pub stage: Stage,
    /// What happened on both sides; nothing where one of them did not get there.
    pub happened: [Option<EventKind>; 2],
}

/// The first pixel, and what happens to its samples on either side.
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

/// Something that happened, in an order that does not depend on the schedule.
struct Occurrence {
    place: PathKey,
    /// Which of several of its kind at one place.
    ordinal: usize,
    what: EventKind,
}

impl Occurrence {
    fn key(&self) -> (u32, u32, usize, u32, usize) {
        (self.place.sample, self.place.depth, rank(&self.what), self.place.branch, self.ordinal)
    }
}

/// The order of what happens at one depth.
fn rank(what: &EventKind) -> usize {
    match what {
        EventKind::Onward { .. } => 0,
        EventKind::Ray { .. } => 1,
        EventKind::Vertex { .. } => 2,
        EventKind::Choice { .. } => 3,
        EventKind::Gathered { .. } => 4,
        EventKind::Light { .. } => 5,
        EventKind::Shadow { .. } => 6,
        EventKind::Aside => 7,
        EventKind::End { .. } => 8,
        EventKind::Received { .. } => 9,
        EventKind::Drawn { .. } => 10,
    }
}

/// All that happens to the samples of a pixel.
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
        // Only forks that went through the same kinds of bounces share a place: their order is the schedule's.
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
                // Where one side has nothing at a place, the other's comes first.
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

/// To the bit: −0 is not 0, and NaN is itself.
fn same(a: &EventKind, b: &EventKind) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

/// Which stage does what differs.
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
        // Shading decided that one goes on and the other does not.
        [None, Some(EventKind::End { .. })] | [Some(EventKind::End { .. }), None] => Stage::Shade,
        [Some(one), _] | [None, Some(one)] => match one {
            EventKind::Ray { .. } => Stage::Intersect,
            EventKind::Vertex { .. } | EventKind::Choice { .. } | EventKind::Onward { .. } => Stage::Shade,
            EventKind::Light { .. } => Stage::Light,
            EventKind::Shadow { .. } => Stage::Shadow,
            EventKind::Received { .. } => Stage::Connect,
            EventKind::Gathered { .. } | EventKind::Drawn { .. } => Stage::Photons,
            EventKind::Aside | EventKind::End { .. } => Stage::Advance,
        },
        [None, None] => Stage::Advance,
    }
}
