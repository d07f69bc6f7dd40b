//! Everything that lights a surface, as both transports sample it.

use super::light_tree::LightTree;
use crate::math::NONE;

/// Kinds of emitters: the rows of [`Emitters::rows`] mean different things.
pub mod kind {
    /// A triangle: corner, two edges, radiance.
    pub const TRIANGLE: u32 = 0;
    /// A parallelogram: corner, two edges, radiance; with [`super::flag::ROUND`] the ellipse that touches its sides.
    pub const QUAD: u32 = 1;
    /// A sphere: centre, radius at 9, radiance at 10.
    pub const SPHERE: u32 = 2;
    /// A point: place, intensity at 10; 1 at 9 if light falls with distance.
    pub const POINT: u32 = 3;
    /// A spot: as a point; axis at 3, cosine of the outer angle at 6, scale at 7.
    pub const SPOT: u32 = 4;
    /// Parallel light: direction to it, 1 − cosine of half its angle at 3, irradiance at 10.
    pub const DIRECTIONAL: u32 = 5;
    /// All around.
    pub const ENVIRONMENT: u32 = 6;
    /// A point with a profile: place, axis at 3, where angles about it begin at 6, 1 over the profile's mean at 9,
    /// the mean intensity at 10.
    pub const PHOTOMETRIC: u32 = 7;
}

/// Bits of [`Emitters::flags`].
pub mod flag {
    /// Its back shines, too.
    pub const TWO_SIDED: u32 = 1;
    /// Its radiance comes from its material's texture.
    pub const TEXTURED: u32 = 2;
    /// Its front is where its edges go around clockwise: a mirrored triangle, whose corners keep the
    /// order of its texture.
    pub const REVERSED: u32 = 8;
    /// Rays can hit it: it is found in two ways, which share the work.
    pub const VISIBLE: u32 = 4;
    /// Only the ellipse within it is there.
    pub const ROUND: u32 = 32;
    /// Only a part of it is there: its material's coverage.
    pub const COVERED: u32 = 16;
    /// No photons begin on it.
    pub const WITHOUT_PHOTONS: u32 = 64;
}

/// Columns by emitter. What shines from all around comes last, if that is an emitter.
#[derive(Debug, Default)]
pub struct Emitters {
    /// See [`kind`].
    pub kinds: Vec<u32>,
    /// See [`flag`].
    pub flags: Vec<u32>,
    /// See [`kind`]; radiance or intensity is at 10.
    pub rows: Vec<[f32; 13]>,
    /// Material of a surface, [`NONE`] of all else.
    pub material: Vec<u32>,
    /// The profile's texture of what has one, [`NONE`] of all else.
    pub profile: Vec<u32>,
    /// The surface's primitive, the first of two that make one emitter; of a light its index among
    /// the scene's.
    pub primitive: Vec<u32>,
    /// For the triangles in world space, then for the spheres, the emitter of the surface, or [`NONE`]. Behind these,
    /// for the triangles of meshes with instances, which of an instance's emitters it is. Empty if no surface shines.
    pub of_primitive: Vec<u32>,
    /// For each instance its first emitter, or [`NONE`] if it has none. Empty if none has any, as
    /// the next.
    pub instance_first: Vec<u32>,
    /// For each instance what is added (wrapping) to its triangles' numbers to find them in
    /// [`Emitters::of_primitive`].
    pub instance_places: Vec<u32>,
    /// Emitters are chosen in it by what each may contribute at a point.
    pub tree: LightTree,
}

/// What an emitter is a part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitterSource {
    /// Index among the scene's lights.
    Light(u32),
    /// A primitive, and the instance that it is in or [`NONE`].
    Surface(u32, u32),
    /// All around.
    Environment,
}

impl Emitters {
    /// Where an emitter comes from, for people: looks through all instances.
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
        // In each instance's range emitters follow each other, behind all that is in the world.
        let instance = before.max_by_key(|(_, first)| **first).map_or(NONE, |(instance, _)| instance as u32);
        EmitterSource::Surface(primitive, instance)
    }

    /// The kind of one of them and what is known of it.
    pub fn row(&self, emitter: u32) -> (u32, &[f32; 13]) {
        (self.kinds[emitter as usize], &self.rows[emitter as usize])
    }

    /// True if rays can hit some of them.
    pub fn can_be_hit(&self) -> bool {
        !self.of_primitive.is_empty()
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> usize {
        let words =
            [&self.kinds, &self.flags, &self.material, &self.profile, &self.primitive, &self.of_primitive];
        let of_instances = [&self.instance_first, &self.instance_places];
        let words: usize = words.iter().chain(&of_instances).map(|column| size_of_val(&column[..])).sum();
        words + size_of_val(&self.rows[..]) + self.tree.bytes()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }
}
