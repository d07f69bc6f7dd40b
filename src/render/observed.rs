//! Renderings that are watched: what happens to a pixel's samples, and where the time goes.

use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::Session;
use super::passes::{at_once, work};
use super::session::lock;
use crate::film::{Film, Region};
use crate::integrator::observe::{Event, Somebody, Timekeeper};
use crate::integrator::wavefront::Wave;
use crate::integrator::{Schedule, Stage, Statistics, Stop, Work, Worker};

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
    /// Calls `render` with the work and a part of the samples, part by part.
    fn for_samples(&self, mut render: impl FnMut(Work, Range<u32>)) {
        let (prepared, end) = (self.prepared(), self.wanted.end);
        let mut start = self.wanted.start;
        while start < end {
            let samples = start..end.min(start.saturating_add(at_once(Some(&prepared))));
            let (photons, _) =
                self.photons(Some(&prepared), samples.clone(), &Stop::NEVER).unwrap_or_default();
            render(
                work(&self.frame, Some(&prepared), (start, &photons), self.options.level),
                samples.clone(),
            );
            start = samples.end;
        }
    }

    /// Renders all samples of the tile that a pixel lies in, or of all tiles in turn, while `look` is told what
    /// happens. Returns the film of the last tile; the session's own film stays as it is.
    pub(crate) fn observe(&self, pixel: Option<[u32; 2]>, look: &mut dyn FnMut(&Event)) -> Film {
        let (frame, options) = (&self.frame, &self.options);
        let mut worker = Worker::new(frame, options.schedule, options.wave, options.sorting);
        let mut film = Film::new(Region { x0: 0, y0: 0, x1: 0, y1: 0 }, frame.unit);
        for tile in self.tiles() {
            let holds = |[x, y]: [u32; 2]| (tile.x0..tile.x1).contains(&x) && (tile.y0..tile.y1).contains(&y);
            if pixel.is_none_or(holds) {
                film = Film::new(tile, frame.unit);
                self.for_samples(|work, samples| {
                    let (mut ignored, mut observer) = (Statistics::default(), Somebody(&mut *look));
                    film.merge(&worker.observe(work, tile, samples, &mut ignored, &mut observer));
                });
            }
        }
        film
    }

    /// Renders all samples, tile by tile and on this thread, in the wavefront schedule; `mark` is
    /// called at the end of each stage.
    pub(crate) fn time_stages(&self, mark: &mut dyn FnMut(Stage)) {
        let (frame, options) = (&self.frame, &self.options);
        let mut wave = Wave::new(frame, options.wave, options.sorting);
        let mut ignored = Statistics::default();
        self.for_samples(|work, samples| {
            for tile in self.tiles() {
                let mut film = Film::new(tile, frame.unit);
                let mut observer = Timekeeper(&mut *mark);
                wave.render(work, &mut film, samples.clone(), &mut ignored, &mut observer);
            }
        });
    }

    /// Renders all samples on all threads and says when each thread did what.
    pub(crate) fn spans(&self) -> Vec<Span> {
        let start = Instant::now();
        let spans = Mutex::new(Vec::new());
        self.for_samples(|work, samples| self.add_spans(work, &samples, start, &spans));
        spans.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn add_spans(&self, work: Work, samples: &Range<u32>, start: Instant, spans: &Mutex<Vec<Span>>) {
        let (frame, options) = (&self.frame, &self.options);
        self.tiles().into_par_iter().for_each(|tile| {
            let thread = rayon::current_thread_index().unwrap_or(0);
            let mut own = Vec::new();
            let (mut last, samples, mut ignored) = (start.elapsed(), samples.clone(), Statistics::default());
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
            lock(spans).append(&mut own);
        });
    }
}
