//! Locates parts of a text: lines and columns, blanks, brackets. Validation is left to `ron`; this module only finds
//! the places for messages.

/// The line and column of a byte offset, both from 1, the column in characters.
pub(super) fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
    (line, before[line_start..].chars().count() + 1)
}

/// The byte offset of a line and column, counted as by [`position`].
pub(super) fn offset(text: &str, line: usize, column: usize) -> usize {
    let line_start = if line <= 1 {
        0
    } else {
        text.match_indices('\n').nth(line - 2).map_or(text.len(), |(newline, _)| newline + 1)
    };
    let in_line = text[line_start..].char_indices().nth(column.saturating_sub(1));
    in_line.map_or(text.len(), |(offset, _)| line_start + offset)
}

/// The byte offset of `part` within `text`; none if `part` is not a slice of it.
pub(super) fn offset_of(text: &str, part: &str) -> Option<usize> {
    let offset = part.as_ptr().addr().checked_sub(text.as_ptr().addr())?;
    (offset + part.len() <= text.len()).then_some(offset)
}

/// The text without leading white space and comments.
pub(super) fn skip_blank(text: &str) -> &str {
    let mut rest = text;
    loop {
        // Most texts begin with no or one blank: decoding characters takes longer.
        rest = rest.strip_prefix(' ').unwrap_or(rest);
        if rest.as_bytes().first().is_some_and(|byte| byte.is_ascii_graphic() && *byte != b'/') {
            return rest;
        }
        rest = rest.trim_start_matches(is_blank);
        if rest.starts_with("//") {
            rest = rest.find('\n').map_or("", |newline| &rest[newline..]);
        } else if rest.starts_with("/*") {
            match block_comment(rest) {
                Some(length) => rest = &rest[length..],
                None => return "",
            }
        } else {
            return rest;
        }
    }
}

/// The text without white space and comments at its end.
pub(super) fn without_trailing_blanks(text: &str) -> &str {
    let (mut end, mut rest) = (0, skip_blank(text));
    while !rest.is_empty() {
        let (_, length) = token(rest);
        end = text.len() - rest.len() + length;
        rest = skip_blank(&text[end..]);
    }
    &text[..end]
}

/// Splits `text` into the name that it begins with, which may be empty, and the rest.
pub(super) fn split_identifier(text: &str) -> (&str, &str) {
    let text = text.strip_prefix("r#").unwrap_or(text);
    let is_ascii_word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    let ascii = text.bytes().take_while(|byte| is_ascii_word(byte)).count();
    if text.as_bytes().get(ascii).is_none_or(u8::is_ascii) {
        return if text.as_bytes().first().is_some_and(u8::is_ascii_digit) {
            ("", text)
        } else {
            text.split_at(ascii)
        };
    }
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    if text.starts_with(|c: char| c.is_numeric()) { ("", text) } else { text.split_at(end) }
}

/// A bracket, string or comment that is not closed.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Unclosed {
    /// The byte offset of its start.
    pub offset: usize,
    /// The bracket in quotes, `string` or `comment`.
    pub what: &'static str,
}

/// Finds the innermost bracket that is left open or closed by the wrong bracket, or the first unclosed string or
/// comment.
pub(super) fn find_unclosed(text: &str) -> Option<Unclosed> {
    let mut open: Vec<Unclosed> = Vec::new();
    let mut offset = 0;
    while offset < text.len() {
        let (token, length) = token(&text[offset..]);
        match token {
            BracketToken::Open(what) => open.push(Unclosed { offset, what }),
            BracketToken::Close(expected) => {
                // The parser itself stops at a surplus closing bracket.
                let last = open.pop()?;
                if last.what != expected {
                    return Some(last);
                }
            }
            BracketToken::Unclosed(what) => return Some(Unclosed { offset, what }),
            _ => {}
        }
        offset += length;
    }
    open.pop()
}

/// Splits `key: value`; none if there is no colon.
pub(super) fn key_and_value(item: &str) -> Option<(&str, &str)> {
    let (mut depth, mut offset) = (0_usize, 0);
    while offset < item.len() {
        let (token, length) = token(&item[offset..]);
        match token {
            BracketToken::Open(_) => depth += 1,
            BracketToken::Close(_) => depth = depth.saturating_sub(1),
            BracketToken::Colon if depth == 0 => {
                return Some((item[..offset].trim_end(), skip_blank(&item[offset + length..])));
            }
            _ => {}
        }
        offset += length;
    }
    None
}

