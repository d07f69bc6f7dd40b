//! The memory layout of the flattened tree.

pub mod shape;
pub mod sidedness;
pub(in crate::bvh) mod speeds;

use std::sync::Arc;

use crate::math::{Aabb, DAffine3, NONE, Vec3};
use crate::simd::prefetch;
use crate::simd::sixteen::shift;
use sidedness::{PrimitiveRef, SPHERE, Sidedness};
use speeds::KernelSpeeds;

/// The number of children of a node.
pub const WIDTH: usize = 16;
/// The number of primitives of a block.
pub const BLOCK: usize = 8;

/// Boxes grow by this fraction of their own coordinates, and slab distances by the same fraction of themselves; both
/// are needed so that rounding never culls a hit.
pub const PADDING: f32 = 1.0 / 524_288.0;

/// A child word: the kind in the two high bits, an index below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(pub u32);

/// The kinds of [`Child`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildKind {
    /// Index of a [`Node`].
    Node = 0,
    /// Index of a [`TriangleBlock`].
    Triangles = 1,
    /// Index of a [`SphereBlock`].
    Spheres = 2,
    /// Index of an [`Instance`].
    Instance = 3,
}

impl Child {
    /// The largest index.
    pub const MAX_INDEX: usize = (1 << 30) - 1;

    /// Packs a kind and an index.
    pub fn new(kind: ChildKind, index: usize) -> Self {
        assert!(index <= Self::MAX_INDEX, "more than 2^30 nodes or blocks");
        Self((kind as u32) << 30 | index as u32)
    }

    /// The kind of the child.
    #[inline(always)]
    pub fn kind(self) -> ChildKind {
        match self.0 >> 30 {
            0 => ChildKind::Node,
            1 => ChildKind::Triangles,
            2 => ChildKind::Spheres,
            _ => ChildKind::Instance,
        }
    }

    /// The index of the child among its kind.
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & Self::MAX_INDEX as u32) as usize
    }
}

/// The number of cache lines of a node.
pub const NODE_LINES: usize = size_of::<Node>() / 64;

/// 16 boxes and their contents. 512 bytes: planes of one kind lie together, a cache line each.
///
/// ```text
/// min.x ×16 │ max.x ×16 │ min.y ×16 │ max.y ×16 │ min.z ×16 │ max.z ×16 │ child ×16 │ order ×8
/// ```
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// The planes by axis, the low ones before the high ones. Unused boxes are inverted and never hit.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// The child words of the boxes.
    pub child: [u32; WIDTH],
    /// The boxes from front to back, by octant: bit i of an octant is set for rays that go down along axis i. The order
    /// of the opposite octant is its reverse.
    pub order: [Order; 8],
}

impl Node {
    /// A node with all 16 boxes unused.
    pub const EMPTY: Node = Node {
        planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
        child: [0; WIDTH],
        order: [0; 8],
    };

    /// Sets one of the boxes.
    pub fn set(&mut self, slot: usize, bounds: &Aabb, child: Child) {
        for axis in 0..3 {
            self.planes[axis][0][slot] = bounds.min[axis];
            self.planes[axis][1][slot] = bounds.max[axis];
        }
        self.child[slot] = child.0;
    }

    /// The boxes from back to front, for rays of an octant.
    #[inline(always)]
    pub fn back_to_front(&self, octant: u32) -> Order {
        self.order[(octant as usize % 8) ^ 7]
    }

    /// The near planes across an axis, which begin at index 0 or 16 (`first`), and the far ones.
    #[inline(always)]
    pub fn planes_across(&self, axis: usize, first: u32) -> (&[f32; WIDTH], &[f32; WIDTH]) {
        let planes = &self.planes[axis];
        let from =
            |at: u32| planes.as_flattened()[(at as usize & WIDTH)..].first_chunk().unwrap_or(&planes[0]);
        (from(first), from(!first))
    }

    /// The bounds of one of the boxes.
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| Vec3::from_array(self.planes.map(|axis| axis[side][slot]));
        Aabb { min: corner(0), max: corner(1) }
    }
}

/// A permutation of a node's children: see [`crate::simd::sixteen::slot`].
pub type Order = u64;

impl Node {
    /// Computes the orders from the boxes' centres along the octants' diagonals, once all boxes are set.
    pub fn put_in_order(&mut self) {
        for octant in 0..4 {
            let sign = |axis: usize| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
            let mut depths = [(0.0, 0); WIDTH];
            for (slot, depth) in depths.iter_mut().enumerate() {
                let center = |axis: usize| self.planes[axis][0][slot] + self.planes[axis][1][slot];
                // NaN for unused boxes.
                *depth = (center(0) * sign(0) + center(1) * sign(1) + center(2), slot as u64);
            }
            depths.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (place, (_, slot)) in depths.into_iter().enumerate() {
                self.order[octant ^ 7] |= slot << shift(place);
                self.order[octant] |= slot << shift(WIDTH - 1 - place);
            }
        }
    }
}

