//! The components that an entity can carry. Lengths are in metres, angles in
//! radians, colours linear Rec. 709.

use crate::math::{Mat4, Quat, Rgb, Vec2, Vec3};

use super::assets::{ImageId, MaterialId, MeshId, TextureId};

/// What the author calls an entity. Names are unique in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(pub String);

/// The glTF file whose nodes stand under this entity (see [`Placed`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Model(pub std::path::PathBuf);

/// Materials instead of those that the entity's [`Model`] calls so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides(pub Vec<(String, MaterialId)>);

/// Marks the entities that came with an ancestor's [`Model`]: a saved scene names the file and
/// leaves them out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placed;

/// The entity that this one's [`Transform`] is relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parent(pub hecs::Entity);

/// Local space to the parent's space (or the world's). Cameras look along −Z
/// with +Y up; spot, directional and area lights shine along −Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Scale first, then rotate, then translate.
    Trs {
        /// In metres.
        translation: Vec3,
        /// A unit quaternion.
        rotation: Quat,
        /// A factor for each axis; may be negative, not zero.
        scale: Vec3,
    },
    /// An affine matrix (last row 0 0 0 1) that can be inverted.
    Matrix(Mat4),
}

impl Transform {
    /// Leaves everything where it is.
    pub const IDENTITY: Transform =
        Transform::Trs { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// What rays can hit, in local space.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Centred at the local origin. u runs around +Y once, starting at −X and going by +Z;
    /// v runs from 0 at the +Y pole to 1 at the −Y pole.
    Sphere {
        /// In metres, above zero.
        radius_m: f32,
    },
    /// Three corners, counter-clockwise seen from the front.
    Triangle {
        /// The corners.
        vertices: [Vec3; 3],
        /// Shading normals at the corners; flat when absent.
        normals: Option<[Vec3; 3]>,
        /// Texture coordinates; (0,0), (1,0), (0,1) when absent.
        uvs: Option<[Vec2; 3]>,
    },
    /// A planar convex quadrilateral. Its corners, in order around it, are the
    /// texture's top left, top right, bottom right and bottom left. Its front, the
    /// outside of glass, is the side from which they go around counter-clockwise, as for
    /// triangles; the texture is seen the right way around from the other side.
    Plane {
        /// The corners.
        corners: [Vec3; 4],
    },
    /// A triangle mesh of the asset store.
    Mesh(MeshId),
}

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
    /// Where it is looked up, as it is stored (the texture's own factor does not count).
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

/// Light with irradiance E (measured across its direction) leaves as
/// `E · (diffuse · max(n·l, 0) + specular · lobe)`; to that are added
/// `emission`, the mirror image times `kr` and, with an `ior`, what is seen
/// through the surface times `kt`. No factor 1/π, as in Whitted's day.
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
    /// Index of refraction of the inside (where the normal does not point); none
    /// for what light does not enter.
    pub ior: Option<f32>,
    /// Radiance that the surface gives off by itself, W m⁻² sr⁻¹. It lights no other surface.
    pub emission: ColorInput,
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
            emission: ColorInput::Constant(Rgb::BLACK),
        }
    }
}

/// A physically based surface: the metallic-roughness model of glTF 2.0 (appendix B) and what
/// Khronos' extensions add to it, under their names. Factors are within the ranges that the
/// specification gives; colours are reflectances.
#[derive(Clone, Debug, PartialEq)]
pub struct Principled {
    /// Albedo of what is no metal, reflectance straight on of what is.
    pub base_color: ColorInput,
    /// How much of the surface is there, by [`Principled::alpha_mode`].
    pub alpha: ScalarInput,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// 0 dielectric to 1 metal.
    pub metallic: ScalarInput,
    /// Perceptual roughness r; the width of the microfacets' slopes is α = r².
    pub roughness: ScalarInput,
    /// Bends the shading normal.
    pub normal: Option<NormalMap>,
    /// Radiance that the surface gives off, W m⁻² sr⁻¹ (glTF: nits).
    pub emission: ColorInput,
    /// Whether its back is there, too. What is behind a single-sided surface is seen through it.
    pub double_sided: bool,
    /// Shows its base colour whatever light there is (KHR_materials_unlit).
    pub unlit: bool,
    /// Index of refraction; 0 stands for a surface that reflects all (KHR_materials_ior).
    pub ior: f32,
    /// Strength of the dielectric's reflection (KHR_materials_specular).
    pub specular: ScalarInput,
    /// Its colour straight on.
    pub specular_color: ColorInput,
    /// The part of what is not reflected that goes through (KHR_materials_transmission).
    pub transmission: ScalarInput,
    /// The inside, if the surface is the boundary of a body (KHR_materials_volume); a thin
    /// sheet otherwise.
    pub volume: Option<Volume>,
    /// 20 / Abbe number (KHR_materials_dispersion).
    pub dispersion: f32,
    /// The part of diffuse light that leaves on the other side (KHR_materials_diffuse_transmission).
    pub diffuse_transmission: ScalarInput,
    /// Its colour.
    pub diffuse_transmission_color: ColorInput,
    /// Coverage by a clear layer of ior 1.5 (KHR_materials_clearcoat).
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
        }
    }
}

/// What a material's alpha means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Nothing: the surface is all there.
    #[default]
    Opaque,
    /// It is there where alpha is at least the cutoff.
    Mask {
        /// The least alpha.
        cutoff: f32,
    },
    /// That part of it is there.
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

/// The inside of a body (KHR_materials_volume).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// What is left of white light after [`Volume::attenuation_distance`].
    pub attenuation_color: Rgb,
    /// In metres; infinite for a body that absorbs nothing.
    pub attenuation_distance: f32,
}

