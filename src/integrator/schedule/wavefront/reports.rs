//! Reports to an observer of the wave after each stage, read from the queues. All are skipped if no reports are wanted.

use super::queue::PathQueue;
use super::wave::Wave;
use crate::integrator::observe::{self, Continuation, Event, Flow, Observer};
use crate::integrator::photons::PhotonMaps;
use crate::integrator::transport::decide::decide;
use crate::integrator::transport::unseen_lamps::each_found;
use crate::integrator::{RenderSetup, Stage};
use crate::math::{Color, Hit, NONE};
use crate::simd::Isa;
use crate::world::Transport;

impl Wave {
    /// Bytes of all queues.
    pub fn bytes(&self) -> usize {
        let paths = [&self.paths, &self.reflect, &self.refract, &self.pending, &self.alone];
        let columns = [&self.goes_on, &self.occluded, &self.pixels, &self.samples];
        paths.map(|queue| queue.bytes()).iter().sum::<usize>()
            + self.hits.0.bytes()
            + self.vertices.0.bytes()
            + self.shadow.bytes()
            + self.ended.as_ref().map_or(0, |ended| ended.0.bytes())
            + columns.map(|column| size_of_val(&column[..])).iter().sum::<usize>()
            + self.ends.bytes()
            + self.shared.as_ref().map_or(0, |shared| shared.bytes())
    }

    /// Reports the rays of the wave and their hits.
    pub(super) fn report_hits(&self, isa: Isa, observer: &mut dyn Observer) {
        if !observer.is_active() {
            return;
        }
        let count = self.paths.columns.len();
        let mut met = Vec::with_capacity(count);
        for i in 0..count {
            let hit = self.hits.load::<f32>(i);
            let (primitive, instance) = (hit.primitive.0, hit.instance.0);
            let hit = Hit { t: hit.t, u: hit.u, v: hit.v, primitive, instance };
            let hit = if hit.is_miss() { Hit::MISS } else { hit };
            observer.report(&observe::ray(&self.paths.load::<f32>(i), hit));
            if !hit.is_miss() {
                met.push(i);
            }
        }
        let capacity = self.paths.columns.capacity();
        // Misses leave the wave in the next stage.
        observer.report(&Event::Wave(flow(Stage::Intersect, isa, count, capacity, 0..count)));
        observer.report(&Event::Wave(flow(Stage::Retire, isa, count, capacity, met.into_iter())));
    }

    /// Reports the unseen lamps that paths have found.
    pub(super) fn report_lamps(
        &self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        observer: &mut dyn Observer,
    ) {
        if !observer.is_active() {
            return;
        }
        for i in 0..self.paths.columns.len() {
            let (path, hit) = (self.paths.load::<f32>(i), self.hits.load::<f32>(i));
            let t = if hit.primitive.0 == NONE { f32::INFINITY } else { hit.t };
            for lamp in each_found(setup, photons, &path, t) {
                observer.report(&observe::lamp(&path, &lamp));
            }
        }
    }

    /// Reports the vertices of the wave's paths and their continuations.
    pub(super) fn report_vertices(&self, isa: Isa, observer: &mut dyn Observer) {
        if !observer.is_active() {
            return;
        }
        let count = self.paths.columns.len();
        for i in 0..count {
            let (path, vertex) = (self.paths.load::<f32>(i), self.vertices.load::<f32>(i));
            let (own, shading) = (vertex.geometric_normal, vertex.normal);
            observer.report(&observe::vertex(&path, vertex.position, own, shading));
        }
        report_onward(&self.reflect, Continuation::Reflect, observer);
        report_onward(&self.refract, Continuation::Refract, observer);
        let onward = (0..count).filter(|i| self.goes_on[*i] != 0);
        let capacity = self.paths.columns.capacity();
        observer.report(&Event::Wave(flow(Stage::Shade, isa, count, capacity, onward)));
    }

