//! Changes values of components by statements: the component is written as in a scene file, the value replaced, and the
//! text read again. Every field can thus be set, by its own name, to any value that a file may contain.

use crate::error::Diagnostic;
use hecs::Entity;

use super::select::Index;
use super::{Query, QueryError, QueryReader, Selected, advice, rotation};
use crate::error::{LoadError, did_you_mean, in_one_line};
use crate::formats::AssetFiles;
use crate::formats::ron::lower::reread::{Component, Names, reread, reread_settings};
use crate::formats::ron::scan;
use crate::formats::ron::tree::BracketTree;
use crate::formats::ron::write::{component_text, settings_text};
use crate::world::{MaterialId, Shape, Transform, World};

/// Assignment (`=`) and the arithmetic assignment operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Set,
    Times,
    Over,
    Plus,
    Minus,
}

/// All operators by their text.
const OPERATORS: [(&str, Operator); 5] = [
    ("*=", Operator::Times),
    ("/=", Operator::Over),
    ("+=", Operator::Plus),
    ("-=", Operator::Minus),
    ("=", Operator::Set),
];

impl Operator {
    /// The text of the operator.
    pub(super) fn sign(self) -> &'static str {
        OPERATORS.iter().find(|(_, operator)| *operator == self).map_or("=", |(sign, _)| sign)
    }
}

/// A component or material to change.
#[derive(Clone, Copy)]
enum Target {
    Entity(Entity, Component),
    Material(MaterialId),
}

/// A parsed statement.
pub(super) struct Statement<'a> {
    pub(super) text: &'a str,
    /// The field names, from the component's field inwards.
    pub(super) path: Vec<&'a str>,
    pub(super) operator: Operator,
    pub(super) value: &'a str,
    /// True if it changes one thing, as far as is known.
    is_only: bool,
}

/// Executes one statement. Returns the number of entities or materials that it changed, at least 1.
pub fn set(world: &mut World, text: &str, files: &mut dyn AssetFiles) -> Result<usize, QueryError> {
    EditRunner::new(world).carry_out(world, text, files)
}

/// The number of changes allowed for each entity or material, on average.
const MOST_CHANGES: u64 = 64;
/// The number of changes that is always allowed, however few entities and materials there are.
const FEW_CHANGES: u64 = 100_000;
/// The number of entities or materials that can be tested in the time of one change.
const LOOKS: u64 = 64;

/// Executes statements in sequence. The time is bounded by the numbers of statements and of entities and materials, not
/// by their product: a short file could otherwise keep a machine busy for hours.
pub struct EditRunner {
    index: Index,
    /// The materials by name, once they have been needed.
    names: Names,
    changed: u64,
}

impl EditRunner {
    /// Creates the runner for a world that only its statements change.
    pub fn new(world: &World) -> EditRunner {
        EditRunner { index: Index::new(world), names: None, changed: 0 }
    }

