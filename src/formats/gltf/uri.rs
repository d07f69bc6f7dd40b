//! The targets of URIs: data within the URI, or a file in the document's folder or below.

use std::path::{Component, Path, PathBuf};

use base64::engine::general_purpose::{GeneralPurpose, NO_PAD};
use base64::{DecodeError, Engine, alphabet};
use percent_encoding::percent_decode_str;

use crate::files;

/// Base64 whose unused last bits may have any value.
const BASE64: GeneralPurpose =
    GeneralPurpose::new(&alphabet::STANDARD, NO_PAD.with_decode_allow_trailing_bits(true));

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
        let digits = data.trim_end_matches('=');
        BASE64.decode(digits).map_err(|error| {
            let at = if let DecodeError::InvalidByte(at, _) = error { at + 1 } else { digits.len() };
            format!("the data URI is not base64 at character {at} of its data")
        })
    } else {
        Ok(percent_decode_str(data).collect())
    }
}

/// Resolves a path relative to `folder`, which must stay below it unless that is allowed.
fn file(uri: &str, folder: &Path) -> Result<PathBuf, String> {
    let shown = || -> String { uri.chars().take(80).flat_map(char::escape_debug).collect() };
    let first = uri.split('/').next().unwrap_or_default();
    if first.contains(':') {
        return Err(format!("\"{}\" does not refer to a file beside this one", shown()));
    }
    let decoded = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| format!("\"{}\" is not UTF-8 once its % signs are decoded", shown()))?;
    // Some exporters on Windows write backslashes.
    let decoded = decoded.replace('\\', "/");
    if files::outside_is_allowed() && !decoded.contains('\0') {
        return Ok(folder.join(decoded));
    }
    let leaves = || {
        let remedy = "put what it refers to into it, or say `--allow-outside`";
        format!("\"{}\" leaves the folder of this file ({remedy})", shown())
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
