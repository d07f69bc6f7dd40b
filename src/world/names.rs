//! The comparison of names that users type with names in files.

use std::borrow::Cow;

use unicode_normalization::{UnicodeNormalization, is_nfc};

/// A name with each accent as a part of its letter: some systems write `é` as one character and others as two.
pub(crate) fn composed(name: &str) -> Cow<'_, str> {
    if is_nfc(name) { name.into() } else { name.nfc().collect::<String>().into() }
}

/// True if two names are the same text, [`composed`].
pub(crate) fn is_same_name(one: &str, other: &str) -> bool {
    one == other || !(one.is_ascii() && other.is_ascii()) && composed(one) == composed(other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_same_with_composed_and_decomposed_accents() {
        assert!(is_same_name("Za\u{308}hler", "Z\u{e4}hler") && is_same_name("\u{e9}", "e\u{301}"));
        assert!(is_same_name("lamp", "lamp") && is_same_name("\u{ac00}", "\u{1100}\u{1161}"));
        assert!(composed("lamp") == "lamp" && composed("e\u{301}") == "\u{e9}");
        assert!(!is_same_name("Zahler", "Z\u{e4}hler") && !is_same_name("lamp", "Lamp"));
    }
}
