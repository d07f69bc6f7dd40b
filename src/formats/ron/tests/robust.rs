//! Tests that no file makes the reader panic, however damaged.

use std::path::Path;

use proptest::prelude::*;

use super::writing::assert_same;
use super::{EVERYTHING, read};
use crate::error::LoadError;
use crate::formats::ron::write;

fn is_within(error: &LoadError, text: &str) {
    match error {
        LoadError::At { line, column, .. } => {
            let in_line = text.trim_start_matches('\u{feff}').split('\n').nth(line - 1).unwrap();
            assert!((1..=in_line.chars().count() + 1).contains(column), "{line}:{column} in {text}");
        }
        LoadError::Several(faults) => faults.iter().for_each(|fault| is_within(fault, text)),
        other => panic!("an error without a place: {other}"),
    }
}

/// Reads a text; checks that an error's place is within it, or that the world survives saving.
fn survives(text: &str) {
    match read(text) {
        Err(error) => is_within(&error, text),
        // An accepted scene can be saved, unless a mutation changed its mesh's extension, for example to .pl or .exe.
        Ok(world) => {
            if let Ok(written) = write(&world, Path::new("scenes/test.ron")) {
                let again =
                    read(&written).unwrap_or_else(|error| panic!("{error} in\n{written}\nfrom {text}"));
                assert_same(&world, &again);
            }
        }
    }
}

#[test]
fn every_prefix_is_refused_without_panic() {
    let end = EVERYTHING.trim_end().len();
    for (cut, _) in EVERYTHING.char_indices().filter(|(cut, _)| *cut < end) {
        let text = &EVERYTHING[..cut];
        survives(text);
        assert!(read(text).is_err(), "{text}");
    }
    assert!(read(EVERYTHING).is_ok());
}

#[test]
fn every_suffix_is_read_without_panic() {
    for (cut, _) in EVERYTHING.char_indices() {
        survives(&EVERYTHING[cut..]);
    }
}

/// Pieces of text, valid and invalid in scenes.
const PIECES: &[&str] = &[
    "(", ")", "[", "]", "{", "}", ",", ":", "\"", "'", "r#\"", "b\"", "br#\"", "b'", "//", "/*", "*/", "\\",
    "\n", "NaN", "-inf", "1e99", "-1", "0", "..", "1..2", "_", "#", "#![", "r#", "Some(", "None", "()", "ä",
    "\u{feff}", "\u{2028}", "\u{85}", "\0", "entities", "Sphere", "Mesh(\"missing\")",
    "99999999999999999999999", "0x1F", "1_0", "true", "1f32", "5u8", "\"a\"", "'('", "Image", "material",
    "kd", "parent: \"ball\"", "$", "$a", "variables: {\"a\": ", "include: [",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn mutated_scenes_are_read_without_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0..40_usize, 0..=PIECES.len()), 1..6),
    ) {
        let mut characters: Vec<char> = EVERYTHING.chars().collect();
        for (place, cut, piece) in edits {
            let start = place.index(characters.len().max(1)).min(characters.len());
            // Mostly insertions: after a long cut, little is left to go wrong.
            let end = (start + cut.saturating_sub(20)).min(characters.len());
            let piece = PIECES.get(piece).copied().unwrap_or_default();
            characters.splice(start..end, piece.chars());
        }
        survives(&characters.into_iter().collect::<String>());
    }

    #[test]
    fn pieces_in_any_order_are_read_without_panic(pieces in prop::collection::vec(prop::sample::select(PIECES), 0..24)) {
        let inside = pieces.concat();
        survives(&inside);
        survives(&format!("(entities: [({inside})])"));
        survives(&format!("(entities: [(material: (kd: {inside}))])"));
        survives(&format!("(entities: [(shape: Sphere(radius_m: {inside}))])"));
        survives(&format!("(entities: [(transform: {inside})])"));
    }

    #[test]
    fn any_text_is_read_without_panic(text in any::<String>()) {
        survives(&text);
    }
}