/// The tokens that matter for matching brackets.
pub(super) enum BracketToken {
    /// An opening bracket, in quotes.
    Open(&'static str),
    /// A closing bracket: the opening bracket that it matches, in quotes.
    Close(&'static str),
    Comma,
    Colon,
    /// A string or comment that is not closed.
    Unclosed(&'static str),
    Other,
}

/// The token at the start of `text`, which must not be empty, and its length in bytes.
pub(super) fn token(text: &str) -> (BracketToken, usize) {
    let literal = |length: Option<usize>, what| match length {
        Some(length) => (BracketToken::Other, length),
        None => (BracketToken::Unclosed(what), text.len()),
    };
    let bytes = text.as_bytes();
    match bytes[0] {
        b'(' => (BracketToken::Open("\"(\""), 1),
        b'[' => (BracketToken::Open("\"[\""), 1),
        b'{' => (BracketToken::Open("\"{\""), 1),
        b')' => (BracketToken::Close("\"(\""), 1),
        b']' => (BracketToken::Close("\"[\""), 1),
        b'}' => (BracketToken::Close("\"{\""), 1),
        b',' => (BracketToken::Comma, 1),
        b':' => (BracketToken::Colon, 1),
        b'"' => literal(plain_string(text), "string"),
        b'\'' => (BracketToken::Other, character_literal(text)),
        b'/' if text.starts_with("/*") => literal(block_comment(text), "comment"),
        b'/' if text.starts_with("//") => (BracketToken::Other, text.find('\n').unwrap_or(text.len())),
        b'r' if starts_raw_string(&text[1..]) => literal(raw_string(text, 1), "string"),
        b'b' if bytes.get(1) == Some(&b'r') && starts_raw_string(&text[2..]) => {
            literal(raw_string(text, 2), "string")
        }
        b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
            let word = bytes.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
            (BracketToken::Other, word)
        }
        _ => (BracketToken::Other, text.chars().next().map_or(1, char::len_utf8)),
    }
}

/// Tests for the white space of RON.
fn is_blank(c: char) -> bool {
    matches!(c, ' ' | '\t'..='\r' | '\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}')
}

fn plain_string(text: &str) -> Option<usize> {
    let mut escaped = false;
    for (offset, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return Some(offset + 1),
            _ => {}
        }
    }
    None
}

/// Tests if the `r` before `text` starts a raw string.
fn starts_raw_string(text: &str) -> bool {
    text.trim_start_matches('#').starts_with('"')
}

/// The length of the raw string whose `r` or `br` is `prefix` bytes long.
fn raw_string(text: &str, prefix: usize) -> Option<usize> {
    let after = &text[prefix..];
    let hashes = after.len() - after.trim_start_matches('#').len();
    let body = prefix + hashes + 1;
    let end = format!("\"{}", "#".repeat(hashes));
    text[body..].find(&end).map(|offset| body + offset + end.len())
}

/// The length in bytes of the character literal; 1, for the apostrophe, if it is none.
fn character_literal(text: &str) -> usize {
    let body = text[1..].strip_prefix('\\').unwrap_or(&text[1..]);
    let mut after = body.chars();
    match (after.next(), after.next()) {
        (Some(c), Some('\'')) => text.len() - body.len() + c.len_utf8() + 1,
        _ => 1,
    }
}

/// The length in bytes of a block comment, which may be nested; none if it is not closed.
pub(super) fn block_comment(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let (mut depth, mut offset) = (0_usize, 0);
    while offset + 1 < bytes.len() {
        match &bytes[offset..offset + 2] {
            b"/*" => depth += 1,
            b"*/" => depth -= 1,
            _ => {
                offset += 1;
                continue;
            }
        }
        offset += 2;
        if depth == 0 {
            return Some(offset);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_lines_count_newlines() {
        let text = "a\r\n/* äöü */ x\n";
        let x = text.find('x').unwrap();
        assert_eq!(position(text, x), (2, 11));
        assert_eq!(offset(text, 2, 11), x);
        assert_eq!(position(text, 0), (1, 1));
        assert_eq!(position(text, text.len()), (3, 1));
        assert_eq!(offset(text, 9, 1), text.len());
        assert_eq!(offset(text, 1, 99), text.len());
    }

    #[test]
    fn offset_of_finds_slices_and_rejects_other_texts() {
        let text = String::from("abcdef");
        assert_eq!(offset_of(&text, &text[2..4]), Some(2));
        assert_eq!(offset_of(&text, &text[6..]), Some(6));
        assert_eq!(offset_of(&text, "()"), None);
    }

    #[test]
    fn blanks_are_white_space_and_nested_comments() {
        assert_eq!(skip_blank(" \n// one\n/* two /* three */ */ (x"), "(x");
        assert_eq!(skip_blank("// to the end"), "");
        assert_eq!(skip_blank("/* open"), "");
        assert_eq!(skip_blank("/x"), "/x");
    }

    #[test]
    fn identifiers_are_split_off() {
        assert_eq!(split_identifier("Sphere (1)"), ("Sphere", " (1)"));
        assert_eq!(split_identifier("r#in:"), ("in", ":"));
        assert_eq!(split_identifier("12"), ("", "12"));
        assert_eq!(split_identifier(""), ("", ""));
    }

    #[test]
    fn keys_end_at_the_first_colon_outside_brackets_and_strings() {
        assert_eq!(key_and_value("\"a:b\" : (c: 1)"), Some(("\"a:b\"", "(c: 1)")));
        assert_eq!(key_and_value("(c: 1)"), None);
    }

    #[test]
    fn innermost_unclosed_bracket_string_or_comment_is_found() {
        let found = |text: &str| find_unclosed(text).map(|u| (u.offset, u.what));
        assert_eq!(found("([{}])"), None);
        assert_eq!(found("(a: [1, 2)"), Some((4, "\"[\"")));
        assert_eq!(found("(a: (1, 2)"), Some((0, "\"(\"")));
        assert_eq!(found("(\")\", ')', /* ) */ r#\")\"# // )\n"), Some((0, "\"(\"")));
        assert_eq!(found("(a: \"x)"), Some((4, "string")));
        assert_eq!(found("(a: r#\"x\")"), Some((4, "string")));
        assert_eq!(found("( /* x"), Some((2, "comment")));
        assert_eq!(found("())("), None);
        assert_eq!(found("(color\"x\")"), None);
    }
}
