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
mod path_stages;
mod photons;
pub mod queue;
mod reports;
mod reuse;
pub mod shadows;
mod stages;
pub mod vertices;

use std::ops::Range;
use std::time::Instant;

use super::observe::Observer;
use super::path::{pack_pixel, unpack_pixel};
use super::photons::PhotonMaps;
use super::reuse::Sink;
use super::transparent_shadow::Crossings;
use super::{RayStatistics, RenderSetup, Sorting, Stage, Work};
use crate::bvh::{self, Coherence, Stack};
use crate::film::{Film, Region};
use crate::math::Rgb;
use crate::simd::{Isa, dispatch};
use crate::world::Transport;
use path_stages::{EndQueue, HitRoles, MaterialRanges, ShadePathsStage};
use queue::{Columns, HitQueue, PADDING, PathAnyHit, PathQueue, RayLimits};
use reuse::ReuseBuffers;
use shadows::ShadowQueue;
use stages::{GenerateStage, LightStage, RetireStage, ShadeStage};
use vertices::VertexQueue;

/// A worker's queues, allocated once.
pub struct Wave {
    /// Paths of the wave.
    paths: PathQueue,
    hits: HitQueue,
    vertices: VertexQueue,
    reflect: PathQueue,
    refract: PathQueue,
    shadow: ShadowQueue,
    /// Photons that have ended, if there may be any photons.
    ended: Option<EndQueue>,
    /// Forks without a place in the wave; last in, first out, so that the queue stays short.
    pending: PathQueue,
    /// Paths that are not reused; those that are go first.
    alone: PathQueue,
    goes_on: Vec<u32>,
    roles: HitRoles,
    shared: Option<ReuseBuffers>,
    occluded: Vec<u32>,
    crossings: Crossings,
    pixels: Vec<u32>,
    samples: Vec<u32>,
    groups: MaterialRanges,
    ends: RayLimits,
    stack: Stack,
}

impl Wave {
    /// Creates queues for waves of `capacity` paths, at least 1.
    pub fn new(setup: &RenderSetup, capacity: usize, sorting: Sorting) -> Self {
        let shared = setup.sharing.map(|_| ReuseBuffers::new(setup, capacity));
        // Reused paths go through the wave together.
        let capacity = shared.as_ref().map_or(capacity, ReuseBuffers::paths).max(1);
        let integers = || vec![0; capacity + PADDING];
        Self {
            paths: PathQueue::new(setup, capacity),
            hits: HitQueue(Columns::new(capacity)),
            vertices: VertexQueue(Columns::new(capacity)),
            reflect: PathQueue::new(setup, capacity),
            refract: PathQueue::new(setup, capacity),
            shadow: ShadowQueue::new(setup, capacity),
            ended: setup.photons.is_ok().then(|| EndQueue(Columns::new(capacity))),
            pending: PathQueue::new(setup, capacity),
            alone: PathQueue::new(setup, 0),
            goes_on: integers(),
            roles: if shared.is_some() { HitRoles::new(capacity) } else { HitRoles::default() },
            shared,
            occluded: integers(),
            crossings: Crossings::default(),
            pixels: integers(),
            samples: integers(),
            groups: MaterialRanges::new(capacity, setup.scene.materials.len(), sorting),
            ends: RayLimits::new(capacity + PADDING),
            stack: Stack::new(&setup.scene.bvh),
        }
    }

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
            self.retire(setup, photons, isa, Some(film), clock);
            match setup.transport {
                Transport::Whitted => {
                    self.shade(setup, photons, isa, clock);
                    self.report_vertices(isa, clock.observer);
                    self.lights(setup, isa, clock);
                }
                Transport::Path => {
                    self.shade_paths(setup, photons, isa, false, clock);
                    self.report_paths(setup, photons, isa, clock.observer);
                    self.shadows(setup, isa, clock);
                }
            }
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
        bvh::closest(isa, bvh, rays, Coherence::Unknown, &mut self.stack, hits);
        clock.stage(Stage::Intersect);
        self.report_hits(isa, clock.observer);
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
        let (paths, hits) = (&mut self.paths, &mut self.hits);
        dispatch(isa, RetireStage { setup, photons, paths, hits, sink, observer: &mut *clock.observer });
        clock.stage(Stage::Retire);
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
        clock.stage(Stage::Generate);
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
        };
        dispatch(isa, stage);
        clock.statistics.rays.reflect += self.reflect.columns.len() as u64;
        clock.statistics.rays.refract += self.refract.columns.len() as u64;
        clock.stage(Stage::Shade);
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
        };
        dispatch(isa, stage);
        clock.statistics.rays.scatter += self.reflect.columns.len() as u64;
        clock.statistics.rays.refract += self.refract.columns.len() as u64;
        clock.stage(Stage::Shade);
    }

    /// Traces all samples of all lights, light by light, as many in one shadow wave as fit. Many lights may take long,
    /// so this may be stopped, too.
    fn lights(&mut self, setup: &RenderSetup, isa: Isa, clock: &mut StageClock) {
        for light in 0..setup.scene.lights.len() {
            for which in 0..setup.scene.lights[light].samples {
                if self.shadow.room() < self.paths.columns.len() {
                    self.shadows(setup, isa, clock);
                    if clock.observer.stops(clock.statistics.rays.total()) {
                        return;
                    }
                }
                let before = self.shadow.count();
                let (paths, vertices, out) = (&self.paths, &self.vertices, &mut self.shadow);
                dispatch(isa, LightStage { setup, paths, vertices, light, which, out });
                clock.stage(Stage::Light);
                self.report_lights(isa, light, which, before, clock.observer);
            }
        }
        self.shadows(setup, isa, clock);
    }

    /// Moves finished paths to the film, and the others with their radiance to the next wave.
    fn advance(&mut self, sink: &mut dyn Sink, clock: &mut StageClock) {
        let (pixels, samples) = self.paths.pixels();
        let [r, g, b] = self.paths.radiance();
        for i in 0..pixels.len() {
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
        clock.stage(Stage::Advance);
    }
}

