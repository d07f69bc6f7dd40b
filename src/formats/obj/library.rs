//! Material libraries (MTL): found, normalised and read by tobj.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{first_of, text_of};
use crate::error::{Diagnostic, LoadError};
use crate::formats::mended;
use crate::formats::references::resolve;
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
    /// The keywords that each material's lines begin with, and their line numbers.
    pub lines: Vec<HashMap<String, usize>>,
    by_name: HashMap<String, usize>,
}

impl Library {
    /// The number of a material; if several have that name, of the last one. A comment may follow the name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).or_else(|| self.by_name.get(before_comment(name))).copied()
    }

    /// The number of the material, if there is only one.
    pub fn only(&self) -> Option<usize> {
        (self.materials.len() == 1).then_some(0)
    }
}

/// A name without a comment after it.
fn before_comment(name: &str) -> &str {
    name.split_once(" #").or_else(|| name.split_once("\t#")).map_or(name, |(name, _)| name.trim_end())
}

/// Reads all libraries that `names` refer to, each with its line. Missing or invalid ones are warnings.
pub fn load_all(
    obj: &Path,
    names: &[(String, usize)],
    sources: &SourceFiles,
    warnings: &mut Vec<Diagnostic>,
) -> Library {
    let mut library = Library::default();
    let mut files: Vec<(PathBuf, usize)> = Vec::new();
    for (name, line) in names.iter().take(LIBRARIES) {
        files.extend(files_of(obj, name).into_iter().take(LIBRARIES).map(|file| (file, *line)));
    }
    let mut seen = HashSet::new();
    files.retain(|(file, _)| seen.insert(file.clone()));
    if names.len() > LIBRARIES || files.len() > LIBRARIES {
        let what = format!("only the first {LIBRARIES} material libraries are read");
        warnings.push(Diagnostic::in_file("import", obj, &what));
        files.truncate(LIBRARIES);
    }
    for (file, line) in &files {
        let bytes = match sources.read(file) {
            Ok(bytes) => bytes,
            Err(error) => {
                let hint = match LoadError::io(file)(error) {
                    LoadError::Io { source, hint, .. } => format!("{source}{hint}"),
                    other => other.to_string(),
                };
                let what = format!("cannot read the material library {}: {hint}", file.display());
                warnings.push(Diagnostic::at_line("import", obj, *line, what));
                continue;
            }
        };
        load_one(file, &bytes, &mut library, warnings);
    }
    library
}

/// The files of a `mtllib` line. It may name several, but names with blanks are more common.
fn files_of(obj: &Path, names: &str) -> Vec<PathBuf> {
    let whole = |names: &str| Some(resolve(obj, names)).filter(|file| file.is_file());
    let plain = before_comment(names);
    if let Some(file) = whole(names).or_else(|| whole(plain)) {
        return vec![file];
    }
    if !plain.contains(char::is_whitespace) {
        return vec![resolve(obj, plain)];
    }
    // Several names with blanks: each ends with the extension.
    let lower = plain.to_ascii_lowercase();
    let ends = lower.match_indices(".mtl").map(|(at, end)| at + end.len());
    let ends = ends.filter(|end| lower[*end..].is_empty() || lower[*end..].starts_with(char::is_whitespace));
    let mut start = 0;
    let parts: Vec<PathBuf> =
        ends.map(|end| resolve(obj, &plain[std::mem::replace(&mut start, end)..end])).collect();
    if !parts.is_empty() && parts.len() <= LIBRARIES && parts.iter().all(|file| file.is_file()) {
        return parts;
    }
    plain.split_whitespace().map(|part| resolve(obj, part)).collect()
}

fn load_one(file: &Path, bytes: &[u8], library: &mut Library, warnings: &mut Vec<Diagnostic>) {
    let TidiedLibrary { text, faults, limited, lines } = TidiedLibrary::new(&text_of(bytes));
    let lists = [(faults, "lines without a proper value are ignored"), (limited, "values out of range")];
    for (list, what) in lists {
        if let Some((line, _)) = list.first() {
            let parts: Vec<String> = list.iter().map(|(_, what)| what.clone()).collect();
            let what = format!("{what}: {}", first_of(&parts));
            warnings.push(Diagnostic::at_line("import", file, *line, what));
        }
    }
    match tobj::load_mtl_buf(&mut text.as_bytes()) {
        Ok((materials, _)) => {
            let of_material = lines.into_iter().map(Some).chain(std::iter::repeat(None));
            for (material, lines) in materials.into_iter().zip(of_material) {
                let number = library.materials.len();
                library.by_name.entry(before_comment(&material.name).to_owned()).or_insert(number);
                library.by_name.insert(material.name.clone(), number);
                library.materials.push(material);
                library.files.push(file.to_owned());
                library.lines.push(lines.unwrap_or_default());
            }
        }
        Err(error) => warnings.push(Diagnostic::in_file("import", file, &error.to_string())),
    }
}

/// The kinds of values that lines have.
#[derive(Clone, Copy, PartialEq)]
enum ValueKind {
    /// Red, green and blue, or a grey, at most this.
    Color(f32),
    /// A number in a range.
    Number(f32, f32),
    /// One of the models 0 to 10.
    Model,
    /// A name, or a file with options.
    Text,
}

use ValueKind::{Color, Model, Number, Text};

