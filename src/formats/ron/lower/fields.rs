//! Reads the fields of a component by their table ([`crate::world::fields`]).

use super::{Lowering, radians};
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, SceneText};
use crate::world::fields::{Field, Fields, Forms, Range, Slot};

/// Keys and values as they stand in the file.
type Members<'a> = [(&'a str, Raw<'a>)];

impl<'a> Lowering<'_, 'a> {
    /// Sets the fields that `(key: value, …)` gives; all others stay.
    pub(super) fn structure(&mut self, raw: Raw<'a>, to: &mut dyn Fields) -> Result<(), LoadError> {
        let what = to.what();
        let members = self.source.structure(raw, what)?;
        self.fill(&members, what, to.fields())
    }

    /// Sets the fields that members give.
    pub(super) fn fill(
        &mut self,
        members: &Members<'a>,
        what: &str,
        fields: Vec<Field>,
    ) -> Result<(), LoadError> {
        self.source.check_keys(members, what, &fields)?;
        for field in fields {
            let given = members.iter().find(|(key, _)| field.is_called(key));
            let Field { name, slot, .. } = field;
            if let Some(raw) = given.and_then(|(_, raw)| self.source.optional(*raw)) {
                self.read(raw, name, slot)?;
            }
        }
        Ok(())
    }

    fn read(&mut self, raw: Raw<'a>, name: &str, slot: Slot) -> Result<(), LoadError> {
        let source = self.source;
        match slot {
            Slot::Flag(to) => *to = source.flag(raw)?,
            Slot::Number(to, range) => *to = source.number_in(raw, name, range)?,
            Slot::OptionalNumber(to, range) => *to = Some(source.number_in(raw, name, range)?),
            Slot::Degrees(to) => *to = radians(source.number(raw)?),
            Slot::Priority(to) => *to = source.priority(raw)?,
            Slot::Color(to, range) => {
                *to = source.color(raw, name)?;
                if !to.to_array().iter().all(|part| range.contains(*part)) {
                    return Err(source.out_of_range(raw, name, &range.to_string()));
                }
            }
            Slot::ColorMap(to, Range::UNIT) => *to = self.reflectance(raw, name)?,
            Slot::ColorMap(to, _) => *to = self.color_input(raw, name)?,
            Slot::NumberMap(to, usual) => *to = self.scalar_input(raw, name, usual)?,
            Slot::ChannelMap(to, usual) => *to = Some(self.channel_input(raw, usual)?),
            Slot::DataMap(to) => *to = Some(self.data_input(raw)?),
            Slot::Normals(to) => *to = Some(self.normal_map(raw)?),
            Slot::Bumps(to) => *to = Some(self.bump_map(raw)?),
            Slot::Part(to) => self.structure(raw, to)?,
            Slot::OptionalPart(to) => self.structure(raw, to.insert())?,
            Slot::Form(to) => self.form(raw, to)?,
        }
        Ok(())
    }

    /// `Name` or `Name(key: value, …)`.
    fn form(&mut self, raw: Raw<'a>, to: &mut dyn Forms) -> Result<(), LoadError> {
        let (source, names) = (self.source, to.names());
        let Some(variant) = source.variant(raw) else {
            let article = if to.kind().starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
            return Err(source.expected(raw, &format!("{article} {}: {}", to.kind(), names.join(", "))));
        };
        let found = names.iter().position(|name| *name == variant.name);
        to.set_form(found.ok_or_else(|| source.unknown(variant.name, to.kind(), names))?);
        let fields = to.fields();
        if fields.is_empty() {
            return source.no_fields(variant);
        }
        let members = source.members(variant.body.unwrap_or("()"), variant.name)?;
        self.fill(&members, variant.name, fields)
    }
}

impl<'a> SceneText<'a> {
    /// A number in a range; `name` is that of its field.
    fn number_in(&self, raw: Raw<'a>, name: &str, range: Range) -> Result<f32, LoadError> {
        let number = self.number(raw)?;
        if range.contains(number) {
            Ok(number)
        } else {
            Err(self.out_of_range(raw, name, &range.to_string()))
        }
    }

    /// Refuses keys that stand for no field, and second ones for a field.
    fn check_keys(&self, members: &Members<'a>, what: &str, fields: &[Field]) -> Result<(), LoadError> {
        let mut given = vec![false; fields.len()];
        for (key, _) in members {
            let Some(field) = fields.iter().position(|field| field.is_called(key)) else {
                let known = fields.iter().flat_map(|field| std::iter::once(&field.name).chain(field.aliases));
                return Err(self.unknown_field(key, what, &known.copied().collect::<Vec<_>>()));
            };
            if std::mem::replace(&mut given[field], true) {
                let name = fields[field].name;
                return Err(self.error(key, format!("{what} has the field \"{name}\" twice")));
            }
        }
        Ok(())
    }
}
