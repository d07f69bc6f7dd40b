//! How much memory a rendering takes in addition to its scene.

use super::{DEFAULT_WAVE, Options};
use crate::denoise;
use crate::film::{Features, PixelSum, Region};
use crate::integrator::wavefront::Wave;
use crate::integrator::{Frame, Schedule};
use crate::math::Rgb;
use crate::memory::{self, Shortage};
use crate::world::Settings;

/// What a thread takes: the used part of its stack, and what the allocator sets aside for it.
const THREAD: usize = 5 << 19;

/// The number of channels in a file with all output variables, including light and A.
const MOST_CHANNELS: usize = 21;

/// Paths of a wave that is made to be measured.
const MEASURED: usize = 1024;

/// What decides how much memory a rendering takes.
pub struct Needs {
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
}

impl Needs {
    /// The defaults.
    pub fn usual(region: Region) -> Needs {
        Needs {
            region,
            to_openexr: false,
            denoises: false,
            schedule: Schedule::Wavefront,
            wave: DEFAULT_WAVE,
        }
    }

    /// In bytes.
    pub fn bytes(&self, frame: &Frame, settings: &Settings) -> u64 {
        // Sums, the picture that is made of them, and its bytes on the way to a file.
        let mut pixel = size_of::<PixelSum>() + size_of::<Rgb>() + 4;
        if !settings.aov.is_empty() {
            pixel += size_of::<Features>() + size_of::<[u128; 3]>() + 2 * 4 * MOST_CHANNELS;
        }
        if self.to_openexr {
            // Channel by channel.
            pixel += size_of::<Rgb>();
        }
        if self.denoises {
            pixel += denoise::BYTES + 2 * size_of::<Features>();
        }
        let queues = match self.schedule {
            // A wave takes memory in proportion to its size.
            Schedule::Wavefront => {
                Wave::new(frame, MEASURED, Default::default()).bytes() / MEASURED * self.wave
            }
            Schedule::Recursive => 0,
        };
        let tile = Options::default().tile as usize;
        let worker = queues + tile * tile * size_of::<PixelSum>() + THREAD;
        let area = self.region.area();
        (area as u64).saturating_mul(pixel as u64) + (worker * rayon::current_num_threads()) as u64
    }

    /// Checks whether there is enough memory.
    pub fn check(&self, frame: &Frame, settings: &Settings) -> Result<(), Shortage> {
        let (width, height) = (self.region.width(), self.region.height());
        let what = format_args!("an image of {width}x{height}");
        let claim = memory::claim(what, self.bytes(frame, settings));
        claim.map(|_| ()).map_err(|shortage| shortage.or("use --crop or a smaller --size"))
    }
}