/// The samples of a tile that have not begun, in blocks of 8 × 8 pixels. Within a block all samples of a pixel follow
/// each other, so that neighbours in the wave are neighbours in the image. If paths gather photons, all pixels of a
/// sample follow each other instead, because each sample has its own photons.
struct SampleCursor {
    samples: Range<u32>,
    /// The pixels of each block, which are repeated for all samples.
    runs: Vec<Vec<u32>>,
    by_sample: bool,
    /// The next run, and the next sample of its pixels.
    next_run: usize,
    next: u32,
}

impl SampleCursor {
    const BLOCK: u32 = 8;

    fn new(region: Region, samples: Range<u32>, by_sample: bool, holds: &dyn Fn(u32, u32) -> bool) -> Self {
        let mut runs = Vec::new();
        for by in (region.y0..region.y1).step_by(Self::BLOCK as usize) {
            for bx in (region.x0..region.x1).step_by(Self::BLOCK as usize) {
                let rows = by..(by + Self::BLOCK).min(region.y1);
                let row = |y| (bx..(bx + Self::BLOCK).min(region.x1)).map(move |x| (x, y));
                let pixels = rows.flat_map(row).filter(|(x, y)| holds(*x, *y));
                runs.push(pixels.map(|(x, y)| pack_pixel(x, y)).collect());
            }
        }
        Self { samples, runs, by_sample, next_run: 0, next: 0 }
    }

    /// Fills both columns from the front; returns how many places it filled.
    fn next_batch(&mut self, pixels: &mut [u32], samples: &mut [u32]) -> usize {
        let mut count = 0;
        while count < pixels.len()
            && let Some(run) = self.runs.get(self.next_run)
        {
            let (all, every) = (run.len() as u32, self.samples.end - self.samples.start);
            if self.next == all * every {
                (self.next_run, self.next) = (self.next_run + 1, 0);
                continue;
            }
            let (pixel, sample) = match self.by_sample {
                true => (self.next % all, self.next / all),
                false => (self.next / every, self.next % every),
            };
            (pixels[count], samples[count]) = (run[pixel as usize], self.samples.start + sample);
            (count, self.next) = (count + 1, self.next + 1);
        }
        count
    }
}

/// A clock that charges the time since the last stage to the present one.
struct StageClock<'a> {
    statistics: &'a mut RayStatistics,
    last: Instant,
    observer: &'a mut dyn Observer,
}

impl StageClock<'_> {
    fn stage(&mut self, stage: Stage) {
        let now = Instant::now();
        self.statistics.stages[stage as usize] += now - self.last;
        self.last = now;
        self.observer.mark(stage);
    }
}
