//! The components that an entity can carry. Lengths are in metres, angles in
//! radians, colours linear Rec. 709.

use crate::math::{DAffine3, DMat3, DQuat, DVec3, Quat, Rgb, Vec2, Vec3};

use super::assets::{ImageId, MaterialId, TextureId};
use super::fields::{Quantity, Range, forms, radians};
use super::settings::Settings;

/// The author's name for an entity. Names are unique in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(pub String);

/// The glTF file whose nodes are descendants of this entity (see [`FromModel`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Model(pub std::path::PathBuf);

/// Replacements for materials of the entity's [`Model`], by the materials' names in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides(pub Vec<(String, MaterialId)>);

/// Marks an entity that was loaded from an ancestor's [`Model`]. A saved scene names the file and omits such entities
/// as long as they are unchanged. The number is a hash of the entity as loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FromModel(pub u64);

/// The place in a scene file where an entity is written, for messages.
#[derive(Clone, Debug)]
pub(crate) struct WrittenAt {
    /// The file.
    pub file: std::sync::Arc<std::path::Path>,
    /// Line and column, from 1.
    pub position: [u32; 2],
}

/// The entity that this one's [`Transform`] is relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parent(pub hecs::Entity);

/// The transform from local space to the parent's space, or to world space without a [`Parent`]. Cameras look along −Z
/// with +Y up; spot, directional and area lights emit along −Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// A scale, then a rotation, then a translation.
    Trs {
        /// In metres. Double precision places things exactly, however far from the origin.
        translation: DVec3,
        /// A unit quaternion.
        rotation: Quat,
        /// A factor for each axis; may be negative, but not zero.
        scale: Vec3,
    },
    /// An affine matrix that can be inverted.
    Matrix(DAffine3),
}

impl Transform {
    /// The identity transform.
    pub const IDENTITY: Transform =
        Transform::Trs { translation: DVec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// Returns the transform that places the origin at `from` (in metres), with −Z towards `to` and +Y as close to `up`
    /// as that allows; `up` may have any length.
    ///
    /// # Errors
    ///
    /// [`LookAtFault::SamePoint`] if `from` equals `to`, [`LookAtFault::NoUp`] if `up` is zero, and
    /// [`LookAtFault::Parallel`] if the sine of the angle between `up` and the direction of view is below 10⁻⁶.
    pub fn look_at(from: DVec3, to: DVec3, up: Vec3) -> Result<Transform, LookAtFault> {
        /// The sine of the angle below which two directions count as parallel.
        const PARALLEL: f64 = 1e-6;
        let backward = from - to;
        if from == to {
            return Err(LookAtFault::SamePoint);
        }
        let backward = backward / backward.length();
        let up_length = up.as_dvec3().length();
        if up_length == 0.0 {
            return Err(LookAtFault::NoUp);
        }
        let right = (up.as_dvec3() / up_length).cross(backward);
        if right.length() < PARALLEL {
            return Err(LookAtFault::Parallel);
        }
        let right = right / right.length();
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        let rotation = DQuat::from_mat3(&axes).normalize().as_quat();
        Ok(Transform::Trs { translation: from, rotation, scale: Vec3::ONE })
    }
}

/// The error of [`Transform::look_at`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LookAtFault {
    /// The two points are the same.
    #[error("both places are the same")]
    SamePoint,
    /// The up vector is (0, 0, 0).
    #[error("up must not be (0, 0, 0)")]
    NoUp,
    /// The up vector is parallel to the direction of view.
    #[error("up must not lie along the direction of view")]
    Parallel,
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

forms! {
    /// The distribution of N sample points over a square.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
    pub enum Pattern, "pattern" {
        /// Independent uniform random points.
        Uniform,
        /// One random point in each cell of a grid (stratified).
        #[default]
        Jittered,
        /// The centres of the cells of a grid.
        Regular,
        /// All at the centre of the square: a pixel without antialiasing, which leaves only other effects to see.
        Center,
    }
}

forms! {
    /// The dependence of irradiance on the distance from a light.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Falloff, "falloff" {
        /// Irradiance falls off as 1/d².
        #[default]
        InverseSquare,
        /// Irradiance at every distance is that at one metre.
        Constant,
    }
}

forms! {
    /// The way in which a spotlight fades between its angles, over t, which goes from 0 to 1 with the cosine.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum ConeEdge, "cone edge" {
        /// t², as in glTF.
        #[default]
        Squared,
        /// 3t² − 2t³, as in Blender.
        Smoothstep,
    }
}

forms! {
    /// The shape of an area light within its rectangle.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Outline, "outline" {
        /// The whole rectangle.
        #[default]
        Rectangle,
        /// The ellipse inscribed in the rectangle.
        Disc,
    }
}

impl Outline {
    /// The fraction of the rectangle that the outline covers.
    pub(crate) fn part(self) -> f32 {
        match self {
            Self::Rectangle => 1.0,
            Self::Disc => std::f32::consts::FRAC_PI_4,
        }
    }
}

