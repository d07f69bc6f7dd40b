//! Where things are in a text: lines and columns, blanks, brackets. Nothing here
//! decides what is valid, that is `ron`'s part; it only finds the places to name.

/// Line and column, both from 1, the column in characters.
pub(super) fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
    (line, before[line_start..].chars().count() + 1)
}

/// The byte offset of a line and column as [`position`] counts them.
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

/// `text` without the white space and comments that it begins with.
pub(super) fn skip_blank(text: &str) -> &str {
    let mut rest = text;
    loop {
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

/// The name that `text` begins with and what follows it.
pub(super) fn split_identifier(text: &str) -> (&str, &str) {
    let text = text.strip_prefix("r#").unwrap_or(text);
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    if text.starts_with(|c: char| c.is_numeric()) { ("", text) } else { text.split_at(end) }
}

/// A bracket, string or comment without its other end.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Unclosed {
    /// Byte offset.
    pub offset: usize,
    /// What begins there.
    pub what: &'static str,
}

/// The first thing that is opened and not closed, or closed by the wrong bracket.
pub(super) fn find_unclosed(text: &str) -> Option<Unclosed> {
    let mut open: Vec<Unclosed> = Vec::new();
    let mut offset = 0;
    while offset < text.len() {
        let (token, length) = token(&text[offset..]);
        match token {
            BracketToken::Open(what) => open.push(Unclosed { offset, what }),
            BracketToken::Close(expected) => {
                // At a surplus closing bracket the parser stops by itself.
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

/// The values between the brackets that `text` begins with, without blanks in front;
/// what follows the closing bracket counts for nothing.
pub(super) fn items(text: &str) -> Vec<&str> {
    let mut items = Vec::new();
    let (mut depth, mut offset, mut start) = (0_usize, 0, 0);
    while offset < text.len() {
        let (token, length) = token(&text[offset..]);
        let (ends_item, next_depth) = match token {
            BracketToken::Open(_) => (false, depth + 1),
            BracketToken::Close(_) => (depth <= 1, depth.saturating_sub(1)),
            BracketToken::Comma => (depth == 1, depth),
            _ => (false, depth),
        };
        if depth == 0 && next_depth == 1 {
            start = offset + length;
        }
        if ends_item {
            let item = skip_blank(&text[start..offset]);
            if !item.is_empty() {
                items.push(item);
            }
            start = offset + length;
        }
        depth = next_depth;
        offset += length;
        if depth == 0 {
            break;
        }
    }
    items
}

/// What follows the brackets that `text` begins with.
pub(super) fn skip_brackets(text: &str) -> &str {
    let (mut depth, mut offset) = (0_usize, 0);
    while offset < text.len() {
        let (token, length) = token(&text[offset..]);
        match token {
            BracketToken::Open(_) => depth += 1,
            BracketToken::Close(_) => depth = depth.saturating_sub(1),
            _ => {}
        }
        offset += length;
        if depth == 0 {
            break;
        }
    }
    &text[offset..]
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
enum BracketToken {
    /// What it is, in quotes.
    Open(&'static str),
    /// Which bracket it closes.
    Close(&'static str),
    Comma,
    Colon,
    /// A string or comment without end.
    Unclosed(&'static str),
    Other,
}

/// The token that `text` begins with (it is not empty), and its length in bytes.
fn token(text: &str) -> (BracketToken, usize) {
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

/// The white space of RON.
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

/// Whether the `r` before `text` begins a raw string.
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

/// If this is no character literal, the apostrophe alone.
fn character_literal(text: &str) -> usize {
    let body = text[1..].strip_prefix('\\').unwrap_or(&text[1..]);
    let mut after = body.chars();
    match (after.next(), after.next()) {
        (Some(c), Some('\'')) => text.len() - body.len() + c.len_utf8() + 1,
        _ => 1,
    }
}

/// Comments nest.
fn block_comment(text: &str) -> Option<usize> {
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
    fn a_slice_is_found_and_a_stranger_is_not() {
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
    fn brackets_are_taken_apart() {
        assert_eq!(
            items("(1, (2, 3) ,/* , */ \"4,)\", r#\"\"),\"#, ',' , br\"\\\",) // x"),
            ["1", "(2, 3) ", "\"4,)\"", "r#\"\"),\"#", "',' ", "br\"\\\""]
        );
        assert!(items("( )").is_empty());
        assert!(items("").is_empty());
        assert!(items("5").is_empty());
        assert_eq!(key_and_value("\"a:b\" : (c: 1)"), Some(("\"a:b\"", "(c: 1)")));
        assert_eq!(key_and_value("(c: 1)"), None);
    }

    #[test]
    fn the_innermost_unclosed_thing_is_found() {
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
