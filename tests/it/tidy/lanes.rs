//! Rules for code over lanes that the compiler does not check: see ARCHITECTURE.md, "Lanes".

use super::none;
use super::source::{Source, is_word, sources};

/// Trait bounds of type parameters that are lanes.
const TRAITS: [&str; 5] = ["Float", "Int", "Mask", "Lanes", "Sixteen"];
/// Operations on lanes that a closure must not contain, in addition to paths that start with names of lanes.
const OPERATIONS: [&str; 14] = [
    "Vector::", "Color::", "splat(", "gather(", "select(", ".lt(", ".le(", ".gt(", ".ge(", ".eq(", ".dot(",
    ".cross(", ".to_int(", ".to_float(",
];

/// Exceptions: file, function, rule, and reason.
const MAY_BREAK: [(&str, &str, Rule, &str); 0] = [];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    /// Everything below a kernel is `#[inline(always)]`.
    Inline,
    /// No closures around lanes.
    Closure,
}

#[derive(Debug, PartialEq)]
struct Broken {
    line: usize,
    function: String,
    rule: Rule,
}

/// Returns the position of the bracket that closes the one at `open`.
fn closing(code: &str, open: usize) -> usize {
    let mut depth = 0;
    for (at, c) in code[open..].char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return open + at;
        }
    }
    code.len()
}

/// Returns the positions of `word` as a whole word.
fn words<'c>(code: &'c str, word: &'c str) -> impl Iterator<Item = usize> + 'c {
    code.match_indices(word)
        .map(|(at, _)| at)
        .filter(move |at| !code[..*at].ends_with(is_word) && !code[at + word.len()..].starts_with(is_word))
}

/// Returns the names of type parameters in a header that are lanes: F for `<F: Float, T>`.
fn lanes(header: &str) -> Vec<&str> {
    let bound = |at: usize, name: &str| {
        let before = header[..at].trim_end().strip_suffix(':').map(str::trim_end)?;
        let rest = header[at + name.len()..].trim_start();
        let start = before.rfind(|c| !is_word(c)).map_or(0, |at| at + 1);
        // Not `F: Float::Something`, and not an argument of that name.
        let is_type = before[start..].starts_with(char::is_uppercase);
        (is_type && !rest.starts_with("::")).then(|| &before[start..])
    };
    TRAITS.iter().flat_map(|name| words(header, name).filter_map(|at| bound(at, name))).collect()
}

/// Blocks `impl … {` and `trait … {` over lanes: their range, and the names of the lanes.
fn blocks(code: &str) -> Vec<(std::ops::Range<usize>, Vec<&str>)> {
    let mut blocks = Vec::new();
    for word in ["impl", "trait"] {
        for at in words(code, word) {
            let line = code[..at].rfind('\n').map_or(0, |at| at + 1);
            let begins = ["", "pub", "unsafe", "pub unsafe"].contains(&code[line..at].trim());
            let Some(open) = code[at..].find('{').map(|open| at + open).filter(|_| begins) else { continue };
            let header = &code[at..open];
            let mut names = lanes(header);
            // Implementations of the traits are over lanes, too.
            let is_trait = |name: &&str| header.starts_with(&format!("trait {name}"));
            if TRAITS.iter().any(|name| is_trait(name) || header.contains(&format!("{name} for "))) {
                names.push("Self");
            }
            if !names.is_empty() {
                blocks.push((at..closing(code, open), names));
            }
        }
    }
    blocks
}

/// Returns the places where code breaks the rules.
fn broken(source: &Source) -> Vec<Broken> {
    let code = source.code.join("\n");
    if source.module() != "simd" && !code.contains("simd::") {
        return Vec::new();
    }
    let blocks = blocks(&code);
    let mut found = Vec::new();
    for at in words(&code, "fn") {
        let rest = &code[at + 2..];
        let name: String = rest.trim_start().chars().take_while(|c| is_word(*c)).collect();
        let end = signature(&code, at);
        if name.is_empty() {
            continue;
        }
        let mut names = lanes(&code[at..end]);
        names.extend(blocks.iter().filter(|(range, _)| range.contains(&at)).flat_map(|(_, names)| names));
        if names.is_empty() || !code[end..].starts_with('{') {
            continue;
        }
        let line = |at: usize| code[..at].matches('\n').count() + 1;
        let is_fine = |line: &str| line == "#[inline(always)]" || line.contains("target_feature");
        // This function makes other functions out of line.
        let is_outlined = source.module() == "simd" && name == "outlined";
        // Macros of `simd` inline functions that are written as one expression behind an arrow.
        let is_by_macro = source.module() == "simd" && code[at..end].contains("=>");
        if !is_outlined && !is_by_macro && !attributes(&code, at).any(is_fine) {
            found.push(Broken { line: line(at), function: name.clone(), rule: Rule::Inline });
        }
        let body = &code[..closing(&code, end)];
        for closure in closures(body, end) {
            if touches_lanes(&body[closure.clone()], &names) {
                found.push(Broken { line: line(closure.start), function: name.clone(), rule: Rule::Closure });
            }
        }
    }
    found
}

/// Returns the end of a signature that starts at `from`: a body's `{`, or a `;` outside of arrays.
fn signature(code: &str, from: usize) -> usize {
    let mut depth = 0;
    for (at, c) in code[from..].char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            '{' | ';' if depth == 0 => return from + at,
            _ => {}
        }
    }
    code.len()
}

