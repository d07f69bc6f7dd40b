//! Carries out statements in the text of a scene file, so that everything else in it stays as the author wrote it.

use std::ops::Range;
use std::path::Path;

use super::rotation::in_parts;
use super::select::select;
use super::set::{Operator, Statement, statement};
use super::{QueryReader, Selected};
use crate::error::{LoadError, Subject};
use crate::formats::ron::lower::reread::Component;
use crate::formats::ron::parts::TextPart;
use crate::formats::ron::scan;
use crate::formats::ron::source::{Raw, SceneText};
use crate::world::{Transform, World};

/// Returns the text of the scene file at `path` with statements carried out in it. If `in_place` is true, a value that
/// the text writes, or could write in the component that it belongs to, is replaced there; all other statements are
/// added to `edits`, where they replace those about the same field. `world` is the scene that the text describes.
///
/// The result may describe another scene, for example if the text gives a field by another of its names: compare.
pub fn with_statements(
    text: &str,
    path: &Path,
    world: &World,
    statements: &[String],
    in_place: bool,
) -> Result<String, LoadError> {
    let part = TextPart::new(text, path);
    let source = SceneText::new(std::slice::from_ref(&part), 0.0);
    let scene = SceneFile { text: &part.text, path, root: source.root()?, source: &source };
    let (mut changes, mut others) = (Vec::new(), Vec::new());
    for statement in statements {
        if !in_place || scene.change(world, statement, &mut changes).is_none() {
            others.push(&statement[..]);
        }
    }
    if !others.is_empty() {
        changes.extend(scene.add_edits(&others));
    }
    // From the end, so that earlier places stay valid.
    changes.sort_by_key(|(place, _)| std::cmp::Reverse(place.start));
    let mut edited = part.text.to_string();
    for (place, new) in changes {
        edited.replace_range(place, &new);
    }
    Ok(edited)
}

/// The field that a statement sets, with the query before it, and the new value; none for other statements.
pub fn assignment(text: &str) -> Option<(&str, &str)> {
    let mut reader = QueryReader::new(text).ok()?;
    if reader.accept("settings.") {
        reader.rest = &text[scan::offset_of(text, reader.rest)? - 1..];
    } else {
        reader.either().ok()?;
    }
    let statement = statement(text, reader).ok().filter(|statement| statement.operator == Operator::Set)?;
    let before = text[..scan::offset_of(text, statement.value)?].trim_end();
    Some((before.strip_suffix('=')?.trim(), statement.value))
}

/// A place in a text, and what is written there instead.
type TextChange = (Range<usize>, String);

struct SceneFile<'s, 'a> {
    text: &'a str,
    path: &'s Path,
    root: Raw<'a>,
    source: &'s SceneText<'a>,
}

