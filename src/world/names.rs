//! The comparison of names that users type with names in files.

use unicode_normalization::UnicodeNormalization;

/// True if two names are the same text. An accent may be a part of its letter or follow it: some systems write `é` as
/// one character and others as two.
pub(crate) fn is_same_name(one: &str, other: &str) -> bool {
    one == other || !(one.is_ascii() && other.is_ascii()) && one.nfc().eq(other.nfc())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_same_with_composed_and_decomposed_accents() {
        assert!(is_same_name("Za\u{308}hler", "Z\u{e4}hler") && is_same_name("\u{e9}", "e\u{301}"));
        assert!(is_same_name("lamp", "lamp") && is_same_name("\u{ac00}", "\u{1100}\u{1161}"));
        assert!(!is_same_name("Zahler", "Z\u{e4}hler") && !is_same_name("lamp", "Lamp"));
    }
}
