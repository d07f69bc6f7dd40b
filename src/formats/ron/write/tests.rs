//! Generates the tables of `scenes/README.md` and the types of the Python module from the code, and checks that they are
//! up to date.

use std::collections::BTreeMap;
use std::path::Path;

use super::assets::AssetPaths;
use super::texture::WrittenTextures;
use crate::math::Rgb;
use crate::tests::is_up_to_date;
use crate::world::fields::{Field, Fields, Forms, Range, Slot, all_fields};
use crate::world::{
    AlphaMode, Anisotropy, Aov, Assets, BlinnPhong, Camera, ColorInput, Combination, Falloff, Iridescence,
    Light, Modifier, PatternPlacement, PixelFilter, Principled, ScatteredCopies, Settings, Shape, Stereo,
    TexturePattern, Volume,
};

/// The human-readable type of a field.
fn kind(slot: &mut Slot) -> String {
    let bounded = |noun: &str, range: &Range| match range {
        Range::Finite => noun.to_owned(),
        Range::Above0 | Range::Distance => format!("{noun}, above 0"),
        Range::Between(least, most) => format!("{noun}, above {least} and below {most}"),
        Range::From(least) => format!("{noun}, at least {least}"),
        Range::Light(_) => unreachable!("of colours only"),
        Range::FromTo(least, most) => format!("{noun}, {least} to {most}"),
        Range::UpTo(most) => format!("{noun}, above 0 and at most {most}"),
    };
    let color = |noun: &str, range: &Range| match range {
        Range::FromTo(_, most) => format!("{noun}, up to {most}"),
        Range::Light(quantity) => {
            let units: Vec<_> = quantity.units().iter().map(|(unit, _)| format!("`{unit}`")).collect();
            format!("{noun}, also in {}", units.join(" or "))
        }
        _ => noun.to_owned(),
    };
    match slot {
        Slot::Flag(_) => "`true` or `false`".into(),
        Slot::Number(_, range) | Slot::OptionalNumber(_, range) => bounded("number", range),
        Slot::Degrees(_, range) => bounded("degrees", range),
        Slot::Azimuth(_) => "degrees".into(),
        Slot::Vector(..) => "number or (x, y, z)".into(),
        Slot::Stops(_) => "`[(number, colour), …]`".into(),
        Slot::Sides(_) => "number or (width, height), m".into(),
        Slot::Extents(_) => "number or (x, y, z), m".into(),
        Slot::Pair(_, range) => bounded("(x, y)", range),
        Slot::Image(_) | Slot::Profile(_) => "path".into(),
        Slot::Priority(_) => "whole number, -1000 to 1000".into(),
        Slot::Color(_, range) => color("colour", range),
        Slot::ColorMap(_, range) => color("map", range),
        Slot::NumberMap(..) => "number map".into(),
        Slot::ChannelMap(..) => "texture, one channel".into(),
        Slot::DataMap(_) => "texture".into(),
        Slot::Normals(_) => "texture or `(texture: texture, scale: number)`".into(),
        Slot::Bumps(_) => "`(texture: texture, height_m: m)`".into(),
        Slot::Whole(_, least, most) => format!("{} to {}", grouped(*least), grouped(*most)),
        Slot::OptionalWhole(_, least, most) => {
            format!("{} to {} or `None`", grouped(*least), grouped(*most))
        }
        Slot::Seed(_) => "whole number".into(),
        Slot::Size(_) => {
            format!("(width, height), pixels, each 1 to {}", grouped(Settings::MOST_PIXELS_A_SIDE))
        }
        Slot::Transport(_) => "`Whitted`, `Path` or `Auto`".into(),
        Slot::Sharing(_) => "`Auto`, `Off`, or 2, 4, 8, 16, 32 or 64".into(),
        Slot::Caustics(_) => "`Auto`, `Off` or `(photons: number, radius: pixels)`".into(),
        Slot::Background(_) => "colour or `Gradient(bottom: colour, top: colour)`".into(),
        Slot::OptionalBackground(_) => "colour, `Gradient(bottom: colour, top: colour)` or `None`".into(),
        Slot::Backplate(_) => {
            "colour, `Gradient(bottom: colour, top: colour)`, `Image(path)` or `None`".into()
        }
        Slot::Exposure(_) => "`Fixed` or `Auto`".into(),
        Slot::Aovs(_) => {
            let names: Vec<String> = Aov::ALL.iter().map(|aov| format!("`{aov:?}`")).collect();
            format!("`All` or a list of {}", names.join(", "))
        }
        Slot::Triangle(_) => "3 vectors, m".into(),
        Slot::Quadrilateral(_) => "4 vectors, m".into(),
        Slot::CornerVectors(_) => "3 vectors".into(),
        Slot::CornerUvs(_) => "3 pairs (u, v)".into(),
        Slot::Pairs(_) => "list of pairs, m".into(),
        Slot::PairLists(_) => "list of lists of pairs, m".into(),
        Slot::Path(_) => "list of vectors, m".into(),
        Slot::Numbers(_, range) => format!("{}, or a list", bounded("number", range)),
        Slot::Strands(_) | Slot::Font(_) => "path".into(),
        Slot::Text(_) => "string".into(),
        Slot::Mesh(_) => "path of a `.ply`, `.obj` or `.stl` file, relative to the scene's folder; `car.obj#wheel` is one object of it".into(),
        Slot::Inline(_) => unreachable!("fields of the structure itself"),
        Slot::Part(part) => keys(part.fields()),
        Slot::OptionalPart(part) => keys(part.insert().fields()),
        Slot::Form(form) => {
            let names: Vec<String> = (0..form.names().len())
                .map(|index| {
                    form.set_form(index);
                    let fields: Vec<String> = form.fields().iter_mut().map(key_and_kind).collect();
                    let body =
                        if fields.is_empty() { String::new() } else { format!("({})", fields.join(", ")) };
                    format!("`{}{body}`", form.names()[index])
                })
                .collect();
            let (last, first) = names.split_last().expect("forms");
            format!("{} or {last}", first.join(", "))
        }
    }
}

