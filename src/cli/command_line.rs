//! Command lines: normalised ones, and those to type next, derived from what was typed.

use std::ffi::{OsStr, OsString};
use std::iter::Peekable;
use std::ops::Range;
use std::path::Path;

use super::args::{Words, parse_place};
use crate::formats::film_file::FilmHeader;
use crate::study::explain::Recipe;

/// Normalises words: `--samples` with a plain number becomes `--spp`, the samples per pixel of other programs, and two
/// points in one word become two words.
pub fn normalize_args(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let is_number = |word: &OsStr| !word.is_empty() && word.as_encoded_bytes().iter().all(u8::is_ascii_digit);
    let mut words = words.into_iter().peekable();
    let mut meant = Vec::new();
    while let Some(word) = words.next() {
        if word == "--look-at" {
            meant.push(word);
            meant.extend(places(&mut words));
            continue;
        }
        let attached = word.to_str().and_then(|word| word.strip_prefix("--samples="));
        meant.push(match attached.filter(|number| is_number(OsStr::new(number))) {
            Some(number) => format!("--spp={number}").into(),
            None if word == "--samples" && words.peek().is_some_and(|next| is_number(next)) => "--spp".into(),
            None => word,
        });
    }
    meant
}

/// Returns the words of two points, which are typed as one word or two. A missing second point becomes an empty word,
/// so that the error is about it, not about the words that follow.
fn places(words: &mut Peekable<impl Iterator<Item = OsString>>) -> Vec<OsString> {
    let Some(first) = words.next() else { return Vec::new() };
    let parts: Vec<&str> = first.to_str().unwrap_or_default().split_whitespace().collect();
    if let [from, to] = parts[..] {
        return vec![from.into(), to.into()];
    }
    let is_place = |word: &OsString| word.to_str().is_some_and(|word| parse_place(word).is_ok());
    vec![first, words.next_if(is_place).unwrap_or_default()]
}

/// Returns this process's arguments as [`recorded`].
pub fn recorded_args() -> Vec<String> {
    let words = normalize_args(std::env::args_os().skip(1));
    recorded(words.into_iter().map(|word| word.to_string_lossy().into_owned()).collect())
}

/// Returns words with each option under its main name, so that the record in an image, and everything derived from it,
/// does not depend on the alias that was typed.
pub fn recorded(mut words: Vec<String>) -> Vec<String> {
    const OTHER_NAMES: [(&str, &str); 4] =
        [("--samples-per-pixel", "--spp"), ("-s", "--spp"), ("-t", "--threads"), ("-q", "--quiet")];
    if words.first().is_some_and(|word| word == "render") {
        words.remove(0);
    }
    for word in &mut words {
        for (other, name) in OTHER_NAMES {
            let is_short = other.len() == 2;
            let Some(value) = word.strip_prefix(other) else { continue };
            match value.strip_prefix('=').unwrap_or(value) {
                "" => *word = name.to_owned(),
                value if is_short || word.contains('=') => *word = format!("{name}={value}"),
                _ => {}
            }
        }
    }
    words
}

/// Returns a word, quoted for a shell.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Returns the command that renders another part, next to the one at `path`.
pub fn of_shard(header: &FilmHeader, path: &Path, [index, count]: [u32; 2]) -> String {
    let own = header.shard.map_or(0, |[index, _]| index);
    let name = path.to_string_lossy();
    let file = other_number(&name, own, index).unwrap_or_else(|| format!("part-{index}-of-{count}.film"));
    line(header, &["--shard", &format!("{index}/{count}")], &file)
}

/// Returns the command that renders some samples, next to the film at `path`.
pub fn of_samples(header: &FilmHeader, path: &Path, samples: Range<u32>) -> String {
    let Range { start, end } = samples;
    let file = path.with_file_name(format!("samples-{start}-{end}.film"));
    line(header, &["--samples", &format!("{start}..{end}")], &file.to_string_lossy())
}

/// Returns the command that explains a sample of a render.
pub fn of_explain(recipe: &Recipe, [x, y]: [u32; 2], sample: u32) -> String {
    let Recipe { path, options, camera, authored, settings, is_moved } = recipe;
    let scene = not_an_option(path);
    let mut words = vec!["rayfront".to_owned(), "explain".to_owned(), scene, format!("{x},{y}")];
    words.extend(["--sample".to_owned(), sample.to_string()]);
    words.extend(Words::of_settings(authored, settings));
    words.extend(Words::of_loading(options));
    let mut looks = Words::default();
    looks.option("--camera", camera.as_ref());
    words.extend(looks);
    if crate::files::outside_is_allowed() {
        words.push("--allow-outside".to_owned());
    }
    let note = if *is_moved { "  # but that the camera is where its file says" } else { "" };
    shell_line(&words) + note
}

