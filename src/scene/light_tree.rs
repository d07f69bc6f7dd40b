//! The light tree: a binary tree over all emitters, from which lights are chosen.

/// Floats per node.
pub const NODE: usize = 16;

/// Bit of [`LightNode::next`] that marks a leaf; the other bits are its light.
pub const LEAF: u32 = 1 << 31;

/// [`LightNode::radius_square`] of lights that are infinitely far away.
pub const FAR: f32 = -1.0;

/// A node in 64 bytes. All fields but one are floats, so lanes gather from one table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightNode {
    /// Centre of the bounding sphere of the lights.
    pub center: [f32; 3],
    /// Square of its radius; [`FAR`] if the lights are infinitely far away.
    pub radius_square: f32,
    /// Axis of the cone of the lights' normals; for lights that are far away, of the directions to them.
    pub axis: [f32; 3],
    /// Cosine of the cone's half angle; −1 for all directions.
    pub cos_spread: f32,
    /// Sine of the cone's half angle.
    pub sin_spread: f32,
    /// Cosine of the angle from a normal within which light is emitted.
    pub cos_emission: f32,
    /// The sum of the intensities of all lights along their normals, W/sr; for lights that are far away the sum of
    /// their irradiances, W/m². In a unit of the tree's own.
    pub power: f32,
    /// 1 if light is also emitted to the other side of normals. Otherwise 0 or negative: minus the intensity outside
    /// all these directions, as a fraction of `power`.
    pub sides: f32,
    /// Index of the first of two consecutive children, or [`LEAF`] and a light.
    pub next: u32,
    /// Half the size of the bounding box of the lights.
    pub half: [f32; 3],
}

/// Offsets of the fields of a [`LightNode`] in its floats.
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
    /// The node as an array of floats.
    pub fn to_floats(self) -> [f32; NODE] {
        let [x, y, z] = self.center;
        let [a, b, c] = self.axis;
        let [p, q, r] = self.half;
        let next = f32::from_bits(self.next);
        [
            x, y, z, self.radius_square, a, b, c, self.cos_spread, self.sin_spread, self.cos_emission,
            self.power, self.sides, next, p, q, r,
        ]
    }
}

/// A light tree. Node 0 is the root and node 1 is empty, so that siblings share 128 bytes.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// [`LightNode`]s as floats; empty if there are no lights.
    pub nodes: Vec<[f32; NODE]>,
    /// The path from the root to each light, lowest bit first: 1 for the second child. No path is longer than 32.
    pub paths: Vec<u32>,
    /// True if the root's first child holds all lights at finite positions, and its second all that are far away.
    pub mixed: bool,
}

impl LightTree {
    /// The number of lights in the tree.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// True if there are no lights.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    /// The size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.paths.as_slice())
    }
}
