//! The emitters of a scene, as sampled by both transports.

use super::emitter_rows::EmitterRow;
use super::light_tree::LightTree;
use crate::math::NONE;

/// Kinds of emitters; each has its own columns in [`Emitters::rows`], by a type of `emitter_rows`.
pub mod kind {
    /// A triangle: `PlanarRow`.
    pub const TRIANGLE: u32 = 0;
    /// A parallelogram, with [`super::flag::ROUND`] its inscribed ellipse: `PlanarRow`.
    pub const QUAD: u32 = 1;
    /// A sphere: `SphereRow`.
    pub const SPHERE: u32 = 2;
    /// A point light: `PointRow`.
    pub const POINT: u32 = 3;
    /// A spotlight: `PointRow`.
    pub const SPOT: u32 = 4;
    /// Parallel light: `DirectionalRow`.
    pub const DIRECTIONAL: u32 = 5;
    /// Light from the environment.
    pub const ENVIRONMENT: u32 = 6;
    /// A point light with a photometric profile: `PhotometricRow`.
    pub const PHOTOMETRIC: u32 = 7;
}

/// Bits of [`Emitters::flags`].
pub mod flag {
    /// Its back emits too.
    pub const TWO_SIDED: u32 = 1;
    /// Its radiance comes from the texture of its material.
    pub const TEXTURED: u32 = 2;
    /// Its front is the side from which its edges go around clockwise: a mirrored triangle, whose corners keep the
    /// order of its texture.
    pub const REVERSED: u32 = 8;
    /// Rays can hit it, so light and BSDF samples are combined by MIS.
    pub const VISIBLE: u32 = 4;
    /// Only the inscribed ellipse exists.
    pub const ROUND: u32 = 32;
    /// Only a part of it exists, by the coverage of its material.
    pub const COVERED: u32 = 16;
    /// It emits no photons.
    pub const WITHOUT_PHOTONS: u32 = 64;
    /// A sphere whose points emit within a cone.
    pub const CONE: u32 = 128;
    /// One of [`super::UnseenLamps`]: light and BSDF samples are combined by MIS here, too.
    pub const UNSEEN: u32 = 256;
}

/// Columns by emitter. The environment comes last, if it is an emitter.
#[derive(Debug, Default)]
pub struct Emitters {
    /// See [`kind`].
    pub kinds: Vec<u32>,
    /// See [`flag`].
    pub flags: Vec<u32>,
    /// See [`kind`].
    pub rows: Vec<EmitterRow>,
    /// The material of an emitting surface; [`NONE`] for all other emitters.
    pub material: Vec<u32>,
    /// The texture of the photometric profile; [`NONE`] for emitters without a profile.
    pub profile: Vec<u32>,
    /// The light group, or [`NONE`].
    pub group: Vec<u32>,
    /// The primitive of an emitting surface, the first one if two primitives make one emitter. For a light entity its
    /// index among the scene's lights.
    pub primitive: Vec<u32>,
    /// The emitter of each surface, or [`NONE`]: for the triangles in world space, then for the spheres. After these,
    /// for the triangles of meshes with instances, the index among the emitters of an instance. Empty if no surface
    /// emits light.
    pub of_primitive: Vec<u32>,
    /// The first emitter of each instance, or [`NONE`] if it has none. This column and the next are empty if no
    /// instance has any.
    pub instance_first: Vec<u32>,
    /// The number added (wrapping) to the ids of each instance's triangles to get their index in
    /// [`Emitters::of_primitive`].
    pub instance_places: Vec<u32>,
    /// The light tree, which chooses emitters by their estimated contribution at a point.
    pub tree: LightTree,
    /// The lights that no surface shows.
    pub unseen: UnseenLamps,
}

/// Lights with an extent that have no surface: the camera does not see them and they block no ray, but paths find them
/// in mirrors, through glass, and wherever a light sample could have.
#[derive(Debug, Default)]
pub struct UnseenLamps {
    /// A tree over those at a finite place; its lights are indices of [`UnseenLamps::placed`].
    pub tree: LightTree,
    /// The emitters at a finite place: [`kind::QUAD`] and [`kind::SPHERE`].
    pub placed: Vec<u32>,
    /// The emitters that are discs in the sky: [`kind::DIRECTIONAL`].
    pub distant: Vec<u32>,
}

impl UnseenLamps {
    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty() && self.distant.is_empty()
    }
}

/// The object that an emitter belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitterSource {
    /// Index among the scene's lights.
    Light(u32),
    /// A primitive and its instance, or [`NONE`].
    Surface(u32, u32),
    /// The environment.
    Environment,
}

impl Emitters {
    /// The object that an emitter belongs to, for messages: searches all instances.
    pub fn source(&self, emitter: u32) -> EmitterSource {
        let (material, primitive) = (self.material[emitter as usize], self.primitive[emitter as usize]);
        if material == NONE {
            return if primitive == NONE {
                EmitterSource::Environment
            } else {
                EmitterSource::Light(primitive)
            };
        }
        let starts = self.instance_first.iter().enumerate();
        let before = starts.filter(|(_, first)| **first != NONE && **first <= emitter);
        // Emitters of one instance have consecutive numbers, after those of all surfaces in world space.
        let instance = before.max_by_key(|(_, first)| **first).map_or(NONE, |(instance, _)| instance as u32);
        EmitterSource::Surface(primitive, instance)
    }

    /// The kind and the row of an emitter.
    pub fn row(&self, emitter: u32) -> (u32, &EmitterRow) {
        (self.kinds[emitter as usize], &self.rows[emitter as usize])
    }

    /// True if rays can hit the surfaces of some of the emitters.
    pub fn can_be_hit(&self) -> bool {
        !self.of_primitive.is_empty()
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        let words = [
            &self.kinds, &self.flags, &self.material, &self.profile, &self.group, &self.primitive,
            &self.of_primitive,
        ];
        let of_instances = [&self.instance_first, &self.instance_places];
        let words: usize = words.iter().chain(&of_instances).map(|column| size_of_val(&column[..])).sum();
        let UnseenLamps { tree, placed, distant } = &self.unseen;
        let unseen = tree.bytes() + size_of_val(&placed[..]) + size_of_val(&distant[..]);
        words + size_of_val(&self.rows[..]) + self.tree.bytes() + unseen
    }

    /// The number of emitters.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// True if there are no emitters.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }
}
