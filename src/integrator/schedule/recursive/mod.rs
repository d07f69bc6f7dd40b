//! The recursive schedule, depth first: every sample of a pixel is followed to its end before the next begins, with the
//! single-ray kernels. Forks go onto an explicit stack instead of the thread's, so that no depth overflows it.

mod photons;
mod reuse;

use std::num::Wrapping;
use std::ops::Range;

use smallvec::SmallVec;

use crate::bvh::{AnyHitFilter, Stack, any_ray, closest_ray};
use crate::film::{Film, Region};
use crate::integrator::observe::stop::{Stop, Watch};
use crate::integrator::observe::{self, Continuation, Observer};
use crate::integrator::path::any_hit::{LightRay, PathRay, culling};
use crate::integrator::path::light_groups::{GroupQueue, group_of};
use crate::integrator::path::shadow::{ShadowRay, connect};
use crate::integrator::path::{Path, camera_path, pack_pixel};
use crate::integrator::photons::PhotonMaps;
use crate::integrator::reuse::probe::{MeasuredBlock, plain};
use crate::integrator::reuse::{Connections, PathSlots, Sink};
use crate::integrator::transport::decide::decide;
use crate::integrator::transport::path_tracing::{self, VertexOutcome};
use crate::integrator::transport::transparent_shadow::arriving;
use crate::integrator::transport::unseen_lamps;
use crate::integrator::transport::whitted::{self, WhittedScatter, WhittedVertex};
use crate::integrator::{RayStatistics, RenderSetup, Work};
use crate::math::{Color, Hit, Rgb};
use crate::shading::HitLanes;
use crate::shading::surface::material_of;
use crate::simd::Isa;
use crate::world::Transport;

/// A worker of the recursive schedule.
pub struct Recursion {
    buffers: RecursionBuffers,
    /// The paths of one sample of a block, for path reuse.
    shared: Option<(PathSlots, Connections)>,
}

/// The buffers of one path, and a stack of forks.
struct RecursionBuffers {
    stack: Stack,
    forks: SmallVec<[Path<f32>; 32]>,
    /// The light that paths have found, by group.
    found: GroupQueue,
}

impl Recursion {
    /// Creates the buffers for a render setup.
    pub fn new(setup: &RenderSetup) -> Self {
        let shared = setup.sharing.map(|_| (PathSlots::new(setup, 1), Connections::default()));
        let stack = Stack::new(&setup.scene.bvh);
        Self {
            buffers: RecursionBuffers { stack, forks: SmallVec::new(), found: GroupQueue::default() },
            shared,
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
        let Work { setup, pilot, photons, isa } = work;
        let looks = observer.is_active();
        let plain = setup.sharing.map(|_| plain(setup));
        let setups = [setup, plain.as_ref().unwrap_or(setup)];
        let tile = Tile::new(setups, photons, isa, statistics, &mut self.buffers, observer);
        let mut tile = Tile { looks, ..tile };
        match &mut self.shared {
            Some((slots, connections)) => tile.render_shared(pilot, film, samples, slots, connections),
            None => tile.render_plain(film, samples, &|_, _| true),
        }
    }

    /// Measures a block for a reuse probe: what two samples of some of its pixels find, and the number of rays traced.
    /// None if stopped.
    pub fn probe(
        &mut self,
        setup: &RenderSetup,
        photons: Option<PhotonMaps>,
        block: Region,
        stop: &Stop,
    ) -> Option<(MeasuredBlock, u64)> {
        let (slots, _) = self.shared.as_mut()?;
        let (statistics, observer) = (&mut RayStatistics::default(), &mut Watch::new(stop));
        let setups = [setup, &plain(setup)];
        let mut tile = Tile::new(setups, photons, Isa::detect(), statistics, &mut self.buffers, observer);
        slots.enter(setup, block);
        tile.probe(slots);
        (!tile.stopped).then(|| (slots.measured(), tile.statistics.rays.total()))
    }
}

/// The state for following paths. Only the traversal is compiled for each instruction set; the rest exists once, and
/// thus without AVX, which costs up to a sixth more time.
struct Tile<'a> {
    setup: &'a RenderSetup,
    /// The setup of paths that are not reused.
    plain: &'a RenderSetup,
    photons: Option<PhotonMaps<'a>>,
    isa: Isa,
    statistics: &'a mut RayStatistics,
    buffers: &'a mut RecursionBuffers,
    looks: bool,
    observer: &'a mut dyn Observer,
    /// The number of calls of [`Tile::stops`].
    asked: u32,
    /// True once the tile is stopped: all rays miss from then on.
    stopped: bool,
}

