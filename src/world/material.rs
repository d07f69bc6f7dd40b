//! What surfaces are made of: materials and the inputs of their parameters.

use crate::math::Rgb;

use super::assets::{MaterialId, TextureId};

impl MaterialId {
    /// The white diffuse material that every asset store begins with.
    pub const DEFAULT: MaterialId = MaterialId(0);
}

/// A factor that is one colour or comes from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// The same everywhere.
    Constant(Rgb),
    /// Looked up at the hit's texture coordinates.
    Texture(TextureId),
}

impl Default for ColorInput {
    fn default() -> Self {
        Self::Constant(Rgb::BLACK)
    }
}

/// A number that is the same everywhere or comes from one channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarInput {
    /// The number, or what the texture's is multiplied by.
    pub factor: f32,
    /// The texture and the channel that the factor is multiplied by; the texture's own factor does not count.
    /// Textures of numbers need [`ColorSpace::Linear`](super::ColorSpace::Linear).
    pub texture: Option<(TextureId, Channel)>,
}

impl ScalarInput {
    /// The same everywhere.
    pub const fn constant(factor: f32) -> Self {
        Self { factor, texture: None }
    }
}

/// A channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The first.
    Red,
    /// The second.
    Green,
    /// The third.
    Blue,
    /// The fourth; 1 where an image has none.
    Alpha,
}

/// How a surface answers light. Entities carry a [`MaterialId`] as component.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// The classic model.
    BlinnPhong(BlinnPhong),
    /// The metallic-roughness model of glTF with its extensions.
    Principled(Box<Principled>),
}

impl Default for Material {
    fn default() -> Self {
        Self::BlinnPhong(BlinnPhong::default())
    }
}

/// Which vector the specular lobe of [`BlinnPhong`] is built about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Highlight {
    /// `max(n·h, 0)^shininess`, h half way between light and viewer (Blinn 1977).
    #[default]
    Blinn,
    /// `max(r·l, 0)^shininess`, r the mirror direction (Phong 1975).
    Phong,
}

/// Light with irradiance E (measured perpendicular to its direction) leaves as
/// `E · (diffuse · max(n·l, 0) + specular · lobe)`. Added to that are `emission`, the mirror image times `kr` and,
/// with an `ior`, what is seen through the surface times `kt`. There is no factor 1/π, as in Whitted's day.
#[derive(Clone, Debug, PartialEq)]
pub struct BlinnPhong {
    /// kd, for each colour.
    pub diffuse: ColorInput,
    /// ks, for each colour.
    pub specular: ColorInput,
    /// The exponent of the specular lobe; at least 0.
    pub shininess: f32,
    /// Which lobe.
    pub highlight: Highlight,
    /// Weight of the mirror reflection; with an `ior`, a factor on Fresnel's weight.
    pub kr: ColorInput,
    /// Weight of the refraction, a factor on what Fresnel leaves; counts only with an `ior`.
    pub kt: Rgb,
    /// Index of refraction of the inside (where the normal does not point); `None` if light does not enter.
    pub ior: Option<f32>,
    /// As [`Volume::priority`]; counts only with an `ior`.
    pub priority: i32,
    /// Radiance that the surface gives off by itself, W m⁻² sr⁻¹. Under the Whitted
    /// transport it lights no other surface.
    pub emission: ColorInput,
    /// See [`Principled::caustics`].
    pub caustics: bool,
}

impl Default for BlinnPhong {
    fn default() -> Self {
        Self {
            diffuse: ColorInput::Constant(Rgb::splat(0.8)),
            specular: ColorInput::Constant(Rgb::BLACK),
            shininess: 32.0,
            highlight: Highlight::Blinn,
            kr: ColorInput::Constant(Rgb::BLACK),
            kt: Rgb::WHITE,
            ior: None,
            priority: 0,
            emission: ColorInput::Constant(Rgb::BLACK),
            caustics: true,
        }
    }
}

/// A physically based surface: the metallic-roughness model of glTF 2.0 (appendix B) and what
/// Khronos' extensions add to it, under their names. Factors are within the ranges that the
/// specification gives; colours are reflectances.
#[derive(Clone, Debug, PartialEq)]
pub struct Principled {
    /// Albedo of dielectrics, reflectance straight on of metals.
    pub base_color: ColorInput,
    /// How much of the surface is there, 0 to 1, by [`Principled::alpha_mode`].
    pub alpha: ScalarInput,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// 0 dielectric to 1 metal.
    pub metallic: ScalarInput,
    /// Perceptual roughness r; the width of the microfacets' slopes is α = r².
    pub roughness: ScalarInput,
    /// Tilts the shading normal.
    pub normal: Option<NormalMap>,
    /// The same by heights, on top of the normal map.
    pub bump: Option<BumpMap>,
    /// Radiance that the surface gives off, W m⁻² sr⁻¹ (glTF: nits).
    pub emission: ColorInput,
    /// Whether it has a back. A single-sided surface has none: what is behind it is seen through it.
    pub double_sided: bool,
    /// Shows its base colour whatever the light (KHR_materials_unlit).
    pub unlit: bool,
    /// Index of refraction, of the inside over the outside; 0 stands for a surface that reflects all
    /// (KHR_materials_ior).
    pub ior: f32,
    /// Strength of the dielectric's reflection, 0 to 1 (KHR_materials_specular).
    pub specular: ScalarInput,
    /// Its colour straight on.
    pub specular_color: ColorInput,
    /// The part of what is not reflected that goes through, 0 to 1 (KHR_materials_transmission).
    pub transmission: ScalarInput,
    /// The inside, if the surface is the boundary of a body (KHR_materials_volume); a thin
    /// sheet otherwise.
    pub volume: Option<Volume>,
    /// 20 / Abbe number; 0 for none (KHR_materials_dispersion).
    pub dispersion: f32,
    /// The part of diffuse light that leaves on the other side, 0 to 1 (KHR_materials_diffuse_transmission).
    pub diffuse_transmission: ScalarInput,
    /// Its colour.
    pub diffuse_transmission_color: ColorInput,
    /// Coverage by a clear layer of ior 1.5, 0 to 1 (KHR_materials_clearcoat).
    pub clearcoat: ScalarInput,
    /// The layer's roughness.
    pub clearcoat_roughness: ScalarInput,
    /// The layer's own normals.
    pub clearcoat_normal: Option<NormalMap>,
    /// Colour of fibres that stand up (KHR_materials_sheen).
    pub sheen_color: ColorInput,
    /// Their perceptual roughness.
    pub sheen_roughness: ScalarInput,
    /// Brushed surfaces (KHR_materials_anisotropy).
    pub anisotropy: Anisotropy,
    /// A thin film (KHR_materials_iridescence).
    pub iridescence: Iridescence,
    /// False if no photons are aimed at the surface, nor begin on it if it emits: its caustics are left to chance.
    pub caustics: bool,
}

