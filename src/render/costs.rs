//! The cost of pixels: the work of their samples' rays, and the time of their samples.

use std::ops::Range;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::Session;
use super::passes::take_worker;
use super::session::lock;
use crate::film::{FilmChannel, Region, Values};
use crate::integrator::observe::visits::VisitCounter;
use crate::integrator::observe::{Event, EventKind, FnObserver, NoObserver};
use crate::integrator::reuse::probe::plain;
use crate::integrator::schedule::recursive::Recursion;
use crate::integrator::{RayStatistics, Work};
use crate::world::Aov;

/// The work of a pixel's rays. Photons and the connecting rays of path reuse belong to no pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelCost {
    /// Visited nodes of camera rays, of the other rays of paths, of shadow rays.
    pub nodes: [u64; 3],
    /// Tests of triangles and spheres by the same kinds of rays.
    pub tests: [u64; 3],
    /// The number of rays without shadow rays.
    pub path_rays: u64,
}

impl PixelCost {
    fn add(&mut self, other: &PixelCost) {
        for kind in 0..3 {
            self.nodes[kind] += other.nodes[kind];
            self.tests[kind] += other.tests[kind];
        }
        self.path_rays += other.path_rays;
    }
}

/// Returns the channels of a cost: the means over a pixel's samples.
pub fn cost_channels(aov: Aov, costs: &[PixelCost], samples: u32) -> Vec<FilmChannel> {
    let channel = |name: &'static str, sum: &dyn Fn(&PixelCost) -> u64| {
        let mean = |cost| (sum(cost) as f64 / f64::from(samples.max(1))) as f32;
        FilmChannel { name: name.into(), values: Values::Float(costs.iter().map(mean).collect()) }
    };
    match aov {
        Aov::Nodes => vec![
            channel("nodes.camera", &|cost| cost.nodes[0]),
            channel("nodes.path", &|cost| cost.nodes[1]),
            channel("nodes.shadow", &|cost| cost.nodes[2]),
        ],
        Aov::Tests => vec![
            channel("tests.camera", &|cost| cost.tests[0]),
            channel("tests.path", &|cost| cost.tests[1]),
            channel("tests.shadow", &|cost| cost.tests[2]),
        ],
        Aov::PathLength => vec![channel("path-length", &|cost| cost.path_rays)],
        _ => Vec::new(),
    }
}

impl Session {
    /// Renders the samples of [`Session::features`] again and returns the sums of their work, row by row.
    #[doc(hidden)]
    pub fn costs(&self) -> Vec<PixelCost> {
        self.sums(PixelCost::add, |work, tile, samples| self.costs_of_tile(work, tile, samples))
    }

    /// Renders the same samples again, path by path and without path reuse; returns the mean time of a sample in
    /// microseconds, row by row. Other load on the machine can only add time, so the lesser of two measurements counts.
    pub(crate) fn microseconds(&self) -> Vec<f32> {
        let times = self.sums(|sum, more: &Duration| *sum += *more, times_of_tile);
        let samples = f64::from(self.samples_of_layers().count());
        times.iter().map(|time| (time.as_secs_f64() * 1e6 / samples) as f32).collect()
    }

    /// Returns the sums over all samples of what a function returns for the pixels of tiles.
    fn sums<T: Clone + Default + Send>(
        &self,
        add: impl Fn(&mut T, &T) + Sync,
        of_tile: impl Fn(Work, Region, Range<u32>) -> Vec<T> + Sync,
    ) -> Vec<T> {
        let region = self.film().region();
        let sums = Mutex::new(vec![T::default(); region.area()]);
        for range in self.samples_of_layers().iter() {
            self.for_samples(&self.prepared(), range, &mut |work, samples, _| {
                self.tiles().into_par_iter().for_each(|tile| {
                    let found = of_tile(work, tile, samples.clone());
                    let width = (tile.width() as usize).max(1);
                    let mut sums = lock(&sums);
                    for (y, row) in (tile.y0..tile.y1).zip(found.chunks(width)) {
                        let start = region.index(tile.x0, y);
                        sums[start..start + width].iter_mut().zip(row).for_each(|(sum, more)| add(sum, more));
                    }
                });
            });
        }
        sums.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn costs_of_tile(&self, work: Work, tile: Region, samples: Range<u32>) -> Vec<PixelCost> {
        let mut costs = vec![PixelCost::default(); tile.area()];
        let mut counter = VisitCounter::new(&work.setup.scene.bvh);
        let mut worker = take_worker(&self.workers, &self.setup, &self.options);
        let mut look = |event: &Event| {
            let Event::Sample(place, what) = event else { return };
            let Some(visits) = counter.of(what) else { return };
            let kind = match what {
                EventKind::Ray { .. } => usize::from(place.depth > 0),
                _ => 2,
            };
            let (x, y) = place.pixel;
            let cost = &mut costs[tile.index(x, y)];
            cost.nodes[kind] += visits.nodes;
            cost.tests[kind] += visits.primitives;
            cost.path_rays += u64::from(kind < 2);
        };
        worker.observe(work, tile, samples, &mut RayStatistics::default(), &mut FnObserver(&mut look));
        lock(&self.workers).push(worker);
        costs
    }
}

/// The times of a tile's pixels. The clock is read twice for all samples of a pixel; photons that it sees directly are
/// not drawn.
fn times_of_tile(work: Work, tile: Region, samples: Range<u32>) -> Vec<Duration> {
    let setup = &plain(work.setup);
    let work = Work { setup, pilot: None, ..work };
    let mut recursion = Recursion::new(setup);
    let mut times = vec![Duration::MAX; tile.area()];
    // The second measurement of a pixel comes after all others, so that the first does not fill the caches for it.
    for _ in 0..2 {
        for y in tile.y0..tile.y1 {
            for x in tile.x0..tile.x1 {
                let mut film = setup.film(Region { x0: x, y0: y, x1: x + 1, y1: y + 1 });
                let (start, mut ignored) = (Instant::now(), RayStatistics::default());
                recursion.render(work, &mut film, samples.clone(), &mut ignored, &mut NoObserver);
                let time = &mut times[tile.index(x, y)];
                *time = start.elapsed().min(*time);
            }
        }
    }
    times
}
