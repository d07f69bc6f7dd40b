//! Every use of a random number has a named dimension, 16 for the camera and 16 for
//! each bounce, so that no two uses share one.

use crate::simd::Int;

/// How many dimensions a bounce has.
pub const PER_BOUNCE: u32 = 16;

/// What a random number is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Dimension {
    /// The place in the pixel: two numbers and the order of the strata.
    Pixel = 0,
    /// The place on the lens: two numbers and the order of the strata.
    Lens = 3,
    /// The wavelength of light that is split up: which colour, and where in its band; the same at all bounces.
    /// Numbers as for the place in the pixel.
    Wavelength = 6,
    /// Of a bounce: which light, and the place on it. Lights and their samples are told apart by
    /// `Key::fork`.
    Light = 16,
    /// Of a bounce: new bits for the place on a light, for those that the choice of the light has used up. One number
    /// and the order of the strata.
    LightBits = 19,
    /// Of a bounce: which of a surface's lobes scatters light, and in which direction. Numbers as for the place in
    /// the pixel.
    Scatter = 21,
    /// Of a bounce: whether a microfacet reflects it or lets it through. Numbers as for [`Dimension::LightBits`].
    Through = 24,
    /// Of a bounce: whether the path goes on. Numbers as for [`Dimension::LightBits`].
    Roulette = 26,
    /// Of a bounce: whether a surface is there for the path, by its alpha. Numbers as for [`Dimension::LightBits`].
    Alpha = 28,
    /// Of a bounce: the same for rays to lights.
    ShadowAlpha = 30,
}

impl Dimension {
    /// How many consecutive numbers the use draws.
    pub const fn count(self) -> u32 {
        match self {
            Self::Pixel | Self::Lens | Self::Wavelength | Self::Light | Self::Scatter => 3,
            Self::LightBits | Self::Through | Self::Roulette | Self::Alpha | Self::ShadowAlpha => 2,
        }
    }

    /// The number of this dimension at a bounce (0 is the first hit, and what camera
    /// dimensions take).
    #[inline(always)]
    pub fn at<I: Int>(self, bounce: I) -> I {
        I::splat(self as u32) + bounce * I::splat(PER_BOUNCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_do_not_overlap() {
        let all = [
            Dimension::Pixel,
            Dimension::Lens,
            Dimension::Wavelength,
            Dimension::Light,
            Dimension::LightBits,
            Dimension::Scatter,
            Dimension::Through,
            Dimension::Roulette,
            Dimension::Alpha,
            Dimension::ShadowAlpha,
        ];
        let mut used = std::collections::HashSet::new();
        for dimension in all {
            let bounces = if (dimension as u32) < PER_BOUNCE { 1 } else { 300 };
            for bounce in 0..bounces {
                for k in 0..dimension.count() {
                    assert!(
                        used.insert(dimension.at(std::num::Wrapping(bounce)).0 + k),
                        "{dimension:?} at bounce {bounce}"
                    );
                }
            }
            let end = dimension as u32 % PER_BOUNCE + dimension.count();
            assert!(end <= PER_BOUNCE, "{dimension:?} runs into the next bounce");
        }
    }
}
