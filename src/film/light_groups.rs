//! Groups of a film: sums beside those of all light. Those of light groups let lamps be mixed afterwards; one more
//! counts what pixels show of the things behind the scene, and others what shadow catchers do.
//!
//! A film with groups has the same sums of all light as one without. What belongs to no group is the difference, so
//! that all parts add up to the whole exactly.

use super::catcher::Caught;
use super::sums::{Film, MAX_RADIANCE, PixelSum, QUANTUM, saturated_sum};
use crate::math::Rgb;

/// The largest number of light groups: each takes 48 bytes for every pixel.
pub const MOST_LIGHT_GROUPS: usize = 64;

/// The sums of one group in a pixel, in quanta: even and odd samples; red, green, blue.
pub type GroupSum = [[i64; 3]; 2];

/// The groups whose sums a film holds beside those of all light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GroupKinds {
    /// The number of light groups, which come first.
    pub lights: usize,
    /// True if one more group counts, without the film scale, what pixels show of the things behind the scene.
    pub has_transparency: bool,
    /// True if three more groups count the light of shadow catchers.
    pub has_catcher: bool,
}

impl GroupKinds {
    /// The number of groups.
    pub fn count(self) -> usize {
        self.lights + usize::from(self.has_transparency) + if self.has_catcher { 3 } else { 0 }
    }

    /// The group of what pixels show of the things behind the scene, if there is one.
    pub(crate) fn transparency(self) -> u32 {
        self.lights as u32
    }

    /// A group of a shadow catcher, if there are any.
    pub(crate) fn caught(self, part: Caught) -> u32 {
        self.transparency() + u32::from(self.has_transparency) + part as u32
    }
}

impl Film {
    /// Returns the film with room for the sums of groups.
    pub(crate) fn with_groups(mut self, kinds: GroupKinds) -> Film {
        self.kinds = kinds;
        self.groups = vec![GroupSum::default(); kinds.count() * self.pixels.len()];
        self
    }

    /// Returns the film with sums of groups, pixel by pixel; none if they are not as many as its pixels times these, or
    /// negative.
    pub(crate) fn with_group_sums(mut self, kinds: GroupKinds, sums: Vec<GroupSum>) -> Option<Film> {
        let sound = sums.as_flattened().as_flattened().iter().all(|sum| *sum >= 0);
        let fits = sound && sums.len() == kinds.count() * self.pixels.len();
        (self.kinds, self.groups) = (kinds, sums);
        fits.then_some(self)
    }

    /// The number of light groups.
    pub fn light_groups(&self) -> usize {
        self.kinds.lights
    }

    /// The groups whose sums it holds.
    pub(crate) fn group_kinds(&self) -> GroupKinds {
        self.kinds
    }

    /// The sums of all groups, pixel by pixel.
    pub(crate) fn group_sums(&self) -> &[GroupSum] {
        &self.groups
    }

    /// Adds light of a group, which is also part of a radiance that [`Film::add`] adds.
    #[inline(always)]
    pub(crate) fn add_to_group(&mut self, x: u32, y: u32, sample: u32, group: u32, light: Rgb) {
        let place = self.region.index(x, y) * self.kinds.count() + group as usize;
        let sum = &mut self.groups[place][(sample & 1) as usize];
        let more = (light * self.inverse).to_array().map(quickly_counted);
        for (sum, more) in sum.iter_mut().zip(more) {
            *sum = saturated_sum(*sum, more);
        }
    }

    /// Does what [`Film::add_to_group`] does with the light of many rays, by component. `of` gives the packed pixel, the
    /// sample and the group of each; none for rays that do not count.
    #[inline(always)]
    pub(crate) fn add_each_to_group(
        &mut self,
        light: [&[f32]; 3],
        of: impl Fn(usize) -> Option<[u32; 3]>,
        unpack: impl Fn(u32) -> (u32, u32),
    ) {
        /// Converted together, so that the compiler can use wide registers.
        const TOGETHER: usize = 16;
        // Rays of one pixel follow each other.
        let (mut last, mut sums) = (None, &mut [][..]);
        let (region, count, inverse) = (self.region, self.kinds.count(), self.inverse);
        for first in (0..light[0].len()).step_by(TOGETHER) {
            let together = TOGETHER.min(light[0].len() - first);
            let mut quanta = [[0; TOGETHER]; 3];
            for (quanta, light) in quanta.iter_mut().zip(light) {
                let mut some = [0.0; TOGETHER];
                some[..together].copy_from_slice(&light[first..first + together]);
                for (quanta, light) in quanta.iter_mut().zip(some) {
                    *quanta = quickly_counted(light * inverse);
                }
            }
            for lane in 0..together {
                let Some([pixel, sample, group]) = of(first + lane) else { continue };
                if last != Some(pixel) {
                    let (x, y) = unpack(pixel);
                    let place = region.index(x, y) * count;
                    (last, sums) = (Some(pixel), &mut self.groups[place..place + count]);
                }
                let sum = &mut sums[group as usize][(sample & 1) as usize];
                for (sum, quanta) in sum.iter_mut().zip(&quanta) {
                    *sum = saturated_sum(*sum, quanta[lane]);
                }
            }
        }
    }

