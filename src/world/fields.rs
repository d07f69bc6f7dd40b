//! The fields of components: a table for each, used for reading and writing scene files, `--set`, checking worlds built
//! by programs, and the tables of `scenes/README.md`.
//!
//! [`fields!`] declares a structure with its table, [`forms!`] an enumeration. To add a field, add a line there.

use crate::math::{DVec3, Rgb, Vec2, Vec3};

use super::assets::{FontId, ImageId, MeshId, StrandsId, TextureId};
use super::material::{BumpMap, Channel, ColorInput, NormalMap, ScalarInput};
pub(crate) use super::quantity::Quantity;
use super::settings::{Aov, Background, Backplate, Caustics, Sharing, Transport};

/// The range of a field's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Range {
    /// Any finite number.
    Finite,
    /// Finite, and above 0.
    Above0,
    /// A number like [`Range::Above0`], infinite if it is left out.
    Distance,
    /// Finite, and at least the number.
    From(f32),
    /// A colour of at least 0 that is a quantity of light.
    Light(Quantity),
    /// Finite, and between the numbers, both included.
    FromTo(f32, f32),
    /// Above 0, and at most the number.
    UpTo(f32),
    /// Finite, and between the numbers, both excluded.
    Between(f32, f32),
}

impl Range {
    /// From 0 to 1.
    pub(crate) const UNIT: Range = Range::FromTo(0.0, 1.0);

    /// The quantity of light that a colour with this range is, if it is one.
    #[cfg(feature = "formats")]
    pub(crate) fn quantity(self) -> Option<Quantity> {
        match self {
            Range::Light(quantity) => Some(quantity),
            _ => None,
        }
    }

    /// True if a number is in the range.
    pub(crate) fn contains(self, value: f32) -> bool {
        value.is_finite()
            && match self {
                Range::Finite => true,
                Range::Above0 | Range::Distance => value > 0.0,
                Range::From(least) => value >= least,
                Range::Light(_) => value >= 0.0,
                Range::FromTo(least, most) => (least..=most).contains(&value),
                Range::UpTo(most) => value > 0.0 && value <= most,
                Range::Between(least, most) => least < value && value < most,
            }
    }
}

impl std::fmt::Display for Range {
    /// Writes the range as it follows "must be", such as "at least 0".
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Range::Finite => f.write_str("finite"),
            Range::Above0 | Range::Distance => f.write_str("above 0"),
            Range::From(least) => write!(f, "at least {least}"),
            Range::Light(_) => f.write_str("at least 0"),
            Range::FromTo(least, most) => write!(f, "from {least} to {most}"),
            Range::UpTo(most) => write!(f, "above 0 and at most {most}"),
            Range::Between(least, most) => write!(f, "above {least} and below {most}"),
        }
    }
}

