//! Depth first: every sample of a pixel is followed to its end before the next begins,
//! with the single-ray kernels. A fork waits on a stack of our own instead of the
//! thread's, so that no depth overflows it.

mod photons;
mod sharing;

use std::num::Wrapping;
use std::ops::Range;

use smallvec::SmallVec;

use super::decision::decide;
use super::observe::{self, Continuation, Observer};
use super::path::{Path, pack_pixel};
use super::path_tracing::VertexOutcome;
use super::photons::Photons;
use super::presence::{Shadow, Traced, sides};
use super::shadow::{ShadowRay, connect};
use super::sharing::pilot::{Measured, plain};
use super::sharing::{Connections, Slots};
use super::stop::{Stop, Watch};
use super::straight::{Crossings, arriving};
use super::whitted::{Scatter, WhittedVertex};
use super::{Frame, Statistics, Work, begin, path_tracing, whitted};
use crate::bvh::{AnyHitFilter, Stack, any_ray, closest_ray};
use crate::film::{Film, Region};
use crate::math::{Color, Hit, Rgb};
use crate::shading::HitLanes;
use crate::shading::surface::material_of;
use crate::simd::Isa;
use crate::world::Transport;

/// A worker of the recursive schedule.
pub struct Recursion {
    buffers: Buffers,
    /// For shared paths: those of one sample of a block.
    shared: Option<(Slots, Connections)>,
}

/// Buffers of one path, and the paths that wait for its end.
struct Buffers {
    stack: Stack,
    crossings: Crossings,
    forks: SmallVec<[Path<f32>; 32]>,
}

impl Recursion {
    /// For a frame.
    pub fn new(frame: &Frame) -> Self {
        let shared = frame.sharing.map(|_| (Slots::new(frame, 1), Connections::default()));
        let (stack, crossings) = (Stack::new(&frame.scene.bvh), Crossings::default());
        Self { buffers: Buffers { stack, crossings, forks: SmallVec::new() }, shared }
    }

    /// Renders a range of samples of all the film's pixels.
    pub fn render(
        &mut self,
        work: Work,
        film: &mut Film,
        samples: Range<u32>,
        statistics: &mut Statistics,
        observer: &mut dyn Observer,
    ) {
        let Work { frame, pilot, photons, isa } = work;
        let looks = observer.looks();
        let plain = frame.sharing.map(|_| plain(frame));
        let frames = [frame, plain.as_ref().unwrap_or(frame)];
        let tile = Tile::new(frames, photons, isa, statistics, &mut self.buffers, observer);
        let mut tile = Tile { looks, ..tile };
        match &mut self.shared {
            Some((slots, connections)) => tile.render_shared(pilot, film, samples, slots, connections),
            None => tile.render_plain(film, samples, &|_, _| true),
        }
    }

    /// What two samples of some pixels of a block find in a pilot's frame, and the number of rays that it took. None if
    /// it was stopped.
    pub fn look(
        &mut self,
        frame: &Frame,
        photons: Option<Photons>,
        block: Region,
        stop: &Stop,
    ) -> Option<(Measured, u64)> {
        let (slots, _) = self.shared.as_mut()?;
        let (statistics, observer) = (&mut Statistics::default(), &mut Watch::new(stop));
        let frames = [frame, &plain(frame)];
        let mut tile = Tile::new(frames, photons, Isa::detect(), statistics, &mut self.buffers, observer);
        slots.enter(frame, block);
        tile.look(slots);
        (!tile.stopped).then(|| (slots.measured(), tile.statistics.rays.total()))
    }
}

/// What is needed to follow paths. Only the traversal of the tree is compiled for each instruction set; the rest
/// exists once, and so without AVX, which costs up to a sixth more time.
struct Tile<'a> {
    frame: &'a Frame,
    /// The settings of paths that are not shared.
    plain: &'a Frame,
    photons: Option<Photons<'a>>,
    isa: Isa,
    statistics: &'a mut Statistics,
    buffers: &'a mut Buffers,
    looks: bool,
    observer: &'a mut dyn Observer,
    /// How often it was to be decided whether to end.
    asked: u32,
    /// True once the tile ends within: nothing is met any more.
    stopped: bool,
}

