//! A query and edit language for scenes: `Light[name~"lamp*"]`, `Mesh & !Material`, `Material["glass"].ior = 1.6`.
//!
//! ```text
//! statement  = ( query | "settings" ) "." path operator value        operator: = *= /= += -=
//! query      = all { "|" all }                      all = one { "&" one }
//! one        = "!" one | "(" query ")" | atom       path: names with dots
//! atom       = Kind [ "[" filters "]" ] | "\"name\""
//! filters    = "\"name\"" | filter { "," filter }   filter = key ( "=" | "!=" | "~" ) "\"text\""
//! ```
//!
//! Kinds are components and their forms, as named in scene files; keys are `name`, `parent` and `material`; after `~`,
//! `*` stands for any text. Values are validated by the reader of scene files, which reads the changed component again.

mod advice;
mod in_text;
mod mix;
mod rotation;
mod select;
mod set;
#[cfg(test)]
mod tests;

use crate::error::{did_you_mean, in_one_line, with_blanks};
use crate::formats::ron::scan::{self, find_unclosed};
use crate::world::{Camera, Light, Shape, World};

pub use in_text::{assignment, with_statements};
pub use mix::mix;
pub use rotation::transform_parts;
pub use select::{Selected, list, select};
pub use set::{EditRunner, no_match, set};

/// An error in a query, with the place marked below its text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}\n  {text}\n  {}{}", " ".repeat(*.column), "^".repeat((*.width).max(1)))]
pub struct QueryError {
    text: String,
    column: usize,
    width: usize,
    reason: String,
}

impl QueryError {
    /// Creates the error at `part`, a slice of `text`.
    fn new(text: &str, part: &str, reason: impl Into<String>) -> QueryError {
        let offset = scan::offset_of(text, part).unwrap_or(text.len());
        let column = text[..offset].chars().count();
        let width = part.trim_end().chars().count();
        QueryError { text: with_blanks(text), column, width, reason: in_one_line(&reason.into()) }
    }
}

/// The kind of entity that an atom selects: one that has a component, or one form of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Every entity.
    Entity,
    /// Entities with a shape.
    Shape,
    /// Entities with a light.
    Light,
    /// Entities with a camera.
    Camera,
    /// Entities with a material of their own; if the query is a single atom with filters, the materials themselves.
    Material,
    /// Entities with a transform.
    Transform,
    /// Entities that place a glTF file.
    Model,
    /// Entities read from a glTF file.
    Placed,
    /// A form of a shape, a light or a camera, by its name.
    Form(&'static str),
}

/// The kinds that are no forms, by their names.
const KINDS: [(&str, Kind); 8] = [
    ("Entity", Kind::Entity),
    ("Shape", Kind::Shape),
    ("Light", Kind::Light),
    ("Camera", Kind::Camera),
    ("Material", Kind::Material),
    ("Transform", Kind::Transform),
    ("Model", Kind::Model),
    ("Placed", Kind::Placed),
];

impl Kind {
    /// All kinds by their names.
    fn all() -> impl Iterator<Item = (&'static str, Kind)> {
        let forms = [Shape::FORMS, Light::FORMS, Camera::FORMS].into_iter().flatten();
        KINDS.into_iter().chain(forms.map(|name| (*name, Kind::Form(name))))
    }
}

/// The property that a filter compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FilterKey {
    Name,
    Parent,
    Material,
}

const KEYS: [(&str, FilterKey); 3] =
    [("name", FilterKey::Name), ("parent", FilterKey::Parent), ("material", FilterKey::Material)];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    Equal,
    Unequal,
    Like,
}

/// A condition on an entity's name, parent or material.
#[derive(Clone, Debug, PartialEq)]
pub struct QueryFilter {
    key: FilterKey,
    comparison: Comparison,
    text: String,
}

/// A selection of parts of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Query {
    /// Entities of a kind that pass every filter.
    Atom(Kind, Vec<QueryFilter>),
    /// Entities that the query does not select.
    Not(Box<Query>),
    /// Entities that both queries select.
    And(Box<Query>, Box<Query>),
    /// Entities that at least one of the queries selects.
    Or(Box<Query>, Box<Query>),
}

impl Query {
    /// Parses a query about a world, which must fill all of `text`. Only messages depend on the world.
    pub fn parse(text: &str, world: &World) -> Result<Query, QueryError> {
        let mut reader = QueryReader { world: Some(world), ..QueryReader::new(text)? };
        let query = reader.either()?;
        match reader.rest.trim_start() {
            "" => Ok(query),
            rest => Err(reader.error(rest, "expected &, | or the end")),
        }
    }
}

/// A parser of queries and statements.
struct QueryReader<'a, 'w> {
    text: &'a str,
    rest: &'a str,
    /// The world whose names messages suggest, if there is one.
    world: Option<&'w World>,
}

