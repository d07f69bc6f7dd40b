//! The text of a scene, and errors with line and column.
//!
//! Each text is checked, and the spans of its values are found, in one pass ([`plain`](super::plain)); `ron` checks texts
//! with rare forms or errors. Values are [`Raw`]: slices of one of the scene's texts. Every error can thus be located by
//! the slice of its value, and `ron` need not parse nested values twice, as it would with its own raw values.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use ron::error::SpannedError;
use ron::extensions::Extensions;
use serde::de::{Deserialize, DeserializeOwned, IgnoredAny};

use super::keyframes::Clock;
use super::parts::TextPart;
use super::variables::without_variables;
use super::{plain, scan, slips};
use crate::error::{LoadError, did_you_mean, in_one_line, meant};
use crate::formats::elsewhere;

/// The number of faults after which reading stops.
const MOST_FAULTS: usize = 20;

/// A value's text as in the file, without leading blanks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raw<'a>(pub &'a str);

/// An enum variant: `Sphere(radius_m: 1)` or `Clamp`.
#[derive(Clone, Copy, Debug)]
pub(super) struct VariantText<'a> {
    /// The name, `Sphere`.
    pub name: &'a str,
    /// The parentheses with their content, `(radius_m: 1)`, if any.
    pub body: Option<&'a str>,
}

/// The texts of a scene, and the time at which it is read.
pub(super) struct SceneText<'a> {
    /// The scene's own text, and then all others.
    pub(super) parts: &'a [TextPart<'a>],
    /// The address and number of each text, in the order of the addresses.
    addresses: Vec<(usize, usize)>,
    /// The number of the text that was needed last.
    last: Cell<usize>,
    options: ron::Options,
    clock: Clock,
    /// True while faults are collected.
    collects: Cell<bool>,
    /// The faults found up to now, if they are collected.
    pub(super) faults: RefCell<Vec<LoadError>>,
    /// The values of variables with their last uses, by their addresses.
    pub(super) uses: RefCell<BTreeMap<usize, (&'a str, &'a str)>>,
}

