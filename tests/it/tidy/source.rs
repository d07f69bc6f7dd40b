//! Sources without tests, comments and strings.

use std::path::{Path, PathBuf};

/// A source file without its tests: lines as they are, and with comments and strings blanked.
pub struct Source {
    /// The path below `src/`, with forward slashes.
    pub name: String,
    pub lines: Vec<String>,
    pub code: Vec<String>,
}

impl Source {
    pub fn new(name: String, text: &str) -> Self {
        let text = without_tests(text);
        let code = blank(text).lines().map(str::to_owned).collect();
        Self { name, lines: text.lines().map(str::to_owned).collect(), code }
    }

    pub fn module(&self) -> &str {
        let first = self.name.split('/').next().unwrap_or_default();
        first.trim_end_matches(".rs")
    }

    /// Line numbers (from 1) and code.
    pub fn numbered(&self) -> impl Iterator<Item = (usize, &str)> {
        self.code.iter().enumerate().map(|(i, line)| (i + 1, line.as_str()))
    }
}

pub fn root() -> PathBuf {
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

pub fn sources() -> Vec<Source> {
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
            sources.push(Source::new(name, &text));
        }
    }
    sources
}

/// The text before the tests. Panics if they are not at the end of the file, where they would hide code.
fn without_tests(text: &str) -> &str {
    let Some(at) = text.find("#[cfg(test)]\nmod tests {") else { return text };
    let rest = &text[at..];
    let end = rest.find("\n}\n").map_or(rest.len(), |end| end + 3);
    assert!(rest[end..].trim().is_empty(), "code behind the tests:\n{}", &rest[end..]);
    &text[..at]
}

/// Replaces comments, strings and characters by blanks and keeps line breaks.
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

/// Returns the length in bytes of a comment, string or character at the start of `text`, or 0.
fn skipped(text: &str) -> usize {
    let until =
        |end: &str, from: usize| text[from..].find(end).map_or(text.len(), |at| from + at + end.len());
    if text.starts_with("//") {
        return until("\n", 0) - text.contains('\n') as usize;
    }
    if text.starts_with("/*") {
        return comment(text);
    }
    for hashes in 0..3 {
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

/// Returns the length in bytes of a comment at the start of `text`, which may contain others.
fn comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let rest = &text.as_bytes()[at..];
        match (rest.starts_with(b"/*"), rest.starts_with(b"*/")) {
            (true, _) => (depth, at) = (depth + 1, at + 2),
            (_, true) => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            break;
        }
    }
    at
}

/// Returns the whole words that follow `before` in a line.
pub fn words_after<'a>(line: &'a str, before: &'a str) -> impl Iterator<Item = &'a str> {
    line.match_indices(before).filter_map(move |(at, _)| {
        let starts_word = !line[..at].ends_with(is_word);
        let rest = &line[at + before.len()..];
        let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        (starts_word && end > 0).then(|| &rest[..end])
    })
}

pub fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[test]
fn comments_and_strings_are_not_code() {
    for (text, expected) in [
        ("a // unsafe\nb", "a\nb"),
        ("a /* unsafe\n panic! */ b", "a\n b"),
        ("a /* /* unsafe */ panic! */ b /**/ c", "a b c"),
        (r#"let a = "unsafe"; b"#, "let a = ; b"),
        (r#"a("unsafe \" { \\") b"#, "a( ) b"),
        ("a(\"unsafe\n // panic!\") b", "a(\n ) b"),
        (r##"a(r#"panic!("unsafe"#) b"##, "a( ) b"),
        (r#"a(r"C:\") b(br"\") c"#, "a( ) b(b ) c"),
        (r"let q = '\''; let r = '\\'; let s = '\u{1F}'; b", "let q = ; let r = ; let s = ; b"),
        ("let q = '\"'; unsafe { '{' }", "let q = ; unsafe { }"),
        ("fn f<'a>(a: &'a str) -> &'a str { 'x'; a }", "fn f<'a>(a: &'a str) -> &'a str { ; a }"),
        ("let s: &'static str = \"é // unsafe\"; b", "let s: &'static str = ; b"),
    ] {
        let blanked = blank(text);
        assert_eq!(blanked.chars().count(), text.chars().count(), "places are kept: {text}");
        let lines = |text: &str| -> Vec<String> {
            let words = |line: &str| line.split_whitespace().collect::<String>();
            text.lines().map(words).collect()
        };
        assert_eq!(lines(&blanked), lines(expected), "{text}");
    }
}

#[test]
fn tests_are_not_code() {
    let source = Source::new("a/b.rs".into(), "fn a() {}\n#[cfg(test)]\nmod tests {\n    fn b() {}\n}\n");
    assert_eq!((source.code.join(""), source.module()), ("fn a() {}".into(), "a"));
}
