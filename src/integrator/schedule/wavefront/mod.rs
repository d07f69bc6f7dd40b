//! The wavefront schedule, breadth first: a wave of paths goes through one stage after another, each a kernel over
//! queues. Forks and new samples fill the places of paths that have ended, so that lanes stay full at any depth.
//!
//! ```text
//! camera ─┐                              ┌─ light ─> shadow ─> connect
//! pending ┼─> intersect ─> retire ─> shade ┼─ reflect ─┐
//!         │                              └─ refract ─┤
//!         └──────────────── advance <────────────────┘
//! ```

pub mod first_hits;
pub mod material_ranges;
mod path_stages;
mod photons;
pub mod queue;
mod reports;
mod reuse;
pub mod shadow_queue;
mod shadows;
mod stages;
pub mod vertices;
pub mod wave;

use std::ops::Range;
use std::time::Instant;
use wave::{SampleCursor, StageClock, Wave};

use crate::bvh::{self, Coherence};
use crate::film::Film;
use crate::integrator::observe::Observer;
use crate::integrator::path::unpack_pixel;
use crate::integrator::photons::PhotonMaps;
use crate::integrator::reuse::Sink;
use crate::integrator::transport::unseen_lamps;
use crate::integrator::{RayStatistics, RenderSetup, Stage, Work};
use crate::math::Rgb;
use crate::simd::{Isa, dispatch};
use crate::world::Transport;
use path_stages::{FindLampsStage, ShadePathsStage};
use queue::PathAnyHit;
use stages::{GenerateStage, LightStage, RetireStage, ShadeStage};

impl Wave {
    /// Renders a range of samples of all the film's pixels.
    pub fn render(
        &mut self,
        work: Work,
        film: &mut Film,
        samples: Range<u32>,
        statistics: &mut RayStatistics,
        observer: &mut dyn Observer,
    ) {
        let clock = &mut StageClock { statistics, last: Instant::now(), observer };
        if work.setup.sharing.is_some() {
            return self.render_shared(work, film, samples, clock);
        }
        let todo = SampleCursor::new(film.region(), samples, work.photons.is_some(), &|_, _| true);
        self.render_todo(work, film, todo, clock);
    }

    /// Renders samples of pixels without path reuse.
    fn render_todo(&mut self, work: Work, film: &mut Film, mut todo: SampleCursor, clock: &mut StageClock) {
        let Work { setup, photons, isa, .. } = work;
        while !self.is_stopped(clock) {
            self.generate(setup, isa, film, &mut todo, clock);
            if self.paths.columns.is_empty() {
                return;
            }
            self.intersect(setup, isa, clock);
            self.find_lamps(setup, photons, isa, clock);
            self.retire(setup, photons, isa, Some(film), clock);
            match setup.transport {
                Transport::Whitted => {
                    self.shade(setup, photons, isa, clock);
                    self.report_vertices(isa, clock.observer);
                    self.lights(setup, isa, film, clock);
                }
                Transport::Path => {
                    self.shade_paths(setup, photons, isa, false, clock);
                    self.report_paths(setup, photons, isa, clock.observer);
                    self.shadows(setup, isa, Some(film), clock);
                }
            }
            film.take_groups(&mut self.found);
            self.report_ends(clock.observer);
            self.advance(film, clock);
        }
    }

    /// True if the tile is to be stopped; all paths are dropped then.
    fn is_stopped(&mut self, clock: &mut StageClock) -> bool {
        let stops = clock.observer.stops(clock.statistics.rays.total());
        if stops {
            self.paths.columns.clear();
            self.pending.columns.clear();
            self.alone.columns.clear();
        }
        stops
    }

    /// Finds the closest hits of the wave's paths.
    fn intersect(&mut self, setup: &RenderSetup, isa: Isa, clock: &mut StageClock) {
        let count = self.paths.columns.len();
        let surfaces = PathAnyHit { setup, paths: &self.paths };
        let rays = self.paths.rays(&self.ends, &surfaces);
        let (bvh, hits) = (&setup.scene.bvh, self.hits.columns(count));
        bvh::closest(self.traversal.unwrap_or(isa), bvh, rays, Coherence::Unknown, &mut self.stack, hits);
        clock.stage(Stage::Intersect, count);
        self.report_hits(isa, clock.observer);
    }

    /// Adds the light of the unseen lamps before the hits.
    fn find_lamps(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        clock: &mut StageClock,
    ) {
        if !unseen_lamps::exist(setup) {
            return;
        }
        let Self { paths, hits, found, .. } = self;
        dispatch(isa, FindLampsStage { setup, photons, paths, hits, found });
        self.report_lamps(setup, photons, clock.observer);
        clock.stage(Stage::Intersect, 0);
    }

