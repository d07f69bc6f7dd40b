//! Reads inputs that may be textures: colours, numbers, normals and bumps.

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::color::is_color_form;
use crate::formats::ron::source::{Raw, VariantText};
use crate::math::{Rgb, Vec2};
use crate::world::assets::{ColorSpace, TextureFilter, Wrap};
use crate::world::fields::{Field, Forms, Quantity, Range, Slot, radians, visit_all};
use crate::world::{
    BumpMap, Channel, ColorInput, Combination, ImageId, NormalMap, PatternTexture, Procedure, ScalarInput,
    Texture, TextureId, TexturePattern,
};

/// The textures with images; those that are computed have tables.
const IMAGES: [&str; 2] = ["Image", "Texture"];
const WRAPS: &[(&str, Wrap)] = &[("Repeat", Wrap::Repeat), ("Clamp", Wrap::Clamp), ("Mirror", Wrap::Mirror)];
const FILTERS: &[(&str, TextureFilter)] = &[
    ("Nearest", TextureFilter::Nearest),
    ("Bilinear", TextureFilter::Bilinear),
    ("Trilinear", TextureFilter::Trilinear),
];
const COLOR_SPACES: &[(&str, ColorSpace)] = &[("Srgb", ColorSpace::Srgb), ("Linear", ColorSpace::Linear)];
const CHANNELS: &[(&str, Channel)] =
    &[("Red", Channel::Red), ("Green", Channel::Green), ("Blue", Channel::Blue), ("Alpha", Channel::Alpha)];

/// The keys of a texture; the first one is required.
const TEXTURE: [&str; 10] = [
    "image", "filter", "wrap", "scale", "rotation_degrees", "offset", "uv_set", "color_space", "channel",
    "factor",
];

/// The parts of a texture, before its use is known.
struct Read<'a> {
    texture: ReadTexture,
    channel: Option<Raw<'a>>,
    factor: Option<Raw<'a>>,
}

enum ReadTexture {
    /// A texture with an image.
    Lookup(Texture),
    /// A computed one, which the world has already.
    Computed(TextureId),
}

