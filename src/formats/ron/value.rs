//! Single values: numbers within their ranges, strings, vectors, choices.

use std::str::FromStr;

use serde::de::Deserialize;

use super::keyframes::Keyed;
use super::scan;
use super::source::{Raw, SceneText, describe};
use crate::error::LoadError;
use crate::math::{DVec3, Vec2, Vec3};

/// The largest magnitude of a body's priority.
const MOST_PRIORITY: f32 = 1000.0;

/// A finite number of the type that it is stored as: parsed once, rounded once.
pub(super) trait FloatValue: Copy + Keyed + Into<f64> + FromStr + for<'de> Deserialize<'de> {
    /// The largest number, for messages.
    const LARGEST: &str;
}

impl FloatValue for f32 {
    const LARGEST: &str = "3.4e38";
}

impl FloatValue for f64 {
    const LARGEST: &str = "1.8e308";
}

impl<'a> SceneText<'a> {
    /// Any finite number.
    pub(super) fn number<F: FloatValue>(&self, raw: Raw<'a>) -> Result<F, LoadError> {
        self.keyed(raw, |raw| self.single_number(raw))
    }

    fn single_number<F: FloatValue>(&self, raw: Raw<'a>) -> Result<F, LoadError> {
        // Reading the number with ron takes ten times as long.
        let text = raw.0.trim_ascii_end();
        let plain = text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'.' | b'-' | b'e'));
        let number = if plain { text.parse().ok() } else { None };
        let Some(number) = number.or_else(|| self.try_read::<F>(raw)) else {
            return Err(self.expected(raw, "a number"));
        };
        let value: f64 = number.into();
        if value.is_finite() {
            Ok(number)
        } else if value.is_nan() || raw.0.contains("inf") {
            Err(self.expected(raw, "a finite number"))
        } else {
            Err(self.error(raw.0, format!("the number is too large (at most {})", F::LARGEST)))
        }
    }

    /// A number of at least zero; `what` is its name in messages.
    pub(super) fn at_least_zero(&self, raw: Raw<'a>, what: &str) -> Result<f32, LoadError> {
        let number = self.number(raw)?;
        if number >= 0.0 { Ok(number) } else { Err(self.out_of_range(raw, what, "at least 0")) }
    }

    /// A body's priority: a whole number of at most [`MOST_PRIORITY`] in magnitude.
    pub(super) fn priority(&self, raw: Raw<'a>) -> Result<i32, LoadError> {
        let number: f32 = self.number(raw)?;
        if number.fract() == 0.0 && number.abs() <= MOST_PRIORITY {
            return Ok(number as i32);
        }
        Err(self.out_of_range(
            raw,
            "priority",
            &format!("a whole number from -{MOST_PRIORITY} to {MOST_PRIORITY}"),
        ))
    }

    /// A number from 0 to 1.
    pub(super) fn part(&self, raw: Raw<'a>, what: &str) -> Result<f32, LoadError> {
        let number = self.number(raw)?;
        if (0.0..=1.0).contains(&number) {
            Ok(number)
        } else {
            Err(self.out_of_range(raw, what, "from 0 to 1"))
        }
    }

    /// A whole number from `least` to `most`.
    pub(super) fn whole(&self, raw: Raw<'a>, what: &str, least: u64, most: u64) -> Result<u64, LoadError> {
        let digits = raw.0.bytes().all(|byte| byte.is_ascii_digit()).then(|| raw.0.parse().ok()).flatten();
        match digits.or_else(|| self.try_read::<u64>(raw)) {
            Some(number) if (least..=most).contains(&number) => Ok(number),
            // A number, but not a whole number in range.
            _ if self.try_read::<f64>(raw).is_some() => {
                Err(self.out_of_range(raw, what, &format!("a whole number from {least} to {most}")))
            }
            _ => Err(self.expected(raw, &format!("a whole number from {least} to {most}"))),
        }
    }

    pub(super) fn out_of_range(&self, raw: Raw<'a>, what: &str, range: &str) -> LoadError {
        self.error(raw.0, format!("{what} must be {range}, not {}", super::source::shorten(raw.0)))
    }

    /// `true` or `false`.
    pub(super) fn flag(&self, raw: Raw<'a>) -> Result<bool, LoadError> {
        self.try_read(raw).ok_or_else(|| self.expected(raw, "true or false"))
    }

    /// A string in quotes; messages call it `what`.
    pub(super) fn string(&self, raw: Raw<'a>, what: &str) -> Result<String, LoadError> {
        let read = || self.try_read(raw).ok_or_else(|| self.expected(raw, &format!("{what} in quotes")));
        without_escapes(raw.0).map_or_else(read, |text| Ok(text.to_owned()))
    }

    /// Exactly `N` values in parentheses; messages show the expected `form`.
    pub(super) fn tuple<const N: usize>(&self, raw: Raw<'a>, form: &str) -> Result<[Raw<'a>; N], LoadError> {
        let mut elements = self.values(raw.0).peekable();
        let count = elements.len();
        let is_structure = elements.peek().is_some_and(|first| {
            let (name, rest) = scan::split_identifier(first);
            !name.is_empty() && scan::skip_blank(rest).starts_with(':')
        });
        if !raw.0.starts_with('(') || is_structure {
            return Err(self.expected(raw, form));
        }
        let values = std::array::from_fn(|_| Raw(elements.next().unwrap_or_default()));
        if count == N {
            return Ok(values);
        }
        let noun = if count == 1 { "value" } else { "values" };
        Err(self.error(raw.0, format!("expected {form}, found {count} {noun}")))
    }

    /// The values of a list in square brackets.
    pub(super) fn list(&self, raw: Raw<'a>, what: &str) -> Result<Vec<Raw<'a>>, LoadError> {
        if !raw.0.starts_with('[') {
            return Err(self.expected(raw, &format!("{what} in square brackets")));
        }
        Ok(self.values(raw.0).map(Raw).collect())
    }

    /// The entries of a map in braces, in the file's order, equal keys included.
    pub(super) fn map(&self, raw: Raw<'a>, what: &str) -> Result<Vec<(Raw<'a>, Raw<'a>)>, LoadError> {
        let entries = self.entries(raw, what)?.into_iter();
        Ok(entries.map(|(key, value)| (key, Raw(self.resolve(value.0)))).collect())
    }

    /// The entries of a map like [`SceneText::map`], with variables as they are written.
    pub(super) fn entries(&self, raw: Raw<'a>, what: &str) -> Result<Vec<(Raw<'a>, Raw<'a>)>, LoadError> {
        if !raw.0.starts_with('{') {
            return Err(self.expected(raw, &format!("{what} in braces, as {{\"name\": …}}")));
        }
        let entry = |item: &'a str| {
            let (key, value) = scan::key_and_value(item)
                .ok_or_else(|| self.error(item, "expected a key, a colon and a value"))?;
            Ok((Raw(key), Raw(value)))
        };
        self.values(raw.0).map(entry).collect()
    }

    /// `(x, y, z)`.
    pub(super) fn vec3(&self, raw: Raw<'a>) -> Result<Vec3, LoadError> {
        self.keyed(raw, |raw| {
            let [x, y, z] = self.tuple(raw, "(x, y, z)")?;
            Ok(Vec3::new(self.number(x)?, self.number(y)?, self.number(z)?))
        })
    }

    /// `(x, y, z)` in double precision, within the range of single precision.
    pub(super) fn point(&self, raw: Raw<'a>) -> Result<DVec3, LoadError> {
        let coordinate = |raw: Raw<'a>| -> Result<f64, LoadError> {
            let number = self.number(raw);
            let is_in_range = |number: &f64| number.abs() <= f64::from(f32::MAX) && !self.has_keys(raw);
            if !number.as_ref().is_ok_and(is_in_range) {
                self.number::<f32>(raw)?;
            }
            number
        };
        self.keyed(raw, |raw| {
            let [x, y, z] = self.tuple(raw, "(x, y, z)")?;
            Ok(DVec3::new(coordinate(x)?, coordinate(y)?, coordinate(z)?))
        })
    }

    /// `(u, v)`.
    pub(super) fn vec2(&self, raw: Raw<'a>) -> Result<Vec2, LoadError> {
        self.keyed(raw, |raw| {
            let [x, y] = self.tuple(raw, "(u, v)")?;
            Ok(Vec2::new(self.number(x)?, self.number(y)?))
        })
    }

    /// The content of `Some(…)`, or the value itself; none for `None`.
    pub(super) fn optional(&self, raw: Raw<'a>) -> Option<Raw<'a>> {
        if !raw.0.starts_with(['N', 'S', 'r']) {
            return Some(raw);
        }
        let (name, rest) = scan::split_identifier(raw.0);
        match name {
            "None" => None,
            "Some" => match self.values(scan::skip_blank(rest)).collect::<Vec<_>>()[..] {
                [inner] => Some(Raw(inner)),
                _ => Some(raw),
            },
            _ => Some(raw),
        }
    }

    /// The error for a value that is no name; those in quotes that are one get it without.
    pub(super) fn expected_name(&self, raw: Raw<'a>, what: &str, names: &[&str]) -> LoadError {
        let quoted = self.try_read::<String>(raw);
        let same = quoted.and_then(|text| names.iter().find(|name| is_same_word(name, &text)));
        let advice = same.map(|name| format!(" (write {name}, without quotes)")).unwrap_or_default();
        let names = names.join(", ");
        self.error(raw.0, format!("expected {what}: {names}, found {}{advice}", describe(raw)))
    }

    /// One of several names.
    pub(super) fn choice<T: Copy>(
        &self,
        raw: Raw<'a>,
        kind: &str,
        known: &[(&str, T)],
    ) -> Result<T, LoadError> {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        let Some(variant) = self.variant(raw) else {
            return Err(self.expected_name(raw, &format!("a {kind}"), &names));
        };
        let found = known.iter().find(|(name, _)| *name == variant.name);
        let (_, value) = found.ok_or_else(|| self.unknown(variant.name, kind, &names))?;
        self.no_fields(variant)?;
        Ok(*value)
    }
}

/// The content of a string in quotes, if nothing in it is escaped.
fn without_escapes(text: &str) -> Option<&str> {
    let inside = text.strip_prefix('"')?;
    let end = inside.bytes().position(|byte| matches!(byte, b'"' | b'\\'))?;
    (inside[end..].trim_ascii_end() == "\"").then(|| &inside[..end])
}

/// True if two names differ only in case, hyphens, underscores and blanks.
fn is_same_word(name: &str, other: &str) -> bool {
    let letters = |text: &str| -> String {
        text.chars().filter(|c| c.is_ascii_alphanumeric()).map(|c| c.to_ascii_lowercase()).collect()
    };
    letters(name) == letters(other)
}
