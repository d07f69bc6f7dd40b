//! The memory that a render takes in addition to its scene.

use super::costs::PixelCost;
use super::options::fitting_wave;
use super::{DEFAULT_WAVE, Options, photons};
use crate::denoise;
use crate::film::alpha::Transparency;
use crate::film::{Features, GroupSum, PixelSum, Region};
use crate::formats::film_file::packed_bytes;
use crate::integrator::schedule::wavefront::wave::Wave;
use crate::integrator::{RenderSetup, Schedule};
use crate::math::Rgb;
use crate::memory::{self, Shortage};
use crate::world::{Adaptive, Aov, Settings};

/// The memory of a thread: the used part of its stack, and what the allocator sets aside for it.
const THREAD: usize = 5 << 19;

/// The memory of a thread without a tile.
const IDLE_THREAD: usize = 1 << 15;

/// The number of channels in a file with all output variables, including light and A.
const MOST_CHANNELS: usize = 28;

/// The number of paths in the wave that is measured.
const MEASURED: usize = 1024;

/// The parameters that determine the memory of a render.
pub struct MemoryEstimate {
    /// The rendered pixels.
    pub region: Region,
    /// True if an OpenEXR file is written.
    pub to_openexr: bool,
    /// True if the image is denoised.
    pub denoises: bool,
    /// The schedule.
    pub schedule: Schedule,
    /// The number of paths in a wave.
    pub wave: usize,
    /// The number of copies of the image that are displayed while rendering.
    pub shown: usize,
    /// True if films are saved while rendering.
    pub saves_film: bool,
    /// True if an existing film is continued.
    pub has_film: bool,
}

impl MemoryEstimate {
    /// Returns the defaults for a region.
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

    /// Estimates the memory in bytes.
    pub fn bytes(&self, setup: &RenderSetup, settings: &Settings) -> u64 {
        let area = self.region.area() as u64;
        let squares = if settings.aov.contains(&Aov::Variance) { size_of::<[u128; 3]>() } else { 0 };
        // A pilot has a film of its own.
        let pilot = if settings.adaptive == Adaptive::Unbiased { size_of::<PixelSum>() } else { 0 };
        let groups = setup.groups().count() * size_of::<GroupSum>();
        let sums = if self.has_film { 0 } else { size_of::<PixelSum>() + groups + squares + pilot };
        // At the end: the image made from the sums, and its bytes on the way to a file.
        let mut picture = size_of::<Rgb>() + 4;
        if setup.transparent {
            picture += size_of::<f32>() + size_of::<Transparency>() + size_of::<Rgb>();
        }
        if !settings.aov.is_empty() {
            picture += size_of::<Features>() + 2 * 4 * MOST_CHANNELS;
        }
        if settings.aov.iter().any(|aov| aov.is_cost()) {
            picture += size_of::<PixelCost>();
        }
        if self.to_openexr {
            // Channel by channel.
            picture += size_of::<Rgb>();
        }
        if self.denoises {
            picture += denoise::BYTES + 2 * size_of::<Features>();
        }
        // Before that: what is displayed and saved while rendering. A film is written as it is: there is no copy of it.
        let shown = area.saturating_mul((self.shown * size_of::<Rgb>()) as u64);
        let packed = if self.saves_film { packed_bytes(self.region, squares > 0, setup.groups()) } else { 0 };
        let above = area.saturating_mul(picture as u64).max(shown.saturating_add(packed));
        let queues = match self.schedule {
            // The memory of a wave is proportional to its size.
            Schedule::Wavefront => {
                let wave = fitting_wave(self.wave, self.region, setup);
                Wave::new(setup, MEASURED, Default::default()).bytes() / MEASURED * wave
            }
            Schedule::Recursive => 0,
        };
        let tile = Options::default().tile;
        let worker = queues + (tile * tile) as usize * (size_of::<PixelSum>() + groups) + THREAD;
        let threads = rayon::current_num_threads();
        let workers = threads.min(tiles(self.region, tile));
        let of_threads = workers * worker + (threads - workers) * IDLE_THREAD;
        area.saturating_mul(sums as u64)
            .saturating_add(above)
            .saturating_add(of_threads as u64)
            .saturating_add(photons::PhotonBytes::most(setup).total())
    }

    /// Checks that there is enough memory.
    pub fn check(&self, setup: &RenderSetup, settings: &Settings) -> Result<(), Shortage> {
        let (width, height) = (self.region.width(), self.region.height());
        let what = format_args!("an image of {width}x{height}");
        let claim = memory::reserve(what, self.bytes(setup, settings));
        claim.map(|_| ()).map_err(|shortage| shortage.or("use --crop or a smaller --size"))
    }
}

/// Returns the number of tiles of a region.
fn tiles(region: Region, size: u32) -> usize {
    let count = |from: u32, to: u32| (to.div_ceil(size) - from / size) as usize;
    count(region.x0, region.x1) * count(region.y0, region.y1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tile_count_matches_session_tiles() {
        for region in [
            Region { x0: 0, y0: 0, x1: 64, y1: 36 },
            Region { x0: 63, y0: 10, x1: 65, y1: 200 },
            Region::whole([1000, 700]),
        ] {
            assert_eq!(tiles(region, 64), super::super::session::tiles(region, 64).len(), "{region:?}");
        }
    }
}
