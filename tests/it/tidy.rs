//! The code keeps to the architecture: this reads the sources.

mod lanes;
mod language;
mod source;

use std::collections::BTreeSet;
use std::path::PathBuf;

use self::source::{Source, is_word, root, sources, words_after};
use crate::scenes;

/// What lies on one level may not import each other, except `math` and `simd`, and what is
/// listed in [`SAME_LEVEL`].
const LAYERS: [&[&str]; 14] = [
    &["math", "simd"],
    &["bvh"],
    &["world", "query"],
    &["sampling", "film"],
    &["denoise"],
    &["scene"],
    &["shading"],
    &["compile", "formats"],
    &["integrator"],
    &["render"],
    &["study"],
    &["check"],
    &["view"],
    &["cli", "python"],
];
const SAME_LEVEL: [(&str, &str); 2] = [("math", "simd"), ("simd", "math")];
/// Free to be used by all, and to use none.
const FREE: [&str; 3] = ["error", "files", "memory"];

/// The rooms of large modules: each imports only from those before it.
const ROOMS: [(&str, &[&str]); 3] = [
    ("bvh", &["layout", "intersect", "build", "kernels", "baseline"]),
    ("formats", &["load_options", "film_file", "picture", "ply", "obj", "stl", "gltf", "ron", "staging"]),
    ("integrator", &["setup", "path", "observe", "photons", "transport", "reuse", "schedule"]),
];
/// Files of a room that may import from a later one, and why.
const UPWARDS: [(&str, &str, &str); 1] =
    [("integrator/setup/mod.rs", "path", "the limits on bounces are packed like a path's counters")];

