//! Photometric profiles (IES LM-63): the intensity of a light by direction, resampled to an image. Columns are angles
//! about the light's axis, from 0 to 360°; rows are angles from the axis. The first row is straight ahead, the last one
//! straight back, so that measured angles coincide with rows.

use std::path::Path;

use crate::error::LoadError;
use crate::world::{Image, Texels};

/// The size of the image.
const WIDTH: usize = 144;
const HEIGHT: usize = 361;

/// True if the file has the extension of profiles (the oldest ones do not identify themselves) or their signature.
pub(super) fn is_ies(bytes: &[u8], path: &Path) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    text.starts_with(b"IES")
        || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ies"))
}

/// The numbers of a file, in order.
struct Numbers<'a> {
    text: std::str::SplitAsciiWhitespace<'a>,
    path: &'a Path,
}

impl Numbers<'_> {
    fn next(&mut self, what: &str) -> Result<f32, LoadError> {
        let text = self.text.next().ok_or_else(|| self.error(&format!("it ends before {what}")))?;
        let number = text.parse().ok().filter(|number: &f32| number.is_finite());
        number.ok_or_else(|| self.error(&format!("{what}: {text:?} is not a number")))
    }

    /// Reads a count of at most 10,000, so that a broken file cannot demand more.
    fn count(&mut self, what: &str) -> Result<usize, LoadError> {
        let number = self.next(what)?;
        if number.fract() == 0.0 && (1.0..=1e4).contains(&number) {
            Ok(number as usize)
        } else {
            Err(self.error(&format!("{what} is {number}, not a number from 1 to 10000")))
        }
    }

    fn several(&mut self, count: usize, what: &str) -> Result<Vec<f32>, LoadError> {
        (0..count).map(|_| self.next(what)).collect()
    }

    /// Reads angles in ascending order.
    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f32>, LoadError> {
        let angles = self.several(count, what)?;
        if angles.windows(2).all(|pair| pair[0] < pair[1]) {
            Ok(angles)
        } else {
            Err(self.error(&format!("its {what} do not grow")))
        }
    }

    fn error(&self, reason: &str) -> LoadError {
        LoadError::invalid(self.path, format!("the photometric profile cannot be read: {reason}"))
    }
}

/// Reads a profile.
pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<Image, LoadError> {
    // Keywords may have any text encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes).replace(',', " ");
    let nothing = Numbers { text: "".split_ascii_whitespace(), path };
    let (_, rest) = text.split_once("TILT=").ok_or_else(|| nothing.error("it has no line TILT="))?;
    let (tilt, rest) = rest.split_once('\n').ok_or_else(|| nothing.error("it ends after TILT="))?;
    let mut numbers = Numbers { text: rest.split_ascii_whitespace(), path };
    match tilt.trim() {
        "NONE" => {}
        "INCLUDE" => {
            // The change of output with the tilt of the lamp is skipped: lights are used as they were measured.
            numbers.next("the tilt's geometry")?;
            let count = numbers.count("the number of tilts")?;
            numbers.several(2 * count, "the tilts")?;
        }
        other => return Err(numbers.error(&format!("TILT={other} is in another file: use TILT=NONE"))),
    }
    numbers.several(3, "lamps, lumens and the multiplier")?;
    let vertical = numbers.count("the number of vertical angles")?;
    let horizontal = numbers.count("the number of horizontal angles")?;
    let kind = numbers.next("the photometric type")?;
    if kind != 1.0 {
        return Err(numbers.error(&format!("it is of photometric type {kind}, and only type C (1) is read")));
    }
    numbers.several(7, "sizes, ballast factors and watts")?;
    let down = numbers.angles(vertical, "vertical angles")?;
    let mut around = numbers.angles(horizontal, "horizontal angles")?;
    let mut candela = numbers.several(vertical * horizontal, "candela values")?;
    if let (Some(first), Some(last)) = (around.first(), around.last())
        && *last > 270.0
        && *last < first + 360.0
    {
        // Closes the circle with the first angle.
        around.push(first + 360.0);
        candela.extend_from_within(..vertical);
    }
    let profile = IesProfile { down, around, candela };
    let texel = |i: usize| {
        let (down, around) = (i / WIDTH, i % WIDTH);
        [profile.at(180.0 * down as f32 / (HEIGHT - 1) as f32, 360.0 * around as f32 / WIDTH as f32); 3]
    };
    let texels = Texels::Rgb32((0..WIDTH * HEIGHT).map(texel).collect());
    Ok(Image { source: None, width: WIDTH as u32, height: HEIGHT as u32, texels })
}

/// The measured intensities.
struct IesProfile {
    down: Vec<f32>,
    around: Vec<f32>,
    /// The intensities at all angles from the axis, for each angle around it.
    candela: Vec<f32>,
}

