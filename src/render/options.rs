//! Render options.

use super::{Isa, Schedule, Sorting};
use crate::film::Region;
use crate::integrator::schedule::wavefront::wave::Wave;
use crate::integrator::{RenderSetup, Worker};

/// The default number of paths in a wave. Measured: 256 to 16,384 are equally fast, 65,536 is up to 1.28 times slower.
pub const DEFAULT_WAVE: usize = 4096;
/// The least number of paths to which the wave of a small image is reduced: it may fork paths, or get more samples.
const LEAST_WAVE: usize = 256;

/// The options of a render. Apart from the region, none of them changes the image.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// The order in which rays are traced.
    pub schedule: Schedule,
    /// The number of paths in a wave of the wavefront schedule, at least 1.
    pub wave: usize,
    /// The order in which a wave's hits are shaded.
    pub sorting: Sorting,
    /// The instruction set; the widest one by default.
    pub isa: Isa,
    /// The instruction set in which a wave's rays are traced, if another than that of its stages.
    pub traversal: Option<Isa>,
    /// The part of the image to render, in pixels; `None` for all of it. It is clipped to the image.
    pub region: Option<Region>,
    /// The width and height of a tile in pixels, at least 1. With path reuse, rounded up to a multiple
    /// of its blocks.
    pub tile: u32,
    /// True if the variance of pixels is estimated; samples are then rendered one by one, which takes longer.
    pub variance: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            schedule: Schedule::Wavefront,
            wave: DEFAULT_WAVE,
            sorting: Sorting::default(),
            isa: Isa::detect(),
            traversal: None,
            region: None,
            tile: 64,
            variance: false,
        }
    }
}

impl Options {
    /// Creates a worker.
    pub(crate) fn worker(&self, setup: &RenderSetup) -> Worker {
        Worker::new(setup, self.schedule, self.wave(setup), self.sorting).with_traversal(self.traversal)
    }

    /// Returns [`fitting_wave`] for the rendered part.
    pub(super) fn wave(&self, setup: &RenderSetup) -> usize {
        fitting_wave(self.wave, self.region_of(setup.size), setup)
    }

    /// Creates the queues of a worker of the wavefront schedule.
    pub(super) fn queues(&self, setup: &RenderSetup) -> Wave {
        Wave::new(setup, self.wave, self.sorting).with_traversal(self.traversal)
    }

    /// Returns the rendered part of an image of this size.
    pub(super) fn region_of(&self, [width, height]: [u32; 2]) -> Region {
        let Region { x0, y0, x1, y1 } = self.region.unwrap_or(Region::whole([width, height]));
        let (x1, y1) = (x1.min(width), y1.min(height));
        Region { x0: x0.min(x1), y0: y0.min(y1), x1, y1 }
    }
}

/// Reduces the number of paths in a wave to that of a small image: to allocate the queues of 4,096 paths takes half a
/// millisecond.
pub(super) fn fitting_wave(wave: usize, region: Region, setup: &RenderSetup) -> usize {
    wave.min(region.area().saturating_mul(setup.samples.cells() as usize).max(LEAST_WAVE))
}
