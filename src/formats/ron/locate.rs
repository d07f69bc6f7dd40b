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

/// The part of `text` inside which `part` lies begins this many bytes into it; none when
/// `part` is not a slice of `text`.
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
    while let Some(character) = text[offset..].chars().next() {
        let rest = &text[offset..];
        let literal = match character {
            '"' => Some((plain_string(rest), "string")),
            'r' if starts_raw_string(rest) => Some((raw_string(rest), "string")),
            '\'' => Some((Some(character_literal(rest)), "character")),
            '/' if rest.starts_with("/*") => Some((block_comment(rest), "comment")),
            '/' if rest.starts_with("//") => Some((Some(rest.find('\n').unwrap_or(rest.len())), "comment")),
            'a'..='z' | 'A'..='Z' | '_' => Some((Some(rest.len() - split_identifier(rest).1.len()), "word")),
            _ => None,
        };
        if let Some((length, what)) = literal {
            match length {
                Some(length) => offset += length.max(1),
                None => return Some(Unclosed { offset, what }),
            }
            continue;
        }
        match character {
            '(' => open.push(Unclosed { offset, what: "\"(\"" }),
            '[' => open.push(Unclosed { offset, what: "\"[\"" }),
            '{' => open.push(Unclosed { offset, what: "\"{\"" }),
            ')' | ']' | '}' => {
                let expected = match character {
                    ')' => "\"(\"",
                    ']' => "\"[\"",
                    _ => "\"{\"",
                };
                // A closing bracket too many is where the parser stops by itself.
                let last = open.pop()?;
                if last.what != expected {
                    return Some(last);
                }
            }
            _ => {}
        }
        offset += character.len_utf8();
    }
    open.pop()
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

fn starts_raw_string(text: &str) -> bool {
    text[1..].trim_start_matches('#').starts_with('"')
}

fn raw_string(text: &str) -> Option<usize> {
    let hashes = text[1..].len() - text[1..].trim_start_matches('#').len();
    let body = 2 + hashes;
    let end = format!("\"{}", "#".repeat(hashes));
    text[body..].find(&end).map(|offset| body + offset + end.len())
}

/// An apostrophe alone where no character literal is.
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