impl<'a> QueryReader<'a, '_> {
    fn new(text: &'a str) -> Result<Self, QueryError> {
        if text.len() > LONGEST || text.matches('(').count() > DEEPEST {
            let start: String = text.chars().take(40).collect();
            return Err(QueryError::new(&start, &start, "this is too long for a query"));
        }
        if let Some(open) = find_unclosed(text) {
            return Err(QueryError::new(text, &text[open.offset..], "this is never closed"));
        }
        Ok(Self { text, rest: text, world: None })
    }

    fn error(&self, part: &str, reason: impl Into<String>) -> QueryError {
        QueryError::new(self.text, part, reason)
    }

    /// Consumes `word` if it comes next; returns true if it does.
    fn accept(&mut self, word: &str) -> bool {
        let rest = self.rest.trim_start();
        let found = rest.strip_prefix(word);
        self.rest = found.unwrap_or(rest);
        found.is_some()
    }

    fn either(&mut self) -> Result<Query, QueryError> {
        let mut query = self.both()?;
        while self.accept("|") {
            query = Query::Or(Box::new(query), Box::new(self.both()?));
        }
        Ok(query)
    }

    fn both(&mut self) -> Result<Query, QueryError> {
        let mut query = self.one()?;
        while self.accept("&") {
            query = Query::And(Box::new(query), Box::new(self.one()?));
        }
        Ok(query)
    }

    fn one(&mut self) -> Result<Query, QueryError> {
        // A loop instead of recursion: there may be thousands of these.
        let mut negated = false;
        while self.accept("!") {
            negated = !negated;
        }
        let query = if self.accept("(") {
            let query = self.either()?;
            if !self.accept(")") {
                return Err(self.error(self.rest, "expected )"));
            }
            query
        } else {
            self.atom()?
        };
        Ok(if negated { Query::Not(Box::new(query)) } else { query })
    }

    fn atom(&mut self) -> Result<Query, QueryError> {
        self.rest = self.rest.trim_start();
        if self.rest.starts_with('"') {
            let text = self.string()?;
            return Ok(Query::Atom(Kind::Entity, vec![named(text)]));
        }
        let (name, rest) = scan::split_identifier(self.rest);
        let Some((_, kind)) = Kind::all().find(|(known, _)| *known == name) else {
            return Err(self.unknown_kind());
        };
        self.rest = rest;
        let mut filters = Vec::new();
        if self.accept("[") {
            loop {
                filters.push(self.filter()?);
                if self.accept("]") {
                    break;
                }
                if !self.accept(",") {
                    return Err(self.error(self.rest, "expected , or ]"));
                }
            }
        }
        Ok(Query::Atom(kind, filters))
    }

    fn filter(&mut self) -> Result<QueryFilter, QueryError> {
        self.rest = self.rest.trim_start();
        if self.rest.starts_with('"') {
            return self.string().map(named);
        }
        if self.rest.starts_with('\'') {
            return Err(self.single_quotes());
        }
        let (name, rest) = scan::split_identifier(self.rest);
        let Some((_, key)) = KEYS.iter().find(|(known, _)| *known == name) else {
            let known = KEYS.map(|(known, _)| known);
            let part = if name.is_empty() { self.rest } else { name };
            let hint = did_you_mean(name, known);
            return Err(self.error(part, format!("expected \"a name\" or one of {}{hint}", known.join(", "))));
        };
        self.rest = rest;
        let comparison = if self.accept("!=") {
            Comparison::Unequal
        } else if self.accept("=") {
            Comparison::Equal
        } else if self.accept("~") {
            Comparison::Like
        } else {
            return Err(self.error(self.rest, "expected =, != or ~"));
        };
        let text = self.string()?;
        Ok(QueryFilter { key: *key, comparison, text })
    }

    /// Text in quotes, as in scene files.
    fn string(&mut self) -> Result<String, QueryError> {
        self.rest = self.rest.trim_start();
        let body = self.rest.strip_prefix('"');
        let mut escaped = false;
        let end = body.and_then(|body| {
            body.find(|c: char| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            })
        });
        if self.rest.starts_with('\'') {
            return Err(self.single_quotes());
        }
        let Some(end) = end else { return Err(self.error(self.rest, "expected text in quotes")) };
        let (quoted, rest) = self.rest.split_at(end + 2);
        let text = ron::from_str(quoted).map_err(|error| self.error(quoted, error.code.to_string()))?;
        self.rest = rest;
        Ok(text)
    }
}

/// The maximum length of a query, in bytes: queries are parsed, evaluated and dropped recursively.
const LONGEST: usize = 4096;
/// The maximum number of opening parentheses, for the same reason.
const DEEPEST: usize = 100;

fn named(text: String) -> QueryFilter {
    let comparison = if text.contains('*') { Comparison::Like } else { Comparison::Equal };
    QueryFilter { key: FilterKey::Name, comparison, text }
}

/// Tests if a text matches a pattern in which `*` stands for any text.
fn is_like(text: &str, pattern: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = text.strip_prefix(first) else { return false };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}
