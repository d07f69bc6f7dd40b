//! Writes the fields of a component by their table ([`crate::world::fields`]).

use super::Written;
use super::number::{Keys, color, degrees, number, same};
use super::texture::WrittenTextures;
use crate::world::fields::{Field, Fields, Forms, Slot};
use crate::world::{BumpMap, ColorInput, NormalMap, ScalarInput};

impl WrittenTextures<'_> {
    /// The keys of a structure that are not at their defaults.
    pub(super) fn structure(&self, part: &mut dyn Fields) -> Written<Keys> {
        let given = |field: &Field| matches!(field.slot, Slot::OptionalNumber(Some(_), _));
        let given: Vec<_> =
            part.fields().iter().filter(|field| given(field)).map(|field| field.name).collect();
        let mut defaults = part.defaults(&|key| given.contains(&key));
        let mut keys = Keys::default();
        for (Field { name, slot, .. }, default) in part.fields().into_iter().zip(defaults.fields()) {
            if let Some(text) = self.unless_default(slot, default.slot)? {
                keys.push(name, text);
            }
        }
        Ok(keys)
    }

    /// A value as a scene file has it; `None` if it is the default, a slot of the same kind.
    fn unless_default(&self, slot: Slot, default: Slot) -> Written<Option<String>> {
        let is_default = match (&slot, &default) {
            (Slot::Flag(a), Slot::Flag(b)) => a == b,
            (Slot::Number(a, _), Slot::Number(b, _)) | (Slot::Degrees(a), Slot::Degrees(b)) => {
                same(&[**a], &[**b])
            }
            (Slot::Priority(a), Slot::Priority(b)) => a == b,
            (Slot::Color(a, _), Slot::Color(b, _)) => same(&a.to_array(), &b.to_array()),
            (Slot::ColorMap(ColorInput::Constant(a), _), Slot::ColorMap(ColorInput::Constant(b), _)) => {
                same(&a.to_array(), &b.to_array())
            }
            (Slot::NumberMap(a, _), Slot::NumberMap(b, _)) => {
                a.texture.is_none() && same(&[a.factor], &[b.factor])
            }
            (Slot::Form(a), Slot::Form(b)) => a.form() == b.form(),
            _ => false,
        };
        if is_default { Ok(None) } else { self.value(slot) }
    }

    /// A value as a scene file has it; `None` if it is one that is left out.
    pub(super) fn value(&self, slot: Slot) -> Written<Option<String>> {
        let text = match slot {
            Slot::Flag(flag) => flag.to_string(),
            Slot::Number(value, _) | Slot::OptionalNumber(Some(value), _) => number(*value)?,
            Slot::Degrees(angle) => degrees(*angle)?,
            Slot::Priority(priority) => priority.to_string(),
            Slot::Color(value, _) => color(*value)?,
            Slot::ColorMap(input, _) => self.color(input)?,
            Slot::NumberMap(input, usual) => self.scalar(input, usual)?,
            Slot::ChannelMap(Some((texture, channel)), usual) => self.channel(*texture, *channel, usual)?,
            Slot::DataMap(Some(texture)) => self.data(*texture)?,
            Slot::Normals(Some(NormalMap { texture, scale })) if same(&[*scale], &[1.0]) => {
                self.data(*texture)?
            }
            Slot::Normals(Some(NormalMap { texture, scale })) => {
                format!("(texture: {}, scale: {})", self.data(*texture)?, number(*scale)?)
            }
            Slot::Bumps(Some(BumpMap { texture, channel, height_m })) => {
                let input = ScalarInput { factor: 1.0, texture: Some((*texture, *channel)) };
                let texture = self.scalar(&input, crate::world::Channel::Red)?;
                format!("(texture: {texture}, height_m: {})", number(*height_m)?)
            }
            Slot::Part(part) => {
                let keys = self.structure(part)?;
                if keys.is_empty() {
                    return Ok(None);
                }
                keys.finish("")
            }
            Slot::OptionalPart(part) => match part.part() {
                Some(part) => self.structure(part)?.finish(""),
                None => return Ok(None),
            },
            Slot::Form(form) => self.form(form)?,
            Slot::OptionalNumber(None, _)
            | Slot::ChannelMap(None, _)
            | Slot::DataMap(None)
            | Slot::Normals(None)
            | Slot::Bumps(None) => return Ok(None),
        };
        Ok(Some(text))
    }

    /// `Name`, or `Name(key: value, …)` with all its fields.
    fn form(&self, form: &mut dyn Forms) -> Written {
        let name = form.names()[form.form()];
        let mut keys = Keys::default();
        for field in form.fields() {
            if let Some(text) = self.value(field.slot)? {
                keys.push(field.name, text);
            }
        }
        Ok(if keys.is_empty() { name.to_owned() } else { keys.finish(name) })
    }
}
