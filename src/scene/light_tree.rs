//! All lights in a binary tree: what a light is chosen by.

/// Floats a node.
pub const NODE: usize = 16;

/// Bit of [`LightNode::next`] that marks a leaf; the others are its light.
pub const LEAF: u32 = 1 << 31;

/// [`LightNode::radius_square`] of what is far away.
pub const FAR: f32 = -1.0;

/// A node in 64 bytes, all floats but one, so that lanes gather from one table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightNode {
    /// Centre of the sphere around the lights.
    pub center: [f32; 3],
    /// Square of its radius; [`FAR`] where the lights are infinitely far away.
    pub radius_square: f32,
    /// Middle of the directions that the lights' normals point to, or that they are in if they are far away.
    pub axis: [f32; 3],
    /// Cosine of the angle from it within which these are; −1 where they are everywhere.
    pub cos_spread: f32,
    /// Sine of the same angle.
    pub sin_spread: f32,
    /// Cosine of the angle from a normal within which light leaves.
    pub cos_emission: f32,
    /// The intensities along their normals of all lights in it, W/sr; of those far away the irradiances that
    /// they bring, W/m². In a unit of the tree's own.
    pub power: f32,
    /// 1 if light leaves to the other side of normals, too. Otherwise 0, or below: minus the intensity outside of all
    /// these directions, as a fraction of `power`.
    pub sides: f32,
    /// The first of two consecutive children, or [`LEAF`] and a light.
    pub next: u32,
    /// Half the size of the box around the lights.
    pub half: [f32; 3],
}

/// Where the fields of a [`LightNode`] are in its floats.
pub mod field {
    /// [`super::LightNode::center`], three floats.
    pub const CENTER: u32 = 0;
    /// [`super::LightNode::radius_square`].
    pub const RADIUS_SQUARE: u32 = 3;
    /// [`super::LightNode::axis`], three floats.
    pub const AXIS: u32 = 4;
    /// [`super::LightNode::cos_spread`].
    pub const COS_SPREAD: u32 = 7;
    /// [`super::LightNode::sin_spread`].
    pub const SIN_SPREAD: u32 = 8;
    /// [`super::LightNode::cos_emission`].
    pub const COS_EMISSION: u32 = 9;
    /// [`super::LightNode::power`].
    pub const POWER: u32 = 10;
    /// [`super::LightNode::sides`].
    pub const SIDES: u32 = 11;
    /// [`super::LightNode::next`], as bits.
    pub const NEXT: u32 = 12;
    /// [`super::LightNode::half`], three floats.
    pub const HALF: u32 = 13;
}

impl LightNode {
    /// As floats.
    pub fn to_floats(self) -> [f32; NODE] {
        let [x, y, z] = self.center;
        let [a, b, c] = self.axis;
        let [p, q, r] = self.half;
        let next = f32::from_bits(self.next);
        [
            x,
            y,
            z,
            self.radius_square,
            a,
            b,
            c,
            self.cos_spread,
            self.sin_spread,
            self.cos_emission,
            self.power,
            self.sides,
            next,
            p,
            q,
            r,
        ]
    }
}

/// The tree. Node 0 is the root, node 1 is empty, so that siblings share 128 bytes.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// [`LightNode`]s as floats; none without lights.
    pub nodes: Vec<[f32; NODE]>,
    /// For each light the way to it from the root, the lowest bit first: 1 for the second child.
    /// No path is longer than 32.
    pub paths: Vec<u32>,
    /// The root's first child has all that is somewhere, its second all that is far away.
    pub mixed: bool,
}

impl LightTree {
    /// How many lights there are in it.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.paths.as_slice())
    }
}