impl<'a> Tile<'a> {
    /// A tile that reports nothing. `plain` is as the field.
    fn new(
        [frame, plain]: [&'a Frame; 2],
        photons: Option<Photons<'a>>,
        isa: Isa,
        statistics: &'a mut Statistics,
        buffers: &'a mut Buffers,
        observer: &'a mut dyn Observer,
    ) -> Self {
        let (looks, asked, stopped) = (false, 0, false);
        Self { frame, plain, photons, isa, statistics, buffers, looks, observer, asked, stopped }
    }

    /// Renders samples of pixels that share nothing.
    fn render_plain(&mut self, film: &mut Film, samples: Range<u32>, holds: &dyn Fn(u32, u32) -> bool) {
        let (frame, region) = (self.frame, film.region());
        for y in region.y0..region.y1 {
            for x in (region.x0..region.x1).filter(|x| holds(*x, y)) {
                for sample in samples.clone() {
                    if self.stopped {
                        return;
                    }
                    let path = begin::begin::<f32>(frame, Wrapping(pack_pixel(x, y)), Wrapping(sample));
                    film.count(x, y, sample);
                    self.statistics.rays.camera += 1;
                    self.buffers.forks.push(path);
                    while let Some(path) = self.buffers.forks.pop() {
                        let radiance = match frame.transport {
                            Transport::Whitted => self.follow(path),
                            Transport::Path => self.trace(path),
                        };
                        film.add(x, y, sample, radiance);
                    }
                }
            }
        }
    }

    /// True if the tile is to end within. Called before each ray, so it seldom looks.
    #[inline(always)]
    fn stops(&mut self) -> bool {
        self.asked = self.asked.wrapping_add(1);
        if self.asked.is_multiple_of(256) {
            self.stopped = self.observer.stops(self.statistics.rays.total());
        }
        self.stopped
    }

    /// What a path meets next.
    fn meet(&mut self, path: &Path<f32>) -> Hit {
        if self.stops() {
            return Hit::MISS;
        }
        let traced = Traced { frame: self.frame, path: &|| *path, shadow: None };
        closest_ray(
            self.isa,
            &self.frame.scene.bvh,
            &path.ray(),
            AnyHitFilter::new(&traced, 0).with_culling(sides(self.frame, false)),
            &mut self.buffers.stack,
        )
    }

    /// Whether something lies between a path's vertex and a light.
    fn is_blocked(&mut self, path: &Path<f32>, shadow: &ShadowRay<f32>) -> bool {
        self.statistics.rays.shadow += 1;
        if self.stops() {
            return true;
        }
        let ray = shadow.ray;
        let to_light = Some(Shadow { ray, emitter: shadow.emitter.0, passes: &|_| {} });
        let traced = Traced { frame: self.frame, path: &|| *path, shadow: to_light };
        any_ray(self.isa, &self.frame.scene.bvh, &ray, AnyHitFilter::new(&traced, 0), &mut self.buffers.stack)
    }

    /// Follows a path to its end and returns its radiance; forks go onto the stack.
    fn follow(&mut self, mut path: Path<f32>) -> Rgb {
        let frame = self.frame;
        loop {
            let hit = self.meet(&path);
            if self.looks {
                self.observer.report(&observe::ray(&path, hit));
            }
            if hit.is_miss() {
                let radiance = whitted::miss(frame, &path);
                if self.looks {
                    self.observer.report(&observe::end(&path, radiance));
                }
                return to_rgb(radiance);
            }
            let (vertex, scatter, radiance) =
                whitted::hit(frame, self.photons, &path, &HitLanes::one(&hit), true);
            path.radiance = radiance;
            if self.looks {
                let (own, shading) = (vertex.geometric_normal, vertex.normal);
                self.observer.report(&observe::vertex(&path, vertex.position, own, shading));
            }
            self.lights(&mut path, &vertex);
            self.statistics.rays.reflect += scatter.reflects as u64;
            self.statistics.rays.refract += scatter.refracts as u64;
            if self.looks {
                self.report_onward(&path, &vertex, &scatter);
            }
            if scatter.forks() {
                self.buffers.forks.push(scatter.refracted(&path, &vertex));
            }
            let next = if scatter.reflects {
                scatter.reflected(&path, &vertex)
            } else if scatter.refracts {
                scatter.refracted(&path, &vertex)
            } else {
                return to_rgb(path.radiance);
            };
            path = Path { radiance: path.radiance, ..next };
        }
    }

    /// Follows a path of the path transport to its end.
    fn trace(&mut self, mut path: Path<f32>) -> Rgb {
        loop {
            let hit = self.meet(&path);
            let Some(outcome) = self.vertex(&mut path, hit) else { return to_rgb(path.radiance) };
            self.light(&mut path, &outcome);
            self.fork(&outcome);
            match self.onward(&path, &outcome) {
                Some(next) => path = Path { radiance: path.radiance, ..next },
                None => return to_rgb(path.radiance),
            }
        }
    }

    /// The vertex where a path has hit something; none if it has hit nothing, and ends.
    fn vertex(&mut self, path: &mut Path<f32>, hit: Hit) -> Option<VertexOutcome<f32>> {
        let frame = self.frame;
        if self.looks {
            self.observer.report(&observe::ray(path, hit));
        }
        if hit.is_miss() {
            path.radiance = path_tracing::miss(frame, self.photons, path, true);
            if self.looks {
                self.observer.report(&observe::end(path, path.radiance));
            }
            return None;
        }
        let lane = HitLanes::one(&hit);
        let material = material_of(&frame.scene.geometry, &lane, true).0;
        let outcome = path_tracing::hit(frame, self.photons, path, &lane, material, true);
        path.radiance = outcome.radiance;
        if self.looks {
            let decision = decide(frame, self.photons, path, &lane, material);
            observe::path_vertex(path, &decision).for_each(|event| self.observer.report(&event));
            if outcome.shadow.mask {
                let (ray, contribution) = (&outcome.shadow.ray, outcome.shadow.contribution);
                self.observer.report(&observe::path_light(path, &decision, ray, contribution));
            }
        }
        Some(outcome)
    }

    /// What a light sends to a path's vertex.
    fn light(&mut self, path: &mut Path<f32>, outcome: &VertexOutcome<f32>) {
        if !outcome.shadow.mask {
            return;
        }
        self.statistics.rays.shadow += 1;
        let Self { frame, isa, .. } = *self;
        let Buffers { stack, crossings, .. } = &mut *self.buffers;
        let light = arriving(frame, isa, path, &outcome.shadow, stack, crossings);
        if let Some(light) = light {
            path.radiance = connect(path.radiance, light);
        }
        if self.looks {
            self.observer.report(&observe::path_shadow(path, light.is_none(), path.radiance));
        }
    }

    /// Where the path goes on, if it does.
    fn onward(&mut self, path: &Path<f32>, outcome: &VertexOutcome<f32>) -> Option<Path<f32>> {
        if !outcome.goes_on {
            if self.looks {
                self.observer.report(&observe::end(path, path.radiance));
            }
            return None;
        }
        if self.looks {
            self.observer.report(&observe::onward(Continuation::Scatter, &outcome.next));
        }
        self.statistics.rays.scatter += 1;
        Some(outcome.next)
    }

    /// Puts what is forked off at a vertex onto the stack.
    fn fork(&mut self, outcome: &VertexOutcome<f32>) {
        if let Some(fork) = &outcome.fork
            && fork.mask
        {
            if self.looks {
                self.observer.report(&observe::onward(Continuation::Refract, &fork.next));
            }
            self.statistics.rays.refract += 1;
            self.buffers.forks.push(fork.next);
        }
    }

    /// Reports where the path goes on, or with what it ends.
    fn report_onward(&mut self, path: &Path<f32>, vertex: &WhittedVertex<f32>, scatter: &Scatter<f32>) {
        if scatter.reflects {
            self.observer.report(&observe::onward(Continuation::Reflect, &scatter.reflected(path, vertex)));
        }
        if scatter.refracts {
            self.observer.report(&observe::onward(Continuation::Refract, &scatter.refracted(path, vertex)));
        }
        if !scatter.reflects && !scatter.refracts {
            self.observer.report(&observe::end(path, path.radiance));
        }
    }

    /// Adds what arrives from every sample of every light.
    fn lights(&mut self, path: &mut Path<f32>, vertex: &whitted::WhittedVertex<f32>) {
        let frame = self.frame;
        for light in 0..frame.scene.lights.len() {
            for which in 0..frame.scene.lights[light].samples {
                let shadow = whitted::light_ray(frame, path, vertex, light, which, true);
                if !shadow.mask {
                    continue;
                }
                let blocked = self.is_blocked(path, &shadow);
                if self.looks {
                    let (ray, contribution) = (&shadow.ray, shadow.contribution);
                    self.observer.report(&observe::light(path, light, which, ray, contribution));
                    self.observer.report(&observe::shadow(path, blocked));
                }
                if !blocked {
                    path.radiance = connect(path.radiance, shadow.contribution);
                }
            }
        }
    }
}

#[inline(always)]
fn to_rgb(color: Color<f32>) -> Rgb {
    Rgb::new(color.r, color.g, color.b)
}