    /// Removes paths that have hit nothing from the wave; without a sink their radiance is dropped.
    fn retire(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        sink: Option<&mut (dyn Sink + '_)>,
        clock: &mut StageClock,
    ) {
        let Self { paths, hits, found, .. } = self;
        let (count, observer) = (paths.columns.len(), &mut *clock.observer);
        dispatch(isa, RetireStage { setup, photons, paths, hits, sink, observer, found });
        clock.stage(Stage::Retire, count);
    }

    /// Generates new samples in the free places of the wave.
    fn generate(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        film: &mut Film,
        todo: &mut SampleCursor,
        clock: &mut StageClock,
    ) {
        let room = self.paths.columns.room();
        let count = todo.next_batch(&mut self.pixels[..room], &mut self.samples[..room]);
        for (pixel, sample) in self.pixels[..count].iter().zip(&self.samples) {
            let (x, y) = unpack_pixel(*pixel);
            film.count(x, y, *sample);
        }
        self.begin(setup, isa, count, clock);
    }

    /// Generates the camera's paths for the first `count` pixels and samples.
    fn begin(&mut self, setup: &RenderSetup, isa: Isa, count: usize, clock: &mut StageClock) {
        let (pixels, samples) = (&self.pixels, &self.samples);
        dispatch(isa, GenerateStage { setup, pixels, samples, count, out: &mut self.paths });
        clock.statistics.rays.camera += count as u64;
        clock.stage(Stage::Generate, count);
    }

    fn shade(&mut self, setup: &RenderSetup, photons: Option<PhotonMaps>, isa: Isa, clock: &mut StageClock) {
        let stage = ShadeStage {
            setup,
            photons,
            paths: &mut self.paths,
            hits: &self.hits,
            vertices: &mut self.vertices,
            goes_on: &mut self.goes_on,
            reflect: &mut self.reflect,
            refract: &mut self.refract,
            found: &mut self.found,
        };
        dispatch(isa, stage);
        clock.statistics.rays.reflect += self.reflect.columns.len() as u64;
        clock.statistics.rays.refract += self.refract.columns.len() as u64;
        clock.stage(Stage::Shade, self.paths.columns.len());
    }

    /// Shades the path transport's vertices, material by material.
    fn shade_paths(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        asks: bool,
        clock: &mut StageClock,
    ) {
        self.groups.sort(self.hits.materials(self.paths.columns.len()));
        let stage = ShadePathsStage {
            setup,
            photons,
            paths: &mut self.paths,
            hits: &self.hits,
            groups: &self.groups,
            goes_on: &mut self.goes_on,
            next: &mut self.reflect,
            forks: &mut self.refract,
            shadow: &mut self.shadow,
            roles: asks.then_some(&mut self.roles),
            found: &mut self.found,
        };
        dispatch(isa, stage);
        clock.statistics.rays.scatter += self.reflect.columns.len() as u64;
        clock.statistics.rays.refract += self.refract.columns.len() as u64;
        clock.stage(Stage::Shade, self.paths.columns.len());
    }

    /// Traces all samples of all lights, light by light, as many in one shadow wave as fit. Many lights may take long,
    /// so this may be stopped, too.
    fn lights(&mut self, setup: &RenderSetup, isa: Isa, film: &mut Film, clock: &mut StageClock) {
        for light in 0..setup.scene.lights.len() {
            for which in 0..setup.scene.lights[light].samples {
                if self.shadow.room() < self.paths.columns.len() {
                    self.shadows(setup, isa, Some(film), clock);
                    if clock.observer.stops(clock.statistics.rays.total()) {
                        return;
                    }
                }
                let before = self.shadow.count();
                let (paths, vertices, out) = (&self.paths, &self.vertices, &mut self.shadow);
                dispatch(isa, LightStage { setup, paths, vertices, light, which, out });
                clock.stage(Stage::Light, self.paths.columns.len());
                self.report_lights(isa, light, which, before, clock.observer);
            }
        }
        self.shadows(setup, isa, Some(film), clock);
    }

    /// Moves finished paths to the film, and the others with their radiance to the next wave.
    fn advance(&mut self, sink: &mut dyn Sink, clock: &mut StageClock) {
        let (pixels, samples) = self.paths.pixels();
        let [r, g, b] = self.paths.radiance();
        let count = pixels.len();
        for i in 0..count {
            if self.goes_on[i] == 0 {
                sink.deposit(pixels[i], samples[i], Rgb::new(r[i], g[i], b[i]));
            }
        }
        self.reflect.inherit(&self.paths);
        self.refract.inherit(&self.paths);
        self.paths.columns.clear();
        self.paths.fill_from(&mut self.reflect);
        self.paths.fill_from(&mut self.refract);
        clock.statistics.spilled += self.refract.columns.len() as u64;
        self.pending.spill_from(&mut self.refract);
        self.paths.fill_from(&mut self.pending);
        clock.stage(Stage::Advance, count);
    }
}
