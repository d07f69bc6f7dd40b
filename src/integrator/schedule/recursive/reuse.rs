//! Path reuse under the recursive schedule: blocks of pixels, one sample after another.

use std::num::Wrapping;
use std::ops::Range;

use super::Tile;
use crate::bvh::any_ray;
use crate::film::Film;
use crate::integrator::RayStatistics;
use crate::integrator::observe::{self, Spilled};
use crate::integrator::path::{Path, camera_path, unpack_pixel};
use crate::integrator::photons::PhotonMaps;
use crate::integrator::reuse::probe::{ReuseProbe, plain};
use crate::integrator::reuse::{ClippedSink, Connections, PathSlots, Sink, contains};
use crate::math::Color;
use crate::shading::HitLanes;
use crate::shading::surface::material_of;

impl<'a> Tile<'a> {
    /// Renders samples with path reuse, block by block.
    pub(super) fn render_shared(
        &mut self,
        pilot: Option<&'a ReuseProbe>,
        film: &mut Film,
        samples: Range<u32>,
        slots: &mut PathSlots,
        connections: &mut Connections,
    ) {
        let (setup, region) = (self.setup, film.region());
        let mut begun = Vec::new();
        slots.enter(setup, region);
        if let Some(pilot) = pilot {
            if !slots.recall() {
                // The probe's rays are not counted.
                let (statistics, observer) =
                    (&mut RayStatistics::default(), &mut Spilled(&mut *self.observer));
                let photons = self.photons.map(PhotonMaps::of_pilot);
                let (setups, isa) = ([&pilot.setup, &plain(&pilot.setup)], self.isa);
                let mut aside = Tile::new(setups, photons, isa, statistics, &mut *self.buffers, observer);
                aside.probe(slots);
                if aside.stopped {
                    return;
                }
                slots.choose(pilot);
            }
            self.setup = &pilot.plain;
            self.render_plain(film, samples.clone(), &|x, y| slots.is_plain(x, y));
            self.setup = setup;
        }
        slots.start(samples);
        while !self.stopped && slots.advance(setup.size, &mut |pixel, sample| begun.push((pixel, sample))) {
            for (pixel, sample) in begun.drain(..) {
                let (x, y) = unpack_pixel(pixel);
                if contains(&region, x, y) {
                    film.count(x, y, sample);
                }
                self.statistics.rays.camera += 1;
                let path = camera_path::generate::<f32>(setup, Wrapping(pixel), Wrapping(sample));
                self.share(path, film, slots);
            }
            slots.settle();
            let (isa, stack) = (self.isa, &mut self.buffers.stack);
            connections.finish(setup, isa, slots, film, self.observer, &mut |rays, _, blocked, _| {
                for (at, blocked) in blocked.iter_mut().enumerate() {
                    let ray = rays.range(at..at + 1);
                    *blocked = any_ray(isa, &setup.scene.bvh, &ray.ray(0), ray.filter, stack).into();
                }
            });
            self.statistics.rays.connect += std::mem::take(&mut connections.traced);
        }
    }

    /// Probes some pixels to find out where path reuse pays.
    pub(super) fn probe(&mut self, slots: &mut PathSlots) {
        slots.start_pilot();
        let setup = self.setup;
        let mut film = setup.film(slots.whole_blocks(setup.size));
        let mut begun = Vec::new();
        while !self.stopped && slots.advance(setup.size, &mut |pixel, sample| begun.push((pixel, sample))) {
            for (pixel, sample) in begun.drain(..) {
                let path = camera_path::generate::<f32>(setup, Wrapping(pixel), Wrapping(sample));
                self.share(path, &mut film, slots);
            }
            slots.settle();
            slots.measure(&film);
        }
    }

    /// Follows a path to its end and stores what it finds for path reuse.
    fn share(&mut self, mut path: Path<f32>, film: &mut Film, slots: &mut PathSlots) {
        let hit = self.advance(&mut path);
        let first = self.vertex(&mut path, hit);
        let of = (path.pixel.0, path.sample.0);
        let mut film = ClippedSink(film);
        let Some(outcome) = first else {
            film.deposit(of.0, of.1, path.radiance.into());
            return self.deposit_groups(&mut film);
        };
        self.light(&mut path, &outcome);
        self.deposit_groups(&mut film);
        let lane = HitLanes::one(&hit);
        let material = material_of(&self.setup.scene.geometry, &lane, true).0;
        slots.first(of, &lane, material, outcome.reuse.as_ref().is_some_and(|shared| shared.takes));
        self.fork(&outcome);
        let next = self.onward(&path, &outcome);
        if let Some(next) = next.filter(|next| slots.leave(of, next.throughput, next.pdf)) {
            film.deposit(of.0, of.1, path.radiance.into());
            self.put_aside(&mut path);
            self.share_onward(next, slots);
            return;
        }
        let setup = std::mem::replace(&mut self.setup, self.plain);
        match next {
            Some(next) => self.end(Path { radiance: path.radiance, ..next }, &mut film),
            None => film.deposit(of.0, of.1, path.radiance.into()),
        }
        self.end_forks(&mut film);
        self.setup = setup;
    }

    /// Follows a path to its end and deposits its radiance.
    fn end(&mut self, path: Path<f32>, sink: &mut dyn Sink) {
        let found = self.trace(path);
        sink.deposit(path.pixel.0, path.sample.0, found);
        self.deposit_groups(sink);
    }

    /// Follows all forks to their ends.
    fn end_forks(&mut self, sink: &mut dyn Sink) {
        while let Some(fork) = self.buffers.forks.pop() {
            self.end(fork, sink);
        }
    }

    /// Follows a reused path from its first vertex to its end.
    fn share_onward(&mut self, next: Path<f32>, slots: &mut PathSlots) {
        let of = (next.pixel.0, next.sample.0);
        let (throughput, radiance) = (Color::new(1.0, 1.0, 1.0), Color::black());
        let mut path = Path { throughput, radiance, ..next };
        let hit = self.advance(&mut path);
        if hit.is_miss() {
            slots.miss(self.setup, of, path.direction);
        }
        slots.second_by_group(&mut self.buffers.found);
        if hit.is_miss() && path.radiance.max_component() > 0.0 {
            slots.keep(of, path.radiance);
            self.put_aside(&mut path);
        }
        let Some(outcome) = self.vertex(&mut path, hit) else {
            slots.deposit(of.0, of.1, path.radiance.into());
            return self.deposit_groups(slots);
        };
        let reusable = outcome.reuse.as_ref().and_then(|shared| shared.gives.then_some(&shared.reusable));
        slots.second(of, path.radiance, reusable);
        slots.second_by_group(&mut self.buffers.found);
        self.put_aside(&mut path);
        self.light(&mut path, &outcome);
        slots.lit(of, path.radiance);
        slots.lit_by_group(&mut self.buffers.found);
        self.fork(&outcome);
        let next = self.onward(&path, &outcome);
        self.put_aside(&mut path);
        if let Some(next) = next {
            self.end(next, slots);
        }
        self.end_forks(slots);
    }

    /// Clears the path's radiance, which has been stored for path reuse.
    fn put_aside(&mut self, path: &mut Path<f32>) {
        if self.looks {
            self.observer.report(&observe::spilled(path));
        }
        path.radiance = Color::black();
    }
}
