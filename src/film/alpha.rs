//! The opacity of pixels (alpha).

use std::borrow::Cow;

use super::light_groups::GroupSum;
use super::sums::{Film, PixelSum, QUANTUM};
use super::tonemap::srgb_encode;
use crate::math::Rgb;

/// The opacities of pixels of which a part is there.
const PARTIAL: std::ops::Range<f32> = 0.02..0.98;

impl Film {
    /// The opacity of each pixel, from 0 to 1, row by row from the top: 1 less the mean part of what is behind the scene
    /// that its samples let through ([`crate::world::Settings::transparent`]). None if the film does not count this.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        self.kinds
            .has_transparency
            .then(|| (0..self.pixels.len()).map(|index| self.alpha_of(index)).collect())
    }

    /// True if the film counts opacity.
    pub(crate) fn counts_opacity(&self) -> bool {
        self.kinds.has_transparency
    }

    /// The opacity of a pixel by its index; 1 if the film does not count it.
    pub(crate) fn alpha_of(&self, index: usize) -> f32 {
        if !self.kinds.has_transparency {
            return 1.0;
        }
        opacity(self.let_through(index))
    }

    /// The part of what is behind the scene that a pixel shows, by its index: of each colour. Black if the film does not
    /// count it.
    pub(crate) fn let_through(&self, index: usize) -> Rgb {
        match self.kinds.has_transparency {
            true => self.visible_behind(index, self.caught_light(index)).mean(QUANTUM),
            false => Rgb::BLACK,
        }
    }

    /// The part of a pixel, by its index, that things cover: its opacity, except that shadow catchers and their shadows
    /// cover nothing. 1 if the film does not count opacity.
    pub(crate) fn coverage_of(&self, index: usize) -> f32 {
        if !self.kinds.has_transparency {
            return 1.0;
        }
        opacity(self.visible_behind(index, self.behind_catcher(index)).mean(QUANTUM))
    }

    /// The part that samples let through, and that catchers do, as a pixel's sums.
    fn visible_behind(&self, index: usize, caught: GroupSum) -> PixelSum {
        let mut sum = self.groups[index * self.kinds.count() + self.kinds.transparency() as usize];
        for (sum, more) in sum.as_flattened_mut().iter_mut().zip(caught.as_flattened()) {
            *sum = sum.saturating_add(*more);
        }
        PixelSum { sum, ..self.pixels[index] }
    }

    /// The opacity that an image for screens stores for a pixel, by its index, which lets through these parts of the
    /// colours behind it. Programs that show images, such as browsers, blend encoded values with it, where a surface of a
    /// coverage looks nearly as in linear light, but a shadow far too dark: so its own opacity is what darkens an encoded
    /// value as much as the shadow darkens light (exactly on white).
    pub(crate) fn screen_alpha_of(&self, index: usize, let_through: Rgb) -> f32 {
        let alpha = opacity(let_through);
        if !(self.kinds.has_transparency && self.kinds.has_catcher) {
            return alpha;
        }
        let beside_things = 1.0 - self.coverage_of(index);
        let in_shadow = (1.0 - alpha).min(beside_things);
        match in_shadow > 0.0 {
            true => 1.0 - beside_things * srgb_encode(in_shadow / beside_things),
            false => alpha,
        }
    }

    /// The part of what is behind the scene that each pixel's even and odd samples show, if shadow catchers or blended
    /// surfaces make it noisy. `None` for others, and until every pixel has some of both.
    pub(crate) fn halves_let_through(&self) -> Option<impl Iterator<Item = [Rgb; 2]>> {
        let is_noisy = self.kinds.has_transparency && (self.kinds.has_catcher || self.has_partial_areas());
        (is_noisy && self.has_halves()).then(|| {
            (0..self.pixels.len())
                .map(|index| self.visible_behind(index, self.caught_light(index)).halves(QUANTUM))
        })
    }

    /// True if in a thousandth of the pixels, and in all their neighbours, a part is there: on blended surfaces and along
    /// blurred edges. Along sharp edges, pixels have neighbours that are wholly there or not at all.
    fn has_partial_areas(&self) -> bool {
        let [width, height] = [self.region.width() as usize, self.region.height() as usize];
        let is_partial = |index: usize| PARTIAL.contains(&self.alpha_of(index));
        let partial: Vec<bool> = (0..self.pixels.len()).map(is_partial).collect();
        let within = |x: usize, y: usize| {
            (y - 1..=y + 1).all(|y| partial[y * width + x - 1..=y * width + x + 1].iter().all(|is| *is))
        };
        let rows = 1..height.saturating_sub(1);
        let count = rows.flat_map(|y| (1..width.saturating_sub(1)).filter(move |x| within(*x, y))).count();
        1_000 * count > self.pixels.len()
    }

    /// The radiance of what pixels show by themselves: [`unassociated`].
    pub(crate) fn own_radiance(&self) -> Vec<Rgb> {
        let radiance = self.radiance();
        match self.alpha() {
            Some(alpha) => unassociated(&radiance, Some(&alpha)).into_owned(),
            None => radiance,
        }
    }
}

/// The opacity of a pixel that lets through these parts of the colours behind it.
pub fn opacity(let_through: Rgb) -> f32 {
    let Rgb { r, g, b } = let_through;
    (1.0 - (r + g + b) / 3.0).clamp(0.0, 1.0)
}

/// The colours of pixels by themselves (unassociated alpha): radiance divided by opacity, both row by row; black where
/// nothing is. Radiance in a film is associated with alpha (Porter and Duff 1984): it counts as much as the pixel is
/// covered. Without alpha, the radiance itself.
pub fn unassociated<'a>(radiance: &'a [Rgb], alpha: Option<&[f32]>) -> Cow<'a, [Rgb]> {
    let Some(alpha) = alpha else { return Cow::Borrowed(radiance) };
    let own = |(light, alpha): (&Rgb, &f32)| if *alpha > 0.0 { *light * (1.0 / alpha) } else { Rgb::BLACK };
    Cow::Owned(radiance.iter().zip(alpha).map(own).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_over_anything_are_those_of_the_pixel_and_what_shows_through_it() {
        let (color, behind) = (Rgb::new(0.5, 2.0, 0.0), Rgb::new(3.0, 0.25, 1.0));
        for alpha in [1e-3, 0.25, 1.0] {
            let own = unassociated(&[color], Some(&[alpha]))[0];
            let over = own * alpha + behind * (1.0 - alpha);
            let expected = color + behind * (1.0 - alpha);
            assert!((over.r - expected.r).abs() < 1e-6 && (over.g - expected.g).abs() < 1e-6);
        }
        assert_eq!(unassociated(&[color], Some(&[0.0]))[0], Rgb::BLACK);
        assert_eq!(unassociated(&[color], None)[0], color);
    }
}
