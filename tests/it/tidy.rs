//! The code keeps to the architecture: this reads the sources.

use std::path::{Path, PathBuf};

use crate::scenes;

/// What lies on one level may not import each other, except `math` and `simd`, and what is
/// listed in [`SAME_LEVEL`].
const LAYERS: [&[&str]; 10] = [
    &["math", "simd"],
    &["world"],
    &["sampling", "film"],
    &["bvh"],
    &["scene", "query"],
    &["compile", "shading", "formats"],
    &["integrator"],
    &["render"],
    &["study"],
    &["cli"],
];
const SAME_LEVEL: [(&str, &str); 2] = [("math", "simd"), ("simd", "math")];
/// Free to be used by all, and to use none.
const FREE: [&str; 1] = ["error"];

/// Which modules may name which crates; crates that are not listed are free.
const CRATES: [(&str, &[&str]); 26] = [
    ("hecs", &["world", "formats", "compile"]),
    ("ron", &["formats"]),
    ("serde", &["formats"]),
    ("basisu", &["formats"]),
    ("bevy_mikktspace", &["formats"]),
    ("draco_core", &["formats"]),
    ("gltf", &["formats"]),
    ("tobj", &["formats"]),
    ("image", &["formats"]),
    ("png", &["formats"]),
    ("exr", &["formats"]),
    ("tempfile", &["formats"]),
    ("serde_json", &["cli", "formats"]),
    ("rayon", &["compile", "bvh", "formats", "render", "cli"]),
    ("clap", &["cli"]),
    ("indicatif", &["cli"]),
    ("ctrlc", &["cli"]),
    ("rustix", &["cli"]),
    ("perf_event", &["study"]),
    ("plotters", &["study"]),
    ("dejavu", &["study"]),
    ("rand", &["sampling", "study"]),
    ("xxhash_rust", &["film", "study"]),
    ("strsim", &["error"]),
    ("thiserror", &["error", "formats", "query"]),
    ("libm", &["math", "sampling", "film", "compile", "formats", "study", "cli"]),
];

/// Words that end the program, and why these few may.
const MAY_PANIC: [(&str, &str, &str); 2] = [
    ("integrator/wavefront/queue.rs", "unreachable!", "a slice of three has three elements"),
    ("compile/lights.rs", "unreachable!", "the caller's match has taken that variant"),
];

const LONGEST_FILE: usize = 500;
const LONGEST_FUNCTION: usize = 90;
/// Files and functions that may be longer, and why.
const MAY_BE_LONG: [(&str, &str); 0] = [];

/// A source file without its tests: lines as they are, and with comments and strings blanked.
struct Source {
    /// Below `src/`, with forward slashes.
    name: String,
    lines: Vec<String>,
    code: Vec<String>,
}

impl Source {
    fn module(&self) -> &str {
        let first = self.name.split('/').next().unwrap_or_default();
        first.trim_end_matches(".rs")
    }