impl<'a> SceneFile<'_, 'a> {
    /// Carries out a statement in the component that it changes. None if the text does not contain it as a structure.
    fn change(&self, world: &World, text: &str, changes: &mut Vec<TextChange>) -> Option<()> {
        let mut reader = QueryReader::new(text).ok()?;
        let mut transform = None;
        let (component, parsed) = if reader.accept("settings.") {
            // The dot belongs to the path.
            reader.rest = &text[scan::offset_of(text, reader.rest)? - 1..];
            (self.value_of(self.root.0, "settings")?, statement(text, reader).ok()?)
        } else {
            let query = reader.either().ok()?;
            let mut parsed = statement(text, reader).ok()?;
            let component = match select(world, &query) {
                Selected::Materials(ids) => match ids[..] {
                    [id] => self.material(&world.assets.material_name(id))?,
                    _ => return None,
                },
                Selected::Entities(entities) => match entities[..] {
                    [entity] => {
                        let component = parsed.component(&query).ok()?;
                        let own = world.entities.get::<&Transform>(entity).ok().map(|it| *it);
                        transform = own.filter(|_| component == Component::Transform);
                        self.component(world.subject(entity), component)?
                    }
                    _ => return None,
                },
            };
            (component, parsed)
        };
        let start = scan::offset_of(self.text, component)?;
        let place = start..start + component.len();
        match changes.iter_mut().find(|(changed, _)| *changed == place) {
            Some((_, new)) => *new = edited(&parsed, new, transform)?,
            None => changes.push((place, edited(&parsed, component, transform)?)),
        }
        Some(())
    }

    /// The value of a key of a structure, without the blanks and comments behind it.
    fn value_of(&self, structure: &'a str, key: &str) -> Option<&'a str> {
        let mut items = self.source.values(structure).filter_map(scan::key_and_value);
        items.find(|(found, _)| *found == key).map(|(_, value)| scan::without_trailing_blanks(value))
    }

    /// The component of an entity that this file contains.
    fn component(&self, subject: Subject, component: Component) -> Option<&'a str> {
        let [line, column] = subject.position.filter(|_| subject.file.as_deref() == Some(self.path))?;
        self.value_of(&self.text[scan::offset(self.text, line as usize, column as usize)..], component.name())
    }

    /// The material that this file calls by a name.
    fn material(&self, name: &str) -> Option<&'a str> {
        let materials = self.value_of(self.root.0, "materials")?;
        self.source.values(materials).find_map(|item| {
            let (key, value) = scan::key_and_value(item)?;
            let is_it = ron::from_str::<String>(key).is_ok_and(|key| key == name);
            is_it.then(|| scan::without_trailing_blanks(value))
        })
    }

    /// The changes that add statements to `edits`.
    fn add_edits(&self, statements: &[&str]) -> Vec<TextChange> {
        let quoted = |statement: &str| ron::to_string(statement).unwrap_or_default();
        let list = self.value_of(self.root.0, "edits").filter(|list| list.starts_with('['));
        let Some(list) = list else {
            let all: Vec<String> = statements.iter().map(|it| format!("        {},\n", quoted(it))).collect();
            let root = scan::without_trailing_blanks(self.root.0);
            let end = scan::offset_of(self.text, root).unwrap_or(0) + root.len().saturating_sub(1);
            let before = scan::without_trailing_blanks(&root[..root.len().saturating_sub(1)]);
            let comma = if before.ends_with([',', '(']) { "" } else { "," };
            return vec![(end..end, format!("{comma}    edits: [\n{}    ],\n", all.concat()))];
        };
        let mut changes = Vec::new();
        for statement in statements {
            let earlier = self.source.values(list).map(scan::without_trailing_blanks).find(|item| {
                let field = |text: &str| assignment(text).map(|(field, _)| field.to_owned());
                ron::from_str::<String>(item).is_ok_and(|item| field(&item) == field(statement))
            });
            let start = earlier.and_then(|item| scan::offset_of(self.text, item));
            match earlier.zip(start) {
                Some((item, start)) => changes.push((start..start + item.len(), quoted(statement))),
                None => {
                    let inner = scan::without_trailing_blanks(&list[..list.len().saturating_sub(1)]);
                    let end = scan::offset_of(self.text, list).unwrap_or(0) + inner.len();
                    let comma = if inner.ends_with([',', '[']) { "" } else { "," };
                    changes.push((end..end, format!("{comma} {}", quoted(statement))));
                }
            }
        }
        changes
    }
}

