//! Depth first: every sample of a pixel is followed to its end before the next begins,
//! with the single-ray kernels. A fork waits on a stack of our own instead of the
//! thread's, so that no depth overflows it.

use std::num::Wrapping;
use std::ops::Range;

use smallvec::SmallVec;

use super::path::{Path, pack_pixel};
use super::shadow::{ShadowRay, connect};
use super::{Frame, Statistics, begin, path_tracing, whitted};
use crate::bvh::Stack;
use crate::bvh::traverse::{any_one, closest_one};
use crate::film::Film;
use crate::math::{Color, Hit, Rgb};
use crate::shading::HitLanes;
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
    pub fn render(
        &mut self,
        frame: &Frame,
        level: Level,
        film: &mut Film,
        samples: Range<u32>,
        statistics: &mut Statistics,
    ) {
        dispatch(level, Tile { frame, film, samples, statistics, recursion: self });
    }
}

struct Tile<'a> {
    frame: &'a Frame,
    film: &'a mut Film,
    samples: Range<u32>,
    statistics: &'a mut Statistics,
    recursion: &'a mut Recursion,
}

impl Kernel for Tile<'_> {
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

impl Tile<'_> {
    /// Follows a path to its end and returns its radiance; forks go onto the stack.
    #[inline(always)]
    fn follow<L: Lanes>(&mut self, mut path: Path<f32>) -> Rgb {
        let frame = self.frame;
        loop {
            let hit = closest_one::<L>(&frame.scene.bvh, &path.ray(), &mut self.recursion.stack);
            if hit.is_miss() {
                return to_rgb(whitted::miss(frame, &path));
            }
            let (vertex, scatter, radiance) = whitted::hit(frame, &path, &one_lane(&hit), true);
            path.radiance = radiance;
            self.lights::<L>(&mut path, &vertex);
            self.statistics.rays.reflect += scatter.reflects as u64;
            self.statistics.rays.refract += scatter.refracts as u64;
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
            if hit.is_miss() {
                return to_rgb(path_tracing::miss(frame, &path, true));
            }
            let material = scene.geometry.material_of(hit.primitive, hit.instance);
            let outcome = path_tracing::hit(frame, &path, &one_lane(&hit), material, true);
            path.radiance = outcome.radiance;
            if outcome.shadow.mask {
                self.statistics.rays.shadow += 1;
                let arrives = self.arriving::<L>(outcome.shadow);
                path.radiance = arrives.map_or(path.radiance, |light| connect(path.radiance, light));
            }
            if !outcome.goes_on {
                return to_rgb(path.radiance);
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
            let material = scene.geometry.material_of(hit.primitive, hit.instance);
            let (left, passes) = path_tracing::shadow_hit(frame, &shadow, &one_lane(&hit), material, true);
            if !passes {
                return None;
            }
            shadow.contribution = left;
            shadow.ray.t_min = hit.t;
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
                if !any_one::<L>(&frame.scene.bvh, &shadow.ray, &mut self.recursion.stack) {
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
