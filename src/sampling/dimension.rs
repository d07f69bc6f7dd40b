//! Dimensions of random numbers: each use of a random number has its own, 16 for the camera and 16 for each bounce.

use crate::simd::Int;

/// Dimensions per bounce.
pub const PER_BOUNCE: u32 = 16;

/// The use of a random number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Dimension {
    /// The position in the pixel: two numbers and the order of the strata.
    Pixel = 0,
    /// The position on the lens: two numbers and the order of the strata.
    Lens = 3,
    /// The wavelength of dispersed light: the colour and the position in its band, the same at all bounces. Two numbers
    /// and the order of the strata.
    Wavelength = 6,
    /// Per bounce: the light and the position on it; `SampleKey::fork` separates lights and their samples. Two numbers
    /// and the order of the strata.
    Light = 16,
    /// Per bounce: new bits for the position on a light, in place of those that the choice of the light has used up.
    /// One number and the order of the strata.
    LightBits = 19,
    /// Per bounce: the lobe of the surface that scatters light, and the direction. Two numbers and the order of the
    /// strata.
    Scatter = 21,
    /// Per bounce: the choice between reflection and transmission at a microfacet. One number and the order of the
    /// strata.
    Through = 24,
    /// Per bounce: Russian roulette. One number and the order of the strata.
    Roulette = 26,
    /// Per bounce: the alpha test of a surface for the path. One number and the order of the strata.
    Alpha = 28,
    /// Per bounce: the alpha test for shadow rays. One number and the order of the strata.
    ShadowAlpha = 30,
}

impl Dimension {
    /// The number of consecutive dimensions of the use.
    pub const fn count(self) -> u32 {
        match self {
            Self::Pixel | Self::Lens | Self::Wavelength | Self::Light | Self::Scatter => 3,
            Self::LightBits | Self::Through | Self::Roulette | Self::Alpha | Self::ShadowAlpha => 2,
        }
    }

    /// The index of this dimension at a bounce; 0 is the first hit, and the bounce of all camera dimensions.
    #[inline(always)]
    pub fn at<I: Int>(self, bounce: I) -> I {
        I::splat(self as u32) + bounce * I::splat(PER_BOUNCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_of_different_uses_and_bounces_do_not_overlap() {
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
