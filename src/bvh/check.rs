//! Oracles: what a sound tree looks like, and the answer without culling.

use super::layout::{BLOCK, Bvh, Child, Kind, Root};
use crate::math::{Aabb, NONE, Vec3};

impl Bvh {
    /// Whether every box lies in its parent's, every primitive in its leaf's box, and every
    /// primitive of a tree in exactly one leaf. Says what is wrong where it isn't so.
    pub fn validate(&self) -> Result<(), String> {
        let Some(root) = self.root else { return Ok(()) };
        let mut seen = std::collections::HashSet::new();
        self.validate_tree(root, &mut seen)?;
        let mut below = std::collections::HashSet::new();
        for instance in &self.instances {
            if below.insert(instance.root.0) {
                let everything = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
                let root = Root { child: instance.root, bounds: everything };
                self.validate_tree(root, &mut std::collections::HashSet::new())?;
            }
        }
        Ok(())
    }

    fn validate_tree(
        &self,
        root: Root,
        seen: &mut std::collections::HashSet<(bool, u32)>,
    ) -> Result<(), String> {
        let mut todo = vec![(root.child, root.bounds, 0)];
        while let Some((child, bounds, depth)) = todo.pop() {
            if depth * super::layout::WIDTH > self.stack_size {
                return Err(format!("the tree is deeper than its stack of {}", self.stack_size));
            }
            if child.kind() == Kind::Node {
                let node = &self.nodes[child.index()];
                for slot in 0..node.child.len() {
                    let inner = node.bounds(slot);
                    if inner.is_empty() {
                        continue;
                    }
                    if bounds.union(inner) != bounds {
                        return Err(format!("child {slot} of node {} sticks out", child.index()));
                    }
                    todo.push((Child(node.child[slot]), inner, depth + 1));
                }
                continue;
            }
            for (id, primitive) in self.contents(child) {
                if !seen.insert((child.kind() == Kind::Instance, id)) {
                    return Err(format!("primitive {id} is in two leaves"));
                }
                if bounds.union(primitive) != bounds {
                    return Err(format!("primitive {id} sticks out of its leaf"));
                }
            }
        }
        Ok(())
    }

    /// Ids and exact boxes of what a leaf holds (an instance has no box of its own here).
    fn contents(&self, child: Child) -> Vec<(u32, Aabb)> {
        let index = child.index();
        let used = |id: &u32| *id != NONE;
        match child.kind() {
            Kind::Node => Vec::new(),
            Kind::Instance => vec![(index as u32, Aabb::EMPTY)],
            Kind::Triangles => {
                let block = &self.triangles[index];
                let around = |lane: usize| Aabb::around(block.corners(lane).map(Vec3::from_array));
                (0..BLOCK)
                    .filter(|&l| used(&block.primitive[l]))
                    .map(|l| (block.primitive[l], around(l)))
                    .collect()
            }
            Kind::Spheres => {
                let block = &self.spheres[index];
                let around = |lane: usize| {
                    let center = Vec3::from_array(block.center.map(|axis| axis[lane]));
                    let radius = Vec3::splat(block.radius[lane]);
                    Aabb { min: center - radius, max: center + radius }
                };
                (0..BLOCK)
                    .filter(|&l| used(&block.primitive[l]))
                    .map(|l| (block.primitive[l], around(l)))
                    .collect()
            }
        }
    }
}
