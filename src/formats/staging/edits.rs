//! Changes to a scene beyond its files: other values, and parts left out.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::framing;
use super::surroundings::{self, AddedSurroundings};
use crate::error::Diagnostic;
use crate::error::{LoadError, in_one_line};
use crate::formats::load_options::Edits;
use crate::formats::ron::query::{EditRunner, Query, no_match};
use crate::formats::{AssetFiles, Files};
use crate::world::{Background, Backplate, Camera, Light, Parent, Settings, Shape, World};

impl Edits {
    /// Applies the edits that do not depend on positions. Fails for texts that are no query, or that select nothing.
    pub(crate) fn apply(&self, world: &mut World, files: &mut Files) -> Result<(), LoadError> {
        if self.zoom.is_some_and(|zoom| !(1e-3..=1e3).contains(&zoom)) {
            return Err(LoadError::option("zoom", "it must be 0.001 to 1000: 2 is twice as near"));
        }
        if self.orbit.is_some_and(|angles| !angles.iter().all(|angle| angle.is_finite())) {
            return Err(LoadError::option("orbit", "its angles must be finite"));
        }
        surroundings::change(world, self.env_turn_degrees, self.env_strength)?;
        let mut changes = EditRunner::new(world);
        if let Some([from, to]) = &self.look_at {
            let statement = format!("Camera.transform = LookAt(from: ({from}), to: ({to}))");
            let done = changes.carry_out(world, &statement, files);
            done.map_err(|error| LoadError::option("look_at", error))?;
        }
        for statement in &self.set {
            let done = changes.carry_out(world, statement, files);
            done.map_err(|error| LoadError::option("set", error))?;
        }
        if !self.only.is_empty() {
            let queries = queries(world, "only", &self.only)?;
            let kept = meant(world, &queries, "only", &self.only)?;
            for entity in world.in_order() {
                if !kept.contains(&entity) {
                    // Not every entity has a shape.
                    let _ = world.entities.remove_one::<Shape>(entity);
                }
            }
        }
        if !self.hide.is_empty() {
            let queries = queries(world, "hide", &self.hide)?;
            let is_added = |entity: &hecs::Entity| world.entities.satisfies::<&AddedSurroundings>(*entity);
            let mut all = meant(world, &queries, "hide", &self.hide)?;
            all.retain(|entity| !is_added(entity));
            let is_visible =
                |entity: &hecs::Entity| world.entities.satisfies::<hecs::Or<&Shape, &Light>>(*entity);
            let is_camera = |entity: &hecs::Entity| world.entities.satisfies::<&Camera>(*entity);
            let (order, mut idle, mut cameras) = (world.in_order(), Vec::new(), Vec::new());
            for (query, text) in queries.iter().zip(&self.hide) {
                let own: Vec<_> =
                    order.iter().filter(|entity| query.matches(world, **entity)).copied().collect();
                if own.iter().all(|entity| is_camera(entity) && !is_visible(entity)) {
                    cameras.extend(own);
                    continue;
                }
                // Those that another query hides count, too.
                let one = meant(world, std::slice::from_ref(query), "hide", std::slice::from_ref(text))?;
                if !one.iter().any(|entity| is_visible(entity) && !is_added(entity)) {
                    idle.push(text);
                }
            }
            for text in idle {
                let what = format!(
                    "hide: {}: nothing of that is a shape, a light or a camera of the files, so nothing is hidden",
                    in_one_line(text)
                );
                world.warnings.push(Diagnostic::warning("hide-without-effect", what));
            }
            for entity in all {
                // Not every entity has both.
                let _ = world.entities.remove_one::<Shape>(entity);
                let _ = world.entities.remove_one::<Light>(entity);
            }
            if !cameras.is_empty() {
                for entity in cameras {
                    // Queries may select the same one.
                    let _ = world.entities.remove_one::<Camera>(entity);
                }
                framing::add_camera(world);
            }
        }
        if let Some(background) = &self.background {
            let backplate = Some(backplate(background, world, files)?);
            let before = std::mem::take(&mut world.settings);
            // What the scene itself shows there, it takes the place of.
            world.settings = Settings { backplate, backdrop: None, transparent: false, ..before };
        }
        // A background other than black is reported when the scene is compiled.
        if world.settings.background == Background::default()
            && self.set.iter().any(|it| is_of_background(it))
        {
            let hidden = world.hidden_background();
            world.warnings.extend(hidden);
        }
        Ok(())
    }
}

