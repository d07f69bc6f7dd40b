//! The first hits of camera rays: short waves over the same rays as the image's, separate from the rendering, whose
//! stages do not need them.

use std::num::Wrapping;

use super::queue::{HitQueue, PathAnyHit, PathQueue, RayLimits};
use super::stages::GenerateStage;
use super::wave::SampleCursor;
use crate::bvh::{self, Coherence, Stack};
use crate::film::{Features, FirstHit, Gathering, Region, SampleRanges};
use crate::integrator::RenderSetup;
use crate::integrator::path::columns::{Columns, PADDING};
use crate::integrator::path::{Path, unpack_pixel};
use crate::math::{NONE, Vector};
use crate::shading::whitted_params::Shaded;
use crate::shading::{HitLanes, ShadingPoint, Surface};
use crate::simd::{Isa, dispatch};
use crate::world::Transport;

/// A worker's queues, allocated once.
pub struct FirstHits {
    paths: PathQueue,
    hits: HitQueue,
    found: Vec<Option<FirstHit>>,
    pixels: Vec<u32>,
    samples: Vec<u32>,
    ends: RayLimits,
    stack: Stack,
}

impl FirstHits {
    /// Creates queues for waves of `capacity` paths, at least 1.
    pub fn new(setup: &RenderSetup, capacity: usize) -> Self {
        let capacity = capacity.max(1);
        Self {
            paths: PathQueue::new(setup, capacity),
            hits: HitQueue(Columns::new(capacity)),
            found: vec![None; capacity],
            pixels: vec![0; capacity + PADDING],
            samples: vec![0; capacity + PADDING],
            ends: RayLimits::new(capacity + PADDING),
            stack: Stack::new(&setup.scene.bvh),
        }
    }

    /// Returns the first hits of all of a tile's pixels, row by row.
    pub fn look(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        tile: Region,
        samples: &SampleRanges,
    ) -> Vec<Features> {
        let [all] = self.trace_by_parity(setup, isa, tile, samples);
        all
    }

    /// Returns the first hits of every Nth sample separately: with 2 of even and of odd samples.
    pub fn trace_by_parity<const N: usize>(
        &mut self,
        setup: &RenderSetup,
        isa: Isa,
        tile: Region,
        samples: &SampleRanges,
    ) -> [Vec<Features>; N] {
        let mut features = [(); N].map(|()| vec![Features::NOTHING; tile.area()]);
        let mut parts = [(); N].map(|()| Gathering::default());
        let mut todo = SampleCursor::new(tile, 0..samples.count(), false, &|_, _| true);
        let last = samples.iter().last().map_or(0, |range| range.end - 1);
        loop {
            let capacity = self.found.len();
            let count = todo.next_batch(&mut self.pixels[..capacity], &mut self.samples[..capacity]);
            if count == 0 {
                return features;
            }
            for place in &mut self.samples[..count] {
                *place = samples.nth(*place).unwrap_or(last);
            }
            self.trace(setup, isa, count);
            for at in 0..count {
                parts[self.samples[at] as usize % N].add(self.found[at].as_ref());
                if self.samples[at] == last {
                    let (x, y) = unpack_pixel(self.pixels[at]);
                    for (features, part) in features.iter_mut().zip(&mut parts) {
                        features[tile.index(x, y)] = part.take();
                    }
                }
            }
        }
    }

    /// Traces the first `count` samples and stores their hits in `found`.
    fn trace(&mut self, setup: &RenderSetup, isa: Isa, count: usize) {
        self.paths.columns.clear();
        let (pixels, samples, out) = (&self.pixels, &self.samples, &mut self.paths);
        dispatch(isa, GenerateStage { setup, pixels, samples, count, out });
        let surfaces = PathAnyHit { setup, paths: &self.paths };
        let (rays, hits) = (self.paths.rays(&self.ends, &surfaces), self.hits.columns(count));
        bvh::closest(isa, &setup.scene.bvh, rays, Coherence::Unknown, &mut self.stack, hits);
        for at in 0..count {
            let (path, hit) = (self.paths.load::<f32>(at), self.hits.load::<f32>(at));
            self.found[at] = (hit.primitive != Wrapping(NONE)).then(|| look_up(setup, &path, &hit));
        }
    }
}

/// Evaluates a hit as the transport does.
fn look_up(setup: &RenderSetup, path: &Path<f32>, hit: &HitLanes<f32>) -> FirstHit {
    let scene = &setup.scene;
    let surface = Surface::new(&scene.geometry, &path.ray(), hit, true);
    let (material, width) = (surface.material.0, path.width + path.spread * hit.t);
    let (normal, albedo) = match setup.transport {
        Transport::Whitted => {
            let shaded = Shaded::new(scene, hit, &surface, path.direction, width, true);
            (shaded.normal, shaded.model.diffuse)
        }
        Transport::Path => {
            let point = ShadingPoint::new(scene, material, hit, &surface, path.direction, width, true);
            (point.normal(), point.base_color())
        }
    };
    let camera = &scene.camera;
    let from_camera = surface.position - Vector::splat(camera.origin);
    FirstHit {
        depth_m: if camera.is_flat() { from_camera.dot(Vector::splat(camera.forward)) } else { hit.t },
        normal: [normal.x, normal.y, normal.z],
        albedo: albedo.into(),
        position: [surface.position.x, surface.position.y, surface.position.z],
        entity: scene.geometry.entity_of(hit.primitive.0, hit.instance.0),
        material,
    }
}
