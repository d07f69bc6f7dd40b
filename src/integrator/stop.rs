//! When a rendering ends before it is done.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::observe::{Event, Observer};

/// The conditions that end a rendering before it is done: a flag that somebody sets, a time that passes, a number of
/// rays.
#[derive(Clone, Copy, Debug)]
pub struct Stop<'a> {
    flag: Option<&'a AtomicBool>,
    deadline: Option<Instant>,
    most_rays: u64,
}

impl<'a> Stop<'a> {
    /// Nothing does.
    pub const NEVER: Stop<'static> = Stop { flag: None, deadline: None, most_rays: u64::MAX };

    /// A flag.
    pub const fn at(flag: &'a AtomicBool) -> Self {
        Stop { flag: Some(flag), ..Stop::NEVER }
    }

    /// The first tile that takes more rays. Where a tile ends then is the same on every machine.
    pub const fn after_rays(most_rays: u64) -> Self {
        Stop { most_rays, ..Stop::NEVER }
    }

    /// A number of rays of a tile, too.
    pub const fn or_after_rays(self, most_rays: u64) -> Self {
        Stop { most_rays, ..self }
    }

    /// A moment, too.
    pub const fn with_deadline(self, deadline: Option<Instant>) -> Self {
        Stop { deadline, ..self }
    }

    /// True if the flag is set or the time is over.
    pub fn is_set(&self) -> bool {
        self.flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// Looks at nothing but when to stop, while a tile is rendered.
pub struct Watch<'a> {
    stop: &'a Stop<'a>,
    /// True if it was stopped, so that the tile is not whole.
    pub stopped: bool,
}

impl<'a> Watch<'a> {
    /// For one tile.
    pub fn new(stop: &'a Stop<'a>) -> Self {
        Self { stop, stopped: false }
    }
}

impl Observer for Watch<'_> {
    fn is_active(&self) -> bool {
        false
    }
    fn report(&mut self, _: &Event) {}
    fn stops(&mut self, rays: u64) -> bool {
        self.stopped = self.stopped || rays > self.stop.most_rays || self.stop.is_set();
        self.stopped
    }
}
