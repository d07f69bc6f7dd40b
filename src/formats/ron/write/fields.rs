//! Writes the fields of a component from their table ([`crate::world::fields`]).

use super::number::{Keys, color, degrees, list, number, pairs, same, tuple, uniform_or_tuple, vectors};
use super::texture::WrittenTextures;
use super::{Written, quote};
use crate::math::{Rgb, Vec2};
use crate::world::fields::{Field, Fields, Forms, Slot, all_fields};
use crate::world::{
    Aov, Background, Backplate, BumpMap, Caustics, ColorInput, NormalMap, ScalarInput, Sharing,
};

impl WrittenTextures<'_> {
    /// The keys of a structure that are not at their defaults.
    pub(super) fn structure(&self, part: &mut dyn Fields) -> Written<Keys> {
        let given = |field: &Field| matches!(field.slot, Slot::OptionalNumber(Some(_), _));
        let given: Vec<_> =
            part.fields().iter().filter(|field| given(field)).map(|field| field.name).collect();
        let mut defaults = part.defaults(&|key| given.contains(&key));
        self.differences(part, &mut *defaults)
    }

    /// The keys of a structure whose values differ from `defaults`.
    pub(super) fn differences(&self, part: &mut dyn Fields, defaults: &mut dyn Fields) -> Written<Keys> {
        let mut keys = Keys::default();
        for (Field { name, slot, .. }, default) in all_fields(part).into_iter().zip(all_fields(defaults)) {
            if let Some(text) = self.unless_default(slot, default.slot)? {
                keys.push(name, text);
            }
        }
        Ok(keys)
    }

    /// A value as in a scene file; `None` if it equals `default`, a slot of the same kind.
    fn unless_default(&self, slot: Slot, default: Slot) -> Written<Option<String>> {
        let is_default = match (&slot, &default) {
            (Slot::Flag(a), Slot::Flag(b)) => a == b,
            (Slot::Number(a, _), Slot::Number(b, _))
            | (Slot::Degrees(a, _), Slot::Degrees(b, _))
            | (Slot::Azimuth(a), Slot::Azimuth(b)) => same(&[**a], &[**b]),
            (Slot::PairLists(a), Slot::PairLists(b)) => a == b,
            (Slot::Numbers(a, _), Slot::Numbers(b, _)) => same(a, b),
            (Slot::Extents(a), Slot::Extents(b)) => same(&a.to_array(), &b.to_array()),
            (Slot::Sides(a), Slot::Sides(b)) => same(&a.to_array(), &b.to_array()),
            (Slot::Priority(a), Slot::Priority(b)) => a == b,
            (Slot::Color(a, _), Slot::Color(b, _)) => same(&a.to_array(), &b.to_array()),
            (Slot::ColorMap(ColorInput::Constant(a), _), Slot::ColorMap(ColorInput::Constant(b), _)) => {
                same(&a.to_array(), &b.to_array())
            }
            (Slot::NumberMap(a, _), Slot::NumberMap(b, _)) => {
                a.texture.is_none() && same(&[a.factor], &[b.factor])
            }
            (Slot::Text(a), Slot::Text(b)) => a == b,
            (Slot::Pair(a, _), Slot::Pair(b, _)) => same(&a.to_array(), &b.to_array()),
            (Slot::Vector(a, _), Slot::Vector(b, _)) => same(&a.to_array(), &b.to_array()),
            (Slot::Size(a), Slot::Size(b)) => a == b,
            (Slot::Whole(a, ..), Slot::Whole(b, ..)) => a == b,
            (Slot::OptionalWhole(a, ..), Slot::OptionalWhole(b, ..)) => a == b,
            (Slot::Seed(a), Slot::Seed(b)) => a == b,
            (Slot::Transport(a), Slot::Transport(b)) => a == b,
            (Slot::Sharing(a), Slot::Sharing(b)) => a == b,
            (Slot::Caustics(a), Slot::Caustics(b)) => a == b,
            (Slot::Background(a), Slot::Background(b)) => a == b,
            (Slot::OptionalBackground(a), Slot::OptionalBackground(b)) => a == b,
            (Slot::Backplate(a), Slot::Backplate(b)) => a == b,
            (Slot::Exposure(a), Slot::Exposure(b)) => a == b,
            (Slot::Aovs(a), Slot::Aovs(b)) => a == b,
            _ => false,
        };
        if let (Slot::Form(_), Slot::Form(default)) = (&slot, default) {
            let default = self.form(default)?;
            return Ok(self.value(slot)?.filter(|text| *text != default));
        }
        if is_default { Ok(None) } else { self.value(slot) }
    }

    /// A value as in a scene file; `None` if it is absent or a structure with all defaults.
    pub(super) fn value(&self, slot: Slot) -> Written<Option<String>> {
        let text = match slot {
            Slot::Flag(flag) => flag.to_string(),
            Slot::Number(value, _) | Slot::OptionalNumber(Some(value), _) => number(*value)?,
            Slot::Degrees(angle, _) | Slot::Azimuth(angle) => degrees(*angle)?,
            Slot::Vector(vector, _) => uniform_or_tuple(&vector.to_array())?,
            Slot::Stops(stops) if stops.is_empty() => return Ok(None),
            Slot::Stops(stops) => {
                let each =
                    stops.iter().map(|(at, stop)| Ok(format!("({}, {})", number(*at)?, color(*stop)?)));
                format!("[{}]", each.collect::<Written<Vec<String>>>()?.join(", "))
            }
            Slot::Extents(size) => uniform_or_tuple(&size.to_array())?,
            Slot::Sides(size) => uniform_or_tuple(&size.to_array())?,
            Slot::Pair(pair, _) => tuple(&pair.to_array())?,
            Slot::Image(Some(image)) => self.paths.image(*image)?,
            Slot::Profile(texture) => self.paths.image_of(*texture)?,
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
            Slot::Whole(value, ..) | Slot::OptionalWhole(Some(value), ..) => value.to_string(),
            Slot::OptionalWhole(None, ..) => "None".to_owned(),
            Slot::Seed(seed) => seed.to_string(),
            Slot::Size([width, height]) => format!("({width}, {height})"),
            Slot::Transport(transport) => format!("{transport:?}"),
            Slot::Sharing(sharing) => match sharing {
                Sharing::Groups(pixels) => pixels.to_string(),
                _ => format!("{sharing:?}"),
            },
            Slot::Caustics(Caustics::Photons { photons, radius }) => {
                format!("(photons: {}, radius: {})", number(*photons)?, number(*radius)?)
            }
            Slot::Caustics(caustics) => format!("{caustics:?}"),
            Slot::Background(background) | Slot::OptionalBackground(Some(background)) => match background {
                Background::Constant(radiance) => color(*radiance)?,
                Background::Gradient { bottom, top } => gradient(*bottom, *top)?,
            },
            Slot::Backplate(Some(plate)) => self.backplate(plate)?,
            Slot::Exposure(is_chosen) => if *is_chosen { "Auto" } else { "Fixed" }.to_owned(),
            Slot::Aovs(aovs) if aovs[..] == *Aov::IMAGE => "All".to_owned(),
            Slot::Aovs(aovs) => format!("{aovs:?}"),
            Slot::Triangle(corners) => vectors(corners.map(|it| it.to_array()))?,
            Slot::Quadrilateral(corners) => vectors(corners.map(|it| it.to_array()))?,
            Slot::CornerVectors(Some(corners)) => vectors(corners.map(|it| it.to_array()))?,
            Slot::CornerUvs(Some(corners)) => pairs(corners)?,
            Slot::Pairs(_) | Slot::PairLists(_) | Slot::Path(_) | Slot::Numbers(..) => lists(&slot)?,
            Slot::Strands(strands) => self.paths.strands(*strands)?,
            Slot::Font(font) => self.paths.font(*font)?,
            Slot::Text(text) => quote(text)?,
            Slot::Mesh(mesh) => self.paths.mesh(*mesh)?,
            Slot::Inline(_)
            | Slot::OptionalBackground(None)
            | Slot::Backplate(None)
            | Slot::OptionalNumber(None, _)
            | Slot::ChannelMap(None, _)
            | Slot::DataMap(None)
            | Slot::Image(None)
            | Slot::Normals(None)
            | Slot::CornerVectors(None)
            | Slot::CornerUvs(None)
            | Slot::Bumps(None) => return Ok(None),
        };
        Ok(Some(text))
    }

    fn backplate(&self, plate: &Backplate) -> Written {
        match plate {
            Backplate::Constant(shown) => color(*shown),
            Backplate::Gradient { bottom, top } => gradient(*bottom, *top),
            Backplate::Image(file) => Ok(format!("Image({})", self.paths.picture(file)?)),
        }
    }

    /// Returns `Name`, or `Name(key: value, …)` with all numbers (which `--set` may multiply) and all other fields that
    /// are required or not at their defaults.
    pub(super) fn form(&self, form: &mut dyn Forms) -> Written {
        let (name, mut defaults) = (form.names()[form.form()], form.defaults());
        if let [Field { name: "", .. }] = form.fields()[..] {
            let value = form.fields().pop().map_or(Ok(None), |field| self.value(field.slot))?;
            return Ok(format!("{name}({})", value.unwrap_or_default()));
        }
        let mut keys = Keys::default();
        let fields = form.fields();
        let has_fields = !fields.is_empty();
        for (Field { name, required, slot, .. }, default) in fields.into_iter().zip(defaults.fields()) {
            let is_number =
                matches!(slot, Slot::Number(..) | Slot::Degrees(..) | Slot::Azimuth(_) | Slot::Extents(_));
            let text = match required || is_number {
                true => self.value(slot)?,
                false => self.unless_default(slot, default.slot)?,
            };
            if let Some(text) = text {
                keys.push(name, text);
            }
        }
        Ok(if has_fields { keys.finish(name) } else { name.to_owned() })
    }
}

/// A gradient from the bottom to the top.
fn gradient(bottom: Rgb, top: Rgb) -> Written {
    Ok(format!("Gradient(bottom: {}, top: {})", color(bottom)?, color(top)?))
}

/// The lists of numbers and points of a shape.
fn lists(slot: &Slot) -> Written {
    let pairs = |points: &[Vec2]| list(points.iter().map(|point| tuple(&point.to_array())));
    match slot {
        Slot::Pairs(points) => pairs(points),
        Slot::PairLists(all) => list(all.iter().map(|points| pairs(points))),
        Slot::Path(points) => list(points.iter().map(|point| tuple(&point.to_array()))),
        Slot::Numbers(values, _) => match &values[..] {
            [single] => number(*single),
            _ => list(values.iter().map(|value| number(*value))),
        },
        _ => Ok(String::new()),
    }
}
