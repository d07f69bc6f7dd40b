//! Boxes, with edges and corners that may be round.

use std::f64::consts::FRAC_PI_4;

use super::Fineness;
use super::builder::{MeshBuilder, ShapeVertex};
use crate::error::CompileError;
use crate::math::{DVec3, Vec3};
use crate::world::Mesh;

/// The normal of each face, and the directions to the right and down of its image.
const FACES: [[DVec3; 3]; 6] = [
    [DVec3::Z, DVec3::X, DVec3::NEG_Y],
    [DVec3::NEG_Z, DVec3::NEG_X, DVec3::NEG_Y],
    [DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y],
    [DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::Y, DVec3::X, DVec3::Z],
    [DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z],
];
/// The least number of chords in a circle that is chosen.
const FEWEST: f64 = 16.0;

/// A line across a face.
struct FaceLine {
    /// The side of the middle on which it is.
    side: f64,
    /// The tangent of the angle of the normal there.
    slope: f64,
    /// The distance along the surface from the first line.
    along: f64,
}

/// The lines across a face of a half width without its bevels, of a radius with that many chords on each side.
fn lines(half: f64, radius: f64, chords: usize) -> Vec<FaceLine> {
    let angle = |chord: usize| FRAC_PI_4 * chord as f64 / chords as f64;
    // The neighbouring face has the same line: its slope is exactly 1.
    let slope = |chord: usize| if chord == chords { 1.0 } else { libm::tan(angle(chord)) };
    let end = 2.0 * half + 2.0 * radius * FRAC_PI_4;
    let line = |chord: usize, side: f64| {
        let from_end = radius * (FRAC_PI_4 - angle(chord));
        let along = if side < 0.0 { from_end } else { end - from_end };
        FaceLine { side, slope: slope(chord), along }
    };
    if radius == 0.0 {
        return [-1.0, 1.0].map(|side| FaceLine { side, slope: 0.0, along: half + half * side }).into();
    }
    (0..=chords)
        .rev()
        .map(|chord| line(chord, -1.0))
        .chain((0..=chords).map(|chord| line(chord, 1.0)))
        .collect()
}

/// A box of a size whose edges and corners have a radius.
pub(super) fn mesh(
    size: Vec3,
    bevel: f32,
    segments: Option<u32>,
    fineness: Fineness,
) -> Result<Mesh, CompileError> {
    let radius = f64::from(bevel);
    let core = 0.5 * size.as_dvec3() - radius;
    // A quarter of a circle lies half on each of two faces.
    let chords = if radius > 0.0 { fineness.segments(radius, segments, FEWEST).div_ceil(8) } else { 1 };
    let side = 2 * (chords + 1);
    let mut builder = MeshBuilder::with_room(6 * side * side, 12 * side * side)?;
    for [normal, right, down] in FACES {
        let across = |axis: DVec3| lines(core.dot(axis.abs()), radius, chords);
        let (columns, rows) = (across(right), across(down));
        let first = builder.len();
        let end = |lines: &[FaceLine]| lines.last().map_or(1.0, |line| line.along);
        for row in &rows {
            for column in &columns {
                let ways = normal + right * column.side + down * row.side;
                let turned = normal + right * (column.side * column.slope) + down * (row.side * row.slope);
                let normal = turned.normalize();
                let uv = [column.along / end(&columns), row.along / end(&rows)];
                builder.vertex(ShapeVertex { position: core * ways + radius * normal, normal, uv });
            }
        }
        builder.lattice(first, rows.len(), columns.len());
    }
    Ok(builder.finish())
}