/// The backplate that `--background` names: a colour, or a picture relative to the current folder.
fn backplate(text: &str, world: &mut World, files: &mut Files) -> Result<Backplate, LoadError> {
    let path = Path::new(text);
    let starts_with_letter =
        |end: &std::ffi::OsStr| end.as_encoded_bytes().first().is_some_and(u8::is_ascii_alphabetic);
    if path.extension().is_some_and(starts_with_letter) || text.contains(['/', '\\']) {
        files.sources.allow(path);
        files.image(path)?;
        world.assets.files.extend(&files.sources);
        return Ok(Backplate::Image(path.to_owned()));
    }
    let numbers: Vec<f64> = text.split(',').map_while(|number| number.trim().parse().ok()).collect();
    if let [r, g, b] = numbers[..]
        && [r, g, b].iter().all(|part| (0.0..=255.0).contains(part) && part.fract() == 0.0)
        && numbers.iter().any(|part| *part > 1.0)
    {
        let [r, g, b] = [r, g, b].map(|part| part as u8);
        let reason = format!("numbers are from 0 to 1, and linear: this is '#{r:02x}{g:02x}{b:02x}'");
        return Err(LoadError::option("background", reason));
    }
    let mut changed = World::default();
    let statement = format!("{STATEMENT}{}", as_in_files(text));
    let done = EditRunner::new(&changed).carry_out(&mut changed, &statement, files);
    done.map_err(|error| LoadError::option("background", as_typed(&error.to_string())))?;
    changed
        .settings
        .backplate
        .ok_or_else(|| LoadError::option("background", "it must be a colour or a picture"))
}

/// The statement that `--background` is short for, up to its value.
const STATEMENT: &str = "settings.backplate = ";

/// Returns a message about [`STATEMENT`] with the option in its place, and the marks below it where they belong.
fn as_typed(message: &str) -> String {
    const OPTION: &str = "--background ";
    let mut is_below = false;
    let line = |line: &str| {
        let (indent, rest) = line.split_at(line.len() - line.trim_start().len());
        let marks = indent.len().saturating_sub(if is_below { STATEMENT.len() - OPTION.len() } else { 0 });
        let value = rest.strip_prefix(STATEMENT);
        is_below = value.is_some();
        match value {
            Some(value) => format!("{indent}{OPTION}{value}"),
            None => format!("{}{rest}", " ".repeat(marks)),
        }
    };
    message.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Returns a colour in the syntax of scene files. The quotes and parentheses, which are hard to type on a command line,
/// may be missing from `color`.
fn as_in_files(color: &str) -> String {
    let color = color.trim();
    match color {
        hexadecimal if hexadecimal.starts_with('#') => format!("\"{hexadecimal}\""),
        digits if [3, 6].contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_hexdigit()) => {
            format!("\"{digits}\"")
        }
        name if name != "None" && !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphabetic()) => {
            format!("\"{name}\"")
        }
        list if list.contains(',') && !list.contains('(') => format!("({list})"),
        other => other.to_owned(),
    }
}

/// True if a statement is about the background.
fn is_of_background(statement: &str) -> bool {
    let field = statement.trim_start().strip_prefix("settings.");
    field.is_some_and(|field| field.trim_start().starts_with("background"))
}

fn queries(world: &World, option: &'static str, texts: &[String]) -> Result<Vec<Query>, LoadError> {
    let parse = |text: &String| Query::parse(text, world).map_err(|error| LoadError::option(option, error));
    texts.iter().map(parse).collect()
}

/// The entities that any of the queries selects, and all below them.
fn meant(
    world: &World,
    queries: &[Query],
    option: &'static str,
    texts: &[String],
) -> Result<HashSet<hecs::Entity>, LoadError> {
    let order = world.in_order();
    for (query, text) in queries.iter().zip(texts) {
        if !order.iter().any(|entity| query.matches(world, *entity)) {
            let reason = format!("{}: {}", in_one_line(text), no_match(world, query));
            return Err(LoadError::option(option, reason));
        }
    }
    // Walks up from each entity to one with a known result: however deep they are, each is tested once.
    let mut known: HashMap<hecs::Entity, bool> = HashMap::with_capacity(order.len());
    for entity in &order {
        let (mut at, mut chain) = (Some(*entity), Vec::new());
        let mut is_meant = false;
        while let Some(entity) = at {
            // An entity that is already on the way is below itself: the compiler refuses it.
            if let Some(found) = known.get(&entity) {
                is_meant = *found;
                break;
            }
            chain.push(entity);
            known.insert(entity, false);
            if queries.iter().any(|query| query.matches(world, entity)) {
                is_meant = true;
                break;
            }
            at = world.entities.get::<&Parent>(entity).ok().map(|parent| parent.0);
        }
        known.extend(chain.into_iter().map(|entity| (entity, is_meant)));
    }
    Ok(known.into_iter().filter(|(_, is_meant)| *is_meant).map(|(entity, _)| entity).collect())
}

#[cfg(test)]
mod tests {
    use super::as_typed;

    #[test]
    fn messages_quote_the_option_and_mark_its_value() {
        let message =
            "expected a value, found 3\n  settings.backplate = Image(3)\n                       ^^^^^^^^";
        let typed = "expected a value, found 3\n  --background Image(3)\n               ^^^^^^^^";
        assert_eq!(as_typed(message), typed);
        assert_eq!(as_typed("no such colour"), "no such colour");
    }
}