/// A number with commas between thousands.
fn grouped(number: u32) -> String {
    let digits = number.to_string();
    let comma = |i: usize| i > 0 && (digits.len() - i).is_multiple_of(3);
    digits.char_indices().map(|(i, c)| if comma(i) { format!(",{c}") } else { c.to_string() }).collect()
}

fn key_and_kind(field: &mut Field) -> String {
    format!("{}: {}", field.name, kind(&mut field.slot))
}

fn keys(fields: Vec<Field>) -> String {
    let names: Vec<&str> = fields.iter().map(|field| field.name).collect();
    format!("`({}: …)`", names.join(": …, "))
}

/// A default value as in a scene file.
fn default_text(slot: Slot) -> String {
    let is_part = matches!(slot, Slot::Part(_));
    let is_infinite = matches!(&slot, Slot::Number(value, _) if value.is_infinite());
    let is_transport = matches!(slot, Slot::Transport(_));
    let assets = Assets::default();
    let paths = AssetPaths::numbers(&assets);
    let textures = WrittenTextures::new(&paths);
    match if is_infinite { None } else { textures.value(slot).expect("a default") } {
        _ if is_transport => "`Auto`".to_owned(),
        Some(text) if text == "[]" => "none".to_owned(),
        None if is_part => "all defaults".to_owned(),
        None => "none".to_owned(),
        Some(text) if text.starts_with(|c: char| c.is_ascii_alphabetic()) => format!("`{text}`"),
        Some(text) => text,
    }
}

