//! Photons as another set of queues: emit → intersect → scatter → shadow (to the camera) → land, with the kernels of
//! the camera's paths.

use std::num::Wrapping;
use std::ops::Range;
use std::time::Instant;

use super::path_stages::{EndQueue, PhotonStage};
use super::wave::{StageClock, Wave};
use crate::integrator::observe::Observer;
use crate::integrator::path::columns::Columns;
use crate::integrator::photons::map::Photon;
use crate::integrator::photons::splat::Splat;
use crate::integrator::photons::{LandedPhotons, PhotonPlan};
use crate::integrator::transport::photon_tracing;
use crate::integrator::{RayStatistics, Stage};
use crate::math::{Color, NONE, Vector};
use crate::simd::{Isa, dispatch};
use crate::world::Transport;

impl Wave {
    /// Traces some of a sample's photons, by their numbers.
    pub fn trace_photons(
        &mut self,
        plan: &PhotonPlan,
        isa: Isa,
        (sample, numbers): (u32, Range<u32>),
        landed: &mut LandedPhotons,
        statistics: &mut RayStatistics,
        observer: &mut dyn Observer,
    ) {
        let clock = &mut StageClock { statistics, last: Instant::now(), observer };
        let mut ended =
            self.ended.take().unwrap_or_else(|| EndQueue(Columns::new(self.paths.columns.capacity())));
        let mut numbers = numbers;
        while !self.is_stopped(clock) {
            self.emit(plan, sample, &mut numbers, clock);
            if self.paths.columns.is_empty() {
                break;
            }
            self.intersect(&plan.setup, isa, clock);
            self.retire(&plan.setup, None, isa, None, clock);
            self.scatter_photons(plan, isa, &mut ended, clock);
            self.shadows(&plan.setup, isa, None, clock);
            self.land(plan, sample, &mut ended, landed);
            self.paths.columns.clear();
            self.paths.fill_from(&mut self.reflect);
            self.paths.fill_from(&mut self.refract);
            self.pending.spill_from(&mut self.refract);
            self.paths.fill_from(&mut self.pending);
            clock.stage(Stage::Photons, self.paths.columns.len());
        }
        self.ended = Some(ended);
    }

    /// Emits new photons into the free places of the wave.
    fn emit(&mut self, plan: &PhotonPlan, sample: u32, numbers: &mut Range<u32>, clock: &mut StageClock) {
        let first = u64::from(sample) * u64::from(plan.count());
        let (scene, seed) = (&plan.setup.scene, plan.setup.seed);
        while self.paths.columns.room() > 0
            && let Some(number) = numbers.next()
        {
            if let Some(photon) = plan.emission.emit(scene, seed, first + u64::from(number)) {
                let path = photon_tracing::path(sample, number, &photon);
                self.paths.append::<f32>(true, &path, Wrapping(NONE));
            }
        }
        clock.statistics.rays.photon += self.paths.columns.len() as u64;
        clock.stage(Stage::Photons, self.paths.columns.len());
    }

    fn scatter_photons(&mut self, plan: &PhotonPlan, isa: Isa, ended: &mut EndQueue, clock: &mut StageClock) {
        if plan.setup.transport == Transport::Path {
            self.groups.sort(self.hits.materials(self.paths.columns.len()));
        }
        for column in self.paths.radiance_mut() {
            column.fill(0.0);
        }
        let stage = PhotonStage {
            plan,
            paths: &self.paths,
            hits: &self.hits,
            groups: &self.groups,
            next: &mut self.reflect,
            passed: &mut self.refract,
            shadow: &mut self.shadow,
            ended,
        };
        dispatch(isa, stage);
        clock.stage(Stage::Photons, self.paths.columns.len());
    }

    /// Collects the photons that have ended, with what has arrived at the camera.
    fn land(&mut self, plan: &PhotonPlan, sample: u32, ended: &mut EndQueue, landed: &mut LandedPhotons) {
        let [r, g, b] = self.paths.radiance();
        let queue = &ended.0;
        for i in 0..queue.len() {
            let vector = |first: usize| {
                let [x, y, z] = [0, 1, 2].map(|axis| queue.floats(first + axis)[i]);
                Vector::new(x, y, z)
            };
            let flux = [3, 4, 5].map(|column| queue.floats(column)[i]);
            let [number, bounces, density, from] = [0, 1, 2, 3].map(|column| queue.integers(column)[i]);
            let density = f32::from_bits(density);
            let photon = Photon::new(vector(0), flux, vector(6), vector(9), bounces, density);
            let from = from as usize;
            let [column, row] = [12, 13].map(|column| queue.floats(column)[i]);
            let light = Color::new(r[from], g[from], b[from]);
            landed.add(number, photon, Splat { column, row, light, group: plan.group_of(sample, number) });
        }
        ended.0.clear();
    }
}
