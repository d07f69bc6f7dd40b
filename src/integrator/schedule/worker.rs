//! Workers, which render tiles: the buffers of a thread, under one of the two schedules.

use std::ops::Range;

use super::work::{Schedule, Sorting, Work};
use super::{recursive, wavefront};
use crate::film::{Film, Region};
use crate::integrator::observe::statistics::RayStatistics;
use crate::integrator::observe::stop::{Stop, Watch};
use crate::integrator::observe::{NoObserver, Observer};
use crate::integrator::photons::{LandedPhotons, PhotonPlan};
use crate::integrator::setup::RenderSetup;
use crate::simd::Isa;

/// A worker's buffers, allocated once and used for tile after tile.
pub enum Worker {
    /// The buffers for [`Schedule::Wavefront`].
    Wavefront(Box<wavefront::wave::Wave>),
    /// The buffers for [`Schedule::Recursive`].
    Recursive(Box<recursive::Recursion>),
}

impl Worker {
    /// Creates buffers for waves of `wave` paths, or for single paths.
    pub fn new(setup: &RenderSetup, schedule: Schedule, wave: usize, sorting: Sorting) -> Self {
        match schedule {
            Schedule::Wavefront => {
                Worker::Wavefront(Box::new(wavefront::wave::Wave::new(setup, wave, sorting)))
            }
            Schedule::Recursive => Worker::Recursive(Box::new(recursive::Recursion::new(setup))),
        }
    }

    /// Traces a wave's rays with another instruction set than that of its stages.
    pub fn with_traversal(self, traversal: Option<Isa>) -> Self {
        match self {
            Worker::Wavefront(wave) => Worker::Wavefront(Box::new(wave.with_traversal(traversal))),
            Worker::Recursive(recursion) => Worker::Recursive(recursion),
        }
    }

    /// Traces some of a sample's photons, by their numbers. The result is meaningless if it is stopped.
    pub fn trace_photons(
        &mut self,
        plan: &PhotonPlan,
        isa: Isa,
        sample: u32,
        numbers: Range<u32>,
        statistics: &mut RayStatistics,
        stop: &Stop,
    ) -> LandedPhotons {
        let mut landed = LandedPhotons::default();
        let (watch, todo) = (&mut Watch::new(stop), (sample, numbers));
        match self {
            Worker::Wavefront(wave) => wave.trace_photons(plan, isa, todo, &mut landed, statistics, watch),
            Worker::Recursive(recursion) => {
                recursion.trace_photons(plan, isa, todo, &mut landed, statistics, watch);
            }
        }
        landed.sort();
        landed
    }

    /// Renders a range of samples of a tile into a film of its own.
    pub fn render(
        &mut self,
        work: Work,
        tile: Region,
        samples: Range<u32>,
        statistics: &mut RayStatistics,
    ) -> Film {
        self.observe(work, tile, samples, statistics, &mut NoObserver)
    }

    /// Renders like [`Worker::render`]; returns none if stopped before the tile is complete.
    pub fn render_until(
        &mut self,
        work: Work,
        (tile, samples): (Region, Range<u32>),
        statistics: &mut RayStatistics,
        stop: &Stop,
    ) -> Option<Film> {
        let mut watch = Watch::new(stop);
        let film = self.observe(work, tile, samples, statistics, &mut watch);
        (!watch.stopped).then_some(film)
    }

    /// Renders like [`Worker::render`], with an observer.
    pub fn observe(
        &mut self,
        work: Work,
        tile: Region,
        samples: Range<u32>,
        statistics: &mut RayStatistics,
        observer: &mut dyn Observer,
    ) -> Film {
        let mut film = work.setup.film(tile);
        match self {
            Worker::Wavefront(wave) => wave.render(work, &mut film, samples.clone(), statistics, observer),
            Worker::Recursive(recursion) => {
                recursion.render(work, &mut film, samples.clone(), statistics, observer);
            }
        }
        if let Some(photons) = work.photons {
            photons.draw(work.setup, &mut film, samples, observer);
        }
        film
    }
}
