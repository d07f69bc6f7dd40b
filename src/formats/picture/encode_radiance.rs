//! Radiance HDR encoder (Ward, "Real Pixels", Graphics Gems II, 1991): 8-bit mantissas with a shared exponent, rows
//! run-length encoded.

use std::io::{self, Write};

use super::encode::Output;
use crate::math::Rgb;

/// Rows of other widths cannot be run-length encoded.
const PACKED_WIDTHS: std::ops::RangeInclusive<usize> = 8..=32_767;
const LONGEST_RUN: usize = 127;
const LONGEST_LITERAL: usize = 128;
/// A shorter run takes as many bytes as a literal.
const SHORTEST_RUN: usize = 3;

pub(super) fn encode(writer: &mut impl Write, output: &Output<'_>) -> io::Result<()> {
    writer.write_all(b"#?RADIANCE\n")?;
    for (name, value) in output.metadata {
        // Metadata are written as comments: header variables have predefined meanings, and an empty line ends the
        // header.
        let line = format!("{name}: {value}").replace(['\n', '\r'], " ");
        writeln!(writer, "# {line}")?;
    }
    write!(writer, "SOFTWARE=rayfront\nFORMAT=32-bit_rle_rgbe\n\n")?;
    writeln!(writer, "-Y {} +X {}", output.height, output.width)?;
    let width = output.width as usize;
    for row in output.radiance.chunks_exact(width) {
        let pixels: Vec<[u8; 4]> = row.iter().map(|pixel| rgbe(*pixel)).collect();
        if !PACKED_WIDTHS.contains(&width) {
            writer.write_all(pixels.as_flattened())?;
            continue;
        }
        writer.write_all(&[2, 2, (width >> 8) as u8, (width & 255) as u8])?;
        for channel in 0..4 {
            let bytes: Vec<u8> = pixels.iter().map(|pixel| pixel[channel]).collect();
            pack(writer, &bytes)?;
        }
    }
    Ok(())
}

/// Encodes three mantissas and an exponent: a component is `mantissa * 2^(exponent - 136)`. NaN and negative components
/// become 0; values that are too large (above 2^127) become the largest one.
fn rgbe(pixel: Rgb) -> [u8; 4] {
    /// The largest value that rounds to a mantissa of 255 at the largest exponent.
    const BRIGHTEST: f32 = 1.695e38;
    let components = pixel.to_array().map(|c| if c > 0.0 { f64::from(c.min(BRIGHTEST)) } else { 0.0 });
    let largest = components[0].max(components[1]).max(components[2]);
    // largest = fraction * 2^exponent with fraction in [0.5, 1).
    let (fraction, mut exponent) = libm::frexp(largest);
    if largest == 0.0 || exponent < -127 {
        return [0; 4];
    }
    // The mantissa would be rounded up to 256.
    if fraction * 256.0 >= 255.5 {
        exponent += 1;
    }
    let unit = libm::ldexp(1.0, exponent - 8);
    let [r, g, b] = components.map(|c| (c / unit + 0.5) as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// Run-length encodes one channel of a row. A byte above 128 is a repeat count of the next byte, plus 128; any other is
/// the number of literal bytes that follow.
fn pack(writer: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    let run_at = |start: usize| {
        let same = bytes[start..].iter().take_while(|byte| **byte == bytes[start]);
        same.take(LONGEST_RUN).count()
    };
    let mut start = 0;
    while start < bytes.len() {
        let run = run_at(start);
        if run >= SHORTEST_RUN {
            writer.write_all(&[128 + run as u8, bytes[start]])?;
            start += run;
            continue;
        }
        let mut end = start + run;
        while end < bytes.len() && end - start < LONGEST_LITERAL && run_at(end) < SHORTEST_RUN {
            end += 1;
        }
        writer.write_all(&[(end - start) as u8])?;
        writer.write_all(&bytes[start..end])?;
        start = end;
    }
    Ok(())
}
