//! Curves of hair, cables and the like: text with a point in each line, and the binary `.hair` files of Yuksel's models
//! (cemyuksel.com/research/hairmodels).

use std::path::Path;

use super::extension;
use crate::error::{Diagnostic, LoadError};
use crate::math::Vec3;
use crate::memory;
use crate::world::Strands;

/// The bytes of a `.hair` file before its arrays.
const HEADER: usize = 128;
/// The most bytes of a point, with its radius, and of a strand's end, for each byte of text.
const BYTES_PER_BYTE: u64 = 6;

/// The strands of a file, and warnings about its oddities.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<(Strands, Vec<Diagnostic>), LoadError> {
    let (mut strands, warnings) = match extension(path).as_str() {
        "hair" => {
            let found = binary(bytes).map_err(|reason| LoadError::invalid(path, reason))?;
            let warning = |what: &str| {
                let text = format!("{}: the strands' {what} are not used", path.display());
                Diagnostic::warning("import", text)
            };
            (found.0, found.1.into_iter().map(warning).collect())
        }
        "txt" => (text(bytes, path)?, Vec::new()),
        other => {
            let reason = format!("strands are .txt or .hair files, not \".{other}\"");
            return Err(LoadError::invalid(path, reason));
        }
    };
    if strands.ends.is_empty() {
        return Err(LoadError::invalid(path, "has no strand: give two points or more, one in each line"));
    }
    strands.source = Some(path.to_owned());
    Ok((strands, warnings))
}

/// Lines `x y z` or `x y z radius`, with an empty one between strands.
fn text(bytes: &[u8], path: &Path) -> Result<Strands, LoadError> {
    let what = format_args!("the strands of {}", path.display());
    let _claim =
        memory::reserve(what, bytes.len() as u64 * BYTES_PER_BYTE).map_err(LoadError::shortage(path))?;
    let mut strands = Strands::default();
    let fault = |line: usize, column: usize, reason: String| {
        Err(LoadError::At { file: path.to_owned(), line, column, reason })
    };
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let line = line.split(|byte| *byte == b'#').next().unwrap_or_default();
        let Ok(line) = std::str::from_utf8(line) else {
            return fault(index + 1, 1, "this is no text: strands are lines of numbers x y z".to_owned());
        };
        let (mut numbers, mut count) = ([0.0f32; 4], 0);
        for word in line.split([' ', '\t', '\r', ',']).filter(|word| !word.is_empty()) {
            let column = || line[..word.as_ptr() as usize - line.as_ptr() as usize].chars().count() + 1;
            let number = word.parse().ok().filter(|number: &f32| number.is_finite());
            match (number, numbers.get_mut(count)) {
                (Some(number), Some(to)) => *to = number,
                (None, _) => return fault(index + 1, column(), format!("expected a number, found {word:?}")),
                (_, None) => {
                    let reason = "expected x y z or x y z radius, found a fifth number".to_owned();
                    return fault(index + 1, column(), reason);
                }
            }
            if count == 3 && numbers[3] < 0.0 {
                return fault(index + 1, column(), format!("the radius ({word}) must be at least 0"));
            }
            count += 1;
        }
        let known = (!strands.points.is_empty()).then_some(!strands.radii_m.is_empty());
        match count {
            0 => end(&mut strands),
            3 | 4 if known.is_none_or(|radii| radii == (count == 4)) => {
                strands.points.push(Vec3::from_slice(&numbers));
                strands.radii_m.extend((count == 4).then_some(numbers[3]));
            }
            3 | 4 => {
                let reason = "give all points a radius, or none";
                return fault(index + 1, 1, reason.to_owned());
            }
            _ => {
                return fault(index + 1, 1, format!("expected x y z or x y z radius, found {count} numbers"));
            }
        }
    }
    end(&mut strands);
    Ok(strands)
}

/// Ends a strand, if it has begun.
fn end(strands: &mut Strands) {
    let all = strands.points.len() as u32;
    if strands.ends.last().copied().unwrap_or(0) < all {
        strands.ends.push(all);
    }
}

