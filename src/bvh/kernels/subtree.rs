//! Parts of a tree on traversal stacks.

use crate::bvh::layout::Child;

/// A part of a tree, and the distance at which a ray enters it.
#[derive(Clone, Copy)]
pub(in crate::bvh) struct SubtreeEntry {
    pub near: f32,
    pub child: Child,
}

/// A stack entry that returns from an instance to the world.
pub(in crate::bvh) const LEAVE_INSTANCE: u32 = u32::MAX;