impl<'a> SceneText<'a> {
    /// Creates the source of a scene that is read at time `time_s`, in seconds. There must be a text.
    pub(super) fn new(parts: &'a [TextPart<'a>], time_s: f32) -> Self {
        let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
        let mut addresses: Vec<(usize, usize)> =
            parts.iter().enumerate().map(|(number, part)| (part.text.as_ptr().addr(), number)).collect();
        addresses.sort_unstable();
        Self {
            parts,
            addresses,
            last: Cell::new(0),
            options,
            clock: Clock { time_s, ..Clock::default() },
            collects: Cell::new(false),
            faults: RefCell::default(),
            uses: RefCell::default(),
        }
    }

    /// The number of the text that `place` is a slice of; 0 if it is a slice of none.
    pub(super) fn part_of(&self, place: &str) -> usize {
        let has = |number: usize| scan::offset_of(&self.parts[number].text, place).is_some();
        if self.parts.len() > 1 && !has(self.last.get()) {
            let before = self.addresses.partition_point(|(start, _)| *start <= place.as_ptr().addr());
            let found = before.checked_sub(1).map(|before| self.addresses[before].1);
            self.last.set(found.filter(|number| has(*number)).unwrap_or(0));
        }
        self.last.get()
    }

    /// The file that `place` is written in.
    pub(super) fn file(&self, place: Raw) -> &'a Arc<Path> {
        &self.parts[self.part_of(place.0)].path
    }

    /// The folder that a path written at `place` is relative to.
    pub(super) fn folder(&self, place: Raw) -> &'a Path {
        self.file(place).parent().unwrap_or(Path::new(""))
    }

    /// Collects faults from here on: see [`SceneText::recover`].
    pub(super) fn collect_faults(&self) {
        self.collects.set(true);
    }

    /// Returns a value; none if it has a fault, while faults are collected. Errors: a fault if they are not, one that has
    /// no place, and one after the many that an author wants to read at once.
    pub(super) fn recover<T>(&self, value: Result<T, LoadError>) -> Result<Option<T>, LoadError> {
        match value {
            Ok(value) => Ok(Some(value)),
            Err(error @ LoadError::At { .. }) if self.collects.get() => {
                let mut faults = self.faults.borrow_mut();
                faults.push(error);
                if faults.len() < MOST_FAULTS { Ok(None) } else { Err(self.faults_of(&mut faults)) }
            }
            Err(error) => Err(error),
        }
    }

    /// The number of faults collected up to now.
    pub(super) fn fault_count(&self) -> usize {
        self.faults.borrow().len()
    }

    /// True if faults were collected.
    pub(super) fn has_faults(&self) -> bool {
        !self.faults.borrow().is_empty()
    }

    /// Errors: all faults that were collected.
    pub(super) fn check_faults(&self) -> Result<(), LoadError> {
        let mut faults = self.faults.borrow_mut();
        if faults.is_empty() { Ok(()) } else { Err(self.faults_of(&mut faults)) }
    }

    fn faults_of(&self, faults: &mut Vec<LoadError>) -> LoadError {
        let mut faults = std::mem::take(faults);
        let number = |file: &Path| self.parts.iter().position(|part| *part.path == *file);
        faults.sort_by_cached_key(|fault| match fault {
            LoadError::At { file, line, column, .. } => (number(file), *line, *column),
            _ => (None, 0, 0),
        });
        // A file that is included several times has each fault once.
        faults.dedup_by_key(|fault| fault.to_string());
        match faults.len() {
            1 => faults.swap_remove(0),
            _ => LoadError::Several(faults),
        }
    }

    /// The time at which keyed values are evaluated.
    pub(super) fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The scene's own file as one value, after checking that it is well formed.
    pub(super) fn root(&self) -> Result<Raw<'a>, LoadError> {
        self.root_of(0)
    }

    /// The text with a number as one value, after checking that it is well formed.
    pub(super) fn root_of(&self, number: usize) -> Result<Raw<'a>, LoadError> {
        let part = &self.parts[number];
        if let Some(start) = part.root.get() {
            return Ok(Raw(&part.text[*start..]));
        }
        match plain::tree(&part.text) {
            Some(tree) => drop(part.tree.set(tree)),
            None => self
                .options
                .from_str::<IgnoredAny>(&without_variables(&part.text))
                .map_err(|error| self.syntax_error(&part.text, &error))
                .map(drop)?,
        }
        let mut rest = scan::skip_blank(&part.text);
        // Skips attributes, such as #![enable(implicit_some)].
        while rest.starts_with('#') {
            let Some(bracket) = rest.find('[') else { break };
            rest = scan::skip_blank(self.after_brackets(&rest[bracket..]));
        }
        let _ = part.root.set(part.text.len() - rest.len());
        Ok(Raw(rest))
    }

    /// The values between the brackets that a slice of a text begins with.
    pub(super) fn values(&self, bracketed: &str) -> impl ExactSizeIterator<Item = &'a str> {
        let part = &self.parts[self.part_of(bracketed)];
        part.tree().values(&part.text, bracketed).map(|value| self.resolve(value))
    }

    /// The text after the brackets that a slice of a text begins with.
    pub(super) fn after_brackets(&self, bracketed: &'a str) -> &'a str {
        let part = &self.parts[self.part_of(bracketed)];
        part.tree().after(&part.text, bracketed).unwrap_or(bracketed)
    }

    /// The line and column of `place`, a slice of a text, both from 1, the column in characters.
    pub(super) fn position(&self, place: &str) -> (usize, usize) {
        self.parts[self.part_of(place)].position(place)
    }

    /// The place of a value, for a message in which `near` is the place: without the file if that is the same.
    pub(super) fn place(&self, value: Raw, near: Raw) -> String {
        let (line, column) = self.position(value.0);
        match self.part_of(value.0) == self.part_of(near.0) {
            true => format!("{line}:{column}"),
            false => format!("{}:{line}:{column}", self.file(value).display()),
        }
    }

    /// An error at `place`, a slice of a text.
    pub(super) fn error(&self, place: &str, reason: impl Into<String>) -> LoadError {
        let part = &self.parts[self.part_of(place)];
        let reason = format!("{}{}", reason.into(), self.used_at(place));
        if let Some(name) = &part.option {
            return LoadError::option(
                "var",
                in_one_line(&format!("{name}={}: {reason}", shorten(&part.text))),
            );
        }
        let (line, column) = part.position(place);
        LoadError::At { file: part.path.to_path_buf(), line, column, reason }
    }

    /// The error for a file that is named by `raw` and could not be read.
    pub(super) fn nested(&self, raw: Raw<'a>, error: LoadError) -> LoadError {
        let (line, column) = self.position(raw.0);
        match error {
            LoadError::TooLarge { .. } => {
                LoadError::too_large(self.file(raw), format!("{line}:{column}: {error}"))
            }
            _ => self.error(raw.0, error.to_string()),
        }
    }

    /// Parses `raw` with `ron`; none if that fails.
    pub(super) fn try_read<T: Deserialize<'a>>(&self, raw: Raw<'a>) -> Option<T> {
        self.options.from_str(raw.0).ok()
    }

    /// The keys and values of the structure `raw`, which must begin with a parenthesis.
    pub(super) fn structure(&self, raw: Raw<'a>, what: &str) -> Result<Vec<(&'a str, Raw<'a>)>, LoadError> {
        if !raw.0.starts_with('(') {
            return Err(self.expected(raw, &format!("{what}, as (key: value, …)")));
        }
        self.members(raw.0, what)
    }

    /// The values of the structure `raw` by their keys, the first `required` of which must be given.
    pub(super) fn keys<const N: usize>(
        &self,
        raw: Raw<'a>,
        what: &str,
        required: usize,
        names: [&str; N],
    ) -> Result<[Option<Raw<'a>>; N], LoadError> {
        self.by_key(&self.structure(raw, what)?, (what, raw.0), required, names)
    }

    /// The values of a variant by their keys, like [`SceneText::keys`]; without parentheses it has none.
    pub(super) fn variant_keys<const N: usize>(
        &self,
        variant: VariantText<'a>,
        required: usize,
        names: [&str; N],
    ) -> Result<[Option<Raw<'a>>; N], LoadError> {
        let members = self.members(variant.body.unwrap_or("()"), variant.name)?;
        self.by_key(&members, (variant.name, variant.name), required, names)
    }

    /// The keys and values of the structure `(key: value, …)`; messages call it `what`.
    pub(super) fn members(&self, body: &'a str, what: &str) -> Result<Vec<(&'a str, Raw<'a>)>, LoadError> {
        let items = self.values(body);
        let mut members = Vec::with_capacity(items.len());
        for item in items {
            let (name, rest) = scan::split_identifier(item);
            let value = scan::skip_blank(rest).strip_prefix(':').map(scan::skip_blank);
            let Some(value) = value.filter(|_| !name.is_empty()) else {
                let reason = format!("{what} wants every value with its name, as (key: value, …)");
                return Err(self.error(item, reason));
            };
            members.push((name, Raw(self.resolve(value))));
        }
        Ok(members)
    }

    /// The error for a key that is none of `known`, in a structure that messages call `what`.
    pub(super) fn unknown_field(&self, key: &str, what: &str, known: &[&str]) -> LoadError {
        let suggestion = suggest(key, known.iter().copied());
        let (found, known) = (shorten(key), known.join(", "));
        self.error(key, format!("unknown field \"{found}\" in {what}{suggestion}; fields: {known}"))
    }

    fn by_key<const N: usize>(
        &self,
        members: &[(&'a str, Raw<'a>)],
        (what, place): (&str, &str),
        required: usize,
        names: [&str; N],
    ) -> Result<[Option<Raw<'a>>; N], LoadError> {
        let (mut given, mut found) = ([false; N], [None; N]);
        for (key, raw) in members {
            let Some(index) = names.iter().position(|name| name == key) else {
                return Err(self.unknown_field(key, what, &names));
            };
            if std::mem::replace(&mut given[index], true) {
                return Err(self.error(key, format!("{what} has the field \"{key}\" twice")));
            }
            found[index] = self.optional(*raw);
        }
        match found.iter().take(required).position(Option::is_none) {
            Some(missing) => Err(self.error(place, format!("{what} needs the field \"{}\"", names[missing]))),
            None => Ok(found),
        }
    }

    /// Returns an error if a variant without fields has something in its parentheses.
    pub(super) fn no_fields(&self, variant: VariantText<'a>) -> Result<(), LoadError> {
        match variant.body.map(|body| scan::skip_blank(body.trim_start_matches('('))) {
            Some(inside) if !inside.starts_with(')') => {
                Err(self.error(inside, format!("{} has no fields", variant.name)))
            }
            _ => Ok(()),
        }
    }

    /// Splits `Name(…)` or `Name`; none if `raw` does not begin with a name.
    pub(super) fn variant(&self, raw: Raw<'a>) -> Option<VariantText<'a>> {
        let (name, rest) = scan::split_identifier(raw.0);
        if name.is_empty()
            || matches!(name, "inf" | "NaN" | "true" | "false")
            || rest.starts_with(['"', '\''])
        {
            return None;
        }
        let rest = scan::skip_blank(rest);
        Some(VariantText { name, body: rest.starts_with('(').then_some(rest) })
    }

    /// The error for a value of the wrong form.
    pub(super) fn expected(&self, raw: Raw, expected: &str) -> LoadError {
        self.error(raw.0, format!("expected {expected}, found {}", describe(raw)))
    }

    /// The error for a `name` that is none of `known`: `unknown shape "Shere" (did you mean "Sphere"?); shapes: …`.
    pub(super) fn unknown(&self, name: &str, kind: &str, known: &[&str]) -> LoadError {
        let suggestion = suggest(name, known.iter().copied());
        let known = known.join(", ");
        self.error(name, format!("unknown {kind} \"{}\"{suggestion}; {kind}s: {known}", shorten(name)))
    }

    /// The whole file as a value of another kind, after checking that it is well formed.
    pub(super) fn whole_value<T: DeserializeOwned>(&self) -> Result<T, LoadError> {
        use ron::Error;
        let text: &str = &self.parts[0].text;
        self.options.from_str(text).map_err(|error| {
            let start = error.span.start;
            let place = &text[scan::offset(text, start.line, start.col)..];
            let list =
                |known: &[&str], found: &str| (suggest(found, known.iter().copied()), known.join(", "));
            let name = |outer: &Option<String>| outer.clone().unwrap_or_else(|| "this".to_owned());
            let reason = match &error.code {
                Error::NoSuchStructField { expected, found, outer } => {
                    let (hint, known) = list(expected, found);
                    let (found, outer) = (shorten(found), name(outer));
                    format!("unknown field \"{found}\" in {outer}{hint}; fields: {known}")
                }
                Error::NoSuchEnumVariant { expected, found, outer } => {
                    let (hint, known) = list(expected, found);
                    let (found, outer) = (shorten(found), name(outer));
                    format!("unknown {outer} \"{found}\"{hint}; expected one of {known}")
                }
                Error::MissingStructField { field, outer } => {
                    format!("{} needs the field \"{field}\"", name(outer))
                }
                Error::DuplicateStructField { field, outer } => {
                    format!("{} has the field \"{field}\" twice", name(outer))
                }
                other => format!("{other}, found {}", describe(Raw(scan::skip_blank(place)))),
            };
            self.error(place, reason)
        })
    }

    /// Translates a syntax error of `ron` into an error with our wording and position.
    fn syntax_error(&self, text: &'a str, error: &SpannedError) -> LoadError {
        use ron::Error;
        let code = &error.code;
        let stop = &text[scan::offset(text, error.span.end.line, error.span.end.col)..];
        let unclosed = scan::find_unclosed(text);
        // An error at the end of the file is better reported where the bracket was opened.
        let at_end = scan::skip_blank(stop).is_empty();
        if let Some(unclosed) = &unclosed
            && (at_end || matches!(unclosed.what, "string" | "comment"))
        {
            return self.error(&text[unclosed.offset..], format!("this {} is never closed", unclosed.what));
        }
        if let Some(advice) = self.color_of_option(text) {
            return self.error(text, advice);
        }
        let stop = scan::skip_blank(stop);
        let found = match stop.chars().next() {
            None => "the end".to_owned(),
            Some('"') => "a string".to_owned(),
            Some(c) => format!("\"{}\"", c.escape_debug()),
        };
        let before = &text[..scan::offset_of(text, stop).unwrap_or_default()];
        if let Some(advice) = slips::advice(code, before, stop) {
            return self.error(stop, advice);
        }
        let mut reason = match code {
            Error::Eof => "the file ends too early".to_owned(),
            Error::ExpectedComma => format!("expected a comma or a closing bracket, found {found}"),
            Error::ExpectedMapColon => format!("expected a colon after the key, found {found}"),
            Error::ExpectedIdentifier | Error::SuggestRawIdentifier(_) => {
                format!("expected the name of a field, found {found}")
            }
            Error::ExpectedFloat
            | Error::ExpectedInteger
            | Error::FloatUnderscore
            | Error::UnderscoreAtBeginning
            | Error::IntegerOutOfBounds
            | Error::InvalidIntegerDigit { .. } => "this is not a number".to_owned(),
            Error::UnexpectedChar(c) => format!("expected a value, found \"{}\"", c.escape_debug()),
            Error::TrailingCharacters => {
                let is_value = self.parts[self.part_of(text)].option.is_some();
                let whole = if is_value { "value" } else { "scene" };
                format!("expected the end of the {whole}, found {found}")
            }
            Error::ExceededRecursionLimit => "values are nested too deeply".to_owned(),
            other => format!("this is not RON: {other}"),
        };
        if let Some(unclosed) = unclosed {
            let (line, column) = self.position(&text[unclosed.offset..]);
            reason.push_str(&format!("; {} of {line}:{column} is not closed", unclosed.what));
        }
        self.error(stop, reason)
    }
}

