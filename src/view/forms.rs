//! The forms of the page, made from the tables of components ([`crate::world::fields`]): the fields of the settings, of
//! materials with their textures, of lights, cameras, shapes and transforms, each with its value, unit and range.

mod texture;

use std::collections::HashMap;

use hecs::Entity;
use serde_json::{Value, json};

use crate::formats::ron::{ValueWriter, transform_parts};
use crate::world::fields::{Field, Forms, Quantity, Range, Slot, all_fields};
use crate::world::ineffective::{
    FieldContext, OF_BLINN_PHONG, OF_CAMERAS, OF_LIGHTS, OF_PRINCIPLED, OF_SETTINGS, reason,
};
use crate::world::{Camera, ColorInput, FromModel, Light, Material, MaterialId, Shape, Transform, World};

/// The most forms that the page lists.
const MOST_FORMS: usize = 2000;

/// A thing with a form.
pub struct FormTarget {
    /// The part of a statement before the field, such as `"lamp".light`.
    pub statement: String,
    /// One of [`KINDS`].
    pub kind: &'static str,
    /// The name of the material or entity.
    pub name: String,
    part: FormPart,
}

enum FormPart {
    Settings,
    Material(MaterialId),
    Light(Entity),
    Camera(Entity),
    Shape(Entity),
    Transform(Entity),
}

/// The kinds of things, in their order.
const KINDS: [&str; 6] = ["settings", "material", "light", "camera", "shape", "transform"];

impl FormTarget {
    fn entity(&self) -> Option<Entity> {
        match self.part {
            FormPart::Settings | FormPart::Material(_) => None,
            FormPart::Light(entity)
            | FormPart::Camera(entity)
            | FormPart::Shape(entity)
            | FormPart::Transform(entity) => Some(entity),
        }
    }
}

/// The things that have a form: those that a name distinguishes.
pub fn targets(world: &World) -> Vec<FormTarget> {
    let order = world.in_order();
    let mut counts: HashMap<String, usize> = HashMap::new();
    for entity in &order {
        *counts.entry(world.name_of(*entity)).or_default() += 1;
    }
    // In a query, a * stands for any text.
    let is_clear = |name: &str| !name.contains('*');
    let mut found = vec![FormTarget {
        statement: "settings".into(),
        kind: "settings",
        name: "settings".into(),
        part: FormPart::Settings,
    }];
    let mut add = |statement: String, kind: &'static str, name: &str, part: FormPart| {
        found.push(FormTarget { statement, kind, name: name.to_owned(), part });
    };
    for (number, named) in world.assets.materials.iter().enumerate() {
        if let Some(name) = named.name.as_deref().filter(|name| is_clear(name)) {
            add(
                format!("Material[{name:?}]"),
                "material",
                name,
                FormPart::Material(MaterialId(number as u32)),
            );
        }
    }
    for entity in order {
        let name = world.name_of(entity);
        if !is_clear(&name) || counts.get(&name) != Some(&1) {
            continue;
        }
        if world.entities.satisfies::<&Camera>(entity) {
            add(format!("Camera[name={name:?}].camera"), "camera", &name, FormPart::Camera(entity));
        }
        if world.entities.satisfies::<&Light>(entity) {
            add(format!("{name:?}.light"), "light", &name, FormPart::Light(entity));
        }
        let own = world.entities.get::<&MaterialId>(entity).ok().map(|id| *id);
        let is_from_model = world.entities.satisfies::<&FromModel>(entity);
        let is_unnamed = |id: &MaterialId| {
            world.assets.materials.get(id.0 as usize).is_some_and(|named| named.name.is_none())
        };
        if let Some(id) = own.filter(|id| !is_from_model && is_unnamed(id)) {
            add(format!("{name:?}.material"), "material", &name, FormPart::Material(id));
        }
        if world.entities.satisfies::<&Shape>(entity) && !is_from_model {
            add(format!("{name:?}.shape"), "shape", &name, FormPart::Shape(entity));
        }
        let is_camera = world.entities.satisfies::<&Camera>(entity);
        let query = if is_camera { format!("Camera[name={name:?}]") } else { format!("{name:?}") };
        add(format!("{query}.transform"), "transform", &name, FormPart::Transform(entity));
    }
    // The first ones are those of which there are few.
    found.sort_by_key(|target| KINDS.iter().position(|kind| *kind == target.kind));
    found.truncate(MOST_FORMS);
    found
}

