//! Materials of surfaces, and the inputs of their parameters.

use crate::math::Rgb;

use super::assets::{MaterialId, TextureId};
use super::fields::{Fields, Quantity, Range, fields, forms};

impl MaterialId {
    /// The white diffuse material with which every asset store begins.
    pub const DEFAULT: MaterialId = MaterialId(0);
}

/// A colour parameter: a constant or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// A constant.
    Constant(Rgb),
    /// A texture, sampled at the hit's texture coordinates.
    Texture(TextureId),
}

impl Default for ColorInput {
    fn default() -> Self {
        Self::Constant(Rgb::BLACK)
    }
}

/// A numeric parameter: a constant or one channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarInput {
    /// The number, or a factor on that of the texture.
    pub factor: f32,
    /// The texture and the channel that `factor` multiplies; the texture's own factor is ignored. Textures of numbers
    /// need [`ColorSpace::Linear`](super::ColorSpace::Linear).
    pub texture: Option<(TextureId, Channel)>,
}

impl ScalarInput {
    /// A constant number.
    pub const fn constant(factor: f32) -> Self {
        Self { factor, texture: None }
    }
}

/// A channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The first channel.
    Red,
    /// The second channel.
    Green,
    /// The third channel.
    Blue,
    /// The fourth channel; 1 if an image has none.
    Alpha,
}

impl Channel {
    /// The place in a texel, from 0.
    pub(crate) fn index(self) -> u32 {
        match self {
            Channel::Red => 0,
            Channel::Green => 1,
            Channel::Blue => 2,
            Channel::Alpha => 3,
        }
    }
}

/// A reflection model with its parameters. Entities carry a [`MaterialId`] as component.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// The classic model.
    BlinnPhong(BlinnPhong),
    /// The metallic-roughness model of glTF with its extensions.
    Principled(Box<Principled>),
}

impl Material {
    /// The table of its model.
    pub(crate) fn part(&mut self) -> &mut dyn Fields {
        match self {
            Self::BlinnPhong(material) => material,
            Self::Principled(material) => &mut **material,
        }
    }
}

impl Default for Material {
    fn default() -> Self {
        Self::BlinnPhong(BlinnPhong::default())
    }
}

forms! {
    /// The vector about which the specular lobe of [`BlinnPhong`] is built.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Highlight, "highlight" {
        /// `max(n·h, 0)^shininess`, h half way between light and viewer (Blinn 1977).
        #[default]
        Blinn,
        /// `max(r·l, 0)^shininess`, r the mirror direction (Phong 1975).
        Phong,
    }
}

fields! {
    /// The classic model: light of irradiance E (measured perpendicular to its direction) is reflected as `E · (diffuse
    /// · max(n·l, 0) + specular · lobe)`. To this are added `emission`, the mirror reflection times `kr` and, with an
    /// `ior`, the refracted radiance times `kt`. As in Whitted's time, there is no factor 1/π.
    #[derive(Clone, Debug, PartialEq)]
    pub struct BlinnPhong, "BlinnPhong" with BlinnPhong::with_keys {
        /// factor on diffuse light
        diffuse ["diffuse", "kd"]: ColorInput = ColorInput::Constant(Rgb::splat(0.8)), ColorMap(Range::From(0.0));
        /// factor on the highlight
        specular ["specular", "ks"]: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0));
        /// exponent of the highlight: larger values make it smaller and sharper
        shininess: f32 = 32.0, Number(Range::From(0.0));
        /// computed from the half vector or from the mirror direction
        highlight: Highlight = Highlight::Blinn, Form;
        /// factor on the mirror image; with an `ior`, on Fresnel's weight
        kr: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::From(0.0));
        /// factor on what is seen through the surface, which Fresnel leaves; counts only with an `ior`
        kt: Rgb = Rgb::WHITE, Color(Range::From(0.0));
        /// index of refraction of the inside (where the normal does not point), which light then enters (water 1.33,
        /// glass 1.5; air within them 1)
        ior: Option<f32> = None, OptionalNumber(Range::Above0);
        /// which of several bodies fills a place that they have in common: the one of the highest priority, of these
        /// the one that light has entered last; counts only with an `ior`
        priority: i32 = 0, Priority;
        /// radiance that the surface emits, W m⁻² sr⁻¹; under the Whitted transport it is seen, but lights nothing else
        emission: ColorInput = ColorInput::Constant(Rgb::BLACK), ColorMap(Range::Light(Quantity::Radiance));
        /// how much of the surface is there, as `alpha_mode` says
        alpha: ScalarInput = ScalarInput::constant(1.0), NumberMap(Channel::Alpha);
        /// all of the surface is there; it is there where alpha is at least the cutoff; alpha says which part of it is
        /// there
        alpha_mode: AlphaMode = AlphaMode::Opaque, Form;
        /// whether photons are aimed at the surface, and leave it if it emits light; without them its caustics are left
        /// to chance
        caustics: bool = true, Flag;
    }
}

