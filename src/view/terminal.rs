//! An image drawn with the characters of a terminal.

use crate::film::tonemap::{quantise_8_bit, srgb_decode, srgb_encode};

/// The number of pixels, across and down, that are sampled per half character.
const LOOKED_AT: u32 = 4;

/// Returns evenly spaced columns and rows of an image: enough pixels to draw it in `room` columns and rows, so that a
/// large image need not be tone mapped in full. Also returns their width and height.
pub fn thinned<T: Copy>(pixels: &[T], [width, height]: [u32; 2], room: [u32; 2]) -> (Vec<T>, [u32; 2]) {
    let [columns, rows] = drawn_size([width, height], room);
    let step = (width / (LOOKED_AT * columns)).min(height / (LOOKED_AT * rows)).max(1);
    let row = |y: u32| pixels.iter().skip((y * width) as usize).take(width as usize).step_by(step as usize);
    let left = (0..height).step_by(step as usize).flat_map(row).copied().collect();
    (left, [width.div_ceil(step), height.div_ceil(step)])
}

/// Returns the text that draws an image of sRGB pixels in a room of columns and rows: lines of upper half blocks, whose
/// foreground is a pixel and whose background is the pixel below it. An image larger than the room is scaled down by
/// averaging its linear light over boxes.
pub fn half_blocks(pixels: &[[u8; 3]], size: [u32; 2], room: [u32; 2]) -> String {
    let drawn = drawn_size(size, room);
    let linear: Vec<f32> = (0..=255u8).map(|byte| srgb_decode(f32::from(byte) / 255.0)).collect();
    let color = |column: u32, row: u32| box_mean(pixels, size, drawn, [column, row], &linear);
    let mut text = String::new();
    for row in (0..drawn[1]).step_by(2) {
        if row > 0 {
            text.push('\n');
        }
        let mut colors = [None; 2];
        for column in 0..drawn[0] {
            // If the number of rows is odd, the last one has nothing below it.
            let below = (row + 1 < drawn[1]).then(|| color(column, row + 1));
            for (place, new) in [Some(color(column, row)), below].into_iter().enumerate() {
                // Unchanged colours are not repeated: the text may go through ssh.
                if let Some([r, g, b]) = new.filter(|_| colors[place] != new) {
                    let code = [38, 48][place];
                    text.push_str(&format!("\x1b[{code};2;{r};{g};{b}m"));
                }
                colors[place] = new;
            }
            text.push('▀');
        }
        text.push_str("\x1b[0m");
    }
    text
}

/// The columns and half rows of an image that keeps its proportions in a room. Half a character is about as wide as
/// high.
fn drawn_size([width, height]: [u32; 2], [columns, rows]: [u32; 2]) -> [u32; 2] {
    let [width, height] = [width, height].map(|side| f64::from(side.max(1)));
    let scale = (f64::from(columns) / width).min(2.0 * f64::from(rows) / height).min(1.0);
    [width, height].map(|side| ((side * scale).round() as u32).max(1))
}

/// The mean light of the pixels under a drawn pixel.
fn box_mean(pixels: &[[u8; 3]], size: [u32; 2], drawn: [u32; 2], place: [u32; 2], linear: &[f32]) -> [u8; 3] {
    let bounds = |axis: usize| {
        let at = |place: u32| (u64::from(place) * u64::from(size[axis]) / u64::from(drawn[axis])) as usize;
        at(place[axis])..at(place[axis] + 1).max(at(place[axis]) + 1)
    };
    let (columns, width) = (bounds(0), size[0] as usize);
    let inside = bounds(1).flat_map(|y| pixels.iter().skip(y * width + columns.start).take(columns.len()));
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for pixel in inside {
        for (sum, byte) in sum.iter_mut().zip(pixel) {
            *sum += f64::from(linear[usize::from(*byte)]);
        }
        count += 1.0;
    }
    sum.map(|sum| quantise_8_bit(srgb_encode((sum / f64::max(count, 1.0)) as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    /// The number of characters of each line, without their colours.
    fn shape(text: &str) -> Vec<usize> {
        text.lines().map(|line| line.matches('▀').count()).collect()
    }

    #[test]
    fn half_blocks_draws_two_rows_per_line() {
        let pixels = [[255, 0, 0], [255, 0, 0], [0, 0, 255], [1, 2, 3]];
        let text = half_blocks(&pixels, [2, 2], [80, 24]);
        assert_eq!(text, "\x1b[38;2;255;0;0m\x1b[48;2;0;0;255m▀\x1b[48;2;1;2;3m▀\x1b[0m");
        // The last row of three has nothing below it.
        let text = half_blocks(&[[9; 3]; 3], [1, 3], [80, 24]);
        assert_eq!(text, "\x1b[38;2;9;9;9m\x1b[48;2;9;9;9m▀\x1b[0m\n\x1b[38;2;9;9;9m▀\x1b[0m");
    }

    #[test]
    fn drawn_size_keeps_proportions_within_the_room() {
        for (size, room, expected) in [
            ([160, 90], [80, 24], [80, 45]),
            ([160, 90], [80, 10], [36, 20]),
            ([90, 160], [80, 24], [27, 48]),
            ([16, 12], [80, 24], [16, 12]),
            ([65_536, 1], [80, 24], [80, 1]),
            ([1, 65_536], [80, 24], [1, 48]),
            ([160, 90], [1, 1], [1, 1]),
        ] {
            assert_eq!(drawn_size(size, room), expected, "{size:?} in {room:?}");
        }
        let text = half_blocks(&vec![[0; 3]; 160 * 90], [160, 90], [80, 24]);
        assert_eq!(shape(&text), [80; 23]);
    }

    #[test]
    fn half_blocks_averages_linear_light_not_bytes() {
        // Half the light of white is byte 188.
        let chequered: Vec<[u8; 3]> =
            (0..64).map(|i| [if (i / 8 + i) % 2 == 0 { 255 } else { 0 }; 3]).collect();
        let text = half_blocks(&chequered, [8, 8], [4, 2]);
        assert_eq!(shape(&text), [4, 4]);
        assert!(text.starts_with("\x1b[38;2;188;188;188m\x1b[48;2;188;188;188m▀▀▀▀\x1b[0m\n"), "{text:?}");
        // A uniform image keeps its colour, whatever the sizes.
        for byte in 0..=255 {
            let text = half_blocks(&[[byte; 3]; 7 * 5], [7, 5], [3, 3]);
            assert_eq!(text.matches(&format!(";2;{byte};{byte};{byte}m")).count(), 2, "{byte}: {text:?}");
        }
    }

    #[test]
    fn thinned_keeps_enough_pixels_of_a_large_image() {
        let pixels: Vec<Rgb> = (0..1000 * 500).map(|i| Rgb::splat(i as f32)).collect();
        let (left, size) = thinned(&pixels, [1000, 500], [50, 25]);
        assert_eq!((size, left.len()), ([200, 100], 200 * 100));
        assert_eq!((left[1], left[200]), (Rgb::splat(5.0), Rgb::splat(5000.0)));
        let (left, size) = thinned(&pixels, [1000, 500], [300, 400]);
        assert_eq!((size, left), ([1000, 500], pixels));
    }
}
