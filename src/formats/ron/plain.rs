//! One pass over text of the usual kind: checks that it is well formed, and finds its brackets.
//!
//! `ron` takes ten times as long. Only what it surely accepts is accepted here, without attributes, escapes, raw strings
//! and rare numbers; the caller leaves other texts to it, and with them all errors.

use super::scan::block_comment;
use super::tree::{BracketTree, TreeBuilder};

/// The largest number of brackets around a value: `ron` counts each twice, and stops at 128.
const DEEPEST: usize = 48;

/// The kind of a pair of brackets.
#[derive(Clone, Copy, PartialEq)]
enum Inside {
    /// Parentheses of which the first item is not known.
    Parentheses,
    Tuple,
    Structure,
    List,
    Map,
}

/// The tokens that may follow.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    /// An item, or the closing bracket.
    Item,
    Value,
    /// The colon after a key.
    Colon,
    /// After the first word in parentheses: a colon if it is a key, or else those after a variant.
    Name,
    /// After the name of a variant: parentheses, or the end of the value.
    Variant,
    /// A comma or the closing bracket.
    End,
}

/// The state of the pass.
struct PlainPass {
    builder: TreeBuilder,
    /// The brackets around the present ones, and the starts of their present items.
    around: Vec<(Option<Inside>, usize)>,
    inside: Option<Inside>,
    /// The start of the present item.
    item: usize,
    next: Next,
}

/// Returns the brackets of a text that is well formed; none if `ron` has to decide if it is.
pub(super) fn tree(text: &str) -> Option<BracketTree> {
    let mut pass = PlainPass {
        builder: TreeBuilder::default(),
        around: Vec::new(),
        inside: None,
        item: 0,
        next: Next::Value,
    };
    let (bytes, mut at) = (text.as_bytes(), 0);
    while let Some(byte) = bytes.get(at) {
        at += match byte {
            b' ' | b'\t'..=b'\r' => 1,
            b'/' => comment(text, at)?,
            b')' | b']' | b'}' => pass.close(*byte, at)?,
            b',' => pass.comma(at)?,
            b':' => pass.colon()?,
            _ => pass.begin(&bytes[at..], at)?,
        };
    }
    let is_whole = pass.around.is_empty() && matches!(pass.next, Next::Variant | Next::End);
    is_whole.then_some(pass.builder.tree)
}

impl PlainPass {
    /// A closing bracket. Returns its length, as all of these do.
    fn close(&mut self, byte: u8, at: usize) -> Option<usize> {
        let expected = match self.inside? {
            Inside::List => b']',
            Inside::Map => b'}',
            _ => b')',
        };
        if byte != expected || matches!(self.next, Next::Value | Next::Colon) {
            return None;
        }
        self.builder.close((self.next != Next::Item).then_some(self.item), at);
        (self.inside, self.item) = self.around.pop()?;
        self.next = Next::End;
        Some(1)
    }

    fn comma(&mut self, at: usize) -> Option<usize> {
        match self.next {
            Next::Name => self.inside = Some(Inside::Tuple),
            Next::Variant | Next::End if self.inside.is_some() => {}
            _ => return None,
        }
        self.builder.end_of_value(self.item, at);
        self.next = Next::Item;
        Some(1)
    }

    fn colon(&mut self) -> Option<usize> {
        match self.next {
            Next::Name => self.inside = Some(Inside::Structure),
            Next::Colon => {}
            _ => return None,
        }
        self.next = Next::Value;
        Some(1)
    }

    /// The first token of a key or a value, or the parentheses of a variant.
    fn begin(&mut self, rest: &[u8], at: usize) -> Option<usize> {
        match self.next {
            Next::Item => self.item = at,
            Next::Value => {}
            Next::Name | Next::Variant if rest[0] == b'(' => {}
            _ => return None,
        }
        let is_key = self.next == Next::Item && matches!(self.inside, Some(Inside::Structure | Inside::Map));
        let (length, next) = match rest[0] {
            b'"' => {
                let end = 1 + rest[1..].iter().position(|byte| matches!(byte, b'"' | b'\\'))?;
                if rest[end] == b'\\' || is_key && self.inside == Some(Inside::Structure) {
                    return None;
                }
                (end + 1, if is_key { Next::Colon } else { Next::End })
            }
            _ if is_key => {
                let length = word(rest);
                if length == 0 || self.inside == Some(Inside::Map) {
                    return None;
                }
                (length, Next::Colon)
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                let length = word(rest);
                let is_first = self.next == Next::Item && self.inside == Some(Inside::Parentheses);
                (length, after_word(&rest[..length], is_first)?)
            }
            b'0'..=b'9' | b'-' => (number(rest)?, Next::End),
            b'(' | b'[' | b'{' => (1, Next::Item),
            // The use of a variable: `ron` gets a blank in place of the sign.
            b'$' if word(&rest[1..]) > 0 => (1, Next::Value),
            _ => return None,
        };
        if self.inside == Some(Inside::Parentheses) && next != Next::Name {
            self.inside = Some(Inside::Tuple);
        }
        if next == Next::Item {
            self.open(rest[0], at)?;
        }
        self.next = next;
        Some(length)
    }

    fn open(&mut self, byte: u8, at: usize) -> Option<()> {
        self.builder.open(at);
        self.around.push((self.inside, self.item));
        self.inside = Some(match byte {
            b'(' => Inside::Parentheses,
            b'[' => Inside::List,
            _ => Inside::Map,
        });
        (self.around.len() <= DEEPEST).then_some(())
    }
}