/// A reference to a field's value, by kind. Each kind is read and written in one place.
pub(crate) enum Slot<'a> {
    /// `true` or `false`.
    Flag(&'a mut bool),
    /// A number, in metres or the unit that the field's name gives.
    Number(&'a mut f32, Range),
    /// A number or `None`.
    OptionalNumber(&'a mut Option<f32>, Range),
    /// A whole number, from the first limit to the second.
    Whole(&'a mut u32, u32, u32),
    /// A whole number from the first limit to the second, or `None`.
    OptionalWhole(&'a mut Option<u32>, u32, u32),
    /// Any whole number.
    Seed(&'a mut u64),
    /// Width and height of an image.
    Size(&'a mut [u32; 2]),
    /// An angle in radians, written in degrees; the range is in degrees.
    Degrees(&'a mut f32, Range),
    /// An angle in radians, written in degrees and reduced to one turn.
    Azimuth(&'a mut f32),
    /// (x, y, z), one number for all three, or (x, y), to which the number adds z.
    Vector(&'a mut Vec3, f32),
    /// Colours of numbers from 0 to 1, in order.
    Stops(&'a mut Vec<(f32, Rgb)>),
    /// Width and height in metres, above 0, or one number for both.
    Sides(&'a mut Vec2),
    /// Width, height and depth in metres, above 0, or one number for all.
    Extents(&'a mut Vec3),
    /// Two numbers, each in the range.
    Pair(&'a mut Vec2, Range),
    /// An image.
    Image(&'a mut Option<ImageId>),
    /// A photometric profile.
    Profile(&'a mut TextureId),
    /// A priority among overlapping bodies.
    Priority(&'a mut i32),
    /// A colour, each component of it in the range.
    Color(&'a mut Rgb, Range),
    /// A colour or a texture of colours.
    ColorMap(&'a mut ColorInput, Range),
    /// A number from 0 to 1 or a channel of a texture, and the default channel.
    NumberMap(&'a mut ScalarInput, Channel),
    /// A channel of a texture whose values are used as stored, and the default channel.
    ChannelMap(&'a mut Option<(TextureId, Channel)>, Channel),
    /// A texture whose values are used as stored.
    DataMap(&'a mut Option<TextureId>),
    /// A normal map.
    Normals(&'a mut Option<NormalMap>),
    /// A bump map.
    Bumps(&'a mut Option<BumpMap>),
    /// A structure.
    Part(&'a mut dyn Fields),
    /// An optional structure.
    OptionalPart(&'a mut dyn OptionalFields),
    /// A structure whose fields are listed among those of the enclosing one.
    Inline(&'a mut dyn Fields),
    /// One of several named forms, some of them with fields.
    Form(&'a mut dyn Forms),
    /// A transport, or `Auto`: the one that suits the scene.
    Transport(&'a mut Transport),
    /// `Auto`, `Off` or a number of pixels.
    Sharing(&'a mut Sharing),
    /// `Auto`, `Off` or numbers of photons.
    Caustics(&'a mut Caustics),
    /// A colour or a gradient.
    Background(&'a mut Background),
    /// A colour or a gradient, or `None`.
    OptionalBackground(&'a mut Option<Background>),
    /// A colour, a gradient, or the picture in a file; or `None`.
    Backplate(&'a mut Option<Backplate>),
    /// `Auto` or `Fixed`.
    Exposure(&'a mut bool),
    /// `All`, or a list of output variables.
    Aovs(&'a mut Vec<Aov>),
    /// The corners of a triangle that has an area.
    Triangle(&'a mut [DVec3; 3]),
    /// The corners of a flat convex quadrilateral.
    Quadrilateral(&'a mut [DVec3; 4]),
    /// Vectors at the corners of a triangle.
    CornerVectors(&'a mut Option<[Vec3; 3]>),
    /// Texture coordinates at the corners of a triangle.
    CornerUvs(&'a mut Option<[Vec2; 3]>),
    /// A list of pairs.
    Pairs(&'a mut Vec<Vec2>),
    /// Lists of pairs.
    PairLists(&'a mut Vec<Vec<Vec2>>),
    /// A list of points.
    Path(&'a mut Vec<Vec3>),
    /// A number, or a list of some.
    Numbers(&'a mut Vec<f32>, Range),
    /// Curves.
    Strands(&'a mut StrandsId),
    /// A font.
    Font(&'a mut FontId),
    /// Words in quotes.
    Text(&'a mut String),
    /// A mesh.
    Mesh(&'a mut MeshId),
}

/// A field of a component.
pub(crate) struct Field<'a> {
    /// The field's key in scene files; empty if the value is given without a key, as in `Mesh("path")`.
    pub name: &'static str,
    /// Alternative keys.
    pub aliases: &'static [&'static str],
    /// Keys of older versions, which guides omit.
    pub old: &'static [&'static str],
    /// The field's meaning, for the page and the tables of `scenes/README.md`.
    #[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "the page shows it"))]
    pub doc: &'static str,
    /// True if a scene file must give the field.
    pub required: bool,
    /// The field that may be given in place of a required one.
    pub alternative: Option<&'static str>,
    /// The field's value.
    pub slot: Slot<'a>,
}

impl<'a> Field<'a> {
    /// A field without other keys, which occurs in no table.
    pub(crate) fn plain(name: &'static str, required: bool, slot: Slot<'a>) -> Self {
        Self { name, aliases: &[], old: &[], doc: "", required, alternative: None, slot }
    }

    /// True if the key is the field's name, an alias or an old key.
    pub(crate) fn is_called(&self, key: &str) -> bool {
        self.name == key || self.aliases.contains(&key) || self.old.contains(&key)
    }
}

/// A structure with its fields.
pub(crate) trait Fields {
    /// The name of the structure in messages, with an article.
    fn what(&self) -> &'static str;

    /// Calls a function with each field, in the order in which they are written.
    fn visit<'a>(&'a mut self, visitor: &mut dyn FnMut(Field<'a>));

    /// The fields in that order.
    fn fields(&mut self) -> Vec<Field<'_>> {
        let mut fields = Vec::new();
        self.visit(&mut |field| fields.push(field));
        fields
    }

    /// A structure of this type with all fields at their defaults; these may depend on the keys for which `is_given` is
    /// true.
    fn defaults(&self, is_given: &dyn Fn(&str) -> bool) -> Box<dyn Fields>;
}

/// An optional structure with its fields.
pub(crate) trait OptionalFields {
    /// Inserts a structure with all fields at their defaults.
    fn insert(&mut self) -> &mut dyn Fields;

    /// The structure, if there is one.
    fn part(&mut self) -> Option<&mut dyn Fields>;
}

impl<T: Fields + Default> OptionalFields for Option<T> {
    fn insert(&mut self) -> &mut dyn Fields {
        self.insert(T::default())
    }

    fn part(&mut self) -> Option<&mut dyn Fields> {
        self.as_mut().map(|part| part as &mut dyn Fields)
    }
}

/// An enumeration whose forms have names, and possibly fields.
pub(crate) trait Forms {
    /// The name of the enumeration in messages, without an article.
    fn kind(&self) -> &'static str;

    /// The names of all forms.
    fn names(&self) -> &'static [&'static str];

    /// The index of the current form in [`Forms::names`].
    fn form(&self) -> usize;

    /// Changes to a form, with all fields at their defaults.
    fn set_form(&mut self, form: usize);

    /// The fields of the current form.
    fn fields(&mut self) -> Vec<Field<'_>>;

    /// A value of the same form, with all fields at their defaults.
    fn defaults(&self) -> Box<dyn Forms>;
}

/// Calls a function with each field of a structure, including those of its [`Slot::Inline`] structures.
pub(crate) fn visit_all<'a>(part: &'a mut dyn Fields, visitor: &mut dyn FnMut(Field<'a>)) {
    part.visit(&mut |field| match field.slot {
        Slot::Inline(part) => visit_all(part, visitor),
        _ => visitor(field),
    });
}

/// The fields of a structure, including those of its [`Slot::Inline`] structures.
pub(crate) fn all_fields(part: &mut dyn Fields) -> Vec<Field<'_>> {
    let mut fields = Vec::new();
    visit_all(part, &mut |field| fields.push(field));
    fields
}

/// Declares a structure, its defaults and its table of fields. Each field is
///
/// ```text
/// /// Meaning: the documentation, and the table's last column.
/// name ["key", "other key"]: type = default, Kind(arguments);
/// ```
///
/// where the keys may be omitted if the name is the only key, `old ["key"]` after them is a key of older versions, and
/// Kind is a [`Slot`]. `with` names the function that returns the defaults of a structure from the keys that are given.
macro_rules! fields {
    (
        $(#[$meta:meta])* pub struct $name:ident, $what:literal $(with $defaults:path)? {
            $( $(#[doc = $doc:literal])+
               $field:ident $([$key:literal $(, $alias:literal)*])? $(old [$old:literal])?: $type:ty = $default:expr,
               $kind:ident $(($($argument:expr),+))?; )+
        }
    ) => {
        $(#[$meta])*
        pub struct $name { $( $(#[doc = $doc])+ pub $field: $type, )+ }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        impl $crate::world::fields::Fields for $name {
            fn what(&self) -> &'static str {
                $what
            }

            fn visit<'a>(&'a mut self, visitor: &mut dyn FnMut($crate::world::fields::Field<'a>)) {
                $( visitor($crate::world::fields::Field {
                    name: $crate::world::fields::fields!(@key $field $($key)?),
                    aliases: &[$($($alias),*)?],
                    old: &[$($old)?],
                    required: false,
                    alternative: None,
                    doc: concat!($($doc),+),
                    slot: $crate::world::fields::Slot::$kind(&mut self.$field $(, $($argument),+)?),
                }); )+
            }

            fn defaults(&self, is_given: &dyn Fn(&str) -> bool) -> Box<dyn $crate::world::fields::Fields> {
                let _ = is_given;
                Box::new($crate::world::fields::fields!(@defaults is_given $($defaults)?))
            }
        }
    };
    (@is) => { false };
    (@is required) => { true };
    (@alternative) => { None };
    (@alternative $other:literal) => { Some($other) };
    (@key $field:ident) => { stringify!($field) };
    (@key $field:ident $key:literal) => { $key };
    (@defaults $given:ident) => { Self::default() };
    (@defaults $given:ident $defaults:path) => { $defaults($given) };
}

/// Declares an enumeration, its default and its table of forms. Each form is `Name`,
/// `Name { /// Meaning. name ["key"]: type = default, Kind(arguments); … }`, as in [`fields!`], or
/// `Name(name: type = default, Kind)` for a value without a key; `, required` after the kind marks a field that a scene file
/// must give, `, required unless "other"` one in whose place another may be given.
macro_rules! forms {
    (
        $(#[$meta:meta])* pub enum $name:ident, $kind_name:literal {
            $( $(#[$form_meta:meta])* $form:ident $(($only:ident: $only_type:ty = $only_default:expr, $only_kind:ident))? $({
                $( $(#[doc = $doc:literal])+
                   $field:ident $([$key:literal])? $(old [$old:literal])?: $type:ty = $default:expr,
                   $kind:ident $(($($argument:expr),+))? $(, $required:ident $(unless $other:literal)?)?; )+
            })?, )+
        }
    ) => {
        $(#[$meta])*
        pub enum $name {
            $( $(#[$form_meta])* $form $(($only_type))? $({ $( $(#[doc = $doc])+ $field: $type, )+ })?, )+
        }

        impl $name {
            /// The names of all forms.
            #[allow(dead_code, reason = "only few are needed without a value")]
            pub(crate) const FORMS: &'static [&'static str] = &[$(stringify!($form)),+];
        }

        impl $crate::world::fields::Forms for $name {
            fn kind(&self) -> &'static str {
                $kind_name
            }

            fn names(&self) -> &'static [&'static str] {
                Self::FORMS
            }

            fn form(&self) -> usize {
                let name = match self { $( Self::$form { .. } => stringify!($form), )+ };
                self.names().iter().position(|known| *known == name).unwrap_or_default()
            }

            fn set_form(&mut self, form: usize) {
                match self.names()[form] {
                    $( stringify!($form) => *self = Self::$form $(($only_default))? $({ $($field: $default,)+ })?, )+
                    _ => {}
                }
            }

            fn fields(&mut self) -> Vec<$crate::world::fields::Field<'_>> {
                match self {
                    $( Self::$form $(($only))? $({ $($field,)+ })? => vec![
                        $($crate::world::fields::Field::plain(
                            "", true, $crate::world::fields::Slot::$only_kind($only),
                        ))? $($(
                        $crate::world::fields::Field {
                            name: $crate::world::fields::fields!(@key $field $($key)?),
                            aliases: &[],
                            old: &[$($old)?],
                            required: $crate::world::fields::fields!(@is $($required)?),
                            alternative: $crate::world::fields::fields!(@alternative $($($other)?)?),
                            doc: concat!($($doc),+),
                            slot: $crate::world::fields::Slot::$kind($field $(, $($argument),+)?),
                        },
                    )+)?], )+
                }
            }

            fn defaults(&self) -> Box<dyn $crate::world::fields::Forms> {
                let mut defaults = self.clone();
                defaults.set_form(self.form());
                Box::new(defaults)
            }
        }
    };
}

/// Implements the table of forms for an enumeration without fields that is declared elsewhere.
macro_rules! names {
    ($name:ident, $kind:literal, [$($form:ident),+]) => {
        impl $crate::world::fields::Forms for $name {
            fn kind(&self) -> &'static str {
                $kind
            }

            fn names(&self) -> &'static [&'static str] {
                &[$(stringify!($form)),+]
            }

            fn form(&self) -> usize {
                [$(Self::$form),+].iter().position(|form| form == self).unwrap_or_default()
            }

            fn set_form(&mut self, form: usize) {
                *self = [$(Self::$form),+][form];
            }

            fn fields(&mut self) -> Vec<$crate::world::fields::Field<'_>> {
                Vec::new()
            }

            fn defaults(&self) -> Box<dyn $crate::world::fields::Forms> {
                Box::new(*self)
            }
        }
    };
}

pub(crate) use {fields, forms, names};

/// Calls a function with each texture of a structure, and with the channel if only one is used.
pub(crate) fn for_each_texture(part: &mut dyn Fields, found: &mut dyn FnMut(TextureId, Option<Channel>)) {
    part.visit(&mut |field| textures(field, found));
}

/// Calls [`for_each_texture`]'s function with each texture of a field.
pub(crate) fn textures(field: Field, found: &mut dyn FnMut(TextureId, Option<Channel>)) {
    match field.slot {
        Slot::ColorMap(ColorInput::Texture(id), _) | Slot::DataMap(Some(id)) | Slot::Profile(id) => {
            found(*id, None)
        }
        Slot::NumberMap(ScalarInput { texture: Some((id, channel)), .. }, _)
        | Slot::ChannelMap(Some((id, channel)), _) => {
            found(*id, Some(*channel));
        }
        Slot::Normals(Some(NormalMap { texture, .. })) | Slot::Bumps(Some(BumpMap { texture, .. })) => {
            found(*texture, None);
        }
        Slot::Part(part) => for_each_texture(part, found),
        Slot::OptionalPart(part) => {
            if let Some(part) = part.part() {
                for_each_texture(part, found);
            }
        }
        _ => {}
    }
}

/// The images of fields that are no textures.
pub(crate) fn images(fields: Vec<Field>) -> Vec<ImageId> {
    let image = |field: Field| match field.slot {
        Slot::Image(image) => *image,
        _ => None,
    };
    fields.into_iter().filter_map(image).collect()
}

/// Converts degrees to radians, as stored in worlds. Degrees are 64-bit numbers so that every 32-bit number of radians
/// can be written in degrees.
pub(crate) const fn radians(degrees: f64) -> f32 {
    (degrees * (std::f64::consts::PI / 180.0)) as f32
}
