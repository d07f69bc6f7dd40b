//! Where the rays in flight are, and which memory they need next.

use super::super::hit_sink::HitSink;
use super::super::layout::{Bvh, Child, NODE_LINES, Node, SphereBlock, TriangleBlock};
use super::RAYS;
use crate::simd::prefetch;

/// Cache lines of a block of triangles.
const BLOCK_LINES: usize = size_of::<TriangleBlock>() / 64;

/// Where the rays are. (Not lists of them in memory: the place in a list would depend on what the ray before
/// has found, and loads wait for stores whose addresses are not known.)
#[derive(Clone, Copy, Default)]
pub struct RaySlots {
    /// Rays at nodes in the low half, rays at triangles in the high one.
    pub at: u64,
    /// Rays that have not ended, or whose end nobody has seen.
    pub alive: u32,
}

impl RaySlots {
    /// Notes where a ray is; of which kind that is.
    #[inline(always)]
    pub fn put(&mut self, ray: usize, child: Child) -> usize {
        const AT: [u64; 4] = [1, 1 << 32, 0, 0];
        let kind = (child.0 >> 30) as usize;
        self.at |= AT[kind] << ray;
        kind
    }

    /// The rays at nodes, those at triangles and the others; from now on they are nowhere.
    #[inline(always)]
    pub fn take(&mut self) -> [u32; 3] {
        let (nodes, triangles) = (self.at as u32, (self.at >> 32) as u32);
        self.at = 0;
        [nodes, triangles, self.alive & !(nodes | triangles)]
    }
}

/// Takes a ray, of which there is at least one.
#[inline(always)]
pub fn take_first(rays: &mut u32) -> usize {
    let first = rays.trailing_zeros() as usize % RAYS;
    *rays &= rays.wrapping_sub(1);
    first
}

/// Where the tree is in memory, by kinds of children.
pub struct ChildAddresses {
    /// The first one.
    start: [usize; 4],
    /// Bytes of each.
    size: [usize; 4],
    /// How far it goes on behind as many lines as a block has, if at all: bytes from its start.
    rest: [usize; 4],
}

impl ChildAddresses {
    /// Of a tree.
    pub fn new(bvh: &Bvh) -> Self {
        let (nodes, triangles) = (bvh.nodes.as_ptr() as usize, bvh.triangles.as_ptr() as usize);
        let spheres = bvh.spheres.as_ptr() as usize;
        // Of instances, nothing is asked for.
        Self {
            start: [nodes, triangles, spheres, nodes],
            size: [size_of::<Node>(), size_of::<TriangleBlock>(), size_of::<SphereBlock>(), 0],
            rest: [size_of::<TriangleBlock>(), 0, 0, 0],
        }
    }

    /// Notes where a ray is and asks for the memory of its next step.
    #[inline(always)]
    pub fn send<A: HitSink>(&self, places: &mut RaySlots, ray: usize, child: Child) {
        let kind = places.put(ray, child);
        let address = self.start[kind].wrapping_add(child.index().wrapping_mul(self.size[kind]));
        if A::ANY {
            // The last line of a node are its orders.
            return prefetch(address, NODE_LINES - 1);
        }
        prefetch(address, BLOCK_LINES);
        // The rest of a node. Of a block, which is shorter, the first lines again: that takes less time than asking for
        // what is not needed.
        prefetch(address.wrapping_add(self.rest[kind]), NODE_LINES - BLOCK_LINES);
    }
}