/// Up to 8 triangles, 320 bytes. Unused slots are degenerate and never hit.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct TriangleBlock {
    /// The coordinates by axis, corner and triangle.
    pub vertex: [[[f32; BLOCK]; 3]; 3],
    /// The [`PrimitiveRef`]s of the triangles.
    pub words: [u32; BLOCK],
}

impl TriangleBlock {
    /// A block without triangles.
    pub const EMPTY: TriangleBlock =
        TriangleBlock { vertex: [[[0.0; BLOCK]; 3]; 3], words: [PrimitiveRef::UNUSED.0; BLOCK] };

    /// Stores a triangle in slot `place`.
    pub fn set(&mut self, place: usize, corners: [[f32; 3]; 3], primitive: u32) {
        for (corner, position) in corners.into_iter().enumerate() {
            for (axis, value) in position.into_iter().enumerate() {
                self.vertex[axis][corner][place] = value;
            }
        }
        self.words[place] = PrimitiveRef::new(primitive, Sidedness::Always).0;
    }

    /// The id of the triangle in slot `place`, [`NONE`] if it is unused.
    pub fn id(&self, place: usize) -> u32 {
        let word = PrimitiveRef(self.words[place]);
        if word.is_used() { word.number() } else { NONE }
    }

    /// The corners of the triangle in slot `place`.
    #[inline(always)]
    pub fn corners(&self, place: usize) -> [[f32; 3]; 3] {
        // (`map` is not inlined where this is called most.)
        let mut corners = [[0.0; 3]; 3];
        for (axis, values) in self.vertex.iter().enumerate() {
            for (corner, values) in corners.iter_mut().zip(values) {
                corner[axis] = values[place];
            }
        }
        corners
    }
}

/// Up to 8 spheres, 192 bytes. Unused slots have a NaN radius and are never hit.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SphereBlock {
    /// The centres by axis.
    pub center: [[f32; BLOCK]; 3],
    /// The radii in metres; negative for spheres that may count as vast (`sphere::stored_radius`).
    pub radius: [f32; BLOCK],
    /// The [`PrimitiveRef`]s of the spheres.
    pub words: [u32; BLOCK],
}

impl SphereBlock {
    /// A block without spheres.
    pub const EMPTY: SphereBlock = SphereBlock {
        center: [[0.0; BLOCK]; 3],
        radius: [f32::NAN; BLOCK],
        words: [PrimitiveRef::UNUSED.0; BLOCK],
    };

    /// The id of the sphere in slot `place`, [`NONE`] if it is unused.
    pub fn id(&self, place: usize) -> u32 {
        let word = PrimitiveRef(self.words[place]);
        if word.is_used() { word.number() | SPHERE } else { NONE }
    }

    /// The centre and the stored radius of the sphere in slot `place`.
    #[inline(always)]
    pub fn sphere(&self, place: usize) -> ([f32; 3], f32) {
        let [x, y, z] = &self.center;
        ([x[place], y[place], z[place]], self.radius[place])
    }
}

/// A placed subtree: rays enter it through `to_local`, and t means the same on both sides because directions are not
/// normalized.
#[derive(Clone, Debug)]
pub struct Instance {
    /// World to local for directions, three rows of three. For points, the translation is subtracted first: see
    /// [`Instance::place`].
    pub to_local: [[f32; 3]; 3],
    /// Local to world, three rows of four.
    pub to_world: [[f32; 4]; 3],
    /// The subtree, with its box in its own space; it holds no other instance.
    pub root: Root,
    /// The sidedness of all its primitives; `None` if they keep their own.
    pub sidedness: Option<Sidedness>,
}

impl Instance {
    /// Places a subtree. The transform must be invertible.
    pub fn new(to_world: &DAffine3, root: Root) -> Self {
        let row = |m: &DAffine3, r: usize| {
            let c = m.matrix3;
            [c.x_axis[r] as f32, c.y_axis[r] as f32, c.z_axis[r] as f32]
        };
        let there = |r: usize| {
            let [a, b, c] = row(to_world, r);
            [a, b, c, to_world.translation[r] as f32]
        };
        let back = to_world.inverse();
        Self {
            to_local: [row(&back, 0), row(&back, 1), row(&back, 2)],
            to_world: [there(0), there(1), there(2)],
            root,
            sidedness: None,
        }
    }

    /// The position of the local origin in the world. Subtracting it first keeps the precision of a point near an
    /// instance that is far from the world's origin; rotating first would lose all of its last digits.
    #[inline(always)]
    pub fn place(&self) -> [f32; 3] {
        let [x, y, z] = &self.to_world;
        [x[3], y[3], z[3]]
    }
}

