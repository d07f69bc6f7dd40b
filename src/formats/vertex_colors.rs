//! Colours of vertices in mesh files, which hold them as images do: encoded by the sRGB curve.

use rayon::prelude::*;

use crate::film::tonemap::srgb_decode;
use crate::math::Rgb;

/// The largest component of colours that go from 0 to 1. Those of a few programs are slightly above.
const MOST: f32 = 2.0;

/// Ranges that colours may have been written in, instead of 0 to 1.
const RANGES: [f32; 2] = [255.0, 65_535.0];

/// The largest finite component.
pub fn largest(colors: &[Rgb]) -> f32 {
    let finite = |c: f32| if c.is_finite() { c } else { 0.0 };
    colors.par_iter().map(|color| color.map(finite).max_component()).reduce(|| 0.0, f32::max)
}

/// The range in which a file has its colours.
#[derive(Clone, Copy)]
pub struct ColorRange {
    largest: f32,
    /// The value that stands for 1, if it is another one.
    one: Option<f32>,
}

impl ColorRange {
    /// The range of colours with a [`largest`] component.
    pub fn of(largest: f32) -> ColorRange {
        ColorRange { largest, one: RANGES.into_iter().find(|one| largest > MOST && largest <= *one) }
    }

    /// Brings colours to the range from 0 to 1 and decodes them. A component that is not finite becomes 1, which
    /// changes nothing; a negative one becomes 0.
    pub fn decode(self, colors: &mut [Rgb]) {
        let one = self.one.unwrap_or(1.0);
        let light = |c: f32| if c.is_finite() { srgb_decode(c.max(0.0) / one) } else { 1.0 };
        colors.par_iter_mut().for_each(|color| *color = color.map(light));
    }

    /// A message, if the range is not from 0 to 1.
    pub fn told(self) -> Option<String> {
        let Self { largest, one } = self;
        one.map(|one| {
            format!(
                "the colours of its vertices go up to {largest}, not 1: they are taken for 0 to {one} and divided by it"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_colours_of_all_ranges_become_the_same_light() {
        let decoded = |mut colors: Vec<Rgb>| {
            let range = ColorRange::of(largest(&colors));
            range.decode(&mut colors);
            (range.told(), colors)
        };
        let (said, plain) = decoded(vec![Rgb::new(128.0 / 255.0, 0.0, 1.0), Rgb::new(f32::NAN, -1.0, 1.2)]);
        assert_eq!(said, None);
        assert!((plain[0].r - 0.215_860_5).abs() < 1e-6 && plain[1].b > 1.0, "{plain:?}");
        assert_eq!((plain[0].g, plain[0].b, plain[1].r, plain[1].g), (0.0, 1.0, 1.0, 0.0));
        for range in RANGES {
            let factor = range / 255.0;
            let (said, colors) = decoded(vec![Rgb::new(128.0, 255.0, f32::NAN) * factor]);
            assert!((colors[0].r - plain[0].r).abs() < 1e-6 && colors[0].g == 1.0 && colors[0].b == 1.0);
            assert!(said.is_some_and(|said| said.contains(&format!("0 to {range}"))));
        }
        // Nobody knows what these are.
        let (said, colors) = decoded(vec![Rgb::splat(1e6)]);
        assert!(said.is_none() && colors[0].r > 1e6);
    }
}