/// A table with a row for each field.
fn table(part: &mut dyn Fields) -> String {
    let mut text = "| field | type | default | meaning |\n|---|---|---|---|\n".to_owned();
    let (mut plain, mut glass) = (part.defaults(&|_| false), part.defaults(&|key| key == "ior"));
    let defaults = all_fields(&mut *plain).into_iter().zip(all_fields(&mut *glass));
    for (mut field, (plain, glass)) in all_fields(part).into_iter().zip(defaults) {
        let names = std::iter::once(&field.name).chain(field.aliases);
        let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
        let (mut default, with_ior) = (default_text(plain.slot), default_text(glass.slot));
        if with_ior != default {
            default += &format!(", or {with_ior} with an `ior`");
        }
        let (names, kind, meaning) = (names.join(" or "), kind(&mut field.slot), field.doc.trim());
        text += &format!("| {names} | {kind} | {default} | {meaning} |\n");
    }
    text
}

/// A table with a row for each field of each form.
fn table_of_forms(of: &mut dyn Forms) -> String {
    let mut text = format!("| {} | field | type | default | meaning |\n|---|---|---|---|---|\n", of.kind());
    for (index, form) in of.names().iter().enumerate() {
        of.set_form(index);
        let mut form = format!(" `{form}`");
        let mut defaults = of.defaults();
        for (mut field, default) in of.fields().into_iter().zip(defaults.fields()) {
            let default = if field.required { "—".to_owned() } else { default_text(default.slot) };
            let (name, kind, meaning) = (field.name, kind(&mut field.slot), field.doc.trim());
            if name.is_empty() {
                form = form.replace('`', "");
                text += &format!("| `{}(\"file\")` | | {kind} | — | |\n", form.trim());
                form.clear();
                continue;
            }
            text += &format!("|{form} | `{name}` | {kind} | {default} | {meaning} |\n");
            form.clear();
        }
    }
    text
}

/// The type of a field's values in Python.
fn python_type(slot: &Slot) -> &'static str {
    match slot {
        Slot::Flag(_) => "bool",
        Slot::Number(..) | Slot::OptionalNumber(..) | Slot::Degrees(..) | Slot::Azimuth(_) => "_Number",
        Slot::Whole(..) | Slot::OptionalWhole(..) | Slot::Seed(_) | Slot::Priority(_) => "int",
        Slot::Color(..) | Slot::ColorMap(..) => "_Color",
        Slot::NumberMap(..) => "_Number",
        Slot::Vector(..) => "float | ArrayLike",
        Slot::Stops(_) => "Sequence[tuple[float, _Color]]",
        Slot::Image(_) | Slot::Profile(_) | Slot::Strands(_) | Slot::Font(_) => "_Path",
        Slot::Text(_) => "str",
        Slot::Form(_) | Slot::ChannelMap(..) | Slot::DataMap(_) => "Variant",
        Slot::Part(_) | Slot::OptionalPart(_) | Slot::Bumps(_) => "Mapping[str, Any]",
        Slot::Normals(_) => "Variant | Mapping[str, Any]",
        _ => "ArrayLike",
    }
}

/// A class for a form, whose call has the form's fields as keywords.
fn python_class(name: &str, fields: &[Field]) -> String {
    let mut parameters = String::new();
    for Field { name, aliases, required, alternative, slot, .. } in fields {
        let default = if *required && alternative.is_none() { "" } else { " = ..." };
        for key in std::iter::once(name).chain(*aliases) {
            parameters += &format!("        {key}: {}{default},\n", python_type(slot));
        }
    }
    format!(
        "\nclass _{name}(Variant):\n    def __call__(  # type: ignore[override]\n        self,\n        *,\n{parameters}    ) -> Variant: ...\n\n{name}: _{name}\n"
    )
}

