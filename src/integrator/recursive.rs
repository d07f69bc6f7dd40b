//! Depth first: every sample of a pixel is followed to its end before the next begins,
//! with the single-ray kernels. A fork waits on a stack of our own instead of the
//! thread's, so that no depth overflows it.

use std::num::Wrapping;
use std::ops::Range;

use smallvec::SmallVec;

use super::decision::decide;
use super::observe::{self, Continuation, Observer};
use super::path::{Path, pack_pixel};
use super::presence::Traced;
use super::shadow::connect;
use super::whitted::{Scatter, WhittedVertex};
use super::{Frame, Statistics, begin, path_tracing, whitted};
use crate::bvh::{Asker, Stack, any_ray, closest_ray};
use crate::film::Film;
use crate::math::{Color, Hit, Ray, Rgb};
use crate::shading::HitLanes;
use crate::shading::surface::material_of;
use crate::simd::Level;
use crate::world::Transport;

/// A worker's buffers.
pub struct Recursion {
    stack: Stack,
    forks: SmallVec<[Path<f32>; 32]>,
}

impl Recursion {
    /// For a frame.
    pub fn new(frame: &Frame) -> Self {
        Self { stack: Stack::new(&frame.scene.bvh), forks: SmallVec::new() }
    }

    /// Renders a range of samples of all the film's pixels.
    pub fn render(
        &mut self,
        frame: &Frame,
        level: Level,
        film: &mut Film,
        samples: Range<u32>,
        statistics: &mut Statistics,
        observer: &mut dyn Observer,
    ) {
        let looks = observer.looks();
        let Self { stack, forks } = self;
        let mut tile = Tile { frame, level, statistics, stack, forks, looks, observer };
        let region = film.region();
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                for sample in samples.clone() {
                    let path = begin::begin::<f32>(frame, Wrapping(pack_pixel(x, y)), Wrapping(sample));
                    film.count(x, y, sample);
                    tile.statistics.rays.camera += 1;
                    tile.forks.push(path);
                    while let Some(path) = tile.forks.pop() {
                        let radiance = match frame.transport {
                            Transport::Whitted => tile.follow(path),
                            Transport::Path => tile.trace(path),
                        };
                        film.add(x, y, sample, radiance);
                    }
                }
            }
        }
    }
}

/// What paths are followed with. Of all that happens to them, the way through the tree alone is
/// compiled for each instruction set: the rest exists once, and so without AVX, for up to a sixth more time.
struct Tile<'a> {
    frame: &'a Frame,
    level: Level,
    statistics: &'a mut Statistics,
    stack: &'a mut Stack,
    forks: &'a mut SmallVec<[Path<f32>; 32]>,
    looks: bool,
    observer: &'a mut dyn Observer,
}

impl Tile<'_> {
    /// What a path meets next.
    fn meet(&mut self, path: &Path<f32>) -> Hit {
        let traced = Traced { frame: self.frame, path, shadow: None };
        closest_ray(self.level, &self.frame.scene.bvh, &path.ray(), Asker::new(&traced, 0), self.stack)
    }

    /// Whether something lies between a path's vertex and a light.
    fn is_blocked(&mut self, path: &Path<f32>, ray: Ray<f32>) -> bool {
        self.statistics.rays.shadow += 1;
        let traced = Traced { frame: self.frame, path, shadow: Some(ray) };
        any_ray(self.level, &self.frame.scene.bvh, &ray, Asker::new(&traced, 0), self.stack)
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
            let (vertex, scatter, radiance) = whitted::hit(frame, &path, &one_lane(&hit), true);
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
                self.forks.push(scatter.refracted(&path, &vertex));
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

    /// The same under the path transport, which never forks.
    fn trace(&mut self, mut path: Path<f32>) -> Rgb {
        let frame = self.frame;
        let scene = &frame.scene;
        loop {
            let hit = self.meet(&path);
            if self.looks {
                self.observer.report(&observe::ray(&path, hit));
            }
            if hit.is_miss() {
                let radiance = path_tracing::miss(frame, &path, true);
                if self.looks {
                    self.observer.report(&observe::end(&path, radiance));
                }
                return to_rgb(radiance);
            }
            let lane = one_lane(&hit);
            let material = material_of(&scene.geometry, &lane, true).0;
            let outcome = path_tracing::hit(frame, &path, &lane, material, true);
            path.radiance = outcome.radiance;
            if self.looks {
                let decision = decide(frame, &path, &lane, material);
                observe::path_vertex(&path, &decision).iter().for_each(|event| self.observer.report(event));
                if outcome.shadow.mask {
                    let (ray, contribution) = (&outcome.shadow.ray, outcome.shadow.contribution);
                    self.observer.report(&observe::path_light(&path, &decision, ray, contribution));
                }
            }
            if outcome.shadow.mask {
                let blocked = self.is_blocked(&path, outcome.shadow.ray);
                if !blocked {
                    path.radiance = connect(path.radiance, outcome.shadow.contribution);
                }
                if self.looks {
                    self.observer.report(&observe::path_shadow(&path, blocked, path.radiance));
                }
            }
            if !outcome.goes_on {
                if self.looks {
                    self.observer.report(&observe::end(&path, path.radiance));
                }
                return to_rgb(path.radiance);
            }
            if self.looks {
                self.observer.report(&observe::onward(Continuation::Scatter, &outcome.next));
            }
            self.statistics.rays.scatter += 1;
            path = Path { radiance: path.radiance, ..outcome.next };
        }
    }

    /// Where the path goes on, or what it ends with.
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
                let blocked = self.is_blocked(path, shadow.ray);
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
fn one_lane(hit: &Hit) -> HitLanes<f32> {
    HitLanes {
        t: hit.t,
        u: hit.u,
        v: hit.v,
        primitive: Wrapping(hit.primitive),
        instance: Wrapping(hit.instance),
    }
}

#[inline(always)]
fn to_rgb(color: Color<f32>) -> Rgb {
    Rgb::new(color.r, color.g, color.b)
}
