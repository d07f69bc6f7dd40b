//! The boxes of the tree at one level, as lines over the image.

use serde_json::{Value, json};

use super::lines::{ImageLine, ImageLines, in_tenths};
use super::viewer::Snapshot;
use crate::bvh::layout::shape::TreeBox;

/// The largest number of boxes sent, evenly spread over those that the image shows.
const MOST_BOXES: usize = 1_000;
/// The largest number of boxes that are projected, evenly spread over all.
const MOST_PROJECTED: usize = 1 << 14;
/// The largest number of boxes of the tree that are visited.
const MOST_VISITED: usize = 1 << 19;

/// Returns the boxes at a level of the tree, or at its last one if that is above.
pub fn boxes(shown: &Snapshot, level: usize) -> Value {
    let (lines, bvh) = (ImageLines::new(&shown.setup), &shown.setup.scene.bvh);
    let last = bvh.levels();
    let level = level.min(last);
    let mut count: usize = 0;
    let is_complete = bvh.visit_level(level, MOST_VISITED, &mut |_| count += 1);
    let (mut place, mut seen, every) = (0, Vec::new(), count.div_ceil(MOST_PROJECTED).max(1));
    bvh.visit_level(level, MOST_VISITED, &mut |tree_box| {
        if place % every == 0 {
            let edges = edges_of(&lines, &tree_box);
            seen.extend((!edges.is_empty()).then_some((tree_box.is_leaf, edges)));
        }
        place += 1;
    });
    let step = seen.len().div_ceil(MOST_BOXES).max(1);
    let drawn = seen.iter().step_by(step);
    json!({
        "generation": shown.generation,
        "level": level,
        "last": last,
        "count": count,
        "is_complete": is_complete,
        "is_limited": every > 1 || step > 1,
        "boxes": drawn.map(|(is_leaf, edges)| json!([u8::from(*is_leaf), in_tenths(edges)])).collect::<Vec<_>>(),
    })
}

/// The edges of a box in the image; none if they all lie outside.
fn edges_of(lines: &ImageLines, tree_box: &TreeBox) -> Vec<ImageLine> {
    let corners = (0..8usize).flat_map(|corner| (0..3).map(move |axis| (corner, axis)));
    let ends = corners.filter(|(corner, axis)| corner >> axis & 1 == 0).map(|(a, axis)| [a, a | 1 << axis]);
    lines.draw(ends.map(|ends| ends.map(|corner| tree_box.corners[corner])))
}

#[cfg(test)]
mod tests;
