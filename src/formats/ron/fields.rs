//! Fills structures of the schema by serde; the values of their members stay unparsed.

use std::cell::Cell;
use std::fmt::{Display, Formatter};

use serde::de::value::{BorrowedStrDeserializer, MapAccessDeserializer};
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, Visitor};
use serde::forward_to_deserialize_any;

use super::scan;
use super::source::Raw;

/// An error in the members of a structure.
#[derive(Debug)]
pub(super) enum FieldError {
    Unknown { known: &'static [&'static str] },
    Duplicate(&'static str),
    Missing(&'static str),
    Other(String),
}

/// Fills a structure from names and values. An error comes with the name at which it occurred, if any.
pub(super) fn read<'a, T: Deserialize<'a>>(
    members: &[(&'a str, Raw<'a>)],
) -> Result<T, (Option<&'a str>, FieldError)> {
    let taken = Cell::new(0);
    T::deserialize(MapAccessDeserializer::new(MemberAccess { members, taken: &taken })).map_err(|error| {
        // serde checks each name as soon as it gets it, so the error is at the last one.
        let last = taken.get().checked_sub(1).and_then(|index| members.get(index));
        (last.map(|(name, _)| *name), error)
    })
}

struct MemberAccess<'m, 'a> {
    members: &'m [(&'a str, Raw<'a>)],
    /// The number of names passed to serde.
    taken: &'m Cell<usize>,
}

impl<'a> MapAccess<'a> for MemberAccess<'_, 'a> {
    type Error = FieldError;

    fn next_key_seed<K: DeserializeSeed<'a>>(&mut self, seed: K) -> Result<Option<K::Value>, FieldError> {
        let Some((name, _)) = self.members.get(self.taken.get()) else { return Ok(None) };
        self.taken.set(self.taken.get() + 1);
        seed.deserialize(BorrowedStrDeserializer::new(name)).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, FieldError> {
        let current = self.taken.get().checked_sub(1).and_then(|index| self.members.get(index));
        let (_, value) = current.ok_or_else(|| FieldError::custom("a value without a name"))?;
        seed.deserialize(RawDeserializer(*value))
    }
}

/// Passes a value on unparsed. An [`Option`] is written as in RON, but `Some` may be left out.
struct RawDeserializer<'a>(Raw<'a>);

impl<'de> Deserializer<'de> for RawDeserializer<'de> {
    type Error = FieldError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FieldError> {
        visitor.visit_borrowed_str(self.0.0)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FieldError> {
        match scan::split_identifier(self.0.0) {
            ("None", _) => visitor.visit_none(),
            ("Some", rest) => match scan::items(scan::skip_blank(rest)).as_slice() {
                [inner] => visitor.visit_some(RawDeserializer(Raw(inner))),
                _ => visitor.visit_some(self),
            },
            _ => visitor.visit_some(self),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Raw<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <&'a str>::deserialize(deserializer).map(Raw)
    }
}

impl Error for FieldError {
    fn custom<T: Display>(message: T) -> Self {
        FieldError::Other(message.to_string())
    }

    fn unknown_field(_: &str, known: &'static [&'static str]) -> Self {
        FieldError::Unknown { known }
    }

    fn missing_field(field: &'static str) -> Self {
        FieldError::Missing(field)
    }

    fn duplicate_field(field: &'static str) -> Self {
        FieldError::Duplicate(field)
    }
}

impl std::error::Error for FieldError {}

impl Display for FieldError {
    fn fmt(&self, formatter: &mut Formatter) -> std::fmt::Result {
        write!(formatter, "{self:?}")
    }
}
