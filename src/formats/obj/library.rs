//! Material libraries (MTL): found, tidied and read by tobj.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{first_of, refer, text_of};
use crate::world::SourceFiles;

/// How many libraries a file may name: what they hold is kept, so this limits memory.
const LIBRARIES: usize = 256;

/// The materials of all libraries that an OBJ file names.
#[derive(Default)]
pub struct Library {
    /// As tobj reads them.
    pub materials: Vec<tobj::Material>,
    /// The file that each came from.
    pub files: Vec<PathBuf>,
    by_name: HashMap<String, usize>,
}

impl Library {
    /// The number of a material; if several have that name, of the last one.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// What tobj asks for: it needs no more than the names, to number the faces' materials.
    pub fn for_tobj(&self) -> tobj::MTLLoadResult {
        Ok((Vec::new(), self.by_name.clone()))
    }
}

/// Reads all libraries that `names` stand for. What is missing or wrong in them is a warning.
pub fn load_all(obj: &Path, names: &[String], sources: &SourceFiles, warnings: &mut Vec<String>) -> Library {
    let mut library = Library::default();
    let mut files: Vec<PathBuf> = Vec::new();
    for name in names.iter().take(LIBRARIES) {
        // A line may name several files; but names with spaces are more common.
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
        warnings.push(format!("{}: only the first {LIBRARIES} material libraries are read", obj.display()));
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
    warnings: &mut Vec<String>,
) {
    let bytes = match sources.read(file) {
        Ok(bytes) => bytes,
        Err(error) => {
            warnings.push(format!(
                "{}: cannot read the material library {}: {error}",
                obj.display(),
                file.display()
            ));
            return;
        }
    };
    let (text, faults) = tidy(&text_of(&bytes));
    if !faults.is_empty() {
        let ignored = first_of(&faults);
        warnings.push(format!("{}: lines without a proper value are ignored: {ignored}", file.display()));
    }
    match tobj::load_mtl_buf(&mut text.as_bytes()) {
        Ok((materials, _)) => {
            for material in materials {
                library.by_name.insert(material.name.clone(), library.materials.len());
                library.materials.push(material);
                library.files.push(file.to_owned());
            }
        }
        Err(error) => warnings.push(format!("{}: {error}", file.display())),
    }
}

/// What lines of a library begin with.
const KEYWORDS: [&str; 17] = [
    "newmtl", "Ka", "Kd", "Ks", "Ke", "Tf", "Ns", "Ni", "d", "Tr", "illum", "map_Ka", "map_Kd", "map_Ks",
    "map_d", "bump", "map_Bump",
];

/// The lines of a library that make sense, and the numbers and keywords of the others. With tobj, one bad line would
/// cost the whole library.
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
                // Writing to a string can't fail.
                let _ = writeln!(tidied, "{keyword} {value}");
            }
            None if KEYWORDS.contains(&keyword) => faults.push(format!("{} ({keyword})", i + 1)),
            // Whatever kind of file this is, messages should not show its content.
            None => faults.push((i + 1).to_string()),
        }
    }
    (tidied, faults)
}

/// One or three finite numbers, not below zero; one stands for a grey.
fn color(text: &str) -> Option<String> {
    let numbers: Vec<f32> = numbers(text).collect::<Option<_>>()?;
    match numbers[..] {
        [r, g, b, ..] => Some(format!("{} {} {}", r.max(0.0), g.max(0.0), b.max(0.0))),
        [grey, ..] => Some(format!("{0} {0} {0}", grey.max(0.0))),
        [] => None,
    }
}

/// One finite number, after options such as `-halo`.
fn single(text: &str) -> Option<String> {
    let text = text.trim_start_matches("-halo");
    Some(numbers(text).next()??.to_string())
}

/// The numbers of a line up to a comment; none where a word is not a finite number.
fn numbers(text: &str) -> impl Iterator<Item = Option<f32>> {
    let words = text.split_whitespace().take_while(|word| !word.starts_with('#'));
    words.map(|word| word.parse().ok().filter(|number: &f32| number.is_finite()))
}