/// The end of the Python module's types: every form that its list names, with the fields of those that have a table.
fn python_forms() -> String {
    let mut classes = BTreeMap::new();
    let forms: [&mut dyn Forms; 7] = [
        &mut Modifier::Normals { smooth: 0.0 },
        &mut Combination::Add { a: ColorInput::default(), b: ColorInput::default() },
        &mut Shape::Sphere { radius_m: 1.0 },
        &mut Light::Point { power_w: Rgb::BLACK, falloff: Falloff::default(), radius_m: 0.0 },
        &mut Camera::Orthographic { height_m: 1.0 },
        &mut PixelFilter::Box,
        &mut AlphaMode::Opaque,
    ];
    for of in forms {
        for (index, form) in of.names().iter().enumerate() {
            of.set_form(index);
            let fields = of.fields();
            if fields.iter().any(|field| !field.name.is_empty()) {
                classes.insert(*form, python_class(form, &fields));
            }
        }
    }
    let mut pattern = TexturePattern::Checker;
    for (index, form) in TexturePattern::FORMS.iter().enumerate() {
        pattern.set_form(index);
        let mut place = PatternPlacement::default();
        let fields: Vec<Field> = pattern.fields().into_iter().chain(place.fields()).collect();
        // A background may be a gradient, too.
        if *form != "Gradient" {
            classes.insert(form, python_class(form, &fields));
        }
    }
    classes.insert("BlinnPhong", python_class("BlinnPhong", &all_fields(&mut BlinnPhong::default())));
    classes.insert("Principled", python_class("Principled", &all_fields(&mut Principled::default())));
    let module = read("src/python/rayfront/__init__.py");
    let (_, list) = module.split_once("_FORMS = \"\"\"").expect("the list of forms");
    let names = list.split("\"\"\"").next().unwrap_or_default().split_whitespace();
    names.map(|name| classes.remove(name).unwrap_or_else(|| format!("{name}: Variant\n"))).collect()
}

fn read(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("a file of ours")
}

#[test]
fn types_of_the_python_module_are_as_the_code() {
    const MARK: &str = "# The forms of scene files, generated from their tables.\n";
    let types = "src/python/rayfront/__init__.pyi";
    let own = read(types);
    let (own, _) = own.split_once(MARK).expect("the mark");
    is_up_to_date(types, format!("{own}{MARK}{}", python_forms()).as_bytes());
}

/// Compares the guide's tables, which extend from `<!-- fields of NAME -->` to the next empty line, with those of the
/// code; writes them if `UPDATE` is set.
#[test]
fn tables_of_the_guide_are_as_the_code() {
    let guide = "scenes/README.md";
    let mut new = read(guide);
    let forms: [(&str, &mut dyn Forms); 6] = [
        ("modifiers", &mut Modifier::Normals { smooth: 0.0 }),
        ("patterns", &mut TexturePattern::Checker),
        ("combinations", &mut Combination::Add { a: ColorInput::default(), b: ColorInput::default() }),
        ("shapes", &mut Shape::Sphere { radius_m: 1.0 }),
        ("lights", &mut Light::Point { power_w: Rgb::BLACK, falloff: Falloff::default(), radius_m: 0.0 }),
        ("cameras", &mut Camera::Orthographic { height_m: 1.0 }),
    ];
    let parts: [(&str, &mut dyn Fields); 9] = [
        ("scatter", &mut ScatteredCopies::default()),
        ("placement", &mut PatternPlacement::default()),
        ("stereo pairs", &mut Stereo::default()),
        ("settings", &mut Settings::default()),
        ("BlinnPhong", &mut BlinnPhong::default()),
        ("Principled", &mut Principled::default()),
        ("volume", &mut Volume::default()),
        ("anisotropy", &mut Anisotropy::default()),
        ("iridescence", &mut Iridescence::default()),
    ];
    let tables = parts.into_iter().map(|(name, part)| (name, table(part)));
    let tables = tables.chain(forms.into_iter().map(|(name, forms)| (name, table_of_forms(forms))));
    for (name, table) in tables {
        let mark = format!("<!-- fields of {name} -->\n");
        let start = new.find(&mark).unwrap_or_else(|| panic!("no {mark}")) + mark.len();
        let end = new[start..].find("\n\n").map_or(new.len(), |length| start + length + 1);
        new.replace_range(start..end, &table);
    }
    is_up_to_date(guide, new.as_bytes());
}
