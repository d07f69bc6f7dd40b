//! Depth first: every sample of a pixel is followed to its end before the next begins,
//! with the single-ray kernels. A fork waits on a stack of our own instead of the
//! thread's, so that no depth overflows it.

use std::num::Wrapping;
use std::ops::Range;

use smallvec::SmallVec;

use super::look::look;
use super::observe::{self, Observer, Way};
use super::path::{Path, pack_pixel};
use super::shadow::{ShadowRay, connect};
use super::whitted::{Scatter, Vertex};
use super::{Frame, Statistics, begin, path_tracing, whitted};
use crate::bvh::Stack;
use crate::bvh::traverse::{any_one, closest_one};
use crate::film::Film;
use crate::math::{Color, Hit, Rgb};
use crate::shading::HitLanes;
use crate::shading::surface::material_of;
use crate::simd::{Kernel, Lanes, Level, dispatch};
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
    pub fn render<O: Observer>(
        &mut self,
        frame: &Frame,
        level: Level,
        film: &mut Film,
        samples: Range<u32>,
        statistics: &mut Statistics,
        observer: &mut O,
    ) {
        dispatch(level, Tile { frame, film, samples, statistics, recursion: self, observer });
    }
}

struct Tile<'a, O> {
    frame: &'a Frame,
    film: &'a mut Film,
    samples: Range<u32>,
    statistics: &'a mut Statistics,
    recursion: &'a mut Recursion,
    observer: &'a mut O,
}

impl<O: Observer> Kernel for Tile<'_, O> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let region = self.film.region();
        for y in region.y0..region.y1 {
            for x in region.x0..region.x1 {
                for sample in self.samples.clone() {
                    let pixel = Wrapping(pack_pixel(x, y));
                    let path = begin::begin::<f32>(self.frame, pixel, Wrapping(sample));
                    self.film.count(x, y, sample);
                    self.statistics.rays.camera += 1;
                    self.recursion.forks.push(path);
                    while let Some(path) = self.recursion.forks.pop() {
                        let radiance = match self.frame.transport {
                            Transport::Whitted => self.follow::<L>(path),
                            Transport::Path => self.trace::<L>(path),
                        };
                        self.film.add(x, y, sample, radiance);
                    }
                }
            }
        }
    }
}