impl BlinnPhong {
    /// Returns the defaults of a material with an index of refraction: no diffuse colour, all light reflected or
    /// refracted.
    pub(crate) fn glass() -> BlinnPhong {
        BlinnPhong {
            diffuse: ColorInput::Constant(Rgb::BLACK),
            kr: ColorInput::Constant(Rgb::WHITE),
            ..BlinnPhong::default()
        }
    }

    /// True if it transmits the same part of each colour without refraction, as `d` in an OBJ's library means it.
    pub(crate) fn is_dissolved(&self) -> bool {
        let through = self.kt.r;
        let is_even = self.kt == Rgb::splat(through) && through > 0.0 && through < 1.0;
        self.ior == Some(1.0) && is_even && self.alpha_mode == AlphaMode::Opaque
    }

    /// Returns the defaults of a material; `is_given` is true for the keys that a file gives.
    pub(crate) fn with_keys(is_given: &dyn Fn(&str) -> bool) -> BlinnPhong {
        if is_given("ior") { BlinnPhong::glass() } else { BlinnPhong::default() }
    }
}

fields! {
    /// A physically based surface: the metallic-roughness model of glTF 2.0 (appendix B) with the parameters of
    /// Khronos' extensions, under their names. Factors are within the ranges that the specification gives; colours are
    /// reflectances.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Principled, "Principled" {
        /// albedo; of a metal, its reflectance straight on
        base_color: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::UNIT);
        /// how much of the surface is there, as `alpha_mode` says
        alpha: ScalarInput = ScalarInput::constant(1.0), NumberMap(Channel::Alpha);
        /// all of the surface is there; it is there where alpha is at least the cutoff; alpha says which part of it is
        /// there
        alpha_mode: AlphaMode = AlphaMode::Opaque, Form;
        /// from 0, a dielectric, to 1, a metal
        metallic: ScalarInput = ScalarInput::constant(1.0), NumberMap(Channel::Blue);
        /// a factor on what a metal reflects at 82° to its normal, where measured metals reflect less than Schlick's
        /// approximation says; `Metal(…)` has those of real ones
        edge_tint: Rgb = Rgb::WHITE, Color(Range::UNIT);
        /// from 0, a mirror, to 1; the width of the microfacets' slopes is its square
        roughness: ScalarInput = ScalarInput::constant(1.0), NumberMap(Channel::Green);
        /// a normal map, with a factor on its slopes
        normal: Option<NormalMap> = None, Normals;
        /// a relief on top of the normal map that is shaded, but casts no shadow: one channel, whose 1 is `height_m`
        /// above its 0
        bump: Option<BumpMap> = None, Bumps;
        /// radiance that the surface emits, W m⁻² sr⁻¹
        emission: ColorInput = ColorInput::default(), ColorMap(Range::Light(Quantity::Radiance));
        /// whether it has a back: if not, rays pass through the back, and it emits no light there; planes and surfaces
        /// with a `volume` always have their backs
        double_sided: bool = false, Flag;
        /// shows its base colour whatever the light (KHR_materials_unlit)
        unlit: bool = false, Flag;
        /// shows what is behind it instead of itself, darkened by the shadows and coloured by the reflections that
        /// things throw on it: an object stands on white, or on nothing; under the path transport
        shadow_catcher: bool = false, Flag;
        /// index of refraction of the inside over the outside: water has 1.33 and a bubble of air 1, whatever is around
        /// them; 0 reflects everything (KHR_materials_ior)
        ior: f32 = 1.5, Number(Range::From(0.0));
        /// strength of a dielectric's reflection (KHR_materials_specular)
        specular: ScalarInput = ScalarInput::constant(1.0), NumberMap(Channel::Red);
        /// the colour of that reflection, straight on
        specular_color: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::From(0.0));
        /// part of the light that goes through (KHR_materials_transmission); straight if the surface is smooth and has
        /// no `volume`, or if it has one and its `ior` is 1: then light samples pass through it, too
        transmission: ScalarInput = ScalarInput::constant(0.0), NumberMap(Channel::Red);
        /// makes the surface the boundary of a body (KHR_materials_volume); needs a `transmission` or a
        /// `diffuse_transmission`; without a `volume` the surface is a thin sheet
        volume: Option<Volume> = None, OptionalPart;
        /// 20 / Abbe number: how much more strongly blue light is bent than red; `ior` is that of yellow light; counts
        /// only with a `volume` (KHR_materials_dispersion)
        dispersion: f32 = 0.0, Number(Range::From(0.0));
        /// part of the diffuse light that leaves on the other side (KHR_materials_diffuse_transmission)
        diffuse_transmission: ScalarInput = ScalarInput::constant(0.0), NumberMap(Channel::Red);
        /// the colour of that light
        diffuse_transmission_color: ColorInput = ColorInput::Constant(Rgb::WHITE), ColorMap(Range::UNIT);
        /// how much of the surface a clear layer of ior 1.5 covers (KHR_materials_clearcoat)
        clearcoat: ScalarInput = ScalarInput::constant(0.0), NumberMap(Channel::Red);
        /// the layer's roughness
        clearcoat_roughness: ScalarInput = ScalarInput::constant(0.0), NumberMap(Channel::Green);
        /// the layer's normal map
        clearcoat_normal: Option<NormalMap> = None, Normals;
        /// the colour of fibres that stand up (KHR_materials_sheen)
        sheen_color: ColorInput = ColorInput::default(), ColorMap(Range::UNIT);
        /// their roughness
        sheen_roughness: ScalarInput = ScalarInput::constant(0.0), NumberMap(Channel::Red);
        /// brushed: highlights are stretched (KHR_materials_anisotropy)
        anisotropy: Anisotropy = Anisotropy::default(), Part;
        /// a thin film (KHR_materials_iridescence)
        iridescence: Iridescence = Iridescence::default(), Part;
        /// whether photons are aimed at the surface, and leave it if it emits light; without them its caustics are left
        /// to chance
        caustics: bool = true, Flag;
    }
}

