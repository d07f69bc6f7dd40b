//! A wave: the queues of a worker, its samples and its clock.

use std::ops::Range;
use std::time::Instant;

use super::material_ranges::MaterialRanges;
use super::path_stages::{EndQueue, HitRoles};
use super::queue::{HitQueue, PathQueue, RayLimits};
use super::shadow_queue::ShadowQueue;
use super::vertices::VertexQueue;
use crate::bvh::Stack;
use crate::film::Region;
use crate::integrator::observe::Observer;
use crate::integrator::path::columns::{Columns, PADDING};
use crate::integrator::path::light_groups::GroupQueue;
use crate::integrator::path::pack_pixel;
use crate::integrator::reuse::{Connections, PathSlots};
use crate::integrator::{RayStatistics, RenderSetup, Sorting, Stage};
use crate::simd::Isa;

/// A worker's queues, allocated once.
pub struct Wave {
    /// Paths of the wave.
    pub(super) paths: PathQueue,
    pub(super) hits: HitQueue,
    pub(super) vertices: VertexQueue,
    pub(super) reflect: PathQueue,
    pub(super) refract: PathQueue,
    pub(super) shadow: ShadowQueue,
    /// Photons that have ended, if there may be any photons.
    pub(super) ended: Option<EndQueue>,
    /// Forks without a place in the wave; last in, first out, so that the queue stays short.
    pub(super) pending: PathQueue,
    /// Paths that are not reused; those that are go first.
    pub(super) alone: PathQueue,
    pub(super) goes_on: Vec<u32>,
    pub(super) roles: HitRoles,
    pub(super) shared: Option<ReuseBuffers>,
    /// The light that paths have found since the last stage that took it, by group.
    pub(super) found: GroupQueue,
    pub(super) occluded: Vec<u32>,
    pub(super) pixels: Vec<u32>,
    pub(super) samples: Vec<u32>,
    pub(super) groups: MaterialRanges,
    pub(super) ends: RayLimits,
    pub(super) stack: Stack,
    /// The instruction set of queries, if another than that of the stages.
    pub(super) traversal: Option<Isa>,
}

impl Wave {
    /// Creates queues for waves of `capacity` paths, at least 1.
    pub fn new(setup: &RenderSetup, capacity: usize, sorting: Sorting) -> Self {
        let shared = setup.sharing.map(|_| ReuseBuffers::new(setup, capacity));
        // Reused paths go through the wave together.
        let capacity = shared.as_ref().map_or(capacity, ReuseBuffers::paths).max(1);
        let integers = || vec![0; capacity + PADDING];
        Self {
            paths: PathQueue::new(setup, capacity),
            hits: HitQueue(Columns::new(capacity)),
            vertices: VertexQueue(Columns::new(capacity)),
            reflect: PathQueue::new(setup, capacity),
            refract: PathQueue::new(setup, capacity),
            shadow: ShadowQueue::new(setup, capacity),
            ended: setup.photons.is_ok().then(|| EndQueue(Columns::new(capacity))),
            pending: PathQueue::new(setup, capacity),
            alone: PathQueue::new(setup, 0),
            goes_on: integers(),
            roles: if shared.is_some() { HitRoles::new(capacity) } else { HitRoles::default() },
            shared,
            found: GroupQueue::default(),
            occluded: integers(),
            pixels: integers(),
            samples: integers(),
            groups: MaterialRanges::new(capacity, setup.scene.materials.len(), sorting),
            ends: RayLimits::new(capacity + PADDING),
            stack: Stack::new(&setup.scene.bvh),
            traversal: None,
        }
    }

    /// Traces rays with another instruction set than that of the stages.
    pub fn with_traversal(self, traversal: Option<Isa>) -> Self {
        Self { traversal, ..self }
    }
}

/// The buffers of path reuse in addition to the queues.
pub(super) struct ReuseBuffers {
    pub(super) slots: PathSlots,
    pub(super) connections: Connections,
    pub(super) paths: usize,
}

impl ReuseBuffers {
    /// Creates buffers for waves of about `capacity` paths.
    pub fn new(setup: &RenderSetup, capacity: usize) -> Self {
        let pixels = setup.sharing.map_or(1, |grouping| grouping.pixels());
        let units = (capacity / pixels).max(1);
        Self {
            slots: PathSlots::new(setup, units),
            connections: Connections::default(),
            paths: units * pixels,
        }
    }

    /// The number of paths in a wave.
    pub fn paths(&self) -> usize {
        self.paths
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> usize {
        self.slots.bytes() + self.connections.bytes()
    }
}

/// The samples of a tile that have not begun, in blocks of 8 × 8 pixels. Within a block all samples of a pixel follow
/// each other, so that neighbours in the wave are neighbours in the image. If paths gather photons, all pixels of a
/// sample follow each other instead, because each sample has its own photons.
pub(super) struct SampleCursor {
    pub(super) samples: Range<u32>,
    /// The pixels of each block, which are repeated for all samples.
    pub(super) runs: Vec<Vec<u32>>,
    pub(super) by_sample: bool,
    /// The next run, and the next sample of its pixels.
    pub(super) next_run: usize,
    pub(super) next: u32,
}

impl SampleCursor {
    const BLOCK: u32 = 8;

    pub(super) fn new(
        region: Region,
        samples: Range<u32>,
        by_sample: bool,
        holds: &dyn Fn(u32, u32) -> bool,
    ) -> Self {
        let mut runs = Vec::new();
        for by in (region.y0..region.y1).step_by(Self::BLOCK as usize) {
            for bx in (region.x0..region.x1).step_by(Self::BLOCK as usize) {
                let rows = by..(by + Self::BLOCK).min(region.y1);
                let row = |y| (bx..(bx + Self::BLOCK).min(region.x1)).map(move |x| (x, y));
                let pixels = rows.flat_map(row).filter(|(x, y)| holds(*x, *y));
                runs.push(pixels.map(|(x, y)| pack_pixel(x, y)).collect());
            }
        }
        Self { samples, runs, by_sample, next_run: 0, next: 0 }
    }

    /// Fills both columns from the front; returns how many places it filled.
    pub(super) fn next_batch(&mut self, pixels: &mut [u32], samples: &mut [u32]) -> usize {
        let mut count = 0;
        while count < pixels.len()
            && let Some(run) = self.runs.get(self.next_run)
        {
            let (all, every) = (run.len() as u32, self.samples.end - self.samples.start);
            if self.next == all * every {
                (self.next_run, self.next) = (self.next_run + 1, 0);
                continue;
            }
            let (pixel, sample) = match self.by_sample {
                true => (self.next % all, self.next / all),
                false => (self.next / every, self.next % every),
            };
            (pixels[count], samples[count]) = (run[pixel as usize], self.samples.start + sample);
            (count, self.next) = (count + 1, self.next + 1);
        }
        count
    }
}

/// A clock that charges the time since the last stage to the present one.
pub(super) struct StageClock<'a> {
    pub(super) statistics: &'a mut RayStatistics,
    pub(super) last: Instant,
    pub(super) observer: &'a mut dyn Observer,
}

impl StageClock<'_> {
    /// Ends a stage which that many items have entered.
    pub(super) fn stage(&mut self, stage: Stage, items: usize) {
        let now = Instant::now();
        self.statistics.stages[stage as usize] += now - self.last;
        self.last = now;
        self.observer.mark(stage, items);
    }
}