    /// Executes a statement. Returns the number of entities or materials that it changed, at least 1.
    pub fn carry_out(
        &mut self,
        world: &mut World,
        text: &str,
        files: &mut dyn AssetFiles,
    ) -> Result<usize, QueryError> {
        let mut reader = QueryReader { world: Some(world), ..QueryReader::new(text)? };
        if reader.accept("settings.") {
            // The dot belongs to the path.
            reader.rest = &text[scan::offset_of(text, reader.rest).unwrap_or(1) - 1..];
            return statement(text, reader)?.change_settings(world, files);
        }
        let query = reader.either()?;
        let query_text = text[..text.len() - reader.rest.len()].trim();
        let mut statement = statement(text, reader)?;
        let selected = self.index.select(world, &query);
        if selected.is_empty() {
            let reason = advice::name_of_material(world, &query, Some(&statement));
            let reason = reason.unwrap_or_else(|| no_match(world, &query));
            return Err(QueryError::new(text, query_text, reason));
        }
        self.count(world, selected.len(), text, query_text)?;
        statement.is_only = selected.len() == 1;
        let targets: Vec<Target> = match selected {
            Selected::Materials(materials) => materials.into_iter().map(Target::Material).collect(),
            Selected::Entities(entities) => {
                let component = statement.component(&query).map_err(|error| {
                    statement.without_component(world, &entities, (&query, query_text), error)
                })?;
                if matches!(component, Component::Material | Component::Shape) {
                    self.index.forget_worn();
                }
                entities.into_iter().map(|entity| Target::Entity(entity, component)).collect()
            }
        };
        for target in &targets {
            let changed = statement.change(world, *target, files, &mut self.names);
            changed.map_err(|error| statement.failed(world, (&targets, *target), query_text, error))?;
        }
        let mut materials = targets.iter().filter_map(|target| match target {
            Target::Material(id) => Some(id),
            Target::Entity(..) => None,
        });
        // A material that is changed through an entity is in use.
        let are_all = targets.len() == materials.clone().count();
        if are_all && !materials.any(|id| self.index.worn(world).contains(id)) {
            let what = "no shape has this material, so nothing looks different";
            let remedy =
                "an entity's own is changed by \"its name\".material, overrides where they are written";
            let what = format!("set: {}: {what}", in_one_line(text));
            world.warnings.push(Diagnostic::warning("set-without-effect", what).fixed_by(remedy));
        }
        let shapeless = |target: &Target| match target {
            Target::Entity(entity, Component::Material) => world.entities.get::<&Shape>(*entity).is_err(),
            _ => false,
        };
        if targets.iter().all(shapeless) {
            let what = format!(
                "set: {}: nothing of that has a shape, so nothing looks different",
                in_one_line(text)
            );
            let remedy = "the entities below it have shapes of their own, by their names or as Mesh.material";
            world.warnings.push(Diagnostic::warning("set-without-effect", what).fixed_by(remedy));
        }
        Ok(targets.len())
    }

    /// Counts `more` changes; an error if there have been too many.
    fn count(&mut self, world: &World, more: usize, text: &str, part: &str) -> Result<(), QueryError> {
        self.changed += more as u64;
        let things = (self.index.len() + world.assets.materials.len()) as u64;
        let most = FEW_CHANGES + MOST_CHANGES * things;
        if self.changed + self.index.looked_at / LOOKS <= most {
            return Ok(());
        }
        let reason = format!(
            "up to here, statements change {} values of {things} entities and materials: combine statements about the same things",
            self.changed
        );
        Err(QueryError::new(text, part, reason))
    }
}

/// The message for a query that selects nothing, with a similar name if there is one.
pub fn no_match(world: &World, query: &Query) -> String {
    let names: Vec<String> = match query {
        Query::Atom(super::Kind::Material, _) => {
            world.assets.materials.iter().filter_map(|named| named.name.clone()).collect()
        }
        _ => world.in_order().into_iter().map(|entity| world.name_of(entity)).collect(),
    };
    let wanted = match query {
        Query::Atom(_, filters) => filters.first().map(|filter| filter.text.clone()).unwrap_or_default(),
        _ => String::new(),
    };
    if names.contains(&wanted) && matches!(query, Query::Atom(super::Kind::Material, _)) {
        return format!("a material is no thing: what has it is Shape[material=\"{wanted}\"]");
    }
    if let Some(reason) = advice::name_of_material(world, query, None) {
        return reason;
    }
    let hint = did_you_mean(&wanted, names.iter().map(String::as_str));
    format!("nothing in the scene matches this{hint}: rayfront ls lists what there is")
}

