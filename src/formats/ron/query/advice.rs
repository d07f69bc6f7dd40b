//! Errors about queries and statements that a reader of the scene can mend: names without quotes, fields of another
//! component, components of vectors.

use super::select::is_named;
use super::set::{Operator, Statement};
use super::{Comparison, FilterKey, Kind, Query, QueryError, QueryReader};
use crate::error::{did_you_mean, in_one_line, words};
use crate::formats::ron::lower::reread::Component;
use crate::formats::ron::scan;
use crate::formats::ron::tree::BracketTree;
use crate::world::fields::{Forms, all_fields};
use crate::world::names::is_same_name;
use crate::world::{Camera, Light, Shape, World};

/// A name in quotes, as in scene files.
fn quoted(name: &str) -> String {
    ron::to_string(name).unwrap_or_default()
}

/// The name of the entity that is called `name`, in whatever case.
fn entity_called(world: &World, name: &str) -> Option<String> {
    let names: Vec<String> = world.in_order().into_iter().map(|entity| world.name_of(entity)).collect();
    closest(names.iter().map(String::as_str), name)
}

/// The name of the material that is called `name`, in whatever case.
fn material_called(world: &World, name: &str) -> Option<String> {
    closest(world.assets.materials.iter().filter_map(|named| named.name.as_deref()), name)
}

fn closest<'n>(names: impl Iterator<Item = &'n str> + Clone, name: &str) -> Option<String> {
    let same = names.clone().find(|found| is_same_name(found, name));
    same.or_else(|| names.clone().find(|found| found.to_lowercase() == name.to_lowercase()))
        .map(str::to_owned)
}

impl QueryError {
    /// Names the one of several entities or materials that has the fault.
    pub(super) fn about(self, name: &str) -> QueryError {
        QueryError { reason: in_one_line(&format!("{}: {}", words(name), self.reason)), ..self }
    }
}

impl QueryReader<'_, '_> {
    /// The error for a query that begins with no kind.
    pub(super) fn unknown_kind(&self) -> QueryError {
        let name = scan::split_identifier(self.rest).0;
        if let Some(reason) = self.variable(name) {
            return self.error(self.rest, reason);
        }
        if self.rest.starts_with('\'') {
            return self.single_quotes();
        }
        // A name may have blanks and dots.
        let whole = self.rest.split(['|', '&', ')', '=', '[', '"']).next().unwrap_or_default().trim();
        let first = whole.split('.').next().unwrap_or_default().trim();
        for part in [whole, first].into_iter().filter(|part| !part.is_empty()) {
            if let Some(reason) = self.unquoted(part) {
                return self.error(part, reason);
            }
        }
        let known: Vec<_> = Kind::all().map(|(known, _)| known).collect();
        let (part, hint) =
            (if name.is_empty() { self.rest } else { name }, did_you_mean(name, known.iter().copied()));
        let reason = format!("expected a query{hint}: a name in quotes, or one of {}", known.join(", "));
        self.error(part, reason)
    }

    /// The error for a name in single quotes.
    pub(super) fn single_quotes(&self) -> QueryError {
        let name = self.rest.strip_prefix('\'').unwrap_or(self.rest).split('\'').next().unwrap_or_default();
        let mark = self.rest.get(..name.len() + 2).unwrap_or(self.rest);
        self.error(mark, format!("names stand in double quotes: {}", quoted(name)))
    }

    /// The advice for a variable, which no statement sets.
    fn variable(&self, name: &str) -> Option<String> {
        let after = match self.rest.strip_prefix('$') {
            Some(after) => after,
            None if name == "variables" => {
                self.rest[name.len()..].trim_start().strip_prefix('.')?.trim_start()
            }
            None => return None,
        };
        let (name, rest) = scan::split_identifier(after);
        let value = rest.trim_start().strip_prefix('=').map_or("…", str::trim);
        let quote = if value.contains('\'') { "" } else { "'" };
        Some(format!("a variable is set by --var {quote}{name}={value}{quote}"))
    }