impl<'a> Lowering<'_, 'a> {
    /// The variant of a value that is a texture instead of a constant; animation keys count as a constant.
    fn picture(&self, raw: Raw<'a>) -> Option<VariantText<'a>> {
        let variant = self.source.variant(raw).filter(|variant| !is_color_form(variant.name));
        variant.filter(|_| !self.source.has_keys(raw))
    }

    /// A colour, which may be a quantity of light, or a texture.
    pub(super) fn color_input(
        &mut self,
        raw: Raw<'a>,
        what: &str,
        quantity: Option<Quantity>,
    ) -> Result<ColorInput, LoadError> {
        let Some(variant) = self.picture(raw) else {
            return Ok(ColorInput::Constant(self.source.color(raw, what, quantity)?));
        };
        let space = if self.reads_numbers { ColorSpace::Linear } else { ColorSpace::Srgb };
        let mut read = self.texture(variant, space)?;
        self.no_channel(&read)?;
        if let (Some(raw), ReadTexture::Lookup(texture)) = (read.factor, &mut read.texture) {
            texture.factor = self.source.color(raw, "a factor", quantity)?;
        }
        Ok(ColorInput::Texture(self.texture_id(read.texture)))
    }

    /// A colour with no component above 1, or a texture.
    pub(super) fn reflectance(&mut self, raw: Raw<'a>, what: &str) -> Result<ColorInput, LoadError> {
        let input = self.color_input(raw, what, None)?;
        match input {
            ColorInput::Constant(color) if color.max_component() > 1.0 => {
                Err(self.source.out_of_range(raw, what, "from 0 to 1"))
            }
            input => Ok(input),
        }
    }

    /// A number from 0 to 1, or a texture's channel times such a number.
    pub(super) fn scalar_input(
        &mut self,
        raw: Raw<'a>,
        what: &str,
        usual: Channel,
    ) -> Result<ScalarInput, LoadError> {
        let Some(variant) = self.picture(raw) else {
            return Ok(ScalarInput::constant(self.source.part(raw, what)?));
        };
        let read = self.texture(variant, ColorSpace::Linear)?;
        let factor = read.factor.map_or(Ok(1.0), |raw| self.source.part(raw, what))?;
        Ok(ScalarInput { factor, texture: Some(self.channel(read, usual)?) })
    }

    /// A texture and one of its channels, without a factor.
    pub(super) fn channel_input(
        &mut self,
        raw: Raw<'a>,
        usual: Channel,
    ) -> Result<(TextureId, Channel), LoadError> {
        let read = self.data(raw)?;
        self.no_factor(&read)?;
        self.channel(read, usual)
    }

    /// A texture of data other than colours, without channel and factor.
    pub(super) fn data_input(&mut self, raw: Raw<'a>) -> Result<TextureId, LoadError> {
        let read = self.data(raw)?;
        self.no_channel(&read)?;
        self.no_factor(&read)?;
        Ok(self.texture_id(read.texture))
    }

    /// A normal map: a texture, or `(texture: …, scale: …)`.
    pub(super) fn normal_map(&mut self, raw: Raw<'a>) -> Result<NormalMap, LoadError> {
        if !raw.0.starts_with('(') {
            return Ok(NormalMap { texture: self.data_input(raw)?, scale: 1.0 });
        }
        let members = self.source.structure(raw, "a normal map")?;
        let (mut texture, mut scale) = (None, 1.0);
        self.fill(&members, ("a normal map", raw.0), None, &mut |each| {
            each(Field::plain("texture", true, Slot::DataMap(&mut texture)));
            each(Field::plain("scale", false, Slot::Number(&mut scale, Range::Finite)));
        })?;
        Ok(NormalMap { texture: texture.unwrap_or(TextureId(0)), scale })
    }

    /// A bump map, `(texture: …, height_m: …)`.
    pub(super) fn bump_map(&mut self, raw: Raw<'a>) -> Result<BumpMap, LoadError> {
        let members = self.source.structure(raw, "a bump map")?;
        let (mut texture, mut height_m) = (None, 0.0);
        self.fill(&members, ("a bump map", raw.0), None, &mut |each| {
            each(Field::plain("texture", true, Slot::ChannelMap(&mut texture, Channel::Red)));
            let height = Field::plain("height_m", true, Slot::Number(&mut height_m, Range::Finite));
            each(Field { aliases: &["height"], ..height });
        })?;
        let (texture, channel) = texture.unwrap_or((TextureId(0), Channel::Red));
        Ok(BumpMap { texture, channel, height_m })
    }

    fn data(&mut self, raw: Raw<'a>) -> Result<Read<'a>, LoadError> {
        let Some(variant) = self.source.variant(raw) else {
            return Err(self.source.expected(raw, "a texture, as Image(\"path\") or Texture(…)"));
        };
        self.texture(variant, ColorSpace::Linear)
    }

    fn channel(&mut self, read: Read<'a>, usual: Channel) -> Result<(TextureId, Channel), LoadError> {
        let channel = match read.texture {
            // All channels of numbers are the same, and alpha is 1.
            ReadTexture::Computed(_) => Channel::Red,
            ReadTexture::Lookup(_) => {
                read.channel.map_or(Ok(usual), |raw| self.source.choice(raw, "channel", CHANNELS))?
            }
        };
        Ok((self.texture_id(read.texture), channel))
    }

    fn no_channel(&self, read: &Read<'a>) -> Result<(), LoadError> {
        read.channel.map_or(Ok(()), |raw| {
            Err(self.source.error(raw.0, "all channels are used here: leave the channel out"))
        })
    }

    fn no_factor(&self, read: &Read<'a>) -> Result<(), LoadError> {
        read.factor.map_or(Ok(()), |raw| {
            Err(self.source.error(raw.0, "these numbers are used as they are: leave the factor out"))
        })
    }

    /// A texture: `Image("path")`, `Image("path", Green)` or `Texture(image: "path", …)`; its default colour space is
    /// `space`.
    fn texture(&mut self, variant: VariantText<'a>, space: ColorSpace) -> Result<Read<'a>, LoadError> {
        let source = self.source;
        match variant.name {
            "Image" => {
                let body = Raw(variant.body.unwrap_or(variant.name));
                let (path, channel) = match source.tuple(body, "Image(\"path\")") {
                    Ok([path]) => (path, None),
                    Err(error) => match source.tuple(body, "") {
                        Ok([path, channel]) if source.variant(channel).is_some() => (path, Some(channel)),
                        _ => return Err(error),
                    },
                };
                let image = self.assets.image(source, path, &mut self.world)?;
                let texture = Texture { color_space: space, ..Texture::new(image) };
                Ok(Read { texture: ReadTexture::Lookup(texture), channel, factor: None })
            }
            "Texture" => self.lookup(source.variant_keys(variant, 1, TEXTURE)?, space),
            _ => {
                let outer = std::mem::replace(&mut self.reads_numbers, space == ColorSpace::Linear);
                let read = self.procedure(variant);
                self.reads_numbers = outer;
                let texture = ReadTexture::Computed(self.world.assets.add_procedure(read?));
                Ok(Read { texture, channel: None, factor: None })
            }
        }
    }

    /// A computed texture, such as `Noise(scale: 8)`.
    fn procedure(&mut self, variant: VariantText<'a>) -> Result<Procedure, LoadError> {
        let source = self.source;
        let form = |of: &[&str]| of.iter().position(|name| *name == variant.name);
        let (pattern, combination) = (form(TexturePattern::FORMS), form(Combination::FORMS));
        if pattern.or(combination).is_none() {
            if let Some(error) = source.unquoted_color(&variant) {
                return Err(error);
            }
            let known = [&IMAGES, TexturePattern::FORMS, Combination::FORMS].concat();
            return Err(source.unknown(variant.name, "texture", &known));
        }
        let members = source.members(variant.body.unwrap_or("()"), variant.name)?;
        let what = (variant.name, variant.name);
        if let Some(form) = pattern {
            let mut pattern = TexturePattern::Checker;
            pattern.set_form(form);
            let mut texture = PatternTexture::new(pattern);
            self.fill(&members, what, None, &mut |each| {
                texture.pattern.fields().into_iter().for_each(&mut *each);
                visit_all(&mut texture.placement, &mut |field| each(field));
            })?;
            return Ok(Procedure::Pattern(Box::new(texture)));
        }
        let mut to = Combination::Add { a: ColorInput::default(), b: ColorInput::default() };
        to.set_form(combination.unwrap_or_default());
        self.fill(&members, what, None, &mut |each| to.fields().into_iter().for_each(&mut *each))?;
        Ok(Procedure::Combination(to))
    }

    fn texture_id(&mut self, read: ReadTexture) -> TextureId {
        match read {
            ReadTexture::Lookup(texture) => self.assets.texture(texture, &mut self.world),
            ReadTexture::Computed(id) => id,
        }
    }

    fn lookup(&mut self, given: [Option<Raw<'a>>; 10], space: ColorSpace) -> Result<Read<'a>, LoadError> {
        let source = self.source;
        let [image, filter, wrap, scale, rotation_degrees, offset, uv_set, color_space, channel, factor] =
            given;
        let image = image.map(|raw| self.assets.image(source, raw, &mut self.world)).transpose()?;
        let image = image.unwrap_or(ImageId(0));
        let mut texture = Texture { color_space: space, factor: Rgb::WHITE, ..Texture::new(image) };
        if let Some(raw) = filter {
            texture.filter = source.choice(raw, "filter", FILTERS)?;
        }
        if let Some(raw) = wrap {
            texture.wrap = if raw.0.starts_with('(') {
                let [u, v] = source.tuple(raw, "(wrap along u, wrap along v)")?;
                [source.choice(u, "wrap", WRAPS)?, source.choice(v, "wrap", WRAPS)?]
            } else {
                [source.choice(raw, "wrap", WRAPS)?; 2]
            };
        }
        if let Some(raw) = scale {
            let read = |raw: Raw<'a>| {
                if raw.0.starts_with('(') { source.vec2(raw) } else { source.number(raw).map(Vec2::splat) }
            };
            texture.scale = source.keyed(raw, read)?;
        }
        if let Some(raw) = rotation_degrees {
            texture.rotation = radians(source.number(raw)?);
        }
        if let Some(raw) = offset {
            texture.offset = source.vec2(raw)?;
        }
        if let Some(raw) = uv_set {
            texture.uv_set = source.whole(raw, "uv_set", 0, 1)? as u32;
        }
        if let Some(raw) = color_space {
            texture.color_space = source.choice(raw, "color_space", COLOR_SPACES)?;
        }
        Ok(Read { texture: ReadTexture::Lookup(texture), channel, factor })
    }
}
