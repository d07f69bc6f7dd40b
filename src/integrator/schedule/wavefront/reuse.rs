//! Path reuse in waves: all paths of one sample of a block go through the stages together, and are connected at the
//! end.

use std::ops::Range;

use super::reports::report_connections;
use super::wave::{ReuseBuffers, SampleCursor, StageClock, Wave};
use crate::bvh;
use crate::film::Film;
use crate::integrator::observe::{self, Spilled};
use crate::integrator::path::unpack_pixel;
use crate::integrator::photons::PhotonMaps;
use crate::integrator::reuse::probe::{ReuseProbe, plain};
use crate::integrator::reuse::{ClippedSink, PathSlots, Sink, contains};
use crate::integrator::{RayStatistics, RenderSetup, Stage, Work};
use crate::math::NONE;
use crate::simd::Isa;

/// A render setup, and that of paths that are not reused.
#[derive(Clone, Copy)]
struct SharedAndPlain<'a> {
    setup: &'a RenderSetup,
    plain: &'a RenderSetup,
}

/// The flag of a path that goes on and keeps its radiance.
const KEEPS: u32 = 2;

impl Wave {
    /// Renders a range of samples of all the film's pixels, with those of the neighbours in their groups.
    pub(super) fn render_shared(
        &mut self,
        work: Work,
        film: &mut Film,
        samples: Range<u32>,
        clock: &mut StageClock,
    ) {
        let Work { setup, pilot, photons, isa } = work;
        let Some(mut shared) = self.shared.take() else { return };
        let setups = SharedAndPlain { setup, plain: &plain(setup) };
        shared.slots.enter(setup, film.region());
        if let Some(pilot) = pilot {
            if !shared.slots.recall() && !self.probe(pilot, photons, isa, &mut shared.slots, clock) {
                self.shared = Some(shared);
                return;
            }
            let slots = &shared.slots;
            let todo = SampleCursor::new(film.region(), samples.clone(), photons.is_some(), &|x, y| {
                slots.is_plain(x, y)
            });
            self.render_todo(work.with_frame(&pilot.plain), film, todo, clock);
        }
        shared.slots.start(samples);
        while self.trace_units(setups, photons, isa, film, &mut shared.slots, clock) {
            let ReuseBuffers { slots, connections, .. } = &mut shared;
            let (stack, traversal) = (&mut self.stack, self.traversal.unwrap_or(isa));
            let observer = &mut *clock.observer;
            connections.finish(setup, isa, slots, film, observer, &mut |rays, fans, blocked, observer| {
                bvh::any_in_bundles(traversal, &setup.scene.bvh, rays, fans, stack, blocked);
                report_connections(isa, blocked, observer);
            });
            let traced = std::mem::take(&mut connections.traced);
            clock.statistics.rays.connect += traced;
            clock.stage(Stage::Connect, traced as usize);
        }
        self.shared = Some(shared);
    }

    /// Probes some pixels to find out where path reuse pays. The rays are not counted. Returns false if stopped.
    fn probe(
        &mut self,
        pilot: &ReuseProbe,
        photons: Option<PhotonMaps>,
        isa: Isa,
        slots: &mut PathSlots,
        clock: &mut StageClock,
    ) -> bool {
        let photons = photons.map(PhotonMaps::of_pilot);
        slots.start_pilot();
        let setup = &pilot.setup;
        let setups = SharedAndPlain { setup, plain: &plain(setup) };
        let mut film = setup.film(slots.whole_blocks(setup.size));
        let (mut aside, mut observer) = (RayStatistics::default(), Spilled(&mut *clock.observer));
        let mut own = StageClock { statistics: &mut aside, last: clock.last, observer: &mut observer };
        while self.trace_units(setups, photons, isa, &mut film, slots, &mut own) {
            slots.measure(&film);
        }
        if own.observer.stops(0) {
            return false;
        }
        slots.choose(pilot);
        clock.stage(Stage::Generate, 0);
        true
    }

    /// Follows the paths of the next units to their ends; returns false if there are none, or if stopped.
    fn trace_units(
        &mut self,
        SharedAndPlain { setup, plain }: SharedAndPlain,
        photons: Option<PhotonMaps>,
        isa: Isa,
        film: &mut Film,
        slots: &mut PathSlots,
        clock: &mut StageClock,
    ) -> bool {
        if !self.generate_shared(setup, isa, film, slots, clock) {
            return false;
        }
        self.first_vertices(setup, photons, isa, film, slots, clock);
        self.second_vertices(setup, photons, isa, slots, clock);
        while !self.paths.columns.is_empty() && !self.is_stopped(clock) {
            self.vertices(setup, photons, isa, slots, false, clock);
            self.advance(slots, clock);
        }
        slots.settle();
        self.pending.spill_from(&mut self.alone);
        self.paths.fill_from(&mut self.pending);
        while !self.paths.columns.is_empty() && !self.is_stopped(clock) {
            self.vertices(plain, photons, isa, &mut ClippedSink(&mut *film), false, clock);
            self.advance(&mut ClippedSink(&mut *film), clock);
        }
        !clock.observer.stops(0)
    }