impl IesProfile {
    /// The intensity in a direction, given in degrees.
    fn at(&self, down: f32, around: f32) -> f32 {
        // Directions that were not measured are dark.
        let Some((row, part)) = between(&self.down, down) else { return 0.0 };
        let (first, last) = (self.around[0], self.around.last().copied().unwrap_or(0.0));
        // Symmetric lights are measured in one quadrant or one half only.
        let around = match last {
            last if last <= 0.0 => 0.0,
            last if last <= 90.0 => 90.0 - ((around % 180.0) - 90.0).abs(),
            last if last <= 180.0 => 180.0 - (around - 180.0).abs(),
            // Symmetric about the plane through 90° and 270°.
            last if first >= 90.0 && last <= 270.0 => match around {
                around if (90.0..=270.0).contains(&around) => around,
                around => (540.0 - around) % 360.0,
            },
            _ if around < first => around + 360.0,
            _ => around,
        };
        let (column, across) = between(&self.around, around.clamp(first, last)).unwrap_or((0, 0.0));
        let value = |column: usize| {
            let values = &self.candela[column * self.down.len()..];
            let next = values[(row + 1).min(self.down.len() - 1)];
            values[row] * (1.0 - part) + next * part
        };
        let next = (column + 1).min(self.around.len() - 1);
        (value(column) * (1.0 - across) + value(next) * across).max(0.0)
    }
}

/// The index of the last of the ascending angles that is not above `angle`, and the fraction of the way to the next.
fn between(angles: &[f32], angle: f32) -> Option<(usize, f32)> {
    let (first, last) = (*angles.first()?, *angles.last()?);
    if angle < first - 1e-3 || angle > last + 1e-3 {
        return None;
    }
    let low = angles.partition_point(|other| *other <= angle).saturating_sub(1);
    let next = angles.get(low + 1).copied().unwrap_or(f32::INFINITY);
    Some((low, ((angle - angles[low]) / (next - angles[low])).clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Image, LoadError> {
        decode(text.as_bytes(), Path::new("lamp.ies"))
    }

    fn value(image: &Image, down: f32, around: f32) -> f32 {
        let Texels::Rgb32(texels) = &image.texels else { panic!() };
        let row = (down / 180.0 * (HEIGHT - 1) as f32).round() as usize;
        let column = (around / 360.0 * WIDTH as f32).round() as usize % WIDTH;
        texels[row * WIDTH + column][0]
    }

    const HEAD: &str = "IESNA:LM-63-2002\n[TEST] made up\nTILT=NONE\n1 1000 1 ";

    #[test]
    fn profiles_are_read_with_their_symmetries() {
        let round = read(&format!("{HEAD}3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 50, 0\n")).unwrap();
        for around in [0.0, 77.0, 311.0] {
            assert!((value(&round, 22.5, around) - 75.0).abs() < 0.6);
            assert!((value(&round, 0.1, around) - 100.0).abs() < 0.6);
            assert_eq!(value(&round, 91.0, around), 0.0);
        }
        // 0 to 90°: mirrored about both planes.
        let quarter = read(&format!("{HEAD}2 2 1 2 0 0 0 1 1 10 0 180 0 90 100 100 20 20")).unwrap();
        for around in [30.0, 150.0, 210.0, 330.0] {
            let found = value(&quarter, 90.0, around);
            assert!((found - (100.0 - 80.0 / 3.0)).abs() < 3.0, "{around}: {found}");
        }
        // 0 to 360°.
        let whole = read(&format!("{HEAD}2 3 1 2 0 0 0 1 1 10 0 180 0 180 360 0 0 90 90 0 0")).unwrap();
        assert!((value(&whole, 10.0, 90.0) - 45.0).abs() < 2.0);
        assert!((value(&whole, 10.0, 270.0) - 45.0).abs() < 2.0);
        // 90 to 270°: 0° equals 180°, 30° equals 150°, 330° equals 210°.
        let half = read(&format!("{HEAD}2 3 1 2 0 0 0 1 1 10 0 180 90 180 270 10 10 50 50 90 90")).unwrap();
        for (around, expected) in
            [(90.0, 10.0), (180.0, 50.0), (0.0, 50.0), (30.0, 36.7), (150.0, 36.7), (330.0, 63.3)]
        {
            let found = value(&half, 90.0, around);
            assert!((found - expected).abs() < 2.0, "{around}: {found}");
        }
        // Without 360°, the last angle is followed by the first.
        let open =
            read(&format!("{HEAD}2 4 1 2 0 0 0 1 1 10 0 180 0 90 180 300 10 10 10 10 10 10 70 70")).unwrap();
        assert!((value(&open, 90.0, 330.0) - 40.0).abs() < 3.0);
    }

    #[test]
    fn errors_name_what_is_invalid() {
        for (text, part) in [
            ("IESNA", "TILT="),
            ("TILT=NONE\n1 2", "ends before"),
            ("TILT=NONE\n1 2 3 2.5 1 1", "2.5"),
            ("TILT=NONE\n1 2 3 9999 9999 1 2 0 0 0 1 1 10 0 1", "ends before"),
            ("TILT=NONE\n1 2 3 2 1 2", "type C"),
            ("TILT=NONE\n1 2 3 2 1 1 2 0 0 0 1 1 10 90 0 0 5 5", "do not grow"),
            ("TILT=NONE\n1 2 3 two", "is not a number"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