impl Default for Principled {
    fn default() -> Self {
        let none = ScalarInput::constant(0.0);
        let white = ColorInput::Constant(Rgb::WHITE);
        Self {
            base_color: white,
            alpha: ScalarInput::constant(1.0),
            alpha_mode: AlphaMode::Opaque,
            metallic: ScalarInput::constant(1.0),
            roughness: ScalarInput::constant(1.0),
            normal: None,
            bump: None,
            emission: ColorInput::default(),
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: ScalarInput::constant(1.0),
            specular_color: white,
            transmission: none,
            volume: None,
            dispersion: 0.0,
            diffuse_transmission: none,
            diffuse_transmission_color: white,
            clearcoat: none,
            clearcoat_roughness: none,
            clearcoat_normal: None,
            sheen_color: ColorInput::default(),
            sheen_roughness: none,
            anisotropy: Anisotropy::default(),
            iridescence: Iridescence::default(),
            caustics: true,
        }
    }
}

/// What a material's alpha means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Nothing: all of the surface is there.
    #[default]
    Opaque,
    /// It is there where alpha is at least the cutoff.
    Mask {
        /// The least alpha.
        cutoff: f32,
    },
    /// It is the part of the surface that is there.
    Blend,
}

/// Normals in tangent space, as glTF stores them: rgb in 0..1 stand for x, y, z in −1..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// Looked up as it is stored.
    pub texture: TextureId,
    /// A factor on x and y.
    pub scale: f32,
}

/// Heights above a surface, which is shaded as if it had them (Blinn 1978).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpMap {
    /// Looked up as it is stored.
    pub texture: TextureId,
    /// Which of its channels.
    pub channel: Channel,
    /// How much higher a value of 1 is than one of 0, in metres.
    pub height_m: f32,
}

/// The inside of a body (KHR_materials_volume, KHR_materials_volume_scatter).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// What is left of white light after [`Volume::attenuation_distance`], neither absorbed nor scattered.
    pub attenuation_color: Rgb,
    /// In metres; infinite for a body that does nothing to light.
    pub attenuation_distance: f32,
    /// The colour of a body so large that all light that leaves it has been scattered many times. It determines which
    /// part of the attenuation is scattering (Kulla and Conty 2017). Black where nothing scatters.
    pub multiscatter_color: Rgb,
    /// The mean cosine of the angle by which light is scattered, −0.99 to 0.99 (Henyey and Greenstein's g): above 0
    /// it mostly keeps its direction.
    pub scatter_anisotropy: f32,
    /// How thick the material is where its surface is open, and so encloses nothing: there it is a thin sheet, which
    /// absorbs by this thickness and bends no light. In metres before the entity's transform; at 0 an open surface
    /// counts as the boundary of a body, which lies behind it.
    pub thickness: f32,
    /// Which of several bodies fills a place that they have in common: that of the highest priority; of these, the one
    /// that light has entered last.
    pub priority: i32,
}

impl Volume {
    /// The largest magnitude of [`Volume::scatter_anisotropy`]: beyond it light is hardly deflected any more.
    pub const MOST: f32 = 0.99;

    /// Does nothing to light.
    pub const CLEAR: Volume = Volume {
        attenuation_color: Rgb::WHITE,
        attenuation_distance: f32::INFINITY,
        multiscatter_color: Rgb::BLACK,
        scatter_anisotropy: 0.0,
        thickness: 0.0,
        priority: 0,
    };
}

/// Microfacets that are stretched along one direction (KHR_materials_anisotropy).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anisotropy {
    /// From 0, round, to 1, as long as can be.
    pub strength: f32,
    /// From the tangent, counter-clockwise, in radians.
    pub rotation: f32,
    /// Red and green: direction in −1..1; blue: a factor on the strength.
    pub texture: Option<TextureId>,
}

/// A film about as thick as wavelengths of light (KHR_materials_iridescence).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// Coverage, 0 to 1.
    pub factor: ScalarInput,
    /// The film's index of refraction, at least 1.
    pub ior: f32,
    /// In nm, where the texture is 0.
    pub thickness_minimum: f32,
    /// In nm, where the texture is 1 or there is none.
    pub thickness_maximum: f32,
    /// A texture's channel, for what lies between minimum and maximum.
    pub thickness: Option<(TextureId, Channel)>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self {
            factor: ScalarInput::constant(0.0),
            ior: 1.3,
            thickness_minimum: 100.0,
            thickness_maximum: 400.0,
            thickness: None,
        }
    }
}
