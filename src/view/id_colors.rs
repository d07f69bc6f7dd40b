//! Colours that stand for entities and materials.

use std::num::Wrapping;

use crate::sampling::hash::mix;

/// The colour of an entity, by its number.
pub fn entity_color(number: u32) -> [u8; 3] {
    color(number.wrapping_add(1))
}

/// The colour of a material, by its index.
pub fn material_color(index: u32) -> [u8; 3] {
    color(index.wrapping_add(1 + (1 << 16)))
}

/// A colour for a number: neighbouring numbers have hues that differ by the golden ratio of the circle, so that any few
/// of them are far apart.
fn color(number: u32) -> [u8; 3] {
    let turns = (f64::from(number) * 0.618_033_988_749_895).fract();
    let Wrapping(mixed) = mix(Wrapping(number));
    let brightness = 0.72 + 0.28 * f64::from(mixed & 0xff) / 255.0;
    let saturation = 0.35 + 0.35 * f64::from(mixed >> 8 & 0xff) / 255.0;
    // From HSV (Smith 1978): each channel falls by the saturation where the hue is far from its own.
    [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|own| {
        let from_own = (((turns + own).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        (255.0 * brightness * (1.0 - saturation * (1.0 - from_own)) + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_numbers_have_colours_that_differ() {
        for first in [0, 7, 1_000, u32::MAX - 6] {
            let colors: Vec<[u8; 3]> = (0..6).map(|i| material_color(first.wrapping_add(i))).collect();
            for (at, a) in colors.iter().enumerate() {
                for b in &colors[..at] {
                    let apart: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
                    assert!(apart > 40, "{a:?} and {b:?}");
                }
            }
        }
    }
}
