//! Renderings that are watched: what happens to a pixel's samples, and where the time goes.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::Session;
use super::session::{lock, work};
use crate::film::{Film, Region};
use crate::integrator::observe::{Event, Somebody, Timekeeper};
use crate::integrator::wavefront::Wave;
use crate::integrator::{Schedule, Stage, Statistics, Worker};

/// What a thread did and when, counted from the beginning.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// Which thread.
    pub thread: usize,
    /// Where in the image.
    pub tile: Region,
    /// Which stage of the wave; none for a whole tile of the recursive schedule.
    pub stage: Option<Stage>,
    /// When it began.
    pub start: Duration,
    /// When it ended.
    pub end: Duration,
}

impl Session {
    /// Renders all samples of the tile that a pixel lies in, or of all tiles in turn, while `look` is told what
    /// happens. Returns the film of the last tile; the session's own film stays as it is.
    pub(crate) fn observe(&self, pixel: Option<[u32; 2]>, look: &mut dyn FnMut(&Event)) -> Film {
        let (frame, options, prepared) = (&self.frame, &self.options, self.prepared());
        let work = work(frame, Some(&prepared), options.level);
        let mut worker = Worker::new(frame, options.schedule, options.wave, options.sorting);
        let mut film = Film::new(Region { x0: 0, y0: 0, x1: 0, y1: 0 }, frame.unit);
        for tile in self.tiles() {
            let holds = |[x, y]: [u32; 2]| (tile.x0..tile.x1).contains(&x) && (tile.y0..tile.y1).contains(&y);
            if pixel.is_none_or(holds) {
                let (samples, mut ignored) = (self.wanted.clone(), Statistics::default());
                let mut observer = Somebody(&mut *look);
                film = worker.observe(work, tile, samples, &mut ignored, &mut observer);
            }
        }
        film
    }

    /// Renders all samples, tile by tile and on this thread, in the wavefront schedule; `mark` is
    /// called at the end of each stage.
    pub(crate) fn time_stages(&self, mark: &mut dyn FnMut(Stage)) {
        let (frame, options, prepared) = (&self.frame, &self.options, self.prepared());
        let work = work(frame, Some(&prepared), options.level);
        let mut wave = Wave::new(frame, options.wave, options.sorting);
        let mut ignored = Statistics::default();
        for tile in self.tiles() {
            let (mut film, samples) = (Film::new(tile, frame.unit), self.wanted.clone());
            let mut observer = Timekeeper(&mut *mark);
            wave.render(work, &mut film, samples, &mut ignored, &mut observer);
        }
    }

    /// Renders all samples on all threads and says when each thread did what.
    pub(crate) fn spans(&self) -> Vec<Span> {
        let (frame, options, prepared) = (&self.frame, &self.options, self.prepared());
        let (work, start) = (work(frame, Some(&prepared), options.level), Instant::now());
        let spans = Mutex::new(Vec::new());
        self.tiles().into_par_iter().for_each(|tile| {
            let thread = rayon::current_thread_index().unwrap_or(0);
            let mut own = Vec::new();
            let (mut last, samples, mut ignored) =
                (start.elapsed(), self.wanted.clone(), Statistics::default());
            match options.schedule {
                Schedule::Wavefront => {
                    let mut observer = Timekeeper(|stage| {
                        let end = start.elapsed();
                        own.push(Span { thread, tile, stage: Some(stage), start: last, end });
                        last = end;
                    });
                    let (mut wave, mut film) =
                        (Wave::new(frame, options.wave, options.sorting), Film::new(tile, frame.unit));
                    wave.render(work, &mut film, samples, &mut ignored, &mut observer);
                }
                Schedule::Recursive => {
                    let mut worker = Worker::new(frame, options.schedule, options.wave, options.sorting);
                    worker.render(work, tile, samples, &mut ignored);
                    own.push(Span { thread, tile, stage: None, start: last, end: start.elapsed() });
                }
            }
            lock(&spans).append(&mut own);
        });
        spans.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