impl<'a> Tile<'a> {
    /// Creates a tile that reports nothing. `plain` is the field of that name.
    fn new(
        [setup, plain]: [&'a RenderSetup; 2],
        photons: Option<PhotonMaps<'a>>,
        isa: Isa,
        statistics: &'a mut RayStatistics,
        buffers: &'a mut RecursionBuffers,
        observer: &'a mut dyn Observer,
    ) -> Self {
        let (looks, asked, stopped) = (false, 0, false);
        Self { setup, plain, photons, isa, statistics, buffers, looks, observer, asked, stopped }
    }

    /// Renders samples of pixels without path reuse.
    fn render_plain(&mut self, film: &mut Film, samples: Range<u32>, holds: &dyn Fn(u32, u32) -> bool) {
        let (setup, region) = (self.setup, film.region());
        for y in region.y0..region.y1 {
            for x in (region.x0..region.x1).filter(|x| holds(*x, y)) {
                for sample in samples.clone() {
                    if self.stopped {
                        return;
                    }
                    let path =
                        camera_path::generate::<f32>(setup, Wrapping(pack_pixel(x, y)), Wrapping(sample));
                    film.count(x, y, sample);
                    self.statistics.rays.camera += 1;
                    self.buffers.forks.push(path);
                    while let Some(path) = self.buffers.forks.pop() {
                        let radiance = match setup.transport {
                            Transport::Whitted => self.follow(path),
                            Transport::Path => self.trace(path),
                        };
                        film.add(x, y, sample, radiance);
                        self.deposit_groups(film);
                    }
                }
            }
        }
    }

    /// True if the tile is to be stopped. Called before each ray, so it seldom checks.
    #[inline(always)]
    fn stops(&mut self) -> bool {
        self.asked = self.asked.wrapping_add(1);
        if self.asked.is_multiple_of(256) {
            self.stopped = self.observer.stops(self.statistics.rays.total());
        }
        self.stopped
    }

    /// Returns the closest hit of a path's ray.
    fn meet(&mut self, path: &Path<f32>) -> Hit {
        if self.stops() {
            return Hit::MISS;
        }
        let traced = PathRay { setup: self.setup, path: &|| *path, shadow: None };
        closest_ray(
            self.isa,
            &self.setup.scene.bvh,
            &path.ray(),
            AnyHitFilter::new(&traced, 0).with_culling(culling(self.setup, false)),
            &mut self.buffers.stack,
        )
    }

    /// True if a path's shadow ray is blocked.
    fn is_blocked(&mut self, path: &Path<f32>, shadow: &ShadowRay<f32>) -> bool {
        self.statistics.rays.shadow += 1;
        if self.stops() {
            return true;
        }
        let ray = shadow.ray;
        let to_light = Some(LightRay { ray, emitter: shadow.emitter.0, passes: &|_| {} });
        let traced = PathRay { setup: self.setup, path: &|| *path, shadow: to_light };
        any_ray(self.isa, &self.setup.scene.bvh, &ray, AnyHitFilter::new(&traced, 0), &mut self.buffers.stack)
    }

    /// Follows a path to its end and returns its radiance; forks go onto the stack.
    fn follow(&mut self, mut path: Path<f32>) -> Rgb {
        let setup = self.setup;
        loop {
            let hit = self.meet(&path);
            if self.looks {
                self.observer.report(&observe::ray(&path, hit));
            }
            if hit.is_miss() {
                let radiance = path.radiance + whitted::miss(setup, &path, true, &mut self.buffers.found);
                if self.looks {
                    self.observer.report(&observe::end(&path, radiance));
                }
                return radiance.into();
            }
            let (vertex, scatter, radiance) =
                whitted::hit(setup, self.photons, &path, &HitLanes::one(&hit), true, &mut self.buffers.found);
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
                return path.radiance.into();
            };
            path = Path { radiance: path.radiance, ..next };
        }
    }

