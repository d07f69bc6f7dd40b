//! Replaces single values in a scene's text and keeps everything else as the author wrote it: comments, order and
//! formatting.

use std::path::Path;

use super::parts::TextPart;
use super::scan;
use super::source::{Raw, SceneText};
use crate::error::LoadError;

/// Returns the text with new values for some keys of the entity at a line and column.
pub fn with_keys(
    text: &str,
    path: &Path,
    [line, column]: [u32; 2],
    keys: &[(&str, String)],
) -> Result<String, LoadError> {
    let part = TextPart::new(text, path);
    let source = SceneText::new(std::slice::from_ref(&part), 0.0);
    source.root()?;
    let raw = Raw(&part.text[scan::offset(text, line as usize, column as usize)..]);
    if !raw.0.starts_with('(') {
        return Err(source.error(raw.0, "there is no entity here by now"));
    }
    let text = &*part.text;
    let mut edited = text.to_owned();
    let mut changes: Vec<(usize, usize, String)> =
        keys.iter().map(|(key, value)| change(&source, text, raw, key, value)).collect();
    // From the end, so that earlier offsets stay valid.
    changes.sort_by_key(|(start, ..)| std::cmp::Reverse(*start));
    for (start, end, value) in changes {
        edited.replace_range(start..end, &value);
    }
    Ok(edited)
}

/// The start and end of a key's value in the text, and its replacement. A missing key is inserted first.
fn change<'a>(
    source: &SceneText<'a>,
    text: &str,
    entity: Raw<'a>,
    key: &str,
    value: &str,
) -> (usize, usize, String) {
    let place = |part: &str| scan::offset_of(text, part).unwrap_or(0);
    for item in source.values(entity.0) {
        if let Some((found, old)) = scan::key_and_value(item)
            && found == key
        {
            let old = scan::without_trailing_blanks(old);
            return (place(old), place(old) + old.len(), value.to_owned());
        }
    }
    // Inserts the key after the opening parenthesis.
    let start = place(entity.0) + 1;
    (start, start, format!("{key}: {value}, "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"(
    entities: [
        (shape: Sphere(radius_m: 1)), // a ball
        (
            // Where we stand.
            name: "eye (1)", transform: LookAt(from: (0, 1, 5), to: (0, 0, 0)) /* so */,
            camera: Pinhole( vertical_fov_degrees: 45 /* ) */ ) // wide
        ),
    ],
)"#;

    #[test]
    fn values_are_replaced_and_everything_else_is_kept() {
        let keys =
            [("camera", "Orthographic(height_m: 2)".into()), ("transform", "(translate: (1, 2, 3))".into())];
        let edited = with_keys(SCENE, Path::new("a.ron"), [4, 9], &keys).unwrap();
        let expected = SCENE
            .replace("LookAt(from: (0, 1, 5), to: (0, 0, 0))", "(translate: (1, 2, 3))")
            .replace("Pinhole( vertical_fov_degrees: 45 /* ) */ )", "Orthographic(height_m: 2)");
        assert_eq!(edited, expected);
    }

    #[test]
    fn missing_keys_are_added_and_missing_entities_refused() {
        let edited = with_keys(SCENE, Path::new("a.ron"), [3, 9], &[("transform", "()".into())]).unwrap();
        assert!(edited.contains("(transform: (), shape: Sphere(radius_m: 1)), // a ball"), "{edited}");
        assert!(with_keys(SCENE, Path::new("a.ron"), [8, 5], &[]).is_err());
    }
}