/// The form of a thing: the name of its model or form, and its fields. None if the world has no such thing.
pub fn form(world: &World, statement: &str) -> Option<Value> {
    let target = targets(world).into_iter().find(|target| target.statement == statement)?;
    let context = FieldContext { world, entity: target.entity() };
    let of_forms = |forms: &mut dyn Forms, reason: FieldReason| {
        let fields = FormWriter::new(world, reason).values(forms.fields(), "");
        (forms.names()[forms.form()].to_owned(), fields)
    };
    let (form, fields) = match target.part {
        FormPart::Settings => {
            let idle = |path: &str| reason(OF_SETTINGS, &world.settings, &context, path);
            (
                "Settings".to_owned(),
                FormWriter::new(world, &idle).values(all_fields(&mut world.settings.clone()), ""),
            )
        }
        FormPart::Material(id) => {
            let material = &world.assets.materials.get(id.0 as usize)?.material;
            let idle = |path: &str| match material {
                Material::Principled(material) => reason(OF_PRINCIPLED, material, &context, path),
                Material::BlinnPhong(material) => reason(OF_BLINN_PHONG, material, &context, path),
            };
            let mut copy = material.clone();
            let part = copy.part();
            (part.what().to_owned(), FormWriter::new(world, &idle).values(all_fields(part), ""))
        }
        FormPart::Light(entity) => {
            let light = (*world.entities.get::<&Light>(entity).ok()?).clone();
            of_forms(&mut light.clone(), &|path| reason(OF_LIGHTS, &light, &context, path))
        }
        FormPart::Camera(entity) => {
            let mut camera = world.entities.get::<&Camera>(entity).ok().map(|it| *it)?;
            let own = camera;
            of_forms(&mut camera, &|path| reason(OF_CAMERAS, &own, &context, path))
        }
        FormPart::Shape(entity) => {
            of_forms(&mut (*world.entities.get::<&Shape>(entity).ok()?).clone(), &|_| None)
        }
        FormPart::Transform(entity) => {
            let own = world.entities.get::<&Transform>(entity).map(|it| *it).unwrap_or_default();
            ("Transform".to_owned(), of_transform(&own))
        }
    };
    let FormTarget { statement, kind, name, .. } = target;
    Some(json!({"statement": statement, "kind": kind, "name": name, "form": form, "fields": fields}))
}

/// The fields of a transform, in parts.
fn of_transform(transform: &Transform) -> Vec<Value> {
    let field = |name: &str, doc: &str, unit: &str, range: &str, value: [f64; 3]| {
        json!({
            "kind": "vector", "path": name, "name": name, "doc": doc, "unit": unit, "range": range, "value": value,
            "is_double": name == "translate", "without_effect": null,
        })
    };
    let Some([translate, rotate, scale]) = transform_parts(transform) else {
        let why = "a matrix that shears is changed in the scene's file";
        return vec![
            json!({"kind": "fixed", "path": "", "name": "matrix", "doc": "", "why": why, "without_effect": null}),
        ];
    };
    vec![
        field("translate", "moves it, after scale and rotation", "m", "", translate),
        field("rotate_degrees", "about the fixed X axis, then Y, then Z", "°", "", rotate),
        field("scale", "a factor for each axis; negative values mirror", "", "not 0", scale),
    ]
}

/// The reason why the field at a path does nothing, if it does.
type FieldReason<'a> = &'a dyn Fn(&str) -> Option<&'static str>;

/// Describes the fields of a form.
struct FormWriter<'a> {
    world: &'a World,
    reason: FieldReason<'a>,
}

impl<'a> FormWriter<'a> {
    fn new(world: &'a World, reason: FieldReason<'a>) -> Self {
        FormWriter { world, reason }
    }

    fn values(&self, fields: Vec<Field>, prefix: &str) -> Vec<Value> {
        let named = fields.into_iter().filter(|field| !field.name.is_empty());
        named.map(|field| self.value(field, prefix)).collect()
    }

    /// A field with its value. `kind` says how the page edits it: `flag`, `number`, `color`, `vector`, `choice`, `texture`,
    /// `text`, `part` (fields of its own), `absent` (a part that may be added) or `fixed`.
    fn value(&self, field: Field, prefix: &str) -> Value {
        let Field { name, doc, mut slot, .. } = field;
        let path = format!("{prefix}{name}");
        let unit = unit_of(name, &slot);
        let may_be_pattern = matches!(slot, Slot::ColorMap(..) | Slot::NumberMap(..));
        let mut described = match self.texture_of(&mut slot, &path) {
            Some(texture) => texture,
            None => {
                let mut plain = self.plain(slot, &path);
                if may_be_pattern {
                    plain["textures"] = json!(texture::names());
                }
                plain
            }
        };
        described["without_effect"] = json!((self.reason)(&path));
        described["path"] = json!(path);
        described["name"] = json!(name);
        described["doc"] = json!(doc.trim());
        described["unit"] = json!(unit);
        described
    }

