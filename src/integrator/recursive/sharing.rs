//! Blocks whose paths are shared, one sample after another.

use std::num::Wrapping;
use std::ops::Range;

use super::{Tile, to_rgb};
use crate::bvh::any_ray;
use crate::film::Film;
use crate::integrator::observe::{self, Aside};
use crate::integrator::path::{Path, unpack_pixel};
use crate::integrator::photons::Photons;
use crate::integrator::sharing::pilot::{Pilot, plain};
use crate::integrator::sharing::{Connections, PIXELS, Sink, Slots, Within, holds};
use crate::integrator::{Statistics, begin};
use crate::math::Color;
use crate::shading::HitLanes;
use crate::shading::surface::material_of;

impl<'a> Tile<'a> {
    /// Renders samples whose paths are shared, block by block.
    pub(super) fn render_shared(
        &mut self,
        pilot: Option<&'a Pilot>,
        film: &mut Film,
        samples: Range<u32>,
        slots: &mut Slots,
        connections: &mut Connections,
    ) {
        let (frame, region) = (self.frame, film.region());
        let mut begun = Vec::with_capacity(PIXELS);
        slots.enter(frame, region);
        if let Some(pilot) = pilot {
            if !slots.recall() {
                // The rays do not count.
                let (statistics, observer) = (&mut Statistics::default(), &mut Aside(&mut *self.observer));
                let photons = self.photons.map(Photons::of_pilot);
                let (frames, isa) = ([&pilot.frame, &plain(&pilot.frame)], self.isa);
                let mut aside = Tile::new(frames, photons, isa, statistics, &mut *self.buffers, observer);
                aside.look(slots);
                if aside.stopped {
                    return;
                }
                slots.choose(pilot);
            }
            self.frame = &pilot.plain;
            self.render_plain(film, samples.clone(), &|x, y| slots.is_plain(x, y));
            self.frame = frame;
        }
        slots.start(samples);
        while !self.stopped && slots.advance(frame.size, &mut |pixel, sample| begun.push((pixel, sample))) {
            for (pixel, sample) in begun.drain(..) {
                let (x, y) = unpack_pixel(pixel);
                if holds(&region, x, y) {
                    film.count(x, y, sample);
                }
                self.statistics.rays.camera += 1;
                let path = begin::begin::<f32>(frame, Wrapping(pixel), Wrapping(sample));
                self.share(path, film, slots);
            }
            slots.settle();
            let (isa, stack) = (self.isa, &mut self.buffers.stack);
            connections.finish(frame, isa, slots, film, self.observer, &mut |rays, _, blocked, _| {
                for (at, blocked) in blocked.iter_mut().enumerate() {
                    let ray = rays.range(at..at + 1);
                    *blocked = any_ray(isa, &frame.scene.bvh, &ray.ray(0), ray.filter, stack).into();
                }
            });
            self.statistics.rays.connect += std::mem::take(&mut connections.traced);
        }
    }

    /// Looks at some pixels of a pilot's frame to see where sharing pays.
    pub(super) fn look(&mut self, slots: &mut Slots) {
        slots.start_pilot();
        let frame = self.frame;
        let mut film = Film::new(slots.whole_blocks(frame.size), frame.unit);
        let mut begun = Vec::with_capacity(PIXELS);
        while !self.stopped && slots.advance(frame.size, &mut |pixel, sample| begun.push((pixel, sample))) {
            for (pixel, sample) in begun.drain(..) {
                let path = begin::begin::<f32>(frame, Wrapping(pixel), Wrapping(sample));
                self.share(path, &mut film, slots);
            }
            slots.settle();
            slots.measure(&film);
        }
    }

    /// Follows a path to its end and leaves what it finds where others share it.
    fn share(&mut self, mut path: Path<f32>, film: &mut Film, slots: &mut Slots) {
        let hit = self.meet(&path);
        let first = self.vertex(&mut path, hit);
        let of = (path.pixel.0, path.sample.0);
        let mut film = Within(film);
        let Some(outcome) = first else { return film.deposit(of.0, of.1, to_rgb(path.radiance)) };
        self.light(&mut path, &outcome);
        let lane = HitLanes::one(&hit);
        let material = material_of(&self.frame.scene.geometry, &lane, true).0;
        slots.first(of, &lane, material, outcome.shared.as_ref().is_some_and(|shared| shared.receives));
        self.fork(&outcome);
        let next = self.onward(&path, &outcome);
        if let Some(next) = next.filter(|next| slots.leave(of, next.throughput, next.pdf)) {
            film.deposit(of.0, of.1, to_rgb(path.radiance));
            self.put_aside(&mut path);
            self.share_onward(next, slots);
            return;
        }
        let frame = std::mem::replace(&mut self.frame, self.plain);
        match next {
            Some(next) => self.end(Path { radiance: path.radiance, ..next }, &mut film),
            None => film.deposit(of.0, of.1, to_rgb(path.radiance)),
        }
        self.end_forks(&mut film);
        self.frame = frame;
    }

    /// Follows a path to its end.
    fn end(&mut self, path: Path<f32>, sink: &mut dyn Sink) {
        let found = self.trace(path);
        sink.deposit(path.pixel.0, path.sample.0, found);
    }

    /// Follows what has been forked off.
    fn end_forks(&mut self, sink: &mut dyn Sink) {
        while let Some(fork) = self.buffers.forks.pop() {
            self.end(fork, sink);
        }
    }

    /// Follows a path that is shared from its first vertex to its end.
    fn share_onward(&mut self, next: Path<f32>, slots: &mut Slots) {
        let of = (next.pixel.0, next.sample.0);
        let (throughput, radiance) = (Color::new(1.0, 1.0, 1.0), Color::black());
        let mut path = Path { throughput, radiance, ..next };
        let hit = self.meet(&path);
        if hit.is_miss() {
            slots.miss(self.frame, of, path.direction);
        }
        let Some(outcome) = self.vertex(&mut path, hit) else {
            return slots.deposit(of.0, of.1, to_rgb(path.radiance));
        };
        let lent = outcome.shared.as_ref().and_then(|shared| shared.lends.then_some(&shared.lent));
        slots.second(of, path.radiance, lent);
        self.put_aside(&mut path);
        self.light(&mut path, &outcome);
        slots.lit(of, path.radiance);
        self.fork(&outcome);
        let next = self.onward(&path, &outcome);
        self.put_aside(&mut path);
        if let Some(next) = next {
            self.end(next, slots);
        }
        self.end_forks(slots);
    }

    /// Clears the path's radiance, which has been put where it is shared.
    fn put_aside(&mut self, path: &mut Path<f32>) {
        if self.looks {
            self.observer.report(&observe::aside(path));
        }
        path.radiance = Color::black();
    }
}