    /// Returns the closest hit of a path's ray under the path transport, and adds the light of the unseen lamps before it.
    fn advance(&mut self, path: &mut Path<f32>) -> Hit {
        let hit = self.meet(path);
        if self.looks {
            self.observer.report(&observe::ray(path, hit));
        }
        if unseen_lamps::exist(self.setup) {
            let (setup, t) = (self.setup, if hit.is_miss() { f32::INFINITY } else { hit.t });
            let found = &mut self.buffers.found;
            path.radiance = path.radiance + unseen_lamps::found(setup, self.photons, path, t, true, found);
            if self.looks {
                for lamp in unseen_lamps::each_found(setup, self.photons, path, t) {
                    self.observer.report(&observe::lamp(path, &lamp));
                }
            }
        }
        hit
    }

    /// Follows a path of the path transport to its end.
    fn trace(&mut self, mut path: Path<f32>) -> Rgb {
        loop {
            let hit = self.advance(&mut path);
            let Some(outcome) = self.vertex(&mut path, hit) else { return path.radiance.into() };
            self.light(&mut path, &outcome);
            self.fork(&outcome);
            match self.onward(&path, &outcome) {
                Some(next) => path = Path { radiance: path.radiance, ..next },
                None => return path.radiance.into(),
            }
        }
    }

    /// Evaluates the vertex where a path has hit something; none if it has hit nothing, and ends.
    fn vertex(&mut self, path: &mut Path<f32>, hit: Hit) -> Option<VertexOutcome<f32>> {
        let setup = self.setup;
        if hit.is_miss() {
            let found = &mut self.buffers.found;
            path.radiance = path.radiance + path_tracing::miss(setup, self.photons, path, true, found);
            if self.looks {
                self.observer.report(&observe::end(path, path.radiance));
            }
            return None;
        }
        let lane = HitLanes::one(&hit);
        let material = material_of(&setup.scene.geometry, &lane, true).0;
        let found = &mut self.buffers.found;
        let outcome = path_tracing::hit(setup, self.photons, path, &lane, material, true, found);
        path.radiance = outcome.radiance;
        if self.looks {
            let decision = decide(setup, self.photons, path, &lane, material);
            observe::path_vertex(path, &decision).for_each(|event| self.observer.report(&event));
            if outcome.shadow.mask {
                let (ray, contribution) = (&outcome.shadow.ray, outcome.shadow.contribution);
                self.observer.report(&observe::path_light(path, &decision, ray, contribution));
            }
        }
        Some(outcome)
    }

    /// Adds the light that a shadow ray brings to a path's vertex.
    fn light(&mut self, path: &mut Path<f32>, outcome: &VertexOutcome<f32>) {
        if !outcome.shadow.mask {
            return;
        }
        self.statistics.rays.shadow += 1;
        let Self { setup, isa, .. } = *self;
        let light = arriving(setup, isa, path, &outcome.shadow, &mut self.buffers.stack);
        if let Some(light) = light {
            path.radiance = connect(path.radiance, light);
            self.find_of(path, &outcome.shadow, light);
        }
        if self.looks {
            self.observer.report(&observe::path_shadow(path, light.is_none(), path.radiance));
        }
    }

    /// Adds the light that a shadow ray brings to that of its group.
    fn find_of(&mut self, path: &Path<f32>, shadow: &ShadowRay<f32>, light: Color<f32>) {
        let group = match self.setup.groups_by_path() {
            true => shadow.path_group,
            false if self.setup.light_groups() == 0 => return,
            false => Wrapping(group_of(self.setup, shadow.emitter.0)),
        };
        self.buffers.found.add(path, group, light, false, true);
    }

    /// Moves the light found by group to a sink.
    fn deposit_groups(&mut self, sink: &mut dyn Sink) {
        sink.take_groups(&mut self.buffers.found);
    }

    /// Returns the continued path, if it goes on.
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

    /// Pushes the path that forks off at a vertex onto the stack.
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

    /// Reports the continuations of a path, or its end.
    fn report_onward(
        &mut self,
        path: &Path<f32>,
        vertex: &WhittedVertex<f32>,
        scatter: &WhittedScatter<f32>,
    ) {
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

    /// Adds the contributions of all samples of all lights.
    fn lights(&mut self, path: &mut Path<f32>, vertex: &whitted::WhittedVertex<f32>) {
        let setup = self.setup;
        for light in 0..setup.scene.lights.len() {
            for which in 0..setup.scene.lights[light].samples {
                let shadow = whitted::light_ray(setup, path, vertex, light, which, true);
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
                    self.find_of(path, &shadow, shadow.contribution);
                }
            }
        }
    }
}
