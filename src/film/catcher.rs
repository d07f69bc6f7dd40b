//! The picture that shadow catchers show: the things behind them, as bright as catchers are for the things on them.
//!
//! A film counts the light of catchers in three groups ([`Caught`]). A pixel shows what is behind its catcher, times the
//! ratio of the light that arrives there to the light that would without other things: differential rendering (Debevec,
//! "Rendering synthetic objects into real scenes", SIGGRAPH 1998) by a quotient. Both come from the same samples, so
//! where nothing is in the way the ratio is exactly 1, however noisy both are.

use super::light_groups::GroupSum;
use super::sums::{Film, PixelSum, QUANTUM};

/// The sums of a shadow catcher.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Caught {
    /// The light that samples would show without the catcher. In transparent films, the part of it that they would.
    Behind,
    /// The light that they show of the catcher. It is part of all light.
    Arriving,
    /// The light that they would show of it without other things.
    Unblocked,
}

impl Film {
    /// The sums that a pixel shows, by its index: those of all light, except that what is behind catchers, darkened,
    /// takes the place of their light.
    #[inline]
    pub(crate) fn shown(&self, index: usize) -> PixelSum {
        if self.kinds.has_catcher { self.developed(index) } else { self.pixels[index] }
    }

    #[cold]
    fn developed(&self, index: usize) -> PixelSum {
        let [_, arriving, _] = self.caught(index);
        let darkened = if self.kinds.has_transparency { GroupSum::default() } else { self.darkened(index) };
        let mut pixel = self.pixels[index];
        for (parity, sums) in pixel.sum.iter_mut().enumerate() {
            for (channel, sum) in sums.iter_mut().enumerate() {
                // Light that is counted in parts was rounded for itself.
                *sum = (*sum - arriving[parity][channel]).max(0).saturating_add(darkened[parity][channel]);
            }
        }
        pixel
    }

    /// The light behind a pixel's catcher, as dark as the catcher makes it. The film must have one.
    fn darkened(&self, index: usize) -> GroupSum {
        let [behind, ..] = self.caught(index);
        let count = self.pixels[index].count.map(f64::from);
        let mut darkened = GroupSum::default();
        for channel in 0..3 {
            let parts = [0, 1].map(|parity| self.ratio(index, &[parity], channel));
            let ratio = self.ratio(index, &[0, 1], channel);
            let [even, odd] = behind.map(|sum| sum[channel] as f64);
            // Halves differ as their own ratios do, but add up to what both together show.
            let fewer = count[0].min(count[1]);
            let apart = 0.5 * fewer * (even + odd) / (count[0] + count[1]).max(1.0) * (parts[0] - parts[1]);
            let apart = apart.clamp(-even * ratio, odd * ratio);
            darkened[0][channel] = (even * ratio + apart).round() as i64;
            darkened[1][channel] = (odd * ratio - apart).round() as i64;
        }
        darkened
    }

    /// The part of what is behind a pixel's catcher that it shows, in a transparent film: a sum as that of what it shows
    /// of the things behind the scene. 0 without a catcher.
    pub(super) fn caught_light(&self, index: usize) -> GroupSum {
        if self.kinds.has_catcher { self.darkened(index) } else { GroupSum::default() }
    }

    /// The part behind a pixel's catcher, in a transparent film: a sum as that of [`Film::caught_light`]. 0 without one.
    pub(super) fn behind_catcher(&self, index: usize) -> GroupSum {
        match self.kinds.has_catcher {
            true => self.caught(index)[Caught::Behind as usize],
            false => GroupSum::default(),
        }
    }

    /// The mean luminance of shadow catchers without other things, in W m⁻² sr⁻¹, in a film that counts opacity. None if
    /// hardly any are in the image.
    pub(crate) fn catcher_luminance(&self) -> Option<f64> {
        /// The part of the image that must show catchers.
        const LEAST: f64 = 0.01;
        if !(self.kinds.has_catcher && self.kinds.has_transparency) {
            return None;
        }
        let mean = |index: usize, part: Caught, quantum: f64| {
            let sum = self.caught(index)[part as usize];
            f64::from(PixelSum { sum, ..self.pixels[index] }.mean(quantum).luminance())
        };
        let (mut light, mut area) = (0.0, 0.0);
        for index in 0..self.pixels.len() {
            light += mean(index, Caught::Unblocked, self.unit.quantum());
            area += mean(index, Caught::Behind, QUANTUM);
        }
        (light > 0.0 && area > LEAST * self.pixels.len() as f64).then(|| light / area)
    }

