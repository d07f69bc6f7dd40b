//! Observed renders: the events of a pixel's samples, and the time of each stage.

use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::Session;
use super::passes::{at_once, work};
use super::prepare::Prepared;
use super::session::lock;
use crate::film::{Film, Region};
use crate::integrator::observe::{Event, Flow, FnObserver, NoObserver, Observer, Timekeeper};
use crate::integrator::photons::PhotonMaps;
use crate::integrator::{RayStatistics, Schedule, Stage, Stop, Work};

/// A span of a thread's time, counted from the start of the render.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// The thread's number; 0 for photons, which are traced on all threads.
    pub thread: usize,
    /// The tile; the whole region for photons.
    pub tile: Region,
    /// The stage of the wave; `None` for a whole tile of the recursive schedule.
    pub stage: Option<Stage>,
    /// The number of items that entered the stage; 0 if it has none.
    pub items: usize,
    /// The start time.
    pub start: Duration,
    /// The end time.
    pub end: Duration,
}

impl Session {
    /// Calls `render` for some samples, part by part: with the work, the part, and the statistics of its photons.
    pub(super) fn for_samples(
        &self,
        prepared: &Prepared,
        wanted: Range<u32>,
        render: &mut dyn FnMut(Work, Range<u32>, &RayStatistics),
    ) {
        let mut start = wanted.start;
        while start < wanted.end {
            let samples = start..wanted.end.min(start.saturating_add(at_once(Some(prepared))));
            let (photons, took) =
                self.photons(Some(prepared), samples.clone(), &Stop::NEVER).unwrap_or_default();
            render(
                work(&self.setup, Some(prepared), (start, &photons), self.options.isa),
                samples.clone(),
                &took,
            );
            start = samples.end;
        }
    }

    /// Calls `look` for each of the film's samples in each of some pixels: with the sample's number, the pixel's place
    /// in the list, and the luminance.
    pub(crate) fn each_sample_of(&self, pixels: &[[u32; 2]], look: &mut dyn FnMut(u32, usize, f32)) {
        let (setup, options, prepared) = (&self.setup, &self.options, self.prepared());
        let mut worker = options.worker(setup);
        for range in self.gathered.samples.iter() {
            self.for_samples(&prepared, range, &mut |work, samples, _| {
                for sample in samples {
                    for (which, [x, y]) in pixels.iter().enumerate() {
                        let pixel = Region { x0: *x, y0: *y, x1: x + 1, y1: y + 1 };
                        let film =
                            worker.render(work, pixel, sample..sample + 1, &mut RayStatistics::default());
                        look(sample, which, film.radiance().first().map_or(0.0, |light| light.luminance()));
                    }
                }
            });
        }
    }

    /// Renders all samples of the tile that contains a pixel, or of all tiles in turn, and reports events to `look`.
    /// Returns the film of the last tile; the session's own film is unchanged.
    pub(crate) fn observe(&self, pixel: Option<[u32; 2]>, look: &mut dyn FnMut(&Event)) -> Film {
        self.observe_by(pixel, &mut FnObserver(look))
    }

    /// Does the same with an observer, which may stop it; the film is useless then.
    pub(crate) fn observe_by(&self, pixel: Option<[u32; 2]>, observer: &mut dyn Observer) -> Film {
        let (setup, options) = (&self.setup, &self.options);
        let mut worker = options.worker(setup);
        let mut tiles = self.tiles();
        tiles.retain(|tile| {
            let holds = |[x, y]: [u32; 2]| (tile.x0..tile.x1).contains(&x) && (tile.y0..tile.y1).contains(&y);
            pixel.is_none_or(holds)
        });
        let last = tiles.last().copied().unwrap_or(Region { x0: 0, y0: 0, x1: 0, y1: 0 });
        let mut film = setup.film(last);
        self.for_samples(&self.prepared(), self.wanted.clone(), &mut |work, samples, took| {
            if let Some(photons) = work.photons {
                observer.report(&Event::Wave(flow_of_photons(&photons, took)));
            }
            for tile in &tiles {
                let mut ignored = RayStatistics::default();
                let rendered = worker.observe(work, *tile, samples.clone(), &mut ignored, &mut *observer);
                if *tile == last {
                    film.merge(&rendered);
                }
            }
        });
        film
    }

    /// Renders all samples, tile by tile and on this thread, with the wavefront schedule; calls `mark` at the end of
    /// each stage. All work on photons is one stage.
    pub(crate) fn time_stages(&self, mark: &mut dyn FnMut(Stage)) {
        let (setup, options) = (&self.setup, &self.options);
        let mut wave = options.queues(setup);
        let mut ignored = RayStatistics::default();
        self.for_samples(&self.prepared(), self.wanted.clone(), &mut |work, samples, _| {
            if work.photons.is_some() {
                mark(Stage::Photons);
            }
            for tile in self.tiles() {
                let mut film = setup.film(tile);
                let mut observer = Timekeeper(|stage, _| mark(stage));
                wave.render(work, &mut film, samples.clone(), &mut ignored, &mut observer);
                if let Some(photons) = work.photons {
                    photons.draw(setup, &mut film, samples.clone(), &mut NoObserver);
                    mark(Stage::Photons);
                }
            }
        });
    }

    /// Renders all samples on all threads and returns the spans of each thread.
    pub(crate) fn spans(&self) -> Vec<Span> {
        let start = Instant::now();
        let (spans, mut last) = (Mutex::new(Vec::new()), Duration::ZERO);
        self.for_samples(&self.prepared(), self.wanted.clone(), &mut |work, samples, _| {
            if work.photons.is_some() {
                let (tile, stage, end) = (self.gathered.film.region(), Some(Stage::Photons), start.elapsed());
                lock(&spans).push(Span { thread: 0, tile, stage, items: 0, start: last, end });
            }
            self.add_spans(work, &samples, start, &spans);
            last = start.elapsed();
        });
        spans.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn add_spans(&self, work: Work, samples: &Range<u32>, start: Instant, spans: &Mutex<Vec<Span>>) {
        let (setup, options) = (&self.setup, &self.options);
        self.tiles().into_par_iter().for_each(|tile| {
            let thread = rayon::current_thread_index().unwrap_or(0);
            let mut own = Vec::new();
            let (mut last, samples, mut ignored) =
                (start.elapsed(), samples.clone(), RayStatistics::default());
            match options.schedule {
                Schedule::Wavefront => {
                    let mut observer = Timekeeper(|stage, items| {
                        let end = start.elapsed();
                        own.push(Span { thread, tile, stage: Some(stage), items, start: last, end });
                        last = end;
                    });
                    let (mut wave, mut film) = (options.queues(setup), setup.film(tile));
                    wave.render(work, &mut film, samples, &mut ignored, &mut observer);
                }
                Schedule::Recursive => {
                    let mut worker = options.worker(setup);
                    worker.render(work, tile, samples, &mut ignored);
                    own.push(Span { thread, tile, stage: None, items: 0, start: last, end: start.elapsed() });
                }
            }
            lock(spans).append(&mut own);
        });
    }
}

/// Describes the photons of some samples as a stage: their rays enter, and those that have ended on a surface leave.
fn flow_of_photons(photons: &PhotonMaps, took: &RayStatistics) -> Flow {
    let leaving = photons.samples.iter().map(|of_sample| of_sample.map.count()).sum();
    let entering = took.rays.photon as usize;
    Flow { stage: Stage::Photons, entering, leaving, capacity: 0, width: 0, lanes: [0; 17] }
}