forms! {
    /// The meaning of a material's alpha.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub enum AlphaMode, "alpha mode" {
        /// Alpha is ignored: the surface is opaque.
        #[default]
        Opaque,
        /// The surface is present where alpha is at least the cutoff.
        Mask {
            /// the least alpha
            cutoff: f32 = 0.5, Number(Range::From(0.0));
        },
        /// Alpha is the fraction of the surface that is present.
        Blend,
    }
}

/// A map of normals in tangent space, encoded as in glTF: rgb in 0..1 represent x, y, z in −1..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The texture, whose values are used as stored.
    pub texture: TextureId,
    /// A factor on the normal's x and y.
    pub scale: f32,
}

/// A map of heights, by which the surface's shading normals are perturbed (Blinn 1978).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpMap {
    /// The texture, whose values are used as stored.
    pub texture: TextureId,
    /// The channel of the heights.
    pub channel: Channel,
    /// The height of the value 1 above the value 0, in metres.
    pub height_m: f32,
}

fields! {
    /// The interior of a body (KHR_materials_volume, KHR_materials_volume_scatter).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Volume, "a volume" {
        /// what is left of white light after the distance, neither absorbed nor scattered
        attenuation_color: Rgb = Rgb::WHITE, Color(Range::UNIT);
        /// the distance, in metres; without one the body is clear
        attenuation_distance ["attenuation_distance_m"] old ["attenuation_distance"]: f32 = f32::INFINITY, Number(Range::Distance);
        /// the colour of a body so large that all light that leaves it has been scattered many times; it determines
        /// which part of the attenuation is scattering (Kulla and Conty 2017): the rest is absorbed, all of it at 0
        multiscatter_color: Rgb = Rgb::BLACK, Color(Range::UNIT);
        /// the mean cosine of the angle by which light is scattered (Henyey and Greenstein's g): above 0 it mostly
        /// keeps its direction
        scatter_anisotropy: f32 = 0.0, Number(Range::FromTo(-Volume::MOST, Volume::MOST));
        /// how thick the material is, in metres before the entity's transform, where the surface encloses nothing, as a
        /// pane: there it is a thin sheet, which absorbs by this thickness and bends no light; at 0 an open surface
        /// counts as the boundary of a body, which lies behind it
        thickness ["thickness_m"] old ["thickness"]: f32 = 0.0, Number(Range::From(0.0));
        /// which of several bodies fills a place that they have in common: the one of the highest priority, of these
        /// the one that light has entered last
        priority: i32 = 0, Priority;
    }
}

impl Volume {
    /// The largest magnitude of [`Volume::scatter_anisotropy`]; beyond it, light is hardly deflected.
    pub const MOST: f32 = 0.99;
}

fields! {
    /// Microfacets stretched along one direction (KHR_materials_anisotropy).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Anisotropy, "an anisotropy" {
        /// from 0, round, to 1, as long as can be
        strength: f32 = 0.0, Number(Range::UNIT);
        /// the angle from the tangent, counter-clockwise; radians in a program's worlds
        rotation ["rotation_degrees"]: f32 = 0.0, Degrees(Range::Finite);
        /// red and green: the direction, 0 to 1 for −1 to 1; blue: a factor on the strength
        texture: Option<TextureId> = None, DataMap;
    }
}

fields! {
    /// A thin film, about as thick as a wavelength of light (KHR_materials_iridescence).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Iridescence, "an iridescence" {
        /// coverage
        factor: ScalarInput = ScalarInput::constant(0.0), NumberMap(Channel::Red);
        /// the film's index of refraction
        ior: f32 = 1.3, Number(Range::From(1.0));
        /// in nm, where the texture is 0
        thickness_minimum ["thickness_minimum_nm"] old ["thickness_minimum"]: f32 = 100.0, Number(Range::From(0.0));
        /// in nm, where the texture is 1 or there is none
        thickness_maximum ["thickness_maximum_nm"] old ["thickness_maximum"]: f32 = 400.0, Number(Range::From(0.0));
        /// a texture's channel, for what lies between minimum and maximum
        thickness: Option<(TextureId, Channel)> = None, ChannelMap(Channel::Green);
    }
}