/// The tokens that may follow a word that begins a value.
fn after_word(word: &[u8], may_be_key: bool) -> Option<Next> {
    match word {
        b"true" | b"false" | b"None" => Some(Next::End),
        // `ron` has rules of their own for these.
        [b'S', b'o', b'm', b'e', ..] | [b'i', b'n', b'f', ..] | [b'N', b'a', b'N', ..] => None,
        _ => Some(if may_be_key { Next::Name } else { Next::Variant }),
    }
}

/// The length of the word at the start of a text, which is 0 if it begins with no letter.
fn word(bytes: &[u8]) -> usize {
    if bytes.first().is_none_or(u8::is_ascii_digit) {
        return 0;
    }
    bytes.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count()
}

/// The length of the comment at a place; none if there is none, or if it is not closed.
fn comment(text: &str, at: usize) -> Option<usize> {
    let rest = &text[at..];
    match rest.as_bytes().get(1)? {
        b'/' => rest.find('\n'),
        b'*' => block_comment(rest),
        _ => None,
    }
}

/// The length of a decimal number with digits before and after its point.
fn number(bytes: &[u8]) -> Option<usize> {
    let digits = |from: usize| {
        let count = bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        (count > 0).then_some(from + count)
    };
    let mut end = digits(usize::from(bytes[0] == b'-'))?;
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1)?;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        end += 1;
        end = digits(end + usize::from(matches!(bytes.get(end), Some(b'+' | b'-'))))?;
    }
    Some(end)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::path::{Path, PathBuf};

    use proptest::prelude::*;
    use proptest::test_runner::TestRunner;
    use serde::de::IgnoredAny;

    use super::*;
    use crate::formats::ron::variables::without_variables;

    /// Tests if a text is accepted, which `ron` must accept then, with the brackets that are found token by token.
    fn is_plain(text: &str) -> bool {
        let Some(tree) = tree(text) else { return false };
        let read = ron::from_str::<IgnoredAny>(&without_variables(text));
        assert!(read.is_ok(), "{read:?} in {text}");
        assert_eq!(tree, BracketTree::new(text), "{text}");
        true
    }

    #[test]
    fn usual_forms_are_plain() {
        for text in [
            "(a: 1, b: (x: -1.5e-3, y: [1, 2e5, ], ), c: {\"k\": Foo (bar), \"l\": (), }, d: true,)",
            " /* /* */ ; */ ( // (\n) // \n",
            "Name",
            "\"ä, (\"",
            "12345678901234567890123456789",
            "($a, [$b], Foo(a: $c))",
            "( a , b )",
            "(a /* , */ , (1,),)",
        ] {
            assert!(is_plain(text), "{text}");
        }
        assert!(is_plain(&format!("{}{}", "[".repeat(DEEPEST), "]".repeat(DEEPEST))));
        for text in [
            "(", "(a: 1", "(1, a: 2)", "(a: 1, 2)", "[a: 1]", "[1 2]", "(,)", "(a:)", "1 2", "{1}", "", "(]",
            "(a: 1))",
        ] {
            assert!(!is_plain(text), "{text}");
        }
    }

    /// The texts of all scenes in this folder and those in it.
    fn scenes_in(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let mut paths: Vec<_> = entries.collect();
        paths.sort();
        let texts = |path: PathBuf| match path.extension() {
            _ if path.is_dir() => scenes_in(&path),
            Some(extension) if extension == "ron" => vec![std::fs::read_to_string(path).unwrap()],
            _ => Vec::new(),
        };
        paths.into_iter().flat_map(texts).collect()
    }

    fn shipped() -> Vec<String> {
        scenes_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes"))
    }

    #[test]
    fn shipped_scenes_are_plain() {
        assert!(shipped().len() > 30);
        for text in shipped() {
            assert!(is_plain(&text) || text.contains('\\'), "{text}");
        }
    }

    const PIECES: &[&str] = &[
        "(", ")", "[", "]", "{", "}", ",", ":", "\"", "\"a\"", "'", "r#\"", "b\"", "//", "/*", "*/", "\\",
        "\n", " ", "NaN", "inf", "Some", "None", "true", "-", "1", "2.5", ".", "e", "e5", "+", "_", "#", "$",
        "$a", "a", "Foo", "r", "b", "0x", "ä", "\u{85}", "\0", "\u{feff}", "a: ", "(a: 1)", "(1, 2)", "[1]",
        "{\"a\": 1}", "()", "f32",
    ];

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn plain_texts_are_those_of_ron(pieces in prop::collection::vec(prop::sample::select(PIECES), 0..12)) {
            let text = pieces.concat();
            is_plain(&text);
            is_plain(&format!("({text})"));
            is_plain(&format!("(a: [{text}], b: 1)"));
            is_plain(&format!("{{\"a\": {text}}}"));
        }
    }

    #[test]
    fn changed_scenes_are_those_of_ron() {
        let texts = shipped();
        let edit = (any::<prop::sample::Index>(), 0..3_usize, 0..=PIECES.len());
        let edits = (0..texts.len(), prop::collection::vec(edit, 1..3));
        let accepted = Cell::new(0);
        let mut runner = TestRunner::new(ProptestConfig::with_cases(1000));
        let run = runner.run(&edits, |(number, edits)| {
            let mut characters: Vec<char> = texts[number].chars().collect();
            for (place, cut, piece) in edits {
                let start = place.index(characters.len());
                let end = (start + cut).min(characters.len());
                characters.splice(start..end, PIECES.get(piece).copied().unwrap_or_default().chars());
            }
            accepted.set(accepted.get() + u32::from(is_plain(&String::from_iter(characters))));
            Ok(())
        });
        run.unwrap();
        assert!((100..900).contains(&accepted.get()), "{accepted:?}");
    }
}
