//! The opacity of pixels (alpha).

use std::borrow::Cow;

use super::light_groups::GroupSum;
use super::sums::{Film, PixelSum, QUANTUM};
use super::tonemap::{srgb_decode, srgb_encode};
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

    /// The part of what is behind the scene that a pixel would show without shadows on catchers, by its index: of each
    /// colour. None without catchers.
    pub(crate) fn without_shadows(&self, index: usize) -> Option<Rgb> {
        let has_shadows = self.kinds.has_transparency && self.kinds.has_catcher;
        has_shadows.then(|| self.visible_behind(index, self.behind_catcher(index)).mean(QUANTUM))
    }

    /// The part of what is behind the scene that each pixel's even and odd samples show, if shadow catchers or blended
    /// surfaces make it noisy. `None` for others, and until every pixel has some of both.
    pub(crate) fn halves_let_through(&self) -> Option<impl Iterator<Item = [Rgb; 2]>> {
        let is_noisy = self.kinds.has_transparency
            && (self.kinds.has_catcher || self.has_partial_areas(&Film::alpha_of));
        (is_noisy && self.has_halves()).then(|| {
            (0..self.pixels.len())
                .map(|index| self.visible_behind(index, self.caught_light(index)).halves(QUANTUM))
        })
    }

    /// Like [`Film::halves_let_through`], but without shadows on catchers, if there are such and blended surfaces make
    /// it noisy.
    pub(crate) fn halves_without_shadows(&self) -> Option<impl Iterator<Item = [Rgb; 2]>> {
        let is_noisy = self.kinds.has_transparency
            && self.kinds.has_catcher
            && self.has_partial_areas(&Film::coverage_of);
        (is_noisy && self.has_halves()).then(|| {
            (0..self.pixels.len())
                .map(|index| self.visible_behind(index, self.behind_catcher(index)).halves(QUANTUM))
        })
    }

    /// True if in a thousandth of the pixels, and in all their neighbours, a part is there: on blended surfaces and along
    /// blurred edges. Along sharp edges, pixels have neighbours that are wholly there or not at all.
    fn has_partial_areas(&self, part: &dyn Fn(&Film, usize) -> f32) -> bool {
        let [width, height] = [self.region.width() as usize, self.region.height() as usize];
        let is_partial = |index: usize| PARTIAL.contains(&part(self, index));
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

/// The parts of what is behind the scene that a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transparency {
    /// The part of each colour.
    let_through: Rgb,
    /// The largest part of a colour without the shadows on shadow catchers. None without shadow catchers.
    without_shadows: Option<f32>,
}

impl Transparency {
    /// Creates the transparency of a pixel of the parts that it lets through, and of those without shadows on catchers.
    pub fn new(let_through: Rgb, without_shadows: Option<Rgb>) -> Transparency {
        let largest = |parts: Rgb| 1.0 - opacity(Rgb::splat(parts.max_component()));
        Transparency { let_through, without_shadows: without_shadows.map(largest) }
    }