    /// The advice for `part`, the name of something without its quotes.
    fn unquoted(&self, part: &str) -> Option<String> {
        let world = self.world?;
        let (entity, material) = (entity_called(world, part), material_called(world, part));
        let after = self.rest[scan::offset_of(self.rest, part)? + part.len()..].trim_start();
        let Some(path) = after.strip_prefix('.') else {
            let query = entity.map(|name| quoted(&name));
            let query = query.or_else(|| Some(format!("Shape[material={}]", quoted(&material?))))?;
            let shell = match query.contains('\'') {
                true => String::new(),
                false => format!(", in a shell '{query}'"),
            };
            return Some(format!("names stand in double quotes: did you mean {query}{shell}?"));
        };
        let field = scan::split_identifier(path.trim_start()).0;
        let is_component = Component::ALL.iter().any(|(name, _)| *name == field);
        let owner = |entity: &str| {
            let found = world.in_order().into_iter().find(|id| world.name_of(*id) == entity);
            found.and_then(|id| owner_of(world, id, field))
        };
        let has_itself = |entity: &str| owner(entity).is_some_and(|owner| owner != Component::Material);
        let target = match (entity, material) {
            (entity, Some(material))
                if !is_component && !entity.as_ref().is_some_and(|it| has_itself(it)) =>
            {
                format!("Material[{}].{field}", quoted(&material))
            }
            (Some(entity), _) => {
                let owner = owner(&entity).filter(|_| !is_component);
                let owner = owner.map_or_else(String::new, |owner| format!(".{}", owner.name()));
                format!("{}{owner}.{field}", quoted(&entity))
            }
            (None, Some(material)) => format!("Shape[material={}].{field}", quoted(&material)),
            (None, None) => return None,
        };
        Some(format!("names stand in double quotes: did you mean {target}?"))
    }
}

/// The component of an entity that has a field.
fn owner_of(world: &World, entity: hecs::Entity, field: &str) -> Option<Component> {
    let has = |form: &mut dyn Forms| form.fields().iter().any(|known| known.is_called(field));
    let entities = &world.entities;
    if super::rotation::PARTS.contains(&field) {
        return Some(Component::Transform);
    }
    if entities.get::<&Shape>(entity).is_ok_and(|it| has(&mut (*it).clone())) {
        return Some(Component::Shape);
    }
    if entities.get::<&Light>(entity).is_ok_and(|it| has(&mut (*it).clone())) {
        return Some(Component::Light);
    }
    if entities.get::<&Camera>(entity).is_ok_and(|it| has(&mut (*it).clone())) {
        return Some(Component::Camera);
    }
    entities.get::<&Shape>(entity).ok()?;
    let material = world.assets.materials.get(world.only_material(entity)?.0 as usize)?;
    let mut material = material.material.clone();
    all_fields(material.part()).iter().any(|known| known.is_called(field)).then_some(Component::Material)
}

/// The name of a query that is only a name.
fn only_name(query: &Query) -> Option<&str> {
    match query {
        Query::Atom(Kind::Entity, filters) => match &filters[..] {
            [filter] if filter.key == FilterKey::Name && filter.comparison == Comparison::Equal => {
                Some(&filter.text)
            }
            _ => None,
        },
        _ => None,
    }
}

/// The advice for a name that no entity has, but a material.
pub(super) fn name_of_material(
    world: &World,
    query: &Query,
    statement: Option<&Statement>,
) -> Option<String> {
    let name = only_name(query)?;
    let has_it = |found: &&str| is_same_name(found, name);
    let material =
        quoted(world.assets.materials.iter().filter_map(|named| named.name.as_deref()).find(has_it)?);
    let path = statement.map(|statement| match statement.path[..] {
        ["material", ref fields @ ..] => fields.join("."),
        ref fields if Component::ALL.iter().any(|(name, _)| *name == fields[0]) => String::new(),
        ref fields => fields.join("."),
    });
    Some(match path.filter(|path| !path.is_empty()) {
        Some(path) => format!("a material has this name: write Material[{material}].{path}"),
        None => format!("a material has this name: what has it is Shape[material={material}]"),
    })
}