/// Returns the strands of a binary file, and the names of its arrays that are not used.
fn binary(bytes: &[u8]) -> Result<(Strands, Vec<&'static str>), String> {
    let cut = || "ends before its header says".to_owned();
    let header = bytes.get(..HEADER).filter(|header| header.starts_with(b"HAIR"));
    let header = header.ok_or("does not begin as .hair files do, with HAIR and a header of 128 bytes")?;
    let word = |at: usize| [0, 1, 2, 3].map(|k| header[at + k]);
    let [count, points, has, usual] = [4, 8, 12, 16].map(|at| u32::from_le_bytes(word(at)));
    let thickness = f32::from_le_bytes(word(20));
    let mut rest = &bytes[HEADER..];
    let mut array = |present: bool, items: u32, size: usize| -> Result<&[u8], String> {
        let length = if present { (items as usize).checked_mul(size).ok_or_else(cut)? } else { 0 };
        let (array, after) = rest.split_at_checked(length).ok_or_else(cut)?;
        rest = after;
        Ok(array)
    };
    let segments = array(has & 1 != 0, count, 2)?;
    let places = array(has & 2 != 0, points, 12)?;
    let thicknesses = array(has & 4 != 0, points, 4)?;
    let unused: Vec<_> =
        [(8, "transparencies"), (16, "colours")].into_iter().filter(|(bit, _)| has & bit != 0).collect();
    let floats = |bytes: &[u8]| -> Vec<f32> {
        bytes.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]])).collect()
    };
    let points: Vec<Vec3> = floats(places).chunks_exact(3).map(Vec3::from_slice).collect();
    // A thickness is a diameter.
    let mut radii_m: Vec<f32> = floats(thicknesses).into_iter().map(|thickness| 0.5 * thickness).collect();
    if radii_m.is_empty() && thickness > 0.0 && thickness.is_finite() {
        radii_m = vec![0.5 * thickness; points.len()];
    }
    if let Some(point) = points.iter().position(|point| !point.is_finite()) {
        return Err(format!("point {point} is not finite"));
    }
    if let Some(point) = radii_m.iter().position(|radius| !(*radius >= 0.0 && radius.is_finite())) {
        return Err(format!("the thickness of point {point} must be at least 0, and finite"));
    }
    let mut ends = Vec::with_capacity(if has & 1 != 0 { count as usize } else { 0 });
    let mut all = 0u64;
    for strand in 0..count as usize {
        let own = segments.get(2 * strand..2 * strand + 2);
        all += u64::from(own.map_or(usual, |own| u16::from_le_bytes([own[0], own[1]]).into())) + 1;
        if all > points.len() as u64 {
            return Err(format!("strand {strand} needs {all} points, and there are {}", points.len()));
        }
        ends.push(all as u32);
    }
    Ok((Strands { source: None, points, radii_m, ends }, unused.into_iter().map(|(_, name)| name).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, bytes: &[u8]) -> Result<(Strands, Vec<Diagnostic>), String> {
        parse(bytes, Path::new(name)).map_err(|error| error.to_string())
    }

    #[test]
    fn text_has_a_point_in_each_line_and_empty_lines_between_strands() {
        let text = b"# two strands\n0 0 0\n0 1 0 # up\n\n\n1, 0, 0\r\n1\t1e0 0\r\n1 2 -0.5";
        let (strands, warnings) = read("a.txt", text).unwrap();
        assert!(warnings.is_empty() && strands.radii_m.is_empty());
        assert_eq!(strands.ends, [2, 5]);
        assert_eq!(strands.points[4], Vec3::new(1.0, 2.0, -0.5));
        let (strands, _) = read("a.txt", b"0 0 0 0.1\n0 1 0 0\n").unwrap();
        assert_eq!((strands.radii_m, strands.ends), (vec![0.1, 0.0], vec![2]));
        for (text, message) in [
            (&b"0 0 0\n0 1\n"[..], "a.txt:2:1: expected x y z or x y z radius, found 2 numbers"),
            (b"0 0 0\n0  x 1\n", "a.txt:2:4: expected a number, found \"x\""),
            (b"0 0 inf\n", "a.txt:1:5: expected a number, found \"inf\""),
            (b"0 0 0 1 2\n", "a.txt:1:9: expected x y z or x y z radius, found a fifth number"),
            (b"0 0 0 -1\n", "a.txt:1:7: the radius (-1) must be at least 0"),
            (b"0 0 0\n0 0 0 1\n", "a.txt:2:1: give all points a radius, or none"),
            (b"0 0 0\n\xff\n", "a.txt:2:1: this is no text"),
            (b"# none\n", "a.txt: has no strand"),
        ] {
            let error = read("a.txt", text).unwrap_err();
            assert!(error.starts_with(message), "{error}");
        }
        assert!(read("a.abc", b"").unwrap_err().contains("strands are .txt or .hair files, not \".abc\""));
    }

    fn hair(has: u32, counts: [u32; 3], arrays: &[u8]) -> Vec<u8> {
        let mut bytes = b"HAIR".to_vec();
        for word in [counts[0], counts[1], has, counts[2]] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(0.5f32.to_le_bytes());
        bytes.resize(HEADER, 0);
        bytes.extend(arrays);
        bytes
    }

    #[test]
    fn hair_files_have_strands_of_segments_and_thickness() {
        let floats =
            |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let places: Vec<f32> = (0..15).map(|i| i as f32).collect();
        let own = [&[1, 0, 2, 0][..], &floats(&places), &floats(&[0.2; 5]), &floats(&[1.0; 5])].concat();
        let (strands, warnings) = read("a.hair", &hair(1 | 2 | 4 | 8, [2, 5, 9], &own)).unwrap();
        assert_eq!((&strands.ends[..], strands.points[4]), (&[2, 5][..], Vec3::new(12.0, 13.0, 14.0)));
        assert_eq!(strands.radii_m, [0.1; 5]);
        assert!(warnings.len() == 1 && warnings[0].to_string().contains("transparencies are not used"));
        // Segments and thickness of the header.
        let (strands, _) = read("a.hair", &hair(2, [1, 5, 4], &floats(&places))).unwrap();
        assert_eq!((&strands.ends[..], strands.radii_m[0]), (&[5][..], 0.25));
        let refused = |bytes: &[u8], message: &str| {
            let error = read("a.hair", bytes).unwrap_err();
            assert!(error.contains(message), "{error}");
        };
        refused(b"HAIR", "does not begin as .hair files do");
        refused(&hair(2, [1, 5, 4], &floats(&places[..14])), "ends before its header says");
        refused(&hair(2, [u32::MAX, 5, 4], &floats(&places)), "strand 1 needs 10 points, and there are 5");
        refused(&hair(2, [1, u32::MAX, 4], &[]), "ends before its header says");
        refused(&hair(2, [1, 1, 0], &floats(&[0.0, f32::NAN, 0.0])), "point 0 is not finite");
        refused(&hair(0, [0, 0, 0], &[]), "has no strand");
    }
}
