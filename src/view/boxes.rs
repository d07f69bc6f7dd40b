//! The boxes of the tree at one level, as lines over the image.

use serde_json::{Value, json};

use super::viewer::Snapshot;
use crate::bvh::layout::shape::TreeBox;
use crate::integrator::RenderSetup;
use crate::math::{Vec3, Vector};
use crate::scene::{Projection, StereoPair};
use crate::world::StereoLayout;

/// The largest number of boxes sent: the first ones of the tree that the image shows.
const MOST_BOXES: usize = 1_000;
/// The largest number of boxes that are projected: of many, the image may show none.
const MOST_PROJECTED: usize = 1 << 14;
/// The largest number of boxes of the tree that are visited.
const MOST_VISITED: usize = 1 << 19;
/// The farthest from the bend of an edge that a line may lie, in pixels.
const TOLERANCE: f32 = 0.2;
/// The farthest place that is drawn, in pixels: more than any image has.
const FAR: f32 = 1e6;

/// A line in the image: its corners, by column and row.
type ImageLine = Vec<[f32; 2]>;

/// Returns the boxes at a level of the tree, or at its last one if that is above.
pub fn boxes(shown: &Snapshot, level: usize) -> Value {
    let (setup, bvh) = (&*shown.setup, &shown.setup.scene.bvh);
    let last = bvh.levels();
    let level = level.min(last);
    let (mut count, mut drawn, mut is_limited) = (0, Vec::new(), false);
    let is_complete = bvh.visit_level(level, MOST_VISITED, &mut |tree_box| {
        count += 1;
        is_limited = drawn.len() == MOST_BOXES || count > MOST_PROJECTED;
        if !is_limited {
            let lines = lines(setup, &tree_box);
            drawn.extend((!lines.is_empty()).then(|| json!([u8::from(tree_box.is_leaf), in_tenths(&lines)])));
        }
    });
    json!({
        "generation": shown.generation,
        "level": level,
        "last": last,
        "count": count,
        "is_complete": is_complete,
        "is_limited": is_limited,
        "boxes": drawn,
    })
}

fn in_tenths(lines: &[ImageLine]) -> Value {
    let tenths = |place: f32| (f64::from(place) * 10.0).round() / 10.0;
    lines.iter().map(|line| line.as_flattened().iter().copied().map(tenths).collect::<Value>()).collect()
}

/// The edges of a box in the image; none if they all lie outside.
fn lines(setup: &RenderSetup, tree_box: &TreeBox) -> Vec<ImageLine> {
    let mut lines = Vec::new();
    for lens in eyes(setup) {
        let edges = Edges { setup, lens, is_straight: is_straight(setup) };
        for corner in 0..8usize {
            for axis in (0..3).filter(|axis| corner >> axis & 1 == 0) {
                let [a, b] = [corner, corner | 1 << axis].map(|corner| edges.end(tree_box.corners[corner]));
                let mut own = Vec::new();
                edges.draw(&a, &b, 0, &mut own);
                lines.append(&mut own);
            }
        }
    }
    let size = setup.size.map(|side| side as f32);
    lines.retain(|line| line.windows(2).any(|ends| may_show(ends, size)));
    lines
}

/// The points of the lens through which points are projected: its middle, for each eye of a stereo pair.
fn eyes(setup: &RenderSetup) -> Vec<(f32, f32)> {
    match setup.scene.camera.stereo {
        Some(StereoPair { layout: StereoLayout::SideBySide | StereoLayout::OverUnder, .. }) => {
            vec![(0.25, 0.5), (0.75, 0.5)]
        }
        _ => vec![(0.5, 0.5)],
    }
}

/// True if the image shows straight lines as straight lines.
fn is_straight(setup: &RenderSetup) -> bool {
    let camera = &setup.scene.camera;
    let is_curved = matches!(camera.projection, Projection::Panorama { .. } | Projection::Fisheye { .. });
    // An eye's image ends where that of the other begins.
    !is_curved && camera.stereo.is_none()
}

/// True if a straight line may cross the image.
fn may_show(ends: &[[f32; 2]], size: [f32; 2]) -> bool {
    (0..2).all(|axis| {
        let places = ends.iter().map(|end| end[axis]);
        let (least, most) = places.fold((f32::INFINITY, -f32::INFINITY), |(a, b), at| (a.min(at), b.max(at)));
        most >= 0.0 && least <= size[axis]
    })
}

/// An end of an edge, and its place in the image if the camera can see it.
struct EdgeEnd {
    point: Vec3,
    place: Option<[f32; 2]>,
}

/// Draws edges as one eye sees them.
struct Edges<'a> {
    setup: &'a RenderSetup,
    lens: (f32, f32),
    is_straight: bool,
}

impl Edges<'_> {
    /// The halvings of an edge that is drawn in any case, and of one whose bend or visible part is searched for.
    fn halvings(&self) -> [u32; 2] {
        if self.is_straight { [0, 20] } else { [3, 10] }
    }

    fn end(&self, point: Vec3) -> EdgeEnd {
        let [x, y, z] = point.to_array();
        // Through the middle of the lens, whatever its opening.
        let view = self.setup.image().project(None, Vector::new(x, y, z), self.lens);
        let place = [view.column, view.row];
        let is_near = place.iter().all(|at| at.abs() <= FAR);
        EdgeEnd { point, place: (view.seen && is_near).then_some(place) }
    }

    /// Appends the visible parts of an edge as lines.
    fn draw(&self, a: &EdgeEnd, b: &EdgeEnd, depth: u32, lines: &mut Vec<ImageLine>) {
        let [least, most] = self.halvings();
        let is_one_line = match (a.place, b.place) {
            (None, None) if depth >= least => return,
            (Some(_), Some(_)) if self.is_straight => true,
            _ => false,
        };
        let middle = self.end((a.point + b.point) * 0.5);
        if let (Some(from), Some(to)) = (a.place, b.place)
            && (is_one_line || (depth >= least && self.is_bend_small(from, to, middle.place)))
        {
            match lines.last_mut().filter(|line| line.last() == Some(&from)) {
                // The parts of a straight line are one.
                Some(line) if self.is_straight => line[1] = to,
                Some(line) => line.push(to),
                None => lines.push(vec![from, to]),
            }
        } else if depth < most {
            self.draw(a, &middle, depth + 1, lines);
            self.draw(&middle, b, depth + 1, lines);
        }
    }

    /// True if a line between two places shows what lies between them.
    fn is_bend_small(&self, a: [f32; 2], b: [f32; 2], middle: Option<[f32; 2]>) -> bool {
        middle.is_some_and(|middle| {
            (0..2).all(|axis| (0.5 * (a[axis] + b[axis]) - middle[axis]).abs() <= TOLERANCE)
        })
    }
}

#[cfg(test)]
mod tests;