    /// Generates the camera's paths of the next units; returns false if there are none.
    fn generate_shared(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        film: &mut Film,
        slots: &mut PathSlots,
        clock: &mut StageClock,
    ) -> bool {
        let (mut count, region) = (0, film.region());
        let (pixels, numbers) = (&mut self.pixels, &mut self.samples);
        let more = slots.advance(setup.size, &mut |pixel, sample| {
            (pixels[count], numbers[count]) = (pixel, sample);
            count += 1;
            let (x, y) = unpack_pixel(pixel);
            if contains(&region, x, y) {
                film.count(x, y, sample);
            }
        });
        if more {
            self.begin(setup, isa, count, clock);
        }
        more
    }

    /// Finds and evaluates the wave's next vertices; the radiance of misses goes to the sink. `asks`: the roles of hits
    /// in path reuse are stored.
    fn vertices(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        sink: &mut dyn Sink,
        asks: bool,
        clock: &mut StageClock,
    ) {
        self.intersect(setup, isa, clock);
        self.find_lamps(setup, photons, isa, clock);
        self.retire(setup, photons, isa, Some(sink), clock);
        self.shade_paths(setup, photons, isa, asks, clock);
        self.report_paths(setup, photons, isa, clock.observer);
        self.shadows(setup, isa, None, clock);
        sink.take_groups(&mut self.found);
        self.report_ends(clock.observer);
    }

    /// Processes first vertices, whose light the path keeps.
    fn first_vertices(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        film: &mut Film,
        slots: &mut PathSlots,
        clock: &mut StageClock,
    ) {
        let mut film = ClippedSink(film);
        self.vertices(setup, photons, isa, &mut film, true, clock);
        let materials = self.hits.materials(self.paths.columns.len());
        for (i, (path, _)) in self.paths.found().enumerate() {
            slots.first(path, &self.hits.load::<f32>(i), materials[i], self.roles.takes[i]);
        }
        self.reflect.inherit(&self.paths);
        let (goes_on, looks) = (&mut self.goes_on, clock.observer.is_active());
        let mut shared = Vec::new();
        self.reflect.part(&mut self.alone, |source, path, throughput, pdf| {
            let shares = slots.leave(path, throughput, pdf);
            if !shares {
                goes_on[source] = KEEPS;
            } else if looks {
                shared.push(source);
            }
            shares
        });
        self.alone.spill_from(&mut self.refract);
        for (i, (path, found)) in self.paths.found().enumerate() {
            if self.goes_on[i] != KEEPS {
                film.deposit(path.0, path.1, found.into());
            }
        }
        for source in shared {
            clock.observer.report(&observe::spilled(&self.paths.load::<f32>(source)));
        }
        let count = self.paths.columns.len();
        self.paths.columns.clear();
        self.paths.fill_from(&mut self.reflect);
        clock.stage(Stage::Advance, count);
    }

    /// Processes second vertices, which give what leaves them by their diffuse lobe.
    fn second_vertices(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        slots: &mut PathSlots,
        clock: &mut StageClock,
    ) {
        self.intersect(setup, isa, clock);
        self.find_lamps(setup, photons, isa, clock);
        slots.second_by_group(&mut self.found);
        for (i, primitive) in self.hits.primitives(self.paths.columns.len()).iter().enumerate() {
            if *primitive == NONE {
                let path = self.paths.load::<f32>(i);
                let of = (path.pixel.0, path.sample.0);
                slots.miss(setup, of, path.direction);
                if path.radiance.max_component() > 0.0 {
                    slots.keep(of, path.radiance);
                    if clock.observer.is_active() {
                        clock.observer.report(&observe::spilled(&path));
                    }
                    self.paths.radiance_mut().into_iter().for_each(|column| column[i] = 0.0);
                }
            }
        }
        self.retire(setup, photons, isa, Some(slots), clock);
        self.shade_paths(setup, photons, isa, true, clock);
        self.report_paths(setup, photons, isa, clock.observer);
        for ((path, emitted), reusable) in self.paths.found().zip(&self.roles.reusable) {
            slots.second(path, emitted, reusable.as_ref());
        }
        slots.second_by_group(&mut self.found);
        self.put_aside(clock);
        self.shadows(setup, isa, None, clock);
        self.report_ends(clock.observer);
        for (path, radiance) in self.paths.found() {
            slots.lit(path, radiance);
        }
        slots.lit_by_group(&mut self.found);
        self.put_aside(clock);
        self.advance(slots, clock);
    }

    /// Clears the paths' radiance, which has been stored elsewhere.
    fn put_aside(&mut self, clock: &mut StageClock) {
        if clock.observer.is_active() {
            let report = |i| clock.observer.report(&observe::spilled(&self.paths.load::<f32>(i)));
            (0..self.paths.columns.len()).for_each(report);
        }
        self.paths.radiance_mut().into_iter().for_each(|column| column.fill(0.0));
    }
}
