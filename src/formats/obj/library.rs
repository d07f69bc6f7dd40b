//! Material libraries (MTL): found, normalised and read by tobj.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{first_of, refer, text_of};
use crate::error::Diagnostic;
use crate::world::SourceFiles;

/// The largest number of libraries per file; limits the memory for their contents.
const LIBRARIES: usize = 256;

/// The materials of all libraries of an OBJ file.
#[derive(Default)]
pub struct Library {
    /// The materials as read by tobj.
    pub materials: Vec<tobj::Material>,
    /// The file of each material.
    pub files: Vec<PathBuf>,
    by_name: HashMap<String, usize>,
}

impl Library {
    /// The number of a material; if several have that name, of the last one.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// The result of tobj's loader callback: tobj needs only the names, to number the faces' materials.
    pub fn for_tobj(&self) -> tobj::MTLLoadResult {
        Ok((Vec::new(), self.by_name.clone()))
    }
}

/// Reads all libraries that `names` refer to. Missing or invalid ones are warnings.
pub fn load_all(
    obj: &Path,
    names: &[String],
    sources: &SourceFiles,
    warnings: &mut Vec<Diagnostic>,
) -> Library {
    let mut library = Library::default();
    let mut files: Vec<PathBuf> = Vec::new();
    for name in names.iter().take(LIBRARIES) {
        // A line may name several files, but names with spaces are more common.
        let whole = refer(obj, name);
        if whole.is_file() || !name.contains(char::is_whitespace) {
            files.push(whole);
        } else {
            files.extend(name.split_whitespace().take(LIBRARIES).map(|part| refer(obj, part)));
        }
    }
    let mut seen = HashSet::new();
    files.retain(|file| seen.insert(file.clone()));
    if names.len() > LIBRARIES || files.len() > LIBRARIES {
        let what = format!("only the first {LIBRARIES} material libraries are read");
        warnings.push(Diagnostic::in_file("import", obj, &what));
        files.truncate(LIBRARIES);
    }
    for file in &files {
        load_one(file, obj, sources, &mut library, warnings);
    }
    library
}

fn load_one(
    file: &Path,
    obj: &Path,
    sources: &SourceFiles,
    library: &mut Library,
    warnings: &mut Vec<Diagnostic>,
) {
    let bytes = match sources.read(file) {
        Ok(bytes) => bytes,
        Err(error) => {
            let what = format!("cannot read the material library {}: {error}", file.display());
            warnings.push(Diagnostic::in_file("import", obj, &what));
            return;
        }
    };
    let (text, faults) = tidy(&text_of(&bytes));
    if !faults.is_empty() {
        let ignored = first_of(&faults);
        let what = format!("lines without a proper value are ignored: {ignored}");
        warnings.push(Diagnostic::in_file("import", file, &what));
    }
    match tobj::load_mtl_buf(&mut text.as_bytes()) {
        Ok((materials, _)) => {
            for material in materials {
                library.by_name.insert(material.name.clone(), library.materials.len());
                library.materials.push(material);
                library.files.push(file.to_owned());
            }
        }
        Err(error) => warnings.push(Diagnostic::in_file("import", file, &error.to_string())),
    }
}

/// The keywords that a line may begin with.
const KEYWORDS: [&str; 17] = [
    "newmtl", "Ka", "Kd", "Ks", "Ke", "Tf", "Ns", "Ni", "d", "Tr", "illum", "map_Ka", "map_Kd", "map_Ks",
    "map_d", "bump", "map_Bump",
];

/// Returns the valid lines of a library, and the line numbers and keywords of the others. In tobj, one invalid line
/// makes the whole library unreadable.
fn tidy(text: &str) -> (String, Vec<String>) {
    let mut tidied = String::with_capacity(text.len());
    let mut faults = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let value = match keyword {
            "" => continue,
            _ if keyword.starts_with('#') => continue,
            "Ka" | "Kd" | "Ks" | "Ke" | "Tf" => color(rest),
            "Ns" | "Ni" | "d" | "Tr" => single(rest),
            "illum" => {
                rest.split_whitespace().next().and_then(|word| word.parse::<u8>().ok()).map(|n| n.to_string())
            }
            _ => (!rest.is_empty()).then(|| rest.to_owned()),
        };
        match value {
            Some(value) => {
                // Writing to a string cannot fail.
                let _ = writeln!(tidied, "{keyword} {value}");
            }
            None if KEYWORDS.contains(&keyword) => faults.push(format!("{} ({keyword})", i + 1)),
            // Messages must not reveal the content of a file that may not be a library at all.
            None => faults.push((i + 1).to_string()),
        }
    }
    (tidied, faults)
}

/// Parses one or three finite numbers and clamps them to 0 or more; one number is a grey.
fn color(text: &str) -> Option<String> {
    let numbers: Vec<f32> = numbers(text).collect::<Option<_>>()?;
    match numbers[..] {
        [r, g, b, ..] => Some(format!("{} {} {}", r.max(0.0), g.max(0.0), b.max(0.0))),
        [grey, ..] => Some(format!("{0} {0} {0}", grey.max(0.0))),
        [] => None,
    }
}

/// Parses a finite number, after options such as `-halo`.
fn single(text: &str) -> Option<String> {
    let text = text.trim_start_matches("-halo");
    Some(numbers(text).next()??.to_string())
}

/// The numbers of a line up to a comment; none for a word that is not a finite number.
fn numbers(text: &str) -> impl Iterator<Item = Option<f32>> {
    let words = text.split_whitespace().take_while(|word| !word.starts_with('#'));
    words.map(|word| word.parse().ok().filter(|number: &f32| number.is_finite()))
}
