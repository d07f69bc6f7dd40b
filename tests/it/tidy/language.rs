//! The names and comments keep to the glossary of ARCHITECTURE.md and to plain English.

use std::collections::BTreeMap;

use super::none;
use super::source::{Source, is_word, sources};

/// Names that once meant something else than in the field, or several things, and what stands for them now.
const OLD_NAMES: [(&str, &str); 40] = [
    ("Asker", "AnyHitFilter"),
    ("Basis", "ShadingFrame"),
    ("CREDULOUS", "ACCEPT_ALL"),
    ("Contest", "Pairing"),
    ("Fate", "PathEvent"),
    ("Glows", "EmissionAverages"),
    ("Grouping", "ReuseGroups"),
    ("Has", "LobeFlags"),
    ("Kept", "AssetCache"),
    ("Lamp", "WorldLight, PlacedLight"),
    ("Lent", "ReusableVertex"),
    ("Level", "Isa"),
    ("LitWithin", "MediumLightSample"),
    ("Made", "Memo"),
    ("Narrow", "BinaryBvh"),
    ("Nobody", "NoObserver"),
    ("OfPaths", "PathAnyHit"),
    ("Onlookers", "LiveViews"),
    ("Opening", "CollapseChoice"),
    ("Panel", "LightMesh"),
    ("Presence", "Sidedness"),
    ("Race", "KernelTimer"),
    ("Rig", "OrbitCamera"),
    ("Sheets", "TwoSidedVariants"),
    ("Shown", "Snapshot"),
    ("Somebody", "FnObserver"),
    ("Tally", "Counter"),
    ("Todo", "SampleCursor"),
    ("Waiting", "TraversalStack"),
    ("Wish", "ViewRequest"),
    ("are_apart", "check_output_conflicts"),
    ("asker", "filter"),
    ("emission_share", "emission_mis_weight"),
    ("go_on_with", "resume_from"),
    ("is_there", "accepts"),
    ("lends", "gives"),
    ("look_apart", "trace_by_parity"),
    ("no_numbers", "non_finite"),
    ("shines", "emits"),
    ("there_already", "load_existing_film"),
];

#[test]
fn identifiers_are_words_of_the_field() {
    let mut problems = Vec::new();
    for source in sources() {
        for (number, line) in source.numbered() {
            for word in line.split(|c| !is_word(c)) {
                if let Some((old, new)) = OLD_NAMES.iter().find(|(old, _)| *old == word) {
                    problems.push(format!("src/{}:{number}: {old} is {new} now", source.name));
                }
            }
        }
    }
    none(problems);
}

/// The types that a source declares; associated types have no name of their own, and those that macros declare have an
/// empty one.
fn types(source: &Source) -> impl Iterator<Item = &str> {
    source.code.iter().filter_map(|line| {
        let rest = line.trim_start();
        let is_outside = rest.len() == line.len();
        let rest = match rest.strip_prefix("pub") {
            Some(scoped) if scoped.starts_with('(') => scoped.split_once(") ")?.1,
            Some(public) => public.trim_start(),
            None => rest,
        };
        let (kind, name) = rest.split_once(' ')?;
        let is_type = ["struct", "enum", "trait", "union"].contains(&kind) || (kind == "type" && is_outside);
        is_type.then(|| name.split(|c| !is_word(c)).next().unwrap_or_default())
    })
}

#[test]
fn type_names_are_defined_once() {
    let made_up = Source::new(
        "a.rs".into(),
        "pub(super) struct A;\nimpl B for A {\n    type Output = A;\n}\ntype C = A;\n",
    );
    assert_eq!(types(&made_up).collect::<Vec<_>>(), ["A", "C"]);
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for source in sources() {
        for name in types(&source) {
            places.entry(name.to_owned()).or_default().push(source.name.clone());
        }
    }
    assert!(places.len() > 500, "the search finds nothing");
    let twice = places.iter().filter(|(name, places)| places.len() > 1 && !name.is_empty());
    none(twice.map(|(name, places)| format!("{name} is defined in {}", places.join(", "))).collect());
}

/// First words of doc lines that have no head.
const HEADLESS: [&str; 10] =
    ["What", "Whether", "Of", "As", "How", "Where", "Which", "Who", "Whom", "The same"];
/// Words by which code becomes a person, or a light a lamp.
const PERSONS: [&str; 6] = ["nobody", "somebody", "shines", "shining", "glow", "glows"];

/// The text of a doc comment or another comment, and whether it is a doc comment.
fn comment(line: &str) -> Option<(&str, bool)> {
    let line = line.trim_start();
    let doc = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
    doc.map(|text| (text.trim(), true)).or_else(|| line.strip_prefix("//").map(|text| (text.trim(), false)))
}

#[test]
fn comments_are_plain_english() {
    let mut problems = Vec::new();
    for source in sources() {
        let mut before = None;
        for (number, line) in source.lines.iter().enumerate() {
            let found = comment(line);
            if let Some((text, is_doc)) = found {
                let is_first = is_doc && !before.is_some_and(|(_, is_doc)| is_doc);
                let begins =
                    |word: &&&str| text.strip_prefix(**word).is_some_and(|rest| !rest.starts_with(is_word));
                let place = || format!("src/{}:{}", source.name, number + 1);
                if let Some(word) = HEADLESS.iter().filter(|_| is_first).find(begins) {
                    problems.push(format!("{}: {word} …: say what it is, or what it does", place()));
                }
                let words = text.split(|c| !is_word(c)).map(str::to_lowercase);
                if let Some(word) = words.into_iter().find(|word| PERSONS.contains(&word.as_str())) {
                    problems.push(format!("{}: {word}: code is no person, and lights emit", place()));
                }
            }
            before = found;
        }
    }
    none(problems);
}
