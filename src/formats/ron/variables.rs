//! Variables: `$name` stands for the value that `variables` or the caller gives. Every use is checked before any value is
//! converted; from then on a use is replaced by the slice of its value wherever a value is taken from the text.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};

use super::parts::TextSpan;
use super::scan::{self, BracketToken, skip_blank, split_identifier, token};
use super::source::{SceneText, shorten, suggest};
use crate::error::LoadError;

/// The largest depth to which variables stand in the values of variables.
const DEEPEST: usize = 64;
/// The largest number of brackets around a value, with those around the use of its variable: as `ron` allows in a text.
const MOST_NESTED: usize = 128;
/// The largest size of all values that a file's variables stand for, in bytes.
const MOST_BYTES: u64 = 1 << 28;

/// The size and the nesting of values by their addresses.
type Sizes = HashMap<usize, Option<(u64, usize)>>;

/// True if a text can be the name of a variable.
pub(super) fn is_name(text: &str) -> bool {
    !text.starts_with("r#") && split_identifier(text) == (text, "") && !text.is_empty()
}

/// The name of the variable that `usage` begins with.
fn name_of(usage: &str) -> &str {
    split_identifier(usage.strip_prefix('$').unwrap_or(usage)).0
}

/// The uses of variables in a text: slices that begin with `$name`, and the number of brackets around each.
fn uses(text: &str) -> impl Iterator<Item = (&str, usize)> {
    let mut rest = if text.contains('$') { text } else { "" };
    let mut depth = 0_usize;
    std::iter::from_fn(move || {
        while !rest.is_empty() {
            let (found, length) = token(rest);
            let (at, after) = (rest, &rest[length..]);
            rest = after;
            depth = depth_after(depth, &found);
            if at.starts_with('$') && !name_of(at).is_empty() {
                return Some((at, depth));
            }
        }
        None
    })
}

fn depth_after(depth: usize, token: &BracketToken) -> usize {
    match token {
        BracketToken::Open(_) => depth + 1,
        BracketToken::Close(_) => depth.saturating_sub(1),
        _ => depth,
    }
}

/// The largest number of brackets around anything in a text.
fn nesting(mut text: &str) -> usize {
    let (mut depth, mut most) = (0, 0);
    while !text.is_empty() {
        let (found, length) = token(text);
        depth = depth_after(depth, &found);
        most = most.max(depth);
        text = &text[length..];
    }
    most
}

/// The text with a blank in place of each `$`, for a parser of RON: no place changes.
pub(super) fn without_variables(text: &str) -> Cow<'_, str> {
    let mut plain = Cow::Borrowed(text);
    for (usage, _) in uses(text) {
        let at = scan::offset_of(text, usage).unwrap_or(0);
        plain.to_mut().replace_range(at..=at, " ");
    }
    plain
}

impl<'a> SceneText<'a> {
    /// The span of a slice of one of the texts.
    pub(super) fn span(&self, place: &str) -> TextSpan {
        let part = self.part_of(place);
        let start = scan::offset_of(&self.parts[part].text, place).unwrap_or(0);
        TextSpan { part, bytes: [start, start + place.len()] }
    }