impl<O: Observer> Tile<'_, O> {
    /// Follows a path to its end and returns its radiance; forks go onto the stack.
    #[inline(always)]
    fn follow<L: Lanes>(&mut self, mut path: Path<f32>) -> Rgb {
        let frame = self.frame;
        loop {
            let hit = closest_one::<L>(&frame.scene.bvh, &path.ray(), &mut self.recursion.stack);
            if O::LOOKS {
                self.observer.report(&observe::ray(&path, hit));
            }
            if hit.is_miss() {
                let radiance = whitted::miss(frame, &path);
                if O::LOOKS {
                    self.observer.report(&observe::end(&path, radiance));
                }
                return to_rgb(radiance);
            }
            let (vertex, scatter, radiance) = whitted::hit(frame, &path, &one_lane(&hit), true);
            path.radiance = radiance;
            if O::LOOKS {
                let (own, shading) = (vertex.geometric_normal, vertex.normal);
                self.observer.report(&observe::vertex(&path, vertex.position, own, shading));
            }
            self.lights::<L>(&mut path, &vertex);
            self.statistics.rays.reflect += scatter.reflects as u64;
            self.statistics.rays.refract += scatter.refracts as u64;
            if O::LOOKS {
                self.tell_onward(&path, &vertex, &scatter);
            }
            if scatter.forks() {
                self.recursion.forks.push(scatter.refracted(&path, &vertex));
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
    #[inline(always)]
    fn trace<L: Lanes>(&mut self, mut path: Path<f32>) -> Rgb {
        let frame = self.frame;
        let scene = &frame.scene;
        loop {
            let hit = closest_one::<L>(&scene.bvh, &path.ray(), &mut self.recursion.stack);
            if O::LOOKS {
                self.observer.report(&observe::ray(&path, hit));
            }
            if hit.is_miss() {
                let radiance = path_tracing::miss(frame, &path, true);
                if O::LOOKS {
                    self.observer.report(&observe::end(&path, radiance));
                }
                return to_rgb(radiance);
            }
            let lane = one_lane(&hit);
            let material = material_of(&scene.geometry, &lane, true).0;
            let outcome = path_tracing::hit(frame, &path, &lane, material, true);
            path.radiance = outcome.radiance;
            if O::LOOKS {
                let look = look(frame, &path, &lane, material);
                observe::path_vertex(&path, &look).iter().for_each(|event| self.observer.report(event));
                if outcome.shadow.mask {
                    let (ray, contribution) = (&outcome.shadow.ray, outcome.shadow.contribution);
                    self.observer.report(&observe::path_light(&path, &look, ray, contribution));
                }
            }
            if outcome.shadow.mask {
                self.statistics.rays.shadow += 1;
                let arrives = self.arriving::<L>(outcome.shadow);
                let lit = arrives.map_or(path.radiance, |light| connect(path.radiance, light));
                if O::LOOKS {
                    self.observer.report(&observe::path_shadow(&path, arrives.is_none(), lit));
                }
                path.radiance = lit;
            }
            if !outcome.goes_on {
                if O::LOOKS {
                    self.observer.report(&observe::end(&path, path.radiance));
                }
                return to_rgb(path.radiance);
            }
            if O::LOOKS {
                self.observer.report(&observe::onward(Way::Scatter, &outcome.next));
            }
            self.statistics.rays.scatter += 1;
            path = Path { radiance: path.radiance, ..outcome.next };
        }
    }

    /// What reaches the end of a shadow ray, if anything.
    #[inline(always)]
    fn arriving<L: Lanes>(&mut self, mut shadow: ShadowRay<f32>) -> Option<Color<f32>> {
        let (frame, stack) = (self.frame, &mut self.recursion.stack);
        let scene = &frame.scene;
        if !scene.has_cutouts {
            let blocked = any_one::<L>(&scene.bvh, &shadow.ray, stack);
            return (!blocked).then_some(shadow.contribution);
        }
        loop {
            let hit = closest_one::<L>(&scene.bvh, &shadow.ray, stack);
            if hit.is_miss() {
                return Some(shadow.contribution);
            }
            let lane = one_lane(&hit);
            let material = material_of(&scene.geometry, &lane, true).0;
            let (left, passes) = path_tracing::shadow_hit(frame, &shadow, &lane, material, true);
            if !passes {
                return None;
            }
            shadow.contribution = left;
            shadow.ray.t_min = hit.t;
        }
    }

    /// Where the path goes on, or what it ends with.
    fn tell_onward(&mut self, path: &Path<f32>, vertex: &Vertex<f32>, scatter: &Scatter<f32>) {
        if scatter.reflects {
            self.observer.report(&observe::onward(Way::Reflect, &scatter.reflected(path, vertex)));
        }
        if scatter.refracts {
            self.observer.report(&observe::onward(Way::Refract, &scatter.refracted(path, vertex)));
        }
        if !scatter.reflects && !scatter.refracts {
            self.observer.report(&observe::end(path, path.radiance));
        }
    }

    /// Adds what arrives from every sample of every light.
    #[inline(always)]
    fn lights<L: Lanes>(&mut self, path: &mut Path<f32>, vertex: &whitted::Vertex<f32>) {
        let frame = self.frame;
        for light in 0..frame.scene.lights.len() {
            for which in 0..frame.scene.lights[light].samples() {
                let shadow = whitted::light_ray(frame, path, vertex, light, which, true);
                if !shadow.mask {
                    continue;
                }
                self.statistics.rays.shadow += 1;
                let blocked = any_one::<L>(&frame.scene.bvh, &shadow.ray, &mut self.recursion.stack);
                if O::LOOKS {
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