forms! {
    /// A light source.
    #[derive(Clone, Debug, PartialEq)]
    pub enum Light, "light" {
        /// A point light at the local origin, with intensity Φ/4π in all directions.
        Point {
            /// Φ, the power
            power_w: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::ALL_AROUND)), required;
            /// whether the light weakens with distance, or is everywhere as at 1 m
            falloff: Falloff = Falloff::InverseSquare, Form;
            /// the radius of the ball that emits the light: the larger, the softer are shadows; it hides nothing, and is seen in
            /// mirrors and through glass alone; under the Whitted transport, and with constant falloff, it is a point
            radius_m: f32 = 0.0, Number(Range::From(0.0));
        },
        /// A point light (of intensity Φ/4π) that emits only within a cone about −Z.
        Spot {
            /// Φ, the power of the point light without its cone
            power_w: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::ALL_AROUND)), required;
            /// half of the angle within which the light is at full strength; at most the outer one
            inner_angle ["inner_degrees"]: f32 = radians(30.0), Degrees(Range::FromTo(0.0, 90.0));
            /// half of the angle beyond which there is none; between the two it fades
            outer_angle ["outer_degrees"]: f32 = radians(45.0), Degrees(Range::FromTo(0.0, 90.0));
            /// the way in which it fades, over t, which goes from 0 to 1 with the cosine: t², as in glTF, or 3t² − 2t³, as in
            /// Blender
            edge: ConeEdge = ConeEdge::Squared, Form;
            /// as of `Point`
            falloff: Falloff = Falloff::InverseSquare, Form;
            /// as of `Point`: each point of the ball emits within the cone
            radius_m: f32 = 0.0, Number(Range::From(0.0));
        },
        /// A measured point light at the local origin: its intensity depends on the direction, and its axis is −Z.
        Photometric {
            /// Φ, the power over all directions
            power_w: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::Power(None))), required;
            /// the relative intensity: an `.ies` file, or an equirectangular image; in a program's world, columns go
            /// about the axis, from +X towards +Y, once around, and rows from straight ahead to straight back
            profile: TextureId = TextureId(0), Profile, required;
        },
        /// Parallel light along −Z.
        Directional {
            /// irradiance of a surface perpendicular to the light, W m⁻²
            irradiance: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::Irradiance)), required;
            /// the full angle that the source covers in the sky (the sun: 0.53), where mirrors show it; 0 for a point, as which the
            /// Whitted transport treats every source
            angle ["angle_degrees"]: f32 = 0.0, Degrees(Range::FromTo(0.0, 180.0));
        },
        /// Infinitely distant light from all directions, seen by rays that hit nothing. The entity's rotation applies
        /// to it. Only the first environment or [`Light::Sky`] counts.
        Environment {
            /// radiance, W m⁻² sr⁻¹; a factor on the image if there is one
            radiance: Rgb = Rgb::WHITE, Color(Range::Light(Quantity::Radiance));
            /// an equirectangular image: its centre lies along −Z, its top along +Y
            image: Option<ImageId> = None, Image;
        },
        /// A clear sky with its sun over a grey ground, infinitely far away, after Hillaire, "A scalable and production
        /// ready sky and atmosphere rendering technique" (2020). The entity's rotation applies to it. It acts as a
        /// [`Light::Environment`] and a [`Light::Directional`].
        Sky {
            /// the sun's height above the horizon; negative after sunset
            elevation ["elevation_degrees"] old ["elevation"]: f32 = radians(45.0), Degrees(Range::FromTo(-90.0, 90.0));
            /// the sun's direction: 0 along −Z, 90 along +X
            azimuth ["azimuth_degrees"] old ["azimuth"]: f32 = radians(220.0), Azimuth;
            /// how many times as much haze as on a clear day
            haze: f32 = 1.0, Number(Range::FromTo(0.0, 100.0));
            /// a factor; with 1, a white surface in the noon sun has a radiance of about 1
            radiance: Rgb = Rgb::WHITE, Color(Range::From(0.0));
            /// a factor on the light that comes from the sun itself; with 0, only the sky gives light
            sun: f32 = 1.0, Number(Range::From(0.0));
            /// the full angle that the sun covers; a larger one gives the same light with softer shadows
            sun_angle ["sun_degrees"]: f32 = Light::SUN_ANGLE, Degrees(Range::FromTo(0.0, 180.0));
        },
        /// A rectangle or a disc in the local XY plane, centred at the origin, that emits
        /// towards −Z with the same radiance L + Φ/(πA) in all directions.
        Area {
            /// Φ, the power; needed unless there is a `radiance`
            power_w: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::FLAT)), required unless "radiance";
            /// L, W m⁻² sr⁻¹, in place of a power or added to it: larger lights then give more light
            radiance: Rgb = Rgb::BLACK, Color(Range::Light(Quantity::Radiance));
            /// width along X and height along Y; of a disc both diameters
            size_m: Vec2 = Vec2::ONE, Sides, required;
            /// the shape within that rectangle
            outline: Outline = Outline::Rectangle, Form;
            /// shadow rays for each hit, under the Whitted transport
            samples: u32 = 1, Whole(1, Settings::MOST_SAMPLES);
            /// how they are spread over the light
            pattern: Pattern = Pattern::Jittered, Form;
            /// whether it has a surface, which the camera sees and which hides what is behind it; without one, only the path
            /// transport's mirrors and glass show it
            visible: bool = false, Flag;
        },
    }
}

/// Marks an entity whose [`Light`] emits no photons: only paths that hit its surface by chance find its caustics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WithoutCaustics;

/// The light group of what an entity and the entities below it emit: the film sums up its light by itself, so that it
/// can be made brighter, darker or of another colour without rendering again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroup(pub String);

impl Light {
    /// The sun's angular diameter, radians.
    pub(crate) const SUN_ANGLE: f32 = 0.533 * std::f32::consts::PI / 180.0;

    /// True if the light is an environment or a sky.
    pub(crate) fn is_around(&self) -> bool {
        matches!(self, Light::Environment { .. } | Light::Sky { .. })
    }
}
