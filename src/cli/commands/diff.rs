//! `rayfront diff A B`: lists the components in which two scenes differ.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::cli::args::ModelOptions;
use crate::cli::failure::{Failure, Fault};
use crate::cli::output;
use crate::formats::ron::{Portrait, portrait};

/// `rayfront diff`.
#[derive(Args, Debug)]
pub struct Diff {
    /// A scene
    pub a: PathBuf,
    /// Another scene
    pub b: PathBuf,
    /// The options for reading the scenes.
    #[command(flatten)]
    pub model: ModelOptions,
}

pub fn run(arguments: &Diff) -> Result<ExitCode, Failure> {
    let read = |path: &PathBuf| -> Result<Portrait, Failure> {
        let world = crate::formats::load_with(path, &arguments.model.of_size(None))?;
        Ok(portrait(&world, path))
    };
    let lines = differences(&read(&arguments.a)?, &read(&arguments.b)?);
    output::print(&lines.iter().map(|line| format!("{line}\n")).collect::<String>())?;
    Ok(if lines.is_empty() { ExitCode::SUCCESS } else { Fault::Difference.code() })
}

/// Returns the values of A that differ in B, with `-`, and those of B, with `+`.
fn differences(a: &Portrait, b: &Portrait) -> Vec<String> {
    let [a, b] = [a, b].map(values);
    let mut lines = Vec::new();
    for (place, old) in &a {
        match b.get(place) {
            Some(new) if new == old => {}
            Some(new) => lines.extend([format!("- {place}: {old}"), format!("+ {place}: {new}")]),
            None => lines.push(format!("- {place}: {old}")),
        }
    }
    lines.extend(
        b.iter().filter(|(place, _)| !a.contains_key(*place)).map(|(place, new)| format!("+ {place}: {new}")),
    );
    lines
}

/// Returns every value by its place. Items of the same name are distinguished by their order.
fn values(portrait: &Portrait) -> BTreeMap<String, String> {
    let mut values = BTreeMap::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut unique = |name: String| {
        let count = seen.entry(name.clone()).or_default();
        *count += 1;
        if *count == 1 { name } else { format!("{name} ({count})") }
    };
    values.insert("settings".to_owned(), portrait.settings.clone());
    for (name, text) in &portrait.materials {
        values.insert(unique(format!("material {name:?}")), text.clone());
    }
    for (name, keys) in &portrait.entities {
        let name = unique(format!("{name:?}"));
        values.insert(name.clone(), "is there".to_owned());
        values.extend(keys.iter().map(|(key, value)| (format!("{name}.{key}"), value.clone())));
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_listed_by_component() {
        let entity = |name: &str, keys: &[(&'static str, &str)]| {
            (name.to_owned(), keys.iter().map(|(key, value)| (*key, (*value).to_owned())).collect())
        };
        let a = Portrait {
            entities: vec![entity("lamp", &[("light", "Point(power_w: 1)")]), entity("ball", &[])],
            ..Portrait::default()
        };
        let b = Portrait {
            entities: vec![entity("lamp", &[("light", "Point(power_w: 2)")])],
            ..Portrait::default()
        };
        assert!(differences(&a, &a).is_empty());
        let expected = [
            "- \"ball\": is there", "- \"lamp\".light: Point(power_w: 1)",
            "+ \"lamp\".light: Point(power_w: 2)",
        ];
        assert_eq!(differences(&a, &b), expected);
    }
}