/// The whole structure: all trees lie in the same arrays, the parts of each together.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes, depth first.
    pub nodes: Vec<Node>,
    /// Blocks of triangles.
    pub triangles: Vec<TriangleBlock>,
    /// Blocks of spheres.
    pub spheres: Vec<SphereBlock>,
    /// Subtrees placed in the world.
    pub instances: Vec<Instance>,
    /// True if the sidedness of some primitive or instance is not [`Sidedness::Always`].
    pub conditional: bool,
    /// The world's tree; `None` if the world is empty.
    pub root: Option<Root>,
    /// The largest number of entries on a traversal stack.
    pub stack_size: usize,
    /// The time and memory of building so far.
    pub statistics: BuildStatistics,
    /// Measured speeds of the kernels; copies of the tree share them.
    pub(in crate::bvh) speeds: Arc<KernelSpeeds>,
}

/// The time and memory of building, for all trees together.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuildStatistics {
    /// Wall-clock time.
    pub time: std::time::Duration,
    /// A bound on the builder's memory in bytes, besides the finished arrays and the caller's data, for the largest of
    /// the trees.
    pub peak_bytes: usize,
}

/// A tree with its bounds.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// Its topmost node or block.
    pub child: Child,
    /// The bounds of the whole tree.
    pub bounds: Aabb,
}

impl Default for Bvh {
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            triangles: Vec::new(),
            spheres: Vec::new(),
            instances: Vec::new(),
            conditional: false,
            root: None,
            stack_size: WIDTH,
            statistics: BuildStatistics::default(),
            speeds: Arc::default(),
        }
    }
}

impl Bvh {
    /// A tree of nothing, to which trees can be added, with what is known of the kernels' speeds from the tree of
    /// `before`, a similar scene.
    pub fn after(before: Option<&Bvh>) -> Self {
        let speeds = before.map_or_else(KernelSpeeds::default, |before| KernelSpeeds::clone(&before.speeds));
        Self { speeds: Arc::new(speeds), ..Self::default() }
    }

    /// Prefetches a node or a block of triangles that will be visited soon.
    #[inline(always)]
    pub(in crate::bvh) fn fetch(&self, child: Child) {
        match child.kind() {
            ChildKind::Node => {
                prefetch(self.nodes.as_ptr() as usize + child.index() * size_of::<Node>(), NODE_LINES)
            }
            ChildKind::Triangles => {
                prefetch(self.triangles.as_ptr() as usize + child.index() * size_of::<TriangleBlock>(), 5);
            }
            _ => {}
        }
    }

    /// Sets the sidedness of each primitive, by id, and that of each instance.
    pub fn set_sidedness(&mut self, of: impl Fn(u32) -> Sidedness, placed: &[Option<Sidedness>]) {
        let mut conditional = false;
        let mut set = |word: &mut u32, flag: u32| {
            let number = PrimitiveRef(*word).number();
            if PrimitiveRef(*word).is_used() {
                let sidedness = of(number | flag);
                conditional |= sidedness != Sidedness::Always;
                *word = PrimitiveRef::new(number, sidedness).0;
            }
        };
        self.triangles.iter_mut().flat_map(|block| &mut block.words).for_each(|word| set(word, 0));
        self.spheres.iter_mut().flat_map(|block| &mut block.words).for_each(|word| set(word, SPHERE));
        for (instance, sidedness) in self.instances.iter_mut().zip(placed) {
            conditional |= sidedness.is_some_and(|sidedness| sidedness != Sidedness::Always);
            instance.sidedness = *sidedness;
        }
        self.conditional = conditional;
    }

    /// The memory that it takes, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.instances[..])
    }
}

/// A box grown by [`PADDING`] of its coordinates.
pub fn pad(bounds: Aabb) -> Aabb {
    Aabb { min: bounds.min - bounds.min.abs() * PADDING, max: bounds.max + bounds.max.abs() * PADDING }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::sixteen::slot;

    #[test]
    fn order_of_each_octant_lists_all_children_by_depth() {
        let mut node = Node::EMPTY;
        let corners = [[0.0, 0.0, 0.0], [5.0, 1.0, 0.0], [1.0, 7.0, 0.0], [2.0, 2.0, 9.0]];
        for (slot, corner) in corners.into_iter().enumerate() {
            let min = Vec3::from_array(corner);
            node.set(slot, &Aabb { min, max: min + 1.0 }, Child::new(ChildKind::Node, slot));
        }
        node.put_in_order();
        for (octant, order) in node.order.into_iter().enumerate() {
            let mut slots: Vec<_> = (0..WIDTH).rev().map(|place| slot(order, place)).collect();
            let used: Vec<_> = slots.iter().copied().filter(|slot| *slot < 4).collect();
            let depth = |slot: &usize| {
                let signs = [0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 });
                corners[*slot].iter().zip(signs).map(|(value, sign)| value * sign).sum::<f32>()
            };
            assert!(used.is_sorted_by(|a, b| depth(a) >= depth(b)), "octant {octant}: {used:?}");
            slots.sort();
            assert!(slots.into_iter().eq(0..WIDTH));
        }
    }

    #[test]
    fn node_and_block_sizes_are_whole_cache_lines() {
        assert_eq!(size_of::<Node>(), 512);
        assert_eq!(size_of::<TriangleBlock>(), 320);
        assert_eq!(size_of::<SphereBlock>(), 192);
    }
}