/// A text in which one value, `Image("path")` or `Image("path", Green)`, is a `Texture(image: …)` that may have fields.
fn with_keys_of_image(old: &str, image: &str, values: &mut dyn Iterator<Item = &str>) -> Option<String> {
    let image = scan::without_trailing_blanks(image);
    let start = scan::offset_of(old, image)?;
    let path = values.next()?.trim();
    let channel = values.next().map_or(String::new(), |channel| format!(", channel: {}", channel.trim()));
    let texture = format!("Texture(image: {path}{channel})");
    Some(format!("{}{texture}{}", &old[..start], &old[start + image.len()..]))
}

/// The defaults of numbers that files mostly leave out.
pub(super) fn default_of(name: &str) -> Option<&'static str> {
    match name {
        "translate" => Some("(0, 0, 0)"),
        "scale" | "radiance" => Some("1"),
        _ => None,
    }
}

/// The form of values with fields that files mostly leave out.
fn default_form(name: &str) -> &'static str {
    if name == "filter" { "BlackmanHarris" } else { "" }
}

pub(super) fn statement<'a>(
    text: &'a str,
    mut reader: QueryReader<'a, '_>,
) -> Result<Statement<'a>, QueryError> {
    let mut path = Vec::new();
    while reader.accept(".") {
        let (name, rest) = scan::split_identifier(reader.rest.trim_start());
        if name.is_empty() {
            return Err(reader.error(rest, "expected the name of a field"));
        }
        path.push(name);
        reader.rest = rest;
    }
    if path.is_empty() {
        let query = text[..text.len() - reader.rest.len()].trim();
        let name = query.strip_prefix("Material[").and_then(|rest| rest.strip_suffix(']'));
        if let Some(name) = name.filter(|name| name.starts_with('"')) {
            let reason = format!(
                "its fields are set, such as .base_color; what has it gets another one by Shape[material={name}].material = …"
            );
            return Err(reader.error(reader.rest, reason));
        }
        return Err(reader.error(reader.rest, "expected a dot and the name of a field, such as .power_w"));
    }
    let operator = OPERATORS.iter().find(|(word, _)| reader.accept(word)).map(|(_, operator)| *operator);
    let Some(operator) = operator else {
        return Err(reader.error(reader.rest, "expected =, *=, /=, += or -="));
    };
    let value = reader.rest.trim();
    if value.is_empty() {
        return Err(reader.error(reader.rest, "expected a value"));
    }
    Ok(Statement { text, path, operator, value, is_only: true })
}

