//! Writes colours and numbers that may come from textures.

use super::Written;
use super::assets::AssetPaths;
use super::number::{Keys, color, degrees, number, same, tuple, uniform_or_tuple};
use crate::math::Rgb;
use crate::world::assets::{ColorSpace, TextureFilter, TextureSource, Wrap};
use crate::world::{Channel, ColorInput, PatternTexture, Procedure, ScalarInput, Texture, TextureId};

/// Writes values that may refer to textures and images.
#[derive(Clone, Copy)]
pub(super) struct WrittenTextures<'a> {
    pub paths: &'a AssetPaths<'a>,
    /// The default colour space of textures of colours.
    space: ColorSpace,
}

impl<'a> WrittenTextures<'a> {
    pub(super) fn new(paths: &'a AssetPaths<'a>) -> Self {
        WrittenTextures { paths, space: ColorSpace::Srgb }
    }

    pub(super) fn color(&self, input: &ColorInput) -> Written {
        match input {
            ColorInput::Constant(constant) => color(*constant),
            ColorInput::Texture(id) => {
                let factor = self.get(*id)?.factor;
                let is_default = same(&factor.to_array(), &Rgb::WHITE.to_array());
                if let Some(text) = self.computed(*id)? {
                    return Ok(if is_default {
                        text
                    } else {
                        format!("Multiply(a: {text}, b: {})", color(factor)?)
                    });
                }
                let mut keys = self.lookup(*id, self.space)?;
                keys.push_unless(is_default, "factor", || color(factor))?;
                self.finish(*id, keys, None)
            }
        }
    }

    /// A number or a texture, with its channel if that is not the usual one.
    pub(super) fn scalar(&self, input: &ScalarInput, usual: Channel) -> Written {
        let Some((id, channel)) = input.texture else { return number(input.factor) };
        if let Some(text) = self.of_numbers().computed(id)? {
            let is_default = same(&[input.factor], &[1.0]);
            return Ok(if is_default {
                text
            } else {
                format!("Multiply(a: {text}, b: {})", number(input.factor)?)
            });
        }
        let mut keys = self.lookup(id, ColorSpace::Linear)?;
        let factor = input.factor;
        keys.push_unless(same(&[factor], &[1.0]), "factor", || number(factor))?;
        self.finish(id, keys, (channel != usual).then_some(channel))
    }

    pub(super) fn channel(&self, id: TextureId, channel: Channel, usual: Channel) -> Written {
        if let Some(text) = self.of_numbers().computed(id)? {
            return Ok(text);
        }
        let keys = self.lookup(id, ColorSpace::Linear)?;
        self.finish(id, keys, (channel != usual).then_some(channel))
    }

    pub(super) fn data(&self, id: TextureId) -> Written {
        if let Some(text) = self.of_numbers().computed(id)? {
            return Ok(text);
        }
        let keys = self.lookup(id, ColorSpace::Linear)?;
        self.finish(id, keys, None)
    }

    fn of_numbers(self) -> Self {
        WrittenTextures { space: ColorSpace::Linear, ..self }
    }

    /// A computed texture; none if the texture has an image.
    fn computed(&self, id: TextureId) -> Written<Option<String>> {
        let TextureSource::Procedure(id) = self.get(id)?.source else { return Ok(None) };
        let procedure = self.paths.assets.procedures.get(id.0 as usize);
        match procedure.cloned().ok_or_else(|| format!("there is no procedure of number {}", id.0))? {
            Procedure::Combination(mut combination) => self.form(&mut combination),
            Procedure::Pattern(mut texture) => {
                let mut usual = PatternTexture::new(texture.pattern).placement;
                let place = self.differences(&mut texture.placement, &mut usual)?.finish("");
                let text = self.form(&mut texture.pattern)?;
                let (name, own) = text.split_once('(').unwrap_or((&text, ")"));
                let own = own.trim_end_matches(')');
                let place = place.trim_start_matches('(');
                let comma = if own.is_empty() || place == ")" { "" } else { ", " };
                Ok(format!("{name}({own}{comma}{place}"))
            }
        }
        .map(Some)
    }

    fn get(&self, id: TextureId) -> Written<&Texture> {
        let texture = self.paths.assets.textures.get(id.0 as usize);
        texture.ok_or_else(|| format!("there is no texture of number {}", id.0))
    }

    /// The keys for a texture lookup that are not at their defaults; the default colour space is `space`.
    fn lookup(&self, id: TextureId, space: ColorSpace) -> Written<Keys> {
        let Texture { filter, wrap: [u, v], scale, rotation, offset, uv_set, color_space, .. } =
            self.get(id)?;
        let [scale, offset] = [scale.to_array(), offset.to_array()];
        let mut keys = Keys::default();
        keys.push_unless(*filter == TextureFilter::default(), "filter", || Ok(format!("{filter:?}")))?;
        keys.push_unless([*u, *v] == [Wrap::default(); 2], "wrap", || {
            Ok(if u == v { format!("{u:?}") } else { format!("({u:?}, {v:?})") })
        })?;
        keys.push_unless(same(&scale, &[1.0; 2]), "scale", || uniform_or_tuple(&scale))?;
        keys.push_unless(same(&[*rotation], &[0.0]), "rotation_degrees", || degrees(*rotation))?;
        keys.push_unless(same(&offset, &[0.0; 2]), "offset", || tuple(&offset))?;
        keys.push_unless(*uv_set == 0, "uv_set", || Ok(uv_set.to_string()))?;
        keys.push_unless(*color_space == space, "color_space", || Ok(format!("{color_space:?}")))?;
        Ok(keys)
    }

    /// Returns `Texture(image: …, …)`, or the short form `Image(…)` if there are no keys.
    fn finish(&self, id: TextureId, mut keys: Keys, channel: Option<Channel>) -> Written {
        let image = self.get(id)?.image().ok_or("a texture has no image")?;
        let image = self.paths.image(image)?;
        if keys.is_empty() {
            return Ok(match channel {
                Some(channel) => format!("Image({image}, {channel:?})"),
                None => format!("Image({image})"),
            });
        }
        if let Some(channel) = channel {
            keys.push("channel", format!("{channel:?}"));
        }
        Ok(format!("Texture(image: {image}, {}", &keys.finish("")[1..]))
    }
}