/// Microfacets that are stretched along one direction (KHR_materials_anisotropy).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anisotropy {
    /// 0 round to 1 as long as can be.
    pub strength: f32,
    /// From the tangent, counter-clockwise, in radians.
    pub rotation: f32,
    /// Red and green: direction in −1..1; blue: a factor on the strength.
    pub texture: Option<TextureId>,
}

/// A film whose thickness is of the order of light's wavelengths (KHR_materials_iridescence).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// Coverage.
    pub factor: ScalarInput,
    /// The film's index of refraction.
    pub ior: f32,
    /// In nm, where the texture is 0.
    pub thickness_minimum: f32,
    /// In nm, where the texture is 1 or there is none.
    pub thickness_maximum: f32,
    /// Between minimum and maximum.
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

/// How N sample points are spread over a square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pattern {
    /// Each on its own, uniformly at random.
    Uniform,
    /// One at random in each cell of a grid (stratified).
    #[default]
    Jittered,
    /// The centres of the cells of a grid.
    Regular,
}

/// How irradiance depends on the distance from a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Falloff {
    /// As 1/d².
    #[default]
    InverseSquare,
    /// As at one metre, at every distance.
    Constant,
}

/// What sends light into the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// From the local origin into all directions: intensity Φ/4π.
    Point {
        /// Φ in W.
        power_w: Rgb,
        /// With distance.
        falloff: Falloff,
    },
    /// A point light (of intensity Φ/4π) seen only within a cone about −Z.
    Spot {
        /// Φ in W of the point light without its cone.
        power_w: Rgb,
        /// Half angle in radians within which nothing is lost.
        inner_angle: f32,
        /// Half angle in radians beyond which nothing arrives; at most π/2.
        outer_angle: f32,
        /// With distance.
        falloff: Falloff,
    },
    /// Parallel light along −Z.
    Directional {
        /// On a surface across the light, W m⁻².
        irradiance: Rgb,
        /// The full angle that the source takes up in the sky, in radians; 0 for a point. The
        /// Whitted transport takes every source for a point.
        angle: f32,
    },
    /// Light from all around, infinitely far away. The entity's rotation turns it; it is what
    /// rays see that hit nothing. The first one counts.
    Environment {
        /// Radiance in W m⁻² sr⁻¹; a factor on the image if there is one.
        radiance: Rgb,
        /// Equirectangular: its centre lies along −Z, its top along +Y, u grows to the right
        /// as seen from within.
        image: Option<ImageId>,
    },
    /// A rectangle in the local XY plane, centred at the origin, that emits
    /// towards −Z with the same radiance Φ/(πA) in all directions.
    Area {
        /// Φ in W.
        power_w: Rgb,
        /// Width along X and height along Y in metres.
        size_m: Vec2,
        /// Shadow rays for each hit, at least 1.
        samples: u32,
        /// Where on the light they go.
        pattern: Pattern,
        /// Whether rays can hit it (it then hides what is behind it, too).
        visible: bool,
    },
}

/// How a camera turns image points into rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// All rays pass the local origin.
    Pinhole {
        /// The full vertical angle of view in radians, in (0, π).
        vertical_fov: f32,
    },
    /// Rays pass a lens about the local origin and meet in the focal plane.
    ThinLens {
        /// The full vertical angle of view in radians, in (0, π).
        vertical_fov: f32,
        /// In metres, at least 0.
        lens_radius_m: f32,
        /// From the lens to the plane in focus, along −Z.
        focus_distance_m: f32,
        /// How a pixel's samples are spread over the lens.
        pattern: Pattern,
    },
    /// Parallel rays along −Z.
    Orthographic {
        /// Height of the image in metres.
        height_m: f32,
    },
}

/// How far a plane's corners may be from one plane, over its diameter.
const PLANAR: f64 = 1e-4;
/// Sine of the angle at a corner below which its edges count as one line.
const STRAIGHT: f64 = 1e-9;

/// Whether the corners go around a flat convex quadrilateral; else what is wrong and at
/// which of them.
pub fn check_plane(corners: [Vec3; 4]) -> Result<(), (Option<usize>, String)> {
    let [a, b, c, d] = corners.map(|corner| corner.as_dvec3());
    // Twice the area, along the normal: what the two diagonals span.
    let normal = (c - a).cross(d - b);
    let diameter =
        [b - a, c - a, d - a, c - b, d - b, d - c].map(|v| v.length()).into_iter().fold(0.0, f64::max);
    if normal.length() <= STRAIGHT * diameter * diameter {
        return Err((None, "the plane has no area: give its corners in order around it".to_owned()));
    }
    let normal = normal / normal.length();
    let centre = (a + b + c + d) / 4.0;
    for (index, corner) in [a, b, c, d].into_iter().enumerate() {
        let distance = (corner - centre).dot(normal).abs();
        if distance > PLANAR * diameter {
            let reason = format!(
                "the corners are not in one plane (this one is {distance:.3e} m off): move it or use two triangles"
            );
            return Err((Some(index), reason));
        }
    }
    for (index, [before, at, after]) in [[d, a, b], [a, b, c], [b, c, d], [c, d, a]].into_iter().enumerate() {
        let (incoming, outgoing) = (at - before, after - at);
        if incoming.cross(outgoing).dot(normal) <= STRAIGHT * incoming.length() * outgoing.length() {
            let reason = "the plane is not convex at this corner: give the corners in order around it, \
                          or use two triangles";
            return Err((Some(index), reason.to_owned()));
        }
    }
    Ok(())
}
