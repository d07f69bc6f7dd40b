//! One pass of a render: tiles are distributed to workers, with the photons of the pass's samples.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::options::Options;
use super::prepare::Prepared;
use super::render_state::{RenderPass, RenderState};
use super::session::{OnProgress, Progress, Session, lock, tiles};
use super::{Isa, adaptive, photons};
use crate::film::{Film, Moments, Region, SampleRanges};
use crate::integrator::photons::{PhotonMaps, SamplePhotons};
use crate::integrator::{RayStatistics, RenderSetup, Stop, Work, Worker};

impl Session {
    /// Renders the next samples of a pass; returns their number, or 0 if stopped.
    pub(super) fn advance_pass(
        &mut self,
        pass: RenderPass,
        stop: &Stop,
        pause: &AtomicBool,
        progress: OnProgress,
    ) -> u32 {
        let region = self.gathered.film.region();
        let (samples, all) = (pass.samples.clone(), pass.blocks.is_none());
        let counts_rays = self.rounds().is_some() || self.is_pilot;
        let by_block = counts_rays || !all;
        if counts_rays {
            let blocks = adaptive::blocks(region).len();
            self.gathered.rays.get_or_insert_with(|| vec![0; blocks]);
        }
        let todo = tiles(region, pass.tile.max(1)).into_iter().enumerate();
        let todo: Vec<_> = todo
            .filter(|(number, _)| !pass.done[*number])
            .map(|(number, tile)| (number, pass.parts(region, tile, by_block)))
            .collect();
        self.gathered.pass = Some(pass);
        let photons = self.photons(self.prepared.as_deref(), samples.clone(), stop);
        let Some((of_samples, of_photons)) = photons else { return 0 };
        self.statistics.add(&of_photons);
        let (setup, options, workers) = (&self.setup, &self.options, &self.workers);
        let work = work(setup, self.prepared.as_deref(), (samples.start, &of_samples), options.isa);
        let (gathered, statistics) = (Mutex::new(&mut self.gathered), Mutex::new(&mut self.statistics));
        todo.into_par_iter().for_each(|(number, parts)| {
            if stop.is_set() || pause.load(Ordering::Relaxed) {
                return;
            }
            let mut worker = take_worker(workers, setup, options);
            let mut render = |part: Region| {
                let mut own = RayStatistics::default();
                let mut moments = options.variance.then(|| Moments::new(part));
                let todo = (part, samples.clone());
                let film = match &mut moments {
                    None => worker.render_until(work, todo, &mut own, stop),
                    Some(squares) => one_by_one(&mut worker, work, todo, &mut own, squares, stop),
                };
                let samples = SampleRanges::default();
                Some((
                    RenderState { film: film?, moments, samples, pass: None, rays: None, allocation: None },
                    own,
                ))
            };
            let rendered: Option<Vec<(RenderState, RayStatistics)>> =
                parts.iter().map(|(_, part)| render(*part)).collect();
            lock(workers).push(worker);
            // Stopped: the tile is not marked as done and is rendered again as a whole.
            let Some(rendered) = rendered else { return };
            let mut guard = lock(&gathered);
            for ((block, _), (rendered, own)) in parts.iter().zip(&rendered) {
                guard.merge(rendered);
                let rays = block.zip(guard.rays.as_mut()).and_then(|(block, rays)| rays.get_mut(block));
                if let Some(rays) = rays.filter(|_| all) {
                    *rays += own.rays.total();
                }
                lock(&statistics).add(own);
            }
            if let Some(pass) = &mut guard.pass {
                pass.done[number] = true;
            }
            drop(guard);
            let pixels: usize = parts.iter().map(|(_, part)| part.area()).sum();
            let samples = pixels as u64 * samples.len() as u64;
            let rays = rendered.iter().map(|(_, own)| own.rays.total()).sum();
            progress(&Progress { samples, rays, look: &|look| look(&lock(&gathered)), pause });
        });
        let most = self.at_once();
        let Some(done) = self.gathered.pass.take_if(|pass| pass.done.iter().all(|done| *done)) else {
            return 0;
        };
        self.gathered.pass = done.next(most);
        let count = samples.len() as u32;
        // The film's counts show which rounds are done.
        if all || self.gathered.allocation.is_some() {
            self.gathered.samples.insert(samples);
        }
        count
    }

    /// Traces the photons of some samples, if there are any; returns them with their statistics. `None` if stopped.
    pub(super) fn photons(
        &self,
        prepared: Option<&Prepared>,
        samples: Range<u32>,
        stop: &Stop,
    ) -> Option<(Vec<SamplePhotons>, RayStatistics)> {
        let Some(plan) = prepared.and_then(|prepared| prepared.plan.as_ref().ok()) else {
            return Some(Default::default());
        };
        let all = Mutex::new(RayStatistics::default());
        let with = |trace: &mut dyn FnMut(&mut Worker, &mut RayStatistics)| {
            let mut worker = take_worker(&self.workers, &self.setup, &self.options);
            let mut own = RayStatistics::default();
            trace(&mut worker, &mut own);
            lock(&self.workers).push(worker);
            lock(&all).add(&own);
        };
        let traced = photons::trace(plan, samples, stop, &with)?;
        Some((traced, *lock(&all)))
    }
}

/// Returns a free worker, or creates one.
pub(super) fn take_worker(workers: &Mutex<Vec<Worker>>, setup: &RenderSetup, options: &Options) -> Worker {
    lock(workers).pop().unwrap_or_else(|| options.worker(setup))
}

/// Renders samples one by one: a sample may arrive in several parts, which are collected in a film of its own. `None`
/// if stopped.
fn one_by_one(
    worker: &mut Worker,
    work: Work,
    (tile, samples): (Region, Range<u32>),
    statistics: &mut RayStatistics,
    squares: &mut Moments,
    stop: &Stop,
) -> Option<Film> {
    let mut film = work.setup.film(tile);
    for sample in samples {
        let one = worker.render_until(work, (tile, sample..sample + 1), statistics, stop)?;
        squares.add_sample(&one);
        film.merge(&one);
    }
    Some(film)
}

/// The largest number of samples that are rendered together.
pub(super) fn at_once(prepared: Option<&Prepared>) -> u32 {
    let plan = prepared.and_then(|prepared| prepared.plan.as_ref().ok());
    plan.map_or(u32::MAX, photons::samples_at_once)
}

/// The input of workers.
pub(super) fn work<'a>(
    setup: &'a RenderSetup,
    prepared: Option<&'a Prepared>,
    (first, samples): (u32, &'a [SamplePhotons]),
    isa: Isa,
) -> Work<'a> {
    let plan = prepared.and_then(|prepared| prepared.plan.as_ref().ok()).filter(|_| !samples.is_empty());
    let photons = plan.map(|plan| PhotonMaps { plan, first, samples });
    Work { setup, pilot: prepared.and_then(|prepared| prepared.pilot.as_ref()), photons, isa }
}