/// A component's text with a statement carried out; none for a field of what is no structure, but a name or a variable,
/// or of a transform that is not in parts.
fn edited(statement: &Statement, component: &str, transform: Option<Transform>) -> Option<String> {
    let (form, rest) = scan::split_identifier(component);
    if let (Some(transform), Some(part)) = (transform, statement.path.first()) {
        let text = form.is_empty().then(|| in_parts(component.to_owned(), &transform, part).ok())??;
        return statement.edited(&text).ok();
    }
    let is_structure = scan::skip_blank(rest).starts_with('(');
    (statement.path.is_empty() || is_structure).then(|| statement.edited(component).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Files, LoadOptions};
    use crate::world::SourceFiles;

    const SCENE: &str = r#"(
    settings: (samples: 4 /* few */),
    materials: {
        // Red.
        "paint": (diffuse: (0.8, 0.2, 0.1) /* as the car */, shininess: 9),
    },
    entities: [
        (name: "ball", shape: Sphere(radius_m: 1), material: "paint"),
        (name: "box", shape: Sphere(radius_m: 2), material: (diffuse: 0.5)), // grey
        (name: "lamp", light: Area(
            power_w: 300, // bright
            size_m: 2,
        )),
    ], // all
)"#;

    fn edited(text: &str, statements: &[&str], in_place: bool) -> String {
        let mut files = Files::new(SourceFiles::default(), LoadOptions::default());
        let world = crate::formats::ron::parse(text, Path::new("a.ron"), &mut files).unwrap();
        let statements: Vec<String> = statements.iter().map(|it| (*it).to_owned()).collect();
        let new = with_statements(text, Path::new("a.ron"), &world, &statements, in_place).unwrap();
        crate::formats::ron::parse(&new, Path::new("a.ron"), &mut files).unwrap();
        new
    }

    #[test]
    fn statements_change_values_where_they_are_written() {
        let statements = [
            r#"Material["paint"].diffuse = (0.1, 0.2, 0.3)"#,
            r#"Material["paint"].specular = 0.5"#,
            r#""lamp".light.power_w = 7"#,
            r#""box".material.diffuse = 0.25"#,
            "settings.samples = 16",
        ];
        let expected = SCENE
            .replace("(diffuse: (0.8, 0.2, 0.1) /*", "(specular: 0.5, diffuse: (0.1, 0.2, 0.3) /*")
            .replace("power_w: 300, //", "power_w: 7, //")
            .replace("(diffuse: 0.5)), // grey", "(diffuse: 0.25)), // grey")
            .replace("samples: 4 /*", "samples: 16 /*");
        assert_eq!(edited(SCENE, &statements, true), expected);
    }

    #[test]
    fn shapes_transforms_and_textures_change_where_they_are_written() {
        let text = r#"(
    entities: [
        (name: "a", shape: Box(size_m: 1 /* cube */), transform: (translate: (1, 0, 0), // here
            rotate_quaternion: (0, 0, 0, 1))),
        (name: "b", shape: Sphere, material: (diffuse: Checker(scale: 2 /* wide */), alpha: 0.5)),
        (name: "c", light: Point(power_w: 1), transform: LookAt(from: (0, 1, 2), to: (0, 0, 0))),
    ],
)"#;
        let statements = [
            r#""a".shape.size_m = (1, 2, 3)"#,
            r#""a".transform.translate = (4, 0, 0)"#,
            r#""a".transform.rotate_degrees = (0, 45, 0)"#,
            r#""b".material.diffuse.scale = (5, 5, 1)"#,
            r#""b".material.alpha = Noise()"#,
        ];
        let expected = text
            .replace("size_m: 1 /*", "size_m: (1, 2, 3) /*")
            .replace("translate: (1, 0, 0)", "translate: (4, 0, 0)")
            .replace("rotate_quaternion: (0, 0, 0, 1)", "rotate_degrees: (0, 45, 0)")
            .replace("scale: 2 /*", "scale: (5, 5, 1) /*")
            .replace("alpha: 0.5", "alpha: Noise()");
        assert_eq!(edited(text, &statements, true), expected);
        // A transform of another form stays as it is.
        let moved = edited(text, &[r#""c".transform.translate = (4, 0, 0)"#], true);
        assert!(moved.contains("LookAt(from: (0, 1, 2)") && moved.contains("edits: ["), "{moved}");
    }

    #[test]
    fn assignments_are_split_at_their_operator() {
        let camera = r#"Camera[name="a = b"].camera.height_m"#;
        assert_eq!(assignment(&format!("{camera} = \"c = d\" // = 1")), Some((camera, "\"c = d\" // = 1")));
        assert_eq!(assignment("settings.samples=3"), Some(("settings.samples", "3")));
        assert_eq!(assignment("settings.samples *= 3"), None);
    }

    #[test]
    fn other_statements_become_edits_and_replace_those_about_the_same_field() {
        // A named material belongs to others, too, so the entity's own one is not where the file has it.
        let own = r#""ball".material.diffuse = 0.1"#;
        let first = edited(SCENE, &[own], true);
        let line = r#"        "\"ball\".material.diffuse = 0.1","#;
        assert_eq!(first, SCENE.replace("// all\n)", &format!("// all\n    edits: [\n{line}\n    ],\n)")));
        let second = edited(&first, &[r#""ball".material.diffuse = 0.9"#, "settings.samples = 2"], false);
        let expected = first.replace("= 0.1\",", "= 0.9\", \"settings.samples = 2\"");
        assert_eq!(
            second.replace(",\n    ],\n)", "\n    ],\n)"),
            expected.replace(",\n    ],\n)", "\n    ],\n)")
        );
    }
}