/// Which modules may name which crates; crates that are not listed are free.
const CRATES: [(&str, &[&str]); 42] = [
    ("hecs", &["world", "formats", "compile", "check", "view"]),
    ("ron", &["formats"]),
    ("serde_path_to_error", &["formats"]),
    ("ttf_parser", &["world"]),
    ("unicode_normalization", &["world"]),
    ("serde", &["math", "bvh", "world", "film", "formats", "view"]),
    ("basisu", &["formats"]),
    ("bevy_mikktspace", &["formats"]),
    ("draco_core", &["formats"]),
    ("gltf", &["formats"]),
    ("tobj", &["formats"]),
    ("image", &["formats"]),
    ("png", &["formats"]),
    ("exr", &["formats"]),
    ("tempfile", &["files"]),
    ("serde_json", &["cli", "formats", "study", "view"]),
    ("rayon", &["compile", "denoise", "bvh", "formats", "render", "view", "cli", "python"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("console", &["cli"]),
    ("indicatif", &["cli"]),
    ("ctrlc", &["cli"]),
    ("signal_hook", &["cli"]),
    ("rustix", &["cli", "simd"]),
    ("perf_event", &["study"]),
    ("plotters", &["study"]),
    ("dejavu", &["study"]),
    ("rand", &["math", "study"]),
    ("xxhash_rust", &["world", "film", "scene", "denoise", "formats", "study"]),
    ("bytemuck", &["world", "formats"]),
    ("strsim", &["error"]),
    ("thiserror", &["error", "world", "formats", "memory", "query", "view"]),
    ("libm", &["math", "world", "sampling", "film", "compile", "formats", "study", "check", "view", "cli"]),
    ("axum", &["view"]),
    ("hyper", &["view"]),
    ("hyper_util", &["view"]),
    ("tokio", &["view"]),
    ("tokio_stream", &["view"]),
    ("getrandom", &["view"]),
    ("pyo3", &["python"]),
    ("numpy", &["python"]),
];

/// Words that end the program, and why these few may.
const MAY_PANIC: [(&str, &str, &str); 2] = [
    ("integrator/schedule/wavefront/queue.rs", "unreachable!", "a slice of three has three elements"),
    ("compile/lights.rs", "unreachable!", "the caller's match has taken that variant"),
];

const LONGEST_FILE: usize = 500;
const LONGEST_FUNCTION: usize = 90;
/// Files and functions that may be longer, and why.
const MAY_BE_LONG: [(&str, &str); 0] = [];

#[track_caller]
pub(super) fn none(problems: Vec<String>) {
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
                    _ if from == to || FREE.contains(&to) || ["main", "lib", "internals"].contains(&from) => {
                        true
                    }
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
fn rooms_import_downwards_only() {
    let mut problems = Vec::new();
    let mut excused = std::collections::HashSet::new();
    for source in sources() {
        let mut path = source.name.split('/');
        let (Some(module), Some(own)) = (path.next(), path.next()) else { continue };
        let Some((_, rooms)) = ROOMS.iter().find(|(name, _)| *name == module) else { continue };
        for (number, line) in source.numbered() {
            if line.contains("super::super::") {
                problems
                    .push(format!("src/{}:{number}: write crate:: for what lies further up", source.name));
            }
        }
        let rank = |word: &str| rooms.iter().position(|room| *room == word.trim_end_matches(".rs"));
        let Some(level) = rank(own) else { continue };
        for (number, line) in source.numbered() {
            let start = format!("crate::{module}::");
            for (at, _) in line.match_indices(&start) {
                let rest = &line[at + start.len()..];
                let listed = rest.starts_with('{').then(|| rest.split(|c| !is_word(c)));
                let words = listed.into_iter().flatten().chain(rest.split("::").next());
                for to in words.filter(|word| rank(word).is_some_and(|other| other > level)) {
                    match UPWARDS.iter().position(|(file, room, _)| *file == source.name && *room == to) {
                        Some(excuse) => drop(excused.insert(excuse)),
                        None => {
                            problems.push(format!("src/{}:{number}: {own} may not import {to}", source.name))
                        }
                    }
                }
            }
        }
    }
    assert_eq!(excused.len(), UPWARDS.len(), "an excuse is no longer needed");
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
                    let own_module = match source.module() {
                        "formats" => ["ron", "tobj", "image", "png"].contains(&name),
                        "python" => ["gltf", "ron"].contains(&name),
                        _ => false,
                    };
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

/// Checks that lines of a kind occur in one module only, and more often than `least`.
fn only_in(module: &str, least: usize, is_of_kind: impl Fn(&str) -> bool) {
    let mut problems = Vec::new();
    let mut found = 0;
    for source in sources() {
        for (number, line) in source.numbered().filter(|(_, line)| is_of_kind(line)) {
            found += 1;
            if source.module() != module {
                problems.push(format!("src/{}:{number}: {}", source.name, line.trim()));
            }
        }
    }
    assert!(found > least);
    none(problems);
}

#[test]
fn unsafe_code_is_in_simd_alone() {
    only_in("simd", 10, |line| {
        let is_unsafe = line.split(|c| !is_word(c)).any(|word| word == "unsafe");
        is_unsafe || line.contains("std::arch") || line.contains("core::arch")
    });
}

/// Whoever opens or writes files in another way skips the checks that are made there.
#[test]
fn files_are_opened_and_written_in_one_place() {
    let words = ["File::open", "File::create", "fs::read(", "fs::write("];
    only_in("files", 0, |line| words.iter().any(|word| line.contains(word)));
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

/// Whether code of a file calls into a crate. A module of ours may have the crate's name; and implementing one of its
/// traits does not count as a call.
fn uses(source: &Source, name: &str) -> bool {
    let is_ours = source.code.iter().map(|line| line.trim()).any(|line| {
        let declared = words_after(line, "mod ").next() == Some(name);
        let imported = ["use crate::", "use super::", "use self::"].iter().any(|start| {
            let rest = line.split_once(start).map_or("", |(_, rest)| rest);
            let ends = |part: &str| part.trim().rsplit("::").next() == Some(name);
            rest.split(['{', '}', ',', ';']).any(ends)
        });
        declared || imported
    });
    let in_path = |line: &str| {
        line.match_indices(&format!("{name}::"))
            .any(|(at, _)| !line[..at].ends_with(|c| is_word(c) || c == ':'))
    };
    !is_ours && source.code.iter().any(|line| !line.trim_start().starts_with("impl") && in_path(line))
}

#[test]
fn the_crates_of_the_specification_are_used() {
    let sources = sources();
    let used = |name: &str| sources.iter().any(|source| uses(source, name));
    for name in ["hecs", "glam", "rayon", "image", "gltf", "tobj", "ron", "rand", "smallvec"] {
        assert!(used(name), "nothing but tests uses {name}");
    }
    for name in ["proptest", "criterion", "png_encoder"] {
        assert!(!used(name), "{name} is for tests: the search finds what is not there");
    }
    let made_up = |text: &str| uses(&Source::new("formats/a.rs".into(), text), "ron");
    assert!(made_up("use ron::Options;") && made_up("fn f() { let a = ron::to_string(&1); }"));
    for text in [
        "mod ron;\nfn f() { ron::load() }",
        "use super::ron;\nfn f() { ron::load() }",
        "use crate::formats::{obj, ron};\nfn f() { ron::load() }",
        "// ron::load()\nconst A: &str = \"ron::load()\";",
        "impl ron::Trait for A {}",
        "fn f() { super::ron::load(); macron::load() }",
        "#[cfg(test)]\nmod tests {\n    use ron::Options;\n}\n",
    ] {
        assert!(!made_up(text), "{text}");
    }
}

/// The forms of scene files are attributes of the Python module, and nothing else that begins with a capital letter.
#[test]
fn the_python_module_knows_the_forms_of_scene_files() {
    let folder = root().join("src/formats/ron/lower");
    let files = std::fs::read_dir(folder).expect("readers").map(|file| file.expect("a file").path());
    let texts = files
        .chain([root().join("src/formats/ron/keyframes.rs")])
        .map(|path| std::fs::read_to_string(path).expect("text"));
    let is_form = |word: &&str| {
        word.starts_with(|c: char| c.is_ascii_uppercase()) && word.chars().all(|c| c.is_ascii_alphanumeric())
    };
    let mut forms = BTreeSet::new();
    for text in texts {
        // Every second part is within quotes.
        forms.extend(text.split('"').skip(1).step_by(2).filter(is_form).map(str::to_owned));
    }
    for file in [
        "camera.rs", "components.rs", "material.rs", "modifiers.rs", "procedure.rs", "settings.rs",
        "shape.rs",
    ] {
        let text = std::fs::read_to_string(root().join("src/world").join(file)).expect("text");
        for table in text.split("\nforms! {\n").skip(1).filter_map(|rest| rest.split("\n}\n").next()) {
            let variants = table.lines().filter_map(|line| line.strip_prefix("        "));
            let names = variants.filter_map(|line| line.strip_suffix(" {").or(line.strip_suffix(',')));
            forms.extend(names.filter(is_form).map(str::to_owned));
        }
        for list in text.split("names!(").skip(1).filter_map(|rest| rest.split(");").next()) {
            let (_, names) = list.split_once('[').expect("a list");
            forms.extend(
                names
                    .split([',', ' ', '\n', ']'])
                    .filter(|name| !name.is_empty())
                    .filter(is_form)
                    .map(str::to_owned),
            );
        }
    }
    // Colours and the units of light.
    for (file, list) in [("formats/ron/color.rs", "const FORMS:"), ("world/quantity.rs", "const UNITS:")] {
        let text = std::fs::read_to_string(root().join("src").join(file)).expect("text");
        let list = text.lines().find(|line| line.contains(list)).expect("a list");
        forms.extend(list.split('"').skip(1).step_by(2).map(str::to_owned));
    }
    // Mesh is a class there.
    forms.retain(|form| !["None", "Some", "Mesh"].contains(&form.as_str()));
    let read =
        |name: &str| std::fs::read_to_string(root().join("src/python/rayfront").join(name)).expect("text");
    let module = read("__init__.py");
    let (_, list) = module.split_once("_FORMS = \"\"\"").expect("the list");
    let (list, _) = list.split_once("\"\"\"").expect("its end");
    assert_eq!(list.split_whitespace().map(str::to_owned).collect::<BTreeSet<_>>(), forms);
    let types = read("__init__.pyi");
    let typed = types.lines().filter_map(|line| {
        let (name, kind) = line.split_once(": ")?;
        (kind == "Variant" || kind.strip_prefix('_') == Some(name)).then_some(name)
    });
    assert_eq!(typed.map(str::to_owned).collect::<BTreeSet<_>>(), forms);
    assert!(!types.contains("def __getattr__"), "every name would be one");
}