impl Statement<'_> {
    /// The error for a path that does not begin with a component, with the component that has the field.
    pub(super) fn without_component(
        &self,
        world: &World,
        entities: &[hecs::Entity],
        (query, text): (&Query, &str),
        error: QueryError,
    ) -> QueryError {
        let path = self.path.join(".");
        let owner = entities.iter().find_map(|entity| owner_of(world, *entity, self.path[0]));
        let mut targets: Vec<String> =
            owner.map(|owner| format!("{text}.{}.{path}", owner.name())).into_iter().collect();
        if owner.is_none_or(|owner| owner == Component::Material)
            && let Some(name) = only_name(query)
            && is_named(world, name)
        {
            targets.push(format!("Material[{}].{path}", quoted(name)));
        }
        match targets.is_empty() {
            true => error,
            false => self.error(self.path[0], format!("did you mean {}?", targets.join(", or "))),
        }
    }

    /// The error for a field that some of the selected entities lack: names one of them, and selects the others.
    pub(super) fn lacking(
        &self,
        world: &World,
        (entities, component): (&[hecs::Entity], Component),
        entity: hecs::Entity,
        text: &str,
    ) -> Option<QueryError> {
        let field = *self.path.first()?;
        let index = match component {
            Component::Shape => 0,
            Component::Light => 1,
            Component::Camera => 2,
            Component::Transform | Component::Material => return None,
        };
        let has = |entity: hecs::Entity| owner_of(world, entity, field) == Some(component);
        if has(entity) {
            return None;
        }
        let having = entities.iter().filter(|entity| has(**entity));
        let mut forms: Vec<&str> =
            having.filter_map(|entity| super::select::forms(world, *entity)[index]).collect();
        forms.sort_unstable();
        forms.dedup();
        let own = super::select::forms(world, entity)[index]?;
        let path = self.path.join(".");
        let target = match (&forms[..], Kind::all().any(|(kind, _)| kind == text)) {
            ([], _) => return None,
            ([form], true) => format!("{form}.{path}"),
            (forms, true) => format!("({}).{}.{path}", forms.join(" | "), component.name()),
            ([form], false) if !text.contains(['|', '&']) => {
                format!("({text} & {form}).{}.{path}", component.name())
            }
            (forms, false) => format!("(({text}) & ({})).{}.{path}", forms.join(" | "), component.name()),
        };
        let name = quoted(&world.name_of(entity));
        Some(self.error(field, format!("{name}, a {own}, has no field \"{field}\": write {target}")))
    }

    /// The advice for a component of a vector or a colour (`translate.y`), of which all components are set together.
    /// `old` is the text of the component of the scene before, `is_only` true if no other is changed.
    pub(super) fn vector_component(&self, old: &str, is_only: bool) -> Option<String> {
        let (letter, fields) = self.path.split_last()?;
        let axis = ["x", "y", "z"].iter().chain(&["r", "g", "b"]).position(|name| name == letter)? % 3;
        let field = fields.last()?;
        let mut body = Some(old);
        let tree = BracketTree::new(old);
        for name in fields {
            body = body.and_then(|body| {
                let brackets = scan::skip_blank(scan::split_identifier(body).1);
                let mut found = tree.values(old, brackets).filter_map(scan::key_and_value);
                found.find(|(key, _)| key == name).map(|(_, value)| scan::without_trailing_blanks(value))
            });
        }
        let present = match body.or_else(|| super::set::default_of(field)) {
            Some(text) => text,
            None if *field == "rotate_degrees" => "(0, 0, 0)",
            // A field that no file gives has its default; one that there is none of cannot be changed.
            None if self.operator != Operator::Set => return None,
            None => "",
        };
        let end = scan::offset_of(self.text, letter)?;
        let target = self.text[..end].trim_end().trim_end_matches('.').trim_end();
        let numbers: Vec<f64> = match present.starts_with('(') {
            true => {
                let items = present[1..].trim_end_matches(')').split(',').map(str::trim);
                items.filter(|item| !item.is_empty()).map(|item| item.parse().ok()).collect::<Option<_>>()?
            }
            // One number stands for three in colours and in `scale`.
            false if "rgb".contains(letter) || *field == "scale" => {
                present.parse().map_or_else(|_| Vec::new(), |number| vec![number; 3])
            }
            false if present.parse::<f64>().is_ok() => {
                let Self { operator, value, .. } = self;
                return Some(format!("{field} is one number: write {target} {} {value}", operator.sign()));
            }
            false => Vec::new(),
        };
        let is_text = present.is_empty() || present.starts_with('"');
        if !is_text && numbers.len() <= axis {
            return None;
        }
        let what = format!("{field} has no field \"{letter}\"");
        let by: Option<f64> = self.value.parse().ok();
        let neutral = match self.operator {
            Operator::Times | Operator::Over => 1.0,
            Operator::Plus | Operator::Minus | Operator::Set => 0.0,
        };
        let (sign, mut numbers) = match (by, is_only, self.operator) {
            (Some(_), true, _) if !numbers.is_empty() => ("=", numbers),
            (Some(_), false, operator) if !numbers.is_empty() && operator != Operator::Set => {
                (operator.sign(), vec![neutral; numbers.len()])
            }
            _ => {
                let all = match ("xyz".contains(letter), numbers.len()) {
                    (false, _) => "(r, g, b)",
                    (true, 3) => "(x, y, z)",
                    _ => "(…)",
                };
                return Some(format!("{what}: write {target} = {all}, with all components"));
            }
        };
        let by = by.unwrap_or_default();
        let old = numbers[axis];
        numbers[axis] = match self.operator {
            _ if !is_only => by,
            Operator::Set => by,
            Operator::Times => old * by,
            Operator::Over => old / by,
            Operator::Plus => old + by,
            Operator::Minus => old - by,
        };
        let numbers: Vec<String> = numbers.iter().map(|number| (*number as f32).to_string()).collect();
        Some(format!("{what}: write {target} {sign} ({})", numbers.join(", ")))
    }
}