/// A short description of a value, for messages.
pub(super) fn describe(raw: Raw) -> String {
    let text = raw.0;
    let (name, rest) = scan::split_identifier(text);
    let after_name = scan::skip_blank(rest);
    match text.chars().next() {
        Some('(') => {
            let (key, rest) = scan::split_identifier(scan::skip_blank(&text[1..]));
            if !key.is_empty() && scan::skip_blank(rest).starts_with(':') {
                format!("a structure ({}: …)", shorten(key))
            } else {
                format!("the tuple {}", shorten(text))
            }
        }
        Some('[') => "a list […]".to_owned(),
        Some('{') => "a map {…}".to_owned(),
        Some('"') => format!("the string {}", shorten(text)),
        _ if !name.is_empty() && after_name.starts_with('(') => format!("{}(…)", shorten(name)),
        _ if !name.is_empty() => shorten(name),
        _ => shorten(text.trim_end()),
    }
}

/// The first line of `text`, cut to 48 characters.
pub(super) fn shorten(text: &str) -> String {
    const LONGEST: usize = 48;
    let line = text.lines().next().unwrap_or_default().trim_end();
    let mut short: String = line.chars().take(LONGEST).collect();
    if short.len() < line.len() || line.len() < text.trim_end().len() {
        short.push('…');
    }
    short
}

/// A hint for an unknown name: advice, a similar name, or our word for that of other programs. Names of more than 64
/// bytes are left out, since [`did_you_mean`] takes time and memory proportional to the product of two names' lengths.
pub(super) fn suggest<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> String {
    const LONGEST: usize = 64;
    if name.len() > LONGEST {
        return String::new();
    }
    let known: Vec<&str> = known.into_iter().filter(|known| known.len() <= LONGEST).collect();
    if let Some(advice) = elsewhere::advice(name, &known) {
        return format!(" ({advice})");
    }
    // Names of colours stand where colours or textures may.
    let is_color = known.contains(&"Image") || known.contains(&"Srgb");
    if let Some(color) = elsewhere::color_advice(name).filter(|_| is_color) {
        return format!(" (write {color})");
    }
    let near = did_you_mean(name, known.iter().copied());
    match elsewhere::same_field(name, &known) {
        Some(ours) if near.is_empty() => meant(ours),
        _ => near,
    }
}