/// The keywords that a line may begin with.
const KEYWORDS: [(&str, ValueKind); 37] = [
    ("newmtl", Text),
    ("Ka", Color(f32::MAX)),
    ("Kd", Color(1.0)),
    ("Ks", Color(f32::MAX)),
    ("Ke", Color(f32::MAX)),
    ("Tf", Color(1.0)),
    ("Ns", Number(0.0, f32::MAX)),
    ("Ni", Number(0.0, f32::MAX)),
    ("d", Number(0.0, 1.0)),
    ("Tr", Number(0.0, 1.0)),
    ("illum", Model),
    ("Pr", Number(0.0, 1.0)),
    ("Pm", Number(0.0, 1.0)),
    ("Pc", Number(0.0, 1.0)),
    ("Pcr", Number(0.0, 1.0)),
    ("Ps", Number(0.0, 1.0)),
    ("aniso", Number(0.0, 1.0)),
    ("anisor", Number(f32::MIN, f32::MAX)),
    ("sharpness", Number(f32::MIN, f32::MAX)),
    ("map_Ka", Text),
    ("map_Kd", Text),
    ("map_Ks", Text),
    ("map_Ke", Text),
    ("map_Ns", Text),
    ("map_d", Text),
    ("map_Tr", Text),
    ("map_Pr", Text),
    ("map_Pm", Text),
    ("map_Ps", Text),
    ("map_Pc", Text),
    ("map_Bump", Text),
    ("bump", Text),
    ("norm", Text),
    ("map_Kn", Text),
    ("disp", Text),
    ("decal", Text),
    ("refl", Text),
];

/// True for a keyword that this reader knows, even if it changes nothing.
pub fn is_known(word: &str) -> bool {
    KEYWORDS.iter().any(|(keyword, _)| *keyword == word)
}

/// The valid lines of a library. In tobj, one invalid line makes the whole library unreadable.
#[derive(Default)]
struct TidiedLibrary {
    text: String,
    /// Lines without a valid value: their numbers, with their keywords if these are known.
    faults: Vec<(usize, String)>,
    /// Lines whose value was brought into its range.
    limited: Vec<(usize, String)>,
    /// The lines of each material by their keywords.
    lines: Vec<HashMap<String, usize>>,
}

impl TidiedLibrary {
    fn new(text: &str) -> TidiedLibrary {
        let mut tidied = TidiedLibrary { text: String::with_capacity(text.len()), ..Default::default() };
        for (i, line) in text.lines().enumerate() {
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            if !word.is_empty() && !word.starts_with('#') {
                tidied.read_line(i + 1, word, rest.trim());
            }
        }
        tidied
    }

    fn read_line(&mut self, line: usize, word: &str, rest: &str) {
        let known = KEYWORDS.iter().find(|(keyword, _)| keyword.eq_ignore_ascii_case(word));
        let (keyword, kind) = known.copied().unwrap_or((word, Text));
        let mut limit = |what: String| self.limited.push((line, format!("{what} (line {line})")));
        let value = match kind {
            Color(most) => color(keyword, rest, most, &mut limit),
            Number(least, most) => number(keyword, rest, [least, most], &mut limit),
            Model => model(rest, &mut limit),
            Text => (!rest.is_empty()).then(|| rest.to_owned()),
        };
        let Some(value) = value else {
            // Messages must not reveal the content of a file that may not be a library at all.
            let what = if known.is_some() { format!("{line} ({keyword})") } else { line.to_string() };
            return self.faults.push((line, what));
        };
        if keyword == "newmtl" {
            self.lines.push(HashMap::new());
        } else if let Some(lines) = self.lines.last_mut() {
            lines.entry(keyword.to_owned()).or_insert(line);
        }
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{keyword} {value}");
    }
}

/// Parses one or three finite numbers from 0 to `most`; one number is a grey. Colours that can only go from 0 to 1 but
/// are far above it go to 255.
fn color(keyword: &str, text: &str, most: f32, limit: &mut impl FnMut(String)) -> Option<String> {
    let numbers: Vec<f32> = numbers(text).collect::<Option<_>>()?;
    let rgb = match numbers[..] {
        [r, g, b, ..] => [r, g, b],
        [grey] => [grey; 3],
        _ => return None,
    };
    let largest = rgb.into_iter().fold(0.0, f32::max);
    let one = if most == 1.0 && largest > 2.0 && largest <= 255.0 { 255.0 } else { 1.0 };
    let limited = rgb.map(|c| (c / one).clamp(0.0, most));
    let [r, g, b] = limited;
    if one != 1.0 {
        limit(format!("{keyword} goes up to {largest}, not 1: divided by 255"));
    } else if limited != rgb {
        limit(format!("{keyword} {} {} {} becomes {r} {g} {b}", rgb[0], rgb[1], rgb[2]));
    }
    Some(format!("{r} {g} {b}"))
}

/// Parses a finite number in a range, after options such as `-halo`.
fn number(
    keyword: &str,
    text: &str,
    [least, most]: [f32; 2],
    limit: &mut impl FnMut(String),
) -> Option<String> {
    let text = text.trim_start_matches("-halo");
    let value = numbers(text).next()??;
    let limited = value.clamp(least, most);
    if limited != value {
        limit(format!("{keyword} {value} becomes {limited}"));
    }
    Some(limited.to_string())
}

/// Parses the number of an illumination model.
fn model(text: &str, limit: &mut impl FnMut(String)) -> Option<String> {
    let model = numbers(text).next()??;
    let known = (0.0..=10.0).contains(&model) && model.fract() == 0.0;
    if !known {
        limit(format!("illum {model} becomes 2"));
    }
    Some(if known { model } else { 2.0 }.to_string())
}

/// The numbers of a line up to a comment; none for a word that is not a finite number.
fn numbers(text: &str) -> impl Iterator<Item = Option<f32>> {
    let words = text.split_whitespace().take_while(|word| !word.starts_with('#'));
    words.map(|word| mended::number(word).filter(|number| number.is_finite()))
}
