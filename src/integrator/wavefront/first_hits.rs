//! What camera rays hit first: short waves over the same rays as the image's, apart from the
//! rendering, whose stages know nothing of it.

use std::num::Wrapping;
use std::ops::Range;

use super::Todo;
use super::queue::{Columns, HitQueue, PADDING, PathQueue};
use super::stages::Generate;
use crate::bvh::{self, Coherence, Stack};
use crate::film::{Features, FirstHit, Gathering, Region};
use crate::integrator::path::{Path, unpack_pixel};
use crate::integrator::{Frame, path_tracing};
use crate::math::{Color, NONE, Rgb, Vector};
use crate::shading::principled::Spot;
use crate::shading::{HitLanes, Shaded, Surface};
use crate::simd::{Level, dispatch};
use crate::world::Transport;

/// A worker's queues, made once.
pub struct FirstHits {
    paths: PathQueue,
    hits: HitQueue,
    /// The place in the wave at which each path began.
    places: Vec<u32>,
    found: Vec<Option<FirstHit>>,
    pixels: Vec<u32>,
    samples: Vec<u32>,
    t_max: Vec<f32>,
    stack: Stack,
}

impl FirstHits {
    /// For waves of `capacity` paths, at least 1.
    pub fn new(frame: &Frame, capacity: usize) -> Self {
        let capacity = capacity.max(1);
        Self {
            paths: PathQueue(Columns::new(capacity)),
            hits: HitQueue(Columns::new(capacity)),
            places: vec![0; capacity],
            found: vec![None; capacity],
            pixels: vec![0; capacity + PADDING],
            samples: vec![0; capacity + PADDING],
            t_max: vec![f32::INFINITY; capacity],
            stack: Stack::new(&frame.scene.bvh),
        }
    }

    /// Of all a tile's pixels, row by row.
    pub fn look(&mut self, frame: &Frame, level: Level, tile: Region, samples: Range<u32>) -> Vec<Features> {
        let mut features = vec![Features::NOTHING; tile.area()];
        let mut pixel = Gathering::default();
        let mut todo = Todo::new(tile, samples.clone());
        let last = samples.end.wrapping_sub(1);
        loop {
            let capacity = self.found.len();
            let count = todo.take(&mut self.pixels[..capacity], &mut self.samples[..capacity]);
            if count == 0 {
                return features;
            }
            self.trace(frame, level, count);
            for at in 0..count {
                pixel.add(self.found[at].as_ref());
                if self.samples[at] == last {
                    let (x, y) = unpack_pixel(self.pixels[at]);
                    features[tile.index(x, y)] = pixel.take();
                }
            }
        }
    }

    /// Fills the first `count` places of what has been found.
    fn trace(&mut self, frame: &Frame, level: Level, count: usize) {
        self.paths.0.clear();
        let (pixels, samples, out) = (&self.pixels, &self.samples, &mut self.paths);
        dispatch(level, Generate { frame, pixels, samples, count, out });
        self.found[..count].fill(None);
        (0..count).for_each(|at| self.places[at] = at as u32);
        while !self.paths.0.is_empty() {
            let count = self.paths.0.len();
            let (rays, hits) = (self.paths.rays(&self.t_max), self.hits.columns(count));
            bvh::closest(level, &frame.scene.bvh, rays, Coherence::Unknown, &mut self.stack, hits);
            let mut kept = 0;
            for at in 0..count {
                let (path, hit) = (self.paths.load::<f32>(at), self.hits.load::<f32>(at));
                if hit.primitive == Wrapping(NONE) {
                    continue;
                }
                let found = look_up(frame, &path, &hit);
                self.found[self.places[at] as usize] = found;
                if found.is_none() {
                    // In place: what is written lies at or before what has been read.
                    let onward = Path { t_min: hit.t, ..path };
                    self.paths.store(kept, true, &onward, Wrapping(NONE));
                    self.places[kept] = self.places[at];
                    kept += 1;
                }
            }
            self.paths.0.set_len(kept);
        }
    }
}

/// A hit as the transport sees it; none where the surface is not there for this sample.
fn look_up(frame: &Frame, path: &Path<f32>, hit: &HitLanes<f32>) -> Option<FirstHit> {
    let scene = &frame.scene;
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, true);
    let (normal, albedo) = match frame.transport {
        Transport::Whitted => {
            let shaded = Shaded::new(&scene.materials, &scene.textures, &surface, true);
            (surface.normal, shaded.diffuse)
        }
        Transport::Path => principled(frame, path, hit, &surface)?,
    };
    let camera = &scene.camera;
    let from_camera = surface.position - Vector::splat(camera.origin);
    Some(FirstHit {
        depth_m: from_camera.dot(Vector::splat(camera.forward)),
        normal: [normal.x, normal.y, normal.z],
        albedo: Rgb::new(albedo.r, albedo.g, albedo.b),
        position: [surface.position.x, surface.position.y, surface.position.z],
        entity: scene.geometry.entity_of(hit.primitive.0, hit.instance.0),
        material: surface.material.0,
    })
}

/// Shading normal and base colour under the path transport.
fn principled(
    frame: &Frame,
    path: &Path<f32>,
    hit: &HitLanes<f32>,
    surface: &Surface<f32>,
) -> Option<(Vector<f32>, Color<f32>)> {
    let width = path.width + path.spread * hit.t;
    let material = surface.material.0;
    let spot = Spot::new(&frame.scene, material, hit, surface, path.direction, width, true);
    let passes = path_tracing::passing(frame, path, hit, &spot, true);
    (!passes).then(|| (spot.normal(), spot.base_color()))
}
