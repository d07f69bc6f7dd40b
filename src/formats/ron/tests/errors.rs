//! Tests that every error is reported with its place, its reason and a remedy.

use super::{Fake, read};
use crate::error::LoadError;
use crate::formats::ron::load;

#[test]
fn mistakes_are_reported_where_they_are() {
    let mut wrong = Vec::new();
    for (number, row) in include_str!("mistakes.txt").lines().enumerate() {
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let (kind, row) = row.split_once(": ").unwrap();
        let (mistake, reason) = row.split_once(" => ").unwrap();
        // Non-ASCII text in front tests lines and columns.
        let marked = match kind {
            "entity" => format!("// ä\n(entities: [\n    /* ö */ ({mistake}),\n])"),
            "material" => format!("(entities: [(material: Principled({mistake}))])"),
            "settings" => format!("(settings: ({mistake}), entities: [])"),
            _ => mistake.replace("\\n", "\n"),
        };
        let (before, after) = marked.split_once('^').unwrap();
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let expected = format!("scenes/test.ron:{line}:{column}: {reason}");
        let found = read(&format!("{before}{after}")).err().map(|error| error.to_string());
        if found.as_ref() != Some(&expected) {
            wrong.push(format!("mistakes.txt:{}: {found:?} instead of {expected}", number + 1));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn message_has_file_line_column_and_suggestion() {
    let text =
        "(entities: [\n  (name: \"ball\", material: \"galss\"),\n], materials: {\"glass\": (ior: 1.5)})";
    let message = read(text).err().unwrap().to_string();
    assert_eq!(message, "scenes/test.ron:2:28: unknown material \"galss\" (did you mean \"glass\"?)");
}

#[test]
fn deep_nesting_is_refused_without_stack_overflow() {
    for (open, start) in
        [("(", ""), ("[", "(entities: "), ("{1: ", "(materials: "), ("a(", "(entities: "), ("Some(", "")]
    {
        let text = format!("{start}{}", open.repeat(100_000));
        let reason = read(&text).err().unwrap().to_string();
        assert!(reason.contains("nested too deeply"), "{reason:.200}");
        let closed = format!(
            "{text}{}",
            match open {
                "[" => "]",
                "{1: " => "}",
                _ => ")",
            }
            .repeat(100_000)
        );
        assert!(read(&closed).is_err());
    }
}

/// A name that is too long for suggestions is shortened in the message.
#[test]
fn long_names_are_shortened() {
    let text = format!("(entities: [(material: \"{}\")])", "x".repeat(1_000_000));
    let reason = format!(": unknown material \"{}…\"", "x".repeat(48));
    assert!(read(&text).err().unwrap().to_string().contains(&reason));
}

/// A long chain of ancestors is not a cycle and does not overflow the stack.
#[test]
fn long_chains_of_parents_are_read() {
    let mut text = String::from("(entities: [(name: \"0\")");
    for generation in 1..20_000 {
        text.push_str(&format!(", (name: \"{generation}\", parent: \"{}\")", generation - 1));
    }
    assert!(read(&format!("{text}])")).is_ok());
}

#[test]
fn mistakes_are_found_deep_in_a_long_file() {
    const WRONG: usize = 1500;
    let scene = |wrong: &str| {
        let mut text = String::from("( // line 1\nmaterials: {\"glass\": (ior: 1.5)},\nentities: [\n");
        for line in 4..=1999 {
            let ball =
                format!("    (name: \"bäll {line}\", shape: Sphere(radius_m: 0.5), material: \"glass\"),\n");
            text.push_str(if line == WRONG { wrong } else { &ball });
        }
        text + "])\n"
    };
    for (wrong, column, reason) in [
        (
            "shape: Sphere(radus_m: 0.5)",
            34,
            "unknown field \"radus_m\" in Sphere (did you mean \"radius_m\"?)",
        ),
        ("material: \"galss\"", 30, "unknown material \"galss\" (did you mean \"glass\"?)"),
        ("shape: Sphere(radius_m: NaN)", 44, "expected a finite number, found NaN"),
    ] {
        let text = scene(&format!("    (name: \"bäll\", {wrong}),\n"));
        assert_eq!(text.lines().count(), 2000);
        let message = read(&text).err().unwrap().to_string();
        assert!(message.starts_with(&format!("scenes/test.ron:{WRONG}:{column}: {reason}")), "{message}");
    }
}

#[test]
fn files_that_are_unreadable_or_not_utf_8_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    std::fs::write(&path, b"(entities:\n [\xff])").unwrap();
    let message = load(&path, &mut Fake::default()).err().unwrap().to_string();
    assert!(message.ends_with("a.ron:2:3: this is not UTF-8: save the file in that encoding"), "{message}");
    let message = load(&folder.path().join("b.ron"), &mut Fake::default()).err().unwrap().to_string();
    assert!(message.contains("b.ron: cannot read: "), "{message}");
}

/// All faults of a file are told at once, in their order, and nothing that only follows from one of them.
#[test]
fn all_faults_of_a_file_are_told() {
    let text = r#"(
    settings: (samples: 0, sizes: (3, 3)),
    materials: {"red": (diffuse: (1, 0)), "blue": (difuse: 1)},
    entities: [
        (name: "a", shape: Sphere(radius: 1), material: "red", transform: (translate: (1, 2))),
        (nam: "b"),
        (parent: "b", camera: Pinhole(vertical_fov_degrees: 200), material: "green"),
        (parent: "c", shape: Sphere(radius_m: 1)),
    ],
)"#;
    let error = read(text).err().unwrap();
    let LoadError::Several(faults) = &error else { panic!("{error}") };
    let places: Vec<_> = faults
        .iter()
        .map(|fault| match fault {
            LoadError::At { line, column, .. } => (*line, *column),
            other => panic!("{other}"),
        })
        .collect();
    let expected = [(2, 25), (2, 28), (3, 34), (3, 52), (5, 35), (5, 87), (6, 10), (7, 61), (7, 77)];
    assert_eq!(places, expected, "{error}");
    assert_eq!(error.to_string().lines().count(), faults.len());
    let many = format!("(entities: [{}])", "(lamp: 1), ".repeat(1000));
    let LoadError::Several(faults) = read(&many).err().unwrap() else { panic!() };
    assert_eq!(faults.len(), 20);
}
