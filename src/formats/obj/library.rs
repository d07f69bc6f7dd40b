//! Material libraries (MTL): found, tidied and read by tobj.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{refer, text_of};

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
    /// The number of a material; the last of that name counts.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// What tobj asks for: it needs no more than the names, to number the faces' materials.
    pub fn for_tobj(&self) -> tobj::MTLLoadResult {
        Ok((Vec::new(), self.by_name.clone()))
    }
}

/// Reads all libraries that `names` stand for. What is missing or wrong in them is a warning.
pub fn load_all(obj: &Path, names: &[String], warnings: &mut Vec<String>) -> Library {
    let mut library = Library::default();
    for name in names {
        // A line may name several files; but names with spaces are more common.
        let whole = refer(obj, name);
        let files = if whole.is_file() || !name.contains(char::is_whitespace) {
            vec![whole]
        } else {
            name.split_whitespace().map(|part| refer(obj, part)).collect()
        };
        for file in files {
            load_one(&file, obj, &mut library, warnings);
        }
    }
    library
}

fn load_one(file: &Path, obj: &Path, library: &mut Library, warnings: &mut Vec<String>) {
    let bytes = match std::fs::read(file) {
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
    warnings.extend(faults.iter().map(|fault| format!("{}:{fault}", file.display())));
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

/// The lines of a library that make sense, and what is wrong with the others (with the line's
/// number first). One bad line shall not cost the whole library, as it would with tobj.
fn tidy(text: &str) -> (String, Vec<String>) {
    let mut tidied = String::with_capacity(text.len());
    let mut faults = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let mut fault = |reason: String| faults.push(format!("{}:1: {reason}", i + 1));
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
            None => fault(format!("{keyword} has no proper value: the line is ignored")),
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
