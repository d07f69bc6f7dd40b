//! Reads the fields of a component by means of their table ([`crate::world::fields`]).

use super::Lowering;
use crate::error::LoadError;
use crate::formats::ron::source::{Raw, SceneText};
use crate::math::{Rgb, Vec2, Vec3};
use crate::world::Settings;
use crate::world::bounds::check_stops;
use crate::world::fields::{Field, Fields, Forms, Range, Slot, radians, visit_all};

/// The keys and values of a structure, in file order.
type Members<'a> = [(&'a str, Raw<'a>)];

/// Calls a function with each of some fields.
type VisitFields<'f> = dyn FnMut(&mut dyn FnMut(Field)) + 'f;

impl<'a> Lowering<'_, 'a> {
    /// Sets the fields given in `(key: value, …)`; all others keep their values.
    pub(super) fn structure(&mut self, raw: Raw<'a>, to: &mut dyn Fields) -> Result<(), LoadError> {
        let what = to.what();
        let members = self.source.structure(raw, what)?;
        self.fill(&members, (what, raw.0), None, &mut |each| visit_all(to, &mut |field| each(field)))
    }

    /// Sets the fields given by `members`; messages name the `owner` of a field, if there is one.
    pub(super) fn fill(
        &mut self,
        members: &Members<'a>,
        (what, place): (&str, &str),
        owner: Option<&str>,
        fields: &mut VisitFields,
    ) -> Result<(), LoadError> {
        let source = self.source;
        // A key that is misspelt is not missing, too.
        let is_spelt = source.recover(source.check_keys(members, what, fields))?.is_some();
        let mut result = Ok(());
        fields(&mut |mut field| {
            field.required &= !members.iter().any(|(key, _)| field.alternative == Some(*key));
            let given = members.iter().find(|(key, _)| field.is_called(key)).map(|(_, raw)| *raw);
            if result.is_ok() && (is_spelt || given.is_some()) {
                result = source.recover(self.set(given, (what, place), owner, field)).map(drop);
            }
        });
        result
    }

    /// Sets a field to the value that is given, if there is one.
    fn set(
        &mut self,
        given: Option<Raw<'a>>,
        (what, place): (&str, &str),
        owner: Option<&str>,
        Field { name, required, slot, .. }: Field,
    ) -> Result<(), LoadError> {
        match (given.and_then(|raw| self.source.optional(raw)), slot) {
            (Some(raw), mut slot) => {
                let Some(owner) = owner else { return self.read(raw, name, slot) };
                // Only errors name the owner.
                if let Slot::Number(to, range) = &mut slot
                    && let Ok(number) = self.source.number_in(raw, name, *range)
                {
                    **to = number;
                    return Ok(());
                }
                self.read(raw, &format!("the {owner}'s {name}"), slot)
            }
            (None, _) if required => {
                Err(self.source.error(place, format!("{what} needs the field \"{name}\"")))
            }
            (None, Slot::OptionalNumber(to, _)) if given.is_some() => {
                *to = None;
                Ok(())
            }
            (None, Slot::OptionalWhole(to, ..)) if given.is_some() => {
                *to = None;
                Ok(())
            }
            (None, _) => Ok(()),
        }
    }

    fn read(&mut self, raw: Raw<'a>, name: &str, slot: Slot) -> Result<(), LoadError> {
        let source = self.source;
        match slot {
            Slot::Flag(to) => *to = source.flag(raw)?,
            Slot::Number(to, range) => *to = source.number_in(raw, name, range)?,
            Slot::OptionalNumber(to, range) => *to = Some(source.number_in(raw, name, range)?),
            Slot::Degrees(to, range) => {
                let degrees: f64 = source.number(raw)?;
                if !range.contains(degrees as f32) {
                    return Err(source.out_of_range(raw, name, &format!("{range} degrees")));
                }
                *to = radians(degrees);
            }
            Slot::Azimuth(to) => *to = radians(source.number::<f64>(raw)?.rem_euclid(360.0)),
            Slot::Vector(to, z) => *to = source.vector(raw, z)?,
            Slot::Stops(to) => *to = source.stops(raw)?,
            Slot::Sides(to) => *to = source.sides(raw, name)?,
            Slot::Extents(to) => *to = source.extents(raw, name)?,
            Slot::Pair(to, range) => {
                *to = source.vec2(raw)?;
                if ![to.x, to.y].into_iter().all(|part| range.contains(part)) {
                    return Err(source.out_of_range(raw, name, &range.to_string()));
                }
            }
            Slot::Image(to) => *to = Some(self.assets.image(source, raw, &mut self.world)?),
            Slot::Profile(to) => *to = self.profile(raw)?,
            Slot::Priority(to) => *to = source.priority(raw)?,
            Slot::Color(to, range) => {
                *to = source.color(raw, name, range.quantity())?;
                if !to.to_array().iter().all(|part| range.contains(*part)) {
                    return Err(source.out_of_range(raw, name, &range.to_string()));
                }
            }
            Slot::ColorMap(to, Range::UNIT) => *to = self.reflectance(raw, name)?,
            Slot::ColorMap(to, range) => *to = self.color_input(raw, name, range.quantity())?,
            Slot::NumberMap(to, usual) => *to = self.scalar_input(raw, name, usual)?,
            Slot::ChannelMap(to, usual) => *to = Some(self.channel_input(raw, usual)?),
            Slot::DataMap(to) => *to = Some(self.data_input(raw)?),
            Slot::Normals(to) => *to = Some(self.normal_map(raw)?),
            Slot::Bumps(to) => *to = Some(self.bump_map(raw)?),
            Slot::Whole(to, least, most) => {
                *to = source.whole(raw, name, least.into(), most.into())? as u32;
            }
            Slot::OptionalWhole(to, least, most) => {
                *to = Some(source.whole(raw, name, least.into(), most.into())? as u32);
            }
            Slot::Seed(to) => *to = source.whole(raw, name, 0, u64::MAX)?,
            Slot::Size(to) => *to = source.size(raw, Settings::MOST_PIXELS_A_SIDE)?,
            Slot::Transport(to) => *to = source.transport(raw)?.unwrap_or_default(),
            Slot::Sharing(to) => *to = source.sharing(raw)?,
            Slot::Caustics(to) => *to = self.caustics(raw)?,
            Slot::Background(to) => *to = self.background(raw)?,
            Slot::OptionalBackground(to) => *to = Some(self.background(raw)?),
            Slot::Backplate(to) => *to = Some(self.backplate(raw)?),
            Slot::Exposure(to) => *to = source.exposure(raw)?,
            Slot::Aovs(to) => *to = source.aovs(raw)?,
            Slot::Triangle(to) => *to = source.triangle(raw)?,
            Slot::Quadrilateral(to) => *to = source.quadrilateral(raw)?,
            Slot::CornerVectors(to) => *to = Some(source.three_vectors(raw)?),
            Slot::CornerUvs(to) => {
                let corners: [Raw; 3] = source.tuple(raw, "three pairs ((u, v), (u, v), (u, v))")?;
                let mut uvs = [Vec2::ZERO; 3];
                for (uv, raw) in uvs.iter_mut().zip(corners) {
                    *uv = source.vec2(raw)?;
                }
                *to = Some(uvs);
            }
            Slot::Pairs(to) => *to = source.items(raw, "pairs", |raw| source.vec2(raw))?,
            Slot::PairLists(to) => {
                *to = source
                    .items(raw, "lists of pairs", |raw| source.items(raw, "pairs", |raw| source.vec2(raw)))?;
            }
            Slot::Path(to) => *to = source.items(raw, "points (x, y, z)", |raw| source.vec3(raw))?,
            Slot::Numbers(to, range) => {
                let single = |raw| source.number_in(raw, name, range);
                *to = match raw.0.starts_with(['[', '(']) {
                    true => source.items(raw, "numbers", single)?,
                    false => vec![single(raw)?],
                };
            }
            Slot::Strands(to) => *to = self.assets.strands(source, raw, &mut self.world)?,
            Slot::Font(to) => *to = self.assets.font(source, raw, &mut self.world)?,
            Slot::Text(to) => *to = source.string(raw, name)?,
            Slot::Mesh(to) => *to = self.assets.mesh(source, raw, &mut self.world)?,
            Slot::Part(to) | Slot::Inline(to) => self.structure(raw, to)?,
            Slot::OptionalPart(to) => self.structure(raw, to.insert())?,
            Slot::Form(to) => self.form(raw, to)?,
        }
        Ok(())
    }

    /// Reads `Name` or `Name(key: value, …)`.
    pub(super) fn form(&mut self, raw: Raw<'a>, to: &mut dyn Forms) -> Result<(), LoadError> {
        let (source, names, kind) = (self.source, to.names(), to.kind());
        let Some(variant) = source.variant(raw) else {
            let article = if kind.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
            return Err(source.expected_name(raw, &format!("{article} {kind}"), names));
        };
        let found = names.iter().position(|name| *name == variant.name);
        to.set_form(found.ok_or_else(|| source.unknown(variant.name, kind, names))?);
        let fields = to.fields();
        if fields.is_empty() {
            return source.no_fields(variant);
        }
        if let [Field { name: "", .. }] = fields[..] {
            let body = Raw(variant.body.unwrap_or(variant.name));
            let [only] = source.tuple(body, &format!("{}(\"path\")", variant.name))?;
            return fields.into_iter().try_for_each(|field| self.read(only, variant.name, field.slot));
        }
        let members = source.members(variant.body.unwrap_or("()"), variant.name)?;
        self.fill(&members, (variant.name, variant.name), Some(kind), &mut |each| {
            to.fields().into_iter().for_each(&mut *each)
        })
    }
}

