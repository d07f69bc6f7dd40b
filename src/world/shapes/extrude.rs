//! Flat outlines with a thickness: prisms, and letters.

use super::builder::{MeshBuilder, ShapeVertex};
use super::curves::CurvePoint;
use crate::error::CompileError;
use crate::math::{DVec2, DVec3, Vec3};
use crate::world::Mesh;
use crate::world::triangulate::Triangulator;

/// The largest factor by which a mitre is longer than its bevel.
const LONGEST_MITRE: f64 = 4.0;

/// Closed outlines in one plane, each in smooth parts: those around an area run counter-clockwise, those around its holes
/// clockwise.
pub(super) struct Area {
    /// The outline of each area, followed by those of its holes.
    pub regions: Vec<Vec<Vec<Vec<CurvePoint>>>>,
}

/// A line of the section through the side, from the front to the back.
#[derive(Clone, Copy)]
pub(super) struct SectionLine {
    /// The distance from the outline, outwards.
    pub out: f64,
    /// The place along the thickness.
    pub depth: f64,
    /// The normal's parts outwards and to the front.
    pub normal: DVec2,
    pub v: f64,
}

/// The axes into which an outline is placed: those of its plane, and that of its thickness.
pub(super) type Axes = [DVec3; 3];

/// Points of one contour, without repeating the first one.
pub(super) fn contour(parts: &[Vec<CurvePoint>]) -> impl Iterator<Item = DVec2> {
    parts.iter().flat_map(|part| &part[..part.len().saturating_sub(1)]).map(|point| point.at.truncate())
}

/// Twice the area within a contour, positive if it runs counter-clockwise.
pub(super) fn twice_area(points: impl Iterator<Item = DVec2> + Clone) -> f64 {
    let Some(first) = points.clone().next() else { return 0.0 };
    let next = points.clone().skip(1).chain([first]);
    points.zip(next).map(|(a, b)| (a - first).perp_dot(b - first)).sum()
}

/// Splits a contour with holes into triangles of indices into the contours' points, one after the other; none if they
/// cross each other or themselves, or are too many.
pub(super) fn triangles(contours: &[Vec<DVec2>]) -> Option<Vec<[u32; 3]>> {
    let positions: Vec<Vec3> = contours.iter().flatten().map(|point| point.extend(0.0).as_vec3()).collect();
    let triangles = split(contours)?;
    // Crossing contours leave triangles that overlap or are turned around.
    let area = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| positions[corner as usize].truncate().as_dvec2());
        (b - a).perp_dot(c - a)
    };
    let whole: f64 = contours.iter().map(|contour| twice_area(contour.iter().copied())).sum();
    let covered: f64 = triangles.iter().map(|triangle| area(*triangle).abs()).sum();
    (whole > 0.0 && (covered - whole).abs() <= 1e-5 * whole).then_some(triangles)
}

/// Splits a contour with holes as [`triangles`] does, whether they cross or not.
fn split(contours: &[Vec<DVec2>]) -> Option<Vec<[u32; 3]>> {
    let points: Vec<DVec2> = contours.concat();
    let positions: Vec<Vec3> = points.iter().map(|point| point.extend(0.0).as_vec3()).collect();
    let ring = joined(contours, &points)?;
    let mut triangles = Vec::with_capacity(ring.len());
    let add = |triangle: [usize; 3]| triangles.push(triangle.map(|corner| ring[corner]));
    Triangulator::default().split(&positions, &ring, add).ok()?;
    Some(triangles)
}

/// One ring of a contour and its holes, with a bridge to each hole from the right-most one on (Eberly, "Triangulation by
/// Ear Clipping"); none if a hole is not within the contour.
fn joined(contours: &[Vec<DVec2>], points: &[DVec2]) -> Option<Vec<u32>> {
    let mut first = 0;
    let mut rings = contours.iter().map(|contour| {
        first += contour.len() as u32;
        (first - contour.len() as u32..first).collect::<Vec<u32>>()
    });
    let mut ring = rings.next()?;
    let at = |vertex: u32| points[vertex as usize];
    let right_most = |hole: &Vec<u32>| {
        let places = 0..hole.len();
        places.max_by(|a, b| at(hole[*a]).x.total_cmp(&at(hole[*b]).x)).unwrap_or(0)
    };
    let mut holes: Vec<Vec<u32>> = rings.filter(|hole| !hole.is_empty()).collect();
    holes.sort_by(|a, b| at(b[right_most(b)]).x.total_cmp(&at(a[right_most(a)]).x));
    for mut hole in holes {
        let place = right_most(&hole);
        hole.rotate_left(place);
        let from = at(hole[0]);
        // The nearest edge to the right that goes up, and its end on the right.
        let (mut nearest, mut bridge) = (f64::INFINITY, None);
        for (index, vertex) in ring.iter().enumerate() {
            let next = (index + 1) % ring.len();
            let (a, b) = (at(*vertex), at(ring[next]));
            if !(a.y <= from.y && from.y <= b.y && a.y < b.y) {
                continue;
            }
            let x = a.x + (from.y - a.y) / (b.y - a.y) * (b.x - a.x);
            if x >= from.x && x < nearest {
                nearest = x;
                bridge = Some(if a.x > b.x { index } else { next });
            }
        }
        let mut bridge = bridge?;
        // A corner in the triangle between the hole, the edge and its end hides the end.
        let (end, edge) = (at(ring[bridge]), DVec2::new(nearest, from.y));
        let side = (edge - from).perp_dot(end - from);
        let inside = |p: DVec2| {
            let turn = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a) * side.signum();
            p != end
                && p.x >= from.x
                && turn(from, edge) >= 0.0
                && turn(edge, end) >= 0.0
                && turn(end, from) >= 0.0
        };
        if side != 0.0 {
            let steep = |p: DVec2| ((p.y - from.y).abs() / (p.x - from.x).max(1e-300), p.x - from.x);
            let mut least = (f64::INFINITY, f64::INFINITY);
            for (index, vertex) in ring.iter().enumerate() {
                let p = at(*vertex);
                if inside(p) && steep(p) < least {
                    (least, bridge) = (steep(p), index);
                }
            }
        }
        let tail = ring.split_off(bridge + 1);
        let back = ring[bridge];
        ring.extend(hole.iter().chain([&hole[0], &back]));
        ring.extend(tail);
    }
    Some(ring)
}

