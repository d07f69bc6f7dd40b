//! What the guides show: scenes that render, command lines that the program understands, links that lead somewhere.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use rayfront::compile::compile;
use rayfront::internals::cli::understands;
use rayfront::internals::formats::load;
use rayfront::render::{Options, Session};

/// A file of text for people, below the crate's folder.
struct Guide {
    path: PathBuf,
    text: String,
}

/// All of them: beside the sources, the scenes and the benchmarks, and at the top.
fn guides() -> Vec<Guide> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("src"), root.join("scenes"), root.join("benches")];
    let mut paths: Vec<PathBuf> = of_folder(root);
    while let Some(folder) = folders.pop() {
        let found = of_folder(&folder);
        folders.extend(found.iter().filter(|path| path.is_dir()).cloned());
        paths.extend(found);
    }
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    paths.sort();
    assert!(paths.len() > 10, "the guides were not found");
    let read = |path: PathBuf| Guide { text: std::fs::read_to_string(&path).expect("a guide"), path };
    paths.into_iter().map(read).collect()
}

fn of_folder(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries.map(|entry| entry.expect("an entry").path()).collect()
}

impl Guide {
    /// Blocks of code of a language, with the numbers of their first lines.
    fn blocks(&self, language: &str) -> Vec<(usize, String)> {
        let mut blocks = Vec::new();
        let mut inside: Option<(bool, usize, String)> = None;
        for (number, line) in (1..).zip(self.text.lines()) {
            match (&mut inside, line.strip_prefix("```")) {
                (None, Some(name)) => inside = Some((name == language, number + 1, String::new())),
                (Some((wanted, start, text)), Some(_)) => {
                    if *wanted {
                        blocks.push((*start, std::mem::take(text)));
                    }
                    inside = None;
                }
                (Some((_, _, text)), None) => {
                    text.push_str(line);
                    text.push('\n');
                }
                (None, None) => {}
            }
        }
        assert!(inside.is_none(), "{}: a block has no end", self.path.display());
        blocks
    }

    /// Lines outside of blocks, with their numbers.
    fn prose(&self) -> Vec<(usize, &str)> {
        let mut is_code = false;
        let is_prose = |(_, line): &(usize, &str)| {
            let is_fence = line.starts_with("```");
            is_code ^= is_fence;
            !is_code && !is_fence
        };
        (1..).zip(self.text.lines()).filter(is_prose).collect()
    }

    /// Places that links can name.
    fn anchors(&self) -> HashSet<String> {
        let headings = self.prose().into_iter().filter(|(_, line)| line.starts_with('#'));
        headings.map(|(_, line)| anchor(line.trim_start_matches('#').trim())).collect()
    }
}

/// As the sites do that show Markdown.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

#[test]
fn links_lead_somewhere() {
    let all = guides();
    let (mut problems, mut count) = (Vec::new(), 0);
    for guide in &all {
        for (number, line) in guide.prose() {
            for (start, _) in line.match_indices("](") {
                let target = line[start + 2..].split(')').next().unwrap_or_default();
                if target.starts_with("https://") {
                    continue;
                }
                count += 1;
                let (file, place) = target.split_once('#').unwrap_or((target, ""));
                let path = match file {
                    "" => guide.path.clone(),
                    file => guide.path.parent().expect("a folder").join(file),
                };
                let found = path.canonicalize().ok();
                let is_there = found.as_ref().is_some_and(|path| {
                    let named =
                        all.iter().find(|other| other.path.canonicalize().ok().as_ref() == Some(path));
                    place.is_empty() || named.is_some_and(|other| other.anchors().contains(place))
                });
                if !is_there {
                    problems.push(format!("{}:{number}: {target}", guide.path.display()));
                }
            }
        }
    }
    assert!(count > 50, "links were not found");
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

#[test]
fn scenes_render() {
    let mut count = 0;
    for guide in guides() {
        let folder = tempfile::tempdir().expect("a folder");
        for (number, text) in guide.blocks("ron") {
            count += 1;
            // The first line may name the file for those that include it.
            let name = text.lines().next().and_then(|line| line.strip_prefix("// "));
            let path = folder.path().join(name.filter(|name| name.ends_with(".ron")).unwrap_or("scene.ron"));
            std::fs::write(&path, &text).expect("a scene");
            let place = format!("{}:{number}", guide.path.display());
            let mut world = load(&path).unwrap_or_else(|error| panic!("{place}: {error}"));
            world.settings.size = [64, 36];
            world.settings.samples = 1;
            let scene = compile(&world, None).unwrap_or_else(|error| panic!("{place}: {error}"));
            let mut session = Session::new(scene, &world.settings, Options::default());
            session.finish(|_| ());
            let light = session.film().radiance().iter().map(|pixel| pixel.luminance()).sum::<f32>();
            assert!(light > 1.0, "{place}: the image is black");
        }
    }
    assert!(count > 2, "scenes were not found");
}

#[test]
fn the_program_understands_what_the_guides_type() {
    let (mut problems, mut count) = (Vec::new(), 0);
    for guide in guides() {
        for (number, block) in guide.blocks("sh") {
            for (offset, line) in block.lines().enumerate() {
                let words = words(line);
                let start = match &words[..] {
                    [first, ..] if first == "rayfront" => 0,
                    [cargo, ..] if cargo == "cargo" && line.starts_with("cargo run --release -- ") => 3,
                    _ => continue,
                };
                count += 1;
                let words: Vec<String> = std::iter::once("rayfront".to_string())
                    .chain(words[start + 1..].iter().cloned())
                    .collect();
                if let Err(error) = understands(&words) {
                    problems.push(format!("{}:{}: {line}\n{error}", guide.path.display(), number + offset));
                }
            }
        }
    }
    assert!(count > 50, "command lines were not found");
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

/// Words of a shell's line up to a redirection or another command.
fn words(line: &str) -> Vec<String> {
    let words = shlex::split(line).unwrap_or_default();
    words.into_iter().take_while(|word| !word.starts_with(['>', '|', ';', '&'])).collect()
}