impl<'a> SceneText<'a> {
    /// A number in a range; `name` is the name of its field.
    pub(super) fn number_in(&self, raw: Raw<'a>, name: &str, range: Range) -> Result<f32, LoadError> {
        let number = self.number(raw)?;
        if range.contains(number) {
            Ok(number)
        } else {
            Err(self.out_of_range(raw, name, &range.to_string()))
        }
    }

    /// `(x, y, z)`, one number for all three, or `(x, y)`, to which `z` belongs.
    fn vector(&self, raw: Raw<'a>, z: f32) -> Result<Vec3, LoadError> {
        self.keyed(raw, |raw| {
            if !raw.0.starts_with('(') {
                return self.number(raw).map(Vec3::splat);
            }
            if let Ok([x, y]) = self.tuple(raw, "") {
                return Ok(Vec3::new(self.number(x)?, self.number(y)?, z));
            }
            self.vec3(raw)
        })
    }

    /// `[(number, colour), …]`, the numbers from 0 to 1 and in order.
    fn stops(&self, raw: Raw<'a>) -> Result<Vec<(f32, Rgb)>, LoadError> {
        let items = self.list(raw, "a list of (number, colour)")?;
        let mut stops = Vec::with_capacity(items.len());
        for item in &items {
            let [at, color] = self.tuple(*item, "(number, colour)")?;
            stops.push((self.number(at)?, self.color(color, "the colour of a stop", None)?));
        }
        check_stops(&stops).map_err(|(number, reason)| self.error(items[number].0, reason))?;
        if stops.is_empty() {
            return Err(self.error(raw.0, "there are no stops: give two or more, [(0, colour), (1, colour)]"));
        }
        Ok(stops)
    }