    /// The colour and the opacity that an image for screens stores for a pixel of this own colour, a linear display value.
    ///
    /// Programs that show images, such as browsers, blend encoded values with one opacity. A surface of a coverage looks
    /// nearly as in linear light, but a shadow far too dark, and coloured glass grey. So, a pixel is taken for an opaque
    /// surface beside a filter: the shadow and the glass, which darken an encoded white as they darken light. Glass without
    /// colour counts as a surface. The opacity is that of the colour of which the least is let through; what more there is
    /// of others is added to the colour of the pixel, so that it looks on white as in linear light.
    pub fn on_screens(self, own: Rgb) -> (Rgb, f32) {
        // False for NaN.
        let through = self.let_through.to_array().map(|part| if part > 0.0 { part.min(1.0) } else { 0.0 });
        let [darkest, most] = [f32::min, f32::max].map(|of| through.into_iter().fold(through[0], of));
        let least_opacity = opacity(Rgb::splat(most));
        let brightest = 1.0 - least_opacity;
        let opaque_beside = |beside: f32| 1.0 - beside * srgb_encode(brightest.min(beside) / beside);
        if darkest == most || brightest <= 0.0 {
            let shadowed = self.without_shadows.filter(|beside| brightest.min(*beside) > 0.0);
            return (own, shadowed.map_or(least_opacity, opaque_beside));
        }
        // The part of the filter. The more colour there is, the less it has of an opaque surface.
        let beside = self.without_shadows.unwrap_or(brightest).max(brightest);
        let beside = beside + (1.0 - darkest / most) * (1.0 - beside);
        let (opaque, shadow) = (opaque_beside(beside), brightest / beside);
        let rest = 1.0 - opaque;
        let encoded = |light: f32| srgb_encode(shadow * light.min(1.0)) / srgb_encode(shadow);
        // The light of the pixel that is not that of the opaque surface.
        let added = (opacity(Rgb::from(through)) - least_opacity).max(0.0) / brightest;
        let own_light = own.to_array();
        let filtered: [[f32; 2]; 3] = std::array::from_fn(|channel| {
            let light = own_light[channel] * added;
            [encoded(light), encoded(light + through[channel] / brightest)]
        });
        let least = filtered.iter().map(|[black, white]| white - black).fold(1.0, f32::min);
        let alpha = 1.0 - rest * least.max(0.0);
        if alpha <= 0.0 {
            return (own, 0.0);
        }
        let stored = |channel: usize| {
            let on_white = opaque * srgb_encode(own_light[channel]) + rest * filtered[channel][1];
            srgb_decode(((on_white - (1.0 - alpha)) / alpha).clamp(0.0, 1.0))
        };
        (Rgb::from(std::array::from_fn(stored)), alpha)
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

    /// An encoded value of a page where a browser blends an image with it.
    fn on_page(pixel: Transparency, own: Rgb, page: [f32; 3]) -> [f32; 3] {
        let (color, alpha) = pixel.on_screens(own);
        let color = color.to_array().map(srgb_encode);
        std::array::from_fn(|at| color[at] * alpha + page[at] * (1.0 - alpha))
    }

    /// Pixels without colour are stored as surfaces of a coverage, beside shadows that darken an encoded white.
    #[test]
    fn pixels_that_let_all_colours_through_alike_keep_their_own_colour() {
        let own = Rgb::new(0.1, 0.7, 0.3);
        for part in [0.0, 1e-6, 0.2, 0.5, 0.83, 1.0] {
            let let_through = Rgb::splat(part);
            let plain = Transparency { let_through, without_shadows: None };
            assert_eq!(plain.on_screens(own), (own, opacity(let_through)));
            for beside in [0.3, 0.9, 1.0] {
                let shadow = (1.0 - opacity(let_through)).min(beside);
                let expected = 1.0 - beside * srgb_encode(shadow / beside);
                let pixel = Transparency { let_through, without_shadows: Some(beside) };
                assert_eq!(pixel.on_screens(own), (own, if shadow > 0.0 { expected } else { 1.0 }));
            }
        }
    }

    #[test]
    fn coloured_filters_and_shadows_look_on_white_as_in_linear_light() {
        let colors = [[0.9, 0.3, 0.1], [0.2, 1.0, 0.6], [0.0, 1.0, 0.0], [1.0, 0.95, 0.9]].map(Rgb::from);
        let lights = [Rgb::BLACK, Rgb::splat(0.02), Rgb::new(0.3, 0.1, 0.05), Rgb::splat(0.4)];
        for (let_through, light) in colors.iter().flat_map(|color| lights.map(|light| (*color, light))) {
            let alpha = opacity(let_through);
            let own = Rgb::from((light * (1.0 / alpha)).to_array().map(|part| part.min(1.0)));
            for without_shadows in [None, Some(1.0)] {
                let pixel = Transparency { let_through, without_shadows };
                let shown = on_page(pixel, own, [1.0; 3]);
                let expected = (own * alpha + let_through).to_array().map(|part| srgb_encode(part.min(1.0)));
                let far = |at: usize| (shown[at] - expected[at]).abs();
                let is_near = (0..3).all(|at| far(at) < 0.03);
                assert!(is_near, "{let_through:?}, {light:?}: {shown:?}, not {expected:?}");
                // On black, no colour is darker than the light of the pixel.
                let shown = on_page(pixel, own, [0.0; 3]);
                let light = (own * (1.0 - let_through.r.max(let_through.g).max(let_through.b))).to_array();
                assert!((0..3).all(|at| shown[at] >= light[at] - 1e-3), "{shown:?}, {light:?}");
            }
        }
    }

    /// A hint of colour changes a pixel by a hint.
    #[test]
    fn screens_show_pixels_with_hardly_any_colour_as_those_without() {
        let own = Rgb::new(0.1, 0.7, 0.3);
        for (part, without_shadows) in [(0.1, None), (0.5, None), (0.9, None), (0.3, Some(0.5))] {
            let tinted = Transparency { let_through: Rgb::new(part, part - 1e-4, part), without_shadows };
            let grey = Transparency { let_through: Rgb::splat(part), without_shadows };
            for page in [[0.0; 3], [0.2, 0.5, 0.9], [1.0; 3]] {
                let shown = [tinted, grey].map(|pixel| on_page(pixel, own, page));
                assert!((0..3).all(|at| (shown[0][at] - shown[1][at]).abs() < 2e-3), "{shown:?}");
            }
        }
    }

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
