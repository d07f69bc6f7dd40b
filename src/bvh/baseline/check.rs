//! Oracles: the validity of a tree, and its expected cost.

use crate::bvh::layout::WIDTH;
use std::collections::HashMap;

use crate::bvh::build::costs::NODE_COST;
use crate::bvh::layout::{BLOCK, Bvh, Child, ChildKind, Root};
use crate::math::{Aabb, NONE, Vec3};

/// A triangle in several leaves is checked at points, this many along each side.
const POINTS: u32 = 16;

/// A primitive in a leaf.
struct LeafPrimitive {
    id: u32,
    /// The bounds of the whole primitive (empty for an instance).
    bounds: Aabb,
    /// The corners of a triangle.
    corners: Option<[Vec3; 3]>,
}

/// The leaves that hold each primitive; instances have separate keys.
type LeavesByPrimitive = HashMap<(bool, u32), (LeafPrimitive, Vec<Aabb>)>;

impl Bvh {
    /// Checks that every box lies in its parent's, and every primitive of a tree in a leaf's box; a triangle may
    /// instead lie, part by part, in the boxes of several leaves. Returns a description of what is wrong.
    pub fn validate(&self) -> Result<(), String> {
        let Some(root) = self.root else { return Ok(()) };
        self.validate_tree(root)?;
        let mut below = std::collections::HashSet::new();
        for instance in &self.instances {
            if below.insert(instance.root.child.0) {
                let everything = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
                self.validate_tree(Root { child: instance.root.child, bounds: everything })?;
            }
        }
        Ok(())
    }

    /// The expected cost of a ray through the world's tree by the surface area heuristic, in block tests: each node's
    /// and block's half area as a fraction of the root's, a node weighted with [`NODE_COST`].
    pub fn expected_cost(&self) -> f64 {
        let Some(root) = self.root else { return 0.0 };
        let area = |bounds: &Aabb| f64::from(bounds.half_area());
        let mut todo = vec![(root.child, area(&root.bounds))];
        let mut sum = 0.0;
        while let Some((child, area_of_child)) = todo.pop() {
            if child.kind() != ChildKind::Node {
                sum += area_of_child;
                continue;
            }
            sum += f64::from(NODE_COST) * area_of_child;
            let node = &self.nodes[child.index()];
            let boxes = node.child.iter().enumerate().map(|(slot, child)| (child, node.bounds(slot)));
            let used = boxes.filter(|(_, bounds)| !bounds.is_empty());
            todo.extend(used.map(|(child, bounds)| (Child(*child), area(&bounds))));
        }
        sum / area(&root.bounds)
    }

    fn validate_tree(&self, root: Root) -> Result<(), String> {
        let mut seen = LeavesByPrimitive::new();
        let mut todo = vec![(root.child, root.bounds, 0)];
        while let Some((child, bounds, depth)) = todo.pop() {
            if depth * WIDTH > self.stack_size {
                return Err(format!("the tree is deeper than its stack of {}", self.stack_size));
            }
            if child.kind() == ChildKind::Node {
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
            let mut here = std::collections::HashSet::new();
            for content in self.contents(child) {
                if !here.insert(content.id) {
                    return Err(format!("primitive {} is twice in one leaf", content.id));
                }
                let key = (child.kind() == ChildKind::Instance, content.id);
                seen.entry(key).or_insert((content, Vec::new())).1.push(bounds);
            }
        }
        seen.values().try_for_each(|(content, leaves)| content.validate(leaves))
    }

    /// The contents of a leaf.
    fn contents(&self, child: Child) -> Vec<LeafPrimitive> {
        let index = child.index();
        match child.kind() {
            ChildKind::Node => Vec::new(),
            ChildKind::Instance => {
                vec![LeafPrimitive { id: index as u32, bounds: Aabb::EMPTY, corners: None }]
            }
            ChildKind::Triangles => {
                let block = &self.triangles[index];
                let content = |lane: usize| {
                    let corners = block.corners(lane).map(Vec3::from_array);
                    let bounds = Aabb::around(corners);
                    LeafPrimitive { id: block.id(lane), bounds, corners: Some(corners) }
                };
                (0..BLOCK).map(content).filter(|c| c.id != NONE).collect()
            }
            ChildKind::Spheres => {
                let block = &self.spheres[index];
                let content = |lane: usize| {
                    let center = Vec3::from_array(block.center.map(|axis| axis[lane]));
                    let radius = Vec3::splat(block.radius[lane].abs());
                    let bounds = Aabb { min: center - radius, max: center + radius };
                    LeafPrimitive { id: block.id(lane), bounds, corners: None }
                };
                (0..BLOCK).map(content).filter(|c| c.id != NONE).collect()
            }
        }
    }
}

impl LeafPrimitive {
    fn validate(&self, leaves: &[Aabb]) -> Result<(), String> {
        match (leaves, self.corners) {
            ([leaf], _) if leaf.union(self.bounds) == *leaf => Ok(()),
            ([_], _) => Err(format!("primitive {} sticks out of its leaf", self.id)),
            (_, Some(corners)) if is_covered(corners, leaves) => Ok(()),
            (_, Some(_)) => Err(format!("a part of triangle {} is in no leaf", self.id)),
            _ => Err(format!("primitive {} is in {} leaves", self.id, leaves.len())),
        }
    }
}

/// True if points all over a triangle are each in a box.
fn is_covered(corners: [Vec3; 3], boxes: &[Aabb]) -> bool {
    let corners = corners.map(|corner| corner.as_dvec3());
    let boxes: Vec<_> = boxes.iter().map(|b| (b.min.as_dvec3(), b.max.as_dvec3())).collect();
    (0..=POINTS).all(|i| {
        (0..=POINTS - i).all(|j| {
            let (u, v) = (f64::from(i) / f64::from(POINTS), f64::from(j) / f64::from(POINTS));
            let point = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
            boxes.iter().any(|(min, max)| point.cmpge(*min).all() && point.cmple(*max).all())
        })
    })
}