impl Statement<'_> {
    pub(super) fn error(&self, part: &str, reason: impl Into<String>) -> QueryError {
        QueryError::new(self.text, part, reason)
    }

    /// The component of the path: the one that it begins with (which is removed), or the query's.
    pub(super) fn component(&mut self, query: &Query) -> Result<Component, QueryError> {
        // No component has a field with the name of a component.
        let first = self.path[0];
        if let Some((_, component)) = Component::ALL.iter().find(|(name, _)| *name == first) {
            self.path.remove(0);
            return Ok(*component);
        }
        if let Query::Atom(kind, _) = query
            && let Some(component) = Component::of(*kind)
        {
            return Ok(component);
        }
        let known = Component::ALL.map(|(name, _)| name);
        let hint = did_you_mean(first, known);
        Err(self.error(first, format!("expected one of {}{hint}", known.join(", "))))
    }

    /// Changes the settings, which count as one change.
    fn change_settings(&self, world: &mut World, files: &mut dyn AssetFiles) -> Result<usize, QueryError> {
        let whole = |reason: String| self.error(self.path.first().unwrap_or(&self.value), reason);
        // A depth that no file sets stays one.
        let names_depth = self.path.first() == Some(&"max_depth");
        let old = settings_text(world, names_depth).map_err(whole)?;
        let new = self.edited(&old).map_err(|error| self.of_vector(&old).unwrap_or(error))?;
        reread_settings(world, &new, files).map_err(|error| self.of_component(&error, &old))?;
        Ok(1)
    }

    fn change(
        &self,
        world: &mut World,
        target: Target,
        files: &mut dyn AssetFiles,
        names: &mut Names,
    ) -> Result<(), QueryError> {
        let whole = |reason: String| self.error(self.path.first().unwrap_or(&self.value), reason);
        let (component, name) = match target {
            Target::Entity(entity, component) => (component, world.name_of(entity)),
            Target::Material(_) => (Component::Material, "the material".to_owned()),
        };
        let material = match target {
            Target::Material(id) => Some(id),
            Target::Entity(..) => None,
        };
        let entity = match target {
            Target::Entity(entity, _) => Some(entity),
            Target::Material(_) => None,
        };
        let old = match component_text(world, component, entity, material) {
            // A material that is replaced as a whole need not be the entity's only one.
            Err(_) if component == Component::Material && self.path.is_empty() => Some(String::new()),
            old => old.map_err(whole)?,
        };
        let Some(old) = old else {
            return Err(whole(format!("{name} has no {}", component.name())));
        };
        let old = match (component, entity, self.path.first()) {
            (Component::Transform, Some(entity), Some(name)) => {
                let own = world.entities.get::<&Transform>(entity).map(|own| *own).unwrap_or_default();
                rotation::in_parts(old, &own, name).map_err(whole)?
            }
            _ => old,
        };
        let new = match self.edited(&old) {
            Ok(new) => new,
            Err(error) if self.operator == Operator::Set => return Err(error),
            Err(error) => {
                if let Some(error) = self.of_vector(&old) {
                    return Err(error);
                }
                return Err(self.not_there(
                    world,
                    (component, entity, material),
                    &old,
                    (files, names),
                    error,
                ));
            }
        };
        reread(world, component, (entity, material), &new, files, names)
            .map_err(|error| self.of_component(&error, &old))
    }

    /// The error of the scene file reader about a component whose text was `old`.
    fn of_component(&self, error: &LoadError, old: &str) -> QueryError {
        let field = self.path.iter().rev().nth(1).copied().unwrap_or_default();
        let is_known = !error.to_string().contains(&format!("unknown field \"{field}\""));
        self.of_vector(old).filter(|_| is_known).unwrap_or_else(|| self.explained(error))
    }

    /// The error for a component of a vector.
    fn of_vector(&self, old: &str) -> Option<QueryError> {
        let reason = self.vector_component(old, self.is_only)?;
        Some(self.error(self.path.last()?, reason))
    }

    /// The component's text with the new value.
    pub(super) fn edited(&self, old: &str) -> Result<String, QueryError> {
        if self.path.is_empty() {
            return Ok(self.value.to_owned());
        }
        let (tree, mut body) = (BracketTree::new(old), old);
        for (depth, name) in self.path.iter().enumerate() {
            let (form, rest) = scan::split_identifier(body);
            let brackets = scan::skip_blank(rest);
            if form == "Image"
                && let Some(opened) = with_keys_of_image(old, body, &mut tree.values(old, brackets))
            {
                return self.edited(&opened);
            }
            let found = tree.values(old, brackets).find_map(|item| {
                scan::key_and_value(item).filter(|(key, _)| key == name).map(|(_, value)| value)
            });
            let is_last = depth + 1 == self.path.len();
            match found {
                Some(value) if is_last => {
                    let start = scan::offset_of(old, value).unwrap_or(0);
                    let value = scan::without_trailing_blanks(value);
                    let new = self.combined(value)?;
                    return Ok(format!("{}{new}{}", &old[..start], &old[start + value.len()..]));
                }
                Some(value) => body = value,
                None if self.operator == Operator::Set || (is_last && default_of(name).is_some()) => {
                    // Values at their defaults are not written, nor are structures of such values.
                    let new = self.combined(default_of(name).unwrap_or_default())?;
                    let inner = self.path[depth + 1..].iter().rev();
                    let new = inner.fold(new, |value, key| format!("({key}: {value})"));
                    let new = if is_last { new } else { format!("{}{new}", default_form(name)) };
                    let at = scan::offset_of(old, brackets).filter(|_| brackets.starts_with('('));
                    let Some(at) = at else { return Ok(format!("{old}({name}: {new})")) };
                    return Ok(format!("{}{name}: {new}, {}", &old[..=at], &old[at + 1..]));
                }
                None => {
                    let keys: Vec<&str> = tree
                        .values(old, brackets)
                        .filter_map(|item| scan::key_and_value(item).map(|(key, _)| key))
                        .collect();
                    let hint = did_you_mean(name, keys.iter().copied());
                    let reason =
                        format!("\"{name}\" is not set here{hint}, so it has its default: set it with =");
                    return Err(self.error(name, reason));
                }
            }
        }
        Ok(self.value.to_owned())
    }

    /// The error for changing a value that is not written: its name is unknown, or it has its default.
    fn not_there(
        &self,
        world: &mut World,
        (component, entity, material): (Component, Option<Entity>, Option<MaterialId>),
        old: &str,
        (files, names): (&mut dyn AssetFiles, &mut Names),
        error: QueryError,
    ) -> QueryError {
        let set = Statement { operator: Operator::Set, path: self.path.clone(), ..*self };
        let read =
            set.edited(old).map(|new| reread(world, component, (entity, material), &new, files, names));
        match read {
            Ok(Err(unknown)) if unknown.to_string().contains("unknown") => self.explained(&unknown),
            _ => error,
        }
    }

    /// The error for one of the targets, which it names if there are several and it lacks the field.
    fn failed(&self, world: &World, of: (&[Target], Target), query: &str, error: QueryError) -> QueryError {
        let entity = |target: &Target| match target {
            Target::Entity(entity, _) => Some(*entity),
            Target::Material(_) => None,
        };
        match of.1 {
            _ if self.is_only || !error.reason.starts_with("unknown field") => error,
            Target::Material(id) => error.about(&world.assets.material_name(id)),
            Target::Entity(one, component) => {
                let all: Vec<Entity> = of.0.iter().filter_map(entity).collect();
                let lacking = self.lacking(world, (&all, component), one, query);
                lacking.unwrap_or_else(|| error.about(&world.name_of(one)))
            }
        }
    }

    /// The new value; the operators change tuples of numbers, such as colours, by component.
    fn combined(&self, old: &str) -> Result<String, QueryError> {
        if self.operator == Operator::Set {
            return Ok(self.value.to_owned());
        }
        let numbers = |text: &str| -> Option<Vec<f64>> {
            match text.starts_with('(') {
                true => {
                    BracketTree::new(text).values(text, text).map(|item| item.trim().parse().ok()).collect()
                }
                false => Some(vec![text.trim().parse().ok()?]),
            }
        };
        let Some(old) = numbers(old) else {
            return Err(self.error(self.value, "this changes numbers, and what is there is none: use ="));
        };
        let Some(by) = numbers(self.value).filter(|by| by.len() == 1 || by.len() == old.len()) else {
            let reason =
                format!("expected a number{}", if old.len() > 1 { ", or as many as there are" } else { "" });
            return Err(self.error(self.value, reason));
        };
        let combine = |(old, by): (&f64, &f64)| match self.operator {
            Operator::Times => old * by,
            Operator::Over => old / by,
            Operator::Plus => old + by,
            Operator::Minus => old - by,
            Operator::Set => *by,
        };
        let new: Vec<f64> = old.iter().zip(by.iter().cycle()).map(combine).collect();
        if new.iter().any(|number| !number.is_finite()) {
            return Err(self.error(self.value, "that leaves no number"));
        }
        // Rounded to f32, the precision of scene files; whole numbers, such as counts, stay exact.
        let is_whole = |number: &f64| number.fract() == 0.0 && number.abs() < 9e15;
        let text = |number: &f64| match is_whole(number) {
            true => format!("{number}"),
            false => format!("{}", *number as f32),
        };
        let texts: Vec<String> = new.iter().map(text).collect();
        Ok(if texts.len() == 1 { texts[0].clone() } else { format!("({})", texts.join(", ")) })
    }

    /// Maps an error of the scene file reader to its place in the statement.
    fn explained(&self, error: &LoadError) -> QueryError {
        let (part, reason) = match error {
            LoadError::At { reason, .. } if reason.contains("unknown field") => {
                let name = self.path.iter().find(|name| reason.contains(&format!("\"{name}\"")));
                (*name.or(self.path.last()).unwrap_or(&self.value), reason.clone())
            }
            LoadError::At { reason, .. } => (self.value, reason.clone()),
            other => (self.value, other.to_string()),
        };
        self.error(part, reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ron::tests::{Fake, read};

    fn balls(count: usize) -> World {
        let ball = |i| format!("(name: \"ball {i}\", shape: Sphere(radius_m: 1), material: \"red\"),");
        let balls: String = (0..count).map(ball).collect();
        read(&format!("(materials: {{ \"red\": (diffuse: 0.5) }}, entities: [{balls}])")).unwrap()
    }

    #[test]
    fn entities_selected_by_name_are_found_without_a_search() {
        let mut world = balls(300);
        let mut changes = EditRunner::new(&world);
        for i in 0..300 {
            for query in [format!("\"ball {i}\".shape"), format!("(Sphere & \"ball {i}\").shape")] {
                let statement = format!("{query}.radius_m *= 2");
                assert_eq!(changes.carry_out(&mut world, &statement, &mut Fake::default()).unwrap(), 1);
            }
        }
        assert_eq!(changes.index.looked_at, 600, "one for each");
        let radius = |shape: &crate::world::Shape| *shape == crate::world::Shape::Sphere { radius_m: 4.0 };
        assert!(world.entities.query::<&crate::world::Shape>().iter().all(radius));
    }

    #[test]
    fn too_many_changes_and_searches_are_refused() {
        let mut world = balls(10);
        let mut changes = EditRunner::new(&world);
        changes.changed = FEW_CHANGES + MOST_CHANGES * 12 - 15;
        let statement = "Sphere.radius_m *= 1";
        assert_eq!(changes.carry_out(&mut world, statement, &mut Fake::default()).unwrap(), 10);
        let error = changes.carry_out(&mut world, statement, &mut Fake::default()).unwrap_err().to_string();
        assert!(
            error.contains("combine statements") && error.contains("12 entities and materials"),
            "{error}"
        );
        // Tests of entities are limited, too.
        let mut changes = EditRunner::new(&world);
        changes.index.looked_at = LOOKS * (FEW_CHANGES + MOST_CHANGES * 12);
        assert!(
            changes.carry_out(&mut world, "\"ball 1*\".shape.radius_m *= 1", &mut Fake::default()).is_err()
        );
    }

    #[test]
    fn materials_set_by_statements_are_known_to_the_next_ones() {
        let mut world = balls(2);
        let mut changes = EditRunner::new(&world);
        for statement in [
            "\"ball 0\".material.diffuse = 0.1", "\"ball 0\".material = \"red\"",
            "Material[\"red\"].diffuse = 0.2", "\"ball 1\".material = (diffuse: 0.3)",
            "Shape.material = \"red\"",
        ] {
            changes.carry_out(&mut world, statement, &mut Fake::default()).unwrap();
        }
        assert!(world.warnings.is_empty(), "{:?}", world.warnings);
        changes.carry_out(&mut world, "Shape.material = (diffuse: 0.4)", &mut Fake::default()).unwrap();
        changes.carry_out(&mut world, "Material[\"red\"].diffuse = 0.2", &mut Fake::default()).unwrap();
        assert!(world.warnings[0].code == "set-without-effect", "{:?}", world.warnings);
    }
}