    /// The slice of a span.
    pub(super) fn slice(&self, TextSpan { part, bytes: [start, end] }: TextSpan) -> &'a str {
        &self.parts[part].text[start..end]
    }

    /// The value of a variable in a text: what the entry of `include` gives, or else the including file and the caller,
    /// or else the text itself.
    fn variable(&self, part: usize, name: &str) -> Option<&'a str> {
        let this = &self.parts[part];
        let outer = match (&this.inclusion, &this.option) {
            (Some(inclusion), _) => match inclusion.given.get(name) {
                Some(given) => return Some(self.slice(*given)),
                None => self.variable(inclusion.by, name),
            },
            (None, Some(_)) => return self.variable(0, name),
            (None, None) => {
                let mut options = self.parts.iter().skip(1).take_while(|part| part.option.is_some());
                let given = options.find(|part| part.option.as_deref() == Some(name));
                given.map(|part| skip_blank(&part.text))
            }
        };
        outer.or_else(|| Some(self.slice(*this.variables.get()?.get(name)?)))
    }

    /// A value; that of its variable if `value` begins with the use of one.
    pub(super) fn resolve(&self, value: &'a str) -> &'a str {
        let mut found = value;
        for _ in 0..DEEPEST {
            if !found.starts_with('$') {
                break;
            }
            let Some(next) = self.variable(self.part_of(found), name_of(found)) else { break };
            self.uses.borrow_mut().insert(next.as_ptr().addr(), (next, value));
            found = next;
        }
        found
    }

    /// The last use of the variable in whose value `place` lies: ` (for $name at line:column)`.
    pub(super) fn used_at(&self, place: &str) -> String {
        let uses = self.uses.borrow();
        let before = uses.range(..=place.as_ptr().addr()).next_back();
        let Some((value, usage)) =
            before.map(|(_, it)| *it).filter(|(it, _)| scan::offset_of(it, place).is_some())
        else {
            return String::new();
        };
        let (part, (line, column)) = (self.part_of(usage), self.position(usage));
        let file = match part == self.part_of(value) {
            true => String::new(),
            false => format!("{}:", self.parts[part].path.display()),
        };
        format!(" (for ${} at {file}{line}:{column})", name_of(usage))
    }

    /// Checks all uses of variables in the text with a number. Returns the size of their values.
    pub(super) fn check_variables(&self, part: usize) -> Result<u64, LoadError> {
        let mut sizes = HashMap::new();
        let (mut bytes, mut is_circular) = (0_u64, false);
        for (usage, depth) in uses(&self.parts[part].text) {
            let name = name_of(usage);
            let after = skip_blank(&usage[1 + name.len()..]);
            let found = if !after.is_empty() && !after.starts_with([',', ')', ']', '}']) {
                let reason = format!("expected a comma or a closing bracket after ${}", shorten(name));
                Err(self.error(after, reason))
            } else if self.variable(part, name).is_none() {
                Err(self.error(usage, self.unknown_variable(name)))
            } else {
                match self.size_of(usage, 0, &mut sizes) {
                    Some((_, inner)) if depth + inner > MOST_NESTED => {
                        Err(self.error(usage, "values are nested too deeply"))
                    }
                    Some((size, _)) => {
                        bytes = bytes.saturating_add(size);
                        let reason =
                            "the values of the variables up to here have more than 256 MiB: use fewer";
                        if bytes <= MOST_BYTES { Ok(()) } else { return Err(self.error(usage, reason)) }
                    }
                    None if std::mem::replace(&mut is_circular, true) => Ok(()),
                    None => {
                        let reason = format!(
                            "the value of ${name} depends on itself, or on more than {DEEPEST} others in a row"
                        );
                        Err(self.error(usage, reason))
                    }
                }
            };
            self.recover(found)?;
        }
        Ok(bytes)
    }

    /// The size and the nesting of the value of a variable with all variables in it; none if it depends on itself.
    /// `sizes` holds those that are known, and none for those that are being computed.
    fn size_of(&self, usage: &'a str, depth: usize, sizes: &mut Sizes) -> Option<(u64, usize)> {
        let Some(value) = self.variable(self.part_of(usage), name_of(usage)) else { return Some((0, 0)) };
        let place = value.as_ptr().addr();
        if let Some(known) = sizes.get(&place) {
            return *known;
        }
        sizes.insert(place, None);
        let (mut bytes, mut most) = (value.len() as u64, nesting(value));
        for (inner, around) in uses(value) {
            let (size, nested) =
                if depth < DEEPEST { self.size_of(inner, depth + 1, sizes)? } else { return None };
            bytes = bytes.saturating_add(size);
            most = most.max(around + nested);
        }
        sizes.insert(place, Some((bytes, most)));
        Some((bytes, most))
    }

    fn unknown_variable(&self, name: &str) -> String {
        let known = self.known_variables(false);
        let hint = suggest(name, known.iter().map(String::as_str));
        let name = shorten(name);
        format!("unknown variable ${name}{hint}: write variables: {{\"{name}\": …}}, or --var {name}=…")
    }

    /// The names of all variables; with those that are only used, if these count.
    fn known_variables(&self, with_used: bool) -> BTreeSet<String> {
        let mut names = BTreeSet::new();
        for part in self.parts {
            names.extend(part.variables.get().into_iter().flat_map(|it| it.keys().cloned()));
            if with_used {
                names.extend(uses(&part.text).map(|(usage, _)| name_of(usage).to_owned()));
            }
        }
        names
    }

    /// The variables of the caller that files define, but nothing uses.
    pub(super) fn unused_options(&self) -> Vec<String> {
        if !self.parts.iter().any(|part| part.option.is_some()) {
            return Vec::new();
        }
        let used: BTreeSet<&str> =
            self.parts.iter().flat_map(|part| uses(&part.text)).map(|(usage, _)| name_of(usage)).collect();
        let given = self.parts.iter().filter_map(|part| part.option.as_deref());
        given.filter(|name| !used.contains(name)).map(str::to_owned).collect()
    }

    /// Returns an error for a variable of the caller that no file defines or uses.
    pub(super) fn check_options(&self) -> Result<(), LoadError> {
        let known = self.known_variables(true);
        let mut given = self.parts.iter().filter_map(|part| part.option.as_deref());
        given.find(|name| !known.contains(*name)).map_or(Ok(()), |name| {
            let names: Vec<&str> = known.iter().map(String::as_str).collect();
            let known = match names.len() {
                0 => "the scene has no variables".to_owned(),
                _ => format!("variables: {}", shorten(&names.join(", "))),
            };
            let hint = suggest(name, names.iter().copied());
            Err(LoadError::option("var", format!("unknown variable \"{}\"{hint}; {known}", shorten(name))))
        })
    }
}
