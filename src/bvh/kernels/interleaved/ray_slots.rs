//! The positions of interleaved rays, and the memory that they need next.

use super::RAYS;
use crate::bvh::intersect::hit_sink::HitSink;
use crate::bvh::layout::{Bvh, Child, NODE_LINES, Node, SphereBlock, TriangleBlock};
use crate::simd::prefetch;

/// The number of cache lines of a block of triangles.
const BLOCK_LINES: usize = size_of::<TriangleBlock>() / 64;

/// The positions of the rays. (Not lists of rays in memory: the place in a list would depend on the result of the ray
/// before, and loads wait for stores whose addresses are not known.)
#[derive(Clone, Copy, Default)]
pub struct RaySlots {
    /// Rays at nodes in the low half, rays at triangles in the high one.
    pub at: u64,
    /// Rays that have not ended, or whose end has not been processed.
    pub alive: u32,
}

impl RaySlots {
    /// Records the position of a ray; returns the kind of its child.
    #[inline(always)]
    pub fn put(&mut self, ray: usize, child: Child) -> usize {
        const AT: [u64; 4] = [1, 1 << 32, 0, 0];
        let kind = (child.0 >> 30) as usize;
        self.at |= AT[kind] << ray;
        kind
    }

    /// Takes the rays at nodes, those at triangles and the others; clears their positions.
    #[inline(always)]
    pub fn take(&mut self) -> [u32; 3] {
        let (nodes, triangles) = (self.at as u32, (self.at >> 32) as u32);
        self.at = 0;
        [nodes, triangles, self.alive & !(nodes | triangles)]
    }
}

/// Takes the first ray, of which there is at least one.
#[inline(always)]
pub fn take_first(rays: &mut u32) -> usize {
    let first = rays.trailing_zeros() as usize % RAYS;
    *rays &= rays.wrapping_sub(1);
    first
}

/// The memory addresses of the tree, by kinds of children.
pub struct ChildAddresses {
    /// The address of the first one.
    start: [usize; 4],
    /// The size of each in bytes.
    size: [usize; 4],
    /// The offset in bytes of the part behind as many lines as a block has; 0 if there is none.
    rest: [usize; 4],
}

impl ChildAddresses {
    /// The addresses of a tree.
    pub fn new(bvh: &Bvh) -> Self {
        let (nodes, triangles) = (bvh.nodes.as_ptr() as usize, bvh.triangles.as_ptr() as usize);
        let spheres = bvh.spheres.as_ptr() as usize;
        // Instances are not prefetched.
        Self {
            start: [nodes, triangles, spheres, nodes],
            size: [size_of::<Node>(), size_of::<TriangleBlock>(), size_of::<SphereBlock>(), 0],
            rest: [size_of::<TriangleBlock>(), 0, 0, 0],
        }
    }

    /// Records the position of a ray and prefetches the memory for its next step.
    #[inline(always)]
    pub fn send<A: HitSink>(&self, places: &mut RaySlots, ray: usize, child: Child) {
        let kind = places.put(ray, child);
        let address = self.start[kind].wrapping_add(child.index().wrapping_mul(self.size[kind]));
        if A::ANY {
            // The last line of a node holds its orders, which are not needed.
            return prefetch(address, NODE_LINES - 1);
        }
        prefetch(address, BLOCK_LINES);
        // The rest of a node. For a block, which is shorter, the first lines again: that takes less time than fetching
        // unneeded memory.
        prefetch(address.wrapping_add(self.rest[kind]), NODE_LINES - BLOCK_LINES);
    }
}
