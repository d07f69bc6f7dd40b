//! The colours of stored texels.

use std::borrow::Cow;
use std::sync::LazyLock;

use super::tonemap::srgb_decode;
use crate::world::Texels;

/// The sRGB curve for all 16-bit values: one power per texel would take seconds.
static LINEAR_OF_16_BIT: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=u16::MAX).map(|word| srgb_decode(f32::from(word) / 65_535.0)).collect());

/// Decodes a 16-bit value from the sRGB curve.
pub fn srgb_decode_16_bit(word: u16) -> f32 {
    LINEAR_OF_16_BIT[usize::from(word)]
}

/// Returns texels as linear colours, without alpha: those of 8 and 16 bits are decoded from the sRGB curve.
pub fn linear_colors(texels: &Texels) -> Cow<'_, [[f32; 3]]> {
    match texels {
        Texels::Rgb32(texels) => texels.as_slice().into(),
        Texels::Rgba16(texels) => {
            texels.iter().map(|[r, g, b, _]| [*r, *g, *b].map(srgb_decode_16_bit)).collect()
        }
        Texels::Rgba8(texels) => {
            let linear: Vec<f32> = (0..=u8::MAX).map(|byte| srgb_decode(f32::from(byte) / 255.0)).collect();
            texels.iter().map(|[r, g, b, _]| [*r, *g, *b].map(|byte| linear[usize::from(byte)])).collect()
        }
    }
}