/// Returns the lines of attributes above the function at `at`.
fn attributes(code: &str, at: usize) -> impl Iterator<Item = &str> {
    let above = code[..at].rfind('\n').map_or("", |end| &code[..end]);
    above.lines().rev().map(str::trim).take_while(|line| line.is_empty() || line.starts_with("#["))
}

/// Returns the closures of a function whose body starts at `from`, each from its first bar to its end.
fn closures(code: &str, from: usize) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let mut next = from;
    while let Some(bar) = code[next..].find('|').map(|bar| next + bar) {
        next = bar + 1;
        let before = code[..bar].trim_end();
        // Between two values it is an operator, and between patterns an alternative.
        let word = before.rfind(|c| !is_word(c)).map_or(before, |at| &before[at + 1..]);
        let begins =
            before.ends_with(['(', ',', '=', '{', ';', '[', '>']) || ["move", "return"].contains(&word);
        let Some(second) = code[next..].find('|').map(|bar| next + bar).filter(|_| begins) else { continue };
        let body = code[second + 1..].trim_start();
        let start = code.len() - body.len();
        let end = if body.starts_with('{') { closing(code, start) } else { expression(code, start) };
        found.push(bar..end);
        next = second + 1;
    }
    found
}

/// Returns the end of an expression in brackets or in a list.
fn expression(code: &str, from: usize) -> usize {
    let mut depth = 0;
    for (at, c) in code[from..].char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' if depth == 0 => return from + at,
            ')' | ']' | '}' => depth -= 1,
            ',' | ';' if depth == 0 => return from + at,
            _ => {}
        }
    }
    code.len()
}

fn touches_lanes(closure: &str, names: &[&str]) -> bool {
    // The number of lanes is an ordinary number.
    let is_lanes = |rest: &str| rest.starts_with("::") && !rest.starts_with("::WIDTH");
    let of_lanes = |name: &&str| words(closure, name).any(|at| is_lanes(&closure[at + name.len()..]));
    OPERATIONS.iter().any(|operation| closure.contains(operation)) || names.iter().any(of_lanes)
}

#[test]
fn code_over_lanes_is_inlined_and_has_no_closures() {
    let mut problems = Vec::new();
    let mut excused = [false; MAY_BREAK.len()];
    let mut functions = 0;
    for source in sources() {
        functions += source.code.iter().filter(|line| line.contains("F: Float")).count();
        for Broken { line, function, rule } in broken(&source) {
            let is_excuse = |(file, name, r, _): &(&str, &str, Rule, &str)| {
                *file == source.name && *name == function && *r == rule
            };
            match MAY_BREAK.iter().position(is_excuse) {
                Some(excuse) => excused[excuse] = true,
                None => problems.push(format!("src/{}:{line}: {function}: {rule:?}", source.name)),
            }
        }
    }
    assert!(functions > 100, "the search finds nothing");
    none(problems);
    assert!(excused.iter().all(|needed| *needed), "an excuse is no longer needed: {excused:?}");
}

#[test]
fn violations_of_both_rules_are_found() {
    let found = |text: &str| {
        let text = format!("use crate::simd::Float;\n{text}");
        broken(&Source::new("shading/a.rs".into(), &text)).into_iter().map(|b| b.rule).collect::<Vec<_>>()
    };
    for text in [
        "fn f<F: Float>(a: F) -> F {\n    a\n}",
        "#[inline]\nfn f<I: Int, const N: usize>(a: [I; N]) -> I {\n    a[0]\n}",
        "/// Words.\npub(super) fn f<T, F>(a: F) -> F\nwhere\n    F: Float,\n{\n    a\n}",
        "impl<F: Float> A<F> {\n    #[inline(always)]\n    fn f() {}\n    fn g(&self) {}\n}",
        "impl<L: Lanes> Kernel for A<L> {\n    pub fn g(&self) {}\n}",
    ] {
        assert_eq!(found(text), [Rule::Inline], "{text}");
    }
    for body in [
        "let b = |c: f32| F::splat(c); b(1.0)",
        "[a, a].map(|x| x.select(a, a))[0]",
        "v.iter().fold(a, |sum, x| {\n sum + Vector::splat(x).dot(y)\n })",
        "let b = move || F::Int::splat(1); b()",
        "f(1, |k| match k { 1 | 2 => a.lt(a), _ => a.gt(a) })",
    ] {
        let text = format!("#[inline(always)]\nfn f<F: Float>(a: F) -> F {{\n    {body}\n}}");
        assert_eq!(found(&text), [Rule::Closure], "{text}");
    }
    for text in [
        "fn f(a: Float) {}\nfn g<T: Copy>(a: T) { h(|x| F::splat(x)) }",
        "#[inline(always)]\nfn f<F: Float>(a: F, m: F::Mask) -> F {\n    (a.lt(a) | m | a.gt(a)).any()\n}",
        "#[inline(always)]\n#[must_use]\npub fn f<F: Float>(a: F) -> F {\n    v.iter().map(|x| x + F::WIDTH).sum()\n}",
        "pub trait A {\n    fn f<F: Float>(a: F) -> F;\n}\n#[inline(always)]\nfn f<F: Float>() {\n    let x = |k: u32| k + 1;\n    F::splat(x(1))\n}",
    ] {
        assert_eq!(found(text), [], "{text}");
    }
}
