//! Animations as a stream of frames: YUV4MPEG2, supported by ffmpeg, x264 and most players of raw video.

use std::io::{self, Write};

use super::Output;

/// Writes the header before the first frame: size, frame rate as a fraction, no interlacing, square pixels, colour at
/// full resolution in limited range.
pub fn write_header(
    out: &mut dyn Write,
    [width, height]: [u32; 2],
    [frames, seconds]: [u32; 2],
) -> io::Result<()> {
    writeln!(out, "YUV4MPEG2 W{width} H{height} F{frames}:{seconds} Ip A1:1 C444 XCOLORRANGE=LIMITED")
}

/// Writes a frame with the values of an 8-bit PNG. The image must keep no opacity.
pub fn write_frame(out: &mut dyn Write, image: &Output<'_>) -> io::Result<()> {
    out.write_all(b"FRAME\n")?;
    let pixels: Vec<[u8; 3]> = image.shown_8_bit().as_chunks().0.iter().copied().map(y_cb_cr).collect();
    for component in 0..3 {
        let plane: Vec<u8> = pixels.iter().map(|pixel| pixel[component]).collect();
        out.write_all(&plane)?;
    }
    Ok(())
}

/// Converts an sRGB-encoded colour to Y′CbCr (Rec. ITU-R BT.709-6, items 3.2 to 3.4, 8 bits).
fn y_cb_cr(rgb: [u8; 3]) -> [u8; 3] {
    let [r, g, b] = rgb.map(|component| f64::from(component) / 255.0);
    let luma = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let [blue, red] = [(b - luma) / 1.8556, (r - luma) / 1.5748];
    [16.0 + 219.0 * luma, 128.0 + 224.0 * blue, 128.0 + 224.0 * red].map(|value| value.round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tonemap::DisplayTransform;
    use crate::math::Rgb;
    use crate::world::Tonemap;

    #[test]
    fn y_cb_cr_matches_the_recommendation() {
        assert_eq!(y_cb_cr([0, 0, 0]), [16, 128, 128]);
        assert_eq!(y_cb_cr([255, 255, 255]), [235, 128, 128]);
        assert_eq!(y_cb_cr([255, 0, 0]), [63, 102, 240]);
        assert_eq!(y_cb_cr([0, 0, 255]), [32, 240, 118]);
    }

    #[test]
    fn frame_planes_are_written_in_sequence() {
        let radiance = [Rgb::WHITE, Rgb::BLACK, Rgb::new(1.0, 0.0, 0.0)];
        let output = Output::plain([3, 1], &radiance, DisplayTransform::new(Tonemap::Clamp, 0.0, &radiance));
        let mut bytes = Vec::new();
        write_header(&mut bytes, [3, 1], [24, 1]).expect("room");
        write_frame(&mut bytes, &output).expect("room");
        let expected = b"YUV4MPEG2 W3 H1 F24:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\nFRAME\n\xeb\x10\x3f\x80\x80\x66\x80\x80\xf0";
        assert_eq!(bytes, expected);
    }
}