/// Gives an area a thickness. Its front faces along the third axis.
pub(super) fn extrude(area: &Area, section: &[SectionLine], axes: Axes) -> Result<Mesh, CompileError> {
    let contours = || area.regions.iter().flatten();
    let points: usize = contours().flatten().map(Vec::len).sum();
    let mut builder = MeshBuilder::with_room(points * (section.len() + 2), 2 * points * (section.len() + 2))?;
    let place = |at: DVec2, depth: f64| axes[0] * at.x + axes[1] * at.y + axes[2] * depth;
    let flat = || contours().flat_map(|parts| contour(parts));
    let low = flat().fold(DVec2::INFINITY, DVec2::min);
    let size = flat().fold(DVec2::NEG_INFINITY, DVec2::max) - low;
    let ends = [section.first(), section.last()].map(|line| line.map_or(0.0, |line| line.depth));
    for region in &area.regions {
        let contours: Vec<Vec<DVec2>> = region.iter().map(|parts| contour(parts).collect()).collect();
        // Fonts may have outlines that cross; each for itself can still be filled.
        let Some(triangles) = triangles(&contours).or_else(|| split(&contours)) else { continue };
        for (depth, side) in ends.into_iter().zip([1.0, -1.0]) {
            let first = builder.len();
            for at in contours.iter().flatten() {
                let part = (*at - low) / size;
                // Front and back are both upright from where they are seen: the back is tilted over its upper edge.
                let uv = [part.x, if side > 0.0 { 1.0 - part.y } else { part.y }];
                builder.vertex(ShapeVertex { position: place(*at, depth), normal: axes[2] * side, uv });
            }
            for [a, b, c] in &triangles {
                let [a, b, c] = [a, b, c].map(|corner| first + corner);
                builder.triangle(if side > 0.0 { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    for parts in contours() {
        wall(&mut builder, parts, section, &place);
    }
    Ok(builder.finish())
}

/// The side along one contour.
fn wall(
    builder: &mut MeshBuilder,
    parts: &[Vec<CurvePoint>],
    section: &[SectionLine],
    place: &impl Fn(DVec2, f64) -> DVec3,
) {
    let outward = |point: &CurvePoint| DVec2::new(point.tangent.y, -point.tangent.x);
    let length = parts.last().and_then(|part| part.last()).map_or(1.0, |point| point.along);
    for (number, part) in parts.iter().enumerate() {
        let before = parts[(number + parts.len() - 1) % parts.len()].last();
        let after = parts[(number + 1) % parts.len()].first();
        // Parts that meet in an edge are both bevelled along the mitre between them.
        let mitre = |own: DVec2, other: Option<&CurvePoint>| {
            let sum = own + other.map_or(own, outward);
            let along = 2.0 * sum / sum.length_squared().max(1e-12);
            along.clamp_length_max(LONGEST_MITRE)
        };
        let last = part.len().saturating_sub(1);
        let first = builder.len();
        for line in section {
            for (index, point) in part.iter().enumerate() {
                let normal = outward(point);
                let out = match index {
                    0 => mitre(normal, before),
                    _ if index == last => mitre(normal, after),
                    _ => normal,
                };
                let at = point.at.truncate() + line.out * out;
                // The third axis is that of the front.
                let normal = place(line.normal.x * normal, line.normal.y);
                builder.vertex(ShapeVertex {
                    position: place(at, line.depth),
                    normal,
                    uv: [point.along / length, line.v],
                });
            }
        }
        builder.lattice(first, section.len(), part.len());
    }
}