    /// The value of a field that is no texture.
    fn plain(&self, slot: Slot, path: &str) -> Value {
        let inner = format!("{path}.");
        let number = |value: Option<f32>, range: Range| {
            let [least, most] = limits(range);
            let range = range.to_string();
            json!({"kind": "number", "value": value, "range": range, "min": least, "max": most})
        };
        let whole = |value: Option<i64>, least: i64, most: i64| {
            let range = format!("from {least} to {most}");
            json!({"kind": "number", "value": value, "range": range, "min": least, "max": most, "step": 1})
        };
        let color = |value: &[f32; 3], range: Range| json!({"kind": "color", "value": value, "range": range.to_string()});
        let vector = |value: &[f32], range: Range| json!({"kind": "vector", "value": value, "range": range.to_string()});
        match slot {
            Slot::Flag(flag) => json!({"kind": "flag", "value": *flag}),
            Slot::Number(value, range) => number(Some(*value), range),
            Slot::OptionalNumber(value, range) => number(*value, range),
            Slot::Degrees(angle, range) => number(Some(angle.to_degrees()), range),
            Slot::Azimuth(angle) => number(Some(angle.to_degrees()), Range::Finite),
            Slot::Whole(value, least, most) => whole(Some((*value).into()), least.into(), most.into()),
            Slot::OptionalWhole(value, least, most) => whole(value.map(i64::from), least.into(), most.into()),
            Slot::Priority(value) => json!({"kind": "number", "value": *value, "range": "whole", "step": 1}),
            Slot::Color(value, range) => color(&value.to_array(), range),
            Slot::ColorMap(ColorInput::Constant(value), range) => color(&value.to_array(), range),
            Slot::NumberMap(input, _) if input.texture.is_none() => number(Some(input.factor), Range::UNIT),
            Slot::Form(forms) => {
                let (names, at) = (forms.names(), forms.form());
                let fields = self.values(forms.fields(), &inner);
                json!({"kind": "choice", "value": names[at], "names": names, "fields": fields})
            }
            Slot::Part(part) => json!({"kind": "part", "fields": self.values(all_fields(part), &inner)}),
            Slot::OptionalPart(part) => match part.part() {
                Some(part) => json!({"kind": "part", "fields": self.values(all_fields(part), &inner)}),
                None => json!({"kind": "absent"}),
            },
            Slot::Vector(value, _) => vector(&value.to_array(), Range::Finite),
            Slot::Extents(value) => vector(&value.to_array(), Range::Above0),
            Slot::Sides(value) => vector(&value.to_array(), Range::Above0),
            Slot::Pair(value, range) => vector(&value.to_array(), range),
            Slot::Image(_) | Slot::Profile(_) | Slot::Strands(_) | Slot::Mesh(_) | Slot::Font(_) => {
                json!({"kind": "fixed", "why": "files are named in the scene's file"})
            }
            other => json!({"kind": "text", "value": ValueWriter::new(self.world).text(other)}),
        }
    }
}

/// The least and the greatest number of a range, as far as it has them.
fn limits(range: Range) -> [Option<f32>; 2] {
    match range {
        Range::Finite => [None, None],
        Range::Above0 | Range::Distance | Range::Light(_) => [Some(0.0), None],
        Range::From(least) => [Some(least), None],
        Range::FromTo(least, most) | Range::Between(least, most) => [Some(least), Some(most)],
        Range::UpTo(most) => [Some(0.0), Some(most)],
    }
}

/// The unit of a field, which its range or the end of its name gives.
fn unit_of(name: &str, slot: &Slot) -> &'static str {
    const ENDINGS: [(&str, &str); 7] = [
        ("_m", "m"),
        ("_mm", "mm"),
        ("_w", "W"),
        ("_s", "s"),
        ("_ev", "stops"),
        ("_degrees", "°"),
        ("_kelvin", "K"),
    ];
    match slot {
        Slot::Color(_, Range::Light(quantity)) | Slot::ColorMap(_, Range::Light(quantity)) => {
            match quantity {
                Quantity::Power(_) => "W",
                Quantity::Irradiance => "W m⁻²",
                Quantity::Radiance => "W m⁻² sr⁻¹",
            }
        }
        Slot::Degrees(..) | Slot::Azimuth(_) => "°",
        _ => ENDINGS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("", |(_, unit)| unit),
    }
}

#[cfg(test)]
mod tests;
