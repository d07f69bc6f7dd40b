//! Path reuse between pixels (Bekaert, Sbert and Halton 2002): in a group of pixels, all with the same sample, first
//! vertices take light from the second vertices of each other's paths. Each first vertex x is connected to every second
//! vertex y of the group, weighted by the balance heuristic over all ways to find y:
//!
//! ```text
//! received(x) = Σ_y f(x → y) |cos| L(y) / Σ_i p_i(y)
//! ```
//!
//! where p_i is the density with which the i-th first vertex draws y, its own and those of the others. This is
//! unbiased, and no weight exceeds that which the path itself would have had. Of second vertices that give less light
//! than the group's mean, some are drawn, and give as much as the mean.
//!
//! Light that is given must look the same from everywhere: that which leaves y by its diffuse lobe. Emission, mirror
//! reflection and transmission stay with their own path. The properties of x and y decide between the two, so nothing
//! counts twice.
//!
//! Both schedules process a sample of a block of pixels as a unit and write into the same [`PathSlots`].

mod connect;
mod partition;
mod path_slots;
pub mod probe;
mod receive;

use crate::film::{Film, Region};
use crate::integrator::path::light_groups::{GroupLight, GroupQueue};
use crate::integrator::path::unpack_pixel;
use crate::math::Rgb;
pub use connect::Connections;
pub use partition::Partition;
pub use path_slots::PathSlots;

/// A receiver of the radiance of ended paths.
pub trait Sink {
    /// Adds what a sample's path has gathered since its radiance was last taken.
    fn deposit(&mut self, pixel: u32, sample: u32, radiance: Rgb);
    /// Adds light of groups, which is also part of the radiance that [`Sink::deposit`] adds.
    fn deposit_to_groups(&mut self, lights: &[GroupLight]);
    /// Takes all light by group that paths keep.
    #[inline(always)]
    fn take_groups(&mut self, found: &mut GroupQueue) {
        if !found.kept.is_empty() {
            self.deposit_to_groups(&found.kept);
            found.kept.clear();
        }
    }
}

impl Sink for Film {
    #[inline(always)]
    fn deposit(&mut self, pixel: u32, sample: u32, radiance: Rgb) {
        let (x, y) = unpack_pixel(pixel);
        self.add(x, y, sample, radiance);
    }

    fn deposit_to_groups(&mut self, lights: &[GroupLight]) {
        for light in lights {
            let (x, y) = unpack_pixel(light.pixel);
            self.add_to_group(x, y, light.sample, light.group, light.light);
        }
    }
}

/// A film that ignores radiance outside its region.
pub struct ClippedSink<'a>(pub &'a mut Film);

impl Sink for ClippedSink<'_> {
    fn deposit(&mut self, pixel: u32, sample: u32, radiance: Rgb) {
        let (x, y) = unpack_pixel(pixel);
        if contains(&self.0.region(), x, y) {
            self.0.deposit(pixel, sample, radiance);
        }
    }

    fn deposit_to_groups(&mut self, lights: &[GroupLight]) {
        let region = self.0.region();
        for light in lights {
            let (x, y) = unpack_pixel(light.pixel);
            if contains(&region, x, y) {
                self.0.add_to_group(x, y, light.sample, light.group, light.light);
            }
        }
    }
}

/// True if a pixel lies in a region.
pub fn contains(region: &Region, x: u32, y: u32) -> bool {
    (region.x0..region.x1).contains(&x) && (region.y0..region.y1).contains(&y)
}

/// A packed pixel and one of its samples, which identify a path.
pub type PixelSample = (u32, u32);
