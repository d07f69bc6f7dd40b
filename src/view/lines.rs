//! Lines between points of the scene, as the image shows them.

use serde_json::Value;

use crate::integrator::RenderSetup;
use crate::math::{Vec3, Vector};
use crate::scene::{Projection, StereoPair};
use crate::world::StereoLayout;

/// The farthest from the bend of a line that a line may lie, in pixels.
const TOLERANCE: f32 = 0.2;
/// The farthest place that is drawn, in pixels: more than any image has.
pub(super) const FAR: f32 = 1e6;

/// A line in the image: its corners, by column and row.
pub type ImageLine = Vec<[f32; 2]>;

/// Draws lines as the eyes of a camera see them.
pub struct ImageLines<'a> {
    eyes: Vec<EyeImage<'a>>,
    size: [f32; 2],
}

impl<'a> ImageLines<'a> {
    /// Draws lines into the image of a setup, through the middle of its lens.
    pub fn new(setup: &'a RenderSetup) -> Self {
        let eyes = eyes(setup).into_iter();
        let is_straight = is_straight(setup);
        Self {
            eyes: eyes.map(|lens| EyeImage { setup, lens, is_straight }).collect(),
            size: setup.size.map(|side| side as f32),
        }
    }

    /// The parts of lines that may be within the image; none if they all lie outside.
    pub fn draw(&self, lines: impl IntoIterator<Item = [Vec3; 2], IntoIter: Clone>) -> Vec<ImageLine> {
        let (mut drawn, lines) = (Vec::new(), lines.into_iter());
        for eye in &self.eyes {
            for [a, b] in lines.clone() {
                let mut own = Vec::new();
                eye.draw(&eye.end(a), &eye.end(b), 0, &mut own);
                drawn.append(&mut own);
            }
        }
        drawn.retain(|line| line.windows(2).any(|ends| may_show(ends, self.size)));
        drawn
    }
}

/// Columns and rows of lines, to tenths of a pixel.
pub fn in_tenths(lines: &[ImageLine]) -> Value {
    let tenths = |place: f32| (f64::from(place) * 10.0).round() / 10.0;
    lines.iter().map(|line| line.as_flattened().iter().copied().map(tenths).collect::<Value>()).collect()
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

/// An end of a line, and its place in the image if the camera can see it.
struct LineEnd {
    point: Vec3,
    place: Option<[f32; 2]>,
}

/// The image that one eye sees, for lines.
struct EyeImage<'a> {
    setup: &'a RenderSetup,
    lens: (f32, f32),
    is_straight: bool,
}

impl EyeImage<'_> {
    /// The halvings of a line that is drawn in any case, and of one whose bend or visible part is searched for.
    fn halvings(&self) -> [u32; 2] {
        if self.is_straight { [0, 20] } else { [3, 10] }
    }

    fn end(&self, point: Vec3) -> LineEnd {
        let [x, y, z] = point.to_array();
        // Through the middle of the lens, whatever its opening.
        let view = self.setup.image().project(None, Vector::new(x, y, z), self.lens);
        let place = [view.column, view.row];
        let is_near = place.iter().all(|at| at.abs() <= FAR);
        LineEnd { point, place: (view.seen && is_near).then_some(place) }
    }

    /// Appends the visible parts of a line as lines.
    fn draw(&self, a: &LineEnd, b: &LineEnd, depth: u32, lines: &mut Vec<ImageLine>) {
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