    /// Numbers (from 1) and code of the lines.
    fn numbered(&self) -> impl Iterator<Item = (usize, &str)> {
        self.code.iter().enumerate().map(|(i, line)| (i + 1, line.as_str()))
    }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources").flatten() {
        let path = entry.path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

fn sources() -> Vec<Source> {
    let src = root().join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    files.sort();
    assert!(files.len() > 50, "the sources were not found");
    let mut sources = Vec::new();
    for file in files {
        let name = file.strip_prefix(&src).expect("below src").to_string_lossy().replace('\\', "/");
        let is_test = name.split('/').any(|part| part == "tests" || part == "tests.rs");
        if !is_test {
            let text = std::fs::read_to_string(&file).expect("a source");
            let text = without_tests(&text);
            let code = blank(text).lines().map(str::to_owned).collect();
            sources.push(Source { name, lines: text.lines().map(str::to_owned).collect(), code });
        }
    }
    sources
}

/// The text up to the tests, which are last in every file (else this would hide code: it panics).
fn without_tests(text: &str) -> &str {
    let Some(at) = text.find("#[cfg(test)]\nmod tests {") else { return text };
    let rest = &text[at..];
    let end = rest.find("\n}\n").map_or(rest.len(), |end| end + 3);
    assert!(rest[end..].trim().is_empty(), "code behind the tests:\n{}", &rest[end..]);
    &text[..at]
}

/// Comments, strings and characters replaced by blanks; lines stay lines.
fn blank(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let length = skipped(rest);
        if length == 0 {
            out.push(c);
            rest = &rest[c.len_utf8()..];
        } else {
            out.extend(rest[..length].chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
            rest = &rest[length..];
        }
    }
    out
}

/// The bytes of the comment, string or character that `text` begins with, or 0.
fn skipped(text: &str) -> usize {
    let until =
        |end: &str, from: usize| text[from..].find(end).map_or(text.len(), |at| from + at + end.len());
    if text.starts_with("//") {
        return until("\n", 0) - text.contains('\n') as usize;
    }
    if text.starts_with("/*") {
        return until("*/", 2);
    }
    for hashes in 1..3 {
        let mark = "#".repeat(hashes);
        if text.starts_with(&format!("r{mark}\"")) {
            return until(&format!("\"{mark}"), hashes + 2);
        }
    }
    let mut characters = text.char_indices();
    match characters.next() {
        Some((_, '"')) => {
            let mut escaped = false;
            for (at, c) in characters {
                match c {
                    '"' if !escaped => return at + 1,
                    _ => escaped = c == '\\' && !escaped,
                }
            }
            text.len()
        }
        // A character, not a lifetime.
        Some((_, '\'')) if text[1..].starts_with('\\') => until("'", 3),
        Some((_, '\'')) => match (characters.next(), characters.next()) {
            (Some(_), Some((at, '\''))) => at + 1,
            _ => 0,
        },
        _ => 0,
    }
}

/// The words that follow `before` in a line, as whole words.
fn words_after<'a>(line: &'a str, before: &'a str) -> impl Iterator<Item = &'a str> {
    line.match_indices(before).filter_map(move |(at, _)| {
        let starts_word = !line[..at].ends_with(is_word);
        let rest = &line[at + before.len()..];
        let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        (starts_word && end > 0).then(|| &rest[..end])
    })
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[track_caller]
fn none(problems: Vec<String>) {
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

#[test]
fn modules_import_downwards_only() {
    let layer = |module: &str| LAYERS.iter().position(|layer| layer.contains(&module));
    let mut problems = Vec::new();
    let mut imports = 0;
    for source in sources() {
        let from = source.module();
        for (number, line) in source.numbered() {
            // A list of modules would escape the search.
            if line.contains("crate::{") {
                problems.push(format!("src/{}:{number}: import one module a line", source.name));
            }
            for to in words_after(line, "crate::") {
                imports += 1;
                let fine = match (layer(from), layer(to)) {
                    _ if from == to || FREE.contains(&to) || ["main", "lib"].contains(&from) => true,
                    (Some(low), Some(high)) => high < low || SAME_LEVEL.contains(&(from, to)),
                    _ => false,
                };
                if !fine {
                    problems.push(format!("src/{}:{number}: {from} may not import {to}", source.name));
                }
            }
        }
    }
    assert!(imports > 100, "the search finds nothing");
    none(problems);
}

#[test]
fn crates_stay_where_they_belong() {
    let mut problems = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for source in sources() {
        for (number, line) in source.numbered() {
            for (name, modules) in CRATES {
                // `name::` at the start of a path, or `use name;`. A module of ours may have that name.
                let start_of_path = line.match_indices(&format!("{name}::")).any(|(at, _)| {
                    let before = &line[..at];
                    !before.ends_with(is_word) && !before.ends_with(':')
                });
                if start_of_path || line.contains(&format!("use {name};")) {
                    seen.insert(name);
                    let own_module =
                        ["ron", "tobj", "image", "png"].contains(&name) && source.module() == "formats";
                    if !modules.contains(&source.module()) && !own_module {
                        problems.push(format!("src/{}:{number}: {name} belongs in {modules:?}", source.name));
                    }
                }
            }
        }
    }
    for name in ["hecs", "rayon", "ron", "clap", "exr"] {
        assert!(seen.contains(name), "the search does not find {name}");
    }
    none(problems);
}

#[test]
fn unsafe_code_is_in_simd_alone() {
    let mut problems = Vec::new();
    let mut found = 0;
    for source in sources() {
        for (number, line) in source.numbered() {
            let is_unsafe = line.split(|c| !is_word(c)).any(|word| word == "unsafe");
            if is_unsafe || line.contains("std::arch") || line.contains("core::arch") {
                found += 1;
                if source.module() != "simd" {
                    problems.push(format!("src/{}:{number}: {}", source.name, line.trim()));
                }
            }
        }
    }
    assert!(found > 10);
    none(problems);
}

#[test]
fn nothing_panics_by_design() {
    let words = [".unwrap()", ".expect(", "panic!", "todo!", "unimplemented!", "unreachable!", "dbg!"];
    let mut problems = Vec::new();
    let mut excused = std::collections::HashSet::new();
    for source in sources() {
        for (number, line) in source.numbered() {
            for word in words.iter().filter(|word| line.contains(**word)) {
                match MAY_PANIC.iter().position(|(file, w, _)| *file == source.name && w == word) {
                    Some(excuse) => drop(excused.insert(excuse)),
                    None => problems.push(format!("src/{}:{number}: {word}", source.name)),
                }
            }
        }
    }
    assert_eq!(excused.len(), MAY_PANIC.len(), "an excuse is no longer needed");
    none(problems);
}

#[test]
fn files_and_functions_are_short() {
    let mut problems = Vec::new();
    for source in sources() {
        let excused = |what: &str| MAY_BE_LONG.iter().any(|(name, _)| *name == what);
        if source.lines.len() > LONGEST_FILE && !excused(&source.name) {
            problems.push(format!("src/{}: {} lines", source.name, source.lines.len()));
        }
        let mut open: Option<(String, usize, usize)> = None;
        for (number, line) in source.numbered() {
            let indent = line.len() - line.trim_start().len();
            let name = words_after(line, "fn ").next();
            match (&open, name) {
                (None, Some(name)) if !line.trim_end().ends_with(['}', ';']) => {
                    open = Some((name.to_owned(), indent, number));
                }
                (Some((name, level, start)), _)
                    if indent == *level && line.trim_start().starts_with(['}', ')']) =>
                {
                    let length = number - start + 1;
                    if length > LONGEST_FUNCTION && !excused(&format!("{}: {name}", source.name)) {
                        problems.push(format!("src/{}:{start}: {name} has {length} lines", source.name));
                    }
                    // A signature of several lines ends with a parenthesis, and its body follows.
                    let is_signature = line.trim_end().ends_with('{');
                    open = if is_signature { open } else { None };
                }
                _ => {}
            }
        }
    }
    none(problems);
}

#[test]
fn scenes_say_what_they_show() {
    let mut problems = Vec::new();
    for file in scenes::files() {
        let text = std::fs::read_to_string(&file).expect("a scene");
        let beginning = text.trim_start_matches(['(', '\u{feff}', ' ', '\n']);
        if !beginning.starts_with("//") && !beginning.starts_with("/*") {
            problems.push(format!("{} does not begin with a comment", file.display()));
        }
    }
    none(problems);
}

/// Files that git tracks; none where there is no git.
fn tracked() -> Vec<PathBuf> {
    let output = std::process::Command::new("git").args(["ls-files", "-z"]).current_dir(root()).output();
    let names = output.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()).unwrap_or_default();
    names.split('\0').filter(|name| !name.is_empty()).map(|name| root().join(name)).collect()
}

#[test]
fn no_large_file_is_tracked() {
    const LARGEST: u64 = 5 << 20;
    let mut problems = Vec::new();
    for file in tracked() {
        let size = std::fs::metadata(&file).map_or(0, |m| m.len());
        if size > LARGEST {
            problems.push(format!("{}: {size} bytes", file.display()));
        }
    }
    none(problems);
}

#[test]
fn the_crates_of_the_specification_are_used() {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).expect("a manifest");
    let dependencies = manifest.split("[dependencies]").nth(1).and_then(|rest| rest.split("\n[").next());
    let dependencies = dependencies.expect("dependencies");
    for name in ["hecs", "glam", "rayon", "image", "gltf", "tobj", "ron", "rand", "smallvec"] {
        let declared = dependencies.lines().any(|line| line.starts_with(&format!("{name} =")));
        assert!(declared, "{name} is not declared");
    }
}

#[test]
fn comments_and_strings_are_not_code() {
    let text = "let a = \"unsafe \\\" {\"; // unsafe\nlet b = 'x'; let c: &'a str = r#\"panic!(\"\"#; /* a\nb */ done";
    let code = blank(text);
    assert_eq!(code.lines().count(), 3);
    assert!(
        !code.contains("unsafe") && !code.contains("panic") && !code.contains('b') || code.contains("let b")
    );
    assert!(code.contains("let a =") && code.contains("&'a str") && code.contains("done"));
}
