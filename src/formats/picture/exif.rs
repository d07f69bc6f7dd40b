//! Texts in the EXIF data of JPEG and WebP files: lines `name: value` in the description.

/// The tag of a picture's description.
const DESCRIPTION: u16 = 0x010e;
/// The number of EXIF's type of texts.
const ASCII: u16 = 2;
/// The longest description: a JPEG file has at most 65,533 bytes of EXIF data.
const LONGEST: usize = 65_000;
/// Byte order, number of the format, and the place of the directory.
const HEADER: [u8; 8] = *b"II*\0\x08\0\0\0";
/// The place of the description: after the header and a directory of one entry.
const TEXT_AT: u32 = 26;

/// Encodes names and values, as many as fit.
pub(super) fn of(metadata: &[(String, String)]) -> Vec<u8> {
    let mut text = String::new();
    for (name, value) in metadata {
        let line = format!("{name}: {value}").replace(['\n', '\r', '\0'], " ") + "\n";
        if text.len() + line.len() <= LONGEST {
            text += &line;
        }
    }
    text.push('\0');
    let mut exif = HEADER.to_vec();
    exif.extend(1_u16.to_le_bytes());
    exif.extend([DESCRIPTION.to_le_bytes(), ASCII.to_le_bytes()].concat());
    exif.extend((text.len() as u32).to_le_bytes());
    exif.extend(TEXT_AT.to_le_bytes());
    // There is no further directory.
    exif.extend(0_u32.to_le_bytes());
    exif.extend(text.as_bytes());
    exif
}

/// Returns the value of a name in EXIF data that [`of`] has made.
pub(super) fn text(exif: &[u8], name: &str) -> Option<String> {
    let rest = exif.strip_prefix(&HEADER)?.get(TEXT_AT as usize - HEADER.len()..)?;
    let text = String::from_utf8_lossy(rest.split(|byte| *byte == 0).next()?).into_owned();
    let value = |line: &str| Some(line.split_once(": ").filter(|(found, _)| *found == name)?.1.to_owned());
    text.lines().find_map(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_found_by_name_and_long_ones_are_left_out() {
        let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let exif = of(&[pair("a", "1: 2\n3"), pair("long", &"x".repeat(70_000)), pair("Zoë", "ü")]);
        assert_eq!(text(&exif, "a").as_deref(), Some("1: 2 3"));
        assert_eq!((text(&exif, "long"), text(&exif, "Zoë").as_deref()), (None, Some("ü")));
        assert!(text(b"MM\0*", "a").is_none() && text(&exif[..20], "a").is_none());
    }
}