    /// The light that arrives at a pixel's catcher, relative to that without other things; 1 if they only add light.
    fn ratio(&self, index: usize, parities: &[usize], channel: usize) -> f64 {
        let [_, arriving, unblocked] = self.caught(index);
        let sum = |group: GroupSum| parities.iter().map(|parity| group[*parity][channel] as f64).sum::<f64>();
        let (arriving, unblocked) = (sum(arriving), sum(unblocked));
        if arriving >= unblocked { 1.0 } else { arriving / unblocked }
    }

    /// A pixel's sums in the order of [`Caught`]. The film must have them.
    fn caught(&self, index: usize) -> [GroupSum; 3] {
        let first = index * self.kinds.count() + self.kinds.caught(Caught::Behind) as usize;
        [0, 1, 2].map(|part| self.groups[first + part])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmScale, GroupKinds, Region};
    use crate::math::Rgb;

    /// Parts of samples: pixel, sample, radiance, the group that also counts it.
    fn film(has_transparency: bool, parts: &[(u32, f32, Option<Caught>)]) -> Film {
        let kinds = GroupKinds { lights: 0, has_transparency, has_catcher: true };
        let mut film = Film::new(Region::whole([1, 1]), FilmScale::default()).with_groups(kinds);
        (0..4).for_each(|sample| film.count(0, 0, sample));
        for (sample, light, caught) in parts.iter().copied() {
            let light = Rgb::new(light, 0.5 * light, 0.0);
            if matches!(caught, None | Some(Caught::Arriving)) {
                film.add(0, 0, sample, light);
            }
            if let Some(part) = caught {
                film.add_to_group(0, 0, sample, kinds.caught(part), light);
            }
        }
        film
    }

    #[test]
    fn lit_catchers_show_exactly_what_is_behind_them_whatever_their_light() {
        use Caught::{Arriving, Behind, Unblocked};
        let noisy = [0.3, 5.7, 0.01, 1.0 / 3.0];
        let lit = (0..4).flat_map(|sample| {
            let light = noisy[sample as usize];
            [(sample, 2.0, Some(Behind)), (sample, light, Some(Arriving)), (sample, light, Some(Unblocked))]
        });
        let film = film(false, &lit.collect::<Vec<_>>());
        assert_eq!(film.radiance()[0], Rgb::new(2.0, 1.0, 0.0));
        assert!(film.noise().unwrap() < 1e-7, "only light that is counted in parts is rounded");
    }

    #[test]
    fn shadows_darken_what_is_behind_and_leave_other_things_as_they_are() {
        use Caught::{Arriving, Behind, Unblocked};
        // Half of the samples see a thing; a quarter of the light arrives at what the others see.
        let mut parts = vec![(0, 8.0, None), (1, 8.0, None)];
        for sample in [2, 3] {
            parts.extend([
                (sample, 2.0, Some(Behind)),
                (sample, 1.0, Some(Arriving)),
                (sample, 4.0, Some(Unblocked)),
            ]);
        }
        assert_eq!(film(false, &parts).radiance()[0].r, 0.5 * 8.0 + 0.5 * 2.0 * 0.25);
        parts.iter_mut().filter(|part| part.2 == Some(Behind)).for_each(|part| part.1 = 1.0);
        let transparent = film(true, &parts);
        assert_eq!(transparent.radiance()[0].r, 0.5 * 8.0, "shadows are black");
        // Red 1/4, green 1/4 of half of the light, blue is not behind at all: see `film`.
        let let_through = (0.25 * 0.5 + 0.5 * 0.25 * 0.5) / 3.0;
        assert!((transparent.alpha().unwrap()[0] - (1.0 - let_through)).abs() < 1e-6);
    }

    #[test]
    fn halves_are_as_far_apart_as_their_own_ratios() {
        use Caught::{Arriving, Behind, Unblocked};
        let mut parts: Vec<_> = (0..4).map(|sample| (sample, 1.0, Some(Behind))).collect();
        parts.extend((0..4).map(|sample| (sample, 1.0, Some(Unblocked))));
        parts.extend([(0, 1.0, Some(Arriving)), (2, 1.0, Some(Arriving))]);
        let film = film(false, &parts);
        assert_eq!(film.radiance()[0].r, 0.5);
        let [even, odd] = film.halves().unwrap().next().unwrap();
        assert!((even.r - 1.0).abs() < 1e-6 && odd.r.abs() < 1e-6, "{even:?} {odd:?}");
    }
}
