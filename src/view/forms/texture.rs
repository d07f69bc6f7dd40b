//! The forms of textures: of patterns, combinations and images, and the names of textures that may replace a value.

use serde_json::{Value, json};

use super::FormWriter;
use crate::world::assets::TextureSource;
use crate::world::fields::{Field, Forms, Range, Slot, all_fields};
use crate::world::ineffective::{FieldContext, OF_PATTERNS, reason};
use crate::world::{BumpMap, Channel, ColorInput, NormalMap, Procedure, Texture, TextureId, TexturePattern};

/// The most dots in the path of a texture with a form: textures may lie within each other.
const DEEPEST: usize = 4;

/// The names of the textures that may replace a value: those that need no field.
pub(super) fn names() -> &'static [&'static str] {
    TexturePattern::FORMS
}

/// The use of a texture, on which its fields depend.
enum TextureUse<'a> {
    /// A colour, with its factor.
    Color,
    /// A number: its factor and channel.
    Number(&'a mut f32, &'a mut Channel),
    /// A channel of values as they are stored.
    Channel(&'a mut Channel),
    /// All of the values as they are stored.
    Data,
}

impl FormWriter<'_> {
    /// The value of a field that is a texture, or may be one and is absent; none for other fields.
    pub(super) fn texture_of(&self, slot: &mut Slot, path: &str) -> Option<Value> {
        let absent = || json!({"kind": "texture", "value": "None", "names": names(), "constant": "None"});
        let pattern = |form: Value, constant: &str| {
            let mut form = form;
            form["constant"] = json!(constant);
            form
        };
        Some(match slot {
            Slot::ColorMap(ColorInput::Texture(id), _) => {
                pattern(self.texture(*id, TextureUse::Color, path), "(0.5, 0.5, 0.5)")
            }
            Slot::NumberMap(input, _) => {
                let (id, mut channel) = input.texture?;
                pattern(self.texture(id, TextureUse::Number(&mut input.factor, &mut channel), path), "0.5")
            }
            Slot::ChannelMap(Some((id, channel)), _) => {
                pattern(self.texture(*id, TextureUse::Channel(channel), path), "None")
            }
            Slot::DataMap(Some(id)) => pattern(self.texture(*id, TextureUse::Data, path), "None"),
            Slot::Normals(Some(NormalMap { texture, scale })) if *scale == 1.0 => {
                pattern(self.texture(*texture, TextureUse::Data, path), "None")
            }
            Slot::Normals(Some(NormalMap { texture, scale })) => {
                let doc = "a factor on the slopes of the map";
                let number =
                    Field { doc, ..Field::plain("scale", false, Slot::Number(scale, Range::Finite)) };
                self.map(path, Slot::DataMap(&mut Some(*texture)), number)
            }
            Slot::Bumps(Some(BumpMap { texture, channel, height_m })) => {
                let doc = "the height of 1 above 0";
                let number = Slot::Number(height_m, Range::Finite);
                let number = Field { doc, ..Field::plain("height_m", false, number) };
                self.map(path, Slot::ChannelMap(&mut Some((*texture, *channel)), Channel::Red), number)
            }
            Slot::Bumps(None) => {
                let mut form = absent();
                form["template"] = json!("(texture: {}, height_m: 0.01)");
                form
            }
            Slot::ChannelMap(None, _) | Slot::DataMap(None) | Slot::Normals(None) => absent(),
            _ => return None,
        })
    }

    /// A map that is a texture and a number.
    fn map(&self, path: &str, texture: Slot, number: Field) -> Value {
        let inner = format!("{path}.");
        let texture = Field { doc: "the map", ..Field::plain("texture", true, texture) };
        let mut texture = self.value(texture, &inner);
        texture["constant"] = Value::Null;
        json!({"kind": "part", "is_removable": true, "fields": [texture, self.value(number, &inner)]})
    }

    /// The form of a texture.
    fn texture(&self, id: TextureId, usage: TextureUse, path: &str) -> Value {
        let assets = &self.world.assets;
        let fixed = |why: &str| json!({"kind": "fixed", "why": why});
        let Some(mut texture) = assets.textures.get(id.0 as usize).copied() else {
            return fixed("the scene has no such texture");
        };
        if path.matches('.').count() > DEEPEST {
            return fixed("textures so deep in others are changed in the scene's file");
        }
        let inner = format!("{path}.");
        let form = |name: &str, fields: Vec<Value>| {
            let others = names().iter().filter(|other| **other != name);
            let names: Vec<&str> = [name].into_iter().chain(others.copied()).collect();
            json!({"kind": "texture", "value": name, "names": names, "fields": fields})
        };
        let TextureSource::Procedure(procedure) = texture.source else {
            return form("Image", self.values(of_image(&mut texture, usage), &inner));
        };
        match assets.procedures.get(procedure.0 as usize).cloned() {
            Some(Procedure::Pattern(own)) => {
                let mut shown = own.clone();
                let name = TexturePattern::FORMS[shown.pattern.form()];
                let mut fields = shown.pattern.fields();
                fields.extend(all_fields(&mut shown.placement));
                let context = FieldContext::of(self.world);
                let idle = |field: &str| {
                    let own_field = field.strip_prefix(&inner).unwrap_or_default();
                    (self.reason)(field).or_else(|| reason(OF_PATTERNS, &own, &context, own_field))
                };
                form(name, FormWriter { reason: &idle, ..*self }.values(fields, &inner))
            }
            Some(Procedure::Combination(mut combination)) => {
                let name = combination.names()[combination.form()];
                form(name, self.values(combination.fields(), &inner))
            }
            None => fixed("the scene has no such texture"),
        }
    }
}

/// The fields of a texture with an image, as in `Texture(image: …)`.
fn of_image<'a>(texture: &'a mut Texture, usage: TextureUse<'a>) -> Vec<Field<'a>> {
    let field = |name, doc, slot| Field { doc, ..Field::plain(name, false, slot) };
    let Texture { filter, wrap, scale, rotation, offset, uv_set, color_space, factor, .. } = texture;
    let mut fields = vec![field("filter", "what is seen between texels", Slot::Form(filter))];
    if let [u, v] = wrap
        && u == v
    {
        fields.push(field("wrap", "what is seen beyond the image", Slot::Form(u)));
    }
    fields.extend([
        field("scale", "repetitions of the image per unit of uv", Slot::Pair(scale, Range::Finite)),
        field("rotation_degrees", "the turn, clockwise", Slot::Degrees(rotation, Range::Finite)),
        field("offset", "added after the rotation", Slot::Pair(offset, Range::Finite)),
        field("uv_set", "the mesh's set of texture coordinates", Slot::Whole(uv_set, 0, 1)),
        field("color_space", "how stored values are read", Slot::Form(color_space)),
    ]);
    let channel = |channel: &'a mut Channel| field("channel", "the channel in use", Slot::Form(channel));
    match usage {
        TextureUse::Color => {
            fields.push(field("factor", "a factor on the colour", Slot::Color(factor, Range::From(0.0))))
        }
        TextureUse::Number(factor, used) => {
            fields.push(channel(used));
            fields.push(field("factor", "a factor on the number", Slot::Number(factor, Range::UNIT)));
        }
        TextureUse::Channel(used) => fields.push(channel(used)),
        TextureUse::Data => {}
    }
    fields
}
