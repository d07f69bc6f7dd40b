//! How much memory a rendering takes in addition to its scene.

use super::{DEFAULT_WAVE, Options, photons};
use crate::denoise;
use crate::film::{Features, PixelSum, Region};
use crate::formats::film_file::packed_bytes;
use crate::integrator::wavefront::Wave;
use crate::integrator::{RenderSetup, Schedule};
use crate::math::Rgb;
use crate::memory::{self, Shortage};
use crate::world::{Adaptive, Aov, Settings};

/// What a thread takes: the used part of its stack, and what the allocator sets aside for it.
const THREAD: usize = 5 << 19;

/// The memory of a thread for which there is no tile.
const IDLE_THREAD: usize = 1 << 15;

/// The number of channels in a file with all output variables, including light and A.
const MOST_CHANNELS: usize = 21;

/// Paths of a wave that is made to be measured.
const MEASURED: usize = 1024;

/// What decides how much memory a rendering takes.
pub struct MemoryEstimate {
    /// Pixels.
    pub region: Region,
    /// Whether an OpenEXR file is written.
    pub to_openexr: bool,
    /// Whether the image is denoised.
    pub denoises: bool,
    /// In which order.
    pub schedule: Schedule,
    /// Paths of a wave.
    pub wave: usize,
    /// Pictures that are shown meanwhile.
    pub shown: usize,
    /// True if films are saved meanwhile.
    pub saves_film: bool,
    /// True if there is a film already, to go on with.
    pub has_film: bool,
}

impl MemoryEstimate {
    /// The defaults.
    pub fn usual(region: Region) -> MemoryEstimate {
        MemoryEstimate {
            region,
            to_openexr: false,
            denoises: false,
            schedule: Schedule::Wavefront,
            wave: DEFAULT_WAVE,
            shown: 0,
            saves_film: true,
            has_film: false,
        }
    }

    /// In bytes.
    pub fn bytes(&self, setup: &RenderSetup, settings: &Settings) -> u64 {
        let area = self.region.area() as u64;
        let squares = if settings.aov.contains(&Aov::Variance) { size_of::<[u128; 3]>() } else { 0 };
        // A pilot has a film of its own.
        let pilot = if settings.adaptive == Adaptive::Unbiased { size_of::<PixelSum>() } else { 0 };
        let sums = if self.has_film { 0 } else { size_of::<PixelSum>() + squares + pilot };
        // At the end, the picture that is made of the sums, and its bytes on the way to a file.
        let mut picture = size_of::<Rgb>() + 4;
        if !settings.aov.is_empty() {
            picture += size_of::<Features>() + 2 * 4 * MOST_CHANNELS;
        }
        if self.to_openexr {
            // Channel by channel.
            picture += size_of::<Rgb>();
        }
        if self.denoises {
            picture += denoise::BYTES + 2 * size_of::<Features>();
        }
        // Before, what is shown and saved meanwhile. A film is written as it is: there is no copy of it.
        let shown = area.saturating_mul((self.shown * size_of::<Rgb>()) as u64);
        let packed = if self.saves_film { packed_bytes(self.region, squares > 0) } else { 0 };
        let above = area.saturating_mul(picture as u64).max(shown.saturating_add(packed));
        let queues = match self.schedule {
            // A wave takes memory in proportion to its size.
            Schedule::Wavefront => {
                Wave::new(setup, MEASURED, Default::default()).bytes() / MEASURED * self.wave
            }
            Schedule::Recursive => 0,
        };
        let tile = Options::default().tile;
        let worker = queues + (tile * tile) as usize * size_of::<PixelSum>() + THREAD;
        let threads = rayon::current_num_threads();
        let workers = threads.min(tiles(self.region, tile));
        let of_threads = workers * worker + (threads - workers) * IDLE_THREAD;
        area.saturating_mul(sums as u64)
            .saturating_add(above)
            .saturating_add(of_threads as u64)
            .saturating_add(photons::PhotonBytes::most(setup).total())
    }

    /// Checks whether there is enough memory.
    pub fn check(&self, setup: &RenderSetup, settings: &Settings) -> Result<(), Shortage> {
        let (width, height) = (self.region.width(), self.region.height());
        let what = format_args!("an image of {width}x{height}");
        let claim = memory::reserve(what, self.bytes(setup, settings));
        claim.map(|_| ()).map_err(|shortage| shortage.or("use --crop or a smaller --size"))
    }
}

/// How many tiles a region is cut into.
fn tiles(region: Region, size: u32) -> usize {
    let count = |from: u32, to: u32| (to.div_ceil(size) - from / size) as usize;
    count(region.x0, region.x1) * count(region.y0, region.y1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_without_a_tile_take_no_wave() {
        for region in [
            Region { x0: 0, y0: 0, x1: 64, y1: 36 },
            Region { x0: 63, y0: 10, x1: 65, y1: 200 },
            Region::whole([1000, 700]),
        ] {
            assert_eq!(tiles(region, 64), super::super::session::tiles(region, 64).len(), "{region:?}");
        }
    }
}
