//! How to render.

use super::{Isa, Schedule, Sorting};
use crate::film::Region;

/// How many paths a wave has unless told otherwise. Measured: 256 to 16,384 are equally fast, 65,536 is up to 1.28
/// times slower.
pub const DEFAULT_WAVE: usize = 4096;

/// How to render what the settings say. Apart from the region, none of this changes the image.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// In which order rays are traced.
    pub schedule: Schedule,
    /// How many paths a wave of the wavefront schedule has, at least 1.
    pub wave: usize,
    /// In which order a wave's hits are shaded.
    pub sorting: Sorting,
    /// Which instruction set; the widest one by default.
    pub isa: Isa,
    /// The part of the image to render, in pixels; `None` for all of it. What lies outside the image is left out.
    pub region: Option<Region>,
    /// Width and height of a tile in pixels, at least 1. Where pixels share paths, the next multiple of 16.
    pub tile: u32,
    /// True if the variance of pixels is wanted, for which samples are rendered one by one, which takes longer.
    pub variance: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            schedule: Schedule::Wavefront,
            wave: DEFAULT_WAVE,
            sorting: Sorting::default(),
            isa: Isa::detect(),
            region: None,
            tile: 64,
            variance: false,
        }
    }
}

impl Options {
    /// The part of an image that is rendered.
    pub(super) fn region_of(&self, [width, height]: [u32; 2]) -> Region {
        let Region { x0, y0, x1, y1 } = self.region.unwrap_or(Region::whole([width, height]));
        let (x1, y1) = (x1.min(width), y1.min(height));
        Region { x0: x0.min(x1), y0: y0.min(y1), x1, y1 }
    }
}