/// Returns the arguments that render a film again, except those for its part of the samples, for stopping and for
/// outputs.
pub fn of_whole(header: &FilmHeader) -> Vec<String> {
    const OTHERS: [&str; 10] = [
        "--until", "--max-time", "--checkpoint", "--samples", "--shard", "--output", "-o", "--tev", "--spp",
        "--frames",
    ];
    let command = &header.note.command;
    let mut words = without(command, &OTHERS);
    words.retain(|word| !["--watch", "--paranoid", "--preview"].contains(&&word[..]));
    let mut more = Words::default();
    // A film that was continued may have more samples than its command.
    more.option("--spp", Some(header.settings.samples));
    if without(command, &["--frames"]).len() < command.len() {
        // It is one of the frames, which have one exposure in common.
        more.option("--time", header.view.time_s);
        if !header.settings.auto_exposure {
            words = without(&words, &["--exposure"]);
            more.option("--exposure", Some(header.settings.exposure_ev));
        }
    }
    words.extend(more);
    words
}

/// Returns the command that renders another part of the samples.
fn line(header: &FilmHeader, part: &[&str], file: &str) -> String {
    let mut words = vec!["rayfront".to_owned()];
    words.extend(of_whole(header));
    words.extend(part.iter().map(|word| (*word).to_owned()));
    words.extend(["-o".to_owned(), file.to_owned()]);
    format!("  {}", shell_line(&words))
}

/// Returns a path as an argument: one that begins with a minus would be taken for an option.
pub fn not_an_option(path: &Path) -> String {
    let path = path.to_string_lossy();
    if path.starts_with('-') { format!("./{path}") } else { path.into_owned() }
}

/// Returns words as a line for a shell.
pub fn shell_line(words: &[String]) -> String {
    let words: Vec<_> = words.iter().map(|word| quoted(word)).collect();
    words.join(" ")
}

/// Returns a command without some options, all of which have values.
pub fn without(command: &[String], options: &[&str]) -> Vec<String> {
    let mut left = Vec::new();
    let mut words = command.iter();
    while let Some(word) = words.next() {
        let (name, has_value) = word.split_once('=').map_or((&word[..], false), |(name, _)| (name, true));
        match options.contains(&name) {
            true if has_value => {}
            true => drop(words.next()),
            // The value may be attached, as in -opart.film.
            false if options.contains(&"-o") && word.starts_with("-o") && !word.starts_with("--") => {}
            false => left.push(word.clone()),
        }
    }
    left
}

/// Returns a path with the old number in the file's name replaced by a new one.
fn other_number(name: &str, old: u32, new: u32) -> Option<String> {
    let start = name.rfind(['/', '\\']).map_or(0, |at| at + 1);
    let old = old.to_string();
    let is_digit = |at: usize| name.as_bytes().get(at).is_some_and(u8::is_ascii_digit);
    let longer = |at: &usize| *at > start && is_digit(at - 1) || is_digit(at + old.len());
    // In "3-of-64", the part comes before the number of parts.
    let mut found = name[start..].match_indices(&old).map(|(at, _)| start + at).filter(|at| !longer(at));
    let at = found.next()?;
    Some(format!("{}{new}{}", &name[..at], &name[at + old.len()..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("part-3.film"), "part-3.film");
        assert_eq!(quoted("it's a $cene"), "'it'\\''s a $cene'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn aliases_become_main_names() {
        let understood = |words: &[&str]| normalize_args(words.iter().map(OsString::from));
        assert_eq!(understood(&["a.ron", "--samples", "64"]), ["a.ron", "--spp", "64"]);
        assert_eq!(understood(&["--samples=64"]), ["--spp=64"]);
        assert_eq!(
            understood(&["--samples", "0..64", "--samples=1..2"]),
            ["--samples", "0..64", "--samples=1..2"]
        );
        assert_eq!(understood(&["--samples"]), ["--samples"]);
        let words = ["render", "a.ron", "-s", "4", "-t2", "--samples-per-pixel=8", "--size", "4x4", "-s=3"];
        let plain = ["a.ron", "--spp", "4", "--threads=2", "--spp=8", "--size", "4x4", "--spp=3"];
        assert_eq!(recorded(words.map(String::from).into()), plain);
    }

    #[test]
    fn options_are_removed_with_their_values() {
        let command = ["a.ron", "--shard", "3/4", "-o", "x.film", "--spp=8", "--output=y.png", "-oz.png"];
        let command: Vec<String> = command.map(String::from).into();
        assert_eq!(without(&command, &["--shard", "--output", "-o"]), ["a.ron", "--spp=8"]);
    }

    #[test]
    fn other_number_replaces_whole_numbers_in_file_names() {
        assert_eq!(other_number("out3/part-3.film", 3, 12), Some("out3/part-12.film".into()));
        assert_eq!(other_number("scene.3-of-33.film", 3, 4), Some("scene.4-of-33.film".into()));
        assert_eq!(other_number("part-13.film", 3, 4), None);
    }
}
