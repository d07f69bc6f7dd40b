//! What an observer of the wave is told after each stage, read from the queues. All of it is
//! left out where nobody looks.

use super::Wave;
use super::queue::PathQueue;
use crate::integrator::Stage;
use crate::integrator::observe::{self, Event, Flow, Observer, Way};
use crate::math::{Color, Hit};
use crate::simd::{Float, Kernel, Lanes, Level, dispatch};

impl Wave {
    /// Bytes of all queues.
    pub fn bytes(&self) -> usize {
        let paths = [&self.paths, &self.reflect, &self.refract, &self.pending];
        let columns = [&self.goes_on, &self.occluded, &self.pixels, &self.samples];
        paths.map(|queue| queue.0.bytes()).iter().sum::<usize>()
            + self.hits.0.bytes()
            + self.vertices.0.bytes()
            + self.shadow.0.bytes()
            + columns.map(|column| size_of_val(&column[..])).iter().sum::<usize>()
            + self.shadow_hits.0.bytes()
            + size_of_val(&self.t_max[..])
    }

    /// The rays of the wave and what they have met.
    pub(super) fn tell_hits<O: Observer>(&self, level: Level, observer: &mut O) {
        if !O::LOOKS {
            return;
        }
        let count = self.paths.0.len();
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
        let capacity = self.paths.0.capacity();
        let flow = |stage| flow(stage, level, count, capacity, met.iter().copied());
        observer.report(&Event::Wave(flow(Stage::Intersect)));
        observer.report(&Event::Wave(flow(Stage::Retire)));
    }

    /// Where the paths of the wave are, and what goes on from there.
    pub(super) fn tell_vertices<O: Observer>(&self, level: Level, observer: &mut O) {
        if !O::LOOKS {
            return;
        }
        let count = self.paths.0.len();
        for i in 0..count {
            let (path, vertex) = (self.paths.load::<f32>(i), self.vertices.load::<f32>(i));
            let (own, shading) = (vertex.geometric_normal, vertex.normal);
            observer.report(&observe::vertex(&path, vertex.position, own, shading));
        }
        tell_onward(&self.reflect, Way::Reflect, observer);
        tell_onward(&self.refract, Way::Refract, observer);
        let onward = (0..count).filter(|i| self.goes_on[*i] != 0);
        let capacity = self.paths.0.capacity();
        observer.report(&Event::Wave(flow(Stage::Shade, level, count, capacity, onward)));
    }

    /// The same under the path transport, with the rays to lights.
    pub(super) fn tell_paths<O: Observer>(&self, level: Level, observer: &mut O) {
        if !O::LOOKS {
            return;
        }
        let count = self.paths.0.len();
        for i in 0..count {
            observer.report(&observe::path_vertex(&self.paths.load::<f32>(i), self.hits.load::<f32>(i).t));
        }
        let ([r, g, b], targets) = self.shadow.contributions();
        for (i, target) in targets.iter().enumerate() {
            let path = self.paths.load::<f32>(*target as usize);
            let contribution = Color::new(r[i], g[i], b[i]);
            observer.report(&observe::path_light(&path, &self.shadow.ray(i), contribution));
        }
        tell_onward(&self.reflect, Way::Scatter, observer);
        let onward = (0..count).filter(|i| self.goes_on[*i] != 0);
        let capacity = self.paths.0.capacity();
        observer.report(&Event::Wave(flow(Stage::Shade, level, count, capacity, onward)));
    }

    /// The shadow rays from `first` on, which lead to a sample of a light.
    pub(super) fn tell_lights<O: Observer>(
        &self,
        level: Level,
        light: usize,
        which: u32,
        first: usize,
        observer: &mut O,
    ) {
        if !O::LOOKS {
            return;
        }
        let ([r, g, b], targets) = self.shadow.contributions();
        for i in first..targets.len() {
            let path = self.paths.load::<f32>(targets[i] as usize);
            let contribution = Color::new(r[i], g[i], b[i]);
            observer.report(&observe::light(&path, light, which, &self.shadow.ray(i), contribution));
        }
        let (count, capacity) = (self.paths.0.len(), self.paths.0.capacity());
        let sent = targets[first..].iter().map(|target| *target as usize);
        observer.report(&Event::Wave(flow(Stage::Light, level, count, capacity, sent)));
    }

    /// Which of the shadow rays were blocked.
    pub(super) fn tell_shadows<O: Observer>(&self, level: Level, observer: &mut O) {
        if !O::LOOKS {
            return;
        }
        let (_, targets) = self.shadow.contributions();
        let count = targets.len();
        for (target, occluded) in targets.iter().zip(&self.occluded) {
            let path = self.paths.load::<f32>(*target as usize);
            observer.report(&observe::shadow(&path, *occluded != 0));
        }
        let open = (0..count).filter(|i| self.occluded[*i] == 0);
        let capacity = self.shadow.0.capacity();
        observer.report(&Event::Wave(flow(Stage::Shadow, level, count, capacity, open)));
    }

    /// The paths that go no further.
    pub(super) fn tell_ends<O: Observer>(&self, observer: &mut O) {
        if !O::LOOKS {
            return;
        }
        for i in (0..self.paths.0.len()).filter(|i| self.goes_on[*i] == 0) {
            let path = self.paths.load::<f32>(i);
            observer.report(&observe::end(&path, path.radiance));
        }
    }
}

fn tell_onward<O: Observer>(queue: &PathQueue, way: Way, observer: &mut O) {
    for i in 0..queue.0.len() {
        observer.report(&observe::onward(way, &queue.load::<f32>(i)));
    }
}

/// `count` items in groups as wide as the machine's lanes, of which those of `leaving` went on.
fn flow(
    stage: Stage,
    level: Level,
    count: usize,
    capacity: usize,
    leaving: impl Iterator<Item = usize>,
) -> Flow {
    let width = dispatch(level, Width);
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

/// How many lanes a level has.
struct Width;

impl Kernel for Width {
    type Output = usize;
    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        L::Queue::WIDTH
    }
}
