//! The early end of a rendering.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::{Event, Observer};

/// The conditions that end a rendering early: a flag, a deadline, a number of rays.
#[derive(Clone, Copy, Debug)]
pub struct Stop<'a> {
    flag: Option<&'a AtomicBool>,
    deadline: Option<Instant>,
    most_rays: u64,
}

impl<'a> Stop<'a> {
    /// Never stops.
    pub const NEVER: Stop<'static> = Stop { flag: None, deadline: None, most_rays: u64::MAX };

    /// Stops when a flag is set.
    pub const fn at(flag: &'a AtomicBool) -> Self {
        Stop { flag: Some(flag), ..Stop::NEVER }
    }

    /// Stops at the first tile that takes more rays, in the same place within the tile on every machine.
    pub const fn after_rays(most_rays: u64) -> Self {
        Stop { most_rays, ..Stop::NEVER }
    }

    /// Adds a limit on the rays of a tile.
    pub const fn or_after_rays(self, most_rays: u64) -> Self {
        Stop { most_rays, ..self }
    }

    /// Adds a deadline, if any.
    pub const fn with_deadline(self, deadline: Option<Instant>) -> Self {
        Stop { deadline, ..self }
    }

    /// True if the flag is set or the deadline has passed.
    pub fn is_set(&self) -> bool {
        self.flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// An observer that only checks for the stop while a tile is rendered.
pub struct Watch<'a> {
    stop: &'a Stop<'a>,
    /// True if the rendering was stopped, so that the tile is incomplete.
    pub stopped: bool,
}

impl<'a> Watch<'a> {
    /// Creates the observer of one tile.
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