    /// The mean radiance of a light group's light, pixel by pixel.
    pub fn group_radiance(&self, group: usize) -> Vec<Rgb> {
        let quantum = self.unit.quantum();
        let pixels = self.pixels.iter().zip(self.groups.chunks(self.kinds.count().max(1)));
        pixels.map(|(pixel, sums)| PixelSum { sum: sums[group], ..*pixel }.mean(quantum)).collect()
    }

    /// The mean radiance of the light that belongs to no group.
    pub fn ungrouped_radiance(&self) -> Vec<Rgb> {
        self.mixed(&vec![Rgb::BLACK; self.kinds.lights]).radiance()
    }

    /// Returns the film of the same scene with each light group's light multiplied by a factor. With factors of 1 it is
    /// this film.
    pub fn mixed(&self, factors: &[Rgb]) -> Film {
        let mut mixed = self.clone();
        let groups = mixed.groups.chunks_mut(self.kinds.count().max(1));
        for (pixel, sums) in mixed.pixels.iter_mut().zip(groups) {
            for (sums, factor) in sums.iter_mut().zip(factors) {
                for (total, sum) in pixel.sum.iter_mut().zip(sums) {
                    for ((total, sum), factor) in total.iter_mut().zip(sum).zip(factor.to_array()) {
                        let scaled = (f64::from(factor) * *sum as f64).round() as i64;
                        *total = total.saturating_add(scaled.saturating_sub(*sum));
                        *sum = scaled;
                    }
                }
            }
            // Each group's light was rounded for itself.
            pixel.sum.as_flattened_mut().iter_mut().for_each(|sum| *sum = (*sum).max(0));
        }
        mixed
    }
}

/// Light in quanta, rounded to the nearest. To a float this large the sum has no fraction, and its bits count.
#[inline(always)]
fn quickly_counted(light: f32) -> i64 {
    const LARGE: f64 = (1u64 << 52) as f64;
    // NaN counts as 0.
    let positive = light.max(0.0);
    ((f64::from(positive.min(MAX_RADIANCE)) * (1.0 / QUANTUM) + LARGE).to_bits() - LARGE.to_bits()) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmScale, Region};
    use proptest::prelude::*;

    proptest! {
        /// Unchanged factors give the same film to the bit, and a mix is the sum of scaled parts.
        #[test]
        fn mixes_are_sums_of_scaled_groups(
            lights in prop::collection::vec((0u32..3, 0u32..2, 0.0f32..50.0, 0u32..4), 1..40),
            factors in prop::array::uniform3(0.0f32..3.0),
        ) {
            let region = Region::whole([2, 1]);
            let mut film = Film::new(region, FilmScale::default()).with_groups(GroupKinds { lights: 3, ..GroupKinds::default() });
            let (mut each, mut added) = (film.clone(), Vec::new());
            let parts = |part: fn(f32) -> f32| lights.iter().map(move |light| part(light.2)).collect::<Vec<f32>>();
            let components = [parts(|light| light), parts(|light| 0.5 * light), parts(|_| 0.0)];
            let (mut expected, mut counts) = ([0.0f64; 2], [0u32; 2]);
            for (group, x, light, sample) in lights.iter().copied() {
                film.count(x, 0, sample);
                counts[x as usize] += 1;
                let light = Rgb::new(light, 0.5 * light, 0.0);
                film.add(x, 0, sample, light);
                film.add_to_group(x, 0, sample, group, light);
                added.push([x, sample, group]);
                each.count(x, 0, sample);
                each.add(x, 0, sample, light);
                expected[x as usize] += f64::from(light.r * factors[group as usize]);
            }
            prop_assert_eq!(&film.mixed(&[Rgb::WHITE; 3]), &film);
            let [r, g, b] = &components;
            each.add_each_to_group([r, g, b], |i| Some(added[i]), |x| (x, 0));
            prop_assert_eq!(&each, &film);
            let mixed = film.mixed(&factors.map(Rgb::splat)).radiance();
            for x in 0..2 {
                let mean = expected[x] / f64::from(counts[x].max(1));
                prop_assert!((f64::from(mixed[x].r) - mean).abs() < 1e-4 * mean.max(1.0));
                prop_assert!((mixed[x].g * 2.0 - mixed[x].r).abs() < 1e-4 * mixed[x].r.max(1.0));
            }
            let nothing = film.ungrouped_radiance();
            // Halves of quanta are rounded up in the film, and to even numbers in groups.
            prop_assert!(nothing.iter().all(|rest| rest.max_component() <= 40.0 * QUANTUM as f32), "{:?}", nothing);
        }
    }
}