    /// Reports vertices and continuations under the path transport, with the rays to lights.
    pub(super) fn report_paths(
        &self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        isa: Isa,
        observer: &mut dyn Observer,
    ) {
        if !observer.is_active() {
            return;
        }
        let count = self.paths.columns.len();
        let materials = self.hits.materials(count);
        let seen = |i: usize| {
            let path = self.paths.load::<f32>(i);
            (path, decide(setup, photons, &path, &self.hits.load::<f32>(i), materials[i]))
        };
        for i in 0..count {
            let (path, decision) = seen(i);
            observe::path_vertex(&path, &decision).for_each(|event| observer.report(&event));
        }
        let ([r, g, b], targets) = self.shadow.contributions();
        for (i, target) in targets.iter().enumerate() {
            let (path, decision) = seen(*target as usize);
            let contribution = Color::new(r[i], g[i], b[i]);
            observer.report(&observe::path_light(&path, &decision, &self.shadow.ray(i), contribution));
        }
        report_onward(&self.reflect, Continuation::Scatter, observer);
        report_onward(&self.refract, Continuation::Refract, observer);
        let onward = (0..count).filter(|i| self.goes_on[*i] != 0);
        let capacity = self.paths.columns.capacity();
        observer.report(&Event::Wave(flow(Stage::Shade, isa, count, capacity, onward)));
    }

    /// Reports the shadow rays from `first` on, which lead to a sample of a light.
    pub(super) fn report_lights(
        &self,
        isa: Isa,
        light: usize,
        which: u32,
        first: usize,
        observer: &mut dyn Observer,
    ) {
        if !observer.is_active() {
            return;
        }
        let ([r, g, b], targets) = self.shadow.contributions();
        for i in first..targets.len() {
            let path = self.paths.load::<f32>(targets[i] as usize);
            let contribution = Color::new(r[i], g[i], b[i]);
            observer.report(&observe::light(&path, light, which, &self.shadow.ray(i), contribution));
        }
        let (count, capacity) = (self.paths.columns.len(), self.paths.columns.capacity());
        let sent = targets[first..].iter().map(|target| *target as usize);
        observer.report(&Event::Wave(flow(Stage::Light, isa, count, capacity, sent)));
    }

    /// Reports which of the shadow rays are blocked.
    pub(super) fn report_shadows(&self, setup: &RenderSetup, isa: Isa, observer: &mut dyn Observer) {
        if !observer.is_active() {
            return;
        }
        let (_, targets) = self.shadow.contributions();
        let count = targets.len();
        for (target, occluded) in targets.iter().zip(&self.occluded) {
            let (path, blocked) = (self.paths.load::<f32>(*target as usize), *occluded != 0);
            observer.report(&match setup.transport {
                Transport::Whitted => observe::shadow(&path, blocked),
                Transport::Path => observe::path_shadow(&path, blocked, path.radiance),
            });
        }
        let open = (0..count).filter(|i| self.occluded[*i] == 0);
        let capacity = self.shadow.capacity();
        observer.report(&Event::Wave(flow(Stage::Shadow, isa, count, capacity, open)));
    }

    /// Reports the paths that end.
    pub(super) fn report_ends(&self, observer: &mut dyn Observer) {
        if !observer.is_active() {
            return;
        }
        for i in (0..self.paths.columns.len()).filter(|i| self.goes_on[*i] == 0) {
            let path = self.paths.load::<f32>(i);
            observer.report(&observe::end(&path, path.radiance));
        }
    }
}

fn report_onward(queue: &PathQueue, way: Continuation, observer: &mut dyn Observer) {
    for i in 0..queue.columns.len() {
        observer.report(&observe::onward(way, &queue.load::<f32>(i)));
    }
}

/// The flow of `count` items in groups as wide as the machine's lanes, of which those of `leaving` went on.
fn flow(stage: Stage, isa: Isa, count: usize, capacity: usize, leaving: impl Iterator<Item = usize>) -> Flow {
    let width = isa.lanes();
    let mut groups = vec![0usize; count.div_ceil(width)];
    let mut total = 0;
    for item in leaving {
        groups[item / width] += 1;
        total += 1;
    }
    let mut lanes = [0; 17];
    groups.iter().for_each(|active| lanes[*active] += 1);
    Flow { stage, entering: count, leaving: total, capacity, width, lanes }
}

/// Reports the rays of path reuse, and how many of them are unblocked.
pub(super) fn report_connections(isa: Isa, blocked: &[u32], observer: &mut dyn Observer) {
    if observer.is_active() && !blocked.is_empty() {
        let free = (0..blocked.len()).filter(|i| blocked[*i] == 0);
        observer.report(&Event::Wave(flow(Stage::Connect, isa, blocked.len(), blocked.len(), free)));
    }
}
