//! The targets of URIs: data within the URI, or a file in the document's folder or below.

use std::path::{Component, Path, PathBuf};

use crate::files;

/// The target of a URI.
#[derive(Debug, PartialEq)]
pub(super) enum Resource {
    /// The bytes in the URI itself.
    Data(Vec<u8>),
    /// A file.
    File(PathBuf),
}

/// Resolves `uri`, relative to `folder`; the error is a reason.
pub(super) fn resolve(uri: &str, folder: &Path) -> Result<Resource, String> {
    match uri.get(..5).filter(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        Some(_) => data(&uri[5..]).map(Resource::Data),
        None => file(uri, folder).map(Resource::File),
    }
}

fn data(rest: &str) -> Result<Vec<u8>, String> {
    let (kind, data) = rest.split_once(',').ok_or("the data URI has no comma before its data")?;
    if kind.split(';').next_back().is_some_and(|last| last.eq_ignore_ascii_case("base64")) {
        base64(data.as_bytes())
            .map_err(|at| format!("the data URI is not base64 at character {at} of its data"))
    } else {
        Ok(percent_decode(data))
    }
}

/// Decodes base64 (RFC 4648); the padding may be missing. The error is the position of the fault.
fn base64(text: &[u8]) -> Result<Vec<u8>, usize> {
    let padding = text.iter().rev().take(2).take_while(|c| **c == b'=').count();
    let digits = &text[..text.len() - padding];
    if digits.len() % 4 == 1 {
        return Err(digits.len());
    }
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for (index, group) in digits.chunks(4).enumerate() {
        let mut bits = 0;
        for (place, digit) in group.iter().enumerate() {
            let value = digit_value(*digit).ok_or(index * 4 + place + 1)?;
            bits |= u32::from(value) << (18 - 6 * place);
        }
        let [_, a, b, c] = bits.to_be_bytes();
        bytes.extend_from_slice(&[a, b, c][..group.len() - 1]);
    }
    Ok(bytes)
}

fn digit_value(digit: u8) -> Option<u8> {
    Some(match digit {
        b'A'..=b'Z' => digit - b'A',
        b'a'..=b'z' => digit - b'a' + 26,
        b'0'..=b'9' => digit - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    })
}

/// Resolves a path relative to `folder`, which must stay below it unless that is allowed.
fn file(uri: &str, folder: &Path) -> Result<PathBuf, String> {
    let shown = || -> String { uri.chars().take(80).flat_map(char::escape_debug).collect() };
    let first = uri.split('/').next().unwrap_or_default();
    if first.contains(':') {
        return Err(format!("\"{}\" does not refer to a file beside this one", shown()));
    }
    let decoded = String::from_utf8(percent_decode(uri))
        .map_err(|_| format!("\"{}\" is not UTF-8 once its % signs are decoded", shown()))?;
    // Some exporters on Windows write backslashes.
    let decoded = decoded.replace('\\', "/");
    if files::outside_is_allowed() && !decoded.contains('\0') {
        return Ok(folder.join(decoded));
    }
    let leaves = || {
        let remedy = "put what it refers to into it, or say --allow-outside";
        format!("\"{}\" leaves the folder of this file: {remedy}", shown())
    };
    let mut below = PathBuf::new();
    for part in decoded.split('/').filter(|part| *part != ".") {
        if part == ".." {
            if !below.pop() {
                return Err(leaves());
            }
        } else if matches!(Path::new(part).components().collect::<Vec<_>>()[..], [Component::Normal(_)])
            && !part.contains('\0')
        {
            below.push(part);
        } else if decoded.starts_with('/') || !part.is_empty() {
            return Err(leaves());
        }
    }
    if below.as_os_str().is_empty() {
        return Err(format!("\"{}\" names no file", shown()));
    }
    Ok(folder.join(below))
}

/// Decodes `%20` and the like to bytes; a stray % stays as it is.
fn percent_decode(text: &str) -> Vec<u8> {
    let mut decoded = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let hex = |digit: u8| char::from(digit).to_digit(16).map(|value| value as u8);
        let pair = after.first_chunk::<2>().filter(|_| *first == b'%');
        match pair.and_then(|[high, low]| Some(hex(*high)? * 16 + hex(*low)?)) {
            Some(byte) => {
                decoded.push(byte);
                rest = &after[2..];
            }
            None => {
                decoded.push(*first);
                rest = after;
            }
        }
    }
    decoded
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(uri: &str) -> Result<Resource, String> {
        resolve(uri, Path::new("models"))
    }

    #[test]
    fn resolve_decodes_data_uris() {
        let bytes = |text: &str| Ok(Resource::Data(text.as_bytes().to_vec()));
        assert_eq!(found("data:application/octet-stream;base64,Zm9vYmFy"), bytes("foobar"));
        assert_eq!(found("DATA:;base64,Zm9vYg=="), bytes("foob"));
        assert_eq!(found("data:;base64,Zm9vYmE"), bytes("fooba"), "without padding");
        assert_eq!(found("data:text/plain,a%20b%"), bytes("a b%"));
        assert!(found("data:;base64,Zm9*").unwrap_err().contains("character 4"));
        assert!(found("data:;base64,Z").is_err() && found("data:;base64").is_err());
    }

    #[test]
    fn resolve_accepts_files_only_in_the_folder_and_below() {
        let path = |path: &str| Ok(Resource::File(PathBuf::from(path)));
        assert_eq!(found("a%20b.bin"), path("models/a b.bin"));
        assert_eq!(found("textures\\x.png"), path("models/textures/x.png"));
        assert_eq!(found("./a/../b//c.bin"), path("models/b/c.bin"));
        assert_eq!(found("100%.png"), path("models/100%.png"));
        let outside =
            ["../a.bin", "a/../../b.bin", "/etc/passwd", "%2e%2e/a.bin", "https://example.org/a.bin", "%00"];
        for uri in outside.iter().chain(&["C:/a.bin", "file:a.bin", "", ".", "%ff.bin"]) {
            assert!(found(uri).is_err(), "{uri}");
        }
    }
}
