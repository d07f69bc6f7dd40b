//! Converts light to sRGB bytes by a table.

use std::sync::LazyLock;

use crate::film::tonemap::srgb_encode;

/// Darker light is byte 0.
const DARKEST: f32 = 1.0 / 8192.0;
/// Floats that share one entry of [`ByteThresholds::cells`]: 128 cells for each power of two, so that no cell
/// holds more than one threshold.
const CELL_BITS: u32 = 16;

/// The thresholds at which the nearest byte of the sRGB curve changes.
pub(super) struct ByteThresholds {
    /// The least light whose byte is at least the index; none above 255.
    thresholds: [f32; 257],
    /// The byte at the beginning of each cell from [`DARKEST`] to 1.
    cells: Vec<u8>,
}

/// Shared by all threads.
pub(super) static CURVE: LazyLock<ByteThresholds> = LazyLock::new(ByteThresholds::new);

impl ByteThresholds {
    fn new() -> Self {
        let mut thresholds = [f32::INFINITY; 257];
        for (byte, threshold) in thresholds.iter_mut().enumerate().take(256) {
            // Positive floats are ordered as their bits are.
            let (mut low, mut high) = (0, 1.0_f32.to_bits());
            while low < high {
                let middle = low + (high - low) / 2;
                match usize::from(by_definition(f32::from_bits(middle))) >= byte {
                    true => high = middle,
                    false => low = middle + 1,
                }
            }
            *threshold = f32::from_bits(low);
        }
        let cells = (DARKEST.to_bits()..1.0_f32.to_bits()).step_by(1 << CELL_BITS);
        Self { thresholds, cells: cells.map(|bits| by_definition(f32::from_bits(bits))).collect() }
    }

    /// The byte nearest to a light value.
    pub(super) fn byte(&self, light: f32) -> u8 {
        if light >= 1.0 {
            return 255;
        }
        if light >= DARKEST {
            let first = self.cells[((light.to_bits() - DARKEST.to_bits()) >> CELL_BITS) as usize];
            return first + u8::from(light >= self.thresholds[usize::from(first) + 1]);
        }
        0
    }
}

/// The byte nearest to a value in [0, 1].
pub(super) fn nearest(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn by_definition(light: f32) -> u8 {
    nearest(srgb_encode(light))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn same(light: f32) {
        assert_eq!(CURVE.byte(light), by_definition(light), "{light}");
    }

    #[test]
    fn table_matches_the_srgb_curve() {
        for threshold in &CURVE.thresholds[1..256] {
            let before = threshold.next_down();
            assert!(by_definition(before) < by_definition(*threshold));
            [before, *threshold, threshold.next_up()].into_iter().for_each(same);
        }
        for bits in (0..=2.0_f32.to_bits()).step_by(2531) {
            same(f32::from_bits(bits));
        }
        for bits in (0..=1.0_f32.to_bits()).step_by(1 << CELL_BITS) {
            for bits in [bits.saturating_sub(1), bits, bits + 1] {
                same(f32::from_bits(bits));
            }
        }
        [-0.0, -1.0, 1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN].into_iter().for_each(same);
    }
}