    /// A number or `(width, height)`, each above 0.
    fn sides(&self, raw: Raw<'a>, name: &str) -> Result<Vec2, LoadError> {
        let side = |raw| self.number_in(raw, name, Range::Above0);
        self.keyed(raw, |raw| {
            if !raw.0.starts_with('(') {
                return side(raw).map(Vec2::splat);
            }
            let [width, height] = self.tuple(raw, "(width, height)")?;
            Ok(Vec2::new(side(width)?, side(height)?))
        })
    }

    /// A list in square brackets or, as Python writes arrays, in parentheses.
    fn items<T>(
        &self,
        raw: Raw<'a>,
        what: &str,
        read: impl Fn(Raw<'a>) -> Result<T, LoadError>,
    ) -> Result<Vec<T>, LoadError> {
        if !raw.0.starts_with(['[', '(']) {
            return Err(self.expected(raw, &format!("a list of {what} in square brackets")));
        }
        self.values(raw.0).map(|item| read(Raw(item))).collect()
    }

    /// A number or `(x, y, z)`, each above 0.
    fn extents(&self, raw: Raw<'a>, name: &str) -> Result<Vec3, LoadError> {
        let side = |raw| self.number_in(raw, name, Range::Above0);
        self.keyed(raw, |raw| {
            if !raw.0.starts_with('(') {
                return side(raw).map(Vec3::splat);
            }
            let [x, y, z] = self.tuple(raw, "(x, y, z)")?;
            Ok(Vec3::new(side(x)?, side(y)?, side(z)?))
        })
    }

    /// Returns an error for an unknown key, or a second key for the same field.
    fn check_keys(
        &self,
        members: &Members<'a>,
        what: &str,
        fields: &mut VisitFields,
    ) -> Result<(), LoadError> {
        let mut is_known = vec![false; members.len()];
        let mut second = None;
        fields(&mut |field| {
            let mut given = false;
            for ((key, _), is_known) in members.iter().zip(&mut is_known) {
                if !*is_known && field.is_called(key) {
                    *is_known = true;
                    if std::mem::replace(&mut given, true) && second.is_none() {
                        second = Some((*key, field.name));
                    }
                }
            }
        });
        if let Some(unknown) = is_known.iter().position(|is_known| !is_known) {
            let mut known = Vec::new();
            fields(&mut |field| known.extend(std::iter::once(&field.name).chain(field.aliases).copied()));
            return Err(self.unknown_field(members[unknown].0, what, &known));
        }
        match second {
            Some((key, name)) => Err(self.error(key, format!("{what} has the field \"{name}\" twice"))),
            None => Ok(()),
        }
    }
}
